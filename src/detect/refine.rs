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

use fearless_simd::{Level as Processor, Simd, dispatch};

use crate::{geom::Pixel, image::Gray, math, par::vectorized};

use super::{
    map::length,
    pyramid::Level,
    window::{Cross, Slope, Window},
};

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
/// What pixels that undersample a sharp edge leave even in a noiseless picture, pixels.
const FLOOR_PX: f64 = 0.0175;
/// Width of the edges that are undersampled by so much, pixels: with wider edges it falls in proportion.
const UNDERSAMPLED: f64 = 1.5;

/// Largest factor by which a blurred picture is reduced.
const MAX_FACTOR: usize = 6;
/// Blur that a reduced picture may keep, pixels. A blurred edge can be two: the hand rests at both ends of a shake.
/// Reduced to this width they are one again, and the corner is the middle of the blur, as a person sees it.
const KEPT_BLUR: f64 = 5.0;
/// Uncertainty of where in a blur the corner is, as a fraction of the width beyond a sharp edge's.
const BLUR_SIGMA: f64 = 0.03;
/// Where a white rim is too narrow for its blur, the marker's own edge and bits pull the corner: this much for the
/// square of the pixels that are wanting, from simulated boards with rims of 0.075 to 0.25 squares.
const MARKER_SIGMA: f64 = 0.07;
/// How gently that sets in, pixels: blur has no end.
const MARKER_ONSET: f64 = 0.5;
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
    let wanting = widest / 2.0 + MIN_WIDTH - rim_px;
    let marker_sigma =
        MARKER_SIGMA * ((wanting + math::hypot(wanting, MARKER_ONSET)) / 2.0).powi(2);
    Some(Refined {
        pixel: Pixel::new(found.pixel.x * f + offset, found.pixel.y * f + offset),
        sigma_px: math::hypot(
            math::hypot(math::hypot(found.sigma_px * noise * f, floor), blur_sigma),
            marker_sigma,
        ),
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
    dispatch!(Processor::new(), simd => {
        iterate(simd, image, window, &cross, half, guess.pixel, reach_px)
    })
}

/// The fixed point of [`Window::solve`] that starts from a pixel, and its σ.
#[inline(always)]
fn iterate<I: Simd>(
    simd: I,
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
            Some((slope, at)) if near(at) => (slope, window.pull(simd, cross, q)),
            _ => {
                let (new, pull) = window.slope(simd, cross, q)?;
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
                sigma_px: window.sigma(simd, cross, &slope, q),
            });
        }
    }
    None
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
