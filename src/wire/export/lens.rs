//! The nearest lens that a format holds.

use crate::{
    camera::{Brown, Camera, Distortion, Intrinsics},
    geom::Pixel,
    solve::DenseCholesky,
};

/// How far one lens is from another over the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// Root mean square of the 2-D distances, pixels.
    pub rms_px: f64,
    /// The largest distance, pixels.
    pub max_px: f64,
}

/// Places across and down the image at which lenses are compared.
const PLACES: usize = 41;

/// OpenCV's lens: k1 k2 p1 p2 k3, and k4 k5 k6 where the radial polynomial has a denominator.
///
/// ```text
/// x' = x·(1 + k1·r² + k2·r⁴ + k3·r⁶)/(1 + k4·r² + k5·r⁴ + k6·r⁶) + 2·p1·x·y + p2·(r² + 2x²)
/// ```
pub(super) type Numbers = [f64; 8];

/// The lens with the first `n_free` numbers that draws all rays of the image nearest to where the camera does, and by
/// how much it misses; no residual where it is the camera's own. A denominator (eight numbers) is taken only where it
/// comes nearer.
pub(super) fn nearest(camera: &Camera, n_free: usize) -> (Numbers, Option<Residual>) {
    let own = match &camera.distortion {
        Distortion::None => Some(Brown::ZERO),
        Distortion::Brown(lens) => Some(*lens),
        Distortion::Table(_) => None,
    };
    let mut numbers = [0.0; 8];
    if let Some(lens) = own {
        numbers[..5].copy_from_slice(&lens.parameters());
        if numbers[n_free..].iter().all(|k| *k == 0.0) {
            return (numbers, None);
        }
    }
    let pinhole = &camera.intrinsics;
    let at = |i: usize, size: usize| i as f64 / (PLACES - 1) as f64 * size as f64 - 0.5;
    let rays: Vec<(Pixel, [f64; 2])> = (0..PLACES * PLACES)
        .map(|i| Pixel::new(at(i % PLACES, pinhole.width), at(i / PLACES, pinhole.height)))
        .filter_map(|pixel| Some((pixel, camera.unproject(pixel)?)))
        .collect();
    let mut best = fitted(pinhole, &rays, n_free.min(5));
    if n_free > 5 {
        let other = fitted(pinhole, &rays, n_free);
        if other.1.rms_px < best.1.rms_px {
            best = other;
        }
    }
    (best.0, Some(best.1))
}

/// Least squares over the rays. Multiplied by the denominator the lens is linear in its numbers; dividing by that of
/// the last round gives pixels again (Sanathanan and Koerner, 1963). Without a denominator one round is all.
fn fitted(pinhole: &Intrinsics, rays: &[(Pixel, [f64; 2])], n_free: usize) -> (Numbers, Residual) {
    let mut numbers = [0.0; 8];
    let n_rounds = if n_free > 5 { 8 } else { 1 };
    for _ in 0..n_rounds {
        let mut normal = vec![0.0; n_free * n_free];
        let mut right = vec![0.0; n_free];
        for (pixel, ray @ [x, y]) in rays {
            let drawn = pinhole.ray_from_pixel(*pixel);
            let r2 = x * x + y * y;
            let below = denominator(&numbers, r2);
            let brown = Brown::ZERO.d_distorted_d_parameters(*ray);
            for (axis, scale) in [pinhole.fx, pinhole.fy].into_iter().enumerate() {
                let weight = (scale / below).powi(2);
                let [k1, k2, p1, p2, k3] = brown[axis];
                let out = -drawn[axis];
                let powers = [out * r2, out * r2 * r2, out * r2 * r2 * r2];
                let row = [k1, k2, below * p1, below * p2, k3, powers[0], powers[1], powers[2]];
                let wanted = drawn[axis] - ray[axis];
                for i in 0..n_free {
                    for j in 0..n_free {
                        normal[i * n_free + j] += weight * row[i] * row[j];
                    }
                    right[i] += weight * row[i] * wanted;
                }
            }
        }
        let Some(factor) = DenseCholesky::new(normal, n_free) else { break };
        numbers[..n_free].copy_from_slice(&factor.solve(&right));
    }
    let (mut squares, mut max_px) = (0.0, 0.0_f64);
    for (pixel, ray) in rays {
        let distance = pinhole.pixel_from_ray(drawn(&numbers, *ray)).distance(*pixel);
        squares += distance * distance;
        max_px = max_px.max(distance);
    }
    let rms_px = (squares / rays.len() as f64).sqrt();
    (numbers, Residual { rms_px, max_px })
}

fn denominator([.., k4, k5, k6]: &Numbers, r2: f64) -> f64 {
    1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
}

/// Where the lens draws a direction (both as x/z, y/z).
pub(super) fn drawn(numbers: &Numbers, [x, y]: [f64; 2]) -> [f64; 2] {
    let [k1, k2, p1, p2, k3, ..] = numbers;
    let r2 = x * x + y * y;
    let radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / denominator(numbers, r2);
    [
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    ]
}
