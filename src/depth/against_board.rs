//! The error of every corner, frame by frame.

use crate::{
    board::CharucoBoard,
    calibrate::{BoardSurface, Estimate},
    depth::DepthLine,
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
    let line = DepthLine::fit(board, &frames);
    BoardDepth { frames, mean_of_medians_m: mean_of(&medians), line }
}

/// Where a corner lies on the board as it is.
pub(crate) fn corner_on(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    id: usize,
) -> Point<Board> {
    let mut point = board.corner(id);
    if let Some(surface) = surface {
        point.coords.z += surface.heights_m[id];
    }
    point
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

    /// A reproducible normal deviate: the sum of twelve uniform ones (a linear congruential generator), minus six.
    struct Noise(u64);
    impl Noise {
        fn uniform(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
        fn normal(&mut self) -> f64 {
            (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
        }
    }

    fn board() -> &'static CharucoBoard {
        static BOARD: LazyLock<CharucoBoard> =
            LazyLock::new(|| CharucoBoard::paper(0.020875).unwrap());
        &BOARD
    }

    fn view(frame: usize, distance_m: f64, tilt_rad: f64) -> View {
        let corners = (0..board().n_corners())
            .map(|id| Corner { id, pixel: Pixel::new(id as f64, 1.0), sigma_px: 0.1 })
            .collect::<Vec<_>>();
        let rotation = Rotation::from_scaled_axis(Vector3::new(0.0, tilt_rad, 0.0));
        View {
            frame,
            residuals_px: vec![[0.0; 2]; corners.len()],
            corners,
            color_from_board: Pose::new(rotation, Vector3::new(-0.1, -0.08, distance_m)),
            rms_px: 0.0,
        }
    }

    fn board_z(view: &View, id: usize) -> f64 {
        (view.color_from_board * board().corner(id)).z()
    }

    #[test]
    fn sign_holes_and_drops() {
        let view = view(3, 0.2, 0.0);
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
        assert!(depth.line.is_none());
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

    /// Sensors with known scale and bias, pose errors shared by each view, a wavy board, noise and outliers.
    fn line(scale: f64, bias_m: f64, seed: u64) -> DepthLine {
        let mut noise = Noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let views: Vec<View> = (0..25)
            .map(|i| view(i, 0.18 + 0.008 * i as f64, 0.4 * (noise.uniform() - 0.5)))
            .collect();
        let wave: Vec<f64> = (0..board().n_corners())
            .map(|id| {
                let (column, row) = board().corner_cell(id);
                0.0008 * (0.8 * column as f64).sin() * (0.7 * row as f64).cos()
            })
            .collect();
        let sensed: Vec<Vec<Option<f64>>> = views
            .iter()
            .map(|view| {
                let pose_error = 0.001 * noise.normal();
                (0..view.corners.len())
                    .map(|id| {
                        let truth = board_z(view, id) + wave[id] + pose_error;
                        let outlier = if noise.uniform() < 0.05 { 0.05 } else { 0.0 };
                        Some(scale * truth + bias_m + 0.0005 * noise.normal() + outlier)
                    })
                    .collect()
            })
            .collect();
        let pairs: Vec<_> = views.iter().zip(&sensed).map(|(v, s)| (v, s.as_slice())).collect();
        against_board(board(), None, &pairs).line.unwrap()
    }

    #[test]
    fn scale_and_bias_with_honest_sigmas() {
        for (scale, bias_m) in [(1.0, 0.0), (1.06, 0.0), (0.97, 0.004), (1.0, -0.01)] {
            let mut squares = [0.0; 3];
            let n = 200;
            for seed in 0..n {
                let line = line(scale, bias_m, seed + 1);
                let truth_at_center = (scale - 1.0) * line.center_m + bias_m;
                squares[0] += ((line.scale.value - scale) / line.scale.sigma).powi(2);
                squares[1] += ((line.bias_m.value - bias_m) / line.bias_m.sigma).powi(2);
                squares[2] +=
                    ((line.offset_m.value - truth_at_center) / line.offset_m.sigma).powi(2);
                assert!(line.scale.sigma < 0.01 && line.correlation < -0.9, "{line:?}");
            }
            // Mean square of the normalised errors: 1 where the sigmas are right. 200 draws leave ±0.1; sigmas are the
            // largest of four, so somewhat below 1.
            for square in squares.map(|s| s / n as f64) {
                assert!((0.3..1.5).contains(&square), "{scale} {bias_m}: {squares:?}");
            }
        }
    }

    #[test]
    fn one_distance_does_not_tell_scale_from_bias() {
        let views: Vec<View> = (0..5).map(|i| view(i, 0.2 + 0.0002 * i as f64, 0.0)).collect();
        let mut noise = Noise(7);
        let sensed: Vec<Vec<Option<f64>>> = views
            .iter()
            .map(|v| {
                (0..63).map(|id| Some(0.98 * board_z(v, id) + 0.0005 * noise.normal())).collect()
            })
            .collect();
        let pairs: Vec<_> = views.iter().zip(&sensed).map(|(v, s)| (v, s.as_slice())).collect();
        let line = against_board(board(), None, &pairs).line.unwrap();
        assert!(line.scale.sigma > 0.05, "{line:?}");
        assert!(
            (line.offset_m.value + 0.004).abs() < 3.0 * line.offset_m.sigma.max(1e-4),
            "{line:?}"
        );
    }
}
