//! A smoothed image at a fraction of the resolution, on which corners are sought.

use crate::{geom::Pixel, image::Gray, par::vectorized};

/// One level: every pixel averages a block of the image, then a binomial filter (1 4 6 4 1)/16 runs along both axes.
///
/// A block average with a binomial is what keeps one pass over memory: the printed bits of the markers, the noise and
/// the JPEG blocks vanish, a crossing of two edges stays a saddle of the same centre.
#[derive(Debug, Default)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Image pixels per pixel of this level, along one axis.
    pub(super) factor: usize,
    /// Smoothed grey values in units of 1/[`UNITS`] grey level: 16 bits move half the memory of floats, and second
    /// differences of them still fit.
    pub(super) values: Vec<i16>,
    /// Memory of the latest rows of block sums: row y lies at y modulo [`KEPT_ROWS`].
    blocks: Vec<u16>,
    /// Memory of one row, filtered along y, and of sums along y.
    column: Vec<u16>,
    sums: Vec<u32>,
}

/// Units of a grey level in [`Level::values`].
pub(super) const UNITS: i16 = 32;

/// Rows of block sums kept: the filter takes five.
const KEPT_ROWS: usize = 8;

impl Level {
    /// Makes this the level whose pixels are `factor` × `factor` blocks of `image`; rows and columns that fill no
    /// block are left out. `None` where fewer than 16 pixels would remain along an axis.
    pub(super) fn fill(&mut self, image: &Gray, factor: usize) -> Option<()> {
        let (width, height) = (image.width() / factor, image.height() / factor);
        if width < 16 || height < 16 {
            return None;
        }
        (self.width, self.height, self.factor) = (width, height, factor);
        self.values.resize(width * height, 0);
        self.blocks.resize(KEPT_ROWS * width, 0);
        self.column.resize(width + 4, 0);
        self.sums.resize(width * factor, 0);
        vectorized(
            #[inline(always)]
            || self.smooth(image),
        );
        Some(())
    }

    /// One pass over the image: block sums, then the filter along y, then along x.
    #[inline(always)]
    fn smooth(&mut self, image: &Gray) {
        let (width, height, factor) = (self.width, self.height, self.factor);
        let shift = unit(factor).ilog2();
        let half = (1_u16 << shift) >> 1;
        let column = &mut self.column[..width + 4];
        let mut n_blocks = 0;
        for y in 0..height {
            while n_blocks < (y + 3).min(height) {
                let out = &mut self.blocks[n_blocks % KEPT_ROWS * width..][..width];
                block_sums(image, factor, n_blocks, out, &mut self.sums);
                n_blocks += 1;
            }
            // Beyond the border the outermost row repeats.
            let row = |dy: isize| {
                let y = (y as isize + dy).clamp(0, height as isize - 1) as usize;
                &self.blocks[y % KEPT_ROWS * width..][..width]
            };
            let [a, b, c, d, e] = [row(-2), row(-1), row(0), row(1), row(2)];
            let out = &mut column[2..2 + width];
            for i in 0..width {
                // At most 4080 · 16, plus 8: it fits. Sixteenths of a grey level are kept.
                let sum = (a[i] + e[i]) + 4 * (b[i] + d[i]) + 6 * c[i];
                out[i] = (sum + half) >> shift;
            }
            column[0] = column[2];
            column[1] = column[2];
            column[width + 2] = column[width + 1];
            column[width + 3] = column[width + 1];
            let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|dx| &column[dx..dx + width]);
            let out = &mut self.values[y * width..][..width];
            for i in 0..width {
                // At most 4080 · 16, plus 4: it fits. From 1/256 of a grey level to 1/32.
                let sum = (a[i] + e[i]) + 4 * (b[i] + d[i]) + 6 * c[i];
                out[i] = ((sum + 4) >> 3) as i16;
            }
        }
    }

    /// Where a position of this level lies in the image.
    pub(super) fn to_image(&self, x: f32, y: f32) -> Pixel {
        let (factor, offset) = (self.factor as f64, (self.factor as f64 - 1.0) / 2.0);
        Pixel::new(f64::from(x) * factor + offset, f64::from(y) * factor + offset)
    }

    /// Its pixels, rounded to whole grey levels.
    pub(super) fn to_gray(&self) -> Gray {
        let round = |v: &i16| ((v + UNITS / 2) / UNITS) as u8;
        Gray::new(self.width, self.height, self.values.iter().map(round).collect())
    }

    /// The nearest pixel's grey value; the border repeats outside.
    pub(super) fn nearest(&self, x: f32, y: f32) -> f32 {
        // A cast from float saturates, so that no position can leave the image.
        let x = ((x + 0.5) as usize).min(self.width - 1);
        let y = ((y + 0.5) as usize).min(self.height - 1);
        f32::from(self.values[y * self.width + x]) * (1.0 / f32::from(UNITS))
    }
}

/// What one grey level is in the block sums: a power of two, at most 16, so that sums fit into 16 bits even after the
/// binomial filter.
fn unit(factor: usize) -> usize {
    match factor {
        1 => 1,
        2 => 4,
        _ => 16,
    }
}

/// The sums over one row of blocks, in units of 1/[`unit`] grey level. `sums` is memory for a row of the image.
#[inline(always)]
fn block_sums(image: &Gray, factor: usize, y: usize, out: &mut [u16], sums: &mut [u32]) {
    match factor {
        1 => {
            for (out, &p) in out.iter_mut().zip(image.row(y)) {
                *out = u16::from(p);
            }
        }
        2 => {
            let [top, bottom] = [2 * y, 2 * y + 1].map(|y| image.row(y).as_chunks::<2>().0);
            for ((out, a), b) in out.iter_mut().zip(top).zip(bottom) {
                let (a, b) = (u16::from_le_bytes(*a), u16::from_le_bytes(*b));
                *out = ((a & 0xff) + (b & 0xff)) + ((a >> 8) + (b >> 8));
            }
        }
        // Their number of pixels is known when this is compiled.
        3 => small_blocks::<3>(image, y, out),
        4 => small_blocks::<4>(image, y, out),
        8 => small_blocks::<8>(image, y, out),
        _ => {
            sums.fill(0);
            for dy in 0..factor {
                for (sum, &p) in sums.iter_mut().zip(image.row(factor * y + dy)) {
                    *sum += u32::from(p);
                }
            }
            let (unit, n) = (unit(factor) as u32, (factor * factor) as u32);
            for (out, block) in out.iter_mut().zip(sums.chunks_exact(factor)) {
                *out = ((block.iter().sum::<u32>() * unit + n / 2) / n) as u16;
            }
        }
    }
}

/// [`block_sums`] of N × N pixels.
#[inline(always)]
fn small_blocks<const N: usize>(image: &Gray, y: usize, out: &mut [u16]) {
    // The sum of all fits into 16 bits.
    const { assert!(N * N * 255 <= u16::MAX as usize) };
    let mut rows: [&[[u8; N]]; N] = [&[]; N];
    for (dy, row) in rows.iter_mut().enumerate() {
        *row = &image.row(N * y + dy).as_chunks::<N>().0[..out.len()];
    }
    let (unit, n) = (unit(N) as u32, (N * N) as u32);
    for (i, out) in out.iter_mut().enumerate() {
        let mut sum = 0_u16;
        for row in rows {
            for p in row[i] {
                sum += u16::from(p);
            }
        }
        *out = ((u32::from(sum) * unit + n / 2) / n) as u16;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_keeps_its_values_and_places() {
        let (width, height) = (64, 48);
        let pixels = (0..width * height).map(|i| (2 * (i % width) + i / width) as u8).collect();
        let image = Gray::new(width, height, pixels);
        for factor in [1, 2, 3] {
            let mut level = Level::default();
            level.fill(&image, factor).unwrap();
            for y in 3..level.height - 3 {
                for x in 3..level.width - 3 {
                    let p = level.to_image(x as f32, y as f32);
                    let expected = 2.0 * p.x + p.y;
                    assert!(
                        (f64::from(level.nearest(x as f32, y as f32)) - expected).abs() < 1e-3,
                        "{factor} {x} {y}"
                    );
                }
            }
        }
        assert!(Level::default().fill(&image, 4).is_none(), "12 rows are too few");
    }
}
