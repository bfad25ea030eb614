//! Scale and bias of the sensor.

use nalgebra::DVector;

use super::{
    FrameDepth,
    clustered::{Clustered, Equation},
};
use crate::{board::CharucoBoard, calibrate::Estimate};

/// The straight line through all samples,
///
/// ```text
/// sensor = scale · board + bias
/// ```
///
/// fitted robustly (least absolute deviations, then Tukey's biweight with the scale from their median), samples beyond
/// [`MAX_ERROR_M`](super::MAX_ERROR_M) included where they lie near the line: a wrong scale must not cut off its own
/// evidence.
///
/// **Sigmas** allow for errors that the corners of a view share (its pose) and for errors that a part of the board
/// shares over all views (its waviness). They do *not* know errors common to everything: a focal length wrong by
/// 1 % makes the board's depth, and so the scale, wrong by 1 %, and so does a wrong square length. Whoever judges has
/// to add the focal length's sigma.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthLine {
    /// 1 for a true sensor.
    pub scale: Estimate,
    /// Where the line meets board = 0, metres. Strongly correlated with the scale: see `correlation`.
    pub bias_m: Estimate,
    /// Correlation of scale and bias, −1 to 1.
    pub correlation: f64,
    /// Mean depth of the board over the samples, metres.
    pub center_m: f64,
    /// Sensor minus board at `center_m`, metres: what the two amount to where the data lie.
    pub offset_m: Estimate,
    /// Smallest and largest depth of the board, metres.
    pub range_m: [f64; 2],
    /// Robust standard deviation of the samples about the line, metres.
    pub residual_m: f64,
    /// Samples.
    pub n_samples: usize,
    /// Frames they come from.
    pub n_frames: usize,
}

/// The residual scale is never taken smaller than this, metres: depth is quantised to 0.1 mm on disk.
const LEAST_RESIDUAL_M: f64 = 1e-4;
/// Tukey's biweight keeps 95 % efficiency under normal noise with this multiple of the standard deviation.
const TUKEY: f64 = 4.685;
/// Median absolute deviation to standard deviation under normal noise.
const SIGMA_FROM_MAD: f64 = 1.4826;

impl DepthLine {
    /// Sensor minus board at this depth of the board, metres, as the line has it.
    ///
    /// The sigma takes offset and slope as independent: they are so at `center_m`, where all samples weigh the same.
    pub fn error_at_m(&self, board_m: f64) -> Estimate {
        let from_center_m = board_m - self.center_m;
        Estimate {
            value: self.offset_m.value + (self.scale.value - 1.0) * from_center_m,
            sigma: self.offset_m.sigma.hypot(self.scale.sigma * from_center_m),
        }
    }

    /// `None` for fewer than 20 samples, fewer than 3 frames, or less than 0.1 mm between the nearest and the
    /// farthest corner.
    pub(super) fn fit(board: &CharucoBoard, frames: &[FrameDepth]) -> Option<Self> {
        let samples: Vec<_> = frames.iter().flat_map(|f| &f.samples).collect();
        let n_frames = frames.iter().filter(|f| !f.samples.is_empty()).count();
        let n = samples.len();
        if n < 20 || n_frames < 3 {
            return None;
        }
        let center_m = samples.iter().map(|s| s.board_m).sum::<f64>() / n as f64;
        let nearest = samples.iter().map(|s| s.board_m).fold(f64::INFINITY, f64::min);
        let farthest = samples.iter().map(|s| s.board_m).fold(0.0, f64::max);
        if !(farthest - nearest > 1e-4) {
            return None;
        }
        // sensor − board = offset + (scale − 1)·(board − center)
        let points: Vec<[f64; 2]> =
            samples.iter().map(|s| [s.board_m - center_m, -s.error_m()]).collect();
        let [mut offset, mut slope] = weighted_line(&points, &|_| 1.0)?;
        for _ in 0..50 {
            [offset, slope] = weighted_line(&points, &|[x, y]| {
                (y - offset - slope * x).abs().max(LEAST_RESIDUAL_M).recip()
            })?;
        }
        let mut deviations: Vec<f64> =
            points.iter().map(|[x, y]| (y - offset - slope * x).abs()).collect();
        deviations.sort_by(f64::total_cmp);
        let residual_m = (SIGMA_FROM_MAD * deviations[n / 2]).max(LEAST_RESIDUAL_M);
        let reach = TUKEY * residual_m;
        let weight =
            |e: f64| if e.abs() < reach { (1.0 - (e / reach).powi(2)).powi(2) } else { 0.0 };
        for _ in 0..50 {
            [offset, slope] = weighted_line(&points, &|[x, y]| weight(y - offset - slope * x))?;
        }

        let columns = board.squares_x - 1;
        let rows = board.squares_y - 1;
        let equations: Vec<Equation> = samples
            .iter()
            .zip(&points)
            .map(|(sample, [x, y])| {
                let e = y - offset - slope * x;
                let u = (e / reach).powi(2);
                let curvature = if u < 1.0 { (1.0 - u) * (1.0 - 5.0 * u) } else { 0.0 };
                let (column, row) = board.corner_cell(sample.corner);
                Equation {
                    x: DVector::from_column_slice(&[1.0, *x]),
                    score: weight(e) * e,
                    curvature,
                    groups: [sample.frame, (row * 3 / rows) * 4 + column * 4 / columns],
                }
            })
            .collect();
        let spread = Clustered::new(&equations)?;
        // bias = offset − (scale − 1)·center
        let (of_scale, of_bias) = ([0.0, 1.0], [1.0, -center_m]);
        let (sigma_scale, sigma_bias) = (spread.sigma(&of_scale), spread.sigma(&of_bias));
        Some(Self {
            scale: Estimate { value: 1.0 + slope, sigma: sigma_scale },
            bias_m: Estimate { value: offset - slope * center_m, sigma: sigma_bias },
            correlation: (spread.covariance(&of_bias, &of_scale) / (sigma_scale * sigma_bias))
                .clamp(-1.0, 1.0),
            center_m,
            offset_m: Estimate { value: offset, sigma: spread.sigma(&[1.0, 0.0]) },
            range_m: [nearest, farthest],
            residual_m,
            n_samples: n,
            n_frames,
        })
    }
}

/// The weighted least-squares line y = a + b·x as [a, b]; `None` where the weights leave less than two places.
fn weighted_line(points: &[[f64; 2]], weight: &dyn Fn(&[f64; 2]) -> f64) -> Option<[f64; 2]> {
    let (mut w, mut wx, mut wy) = (0.0, 0.0, 0.0);
    for point in points {
        let each = weight(point);
        w += each;
        wx += each * point[0];
        wy += each * point[1];
    }
    let (mx, my) = (wx / w, wy / w);
    let (mut wxx, mut wxy) = (0.0, 0.0);
    for point in points {
        let each = weight(point);
        wxx += each * (point[0] - mx).powi(2);
        wxy += each * (point[0] - mx) * (point[1] - my);
    }
    let slope = wxy / wxx;
    slope.is_finite().then_some([my - slope * mx, slope])
}
