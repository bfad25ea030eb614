//! How sure shared parameters are, their blocks' own parameters marginalised.

#![allow(
    clippy::needless_range_loop,
    reason = "index loops over small matrices read as the formulas do"
)]

use super::{Cholesky, Reduced, cholesky::symmetric_eigen};

/// The sum of what all blocks say.
pub fn total<const S: usize>(parts: &[Reduced<S>]) -> Reduced<S> {
    parts.iter().fold(Reduced::ZERO, |mut sum, part| {
        sum.add(part);
        sum
    })
}

/// The covariance of the shared parameters if all residuals are independent with this variance, from the sum of what
/// all parts (and what was known beforehand) say; `None` where the parameters are not determined.
///
/// ```text
/// C = variance·S⁻¹,   S = Σ Sᵢ (+ prior)
/// ```
pub fn classical<const S: usize>(all: &Reduced<S>, variance: f64) -> Option<[[f64; S]; S]> {
    let mut covariance = Cholesky::new(&all.information)?.inverse();
    covariance.iter_mut().flatten().for_each(|c| *c *= variance);
    Some(covariance)
}

/// The covariance of the shared parameters if residuals are independent only *between* `parts`: within a part they may
/// be correlated in any way. `None` where the parameters are not determined, or by a single part alone.
///
/// The sandwich estimator with the correction CR2 of Bell and McCaffrey (*Bias reduction in standard errors for linear
/// regression with multi-stage samples*, 2002), unbiased where the residuals happen to be independent after all:
///
/// ```text
/// S = ΣSᵢ (+ prior) = L·Lᵀ,  Mᵢ = L⁻¹·Sᵢ·L⁻ᵀ,  uᵢ = (1 − Mᵢ)^(−½)·L⁻¹·scoreᵢ,  C = L⁻ᵀ·(Σ uᵢ·uᵢᵀ)·L⁻¹
/// ```
pub fn clustered<const S: usize>(all: &Reduced<S>, parts: &[Reduced<S>]) -> Option<[[f64; S]; S]> {
    let factor = Cholesky::new(&all.information)?;
    let mut meat = [[0.0; S]; S];
    for part in parts {
        // M = L⁻¹·Sᵢ·L⁻ᵀ, column by column and then row by row.
        let half = part.information.map(|column| factor.forward(&column));
        let m = transpose(&half).map(|row| factor.forward(&row));
        let (share, axes) = symmetric_eigen(&m);
        let score = factor.forward(&part.score);
        for k in 0..S {
            let left = 1.0 - share[k];
            if !(left > 1e-9) {
                return None; // This part alone determines a parameter: nothing to compare it with.
            }
        }
        let mut corrected = [0.0; S];
        for k in 0..S {
            let along: f64 = (0..S).map(|i| axes[i][k] * score[i]).sum();
            for i in 0..S {
                corrected[i] += axes[i][k] * along / (1.0 - share[k]).sqrt();
            }
        }
        let corrected = factor.backward(&corrected);
        for i in 0..S {
            for j in 0..S {
                meat[i][j] += corrected[i] * corrected[j];
            }
        }
    }
    Some(meat)
}

/// Classical and clustered joined: the correlations of `classical`, for each parameter the larger of both σ.
///
/// The clustered estimate sees correlation within a part that the classical one denies, but rests on few parts; so it
/// may only enlarge, and its noisy correlations are not used.
pub fn larger<const S: usize>(
    classical: &[[f64; S]; S],
    clustered: &[[f64; S]; S],
) -> [[f64; S]; S] {
    let mut factor = [1.0; S];
    for i in 0..S {
        factor[i] = (clustered[i][i] / classical[i][i]).sqrt().max(1.0);
    }
    let mut joined = *classical;
    for i in 0..S {
        for j in 0..S {
            joined[i][j] *= factor[i] * factor[j];
        }
    }
    joined
}

/// By how much the sum of squares of each part rises when the shared parameters are found without it: to second order
/// the part's residuals predicted from all others, its own block parameters fitted. `None` where the others do not
/// determine the parameters.
///
/// ```text
/// δᵢ = −(S − Sᵢ)⁻¹·scoreᵢ,   rise = −2·scoreᵢᵀ·δᵢ + δᵢᵀ·Sᵢ·δᵢ
/// ```
///
/// Exact for linear problems.
pub fn leave_one_out_rise<const S: usize>(
    all: &Reduced<S>,
    parts: &[Reduced<S>],
) -> Vec<Option<f64>> {
    parts
        .iter()
        .map(|part| {
            let mut others = all.information;
            for i in 0..S {
                for j in 0..S {
                    others[i][j] -= part.information[i][j];
                    // What is left after subtraction is rounding where the others know nothing.
                }
                if !(others[i][i] > 1e-10 * all.information[i][i]) {
                    return None;
                }
            }
            let minus_delta = Cholesky::new(&others)?.solve(&part.score);
            let mut rise = 0.0;
            for i in 0..S {
                rise += 2.0 * part.score[i] * minus_delta[i];
                for j in 0..S {
                    rise += minus_delta[i] * part.information[i][j] * minus_delta[j];
                }
            }
            Some(rise)
        })
        .collect()
}

fn transpose<const S: usize>(matrix: &[[f64; S]; S]) -> [[f64; S]; S] {
    let mut transposed = [[0.0; S]; S];
    for i in 0..S {
        for j in 0..S {
            transposed[j][i] = matrix[i][j];
        }
    }
    transposed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line y = p·t + q through values in groups, as blocks without parameters of their own: the reduced parts, and
    /// the sum of squares of each group at its minimum.
    fn line(groups: &[Vec<(f64, f64)>]) -> (Vec<Reduced<2>>, [f64; 2], Vec<f64>) {
        let (mut information, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
        for &(t, y) in groups.iter().flatten() {
            for (i, a) in [t, 1.0].into_iter().enumerate() {
                for (j, b) in [t, 1.0].into_iter().enumerate() {
                    information[i][j] += a * b;
                }
                right[i] += a * y;
            }
        }
        let x = Cholesky::new(&information).unwrap().solve(&right);
        let mut squares = Vec::new();
        let parts = groups
            .iter()
            .map(|group| {
                let mut part = Reduced::ZERO;
                let mut sum = 0.0;
                for &(t, y) in group {
                    let residual = y - x[0] * t - x[1];
                    sum += residual * residual;
                    for (i, a) in [t, 1.0].into_iter().enumerate() {
                        for (j, b) in [t, 1.0].into_iter().enumerate() {
                            part.information[i][j] += a * b;
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

    /// Mean of an estimated covariance over many draws against the spread of the estimates themselves.
    fn ratio(own: f64, common: f64, estimate: impl Fn(&[Reduced<2>]) -> [[f64; 2]; 2]) -> [f64; 2] {
        const N: u64 = 4000;
        let (mut predicted, mut seen) = ([0.0; 2], [0.0; 2]);
        for seed in 0..N {
            let (parts, x, _) = line(&groups(seed * 77 + 5, own, common));
            let covariance = estimate(&parts);
            for i in 0..2 {
                predicted[i] += covariance[i][i];
                seen[i] += (x[i] - [2.0, -1.0][i]).powi(2);
            }
        }
        [predicted[0] / seen[0], predicted[1] / seen[1]]
    }

    #[test]
    fn covariances_are_unbiased() {
        // Variance of a mean of 4000 squares: ±2.2 % each, so 9 % is four standard deviations.
        for r in ratio(0.5, 0.0, |parts| classical(&total(parts), 0.25).unwrap()) {
            assert!((r - 1.0).abs() < 0.09, "classical {r}");
        }
        for r in ratio(0.5, 0.0, |parts| clustered(&total(parts), parts).unwrap()) {
            assert!((r - 1.0).abs() < 0.09, "clustered, independent noise {r}");
        }
        for r in ratio(0.1, 0.5, |parts| clustered(&total(parts), parts).unwrap()) {
            assert!((r - 1.0).abs() < 0.2, "clustered, common noise {r}");
        }
        for r in ratio(0.1, 0.5, |parts| classical(&total(parts), 0.26).unwrap()) {
            assert!(r < 0.4, "the classical one must be far too small here: {r}");
        }
    }

    #[test]
    fn larger_only_enlarges() {
        let joined = larger(&[[4.0, 1.0], [1.0, 1.0]], &[[1.0, 0.0], [0.0, 9.0]]);
        assert_eq!(joined, [[4.0, 3.0], [3.0, 9.0]]);
    }

    #[test]
    fn leaving_one_out_is_exact_for_a_line() {
        let groups = groups(3, 0.5, 0.3);
        let (parts, _, squares) = line(&groups);
        for (i, rise) in leave_one_out_rise(&total(&parts), &parts).into_iter().enumerate() {
            let others: Vec<_> = groups
                .iter()
                .enumerate()
                .filter(|(j, _)| *j != i)
                .map(|(_, g)| g.clone())
                .collect();
            let (_, x, _) = line(&others);
            let held_out: f64 = groups[i].iter().map(|(t, y)| (y - x[0] * t - x[1]).powi(2)).sum();
            assert!((squares[i] + rise.unwrap() - held_out).abs() < 1e-10);
        }
        let alone = line(&groups[..1]).0;
        assert!(leave_one_out_rise(&total(&alone), &alone)[0].is_none());
        assert!(clustered(&total(&alone), &alone).is_none());
    }
}
