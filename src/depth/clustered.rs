//! How sure a linear estimate is when its residuals are not independent.

use nalgebra::{DMatrix, DVector};

/// Covariances of the estimate θ of a weighted linear model y ≈ X·θ whose residuals agree within groups.
///
/// Corners of one view share the error of its pose; corners at one place of the board share its waviness in every
/// view. Neither shrinks with the number of corners. The sandwich estimator sums scores within each group before it
/// squares them (Liang and Zeger 1986, doi 10.1093/biomet/73.1.13); for two groupings at once it is
/// (Cameron, Gelbach, Miller 2011, doi 10.1198/jbes.2010.07136)
///
/// ```text
/// A = Σᵢ ψ'ᵢ xᵢ xᵢᵀ,   s_g = Σ_{i∈g} ψᵢ xᵢ,   M = Σ_g s_g s_gᵀ · G/(G − p)
/// V = A⁻¹ (M_first + M_second − M_both) A⁻¹
/// ```
///
/// With few groups these are too small as often as too large, so that [`Clustered::sigma`] takes the largest of four:
/// independent residuals, either grouping, both.
#[derive(Clone, Debug)]
pub(crate) struct Clustered {
    covariances: Vec<DMatrix<f64>>,
}

/// One equation of the model.
#[derive(Clone, Debug)]
pub(crate) struct Equation {
    /// Row of X.
    pub(crate) x: DVector<f64>,
    /// ψ: the residual times its robust weight.
    pub(crate) score: f64,
    /// ψ': the derivative of the score by the residual.
    pub(crate) curvature: f64,
    /// The group in either grouping.
    pub(crate) groups: [usize; 2],
}

impl Clustered {
    /// `None` where the equations do not determine the parameters.
    pub(crate) fn new(equations: &[Equation]) -> Option<Self> {
        let p = equations.first()?.x.len();
        let n = equations.len();
        let mut a = DMatrix::zeros(p, p);
        for e in equations {
            a.ger(e.curvature, &e.x, &e.x, 1.0);
        }
        // Scaled to a unit diagonal: parameters come in different units.
        let scale = a.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
        let scaled = DMatrix::from_fn(p, p, |i, j| a[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(p, p, |i, j| inverse[(i, j)] * scale[i] * scale[j]);

        let by = |group: &dyn Fn(&Equation) -> usize| meat(equations, p, group);
        let first = by(&|e| e.groups[0])?;
        let second = by(&|e| e.groups[1])?;
        let n_second = 1 + equations.iter().map(|e| e.groups[1]).max()?;
        let both = by(&|e| e.groups[0] * n_second + e.groups[1])?;
        let squares: f64 = equations.iter().map(|e| e.score * e.score).sum();
        let freedom = n.checked_sub(p).filter(|f| *f > 0)? as f64;
        let mut meat_independent = DMatrix::zeros(p, p);
        for e in equations {
            meat_independent.ger(squares / freedom, &e.x, &e.x, 1.0);
        }
        let two_way = &first + &second - both;
        let covariances = [meat_independent, first, second, two_way]
            .into_iter()
            .map(|meat| &inverse * meat * &inverse)
            .collect();
        Some(Self { covariances })
    }

    /// Standard deviation of Σᵢ cᵢ·θᵢ.
    pub(crate) fn sigma(&self, c: &[f64]) -> f64 {
        self.variances(c).fold(0.0, f64::max).sqrt()
    }

    /// Covariance of the combinations `c` and `d`, from the grouping that makes `c` least sure.
    pub(crate) fn covariance(&self, c: &[f64], d: &[f64]) -> f64 {
        let worst =
            self.variances(c).enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i);
        bilinear(&self.covariances[worst], c, d)
    }

    fn variances<'a>(&'a self, c: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.covariances.iter().map(|v| bilinear(v, c, c))
    }
}

/// cᵀ V d
fn bilinear(v: &DMatrix<f64>, c: &[f64], d: &[f64]) -> f64 {
    (DVector::from_column_slice(c).transpose() * v * DVector::from_column_slice(d))[(0, 0)]
}

/// Σ_g s_g s_gᵀ · G/(G − p); infinite where there are not more groups than parameters would be honest, but one
/// grouping too coarse must not veto the others: that one then counts G/1.
fn meat(
    equations: &[Equation],
    p: usize,
    group: &dyn Fn(&Equation) -> usize,
) -> Option<DMatrix<f64>> {
    let mut order: Vec<usize> = (0..equations.len()).collect();
    order.sort_by_key(|&i| group(&equations[i]));
    let mut meat = DMatrix::zeros(p, p);
    let mut n_groups = 0.0;
    for chunk in order.chunk_by(|&i, &j| group(&equations[i]) == group(&equations[j])) {
        let mut score = DVector::zeros(p);
        for &i in chunk {
            score += &equations[i].x * equations[i].score;
        }
        meat.ger(1.0, &score, &score, 1.0);
        n_groups += 1.0;
    }
    let freedom: f64 = n_groups - p as f64;
    (n_groups > 0.0).then(|| meat * (n_groups / freedom.max(1.0)))
}
