//! A position in an image.

/// A position in an image, in pixels; integer coordinates are pixel *centres*, x to the right, y down.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Pixel {
    /// Column, pixels.
    #[serde(rename = "x_px")]
    pub x: f64,
    /// Row, pixels.
    #[serde(rename = "y_px")]
    pub y: f64,
}

impl Pixel {
    /// The position at column `x`, row `y`.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Euclidean distance, pixels.
    pub fn distance(self, other: Self) -> f64 {
        let (dx, dy) = (self.x - other.x, self.y - other.y);
        // Not `hypot`, which guards against overflow at many times the cost.
        (dx * dx + dy * dy).sqrt()
    }
}

impl std::ops::Sub for Pixel {
    type Output = [f64; 2];
    fn sub(self, other: Self) -> [f64; 2] {
        [self.x - other.x, self.y - other.y]
    }
}
