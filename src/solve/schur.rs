//! Bordered problems: few parameters shared by many independent blocks.

#![allow(
    clippy::needless_range_loop,
    reason = "index loops over small matrices read as the formulas do"
)]

use super::{Cholesky, LeastSquares, Solution};

/// A least-squares problem of `S` shared parameters and any number of blocks of `B` parameters each, where a residual
/// depends on the shared parameters and on one block. Bundle adjustment of intrinsics and poses is one.
///
/// Its normal equations have the shape of an arrow; the blocks are eliminated one by one (Schur complement), so that
/// time and memory grow linearly with their number:
///
/// ```text
/// ⎡ ΣUᵢ  W₁  W₂ … ⎤
/// ⎢ W₁ᵀ  V₁       ⎥     (Σ Uᵢ − Wᵢ·Vᵢ⁻¹·Wᵢᵀ)·δ_shared = Σ gᵢ − Wᵢ·Vᵢ⁻¹·hᵢ
/// ⎣ W₂ᵀ      V₂ … ⎦     δᵢ = Vᵢ⁻¹·(hᵢ − Wᵢᵀ·δ_shared)
/// ```
pub trait Bordered<const S: usize, const B: usize> {
    /// The state of one block; its tangent space has `B` dimensions.
    type Block: Clone;

    /// Adds all residuals of a block; false where the state lies outside the problem's domain.
    fn linearize_block(
        &self,
        index: usize,
        shared: &[f64; S],
        block: &Self::Block,
        normal: &mut BlockNormal<S, B>,
    ) -> bool;

    /// The precision (1/σ²) with which each shared parameter is known to be near zero beforehand; 0 for not at all.
    fn shared_precision(&self) -> [f64; S] {
        [0.0; S]
    }

    /// `block` moved by a step of its tangent space.
    fn advance_block(&self, block: &Self::Block, step: &[f64; B]) -> Self::Block;
}

/// What one block contributes to the normal equations. Matrices hold their lower triangle.
#[derive(Clone, Copy, Debug)]
pub struct BlockNormal<const S: usize, const B: usize> {
    /// U: shared by shared.
    u: [[f64; S]; S],
    /// W: shared by block.
    w: [[f64; B]; S],
    /// V: block by block.
    v: [[f64; B]; B],
    /// g: right-hand side of the shared parameters.
    g: [f64; S],
    /// h: right-hand side of the block's parameters.
    h: [f64; B],
    /// Half the (robust) sum of squares.
    cost: f64,
}

impl<const S: usize, const B: usize> BlockNormal<S, B> {
    /// Nothing added yet.
    pub const ZERO: Self = Self {
        u: [[0.0; S]; S],
        w: [[0.0; B]; S],
        v: [[0.0; B]; B],
        g: [0.0; S],
        h: [0.0; B],
        cost: 0.0,
    };

    /// Adds a residual (observed − predicted) with the derivatives of the *prediction*, in a sum of squares with this
    /// weight. The cost is added apart, by [`add_cost`](Self::add_cost).
    #[inline]
    pub fn add_row(&mut self, weight: f64, residual: f64, d_shared: &[f64; S], d_block: &[f64; B]) {
        let weighted = weight * residual;
        for i in 0..B {
            let row = weight * d_block[i];
            for j in 0..=i {
                self.v[i][j] += row * d_block[j];
            }
            self.h[i] += weighted * d_block[i];
        }
        for i in 0..S {
            let row = weight * d_shared[i];
            for j in 0..B {
                self.w[i][j] += row * d_block[j];
            }
            for j in 0..=i {
                self.u[i][j] += row * d_shared[j];
            }
            self.g[i] += weighted * d_shared[i];
        }
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

    /// The block eliminated at this damping; `None` where its own parameters are not determined.
    fn eliminate(&self, damping: f64) -> Option<Eliminated<S, B>> {
        let mut v = self.v;
        for i in 0..B {
            v[i][i] *= 1.0 + damping;
        }
        let factor = Cholesky::new(&v)?;
        let z = factor.forward(&self.h);
        let mut reduced = Reduced { information: self.u, score: self.g };
        let mut y = [[0.0; B]; S];
        for i in 0..S {
            y[i] = factor.forward(&self.w[i]);
            reduced.information[i][i] += damping * self.u[i][i];
            for j in 0..=i {
                let dot: f64 = (0..B).map(|k| y[i][k] * y[j][k]).sum();
                reduced.information[i][j] -= dot;
            }
            let dot: f64 = (0..B).map(|k| y[i][k] * z[k]).sum();
            reduced.score[i] -= dot;
        }
        Some(Eliminated { factor, y, z, reduced })
    }

    /// What this block says about the shared parameters once its own are eliminated; `None` where its own are not
    /// determined.
    pub fn reduce(&self) -> Option<Reduced<S>> {
        let mut reduced = self.eliminate(0.0)?.reduced;
        for i in 0..S {
            for j in 0..i {
                reduced.information[j][i] = reduced.information[i][j];
            }
        }
        Some(reduced)
    }

    /// The diagonal of U: what the block would say about each shared parameter if all others were known.
    pub fn shared_diagonal(&self) -> [f64; S] {
        std::array::from_fn(|i| self.u[i][i])
    }

    /// (V)⁻¹, the covariance of the block's own parameters for unit variance with the shared ones known; `None` where
    /// they are not determined.
    pub fn block_covariance(&self) -> Option<[[f64; B]; B]> {
        Some(Cholesky::new(&self.v)?.inverse())
    }
}

/// What one block, or a sum of blocks, says about the shared parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reduced<const S: usize> {
    /// Σ Uᵢ − Wᵢ·Vᵢ⁻¹·Wᵢᵀ, symmetric.
    pub information: [[f64; S]; S],
    /// Σ gᵢ − Wᵢ·Vᵢ⁻¹·hᵢ; at the minimum these sum to zero over all blocks.
    pub score: [f64; S],
}

impl<const S: usize> Reduced<S> {
    /// Nothing known.
    pub const ZERO: Self = Self { information: [[0.0; S]; S], score: [0.0; S] };

    /// Adds what another block says.
    pub fn add(&mut self, other: &Self) {
        for i in 0..S {
            for j in 0..S {
                self.information[i][j] += other.information[i][j];
            }
            self.score[i] += other.score[i];
        }
    }
}

struct Eliminated<const S: usize, const B: usize> {
    factor: Cholesky<B>,
    /// L⁻¹·Wᵀ, by shared parameter.
    y: [[f64; B]; S],
    /// L⁻¹·h
    z: [f64; B],
    /// Lower triangle only.
    reduced: Reduced<S>,
}

/// Shared parameters and all blocks: a state, or a step of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow<const S: usize, T> {
    /// The shared parameters.
    pub shared: [f64; S],
    /// The blocks.
    pub blocks: Vec<T>,
}

/// The normal equations of a [`Bordered`] problem.
#[derive(Clone, Debug)]
pub struct ArrowNormal<const S: usize, const B: usize> {
    /// What each block contributes.
    pub blocks: Vec<BlockNormal<S, B>>,
    /// What is known beforehand.
    pub prior: Reduced<S>,
    prior_cost: f64,
}

/// A [`Bordered`] problem as [`minimize`](super::minimize) takes it.
#[derive(Clone, Copy, Debug)]
pub struct BySchur<'a, P, const S: usize, const B: usize>(pub &'a P);

impl<P: Bordered<S, B>, const S: usize, const B: usize> LeastSquares for BySchur<'_, P, S, B> {
    type State = Arrow<S, P::Block>;
    type Normal = ArrowNormal<S, B>;
    type Step = Arrow<S, [f64; B]>;

    fn linearize(&self, state: &Self::State) -> Option<Self::Normal> {
        let mut blocks = vec![BlockNormal::ZERO; state.blocks.len()];
        for (index, (block, normal)) in state.blocks.iter().zip(&mut blocks).enumerate() {
            if !self.0.linearize_block(index, &state.shared, block, normal) {
                return None;
            }
        }
        let mut prior = Reduced::ZERO;
        let mut prior_cost = 0.0;
        for (i, precision) in self.0.shared_precision().into_iter().enumerate() {
            prior.information[i][i] = precision;
            prior.score[i] = -precision * state.shared[i];
            prior_cost += 0.5 * precision * state.shared[i] * state.shared[i];
        }
        Some(ArrowNormal { blocks, prior, prior_cost })
    }

    fn cost(&self, normal: &Self::Normal) -> f64 {
        normal.prior_cost + normal.blocks.iter().map(BlockNormal::cost).sum::<f64>()
    }

    fn solve(&self, normal: &Self::Normal, damping: f64) -> Option<Solution<Self::Step>> {
        let ArrowNormal { blocks: normal, prior, .. } = normal;
        let mut total = *prior;
        for i in 0..S {
            total.information[i][i] *= 1.0 + damping;
        }
        let mut eliminated = Vec::with_capacity(normal.len());
        for block in normal {
            let block = block.eliminate(damping)?;
            total.add(&block.reduced);
            eliminated.push(block);
        }
        let shared = Cholesky::new(&total.information)?.solve(&total.score);
        let mut blocks = Vec::with_capacity(normal.len());
        // ½·δᵀ·(damping·D·δ + g): what the linear model says (Madsen, Nielsen, Tingleff 2004, equation 3.14).
        let mut decrease = 0.0;
        for i in 0..S {
            let damped = damping * prior.information[i][i] * shared[i];
            decrease += shared[i] * (damped + prior.score[i]);
        }
        for (block, Eliminated { factor, y, z, .. }) in normal.iter().zip(&eliminated) {
            let mut rest = *z;
            for i in 0..S {
                for k in 0..B {
                    rest[k] -= y[i][k] * shared[i];
                }
                decrease += shared[i] * (damping * block.u[i][i] * shared[i] + block.g[i]);
            }
            let step = factor.backward(&rest);
            for k in 0..B {
                decrease += step[k] * (damping * block.v[k][k] * step[k] + block.h[k]);
            }
            blocks.push(step);
        }
        let step = Arrow { shared, blocks };
        Some(Solution { step, predicted_decrease: 0.5 * decrease })
    }

    fn advance(&self, state: &Self::State, step: &Self::Step) -> Self::State {
        let mut shared = state.shared;
        for i in 0..S {
            shared[i] += step.shared[i];
        }
        let blocks = state
            .blocks
            .iter()
            .zip(&step.blocks)
            .map(|(block, step)| self.0.advance_block(block, step))
            .collect();
        Arrow { shared, blocks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::{Effort, minimize};

    /// Curves y = aᵢ·exp(−k·t) + bᵢ + c·t²: k and c shared, a and b of each curve its own.
    struct Decays {
        precision: [f64; 2],
        curves: Vec<Vec<(f64, f64)>>,
    }

    impl Bordered<2, 2> for Decays {
        type Block = [f64; 2];

        fn linearize_block(
            &self,
            index: usize,
            &[k, c]: &[f64; 2],
            &[a, b]: &[f64; 2],
            normal: &mut BlockNormal<2, 2>,
        ) -> bool {
            for &(t, y) in &self.curves[index] {
                let e = (-k * t).exp();
                let residual = y - (a * e + b + c * t * t);
                normal.add_row(1.0, residual, &[-t * a * e, t * t], &[e, 1.0]);
                normal.add_cost(0.5 * residual * residual);
            }
            k > 0.0
        }

        fn shared_precision(&self) -> [f64; 2] {
            self.precision
        }

        fn advance_block(&self, block: &[f64; 2], step: &[f64; 2]) -> [f64; 2] {
            [block[0] + step[0], block[1] + step[1]]
        }
    }

    fn decays(noise: f64) -> (Decays, Arrow<2, [f64; 2]>) {
        let truth = [[3.0, 1.0], [-2.0, 0.5], [1.0, 4.0]];
        let curves = truth
            .iter()
            .enumerate()
            .map(|(i, [a, b])| {
                (0..30)
                    .map(|j| {
                        let t = f64::from(j) * 0.3;
                        let wobble = noise * (12.9 * t + 7.7 * i as f64).sin();
                        (t, a * (-0.7 * t).exp() + b + 0.05 * t * t + wobble)
                    })
                    .collect()
            })
            .collect();
        (
            Decays { precision: [0.0; 2], curves },
            Arrow { shared: [0.4, 0.0], blocks: vec![[1.0, 0.0]; 3] },
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
        start.shared[1] = 0.2;
        let problem = BySchur(&problem);
        let normal = problem.linearize(&start).unwrap();
        for damping in [0.0, 0.3] {
            let Solution { step, predicted_decrease } = problem.solve(&normal, damping).unwrap();
            let mut whole = [[0.0; 8]; 8];
            let mut right = [0.0; 8];
            for (index, block) in normal.blocks.iter().enumerate() {
                let at = 2 + 2 * index;
                for i in 0..2 {
                    right[i] += block.g[i];
                    right[at + i] = block.h[i];
                    for j in 0..2 {
                        whole[i][j] += block.u[i.max(j)][i.min(j)];
                        whole[at + i][at + j] = block.v[i.max(j)][i.min(j)];
                        whole[at + j][i] = block.w[i][j];
                        whole[i][at + j] = block.w[i][j];
                    }
                }
            }
            whole[1][1] += 7.0;
            right[1] -= 7.0 * start.shared[1];
            let undamped = whole;
            for i in 0..8 {
                whole[i][i] *= 1.0 + damping;
            }
            let x = Cholesky::new(&whole).unwrap().solve(&right);
            let flat: Vec<f64> =
                step.shared.iter().chain(step.blocks.iter().flatten()).copied().collect();
            for i in 0..8 {
                assert!((flat[i] - x[i]).abs() < 1e-10 * x[i].abs().max(1.0));
            }
            let mut quadratic = 0.0;
            for i in 0..8 {
                quadratic += right[i] * x[i];
                for j in 0..8 {
                    quadratic -= 0.5 * x[i] * undamped[i][j] * x[j];
                }
            }
            assert!((quadratic - predicted_decrease).abs() < 1e-9 * quadratic);
        }
    }

    #[test]
    fn scores_vanish_at_the_minimum() {
        let (problem, start) = decays(0.05);
        let minimum = minimize(&BySchur(&problem), start, Effort::default()).unwrap();
        assert!(minimum.converged);
        let mut total = Reduced::ZERO;
        for block in &minimum.normal.blocks {
            total.add(&block.reduce().unwrap());
        }
        assert!(total.score.iter().all(|s| s.abs() < 1e-6), "{total:?}");
        assert!(total.information[0][1] == total.information[1][0]);
    }

    #[test]
    fn a_step_out_of_the_domain_is_not_taken() {
        let (problem, mut start) = decays(0.0);
        start.shared[0] = -1.0;
        assert!(minimize(&BySchur(&problem), start, Effort::default()).is_none());
    }
}
