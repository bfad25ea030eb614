//! Plane-to-plane projective maps.

use crate::math;

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::Pixel;

/// A projective map of the plane, `p' ~ H·(x, y, 1)ᵀ`, scaled so that `H[2][2] = 1` where that is possible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homography {
    /// The matrix.
    pub matrix: Matrix3<f64>,
}

impl Homography {
    /// The map with this matrix.
    pub const fn new(matrix: Matrix3<f64>) -> Self {
        Self { matrix }
    }

    /// The image of `p`; `None` on or beyond the line that maps to infinity (w ≤ 1e-12 with the sign of the origin's
    /// w, so points that would come from behind the camera do not map).
    pub fn map(&self, p: Pixel) -> Option<Pixel> {
        let m = &self.matrix;
        let w = m[(2, 0)] * p.x + m[(2, 1)] * p.y + m[(2, 2)];
        if w <= 1e-12 {
            return None;
        }
        Some(Pixel::new(
            (m[(0, 0)] * p.x + m[(0, 1)] * p.y + m[(0, 2)]) / w,
            (m[(1, 0)] * p.x + m[(1, 1)] * p.y + m[(1, 2)]) / w,
        ))
    }

    /// The inverse map; `None` where the matrix is singular.
    pub fn inverse(&self) -> Option<Self> {
        let inverse = self.matrix.try_inverse()?;
        let w = inverse[(2, 2)];
        Some(Self::new(if w.abs() > 1e-300 { inverse / w } else { inverse }))
    }

    /// The map that takes `from[i]` to `to[i]`, in the least-squares sense of the normalised DLT (Hartley and
    /// Zisserman, *Multiple View Geometry*, 2nd ed., algorithm 4.2). `None` for fewer than four pairs or a
    /// degenerate configuration.
    ///
    /// The sign is such that the centroid of `from` has w > 0.
    pub fn from_points(from: &[Pixel], to: &[Pixel]) -> Option<Self> {
        if from.len() != to.len() || from.len() < 4 {
            return None;
        }
        let (from_norm, tf) = normalised(from)?;
        let (to_norm, tt) = normalised(to)?;
        // Normal equations of the 2n x 9 system: 9x9, its smallest eigenvector is h. Normalised coordinates are of
        // order one, so squaring the condition number is harmless here. With P = p·pᵀ for p = (x, y, 1) and q = (u, v):
        //
        //   ⎡  ΣP     0   −ΣuP      ⎤
        //   ⎢   0    ΣP   −ΣvP      ⎥
        //   ⎣ −ΣuP −ΣvP  Σ(u²+v²)P  ⎦
        let mut sums = [Matrix3::<f64>::zeros(); 4];
        for (p, q) in from_norm.iter().zip(&to_norm) {
            let p = Vector3::new(p.x, p.y, 1.0);
            let outer = p * p.transpose();
            for (sum, by) in sums.iter_mut().zip([1.0, -q.x, -q.y, q.x * q.x + q.y * q.y]) {
                *sum += outer * by;
            }
        }
        let [plain, by_u, by_v, by_both] = sums;
        let mut ata = SMatrix::<f64, 9, 9>::zeros();
        for (row, column, block) in [
            (0, 0, plain),
            (3, 3, plain),
            (6, 0, by_u),
            (0, 6, by_u),
            (6, 3, by_v),
            (3, 6, by_v),
            (6, 6, by_both),
        ] {
            ata.fixed_view_mut::<3, 3>(row, column).copy_from(&block);
        }
        let eigen = ata.symmetric_eigen();
        let mut order: Vec<usize> = (0..9).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        if eigen.eigenvalues[order[1]] < 1e-12 * eigen.eigenvalues[order[8]] {
            return None; // Two null directions: collinear or coincident points.
        }
        let h = eigen.eigenvectors.column(order[0]);
        let h = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
        let mut m = tt.try_inverse()? * h * tf;
        let n = from.len() as f64;
        let centroid =
            from.iter().fold(Vector3::zeros(), |c, p| c + Vector3::new(p.x, p.y, 1.0)) / n;
        let w = (m * centroid).z;
        if w == 0.0 || !w.is_finite() {
            return None;
        }
        m *= w.signum();
        let scale = if m[(2, 2)] > 1e-9 * m.norm() { m[(2, 2)] } else { m.norm() };
        Some(Self::new(m / scale))
    }
}

/// Moves the centroid to the origin and the mean distance to √2; returns the points and the map that does it.
fn normalised(points: &[Pixel]) -> Option<(Vec<Pixel>, Matrix3<f64>)> {
    let n = points.len() as f64;
    let cx = points.iter().map(|p| p.x).sum::<f64>() / n;
    let cy = points.iter().map(|p| p.y).sum::<f64>() / n;
    let spread = points.iter().map(|p| math::hypot(p.x - cx, p.y - cy)).sum::<f64>() / n;
    if !(spread > 1e-12) {
        return None;
    }
    let s = std::f64::consts::SQRT_2 / spread;
    let moved = points.iter().map(|p| Pixel::new((p.x - cx) * s, (p.y - cy) * s)).collect();
    Some((moved, Matrix3::new(s, 0.0, -s * cx, 0.0, s, -s * cy, 0.0, 0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovers_a_known_map() {
        let truth =
            Homography::new(Matrix3::new(1.2, 0.1, 30.0, -0.2, 0.9, 12.0, 1e-4, -2e-4, 1.0));
        let from: Vec<Pixel> =
            (0..20).map(|i| Pixel::new(f64::from(i % 5) * 40.0, f64::from(i / 5) * 50.0)).collect();
        let to: Vec<Pixel> = from.iter().map(|&p| truth.map(p).expect("in front")).collect();
        let found = Homography::from_points(&from, &to).expect("well posed");
        for (p, q) in from.iter().zip(&to) {
            assert!(found.map(*p).expect("in front").distance(*q) < 1e-9);
        }
        let back = found.inverse().expect("regular");
        assert!(back.map(to[7]).expect("in front").distance(from[7]) < 1e-9);
    }

    #[test]
    fn collinear_points_have_no_map() {
        let line: Vec<Pixel> =
            (0..6).map(|i| Pixel::new(f64::from(i), 2.0 * f64::from(i))).collect();
        assert!(Homography::from_points(&line, &line).is_none());
        assert!(Homography::from_points(&line[..3], &line[..3]).is_none());
    }
}
