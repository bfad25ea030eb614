//! Grey images.

use crate::geom::Pixel;

/// An 8-bit grey image.
#[derive(Clone, Debug, PartialEq)]
pub struct Gray {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Gray {
    /// An image of these pixels, row by row. Panics where their number is not width × height.
    pub fn new(width: usize, height: usize, pixels: Vec<u8>) -> Self {
        assert_eq!(pixels.len(), width * height, "{width}x{height} pixels");
        Self { width, height, pixels }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// One row. Panics beyond the last.
    pub fn row(&self, y: usize) -> &[u8] {
        &self.pixels[y * self.width..][..self.width]
    }

    /// Bilinear interpolation; `None` outside the rectangle of pixel centres.
    pub fn bilinear(&self, at: Pixel) -> Option<f64> {
        let (x, y) = (at.x, at.y);
        if !(x >= 0.0 && y >= 0.0 && x <= self.width as f64 - 1.0 && y <= self.height as f64 - 1.0)
        {
            return None;
        }
        // On the last row or column the neighbour has weight zero; clamp its index.
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
        let (fx, fy) = (x - x0 as f64, y - y0 as f64);
        let p = |x: usize, y: usize| f64::from(self.pixels[y * self.width + x]);
        let top = p(x0, y0) * (1.0 - fx) + p(x1, y0) * fx;
        let bottom = p(x0, y1) * (1.0 - fx) + p(x1, y1) * fx;
        Some(top * (1.0 - fy) + bottom * fy)
    }

    /// `N` values, at least two, at equal steps from one place to another, both included, by bilinear interpolation;
    /// `None` where either lies outside the rectangle of pixel centres.
    pub fn along<const N: usize>(&self, from: Pixel, to: Pixel) -> Option<[f32; N]> {
        let (right, bottom) = (self.width as f64 - 1.0, self.height as f64 - 1.0);
        let inside = |p: Pixel| p.x >= 0.0 && p.y >= 0.0 && p.x <= right && p.y <= bottom;
        if !(inside(from) && inside(to)) {
            return None; // Between two places inside, all are.
        }
        let step = [(to.x - from.x) / (N as f64 - 1.0), (to.y - from.y) / (N as f64 - 1.0)];
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate() {
            // Rounding may step over the border by less than anybody can see.
            let x = (from.x + k as f64 * step[0]).clamp(0.0, right);
            let y = (from.y + k as f64 * step[1]).clamp(0.0, bottom);
            let (x0, y0) = (x as usize, y as usize);
            let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
            let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
            let (top, bottom) = (self.row(y0), self.row(y1));
            let [a, b, c, d] = [top[x0], top[x1], bottom[x0], bottom[x1]].map(f32::from);
            let (top, bottom) = (a + (b - a) * fx, c + (d - c) * fx);
            *value = top + (bottom - top) * fy;
        }
        Some(values)
    }
}
