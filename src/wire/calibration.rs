//! A calibration, out and in again.

use serde::{Deserialize, Serialize};

use super::{Document, Error};
use crate::{
    calibrate::{
        self, BoardSurface, Candidate, Chosen, DistortionTest, Estimate, KnownCamera,
        LeftOutPicture, Model, Outlier, ProjectionUncertainty, RejectedFrame, RollingShutter,
        SurfaceCandidate,
    },
    camera::{self, Brown, Camera, Intrinsics, RadialTable, TablePair},
    detect::Corner,
    geom::Pixel,
    pose,
    recording::Factory,
};

/// What `truedepth calibrate --json` prints. `audit --calibration FILE` reads its part [`Known`].
#[derive(Clone, Debug, Serialize)]
pub struct Calibration<'a> {
    /// Name of the recording.
    recording: &'a str,
    /// `paper`, `auto`, `model` where the model was asked for, or `plain` where that was fitted as OpenCV does.
    method: &'a str,
    model: Model,
    /// The mean of both focal lengths.
    focal_px: Estimate,
    /// (own − factory) / factory.
    focal_difference_percent: Option<f64>,
    #[serde(flatten)]
    known: Known,
    rms_px: f64,
    n_views: usize,
    n_pictures: usize,
    n_corners: usize,
    /// All models tried, with what they leave unexplained.
    candidates: &'a [Candidate],
    distortion_test: Option<&'a DistortionTest>,
    views: Vec<View<'a>>,
    outliers: &'a [Outlier],
    rejected: &'a [RejectedFrame],
    chosen: Option<Chosen>,
    /// The shapes of the board that were tried.
    surfaces: &'a [SurfaceCandidate],
    board_surface: Option<Surface<'a>>,
    /// The focal length (mean of both) without each picture.
    left_out: Vec<LeftOutPicture>,
    rolling_shutter: Option<RollingShutter>,
    projection_uncertainty: Option<ProjectionUncertainty>,
}

/// What is read back of a calibration: a camera, and what is known of its errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// Horizontal and vertical focal length.
    pub focal_xy_px: [f64; 2],
    /// The centre of projection in the image; integers are pixel centres.
    pub principal_point_px: [f64; 2],
    /// Columns and rows of the image that these numbers are for.
    pub image_size_px: [usize; 2],
    /// How the lens bends straight lines.
    pub distortion: Distortion,
    /// What the factory says; `null` where the recording does not tell.
    pub factory_focal_px: Option<f64>,
    /// Free parameters, in the order of `covariance`.
    pub parameters: Vec<Parameter>,
    /// Of `parameters`, row by row, poses marginalised.
    pub covariance: Vec<Vec<Option<f64>>>,
    /// Focal lengths of two disjoint halves of the views, where there are enough.
    pub split_half_focal_px: Option<[Number; 2]>,
}

/// A value, and its standard deviation where there is one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Number {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: Option<f64>,
}

/// A free parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// `focal_px`, `center_x_px`, `k1` ...
    pub name: String,
    /// Its value.
    #[serde(flatten)]
    pub number: Number,
}

/// A view of the board: x_camera = R · x_board + t.
#[derive(Clone, Debug, Serialize)]
pub(super) struct View<'a> {
    frame: usize,
    n_corners: usize,
    rms_px: f64,
    /// Axis times angle of R.
    rotation_vector_rad: [f64; 3],
    translation_m: [f64; 3],
    /// Only in detail.
    #[serde(skip_serializing_if = "Option::is_none")]
    corners: Option<&'a [Corner]>,
    /// Observed minus projected, of each corner.
    #[serde(skip_serializing_if = "Option::is_none")]
    residuals_px: Option<&'a [[f64; 2]]>,
}

/// How much is said of every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// A few numbers.
    Summary,
    /// Corners, residuals and poses, too.
    Frames,
}

impl<'a> View<'a> {
    pub(super) fn new(view: &'a pose::View, detail: Detail) -> Self {
        let in_detail = detail == Detail::Frames;
        Self {
            frame: view.frame,
            n_corners: view.corners.len(),
            rms_px: view.rms_px,
            rotation_vector_rad: view.color_from_board.rotation.scaled_axis().into(),
            translation_m: view.color_from_board.translation.into(),
            corners: in_detail.then_some(&view.corners),
            residuals_px: in_detail.then_some(&view.residuals_px),
        }
    }
}

/// The board's shape, and its size.
#[derive(Clone, Debug, Serialize)]
struct Surface<'a> {
    peak_to_valley_m: Estimate,
    #[serde(flatten)]
    surface: &'a BoardSurface,
}

/// How the lens bends straight lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Distortion {
    /// Not at all.
    None,
    /// Brown-Conrady, OpenCV's five coefficients.
    Brown {
        /// r².
        k1: f64,
        /// r⁴.
        k2: f64,
        /// Tangential.
        p1: f64,
        /// Tangential.
        p2: f64,
        /// r⁶.
        k3: f64,
    },
    /// Apple's radial tables.
    Table {
        /// Rectilinear to distorted, `lensDistortionLookupTable`.
        forward: Table,
        /// Distorted to rectilinear, `inverseLensDistortionLookupTable`.
        inverse: Table,
    },
}

/// One radial table: p' = c + (1 + m(|p − c|))·(p − c).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// c.
    pub center_px: [f64; 2],
    /// Radius of the last sample.
    pub max_radius_px: f64,
    /// m at evenly spaced radii from 0.
    pub magnification: Vec<f64>,
}

impl Document for Calibration<'_> {
    const SCHEMA: &'static str = "truedepth.calibrate/1";
}

impl<'a> Calibration<'a> {
    /// What was calibrated from `recording` by `method`, beside what the factory says.
    pub fn new(
        recording: &'a str,
        method: &'a str,
        factory: Option<&Factory>,
        calibration: &'a calibrate::Calibration,
        detail: Detail,
    ) -> Self {
        let intrinsics = &calibration.camera.intrinsics;
        let focal_px = intrinsics.focal_px();
        // The fit's own number is the horizontal one.
        let mean = focal_px / intrinsics.fx;
        let sigma = calibration.parameter("focal_px").map_or(f64::NAN, |f| mean * f.sigma);
        let known = Known::new(factory, calibration);
        let difference = |factory: f64| 100.0 * (focal_px / factory - 1.0);
        let without = |l: &LeftOutPicture| LeftOutPicture {
            frames: l.frames.clone(),
            focal_px: mean * l.focal_px,
        };
        Self {
            recording,
            method,
            model: calibration.model,
            focal_px: Estimate { value: focal_px, sigma },
            focal_difference_percent: known.factory_focal_px.map(difference),
            known,
            rms_px: calibration.rms_px,
            n_views: calibration.views.len(),
            n_pictures: calibration.n_pictures,
            n_corners: calibration.n_corners(),
            candidates: &calibration.candidates,
            distortion_test: calibration.distortion.as_ref(),
            views: calibration.views.iter().map(|view| View::new(view, detail)).collect(),
            outliers: &calibration.outliers,
            rejected: &calibration.rejected,
            chosen: calibration.chosen,
            surfaces: &calibration.surfaces,
            board_surface: calibration
                .surface
                .as_ref()
                .map(|surface| Surface { peak_to_valley_m: surface.size_m(), surface }),
            left_out: calibration.left_out.iter().map(without).collect(),
            rolling_shutter: calibration.rolling_shutter,
            projection_uncertainty: calibration
                .median_distance_m()
                .and_then(|depth_m| calibration.projection_uncertainty(17, 13, depth_m)),
        }
    }
}

impl Known {
    /// What a calibration knows.
    pub fn new(factory: Option<&Factory>, calibration: &calibrate::Calibration) -> Self {
        let k = &calibration.camera.intrinsics;
        let mean = k.focal_px() / k.fx;
        let number = |Estimate { value, sigma }: Estimate| Number { value, sigma: Some(sigma) };
        let n = calibration.parameters.len();
        Self {
            focal_xy_px: [k.fx, k.fy],
            principal_point_px: [k.cx, k.cy],
            image_size_px: [k.width, k.height],
            distortion: Distortion::from(&calibration.camera.distortion),
            factory_focal_px: factory.map(|f| f.intrinsics.focal_px()),
            parameters: calibration
                .parameters
                .iter()
                .map(|p| Parameter { name: p.name.to_owned(), number: number(p.estimate) })
                .collect(),
            covariance: calibration
                .covariance
                .chunks(n.max(1))
                .map(|row| row.iter().copied().map(Some).collect())
                .collect(),
            split_half_focal_px: calibration.split_half_focal_px.map(|halves| {
                halves.map(|half| {
                    number(Estimate { value: mean * half.value, sigma: mean * half.sigma })
                })
            }),
        }
    }

    /// The camera, as `audit --calibration` takes it.
    ///
    /// Refused: focal lengths or a size that are not positive, a principal point that is not finite, tables that no
    /// lens has.
    pub fn camera(&self) -> Result<Camera, Error> {
        let [fx, fy] = self.focal_xy_px;
        let [cx, cy] = self.principal_point_px;
        let [width, height] = self.image_size_px;
        let positive = |value: f64| value.is_finite() && value > 0.0;
        if !(positive(fx)
            && positive(fy)
            && cx.is_finite()
            && cy.is_finite()
            && width > 0
            && height > 0)
        {
            return Err(Error::Camera(format!(
                "focal lengths {fx} and {fy} px, principal point ({cx}, {cy}), image of {width}x{height}"
            )));
        }
        let intrinsics = Intrinsics { fx, fy, cx, cy, width, height };
        let distortion = camera::Distortion::try_from(&self.distortion)?;
        Ok(Camera { intrinsics, distortion })
    }

    /// The camera with what this calibration knows of its errors.
    ///
    /// Refused: as [`camera`](Self::camera), numbers that no model has or without a σ, and a covariance that is not one
    /// of these numbers.
    pub fn known(&self) -> Result<KnownCamera, Error> {
        let camera = self.camera()?;
        let refused = |what: String| Err(Error::Camera(what));
        let mut parameters = Vec::new();
        for parameter in &self.parameters {
            let name = &parameter.name;
            let Some(known) = calibrate::Parameter::known_name(name) else {
                return refused(format!("a number {name}, which no camera model has"));
            };
            let Some(sigma) = parameter.number.sigma.filter(|sigma| *sigma > 0.0) else {
                return refused(format!(
                    "{name} without a σ above 0: its views did not determine it"
                ));
            };
            let estimate = Estimate { value: parameter.number.value, sigma };
            parameters.push(calibrate::Parameter { name: known, estimate });
        }
        let Some(covariance) = self.covariance_of(&parameters) else {
            let n = parameters.len();
            return refused(format!("a covariance that is not one of its {n} parameters"));
        };
        Ok(KnownCamera {
            camera,
            parameters,
            covariance,
            split_half_focal_px: self
                .split_half_focal_px
                .map(|halves| halves.map(|half| half.value)),
            factory_focal_px: self.factory_focal_px,
        })
    }

    /// Row-major; `None` where it is no covariance, or another one.
    fn covariance_of(&self, parameters: &[calibrate::Parameter]) -> Option<Vec<f64>> {
        /// Numbers are written with nine digits.
        const ROUNDING: f64 = 1e-6;
        let n = parameters.len();
        if self.covariance.len() != n || self.covariance.iter().any(|row| row.len() != n) {
            return None;
        }
        let covariance: Vec<f64> =
            self.covariance.iter().flatten().copied().collect::<Option<_>>()?;
        let sigma = |i: usize| parameters[i].estimate.sigma;
        let correlation: Vec<f64> =
            (0..n * n).map(|at| covariance[at] / (sigma(at / n) * sigma(at % n))).collect();
        let is_one = (0..n).all(|i| {
            (correlation[i * n + i] - 1.0).abs() < ROUNDING
                && (0..i).all(|j| {
                    (correlation[i * n + j] - correlation[j * n + i]).abs() < ROUNDING
                        && correlation[i * n + j].abs() < 1.0 + ROUNDING
                })
        });
        is_one.then_some(covariance)
    }
}

impl From<&camera::Distortion> for Distortion {
    fn from(distortion: &camera::Distortion) -> Self {
        match distortion {
            camera::Distortion::None => Self::None,
            camera::Distortion::Brown(Brown { k1, k2, p1, p2, k3 }) => {
                Self::Brown { k1: *k1, k2: *k2, p1: *p1, p2: *p2, k3: *k3 }
            }
            camera::Distortion::Table(TablePair { forward, inverse }) => {
                Self::Table { forward: Table::from(forward), inverse: Table::from(inverse) }
            }
        }
    }
}

impl From<&RadialTable> for Table {
    fn from(table: &RadialTable) -> Self {
        Self {
            center_px: [table.center.x, table.center.y],
            max_radius_px: table.max_radius_px,
            magnification: table.magnification.clone(),
        }
    }
}

impl TryFrom<&Distortion> for camera::Distortion {
    type Error = Error;

    fn try_from(distortion: &Distortion) -> Result<Self, Error> {
        let table = |table: &Table| {
            let [x, y] = table.center_px;
            RadialTable::new(Pixel::new(x, y), table.max_radius_px, table.magnification.clone())
                .map_err(|error| Error::Camera(error.to_string()))
        };
        Ok(match distortion {
            Distortion::None => Self::None,
            &Distortion::Brown { k1, k2, p1, p2, k3 } => Self::Brown(Brown { k1, k2, p1, p2, k3 }),
            Distortion::Table { forward, inverse } => {
                Self::Table(TablePair { forward: table(forward)?, inverse: table(inverse)? })
            }
        })
    }
}
