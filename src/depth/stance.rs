//! Where the board's plane stood in a frame, and how sure that is.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3, Vector6};

use crate::{
    board::CharucoBoard,
    calibrate::{BoardSurface, Parameter, moved},
    camera::Camera,
    geom::{Board, Color, Pose},
    pose::{View, d_pixel_d_pose},
};

use super::corner_on;

/// The board's plane in one frame: the points X of the colour camera's frame with m·X = 1.
pub(super) struct Stance {
    pub(super) frame: usize,
    pub(super) color_from_board: Pose<Color, Board>,
    /// m, per metre.
    pub(super) plane: Vector3<f64>,
    /// Distance of the plane from the camera, metres: positive where the board's z points away.
    pub(super) distance_m: f64,
    /// Covariance of m from the noise of this frame's corners.
    pub(super) covariance: Matrix3<f64>,
    /// What one σ of each free number of the camera does to m, the pose following.
    pub(super) by_camera: Vec<Vector3<f64>>,
}

/// No corner is known better than that, pixels.
const FLOOR_PX: f64 = 0.03;
/// A frame's own scatter counts beside that of all frames as if these had so many residuals.
const POOLED_RESIDUALS: f64 = 30.0;

/// The camera with one free number moved by half a σ up and down.
pub(super) fn moved_cameras(camera: &Camera, parameters: &[Parameter]) -> Vec<[Camera; 2]> {
    parameters
        .iter()
        .map(|p| [0.5, -0.5].map(|share| moved(camera, p.name, share * p.estimate.sigma)))
        .collect()
}

struct Normal {
    information: Matrix6<f64>,
    by_camera: Vec<Vector6<f64>>,
    /// Σ w·r², and how many residuals are free to scatter.
    squares: f64,
    freedom: f64,
}

/// Every view whose corners determine its pose.
pub(super) fn stances(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    camera: &Camera,
    moved: &[[Camera; 2]],
    views: &[&View],
) -> Vec<Stance> {
    let normals: Vec<(&View, Normal)> = views
        .iter()
        .filter_map(|view| Some((*view, normal(board, surface, camera, moved, view)?)))
        .collect();
    let squares: f64 = normals.iter().map(|(_, n)| n.squares).sum();
    let freedom: f64 = normals.iter().map(|(_, n)| n.freedom).sum();
    let pooled = if freedom > 0.0 { squares / freedom } else { 1.0 };
    normals
        .into_iter()
        .filter_map(|(view, n)| {
            let variance = (n.squares + POOLED_RESIDUALS * pooled) / (n.freedom + POOLED_RESIDUALS);
            let inverse = n.information.try_inverse()?;
            let pose = view.color_from_board;
            let normal = pose.rotation * Vector3::z();
            let distance_m = normal.dot(&pose.translation);
            let by_pose = d_plane_d_pose(&normal, distance_m, &pose.translation);
            Some(Stance {
                frame: view.frame,
                color_from_board: pose,
                plane: normal / distance_m,
                distance_m,
                covariance: by_pose * inverse * by_pose.transpose() * variance,
                by_camera: n.by_camera.iter().map(|b| by_pose * (inverse * -b)).collect(),
            })
        })
        .collect()
}

fn normal(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    camera: &Camera,
    moved: &[[Camera; 2]],
    view: &View,
) -> Option<Normal> {
    let mut normal = Normal {
        information: Matrix6::zeros(),
        by_camera: vec![Vector6::zeros(); moved.len()],
        squares: 0.0,
        freedom: 2.0 * view.corners.len() as f64 - 6.0,
    };
    if !(normal.freedom > 0.0) {
        return None;
    }
    for corner in &view.corners {
        let turned = view.color_from_board.rotation * corner_on(board, surface, corner.id).coords;
        let point = view.color_from_board * corner_on(board, surface, corner.id);
        let (pixel, by_point) = camera.project_with_jacobian(point)?;
        let sigma = if corner.sigma_px > 0.0 { corner.sigma_px } else { 0.0 };
        let weight = (sigma * sigma + FLOOR_PX * FLOOR_PX).recip();
        let rows = by_point.map(|d| Vector6::from(d_pixel_d_pose(d, &turned)));
        for (row, r) in rows.iter().zip(corner.pixel - pixel) {
            normal.information.ger(weight, row, row, 1.0);
            normal.squares += weight * r * r;
        }
        for (sum, [up, down]) in normal.by_camera.iter_mut().zip(moved) {
            let [dx, dy] = up.project(point)? - down.project(point)?;
            *sum += weight * (rows[0] * dx + rows[1] * dy);
        }
    }
    Some(normal)
}

/// How a step (ω, τ) of the pose moves m = n/d, n the board's normal and d = n·t.
fn d_plane_d_pose(n: &Vector3<f64>, d: f64, t: &Vector3<f64>) -> Matrix3x6<f64> {
    let mut j = Matrix3x6::zeros();
    for k in 0..3 {
        let mut axis = Vector3::zeros();
        axis[k] = 1.0;
        let turned = axis.cross(n);
        j.set_column(k, &(turned / d - n * (turned.dot(t) / (d * d))));
        j.set_column(3 + k, &(-n * (n[k] / (d * d))));
    }
    j
}
