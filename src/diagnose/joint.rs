//! One linear step of focal length, centre and distortion, all views at once, with sigmas that know of common errors.
//!
//! The question is not which camera fits best (that is [`calibrate`](crate::calibrate)'s), but whether *this*
//! displacement is in the stream. So the residuals against an ideal pinhole, at the poses and focal length already
//! found, are regressed on what each cause would do to them:
//!
//! ```text
//! r = A_view·δpose + x·δf + δc + d(q)·t/|d|_corner + ε,     x = (X/Z, Y/Z)
//! ```
//!
//! d is the displacement the lens would cause, t its size in pixels at the reference radius: 0 in a rectified stream,
//! the full displacement in a distorted one. Poses are eliminated view by view (Frisch-Waugh), residuals weighted by
//! Tukey's biweight, sigmas clustered by view and by part of the board ([`Clustered`]).
//!
//! **Bound.** Linear about the solution found: displacements of 20 px at a focal length of 440 px leave an error of
//! about 3 % of t, those of Apple's iPads (4 px) less than 1 %.

use nalgebra::{DMatrix, DVector, Matrix2x6, SMatrix};

use crate::{
    board::CharucoBoard,
    calibrate::{BoardSurface, Estimate},
    camera::Intrinsics,
    depth::{Clustered, Equation, corner_on},
    geom::{Pixel, Vector3},
    pose::View,
};

/// Displacement of a rectilinear pixel by the lens, pixels; `None` outside its domain.
pub(super) type Shape<'a> = &'a dyn Fn(Pixel) -> Option<[f64; 2]>;

/// What is free beside the poses and the focal length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freedom {
    /// Nothing else: all of the shape is in the stream.
    Focal,
    /// The size of the distortion.
    Distortion,
    /// The principal point, too.
    CentreAndDistortion,
}

impl Freedom {
    const fn n_parameters(self) -> usize {
        match self {
            Self::Focal => 1,
            Self::Distortion => 2,
            Self::CentreAndDistortion => 4,
        }
    }
}

/// The estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    /// Focal length, pixels.
    pub(super) focal_px: Estimate,
    /// How much of the shape is in the stream: 0 nothing, 1 all of it. One with no sigma under
    /// [`Freedom::Focal`].
    pub(super) amount: Estimate,
    /// RMS of the residuals (2-D distance) with the shape at `amount`, pixels.
    pub(super) rms_px: f64,
    /// The same with the shape left out.
    pub(super) rms_without_px: f64,
    /// The same with all of the shape.
    pub(super) rms_with_px: f64,
    /// Corners with a weight.
    pub(super) n_corners: usize,
    /// Views.
    pub(super) n_views: usize,
}

const TUKEY: f64 = 4.685;
/// Median length of a 2-D normal vector to its standard deviation per axis: 1/√(2 ln 2).
const SIGMA_FROM_MEDIAN: f64 = 0.849_321_8;
/// The residual scale is never taken smaller, pixels: nobody finds corners better.
const LEAST_SIGMA_PX: f64 = 0.01;

/// One view's equations, poses not yet eliminated.
struct Block {
    frame: usize,
    /// 2n x 6
    pose: DMatrix<f64>,
    /// 2n x p
    global: DMatrix<f64>,
    /// 2n
    residual: DVector<f64>,
    /// Part of the board of each corner.
    part: Vec<usize>,
}

/// Estimates from views whose poses were found with a camera of this pinhole, whatever its distortion, of a board that
/// is flat or has this surface. `None` where the views do not determine the parameters (fewer than two of them, say, or
/// all fronto-parallel).
pub(super) fn joint(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    views: &[&View],
    pinhole: &Intrinsics,
    shape: Shape<'_>,
    freedom: Freedom,
) -> Option<Joint> {
    let p = freedom.n_parameters();
    let blocks: Vec<Block> = views
        .iter()
        .filter_map(|view| block(board, surface, view, pinhole, shape, freedom))
        .collect();
    if blocks.len() < 2 {
        return None;
    }
    let mut weights: Vec<Vec<f64>> = blocks.iter().map(|b| vec![1.0; b.part.len()]).collect();
    let mut theta = DVector::zeros(p);
    let mut errors: Vec<DVector<f64>> = Vec::new();
    let mut eliminated: Vec<DMatrix<f64>> = Vec::new();
    for _ in 0..8 {
        let mut normal = DMatrix::zeros(p, p);
        let mut right = DVector::zeros(p);
        eliminated.clear();
        let mut rests = Vec::with_capacity(blocks.len());
        for (block, w) in blocks.iter().zip(&weights) {
            let (global, residual) = block.without_pose(w)?;
            for (i, &w) in w.iter().enumerate() {
                for row in [2 * i, 2 * i + 1] {
                    let x = global.row(row).transpose();
                    normal.ger(w, &x, &x, 1.0);
                    right.axpy(w * residual[row], &x, 1.0);
                }
            }
            eliminated.push(global);
            rests.push(residual);
        }
        theta = solve_scaled(&normal, &right)?;
        errors =
            eliminated.iter().zip(&rests).map(|(global, rest)| rest - global * &theta).collect();
        let mut lengths: Vec<f64> = errors
            .iter()
            .flat_map(|e| (0..e.len() / 2).map(|i| e[2 * i].hypot(e[2 * i + 1])))
            .collect();
        lengths.sort_by(f64::total_cmp);
        let sigma = (SIGMA_FROM_MEDIAN * lengths[lengths.len() / 2]).max(LEAST_SIGMA_PX);
        let reach = TUKEY * sigma;
        for (w, e) in weights.iter_mut().zip(&errors) {
            for (i, w) in w.iter_mut().enumerate() {
                let u = e[2 * i].hypot(e[2 * i + 1]) / reach;
                *w = if u < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 };
            }
        }
    }

    let mut equations = Vec::new();
    let (mut cost, mut weight) = (0.0, 0.0);
    let mut n_corners = 0;
    for (((block, w), e), global) in blocks.iter().zip(&weights).zip(&errors).zip(&eliminated) {
        for (i, &w) in w.iter().enumerate() {
            if w == 0.0 {
                continue;
            }
            n_corners += 1;
            weight += w;
            cost += w * (e[2 * i].powi(2) + e[2 * i + 1].powi(2));
            for row in [2 * i, 2 * i + 1] {
                equations.push(Equation {
                    x: global.row(row).transpose(),
                    score: w * e[row],
                    curvature: w,
                    groups: [block.frame, block.part[i]],
                });
            }
        }
    }
    let spread = Clustered::new(&equations)?;
    let unit = |k: usize| -> Vec<f64> { (0..p).map(|i| f64::from(u8::from(i == k))).collect() };
    let focal_px = Estimate { value: pinhole.focal_px() + theta[0], sigma: spread.sigma(&unit(0)) };
    let (amount, curvature) = if freedom == Freedom::Focal {
        (Estimate { value: 1.0, sigma: 0.0 }, 0.0)
    } else {
        // What the fit gets worse by when the amount is held elsewhere: the Schur complement of its own entry.
        let mut normal = DMatrix::zeros(p, p);
        for e in &equations {
            normal.ger(e.curvature, &e.x, &e.x, 1.0);
        }
        let unit = DVector::from_vec(unit(1));
        let inverse_entry = solve_scaled(&normal, &unit)?[1];
        (Estimate { value: theta[1], sigma: spread.sigma(unit.as_slice()) }, inverse_entry.recip())
    };
    let rms_at = |t: f64| ((cost + curvature * (t - amount.value).powi(2)) / weight).sqrt();
    Some(Joint {
        focal_px,
        amount,
        rms_px: rms_at(amount.value),
        rms_without_px: rms_at(0.0),
        rms_with_px: rms_at(1.0),
        n_corners,
        n_views: blocks.len(),
    })
}

/// `None` for a view with fewer than six corners in front of the camera: its pose eats up all it says.
fn block(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    view: &View,
    pinhole: &Intrinsics,
    shape: Shape<'_>,
    freedom: Freedom,
) -> Option<Block> {
    let (columns, rows) = (board.squares_x - 1, board.squares_y - 1);
    let mut pose = Vec::new();
    let mut global = Vec::new();
    let mut residual = Vec::new();
    let mut part = Vec::new();
    for corner in &view.corners {
        let point = (view.color_from_board * corner_on(board, surface, corner.id)).coords;
        if point.z <= 0.0 {
            continue;
        }
        let [u, v] = [point.x / point.z, point.y / point.z];
        let ideal = pinhole.pixel_from_ray([u, v]);
        let Some([dx, dy]) = shape(ideal) else { continue };
        let [rx, ry] = corner.pixel - ideal;
        let known = if freedom == Freedom::Focal { 1.0 } else { 0.0 };
        residual.extend([rx - known * dx, ry - known * dy]);
        let j = d_pixel_d_pose(pinhole, &point);
        pose.push(j);
        // Focal first, then the amount of distortion, then the centre.
        global.extend([[u, dx, 1.0, 0.0], [v, dy, 0.0, 1.0]]);
        let (column, row) = board.corner_cell(corner.id);
        part.push((row * 3 / rows) * 4 + column * 4 / columns);
    }
    let n = part.len();
    if n < 6 {
        return None;
    }
    Some(Block {
        frame: view.frame,
        pose: DMatrix::from_fn(2 * n, 6, |row, column| pose[row / 2][(row % 2, column)]),
        global: DMatrix::from_fn(2 * n, freedom.n_parameters(), |row, column| global[row][column]),
        residual: DVector::from_vec(residual),
        part,
    })
}

/// By a small rotation about the camera's own axes (radians) and a shift (metres): X' = X + ω×X + τ.
fn d_pixel_d_pose(pinhole: &Intrinsics, point: &Vector3<f64>) -> Matrix2x6<f64> {
    let [x, y, z] = [point.x, point.y, point.z];
    let d_pixel_d_point = SMatrix::<f64, 2, 3>::new(
        pinhole.fx / z,
        0.0,
        -pinhole.fx * x / (z * z),
        0.0,
        pinhole.fy / z,
        -pinhole.fy * y / (z * z),
    );
    let d_point_d_rotation = SMatrix::<f64, 3, 3>::new(0.0, z, -y, -z, 0.0, x, y, -x, 0.0);
    let mut j = Matrix2x6::zeros();
    j.fixed_columns_mut::<3>(0).copy_from(&(d_pixel_d_point * d_point_d_rotation));
    j.fixed_columns_mut::<3>(3).copy_from(&d_pixel_d_point);
    j
}

impl Block {
    /// What is left of globals and residuals when every pose of this view is allowed: M = 1 − A(AᵀWA)⁻¹AᵀW.
    fn without_pose(&self, weights: &[f64]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let mut weighted = self.pose.clone();
        for (i, &w) in weights.iter().enumerate() {
            weighted.row_mut(2 * i).scale_mut(w);
            weighted.row_mut(2 * i + 1).scale_mut(w);
        }
        let normal = weighted.transpose() * &self.pose;
        // Rotations count radians, shifts metres: scale before the factorisation.
        let scale = normal.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
        let inverse = DMatrix::from_fn(6, 6, |i, j| normal[(i, j)] * scale[i] * scale[j])
            .cholesky()?
            .inverse();
        let inverse = DMatrix::from_fn(6, 6, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let project = inverse * weighted.transpose();
        let global = &self.global - &self.pose * (&project * &self.global);
        let residual = &self.residual - &self.pose * (&project * &self.residual);
        Some((global, residual))
    }
}

/// N⁻¹·b with N scaled to a unit diagonal; `None` where it is singular to 1e-9 of that.
fn solve_scaled(normal: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let p = normal.nrows();
    let scale = normal.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 });
    let scaled = DMatrix::from_fn(p, p, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    let factor = scaled.cholesky()?;
    if factor.l_dirty().diagonal().min() < 3e-5 {
        return None;
    }
    Some(factor.solve(&right.component_mul(&scale)).component_mul(&scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{Brown, Camera, Distortion},
        detect::Corner,
        diagnose::tests::{Noise, pinhole, tables},
        geom::{Board, Color, Pose, Rotation},
        pose::Weighting,
    };

    /// Corners that `truth` sees of a board that may be wavy, with poses fitted by another camera.
    fn views(
        board: &CharucoBoard,
        truth: &Camera,
        fitted: &Camera,
        wave_m: f64,
        seed: u64,
    ) -> Vec<View> {
        let mut noise = Noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut views = Vec::new();
        for frame in 0..20 {
            let axis = Vector3::new(noise.normal(), noise.normal(), 0.0).normalize();
            let rotation = Rotation::from_scaled_axis(axis * (0.3 + 0.4 * noise.uniform()))
                * Rotation::from_scaled_axis(Vector3::z() * noise.uniform());
            let centre = Vector3::new(0.104, 0.0835, 0.0);
            let target = Vector3::new(
                0.05 * noise.normal(),
                0.04 * noise.normal(),
                0.28 + 0.12 * noise.uniform(),
            );
            let pose: Pose<Color, Board> = Pose::new(rotation, target - rotation * centre);
            let corners: Vec<Corner> = (0..board.n_corners())
                .filter_map(|id| {
                    let (column, row) = board.corner_cell(id);
                    let mut point = board.corner(id);
                    point.coords.z =
                        wave_m * (0.8 * column as f64).sin() * (0.7 * row as f64).cos();
                    let seen = truth.project(pose * point)?;
                    let pixel =
                        Pixel::new(seen.x + 0.05 * noise.normal(), seen.y + 0.05 * noise.normal());
                    let inside = (0.0..640.0).contains(&pixel.x) && (0.0..480.0).contains(&pixel.y);
                    inside.then_some(Corner { id, pixel, sigma_px: 0.05 })
                })
                .collect();
            views.extend(View::from_corners(frame, board, fitted, &corners, Weighting::Equal).ok());
        }
        views
    }

    fn run(truth: &Camera, fitted: &Camera, shape: Shape<'_>, wave_m: f64, seed: u64) -> Joint {
        let board = CharucoBoard::paper(0.020875).unwrap();
        let views = views(&board, truth, fitted, wave_m, seed);
        let views: Vec<_> = views.iter().collect();
        joint(&board, None, &views, &fitted.intrinsics, shape, Freedom::CentreAndDistortion)
            .unwrap()
    }

    #[test]
    fn tells_a_distorted_stream_from_a_rectified_one() {
        let tables = tables();
        let shape = |p| Some(tables.distort(p)? - p);
        let straight = Camera { intrinsics: pinhole(596.0), distortion: Distortion::None };
        let bent =
            Camera { intrinsics: pinhole(596.0), distortion: Distortion::Table(tables.clone()) };
        // Poses fitted with the wrong focal length and the wrong lens must not matter.
        let fits = [
            straight.clone(),
            bent.clone(),
            Camera { intrinsics: pinhole(602.0), distortion: Distortion::None },
        ];
        for fitted in &fits {
            for (truth, amount) in [(&straight, 0.0), (&bent, 1.0)] {
                let joint = run(truth, fitted, &shape, 0.0, 1);
                assert!((joint.amount.value - amount).abs() < 0.02, "{amount}: {joint:?}");
                assert!(joint.amount.sigma < 0.02, "{joint:?}");
                assert!((joint.focal_px.value - 596.0).abs() < 1.5, "{joint:?}");
                let (better, worse) = if amount == 0.0 {
                    (joint.rms_without_px, joint.rms_with_px)
                } else {
                    (joint.rms_with_px, joint.rms_without_px)
                };
                assert!(better < 0.08 && worse > 2.0 * better, "{joint:?}");
            }
        }
    }

    #[test]
    fn a_wavy_board_widens_the_sigmas() {
        let tables = tables();
        let shape = |p| Some(tables.distort(p)? - p);
        let bent =
            Camera { intrinsics: pinhole(596.0), distortion: Distortion::Table(tables.clone()) };
        let (mut of_focal, mut of_amount) = (0.0, 0.0);
        let n = 60;
        for seed in 0..n {
            let joint = run(&bent, &bent, &shape, 0.0008, seed + 1);
            of_focal += ((joint.focal_px.value - 596.0) / joint.focal_px.sigma).powi(2);
            of_amount += ((joint.amount.value - 1.0) / joint.amount.sigma).powi(2);
        }
        let (of_focal, of_amount) = ((of_focal / n as f64).sqrt(), (of_amount / n as f64).sqrt());
        // RMS of errors over their sigmas: 1 where the sigmas are honest. With corners taken as independent it is 2.1.
        assert!(
            (0.5..1.5).contains(&of_focal) && (0.5..1.5).contains(&of_amount),
            "{of_focal} {of_amount}"
        );
    }

    #[test]
    fn a_strong_lens_without_a_table() {
        let brown = Brown { k1: 0.07, k2: -0.1, p1: 0.0, p2: 0.0, k3: 0.0 };
        let bent = Camera { intrinsics: pinhole(436.5), distortion: Distortion::Brown(brown) };
        let own = |p| Some(bent.project_ray(bent.intrinsics.ray_from_pixel(p))? - p);
        let joint = run(&bent, &bent, &own, 0.0, 3);
        assert!((joint.amount.value - 1.0).abs() < 3.0 * joint.amount.sigma + 0.01, "{joint:?}");
    }

    #[test]
    fn fronto_parallel_views_do_not_tell() {
        let board = CharucoBoard::paper(0.020875).unwrap();
        let camera = Camera { intrinsics: pinhole(596.0), distortion: Distortion::None };
        let views: Vec<View> = (0..5)
            .map(|frame| {
                let mut noise = Noise(frame as u64 + 1);
                let pose: Pose<Color, Board> = Pose::new(
                    Rotation::identity(),
                    Vector3::new(-0.1, -0.08, 0.3 + 0.0003 * frame as f64),
                );
                let corners: Vec<Corner> = (0..board.n_corners())
                    .filter_map(|id| {
                        let seen = camera.project(pose * board.corner(id))?;
                        let pixel = Pixel::new(
                            seen.x + 0.05 * noise.normal(),
                            seen.y + 0.05 * noise.normal(),
                        );
                        Some(Corner { id, pixel, sigma_px: 0.05 })
                    })
                    .collect();
                View::from_corners(frame, &board, &camera, &corners, Weighting::Equal).unwrap()
            })
            .collect();
        let views: Vec<_> = views.iter().collect();
        let flat = |_| Some([0.0; 2]);
        let found = joint(&board, None, &views, &camera.intrinsics, &flat, Freedom::Focal);
        assert!(found.is_none_or(|j| j.focal_px.sigma > 0.05 * 596.0), "{found:?}");
    }
}
