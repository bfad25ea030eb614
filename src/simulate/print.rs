//! What is printed on the sheet, and how much of it a pixel sees.

use super::scene::{Handedness, Polarity, Print};
use crate::board::CharucoBoard;

/// The reflectance of the plane of the board, averaged exactly over quadrilaterals.
///
/// The print is piecewise constant on a grid of lines parallel to the board's sides. Green's theorem turns the mean
/// over a quadrilateral Q into an integral along its sides, in closed form between two lines of the grid:
///
/// ```text
/// ∬_Q g ds dt = ∮ F(s, t) dt,   F(s, t) = ∫ g(s', t) ds' from −∞ to s,   g = reflectance − wall
/// ```
///
/// There are no samples, hence nothing to converge. Coordinates are in squares of the board.
#[derive(Clone, Debug)]
pub(super) struct PrintedPlane {
    s: Axis,
    t: Axis,
    /// Reflectance of the wall round the sheet.
    wall: f64,
    /// Per row of the grid and interval of `s`: g, and ∫ g ds, ∬ g ds ds at the interval's lower end.
    cells: Vec<Cell>,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    g: f64,
    sum: f64,
    sum_of_sum: f64,
}

/// The lines of the grid along one axis: the sheet's end, the squares and inside each of them the marker's cells, the
/// sheet's other end. Interval 0 lies before the first line, the last one beyond the last.
#[derive(Clone, Debug)]
struct Axis {
    squares: usize,
    margin: f64,
    /// White rim between a square's side and its marker, squares.
    rim: f64,
    cells_per_marker: usize,
    cells_per_square: f64,
    /// Lower end of each interval; that of interval 0, which has none, repeats the first line.
    lower: Vec<f64>,
}

impl Axis {
    fn new(squares: usize, margin: f64, marker: f64, cells_per_marker: usize) -> Self {
        let rim = (1.0 - marker) / 2.0;
        let mut lower = vec![-margin, -margin];
        for square in 0..squares {
            let start = square as f64;
            lower.push(start);
            lower.extend(
                (0..=cells_per_marker)
                    .map(|i| start + rim + marker * i as f64 / cells_per_marker as f64),
            );
        }
        lower.extend([squares as f64, squares as f64 + margin]);
        let cells_per_square = cells_per_marker as f64 / marker;
        Self { squares, margin, rim, cells_per_marker, cells_per_square, lower }
    }

    fn len(&self) -> usize {
        self.lower.len()
    }

    /// The interval that holds `u`.
    fn interval(&self, u: f64) -> usize {
        if u < 0.0 {
            return usize::from(u >= -self.margin);
        }
        let n = self.squares as f64;
        if u >= n {
            return self.len() - 1 - usize::from(u < n + self.margin);
        }
        let column = u as usize;
        let within = u - column as f64 - self.rim;
        let inside = if within < 0.0 {
            0
        } else {
            1 + ((within * self.cells_per_square) as usize).min(self.cells_per_marker)
        };
        2 + column * (self.cells_per_marker + 2) + inside
    }

    /// The middle of an interval that has two ends.
    fn middle(&self, interval: usize) -> f64 {
        f64::midpoint(self.lower[interval], self.lower[interval + 1])
    }
}

impl PrintedPlane {
    pub(super) fn new(board: &CharucoBoard, print: &Print, wall: f64) -> Self {
        let marker = board.marker_m / board.square_m;
        let margin = print.margin_m / board.square_m;
        let cells_per_marker = board.dictionary.bits() + 2;
        let s = Axis::new(board.squares_x, margin, marker, cells_per_marker);
        let t = Axis::new(board.squares_y, margin, marker, cells_per_marker);
        let reflectance = |i: usize, j: usize| {
            if i == 0 || j == 0 || i + 1 == s.len() || j + 1 == t.len() {
                return wall;
            }
            let x = match print.handedness {
                Handedness::AsDesigned => s.middle(i),
                Handedness::Mirrored => board.squares_x as f64 - s.middle(i),
            };
            let [x_m, y_m] = [x, t.middle(j)].map(|u| u * board.square_m);
            match (board.is_white_at(print.layout, x_m, y_m), print.polarity) {
                (None, _)
                | (Some(true), Polarity::BlackOnWhite)
                | (Some(false), Polarity::WhiteOnBlack) => print.paper,
                _ => print.ink,
            }
        };
        let mut cells = Vec::with_capacity(s.len() * t.len());
        for j in 0..t.len() {
            let (mut sum, mut sum_of_sum) = (0.0, 0.0);
            for i in 0..s.len() {
                let g = reflectance(i, j) - wall;
                cells.push(Cell { g, sum, sum_of_sum });
                if i > 0 && i + 1 < s.len() {
                    let width = s.lower[i + 1] - s.lower[i];
                    sum_of_sum += width * (sum + g * width / 2.0);
                    sum += g * width;
                }
            }
        }
        Self { s, t, wall, cells }
    }

    /// The reflectance at a point.
    pub(super) fn at(&self, [s, t]: [f64; 2]) -> f64 {
        self.wall + self.cell(self.s.interval(s), self.t.interval(t)).g
    }

    /// The cell of the grid that holds this point: (interval of s, interval of t).
    pub(super) fn interval(&self, [s, t]: [f64; 2]) -> [usize; 2] {
        [self.s.interval(s), self.t.interval(t)]
    }

    /// The one reflectance of all cells of the grid from `low` to `high` (both included); `None` where they differ.
    pub(super) fn uniform(&self, low: [usize; 2], high: [usize; 2]) -> Option<f64> {
        let first = self.cell(low[0], low[1]).g;
        for j in low[1]..=high[1] {
            for i in low[0]..=high[0] {
                if self.cell(i, j).g != first {
                    return None;
                }
            }
        }
        Some(self.wall + first)
    }

    /// ∮ F dt along the straight way from `from` to `to`.
    pub(super) fn along(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        if from[1] > to[1] {
            return -self.upwards(to, from);
        }
        self.upwards(from, to)
    }

    /// The mean reflectance over an area, given ∮ F dt round it and its signed area ∮ s dt.
    pub(super) fn mean(&self, integral: f64, area: f64) -> f64 {
        self.wall + integral / area
    }

    fn upwards(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let height = to[1] - from[1];
        if !(height > 0.0) {
            return 0.0;
        }
        let slope = (to[0] - from[0]) / height;
        let [mut s, mut t] = from;
        let mut integral = 0.0;
        for j in self.t.interval(t)..self.t.len() {
            let end = self.t.lower.get(j + 1).map_or(to[1], |&line| line.min(to[1]));
            let s_end = if end == to[1] { to[0] } else { from[0] + slope * (end - from[1]) };
            integral += (end - t) * self.mean_sum(j, s, s_end);
            (s, t) = (s_end, end);
            if end == to[1] {
                break;
            }
        }
        integral
    }

    /// The mean of F over s between `a` and `b`, in row `j` of the grid.
    fn mean_sum(&self, j: usize, a: f64, b: f64) -> f64 {
        let (ia, ib) = (self.s.interval(a), self.s.interval(b));
        // F is linear inside a cell. Beyond it, dividing the difference of two integrals by a tiny width would lose
        // all digits; F is continuous, so that the trapezoid is as good there.
        if ia == ib || (b - a).abs() < 1e-7 {
            return f64::midpoint(self.sum(j, ia, a), self.sum(j, ib, b));
        }
        (self.sum_of_sum(j, ib, b) - self.sum_of_sum(j, ia, a)) / (b - a)
    }

    /// F
    fn sum(&self, j: usize, i: usize, s: f64) -> f64 {
        let cell = self.cell(i, j);
        cell.sum + cell.g * (s - self.s.lower[i])
    }

    /// ∫ F ds
    fn sum_of_sum(&self, j: usize, i: usize, s: f64) -> f64 {
        let cell = self.cell(i, j);
        let d = s - self.s.lower[i];
        cell.sum_of_sum + d * (cell.sum + d * cell.g / 2.0)
    }

    fn cell(&self, i: usize, j: usize) -> Cell {
        self.cells[j * self.s.len() + i]
    }
}
