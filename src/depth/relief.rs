//! The board's surface between its corners.

use nalgebra::{DMatrix, DVector};

use crate::{board::CharucoBoard, calibrate::BoardSurface};

/// A smooth surface through the heights of all corners: polynomials of degree 4 at most, which is what a calibration
/// estimates, so that nothing is lost.
pub(super) struct Relief {
    size_m: [f64; 2],
    coefficients_m: Vec<f64>,
}

impl Relief {
    /// A flat board, where there is no surface or it does not determine a polynomial.
    pub(super) fn new(board: &CharucoBoard, surface: Option<&BoardSurface>) -> Self {
        let size_m = [board.squares_x, board.squares_y].map(|n| n as f64 * board.square_m);
        let coefficients_m = surface.and_then(|surface| fit(board, size_m, &surface.heights_m));
        Self { size_m, coefficients_m: coefficients_m.unwrap_or_default() }
    }

    /// Height over the board's plane (into the board), metres.
    pub(super) fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        if self.coefficients_m.is_empty() {
            return 0.0;
        }
        // Beyond the outline polynomials run away.
        let [width_m, height_m] = self.size_m;
        let place = terms(
            (2.0 * x_m / width_m - 1.0).clamp(-1.0, 1.0),
            (2.0 * y_m / height_m - 1.0).clamp(-1.0, 1.0),
        );
        self.coefficients_m.iter().zip(place).map(|(c, t)| c * t).sum()
    }
}

const N_TERMS: usize = 15;

/// xⁱ·yʲ with i + j ≤ 4.
fn terms(x: f64, y: f64) -> [f64; N_TERMS] {
    let (x2, y2) = (x * x, y * y);
    [
        1.0,
        x,
        y,
        x2,
        x * y,
        y2,
        x2 * x,
        x2 * y,
        x * y2,
        y2 * y,
        x2 * x2,
        x2 * x * y,
        x2 * y2,
        x * y2 * y,
        y2 * y2,
    ]
}

fn fit(board: &CharucoBoard, size_m: [f64; 2], heights_m: &[f64]) -> Option<Vec<f64>> {
    let mut rows = DMatrix::zeros(heights_m.len(), N_TERMS);
    for id in 0..heights_m.len() {
        let corner = board.corner(id).coords;
        let at = terms(2.0 * corner.x / size_m[0] - 1.0, 2.0 * corner.y / size_m[1] - 1.0);
        for (k, value) in at.into_iter().enumerate() {
            rows[(id, k)] = value;
        }
    }
    // Small boards do not determine all terms: those of least norm are taken.
    let heights = DVector::from_column_slice(heights_m);
    Some(rows.svd(true, true).solve(&heights, 1e-9).ok()?.as_slice().to_vec())
}
