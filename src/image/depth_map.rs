//! Depth images.

use crate::geom::Pixel;

/// Depth along the optical axis (z, not range), metres; NaN where nothing was measured.
#[derive(Clone, Debug)]
pub struct DepthMap {
    width: usize,
    height: usize,
    depth_m: Vec<f32>,
}

impl DepthMap {
    /// A map of these depths (metres, NaN = no measurement), row by row. Panics where their number is not
    /// width × height.
    pub fn new(width: usize, height: usize, depth_m: Vec<f32>) -> Self {
        assert_eq!(depth_m.len(), width * height, "{width}x{height} depths");
        Self { width, height, depth_m }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All depths, metres, row by row.
    pub fn depth_m(&self) -> &[f32] {
        &self.depth_m
    }

    /// The depth at an integer pixel; NaN outside.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        if x < self.width && y < self.height { self.depth_m[y * self.width + x] } else { f32::NAN }
    }

    /// Every row the other way round.
    pub fn mirrored(&self) -> Self {
        Self::new(self.width, self.height, super::mirrored(self.width, &self.depth_m))
    }

    /// Bilinear interpolation, metres; `None` outside the rectangle of pixel centres and wherever any of the
    /// neighbours with a weight has no measurement: depth never blends across a hole.
    pub fn bilinear(&self, at: Pixel) -> Option<f64> {
        let (x, y) = (at.x, at.y);
        if !(x >= 0.0 && y >= 0.0 && x <= self.width as f64 - 1.0 && y <= self.height as f64 - 1.0)
        {
            return None;
        }
        let (x0, y0) = (x as usize, y as usize);
        let (fx, fy) = (x - x0 as f64, y - y0 as f64);
        let mut sum = 0.0;
        for (dx, dy, weight) in [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ] {
            if weight > 0.0 {
                sum += weight * f64::from(self.at(x0 + dx, y0 + dy));
            }
        }
        (!sum.is_nan()).then_some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn never_across_a_hole() {
        let map = DepthMap::new(3, 2, vec![1.0, 2.0, f32::NAN, 3.0, 4.0, 5.0]);
        assert_eq!(map.bilinear(Pixel::new(0.5, 0.5)), Some(2.5));
        assert_eq!(map.bilinear(Pixel::new(1.0, 0.0)), Some(2.0)); // The hole beside it has no weight.
        assert_eq!(map.bilinear(Pixel::new(1.25, 0.5)), None);
        assert_eq!(map.bilinear(Pixel::new(2.0, 1.0)), Some(5.0));
        assert_eq!(map.bilinear(Pixel::new(2.1, 1.0)), None);
        assert_eq!(map.bilinear(Pixel::new(f64::NAN, 1.0)), None);
    }
}
