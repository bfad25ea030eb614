//! Intrinsics from many views, with uncertainties. (skeleton: types only)

use crate::{camera::Camera, pose::View};

/// Which parameters are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Model {
    /// One focal length; principal point as the factory says, no distortion.
    Focal,
    /// As `Focal`, corners first taken through Apple's inverse table.
    FocalTable,
    /// One focal length and the principal point.
    FocalCentre,
    /// As `FocalCentre`, corners first taken through Apple's inverse table.
    FocalTableCentre,
    /// One focal length, principal point, k1 k2 p1 p2 k3.
    Brown,
}

/// The result of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The model that was chosen or asked for.
    pub model: Model,
    /// The camera: intrinsics and distortion as estimated.
    pub camera: Camera,
    /// Free intrinsic parameters by name, value and sigma, in the order of `covariance`'s rows.
    pub parameters: Vec<Parameter>,
    /// Covariance of `parameters` (row-major), poses marginalised.
    pub covariance: Vec<f64>,
    /// Views used.
    pub views: Vec<View>,
    /// RMS over all corners of all views, 2-D distance as OpenCV, pixels.
    pub rms_px: f64,
    /// All models tried, with held-out errors (method auto), for the report.
    pub candidates: Vec<Candidate>,
    /// Focal length of two disjoint halves of the views, px, where there are enough.
    pub split_half_focal_px: Option<[Estimate; 2]>,
    /// Corners left out by the robust loss: (frame, corner id, residual px).
    pub outliers: Vec<Outlier>,
}

/// A number and how sure we are of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// One free parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// `focal_px`, `center_x_px`, `center_y_px`, `k1`, ...
    pub name: &'static str,
    /// Value and standard deviation.
    pub estimate: Estimate,
}

/// One model tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Which.
    pub model: Model,
    /// Fit to the data it was fitted to, pixels.
    pub rms_px: f64,
    /// RMS on corners that were held out, pixels.
    pub held_out_rms_px: f64,
    /// Its focal length.
    pub focal_px: Estimate,
}

/// A corner that disagrees with all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// Frame index.
    pub frame: usize,
    /// Corner id.
    pub id: usize,
    /// Distance to its prediction, pixels.
    pub residual_px: f64,
}
