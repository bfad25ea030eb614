//! A smoothed image at a fraction of the resolution, on which corners are sought.

use crate::{geom::Pixel, image::Gray};

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
    /// Grey values 0..=255, smoothed.
    pub(super) gray: Vec<f32>,
    /// Memory of the block sums.
    blocks: Vec<f32>,
    /// Memory of one row.
    column: Vec<f32>,
}

impl Level {
    /// Makes this the level whose pixels are `factor` × `factor` blocks of `image`; rows and columns that fill no
    /// block are left out. `None` where fewer than 16 pixels would remain along an axis.
    pub(super) fn fill(&mut self, image: &Gray, factor: usize) -> Option<()> {
        let (width, height) = (image.width() / factor, image.height() / factor);
        if width < 16 || height < 16 {
            return None;
        }
        (self.width, self.height, self.factor) = (width, height, factor);
        block_sums(image, factor, width, height, &mut self.blocks);
        let scale = 1.0 / (256.0 * (factor * factor) as f32);
        self.gray.resize(width * height, 0.0);
        self.column.resize(width + 4, 0.0);
        let column = &mut self.column[..width + 4];
        for y in 0..height {
            // Beyond the border the outermost row repeats.
            let row = |dy: isize| {
                let y = (y as isize + dy).clamp(0, height as isize - 1) as usize;
                &self.blocks[y * width..][..width]
            };
            binomial(&mut column[2..2 + width], [row(-2), row(-1), row(0), row(1), row(2)], scale);
            column[0] = column[2];
            column[1] = column[2];
            column[width + 2] = column[width + 1];
            column[width + 3] = column[width + 1];
            let out = &mut self.gray[y * width..][..width];
            binomial(out, [0, 1, 2, 3, 4].map(|dx| &column[dx..dx + width]), 1.0);
        }
        Some(())
    }

    /// Where a position of this level lies in the image.
    pub(super) fn to_image(&self, x: f32, y: f32) -> Pixel {
        let (factor, offset) = (self.factor as f64, (self.factor as f64 - 1.0) / 2.0);
        Pixel::new(f64::from(x) * factor + offset, f64::from(y) * factor + offset)
    }

    /// The nearest pixel's value; the border repeats outside.
    pub(super) fn nearest(&self, x: f32, y: f32) -> f32 {
        // A cast from float saturates, so that no position can leave the image.
        let x = ((x + 0.5) as usize).min(self.width - 1);
        let y = ((y + 0.5) as usize).min(self.height - 1);
        self.gray[y * self.width + x]
    }
}

/// 1 4 6 4 1 across five slices of equal length, times `scale`.
fn binomial(out: &mut [f32], [a, b, c, d, e]: [&[f32]; 5], scale: f32) {
    let n = out.len();
    let (a, b, c, d, e) = (&a[..n], &b[..n], &c[..n], &d[..n], &e[..n]);
    for i in 0..n {
        out[i] = ((a[i] + e[i]) + 4.0 * (b[i] + d[i]) + 6.0 * c[i]) * scale;
    }
}

/// The sum over each block.
fn block_sums(image: &Gray, factor: usize, width: usize, height: usize, sums: &mut Vec<f32>) {
    sums.resize(width * height, 0.0);
    // u16 holds 256 rows of one column, and far more than any factor used.
    let mut columns = vec![0_u16; width * factor];
    for (y, out) in sums.chunks_exact_mut(width).enumerate() {
        match factor {
            1 => {
                for (out, &p) in out.iter_mut().zip(image.row(y)) {
                    *out = f32::from(p);
                }
            }
            2 => {
                let (top, bottom) = (image.row(2 * y), image.row(2 * y + 1));
                for ((out, a), b) in
                    out.iter_mut().zip(top.chunks_exact(2)).zip(bottom.chunks_exact(2))
                {
                    *out = f32::from(
                        u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]),
                    );
                }
            }
            _ => {
                columns.fill(0);
                for dy in 0..factor {
                    for (sum, &p) in columns.iter_mut().zip(image.row(factor * y + dy)) {
                        *sum += u16::from(p);
                    }
                }
                for (out, block) in out.iter_mut().zip(columns.chunks_exact(factor)) {
                    *out = block.iter().map(|&s| f32::from(s)).sum();
                }
            }
        }
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
                        (f64::from(level.gray[y * level.width + x]) - expected).abs() < 1e-3,
                        "{factor} {x} {y}"
                    );
                }
            }
        }
        assert!(Level::default().fill(&image, 4).is_none(), "12 rows are too few");
    }
}
