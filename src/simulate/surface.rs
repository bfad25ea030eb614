//! Prints that are not flat.

use crate::board::CharucoBoard;

/// How far a print stands from its plane.
///
/// ```text
/// z(x, y) = Σ c_k · B_k(ξ, η),   ξ = 2x/width − 1,  η = 2y/height − 1
/// B = ξ² − ⅓,  ξ·η,  η² − ⅓,  ξ³ − ξ,  η³ − η,  ξ²·η,  ξ·η²
/// ```
///
/// z points into the board, away from the viewer; beyond 1.1 times the board's half size the values there hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// c, metres.
    pub coefficients_m: [f64; 7],
}

impl Surface {
    /// A print on a plate.
    pub const FLAT: Self = Self { coefficients_m: [0.0; 7] };

    /// A sheet taped to a wall, like the board of the published recordings: wavy by `peak_to_valley_m` over the board.
    pub fn taped_sheet(peak_to_valley_m: f64) -> Self {
        // Shape chosen by eye after a taped sheet: hollow along x, twisted, one edge lifted.
        let shape = [0.8, 0.35, -0.4, 0.5, -0.25, 0.2, -0.3];
        let unit = Self { coefficients_m: shape };
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (i, j) in (0..=40).flat_map(|i| (0..=40).map(move |j| (i, j))) {
            let z = unit.at(f64::from(i) / 20.0 - 1.0, f64::from(j) / 20.0 - 1.0);
            (low, high) = (low.min(z), high.max(z));
        }
        Self { coefficients_m: shape.map(|c| c * peak_to_valley_m / (high - low)) }
    }

    /// z at (x, y) on this board, metres.
    pub fn height_m(&self, board: &CharucoBoard, x_m: f64, y_m: f64) -> f64 {
        if self.is_flat() {
            return 0.0;
        }
        let side = |u_m: f64, squares: usize| {
            (2.0 * u_m / (squares as f64 * board.square_m) - 1.0).clamp(-1.1, 1.1)
        };
        self.at(side(x_m, board.squares_x), side(y_m, board.squares_y))
    }

    pub(super) fn is_flat(&self) -> bool {
        *self == Self::FLAT
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let [a, b, c, d, e, f, g] = self.coefficients_m;
        let third = 1.0 / 3.0;
        a * (x * x - third)
            + b * x * y
            + c * (y * y - third)
            + d * x * (x * x - 1.0)
            + e * y * (y * y - 1.0)
            + f * x * x * y
            + g * x * y * y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_taped_sheet_is_as_wavy_as_asked() {
        let board = CharucoBoard::paper(0.020875).unwrap();
        let surface = Surface::taped_sheet(8e-4);
        let heights: Vec<f64> = (0..=100)
            .flat_map(|i| (0..=80).map(move |j| (f64::from(i) / 10.0, f64::from(j) / 10.0)))
            .map(|(s, t)| surface.height_m(&board, s * board.square_m, t * board.square_m))
            .collect();
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!((high - low - 8e-4).abs() < 2e-6, "{low} {high}");
        assert_eq!(Surface::FLAT.height_m(&board, 0.1, 0.1), 0.0);
    }
}
