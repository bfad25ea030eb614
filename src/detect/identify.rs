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
//!
//! Where motion smears the bits over their neighbours that is not enough; `blurred` explains the picture under an
//! unknown blur then.

use std::{array, ops::Range, sync::OnceLock};

use crate::{
    board::{CharucoBoard, Layout},
    geom::Pixel,
    image::Gray,
    par::dot,
};

use super::{
    blurred::{BlurModel, Contest, Entrant, MOST_CELLS, MOST_TRIALS, Won},
    lattice::Lattice,
    map::SmoothMap,
};

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

/// A placement that was accepted.
#[derive(Clone, Debug)]
pub(super) struct Identified {
    pub(super) placement: Placement,
    /// The markers whose bits voted, by ascending id.
    pub(super) markers: Vec<usize>,
}

/// Neighbouring bits are not independent under blur: this many count as one.
const BITS_PER_VOTE: f64 = 2.0;
/// Least lead over the runner-up, nats: one wrong placement in e¹² ≈ 160 000 were the model exact.
const MIN_MARGIN: f64 = 12.0;
/// Least significance: chance reaches 6 once in 10⁹, a few hundred placements are tried.
const MIN_SIGNIFICANCE: f64 = 6.0;
/// Least part of the lattice's nodes on the board where the picture is clear: a false one at its rim is all it has.
const CLEAR_INSIDE: f64 = 0.9;
/// The same where it is not: blur makes crossings of the ends of the outermost edges, a whole row of them. The true
/// placement must be among those that are tried, or a false one wins unopposed.
const BLURRED_INSIDE: f64 = 0.65;
/// Correlation of the bits with the expectation that only a clear picture has.
const CLEAR_CORRELATION: f64 = 0.7;
/// Scores are the same in both layouts where they differ by less than this.
const SAME_SCORE: f64 = 0.999;
/// A cell votes when its rim is brighter than the border of its marker by this fraction of the board's contrast.
const MIN_CELL_CONTRAST: f64 = 0.2;

/// A lattice cell that shows a marker.
#[derive(Clone)]
struct Cell {
    i: i32,
    j: i32,
    /// True for black on white, false for the inverse.
    bright: bool,
    /// Grey values of the marker with its border, in the lattice's own orientation: [along j][along i].
    samples: Vec<f32>,
    /// Mean grey of the square's rim.
    rim: f32,
    /// Mean grey of the marker's border.
    border: f32,
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
    bright: bool,
) -> Vec<Cell> {
    let mut candidates = Vec::with_capacity(4 * lattice.nodes.len());
    for node in &lattice.nodes {
        for (di, dj) in [(-1, -1), (0, -1), (-1, 0), (0, 0)] {
            if lattice.is_bright(node.i + di, node.j + dj) == bright {
                candidates.push((node.j + dj, node.i + di));
            }
        }
    }
    candidates.sort_unstable();
    candidates.dedup();
    let mut cells = Vec::new();
    for (j, i) in candidates {
        let (x, y) = (f64::from(i), f64::from(j));
        let [Some(p00), Some(p10), Some(p01), Some(p11)] =
            [map.at(x, y), map.at(x + 1.0, y), map.at(x, y + 1.0), map.at(x + 1.0, y + 1.0)]
        else {
            continue;
        };
        // p00 + u·(p10 − p00) + v·(p01 − p00) + uv·(the rest)
        let (x1, x2, x3) = (p10.x - p00.x, p01.x - p00.x, p11.x - p10.x - p01.x + p00.x);
        let (y1, y2, y3) = (p10.y - p00.y, p01.y - p00.y, p11.y - p10.y - p01.y + p00.y);
        let place = |u: f64, v: f64| {
            Pixel::new(p00.x + u * (x1 + v * x3) + v * x2, p00.y + u * (y1 + v * y3) + v * y2)
        };
        // Between four places inside, all are: no need to look at each.
        let sampled = if [p00, p10, p01, p11].iter().all(|p| image.contains(*p)) {
            sample_cell(board, |u, v| Some(f64::from(image.between(place(u, v)))))
        } else {
            sample_cell(board, |u, v| image.bilinear(place(u, v)))
        };
        if let Some((samples, rim, border)) = sampled {
            let step = if bright { rim - border } else { border - rim };
            if step > MIN_CELL_CONTRAST * lattice.contrast {
                cells.push(Cell { i, j, bright, samples, rim: rim as f32, border: border as f32 });
            }
        }
    }
    cells
}

/// Grey values at the centres of a marker's bits, border included, and the means of the square's rim and of the
/// border; `None` where any of it leaves the image.
fn sample_cell(
    board: &CharucoBoard,
    at: impl Fn(f64, f64) -> Option<f64>,
) -> Option<(Vec<f32>, f64, f64)> {
    let size = board.dictionary.bits() + 2;
    let side = board.marker_m / board.square_m;
    let start = (1.0 - side) / 2.0;
    let center = |k: usize| start + (k as f64 + 0.5) * side / size as f64;
    let mut rim = 0.0;
    for t in [0.3, 0.5, 0.7] {
        for (u, v) in
            [(t, 0.5 * start), (t, 1.0 - 0.5 * start), (0.5 * start, t), (1.0 - 0.5 * start, t)]
        {
            rim += at(u, v)? / 12.0;
        }
    }
    let (mut samples, mut border) = (Vec::with_capacity(size * size), 0.0);
    for row in 0..size {
        for column in 0..size {
            let value = at(center(column), center(row))?;
            if row == 0 || column == 0 || row == size - 1 || column == size - 1 {
                border += value / (4 * (size - 1)) as f64;
            }
            samples.push(value as f32);
        }
    }
    Some((samples, rim, border))
}

/// For every sample of a marker on the board (row by row, border included) the index of its sample in a cell of the
/// lattice.
fn sample_order(size: usize, turn: [[i32; 2]; 2]) -> Vec<usize> {
    let last = size as i32 - 1;
    let mut order = Vec::with_capacity(size * size);
    for row in 0..size as i32 {
        for column in 0..size as i32 {
            // Twice the offset from the cell's centre, turned back into the lattice (the inverse is the transpose).
            let (dx, dy) = (2 * column - last, 2 * row - last);
            let i = turn[0][0] * dx + turn[1][0] * dy;
            let j = turn[0][1] * dx + turn[1][1] * dy;
            order.push((((j + last) / 2) * size as i32 + (i + last) / 2) as usize);
        }
    }
    order
}

/// Shifts under which at least this part of the lattice's nodes lies on the board.
fn shifts(
    board: &CharucoBoard,
    lattice: &Lattice,
    turn: [[i32; 2]; 2],
    least_inside: f64,
) -> Vec<[i32; 2]> {
    let size = [board.squares_x as i32 - 1, board.squares_y as i32 - 1];
    let turned: Vec<[i32; 2]> =
        lattice.nodes.iter().map(|n| [0, 1].map(|a| turn[a][0] * n.i + turn[a][1] * n.j)).collect();
    let most_outside = ((1.0 - least_inside) * turned.len() as f64) as usize;
    // Along each axis alone, few enough nodes are outside.
    let span = |a: usize| {
        let mut sorted: Vec<i32> = turned.iter().map(|t| t[a]).collect();
        sorted.sort_unstable();
        let (low, high) = (sorted[most_outside], sorted[sorted.len() - 1 - most_outside]);
        let (first, last) = (-low, size[a] - 1 - high);
        first.min(last)..=first.max(last)
    };
    let (across, down) = (span(0), span(1));
    let mut shifts = Vec::new();
    for sx in across {
        for sy in down.clone() {
            let outside = |t: &&[i32; 2]| {
                !(0..size[0]).contains(&(t[0] + sx)) || !(0..size[1]).contains(&(t[1] + sy))
            };
            if turned.iter().filter(outside).count() <= most_outside {
                shifts.push([sx, sy]);
            }
        }
    }
    shifts
}

/// What the board's squares show, ready for comparison.
#[derive(Clone, Debug)]
pub(super) struct Expected {
    board: CharucoBoard,
    layouts: &'static [Layout],
    /// For each layout the marker of each square, or none.
    markers: Vec<Vec<Option<usize>>>,
    /// ±1 for every sample of every marker used, border included.
    codes: Vec<f32>,
    /// Samples along one side of a marker, border included.
    size: usize,
    /// Made when the first blurred picture needs it.
    blur: OnceLock<BlurModel>,
}

/// A placement and the index of its turn.
#[derive(Clone, Copy)]
struct Candidate {
    score: f64,
    turn: usize,
    place: Placement,
}

impl Expected {
    pub(super) fn new(board: &CharucoBoard) -> Self {
        // With an odd number of rows the layouts are the same, and which is reported is the board's choice.
        let layouts: &[Layout] = match board.layout {
            _ if board.squares_y.is_multiple_of(2) => &[Layout::New, Layout::Legacy],
            Some(Layout::Legacy) => &[Layout::Legacy],
            _ => &[Layout::New],
        };
        let size = board.dictionary.bits() + 2;
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
        let mut codes = Vec::with_capacity(n_used * size * size);
        for id in 0..n_used {
            for row in 0..size {
                for column in 0..size {
                    codes.push(if board.dictionary.is_white(id, row, column) { 1.0 } else { -1.0 });
                }
            }
        }
        Self { board: board.clone(), layouts, markers, codes, size, blur: OnceLock::new() }
    }

    /// Lays the lattice onto the board by the soft bits of its cells: quick, and enough unless motion smears them.
    pub(super) fn by_bits(
        &self,
        image: &Gray,
        lattice: &Lattice,
        map: &SmoothMap,
    ) -> Result<Identified, NotIdentified> {
        let cells = cells(&self.board, image, lattice, map, true);
        // A mirrored placement is far from every other: it is tried only where no straight one convinces.
        self.best_by_bits(lattice, &cells, 0..4, CLEAR_INSIDE)
            .and_then(|(identified, correlation)| {
                (correlation > CLEAR_CORRELATION)
                    .then_some(identified)
                    .ok_or(NotIdentified::Ambiguous)
            })
            .or_else(|_| self.by_blurred_bits(lattice, &cells))
    }

    /// The same, with every placement allowed that is not absurd.
    fn by_blurred_bits(
        &self,
        lattice: &Lattice,
        cells: &[Cell],
    ) -> Result<Identified, NotIdentified> {
        self.best_by_bits(lattice, cells, 0..4, BLURRED_INSIDE)
            .or_else(|_| self.best_by_bits(lattice, cells, 0..8, BLURRED_INSIDE))
            .map(|(identified, _)| identified)
    }

    /// Lays the lattice onto the board where [`by_bits`](Self::by_bits) failed: under an unknown blur, then as a
    /// print with black and white exchanged.
    pub(super) fn by_effort(
        &self,
        image: &Gray,
        lattice: &Lattice,
        map: &SmoothMap,
    ) -> Result<Identified, NotIdentified> {
        let bright = cells(&self.board, image, lattice, map, true);
        let dark = || cells(&self.board, image, lattice, map, false);
        self.by_blurred_bits(lattice, &bright).or_else(|why| {
            // As with bits: mirrored placements only where no straight one convinces.
            self.best_by_blur(lattice, &bright, 0..4)
                .or_else(|_| self.best_by_blur(lattice, &bright, 0..8))
                .or_else(|_| self.by_blurred_bits(lattice, &dark()))
                .map_err(|_| why)
        })
    }

    /// The board's squares as a placement lays cells on them.
    fn squares(&self, place: &Placement) -> Squares<'_> {
        let layout = self.layouts.iter().position(|l| *l == place.layout);
        // The square between the corners (i, j) and (i + 1, j + 1): its column is the larger of its corners'.
        let [a, b] = place.turn.map(|[i, j]| (i + j).max(0));
        Squares {
            markers: &self.markers[layout.expect("a placement has one of the layouts")],
            turn: place.turn,
            shift: [place.shift[0] + a, place.shift[1] + b],
            size: [self.board.squares_x, self.board.squares_y],
        }
    }

    /// Every placement that the colours of the squares allow, with the number of its markers.
    fn placements(
        &self,
        lattice: &Lattice,
        cells: &[Cell],
        turns: Range<usize>,
        least_inside: f64,
    ) -> Vec<Candidate> {
        let mut all = Vec::new();
        for turn in turns {
            let matrix = TURNS[turn];
            for shift in shifts(&self.board, lattice, matrix, least_inside) {
                for &layout in self.layouts {
                    let mut place = Placement {
                        turn: matrix,
                        shift,
                        layout,
                        mirrored: turn >= 4,
                        inverted: !cells[0].bright,
                        n_markers: 0,
                        margin: 0.0,
                        significance: 0.0,
                    };
                    // All cells have one colour and the board alternates: the first that lies on it decides.
                    let squares = self.squares(&place);
                    let first = cells.iter().find_map(|cell| squares.at(cell));
                    if let Some(Some(_)) = first {
                        place.n_markers =
                            cells.iter().filter(|cell| squares.marker(cell).is_some()).count();
                        all.push(Candidate { score: 0.0, turn, place });
                    }
                }
            }
        }
        all
    }

    /// The cells' values in the orientation of the board, for each turn asked for; the other turns stay empty.
    fn turned(
        &self,
        cells: &[Cell],
        turns: Range<usize>,
        value: impl Fn(&Cell, usize) -> f32,
    ) -> [Vec<f32>; 8] {
        let n2 = self.size * self.size;
        let mut straight = Vec::with_capacity(cells.len() * n2);
        for cell in cells {
            straight.extend((0..n2).map(|k| value(cell, k)));
        }
        array::from_fn(|turn| {
            if !turns.contains(&turn) {
                return Vec::new();
            }
            let order = sample_order(self.size, TURNS[turn]);
            let mut turned = Vec::with_capacity(straight.len());
            for cell in straight.chunks_exact(n2) {
                for &k in &order {
                    turned.push(cell[k]);
                }
            }
            turned
        })
    }

    /// The placement whose markers the soft bits agree with, and their correlation.
    fn best_by_bits(
        &self,
        lattice: &Lattice,
        cells: &[Cell],
        turns: Range<usize>,
        least_inside: f64,
    ) -> Result<(Identified, f64), NotIdentified> {
        if cells.is_empty() {
            return Err(NotIdentified::NoMarkers);
        }
        let (size, n2) = (self.size, self.size * self.size);
        // The border is the same for all markers: it sets the scale and has no vote.
        let inner = 1..size - 1;
        let is_bit: Vec<bool> =
            (0..n2).map(|k| inner.contains(&(k / size)) && inner.contains(&(k % size))).collect();
        let values = self.turned(cells, turns.clone(), |cell, k| {
            if !is_bit[k] {
                return 0.0;
            }
            let (middle, half) = ((cell.rim + cell.border) / 2.0, (cell.rim - cell.border) / 2.0);
            ((cell.samples[k] - middle) / half).clamp(-1.5, 1.5)
        });
        let mut candidates = self.placements(lattice, cells, turns, least_inside);
        for candidate in &mut candidates {
            let mut score = 0.0_f32;
            let squares = self.squares(&candidate.place);
            for (cell, bits) in cells.iter().zip(values[candidate.turn].chunks_exact(n2)) {
                if let Some(id) = squares.marker(cell) {
                    score += dot(bits, &self.codes[id * n2..][..n2]);
                }
            }
            candidate.score = f64::from(score);
        }
        // A view of the board's inside can be the same in both layouts, one column apart: then the word of whoever
        // printed the board decides, and without it nobody can.
        if let Some(stated) = self.board.layout {
            let top = |of_stated: bool| {
                let scores = candidates.iter().filter(|c| (c.place.layout == stated) == of_stated);
                scores.map(|c| c.score).fold(f64::NEG_INFINITY, f64::max)
            };
            if top(true) >= SAME_SCORE * top(false) {
                candidates.retain(|c| c.place.layout == stated);
            }
        }
        let (best, second) = best_two(&candidates).ok_or(NotIdentified::Ambiguous)?;
        let n_bits = (best.place.n_markers * (size - 2) * (size - 2)) as f64;
        let energy = values[0].iter().map(|v| f64::from(v * v)).sum::<f64>()
            / (cells.len() * (size - 2) * (size - 2)) as f64;
        let gain = best.score / n_bits.max(1.0);
        // The floor keeps a perfect picture from claiming certainty beyond its few bits.
        let variance = (energy - gain * gain).max(0.1);
        let correlation = gain / energy.sqrt().max(1e-6);
        let significance = correlation * (n_bits / BITS_PER_VOTE).sqrt();
        let margin = gain / variance * (best.score - second.max(0.0)) / BITS_PER_VOTE;
        let placement = Placement { margin, significance, ..best.place };
        Ok((self.accept(placement, cells)?, correlation))
    }

    /// The placement that, under a blur of its own, leaves the least of the picture unexplained.
    fn best_by_blur(
        &self,
        lattice: &Lattice,
        cells: &[Cell],
        turns: Range<usize>,
    ) -> Result<Identified, NotIdentified> {
        if cells.len() < 4 {
            return Err(NotIdentified::Ambiguous); // Too few samples for a kernel.
        }
        // The work grows with placements times cells: a sample of the cells does, and a small part of a huge board is
        // left alone.
        let step = cells.len().div_ceil(MOST_CELLS);
        let cells: Vec<Cell> = cells.iter().step_by(step).cloned().collect();
        let candidates = self.placements(lattice, &cells, turns.clone(), BLURRED_INSIDE);
        if candidates.len() * cells.len() > MOST_TRIALS {
            return Err(NotIdentified::Ambiguous);
        }
        let half = lattice.contrast as f32 / 2.0;
        let values =
            self.turned(&cells, turns, |cell, k| (cell.samples[k] - cell.rim) / half + 1.0);
        let entrants: Vec<Entrant> = candidates
            .iter()
            .map(|candidate| {
                let squares = self.squares(&candidate.place);
                let markers = cells.iter().map(|cell| squares.marker(cell)).collect();
                Entrant::new(candidate.turn, markers)
            })
            .collect();
        let model = self.blur.get_or_init(|| BlurModel::new(self.size, &self.codes));
        let won = Contest::new(model, &values, cells.len(), &entrants)
            .winner()
            .ok_or(NotIdentified::Ambiguous)?;
        let Won { index, margin, significance } = won;
        self.accept(Placement { margin, significance, ..candidates[index].place }, &cells)
    }

    /// The placement with its markers, if its lead is clear.
    fn accept(&self, placement: Placement, cells: &[Cell]) -> Result<Identified, NotIdentified> {
        if placement.n_markers >= 2
            && placement.margin > MIN_MARGIN
            && placement.significance > MIN_SIGNIFICANCE
        {
            let squares = self.squares(&placement);
            let mut markers: Vec<usize> =
                cells.iter().filter_map(|cell| squares.marker(cell)).collect();
            markers.sort_unstable();
            Ok(Identified { placement, markers })
        } else {
            Err(NotIdentified::Ambiguous)
        }
    }
}

/// What a placement expects where.
struct Squares<'a> {
    /// Row by row.
    markers: &'a [Option<usize>],
    turn: [[i32; 2]; 2],
    shift: [i32; 2],
    size: [usize; 2],
}

impl Squares<'_> {
    /// The square under a cell: `None` beyond the board, `Some(None)` where it shows no marker.
    #[inline]
    fn at(&self, cell: &Cell) -> Option<Option<usize>> {
        let place = |a: usize| {
            let [i, j] = self.turn[a];
            // What is negative becomes larger than any board.
            (i * cell.i + j * cell.j + self.shift[a]) as u32 as usize
        };
        let (column, row) = (place(0), place(1));
        (column < self.size[0] && row < self.size[1])
            .then(|| self.markers[row * self.size[0] + column])
    }

    /// The marker expected in a cell, if any.
    #[inline]
    fn marker(&self, cell: &Cell) -> Option<usize> {
        self.at(cell).flatten()
    }
}

/// The best candidate and the score of the runner-up.
fn best_two(candidates: &[Candidate]) -> Option<(Candidate, f64)> {
    let mut best: Option<&Candidate> = None;
    let mut second = f64::NEG_INFINITY;
    for candidate in candidates {
        match best {
            Some(b) if candidate.score <= b.score => second = second.max(candidate.score),
            _ => {
                second = best.map_or(second, |b| second.max(b.score));
                best = Some(candidate);
            }
        }
    }
    best.map(|b| (*b, second))
}
