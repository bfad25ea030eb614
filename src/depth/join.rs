//! Two estimates of the same numbers as one.

use nalgebra::{SMatrix, SVector};

use crate::solve::larger;

/// Numbers and their covariance.
pub(super) type Found<const M: usize> = (SVector<f64, M>, SMatrix<f64, M, M>);

/// Numbers with their covariance, and by how much each picture (its number) moves them.
pub(super) struct Seen<const K: usize> {
    pub(super) found: Found<K>,
    pub(super) by_picture: Vec<(usize, SVector<f64, K>)>,
}

/// Two estimates as one.
pub(super) struct Joined<const M: usize> {
    pub(super) estimate: Found<M>,
    /// How far the two lie apart: χ² over its degrees of freedom.
    pub(super) disagreement: f64,
}

/// Joins with M numbers what somebody else says of K of them, from the `first` on, weighted by the covariances; the
/// other numbers follow by their correlations.
///
/// What a picture tells both wrongly in the same way (its pose; a hand that moves between colour and depth) is in the
/// products of what each picture moves the one and the other by: σ is the larger of that with these and without.
///
/// Where the two contradict each other, by a χ² that right σ exceed in one case of twenty, σ of the K grow by Birge's
/// ratio; below that there is nothing to say against the σ, and growing by what is chance would make them too large on
/// average. (Key comparisons of measurement standards do it in this way: Cox, Metrologia 39, 589, 2002.)
pub(super) fn join<const M: usize, const K: usize>(
    ours: &Seen<M>,
    first: usize,
    theirs: &Seen<K>,
) -> Option<Joined<M>> {
    let ((theta, covariance), (seen, seen_covariance)) = (&ours.found, &theirs.found);
    let apart = seen - theta.fixed_rows::<K>(first);
    let inverse = (seen_covariance + covariance.fixed_view::<K, K>(first, first)).try_inverse()?;
    let gain = covariance.fixed_columns::<K>(first) * inverse;
    let together = theta + gain * apart;
    let alone = covariance - gain * covariance.fixed_rows::<K>(first);
    let mut common = SMatrix::<f64, M, K>::zeros();
    for (picture, theirs) in &theirs.by_picture {
        if let Some((_, ours)) = ours.by_picture.iter().find(|(index, _)| index == picture) {
            common.ger(1.0, ours, theirs, 1.0);
        }
    }
    let common = (common - gain * common.fixed_rows::<K>(first)) * gain.transpose();
    let variances = alone.diagonal() + 2.0 * common.diagonal();
    let mut left: SMatrix<f64, M, M> =
        SMatrix::from_column_slice(&larger(alone.as_slice(), variances.as_slice()));
    let disagreement = apart.dot(&(inverse * apart)) / K as f64;
    if disagreement > CONTRADICTION[K] {
        for k in first..first + K {
            left.row_mut(k).scale_mut(disagreement.sqrt());
            left.column_mut(k).scale_mut(disagreement.sqrt());
        }
    }
    Some(Joined { estimate: (together, left), disagreement })
}

/// χ² over K degrees of freedom that chance exceeds in 5 % of cases.
const CONTRADICTION: [f64; 5] = [f64::INFINITY, 3.841, 2.996, 2.605, 2.372];

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

    use super::*;

    /// Three numbers of which somebody else knows the last two, ten pictures each.
    fn joined(apart: f64, common: f64) -> Joined<3> {
        let own =
            |i: usize| Vector3::new(0.1, 0.1, 0.1) * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        let ours = Seen {
            found: (Vector3::new(1.0, 0.0, 0.0), Matrix3::identity()),
            by_picture: (0..10).map(|i| (i, own(i))).collect(),
        };
        let theirs = Seen {
            found: (Vector2::new(apart, 0.0), Matrix2::identity()),
            by_picture: (0..10).map(|i| (i, own(i).fixed_rows::<2>(1) * common)).collect(),
        };
        join(&ours, 1, &theirs).expect("positive")
    }

    #[test]
    fn two_estimates_are_joined_by_their_weights() {
        let Joined { estimate: (value, covariance), disagreement } = joined(2.0, 0.0);
        assert!((value - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-12, "{value}");
        assert!((covariance - Matrix3::from_diagonal(&Vector3::new(1.0, 0.5, 0.5))).norm() < 1e-12);
        assert!((disagreement - 1.0).abs() < 1e-12); // 2²/2 over two.
        // What both have from the same pictures is worth nothing twice; what is opposite makes nothing better.
        let together = joined(0.0, 10.0).estimate.1;
        assert!((together[(1, 1)] - 1.0).abs() < 1e-12, "{together}");
        assert_eq!(joined(0.0, -10.0).estimate.1, joined(0.0, 0.0).estimate.1);
    }

    #[test]
    fn contradiction_enlarges_sigma_and_chance_does_not() {
        let chance = joined(3.4, 0.0); // χ² 5.8 of two, exceeded in 5.5 %.
        assert!((chance.estimate.1[(1, 1)] - 0.5).abs() < 1e-12);
        let contradiction = joined(4.0, 0.0);
        assert!((contradiction.disagreement - 4.0).abs() < 1e-12);
        assert!((contradiction.estimate.1[(1, 1)] - 2.0).abs() < 1e-12);
        assert!((contradiction.estimate.1[(0, 0)] - 1.0).abs() < 1e-12);
    }
}
