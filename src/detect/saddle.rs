//! Crossings of two edges: saddle points of the smoothed image that look like the corner of a chessboard.
//!
//! Where four squares meet, the smoothed image has a saddle: its Hessian H has a negative determinant. The strength
//!
//! ```text
//! S = I_xy² − I_xx·I_yy = −det H
//! ```
//!
//! is what Beaudet (1978) proposed for corners and OpenCV's and libcbdetect's successors use in some form. It is
//! evaluated at every pixel; local maxima are then asked for the four alternations of a chessboard on a ring around
//! them (the idea of Bennett and Lasenby's ChESS, CVIU 2014), which also gives the directions of the four edges.

use std::array;

use crate::par::vectorized;

use super::pyramid::{Level, UNITS};

/// A crossing of two edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Saddle {
    /// Position in the level, pixels.
    pub(super) x: f32,
    /// Position in the level, pixels.
    pub(super) y: f32,
    /// Unit vectors along the four edges, by ascending angle (x to the right, y down).
    pub(super) edges: [[f32; 2]; 4],
    /// True where the sector from `edges[0]` to `edges[1]` is bright; the next is dark, and so on.
    pub(super) first_is_bright: bool,
    /// Mean grey of the bright sectors minus that of the dark ones.
    pub(super) contrast: f32,
}

impl Saddle {
    /// True where the sector that follows edge `k` is bright.
    pub(super) fn is_bright_after(&self, k: usize) -> bool {
        self.first_is_bright == k.is_multiple_of(2)
    }
}

/// Radius of the ring, pixels of the level.
const RING_RADIUS: isize = 3;

/// The ring: 16 pixels of a circle of radius 3 (Bresenham), by ascending angle.
const RING: [(isize, isize); 16] = [
    (3, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 3),
    (-1, 3),
    (-2, 2),
    (-3, 1),
    (-3, 0),
    (-3, -1),
    (-2, -2),
    (-1, -3),
    (0, -3),
    (1, -3),
    (2, -2),
    (3, -1),
];

/// What a saddle must have to be one. The strength of a corner of contrast c under this smoothing is about (0.09·c)²,
/// halved twice by strong blur; noise of σ = 10 grey levels stays below 1.
const MIN_STRENGTH: i32 = (UNITS as i32) * (UNITS as i32);
/// Difference between bright and dark on the ring, grey levels.
const MIN_CONTRAST: f32 = 8.0;

/// Saddles much weaker than the strongest are texture and noise: the strength goes with the square of the contrast, so
/// a corner in shade (an eighth of the light) stays above. A corner in deeper shade is no node of the lattice, but it
/// is looked for where the lattice expects it.
const MIN_RELATIVE_STRENGTH: f32 = 0.015;
/// The strongest saddle that counts for this is the one of this rank: a few reflections must not set the scale.
const REFERENCE_RANK: usize = 24;

/// Memory of the search, kept for the next image.
#[derive(Debug, Default)]
pub(super) struct Memory {
    /// The latest rows of the response: row y lies at y modulo [`KEPT_ROWS`]. After its pixels a row has zeros, for a
    /// whole chunk to be looked at wherever one begins.
    response: Vec<i32>,
    /// Strength and index of the peaks.
    peaks: Vec<(i32, u32)>,
}

/// Rows of the response kept: a peak is told from the rows above and below.
const KEPT_ROWS: usize = 3;
/// Pixels of a row looked at together.
const CHUNK: usize = 32;

/// The saddles of a level, strongest first, at most `most`.
pub(super) fn saddles(level: &Level, most: usize, memory: &mut Memory) -> Vec<Saddle> {
    let margin = RING_RADIUS as usize;
    if level.width < 2 * margin + 3 || level.height < 2 * margin + 3 {
        return Vec::new();
    }
    vectorized(
        #[inline(always)]
        || find_peaks(level, memory),
    );
    let peaks = &mut memory.peaks;
    if peaks.len() > REFERENCE_RANK {
        let (_, reference, _) = peaks.select_nth_unstable_by(REFERENCE_RANK, |a, b| b.0.cmp(&a.0));
        let least = (MIN_RELATIVE_STRENGTH * reference.0 as f32) as i32;
        peaks.retain(|peak| peak.0 > least);
    }
    // By strength, then by place: the order must not depend on how the sort works. Most peaks are noise: only what
    // is left of them is sorted.
    let order = |a: &(i32, u32), b: &(i32, u32)| b.0.cmp(&a.0).then(a.1.cmp(&b.1));
    if peaks.len() > most {
        peaks.select_nth_unstable_by(most, order);
        peaks.truncate(most);
    }
    let width = level.width;
    let mut found: Vec<((i32, u32), Saddle)> = peaks
        .iter()
        .filter_map(|&peak| {
            let at = peak.1 as usize;
            Some((peak, examine(level, at % width, at / width)?))
        })
        .collect();
    found.sort_unstable_by(|a, b| order(&a.0, &b.0));
    found.into_iter().map(|(_, saddle)| saddle).collect()
}

/// Local maxima of the response, row by row.
#[inline(always)]
fn find_peaks(level: &Level, memory: &mut Memory) {
    let (width, height) = (level.width, level.height);
    let margin = RING_RADIUS as usize;
    let Memory { response, peaks } = memory;
    peaks.clear();
    let stride = width + CHUNK;
    response.clear();
    response.resize(KEPT_ROWS * stride, 0);
    for y in 1..height - 1 {
        response_row(level, y, &mut response[y % KEPT_ROWS * stride..][..width]);
        let middle = y - 1;
        if middle < margin || middle + margin >= height {
            continue;
        }
        let rows = [middle - 1, middle, y].map(|y| &response[y % KEPT_ROWS * stride..][..stride]);
        for first in (margin..width - margin).step_by(CHUNK) {
            let here: &[i32; CHUNK] = rows[1][first..].first_chunk().expect("zeros follow");
            // Most of most images is smooth.
            if !here.iter().fold(false, |any, &s| any | (s > MIN_STRENGTH)) {
                continue;
            }
            let flags = flag_peaks(rows, first);
            let words: [u64; CHUNK / 8] =
                array::from_fn(|k| u64::from_le_bytes(array::from_fn(|i| flags[8 * k + i])));
            for (k, mut word) in words.into_iter().enumerate() {
                while word != 0 {
                    // A flag is 1 in a byte of its own.
                    let x = 8 * k + word.trailing_zeros() as usize / 8;
                    word &= word - 1;
                    if first + x < width - margin {
                        peaks.push((here[x], (middle * width + first + x) as u32));
                    }
                }
            }
        }
    }
}

/// −det H at every pixel of a row but its ends, in squares of the level's units.
#[inline(always)]
fn response_row(level: &Level, y: usize, out: &mut [i32]) {
    let width = level.width;
    let [a, b, c] = [y - 1, y, y + 1].map(|y| &level.values[y * width..][..width]);
    let n = width - 2;
    let out = &mut out[1..][..n];
    let (a0, a1, a2) = (&a[..n], &a[1..][..n], &a[2..][..n]);
    let (b0, b1, b2) = (&b[..n], &b[1..][..n], &b[2..][..n]);
    let (c0, c1, c2) = (&c[..n], &c[1..][..n], &c[2..][..n]);
    for i in 0..n {
        // Values are at most 255 · 32: four of them fit into 16 bits, and what is left of the products into 32.
        let twice = 2 * b1[i];
        let xx = i32::from(b0[i] + b2[i] - twice);
        let yy = i32::from(a1[i] + c1[i] - twice);
        let four_xy = i32::from((a0[i] + c2[i]) - (a2[i] + c0[i]));
        out[i] = ((four_xy * four_xy) >> 4) - xx * yy;
    }
}

/// Which pixels of a chunk of the middle row exceed [`MIN_STRENGTH`] and their eight neighbours.
#[inline(always)]
fn flag_peaks(rows: [&[i32]; 3], first: usize) -> [u8; CHUNK] {
    let [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = rows.map(|row| {
        let three: &[i32; CHUNK + 2] = row[first - 1..].first_chunk().expect("zeros follow");
        [0, 1, 2].map(|dx| three[dx..].first_chunk::<CHUNK>().expect("two more than the chunk"))
    });
    let mut flags = [0; CHUNK];
    for i in 0..CHUNK {
        let s = b1[i];
        // A strict order among equals, so that a plateau yields one peak.
        let before = a0[i].max(a1[i]).max(a2[i]).max(b0[i]).max(MIN_STRENGTH);
        let after = c0[i].max(c1[i]).max(c2[i]).max(b2[i]);
        flags[i] = u8::from(s > before && s >= after);
    }
    flags
}

/// The saddle at a peak of the response; `None` where its surroundings are not those of a chessboard's corner.
fn examine(level: &Level, x: usize, y: usize) -> Option<Saddle> {
    const R: usize = RING_RADIUS as usize;
    // Rows of the neighbourhood, so that its pixels need no check each.
    let rows: [&[i16; 2 * R + 1]; 2 * R + 1] = array::from_fn(|k| {
        let start = (y + k - R) * level.width + x - R;
        level.values[start..].first_chunk().expect("a peak keeps its ring within the level")
    });
    let at = |dx: isize, dy: isize| {
        let value = rows[(dy + RING_RADIUS) as usize][(dx + RING_RADIUS) as usize];
        f32::from(value) * (1.0 / f32::from(UNITS))
    };
    // The saddle of the quadratic through the 3x3 neighbourhood.
    let c = at(0, 0);
    let (gx, gy) = (0.5 * (at(1, 0) - at(-1, 0)), 0.5 * (at(0, 1) - at(0, -1)));
    let (xx, yy) = (at(1, 0) + at(-1, 0) - 2.0 * c, at(0, 1) + at(0, -1) - 2.0 * c);
    let xy = 0.25 * (at(1, 1) + at(-1, -1) - at(1, -1) - at(-1, 1));
    let det = xx * yy - xy * xy;
    if !(det < 0.0) {
        return None;
    }
    let (dx, dy) = (-(yy * gx - xy * gy) / det, -(xx * gy - xy * gx) / det);
    if !(dx.abs() < 1.5 && dy.abs() < 1.5) {
        return None;
    }

    let mut ring = [0.0; 16];
    for (value, (dx, dy)) in ring.iter_mut().zip(RING) {
        *value = at(dx, dy);
    }
    let middle = c + 0.5 * (gx * dx + gy * dy); // The value at the saddle itself.
    let bright = (0..16).fold(0_u16, |bits, k| bits | u16::from(ring[k] > middle) << k);
    // Bit k: the ring crosses the middle between k and k + 1.
    let mut changes = bright ^ bright.rotate_right(1);
    if changes.count_ones() != 4 {
        return None;
    }
    let first_is_bright = bright >> ((changes.trailing_zeros() + 1) % 16) & 1 == 1;
    let crossings: [f32; 4] = array::from_fn(|_| {
        let k = changes.trailing_zeros() as usize;
        changes &= changes - 1;
        let (a, b) = (ring[k] - middle, ring[(k + 1) % 16] - middle);
        k as f32 + a / (a - b)
    });
    // Every sector must be clearly bright or dark, and wide enough.
    let mut weakest = f32::INFINITY;
    let (mut bright, mut dark) = (f32::INFINITY, f32::INFINITY);
    for k in 0..4 {
        let (from, to) =
            (crossings[k], if k == 3 { crossings[0] + 16.0 } else { crossings[k + 1] });
        if to - from < 1.2 {
            return None;
        }
        let extreme = ((from.ceil() as usize)..=(to.floor() as usize))
            .map(|i| (ring[i % 16] - middle).abs())
            .fold(0.0_f32, f32::max);
        weakest = weakest.min(extreme);
        if first_is_bright == (k % 2 == 0) {
            bright = bright.min(extreme);
        } else {
            dark = dark.min(extreme);
        }
    }
    let contrast = bright + dark;
    if contrast < MIN_CONTRAST || weakest < 0.15 * contrast {
        return None;
    }
    // Opposite edges lie on lines: their directions from the saddle must be opposite within 45°.
    let edges = crossings.map(|t| {
        let (i, f) = ((t as usize).min(15), t.fract());
        let (p, q) = (RING[i], RING[(i + 1) % 16]);
        let px = p.0 as f32 * (1.0 - f) + q.0 as f32 * f - dx;
        let py = p.1 as f32 * (1.0 - f) + q.1 as f32 * f - dy;
        let length = (px * px + py * py).sqrt().max(1e-3);
        [px / length, py / length]
    });
    let opposite = |a: [f32; 2], b: [f32; 2]| a[0] * b[0] + a[1] * b[1] < -0.7;
    if !(opposite(edges[0], edges[2]) && opposite(edges[1], edges[3])) {
        return None;
    }
    Some(Saddle { x: x as f32 + dx, y: y as f32 + dy, edges, first_is_bright, contrast })
}
