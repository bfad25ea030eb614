//! Brown-Conrady distortion (skeleton).

/// The polynomials of Brown and Conrady, in OpenCV's order and notation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brown {
    /// Radial, r².
    pub k1: f64,
    /// Radial, r⁴.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial, r⁶.
    pub k3: f64,
}

impl Brown {
    /// Skeleton.
    pub fn distort(&self, ray: [f64; 2]) -> Option<[f64; 2]> {
        Some(ray)
    }
    /// Skeleton.
    pub fn undistort(&self, ray: [f64; 2]) -> Option<[f64; 2]> {
        Some(ray)
    }
}
