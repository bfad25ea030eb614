//! Apple's radial lookup tables (skeleton).

use crate::geom::Pixel;

/// Radial magnification sampled evenly from the distortion centre to the farthest image corner:
/// p' = c + (1 + m(|p − c|))·(p − c), m interpolated linearly.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialTable {
    /// Distortion centre, pixels of the image.
    pub center: Pixel,
    /// Distance from the centre to the farthest image corner, pixels: the radius of the last sample.
    pub max_radius_px: f64,
    /// Magnification minus one at evenly spaced radii, from 0 to `max_radius_px`.
    pub magnification: Vec<f64>,
}

/// Both of Apple's tables. `inverse` takes a distorted pixel to its rectilinear place, `forward` the other way.
#[derive(Clone, Debug, PartialEq)]
pub struct TablePair {
    /// `lensDistortionLookupTable`: rectilinear → distorted.
    pub forward: RadialTable,
    /// `inverseLensDistortionLookupTable`: distorted → rectilinear.
    pub inverse: RadialTable,
}

impl RadialTable {
    /// Applies the table; `None` never for now (skeleton).
    pub fn apply(&self, pixel: Pixel) -> Option<Pixel> {
        Some(pixel)
    }
}

impl TablePair {
    /// Skeleton.
    pub fn distort(&self, pixel: Pixel) -> Option<Pixel> {
        self.forward.apply(pixel)
    }
    /// Skeleton.
    pub fn undistort(&self, pixel: Pixel) -> Option<Pixel> {
        self.inverse.apply(pixel)
    }
}
