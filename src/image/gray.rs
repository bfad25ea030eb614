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
        if !self.contains(at) {
            return None;
        }
        let (x, y) = (at.x, at.y);
        let ([a, b, c, d], [fx, fy]) = self.around(x, y);
        let [a, b, c, d] = [a, b, c, d].map(f64::from);
        let (top, bottom) = (a + (b - a) * fx, c + (d - c) * fx);
        Some(top + (bottom - top) * fy)
    }

    /// True within the rectangle of pixel centres.
    #[inline]
    pub(crate) fn contains(&self, at: Pixel) -> bool {
        let (right, bottom) = (self.width as f64 - 1.0, self.height as f64 - 1.0);
        at.x >= 0.0 && at.y >= 0.0 && at.x <= right && at.y <= bottom
    }

    /// As [`bilinear`](Self::bilinear), of a place that this image [`contains`](Self::contains) but for rounding;
    /// elsewhere any grey value.
    #[inline]
    pub(crate) fn between(&self, at: Pixel) -> f32 {
        let ([a, b, c, d], [fx, fy]) = self.around(at.x, at.y);
        let [a, b, c, d] = [a, b, c, d].map(f32::from);
        let (fx, fy) = (fx as f32, fy as f32);
        let (top, bottom) = (a + (b - a) * fx, c + (d - c) * fx);
        top + (bottom - top) * fy
    }

    /// The four pixels round a place inside, and how far it lies from the first of them.
    #[inline(always)]
    fn around(&self, x: f64, y: f64) -> ([u8; 4], [f64; 2]) {
        // By way of 32 bits, for which processors have an instruction.
        let (x0, y0) = (x as i32, y as i32);
        let f = [x - f64::from(x0), y - f64::from(y0)];
        let (x0, y0) = (x0 as usize, y0 as usize);
        // On the last row or column the neighbour has weight zero: any pixel will do.
        let at = y0 * self.width + x0;
        let pair = |at: usize| self.pixels.get(at..)?.first_chunk::<2>();
        if let (Some([a, b]), Some([c, d])) = (pair(at), pair(at + self.width)) {
            return ([*a, *b, *c, *d], f);
        }
        let last = self.pixels.len() - 1;
        let p = |at: usize| self.pixels[at.min(last)];
        ([p(at), p(at + 1), p(at), p(at + 1)], f)
    }

    /// `N` values, at least two, at equal steps from one place to another, both included, by bilinear interpolation;
    /// `None` where either lies outside the rectangle of pixel centres.
    pub fn along<const N: usize>(&self, from: Pixel, to: Pixel) -> Option<[f32; N]> {
        if !(self.contains(from) && self.contains(to)) {
            return None; // Between two places inside, all are.
        }
        let step = [(to.x - from.x) / (N as f64 - 1.0), (to.y - from.y) / (N as f64 - 1.0)];
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate() {
            let k = k as f64;
            *value = self.between(Pixel::new(from.x + k * step[0], from.y + k * step[1]));
        }
        Some(values)
    }
}
