//! The two poses in which a plane can look as it does.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, SMatrix, SVector, Vector2, Vector3};

use crate::{
    geom::{Board, Color, Pixel, Point, Pose, Rotation},
    math,
    solve::Cholesky,
};

/// A second pose whose sum of squares is that many times the first's is not refined: both are within a few percent of
/// their minimum.
const AMBIGUOUS: f64 = 16.0;

/// The poses of a plane (z = 0) that may explain how its points project to these directions (x/z, y/z), the better
/// first: two, or one where the other is out of the question; `None` for fewer than four points and for points on a
/// line.
///
/// A plane far away or small looks nearly the same tilted forth and back; noise decides which of both fits better, so
/// that a caller must refine both. The method is IPPE (Collins and Bartoli, *Infinitesimal plane-based pose
/// estimation*, IJCV 109, 2014): the homography's derivative at the points' centroid gives both rotations in closed
/// form.
///
/// ```text
/// J = ∂(H·x)/∂x at the centroid, v its image, R_v turns the z axis to (v, 1)
/// A = [1 | −v]·R_v[:, :2];  A⁻¹·J = γ·R̃;  R = R_v·[R̃ c; ±b a]
/// ```
pub(super) fn both_poses(
    points: &[Point<Board>],
    rays: &[[f64; 2]],
) -> Option<Vec<Pose<Color, Board>>> {
    let n = points.len() as f64;
    let (cx, cy) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x() / n, y + p.y() / n));
    let from: Vec<Pixel> = points.iter().map(|p| Pixel::new(p.x() - cx, p.y() - cy)).collect();
    let h = homography(&from, rays)?;
    let v = Vector2::new(h[(0, 2)], h[(1, 2)]);
    let j = Matrix2::new(
        h[(0, 0)] - h[(2, 0)] * v.x,
        h[(0, 1)] - h[(2, 1)] * v.x,
        h[(1, 0)] - h[(2, 0)] * v.y,
        h[(1, 1)] - h[(2, 1)] * v.y,
    );
    let toward = Vector3::new(v.x, v.y, 1.0);
    let rv = Rotation::rotation_between(&Vector3::z(), &toward)?;
    let r2: Matrix3x2<f64> = rv.matrix().fixed_columns::<2>(0).into_owned();
    let a = Matrix2::new(
        r2[(0, 0)] - v.x * r2[(2, 0)],
        r2[(0, 1)] - v.x * r2[(2, 1)],
        r2[(1, 0)] - v.y * r2[(2, 0)],
        r2[(1, 1)] - v.y * r2[(2, 1)],
    );
    let m = a.try_inverse()? * j;
    // The larger singular value of m: √ of the larger eigenvalue of m·mᵀ.
    let mm = m * m.transpose();
    let gamma =
        (0.5 * (mm.trace() + math::hypot(mm[(0, 0)] - mm[(1, 1)], 2.0 * mm[(0, 1)]))).sqrt();
    if !(gamma > 0.0 && gamma.is_finite()) {
        return None;
    }
    let r = m / gamma;
    let b1 = (1.0 - r[(0, 0)] * r[(0, 0)] - r[(1, 0)] * r[(1, 0)]).max(0.0).sqrt();
    let b2 = (1.0 - r[(0, 1)] * r[(0, 1)] - r[(1, 1)] * r[(1, 1)]).max(0.0).sqrt();
    let b2 = if r[(0, 0)] * r[(0, 1)] + r[(1, 0)] * r[(1, 1)] > 0.0 { -b2 } else { b2 };
    let mut found = [1.0, -1.0].map(|sign| {
        let first = Vector3::new(r[(0, 0)], r[(1, 0)], sign * b1);
        let second = Vector3::new(r[(0, 1)], r[(1, 1)], sign * b2);
        let turn = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        let rotation = orthonormal(rv.matrix() * turn);
        let translation = translation_for(&rotation, &from, rays)?;
        let error = squared_error(&rotation, &translation, &from, rays);
        let centred = Vector3::new(cx, cy, 0.0);
        Some((error, Pose::new(rotation, translation - rotation * centred)))
    });
    found.sort_by(|a, b| {
        let error = |f: &Option<(f64, _)>| f.as_ref().map_or(f64::INFINITY, |f| f.0);
        error(a).total_cmp(&error(b))
    });
    match found {
        [Some((least, first)), Some((error, second))] if error < AMBIGUOUS * least => {
            Some(vec![first, second])
        }
        [Some((_, first)), _] => Some(vec![first]),
        _ => None,
    }
}

/// The homography from points about their centroid to their directions, with 1 for its last element (the centroid is in
/// front of the camera): the least squares of the equations multiplied out. `None` for fewer than four points and for
/// points on a line.
fn homography(from: &[Pixel], rays: &[[f64; 2]]) -> Option<Matrix3<f64>> {
    let n = from.len() as f64;
    let square = from.iter().map(|p| p.x * p.x + p.y * p.y).sum::<f64>() / n;
    if from.len() < 4 || !(square > 0.0) {
        return None;
    }
    let scale = square.sqrt().recip();
    // Sums of P = p·pᵀ, u·P, v·P and (u² + v²)·P for p = (x, y, 1), each by its six different elements.
    let mut sums = [[0.0; 6]; 4];
    for (p, &[u, v]) in from.iter().zip(rays) {
        let (x, y) = (scale * p.x, scale * p.y);
        let products = [x * x, x * y, y * y, x, y, 1.0];
        for (sum, by) in sums.iter_mut().zip([1.0, u, v, u * u + v * v]) {
            (0..6).for_each(|k| sum[k] += by * products[k]);
        }
    }
    let [plain, by_u, by_v, by_both] = sums;
    // Two rows of the homography, then two elements of the third; the lower triangle.
    let mut normal = [[0.0; 8]; 8];
    let mut right = [0.0; 8];
    const AT: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];
    for i in 0..3 {
        for j in 0..3 {
            normal[i][j] = plain[AT[i][j]];
            normal[3 + i][3 + j] = plain[AT[i][j]];
        }
        for j in 0..2 {
            normal[6 + j][i] = -by_u[AT[i][j]];
            normal[6 + j][3 + i] = -by_v[AT[i][j]];
        }
        (right[i], right[3 + i]) = (by_u[AT[i][2]], by_v[AT[i][2]]);
    }
    for i in 0..2 {
        for j in 0..2 {
            normal[6 + i][6 + j] = by_both[AT[i][j]];
        }
        right[6 + i] = -by_both[AT[i][2]];
    }
    // A hundred roundings: points on a line leave that much of the second column.
    let [xx, xy, yy, ..] = plain;
    if !(xx * yy - xy * xy > 1e-12 * (xx + yy) * (xx + yy)) {
        return None;
    }
    let h = Cholesky::new(&normal)?.solve(&right);
    let [a, b, c, d, e, f, g, h] = h;
    Some(Matrix3::new(a * scale, b * scale, c, d * scale, e * scale, f, g * scale, h * scale, 1.0))
}

/// The nearest rotation, by Gram and Schmidt (the input is one but for rounding and the noise of b).
fn orthonormal(matrix: Matrix3<f64>) -> Rotation {
    let x = matrix.column(0).normalize();
    let y = (matrix.column(1) - x * x.dot(&matrix.column(1))).normalize();
    Rotation::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]))
}

/// The translation that, with this rotation, brings the points nearest their rays: linear least squares of
/// t_x − u·t_z = u·q_z − q_x and the same in y, q the rotated point.
fn translation_for(rotation: &Rotation, from: &[Pixel], rays: &[[f64; 2]]) -> Option<Vector3<f64>> {
    let mut ata = SMatrix::<f64, 3, 3>::zeros();
    let mut atb = SVector::<f64, 3>::zeros();
    for (p, &[u, v]) in from.iter().zip(rays) {
        let q = rotation * Vector3::new(p.x, p.y, 0.0);
        let rows = [
            (Vector3::new(1.0, 0.0, -u), u * q.z - q.x),
            (Vector3::new(0.0, 1.0, -v), v * q.z - q.y),
        ];
        for (row, right) in rows {
            ata += row * row.transpose();
            atb += row * right;
        }
    }
    ata.try_inverse().map(|inverse| inverse * atb)
}

/// Infinite where a point lies behind the camera.
fn squared_error(
    rotation: &Rotation,
    translation: &Vector3<f64>,
    from: &[Pixel],
    rays: &[[f64; 2]],
) -> f64 {
    let mut sum = 0.0;
    for (p, &[u, v]) in from.iter().zip(rays) {
        let q = rotation * Vector3::new(p.x, p.y, 0.0) + translation;
        if !(q.z > 0.0) {
            return f64::INFINITY;
        }
        sum += (q.x / q.z - u).powi(2) + (q.y / q.z - v).powi(2);
    }
    sum
}
