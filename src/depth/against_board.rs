//! The error of every corner, frame by frame.

use crate::{
    board::CharucoBoard,
    calibrate::{BoardSurface, Estimate},
    detect::Corner,
    geom::{Board, Pixel, Point},
    image::DepthMap,
    pose::View,
    solve::{mean, median, standard_error},
};

/// Errors beyond this are dropped before medians are taken, as in the paper's code: the sensor then saw something
/// else than the board, metres.
pub const MAX_ERROR_M: f64 = 0.020;

/// One corner of the board where the sensor measured.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Sample {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Id of the corner.
    pub corner: usize,
    /// Where the corner was observed, and the depth map read.
    #[serde(flatten)]
    pub pixel: Pixel,
    /// Depth of the corner as the board's pose tells it, metres.
    pub board_m: f64,
    /// Depth as the sensor measured it, metres.
    pub sensor_m: f64,
}

impl Sample {
    /// Board minus sensor, metres: positive where the sensor measures too near.
    pub fn error_m(&self) -> f64 {
        self.board_m - self.sensor_m
    }
}

/// One frame's depth against the board.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FrameDepth {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Every corner with a measurement, by ascending id, those beyond [`MAX_ERROR_M`] included.
    #[serde(skip)]
    pub samples: Vec<Sample>,
    /// Corners where the depth map has a hole, or that lie outside of it.
    pub n_holes: usize,
    /// Samples beyond [`MAX_ERROR_M`]; they do not enter the median.
    pub n_beyond: usize,
    /// Median error of the other samples, metres; `None` where there are none.
    pub median_error_m: Option<f64>,
}

impl FrameDepth {
    /// Samples within [`MAX_ERROR_M`]: those the median is taken of.
    pub fn kept(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|s| s.error_m().abs() <= MAX_ERROR_M)
    }
}

/// Depth against the board under one camera.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct BoardDepth {
    /// Frames with a depth map and a view of the board, in the order of the recording.
    pub frames: Vec<FrameDepth>,
    /// Mean of the frames' median errors, metres; sigma is the spread of the medians over the root of their number,
    /// and knows nothing of what all frames share (focal length, board). `None` where no frame has a median; sigma is
    /// infinite where one has.
    pub mean_of_medians_m: Option<Estimate>,
}

/// The sensor's depth at each corner, metres, as observed; `None` on holes and outside the map.
pub fn sense(map: &DepthMap, corners: &[Corner]) -> Vec<Option<f64>> {
    corners.iter().map(|corner| map.bilinear(corner.pixel)).collect()
}

/// Compares sensor and board. The board is flat, or has the `surface` that a calibration found. Each item is a view
/// with what [`sense`] read at its corners (in the order of `view.corners`; panics where the lengths differ).
pub fn against_board(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    views: &[(&View, &[Option<f64>])],
) -> BoardDepth {
    let frames: Vec<FrameDepth> =
        views.iter().map(|(view, sensed)| frame_depth(board, surface, view, sensed)).collect();
    let medians: Vec<f64> = frames.iter().filter_map(|f| f.median_error_m).collect();
    BoardDepth { frames, mean_of_medians_m: mean_of(&medians) }
}

/// Where a corner lies on the board as it is.
pub(crate) fn corner_on(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    id: usize,
) -> Point<Board> {
    surface.map_or_else(|| board.corner(id), |surface| surface.corner(board, id))
}

fn frame_depth(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    view: &View,
    sensed: &[Option<f64>],
) -> FrameDepth {
    assert_eq!(view.corners.len(), sensed.len(), "one depth or hole per corner");
    let samples: Vec<Sample> = view
        .corners
        .iter()
        .zip(sensed)
        .filter_map(|(corner, sensed)| {
            Some(Sample {
                frame: view.frame,
                corner: corner.id,
                pixel: corner.pixel,
                board_m: (view.color_from_board * corner_on(board, surface, corner.id)).z(),
                sensor_m: (*sensed)?,
            })
        })
        .collect();
    let n_holes = view.corners.len() - samples.len();
    let mut frame =
        FrameDepth { frame: view.frame, samples, n_holes, n_beyond: 0, median_error_m: None };
    let errors: Vec<f64> = frame.kept().map(Sample::error_m).collect();
    frame.n_beyond = frame.samples.len() - errors.len();
    frame.median_error_m = (!errors.is_empty()).then(|| median(&errors));
    frame
}

fn mean_of(medians: &[f64]) -> Option<Estimate> {
    let sigma = match medians.len() {
        0 => return None,
        1 => f64::INFINITY,
        _ => standard_error(medians),
    };
    Some(Estimate { value: mean(medians), sigma })
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;
    use crate::{
        detect::Corner,
        geom::{Pose, Rotation, Vector3},
    };

    fn board() -> &'static CharucoBoard {
        static BOARD: LazyLock<CharucoBoard> =
            LazyLock::new(|| CharucoBoard::paper(0.020875).unwrap());
        &BOARD
    }

    fn view(frame: usize, distance_m: f64) -> View {
        let corners = (0..board().n_corners())
            .map(|id| Corner { id, pixel: Pixel::new(id as f64, 1.0), sigma_px: 0.1 })
            .collect::<Vec<_>>();
        let rotation = Rotation::identity();
        View {
            frame,
            residuals_px: vec![[0.0; 2]; corners.len()],
            corners,
            color_from_board: Pose::new(rotation, Vector3::new(-0.1, -0.08, distance_m)),
            rms_px: 0.0,
        }
    }

    #[test]
    fn sign_holes_and_drops() {
        let view = view(3, 0.2);
        let mut sensed: Vec<Option<f64>> = vec![Some(0.199); view.corners.len()];
        sensed[0] = None;
        sensed[1] = Some(0.221); // 21 mm beyond the board: dropped
        sensed[2] = Some(0.1801); // 19.9 mm before it: kept
        let depth = against_board(board(), None, &[(&view, &sensed)]);
        let frame = &depth.frames[0];
        assert_eq!((frame.frame, frame.n_holes, frame.n_beyond), (3, 1, 1));
        assert_eq!(frame.samples.len(), 62);
        assert_eq!(frame.kept().count(), 61);
        // The sensor measures 1 mm too near: board − sensor is +1 mm.
        assert!((frame.median_error_m.unwrap() - 0.001).abs() < 1e-12);
        assert!(depth.mean_of_medians_m.unwrap().sigma.is_infinite());
    }

    #[test]
    fn depth_is_read_where_the_corner_was_seen() {
        // Depth grows by 1 mm per column; a hole at (5, 2).
        let mut depth_m: Vec<f32> = (0..10 * 4).map(|i| 0.2 + 0.001 * (i % 10) as f32).collect();
        depth_m[2 * 10 + 5] = f32::NAN;
        let map = DepthMap::new(10, 4, depth_m);
        let corner = |x, y| Corner { id: 0, pixel: Pixel::new(x, y), sigma_px: 0.1 };
        let sensed = sense(&map, &[corner(2.5, 1.0), corner(4.5, 1.5), corner(9.5, 1.0)]);
        assert!((sensed[0].unwrap() - 0.2025).abs() < 1e-7);
        assert_eq!(sensed[1..], [None, None]);
    }
}
