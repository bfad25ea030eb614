//! How much each corner says, and which say something else than all others.

use super::{Outlier, RejectedFrame, Rejection, problem::Measured};
use crate::math;
use crate::solve::{median, quantile};

/// The median of |x|² for a 2-D normal with unit variance per coordinate.
const MEDIAN_SQUARE: f64 = 2.0 * std::f64::consts::LN_2;

/// A corner farther off than so many standard deviations is an outlier: of independent normal ones one in 10⁷ is
/// (exp(−6²/2) = 1.5e-8).
const OUTLIER_SIGMAS: f64 = 6.0;

/// A frame with more than this share of outliers is left out whole.
const FRAME_OUTLIER_SHARE: f64 = 1.0 / 3.0;

/// Sets the weights 1/(scale²·(σ² + floor²)) of all corners such that the median of the residuals is what their σ
/// say; `share` is the degrees of freedom per residual.
///
/// The floor is what no corner is better than, whatever its σ: an uneven board, a lens not quite described. It is the
/// one that makes the median of |residual|²/(σ² + floor²) that of a 2-D normal (a robust form of Mandel and Paule's
/// estimator); where already σ alone are too large it is zero, and `scale` < 1 shrinks them. So only the *ratios* of
/// the given σ are believed.
pub(super) fn weigh(views: &mut [Measured], residuals_px: &[Vec<[f64; 2]>], share: f64) {
    let sigmas: Vec<f64> = views.iter().flat_map(|v| &v.corners).map(|c| c.sigma_px).collect();
    let given: Vec<f64> = sigmas.iter().copied().filter(|s| *s > 0.0 && s.is_finite()).collect();
    let usual = if given.is_empty() { 1.0 } else { median(&given) };
    let variance = |sigma: f64| {
        let sigma = if sigma > 0.0 && sigma.is_finite() { sigma } else { usual };
        sigma * sigma
    };
    let squares: Vec<f64> = residuals_px.iter().flatten().map(|[x, y]| x * x + y * y).collect();
    let target = MEDIAN_SQUARE * share;
    let normalised_median = |floor2: f64| {
        let ratios: Vec<f64> =
            squares.iter().zip(&sigmas).map(|(r2, s)| r2 / (variance(*s) + floor2)).collect();
        median(&ratios)
    };
    let mut floor2 = 0.0;
    let mut scale2 = 1.0;
    let bare = normalised_median(0.0);
    if bare > target {
        let (mut low, mut high) = (0.0, quantile(&squares, 0.5) / target);
        for _ in 0..60 {
            floor2 = f64::midpoint(low, high);
            if normalised_median(floor2) > target { low = floor2 } else { high = floor2 }
        }
    } else if bare > 0.0 {
        scale2 = bare / target;
    }
    for view in views {
        for (corner, weight) in view.corners.iter().zip(&mut view.weights) {
            *weight = 1.0 / (scale2 * (variance(corner.sigma_px) + floor2));
        }
    }
}

/// Takes the outliers out of `views`, and whole views that are mostly outliers or have too few corners left.
pub(super) fn drop_outliers(
    views: &mut Vec<Measured>,
    residuals_px: &[Vec<[f64; 2]>],
    min_corners: usize,
) -> (Vec<Outlier>, Vec<RejectedFrame>) {
    let mut outliers = Vec::new();
    let mut rejected = Vec::new();
    let mut kept = Vec::with_capacity(views.len());
    for (mut view, residuals) in std::mem::take(views).into_iter().zip(residuals_px) {
        let off: Vec<f64> = residuals
            .iter()
            .zip(&view.weights)
            .map(|([x, y], weight)| (weight * (x * x + y * y)).sqrt())
            .collect();
        let n_corners = view.corners.len();
        let n_outliers = off.iter().filter(|s| **s > OUTLIER_SIGMAS).count();
        if n_outliers as f64 > FRAME_OUTLIER_SHARE * n_corners as f64
            || (n_outliers > 0 && n_corners - n_outliers < min_corners)
        {
            let reason = Rejection::Disagrees { n_outliers, n_corners };
            rejected.push(RejectedFrame { frame: view.frame, reason });
            continue;
        }
        for (index, sigmas) in off.iter().enumerate().filter(|(_, s)| **s > OUTLIER_SIGMAS) {
            let [x, y] = residuals[index];
            outliers.push(Outlier {
                frame: view.frame,
                id: view.corners[index].id,
                residual_px: math::hypot(x, y),
                residual_sigmas: *sigmas,
            });
        }
        let inlier = |index: usize| off[index] <= OUTLIER_SIGMAS;
        retain_indices(&mut view.corners, inlier);
        retain_indices(&mut view.points, inlier);
        retain_indices(&mut view.weights, inlier);
        kept.push(view);
    }
    *views = kept;
    (outliers, rejected)
}

fn retain_indices<T>(values: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut index = 0;
    values.retain(|_| {
        index += 1;
        keep(index - 1)
    });
}
