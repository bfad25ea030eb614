//! What is rough in depth maps, where the print shows faintly.

use nalgebra::{Matrix3, Vector3};

use crate::{geom::Pixel, image::DepthMap, par::vectorized, solve::mad_sigma};

/// What is rough in a depth map round the board: cells of some pixels, the frame's own plane and the mean over the
/// neighbourhood taken out.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Side of a cell, pixels.
    pub cell_px: usize,
    /// Column and row of the first cell, in cells.
    first: [usize; 2],
    pub(super) columns: usize,
    /// Cell minus mean of its neighbourhood, inverse depth in [`UNIT_PER_M`]; [`NOTHING`] where nothing was measured.
    pub(super) rough: Vec<i16>,
}

/// One step of a stored inverse depth: a hundredth of the noise at 0.2 m.
pub(super) const UNIT_PER_M: f64 = 1e-5;
/// No measurement.
pub(super) const NOTHING: i16 = i16::MIN;
/// Cells along the image's width.
const CELLS_ACROSS: usize = 128;
/// So many cells tell the plane.
const PLANE_CELLS: usize = 800;
/// The mean over so many cells to each side is taken out: of 640 pixels, 45.
const REACH: usize = 4;

impl Texture {
    /// Of a depth map without measurement.
    pub fn nothing() -> Self {
        Self { cell_px: 1, first: [0; 2], columns: 0, rough: Vec::new() }
    }

    /// Of the part of the map from `low` to `high` (exclusive), pixels.
    pub(super) fn new(map: &DepthMap, low: [usize; 2], high: [usize; 2]) -> Self {
        let cell_px = (map.width() / CELLS_ACROSS).max(2);
        let first = low.map(|p| p / cell_px);
        let [columns, rows] = [0, 1].map(|k| (high[k] / cell_px).saturating_sub(first[k]));
        let mut cells = cell_means(map, cell_px, first, [columns, rows]);
        let mut texture = Self { cell_px, first, columns, rough: Vec::new() };
        let plane = texture.plane(&cells);
        for (k, value) in cells.iter_mut().enumerate() {
            let [i, j] = [k % columns.max(1), k / columns.max(1)].map(|n| n as f64);
            *value -= plane.x + plane.y * i + plane.z * j;
        }
        let sums = Sums::new(columns, cells.iter().map(|v| v.is_finite().then_some([*v])));
        let stored = |(k, value): (usize, &f64)| {
            let Some(([mean], _)) = sums.mean(k).filter(|_| value.is_finite()) else {
                return NOTHING;
            };
            let units = (value - mean) / UNIT_PER_M;
            // Rounded without a call: not all processors have an instruction for it.
            let nearest = (units + 0.5_f64.copysign(units)) as i32;
            i16::try_from(nearest).unwrap_or(NOTHING)
        };
        texture.rough = cells.iter().enumerate().map(stored).collect();
        texture
    }

    /// The plane through most cells: the board's, for a pinhole. What the mean over the neighbourhood leaves of it is
    /// little, so that some of the cells are enough.
    fn plane(&self, cells: &[f64]) -> Vector3<f64> {
        let stride = (cells.len() / PLANE_CELLS).isqrt().max(1);
        let some: Vec<(Vector3<f64>, f64)> = (0..cells.len())
            .map(|k| (k % self.columns, k / self.columns, cells[k]))
            .filter(|(i, j, value)| i % stride == 0 && j % stride == 0 && value.is_finite())
            .map(|(i, j, value)| (Vector3::new(1.0, i as f64, j as f64), value))
            .collect();
        let mut plane = Vector3::zeros();
        let mut reach = f64::INFINITY;
        for _ in 0..4 {
            let (mut ata, mut atb) = (Matrix3::zeros(), Vector3::zeros());
            let off =
                |(row, value): &(Vector3<f64>, f64), plane: &Vector3<f64>| value - row.dot(plane);
            for cell in some.iter().filter(|cell| off(cell, &plane).abs() <= reach) {
                let (row, value) = cell;
                ata += row * row.transpose();
                atb += row * *value;
            }
            let Some(inverse) = ata.try_inverse() else { break };
            plane = inverse * atb;
            let left: Vec<f64> = some.iter().map(|cell| off(cell, &plane)).collect();
            reach = 4.0 * mad_sigma(&left, 0.0);
        }
        plane
    }

    /// Middle of a cell in the depth map.
    pub(super) fn at(&self, k: usize) -> Pixel {
        let along = |first: usize, i: usize| {
            ((first + i) * self.cell_px) as f64 + 0.5 * (self.cell_px as f64 - 1.0)
        };
        Pixel::new(along(self.first[0], k % self.columns), along(self.first[1], k / self.columns))
    }
}

/// The mean inverse depth of each cell, per metre; NaN where a quarter or more of it was not measured.
fn cell_means(
    map: &DepthMap,
    cell_px: usize,
    first: [usize; 2],
    [columns, rows]: [usize; 2],
) -> Vec<f64> {
    vectorized(
        #[inline(always)]
        || {
            let mut means = Vec::with_capacity(columns * rows);
            // Down the columns of pixels first: neighbours side by side.
            let mut sums = vec![0.0; columns * cell_px];
            let mut counts = sums.clone();
            let enough = 0.75 * (cell_px * cell_px) as f64;
            for j in first[1]..first[1] + rows {
                sums.fill(0.0);
                counts.fill(0.0);
                for y in j * cell_px..(j + 1) * cell_px {
                    let line = &map.depth_m()[y * map.width() + first[0] * cell_px..];
                    for ((sum, n), &depth_m) in sums.iter_mut().zip(&mut counts).zip(line) {
                        let is_measured = depth_m > 0.0;
                        *sum += if is_measured { f64::from(depth_m).recip() } else { 0.0 };
                        *n += if is_measured { 1.0 } else { 0.0 };
                    }
                }
                let cells = sums.chunks_exact(cell_px).zip(counts.chunks_exact(cell_px));
                means.extend(cells.map(|(sums, counts)| {
                    let n: f64 = counts.iter().sum();
                    if n >= enough { sums.iter().sum::<f64>() / n } else { f64::NAN }
                }));
            }
            means
        },
    )
}

/// Sums over rectangles of a grid of cells, some without value.
pub(super) struct Sums<const N: usize> {
    columns: usize,
    rows: usize,
    /// Up to and without row j and column i: values, and how many.
    table: Vec<([f64; N], u32)>,
}

impl<const N: usize> Sums<N> {
    pub(super) fn new(
        columns: usize,
        cells: impl ExactSizeIterator<Item = Option<[f64; N]>>,
    ) -> Self {
        let rows = cells.len().checked_div(columns).unwrap_or(0);
        let wide = columns + 1;
        let mut table = vec![([0.0; N], 0); wide * (rows + 1)];
        let mut row = ([0.0; N], 0);
        for (k, cell) in cells.enumerate() {
            let (i, j) = (k % columns, k / columns);
            if i == 0 {
                row = ([0.0; N], 0);
            }
            if let Some(cell) = cell {
                row.0.iter_mut().zip(cell).for_each(|(sum, value)| *sum += value);
                row.1 += 1;
            }
            let above = table[j * wide + i + 1];
            table[(j + 1) * wide + i + 1] =
                (std::array::from_fn(|n| above.0[n] + row.0[n]), above.1 + row.1);
        }
        Self { columns, rows, table }
    }

    /// Mean over the neighbourhood of a cell, and whether it is whole; `None` where a quarter or more is missing.
    pub(super) fn mean(&self, k: usize) -> Option<([f64; N], bool)> {
        let (i, j) = (k % self.columns, k / self.columns);
        let (x0, y0) = (i.checked_sub(REACH)?, j.checked_sub(REACH)?);
        let (x1, y1) = (i + REACH + 1, j + REACH + 1);
        if x1 > self.columns || y1 > self.rows {
            return None;
        }
        let wide = self.columns + 1;
        let [a, b, c, d] = [y0 * wide + x0, y0 * wide + x1, y1 * wide + x0, y1 * wide + x1]
            .map(|at| self.table[at]);
        let n = d.1 + a.1 - b.1 - c.1;
        let all = (2 * REACH + 1).pow(2) as u32;
        if 4 * n < 3 * all {
            return None;
        }
        let mean = |m: usize| (d.0[m] - b.0[m] - c.0[m] + a.0[m]) / f64::from(n);
        Some((std::array::from_fn(mean), n == all))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_no_texture_and_holes_have_none_either() {
        let depth = |i: usize| {
            let (x, y) = ((i % 640) as f64, (i / 640) as f64);
            let hole = (300.0..330.0).contains(&x) && (200.0..230.0).contains(&y);
            if hole { f32::NAN } else { (4.0 + 0.002 * x - 0.001 * y).recip() as f32 }
        };
        let map = DepthMap::new(640, 480, (0..640 * 480).map(depth).collect());
        let texture = Texture::new(&map, [100, 70], [540, 410]);
        let measured: Vec<i16> = texture.rough.iter().copied().filter(|r| *r != NOTHING).collect();
        assert!(measured.iter().all(|r| r.abs() <= 2), "{:?}", measured.iter().max());
        // The frame of the neighbourhood, and the hole with what is next to it.
        assert!((4000..5700).contains(&measured.len()), "{}", measured.len());
    }
}
