//! Colour images.

use super::{Gray, extend};

/// An 8-bit sRGB image.
#[derive(Clone, Debug, PartialEq)]
pub struct Rgb {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Rgb {
    /// An image of these pixels, row by row. Panics where their number is not width × height.
    pub fn new(width: usize, height: usize, pixels: Vec<[u8; 3]>) -> Self {
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
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    /// Every row the other way round.
    pub fn mirrored(&self) -> Self {
        Self::new(self.width, self.height, super::mirrored(self.width, &self.pixels))
    }

    /// The luma of ITU-R BT.601, as OpenCV's `COLOR_RGB2GRAY` rounds it.
    pub fn to_gray(&self) -> Gray {
        let mut gray = Vec::new();
        extend(&mut gray, &self.pixels, luma);
        Gray::new(self.width, self.height, gray)
    }
}

/// 0.299 R + 0.587 G + 0.114 B in 14-bit fixed point, OpenCV's own coefficients.
#[inline(always)]
pub(super) fn luma([r, g, b]: [u8; 3]) -> u8 {
    ((u32::from(r) * 4899 + u32::from(g) * 9617 + u32::from(b) * 1868 + (1 << 13)) >> 14) as u8
}
