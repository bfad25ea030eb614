//! The board as it is: not quite flat.

use super::BoardSurface;
use crate::{
    board::CharucoBoard,
    geom::{Board, Matrix3, Point, Vector3},
};

/// Products of Legendre polynomials of degree 2 to 4 in both directions of the board: every smooth bump that is not a
/// plane, which the pose takes.
pub(super) const N_MODES: usize = 12;

/// How flat a board is taken to be before anything was seen: each mode's σ as a share of the board's longer side.
/// Card and foam board bend by about that (the paper's board: 0.8 mm on 209 mm); glass is flatter, and then the
/// corners say so.
const SIGMA_SHARE: f64 = 0.005;

/// Is the board taken for flat, or is its surface estimated with the camera?
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Surface {
    Flat,
    Free,
}

impl Surface {
    pub(super) const fn n_modes(self) -> usize {
        match self {
            Self::Flat => 0,
            Self::Free => N_MODES,
        }
    }
}

/// The σ of each mode beforehand, metres.
pub(super) fn prior_sigma_m(board: &CharucoBoard) -> f64 {
    SIGMA_SHARE * board.square_m * board.squares_x.max(board.squares_y) as f64
}

/// All modes at a point of the board.
pub(super) fn modes(board: &CharucoBoard, point: &Vector3<f64>) -> [f64; N_MODES] {
    let along = |x: f64, squares: usize| 2.0 * x / (board.square_m * squares as f64) - 1.0;
    let p = legendre(along(point.x, board.squares_x));
    let q = legendre(along(point.y, board.squares_y));
    let mut values = [0.0; N_MODES];
    let mut next = values.iter_mut();
    for degree in 2..=4 {
        for i in 0..=degree {
            if let Some(value) = next.next() {
                *value = p[i] * q[degree - i];
            }
        }
    }
    values
}

/// P₀ to P₄.
fn legendre(s: f64) -> [f64; 5] {
    let s2 = s * s;
    [
        1.0,
        s,
        0.5 * (3.0 * s2 - 1.0),
        0.5 * s * (5.0 * s2 - 3.0),
        0.125 * (35.0 * s2 * s2 - 30.0 * s2 + 3.0),
    ]
}

/// Where a corner of the flat board really lies, metres.
pub(super) fn lifted(
    point: &Vector3<f64>,
    modes: &[f64; N_MODES],
    coefficients: &[f64],
) -> Point<Board> {
    let height: f64 = coefficients.iter().zip(modes).map(|(c, m)| c * m).sum();
    Point::new(point.x, point.y, point.z + height)
}

/// The heights of all corners, from the surface's numbers (metres) and the covariance of all free numbers (row-major,
/// `n` by `n`, the surface's last); `None` for a flat board.
pub(super) fn board_surface(
    board: &CharucoBoard,
    coefficients: &[f64],
    covariance: &[f64],
    n: usize,
) -> Option<BoardSurface> {
    if coefficients.is_empty() {
        return None;
    }
    let corners: Vec<Vector3<f64>> =
        (0..board.n_corners()).map(|id| board.corner(id).coords).collect();
    // Each mode less its own best plane, which the poses take.
    let columns: Vec<Vec<f64>> = (0..coefficients.len())
        .map(|k| without_plane(&corners, corners.iter().map(|c| modes(board, c)[k]).collect()))
        .collect();
    let first = n - coefficients.len();
    let mut heights_m = Vec::with_capacity(corners.len());
    let mut sigmas_m = Vec::with_capacity(corners.len());
    for id in 0..corners.len() {
        heights_m.push(coefficients.iter().zip(&columns).map(|(c, column)| c * column[id]).sum());
        let mut variance = 0.0;
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns.iter().enumerate() {
                variance += a[id] * covariance[(first + i) * n + first + j] * b[id];
            }
        }
        sigmas_m.push(variance.max(0.0).sqrt());
    }
    Some(BoardSurface { heights_m, sigmas_m })
}

/// Values at places, less their best plane.
fn without_plane(places: &[Vector3<f64>], values: Vec<f64>) -> Vec<f64> {
    let (mut ata, mut atb) = (Matrix3::zeros(), Vector3::zeros());
    for (place, value) in places.iter().zip(&values) {
        let row = Vector3::new(1.0, place.x, place.y);
        ata += row * row.transpose();
        atb += row * *value;
    }
    let Some(inverse) = ata.try_inverse() else { return values };
    let plane = inverse * atb;
    let flat = |place: &Vector3<f64>| plane.x + plane.y * place.x + plane.z * place.y;
    places.iter().zip(values).map(|(place, value)| value - flat(place)).collect()
}
