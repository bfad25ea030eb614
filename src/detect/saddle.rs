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

use super::pyramid::Level;

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
const MIN_STRENGTH: f32 = 1.0;
/// Difference between bright and dark on the ring, grey levels.
const MIN_CONTRAST: f32 = 8.0;

/// Saddles much weaker than the strongest are texture: the strength goes with the square of the contrast, so a corner
/// in deep shade (a tenth of the light) stays above.
const MIN_RELATIVE_STRENGTH: f32 = 0.005;
/// The strongest saddle that counts for this is the one of this rank: a few reflections must not set the scale.
const REFERENCE_RANK: usize = 24;

/// The saddles of a level, strongest first, at most `most`. `response` is memory only.
pub(super) fn saddles(level: &Level, most: usize, response: &mut Vec<f32>) -> Vec<Saddle> {
    let (width, height) = (level.width, level.height);
    let margin = RING_RADIUS as usize;
    if width < 2 * margin + 3 || height < 2 * margin + 3 {
        return Vec::new();
    }
    fill_response(level, response);
    let mut peaks: Vec<(f32, u32)> = Vec::new();
    for y in margin..height - margin {
        let [above, here, below] = [y - 1, y, y + 1].map(|y| &response[y * width..][..width]);
        for x in margin..width - margin {
            let s = here[x];
            // A strict order among equals, so that a plateau yields one peak.
            if s > MIN_STRENGTH
                && s > here[x - 1]
                && s >= here[x + 1]
                && above[x - 1..=x + 1].iter().all(|&n| s > n)
                && below[x - 1..=x + 1].iter().all(|&n| s >= n)
            {
                peaks.push((s, (y * width + x) as u32));
            }
        }
    }
    if peaks.len() > REFERENCE_RANK {
        let (_, reference, _) =
            peaks.select_nth_unstable_by(REFERENCE_RANK, |a, b| b.0.total_cmp(&a.0));
        let least = MIN_RELATIVE_STRENGTH * reference.0;
        peaks.retain(|peak| peak.0 > least);
    }
    // By strength, then by place: the order must not depend on how the sort works.
    peaks.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    peaks.truncate(most);
    peaks
        .into_iter()
        .filter_map(|(_, at)| examine(level, at as usize % width, at as usize / width))
        .collect()
}

/// −det H at every pixel but the border's.
fn fill_response(level: &Level, response: &mut Vec<f32>) {
    let (width, height) = (level.width, level.height);
    // The border keeps what an earlier image left there; no peak is sought so near it.
    response.resize(width * height, 0.0);
    for y in 1..height - 1 {
        let [a, b, c] = [y - 1, y, y + 1].map(|y| &level.gray[y * width..][..width]);
        let n = width - 2;
        let out = &mut response[y * width + 1..][..n];
        let (a0, a1, a2) = (&a[..n], &a[1..][..n], &a[2..][..n]);
        let (b0, b1, b2) = (&b[..n], &b[1..][..n], &b[2..][..n]);
        let (c0, c1, c2) = (&c[..n], &c[1..][..n], &c[2..][..n]);
        for i in 0..n {
            let twice = 2.0 * b1[i];
            let xx = b0[i] + b2[i] - twice;
            let yy = a1[i] + c1[i] - twice;
            let xy = 0.25 * ((a0[i] + c2[i]) - (a2[i] + c0[i]));
            out[i] = xy * xy - xx * yy;
        }
    }
}

/// The saddle at a peak of the response; `None` where its surroundings are not those of a chessboard's corner.
fn examine(level: &Level, x: usize, y: usize) -> Option<Saddle> {
    let width = level.width;
    let at = |dx: isize, dy: isize| {
        level.gray[(y as isize + dy) as usize * width + (x as isize + dx) as usize]
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

    let ring = RING.map(|(dx, dy)| at(dx, dy));
    let middle = c + 0.5 * (gx * dx + gy * dy); // The value at the saddle itself.
    let mut crossings = [0.0_f32; 4];
    let mut n = 0;
    let mut first_is_bright = false;
    for k in 0..16 {
        let (a, b) = (ring[k] - middle, ring[(k + 1) % 16] - middle);
        if (a > 0.0) != (b > 0.0) {
            if n == 4 {
                return None;
            }
            if n == 0 {
                first_is_bright = b > 0.0;
            }
            crossings[n] = k as f32 + a / (a - b);
            n += 1;
        }
    }
    if n != 4 {
        return None;
    }
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
