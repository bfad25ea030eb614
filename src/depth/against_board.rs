//! The error of every corner, frame by frame.

use crate::{
    board::CharucoBoard, calibrate::Estimate, depth::DepthLine, detect::Corner, geom::Pixel,
    image::DepthMap, pose::View,
};

/// Errors beyond this are dropped before medians are taken, as in the paper's code: the sensor then saw something
/// else than the board, metres.
pub const MAX_ERROR_M: f64 = 0.020;

/// One corner of the board where the sensor measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Id of the corner.
    pub corner: usize,
    /// Where the corner was observed, and the depth map read.
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
#[derive(Clone, Debug, PartialEq)]
pub struct FrameDepth {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Every corner with a measurement, by ascending id, those beyond [`MAX_ERROR_M`] included.
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
#[derive(Clone, Debug, PartialEq)]
pub struct BoardDepth {
    /// Frames with a depth map and a view of the board, in the order of the recording.
    pub frames: Vec<FrameDepth>,
    /// Mean of the frames' median errors, metres; sigma is the spread of the medians over the root of their number,
    /// and knows nothing of what all frames share (focal length, board). `None` where no frame has a median; sigma is
    /// infinite where one has.
    pub mean_of_medians_m: Option<Estimate>,
    /// The straight line sensor = scale · board + bias; `None` where there are too few samples for one.
    pub line: Option<DepthLine>,
}

/// The sensor's depth at each corner, metres, as observed; `None` on holes and outside the map.
pub fn sense(map: &DepthMap, corners: &[Corner]) -> Vec<Option<f64>> {
    corners.iter().map(|corner| map.bilinear(corner.pixel)).collect()
}

/// Compares sensor and board. Each item is a view with what [`sense`] read at its corners (in the order of
/// `view.corners`; panics where the lengths differ).
pub fn against_board(board: &CharucoBoard, views: &[(&View, &[Option<f64>])]) -> BoardDepth {
    let frames: Vec<FrameDepth> =
        views.iter().map(|(view, sensed)| frame_depth(board, view, sensed)).collect();
    let medians: Vec<f64> = frames.iter().filter_map(|f| f.median_error_m).collect();
    let line = DepthLine::fit(board, &frames);
    BoardDepth { frames, mean_of_medians_m: mean(&medians), line }
}

fn frame_depth(board: &CharucoBoard, view: &View, sensed: &[Option<f64>]) -> FrameDepth {
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
                board_m: (view.color_from_board * board.corner(corner.id)).z(),
                sensor_m: (*sensed)?,
            })
        })
        .collect();
    let n_holes = view.corners.len() - samples.len();
    let mut frame =
        FrameDepth { frame: view.frame, samples, n_holes, n_beyond: 0, median_error_m: None };
    let errors: Vec<f64> = frame.kept().map(Sample::error_m).collect();
    frame.n_beyond = frame.samples.len() - errors.len();
    frame.median_error_m = median(errors);
    frame
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    values.sort_by(f64::total_cmp);
    let n = values.len();
    Some(f64::midpoint(values[(n - 1) / 2], values[n / 2]))
}

fn mean(values: &[f64]) -> Option<Estimate> {
    let n = values.len() as f64;
    if values.is_empty() {
        return None;
    }
    let value = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (n - 1.0);
    let sigma = if values.len() > 1 { (variance / n).sqrt() } else { f64::INFINITY };
    Some(Estimate { value, sigma })
}
