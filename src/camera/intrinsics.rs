//! The pinhole.

use crate::geom::Pixel;

/// Focal lengths and principal point of an image of a given size, pixels; integer coordinates are pixel centres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal length along x, pixels.
    pub fx: f64,
    /// Focal length along y, pixels.
    pub fy: f64,
    /// Principal point, pixels.
    pub cx: f64,
    /// Principal point, pixels.
    pub cy: f64,
    /// Columns of the image these numbers are for.
    pub width: usize,
    /// Rows of the image these numbers are for.
    pub height: usize,
}

impl Intrinsics {
    /// The pixel of the direction (x/z, y/z).
    pub fn pixel_from_ray(&self, [u, v]: [f64; 2]) -> Pixel {
        Pixel::new(self.fx * u + self.cx, self.fy * v + self.cy)
    }

    /// The direction (x/z, y/z) of a pixel.
    pub fn ray_from_pixel(&self, pixel: Pixel) -> [f64; 2] {
        [(pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy]
    }

    /// The same for the image at another size. As everywhere here, pixels are scaled without a half-pixel shift.
    pub fn at_size(&self, [width, height]: [usize; 2]) -> Self {
        let (sx, sy) = (width as f64 / self.width as f64, height as f64 / self.height as f64);
        let (fx, fy) = (self.fx * sx, self.fy * sy);
        Self { fx, fy, cx: self.cx * sx, cy: self.cy * sy, width, height }
    }

    /// The mean of both focal lengths, pixels.
    pub fn focal_px(&self) -> f64 {
        f64::midpoint(self.fx, self.fy)
    }
}
