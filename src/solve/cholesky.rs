//! Small dense symmetric systems.

#![allow(
    clippy::needless_range_loop,
    reason = "triangular loops over two indices read as the formulas do"
)]

use crate::math;
use crate::par::{dot, vectorized};

/// A symmetric positive definite matrix as L·Lᵀ.
#[derive(Clone, Copy, Debug)]
pub struct Cholesky<const N: usize> {
    /// L below and on the diagonal; its diagonal is stored inverted.
    factor: [[f64; N]; N],
}

impl<const N: usize> Cholesky<N> {
    /// Factors a matrix given by its lower triangle; `None` where it is not positive definite within f64.
    ///
    /// A pivot counts as zero below 1e-14 of its diagonal element: what is left then is rounding.
    pub fn new(matrix: &[[f64; N]; N]) -> Option<Self> {
        let mut l = *matrix;
        for j in 0..N {
            let mut pivot = l[j][j];
            for k in 0..j {
                pivot -= l[j][k] * l[j][k];
            }
            if !(pivot > 1e-14 * matrix[j][j]) {
                return None;
            }
            let inverse = 1.0 / pivot.sqrt();
            l[j][j] = inverse;
            for i in j + 1..N {
                let mut sum = l[i][j];
                for k in 0..j {
                    sum -= l[i][k] * l[j][k];
                }
                l[i][j] = sum * inverse;
            }
        }
        Some(Self { factor: l })
    }

    /// The logarithm of the matrix' determinant.
    pub fn log_determinant(&self) -> f64 {
        (0..N).map(|i| -2.0 * math::ln(self.factor[i][i])).sum()
    }

    /// L⁻¹·b
    pub fn forward(&self, b: &[f64; N]) -> [f64; N] {
        let l = &self.factor;
        let mut y = *b;
        for i in 0..N {
            for k in 0..i {
                y[i] -= l[i][k] * y[k];
            }
            y[i] *= l[i][i];
        }
        y
    }

    /// L⁻ᵀ·b
    pub fn backward(&self, b: &[f64; N]) -> [f64; N] {
        let l = &self.factor;
        let mut x = *b;
        for i in (0..N).rev() {
            for k in i + 1..N {
                x[i] -= l[k][i] * x[k];
            }
            x[i] *= l[i][i];
        }
        x
    }

    /// The solution x of L·Lᵀ·x = b.
    pub fn solve(&self, b: &[f64; N]) -> [f64; N] {
        self.backward(&self.forward(b))
    }

    /// (L·Lᵀ)⁻¹
    pub fn inverse(&self) -> [[f64; N]; N] {
        let mut inverse = [[0.0; N]; N];
        for j in 0..N {
            let mut unit = [0.0; N];
            unit[j] = 1.0;
            let column = self.solve(&unit);
            for i in 0..N {
                inverse[i][j] = column[i];
            }
        }
        inverse
    }
}

/// As [`Cholesky`], for a size known at run time.
#[derive(Clone, Debug)]
pub struct DenseCholesky {
    /// L below and on the diagonal, row-major; its diagonal is stored inverted.
    factor: Vec<f64>,
    n: usize,
}

impl DenseCholesky {
    /// Factors an `n` by `n` matrix (row-major) given by its lower triangle; `None` where it is not positive definite
    /// within f64.
    pub fn new(matrix: Vec<f64>, n: usize) -> Option<Self> {
        vectorized(
            #[inline(always)]
            || Self::factor(matrix, n),
        )
    }

    #[inline(always)]
    fn factor(matrix: Vec<f64>, n: usize) -> Option<Self> {
        let mut l = matrix;
        for i in 0..n {
            let (above, row) = l.split_at_mut(i * n);
            let whole = row[i];
            for j in 0..i {
                let other = &above[j * n..j * n + j];
                row[j] = (row[j] - dot(&row[..j], other)) * above[j * n + j];
            }
            let pivot = whole - dot(&row[..i], &row[..i]);
            if !(pivot > 1e-14 * whole) {
                return None;
            }
            row[i] = 1.0 / pivot.sqrt();
        }
        Some(Self { factor: l, n })
    }

    /// The solution x of L·Lᵀ·x = b.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        vectorized(
            #[inline(always)]
            || self.solve_from(0, &mut x),
        );
        x
    }

    /// Solves in place, `x` being zero before `first`.
    #[inline(always)]
    fn solve_from(&self, first: usize, x: &mut [f64]) {
        let (l, n) = (&self.factor, self.n);
        for i in first..n {
            let row = &l[i * n..i * n + i + 1];
            x[i] = (x[i] - dot(&row[first..i], &x[first..i])) * row[i];
        }
        for i in (0..n).rev() {
            x[i] *= l[i * n + i];
            let (before, at) = x.split_at_mut(i);
            before.iter_mut().zip(&l[i * n..i * n + i]).for_each(|(b, a)| *b -= a * at[0]);
        }
    }

    /// (L·Lᵀ)⁻¹, row-major.
    pub fn inverse(&self) -> Vec<f64> {
        let n = self.n;
        let mut inverse = vec![0.0; n * n];
        vectorized(
            #[inline(always)]
            || {
                for j in 0..n {
                    // Symmetric: a column is a row.
                    let row = &mut inverse[j * n..(j + 1) * n];
                    row[j] = 1.0;
                    self.solve_from(j, row);
                }
            },
        );
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [[f64; 3]; 3] = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.25], [-0.5, 0.25, 2.0]];

    #[test]
    fn solves_and_inverts() {
        let cholesky = Cholesky::new(&A).unwrap();
        let x = cholesky.solve(&[1.0, -2.0, 0.5]);
        for i in 0..3 {
            let sum: f64 = (0..3).map(|j| A[i][j] * x[j]).sum();
            assert!((sum - [1.0, -2.0, 0.5][i]).abs() < 1e-14);
        }
        let inverse = cholesky.inverse();
        for i in 0..3 {
            for j in 0..3 {
                let sum: f64 = (0..3).map(|k| A[i][k] * inverse[k][j]).sum();
                assert!((sum - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn refuses_what_is_not_positive_definite() {
        assert!(Cholesky::new(&[[1.0, 1.0], [1.0, 1.0]]).is_none());
        assert!(Cholesky::new(&[[1.0, 2.0], [2.0, 1.0]]).is_none());
        assert!(Cholesky::new(&[[f64::NAN]]).is_none());
        assert!(Cholesky::new(&[[0.0]]).is_none());
        assert!(Cholesky::<0>::new(&[]).is_some());
    }

    #[test]
    fn the_dense_one_is_the_same() {
        let flat: Vec<f64> = A.iter().flatten().copied().collect();
        let dense = DenseCholesky::new(flat, 3).unwrap();
        let fixed = Cholesky::new(&A).unwrap();
        let b = [1.0, -2.0, 0.5];
        for (x, y) in dense.solve(&b).iter().zip(fixed.solve(&b)) {
            assert!((x - y).abs() < 1e-15);
        }
        for (x, y) in dense.inverse().iter().zip(fixed.inverse().as_flattened()) {
            assert!((x - y).abs() < 1e-15);
        }
        assert!(DenseCholesky::new(vec![1.0, 2.0, 2.0, 1.0], 2).is_none());
        assert!(DenseCholesky::new(vec![f64::NAN], 1).is_none());
        assert!(DenseCholesky::new(Vec::new(), 0).is_some());
    }
}
