//! What the depth sensor makes of a scene.

use super::{
    print::PrintedPlane,
    random::{Random, Subject},
    scene::{Scene, Seen, Sight},
};
use crate::{geom::Pixel, image::DepthMap, math};

/// A structured-light depth sensor, registered to the colour camera.
///
/// The numbers of [`DepthSensor::TRUEDEPTH`] follow the published recordings of the iPad 12.9" 5gen, fitted planes in
/// windows of 15x15 pixels: standard deviations of 0.21 mm at 0.19 m and 0.22–0.27 mm at 0.3 m, correlations of 0.75
/// from pixel to pixel and of 0.1–0.3 over four pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthSensor {
    /// Noise that does not depend on distance, metres: interpolation and quantisation of the disparity.
    pub noise_floor_m: f64,
    /// Noise that grows with the square of the distance, as an error of a triangulated disparity does, per metre:
    /// σ² = floor² + (z²·this)².
    pub noise_per_m: f64,
    /// Standard deviation of the Gaussian that correlates the noise of neighbours, pixels.
    pub correlation_px: f64,
    /// Part of the noise's standard deviation that varies over `smooth_px` only.
    pub smooth_part: f64,
    /// How far the smooth part reaches, pixels.
    pub smooth_px: f64,
    /// Nothing nearer is measured, metres; the limit is frayed by a few per cent.
    pub min_range_m: f64,
    /// Nothing seen more slantingly is measured: angle between ray and normal, radians.
    pub max_incidence_rad: f64,
    /// Half the width of the hole along a step in depth, pixels.
    pub edge_px: f64,
    /// Holes for no visible reason, per frame on average.
    pub blobs: f64,
    /// How much farther black ink is measured than white paper, metres: TrueDepth shows the print of the published
    /// boards by 0.2 to 0.3 mm, blurred.
    pub contrast_m: f64,
    /// Standard deviation of the Gaussian that blurs it, pixels.
    pub contrast_blur_px: f64,
    /// Columns at the left and right, rows at the top and bottom that the projector does not reach.
    pub border_px: [usize; 4],
    /// Depths are whole multiples of this, metres; 0 for none.
    pub unit_m: f64,
    /// Error: measured over true, minus 1.
    pub scale: f64,
    /// Error: measured minus true, metres.
    pub bias_m: f64,
    /// Error: the depth map shows a window of the image this wide and high (1 = all of it) about the principal point.
    pub zoom: [f64; 2],
    /// Error: the depth map's content lies this far right of and below its place, pixels.
    pub shift_px: [f64; 2],
}

impl DepthSensor {
    /// No noise, no holes, no errors.
    pub const PERFECT: Self = Self {
        noise_floor_m: 0.0,
        noise_per_m: 0.0,
        correlation_px: 0.0,
        smooth_part: 0.0,
        smooth_px: 1.0,
        min_range_m: 0.0,
        max_incidence_rad: std::f64::consts::FRAC_PI_2,
        edge_px: 0.0,
        blobs: 0.0,
        contrast_m: 0.0,
        contrast_blur_px: 1.0,
        border_px: [0; 4],
        unit_m: 0.0,
        scale: 1.0,
        bias_m: 0.0,
        zoom: [1.0; 2],
        shift_px: [0.0; 2],
    };

    /// As good as the real one where nothing is wrong with it.
    pub const TRUEDEPTH: Self = Self {
        noise_floor_m: 0.17e-3,
        noise_per_m: 2.2e-3,
        correlation_px: 0.95,
        smooth_part: 0.4,
        smooth_px: 14.0,
        min_range_m: 0.13,
        max_incidence_rad: 1.31,
        edge_px: 1.5,
        blobs: 2.0,
        contrast_m: 0.3e-3,
        contrast_blur_px: 8.0,
        border_px: [4, 3, 0, 2],
        unit_m: 1e-4,
        ..Self::PERFECT
    };

    /// Standard deviation of the noise at this depth, metres.
    pub fn noise_m(&self, depth_m: f64) -> f64 {
        let grown_m = depth_m * depth_m * self.noise_per_m;
        (self.noise_floor_m * self.noise_floor_m + grown_m * grown_m).sqrt()
    }
}

/// The depth map this sensor makes of a scene, of the size of the colour image: metres, NaN in holes. `seed` chooses
/// noise and holes.
pub fn measure_depth(scene: &Scene, sensor: &DepthSensor, seed: u64) -> DepthMap {
    measure_frame(scene, sensor, seed, 0)
}

/// As [`measure_depth`], with the noise of frame `frame`.
pub(super) fn measure_frame(
    scene: &Scene,
    sensor: &DepthSensor,
    seed: u64,
    frame: usize,
) -> DepthMap {
    let intrinsics = &scene.camera.intrinsics;
    let (width, height) = (intrinsics.width, intrinsics.height);
    let mut random = Random::new(seed, Subject::Depth, frame);
    let noise = Noise::new(sensor, width, height, &mut random);
    let ragged = Smooth::new(9.0, width, height, &mut random);
    let blobs = blobs(sensor, width, height, &mut random);
    let sight = Sight::new(scene);
    let min_cos = math::cos(sensor.max_incidence_rad);
    let [left, right, top, bottom] = sensor.border_px;
    let seen_at = |x: usize, y: usize| {
        if x < left || x + right >= width || y < top || y + bottom >= height {
            return None;
        }
        // The place in the colour image that this depth pixel looks at.
        let [dx, dy] = sensor.shift_px;
        let [zx, zy] = sensor.zoom;
        let window = |p: f64, zoom: f64, shift: f64, c: f64| c + zoom * (p - shift - c);
        let at = Pixel::new(
            window(x as f64, zx, dx, intrinsics.cx),
            window(y as f64, zy, dy, intrinsics.cy),
        );
        sight.seen(at)
    };
    let seen: Vec<Option<Seen>> =
        (0..width * height).map(|i| seen_at(i % width, i / width)).collect();
    let darkness = (sensor.contrast_m != 0.0).then(|| darkness(scene, sensor, width, &seen));
    let depth_at = |x: usize, y: usize| -> Option<f64> {
        let seen = seen[y * width + x]?;
        let frayed = || sensor.min_range_m * (1.0 + 0.04 * ragged.at(x, y));
        // Raggedness stays within ±5.2, the reach of its random numbers; most pixels need none.
        let too_near = seen.depth_m < 1.3 * sensor.min_range_m && seen.depth_m < frayed();
        let on_edge = seen.edge_px < 4.0 * sensor.edge_px
            && seen.edge_px < sensor.edge_px * (1.0 + 0.5 * ragged.at(x, y));
        if too_near || seen.cos_incidence < min_cos || on_edge {
            return None;
        }
        let in_blob = blobs.iter().any(|blob| {
            let (dx, dy) = (x as f64 - blob.x, y as f64 - blob.y);
            let r2 = dx * dx + dy * dy;
            // As above.
            r2 < 16.0 * blob.radius_px * blob.radius_px
                && r2.sqrt() < blob.radius_px * (1.0 + 0.5 * ragged.at(x, y))
        });
        if in_blob {
            return None;
        }
        let noise_m = sensor.noise_m(seen.depth_m) * noise.at(x, y);
        let dark = darkness.as_ref().map_or(0.0, |d| f64::from(d[y * width + x]));
        let measured =
            seen.depth_m * sensor.scale + sensor.bias_m + sensor.contrast_m * dark + noise_m;
        let unit = sensor.unit_m;
        let stored = if unit > 0.0 { (measured / unit).round() * unit } else { measured };
        (stored > 0.0).then_some(stored)
    };
    let depth_m = (0..width * height)
        .map(|i| depth_at(i % width, i / width).map_or(f32::NAN, |z| z as f32))
        .collect();
    DepthMap::new(width, height, depth_m)
}

/// What is printed where each pixel looks, blurred: −½ for paper, ½ for ink.
fn darkness(scene: &Scene, sensor: &DepthSensor, width: usize, seen: &[Option<Seen>]) -> Vec<f32> {
    let print = &scene.print;
    // The wall is taken for paper.
    let plane = PrintedPlane::new(&scene.board, print, print.paper);
    let dark = |seen: &Option<Seen>| {
        let reflectance = seen.as_ref().map_or(print.paper, |seen| plane.at(seen.square));
        ((print.paper - reflectance) / (print.paper - print.ink) - 0.5) as f32
    };
    let weights = gaussian(sensor.contrast_blur_px);
    let sum: f32 = weights.iter().sum();
    let radius = weights.len() / 2;
    let height = seen.len() / width;
    // The rim repeats beyond the map.
    let (wide, high) = (width + 2 * radius, height + 2 * radius);
    let inside = |i: usize, n: usize| i.saturating_sub(radius).min(n - 1);
    let framed: Vec<f32> = (0..wide * high)
        .map(|k| {
            dark(&seen[inside(k / wide, height) * width + inside(k % wide, width)]) / (sum * sum)
        })
        .collect();
    convolved(&framed, &weights, width, height)
}

/// A Gaussian of this standard deviation, sampled to three of them, 1 at its middle.
fn gaussian(sigma_px: f64) -> Vec<f32> {
    let radius = (3.0 * sigma_px).ceil() as usize;
    (0..=2 * radius)
        .map(|i| (i as f64 - radius as f64) / sigma_px.max(1e-9))
        .map(|x| math::exp(-0.5 * x * x) as f32)
        .collect()
}

/// A map with a frame of half the weights' length all round, convolved along rows and columns; the frame is gone.
fn convolved(framed: &[f32], weights: &[f32], width: usize, height: usize) -> Vec<f32> {
    let wide = width + weights.len() - 1;
    let mut across = vec![0.0f32; width * (height + weights.len() - 1)];
    for (out, row) in across.chunks_mut(width).zip(framed.chunks(wide)) {
        for (i, weight) in weights.iter().enumerate() {
            for (out, value) in out.iter_mut().zip(&row[i..]) {
                *out += weight * value;
            }
        }
    }
    let mut down = vec![0.0f32; width * height];
    for (y, out) in down.chunks_mut(width).enumerate() {
        for (i, weight) in weights.iter().enumerate() {
            for (out, value) in out.iter_mut().zip(&across[(y + i) * width..]) {
                *out += weight * value;
            }
        }
    }
    down
}

/// Round holes with ragged rims.
struct Blob {
    x: f64,
    y: f64,
    radius_px: f64,
}

fn blobs(sensor: &DepthSensor, width: usize, height: usize, random: &mut Random) -> Vec<Blob> {
    // Between none and twice as many as on average.
    let n = (random.between(0.0, 2.0) * sensor.blobs).round() as usize;
    (0..n)
        .map(|_| Blob {
            x: random.between(0.0, width as f64),
            y: random.between(0.0, height as f64),
            radius_px: random.between(1.5, 5.0),
        })
        .collect()
}

/// Noise with variance 1, part of it smooth.
struct Noise {
    width: usize,
    fine: Vec<f32>,
    fine_part: f64,
    smooth_part: f64,
    smooth: Smooth,
}

impl Noise {
    fn new(sensor: &DepthSensor, width: usize, height: usize, random: &mut Random) -> Self {
        let smooth = Smooth::new(sensor.smooth_px, width, height, random);
        let smooth_part = sensor.smooth_part;
        let fine_part = (1.0 - smooth_part * smooth_part).max(0.0).sqrt();
        let fine = correlated(sensor.correlation_px, width, height, random);
        Self { width, fine, fine_part, smooth_part, smooth }
    }

    fn at(&self, x: usize, y: usize) -> f64 {
        let fine = f64::from(self.fine[y * self.width + x]);
        self.fine_part * fine + self.smooth_part * self.smooth.at(x, y)
    }
}

/// White noise convolved with a Gaussian, scaled to variance 1.
fn correlated(sigma_px: f64, width: usize, height: usize, random: &mut Random) -> Vec<f32> {
    let weights = gaussian(sigma_px);
    let norm = weights.iter().map(|w| w * w).sum::<f32>().sqrt();
    let weights: Vec<f32> = weights.iter().map(|w| w / norm).collect();
    // White noise reaches beyond the map by half the weights, so that its rim is as noisy as its middle.
    let (wide, high) = (width + weights.len() - 1, height + weights.len() - 1);
    let white: Vec<f32> = (0..wide * high).map(|_| random.normal() as f32).collect();
    convolved(&white, &weights, width, height)
}

/// Random numbers at the knots of a grid, interpolated bilinearly; variance 1 on average.
struct Smooth {
    step_px: f64,
    columns: usize,
    knots: Vec<f64>,
}

impl Smooth {
    fn new(step_px: f64, width: usize, height: usize, random: &mut Random) -> Self {
        let step_px = step_px.max(1.0);
        let knots_along = |pixels: usize| (pixels as f64 / step_px) as usize + 2;
        let (columns, rows) = (knots_along(width), knots_along(height));
        // Between knots the mean of the squared weights is (2/3)².
        let knots = (0..columns * rows).map(|_| random.normal() * 1.5).collect();
        Self { step_px, columns, knots }
    }

    fn at(&self, x: usize, y: usize) -> f64 {
        let (u, v) = (x as f64 / self.step_px, y as f64 / self.step_px);
        let (i, j) = (u as usize, v as usize);
        let (fu, fv) = (u - i as f64, v - j as f64);
        let knot = |i: usize, j: usize| self.knots[j * self.columns + i];
        (knot(i, j) * (1.0 - fu) + knot(i + 1, j) * fu) * (1.0 - fv)
            + (knot(i, j + 1) * (1.0 - fu) + knot(i + 1, j + 1) * fu) * fv
    }
}
