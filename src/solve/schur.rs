//! Bordered problems: few parameters shared by many independent blocks.

#![allow(
    clippy::needless_range_loop,
    reason = "index loops over small matrices read as the formulas do"
)]

use super::{Cholesky, DenseCholesky, LeastSquares, NormalParts, Solution};
use crate::par::vectorized;

/// So many parameters can be shared.
pub const MAX_SHARED: usize = 12;

/// A least-squares problem of up to [`MAX_SHARED`] shared parameters, any number of *loose* ones, and any number of
/// blocks of `B` parameters each: a residual depends on the shared parameters, on one block, and on one loose parameter
/// at most (or on a [`Mixture`](super::Mixture) of several). Bundle adjustment of intrinsics (shared), heights of a
/// board's corners (loose) and poses (blocks) is one.
///
/// Its normal equations have the shape of an arrow; the blocks are eliminated one by one (Schur complement), so that
/// time and memory grow linearly with their number. With u the shared and loose parameters together:
///
/// ```text
/// ⎡ ΣUᵢ  W₁  W₂ … ⎤
/// ⎢ W₁ᵀ  V₁       ⎥     (Σ Uᵢ − Wᵢ·Vᵢ⁻¹·Wᵢᵀ)·δ_u = Σ gᵢ − Wᵢ·Vᵢ⁻¹·hᵢ
/// ⎣ W₂ᵀ      V₂ … ⎦     δᵢ = Vᵢ⁻¹·(hᵢ − Wᵢᵀ·δ_u)
/// ```
pub trait Bordered<const B: usize> {
    /// The state of one block; its tangent space has `B` dimensions.
    type Block: Clone;

    /// Adds all residuals of a block; false where the state lies outside the problem's domain.
    fn linearize_block(
        &self,
        index: usize,
        shared: &[f64],
        loose: &[f64],
        block: &Self::Block,
        normal: &mut BlockNormal<B>,
    ) -> bool;

    /// The precision (1/σ²) with which each shared parameter is known to be near zero beforehand; empty for not at all.
    fn shared_precision(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The inverse covariance with which the loose parameters are known to be near zero beforehand: row-major, of all
    /// of them; empty for not at all.
    fn loose_precision(&self) -> &[f64] {
        &[]
    }

    /// `block` moved by a step of its tangent space.
    fn advance_block(&self, block: &Self::Block, step: &[f64; B]) -> Self::Block;
}

/// What one block contributes to the normal equations. Of symmetric matrices the lower triangle counts.
#[derive(Clone, Debug)]
pub struct BlockNormal<const B: usize> {
    /// U: shared by shared, row-major.
    pub(super) u: Vec<f64>,
    /// W: shared by block.
    pub(super) w: Vec<[f64; B]>,
    /// V: block by block.
    pub(super) v: [[f64; B]; B],
    /// g: right-hand side of the shared parameters.
    pub(super) g: Vec<f64>,
    /// h: right-hand side of the block's parameters.
    pub(super) h: [f64; B],
    /// The rows of the loose parameters that this block has to do with.
    pub(super) loose: Vec<Loose<B>>,
    /// Loose by loose parameters beside the diagonal: row-major, of all of them; empty where there is nothing.
    pub(super) between: Vec<f64>,
    /// Half the (robust) sum of squares.
    cost: f64,
}

/// The rows of one loose parameter. Before they are mixed loose parameters never share a residual, so that U is
/// diagonal among them.
#[derive(Clone, Debug)]
pub(super) struct Loose<const B: usize> {
    pub(super) parameter: usize,
    /// As many as there are shared parameters, then zeros.
    pub(super) by_shared: [f64; MAX_SHARED],
    pub(super) by_itself: f64,
    pub(super) by_block: [f64; B],
    pub(super) right: f64,
}

impl<const B: usize> Loose<B> {
    pub(super) const fn zero(parameter: usize) -> Self {
        let by_shared = [0.0; MAX_SHARED];
        Self { parameter, by_shared, by_itself: 0.0, by_block: [0.0; B], right: 0.0 }
    }
}

/// A residual (observed − predicted) of a block of `B` parameters, its weight in the sum of squares, and the
/// derivatives of the *prediction*.
#[derive(Clone, Copy, Debug)]
pub struct Row<const B: usize> {
    /// In the sum of squares.
    pub weight: f64,
    /// Observed − predicted.
    pub residual: f64,
    /// By the block's parameters.
    pub d_block: [f64; B],
}

impl<const B: usize> Row<B> {
    /// Says nothing.
    pub const ZERO: Self = Self { weight: 0.0, residual: 0.0, d_block: [0.0; B] };
}

impl<const B: usize> BlockNormal<B> {
    /// Nothing added yet, with so many shared parameters.
    ///
    /// Panics where these are more than [`MAX_SHARED`].
    pub fn zero(n_shared: usize) -> Self {
        assert!(n_shared <= MAX_SHARED, "{n_shared} shared parameters");
        Self {
            u: vec![0.0; n_shared * n_shared],
            w: vec![[0.0; B]; n_shared],
            v: [[0.0; B]; B],
            g: vec![0.0; n_shared],
            h: [0.0; B],
            loose: Vec::new(),
            between: Vec::new(),
            cost: 0.0,
        }
    }

    /// How many parameters are shared.
    pub fn n_shared(&self) -> usize {
        self.g.len()
    }

    pub(crate) fn parts(&mut self) -> NormalParts<'_> {
        NormalParts {
            u: &mut self.u,
            w: self.w.as_flattened_mut(),
            v: self.v.as_flattened_mut(),
            g: &mut self.g,
            h: &mut self.h,
        }
    }

    /// Adds a residual that depends on the shared parameters, too. The cost is added apart, by
    /// [`add_cost`](Self::add_cost).
    #[inline]
    pub fn add_row(&mut self, row: &Row<B>, d_shared: &[f64]) {
        self.add_block_rows(&[*row]);
        let n = self.n_shared();
        for i in 0..n {
            let weighted = row.weight * d_shared[i];
            for j in 0..B {
                self.w[i][j] += weighted * row.d_block[j];
            }
            for j in 0..n {
                self.u[i * n + j] += weighted * d_shared[j];
            }
            self.g[i] += weighted * row.residual;
        }
    }

    /// Adds several residuals at once that depend on the block alone: the sums go through memory once for all of them.
    #[inline(always)]
    pub fn add_block_rows<const R: usize>(&mut self, rows: &[Row<B>; R]) {
        for i in 0..B {
            let mut sum = self.v[i];
            let mut right = self.h[i];
            for row in rows {
                let weighted = row.weight * row.d_block[i];
                for j in 0..B {
                    sum[j] += weighted * row.d_block[j];
                }
                right += weighted * row.residual;
            }
            self.v[i] = sum;
            self.h[i] = right;
        }
    }

    /// Room for so many loose parameters.
    pub fn reserve_loose(&mut self, n: usize) {
        self.loose.reserve(n);
    }

    /// The derivative of a row just added by a loose parameter. Rows of the same parameter come one after another.
    #[inline(always)]
    pub fn add_loose(
        &mut self,
        row: &Row<B>,
        d_shared: &[f64],
        (parameter, d_loose): (usize, f64),
    ) {
        if self.loose.last().is_none_or(|last| last.parameter != parameter) {
            self.loose.push(Loose::zero(parameter));
        }
        let Some(loose) = self.loose.last_mut() else { return };
        let weighted = row.weight * d_loose;
        loose.by_shared.iter_mut().zip(d_shared).for_each(|(by, d)| *by += weighted * d);
        for i in 0..B {
            loose.by_block[i] += weighted * row.d_block[i];
        }
        loose.by_itself += weighted * d_loose;
        loose.right += weighted * row.residual;
    }

    /// As [`add_loose`](Self::add_loose), with all its sums at once: of one parameter by the shared ones, by those of
    /// the block, by itself, and its right-hand side.
    #[inline(always)]
    pub(crate) fn push_loose(
        &mut self,
        parameter: usize,
        (by_shared, by_block): (&[f64], [f64; B]),
        (by_itself, right): (f64, f64),
    ) {
        let mut loose = Loose { by_itself, by_block, right, ..Loose::zero(parameter) };
        loose.by_shared[..by_shared.len()].copy_from_slice(by_shared);
        self.loose.push(loose);
    }

    /// Adds to the cost: half of ρ.
    #[inline]
    pub fn add_cost(&mut self, half_rho: f64) {
        self.cost += half_rho;
    }

    /// Half the (robust) sum of squares of this block.
    pub const fn cost(&self) -> f64 {
        self.cost
    }

    /// Adds this block, eliminated at this damping, to the equations of the shared and loose parameters (lower
    /// triangle); `None` where its own parameters are not determined.
    fn eliminate(&self, damping: f64, into: &mut Reduced) -> Option<Eliminated<B>> {
        vectorized(
            #[inline(always)]
            || self.eliminated(damping, into),
        )
    }

    #[inline(always)]
    fn eliminated(&self, damping: f64, into: &mut Reduced) -> Option<Eliminated<B>> {
        let n_shared = self.n_shared();
        let mut v = self.v;
        for i in 0..B {
            v[i][i] *= 1.0 + damping;
        }
        let factor = Cholesky::new(&v)?;
        let z = factor.forward(&self.h);
        let mut rows: Vec<(usize, [f64; B])> = Vec::with_capacity(n_shared + self.loose.len());
        rows.extend((0..n_shared).map(|i| (i, factor.forward(&self.w[i]))));
        rows.extend(
            self.loose.iter().map(|l| (n_shared + l.parameter, factor.forward(&l.by_block))),
        );
        let n = into.n();
        for i in 0..n_shared {
            for j in 0..=i {
                into.information[i * n + j] += self.u[i * n_shared + j];
            }
            into.information[i * n + i] += damping * self.u[i * n_shared + i];
            into.score[i] += self.g[i];
        }
        for loose in &self.loose {
            let i = n_shared + loose.parameter;
            for j in 0..n_shared {
                into.information[i * n + j] += loose.by_shared[j];
            }
            into.information[i * n + i] += (1.0 + damping) * loose.by_itself;
            into.score[i] += loose.right;
        }
        let n_between = self.between.len().isqrt();
        for (i, row) in self.between.chunks(n_between.max(1)).enumerate() {
            let sums = &mut into.information[(n_shared + i) * n + n_shared..][..i];
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
        // The products of one row with all before it, side by side; then each to its place.
        let mut columns = vec![0.0; B * rows.len()];
        for (a, (_, y)) in rows.iter().enumerate() {
            for k in 0..B {
                columns[k * rows.len() + a] = y[k];
            }
        }
        let mut dots = vec![0.0; rows.len()];
        for (a, (i, y)) in rows.iter().enumerate() {
            let dots = &mut dots[..=a];
            dots.fill(0.0);
            for k in 0..B {
                for (dot, other) in dots.iter_mut().zip(&columns[k * rows.len()..]) {
                    *dot += y[k] * other;
                }
            }
            for ((j, _), dot) in rows.iter().zip(&*dots) {
                into.information[i.max(j) * n + i.min(j)] -= dot;
            }
            let dot: f64 = (0..B).map(|k| y[k] * z[k]).sum();
            into.score[*i] -= dot;
        }
        Some(Eliminated { factor, rows, z })
    }

    /// After a step of the shared and loose parameters and of its own.
    pub(super) fn follow(&mut self, border: &[f64], own: &[f64; B]) {
        let n_shared = self.n_shared();
        // ½·δᵀ·(before + after) is what the step gains.
        let mut gain = 0.0;
        let lower = |i: usize, j: usize| (i.max(j), i.min(j));
        let mut h = self.h;
        for k in 0..B {
            let by_own: f64 = (0..B)
                .map(|l| {
                    let (a, b) = lower(k, l);
                    self.v[a][b] * own[l]
                })
                .sum();
            let by_shared: f64 = (0..n_shared).map(|i| self.w[i][k] * border[i]).sum();
            let by_loose: f64 =
                self.loose.iter().map(|l| l.by_block[k] * border[n_shared + l.parameter]).sum();
            h[k] -= by_own + by_shared + by_loose;
            gain += own[k] * (self.h[k] + h[k]);
        }
        let mut g = self.g.clone();
        for i in 0..n_shared {
            let by_shared: f64 = (0..n_shared)
                .map(|j| {
                    let (a, b) = lower(i, j);
                    self.u[a * n_shared + b] * border[j]
                })
                .sum();
            let by_own: f64 = (0..B).map(|k| self.w[i][k] * own[k]).sum();
            let by_loose: f64 =
                self.loose.iter().map(|l| l.by_shared[i] * border[n_shared + l.parameter]).sum();
            g[i] -= by_shared + by_own + by_loose;
            gain += border[i] * (self.g[i] + g[i]);
        }
        let n = self.between.len().isqrt();
        for loose in &mut self.loose {
            let (at, before) = (loose.parameter, loose.right);
            let by_shared: f64 = (0..n_shared).map(|i| loose.by_shared[i] * border[i]).sum();
            let by_own: f64 = (0..B).map(|k| loose.by_block[k] * own[k]).sum();
            let by_others: f64 = (0..n)
                .map(|other| {
                    let (a, b) = lower(at, other);
                    self.between[a * n + b] * border[n_shared + other]
                })
                .sum();
            loose.right -= by_shared + by_own + by_others + loose.by_itself * border[n_shared + at];
            gain += border[n_shared + at] * (before + loose.right);
        }
        (self.h, self.g) = (h, g);
        self.cost -= 0.5 * gain;
    }

    /// Adds what this block says about the shared and loose parameters once its own are eliminated; false, and nothing
    /// added, where its own are not determined.
    pub fn reduce_into(&self, sum: &mut Reduced) -> bool {
        let mut reduced = Reduced::zero(sum.n());
        if self.eliminate(0.0, &mut reduced).is_none() {
            return false;
        }
        reduced.mirror();
        sum.add(&reduced);
        true
    }

    /// hᵀ·V⁻¹·h, twice what moving the block's own parameters alone would gain, and the logarithm of V's determinant;
    /// `None` where they are not determined.
    pub fn block_gain(&self) -> Option<(f64, f64)> {
        let factor = Cholesky::new(&self.v)?;
        let z = factor.forward(&self.h);
        Some((z.iter().map(|z| z * z).sum(), factor.log_determinant()))
    }

    /// The diagonal of U: what the block would say about each shared parameter if all others were known.
    pub fn shared_diagonal(&self) -> impl Iterator<Item = f64> {
        self.u.iter().step_by(self.n_shared() + 1).copied()
    }

    /// (V)⁻¹, the covariance of the block's own parameters for unit variance with the others known, and how these
    /// follow the others: δ_block = −V⁻¹·Wᵀ·δ_u, as one column per shared and loose parameter (of `n`). `None` where
    /// the block's own are not determined.
    pub fn block_response(&self, n: usize) -> Option<Response<B>> {
        let factor = Cholesky::new(&self.v)?;
        let mut follows = vec![[0.0; B]; n];
        let minus = |row: &[f64; B]| factor.solve(row).map(|x| -x);
        for (follows, by_block) in follows.iter_mut().zip(&self.w) {
            *follows = minus(by_block);
        }
        for loose in &self.loose {
            follows[self.n_shared() + loose.parameter] = minus(&loose.by_block);
        }
        Some((factor.inverse(), follows))
    }
}

/// A block's own covariance, and how its parameters follow each shared and loose one.
pub type Response<const B: usize> = ([[f64; B]; B], Vec<[f64; B]>);

/// What one block, or a sum of blocks, says about the shared parameters and, after these, the loose ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduced {
    /// Σ Uᵢ − Wᵢ·Vᵢ⁻¹·Wᵢᵀ, symmetric, row-major.
    pub information: Vec<f64>,
    /// Σ gᵢ − Wᵢ·Vᵢ⁻¹·hᵢ; at the minimum these sum to zero over all blocks.
    pub score: Vec<f64>,
}

impl Reduced {
    /// Nothing known of `n` parameters.
    pub fn zero(n: usize) -> Self {
        Self { information: vec![0.0; n * n], score: vec![0.0; n] }
    }

    /// How many parameters there are.
    pub fn n(&self) -> usize {
        self.score.len()
    }

    /// Adds what another block says.
    pub fn add(&mut self, other: &Self) {
        self.information.iter_mut().zip(&other.information).for_each(|(a, b)| *a += b);
        self.score.iter_mut().zip(&other.score).for_each(|(a, b)| *a += b);
    }

    /// Copies the lower triangle to the upper.
    fn mirror(&mut self) {
        let n = self.n();
        for i in 0..n {
            for j in 0..i {
                self.information[j * n + i] = self.information[i * n + j];
            }
        }
    }
}

struct Eliminated<const B: usize> {
    factor: Cholesky<B>,
    /// L⁻¹·Wᵀ: parameter and its column.
    rows: Vec<(usize, [f64; B])>,
    /// L⁻¹·h
    z: [f64; B],
}

/// Shared and loose parameters and all blocks: a state, or a step of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow<T> {
    /// The shared parameters.
    pub shared: Vec<f64>,
    /// The loose parameters.
    pub loose: Vec<f64>,
    /// The blocks.
    pub blocks: Vec<T>,
}

/// The normal equations of a [`Bordered`] problem.
#[derive(Clone, Debug)]
pub struct ArrowNormal<const B: usize> {
    /// What each block contributes.
    pub blocks: Vec<BlockNormal<B>>,
    /// What is known beforehand.
    pub prior: Reduced,
    prior_cost: f64,
}

/// A [`Bordered`] problem as [`minimize`](super::minimize) takes it.
#[derive(Clone, Copy, Debug)]
pub struct BySchur<'a, P, const B: usize>(pub &'a P);

impl<P: Bordered<B>, const B: usize> LeastSquares for BySchur<'_, P, B> {
    type State = Arrow<P::Block>;
    type Normal = ArrowNormal<B>;
    type Step = Arrow<[f64; B]>;

    fn linearize(&self, state: &Self::State) -> Option<Self::Normal> {
        let mut blocks = vec![BlockNormal::zero(state.shared.len()); state.blocks.len()];
        for (index, (block, normal)) in state.blocks.iter().zip(&mut blocks).enumerate() {
            if !self.0.linearize_block(index, &state.shared, &state.loose, block, normal) {
                return None;
            }
        }
        let (prior, prior_cost) = self.prior(state);
        Some(ArrowNormal { blocks, prior, prior_cost })
    }

    fn cost(&self, normal: &Self::Normal) -> f64 {
        normal.prior_cost + normal.blocks.iter().map(BlockNormal::cost).sum::<f64>()
    }

    fn solve(&self, normal: &Self::Normal, damping: f64) -> Option<Solution<Self::Step>> {
        let ArrowNormal { blocks: normal, prior, .. } = normal;
        let n = prior.n();
        let mut total = prior.clone();
        for i in 0..n {
            total.information[i * n + i] *= 1.0 + damping;
        }
        let mut eliminated = Vec::with_capacity(normal.len());
        for block in normal {
            eliminated.push(block.eliminate(damping, &mut total)?);
        }
        let border = DenseCholesky::new(total.information, n)?.solve(&total.score);
        let mut blocks = Vec::with_capacity(normal.len());
        // ½·δᵀ·(damping·D·δ + g): what the linear model says (Madsen, Nielsen, Tingleff 2004, equation 3.14).
        let mut decrease = 0.0;
        for i in 0..n {
            let damped = damping * prior.information[i * n + i] * border[i];
            decrease += border[i] * (damped + prior.score[i]);
        }
        let n_shared = normal.first().map_or(n, BlockNormal::n_shared);
        for (block, Eliminated { factor, rows, z }) in normal.iter().zip(&eliminated) {
            let mut rest = *z;
            for (i, y) in rows {
                for k in 0..B {
                    rest[k] -= y[k] * border[*i];
                }
            }
            for i in 0..n_shared {
                decrease +=
                    border[i] * (damping * block.u[i * n_shared + i] * border[i] + block.g[i]);
            }
            for loose in &block.loose {
                let step = border[n_shared + loose.parameter];
                decrease += step * (damping * loose.by_itself * step + loose.right);
            }
            let step = factor.backward(&rest);
            for k in 0..B {
                decrease += step[k] * (damping * block.v[k][k] * step[k] + block.h[k]);
            }
            blocks.push(step);
        }
        let (shared, loose) = border.split_at(n_shared);
        let step = Arrow { shared: shared.to_vec(), loose: loose.to_vec(), blocks };
        Some(Solution { step, predicted_decrease: 0.5 * decrease })
    }

    fn advance(&self, state: &Self::State, step: &Self::Step) -> Self::State {
        let shared =
            state.shared.iter().zip(&step.shared).map(|(value, step)| value + step).collect();
        let loose = state.loose.iter().zip(&step.loose).map(|(value, step)| value + step).collect();
        let blocks = state
            .blocks
            .iter()
            .zip(&step.blocks)
            .map(|(block, step)| self.0.advance_block(block, step))
            .collect();
        Arrow { shared, loose, blocks }
    }

    fn follow(&self, normal: &mut Self::Normal, step: &Self::Step) {
        let border: Vec<f64> = step.shared.iter().chain(&step.loose).copied().collect();
        let prior = &mut normal.prior;
        for (i, row) in prior.information.chunks(border.len().max(1)).enumerate() {
            let before = prior.score[i];
            prior.score[i] -= row.iter().zip(&border).map(|(a, x)| a * x).sum::<f64>();
            normal.prior_cost -= 0.5 * border[i] * (before + prior.score[i]);
        }
        for (block, own) in normal.blocks.iter_mut().zip(&step.blocks) {
            block.follow(&border, own);
        }
    }
}

impl<P: Bordered<B>, const B: usize> BySchur<'_, P, B> {
    /// What is known beforehand, and what it costs at a state.
    fn prior(&self, state: &Arrow<P::Block>) -> (Reduced, f64) {
        let n_shared = state.shared.len();
        let n = n_shared + state.loose.len();
        let mut prior = Reduced::zero(n);
        let mut cost = 0.0;
        for (i, precision) in self.0.shared_precision().into_iter().enumerate() {
            prior.information[i * n + i] = precision;
            prior.score[i] = -precision * state.shared[i];
            cost += 0.5 * precision * state.shared[i] * state.shared[i];
        }
        let precision = self.0.loose_precision();
        for (i, row) in precision.chunks(state.loose.len().max(1)).enumerate() {
            prior.information[(n_shared + i) * n + n_shared..][..row.len()].copy_from_slice(row);
            let dot: f64 = row.iter().zip(&state.loose).map(|(p, x)| p * x).sum();
            prior.score[n_shared + i] = -dot;
            cost += 0.5 * dot * state.loose[i];
        }
        (prior, cost)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::math;
    use crate::solve::{Effort, minimize};

    /// Curves y = aᵢ·exp(−k·t) + bᵢ + c·t² (1 + l_j at every tenth t): k and c shared, l loose, a and b of each curve
    /// its own.
    pub(in crate::solve) struct Decays {
        precision: [f64; 2],
        /// Of three loose parameters, or none.
        pub(in crate::solve) loose_precision: Vec<f64>,
        curves: Vec<Vec<(f64, f64)>>,
    }

    impl Bordered<2> for Decays {
        type Block = [f64; 2];

        fn linearize_block(
            &self,
            index: usize,
            shared: &[f64],
            loose: &[f64],
            &[a, b]: &[f64; 2],
            normal: &mut BlockNormal<2>,
        ) -> bool {
            let (k, c) = (shared[0], shared[1]);
            for &(t, y) in &self.curves[index] {
                let e = math::exp(-k * t);
                let parameter = (10.0 * t / 3.0).round() as usize;
                let bump =
                    if parameter.is_multiple_of(10) { loose.get(parameter / 10) } else { None };
                let bump = bump.copied().unwrap_or(0.0);
                let residual = y - (a * e + b + c * t * t * (1.0 + bump));
                let by_shared = [-t * a * e, t * t * (1.0 + bump)];
                let row = Row { weight: 1.0, residual, d_block: [e, 1.0] };
                normal.add_row(&row, &by_shared);
                if parameter.is_multiple_of(10) && !loose.is_empty() {
                    normal.add_loose(&row, &by_shared, (parameter / 10, c * t * t));
                }
                normal.add_cost(0.5 * residual * residual);
            }
            k > 0.0
        }

        fn shared_precision(&self) -> Vec<f64> {
            self.precision.to_vec()
        }

        fn loose_precision(&self) -> &[f64] {
            &self.loose_precision
        }

        fn advance_block(&self, block: &[f64; 2], step: &[f64; 2]) -> [f64; 2] {
            [block[0] + step[0], block[1] + step[1]]
        }
    }

    pub(in crate::solve) fn decays(noise: f64) -> (Decays, Arrow<[f64; 2]>) {
        let truth = [[3.0, 1.0], [-2.0, 0.5], [1.0, 4.0]];
        let curves = truth
            .iter()
            .enumerate()
            .map(|(i, [a, b])| {
                (0..30)
                    .map(|j| {
                        let t = f64::from(j) * 0.3;
                        let wobble = noise * math::sin(12.9 * t + 7.7 * i as f64);
                        (t, a * math::exp(-0.7 * t) + b + 0.05 * t * t + wobble)
                    })
                    .collect()
            })
            .collect();
        (
            Decays { precision: [0.0; 2], loose_precision: Vec::new(), curves },
            Arrow { shared: vec![0.4, 0.0], loose: Vec::new(), blocks: vec![[1.0, 0.0]; 3] },
        )
    }

    #[test]
    fn finds_the_parameters() {
        let (problem, start) = decays(0.0);
        let minimum = minimize(&BySchur(&problem), start, Effort::default()).unwrap();
        assert!((minimum.state.shared[0] - 0.7).abs() < 1e-9, "{:?}", minimum.state);
        assert!((minimum.state.shared[1] - 0.05).abs() < 1e-9);
        assert!((minimum.state.blocks[1][0] + 2.0).abs() < 1e-8);
        assert!(minimum.n_iterations < 40, "{}", minimum.n_iterations);
    }

    /// One step of the arrow against the same equations solved whole.
    #[test]
    fn step_solves_the_whole_system() {
        let (mut problem, mut start) = decays(0.01);
        problem.precision[1] = 7.0;
        problem.loose_precision = vec![3.0, 1.0, 0.0, 1.0, 5.0, 0.5, 0.0, 0.5, 4.0];
        start.shared[1] = 0.2;
        start.loose = vec![0.3, -0.2, 0.1];
        let problem = BySchur(&problem);
        let normal = problem.linearize(&start).unwrap();
        for damping in [0.0, 0.3] {
            let Solution { step, predicted_decrease } = problem.solve(&normal, damping).unwrap();
            // Shared 0 and 1, loose 2 to 4, blocks from 5.
            let mut whole = [[0.0; 11]; 11];
            let mut right = [0.0; 11];
            for (index, block) in normal.blocks.iter().enumerate() {
                let at = 5 + 2 * index;
                for i in 0..2 {
                    right[i] += block.g[i];
                    right[at + i] = block.h[i];
                    for j in 0..2 {
                        whole[i][j] += block.u[2 * i.max(j) + i.min(j)];
                        whole[at + i][at + j] = block.v[i.max(j)][i.min(j)];
                        whole[at + j][i] = block.w[i][j];
                        whole[i][at + j] = block.w[i][j];
                    }
                }
                for loose in &block.loose {
                    let row = 2 + loose.parameter;
                    right[row] += loose.right;
                    whole[row][row] += loose.by_itself;
                    for i in 0..2 {
                        whole[row][i] += loose.by_shared[i];
                        whole[i][row] += loose.by_shared[i];
                        whole[row][at + i] = loose.by_block[i];
                        whole[at + i][row] = loose.by_block[i];
                    }
                }
            }
            whole[1][1] += 7.0;
            right[1] -= 7.0 * start.shared[1];
            let prior = [[3.0, 1.0, 0.0], [1.0, 5.0, 0.5], [0.0, 0.5, 4.0]];
            for i in 0..3 {
                for j in 0..3 {
                    whole[2 + i][2 + j] += prior[i][j];
                    right[2 + i] -= prior[i][j] * start.loose[j];
                }
            }
            let undamped = whole;
            for i in 0..11 {
                whole[i][i] *= 1.0 + damping;
            }
            let x = Cholesky::new(&whole).unwrap().solve(&right);
            let border = step.shared.iter().chain(&step.loose);
            let flat: Vec<f64> = border.chain(step.blocks.iter().flatten()).copied().collect();
            for i in 0..11 {
                assert!((flat[i] - x[i]).abs() < 1e-10 * x[i].abs().max(1.0));
            }
            let mut quadratic = 0.0;
            for i in 0..11 {
                quadratic += right[i] * x[i];
                for j in 0..11 {
                    quadratic -= 0.5 * x[i] * undamped[i][j] * x[j];
                }
            }
            assert!((quadratic - predicted_decrease).abs() < 1e-9 * quadratic);
        }
    }

    #[test]
    fn scores_vanish_at_the_minimum() {
        let (mut problem, mut start) = decays(0.05);
        problem.loose_precision = vec![3.0, 1.0, 0.0, 1.0, 5.0, 0.5, 0.0, 0.5, 4.0];
        start.loose = vec![0.0; 3];
        let minimum = minimize(&BySchur(&problem), start, Effort::default()).unwrap();
        assert!(minimum.converged);
        let mut total = minimum.normal.prior.clone();
        for block in &minimum.normal.blocks {
            assert!(block.reduce_into(&mut total));
        }
        assert!(total.score.iter().all(|s| s.abs() < 1e-6), "{total:?}");
        assert!(total.information[1] == total.information[5]);
    }

    #[test]
    fn a_step_out_of_the_domain_is_not_taken() {
        let (problem, mut start) = decays(0.0);
        start.shared[0] = -1.0;
        assert!(minimize(&BySchur(&problem), start, Effort::default()).is_none());
    }
}
