//! The nearest lens that a format holds.

use crate::{
    camera::{Brown, Camera, Distortion},
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

/// Brown's lens with the first `n_free` of k1 k2 p1 p2 k3 that draws all rays of the image nearest to where the camera
/// does, and by how much it misses; no residual where it is the camera's own.
///
/// The polynomial is linear in its coefficients, so that least squares over a grid of pixels are solved at once.
pub(super) fn nearest(camera: &Camera, n_free: usize) -> (Brown, Option<Residual>) {
    match &camera.distortion {
        Distortion::None => return (Brown::ZERO, None),
        Distortion::Brown(lens) if lens.parameters()[n_free..].iter().all(|k| *k == 0.0) => {
            return (*lens, None);
        }
        _ => {}
    }
    let pinhole = &camera.intrinsics;
    let at = |i: usize, size: usize| i as f64 / (PLACES - 1) as f64 * size as f64 - 0.5;
    let rays: Vec<(Pixel, [f64; 2])> = (0..PLACES * PLACES)
        .map(|i| Pixel::new(at(i % PLACES, pinhole.width), at(i / PLACES, pinhole.height)))
        .filter_map(|pixel| Some((pixel, camera.unproject(pixel)?)))
        .collect();
    let mut normal = vec![0.0; n_free * n_free];
    let mut right = vec![0.0; n_free];
    for (pixel, ray) in &rays {
        let distorted = pinhole.ray_from_pixel(*pixel);
        let rows = Brown::ZERO.d_distorted_d_parameters(*ray);
        for (axis, scale) in [pinhole.fx, pinhole.fy].into_iter().enumerate() {
            let wanted = distorted[axis] - ray[axis];
            for i in 0..n_free {
                for j in 0..n_free {
                    normal[i * n_free + j] += scale * scale * rows[axis][i] * rows[axis][j];
                }
                right[i] += scale * scale * rows[axis][i] * wanted;
            }
        }
    }
    let mut numbers = [0.0; 5];
    if let Some(factor) = DenseCholesky::new(normal, n_free) {
        numbers[..n_free].copy_from_slice(&factor.solve(&right));
    }
    let lens = Brown::from_parameters(numbers);
    let (mut squares, mut max_px) = (0.0, 0.0_f64);
    for (pixel, ray) in &rays {
        let distance = match lens.distort(*ray) {
            Some(distorted) => pinhole.pixel_from_ray(distorted).distance(*pixel),
            None => f64::INFINITY,
        };
        squares += distance * distance;
        max_px = max_px.max(distance);
    }
    let rms_px = (squares / rays.len() as f64).sqrt();
    (lens, Some(Residual { rms_px, max_px }))
}
