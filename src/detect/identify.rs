//! Which part of the board is it? All visible marker cells vote jointly.
//!
//! A lattice can lie on the board in many places: shifted, turned by quarters, mirrored. Every placement says which
//! marker each bright cell must show. No marker is decoded alone: the grey values at all bits of all cells are
//! correlated with what each placement expects, so that thirty unreadable markers still agree on the one placement
//! that explains them all. With soft bits v (about ±1) and the expected bits c = ±1 the model is
//!
//! ```text
//! v = g·c + noise,    log p(v | A) − log p(v | B) = (g/σ²)·Σ v·(c_A − c_B)
//! ```
//!
//! with g and σ estimated under the best placement, and the sum divided by the number of bits that blur makes one.

use crate::{
    board::{CharucoBoard, Layout},
    geom::Pixel,
    image::Gray,
};

use super::{lattice::Lattice, map::SmoothMap};

/// How a lattice lies on the board.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    /// Board corner (column, row) = turn·(i, j) + shift.
    turn: [[i32; 2]; 2],
    shift: [i32; 2],
    pub(super) layout: Layout,
    pub(super) mirrored: bool,
    pub(super) inverted: bool,
    /// Cells whose bits voted.
    pub(super) n_markers: usize,
    /// Lead over the runner-up, nats.
    pub(super) margin: f64,
    /// Correlation of the bits with the expectation, in units of its spread under chance.
    pub(super) significance: f64,
}

impl Placement {
    /// Column and row of the inner corner at (i, j) of the lattice.
    pub(super) fn corner(&self, i: i32, j: i32) -> [i32; 2] {
        [0, 1].map(|a| self.turn[a][0] * i + self.turn[a][1] * j + self.shift[a])
    }
}

/// The eight ways to lay a grid onto itself: four turns, then the same mirrored.
const TURNS: [[[i32; 2]; 2]; 8] = [
    [[1, 0], [0, 1]],
    [[0, -1], [1, 0]],
    [[-1, 0], [0, -1]],
    [[0, 1], [-1, 0]],
    [[-1, 0], [0, 1]],
    [[0, 1], [1, 0]],
    [[1, 0], [0, -1]],
    [[0, -1], [-1, 0]],
];

/// Neighbouring bits are not independent under blur: this many count as one.
const BITS_PER_VOTE: f64 = 2.0;
/// Least lead over the runner-up, nats: one wrong placement in e¹² ≈ 160 000 were the model exact.
const MIN_MARGIN: f64 = 12.0;
/// Least significance: chance reaches 6 once in 10⁹, a few hundred placements are tried.
const MIN_SIGNIFICANCE: f64 = 6.0;
/// A cell votes when its rim is brighter than the border of its marker by this fraction of the board's contrast.
const MIN_CELL_CONTRAST: f64 = 0.2;

/// A lattice cell that shows a marker.
struct Cell {
    i: i32,
    j: i32,
    /// True for black on white, false for the inverse.
    bright: bool,
    /// Soft bits in the lattice's own orientation: [along j][along i].
    bits: Vec<f32>,
}

/// Lays the lattice onto the board; `Err` tells the best placement's numbers where none is certain.
pub(super) fn identify(
    board: &CharucoBoard,
    image: &Gray,
    lattice: &Lattice,
    map: &SmoothMap,
    contrast: f64,
) -> Result<Placement, NotIdentified> {
    let bright = cells(board, image, lattice, map, contrast, true);
    // Prints with black and white exchanged are rare: look for them only where the usual reading fails.
    match best_placement(board, lattice, &bright) {
        Ok(placement) => Ok(placement),
        Err(first) => {
            let dark = cells(board, image, lattice, map, contrast, false);
            best_placement(board, lattice, &dark).map_err(|_| first)
        }
    }
}

/// Why no placement was accepted.
#[derive(Clone, Copy, Debug)]
pub(super) enum NotIdentified {
    /// No cell shows anything like a marker.
    NoMarkers,
    /// Markers do not agree on a placement.
    Ambiguous,
}

/// Samples all cells of the given colour in and around the lattice.
fn cells(
    board: &CharucoBoard,
    image: &Gray,
    lattice: &Lattice,
    map: &SmoothMap,
    contrast: f64,
    bright: bool,
) -> Vec<Cell> {
    let n = board.dictionary.bits();
    let side = board.marker_m / board.square_m;
    let cell_side = side / (n + 2) as f64;
    let start = (1.0 - side) / 2.0;
    let mut candidates = std::collections::BTreeSet::new();
    for node in &lattice.nodes {
        for (di, dj) in [(-1, -1), (0, -1), (-1, 0), (0, 0)] {
            if lattice.is_bright(node.i + di, node.j + dj) == bright {
                candidates.insert((node.j + dj, node.i + di));
            }
        }
    }
    let mut cells = Vec::new();
    for (j, i) in candidates {
        let (x, y) = (f64::from(i), f64::from(j));
        let [Some(p00), Some(p10), Some(p01), Some(p11)] =
            [map.at(x, y), map.at(x + 1.0, y), map.at(x, y + 1.0), map.at(x + 1.0, y + 1.0)]
        else {
            continue;
        };
        let at = |u: f64, v: f64| {
            let top = [p00.x + (p10.x - p00.x) * u, p00.y + (p10.y - p00.y) * u];
            let bottom = [p01.x + (p11.x - p01.x) * u, p01.y + (p11.y - p01.y) * u];
            image.bilinear(Pixel::new(
                top[0] + (bottom[0] - top[0]) * v,
                top[1] + (bottom[1] - top[1]) * v,
            ))
        };
        if let Some(bits) =
            sample_cell(n, start, cell_side, at, if bright { 1.0 } else { -1.0 }, contrast)
        {
            cells.push(Cell { i, j, bright, bits });
        }
    }
    cells
}

/// Soft bits of one cell; `None` where it leaves the image or shows no marker.
fn sample_cell(
    n: usize,
    start: f64,
    cell_side: f64,
    at: impl Fn(f64, f64) -> Option<f64>,
    sign: f64,
    contrast: f64,
) -> Option<Vec<f32>> {
    let center = |k: usize| start + (k as f64 + 0.5) * cell_side;
    // The black border of the marker and the rim of the square round it.
    let (mut border, mut rim) = (0.0, 0.0);
    let outer = n + 1;
    for k in 0..=n {
        border += at(center(k), center(0))?;
        border += at(center(outer), center(k))?;
        border += at(center(outer - k), center(outer))?;
        border += at(center(0), center(outer - k))?;
    }
    border /= (4 * (n + 1)) as f64;
    for t in [0.3, 0.5, 0.7] {
        for (u, v) in
            [(t, 0.5 * start), (t, 1.0 - 0.5 * start), (0.5 * start, t), (1.0 - 0.5 * start, t)]
        {
            rim += at(u, v)?;
        }
    }
    rim /= 12.0;
    let step = sign * (rim - border);
    if step < MIN_CELL_CONTRAST * contrast {
        return None;
    }
    let (middle, half) = (f64::midpoint(rim, border), (rim - border) / 2.0);
    let mut bits = Vec::with_capacity(n * n);
    for row in 1..=n {
        for column in 1..=n {
            let v = (at(center(column), center(row))? - middle) / half;
            bits.push(v.clamp(-1.5, 1.5) as f32);
        }
    }
    Some(bits)
}

fn best_placement(
    board: &CharucoBoard,
    lattice: &Lattice,
    cells: &[Cell],
) -> Result<Placement, NotIdentified> {
    if cells.is_empty() {
        return Err(NotIdentified::NoMarkers);
    }
    let n = board.dictionary.bits();
    let n2 = n * n;
    let expected = Expected::new(board);
    // (score, bits, placement) of the best and the runner-up's score.
    let mut best: Option<(f64, usize, Placement)> = None;
    let mut second = f64::NEG_INFINITY;
    for (index, &turn) in TURNS.iter().enumerate() {
        // Where each board bit lies among a cell's samples, and the cells' bits in that order.
        let order = bit_order(n, turn);
        let turned: Vec<f32> =
            cells.iter().flat_map(|cell| order.iter().map(|&k| cell.bits[k])).collect();
        for shift in shifts(board, lattice, turn) {
            let place = Placement {
                turn,
                shift,
                layout: Layout::New,
                mirrored: index >= 4,
                inverted: !cells[0].bright,
                n_markers: 0,
                margin: 0.0,
                significance: 0.0,
            };
            for layout in expected.layouts() {
                let Some((score, n_markers)) = expected.score(*layout, &place, cells, &turned, n2)
                else {
                    continue;
                };
                if best.as_ref().is_none_or(|(s, ..)| score > *s) {
                    if let Some((s, ..)) = best {
                        second = second.max(s);
                    }
                    best = Some((
                        score,
                        n_markers * n2,
                        Placement { layout: *layout, n_markers, ..place },
                    ));
                } else {
                    second = second.max(score);
                }
            }
        }
    }
    let (score, n_bits, mut placement) = best.ok_or(NotIdentified::Ambiguous)?;
    let energy: f64 = cells.iter().flat_map(|c| &c.bits).map(|v| f64::from(v * v)).sum::<f64>()
        / (cells.len() * n2) as f64;
    let gain = score / n_bits.max(1) as f64;
    // The floor keeps a perfect picture from claiming certainty beyond its few bits.
    let variance = (energy - gain * gain).max(0.1);
    placement.significance =
        gain / energy.sqrt().max(1e-6) * (n_bits as f64 / BITS_PER_VOTE).sqrt();
    placement.margin = gain / variance * (score - second.max(0.0)) / BITS_PER_VOTE;
    if placement.n_markers >= 2
        && placement.margin > MIN_MARGIN
        && placement.significance > MIN_SIGNIFICANCE
    {
        Ok(placement)
    } else {
        Err(NotIdentified::Ambiguous)
    }
}

/// For every bit of a marker on the board (row by row) the index of its sample in a cell of the lattice.
fn bit_order(n: usize, turn: [[i32; 2]; 2]) -> Vec<usize> {
    let last = n as i32 - 1;
    let mut order = Vec::with_capacity(n * n);
    for row in 0..n as i32 {
        for column in 0..n as i32 {
            // Twice the offset from the cell's centre, turned back into the lattice (the inverse is the transpose).
            let (dx, dy) = (2 * column - last, 2 * row - last);
            let i = turn[0][0] * dx + turn[1][0] * dy;
            let j = turn[0][1] * dx + turn[1][1] * dy;
            order.push((((j + last) / 2) * n as i32 + (i + last) / 2) as usize);
        }
    }
    order
}

/// Shifts under which the lattice lies on the board. Should it be larger than the board (a false node at its rim),
/// the shifts under which at most a tenth of its nodes lies outside.
fn shifts(board: &CharucoBoard, lattice: &Lattice, turn: [[i32; 2]; 2]) -> Vec<[i32; 2]> {
    let size = [board.squares_x as i32 - 1, board.squares_y as i32 - 1];
    let turned: Vec<[i32; 2]> =
        lattice.nodes.iter().map(|n| [0, 1].map(|a| turn[a][0] * n.i + turn[a][1] * n.j)).collect();
    let range = |a: usize| {
        let low = turned.iter().map(|t| t[a]).min().unwrap_or(0);
        let high = turned.iter().map(|t| t[a]).max().unwrap_or(0);
        (low, high)
    };
    let ((x0, x1), (y0, y1)) = (range(0), range(1));
    let fits = x1 - x0 < size[0] && y1 - y0 < size[1];
    let span = |low: i32, high: i32, size: i32| {
        let (a, b) = (-low, size - 1 - high);
        a.min(b)..=a.max(b)
    };
    let mut shifts = Vec::new();
    for sx in span(x0, x1, size[0]) {
        for sy in span(y0, y1, size[1]) {
            let outside = || {
                turned
                    .iter()
                    .filter(|t| {
                        !(0..size[0]).contains(&(t[0] + sx)) || !(0..size[1]).contains(&(t[1] + sy))
                    })
                    .count()
            };
            if fits || outside() * 10 <= turned.len() {
                shifts.push([sx, sy]);
            }
        }
    }
    shifts
}

/// What the board's squares show, ready for correlation.
struct Expected<'a> {
    board: &'a CharucoBoard,
    layouts: &'static [Layout],
    /// For each layout the marker of each square, or none.
    markers: Vec<Vec<Option<usize>>>,
    /// ±1 for every bit of every marker used.
    codes: Vec<f32>,
}

impl<'a> Expected<'a> {
    fn new(board: &'a CharucoBoard) -> Self {
        // With an odd number of rows the layouts are the same.
        let layouts: &[Layout] = if board.squares_y.is_multiple_of(2) {
            &[Layout::New, Layout::Legacy]
        } else {
            &[Layout::New]
        };
        let n = board.dictionary.bits();
        let mut n_used = 0;
        let markers = layouts
            .iter()
            .map(|&layout| {
                let mut squares = vec![None; board.squares_x * board.squares_y];
                for m in board.markers(layout) {
                    squares[m.row * board.squares_x + m.column] = Some(m.id);
                    n_used = n_used.max(m.id + 1);
                }
                squares
            })
            .collect();
        let mut codes = Vec::with_capacity(n_used * n * n);
        for id in 0..n_used {
            for row in 1..=n {
                for column in 1..=n {
                    codes.push(if board.dictionary.is_white(id, row, column) { 1.0 } else { -1.0 });
                }
            }
        }
        Self { board, layouts, markers, codes }
    }

    fn layouts(&self) -> &[Layout] {
        self.layouts
    }

    /// Σ v·c over all cells that lie on the board, and how many they are; `None` where the colours of the squares
    /// contradict the placement.
    fn score(
        &self,
        layout: Layout,
        place: &Placement,
        cells: &[Cell],
        turned: &[f32],
        n2: usize,
    ) -> Option<(f64, usize)> {
        let squares = &self.markers[self.layouts.iter().position(|l| *l == layout)?];
        let (mut score, mut n_markers) = (0.0_f32, 0);
        for (index, cell) in cells.iter().enumerate() {
            // The square between the corners (i, j) and (i + 1, j + 1): its column is the larger of its corners'.
            let [a, b] = [place.corner(cell.i, cell.j), place.corner(cell.i + 1, cell.j + 1)];
            let (column, row) = (a[0].max(b[0]), a[1].max(b[1]));
            if column < 0
                || row < 0
                || column >= self.board.squares_x as i32
                || row >= self.board.squares_y as i32
            {
                continue;
            }
            let id = squares[row as usize * self.board.squares_x + column as usize]?;
            let bits = &turned[index * n2..][..n2];
            let code = &self.codes[id * n2..][..n2];
            score += bits.iter().zip(code).map(|(v, c)| v * c).sum::<f32>();
            n_markers += 1;
        }
        Some((f64::from(score), n_markers))
    }
}
