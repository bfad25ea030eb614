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

use super::simd::{dot, vectorized};

/// Reach of the blur's kernel, bits to each side.
const REACH: i32 = 3;
/// Unknowns of the blur: its kernel and a constant.
const TAPS: usize = 50;
/// The same, filled up to whole vectors.
const PADDED: usize = 56;
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
        let Some(root) = root(&self.normal, self.n_samples) else { return f64::NEG_INFINITY };
        let explained = explained(&root, &self.right);
        let residual = (self.energy - explained).max(1e-6 * self.energy);
        -(residual / self.n_samples).ln()
    }
}

/// Lower triangular L with L Lᵀ = N, with a ridge for so many samples; `None` where N is not positive.
fn root(normal: &Normal, n_samples: f64) -> Option<Box<[f64; TRIANGLE]>> {
    vectorized(
        #[inline(always)]
        || decompose(normal, n_samples),
    )
}

#[inline(always)]
fn decompose(normal: &Normal, n_samples: f64) -> Option<Box<[f64; TRIANGLE]>> {
    let mut root = Box::new(normal.map(f64::from));
    let start = |row: usize| row * (row + 1) / 2;
    for i in 0..TAPS {
        let (above, here) = root.split_at_mut(start(i));
        for j in 0..i {
            let sum = dot(&here[..j], &above[start(j)..][..j]);
            here[j] = (here[j] - sum) / above[start(j) + j];
        }
        let pivot = here[i] + 1e-3 * n_samples - dot(&here[..i], &here[..i]);
        if !(pivot > 0.0) {
            return None;
        }
        here[i] = pivot.sqrt();
    }
    Some(root)
}

/// The energy bᵀ N⁻¹ b = |y|² that the fit explains, L y = b.
fn explained(root: &[f64; TRIANGLE], right: &[f64; TAPS]) -> f64 {
    let mut y = [0.0; TAPS];
    for i in 0..TAPS {
        let row = &root[i * (i + 1) / 2..][..=i];
        let sum = dot(&row[..i], &y[..i]);
        y[i] = (right[i] - sum) / row[i];
    }
    y.iter().map(|v| v * v).sum()
}

fn padded(taps: &[f32; TAPS]) -> [f32; PADDED] {
    std::array::from_fn(|k| taps.get(k).copied().unwrap_or(0.0))
}

/// Adds the outer product of the taps with themselves.
#[inline(always)]
fn add_products(normal: &mut Normal, taps: &[f32; TAPS]) {
    let mut rest = &mut normal[..];
    for i in 0..TAPS {
        let (row, after) = rest.split_at_mut(i + 1);
        for (entry, tap) in row.iter_mut().zip(&taps[..=i]) {
            *entry += taps[i] * tap;
        }
        rest = after;
    }
}

/// The expected markers, and last the mean of all, shifted by every tap of the kernel.
#[derive(Clone, Debug)]
pub(super) struct BlurModel {
    /// For each marker, sample and tap: the expected value.
    shifted: Vec<[f32; PADDED]>,
    /// For each marker the normal matrix of its samples.
    normals: Vec<Normal>,
    /// Root of the mean of the markers' normal matrices.
    mean_root: Box<[f64; TRIANGLE]>,
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
        let (size, n_used) = (size as i32, codes.len() / n2);
        let mut shifted = Vec::with_capacity((n_used + 1) * n2);
        let mut normals = Vec::with_capacity(n_used + 1);
        for id in 0..n_used {
            let mut normal = [0.0; TRIANGLE];
            for row in 0..size {
                for column in 0..size {
                    let mut taps = [1.0_f32; TAPS];
                    let offsets =
                        (-REACH..=REACH).flat_map(|dy| (-REACH..=REACH).map(move |dx| (dx, dy)));
                    for (tap, (dx, dy)) in taps.iter_mut().zip(offsets) {
                        let (r, c) = (row + dy, column + dx);
                        // Round the marker lies the white rim of its square.
                        *tap = if (0..size).contains(&r) && (0..size).contains(&c) {
                            codes[id * n2 + (r * size + c) as usize]
                        } else {
                            1.0
                        };
                    }
                    add_products(&mut normal, &taps);
                    shifted.push(padded(&taps));
                }
            }
            normals.push(normal);
        }
        // The mean marker.
        let mut normal = [0.0; TRIANGLE];
        for sample in 0..n2 {
            let mut mean = [0.0_f32; TAPS];
            for id in 0..n_used {
                let row: &[f32; PADDED] = &shifted[id * n2 + sample];
                for (m, t) in mean.iter_mut().zip(row) {
                    *m += t / n_used as f32;
                }
            }
            add_products(&mut normal, &mean);
            shifted.push(padded(&mean));
        }
        let mut sum = [0.0; TRIANGLE];
        for normal in &normals {
            for (sum, part) in sum.iter_mut().zip(normal) {
                *sum += part / n_used as f32;
            }
        }
        normals.push(normal);
        let mean_root = root(&sum, n2 as f64).expect("a sum of squares and a ridge");
        Self { shifted, normals, mean_root, n2 }
    }

    /// Energy explained per marker, were every marker's normal matrix the mean of all, times the number of markers.
    fn explained_by_mean(&self, right: &[f64; TAPS]) -> f64 {
        explained(&self.mean_root, right)
    }

    /// Σ over the samples of value · expected, for each tap.
    fn correlate(&self, id: usize, samples: &[f32]) -> [f32; TAPS] {
        let rows = &self.shifted[id * self.n2..][..self.n2];
        let sums = vectorized(
            #[inline(always)]
            || {
                let mut sums = [0.0_f32; PADDED];
                for (v, row) in samples.iter().zip(rows) {
                    for k in 0..PADDED {
                        sums[k] += v * row[k];
                    }
                }
                sums
            },
        );
        std::array::from_fn(|tap| sums[tap])
    }
}
