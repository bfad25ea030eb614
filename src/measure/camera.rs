//! The measured camera: calibrated from what was seen, or given.

use super::{About, Error, FrameMeasurement, Method};
use crate::{
    board::CharucoBoard,
    calibrate::{
        self, BoardSurface, Calibration, DistortionTest, FrameCorners, KnownCamera, Parameter,
        RejectedFrame, Rejection, distortion_test,
    },
    camera::Camera,
    depth::Patches,
    detect::Corner,
    pose::{View, Weighting},
    recording::Factory,
};

/// What no corner is better than, pixels: the boards of the published recordings are uneven by 0.8 mm, which is a tenth
/// of a pixel and more at their distance.
const CORNER_FLOOR_PX: f64 = 0.1;

/// Focal lengths of one camera lie within this share of each other: the factory measured each by itself.
pub const SAME_CAMERA: f64 = 0.015;

/// The measured camera, or why there is none.
#[derive(Default)]
pub(super) struct MeasuredCamera {
    pub(super) camera: Option<Camera>,
    pub(super) calibration: Option<Calibration>,
    /// Where the camera is given.
    pub(super) given: Option<KnownCamera>,
    pub(super) why_not: Option<String>,
}

impl MeasuredCamera {
    pub(super) fn surface(&self) -> Option<&BoardSurface> {
        self.calibration.as_ref().and_then(|c| c.surface.as_ref())
    }

    /// The camera's free numbers and their covariance; none of a camera that is exact or not known.
    pub(super) fn uncertainty(&self) -> (&[Parameter], &[f64]) {
        match (&self.calibration, &self.given) {
            (Some(calibration), _) => (&calibration.parameters, &calibration.covariance),
            (None, Some(given)) => (&given.parameters, &given.covariance),
            (None, None) => (&[], &[]),
        }
    }

    /// The calibration's own test, or one beside a calibration that has none (method paper, camera given).
    pub(super) fn distortion(
        &self,
        about: &About,
        board: &CharucoBoard,
        frames: &[FrameMeasurement],
    ) -> Option<DistortionTest> {
        if let Some(test) = self.calibration.as_ref().and_then(|c| c.distortion.as_ref()) {
            return Some(test.clone());
        }
        self.camera.as_ref()?;
        let frames = corners_by_frame(frames);
        distortion_test(&input(about.factory.as_ref()?, board, &frames))
    }

    /// The views that the calibration found, or else those of `frames`, where there is depth.
    pub(super) fn views_with_depth<'a>(
        &'a self,
        frames: &'a [FrameMeasurement],
    ) -> Vec<(&'a View, &'a Patches)> {
        let views: Vec<&View> = match &self.calibration {
            Some(calibration) => calibration.views.iter().collect(),
            None if self.camera.is_some() => {
                frames.iter().filter_map(|f| f.own_view.as_ref()).collect()
            }
            None => frames.iter().filter_map(|f| f.factory_view.as_ref()).collect(),
        };
        views
            .into_iter()
            .filter_map(|view| Some((view, frames[view.frame].patches.as_ref()?)))
            .collect()
    }

    /// The board's pose in a frame with the own camera, corners left out that disagree with all others: where the
    /// board has a shape, that of the calibration, which knows it.
    pub(super) fn view(
        &self,
        index: usize,
        board: &CharucoBoard,
        corners: &[Corner],
    ) -> Option<View> {
        let camera = self.camera.as_ref()?;
        if let Some(calibration) = self.calibration.as_ref().filter(|c| c.surface.is_some())
            && let Some(view) = calibration.views.iter().find(|view| view.frame == index)
        {
            return Some(view.clone());
        }
        let mut corners = corners.to_vec();
        if let Some(calibration) = &self.calibration {
            let disagrees = |r: &RejectedFrame| {
                r.frame == index && matches!(r.reason, Rejection::Disagrees { .. })
            };
            if calibration.rejected.iter().any(disagrees) {
                return None;
            }
            corners
                .retain(|c| !calibration.outliers.iter().any(|o| o.frame == index && o.id == c.id));
        }
        let weighting = Weighting::Sigma { floor_px: CORNER_FLOOR_PX };
        View::from_corners(index, board, camera, &corners, weighting).ok()
    }
}

pub(super) fn measured_camera(
    about: &About,
    (method, max_views): (&Method, usize),
    board: &CharucoBoard,
    frames: &[FrameMeasurement],
) -> Result<MeasuredCamera, Error> {
    let size_px = frames.iter().find_map(|f| f.size_px);
    let method = match method {
        Method::Given(given) => {
            let given = &**given;
            if let Some(size) = size_px {
                given.camera.check_size(size, &about.place)?;
            }
            let recorded = about.factory.as_ref().map(|factory| factory.intrinsics.focal_px());
            // A recording that was corrected by this very calibration has its focal length.
            let is_near = |px: f64, other_px: f64| (px / other_px - 1.0).abs() <= SAME_CAMERA;
            let own_px = given.camera.intrinsics.focal_px();
            if let (Some(given_px), Some(recorded_px)) = (given.factory_focal_px, recorded)
                && !is_near(given_px, recorded_px)
                && !is_near(own_px, recorded_px)
            {
                let recording = about.place.clone();
                return Err(Error::OtherCamera { recording, given_px, recorded_px });
            }
            let camera = Some(given.camera.clone());
            return Ok(MeasuredCamera {
                camera,
                given: Some(given.clone()),
                ..MeasuredCamera::default()
            });
        }
        Method::Paper => calibrate::Method::Paper,
        Method::Auto => calibrate::Method::Auto,
    };
    let why_not =
        |why: String| Ok(MeasuredCamera { why_not: Some(why), ..MeasuredCamera::default() });
    let frames = corners_by_frame(frames);
    if frames.is_empty() {
        return why_not("the board was not seen in any frame".to_owned());
    }
    let Some(factory) = &about.factory else {
        return why_not("the recording has no factory intrinsics to start from".to_owned());
    };
    let input = input(factory, board, &frames);
    match calibrate::calibrate_from(&input, method, max_views) {
        Ok(calibration) => Ok(MeasuredCamera {
            camera: Some(calibration.camera.clone()),
            calibration: Some(calibration),
            ..MeasuredCamera::default()
        }),
        Err(error) => why_not(why_not_calibrated(&error)),
    }
}

fn input<'a>(
    factory: &'a Factory,
    board: &'a CharucoBoard,
    frames: &'a [FrameCorners],
) -> calibrate::Input<'a> {
    let tables = factory.tables.as_ref();
    calibrate::Input { board, factory: &factory.intrinsics, tables, frames }
}

fn corners_by_frame(frames: &[FrameMeasurement]) -> Vec<FrameCorners> {
    frames
        .iter()
        .enumerate()
        .filter(|(_, frame)| !frame.observation.corners.is_empty())
        .map(|(index, frame)| FrameCorners {
            frame: index,
            corners: frame.observation.corners.clone(),
        })
        .collect()
}

/// For the end of a sentence. Findings tell the remedy themselves.
fn why_not_calibrated(error: &calibrate::Error) -> String {
    match error {
        calibrate::Error::TooFewViews { n_frames, n_views, needed, min_corners } => format!(
            "{n_views} of {n_frames} frames with the board are of use for a calibration (at least {min_corners} \
             corners, spread in both directions, from a place of their own), and it takes {needed}"
        ),
        calibrate::Error::Underdetermined { n_views, n_pictures, max_tilt_deg, focal_px } => {
            format!(
                "the {n_views} views of the board ({n_pictures} different, tilted by at most {max_tilt_deg:.0} \
                 degrees) do not determine a focal length{}",
                focal_px.map_or(String::new(), |f| format!(
                    ", which comes out as {:.0} +- {:.0} px",
                    f.value, f.sigma
                ))
            )
        }
        other => other.to_string(),
    }
}
