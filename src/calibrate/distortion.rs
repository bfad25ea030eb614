//! How much of the lens' distortion is left in the stream.

use super::{
    DistortionTest, Estimate, Hypothesis, Input, Lens,
    auto::{Prepared, behind_sigmas, fit_in_motion, fit_prepared, shape_rms_px},
    fit::Fit,
    model::{Aspect, Center, Shape, Warp, brown},
    surface::Surface,
};
use crate::{
    camera::{Intrinsics, RadialTable, TablePair},
    math, par,
};

/// Fits every hypothesis; `None` where the views do not determine k1.
pub(super) fn test(input: &Input<'_>, prepared: &Prepared) -> Option<DistortionTest> {
    let mut warps = vec![(Lens::None, Warp::None)];
    if let Some(TablePair { forward, inverse }) = input.tables {
        warps.extend([
            (Lens::InverseTable, Warp::Table(inverse)),
            (Lens::ForwardTable, Warp::Table(forward)),
            (Lens::FreeTable, Warp::FreeTable(inverse)),
        ]);
    }
    warps.extend([(Lens::FreeRadial, Warp::FreeRadial1), (Lens::FreeRadial, Warp::FreeRadial2)]);
    let mut found = par::map(&warps, |&(lens, warp)| {
        let shape = shape_of(warp, prepared.surface);
        let fit = fit_in_motion(input, prepared, shape).filter(|fit| fit.covariance.is_some())?;
        let flat = Shape { surface: Surface::Flat, ..shape };
        let flat_rms_px = match prepared.surface {
            Surface::Flat => shape_rms_px(input, prepared, shape, &fit),
            Surface::Bend | Surface::Free => {
                shape_rms_px(input, prepared, flat, &fit_prepared(input, prepared, flat)?)
            }
        };
        let hypothesis = Hypothesis {
            lens,
            rms_px: shape_rms_px(input, prepared, shape, &fit),
            flat_rms_px,
            held_out_rms_px: prepared.held_out_rms_px(&fit).value,
            focal_px: fit.focal_px(),
            center_px: [fit.estimate(1), fit.estimate(2)],
        };
        Some((hypothesis, fit))
    });
    let two = found.pop()?;
    let one = found.pop()??;
    // A second number only where held-out pictures ask for it.
    let two = two.filter(|(_, fit)| behind_sigmas(&one.1, fit) > 1.0);
    let is_two = two.is_some();
    let (radial, by_radial) = two.unwrap_or(one);
    let mut hypotheses = Vec::new();
    let mut by_table = None;
    for (hypothesis, fit) in found.into_iter().flatten() {
        if let (Lens::FreeTable, Some(tables)) = (hypothesis.lens, input.tables) {
            by_table = Some((fit, &tables.inverse));
        }
        hypotheses.push(hypothesis);
    }
    hypotheses.push(radial);

    let corner_shift_px = match &by_table {
        Some((fit, table)) => propagate(fit, |free| Some(table_shift_px(table, free[3]))),
        None => {
            let n_radial = if is_two { 2 } else { 1 };
            propagate(&by_radial, |free| {
                radial_shift_px(input.factory, free, &free[3..3 + n_radial])
            })
        }
    };
    Some(DistortionTest {
        amplitude: by_table.as_ref().map(|(fit, _)| fit.estimate(3)),
        k1: by_radial.estimate(3),
        k2: is_two.then(|| by_radial.estimate(4)),
        corner_shift_px,
        table_corner_shift_px: input.tables.map(|tables| table_shift_px(&tables.inverse, 1.0)),
        hypotheses,
    })
}

fn shape_of(warp: Warp<'_>, surface: Surface) -> Shape<'_> {
    Shape { center: Center::Free, warp, aspect: Aspect::Fixed, surface }
}

/// How far the farthest corner lies outside its rectilinear place: r − (1 + a·m(r))·r.
fn table_shift_px(table: &RadialTable, amplitude: f64) -> f64 {
    -amplitude * table.magnification_at(table.max_radius_px) * table.max_radius_px
}

/// The same with Brown's polynomial; `None` where it folds before the corner.
fn radial_shift_px(factory: &Intrinsics, free: &[f64], radial: &[f64]) -> Option<f64> {
    let fy = free[0] * (factory.fy / factory.fx);
    let pinhole = Intrinsics { fx: free[0], fy, cx: free[1], cy: free[2], ..*factory };
    let edge = |c: f64, size: usize| {
        let last = size as f64 - 0.5;
        if c + 0.5 > last - c { -0.5 - c } else { last - c }
    };
    let corner = [
        edge(pinhole.cx, pinhole.width) / pinhole.fx,
        edge(pinhole.cy, pinhole.height) / pinhole.fy,
    ];
    let straight = brown(radial).undistort(corner)?;
    let length = |ray: [f64; 2]| math::hypot(ray[0] * pinhole.fx, ray[1] * pinhole.fy);
    Some(length(corner) - length(straight))
}

/// A function of the free numbers, with the σ that their covariance gives it to first order. NaN and infinite where
/// the function has no value.
fn propagate(fit: &Fit, function: impl Fn(&[f64]) -> Option<f64>) -> Estimate {
    let n = fit.free.len() + fit.knots_m.len();
    let value = function(&fit.free).unwrap_or(f64::NAN);
    let slope: Vec<f64> = (0..fit.free.len())
        .map(|i| {
            // Half a σ to both sides.
            let step = 0.5 * fit.estimate(i).sigma;
            let at = |h: f64| {
                let mut moved = fit.free.clone();
                moved[i] += h;
                function(&moved)
            };
            match (at(step), at(-step)) {
                (Some(high), Some(low)) if step > 0.0 => (high - low) / (2.0 * step),
                _ => f64::NAN,
            }
        })
        .collect();
    let mut variance = 0.0;
    if let Some(covariance) = &fit.covariance {
        for i in 0..slope.len() {
            for j in 0..slope.len() {
                variance += slope[i] * covariance[i * n + j] * slope[j];
            }
        }
    }
    let sigma = if variance.is_finite() { variance.max(0.0).sqrt() } else { f64::INFINITY };
    Estimate { value, sigma }
}
