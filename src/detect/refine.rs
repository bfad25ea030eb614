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
//! Newton's method finds it: as q moves the sum falls by K = M + Σ g (gᵀ(p − q))·(∇w)ᵀ, for the weights move with q.
//! The estimate is linear in the noise of the pixels, so its covariance follows from that of the pixels without any
//! model of the edge: δq = K⁻¹ Σ w·((gᵀr)·1 + g·rᵀ) δg, r = p − q, with δg summed up pixel by pixel.

use crate::{geom::Pixel, image::Gray};

use super::{map::length, pyramid::Level, simd::vectorized};

/// A corner to refine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    /// Where it should be.
    pub(super) pixel: Pixel,
    /// Pixels per square along both axes of the board.
    pub(super) axes: [[f64; 2]; 2],
    /// Width of the white rim round a marker, in squares.
    pub(super) rim: f64,
    /// White minus black on the board, grey levels.
    pub(super) contrast: f64,
}

/// An image and, made when first needed, smaller versions of it on which strongly blurred corners are measured.
#[derive(Debug)]
pub(super) struct Scales<'a> {
    image: &'a Gray,
    /// Standard deviation of the image's noise, grey levels.
    noise: f64,
    coarse: [Option<Gray>; MAX_FACTOR - 1],
    window: &'a mut Window,
}

impl<'a> Scales<'a> {
    pub(super) fn new(image: &'a Gray, window: &'a mut Window) -> Self {
        Self { image, noise: noise_sigma(image), coarse: [const { None }; MAX_FACTOR - 1], window }
    }

    /// The image itself.
    pub(super) fn image(&self) -> &'a Gray {
        self.image
    }

    /// The image in blocks of `factor` × `factor` pixels, smoothed, its noise, and memory for a window of it.
    fn at(&mut self, factor: usize) -> Option<(&Gray, f64, &mut Window)> {
        if factor == 1 {
            return Some((self.image, self.noise, self.window));
        }
        let slot = &mut self.coarse[factor - 2];
        if slot.is_none() {
            let mut level = Level::default();
            level.fill(self.image, factor)?;
            *slot = Some(level.to_gray());
        }
        // Averaging divides white noise; what smoothing leaves of it is 0.27 of a pixel's (Σw² = 70/256 per axis).
        Some((slot.as_ref()?, (0.27 * self.noise / factor as f64).max(ROUNDING), self.window))
    }
}

/// A refined corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined {
    pub(super) pixel: Pixel,
    pub(super) sigma_px: f64,
}

/// Reach along a sharp edge, pixels: more adds cost, not accuracy that the printer has. With it a window is 16 pixels
/// wide, twice [`LANES`].
const SHARP_REACH: f64 = 7.0;
/// Reach along an edge beyond the blur of the other, pixels.
const CLEAN_REACH: f64 = 4.5;
/// Widths of the blur that the sum takes in, to each side of an edge and along the other.
const BLUR_WIDTHS: f64 = 1.25;
/// A reach of [`SHARP_REACH`] that rounding has made longer needs no wider window, pixels.
const ROUNDED: f64 = 1e-6;
/// Longest reach, pixels: bounds the cost.
const MAX_REACH: f64 = 40.0;
/// Reach along an edge, in squares: short of the neighbouring corner.
const REACH: f64 = 0.42;
/// Distance kept from the markers, pixels: their own edges are blurred, too.
const MARKER_BLUR: f64 = 1.2;
/// The cross is never narrower than this, pixels: blurred edges are wider.
const MIN_WIDTH: f64 = 2.0;
/// Converged when a step is shorter than this, pixels: steps shrink at least tenfold.
const CONVERGED: f64 = 2e-2;
/// Steps at most. Good corners take one or two.
const MOST_STEPS: usize = 8;
/// The slope of the sums is taken anew where the corner has moved by more than this since, pixels.
const SAME_SLOPE: f64 = 0.3;
/// Least determinant of the slope, as a fraction of that without the motion of the weights: below, noise rules.
const MIN_SLOPE: f64 = 0.1;
/// What pixels that undersample a sharp edge leave even in a noiseless picture, pixels.
const FLOOR_PX: f64 = 0.015;
/// Width of the edges that are undersampled by so much, pixels: with wider edges it falls in proportion.
const UNDERSAMPLED: f64 = 2.0;

/// Largest factor by which a blurred picture is reduced.
const MAX_FACTOR: usize = 6;
/// Blur that a reduced picture may keep, pixels. A blurred edge can be two: the hand rests at both ends of a shake.
/// Reduced to this width they are one again, and the corner is the middle of the blur, as a person sees it.
const KEPT_BLUR: f64 = 5.0;
/// Uncertainty of where in a blur the corner is, as a fraction of the width beyond a sharp edge's.
const BLUR_SIGMA: f64 = 0.03;
/// Where a white rim is too narrow for its blur, the marker's own edge pulls the corner: this much for every pixel that
/// is wanting, from simulated boards with rims of 0.1 to 0.15 squares.
const MARKER_SIGMA: f64 = 0.15;
/// Width of an edge that counts as sharp, pixels.
const SHARP: f64 = 5.0;

/// The corner near the guess; `None` where no crossing of two edges is within `reach_px` of it.
pub(super) fn refine(scales: &mut Scales<'_>, guess: &Guess, reach_px: f64) -> Option<Refined> {
    let [u, v] = guess.axes;
    let det = (u[0] * v[1] - u[1] * v[0]).abs();
    let across = [det / length(u), det / length(v)];
    if !(across[0] > 1.5 && across[1] > 1.5) {
        return None;
    }
    let blur = [
        blur_width(scales.image, guess, u, v, across[0]),
        blur_width(scales.image, guess, v, u, across[1]),
    ];
    let widest = blur[0].max(blur[1]);
    let factor = ((widest / KEPT_BLUR) as usize).clamp(1, MAX_FACTOR);
    let f = factor as f64;
    let (image, noise, window) = scales.at(factor)?;
    let offset = (f - 1.0) / 2.0;
    let scaled = Guess {
        pixel: Pixel::new((guess.pixel.x - offset) / f, (guess.pixel.y - offset) / f),
        axes: guess.axes.map(|a| a.map(|c| c / f)),
        ..*guess
    };
    let found = refine_at(image, window, &scaled, blur.map(|b| b / f), reach_px / f)?;
    let floor = FLOOR_PX * (UNDERSAMPLED / blur[0].min(blur[1])).min(1.0);
    let blur_sigma = BLUR_SIGMA * (widest - SHARP).max(0.0);
    let rim_px = guess.rim * across[0].min(across[1]);
    let marker_sigma = MARKER_SIGMA * (widest / 2.0 + MIN_WIDTH - rim_px).max(0.0);
    Some(Refined {
        pixel: Pixel::new(found.pixel.x * f + offset, found.pixel.y * f + offset),
        sigma_px: (found.sigma_px * noise * f).hypot(floor).hypot(blur_sigma).hypot(marker_sigma),
    })
}

/// [`refine`] on one scale; `blur` is the width of the blur across the edges along both axes, pixels. σ is for noise of
/// one grey level.
fn refine_at(
    image: &Gray,
    window: &mut Window,
    guess: &Guess,
    blur: [f64; 2],
    reach_px: f64,
) -> Option<Refined> {
    let [u, v] = guess.axes;
    let det = u[0] * v[1] - u[1] * v[0];
    let (lu, lv) = (length(u), length(v));
    if !(det.abs() > 0.05 * lu * lv && lu > 2.0 && lv > 2.0) {
        return None;
    }
    // Board coordinates of a pixel offset.
    let inverse = [[v[1] / det, -v[0] / det], [-u[1] / det, u[0] / det]];
    // Distance between opposite edges of a square, in pixels, across each axis.
    let (across_u, across_v) = (det.abs() / lu, det.abs() / lv);
    // Blur across the edge along u widens the sum across that edge, and what the other edge must reach beyond.
    let [blur_u, blur_v] = blur.map(|b| BLUR_WIDTHS * b);
    let along = |blur: f64, length: f64| {
        ((CLEAN_REACH + blur).clamp(SHARP_REACH, MAX_REACH) / length).min(REACH)
    };
    let width = |blur: f64, across: f64| {
        let rim = (guess.rim - MARKER_BLUR / across).max(MIN_WIDTH / across);
        rim.min((CLEAN_REACH + blur).max(SHARP_REACH) / across).min(REACH)
    };
    let (along_u, along_v) = (along(blur_v, lu), along(blur_u, lv));
    let (width_u, width_v) = (width(blur_u, across_u), width(blur_v, across_v));
    let cross = Cross {
        inverse: inverse.map(|row| row.map(|v| v as f32)),
        along: [along_u, along_v].map(|v| 1.0 / v as f32),
        // Across the edge along u one moves along v.
        width: [width_v, width_u].map(|v| 1.0 / v as f32),
    };
    let half = (along_u.max(width_v) * lu).max(along_v.max(width_u) * lv).min(MAX_REACH) - ROUNDED;
    let half = half.ceil() as i64 + 1;
    vectorized(
        #[inline(always)]
        || iterate(image, window, &cross, half, guess.pixel, reach_px),
    )
}

/// The fixed point of [`Window::solve`] that starts from a pixel, and its σ.
#[inline(always)]
fn iterate(
    image: &Gray,
    window: &mut Window,
    cross: &Cross,
    half: i64,
    from: Pixel,
    reach_px: f64,
) -> Option<Refined> {
    let mut q = [from.x, from.y];
    let mut center: Option<(i64, i64)> = None;
    let mut slope: Option<(Slope, [f64; 2])> = None;
    for step in 0..MOST_STEPS {
        let (cx, cy) = (q[0].round() as i64, q[1].round() as i64);
        if center.is_none_or(|(x, y)| (x - cx).abs() > 1 || (y - cy).abs() > 1) {
            window.fill(image, cx, cy, half)?;
            center = Some((cx, cy));
        }
        // Newton's method; near the corner the slope hardly changes.
        let near = |at: [f64; 2]| length([q[0] - at[0], q[1] - at[1]]) <= SAME_SLOPE;
        let (slope, pull) = match slope {
            Some((slope, at)) if near(at) => (slope, window.pull(cross, q)),
            _ => {
                let (new, pull) = window.slope(cross, q)?;
                slope = Some((new, q));
                (new, pull)
            }
        };
        let [dx, dy] = slope.divide(pull);
        q = [q[0] + dx, q[1] + dy];
        if !(length([q[0] - from.x, q[1] - from.y]) <= reach_px) {
            return None;
        }
        let moved = length([dx, dy]);
        if moved < CONVERGED || (step + 1 == MOST_STEPS && moved < 0.05) {
            return Some(Refined {
                pixel: Pixel::new(q[0], q[1]),
                sigma_px: window.sigma(cross, &slope, q),
            });
        }
    }
    None
}

/// How fast the sums Σ w g gᵀ(p − q) fall as q moves: a matrix K, so that q + K⁻¹·sums is where they vanish.
///
/// K = M + N: M = Σ w g gᵀ would be all if the weights stood still. They move with q, and on a blurred edge what comes
/// in on one side pulls, what goes out on the other pulls less: N = Σ g (gᵀr)·(∇w)ᵀ takes a tenth off M at a blur of
/// σ = 2 px, and hence adds a tenth to σ.
#[derive(Clone, Copy, Debug)]
struct Slope([[f64; 2]; 2]);

impl Slope {
    fn det(&self) -> f64 {
        let [[a, b], [c, d]] = self.0;
        a * d - b * c
    }

    /// K⁻¹ v.
    fn divide(&self, v: [f64; 2]) -> [f64; 2] {
        let [[a, b], [c, d]] = self.0;
        let det = self.det();
        [(d * v[0] - b * v[1]) / det, (a * v[1] - c * v[0]) / det]
    }

    /// Trace of K⁻¹ V K⁻ᵀ for a symmetric V = [xx xy; xy yy].
    fn covariance_trace(&self, [xx, xy, yy]: [f64; 3]) -> f64 {
        let [[a, b], [c, d]] = self.0;
        let (x, y) = (d * d + c * c, a * a + b * b);
        let det = self.det();
        (x * xx - 2.0 * (b * d + a * c) * xy + y * yy) / det / det
    }
}

/// Below this width the blur asks for nothing, pixels: 1.25 times it still lies within [`SHARP_REACH`].
const NO_BLUR: f64 = (SHARP_REACH - CLEAN_REACH) / BLUR_WIDTHS;

/// Width of the blur across the edge along `edge`, pixels: how far it takes the grey values to go from 15 % to 85 % of
/// the step, over 0.7, on the better of the edge's two halves; the first half that is sharp enough to need no widening
/// is enough. `across` is the distance that one of `other` spans at right angles to the edge. 0 where no edge is seen.
fn blur_width(image: &Gray, guess: &Guess, edge: [f64; 2], other: [f64; 2], across: f64) -> f64 {
    const STEPS: usize = 12;
    const MOST_PX: f64 = 18.0;
    let reach = guess.rim.max(1.5 / across).min(MOST_PX / across);
    let step = 2.0 * reach / STEPS as f64;
    let mut narrowest: Option<f64> = None;
    for arm in [-0.3, 0.3] {
        let middle = [0, 1].map(|a| [guess.pixel.x, guess.pixel.y][a] + arm * edge[a]);
        let at = |t: f64| Pixel::new(middle[0] + t * other[0], middle[1] + t * other[1]);
        let Some(profile) = image.along::<{ STEPS + 1 }>(at(-reach), at(reach)) else { continue };
        let (from, to) = (profile[0], profile[STEPS]);
        if (to - from).abs() < 0.3 * guess.contrast as f32 {
            continue;
        }
        let fraction = |k: usize| (profile[k] - from) / (to - from);
        let crossing = |level: f32| {
            (0..STEPS).find(|&k| fraction(k + 1) >= level).map(|k| {
                let (a, b) = (fraction(k), fraction(k + 1));
                k as f64 + f64::from((level - a) / (b - a).max(1e-6))
            })
        };
        if let (Some(low), Some(high)) = (crossing(0.15), crossing(0.85)) {
            let width = (high - low) * step * across / 0.7;
            if width <= NO_BLUR {
                return width;
            }
            narrowest = Some(narrowest.map_or(width, |n: f64| n.min(width)));
        }
    }
    narrowest.unwrap_or(0.0)
}

/// The region of the edges through a corner, in board coordinates.
struct Cross {
    inverse: [[f32; 2]; 2],
    /// One over the reach along each axis, squares.
    along: [f32; 2],
    /// One over the half-width across the other axis' edge, squares.
    width: [f32; 2],
}

impl Cross {
    /// Weight of a pixel at this offset from the corner, 0..=1: smooth, symmetric, zero outside.
    #[inline(always)]
    fn weight(&self, dx: f32, dy: f32) -> f32 {
        let a = self.inverse[0][0] * dx + self.inverse[0][1] * dy;
        let b = self.inverse[1][0] * dx + self.inverse[1][1] * dy;
        let bump = |t: f32| (1.0 - t * t).max(0.0);
        // The edge along the first axis lies where b is small, the other where a is.
        let first = bump(a * self.along[0]) * bump(b * self.width[1]);
        let second = bump(b * self.along[1]) * bump(a * self.width[0]);
        // Not `f32::max`, which must mind NaN.
        if first > second { first } else { second }
    }

    /// The weight and its slope along both axes of the board, per square.
    #[inline(always)]
    fn weight_and_slope(&self, dx: f32, dy: f32) -> [f32; 3] {
        let a = self.inverse[0][0] * dx + self.inverse[0][1] * dy;
        let b = self.inverse[1][0] * dx + self.inverse[1][1] * dy;
        let bump = |t: f32| (1.0 - t * t).max(0.0);
        let (first_a, first_b) = (bump(a * self.along[0]), bump(b * self.width[1]));
        let (second_a, second_b) = (bump(a * self.width[0]), bump(b * self.along[1]));
        let (first, second) = (first_a * first_b, second_a * second_b);
        let is_first = first > second;
        let pick = |x: f32, y: f32| if is_first { x } else { y };
        let weight = pick(first, second);
        let minus_two = if weight > 0.0 { -2.0 } else { 0.0 };
        let (scale_a, scale_b) =
            (pick(self.along[0], self.width[0]), pick(self.width[1], self.along[1]));
        [
            weight,
            minus_two * a * (scale_a * scale_a) * pick(first_b, second_b),
            minus_two * b * (scale_b * scale_b) * pick(first_a, second_a),
        ]
    }
}

/// Pixels handled at a time.
const LANES: usize = 16;
/// Gradients in a row of a sharp corner's window.
const SHARP_COLUMNS: usize = 16;

/// Gradients of a square part of the image, each at the centre of four pixels, after smoothing by (1 2 1)/4 along both
/// axes: without it, sharp edges are undersampled and their squared gradients pull the corner towards pixel centres
/// (0.07 px at a blur of σ = 0.6 px).
#[derive(Debug, Default)]
pub(super) struct Window {
    /// Position of the first gradient.
    x0: f64,
    y0: f64,
    rows: usize,
    /// Gradients in a row, padded with zeros to a multiple of [`LANES`].
    stride: usize,
    gx: Vec<f32>,
    gy: Vec<f32>,
    /// Smoothed pixels, then the influences of gradients: memory only.
    work: Vec<f32>,
    /// Influences on raw pixels in the making: memory only.
    rows_of_raw: Vec<f32>,
    column: Vec<u16>,
}

impl Window {
    /// Fills the window with ± `half` pixels about a pixel, clipped to the image; `None` where less than 4 × 4 remain.
    #[inline(always)]
    fn fill(&mut self, image: &Gray, cx: i64, cy: i64, half: i64) -> Option<()> {
        let clip = |c: i64, size: usize| ((c - half).max(0), (c + half).min(size as i64 - 1));
        let (x0, x1) = clip(cx, image.width());
        let (y0, y1) = clip(cy, image.height());
        if x1 - x0 < 3 || y1 - y0 < 3 {
            return None;
        }
        let (x0, y0) = (x0 as usize, y0 as usize);
        let (columns, rows) = (x1 as usize - x0, y1 as usize - y0);
        // Smoothed pixels: one more than gradients along both axes. Beyond the image its border repeats.
        let n = columns + 1;
        (self.x0, self.y0) = (x0 as f64 + 0.5, y0 as f64 + 0.5);
        (self.rows, self.stride) = (rows, columns.next_multiple_of(LANES));
        if self.stride == SHARP_COLUMNS
            && (1..=image.width().saturating_sub(2 * SHARP_COLUMNS - 1)).contains(&x0)
        {
            self.fill_sharp(image, x0, y0);
            return Some(());
        }
        self.work.resize(n * (rows + 1), 0.0);
        self.column.resize(n + 2, 0);
        let (left, right) = (x0.saturating_sub(1), (x0 + n + 1).min(image.width()));
        let first = left + 1 - x0;
        for (y, out) in self.work.chunks_exact_mut(n).enumerate() {
            let y = y0 + y;
            let [a, b, c] = [y.saturating_sub(1), y, (y + 1).min(image.height() - 1)]
                .map(|y| &image.row(y)[left..right]);
            let column = &mut self.column[first..][..right - left];
            for (((sum, &a), &b), &c) in column.iter_mut().zip(a).zip(b).zip(c) {
                *sum = u16::from(a) + 2 * u16::from(b) + u16::from(c);
            }
            if first == 1 {
                self.column[0] = self.column[1];
            }
            if right < x0 + n + 1 {
                self.column[n + 1] = self.column[n];
            }
            let (l, m, r) = (&self.column[..n], &self.column[1..][..n], &self.column[2..][..n]);
            for (((out, l), m), r) in out.iter_mut().zip(l).zip(m).zip(r) {
                *out = f32::from(l + 2 * m + r) * (1.0 / 16.0);
            }
        }
        let stride = self.stride;
        for g in [&mut self.gx, &mut self.gy] {
            g.clear();
            g.resize(stride * rows, 0.0);
        }
        for y in 0..rows {
            let (top, bottom) = (&self.work[y * n..][..n], &self.work[(y + 1) * n..][..n]);
            let gx = &mut self.gx[y * stride..][..columns];
            let gy = &mut self.gy[y * stride..][..columns];
            let (t1, b1) = (&top[1..][..columns], &bottom[1..][..columns]);
            let (t0, b0) = (&top[..columns], &bottom[..columns]);
            for x in 0..columns {
                gx[x] = 0.5 * ((t1[x] - t0[x]) + (b1[x] - b0[x]));
                gy[x] = 0.5 * ((b0[x] - t0[x]) + (b1[x] - t1[x]));
            }
        }
        Some(())
    }

    /// The same for the window of a sharp corner away from the image's left and right border: most windows. Their
    /// width is known when this is compiled, and rows are read a little beyond their end; weights are zero there.
    #[inline(always)]
    fn fill_sharp(&mut self, image: &Gray, x0: usize, y0: usize) {
        // Step by step for all rows: what has just been written would have to be waited for.
        const N: usize = SHARP_COLUMNS;
        // One more than gradients, and what fills the vector up.
        const M: usize = N + 8;
        self.column.resize(2 * N * (self.rows + 1), 0);
        self.work.resize(M * (self.rows + 1), 0.0);
        for g in [&mut self.gx, &mut self.gy] {
            g.resize(self.rows * N, 0.0);
        }
        let columns = self.column.as_chunks_mut::<{ 2 * N }>().0;
        for (y, column) in (y0..).zip(&mut *columns) {
            let [a, b, c]: [&[u8; 2 * N]; 3] =
                [y.saturating_sub(1), y, (y + 1).min(image.height() - 1)]
                    .map(|y| image.row(y)[x0 - 1..].first_chunk().expect("the caller has looked"));
            for i in 0..2 * N {
                column[i] = u16::from(a[i]) + 2 * u16::from(b[i]) + u16::from(c[i]);
            }
        }
        let smooth = self.work.as_chunks_mut::<M>().0;
        for (out, column) in smooth.iter_mut().zip(columns) {
            for i in 0..M {
                let sum = column[i] + 2 * column[i + 1] + column[i + 2];
                out[i] = f32::from(sum) * (1.0 / 16.0);
            }
        }
        let (gx, gy) = (self.gx.as_chunks_mut::<N>().0, self.gy.as_chunks_mut::<N>().0);
        for (([top, bottom], gx), gy) in smooth.array_windows().zip(gx).zip(gy) {
            let (mut on_x, mut on_y) = ([0.0; N], [0.0; N]);
            for x in 0..N {
                let (right, left) = (bottom[x + 1] - top[x], top[x + 1] - bottom[x]);
                // Half of (t1 − t0) + (b1 − b0) and of (b0 − t0) + (b1 − t1).
                on_x[x] = 0.5 * (right + left);
                on_y[x] = 0.5 * (right - left);
            }
            (*gx, *gy) = (on_x, on_y);
        }
    }

    /// The sums Σ w g gᵀ(p − q), and how fast they fall as q moves; `None` where no two edges cross.
    #[inline(always)]
    fn slope(&self, cross: &Cross, q: [f64; 2]) -> Option<(Slope, [f64; 2])> {
        // The width of most windows is known when this is compiled.
        let sums = match self.stride {
            SHARP_COLUMNS => self.slope_sums(cross, q, SHARP_COLUMNS),
            stride => self.slope_sums(cross, q, stride),
        };
        let [a, b, c, rx, ry, xa, xb, ya, yb] = sums;
        let det = a * c - b * b;
        // Two edges of different directions: the smaller eigenvalue is a fair part of the larger.
        if !(det > 0.02 * (a + c) * (a + c) / 4.0) {
            return None;
        }
        // The slope of the weight in pixels: its slope per square times the inverse of the axes.
        let [u, v] = cross.inverse.map(|row| row.map(f64::from));
        let moving = Slope([
            [a + xa * u[0] + xb * v[0], b + xa * u[1] + xb * v[1]],
            [b + ya * u[0] + yb * v[0], c + ya * u[1] + yb * v[1]],
        ]);
        let falls = moving.0[0][0] + moving.0[1][1] > 0.0 && moving.det() > MIN_SLOPE * det;
        let slope = if falls { moving } else { Slope([[a, b], [b, c]]) };
        Some((slope, [rx, ry]))
    }

    /// The triangle of Σ w g gᵀ, Σ w g (gᵀr), and Σ g (gᵀr)·(∇w)ᵀ with the slope of the weight along the board's axes.
    #[inline(always)]
    fn slope_sums(&self, cross: &Cross, q: [f64; 2], stride: usize) -> [f64; 9] {
        let mut sums = [[0.0_f32; LANES]; 9];
        let first_dx = (self.x0 - q[0]) as f32;
        for y in 0..self.rows {
            let dy = (self.y0 + y as f64 - q[1]) as f32;
            let gx = self.gx[y * stride..][..stride].as_chunks::<LANES>().0;
            let gy = self.gy[y * stride..][..stride].as_chunks::<LANES>().0;
            let mut dx0 = first_dx;
            for (gx, gy) in gx.iter().zip(gy) {
                for k in 0..LANES {
                    let dx = dx0 + k as f32;
                    let [w, wa, wb] = cross.weight_and_slope(dx, dy);
                    let (wx, wy) = (w * gx[k], w * gy[k]);
                    let along = gx[k] * dx + gy[k] * dy;
                    sums[0][k] += wx * gx[k];
                    sums[1][k] += wx * gy[k];
                    sums[2][k] += wy * gy[k];
                    sums[3][k] += wx * along;
                    sums[4][k] += wy * along;
                    let (along_x, along_y) = (along * gx[k], along * gy[k]);
                    sums[5][k] += along_x * wa;
                    sums[6][k] += along_x * wb;
                    sums[7][k] += along_y * wa;
                    sums[8][k] += along_y * wb;
                }
                dx0 += LANES as f32;
            }
        }
        sums.map(sum)
    }

    /// The sums Σ w g gᵀ(p − q) alone.
    #[inline(always)]
    fn pull(&self, cross: &Cross, q: [f64; 2]) -> [f64; 2] {
        match self.stride {
            SHARP_COLUMNS => self.pull_sums(cross, q, SHARP_COLUMNS),
            stride => self.pull_sums(cross, q, stride),
        }
    }

    #[inline(always)]
    fn pull_sums(&self, cross: &Cross, q: [f64; 2], stride: usize) -> [f64; 2] {
        let mut sums = [[0.0_f32; LANES]; 2];
        let first_dx = (self.x0 - q[0]) as f32;
        for y in 0..self.rows {
            let dy = (self.y0 + y as f64 - q[1]) as f32;
            let gx = self.gx[y * stride..][..stride].as_chunks::<LANES>().0;
            let gy = self.gy[y * stride..][..stride].as_chunks::<LANES>().0;
            let mut dx0 = first_dx;
            for (gx, gy) in gx.iter().zip(gy) {
                for k in 0..LANES {
                    let dx = dx0 + k as f32;
                    let along = cross.weight(dx, dy) * (gx[k] * dx + gy[k] * dy);
                    sums[0][k] += along * gx[k];
                    sums[1][k] += along * gy[k];
                }
                dx0 += LANES as f32;
            }
        }
        sums.map(sum)
    }

    /// Standard deviation per coordinate, pixels per grey level of noise.
    ///
    /// The derivative of Σ w g (gᵀr) by one gradient is w·((gᵀr)·1 + g·rᵀ), and K⁻¹ takes it to the corner. A gradient
    /// is half a difference of 2 × 2 smoothed pixels, and those are (1 2 1)/4 of the raw ones along both axes. Together
    /// a gradient along one axis is (−1 −1 1 1) along that and (1 3 3 1) along the other, over 32.
    #[inline(always)]
    fn sigma(&mut self, cross: &Cross, slope: &Slope, q: [f64; 2]) -> f64 {
        let covariance = match self.stride {
            SHARP_COLUMNS => self.raw_covariance(cross, q, SHARP_COLUMNS),
            stride => self.raw_covariance(cross, q, stride),
        };
        (0.5 * slope.covariance_trace(covariance)).sqrt() / 32.0
    }

    /// Σ over the raw pixels of the products of their influences on both sums, times 32².
    #[inline(always)]
    fn raw_covariance(&mut self, cross: &Cross, q: [f64; 2], stride: usize) -> [f64; 3] {
        // Influences of the gradients: for each of both sums that of gx and that of gy, in planes with three rows of
        // zeros before and after.
        let size = (self.rows + 6) * stride;
        self.work.resize(4 * size, 0.0);
        let planes = quarters(&mut self.work, size);
        let [of_gx_on_x, of_gy_on_x, of_gx_on_y, of_gy_on_y] = planes;
        let (before, after) = (3 * stride, (self.rows + 3) * stride);
        for plane in [&mut *of_gx_on_x, of_gy_on_x, of_gx_on_y, of_gy_on_y] {
            plane[..before].fill(0.0);
            plane[after..].fill(0.0);
        }
        // Whole vectors at a time, by way of arrays: the compiler need not mind that planes might overlap.
        let first_dx = (self.x0 - q[0]) as f32;
        for y in 0..self.rows {
            let dy = (self.y0 + y as f64 - q[1]) as f32;
            for x in (0..stride).step_by(LANES) {
                let (gx, gy) = (lanes(&self.gx, y * stride + x), lanes(&self.gy, y * stride + x));
                let mut on = [[0.0; LANES]; 4];
                for i in 0..LANES {
                    let dx = first_dx + (x + i) as i32 as f32;
                    let w = cross.weight(dx, dy);
                    let (gx, gy) = (w * gx[i], w * gy[i]);
                    let along = gx * dx + gy * dy;
                    on[0][i] = along + gx * dx;
                    on[1][i] = gx * dy;
                    on[2][i] = gy * dx;
                    on[3][i] = along + gy * dy;
                }
                let at = (y + 3) * stride + x;
                of_gx_on_x[at..][..LANES].copy_from_slice(&on[0]);
                of_gy_on_x[at..][..LANES].copy_from_slice(&on[1]);
                of_gx_on_y[at..][..LANES].copy_from_slice(&on[2]);
                of_gy_on_y[at..][..LANES].copy_from_slice(&on[3]);
            }
        }
        // Raw pixels, row by row: first along y, which needs no shift, then along x. What a pixel and the one below it
        // do is alike after this much smoothing: every second row stands for two.
        let wide = stride + LANES + 3;
        let n_rows = (self.rows + 3).div_ceil(2);
        self.rows_of_raw.clear();
        self.rows_of_raw.resize(4 * n_rows * wide, 0.0);
        let [a_x, b_x, a_y, b_y] = quarters(&mut self.rows_of_raw, n_rows * wide);
        for row in 0..n_rows {
            for x in (0..stride).step_by(LANES) {
                let from = 2 * row * stride + x;
                let to = row * wide + 3 + x;
                a_x[to..][..LANES]
                    .copy_from_slice(&one_three_three_one(four(of_gx_on_x, from, stride)));
                a_y[to..][..LANES]
                    .copy_from_slice(&one_three_three_one(four(of_gx_on_y, from, stride)));
                b_x[to..][..LANES]
                    .copy_from_slice(&one_one_minus_minus(four(of_gy_on_x, from, stride)));
                b_y[to..][..LANES]
                    .copy_from_slice(&one_one_minus_minus(four(of_gy_on_y, from, stride)));
            }
        }
        let mut sums = [[0.0_f32; LANES]; 3];
        for row in 0..n_rows {
            for x in (0..stride + LANES).step_by(LANES) {
                let at = row * wide + x;
                let (x, y) = (along_row(a_x, b_x, at), along_row(a_y, b_y, at));
                for i in 0..LANES {
                    sums[0][i] += x[i] * x[i];
                    sums[1][i] += x[i] * y[i];
                    sums[2][i] += y[i] * y[i];
                }
            }
        }
        sums.map(|lanes| 2.0 * sum(lanes))
    }
}

/// The sum of all lanes.
fn sum(lanes: [f32; LANES]) -> f64 {
    lanes.iter().map(|&v| f64::from(v)).sum()
}

/// Numbers at and after a place.
#[inline(always)]
fn lanes(numbers: &[f32], at: usize) -> [f32; LANES] {
    *numbers[at..].first_chunk().expect("rows are whole vectors, or end in zeros")
}

/// The same in four rows one below the other, or in one row at four places one after the other.
#[inline(always)]
fn four(numbers: &[f32], at: usize, step: usize) -> [[f32; LANES]; 4] {
    let [a, b, c, d] = [at, at + step, at + 2 * step, at + 3 * step];
    [lanes(numbers, a), lanes(numbers, b), lanes(numbers, c), lanes(numbers, d)]
}

/// Influences of raw pixels, from those of gx and gy that have been summed along y.
#[inline(always)]
fn along_row(of_gx: &[f32], of_gy: &[f32], at: usize) -> [f32; LANES] {
    let across = one_one_minus_minus(four(of_gx, at, 1));
    let mut sum = one_three_three_one(four(of_gy, at, 1));
    for i in 0..LANES {
        sum[i] += across[i];
    }
    sum
}

#[inline(always)]
fn one_three_three_one([a, b, c, d]: [[f32; LANES]; 4]) -> [f32; LANES] {
    let mut sum = [0.0; LANES];
    for i in 0..LANES {
        sum[i] = (a[i] + d[i]) + 3.0 * (b[i] + c[i]);
    }
    sum
}

#[inline(always)]
fn one_one_minus_minus([a, b, c, d]: [[f32; LANES]; 4]) -> [f32; LANES] {
    let mut sum = [0.0; LANES];
    for i in 0..LANES {
        sum[i] = (a[i] + b[i]) - (c[i] + d[i]);
    }
    sum
}

/// Four quarters, of `size` each.
fn quarters(memory: &mut [f32], size: usize) -> [&mut [f32]; 4] {
    let (first, rest) = memory.split_at_mut(size);
    let (second, rest) = rest.split_at_mut(size);
    let (third, rest) = rest.split_at_mut(size);
    [first, second, third, &mut rest[..size]]
}

/// What rounding to 8 bits adds, grey levels: √(1/12).
const ROUNDING: f64 = 0.288_675;

/// Standard deviation of the image's noise, grey levels: the median response to a kernel that cancels any smooth
/// surface (Immerkær, CVIU 1996), so that edges and texture, being few, do not count. Never below
/// [`ROUNDING`].
fn noise_sigma(image: &Gray) -> f64 {
    let (width, height) = (image.width(), image.height());
    if width < 3 || height < 3 {
        return ROUNDING;
    }
    // Whole rows, evenly spread, with some thousand pixels together: the median of n is good to 1.2/√n.
    let n_rows = (PIXELS_FOR_NOISE / width).clamp(8, height.max(8)).min(height - 2);
    let mut values = vec![0_u16; width - 2];
    let mut histogram = [0_u32; 2041];
    for k in 0..n_rows {
        let y = 1 + (2 * k + 1) * (height - 2) / (2 * n_rows);
        let [a, b, c] = [y - 1, y, y + 1].map(|y| image.row(y));
        vectorized(
            #[inline(always)]
            || roughness([a, b, c], &mut values),
        );
        for &value in &values {
            histogram[usize::from(value)] += 1;
        }
    }
    let n = (n_rows * values.len()) as f64;
    // The median of |N(0, s)| is 0.6745·s; the kernel has a gain of 6. Within a bin the count is spread evenly.
    let mut below = 0.0;
    let half = n / 2.0;
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

/// Pixels looked at for the noise, about.
const PIXELS_FOR_NOISE: usize = 5_000;

/// Magnitude of the response to Immerkær's kernel (1 −2 1)ᵀ(1 −2 1) for the middle one of three rows.
#[inline(always)]
fn roughness([a, b, c]: [&[u8]; 3], out: &mut [u16]) {
    let n = out.len();
    let [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] =
        [a, b, c].map(|row| [0, 1, 2].map(|dx| &row[dx..][..n]));
    let wide = i16::from;
    for i in 0..n {
        // At most 16 · 255: it fits.
        let second = |l: u8, m: u8, r: u8| wide(l) + wide(r) - 2 * wide(m);
        let value = second(a0[i], a1[i], a2[i]) + second(c0[i], c1[i], c2[i])
            - 2 * second(b0[i], b1[i], b2[i]);
        out[i] = value.unsigned_abs();
    }
}
