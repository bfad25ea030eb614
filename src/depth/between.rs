//! What the frames say together, each with one plane: the second level of [`register`](super::register).

use nalgebra::{Cholesky, Matrix3, SMatrix, SVector, Vector3};

use crate::math;
use crate::solve::{Pooled, Reduced, larger, median};

/// The unknowns: the plane by which the board's surface is not where its corners say (height of its middle, slopes
/// along its rows and columns), then the five of [`Registration`](super::Registration); the share of the other
/// distortion state comes after these, where it is asked for.
pub(super) const N: usize = 8;
pub(super) const SCALE: usize = 3;
pub(super) const BIAS: usize = 4;
pub(super) const ZOOM: usize = 5;
pub(super) const SHIFT: [usize; 2] = [6, 7];

/// Scale, bias (m), zoom, shift (px) and share that no recording is farther from the truth than by about this: keeps
/// what the views do not determine from running away. Weak beside any recording that tells anything.
const PRIOR_SIGMA: [f64; 6] = [0.3, 0.1, 0.3, 60.0, 60.0, 3.0];
/// Beyond this Mahalanobis distance a frame counts only linearly: 1 % of normal ones do (3 degrees of freedom).
const FRAME_HUBER: f64 = 3.368;
/// Beyond this it does not count at all: a single frame that is wrong by a hundred σ would make all others seem noisy.
const FRAME_LOST: f64 = 10.0;
/// So many of 15 rounds take the variance from the median of the squares, χ² over three degrees of freedom.
const ROUNDS_BY_MEDIAN: usize = 6;
const MEDIAN_CHI2: f64 = 2.366;
/// Fewer different pictures do not tell that poses are better than their corners' noise says: the frames of a picture
/// agree whatever is wrong in it.
const PICTURES_THAT_TELL: usize = 5;
/// How far ρ may be from its start, beforehand: one standard deviation of the common logarithm of ρ.
const RATIO_DECADES: f64 = 1.5;
/// What is less likely than the likeliest by this does not count.
const LEAST_SHARE: f64 = 1e-4;

/// What one frame says.
pub(super) struct Plane {
    /// Index of the frame in the recording.
    pub(super) frame: usize,
    /// The number of the picture that it is one of.
    pub(super) picture: usize,
    /// By which plane the sensor differs from the model.
    pub(super) beta: Vector3<f64>,
    /// By the unknowns.
    pub(super) gain: SMatrix<f64, 3, N>,
    /// By the share of the other distortion state.
    pub(super) by_lens: Vector3<f64>,
    /// By one σ of each of the camera's numbers.
    pub(super) by_camera: Vec<Vector3<f64>>,
    pub(super) pose: Matrix3<f64>,
    pub(super) sensor: Matrix3<f64>,
    pub(super) n_patches: usize,
    /// Sum, smallest and largest depth of the board.
    pub(super) board_m: [f64; 3],
}

/// The second level, for M unknowns: all but the share of the other distortion state, or with it.
pub(super) struct Step<const M: usize> {
    pub(super) delta: SVector<f64, M>,
    pub(super) covariance: SMatrix<f64, M, M>,
    /// By how much each picture (its number) moves them.
    pub(super) by_picture: Vec<(usize, SVector<f64, M>)>,
    /// What one σ of each of the camera's numbers does to them.
    pub(super) by_camera: Vec<SVector<f64, M>>,
}

/// What each of the unknowns does to each frame's plane.
pub(super) type Gains<const M: usize> = [SMatrix<f64, 3, M>];

/// What is known of the unknowns before anything was measured.
pub(super) struct Prior<const M: usize> {
    pub(super) mean: SVector<f64, M>,
    pub(super) covariance: SMatrix<f64, M, M>,
    pub(super) precision: SMatrix<f64, M, M>,
}

impl<const M: usize> Prior<M> {
    pub(super) fn new(of_board: Matrix3<f64>) -> Self {
        let mut mean = SVector::zeros();
        (mean[SCALE], mean[ZOOM]) = (1.0, 1.0);
        let sigma = |k: usize| PRIOR_SIGMA[k.saturating_sub(SCALE)];
        let mut covariance =
            SMatrix::<f64, M, M>::from_diagonal(&SVector::from_fn(|k, _| sigma(k).powi(2)));
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_board);
        let precision = covariance.try_inverse().expect("a covariance");
        Self { mean, covariance, precision }
    }
}

/// ρ, how much the sensor adds to what the poses are unsure by, is not known and often not well told: the likelihood
/// may have two hills, poses alone and the sensor alone, with different answers. So all of them count as far as they
/// are likely (ρ is integrated out), and their differences are part of σ.
pub(super) fn between_frames<const M: usize>(
    planes: &[Plane],
    gains: &Gains<M>,
    theta: &SVector<f64, M>,
    prior: &Prior<M>,
) -> Option<Step<M>> {
    let mut pictures: Vec<usize> = planes.iter().map(|plane| plane.picture).collect();
    pictures.sort_unstable();
    pictures.dedup();
    // Of the variance.
    let least = if pictures.len() < PICTURES_THAT_TELL { 1.0 } else { f64::MIN_POSITIVE };
    let tried: Vec<(f64, Weighed<M>)> = (-16..=16)
        .filter_map(|i| {
            let decades = f64::from(i) / 4.0;
            let weighed = weigh(planes, gains, (theta, prior), (math::pow(10f64, decades), least))?;
            let unlikely = 0.5 * (decades / RATIO_DECADES).powi(2);
            Some((weighed.likelihood - unlikely, weighed))
        })
        .collect();
    let most = tried.iter().map(|(ln, _)| *ln).fold(f64::NEG_INFINITY, f64::max);
    let likely: Vec<(f64, &Weighed<M>)> = tried
        .iter()
        .map(|(ln, weighed)| (math::exp(ln - most), weighed))
        .filter(|(share, _)| *share > LEAST_SHARE)
        .collect();
    let whole: f64 = likely.iter().map(|(share, _)| share).sum();
    let likely = likely.into_iter().map(|(share, weighed)| (share / whole, weighed));

    let n_pictures = pictures.last().map_or(0, |last| last + 1);
    let n_camera = planes.first().map_or(0, |p| p.by_camera.len());
    let mut step = Step {
        delta: likely.clone().map(|(share, weighed)| weighed.delta * share).sum(),
        covariance: SMatrix::zeros(),
        by_picture: (0..n_pictures).map(|picture| (picture, SVector::zeros())).collect(),
        by_camera: vec![SVector::zeros(); n_camera],
    };
    for (share, weighed) in likely {
        let (delta, information) = (weighed.delta, weighed.information);
        let inverse = Cholesky::new(information)?.inverse();
        let all = Reduced { information: information.as_slice().to_vec(), score: vec![0.0; M] };
        // What is wrong in one frame of a picture is wrong in the others the same way.
        let mut parts = vec![Reduced::zero(M); n_pictures];
        weighed.parts().zip(planes).for_each(|(part, plane)| parts[plane.picture].add(&part));
        // Without it where a picture alone determines a number.
        let clustered = Pooled::new(&all, &parts)?.clustered(M).unwrap_or_default();
        let covariance =
            SMatrix::<f64, M, M>::from_column_slice(&larger(inverse.as_slice(), &clustered));
        let apart = delta - step.delta;
        step.covariance += (covariance + apart * apart.transpose()) * share;
        for (k, sum) in step.by_camera.iter_mut().enumerate() {
            let mut score = SVector::<f64, M>::zeros();
            for ((plane, gain), (said, w)) in planes.iter().zip(gains).zip(&weighed.said) {
                score += gain.transpose() * (said.inverse * plane.by_camera[k]) * *w;
            }
            *sum -= inverse * score * share;
        }
        for ((_, sum), part) in step.by_picture.iter_mut().zip(&parts) {
            *sum += inverse * SVector::<f64, M>::from_column_slice(&part.score) * share;
        }
    }
    Some(step)
}

struct Weighed<const M: usize> {
    delta: SVector<f64, M>,
    information: SMatrix<f64, M, M>,
    /// What each frame says, and as how much it counts.
    said: Vec<(Said<M>, f64)>,
    likelihood: f64,
}

impl<const M: usize> Weighed<M> {
    /// What each frame alone says: its information, and what it still asks for.
    fn parts(&self) -> impl Iterator<Item = Reduced> {
        self.said.iter().map(|(said, w)| Reduced {
            information: (said.information * *w).as_slice().to_vec(),
            score: ((said.score - said.information * self.delta) * *w).as_slice().to_vec(),
        })
    }
}

struct Said<const M: usize> {
    /// The precision of the frame's plane.
    inverse: Matrix3<f64>,
    information: SMatrix<f64, M, M>,
    score: SVector<f64, M>,
}

fn weigh<const M: usize>(
    planes: &[Plane],
    gains: &Gains<M>,
    (theta, prior): (&SVector<f64, M>, &Prior<M>),
    (ratio, least): (f64, f64),
) -> Option<Weighed<M>> {
    let mut determinants = 0.0;
    let said: Vec<Said<M>> = planes
        .iter()
        .zip(gains)
        .map(|(plane, gain)| {
            let covariance = plane.pose + plane.sensor * ratio;
            let inverse = covariance.try_inverse()?;
            determinants += math::ln(covariance.determinant());
            let weighted = gain.transpose() * inverse;
            Some(Said { inverse, information: weighted * gain, score: weighted * plane.beta })
        })
        .collect::<Option<_>>()?;
    let n_numbers = (3 * planes.len()) as f64;
    let mut robust = vec![1.0; planes.len()];
    let mut delta = SVector::<f64, M>::zeros();
    let mut variance = 1.0;
    let mut information = SMatrix::<f64, M, M>::zeros();
    let mut beyond = 0.0;
    for round in 0..15 {
        information = prior.precision;
        let mut score = prior.precision * (prior.mean - theta);
        for (said, w) in said.iter().zip(&robust) {
            information += said.information * (w / variance);
            score += said.score * (w / variance);
        }
        let factor = Cholesky::new(information)?;
        delta = factor.solve(&score);
        let squares: Vec<f64> = planes
            .iter()
            .zip(gains)
            .zip(&said)
            .map(|((plane, gain), said)| {
                let e = plane.beta - gain * delta;
                e.dot(&(said.inverse * e))
            })
            .collect();
        // What was known beforehand costs no freedom.
        let n_found = M as f64 - factor.solve(&prior.precision).trace();
        let n_counted = 3.0 * robust.iter().filter(|w| **w > 0.0).count() as f64;
        // A frame that is wrong by far hides in a mean that it makes itself; in the median it cannot.
        variance = if round < ROUNDS_BY_MEDIAN {
            median(&squares) / MEDIAN_CHI2
        } else {
            squares.iter().zip(&robust).map(|(s, w)| s * w).sum::<f64>()
                / (n_counted - n_found).max(1.0)
        }
        .max(least);
        beyond = 0.0;
        for (w, s) in robust.iter_mut().zip(&squares) {
            let distance = (s / variance).sqrt();
            *w = if distance > FRAME_LOST { 0.0 } else { (FRAME_HUBER / distance).min(1.0) };
            beyond += FRAME_HUBER * (distance.min(FRAME_LOST) - FRAME_HUBER).max(0.0);
        }
    }
    let n_found = M as f64 - Cholesky::new(information)?.solve(&prior.precision).trace();
    let root = Cholesky::new(prior.covariance)?.unpack();
    let ln_scaled = Cholesky::new(root.transpose() * information * root)?.ln_determinant();
    let off = theta + delta - prior.mean;
    // Frames that count less, or not at all, are not for nothing: the loss is the sum of weighted squares and what lies
    // beyond.
    let likelihood = -0.5
        * (determinants + n_numbers * math::ln(variance) + beyond + ln_scaled - n_found
            + off.dot(&(prior.precision * off)));
    let said = said.into_iter().zip(robust).map(|(said, w)| (said, w / variance)).collect();
    Some(Weighed { delta, information, said, likelihood })
}
