//! Sub-pixel corners with their uncertainty.
//!
//! Every gradient along an edge is perpendicular to the line from the corner to it (Förstner and Gülch 1987). The
//! corner q minimises
//!
//! ```text
//! Σ w(p)·(g(p)ᵀ(p − q))²    →    M q = Σ w g gᵀ p,   M = Σ w g gᵀ
//! ```
//!
//! with weights w that are symmetric about q and confine the sum to the two edges: a cross in the coordinates of the
//! board, narrow enough to stay off the markers. Blur that is symmetric, motion included, leaves the image symmetric
//! about the crossing, so the fixed point of the iteration is unbiased.
//!
//! The estimate is linear in the noise of the pixels, so its covariance follows from that of the pixels without any
//! model of the edge: δq = M⁻¹ Σ w g (p − q)ᵀ δg, with δg summed up pixel by pixel.

use crate::{geom::Pixel, image::Gray};

/// A corner to refine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    /// Where it should be.
    pub(super) pixel: Pixel,
    /// Pixels per square along both axes of the board.
    pub(super) axes: [[f64; 2]; 2],
    /// Width of the white rim round a marker, in squares.
    pub(super) rim: f64,
    /// Standard deviation of the image's noise, grey levels.
    pub(super) noise: f64,
}

/// A refined corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined {
    pub(super) pixel: Pixel,
    pub(super) sigma_px: f64,
}

/// Longest reach along an edge, pixels: more adds cost, not accuracy that the printer has.
const MAX_REACH: f64 = 8.0;
/// Reach along an edge, in squares: short of the neighbouring corner.
const REACH: f64 = 0.42;
/// The cross is never narrower than this, pixels: blurred edges are wider.
const MIN_WIDTH: f64 = 2.0;
/// Converged when a step is shorter than this, pixels.
const CONVERGED: f64 = 2e-3;
/// Steps at most. Good corners take two or three.
const MOST_STEPS: usize = 8;
/// What calibration targets, lenses and demosaicing leave even in a noiseless picture, pixels.
const FLOOR_PX: f64 = 0.01;

/// The corner near the guess; `None` where no crossing of two edges is within `reach_px` of it.
pub(super) fn refine(image: &Gray, guess: &Guess, reach_px: f64) -> Option<Refined> {
    let [u, v] = guess.axes;
    let det = u[0] * v[1] - u[1] * v[0];
    let (lu, lv) = (u[0].hypot(u[1]), v[0].hypot(v[1]));
    if !(det.abs() > 0.05 * lu * lv && lu > 2.0 && lv > 2.0) {
        return None;
    }
    // Board coordinates of a pixel offset.
    let inverse = [[v[1] / det, -v[0] / det], [-u[1] / det, u[0] / det]];
    // Distance between opposite edges of a square, in pixels, across each axis.
    let (across_u, across_v) = (det.abs() / lu, det.abs() / lv);
    let cross = Cross {
        inverse,
        along: [1.0 / (MAX_REACH / lu).min(REACH), 1.0 / (MAX_REACH / lv).min(REACH)],
        width: [
            1.0 / (0.9 * guess.rim).max(MIN_WIDTH / across_v).min(REACH),
            1.0 / (0.9 * guess.rim).max(MIN_WIDTH / across_u).min(REACH),
        ],
    };
    let half = (MAX_REACH.min(REACH * lu.max(lv)) + 1.0).ceil() as i64;
    let mut q = [guess.pixel.x, guess.pixel.y];
    let mut window: Option<Window> = None;
    for step in 0..MOST_STEPS {
        let (cx, cy) = (q[0].round() as i64, q[1].round() as i64);
        if window.as_ref().is_none_or(|w| (w.cx - cx).abs() > 1 || (w.cy - cy).abs() > 1) {
            window = Some(Window::new(image, cx, cy, half)?);
        }
        let window = window.as_ref()?;
        let next = window.solve(&cross, q)?;
        let moved = (next[0] - q[0]).hypot(next[1] - q[1]);
        q = next;
        if !((q[0] - guess.pixel.x).hypot(q[1] - guess.pixel.y) <= reach_px) {
            return None;
        }
        if moved < CONVERGED || (step + 1 == MOST_STEPS && moved < 0.05) {
            let sigma = window.sigma(&cross, q, guess.noise)?;
            return Some(Refined {
                pixel: Pixel::new(q[0], q[1]),
                sigma_px: sigma.hypot(FLOOR_PX),
            });
        }
    }
    None
}

/// The region of the edges through a corner, in board coordinates.
struct Cross {
    inverse: [[f64; 2]; 2],
    /// One over the reach along each axis, squares.
    along: [f64; 2],
    /// One over the half-width across each axis' edge, squares.
    width: [f64; 2],
}

impl Cross {
    /// Weight of a pixel at this offset from the corner, 0..=1: smooth, symmetric, zero outside.
    fn weight(&self, dx: f64, dy: f64) -> f64 {
        let a = self.inverse[0][0] * dx + self.inverse[0][1] * dy;
        let b = self.inverse[1][0] * dx + self.inverse[1][1] * dy;
        let bump = |t: f64| (1.0 - t * t).max(0.0);
        // The edge along the first axis lies where b is small, the other where a is.
        let first = bump(a * self.along[0]) * bump(b * self.width[1]);
        let second = bump(b * self.along[1]) * bump(a * self.width[0]);
        first.max(second)
    }
}

/// Gradients of a square part of the image, each at the centre of four pixels.
struct Window {
    cx: i64,
    cy: i64,
    /// Offset of the first gradient from the pixel (0, 0) of the image.
    x0: f64,
    y0: f64,
    columns: usize,
    rows: usize,
    gradients: Vec<[f64; 2]>,
}

impl Window {
    /// The window of ± `half` pixels about a pixel, clipped to the image; `None` where less than 4 × 4 remain.
    fn new(image: &Gray, cx: i64, cy: i64, half: i64) -> Option<Self> {
        let clip = |c: i64, size: usize| ((c - half).max(0), (c + half).min(size as i64 - 1));
        let (x0, x1) = clip(cx, image.width());
        let (y0, y1) = clip(cy, image.height());
        if x1 - x0 < 3 || y1 - y0 < 3 {
            return None;
        }
        let (columns, rows) = ((x1 - x0) as usize, (y1 - y0) as usize);
        let mut gradients = Vec::with_capacity(columns * rows);
        for y in 0..rows {
            let top = &image.row(y0 as usize + y)[x0 as usize..=x1 as usize];
            let bottom = &image.row(y0 as usize + y + 1)[x0 as usize..=x1 as usize];
            for (t, b) in top.windows(2).zip(bottom.windows(2)) {
                let [t0, t1, b0, b1] = [t[0], t[1], b[0], b[1]].map(f64::from);
                gradients.push([0.5 * ((t1 - t0) + (b1 - b0)), 0.5 * ((b0 - t0) + (b1 - t1))]);
            }
        }
        Some(Self { cx, cy, x0: x0 as f64 + 0.5, y0: y0 as f64 + 0.5, columns, rows, gradients })
    }

    /// One step: the corner that the weighted gradients about `q` point at.
    fn solve(&self, cross: &Cross, q: [f64; 2]) -> Option<[f64; 2]> {
        let (mut a, mut b, mut c, mut rx, mut ry) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for y in 0..self.rows {
            let dy = self.y0 + y as f64 - q[1];
            let row = &self.gradients[y * self.columns..][..self.columns];
            for (x, g) in row.iter().enumerate() {
                let dx = self.x0 + x as f64 - q[0];
                let w = cross.weight(dx, dy);
                let (wx, wy) = (w * g[0], w * g[1]);
                let along = g[0] * dx + g[1] * dy;
                a += wx * g[0];
                b += wx * g[1];
                c += wy * g[1];
                rx += wx * along;
                ry += wy * along;
            }
        }
        let det = a * c - b * b;
        // Two edges of different directions: the smaller eigenvalue is a fair part of the larger.
        if !(det > 0.02 * (a + c) * (a + c) / 4.0) {
            return None;
        }
        Some([q[0] + (c * rx - b * ry) / det, q[1] + (a * ry - b * rx) / det])
    }

    /// Standard deviation per coordinate, from the noise of the pixels.
    fn sigma(&self, cross: &Cross, q: [f64; 2], noise: f64) -> Option<f64> {
        let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
        // Influence of every pixel on Σ w g (gᵀ(p − q)): the gradient at a cell takes ±½ of its four pixels.
        let stride = self.columns + 1;
        let mut influence = vec![[0.0_f64; 2]; stride * (self.rows + 1)];
        for y in 0..self.rows {
            let dy = self.y0 + y as f64 - q[1];
            for x in 0..self.columns {
                let g = self.gradients[y * self.columns + x];
                let dx = self.x0 + x as f64 - q[0];
                let w = cross.weight(dx, dy);
                if w == 0.0 {
                    continue;
                }
                a += w * g[0] * g[0];
                b += w * g[0] * g[1];
                c += w * g[1] * g[1];
                // d/dg of g·(gᵀr) = (gᵀr)·1 + g·rᵀ.
                let along = g[0] * dx + g[1] * dy;
                let by_gx = [w * (along + g[0] * dx), w * (g[1] * dx)];
                let by_gy = [w * (g[0] * dy), w * (along + g[1] * dy)];
                for (at, sx, sy) in
                    [(0, -0.5, -0.5), (1, 0.5, -0.5), (stride, -0.5, 0.5), (stride + 1, 0.5, 0.5)]
                {
                    let cell = &mut influence[y * stride + x + at];
                    cell[0] += sx * by_gx[0] + sy * by_gy[0];
                    cell[1] += sx * by_gx[1] + sy * by_gy[1];
                }
            }
        }
        let det = a * c - b * b;
        if !(det > 0.0) {
            return None;
        }
        let (mut vxx, mut vyy) = (0.0, 0.0);
        for [ix, iy] in influence {
            let dx = (c * ix - b * iy) / det;
            let dy = (a * iy - b * ix) / det;
            vxx += dx * dx;
            vyy += dy * dy;
        }
        Some(noise * f64::midpoint(vxx, vyy).sqrt())
    }
}

/// Standard deviation of the image's noise, grey levels: the median response to a kernel that cancels any smooth
/// surface (Immerkær, CVIU 1996), so that edges and texture, being few, do not count. Never below what rounding to
/// 8 bits leaves, √(1/12).
pub(super) fn noise_sigma(image: &Gray) -> f64 {
    const ROUNDING: f64 = 0.288_675;
    let (width, height) = (image.width(), image.height());
    if width < 3 || height < 3 {
        return ROUNDING;
    }
    // About 8000 places are plenty for a median.
    let step = (((width * height) as f64 / 8000.0).sqrt() as usize).max(1);
    let mut histogram = [0_u32; 2041];
    let mut n = 0_u32;
    for y in (1..height - 1).step_by(step) {
        let [a, b, c] = [y - 1, y, y + 1].map(|y| image.row(y));
        for x in (1..width - 1).step_by(step) {
            let p = |row: &[u8], x: usize| i32::from(row[x]);
            let value = p(a, x - 1) + p(a, x + 1) + p(c, x - 1) + p(c, x + 1)
                - 2 * (p(a, x) + p(c, x) + p(b, x - 1) + p(b, x + 1))
                + 4 * p(b, x);
            histogram[value.unsigned_abs() as usize] += 1;
            n += 1;
        }
    }
    // The median of |N(0, s)| is 0.6745·s; the kernel has a gain of 6. Within a bin the count is spread evenly.
    let mut below = 0.0;
    let half = f64::from(n) / 2.0;
    for (value, &count) in histogram.iter().enumerate() {
        if below + f64::from(count) >= half {
            let inside = (half - below) / f64::from(count.max(1));
            let median = if value == 0 { 0.5 * inside } else { value as f64 - 0.5 + inside };
            return (median / 0.6745 / 6.0).max(ROUNDING);
        }
        below += f64::from(count);
    }
    ROUNDING
}
