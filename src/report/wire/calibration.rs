//! A calibration, out and in again.

use serde::{Deserialize, Serialize};

use super::{finite, model_name};
use crate::{
    calibrate::{self, Estimate, KnownCamera, Lens},
    camera::{self, Brown, Camera, Intrinsics, RadialTable, TablePair},
    geom::Pixel,
    pose,
    recording::Factory,
    report::Error,
};

/// A calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Name of the recording.
    pub recording: String,
    /// `paper`, `auto`, `model` where the model was asked for, or `plain` where that was fitted as OpenCV does.
    pub method: String,
    /// `focal`, `focal+table`, `focal+centre`, `focal+table+centre` or `brown`.
    pub model: String,
    /// The mean of both focal lengths.
    pub focal_px: f64,
    /// Standard deviation of `focal_px`.
    pub focal_sigma_px: Option<f64>,
    /// What the factory says; `null` where the recording does not tell.
    pub factory_focal_px: Option<f64>,
    /// (own − factory) / factory.
    pub focal_difference_percent: Option<f64>,
    /// Horizontal and vertical focal length.
    pub focal_xy_px: [f64; 2],
    /// The centre of projection in the image; integers are pixel centres.
    pub principal_point_px: [f64; 2],
    /// Columns and rows of the image that these numbers are for.
    pub image_size_px: [usize; 2],
    /// How the lens bends straight lines.
    pub distortion: Distortion,
    /// Root mean square of the corners' 2-D distances, as OpenCV counts.
    pub rms_px: f64,
    /// Views used.
    pub n_views: usize,
    /// How many different pictures these views are.
    pub n_pictures: usize,
    /// Corners used.
    pub n_corners: usize,
    /// Focal lengths of two disjoint halves of the views, where there are enough.
    pub split_half_focal_px: Option<[f64; 2]>,
    /// Their standard deviations.
    pub split_half_focal_sigma_px: Option<[Option<f64>; 2]>,
    /// Free parameters, in the order of `covariance`.
    pub parameters: Vec<Parameter>,
    /// Of `parameters`, row by row, poses marginalised.
    pub covariance: Vec<Vec<Option<f64>>>,
    /// All models tried, with what they leave unexplained.
    pub candidates: Vec<Candidate>,
    /// How much distortion is left in the stream; `null` where it was not tested or the views do not determine it.
    pub distortion_test: Option<DistortionTest>,
    /// The views used.
    pub views: Vec<View>,
    /// Corners that disagree with all others and were left out.
    pub outliers: Vec<Outlier>,
    /// Frames that were left out.
    #[serde(default)]
    pub rejected: Vec<Rejected>,
    /// How the views were chosen; absent where all usable ones took part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<Chosen>,
    /// The shapes of the board that were tried.
    #[serde(default)]
    pub surfaces: Vec<Surface>,
    /// The board's shape; `null` where it was taken for flat.
    #[serde(default)]
    pub board_surface: Option<BoardSurface>,
    /// The focal length without each picture.
    #[serde(default)]
    pub left_out: Vec<LeftOut>,
    /// Whether the views moved while their images were read; `null` where the views do not tell.
    #[serde(default)]
    pub rolling_shutter: Option<RollingShutter>,
    /// What a wrong calibration would cost over the image.
    #[serde(default)]
    pub projection_uncertainty: Option<ProjectionUncertainty>,
}

/// A choice of the most telling views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chosen {
    /// Views that could have taken part.
    pub n_usable: usize,
    /// Views that did.
    pub n_chosen: usize,
    /// Different pictures among those that could have.
    pub n_pictures: usize,
    /// How many times the focal length's σ from corner noise is larger than with all of them.
    pub focal_sigma_ratio: Option<f64>,
}

/// A frame that was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rejected {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// `few_corners`, `narrow_corners`, `no_pose`, `near_accepted`, `not_chosen` or `disagrees`.
    pub reason: String,
    /// The same in a sentence.
    pub why: String,
}

/// A shape of the board that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// `flat`, `bend` or `free`.
    pub kind: String,
    /// On the corners it was fitted to.
    pub rms_px: Option<f64>,
    /// On pictures it had not seen.
    pub held_out_rms_px: Option<f64>,
    /// Standard deviation of `held_out_rms_px`.
    pub held_out_sigma_px: Option<f64>,
    /// By how many standard errors of the difference it predicts worse than the best.
    pub behind_best_sigmas: Option<f64>,
    /// The focal length with it.
    pub focal_px: Option<f64>,
    /// Standard deviation of `focal_px`.
    pub focal_sigma_px: Option<f64>,
}

/// How the board deviates from a flat one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoardSurface {
    /// `bend` or `free`.
    pub kind: String,
    /// From the highest corner to the lowest.
    pub peak_to_valley_mm: Option<f64>,
    /// Standard deviation of `peak_to_valley_mm`.
    pub peak_to_valley_sigma_mm: Option<f64>,
    /// Of each corner, by id: into the board, the best plane taken out.
    pub heights_mm: Vec<Option<f64>>,
    /// Standard deviations of `heights_mm`.
    pub sigmas_mm: Vec<Option<f64>>,
    /// By how much the print is longer along its rows and shorter along its columns than square; `null` where that was
    /// not estimated.
    pub print_stretch: Option<f64>,
    /// Standard deviation of `print_stretch`.
    pub print_stretch_sigma: Option<f64>,
    /// How much x grows with y and y with x.
    pub print_shear: Option<f64>,
    /// Standard deviation of `print_shear`.
    pub print_shear_sigma: Option<f64>,
}

/// The focal length that all other pictures have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The frames of the picture that was left out.
    pub frames: Vec<usize>,
    /// Without them.
    pub focal_px: Option<f64>,
}

/// What is left of the residuals where each view may move while the rows of its image are read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RollingShutter {
    /// How far a view turns while all rows are read (one standard deviation): the likeliest of a few.
    #[serde(default)]
    pub turn_sigma_mrad: Option<f64>,
    /// Their standard deviation as a share of that of still views; near 1 where nothing moved.
    pub residual_share: Option<f64>,
    /// What the focal length would change by.
    pub focal_shift_px: Option<f64>,
    /// What the principal point would change by; `null` where it is the factory's.
    pub center_shift_px: Option<[f64; 2]>,
}

/// What a wrong calibration would cost: one standard deviation of where points at one depth are drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProjectionUncertainty {
    /// Places across the image, from the first pixel's centre to the last one's.
    pub columns: usize,
    /// Places down the image.
    pub rows: usize,
    /// Distance of the points along the optical axis.
    pub depth_m: f64,
    /// In the worst direction, row by row.
    pub sigma_px: Vec<Option<f64>>,
    /// The same sideways at `depth_m`.
    pub sigma_mm: Vec<Option<f64>>,
}

/// A free parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// `focal_px`, `center_x_px`, `k1` ...
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: Option<f64>,
}

/// A camera model that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// As in [`Calibration::model`].
    pub model: String,
    /// On the corners it was fitted to.
    pub rms_px: Option<f64>,
    /// On corners it had not seen.
    pub held_out_rms_px: Option<f64>,
    /// Standard deviation of `held_out_rms_px`.
    #[serde(default)]
    pub held_out_sigma_px: Option<f64>,
    /// By how many standard errors of the difference it predicts worse than the best.
    #[serde(default)]
    pub behind_best_sigmas: Option<f64>,
    /// Its focal length.
    pub focal_px: Option<f64>,
    /// Standard deviation of `focal_px`.
    pub focal_sigma_px: Option<f64>,
}

/// How much of the lens' distortion is left in the stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DistortionTest {
    /// The share of Apple's table that is in the stream: 0 rectified, 1 as the lens drew it, −1 rectified twice;
    /// `null` without tables.
    pub amplitude: Option<f64>,
    /// Standard deviation of `amplitude`.
    pub amplitude_sigma: Option<f64>,
    /// How far the lens draws the farthest image corner outside its rectilinear place.
    pub corner_shift_px: Option<f64>,
    /// Standard deviation of `corner_shift_px`.
    pub corner_shift_sigma_px: Option<f64>,
    /// RMS under each assumption about the stream.
    pub hypotheses: Vec<Hypothesis>,
}

/// An assumption about the stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hypothesis {
    /// `none`, `inverse_table`, `forward_table`, `free_table` or `free_radial`: what rectifies the stream.
    pub lens: String,
    /// On the corners it was fitted to.
    pub rms_px: Option<f64>,
    /// On pictures it had not seen.
    pub held_out_rms_px: Option<f64>,
    /// Focal length under it.
    pub focal_px: Option<f64>,
    /// Standard deviation of `focal_px`.
    pub focal_sigma_px: Option<f64>,
}

/// A view of the board: x_camera = R · x_board + t.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Corners used.
    pub n_corners: usize,
    /// Root mean square of their 2-D distances.
    pub rms_px: f64,
    /// Axis times angle of R.
    pub rotation_vector_rad: [f64; 3],
    /// t.
    pub translation_m: [f64; 3],
}

/// A corner that was left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outlier {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Id of the corner.
    pub id: usize,
    /// Distance to its prediction.
    pub residual_px: Option<f64>,
    /// The same in standard deviations of what corners like it scatter by.
    #[serde(default)]
    pub residual_sigmas: Option<f64>,
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

impl Calibration {
    /// What was calibrated from `recording` by [`method`](Self::method), beside what the factory says.
    pub fn new(
        recording: &str,
        method: &str,
        factory: Option<&Factory>,
        calibration: &calibrate::Calibration,
    ) -> Self {
        let intrinsics = &calibration.camera.intrinsics;
        let focal = intrinsics.focal_px();
        let focal_sigma =
            calibration.parameters.iter().find(|p| p.name == "focal_px").map(|p| p.estimate.sigma);
        let factory_focal = factory.map(|f| f.intrinsics.focal_px());
        // The fit's own number is the horizontal one.
        let mean = focal / intrinsics.fx;
        let halves = calibration.split_half_focal_px;
        let n = calibration.parameters.len();
        Self {
            recording: recording.to_owned(),
            method: method.to_owned(),
            model: model_name(calibration.model).to_owned(),
            focal_px: focal,
            focal_sigma_px: focal_sigma.and_then(|sigma| finite(mean * sigma)),
            factory_focal_px: factory_focal,
            focal_difference_percent: factory_focal
                .map(|factory| 100.0 * (focal / factory - 1.0))
                .and_then(finite),
            focal_xy_px: [intrinsics.fx, intrinsics.fy],
            principal_point_px: [intrinsics.cx, intrinsics.cy],
            image_size_px: [intrinsics.width, intrinsics.height],
            distortion: Distortion::from(&calibration.camera.distortion),
            rms_px: calibration.rms_px,
            n_views: calibration.views.len(),
            n_pictures: calibration.n_pictures,
            n_corners: calibration.views.iter().map(|view| view.corners.len()).sum(),
            split_half_focal_px: halves.map(|halves| halves.map(|half| mean * half.value)),
            split_half_focal_sigma_px: halves
                .map(|halves| halves.map(|half| finite(mean * half.sigma))),
            parameters: calibration.parameters.iter().map(Parameter::from).collect(),
            covariance: calibration
                .covariance
                .chunks(n.max(1))
                .map(|row| row.iter().map(|&value| finite(value)).collect())
                .collect(),
            candidates: calibration.candidates.iter().map(Candidate::from).collect(),
            distortion_test: calibration.distortion.as_ref().map(DistortionTest::from),
            views: calibration.views.iter().map(View::from).collect(),
            outliers: calibration.outliers.iter().map(Outlier::from).collect(),
            rejected: calibration.rejected.iter().map(Rejected::from).collect(),
            chosen: calibration.chosen.map(|chosen| Chosen {
                n_usable: chosen.n_usable,
                n_chosen: chosen.n_chosen,
                n_pictures: chosen.n_pictures,
                focal_sigma_ratio: finite(chosen.focal_sigma_ratio),
            }),
            surfaces: calibration.surfaces.iter().map(Surface::from).collect(),
            board_surface: calibration.surface.as_ref().map(BoardSurface::from),
            left_out: calibration
                .left_out
                .iter()
                .map(|l| LeftOut { frames: l.frames.clone(), focal_px: finite(mean * l.focal_px) })
                .collect(),
            rolling_shutter: calibration.rolling_shutter.map(|shutter| RollingShutter {
                turn_sigma_mrad: finite(1e3 * shutter.turn_sigma_rad),
                residual_share: finite(shutter.residual_share),
                focal_shift_px: finite(shutter.focal_shift_px),
                center_shift_px: shutter
                    .center_shift_px
                    .filter(|c| c.iter().all(|x| x.is_finite())),
            }),
            projection_uncertainty: calibration
                .median_distance_m()
                .and_then(|depth_m| calibration.projection_uncertainty(17, 13, depth_m))
                .as_ref()
                .map(ProjectionUncertainty::from),
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
}

impl Calibration {
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
            let Some(sigma) = parameter.sigma.filter(|sigma| *sigma > 0.0) else {
                return refused(format!(
                    "{name} without a σ above 0: its views did not determine it"
                ));
            };
            let estimate = Estimate { value: parameter.value, sigma };
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
            split_half_focal_px: self.split_half_focal_px,
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

impl From<&calibrate::Parameter> for Parameter {
    fn from(parameter: &calibrate::Parameter) -> Self {
        let Estimate { value, sigma } = parameter.estimate;
        Self { name: parameter.name.to_owned(), value, sigma: finite(sigma) }
    }
}

impl From<&calibrate::Candidate> for Candidate {
    fn from(candidate: &calibrate::Candidate) -> Self {
        Self {
            model: model_name(candidate.model).to_owned(),
            rms_px: finite(candidate.rms_px),
            held_out_rms_px: finite(candidate.held_out_rms_px),
            held_out_sigma_px: finite(candidate.held_out_sigma_px),
            behind_best_sigmas: finite(candidate.behind_best_sigmas),
            focal_px: finite(candidate.focal_px.value),
            focal_sigma_px: finite(candidate.focal_px.sigma),
        }
    }
}

impl From<&calibrate::RejectedFrame> for Rejected {
    fn from(rejected: &calibrate::RejectedFrame) -> Self {
        Self {
            frame: rejected.frame,
            reason: rejected.reason.name().to_owned(),
            why: rejected.reason.to_string(),
        }
    }
}

impl From<&calibrate::SurfaceCandidate> for Surface {
    fn from(surface: &calibrate::SurfaceCandidate) -> Self {
        Self {
            kind: surface.kind.name().to_owned(),
            rms_px: finite(surface.rms_px),
            held_out_rms_px: finite(surface.held_out_rms_px),
            held_out_sigma_px: finite(surface.held_out_sigma_px),
            behind_best_sigmas: finite(surface.behind_best_sigmas),
            focal_px: finite(surface.focal_px.value),
            focal_sigma_px: finite(surface.focal_px.sigma),
        }
    }
}

impl From<&calibrate::BoardSurface> for BoardSurface {
    fn from(surface: &calibrate::BoardSurface) -> Self {
        let mm = |metres: &[f64]| metres.iter().map(|m| finite(1e3 * m)).collect();
        let size = surface.size_m();
        let print = |i: usize| surface.print.map(|print| print[i]);
        let value = |e: Option<Estimate>| e.and_then(|e| finite(e.value));
        let sigma = |e: Option<Estimate>| e.and_then(|e| finite(e.sigma));
        Self {
            kind: surface.kind.name().to_owned(),
            peak_to_valley_mm: finite(1e3 * size.value),
            peak_to_valley_sigma_mm: finite(1e3 * size.sigma),
            heights_mm: mm(&surface.heights_m),
            sigmas_mm: mm(&surface.sigmas_m),
            print_stretch: value(print(0)),
            print_stretch_sigma: sigma(print(0)),
            print_shear: value(print(1)),
            print_shear_sigma: sigma(print(1)),
        }
    }
}

impl From<&calibrate::ProjectionUncertainty> for ProjectionUncertainty {
    fn from(grid: &calibrate::ProjectionUncertainty) -> Self {
        let known = |values: &[f64]| values.iter().map(|v| finite(*v)).collect();
        Self {
            columns: grid.columns,
            rows: grid.rows,
            depth_m: grid.depth_m,
            sigma_px: known(&grid.sigma_px),
            sigma_mm: known(&grid.sigma_mm),
        }
    }
}

impl From<&calibrate::DistortionTest> for DistortionTest {
    fn from(test: &calibrate::DistortionTest) -> Self {
        Self {
            amplitude: test.amplitude.and_then(|amplitude| finite(amplitude.value)),
            amplitude_sigma: test.amplitude.and_then(|amplitude| finite(amplitude.sigma)),
            corner_shift_px: finite(test.corner_shift_px.value),
            corner_shift_sigma_px: finite(test.corner_shift_px.sigma),
            hypotheses: test.hypotheses.iter().map(Hypothesis::from).collect(),
        }
    }
}

impl From<&calibrate::Hypothesis> for Hypothesis {
    fn from(hypothesis: &calibrate::Hypothesis) -> Self {
        let lens = match hypothesis.lens {
            Lens::None => "none",
            Lens::InverseTable => "inverse_table",
            Lens::ForwardTable => "forward_table",
            Lens::FreeTable => "free_table",
            Lens::FreeRadial => "free_radial",
        };
        Self {
            lens: lens.to_owned(),
            rms_px: finite(hypothesis.rms_px),
            held_out_rms_px: finite(hypothesis.held_out_rms_px),
            focal_px: finite(hypothesis.focal_px.value),
            focal_sigma_px: finite(hypothesis.focal_px.sigma),
        }
    }
}

impl From<&pose::View> for View {
    fn from(view: &pose::View) -> Self {
        Self {
            frame: view.frame,
            n_corners: view.corners.len(),
            rms_px: view.rms_px,
            rotation_vector_rad: view.color_from_board.rotation.scaled_axis().into(),
            translation_m: view.color_from_board.translation.into(),
        }
    }
}

impl From<&calibrate::Outlier> for Outlier {
    fn from(outlier: &calibrate::Outlier) -> Self {
        Self {
            frame: outlier.frame,
            id: outlier.id,
            residual_px: finite(outlier.residual_px),
            residual_sigmas: finite(outlier.residual_sigmas),
        }
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
