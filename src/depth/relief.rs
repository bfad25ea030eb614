//! The board's surface between its corners and beyond them.

use nalgebra::{DMatrix, DVector};

use crate::{
    board::CharucoBoard,
    calibrate::{BoardSurface, SurfaceKind, alike},
    geom::{Matrix3, Vector3},
    solve::DenseCholesky,
};

/// Heights are kept on a raster of so many steps a square, between which they are interpolated bilinearly: of waves of
/// 0.8 mm and 100 mm that takes a hundredth.
const STEPS: usize = 4;

/// Of how many places along each side the plane of what is not known is taken.
const MAX_GRID: usize = 12;
/// Heights follow from so many corners at most.
const MAX_CORNERS: usize = 200;

/// The surface through the heights of all corners, metres over the board's plane (into the board).
pub(super) struct Relief {
    per_m: f64,
    columns: usize,
    rows: usize,
    heights_m: Vec<f64>,
    plane_covariance: Matrix3<f64>,
}

/// No board is known better than that at its rim, metres.
const LEAST_SIGMA_M: f64 = 1e-6;

impl Relief {
    /// A flat board, where there is no surface or it does not determine one.
    ///
    /// A free surface is what the Gaussian process, that the calibration takes it for beforehand, expects of every
    /// place once the corners' heights are known (kriging): beyond the outermost corners it goes on as it leaves them,
    /// and comes back to the plane. A bend is two parabolas, and goes on as these.
    pub(super) fn new(board: &CharucoBoard, surface: Option<&BoardSurface>) -> Self {
        let per_m = STEPS as f64 / board.square_m;
        let [columns, rows] = [board.squares_x, board.squares_y].map(|n| n * STEPS + 1);
        let size_m = [board.squares_x, board.squares_y].map(|n| n as f64 * board.square_m);
        let least = [1.0, 2.0 / size_m[0], 2.0 / size_m[1]].map(|by| LEAST_SIGMA_M * by);
        let least = Matrix3::from_diagonal(&Vector3::from(least.map(|sigma| sigma * sigma)));
        let heights_m = Vec::new();
        let mut flat = Self { per_m, columns, rows, heights_m, plane_covariance: least };
        let Some(surface) = surface else { return flat };
        let at = |i: usize| ((i % columns) as f64 / per_m, (i / columns) as f64 / per_m);
        let heights_m = if surface.kind == SurfaceKind::Free {
            Expected::new(board, &surface.heights_m).map(|expected| {
                flat.plane_covariance += expected.plane_covariance(board);
                (0..columns * rows).map(|i| expected.height_m(at(i))).collect()
            })
        } else {
            parabolas(board, size_m, &surface.heights_m).map(|coefficients_m| {
                let height = |(x, y): (f64, f64)| {
                    let place = terms(2.0 * x / size_m[0] - 1.0, 2.0 * y / size_m[1] - 1.0);
                    coefficients_m.iter().zip(place).map(|(c, t)| c * t).sum()
                };
                (0..columns * rows).map(|i| height(at(i))).collect()
            })
        };
        Self { heights_m: heights_m.unwrap_or_default(), ..flat }
    }

    /// How sure the plane through the whole surface is, given the heights of the corners: of the height of its middle
    /// (m) and its slopes along rows and columns.
    pub(super) fn plane_covariance(&self) -> Matrix3<f64> {
        self.plane_covariance
    }

    /// Height of a place on the board; beyond its outline, that of the outline.
    pub(super) fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        if self.heights_m.is_empty() {
            return 0.0;
        }
        let along = |m: f64, n: usize| (m * self.per_m).clamp(0.0, (n - 1) as f64);
        let (x, y) = (along(x_m, self.columns), along(y_m, self.rows));
        let (i, j) = ((x as usize).min(self.columns - 2), (y as usize).min(self.rows - 2));
        let (u, v) = (x - i as f64, y - j as f64);
        let row = &self.heights_m[j * self.columns + i..];
        let (top, bottom) = (row[0] + u * (row[1] - row[0]), {
            let below = &row[self.columns..];
            below[0] + u * (below[1] - below[0])
        });
        top + v * (bottom - top)
    }
}

/// What is expected of a free surface, given heights of some of its corners.
struct Expected {
    pitch_m: f64,
    places: Vec<Vector3<f64>>,
    /// Of the correlation of the places' heights.
    factor: DenseCholesky,
    /// The correlation's inverse times the heights.
    weights: Vec<f64>,
    /// How far the surface stands from its plane, as far as the heights themselves tell: the variance of greatest
    /// likelihood, but for the plane's three numbers, m².
    variance: f64,
}

impl Expected {
    fn new(board: &CharucoBoard, heights_m: &[f64]) -> Option<Self> {
        let corners = [board.squares_x - 1, board.squares_y - 1];
        // Of a large board every second row and column, or third, and always the outermost.
        let mut step = 1;
        let taken = |n: usize, step: usize| (n - 1).div_ceil(step) + 1;
        while corners.iter().map(|&n| taken(n, step)).product::<usize>() > MAX_CORNERS {
            step += 1;
        }
        let along = |n: usize| (0..taken(n, step)).map(move |i| (i * step).min(n - 1));
        let ids: Vec<usize> = along(corners[1])
            .flat_map(|row| along(corners[0]).map(move |column| row * corners[0] + column))
            .collect();
        let places: Vec<Vector3<f64>> = ids.iter().map(|&id| board.corner(id).coords).collect();
        let pitch_m = step as f64 * board.square_m;
        let n = places.len();
        let covariance =
            (0..n * n).map(|at| alike((places[at / n] - places[at % n]).norm(), pitch_m)).collect();
        let heights: Vec<f64> = ids.iter().map(|&id| heights_m[id]).collect();
        let factor = DenseCholesky::new(covariance, n)?;
        let weights = factor.solve(&heights);
        let squares: f64 = heights.iter().zip(&weights).map(|(h, w)| h * w).sum();
        let variance = squares / (n.saturating_sub(3).max(1)) as f64;
        Some(Self { pitch_m, places, factor, weights, variance })
    }

    /// Of the plane nearest to what the surface differs from what is expected of it, at an even grid over the board.
    fn plane_covariance(&self, board: &CharucoBoard) -> Matrix3<f64> {
        let size_m = [board.squares_x, board.squares_y].map(|n| n as f64 * board.square_m);
        let n = [board.squares_x, board.squares_y].map(|n| n.min(MAX_GRID));
        let along = |k: usize, i: usize| (i as f64 + 0.5) / n[k] as f64 * size_m[k];
        let grid: Vec<Vector3<f64>> = (0..n[0] * n[1])
            .map(|i| Vector3::new(along(0, i % n[0]), along(1, i / n[0]), 0.0))
            .collect();
        let middle = 0.5 * Vector3::new(size_m[0], size_m[1], 0.0);
        let row = |at: &Vector3<f64>| Vector3::new(1.0, at.x - middle.x, at.y - middle.y);
        let normal: Matrix3<f64> = grid.iter().map(|at| row(at) * row(at).transpose()).sum();
        let Some(inverse) = normal.try_inverse() else { return Matrix3::zeros() };
        // By the plane's three numbers, the correlation of each with the corners' heights and with itself.
        let by_corner: Vec<Vector3<f64>> = self
            .places
            .iter()
            .map(|place| {
                grid.iter().map(|at| row(at) * alike((place - at).norm(), self.pitch_m)).sum()
            })
            .collect();
        let solved: [Vec<f64>; 3] = std::array::from_fn(|k| {
            self.factor.solve(&by_corner.iter().map(|by| by[k]).collect::<Vec<f64>>())
        });
        let mut left: Matrix3<f64> = Matrix3::zeros();
        for at in &grid {
            for other in &grid {
                left += row(at) * row(other).transpose() * alike((at - other).norm(), self.pitch_m);
            }
        }
        for (i, by) in by_corner.iter().enumerate() {
            left -= by * Vector3::from_fn(|k, _| solved[k][i]).transpose();
        }
        inverse * (0.5 * (left + left.transpose())) * inverse * self.variance
    }

    fn height_m(&self, (x, y): (f64, f64)) -> f64 {
        let at = Vector3::new(x, y, 0.0);
        let shares = self.places.iter().zip(&self.weights);
        shares.map(|(place, weight)| weight * alike((place - at).norm(), self.pitch_m)).sum()
    }
}

/// 1, x, y, x², y².
fn terms(x: f64, y: f64) -> [f64; 5] {
    [1.0, x, y, x * x, y * y]
}

/// The coefficients of these terms, by places that reach from −1 to 1 over the board.
fn parabolas(board: &CharucoBoard, size_m: [f64; 2], heights_m: &[f64]) -> Option<Vec<f64>> {
    let mut rows = DMatrix::zeros(heights_m.len(), 5);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Dictionary;

    fn surface(
        board: &CharucoBoard,
        kind: SurfaceKind,
        at: impl Fn(f64, f64) -> f64,
    ) -> BoardSurface {
        let corners = (0..board.n_corners()).map(|id| board.corner(id));
        let heights_m: Vec<f64> = corners.map(|c| at(c.coords.x, c.coords.y)).collect();
        BoardSurface { kind, sigmas_m: vec![1e-5; heights_m.len()], heights_m, print: None }
    }

    /// Waves as on the paper's board: between corners to a few hundredths, beyond them better than a flat board, on
    /// boards small and large.
    #[test]
    fn waves_go_on_between_corners_and_beyond() {
        for (squares, square_m, wave_m) in [((11, 8), 0.02, 0.16), ((30, 24), 0.01, 0.3)] {
            let dictionary = Dictionary::predefined("DICT_5X5_1000").expect("known");
            let board =
                CharucoBoard::new(squares, square_m, 0.7 * square_m, dictionary).expect("a board");
            let k = std::f64::consts::TAU / wave_m;
            let height = |x: f64, y: f64| 4e-4 * (k * x).sin() * (0.8 * k * y + 0.4).cos();
            let relief = Relief::new(&board, Some(&surface(&board, SurfaceKind::Free, height)));
            let (mut inside, mut beyond, mut flat) = (0.0_f64, 0.0, 0.0);
            for (i, j) in (0..=squares.0 * 3).flat_map(|i| (0..=squares.1 * 3).map(move |j| (i, j)))
            {
                let (x, y) = (i as f64 * square_m / 3.0, j as f64 * square_m / 3.0);
                let error = relief.height_m(x, y) - height(x, y);
                let within = |k: usize, n: usize| (3..=3 * (n - 1)).contains(&k);
                if within(i, squares.0) && within(j, squares.1) {
                    inside = inside.max(error.abs());
                } else {
                    beyond += error * error;
                    flat += height(x, y).powi(2);
                }
            }
            assert!(inside < 2.5e-5, "{squares:?}: {inside}");
            assert!(beyond < 0.2 * flat, "{squares:?}: {beyond} of {flat}");
        }
    }

    /// The plane of what lies between and beyond corners, against what is said of it beforehand.
    #[test]
    fn the_plane_of_what_is_not_known_is_as_large_as_said() {
        let board = CharucoBoard::paper(0.02).expect("a board");
        let size_m = [board.squares_x, board.squares_y].map(|n| n as f64 * 0.02);
        let mut mean = 0.0;
        for k in 0..20 {
            let (a, b) = (35.0 + 0.7 * f64::from(k), 0.9 * f64::from(k));
            let height = |x: f64, y: f64| 4e-4 * (a * x + b).sin() * (0.8 * a * y + 1.3 * b).cos();
            let relief = Relief::new(&board, Some(&surface(&board, SurfaceKind::Free, height)));
            let (mut ata, mut atb) = (Matrix3::zeros(), Vector3::zeros());
            for (i, j) in (0..40).flat_map(|i| (0..32).map(move |j| (i, j))) {
                let (x, y) = ((f64::from(i) + 0.5) * 0.005, (f64::from(j) + 0.5) * 0.005);
                let row = Vector3::new(1.0, x - 0.5 * size_m[0], y - 0.5 * size_m[1]);
                ata += row * row.transpose();
                atb += row * (height(x, y) - relief.height_m(x, y));
            }
            let plane = ata.try_inverse().expect("a grid") * atb;
            let inverse = relief.plane_covariance().try_inverse().expect("positive");
            mean += plane.dot(&(inverse * plane)) / 3.0 / 20.0;
        }
        assert!((0.1..4.0).contains(&mean), "{mean}");
        let flat = Relief::new(&board, None).plane_covariance();
        assert!(flat[(0, 0)].sqrt() <= LEAST_SIGMA_M && flat[(1, 1)].sqrt() < 2e-5, "{flat}");
    }

    #[test]
    fn a_bend_is_two_parabolas_and_no_surface_is_flat() {
        let board = CharucoBoard::paper(0.02).expect("a board");
        let height = |x: f64, y: f64| 0.01 * (x - 0.1).powi(2) - 0.02 * (y - 0.08).powi(2);
        let bend = surface(&board, SurfaceKind::Bend, height);
        let relief = Relief::new(&board, Some(&bend));
        let [width, down] = [board.squares_x, board.squares_y].map(|n| n as f64 * 0.02);
        for (x, y) in [(0.0, 0.0), (width, down), (0.05, 0.11), (0.013, down)] {
            // What is lost on the raster: a parabola over a quarter of a square.
            assert!((relief.height_m(x, y) - height(x, y)).abs() < 2e-7, "{x} {y}");
        }
        assert_eq!(Relief::new(&board, None).height_m(0.1, 0.1), 0.0);
    }
}
