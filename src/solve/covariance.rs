//! How sure shared parameters are, their blocks' own parameters marginalised.

use super::{DenseCholesky, Reduced};
use crate::par::{dot, vectorized};

/// The sum of what all blocks say.
///
/// Panics where there are no parts.
pub fn total(parts: &[Reduced]) -> Reduced {
    let mut sum = Reduced::zero(parts[0].n());
    parts.iter().for_each(|part| sum.add(part));
    sum
}

/// What the parts together say, and what was known before.
#[derive(Clone, Debug)]
pub struct Pooled<'a> {
    parts: &'a [Reduced],
    information: Vec<f64>,
    /// S⁻¹, row-major.
    inverse: Vec<f64>,
    n: usize,
}

impl<'a> Pooled<'a> {
    /// From the sum of all parts and of what was known beforehand; `None` where the parameters are not determined.
    pub fn new(all: &Reduced, parts: &'a [Reduced]) -> Option<Self> {
        let n = all.n();
        let inverse = DenseCholesky::new(all.information.clone(), n)?.inverse();
        Some(Self { parts, information: all.information.clone(), inverse, n })
    }

    /// S⁻¹, row-major: the covariance of the parameters if all residuals are independent with unit variance.
    pub fn classical(&self) -> &[f64] {
        &self.inverse
    }

    /// The variances of the first `n_wanted` parameters if residuals are independent only *between* the parts: within
    /// a part they may be correlated in any way. `None` where a part alone determines one of them.
    pub fn clustered(&self, n_wanted: usize) -> Option<Vec<f64>> {
        self.clustered_of(&units(n_wanted, self.n))
    }

    /// The same of sums of parameters, each given by its weights.
    ///
    /// The sandwich estimator, each part's influence on a sum scaled such that the estimate is unbiased where the
    /// residuals happen to be independent after all: the idea of the correction CR2 (Bell and McCaffrey, *Bias
    /// reduction in standard errors for linear regression with multi-stage samples*, 2002), for one sum at a time.
    ///
    /// ```text
    /// S = ΣSᵢ + prior,  q = S⁻¹·weights,  tᵢ = qᵀ·Sᵢ·q,  vᵢ = tᵢ − qᵀ·Sᵢ·S⁻¹·Sᵢ·q
    /// variance = Σ (qᵀ·scoreᵢ)²·tᵢ/vᵢ + qᵀ·prior·q
    /// ```
    pub fn clustered_of(&self, sums: &[Vec<f64>]) -> Option<Vec<f64>> {
        vectorized(
            #[inline(always)]
            || self.variances_of(sums),
        )
    }

    #[inline(always)]
    fn variances_of(&self, sums: &[Vec<f64>]) -> Option<Vec<f64>> {
        let n = self.n;
        let mut variances = Vec::with_capacity(sums.len());
        let [mut q, mut sq, mut rsq] = [(); 3].map(|()| vec![0.0; n]);
        for weights in sums {
            times(&self.inverse, weights, &mut q);
            let (q, whole) = (&q[..], dot(&q, weights));
            let mut sum = 0.0;
            let mut from_parts = 0.0;
            for part in self.parts {
                times(&part.information, q, &mut sq);
                let t = dot(q, &sq);
                times(&self.inverse, &sq, &mut rsq);
                let v = t - dot(&sq, &rsq);
                if t > 0.0 {
                    if !(v > 1e-9 * t) {
                        return None; // This part alone determines the sum: nothing to compare it with.
                    }
                    sum += dot(q, &part.score).powi(2) * t / v;
                }
                from_parts += t;
            }
            let prior = (whole - from_parts).max(0.0);
            // Rounding of a difference of equal numbers is no prior.
            variances.push(if prior > 1e-9 * whole { sum + prior } else { sum });
        }
        Some(variances)
    }

    /// What each part says differently from all others; `None` where the others do not determine the parameters.
    pub fn leave_one_out(&self) -> Vec<Option<LeftOut>> {
        self.parts.iter().map(|part| self.without(part)).collect()
    }

    fn without(&self, part: &Reduced) -> Option<LeftOut> {
        let n = self.n;
        let others: Vec<f64> =
            self.information.iter().zip(&part.information).map(|(all, own)| all - own).collect();
        // What is left after subtraction is rounding where the others know nothing.
        if (0..n).any(|i| !(others[i * n + i] > 1e-10 * self.information[i * n + i])) {
            return None;
        }
        let minus = DenseCholesky::new(others, n)?.solve(&part.score);
        let mut own = vec![0.0; n];
        times(&part.information, &minus, &mut own);
        let rise = 2.0 * dot(&part.score, &minus) + dot(&minus, &own);
        Some(LeftOut { shift: minus.into_iter().map(|x| -x).collect(), rise })
    }
}

/// What changes where one part is left out: to second order, exact for linear problems.
///
/// ```text
/// shift = −(S − Sᵢ)⁻¹·scoreᵢ,   rise = −2·scoreᵢᵀ·shift + shiftᵀ·Sᵢ·shift
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// By how much each parameter moves.
    pub shift: Vec<f64>,
    /// By how much the part's own sum of squares rises, its block parameters fitted: its residuals predicted from all
    /// others.
    pub rise: f64,
}

/// A covariance whose standard deviations are at least those of `variances`, one for each of the first parameters; its
/// correlations stay.
///
/// The clustered estimate sees correlation within a part that the classical one denies, but rests on few parts; so it
/// may only enlarge.
pub fn larger(covariance: &[f64], variances: &[f64]) -> Vec<f64> {
    let n = covariance.len().isqrt();
    let factor: Vec<f64> = (0..n)
        .map(|i| variances.get(i).map_or(1.0, |v| (v / covariance[i * n + i]).sqrt().max(1.0)))
        .collect();
    (0..n * n).map(|at| covariance[at] * factor[at / n] * factor[at % n]).collect()
}

/// The weights of sums that are the first `n_wanted` of n parameters themselves.
pub fn units(n_wanted: usize, n: usize) -> Vec<Vec<f64>> {
    (0..n_wanted).map(|i| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect()
}

/// The covariance of sums of parameters from that of the parameters: W·C·Wᵀ, row-major, W's rows the sums' weights.
pub fn covariance_of(sums: &[Vec<f64>], covariance: &[f64]) -> Vec<f64> {
    let n = covariance.len().isqrt();
    let mut by = vec![0.0; n];
    let mut out = Vec::with_capacity(sums.len() * sums.len());
    for sum in sums {
        times(covariance, sum, &mut by);
        out.extend(sums.iter().map(|other| dot(&by, other)));
    }
    out
}

/// A square matrix (row-major) times a vector.
#[inline(always)]
fn times(matrix: &[f64], x: &[f64], product: &mut [f64]) {
    for (row, product) in matrix.chunks(x.len().max(1)).zip(product) {
        *product = dot(row, x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line y = p·t + q through values in groups, as blocks without parameters of their own: the reduced parts, and
    /// the sum of squares of each group at its minimum.
    fn line(groups: &[Vec<(f64, f64)>]) -> (Vec<Reduced>, [f64; 2], Vec<f64>) {
        let (mut information, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
        for &(t, y) in groups.iter().flatten() {
            for (i, a) in [t, 1.0].into_iter().enumerate() {
                for (j, b) in [t, 1.0].into_iter().enumerate() {
                    information[i][j] += a * b;
                }
                right[i] += a * y;
            }
        }
        let x = crate::solve::Cholesky::new(&information).unwrap().solve(&right);
        let mut squares = Vec::new();
        let parts = groups
            .iter()
            .map(|group| {
                let mut part = Reduced::zero(2);
                let mut sum = 0.0;
                for &(t, y) in group {
                    let residual = y - x[0] * t - x[1];
                    sum += residual * residual;
                    for (i, a) in [t, 1.0].into_iter().enumerate() {
                        for (j, b) in [t, 1.0].into_iter().enumerate() {
                            part.information[2 * i + j] += a * b;
                        }
                        part.score[i] += a * residual;
                    }
                }
                squares.push(sum);
                part
            })
            .collect();
        (parts, x, squares)
    }

    /// A deterministic sequence of about normal numbers (sums of twelve uniform ones of a linear congruence).
    fn normals(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            sum
        }
    }

    /// 8 groups of 6 values on y = 2t − 1, with noise within (`own`) and common to each group (`common`).
    fn groups(seed: u64, own: f64, common: f64) -> Vec<Vec<(f64, f64)>> {
        let mut normal = normals(seed);
        (0..8)
            .map(|g| {
                let shift = common * normal();
                (0..6)
                    .map(|i| {
                        let t = f64::from(g) + 0.3 * f64::from(i);
                        (t, 2.0 * t - 1.0 + shift + own * normal())
                    })
                    .collect()
            })
            .collect()
    }

    /// Mean of estimated variances over many draws against the spread of the estimates themselves.
    fn ratio(own: f64, common: f64, estimate: impl Fn(&Pooled<'_>) -> [f64; 2]) -> [f64; 2] {
        const N: u64 = 4000;
        let (mut predicted, mut seen) = ([0.0; 2], [0.0; 2]);
        for seed in 0..N {
            let (parts, x, _) = line(&groups(seed * 77 + 5, own, common));
            let variances = estimate(&Pooled::new(&total(&parts), &parts).unwrap());
            for i in 0..2 {
                predicted[i] += variances[i];
                seen[i] += (x[i] - [2.0, -1.0][i]).powi(2);
            }
        }
        [predicted[0] / seen[0], predicted[1] / seen[1]]
    }

    #[test]
    fn covariances_are_unbiased() {
        let classical = |variance: f64| {
            move |pooled: &Pooled<'_>| [0, 3].map(|at| variance * pooled.classical()[at])
        };
        let clustered =
            |pooled: &Pooled<'_>| -> [f64; 2] { pooled.clustered(2).unwrap().try_into().unwrap() };
        // Variance of a mean of 4000 squares: ±2.2 % each, so 9 % is four standard deviations.
        for r in ratio(0.5, 0.0, classical(0.25)) {
            assert!((r - 1.0).abs() < 0.09, "classical {r}");
        }
        for r in ratio(0.5, 0.0, clustered) {
            assert!((r - 1.0).abs() < 0.09, "clustered, independent noise {r}");
        }
        for r in ratio(0.1, 0.5, clustered) {
            assert!((r - 1.0).abs() < 0.2, "clustered, common noise {r}");
        }
        for r in ratio(0.1, 0.5, classical(0.26)) {
            assert!(r < 0.4, "the classical one must be far too small here: {r}");
        }
    }

    #[test]
    fn larger_only_enlarges() {
        let joined = larger(&[4.0, 1.0, 1.0, 1.0], &[1.0, 9.0]);
        assert_eq!(joined, [4.0, 3.0, 3.0, 9.0]);
        assert_eq!(larger(&[4.0, 1.0, 1.0, 1.0], &[16.0]), [16.0, 2.0, 2.0, 1.0]);
    }

    #[test]
    fn leaving_one_out_is_exact_for_a_line() {
        let groups = groups(3, 0.5, 0.3);
        let (parts, all_x, squares) = line(&groups);
        let all = total(&parts);
        for (i, left_out) in Pooled::new(&all, &parts).unwrap().leave_one_out().iter().enumerate() {
            let mut others = groups.clone();
            others.remove(i);
            let (_, x, _) = line(&others);
            let held_out: f64 = groups[i].iter().map(|(t, y)| (y - x[0] * t - x[1]).powi(2)).sum();
            let LeftOut { shift, rise } = left_out.as_ref().unwrap();
            assert!((squares[i] + rise - held_out).abs() < 1e-10);
            assert!((all_x[0] + shift[0] - x[0]).abs() < 1e-10);
        }
        let alone = line(&groups[..1]).0;
        let alone = Pooled::new(&total(&alone), &alone).unwrap();
        assert!(alone.leave_one_out()[0].is_none());
        assert!(alone.clustered(2).is_none());
    }
}
