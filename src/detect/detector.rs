//! The whole way from an image to an observation.

use std::sync::{Mutex, PoisonError};

use crate::{board::CharucoBoard, geom::Pixel, image::Gray};

use super::{
    Corner, Identity, Observation, Reason, Reject,
    identify::{Expected, Identified, NotIdentified},
    lattice::{Lattice, Node, lattices},
    map::{SmoothMap, length},
    pyramid::Level,
    refine::{Guess, Scales, refine},
    saddle::{self, saddles},
    window::Window,
};

/// Finds a board in images.
///
/// What is found depends on the image alone: a detector keeps nothing between images but memory, and one can be shared
/// between threads.
#[derive(Debug)]
pub struct Detector {
    board: CharucoBoard,
    expected: Expected,
    /// Memory for as many images as were looked at at one time. Fresh memory for every image would cost more than
    /// smoothing it.
    pool: Mutex<Vec<Memory>>,
}

impl Clone for Detector {
    fn clone(&self) -> Self {
        Self::new(&self.board)
    }
}

/// What one image needs, kept for the next.
#[derive(Debug, Default)]
struct Memory {
    level: Level,
    search: saddle::Memory,
    window: Window,
}

/// Saddles kept at most, for every million pixels of a level and at least: boards have at most a few hundred corners,
/// the rest is texture.
const MOST_SADDLES_PER_MPX: f64 = 12_000.0;
const LEAST_MOST_SADDLES: usize = 600;
/// Nodes that make a lattice worth reading: two cells.
const MIN_NODES: usize = 6;
/// Lattices tried on one level, largest first.
const MOST_LATTICES: usize = 4;
/// The shorter side of the coarsest level tried, pixels.
const COARSEST: usize = 60;
/// Rounds of looking for corners that the last round brought into reach.
const MOST_PASSES: usize = 8;
/// This many corners foretell others up to two squares away, fewer only their neighbours: farther off, the map may be
/// off by a square, and a corner found there would have a wrong number.
const MANY_CORNERS: usize = 30;
/// A node farther than this from where the map expects it is no start for its corner, pixels.
const MAX_START_PX: f64 = 1.0;
/// A corner whose σ exceeds this is of no use, pixels.
const MAX_SIGMA_PX: f64 = 0.7;

impl Detector {
    /// A detector for this board. Its layout is found from the image, whatever the board says; where both are the same
    /// (an odd number of rows), the board's own is reported, or else the new one.
    pub fn new(board: &CharucoBoard) -> Self {
        Self { board: board.clone(), expected: Expected::new(board), pool: Mutex::new(Vec::new()) }
    }

    /// The board that is sought.
    pub fn board(&self) -> &CharucoBoard {
        &self.board
    }

    /// The board's corners in `image`. May miss, does not invent.
    pub fn detect(&self, image: &Gray) -> Observation {
        // A poisoned lock only means that another thread panicked; the memory has no state to be wrong.
        let mut memory =
            self.pool.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
        let observation = self.detect_in(image, &mut memory);
        self.pool.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
        observation
    }

    /// Nodes that make a lattice worth reading: boards of 3 × 3 squares have four.
    pub(super) fn min_nodes(&self) -> usize {
        MIN_NODES.min(self.board.n_corners()).max(4)
    }

    fn detect_in(&self, image: &Gray, memory: &mut Memory) -> Observation {
        let mut rejects = Vec::new();
        let Memory { level, search, window } = memory;
        let mut scales = Scales::new(image, window);
        for factor in factors(image) {
            if level.fill(image, factor).is_some()
                && let Some(found) = self.search(&mut scales, level, search, &mut rejects)
            {
                return self.collect(&mut scales, &found, rejects);
            }
        }
        Observation { corners: Vec::new(), identity: None, rejects }
    }

    /// Identifies the best lattice of one level.
    fn search(
        &self,
        scales: &mut Scales<'_>,
        level: &Level,
        memory: &mut saddle::Memory,
        rejects: &mut Vec<Reject>,
    ) -> Option<Found> {
        let saddles = saddles(level, most_saddles(level), memory);
        let mut identified: Option<Found> = None;
        for mut lattice in
            lattices(level, &saddles, self.min_nodes()).into_iter().take(MOST_LATTICES)
        {
            if identified.is_some() {
                rejects.push(Reject { pixel: lattice.middle(), reason: Reason::SecondLattice });
                continue;
            }
            let Some(map) = lattice.prune() else { continue };
            let placement = self.expected.by_bits(scales.image(), &lattice, &map).or_else(|_| {
                let contrast = lattice.contrast;
                // A larger lattice has more votes: look where its neighbours should be.
                lattice.extend(self.board.n_corners(), |map, i, j| {
                    self.node(scales, map, i, j, contrast)
                });
                let map = lattice.map().ok_or(NotIdentified::Ambiguous)?;
                self.expected.by_effort(scales.image(), &lattice, &map)
            });
            match placement {
                Ok(identity) => identified = Some(Found { lattice, identity }),
                Err(why) => {
                    let reason = match why {
                        NotIdentified::NoMarkers => Reason::NoMarkers,
                        NotIdentified::Ambiguous => Reason::Ambiguous,
                    };
                    rejects.push(Reject { pixel: lattice.middle(), reason });
                }
            }
        }
        identified
    }

    /// The corner that the map expects at (i, j), if the image shows one.
    fn node(
        &self,
        scales: &mut Scales<'_>,
        map: &SmoothMap,
        i: i32,
        j: i32,
        contrast: f64,
    ) -> Option<(Pixel, f64)> {
        let (x, y) = (f64::from(i), f64::from(j));
        let (predicted, axes) = (map.at(x, y)?, map.axes(x, y)?);
        if !inside(scales.image(), predicted) {
            return None;
        }
        self.corner(scales, predicted, axes, contrast).ok()
    }

    /// Refines every corner that the identified board shows.
    fn collect(
        &self,
        scales: &mut Scales<'_>,
        found: &Found,
        mut rejects: Vec<Reject>,
    ) -> Observation {
        let board = &self.board;
        let (columns, rows) = (board.squares_x as i32 - 1, board.squares_y as i32 - 1);
        let Identified { placement, markers } = &found.identity;
        let mut known: Vec<([f64; 2], Pixel)> = Vec::new();
        // A node of the lattice is where its corner is, to a fraction of a pixel: a better start than the map.
        let mut starts: Vec<Option<Node>> = vec![None; board.n_corners()];
        for node in &found.lattice.nodes {
            let [x, y] = placement.corner(node.i, node.j);
            if (0..columns).contains(&x) && (0..rows).contains(&y) {
                known.push(([f64::from(x), f64::from(y)], node.pixel));
                starts[(y * columns + x) as usize] = Some(*node);
            } else {
                rejects.push(Reject { pixel: node.pixel, reason: Reason::OffBoard });
            }
        }
        let contrast = found.lattice.contrast;
        // First what the lattice foretells; what that finds brings corners into reach that were too far from it.
        let mut corners: Vec<Corner> = Vec::new();
        let mut failed: Vec<Reject> = Vec::new();
        for _ in 0..MOST_PASSES {
            let Some(map) = SmoothMap::fit(&known) else { break };
            let n_before = corners.len();
            failed.clear();
            let foretold = self.foretold(&known);
            for id in 0..board.n_corners() {
                if !foretold[id] || corners[..n_before].binary_search_by_key(&id, |c| c.id).is_ok()
                {
                    continue;
                }
                let (x, y) = board.corner_cell(id);
                let (x, y) = (x as f64, y as f64);
                let (Some(predicted), Some(axes)) = (map.at(x, y), map.axes(x, y)) else {
                    continue;
                };
                if !inside(scales.image(), predicted) {
                    continue;
                }
                let near = |node: &Node| node.pixel.distance(predicted) < MAX_START_PX;
                let measured = match starts[id].take().filter(near) {
                    Some(Node { pixel, sigma_px: Some(sigma_px), .. }) => Ok((pixel, sigma_px)),
                    Some(node) => self.corner(scales, node.pixel, axes, contrast),
                    None => self.corner(scales, predicted, axes, contrast),
                };
                match measured {
                    // Refined beyond the last pixels it would be extrapolated, not seen.
                    Ok((pixel, _)) if !on_pixels(scales.image(), pixel) => {
                        failed.push(Reject { pixel: predicted, reason: Reason::NoCrossing });
                    }
                    Ok((pixel, sigma_px)) => corners.push(Corner { id, pixel, sigma_px }),
                    Err(reason) => failed.push(Reject { pixel: predicted, reason }),
                }
            }
            let n_found = corners.len() - n_before;
            corners.sort_unstable_by_key(|c| c.id);
            if n_found == 0 || (failed.is_empty() && foretold.iter().all(|&is| is)) {
                break;
            }
            known = self.pairs(&corners);
        }
        rejects.append(&mut failed);
        self.drop_strays(&mut corners, &mut rejects);
        let identity = Identity {
            layout: placement.layout,
            mirrored: placement.mirrored,
            inverted: placement.inverted,
            markers: markers.clone(),
            margin: placement.margin,
        };
        if corners.len() < 4 {
            return Observation { corners: Vec::new(), identity: None, rejects };
        }
        Observation { corners, identity: Some(identity), rejects }
    }

    /// For each corner of the board whether known ones are near enough to say where it is.
    fn foretold(&self, known: &[([f64; 2], Pixel)]) -> Vec<bool> {
        let reach = if known.len() < MANY_CORNERS { 1 } else { 2 };
        let (columns, rows) = (self.board.squares_x - 1, self.board.squares_y - 1);
        let mut foretold = vec![false; columns * rows];
        for ([x, y], _) in known {
            let (x, y) = (*x as usize, *y as usize);
            for y in y.saturating_sub(reach)..(y + reach + 1).min(rows) {
                let row = &mut foretold[y * columns..][..columns];
                row[x.saturating_sub(reach)..(x + reach + 1).min(columns)].fill(true);
            }
        }
        foretold
    }

    /// One corner near its prediction.
    fn corner(
        &self,
        scales: &mut Scales<'_>,
        predicted: Pixel,
        axes: [[f64; 2]; 2],
        contrast: f64,
    ) -> Result<(Pixel, f64), Reason> {
        let rim = (1.0 - self.board.marker_m / self.board.square_m) / 2.0;
        let spacing = length(axes[0]).min(length(axes[1]));
        let reach = (0.2 * spacing).clamp(1.5, 6.0);
        let guess = Guess { pixel: predicted, axes, rim, contrast };
        let refined = refine(scales, &guess, reach).ok_or(Reason::NoCrossing)?;
        if refined.sigma_px > MAX_SIGMA_PX {
            return Err(Reason::Uncertain);
        }
        if !is_crossing(scales.image(), refined.pixel, axes, rim) {
            return Err(Reason::NoCrossing);
        }
        Ok((refined.pixel, refined.sigma_px))
    }

    /// Place on the board, in squares from its first corner, and in the image.
    fn pairs(&self, corners: &[Corner]) -> Vec<([f64; 2], Pixel)> {
        corners
            .iter()
            .map(|c| {
                let (x, y) = self.board.corner_cell(c.id);
                ([x as f64, y as f64], c.pixel)
            })
            .collect()
    }

    /// Drops corners that the map through all others does not expect there.
    fn drop_strays(&self, corners: &mut Vec<Corner>, rejects: &mut Vec<Reject>) {
        loop {
            let known = self.pairs(corners);
            let Some(map) = SmoothMap::fit(&known) else { return };
            let distances: Vec<f64> = known
                .iter()
                .map(|(p, q)| map.at(p[0], p[1]).map_or(f64::INFINITY, |e| e.distance(*q)))
                .collect();
            let mut sorted = distances.clone();
            sorted.sort_unstable_by(f64::total_cmp);
            let limit = (6.0 * sorted[sorted.len() / 2]).max(0.6);
            let Some((worst, &distance)) =
                distances.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))
            else {
                return;
            };
            if distance <= limit {
                return;
            }
            rejects.push(Reject { pixel: corners[worst].pixel, reason: Reason::OffLattice });
            corners.remove(worst);
        }
    }
}

/// An identified lattice.
struct Found {
    lattice: Lattice,
    identity: Identified,
}

/// How many saddles of a level are kept.
pub(super) fn most_saddles(level: &Level) -> usize {
    let mpx = (level.width * level.height) as f64 * 1e-6;
    ((MOST_SADDLES_PER_MPX * mpx) as usize).max(LEAST_MOST_SADDLES)
}

/// Blocks to try, best guess first. Below 2560 pixels across, squares of 12 to 150 pixels are seen at half resolution,
/// larger or blurred ones on a coarser level, smaller ones at full. In larger images squares have more pixels, too:
/// they begin coarser. Finer levels, which cost most, come last.
pub(super) fn factors(image: &Gray) -> Vec<usize> {
    let (width, height) = (image.width(), image.height());
    let first = 2 * (width.max(height) / 1280).max(1);
    let first = 1 << first.ilog2();
    let mut factors = if first == 2 { vec![2, 3] } else { vec![first] };
    let mut factor = 4;
    while width.min(height) / factor >= COARSEST {
        if factor != first {
            factors.push(factor);
        }
        factor *= 2;
    }
    if first != 2 {
        factors.push(2);
    }
    factors.push(1);
    factors
}

/// Whether a place lies between the centres of the image's pixels.
fn on_pixels(image: &Gray, at: Pixel) -> bool {
    let within = |v: f64, size: usize| v >= 0.0 && v <= size as f64 - 1.0;
    within(at.x, image.width()) && within(at.y, image.height())
}

/// True where a corner can be measured: three pixels from the border at least.
fn inside(image: &Gray, p: Pixel) -> bool {
    const BORDER: f64 = 2.0;
    p.x >= BORDER
        && p.y >= BORDER
        && p.x <= image.width() as f64 - 1.0 - BORDER
        && p.y <= image.height() as f64 - 1.0 - BORDER
}

/// True where the four squares round a corner alternate in colour.
fn is_crossing(image: &Gray, at: Pixel, [u, v]: [[f64; 2]; 2], rim: f64) -> bool {
    let spacing = length(u).min(length(v));
    let d = (0.75 * rim).max(1.5 / spacing).min(0.3);
    let sample = |a: f64, b: f64| {
        image.bilinear(Pixel::new(
            at.x + d * (a * u[0] + b * v[0]),
            at.y + d * (a * u[1] + b * v[1]),
        ))
    };
    let quadrants = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(a, b)| sample(a, b));
    let [Some(a), Some(b), Some(c), Some(e)] = quadrants else {
        // At the rim of the image a quadrant may be outside; the gradients have already agreed on a crossing.
        return true;
    };
    let (high, low) = (a.min(c), b.max(e));
    let (other_high, other_low) = (b.min(e), a.max(c));
    let range = a.max(b).max(c).max(e) - a.min(b).min(c).min(e);
    (high - low).max(other_high - other_low) > 0.25 * range && range > 6.0
}
