//! The part of an image about a corner, and sums over the gradients in it.
//!
//! What `refine` needs of them: the pull of the edges' gradients on the corner, how fast it changes as the corner
//! moves, and what the noise of the pixels does to it. Most of the time of a detection is spent here, so that the
//! vectors are written out: left to itself the compiler keeps the sums in memory.

use fearless_simd::{Simd, f32x16, prelude::*};

use crate::{image::Gray, solve};

/// Least determinant of the slope, as a fraction of that without the motion of the weights: below, noise rules.
const MIN_SLOPE: f64 = 0.1;
/// What is left of the slope at least, of its determinant: below, nobody can tell how much.
const LEAST_SLOPE: f64 = 0.03;

/// How fast the sums Σ w g gᵀ(p − q) fall as q moves: a matrix K, so that q + K⁻¹·sums is where they vanish.
///
/// K = M + N: M = Σ w g gᵀ would be all if the weights stood still. They move with q, and on a blurred edge what comes
/// in on one side pulls, what goes out on the other pulls less: N = Σ g (gᵀr)·(∇w)ᵀ takes a tenth off M at a blur of
/// σ = 2 px, and hence adds a tenth to σ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    k: [[f64; 2]; 2],
    /// By how much σ is larger than this slope says. Where blur has taken most of it (a wide blur within a narrow rim),
    /// M takes its place, which leads to the same corner; noise moves that as much farther as the slope is less.
    widens: f64,
}

impl Slope {
    /// From M and N.
    fn new(m: [[f64; 2]; 2], n: [[f64; 2]; 2]) -> Self {
        let det = |[[a, b], [c, d]]: [[f64; 2]; 2]| a * d - b * c;
        let k = [0, 1].map(|i| [0, 1].map(|j| m[i][j] + n[i][j]));
        let left = if k[0][0] + k[1][1] > 0.0 { det(k) / det(m) } else { 0.0 };
        if left > MIN_SLOPE {
            Self { k, widens: 1.0 }
        } else {
            // As though both directions had lost as much.
            Self { k: m, widens: left.max(LEAST_SLOPE).sqrt().recip() }
        }
    }

    fn det(&self) -> f64 {
        let [[a, b], [c, d]] = self.k;
        a * d - b * c
    }

    /// K⁻¹ v.
    pub(super) fn divide(&self, v: [f64; 2]) -> [f64; 2] {
        let [[a, b], [c, d]] = self.k;
        let det = self.det();
        [(d * v[0] - b * v[1]) / det, (a * v[1] - c * v[0]) / det]
    }

    /// Trace of K⁻¹ V K⁻ᵀ for a symmetric V = [xx xy; xy yy].
    fn covariance_trace(&self, [xx, xy, yy]: [f64; 3]) -> f64 {
        let [[a, b], [c, d]] = self.k;
        let (x, y) = (d * d + c * c, a * a + b * b);
        let det = self.det();
        (x * xx - 2.0 * (b * d + a * c) * xy + y * yy) / det / det
    }
}

/// The region of the edges through a corner, in board coordinates.
pub(super) struct Cross {
    pub(super) inverse: [[f32; 2]; 2],
    /// One over the reach along each axis, squares.
    pub(super) along: [f32; 2],
    /// One over the half-width across the other axis' edge, squares.
    pub(super) width: [f32; 2],
}

/// Many pixels side by side.
type Lanes<I> = f32x16<I>;

/// Pixels handled at a time.
const LANES: usize = 16;

/// A [`Cross`], ready for [`LANES`] pixels at a time.
struct Bumps<I: Simd> {
    inverse: [[Lanes<I>; 2]; 2],
    along: [Lanes<I>; 2],
    width: [Lanes<I>; 2],
    zero: Lanes<I>,
    one: Lanes<I>,
    minus_two: Lanes<I>,
}

impl<I: Simd> Bumps<I> {
    #[inline(always)]
    fn new(simd: I, cross: &Cross) -> Self {
        let splat = |v: f32| Lanes::splat(simd, v);
        let two = |[a, b]: [f32; 2]| [splat(a), splat(b)];
        let [first, second] = cross.inverse;
        Self {
            inverse: [two(first), two(second)],
            along: two(cross.along),
            width: two(cross.width),
            zero: splat(0.0),
            one: splat(1.0),
            minus_two: splat(-2.0),
        }
    }

    /// Board coordinates of pixels at these offsets from the corner.
    #[inline(always)]
    fn place(&self, dx: Lanes<I>, dy: Lanes<I>) -> [Lanes<I>; 2] {
        let [[a, b], [c, d]] = self.inverse;
        [a * dx + b * dy, c * dx + d * dy]
    }

    #[inline(always)]
    fn bump(&self, t: Lanes<I>) -> Lanes<I> {
        (self.one - t * t).max(self.zero)
    }

    /// Weight of pixels at these offsets from the corner, 0..=1: smooth, symmetric, zero outside.
    #[inline(always)]
    fn weight(&self, dx: Lanes<I>, dy: Lanes<I>) -> Lanes<I> {
        let [a, b] = self.place(dx, dy);
        // The edge along the first axis lies where b is small, the other where a is.
        let first = self.bump(a * self.along[0]) * self.bump(b * self.width[1]);
        let second = self.bump(b * self.along[1]) * self.bump(a * self.width[0]);
        first.max(second)
    }

    /// The weight and its slope along both axes of the board, per square.
    #[inline(always)]
    fn weight_and_slope(&self, dx: Lanes<I>, dy: Lanes<I>) -> [Lanes<I>; 3] {
        let [a, b] = self.place(dx, dy);
        let (first_a, first_b) = (self.bump(a * self.along[0]), self.bump(b * self.width[1]));
        let (second_a, second_b) = (self.bump(a * self.width[0]), self.bump(b * self.along[1]));
        let (first, second) = (first_a * first_b, second_a * second_b);
        let is_first = first.simd_gt(second);
        let weight = first.max(second);
        let minus_two = weight.simd_gt(self.zero).select(self.minus_two, self.zero);
        let scale_a = is_first.select(self.along[0], self.width[0]);
        let scale_b = is_first.select(self.width[1], self.along[1]);
        let (other_a, other_b) =
            (is_first.select(first_b, second_b), is_first.select(first_a, second_a));
        [
            weight,
            minus_two * a * (scale_a * scale_a) * other_a,
            minus_two * b * (scale_b * scale_b) * other_b,
        ]
    }
}

/// Gradients of a square part of the image, each at the centre of four pixels, after smoothing by (1 2 1)/4 along both
/// axes: without it, sharp edges are undersampled and their squared gradients pull the corner towards pixel centres
/// (0.07 px at a blur of σ = 0.6 px).
#[derive(Debug, Default)]
pub(super) struct Window {
    /// Position of the first gradient.
    x0: f64,
    y0: f64,
    rows: usize,
    /// Gradients in a row, padded to a multiple of [`LANES`] with what the weights make zero.
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
    pub(super) fn fill(&mut self, image: &Gray, cx: i64, cy: i64, half: i64) -> Option<()> {
        let clip = |c: i64, size: usize| ((c - half).max(0), (c + half).min(size as i64 - 1));
        let (x0, x1) = clip(cx, image.width());
        let (y0, y1) = clip(cy, image.height());
        if x1 - x0 < 3 || y1 - y0 < 3 {
            return None;
        }
        let (x0, y0) = (x0 as usize, y0 as usize);
        let (columns, rows) = (x1 as usize - x0, y1 as usize - y0);
        (self.x0, self.y0) = (x0 as f64 + 0.5, y0 as f64 + 0.5);
        (self.rows, self.stride) = (rows, columns.next_multiple_of(LANES));
        // Most windows are one or two vectors wide, and away from the image's left and right border.
        let fits = |read: usize| x0 >= 1 && x0 - 1 + read <= image.width();
        match self.stride {
            16 if fits(32) => self.fill_inside::<16, 24, 32>(image, x0, y0),
            32 if fits(48) => self.fill_inside::<32, 40, 48>(image, x0, y0),
            _ => self.fill_clipped(image, x0, y0, columns),
        }
        Some(())
    }

    /// The window wherever it is: beyond the image its border repeats.
    #[inline(always)]
    fn fill_clipped(&mut self, image: &Gray, x0: usize, y0: usize, columns: usize) {
        // Smoothed pixels: one more than gradients along both axes.
        let (n, rows) = (columns + 1, self.rows);
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
    }

    /// The same where nothing is clipped, for rows of N gradients, from N + 8 smoothed pixels and N + 16 raw ones: one
    /// more than gradients is needed, and what fills the vector up. Rows are read a little beyond their end; weights
    /// are zero there.
    #[inline(always)]
    fn fill_inside<const N: usize, const SMOOTH: usize, const RAW: usize>(
        &mut self,
        image: &Gray,
        x0: usize,
        y0: usize,
    ) {
        const { assert!(SMOOTH == N + 8 && RAW == N + 16) };
        // Step by step for all rows: what has just been written would have to be waited for.
        self.column.resize(RAW * (self.rows + 1), 0);
        self.work.resize(SMOOTH * (self.rows + 1), 0.0);
        for g in [&mut self.gx, &mut self.gy] {
            g.resize(self.rows * N, 0.0);
        }
        let columns = self.column.as_chunks_mut::<RAW>().0;
        for (y, column) in (y0..).zip(&mut *columns) {
            let [a, b, c]: [&[u8; RAW]; 3] =
                [y.saturating_sub(1), y, (y + 1).min(image.height() - 1)]
                    .map(|y| image.row(y)[x0 - 1..].first_chunk().expect("the caller has looked"));
            for i in 0..RAW {
                column[i] = u16::from(a[i]) + 2 * u16::from(b[i]) + u16::from(c[i]);
            }
        }
        let smooth = self.work.as_chunks_mut::<SMOOTH>().0;
        for (out, column) in smooth.iter_mut().zip(columns) {
            for i in 0..SMOOTH {
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

    /// Calls `add` for all gradients, [`LANES`] at a time: with where they lie, as offsets from q along x and y, the
    /// offset of the first of them in [`gx`](Self::gx), and the gradients along x and y.
    #[inline(always)]
    fn each<I: Simd>(
        &self,
        simd: I,
        q: [f64; 2],
        mut add: impl FnMut(usize, [Lanes<I>; 2], [Lanes<I>; 2]),
    ) {
        let first = Lanes::from_fn(simd, |k| k as f32) + (self.x0 - q[0]) as f32;
        for y in 0..self.rows {
            let dy = Lanes::splat(simd, (self.y0 + y as f64 - q[1]) as f32);
            let mut dx = first;
            for x in (0..self.stride).step_by(LANES) {
                let at = y * self.stride + x;
                add(at, [dx, dy], [lanes(simd, &self.gx, at), lanes(simd, &self.gy, at)]);
                dx += LANES as f32;
            }
        }
    }

    /// The sums Σ w g gᵀ(p − q), and how fast they fall as q moves; `None` where no two edges cross.
    #[inline(always)]
    pub(super) fn slope<I: Simd>(
        &self,
        simd: I,
        cross: &Cross,
        q: [f64; 2],
    ) -> Option<(Slope, [f64; 2])> {
        // The triangle of Σ w g gᵀ, Σ w g (gᵀr), and Σ g (gᵀr)·(∇w)ᵀ with the slope of the weight along the board's
        // axes.
        let bumps = Bumps::new(simd, cross);
        let mut sums = [bumps.zero; 9];
        self.each(
            simd,
            q,
            #[inline(always)]
            |_, [dx, dy], [gx, gy]| {
                let [w, wa, wb] = bumps.weight_and_slope(dx, dy);
                let (wx, wy) = (w * gx, w * gy);
                let along = gx * dx + gy * dy;
                let (along_x, along_y) = (along * gx, along * gy);
                sums[0] += wx * gx;
                sums[1] += wx * gy;
                sums[2] += wy * gy;
                sums[3] += wx * along;
                sums[4] += wy * along;
                sums[5] += along_x * wa;
                sums[6] += along_x * wb;
                sums[7] += along_y * wa;
                sums[8] += along_y * wb;
            },
        );
        let [a, b, c, rx, ry, xa, xb, ya, yb] = sums.map(sum);
        let det = a * c - b * b;
        // Two edges of different directions: the smaller eigenvalue is a fair part of the larger.
        if !(det > 0.02 * (a + c) * (a + c) / 4.0) {
            return None;
        }
        // The slope of the weight in pixels: its slope per square times the inverse of the axes.
        let [u, v] = cross.inverse.map(|row| row.map(f64::from));
        let moving = [
            [xa * u[0] + xb * v[0], xa * u[1] + xb * v[1]],
            [ya * u[0] + yb * v[0], ya * u[1] + yb * v[1]],
        ];
        Some((Slope::new([[a, b], [b, c]], moving), [rx, ry]))
    }

    /// The sums Σ w g gᵀ(p − q) alone.
    #[inline(always)]
    pub(super) fn pull<I: Simd>(&self, simd: I, cross: &Cross, q: [f64; 2]) -> [f64; 2] {
        let bumps = Bumps::new(simd, cross);
        let mut sums = [bumps.zero; 2];
        self.each(
            simd,
            q,
            #[inline(always)]
            |_, [dx, dy], [gx, gy]| {
                let along = bumps.weight(dx, dy) * (gx * dx + gy * dy);
                sums[0] += along * gx;
                sums[1] += along * gy;
            },
        );
        sums.map(sum)
    }

    /// Standard deviation per coordinate, pixels per grey level of noise.
    ///
    /// The derivative of Σ w g (gᵀr) by one gradient is w·((gᵀr)·1 + g·rᵀ), and K⁻¹ takes it to the corner. A gradient
    /// is half a difference of 2 × 2 smoothed pixels, and those are (1 2 1)/4 of the raw ones along both axes. Together
    /// a gradient along one axis is (−1 −1 1 1) along that and (1 3 3 1) along the other, over 32.
    #[inline(always)]
    pub(super) fn sigma<I: Simd>(
        &mut self,
        simd: I,
        cross: &Cross,
        slope: &Slope,
        q: [f64; 2],
    ) -> f64 {
        let covariance = self.raw_covariance(simd, cross, q);
        slope.widens * (0.5 * slope.covariance_trace(covariance)).sqrt() / 32.0
    }

    /// Σ over the raw pixels of the products of their influences on both sums, times 32².
    #[inline(always)]
    fn raw_covariance<I: Simd>(&mut self, simd: I, cross: &Cross, q: [f64; 2]) -> [f64; 3] {
        // Influences of the gradients: for each of both sums that of gx and that of gy, in planes with three rows of
        // zeros before and after.
        let (rows, stride) = (self.rows, self.stride);
        let size = (rows + 6) * stride;
        let mut work = std::mem::take(&mut self.work);
        work.resize(4 * size, 0.0);
        let planes = quarters(&mut work, size);
        let (before, after) = (3 * stride, (rows + 3) * stride);
        let [of_gx_on_x, of_gy_on_x, of_gx_on_y, of_gy_on_y] = planes.map(|plane| {
            plane[..before].fill(0.0);
            plane[after..].fill(0.0);
            plane
        });
        let bumps = Bumps::new(simd, cross);
        self.each(
            simd,
            q,
            #[inline(always)]
            |at, [dx, dy], [gx, gy]| {
                let w = bumps.weight(dx, dy);
                let (gx, gy) = (w * gx, w * gy);
                let along = gx * dx + gy * dy;
                let at = before + at;
                store(along + gx * dx, of_gx_on_x, at);
                store(gx * dy, of_gy_on_x, at);
                store(gy * dx, of_gx_on_y, at);
                store(along + gy * dy, of_gy_on_y, at);
            },
        );
        // Raw pixels, row by row: first along y, which needs no shift, then along x. What a pixel and the one below it
        // do is alike after this much smoothing: every second row stands for two.
        let wide = stride + LANES + 3;
        let n_rows = (rows + 3).div_ceil(2);
        self.rows_of_raw.clear();
        self.rows_of_raw.resize(4 * n_rows * wide, 0.0);
        let [a_x, b_x, a_y, b_y] = quarters(&mut self.rows_of_raw, n_rows * wide);
        for row in 0..n_rows {
            for x in (0..stride).step_by(LANES) {
                let from = 2 * row * stride + x;
                let to = row * wide + 3 + x;
                store(one_three_three_one(four(simd, of_gx_on_x, from, stride)), a_x, to);
                store(one_three_three_one(four(simd, of_gx_on_y, from, stride)), a_y, to);
                store(one_one_minus_minus(four(simd, of_gy_on_x, from, stride)), b_x, to);
                store(one_one_minus_minus(four(simd, of_gy_on_y, from, stride)), b_y, to);
            }
        }
        let mut sums = [bumps.zero; 3];
        for row in 0..n_rows {
            for x in (0..stride + LANES).step_by(LANES) {
                let at = row * wide + x;
                let (x, y) = (along_row(simd, a_x, b_x, at), along_row(simd, a_y, b_y, at));
                sums[0] += x * x;
                sums[1] += x * y;
                sums[2] += y * y;
            }
        }
        self.work = work;
        sums.map(sum).map(|sum| 2.0 * sum)
    }
}

/// The sum of all lanes; the order of addition is the same on every processor.
#[inline(always)]
fn sum<I: Simd>(lanes: Lanes<I>) -> f64 {
    let (low, high) = lanes.widen();
    solve::sum(low + high)
}

/// Numbers at and after a place.
#[inline(always)]
fn lanes<I: Simd>(simd: I, numbers: &[f32], at: usize) -> Lanes<I> {
    let lanes: &[f32; LANES] =
        numbers[at..].first_chunk().expect("rows are whole vectors, or end in zeros");
    Lanes::simd_from(simd, *lanes)
}

#[inline(always)]
fn store<I: Simd>(lanes: Lanes<I>, numbers: &mut [f32], at: usize) {
    lanes.store_slice(&mut numbers[at..][..LANES]);
}

/// The same in four rows one below the other, or in one row at four places one after the other.
#[inline(always)]
fn four<I: Simd>(simd: I, numbers: &[f32], at: usize, step: usize) -> [Lanes<I>; 4] {
    let [a, b, c, d] = [at, at + step, at + 2 * step, at + 3 * step];
    [
        lanes(simd, numbers, a),
        lanes(simd, numbers, b),
        lanes(simd, numbers, c),
        lanes(simd, numbers, d),
    ]
}

/// Influences of raw pixels, from those of gx and gy that have been summed along y.
#[inline(always)]
fn along_row<I: Simd>(simd: I, of_gx: &[f32], of_gy: &[f32], at: usize) -> Lanes<I> {
    let across = one_one_minus_minus(four(simd, of_gx, at, 1));
    one_three_three_one(four(simd, of_gy, at, 1)) + across
}

#[inline(always)]
fn one_three_three_one<I: Simd>([a, b, c, d]: [Lanes<I>; 4]) -> Lanes<I> {
    (a + d) + (b + c) * 3.0
}

#[inline(always)]
fn one_one_minus_minus<I: Simd>([a, b, c, d]: [Lanes<I>; 4]) -> Lanes<I> {
    (a + b) - (c + d)
}

/// Four quarters, of `size` each.
fn quarters(memory: &mut [f32], size: usize) -> [&mut [f32]; 4] {
    let (first, rest) = memory.split_at_mut(size);
    let (second, rest) = rest.split_at_mut(size);
    let (third, rest) = rest.split_at_mut(size);
    [first, second, third, &mut rest[..size]]
}
