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
    let problem =
        Reprojection::<S> { shape, factory: data.factory, views: data.views, loss: data.loss };
    let shared: [f64; S] = free.try_into().expect("dispatched on the length");
    let start = Arrow { shared, blocks: poses.to_vec() };
    let minimum = minimize(&BySchur(&problem), start, Effort::default())?;

    // The robust sum of squares, but for the rare corner beyond the loss' threshold, is the weighted one.
    let variance = 2.0 * minimum.cost / degrees as f64;
    let mut pictures = vec![Reduced::<S>::ZERO; data.n_pictures()];
    let mut held_out = vec![0.0; data.n_pictures()];
    let mut diagonal = [0.0; S];
    let mut reducible = true;
    for (block, &picture) in minimum.normal.iter().zip(data.pictures) {
        match block.reduce() {
            Some(reduced) => pictures[picture].add(&reduced),
            None => reducible = false,
        }
        held_out[picture] += 2.0 * block.cost();
        for (sum, d) in diagonal.iter_mut().zip(block.shared_diagonal()) {
            *sum += d;
        }
    }
    let determined = reducible && is_determined(&total(&pictures), &diagonal);
    let covariance = determined.then(|| covariance(&pictures, variance)).flatten();
    for (sum, rise) in held_out.iter_mut().zip(leave_one_out_rise(&pictures)) {
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
fn covariance<const S: usize>(pictures: &[Reduced<S>], variance: f64) -> Option<Vec<f64>> {
    let classical = classical(pictures, variance)?;
    let joined = match clustered(pictures) {
        Some(clustered) => larger(&classical, &clustered),
        None => classical,
    };
    Some(joined.into_iter().flatten().collect())
}
