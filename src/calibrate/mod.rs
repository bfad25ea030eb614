//! Intrinsics from many views, with uncertainties.
//!
//! [`calibrate`] takes the corners of many frames ([`Input`]) to a [`Calibration`]: a camera, the views it was found
//! from, and a covariance. [`Method`] says how: exactly as the paper, or by the best of several [`Model`]s, chosen by
//! how well views are predicted that took no part. Beside it stands a [`DistortionTest`]: how much of the lens'
//! distortion is still in the stream, from the pixels alone.
//!
//! Every σ is the larger of two: the classical one (independent corner noise, its size taken from the residuals) and
//! one that lets residuals of the same picture be correlated in any way, as those of a board that is not quite flat
//! are ([`Pooled::clustered`](crate::solve::Pooled::clustered)). What is wrong the same way in *every* picture neither
//! of them sees; the shape of the board is that, and is therefore estimated with the camera ([`BoardSurface`]) where
//! held-out pictures ask for it.
//!
//! ```
//! use truedepth::board::CharucoBoard;
//! use truedepth::calibrate::{FrameCorners, Input, Method, calibrate};
//! use truedepth::camera::{Camera, Distortion, Intrinsics};
//! use truedepth::detect::Corner;
//! use truedepth::geom::{Board, Color, Pose, Rotation, Vector3};
//!
//! let board: CharucoBoard = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse()?;
//! let truth = Intrinsics { fx: 530.0, fy: 530.0, cx: 320.6, cy: 241.2, width: 640, height: 480 };
//! let camera = Camera { intrinsics: truth, distortion: Distortion::None };
//! let frames: Vec<FrameCorners> = (0..8)
//!     .map(|i| {
//!         let azimuth = f64::from(i) * 0.8;
//!         let turn = Rotation::from_scaled_axis(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * 0.6);
//!         let centre = Vector3::new(0.104, 0.0835, 0.0);
//!         let middle = Vector3::new(0.0, 0.0, 0.25 + 0.03 * f64::from(i)); // eight different pictures
//!         let pose: Pose<Color, Board> = Pose::new(turn, middle - turn * centre);
//!         let see = |id| Some(Corner { id, pixel: camera.project(pose * board.corner(id))?, sigma_px: 0.05 });
//!         FrameCorners { frame: i as usize, corners: (0..board.n_corners()).filter_map(see).collect() }
//!     })
//!     .collect();
//! let factory = Intrinsics { fx: 565.1, fy: 565.1, ..truth };
//! let input = Input { board: &board, factory: &factory, tables: None, frames: &frames };
//! let found = calibrate(&input, Method::Auto)?;
//! assert!((found.camera.intrinsics.fx - 530.0).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here: images, files, verdicts.

mod model;

mod surface;

mod problem;

mod fit;

mod motion;

mod select;

mod views;

mod weigh;

mod auto;

mod distortion;

mod job;

mod coverage;

mod guess;

#[cfg(test)]
mod golden;

#[cfg(test)]
mod synthetic;

#[cfg(test)]
mod tests;

pub use coverage::{Coverage, Tilt, coverage};
pub use guess::guess_intrinsics;
pub use job::{MAX_VIEWS, calibrate, calibrate_from, distortion_test};
pub use model::Model;
pub(crate) use model::moved;
pub use motion::{MeanMotion, ProjectionUncertainty};
pub(crate) use surface::alike;
pub(crate) use views::pictures_of;

use std::fmt;

use crate::{
    board::CharucoBoard,
    camera::{Camera, Intrinsics, TablePair},
    detect::Corner,
    geom::{Board, Point},
    math,
    pose::View,
};

/// What a calibration starts from.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// The board.
    pub board: &'a CharucoBoard,
    /// The factory's intrinsics: the start, and what stays fixed where a model does not free it (principal point,
    /// fy/fx).
    pub factory: &'a Intrinsics,
    /// Apple's lookup tables, where the recording has them.
    pub tables: Option<&'a TablePair>,
    /// What was seen. The order matters to [`Method::Paper`] alone.
    pub frames: &'a [FrameCorners],
}

/// The corners of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameCorners {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Its corners.
    pub corners: Vec<Corner>,
}

/// How to calibrate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// As the paper (arXiv:2201.10865, section 5.1): frames in order, at least 9 corners, a view is skipped whose
    /// camera stood less than 4 cm from that of an accepted one (poses with factory intrinsics); then one focal
    /// length, all corners alike, no robust loss.
    Paper,
    /// All usable views, corners weighed by their σ, outliers left out, the model chosen by held-out prediction.
    Auto,
    /// As `Auto` for a camera whose factory says nothing: `factory` is where to start only, and every model frees the
    /// centre ([`Model::UNAIDED`]).
    Unaided,
    /// As `Auto`, with this model.
    Robust(Model),
    /// Least squares of all corners alike with this model, as `cv2.calibrateCamera`.
    Plain(Model),
}

/// The result of a calibration.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// How it was made.
    pub method: Method,
    /// The model that was chosen or asked for.
    pub model: Model,
    /// The camera: intrinsics and distortion as estimated.
    pub camera: Camera,
    /// Free intrinsic parameters by name, value and sigma, in the order of `covariance`'s rows.
    pub parameters: Vec<Parameter>,
    /// Covariance of `parameters` (row-major), poses marginalised.
    pub covariance: Vec<f64>,
    /// Views used, by frame, with the corners that took part; residuals against the board's `surface`.
    pub views: Vec<View>,
    /// How the views were chosen where there were more than are worth their time; `None` where all usable ones took
    /// part.
    pub chosen: Option<Chosen>,
    /// How many different pictures these views are: views whose corners lie within 4 % of the image's width of each
    /// other count once.
    pub n_pictures: usize,
    /// RMS over all corners of all views, 2-D distance as OpenCV, pixels.
    pub rms_px: f64,
    /// All models tried, with held-out errors (method auto), for the report.
    pub candidates: Vec<Candidate>,
    /// Focal length of two disjoint halves of the views (every other one), px, where each half determines one.
    pub split_half_focal_px: Option<[Estimate; 2]>,
    /// How much distortion is left in the stream; not with [`Method::Paper`] and [`Method::Plain`], and `None` where
    /// the views do not determine it.
    pub distortion: Option<DistortionTest>,
    /// The board's shape, where held-out pictures are predicted better with it than with a flat board.
    pub surface: Option<BoardSurface>,
    /// All shapes of the board tried, from simple to flexible; none with [`Method::Paper`] and [`Method::Plain`].
    pub surfaces: Vec<SurfaceCandidate>,
    /// The focal length without each picture, by frame.
    pub left_out: Vec<LeftOutPicture>,
    /// Whether the views moved while the rows of their images were read, and what that may have done; `None` where the
    /// views do not tell.
    pub rolling_shutter: Option<RollingShutter>,
    /// How the poses go with the camera: what [`projection_uncertainty`](Self::projection_uncertainty) needs; `None`
    /// in a calibration that was not made here.
    pub motion: Option<MeanMotion>,
    /// Corners left out.
    pub outliers: Vec<Outlier>,
    /// Frames left out, by frame.
    pub rejected: Vec<RejectedFrame>,
}

impl Calibration {
    /// Corners of all views.
    pub fn n_corners(&self) -> usize {
        self.views.iter().map(|view| view.corners.len()).sum()
    }

    /// The median distance of the camera from the board's origin over all views, metres; `None` without views.
    pub fn median_distance_m(&self) -> Option<f64> {
        let distances: Vec<f64> = self.views.iter().map(|v| v.camera_position_m().norm()).collect();
        (!distances.is_empty()).then(|| crate::solve::median(&distances))
    }

    /// A free parameter by its name, e.g. `focal_px`; `None` where it is not free.
    pub fn parameter(&self, name: &str) -> Option<Estimate> {
        self.parameters.iter().find(|p| p.name == name).map(|p| p.estimate)
    }

    /// The focal length along x, pixels. Free in every model.
    pub fn focal_px(&self) -> Estimate {
        self.parameter("focal_px")
            .unwrap_or(Estimate { value: self.camera.intrinsics.fx, sigma: f64::INFINITY })
    }
}

/// A choice of the most telling views.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Chosen {
    /// Views that could have taken part.
    pub n_usable: usize,
    /// Views that did.
    pub n_chosen: usize,
    /// Different pictures among those that could have.
    pub n_pictures: usize,
    /// How many times the focal length's σ from corner noise is larger than it would have been with all of them.
    pub focal_sigma_ratio: f64,
}

/// The shape of a board, as it is estimated with the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceKind {
    /// A plane.
    Flat,
    /// Two parabolas, along the rows and along the columns, as mrcal's `calobject_warp`.
    Bend,
    /// A smooth surface: a height for each corner, neighbours alike; and a print slightly stretched and sheared (after
    /// Strobl and Hirzinger, *More accurate pinhole camera calibration with imperfect planar target*, ICCV workshops
    /// 2011, who free all three coordinates of each corner).
    Free,
}

impl SurfaceKind {
    /// `flat`, `bend` or `free`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Bend => "bend",
            Self::Free => "free",
        }
    }
}

/// One shape of the board tried.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct SurfaceCandidate {
    /// Which.
    pub kind: SurfaceKind,
    /// As [`Candidate::rms_px`], with the most flexible camera that the views determine.
    pub rms_px: f64,
    /// As [`Candidate::held_out_rms_px`].
    pub held_out_rms_px: f64,
    /// Standard deviation of `held_out_rms_px`.
    pub held_out_sigma_px: f64,
    /// As [`Candidate::behind_best_sigmas`].
    pub behind_best_sigmas: f64,
    /// The focal length with it.
    pub focal_px: Estimate,
}

/// The calibration without one picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct LeftOutPicture {
    /// The frames of this picture.
    pub frames: Vec<usize>,
    /// The focal length that all others have, pixels (to second order: one step of the normal equations).
    pub focal_px: f64,
}

/// What is left of the residuals where each view may turn and shift while the rows of its image are read, one after
/// the other: to first order. (Hand-held cameras with a rolling shutter do.)
///
/// The calibration does not correct for it: the velocities of single views are known too badly, and freeing them
/// costs more than it mends. What they do to the focal length differs from view to view: it averages out, and σ
/// clustered by picture knows of it. A turn looks like another principal point, though, and hands turn the same way
/// again: where `residual_share` is below 0.8, what the principal point would change by is added to its σ; between
/// 0.9 and 0.8 a growing part of it.
/// Said beside the result so that who wants better holds the device still.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct RollingShutter {
    /// How far a view turns while all rows are read (one standard deviation, radians): the likeliest of 4, 2, 1 and
    /// 0.5 mrad, half a millimetre of shift going with each milliradian.
    pub turn_sigma_rad: f64,
    /// The residuals' standard deviation with motion as a share of that without; degrees of freedom are counted, so
    /// that it is near one where nothing moves.
    pub residual_share: f64,
    /// What the focal length would change by, pixels.
    pub focal_shift_px: f64,
    /// What the principal point would change by, pixels; where the model frees it.
    pub center_shift_px: Option<[f64; 2]>,
}

impl RollingShutter {
    /// Where `residual_share` is above the first views did not move, where it is below the second they did.
    pub const STILL_TO_MOVING: [f64; 2] = [0.9, 0.8];
}

/// How a board deviates from a flat one, estimated with the camera.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct BoardSurface {
    /// Which form was fitted; never [`SurfaceKind::Flat`].
    pub kind: SurfaceKind,
    /// Height of each corner, by id, metres: along the board's z, *into* the board; the best plane is taken out.
    pub heights_m: Vec<f64>,
    /// Their standard deviations, metres.
    pub sigmas_m: Vec<f64>,
    /// By how much the print is stretched along its rows and shrunk along its columns, and sheared: x grows by
    /// e·x + g·y, y by g·x − e·y, about its middle. Only of a [`SurfaceKind::Free`] board.
    pub print: Option<[Estimate; 2]>,
}

impl BoardSurface {
    /// Where a corner lies on the board as it is, in the frame of its own plane: as the poses of
    /// [`Calibration::views`] have it.
    pub fn corner(&self, board: &CharucoBoard, id: usize) -> Point<Board> {
        let flat = board.corner(id);
        let [x, y] = [(flat.x(), board.squares_x), (flat.y(), board.squares_y)]
            .map(|(at_m, squares)| at_m - 0.5 * squares as f64 * board.square_m);
        let [stretch, shear] = self.print.map_or([0.0; 2], |print| print.map(|e| e.value));
        Point::new(
            flat.x() + stretch * x + shear * y,
            flat.y() - stretch * y + shear * x,
            self.heights_m[id],
        )
    }

    /// From the lowest to the highest corner, metres.
    pub fn peak_to_valley_m(&self) -> f64 {
        let high = self.heights_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let low = self.heights_m.iter().copied().fold(f64::INFINITY, f64::min);
        high - low
    }

    /// The difference between the highest and the lowest corner with its σ, metres.
    pub fn size_m(&self) -> Estimate {
        let by_height =
            |a: &&usize, b: &&usize| self.heights_m[**a].total_cmp(&self.heights_m[**b]);
        let ids: Vec<usize> = (0..self.heights_m.len()).collect();
        let sigma = |id: Option<&usize>| id.map_or(f64::NAN, |id| self.sigmas_m[*id]);
        let sigma =
            math::hypot(sigma(ids.iter().max_by(by_height)), sigma(ids.iter().min_by(by_height)));
        Estimate { value: self.peak_to_valley_m(), sigma }
    }
}

/// A number and how sure we are of it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// A camera that was calibrated before, and what that calibration knows of its own errors.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownCamera {
    /// The camera.
    pub camera: Camera,
    /// As [`Calibration::parameters`]; none where the camera is taken as exact.
    pub parameters: Vec<Parameter>,
    /// As [`Calibration::covariance`]: n·n numbers for n parameters.
    pub covariance: Vec<f64>,
    /// The focal length of both halves of its views, pixels.
    pub split_half_focal_px: Option<[f64; 2]>,
    /// What the factory says of the camera that was calibrated, where it says anything: a focal length, pixels.
    pub factory_focal_px: Option<f64>,
}

impl KnownCamera {
    /// A camera taken as exact.
    pub const fn exact(camera: Camera) -> Self {
        Self {
            camera,
            parameters: Vec::new(),
            covariance: Vec::new(),
            split_half_focal_px: None,
            factory_focal_px: None,
        }
    }
}

/// One free parameter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Parameter {
    /// `focal_px`, `center_x_px`, `center_y_px`, `k1`, ...
    pub name: &'static str,
    /// Value and standard deviation.
    #[serde(flatten)]
    pub estimate: Estimate,
}

impl Parameter {
    /// The name of a free number as [`Calibration::parameters`] has it; `None` for what no model calls so.
    pub fn known_name(name: &str) -> Option<&'static str> {
        model::NAMES.into_iter().find(|known| *known == name)
    }
}

/// One model tried.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Candidate {
    /// Which.
    pub model: Model,
    /// Fit to the data it was fitted to, pixels (2-D distance).
    pub rms_px: f64,
    /// RMS on pictures that were held out, pixels (2-D distance): intrinsics from all other pictures, only the six
    /// numbers of each pose fitted; corrected for these six; corners weighed as in the fit. Infinite where the other
    /// pictures do not determine the model. σ from the scatter between pictures.
    pub held_out_rms_px: f64,
    /// Standard deviation of `held_out_rms_px`.
    pub held_out_sigma_px: f64,
    /// By how much the held-out mean square exceeds that of the best candidate, in standard errors of that
    /// difference (pictures paired); 0 for the best.
    pub behind_best_sigmas: f64,
    /// Its focal length.
    pub focal_px: Estimate,
}

/// A corner that disagrees with all others.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Outlier {
    /// Frame index.
    pub frame: usize,
    /// Corner id.
    pub id: usize,
    /// Distance to its prediction, pixels.
    pub residual_px: f64,
    /// The same in standard deviations of what corners like it scatter by.
    pub residual_sigmas: f64,
}

/// A frame that took no part.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct RejectedFrame {
    /// Frame index.
    pub frame: usize,
    /// Why.
    #[serde(flatten)]
    pub reason: Rejection,
}

/// Why a frame took no part.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Rejection {
    /// Too few corners.
    FewCorners {
        /// How many.
        n_corners: usize,
        /// How many are asked for.
        needed: usize,
    },
    /// Corners that hardly spread in one direction of the board.
    NarrowCorners {
        /// How many.
        n_corners: usize,
    },
    /// No pose explains the corners.
    NoPose(crate::pose::Error),
    /// Other views tell more ([`Chosen`]).
    NotChosen {
        /// How many views were chosen.
        n_chosen: usize,
    },
    /// The camera stood where it had stood before ([`Method::Paper`]).
    NearAccepted {
        /// The accepted frame.
        accepted: usize,
        /// Distance between both camera positions, metres.
        distance_m: f64,
    },
    /// More than a third of its corners disagree with all other frames: the board was not what it was taken for, or
    /// moved while the shutter was open.
    Disagrees {
        /// How many disagree.
        n_outliers: usize,
        /// Out of so many.
        n_corners: usize,
    },
}

impl Rejection {
    /// `few_corners`, `narrow_corners`, `no_pose`, `near_accepted`, `not_chosen` or `disagrees`: stable, for machines.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::FewCorners { .. } => "few_corners",
            Self::NarrowCorners { .. } => "narrow_corners",
            Self::NoPose(_) => "no_pose",
            Self::NearAccepted { .. } => "near_accepted",
            Self::NotChosen { .. } => "not_chosen",
            Self::Disagrees { .. } => "disagrees",
        }
    }
}

impl serde::Serialize for Rejection {
    /// Its name, and the sentence.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeMap;
        let mut map = serializer.serialize_map(Some(2))?;
        map.serialize_entry("reason", self.name())?;
        map.serialize_entry("why", &self.to_string())?;
        map.end()
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FewCorners { n_corners, needed } => {
                write!(f, "{n_corners} corners; it takes {needed}")
            }
            Self::NarrowCorners { n_corners } => {
                write!(f, "{n_corners} corners that hardly spread in one direction of the board")
            }
            Self::NoPose(error) => write!(f, "{error}"),
            Self::NearAccepted { accepted, distance_m } => write!(
                f,
                "the camera stood {:.0} mm from where it was in frame {accepted}; the paper skips views nearer than 40",
                1e3 * distance_m
            ),
            Self::NotChosen { n_chosen } => {
                write!(f, "the {n_chosen} views that were chosen tell most of what it tells")
            }
            Self::Disagrees { n_outliers, n_corners } => write!(
                f,
                "{n_outliers} of {n_corners} corners disagree with all other frames: another board, or it moved"
            ),
        }
    }
}

/// How much of the lens' distortion is left in the stream, from the pixels alone. Focal length and principal point are
/// free in every hypothesis.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct DistortionTest {
    /// The share a of the inverse table that straightens the stream best, p' = c + (1 + a·m(r))·(p − c): 0 where the
    /// stream is rectified, 1 where it is as the lens drew it, −1 where it was rectified twice. `None` without tables.
    pub amplitude: Option<Estimate>,
    /// Brown's k1, with k2 beside it where held-out pictures ask for it.
    pub k1: Estimate,
    /// Brown's k2, where held-out pictures ask for it.
    pub k2: Option<Estimate>,
    /// How far the lens draws the farthest image corner outside its rectilinear place, pixels (inside: negative): by
    /// the table's amplitude where there are tables, else by k1 (and k2).
    pub corner_shift_px: Estimate,
    /// The same as the inverse table has it (amplitude 1). `None` without tables.
    pub table_corner_shift_px: Option<f64>,
    /// RMS under each hypothesis.
    pub hypotheses: Vec<Hypothesis>,
}

/// One assumption about the stream, and how well it explains the corners.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Hypothesis {
    /// Which.
    pub lens: Lens,
    /// RMS of the residuals, 2-D distance, pixels.
    pub rms_px: f64,
    /// The same with the board taken for flat.
    pub flat_rms_px: f64,
    /// As [`Candidate::held_out_rms_px`].
    pub held_out_rms_px: f64,
    /// Focal length under it.
    pub focal_px: Estimate,
    /// Principal point under it.
    pub center_px: [Estimate; 2],
}

/// What lies between the stream and a pinhole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Lens {
    /// Nothing: the stream is rectified.
    None,
    /// The inverse table rectifies it: the stream is as the lens drew it.
    InverseTable,
    /// The forward table does: the stream was rectified twice.
    ForwardTable,
    /// A free share of the inverse table.
    FreeTable,
    /// Brown's k1, free, and k2 where held-out pictures ask for it.
    FreeRadial,
}

/// A calibration that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Too few usable views.
    #[error(
        "{n_views} of {n_frames} frames show the board well enough (at least {min_corners} corners, spread in both \
         directions); a calibration needs {needed} different views. Record 20 or more, tilted by 20° to 45° to all \
         sides"
    )]
    TooFewViews {
        /// Frames given.
        n_frames: usize,
        /// Frames usable.
        n_views: usize,
        /// Frames needed.
        needed: usize,
        /// Corners a frame needs.
        min_corners: usize,
    },
    /// Views that leave the focal length open.
    #[error(
        "the {n_views} views ({n_pictures} different, tilted by at most {max_tilt_deg:.0}°) do not determine \
         the focal length{}. Record 20 or more views tilted by 20° to 45° to all sides",
        focal_px.map_or(String::new(), |f| format!(" (it comes out as {:.0} ± {:.0} px)", f.value, f.sigma))
    )]
    Underdetermined {
        /// Views used.
        n_views: usize,
        /// How many of them differ.
        n_pictures: usize,
        /// Largest angle between optical axis and board normal, degrees.
        max_tilt_deg: f64,
        /// What came out, where anything did.
        focal_px: Option<Estimate>,
    },
    /// A model that needs tables, without tables.
    #[error("model {} needs Apple's lens distortion tables, and the recording has none", model.name())]
    NoTables {
        /// Which.
        model: Model,
    },
    /// Factory intrinsics that make no camera.
    #[error(
        "factory intrinsics with focal lengths {fx_px}, {fy_px} px and principal point ({cx_px}, {cy_px}) px: no \
         camera has these"
    )]
    Factory {
        /// Focal length.
        fx_px: f64,
        /// Focal length.
        fy_px: f64,
        /// Principal point.
        cx_px: f64,
        /// Principal point.
        cy_px: f64,
    },
}
