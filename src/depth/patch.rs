//! The board's whole surface in a depth map, reduced to some hundred patches.

use fearless_simd::{Level, Simd, dispatch, f64x8, prelude::*};

use super::{CornerDepth, Lattice, Texture};
use crate::{
    board::CharucoBoard,
    detect::{Corner, cells_and_pixels},
    geom::{Homography, Pixel},
    image::DepthMap,
    solve::{LANES, median, sum},
};

/// A small square of a depth map: one plane's worth of depth.
///
/// A plane's *inverse* depth is linear in the pixel for a pinhole, so that its mean over any pixels is its value at
/// their mean position, exactly, holes or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Mean position of the pixels that count, in the depth map.
    pub at: Pixel,
    /// Mean of 1/depth over them, per metre.
    pub inverse_per_m: f64,
    /// Standard deviation of single pixels about the patch's own plane, metres.
    pub noise_m: f64,
    /// Pixels that count.
    pub n: usize,
    /// Pixels without measurement.
    pub n_holes: usize,
}

/// In what steps a depth map is stored, on and round the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthSteps {
    /// Distinct values, of some thousand pixels.
    pub n_levels: usize,
    /// The median difference of neighbouring values as a share of the median depth.
    pub step_share: f64,
}

impl DepthSteps {
    fn of(mut depths_m: Vec<f32>) -> Option<Self> {
        depths_m.sort_by(f32::total_cmp);
        let middle_m = *depths_m.get(depths_m.len() / 2)?;
        depths_m.dedup();
        let gaps: Vec<f64> = depths_m.windows(2).map(|w| f64::from(w[1] - w[0])).collect();
        let step_m = if gaps.is_empty() { 0.0 } else { median(&gaps) };
        Some(Self { n_levels: depths_m.len(), step_share: step_m / f64::from(middle_m) })
    }
}

/// What a depth map says in and around the board's outline.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches {
    /// Side of a patch, pixels.
    pub side_px: usize,
    /// Patches with at least half of their pixels measured, row by row.
    pub measured: Vec<Patch>,
    /// Middles of the patches that have fewer, with the number of pixels without measurement.
    pub torn: Vec<(Pixel, usize)>,
    /// In what steps depth is stored; `None` where nothing was measured.
    pub steps: Option<DepthSteps>,
    /// Depth at the corners, straight and mirrored, by ascending id.
    pub corners: Vec<CornerDepth>,
    /// What is rough: the print, faintly.
    pub texture: Texture,
    /// Single pixels, to compare with those of the next frame.
    pub lattice: Lattice,
}

/// So many patches would fill the outline: enough to see the sensor's patterns, few enough to keep for every frame.
const PATCHES: f64 = 600.0;
/// Patches reach so far beyond the outline, squares: where depth does not lie where colour does, the board's rim is
/// elsewhere in the depth map.
const RIM_SQUARES: f64 = 1.0;
/// A pixel farther than so many standard deviations from its patch's plane does not count.
const OUTLIER_SIGMAS: f64 = 4.0;
/// Every so many pixels the stored value is noted.
const LEVEL_STRIDE: usize = 8;
/// Depth is quantised to 0.1 mm on disk; noise is never taken smaller.
const LEAST_NOISE_M: f64 = 5e-5;

/// Reduces a depth map to patches where these corners show the board, and a square beyond its outline. `None` for
/// fewer than six corners or corners that span no area.
pub fn patches(map: &DepthMap, board: &CharucoBoard, corners: &[Corner]) -> Option<Patches> {
    if corners.len() < 6 {
        return None;
    }
    let [cells, pixels] = cells_and_pixels(board, corners);
    let pixel_from_cell = Homography::from_points(&cells, &pixels)?;
    let cell_from_pixel = Homography::from_points(&pixels, &cells)?;
    let (right, bottom) = (board.squares_x as f64, board.squares_y as f64);
    // The outline may reach beyond the image, and beyond the horizon: bounds from the part that maps.
    let rim: Vec<Pixel> = outline(-RIM_SQUARES, right + RIM_SQUARES, bottom + RIM_SQUARES)
        .filter_map(|cell| pixel_from_cell.map(cell))
        .collect();
    let bound = |values: &dyn Fn(&Pixel) -> f64, size: usize| {
        let low = rim.iter().map(values).fold(f64::INFINITY, f64::min);
        let high = rim.iter().map(values).fold(f64::NEG_INFINITY, f64::max);
        (low.clamp(0.0, size as f64) as usize, high.clamp(0.0, size as f64) as usize)
    };
    let (left, width) = bound(&|p| p.x, map.width());
    let (top, height) = bound(&|p| p.y, map.height());
    let area = (width.saturating_sub(left) * height.saturating_sub(top)) as f64;
    let side_px = ((area / PATCHES).sqrt().round() as usize).max(4);
    let within = |x: usize, y: usize, rim: f64| {
        cell_from_pixel.map(Pixel::new(x as f64, y as f64)).is_some_and(|cell| {
            cell.x >= -rim && cell.y >= -rim && cell.x <= right + rim && cell.y <= bottom + rim
        })
    };
    let inside = |x: usize, y: usize| within(x, y, RIM_SQUARES);
    let read = |corner: &Corner| {
        let mirrored = Pixel::new(map.width() as f64 - 1.0 - corner.pixel.x, corner.pixel.y);
        CornerDepth {
            id: corner.id,
            straight_m: map.bilinear(corner.pixel),
            mirrored_m: map.bilinear(mirrored),
        }
    };
    let mut patches = Patches {
        side_px,
        measured: Vec::new(),
        torn: Vec::new(),
        steps: None,
        corners: corners.iter().map(read).collect(),
        texture: Texture::new(map, [left, top], [width, height]),
        lattice: Lattice::new(map, [left, top], [width, height], |x, y| within(x, y, 0.0)),
    };
    let mut levels_m = Vec::new();
    let mut samples = Samples::new(side_px);
    // A grid fixed to the image, so that patches of all frames lie at the same places.
    for y in (top / side_px * side_px..height).step_by(side_px) {
        for x in (left / side_px * side_px..width).step_by(side_px) {
            let (x1, y1) = (x + side_px - 1, y + side_px - 1);
            let corners = [(x, y), (x1, y), (x, y1), (x1, y1)];
            if x1 >= map.width()
                || y1 >= map.height()
                || !corners.iter().all(|&(x, y)| inside(x, y))
            {
                continue;
            }
            let middle = Pixel::new(0.5 * (x + x1) as f64, 0.5 * (y + y1) as f64);
            // Every so many of the pixels along both diagonals.
            for row in y..=y1 {
                let first = x + (LEVEL_STRIDE - (x + row) % LEVEL_STRIDE) % LEVEL_STRIDE;
                let stored = (first..=x1).step_by(LEVEL_STRIDE).map(|column| map.at(column, row));
                levels_m.extend(stored.filter(|&stored_m| stored_m > 0.0));
            }
            let (fitted, n_holes) = dispatch!(Level::new(), simd => {
                let n_holes = samples.fill(map, x, y);
                (patch(simd, middle, &samples, n_holes), n_holes)
            });
            match fitted.filter(|p| 2 * p.n >= side_px * side_px) {
                Some(patch) => patches.measured.push(patch),
                None => patches.torn.push((middle, n_holes)),
            }
        }
    }
    patches.steps = DepthSteps::of(levels_m);
    Some(patches)
}

/// Points on the rectangle from (low, low) to (right, bottom).
fn outline(low: f64, right: f64, bottom: f64) -> impl Iterator<Item = Pixel> {
    (0..=16).flat_map(move |i| {
        let share = f64::from(i) / 16.0;
        let (x, y) = (low + share * (right - low), low + share * (bottom - low));
        [(x, low), (x, bottom), (low, y), (right, y)].map(|(x, y)| Pixel::new(x, y))
    })
}

/// The pixels of a patch, in rows of whole vectors.
struct Samples {
    side: usize,
    /// Numbers in a row: a multiple of [`LANES`].
    stride: usize,
    /// 1/depth, per metre; 0 where there is no measurement, and after the row's last pixel.
    inverse_per_m: Vec<f64>,
}

impl Samples {
    fn new(side: usize) -> Self {
        let stride = side.next_multiple_of(LANES);
        Self { side, stride, inverse_per_m: vec![0.0; stride * side] }
    }

    /// Takes the pixels of the patch that begins at (x, y); says how many have no measurement.
    #[inline(always)]
    fn fill(&mut self, map: &DepthMap, x: usize, y: usize) -> usize {
        let mut n_holes = 0;
        for (row, out) in self.inverse_per_m.chunks_exact_mut(self.stride).enumerate() {
            let depths_m = &map.depth_m()[(y + row) * map.width() + x..][..self.side];
            for (out, &depth_m) in out.iter_mut().zip(depths_m) {
                let is_measured = depth_m > 0.0;
                n_holes += usize::from(!is_measured);
                *out = if is_measured { f64::from(depth_m).recip() } else { 0.0 };
            }
        }
        n_holes
    }
}

/// Fits 1/depth = a + b·x + c·y twice: the second time without pixels far off the first plane.
#[inline(always)]
fn patch<I: Simd>(simd: I, middle: Pixel, samples: &Samples, n_holes: usize) -> Option<Patch> {
    let origin = *samples.inverse_per_m.iter().find(|&&w| w > 0.0)?;
    let plane = Moments::of(simd, samples, origin, None).plane()?;
    let reach = OUTLIER_SIGMAS * plane.sigma.max(LEAST_NOISE_M * plane.at[2].powi(2));
    let second = Moments::of(simd, samples, plane.at[2], Some((&plane, reach)));
    let Plane { at: [x, y, inverse_per_m], sigma, .. } = second.plane()?;
    Some(Patch {
        at: Pixel::new(middle.x + x, middle.y + y),
        inverse_per_m,
        // δz = z²·δ(1/z)
        noise_m: sigma / inverse_per_m.powi(2),
        n: second.n as usize,
        n_holes,
    })
}

/// Sums over samples (x, y, w): pixels from the patch's middle, and w from a value near all of them, so that what is
/// squared is small.
struct Moments {
    origin: f64,
    n: f64,
    sum: [f64; 3],
    /// xx xy yy xw yw ww
    products: [f64; 6],
}

/// A plane w = at[2] + slope[0]·(x − at[0]) + slope[1]·(y − at[1]), and the σ of samples about it.
struct Plane {
    at: [f64; 3],
    slope: [f64; 2],
    sigma: f64,
}

impl Moments {
    /// Over all samples, or those within a distance of a plane.
    #[inline(always)]
    fn of<I: Simd>(simd: I, samples: &Samples, origin: f64, near: Option<(&Plane, f64)>) -> Self {
        let splat = |v: f64| f64x8::splat(simd, v);
        let (zero, one) = (splat(0.0), splat(1.0));
        let middle = 0.5 * (samples.side as f64 - 1.0);
        let ramp = f64x8::from_fn(simd, |k| k as f64);
        let mut sums = [zero; 10];
        for (row, values) in samples.inverse_per_m.chunks_exact(samples.stride).enumerate() {
            let y = splat(row as f64 - middle);
            for (chunk, values) in values.as_chunks::<LANES>().0.iter().enumerate() {
                let stored = f64x8::simd_from(simd, *values);
                let x = ramp + ((chunk * LANES) as f64 - middle);
                // Multiplied by 0 instead of passed over: no branch that depends on noise.
                let mut share = stored.simd_gt(zero).select(one, zero);
                if let Some((plane, reach)) = near {
                    let [px, py, pw] = plane.at;
                    let [b, c] = plane.slope;
                    let off = (stored - pw) - (x - px) * b - (y - py) * c;
                    share = off.abs().simd_le(splat(reach)).select(share, zero);
                }
                let w = stored - origin;
                let [sx, sy, sw] = [share * x, share * y, share * w];
                let of = [share, sx, sy, sw, sx * x, sx * y, sy * y, sx * w, sy * w, sw * w];
                for (sum, value) in sums.iter_mut().zip(of) {
                    *sum += value;
                }
            }
        }
        let [n, x, y, w, products @ ..] = sums.map(sum);
        Self { origin, n, sum: [x, y, w], products }
    }

    /// `None` for fewer than 8 samples or samples on one line.
    fn plane(&self) -> Option<Plane> {
        if self.n < 8.0 {
            return None;
        }
        let mean = self.sum.map(|sum| sum / self.n);
        let about = |i: usize, j: usize, product: f64| product - self.n * mean[i] * mean[j];
        let [xx, xy, yy, xw, yw, ww] = self.products;
        let (xx, xy, yy) = (about(0, 0, xx), about(0, 1, xy), about(1, 1, yy));
        let (xw, yw, ww) = (about(0, 2, xw), about(1, 2, yw), about(2, 2, ww));
        let determinant = xx * yy - xy * xy;
        if !(determinant > 1e-6 * xx * yy) {
            return None;
        }
        let slope = [(yy * xw - xy * yw) / determinant, (xx * yw - xy * xw) / determinant];
        let squares = ww - slope[0] * xw - slope[1] * yw;
        Some(Plane {
            at: [mean[0], mean[1], self.origin + mean[2]],
            slope,
            sigma: (squares.max(0.0) / (self.n - 3.0)).sqrt(),
        })
    }
}
