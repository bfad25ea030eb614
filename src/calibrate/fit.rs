//! One fit: a shape to views, and what follows from the normal equations at its minimum.

use super::{
    Estimate,
    model::Shape,
    problem::{Measured, Reprojection},
};
use crate::{
    camera::Intrinsics,
    geom::{Board, Color, Pose},
    solve::{
        Arrow, BySchur, Cholesky, Effort, Loss, Reduced, classical, clustered, larger,
        leave_one_out_rise, minimize, total,
    },
};

/// What a fit is made from.
#[derive(Clone, Copy)]
pub(super) struct Data<'a> {
    pub(super) factory: &'a Intrinsics,
    pub(super) views: &'a [&'a Measured],
    /// For each view the number of the picture it is one of; pictures count from 0 without gaps.
    pub(super) pictures: &'a [usize],
    pub(super) loss: Loss,
    /// The σ of each mode of the board's surface beforehand, metres.
    pub(super) surface_sigma_m: f64,
    /// As [`Effort::cost_tolerance`].
    pub(super) cost_tolerance: f64,
}

impl Data<'_> {
    pub(super) fn n_pictures(&self) -> usize {
        self.pictures.iter().max().map_or(0, |last| last + 1)
    }

    fn n_corners(&self) -> usize {
        self.views.iter().map(|view| view.corners.len()).sum()
    }
}

/// A fit at its minimum.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// The free numbers, as [`Shape`] orders them.
    pub(super) free: Vec<f64>,
    pub(super) poses: Vec<Pose<Color, Board>>,
    /// Covariance of `free`, row-major; `None` where the views do not determine them.
    pub(super) covariance: Option<Vec<f64>>,
    /// For each picture the (robust, weighted) sum of squares with the intrinsics of all others; infinite where
    /// these do not determine them.
    pub(super) held_out: Vec<f64>,
}

impl Fit {
    pub(super) fn estimate(&self, index: usize) -> Estimate {
        let n = self.free.len();
        let variance = self.covariance.as_ref().map_or(f64::INFINITY, |c| c[index * n + index]);
        Estimate { value: self.free[index], sigma: variance.sqrt() }
    }

    pub(super) fn focal_px(&self) -> Estimate {
        self.estimate(0)
    }
}

/// The least-squares fit of `shape` from `free` and `poses`. `None` where the start does not project, or there are
/// fewer residuals than parameters.
pub(super) fn fit(
    shape: Shape<'_>,
    data: &Data<'_>,
    free: &[f64],
    poses: &[Pose<Color, Board>],
) -> Option<Fit> {
    match free.len() {
        1 => fit_sized::<1>(shape, data, free, poses),
        3 => fit_sized::<3>(shape, data, free, poses),
        4 => fit_sized::<4>(shape, data, free, poses),
        5 => fit_sized::<5>(shape, data, free, poses),
        8 => fit_sized::<8>(shape, data, free, poses),
        13 => fit_sized::<13>(shape, data, free, poses),
        15 => fit_sized::<15>(shape, data, free, poses),
        16 => fit_sized::<16>(shape, data, free, poses),
        17 => fit_sized::<17>(shape, data, free, poses),
        20 => fit_sized::<20>(shape, data, free, poses),
        n => unreachable!("no shape has {n} free numbers"),
    }
}

fn fit_sized<const S: usize>(
    shape: Shape<'_>,
    data: &Data<'_>,
    free: &[f64],
    poses: &[Pose<Color, Board>],
) -> Option<Fit> {
    let degrees =
        (2 * data.n_corners()).checked_sub(S + 6 * data.views.len()).filter(|&d| d > 0)?;
    let problem = Reprojection::<S> {
        shape,
        factory: data.factory,
        views: data.views,
        loss: data.loss,
        surface_sigma_m: data.surface_sigma_m,
    };
    let shared: [f64; S] = free.try_into().expect("dispatched on the length");
    let start = Arrow { shared, blocks: poses.to_vec() };
    let effort = Effort { cost_tolerance: data.cost_tolerance, ..Effort::default() };
    let minimum = minimize(&BySchur(&problem), start, effort)?;

    // The robust sum of squares, but for the rare corner beyond the loss' threshold, is the weighted one.
    let variance = 2.0 * minimum.cost / degrees as f64;
    let mut pictures = vec![Reduced::<S>::ZERO; data.n_pictures()];
    let mut held_out = vec![0.0; data.n_pictures()];
    let mut diagonal = [0.0; S];
    let mut reducible = true;
    for (block, &picture) in minimum.normal.blocks.iter().zip(data.pictures) {
        match block.reduce() {
            Some(reduced) => pictures[picture].add(&reduced),
            None => reducible = false,
        }
        held_out[picture] += 2.0 * block.cost();
        for (sum, d) in diagonal.iter_mut().zip(block.shared_diagonal()) {
            *sum += d;
        }
    }
    let mut all = total(&pictures);
    all.add(&minimum.normal.prior);
    let determined = reducible && is_determined(&all, &diagonal);
    let covariance = determined.then(|| covariance(&all, &pictures, variance)).flatten();
    for (sum, rise) in held_out.iter_mut().zip(leave_one_out_rise(&all, &pictures)) {
        *sum = match rise {
            Some(rise) if covariance.is_some() => *sum + rise,
            _ => f64::INFINITY,
        };
    }
    Some(Fit {
        free: minimum.state.shared.to_vec(),
        poses: minimum.state.blocks,
        covariance,
        held_out,
    })
}

/// Is anything left of each parameter's information once the poses and the other parameters have taken theirs?
///
/// Eliminating the poses subtracts nearly equal numbers where they can imitate a parameter; below 1e-9 of the whole
/// the difference is rounding.
fn is_determined<const S: usize>(all: &Reduced<S>, diagonal: &[f64; S]) -> bool {
    const LEAST_SHARE: f64 = 1e-9;
    let Some(factor) = Cholesky::new(&all.information) else { return false };
    let inverse = factor.inverse();
    (0..S).all(|i| inverse[i][i] > 0.0 && 1.0 / inverse[i][i] > LEAST_SHARE * diagonal[i])
}

/// The larger of the classical covariance and that clustered by picture, row-major. With a single picture there is
/// only the classical one.
fn covariance<const S: usize>(
    all: &Reduced<S>,
    pictures: &[Reduced<S>],
    variance: f64,
) -> Option<Vec<f64>> {
    let classical = classical(all, variance)?;
    let joined = match clustered(all, pictures) {
        Some(clustered) => larger(&classical, &clustered),
        None => classical,
    };
    Some(joined.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibrate::{
            Input,
            model::{Center, Warp},
            surface::Surface,
            synthetic::{FACTORY, Scene, board},
            views::all_usable,
        },
        camera::Distortion,
        pose::Weighting,
    };

    /// The held-out sums by one step of the normal equations, against refits without each view.
    #[test]
    fn held_out_sums_are_those_of_refits() {
        let board = board();
        let frames = Scene { noise_px: 0.3, ..Scene::new(Distortion::None) }.frames(2);
        let input = Input { board: &board, factory: &FACTORY, tables: None, frames: &frames };
        let gathered = all_usable(&input, 6, Weighting::Equal);
        let views: Vec<&Measured> = gathered.views.iter().collect();
        let poses: Vec<_> = gathered.views.iter().map(|v| v.pose).collect();
        let (center, warp, surface) = (Center::Free, Warp::FreeRadial2, Surface::Flat);
        let shape = Shape { center, warp, surface };
        let fit_of = |views: &[&Measured], shape: Shape<'_>, free: &[f64], poses: &[_]| {
            let pictures: Vec<usize> = (0..views.len()).collect();
            let data = Data {
                factory: &FACTORY,
                views,
                pictures: &pictures,
                loss: Loss::Squared,
                surface_sigma_m: 1e-3,
                cost_tolerance: 1e-12,
            };
            fit(shape, &data, free, poses).unwrap()
        };
        let whole = fit_of(&views, shape, &shape.start(&FACTORY), &poses);
        for left_out in 0..views.len() {
            let others: Vec<usize> = (0..views.len()).filter(|i| *i != left_out).collect();
            let their_views: Vec<&Measured> = others.iter().map(|i| views[*i]).collect();
            let their_poses: Vec<_> = others.iter().map(|i| poses[*i]).collect();
            let refit = fit_of(&their_views, shape, &whole.free, &their_poses);
            let camera = shape.camera(&FACTORY, None, &refit.free);
            let corners = &views[left_out].corners;
            let view =
                crate::pose::View::from_corners(0, &board, &camera, corners, Weighting::Equal)
                    .unwrap();
            let truth = view.rms_px.powi(2) * corners.len() as f64;
            let predicted = whole.held_out[left_out];
            assert!((predicted / truth - 1.0).abs() < 0.02, "{predicted} {truth}");
        }
    }
}
