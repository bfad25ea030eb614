//! Reading markers under an unknown blur.
//!
//! Where motion smears the bits over their neighbours, the picture is explained as the expected pattern under an
//! *unknown* blur: one kernel of 7 × 7 bits, the same for all cells, fitted by least squares for each placement in
//! question. The placement that leaves the least residual wins by
//!
//! ```text
//! log p(v | A) − log p(v | B) = N/2·(ln RSS_B − ln RSS_A),
//! ```
//!
//! N being the number of independent samples. It is blind deconvolution with a finite list of candidate images.

use std::collections::BTreeMap;

use crate::math;
use crate::par::vectorized;

/// Reach of the blur's kernel, bits to each side.
const REACH: i32 = 3;
/// Unknowns of the blur: its kernel and a constant.
const TAPS: usize = 50;
/// Cells that a blurred reading takes in at most: as many as a mask has bits.
pub(super) const MOST_CELLS: usize = 64;
/// Pairs of a placement and a cell at most: about a tenth of a second.
pub(super) const MOST_TRIALS: usize = 60_000;
/// Placements looked at closely.
const SHORT_LIST: usize = 32;
/// Placements are compared where they expect a marker in this part of the cells at least. Fewer would leave too much
/// of what looks like a marker beyond the board.
const MIN_SHARE: f64 = 2.0 / 3.0;
/// Blurred samples are far from independent: this many count as one.
const SAMPLES_PER_VOTE: f64 = 4.0;

/// Least ln(RSS of the runner-up / RSS of the best): chance and model errors stay below 0.05, blurred boards that a
/// person can read lie above 0.2.
const MIN_LEAD: f64 = 0.12;

/// A placement in the contest: which marker it expects in each cell, none where the cell lies beyond the board.
pub(super) struct Entrant {
    turn: usize,
    markers: Vec<Option<usize>>,
    /// Bit c: a marker is expected in cell c.
    mask: u64,
}

impl Entrant {
    /// At most [`MOST_CELLS`] cells.
    pub(super) fn new(turn: usize, markers: Vec<Option<usize>>) -> Self {
        let mask = markers.iter().rev().fold(0, |mask, m| mask << 1 | u64::from(m.is_some()));
        Self { turn, markers, mask }
    }
}

/// Who won, and by how much.
pub(super) struct Won {
    pub(super) index: usize,
    /// Lead over the nearest rival, nats.
    pub(super) margin: f64,
    /// What the markers explain beyond what all markers have in common, in units of its spread under chance.
    pub(super) significance: f64,
}

/// All placements against each other, two at a time, each pair over the cells in which both expect a marker: residuals
/// are comparable only over the same cells, and a placement must not win because the true one leaves a cell that is
/// none beyond the board.
pub(super) struct Contest<'a> {
    model: &'a BlurModel,
    /// For each turn the samples of all cells.
    values: &'a [Vec<f32>; 8],
    n_cells: usize,
    entrants: &'a [Entrant],
    /// Every pair of a cell and a marker is met by many placements: correlated once.
    parts: Vec<[f32; TAPS]>,
    /// Where in `parts` a turn, cell and marker are, plus one.
    places: Vec<u32>,
    /// Σ of the squared samples of each cell.
    energies: Vec<f64>,
    /// Scores by entrant and mask.
    scores: BTreeMap<(usize, u64), f64>,
}

impl<'a> Contest<'a> {
    pub(super) fn new(
        model: &'a BlurModel,
        values: &'a [Vec<f32>; 8],
        n_cells: usize,
        entrants: &'a [Entrant],
    ) -> Self {
        let places = vec![0; values.len() * n_cells * model.normals.len()];
        let energy = |samples: &[f32]| samples.iter().map(|v| f64::from(v * v)).sum();
        // The same in all turns; the first is always there.
        let energies = values[0].chunks_exact(model.n2).map(energy).collect();
        let (parts, scores) = (Vec::new(), BTreeMap::new());
        Self { model, values, n_cells, entrants, parts, places, energies, scores }
    }

    /// The placement that no other beats, if its lead is clear.
    pub(super) fn winner(mut self) -> Option<Won> {
        let most = self.entrants.iter().map(|e| e.mask.count_ones()).max()?;
        let least = (MIN_SHARE * f64::from(most)).ceil() as u32;
        let list = self.short_list(least);
        let mut champion = *list.first()?;
        for &rival in &list {
            if self.lead(champion, rival, least).is_some_and(|(lead, _)| lead < 0.0) {
                champion = rival;
            }
        }
        let (mut lead, mut margin) = (f64::INFINITY, f64::INFINITY);
        for &rival in &list {
            if let Some((over, n_shared)) = self.lead(champion, rival, least) {
                lead = lead.min(over);
                margin = margin.min(votes(n_shared, self.model.n2) * over);
            }
        }
        // What all markers have in common explains much of any of them. The best must beat that, too.
        let mask = self.entrants[champion].mask;
        let over = self.score(champion, mask) - self.common(champion);
        let all = votes(mask.count_ones(), self.model.n2);
        (lead.min(over) >= MIN_LEAD).then(|| Won {
            index: champion,
            margin: margin.min(all * over),
            significance: (2.0 * all * over).sqrt(),
        })
    }

    /// The [`SHORT_LIST`] most promising placements, best first, by a score that takes every marker's normal matrix
    /// for the mean of all: one decomposition serves all placements.
    fn short_list(&mut self, least: u32) -> Vec<usize> {
        let mut ranked: Vec<(f64, usize)> = Vec::new();
        for index in 0..self.entrants.len() {
            let mask = self.entrants[index].mask;
            if mask.count_ones() >= least {
                let (right, energy) = self.sums(index, mask);
                let n_markers = f64::from(mask.count_ones());
                let explained = self.model.explained_by_mean(&right) / n_markers;
                let residual = (energy - explained).max(1e-6 * energy);
                ranked.push((residual / n_markers, index));
            }
        }
        ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        ranked.truncate(SHORT_LIST);
        ranked.into_iter().map(|(_, index)| index).collect()
    }

    /// Lead of one placement over another, and over how many cells; `None` where they share too few.
    fn lead(&mut self, index: usize, rival: usize, least: u32) -> Option<(f64, u32)> {
        let mask = self.entrants[index].mask & self.entrants[rival].mask;
        let n_shared = mask.count_ones();
        (index != rival && n_shared >= least)
            .then(|| (self.score(index, mask) - self.score(rival, mask), n_shared))
    }

    /// −ln of the mean squared residual of a placement over the cells of a mask.
    fn score(&mut self, index: usize, mask: u64) -> f64 {
        if let Some(score) = self.scores.get(&(index, mask)) {
            return *score;
        }
        let (right, energy) = self.sums(index, mask);
        let Entrant { markers, .. } = &self.entrants[index];
        let mut fit = BlurFit::new(right, energy, mask.count_ones() as usize * self.model.n2);
        for (_, id) in in_mask(markers, mask) {
            fit.add(&self.model.normals[id]);
        }
        let score = fit.score();
        self.scores.insert((index, mask), score);
        score
    }

    /// Right-hand side of a placement's normal equations over the cells of a mask, and the energy of the samples.
    fn sums(&mut self, index: usize, mask: u64) -> ([f64; TAPS], f64) {
        let Entrant { turn, markers, .. } = &self.entrants[index];
        let n2 = self.model.n2;
        let (mut right, mut energy) = ([0.0; TAPS], 0.0);
        for (cell, id) in in_mask(markers, mask) {
            let samples = &self.values[*turn][cell * n2..][..n2];
            let key = (turn * self.n_cells + cell) * self.model.normals.len() + id;
            if self.places[key] == 0 {
                self.parts.push(self.model.correlate(id, samples));
                self.places[key] = self.parts.len() as u32;
            }
            let part = &self.parts[self.places[key] as usize - 1];
            for k in 0..TAPS {
                right[k] += f64::from(part[k]);
            }
            energy += self.energies[cell];
        }
        (right, energy)
    }

    /// As [`score`](Self::score) over all of a placement's cells, with the mean of all markers in each.
    fn common(&self, index: usize) -> f64 {
        let Entrant { turn, mask, .. } = self.entrants[index];
        let (n2, mean) = (self.model.n2, self.model.normals.len() - 1);
        let mut fit = BlurFit::new([0.0; TAPS], 0.0, mask.count_ones() as usize * n2);
        for cell in (0..self.n_cells).filter(|cell| mask >> cell & 1 == 1) {
            let part = self.model.correlate(mean, &self.values[turn][cell * n2..][..n2]);
            for (sum, part) in fit.right.iter_mut().zip(part) {
                *sum += f64::from(part);
            }
            fit.energy += self.energies[cell];
            fit.add(&self.model.normals[mean]);
        }
        fit.score()
    }
}

/// Cells of a mask with the markers expected there.
fn in_mask(markers: &[Option<usize>], mask: u64) -> impl Iterator<Item = (usize, usize)> {
    let expected = markers.iter().enumerate().filter_map(|(cell, id)| Some((cell, (*id)?)));
    expected.filter(move |(cell, _)| mask >> cell & 1 == 1)
}

/// Independent votes, halved, of so many markers.
fn votes(n_markers: u32, n2: usize) -> f64 {
    f64::from(n_markers) * n2 as f64 / (2.0 * SAMPLES_PER_VOTE)
}

/// Entries of the lower triangle of a normal matrix, row by row.
const TRIANGLE: usize = TAPS * (TAPS + 1) / 2;

/// A normal matrix of markers: its entries are sums of products of ±1, exact in 32 bits.
type Normal = [f32; TRIANGLE];

/// The kernel that explains all samples added.
struct BlurFit {
    normal: Box<Normal>,
    right: [f64; TAPS],
    energy: f64,
    n_samples: f64,
}

impl BlurFit {
    fn new(right: [f64; TAPS], energy: f64, n_samples: usize) -> Self {
        Self { normal: Box::new([0.0; TRIANGLE]), right, energy, n_samples: n_samples as f64 }
    }

    /// Adds the normal matrix of one marker.
    fn add(&mut self, normal: &Normal) {
        for (sum, part) in self.normal.iter_mut().zip(normal) {
            *sum += part;
        }
    }

    /// −ln of the mean squared residual.
    fn score(self) -> f64 {
        let Some(explained) = Elimination::new(&self.normal, self.n_samples).explained(&self.right)
        else {
            return f64::NEG_INFINITY;
        };
        let residual = (self.energy - explained).max(1e-6 * self.energy);
        -math::ln(residual / self.n_samples)
    }
}

/// Numbers in a row of an [`Elimination`]: a whole number of vectors.
const STRIDE: usize = 56;
/// A normal matrix on the way to U with Uᵀ D⁻¹ U = N, D being the diagonal of U: Gauss' elimination, rows on and right
/// of the diagonal. What lies left of it is of no meaning. The right-hand side may ride along in the last column.
#[derive(Clone, Debug)]
struct Elimination {
    rows: Box<[Row; TAPS]>,
}

/// A row of an [`Elimination`], where vectors do not straddle lines of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Row([f64; STRIDE]);

impl Elimination {
    /// N with a ridge for so many samples.
    fn new(normal: &Normal, n_samples: f64) -> Self {
        let mut rows = Box::new([Row([0.0; STRIDE]); TAPS]);
        let mut rest = &normal[..];
        for i in 0..TAPS {
            let (row, after) = rest.split_at(i + 1);
            for (j, entry) in row.iter().enumerate() {
                rows[j].0[i] = f64::from(*entry);
            }
            rows[i].0[i] += 1e-3 * n_samples;
            rest = after;
        }
        Self { rows }
    }

    /// The energy bᵀ N⁻¹ b that the fit explains; `None` where N is not positive.
    fn explained(mut self, right: &[f64; TAPS]) -> Option<f64> {
        for (row, b) in self.rows.iter_mut().zip(right) {
            row.0[TAPS] = *b;
        }
        self.eliminate()?;
        Some(self.rows.iter().enumerate().map(|(k, Row(row))| row[TAPS] * row[TAPS] / row[k]).sum())
    }

    /// Makes this U; `None` where N is not positive.
    fn eliminate(&mut self) -> Option<()> {
        vectorized(
            #[inline(always)]
            || self.eliminate_pairs(),
        )
    }

    /// Two rows at a time: what lies below is loaded and stored half as often.
    #[inline(always)]
    fn eliminate_pairs(&mut self) -> Option<()> {
        const { assert!(TAPS.is_multiple_of(2)) };
        for k in (0..TAPS).step_by(2) {
            let (above, below) = self.rows.split_at_mut(k + 2);
            let [.., Row(first), Row(second)] = above else { return None };
            let pivot = first[k];
            if !(pivot > 0.0) {
                return None;
            }
            let part = first[k + 1] / pivot;
            for (to, from) in second.iter_mut().zip(&*first) {
                *to -= part * from;
            }
            let second_pivot = second[k + 1];
            if !(second_pivot > 0.0) {
                return None;
            }
            let (over, second_over) = (1.0 / pivot, 1.0 / second_pivot);
            for (i, Row(row)) in (k + 2..).zip(below) {
                let (a, b) = (first[i] * over, second[i] * second_over);
                // Whole rows: their length is known when this is compiled.
                for j in 0..STRIDE {
                    row[j] -= a * first[j] + b * second[j];
                }
            }
        }
        Some(())
    }

    /// The energy bᵀ N⁻¹ b, where this is U already.
    #[inline(always)]
    fn energy(&self, right: &[f64; TAPS]) -> f64 {
        let mut rest = [0.0; STRIDE];
        rest[..TAPS].copy_from_slice(right);
        let mut energy = 0.0;
        for (k, Row(row)) in self.rows.iter().enumerate() {
            let part = rest[k] / row[k];
            energy += part * rest[k];
            for j in 0..STRIDE {
                rest[j] -= part * row[j];
            }
        }
        energy
    }
}

/// Numbers in a row of a normal matrix in the making: a whole number of vectors.
const SQUARE: usize = 64;

/// Adds the outer product of the taps with themselves.
#[inline(always)]
fn add_products(square: &mut [[f32; SQUARE]; TAPS], taps: &[f32; TAPS]) {
    let mut padded = [0.0; SQUARE];
    padded[..TAPS].copy_from_slice(taps);
    for (row, tap) in square.iter_mut().zip(taps) {
        for k in 0..SQUARE {
            row[k] += tap * padded[k];
        }
    }
}

/// The lower triangle of a square.
fn triangle(square: &[[f32; SQUARE]; TAPS]) -> Normal {
    let mut triangle = [0.0; TRIANGLE];
    let mut rest = &mut triangle[..];
    for (i, from) in square.iter().enumerate() {
        let (row, after) = rest.split_at_mut(i + 1);
        row.copy_from_slice(&from[..=i]);
        rest = after;
    }
    triangle
}

/// Columns of a kernel and the constant: a row of taps is one vector.
const TAP_COLUMNS: usize = 2 * REACH as usize + 2;
/// Taps of a kernel with a constant beside every row.
const PADDED: usize = TAP_COLUMNS * (2 * REACH as usize + 1);

/// The expected markers, and last the mean of all, ready for a kernel.
#[derive(Clone, Debug)]
pub(super) struct BlurModel {
    /// For each marker, column and row what a row of the kernel's taps meets there, and 1 for the constant; rows begin
    /// [`REACH`] above the marker. What the whole kernel meets at a sample lies in one piece.
    patterns: Vec<f32>,
    /// For each marker the normal matrix of its samples.
    normals: Vec<Normal>,
    /// Of the mean of the markers' normal matrices.
    mean: Elimination,
    size: usize,
    n2: usize,
}

impl BlurModel {
    /// From ±1 for every sample of every marker, row by row, `size` along one side.
    pub(super) fn new(size: usize, codes: &[f32]) -> Self {
        vectorized(
            #[inline(always)]
            || Self::build(size, codes),
        )
    }

    #[inline(always)]
    fn build(size: usize, codes: &[f32]) -> Self {
        let n2 = size * size;
        let n_used = codes.len() / n2;
        let rows = size + 2 * REACH as usize;
        let length = size * rows * TAP_COLUMNS;
        let mut patterns = Vec::with_capacity((n_used + 1) * length);
        for id in 0..n_used {
            for column in 0..size {
                for row in 0..rows {
                    // Round the marker lies the white rim of its square.
                    let mut taps = [1.0; TAP_COLUMNS];
                    for (k, tap) in taps[..TAP_COLUMNS - 1].iter_mut().enumerate() {
                        // What is negative becomes larger than any marker.
                        let reach = REACH as usize;
                        let (r, c) = (row.wrapping_sub(reach), (column + k).wrapping_sub(reach));
                        if r < size && c < size {
                            *tap = codes[id * n2 + r * size + c];
                        }
                    }
                    patterns.extend(taps);
                }
            }
        }
        // The mean marker.
        for place in 0..length {
            let sum: f32 = (0..n_used).map(|id| patterns[id * length + place]).sum();
            patterns.push(sum / n_used as f32);
        }
        // A loop, not a closure: that would be compiled for any processor.
        let mut normals: Vec<Normal> = Vec::with_capacity(n_used + 1);
        let mut square = Box::new([[0.0; SQUARE]; TAPS]);
        for id in 0..=n_used {
            square.as_flattened_mut().fill(0.0);
            for column in 0..size {
                for row in 0..size {
                    let at = ((id * size + column) * rows + row) * TAP_COLUMNS;
                    let met = patterns[at..].first_chunk().expect("rows enough");
                    add_products(&mut square, &kernel(met));
                }
            }
            normals.push(triangle(&square));
        }
        let mut sum = [0.0; TRIANGLE];
        for normal in &normals[..n_used] {
            for (sum, part) in sum.iter_mut().zip(normal) {
                *sum += part / n_used as f32;
            }
        }
        let mut mean = Elimination::new(&sum, n2 as f64);
        mean.eliminate().expect("a sum of squares and a ridge");
        Self { patterns, normals, mean, size, n2 }
    }

    /// Energy explained per marker, were every marker's normal matrix the mean of all, times the number of markers.
    fn explained_by_mean(&self, right: &[f64; TAPS]) -> f64 {
        vectorized(
            #[inline(always)]
            || self.mean.energy(right),
        )
    }

    /// Σ over the samples of value · expected, for each tap.
    fn correlate(&self, id: usize, samples: &[f32]) -> [f32; TAPS] {
        vectorized(
            #[inline(always)]
            || self.correlate_rows(id, samples),
        )
    }

    #[inline(always)]
    fn correlate_rows(&self, id: usize, samples: &[f32]) -> [f32; TAPS] {
        let column_length = (self.size + 2 * REACH as usize) * TAP_COLUMNS;
        let pattern = &self.patterns[id * self.size * column_length..];
        let mut sums = [0.0_f32; PADDED];
        for (column, pattern) in pattern.chunks_exact(column_length).take(self.size).enumerate() {
            for row in 0..self.size {
                let value = samples[row * self.size + column];
                let met: &[f32; PADDED] =
                    pattern[row * TAP_COLUMNS..].first_chunk().expect("rows enough");
                for k in 0..PADDED {
                    sums[k] += value * met[k];
                }
            }
        }
        kernel(&sums)
    }
}

/// The taps of a kernel, row by row, and last the constant, from rows that have the constant each.
#[inline(always)]
fn kernel(padded: &[f32; PADDED]) -> [f32; TAPS] {
    let mut taps = [padded[TAP_COLUMNS - 1]; TAPS];
    let rows = padded.as_chunks::<TAP_COLUMNS>().0;
    for (taps, row) in taps.chunks_exact_mut(TAP_COLUMNS - 1).zip(rows) {
        taps.copy_from_slice(&row[..TAP_COLUMNS - 1]);
    }
    taps
}
