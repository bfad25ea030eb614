//! Many numbers made of few loose parameters.

use super::{BlockNormal, schur::Loose};

/// How numbers of which a residual depends on one at most are made of loose parameters: the heights of many corners of
/// those of few knots.
#[derive(Clone, Debug)]
pub struct Mixture {
    /// For each number the loose parameters and their shares in it; none twice.
    pub shares: Vec<Vec<(usize, f64)>>,
    /// How many loose parameters there are.
    pub n_parameters: usize,
}

impl<const B: usize> BlockNormal<B> {
    /// Takes the loose parameters so far for mixtures of others.
    pub fn mix_loose(&mut self, mixture: &Mixture) {
        let n = mixture.n_parameters;
        let mut mixed: Vec<Loose<B>> = (0..n).map(Loose::zero).collect();
        let mut between = vec![0.0; n * n];
        for loose in &self.loose {
            let shares = &mixture.shares[loose.parameter];
            for (at, &(a, share)) in shares.iter().enumerate() {
                let into = &mut mixed[a];
                (0..self.n_shared()).for_each(|i| into.by_shared[i] += share * loose.by_shared[i]);
                (0..B).for_each(|i| into.by_block[i] += share * loose.by_block[i]);
                into.right += share * loose.right;
                into.by_itself += share * share * loose.by_itself;
                let weighted = share * loose.by_itself;
                for &(b, other) in &shares[..at] {
                    between[a.max(b) * n + a.min(b)] += weighted * other;
                }
            }
        }
        mixed.retain(|loose| loose.by_itself > 0.0);
        (self.loose, self.between) = (mixed, between);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::{BySchur, LeastSquares, Reduced, schur::tests::decays};

    /// What a block says of mixed parameters is what it says of the numbers that they are mixed to.
    #[test]
    fn mixed_parameters_are_a_change_of_variables() {
        let (mut problem, mut start) = decays(0.01);
        problem.loose_precision = vec![0.0; 9];
        start.loose = vec![0.3, -0.2, 0.1];
        let plain = BySchur(&problem).linearize(&start).unwrap().blocks.swap_remove(1);
        // The number at t = 0 says nothing; the mixture of the others is invertible all the same.
        let shares = vec![
            vec![(0, 1.0)],
            vec![(0, 0.3), (1, 0.5), (2, 0.7)],
            vec![(2, 2.0), (0, -0.5), (1, 0.2)],
        ];
        let mut mixed = plain.clone();
        mixed.mix_loose(&Mixture { shares: shares.clone(), n_parameters: 3 });
        let mut change = [[0.0; 5]; 5];
        (change[0][0], change[1][1]) = (1.0, 1.0);
        for (number, shares) in shares.iter().enumerate() {
            shares.iter().for_each(|(k, share)| change[2 + number][2 + k] = *share);
        }
        let (mut before, mut after) = (Reduced::zero(5), Reduced::zero(5));
        assert!(plain.reduce_into(&mut before) && mixed.reduce_into(&mut after));
        let step = [0.01, -0.02, 0.3, -0.1, 0.2];
        let [mut stepped, mut whole] = [mixed.clone(), plain.clone()];
        let moved: Vec<f64> = change.map(|row| (0..5).map(|j| row[j] * step[j]).sum()).to_vec();
        stepped.follow(&step, &[0.1, -0.3]);
        whole.follow(&moved, &[0.1, -0.3]);
        assert!((stepped.cost() - whole.cost()).abs() < 1e-9 * plain.cost());
        for k in 0..2 {
            assert!((stepped.h[k] - whole.h[k]).abs() < 1e-9 * plain.h[k].abs().max(1.0));
        }
        for i in 0..5 {
            let score: f64 = (0..5).map(|k| change[k][i] * before.score[k]).sum();
            assert!((after.score[i] - score).abs() < 1e-9 * score.abs().max(1.0));
            for j in 0..5 {
                let mut sum = 0.0;
                for k in 0..5 {
                    for l in 0..5 {
                        sum += change[k][i] * before.information[5 * k + l] * change[l][j];
                    }
                }
                assert!((after.information[5 * i + j] - sum).abs() < 1e-9 * sum.abs().max(1.0));
            }
        }
    }
}
