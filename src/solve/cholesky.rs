//! Small dense symmetric systems of a size known at compile time.

#![allow(
    clippy::needless_range_loop,
    reason = "triangular loops over two indices read as the formulas do"
)]

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

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix by Jacobi's rotations; eigenvalues in no order.
pub(super) fn symmetric_eigen<const N: usize>(matrix: &[[f64; N]; N]) -> ([f64; N], [[f64; N]; N]) {
    let mut a = *matrix;
    let mut q = [[0.0; N]; N];
    for i in 0..N {
        q[i][i] = 1.0;
    }
    for _sweep in 0..50 {
        let mut off = 0.0;
        let mut diagonal = 0.0;
        for i in 0..N {
            diagonal += a[i][i] * a[i][i];
            for j in 0..i {
                off += a[i][j] * a[i][j];
            }
        }
        if off <= 1e-30 * diagonal {
            break;
        }
        for p in 0..N {
            for r in p + 1..N {
                if a[p][r] == 0.0 {
                    continue;
                }
                // Golub and Van Loan, Matrix Computations, 4th ed., section 8.5.2.
                let tau = (a[r][r] - a[p][p]) / (2.0 * a[p][r]);
                let t = 1.0_f64.copysign(tau) / (tau.abs() + tau.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                for k in 0..N {
                    let (x, y) = (a[k][p], a[k][r]);
                    a[k][p] = c * x - s * y;
                    a[k][r] = s * x + c * y;
                }
                for k in 0..N {
                    let (x, y) = (a[p][k], a[r][k]);
                    a[p][k] = c * x - s * y;
                    a[r][k] = s * x + c * y;
                    let (x, y) = (q[k][p], q[k][r]);
                    q[k][p] = c * x - s * y;
                    q[k][r] = s * x + c * y;
                }
            }
        }
    }
    let mut values = [0.0; N];
    for i in 0..N {
        values[i] = a[i][i];
    }
    (values, q)
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
    fn eigenvectors_diagonalise() {
        let (values, q) = symmetric_eigen(&A);
        for k in 0..3 {
            for i in 0..3 {
                let image: f64 = (0..3).map(|j| A[i][j] * q[j][k]).sum();
                assert!((image - values[k] * q[i][k]).abs() < 1e-13);
            }
        }
        assert!((values.iter().sum::<f64>() - 9.0).abs() < 1e-13);
    }
}
