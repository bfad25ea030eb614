//! Robust losses: how much a residual that is far off may say.

use crate::math;

/// A loss ρ of a residual measured in its own standard deviations, as a function of s = (r/σ)²; ρ(s) ≈ s for small s.
///
/// Minimised by iteratively reweighted least squares: each residual is weighted by ρ'(s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// ρ(s) = s. Least squares.
    Squared,
    /// Squared up to `threshold` standard deviations, linear beyond (Huber, 1964). Convex: no new minima.
    Huber {
        /// In standard deviations.
        threshold: f64,
    },
    /// ρ(s) = k²·ln(1 + s/k²) (Cauchy, Lorentz): an outlier says less the farther off it is. Needs a good start.
    Cauchy {
        /// k, in standard deviations.
        scale: f64,
    },
}

impl Loss {
    /// ρ(s)
    pub fn rho(self, s: f64) -> f64 {
        match self {
            Self::Squared => s,
            Self::Huber { threshold: k } if s > k * k => 2.0 * k * s.sqrt() - k * k,
            Self::Huber { .. } => s,
            Self::Cauchy { scale: k } => k * k * math::ln_1p(s / (k * k)),
        }
    }

    /// ρ'(s), the weight of the residual: 1 for small s.
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Self::Huber { threshold: k } if s > k * k => k / s.sqrt(),
            Self::Squared | Self::Huber { .. } => 1.0,
            Self::Cauchy { scale: k } => 1.0 / (1.0 + s / (k * k)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_is_the_derivative() {
        let losses = [Loss::Squared, Loss::Huber { threshold: 1.5 }, Loss::Cauchy { scale: 2.0 }];
        for loss in losses {
            for s in [0.01, 0.5, 1.0, 2.2, 2.3, 9.0, 400.0] {
                let h = 1e-6 * s;
                let numeric = (loss.rho(s + h) - loss.rho(s - h)) / (2.0 * h);
                assert!((loss.weight(s) - numeric).abs() < 1e-8, "{loss:?} {s}");
            }
            assert_eq!(loss.rho(0.0), 0.0);
        }
        // Continuous at the threshold.
        let huber = Loss::Huber { threshold: 1.5 };
        assert!((huber.rho(2.25 + 1e-12) - 2.25).abs() < 1e-11);
    }
}
