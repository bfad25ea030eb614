//! One fit: a shape to views, and what follows from the normal equations at its minimum.

use super::{
    Estimate, RollingShutter,
    model::{Center, Shape},
    motion::{Joint, MeanMotion},
    problem::{MOTION_SIGMA, Measured, Reprojection},
    surface::{Form, Sheet},
};
use crate::{
    camera::Intrinsics,
    geom::{Board, Color, Pose},
    math,
    solve::{
        Arrow, ArrowNormal, BySchur, DenseCholesky, Effort, Loss, Pooled, Reduced, Row,
        covariance_of, larger, minimize, total, units,
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
    pub(super) sheet: &'a Sheet,
    /// As [`Effort::cost_tolerance`].
    pub(super) cost_tolerance: f64,
    pub(super) wanted: Wanted,
}

/// How much is asked of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The camera's numbers and their covariance.
    Camera,
    /// These, and what motion while rows are read does to the centre's σ.
    CameraInMotion,
    /// Those of the surface and of the poses, too.
    Everything,
}

impl Data<'_> {
    pub(super) fn n_pictures(&self) -> usize {
        self.pictures.iter().max().map_or(0, |last| last + 1)
    }

    fn n_corners(&self) -> usize {
        self.views.iter().map(|view| view.corners.len()).sum()
    }
}

/// Where a fit begins.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    /// The free numbers, as [`Shape`] orders them.
    pub(super) free: &'a [f64],
    /// The heights of a free surface; those missing are zero.
    pub(super) knots_m: &'a [f64],
    pub(super) poses: &'a [Pose<Color, Board>],
}

/// A fit at its minimum.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// The free numbers, as [`Shape`] orders them.
    pub(super) free: Vec<f64>,
    /// The heights of the board's corners, metres; none unless the surface is free.
    pub(super) knots_m: Vec<f64>,
    pub(super) poses: Vec<Pose<Color, Board>>,
    /// Covariance of `free` and after these `knots_m`, row-major; `None` where the views do not determine them. Where
    /// [`Wanted::Everything`] was, that of the knots' heights from the board's own plane, the larger of both variances
    /// each; else classical, and from where the poses are counted.
    pub(super) covariance: Option<Vec<f64>>,
    /// For each picture the (robust, weighted) sum of squares with the intrinsics of all others; infinite where
    /// these do not determine them.
    pub(super) held_out: Vec<f64>,
    /// For each picture the focal length that all others have, pixels; `None` where these do not determine it.
    pub(super) left_out_focal_px: Vec<Option<f64>>,
    /// What becomes of the fit where views may move while their rows are read; not where [`Wanted::Camera`] was.
    pub(super) shutter: Option<Shutter>,
    /// How the poses go with the camera; only where [`Wanted::Everything`] was.
    pub(super) motion: Option<MeanMotion>,
}

impl Fit {
    pub(super) fn estimate(&self, index: usize) -> Estimate {
        let n = self.free.len() + self.knots_m.len();
        let variance = self.covariance.as_ref().map_or(f64::INFINITY, |c| c[index * n + index]);
        Estimate { value: self.free[index], sigma: variance.sqrt() }
    }

    pub(super) fn focal_px(&self) -> Estimate {
        self.estimate(0)
    }

    /// The numbers of the board's surface.
    pub(super) fn form(&self, shape: &Shape<'_>) -> Form {
        Form { shared: shape.surface_numbers(&self.free).to_vec(), knots_m: self.knots_m.clone() }
    }

    pub(super) fn start(&self) -> Start<'_> {
        Start { free: &self.free, knots_m: &self.knots_m, poses: &self.poses }
    }
}

/// The same fit with a velocity for each view, one step of the normal equations away.
#[derive(Clone, Debug)]
pub(super) struct Shutter {
    /// The σ of a view's turn from its first row to its last that is likeliest of a few, radians.
    pub(super) turn_sigma_rad: f64,
    /// The residuals' standard deviation as a share of what it is without.
    pub(super) share: f64,
    /// By how much `free` and after these `knots_m` move.
    pub(super) shift: Vec<f64>,
}

/// How much of what motion does counts, 0 to 1, where velocities leave this share of the residuals. A turn while rows
/// are read looks like another principal point; hands turn the same way again and again, so that this does not average
/// out, and its σ has to know.
fn motion_counts(share: f64) -> f64 {
    let [still, moving] = RollingShutter::STILL_TO_MOVING;
    ((still - share) / (still - moving)).clamp(0.0, 1.0)
}

/// The least-squares fit of `shape` from `start`. `None` where the start does not project, or there are fewer residuals
/// than parameters.
pub(super) fn fit(shape: Shape<'_>, data: &Data<'_>, start: Start<'_>) -> Option<Fit> {
    let n_shared = start.free.len();
    let degrees =
        (2 * data.n_corners()).checked_sub(n_shared + 6 * data.views.len()).filter(|&d| d > 0)?;
    let problem = Reprojection {
        shape,
        factory: data.factory,
        views: data.views,
        loss: data.loss,
        sheet: data.sheet,
    };
    let mut loose = start.knots_m.to_vec();
    loose.resize(data.sheet.n_knots(shape.surface), 0.0);
    let start = Arrow { shared: start.free.to_vec(), loose, blocks: start.poses.to_vec() };
    let effort = Effort { cost_tolerance: data.cost_tolerance, ..Effort::default() };
    let minimum = minimize(&BySchur(&problem), start, effort)?;
    let Arrow { shared, loose, blocks: poses } = minimum.state;
    let n = n_shared + loose.len();

    // The robust sum of squares, but for the rare corner beyond the loss' threshold, is the weighted one. Each height
    // that was seen takes one degree of freedom at most: the prior holds them together.
    let degrees = degrees.saturating_sub(loose.len()).max(1);
    let variance = 2.0 * minimum.cost / degrees as f64;
    let mut pictures = vec![Reduced::zero(n); data.n_pictures()];
    let mut held_out = vec![0.0; data.n_pictures()];
    let mut diagonal = vec![0.0; n_shared];
    let mut reducible = true;
    for (block, &picture) in minimum.normal.blocks.iter().zip(data.pictures) {
        reducible &= block.reduce_into(&mut pictures[picture]);
        held_out[picture] += 2.0 * block.cost();
        for (sum, d) in diagonal.iter_mut().zip(block.shared_diagonal()) {
            *sum += d;
        }
    }
    let mut all = total(&pictures);
    all.add(&minimum.normal.prior);
    let pooled = Pooled::new(&all, &pictures)
        .filter(|pooled| reducible && is_determined(pooled, &diagonal, n));
    // Heights from a plane that no picture tells from the poses are as unsure as beforehand, all of them alike, and
    // what makes the residuals of a picture alike is lost in that: heights from the board's own plane are asked for.
    let sums = match data.wanted {
        Wanted::Camera | Wanted::CameraInMotion => units(n_shared, n),
        Wanted::Everything => {
            let mut sums = units(n, n);
            data.sheet.take_planes_out(shape.surface, &mut sums);
            sums
        }
    };
    let covariance = pooled.as_ref().map(|pooled| {
        let mut classical: Vec<f64> = pooled.classical().iter().map(|c| variance * c).collect();
        if data.wanted == Wanted::Everything {
            classical = covariance_of(&sums, &classical);
        }
        // With a single picture there is only the classical one.
        match pooled.clustered_of(&sums) {
            Some(clustered) => larger(&classical, &clustered),
            None => classical,
        }
    });
    let shutter = (data.wanted != Wanted::Camera)
        .then(|| shutter(&problem, &minimum.normal, (&shared, &loose), &poses))
        .flatten();
    let covariance = covariance.map(|covariance| match &shutter {
        Some(shutter) if shape.center == Center::Free => {
            let counts = motion_counts(shutter.share);
            let mut variances: Vec<f64> = (0..3).map(|i| covariance[i * n + i]).collect();
            (1..3).for_each(|i| variances[i] += counts * shutter.shift[i].powi(2));
            larger(&covariance, &variances)
        }
        _ => covariance,
    });
    let left_out = match &pooled {
        Some(pooled) => pooled.leave_one_out(),
        None => vec![None; data.n_pictures()],
    };
    for (sum, left_out) in held_out.iter_mut().zip(&left_out) {
        *sum = left_out.as_ref().map_or(f64::INFINITY, |left_out| *sum + left_out.rise);
    }
    let left_out_focal_px =
        left_out.iter().map(|l| l.as_ref().map(|l| shared[0] + l.shift[0])).collect();
    let motion =
        covariance.as_ref().filter(|_| data.wanted == Wanted::Everything).and_then(|covariance| {
            let planes = data.sheet.plane_steps(shape.surface);
            let joint = Joint { covariance, variance, n_camera: shape.n_camera(&shared) };
            mean_motion(&minimum.normal, &poses, &planes, &joint)
        });
    Some(Fit {
        free: shared,
        knots_m: loose,
        poses,
        covariance,
        held_out,
        left_out_focal_px,
        shutter,
        motion,
    })
}

/// Is anything left of each parameter's information once the poses and the other parameters have taken theirs?
///
/// Eliminating the poses subtracts nearly equal numbers where they can imitate a parameter; below 1e-9 of the whole
/// the difference is rounding.
fn is_determined(pooled: &Pooled<'_>, diagonal: &[f64], n: usize) -> bool {
    const LEAST_SHARE: f64 = 1e-9;
    let inverse = pooled.classical();
    diagonal.iter().enumerate().all(|(i, alone)| {
        let variance = inverse[i * n + i];
        variance > 0.0 && 1.0 / variance > LEAST_SHARE * alone
    })
}

/// How fast views may move, as shares of what a hand does at the most.
const MOTION_SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Would velocities explain the residuals, and what would they change? `None` where the views do not determine them.
///
/// How fast views move is not known beforehand; the more they may, the less they tell of everything else. Of four
/// speeds the likeliest is taken: the velocities are integrated out, and the residuals' own variance is the one of
/// greatest likelihood (up to what is the same for all speeds,
/// −2·ln likelihood = N·ln(sum of squares) + Σ (ln det V − ln det P), V the normal equations of a view's own numbers, P
/// the prior's share of it).
fn shutter(
    problem: &Reprojection<'_>,
    normal: &ArrowNormal<6>,
    (shared, knots_m): (&[f64], &[f64]),
    poses: &[Pose<Color, Board>],
) -> Option<Shutter> {
    let n_residuals: usize = problem.views.iter().map(|view| 2 * view.corners.len()).sum();
    let views: Option<Vec<_>> = (poses.iter().enumerate())
        .map(|(index, pose)| problem.moving_view(index, (shared, knots_m), pose))
        .collect();
    let views = views?;
    let likely = |motion: f64| -> Option<(f64, Shutter)> {
        let sigma = MOTION_SIGMA.map(|sigma| motion * sigma);
        let mut all = normal.prior.clone();
        let (mut gain, mut cost, mut unlikely) = (0.0, 0.0, 0.0);
        for view in &views {
            // Velocities are near zero, to these σ.
            let mut block = view.clone();
            for (k, sigma) in sigma.into_iter().enumerate() {
                let mut d_block = [0.0; 12];
                d_block[6 + k] = 1.0;
                let weight = sigma.powi(-2);
                block.add_block_rows(&[Row { weight, residual: 0.0, d_block }]);
            }
            let (by_own, log_determinant) = block.block_gain()?;
            gain += by_own;
            unlikely +=
                log_determinant + 2.0 * sigma.iter().map(|sigma| math::ln(*sigma)).sum::<f64>();
            cost += 2.0 * block.cost();
            if !block.reduce_into(&mut all) {
                return None;
            }
        }
        let shift = DenseCholesky::new(all.information.clone(), all.n())?.solve(&all.score);
        gain += shift.iter().zip(&all.score).map(|(step, score)| step * score).sum::<f64>();
        let degrees = |per_view: usize| {
            n_residuals
                .checked_sub(all.n() + per_view * poses.len())
                .filter(|d| *d > 0)
                .map(|d| d as f64)
        };
        let still = cost / degrees(6)?;
        let left = (cost - gain).max(0.0);
        unlikely += n_residuals as f64 * math::ln(left);
        let share = (left / degrees(12)? / still).sqrt();
        Some((unlikely, Shutter { turn_sigma_rad: sigma[0], share, shift }))
    };
    let all: Option<Vec<_>> = MOTION_SHARES.into_iter().map(likely).collect();
    all?.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, shutter)| shutter)
}

fn mean_motion(
    normal: &ArrowNormal<6>,
    poses: &[Pose<Color, Board>],
    planes: &[[f64; 6]],
    joint: &Joint<'_>,
) -> Option<MeanMotion> {
    let n = joint.covariance.len().isqrt();
    let responses: Option<Vec<_>> = normal.blocks.iter().map(|b| b.block_response(n)).collect();
    Some(MeanMotion::new(responses?, poses, planes, joint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibrate::{
            Input,
            model::{Aspect, Warp},
            surface::Surface,
            synthetic::{FACTORY, Scene, board},
            views::all_usable,
        },
        camera::Distortion,
        pose::Weighting,
    };

    #[test]
    fn motion_counts_by_and_by() {
        let expected = [(1.02, 0.0), (0.9, 0.0), (0.85, 0.5), (0.8, 1.0), (0.6, 1.0)];
        for (share, counts) in expected {
            assert!((motion_counts(share) - counts).abs() < 1e-12, "{share}");
        }
    }

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
        let shape = Shape { center, warp, aspect: Aspect::Fixed, surface };
        let sheet = Sheet::new(&board);
        let fit_of = |views: &[&Measured], free: &[f64], poses: &[_]| {
            let pictures: Vec<usize> = (0..views.len()).collect();
            let data = Data {
                factory: &FACTORY,
                views,
                pictures: &pictures,
                loss: Loss::Squared,
                sheet: &sheet,
                cost_tolerance: 1e-12,
                wanted: Wanted::Camera,
            };
            fit(shape, &data, Start { free, knots_m: &[], poses }).unwrap()
        };
        let whole = fit_of(&views, &shape.start(&FACTORY), &poses);
        for left_out in 0..views.len() {
            let others: Vec<usize> = (0..views.len()).filter(|i| *i != left_out).collect();
            let their_views: Vec<&Measured> = others.iter().map(|i| views[*i]).collect();
            let their_poses: Vec<_> = others.iter().map(|i| poses[*i]).collect();
            let refit = fit_of(&their_views, &whole.free, &their_poses);
            let camera = shape.camera(&FACTORY, None, &refit.free);
            let corners = &views[left_out].corners;
            let view =
                crate::pose::View::from_corners(0, &board, &camera, corners, Weighting::Equal)
                    .unwrap();
            let truth = view.rms_px.powi(2) * corners.len() as f64;
            let predicted = whole.held_out[left_out];
            assert!((predicted / truth - 1.0).abs() < 0.02, "{predicted} {truth}");
            let [focal, others] =
                [whole.left_out_focal_px[left_out].unwrap(), refit.focal_px().value]
                    .map(|f| f - whole.focal_px().value);
            assert!((focal - others).abs() < 0.1 * others.abs().max(0.05), "{focal} {others}");
        }
    }
}
