//! The print, seen in the depth map: a second witness of zoom and shift.

use nalgebra::{Matrix2, Matrix3, Matrix4, Vector2, Vector3, Vector4};

use crate::{
    board::{CharucoBoard, Layout},
    geom::Pixel,
    image::DepthMap,
    solve::mad_sigma,
};

/// What the print in the depth maps says of where they lie on the colour images.
///
/// Structured light measures white paper a little nearer than black ink: one to two tenths of a millimetre in the
/// published recordings. The depth map so shows the chessboard, faintly, and where it shows it is where it lies,
/// whatever poses, heights and the sensor's slow errors are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imprint {
    /// Zoom, shift x and y (px), as in [`Registration`](super::Registration).
    pub place: [f64; 3],
    /// Their covariance: leaving out each frame in turn.
    pub covariance: [[f64; 3]; 3],
    /// How much nearer white is measured than black, metres.
    pub contrast_m: f64,
    /// Its standard deviation, metres.
    pub contrast_sigma_m: f64,
    /// Frames that took part.
    pub n_frames: usize,
}

/// The print's contrast must stand out of the noise by so much; the place is a ratio to it, biased and skewed where it
/// does not (by 1/this² of itself).
const LEAST_CONTRAST: f64 = 7.0;
/// Fewer frames tell no σ.
const LEAST_FRAMES: usize = 5;
/// A frame with fewer cells says nothing.
const LEAST_CELLS: usize = 200;
/// The mean over so many cells to each side is taken out: of 640 pixels, 45.
const REACH: usize = 4;
/// How widely the sensor itself smooths, pixels (a Gaussian's σ). Only sharpens the comparison.
const SENSOR_BLUR_PX: f64 = 3.0;
/// Tukey's constant: 95 % efficiency.
const TUKEY: f64 = 4.685;

/// The print at a row of sharpnesses.
pub(super) struct Print {
    /// Raster cells per metre.
    per_m: f64,
    columns: usize,
    rows: usize,
    /// (σ in metres, darkness −½ to ½), by σ.
    levels: Vec<(f64, Vec<f32>)>,
}

impl Print {
    pub(super) fn new(board: &CharucoBoard) -> Self {
        // Markers have 6 to 10 cells; blurred as the sensor does it, 16 cells a square show all that is left.
        let per_square = if board.squares_x.max(board.squares_y) > 40 { 8 } else { 16 };
        let per_m = per_square as f64 / board.square_m;
        let (columns, rows) = (board.squares_x * per_square, board.squares_y * per_square);
        let layout = board.layout.unwrap_or(Layout::New);
        let at = |i: usize| (i as f64 + 0.5) / per_m;
        let mut raster: Vec<f32> = (0..columns * rows)
            .map(|i| match board.is_white_at(layout, at(i % columns), at(i / columns)) {
                Some(false) => 0.5,
                _ => -0.5,
            })
            .collect();
        // σ of 1, √2, 2 ... raster cells: each level is the last one blurred by as much as it has already.
        let mut levels = Vec::new();
        let mut have = 0.0_f64;
        let mut want = 1.0_f64;
        while want < per_square as f64 {
            blur(&mut raster, (columns, rows), (want * want - have * have).sqrt());
            levels.push((want / per_m, raster.clone()));
            have = want;
            want *= std::f64::consts::SQRT_2;
        }
        Self { per_m, columns, rows, levels }
    }

    /// Darkness and its derivative (per metre) at a place, at the level nearest to this blur; `None` beside the board.
    fn at(&self, level: &[f32], at_m: &Vector2<f64>) -> Option<(f64, Vector2<f64>)> {
        let (x, y) = (at_m.x * self.per_m - 0.5, at_m.y * self.per_m - 0.5);
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        if i + 1 >= self.columns || j + 1 >= self.rows {
            return None;
        }
        let (u, v) = (x - i as f64, y - j as f64);
        let read = |i: usize, j: usize| f64::from(level[j * self.columns + i]);
        let [a, b, c, d] = [read(i, j), read(i + 1, j), read(i, j + 1), read(i + 1, j + 1)];
        let (top, bottom) = (a + u * (b - a), c + u * (d - c));
        let by_x = (1.0 - v) * (b - a) + v * (d - c);
        Some((top + v * (bottom - top), Vector2::new(by_x, bottom - top) * self.per_m))
    }

    fn level(&self, sigma_m: f64) -> &[f32] {
        let nearness = |(each, _): &&(f64, Vec<f32>)| (each / sigma_m).ln().abs();
        let best = self.levels.iter().min_by(|a, b| nearness(a).total_cmp(&nearness(b)));
        best.map_or(&[], |(_, level)| level)
    }
}

/// Blurs in place with a Gaussian of this σ, the rim repeated.
fn blur(raster: &mut Vec<f32>, (columns, rows): (usize, usize), sigma: f64) {
    let radius = (3.0 * sigma).ceil() as usize;
    let mut weights: Vec<f32> = (0..=2 * radius)
        .map(|i| (-0.5 * ((i as f64 - radius as f64) / sigma).powi(2)).exp() as f32)
        .collect();
    let sum: f32 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    let clamp = |i: usize, n: usize| i.saturating_sub(radius).min(n - 1);
    let across: Vec<f32> = (0..columns * rows)
        .map(|k| {
            let (row, i) = (k / columns * columns, k % columns);
            (0..weights.len()).map(|w| weights[w] * raster[row + clamp(i + w, columns)]).sum()
        })
        .collect();
    *raster = (0..columns * rows)
        .map(|k| {
            let (i, j) = (k % columns, k / columns);
            (0..weights.len()).map(|w| weights[w] * across[clamp(j + w, rows) * columns + i]).sum()
        })
        .collect();
}

/// What is rough in a depth map round the board: cells of some pixels, the frame's own plane and the mean over the
/// neighbourhood taken out.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Side of a cell, pixels.
    pub cell_px: usize,
    /// Column and row of the first cell, in cells.
    first: [usize; 2],
    columns: usize,
    /// Cell minus mean of its neighbourhood, inverse depth in [`UNIT_PER_M`]; [`NOTHING`] where nothing was measured.
    rough: Vec<i16>,
}

/// One step of a stored inverse depth: a hundredth of the noise at 0.2 m.
const UNIT_PER_M: f64 = 1e-5;
/// No measurement.
const NOTHING: i16 = i16::MIN;
/// Cells along the image's width.
const CELLS_ACROSS: usize = 128;

impl Texture {
    /// Of the part of the map from `low` to `high` (exclusive), pixels.
    pub(super) fn new(map: &DepthMap, low: [usize; 2], high: [usize; 2]) -> Self {
        let cell_px = (map.width() / CELLS_ACROSS).max(2);
        let first = low.map(|p| p / cell_px);
        let [columns, rows] = [0, 1].map(|k| (high[k] / cell_px).saturating_sub(first[k]));
        let mut cells: Vec<f64> = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                let (mut sum, mut n) = (0.0, 0);
                for y in (first[1] + j) * cell_px..(first[1] + j + 1) * cell_px {
                    for x in (first[0] + i) * cell_px..(first[0] + i + 1) * cell_px {
                        let depth_m = f64::from(map.at(x, y));
                        if depth_m > 0.0 {
                            sum += depth_m.recip();
                            n += 1;
                        }
                    }
                }
                cells.push(if 4 * n >= 3 * cell_px * cell_px { sum / n as f64 } else { f64::NAN });
            }
        }
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
            let units = ((value - mean) / UNIT_PER_M).round();
            if units.abs() < f64::from(i16::MAX) { units as i16 } else { NOTHING }
        };
        texture.rough = cells.iter().enumerate().map(stored).collect();
        texture
    }

    /// The plane through most cells: the board's, for a pinhole.
    fn plane(&self, cells: &[f64]) -> Vector3<f64> {
        let mut plane = Vector3::zeros();
        let mut reach = f64::INFINITY;
        for _ in 0..4 {
            let (mut ata, mut atb) = (Matrix3::zeros(), Vector3::zeros());
            let off = |k: usize, plane: &Vector3<f64>| {
                let row = Vector3::new(1.0, (k % self.columns) as f64, (k / self.columns) as f64);
                (row, cells[k] - row.dot(plane))
            };
            for k in (0..cells.len()).filter(|&k| cells[k].is_finite()) {
                let (row, e) = off(k, &plane);
                if e.abs() <= reach {
                    ata += row * row.transpose();
                    atb += row * cells[k];
                }
            }
            let Some(inverse) = ata.try_inverse() else { break };
            plane = inverse * atb;
            let left: Vec<f64> = (0..cells.len())
                .filter(|&k| cells[k].is_finite())
                .map(|k| off(k, &plane).1)
                .collect();
            reach = 4.0 * mad_sigma(&left, 0.0);
        }
        plane
    }

    /// Middle of a cell in the depth map.
    fn at(&self, k: usize) -> Pixel {
        let along = |first: usize, i: usize| {
            ((first + i) * self.cell_px) as f64 + 0.5 * (self.cell_px as f64 - 1.0)
        };
        Pixel::new(along(self.first[0], k % self.columns), along(self.first[1], k / self.columns))
    }
}

/// Sums over rectangles of a grid of cells, some without value.
struct Sums<const N: usize> {
    columns: usize,
    rows: usize,
    /// Up to and without row j and column i: values, and how many.
    table: Vec<([f64; N], u32)>,
}

impl<const N: usize> Sums<N> {
    fn new(columns: usize, cells: impl ExactSizeIterator<Item = Option<[f64; N]>>) -> Self {
        let rows = if columns == 0 { 0 } else { cells.len() / columns };
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
    fn mean(&self, k: usize) -> Option<([f64; N], bool)> {
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

/// Where a pixel of the depth map looks on the board.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Place on the board, metres.
    pub(super) on_board_m: Vector2<f64>,
    /// How it moves with the pixel looked at, metres per pixel.
    pub(super) by_pixel: Matrix2<f64>,
    /// Depth of the board there, metres.
    pub(super) depth_m: f64,
}

/// A frame's normal equations: contrast (metres), and contrast times what zoom and shift are off.
struct Normal {
    information: Matrix4<f64>,
    score: Vector4<f64>,
}

impl Normal {
    /// Cells where they look now, compared with their neighbours.
    fn new(
        print: &Print,
        texture: &Texture,
        place: &Place,
        look: impl Fn(Pixel) -> Option<Spot>,
    ) -> Option<Self> {
        let n = texture.rough.len();
        let spots: Vec<Option<Spot>> = (0..n)
            .map(|k| if texture.rough[k] == NOTHING { None } else { look(texture.at(k)) })
            .collect();
        let (scale, n_spots) = spots
            .iter()
            .flatten()
            .map(|s| s.by_pixel.determinant().abs().sqrt())
            .fold((0.0, 0), |(sum, n), scale| (sum + scale, n + 1));
        let blur_px = SENSOR_BLUR_PX.hypot(texture.cell_px as f64 / 12.0_f64.sqrt());
        let level = print.level(blur_px * scale / f64::from(n_spots.max(1)));
        // Darkness and its derivatives, as depth: what is measured too far by d has an inverse depth less by d/z².
        let seen: Vec<Option<[f64; 4]>> = (0..n)
            .map(|k| {
                let spot = spots[k].as_ref()?;
                let (darkness, by_board) = print.at(level, &spot.on_board_m)?;
                let by_pixel = spot.by_pixel.transpose() * by_board;
                let by_zoom = by_pixel.dot(&place.from_center(texture.at(k)));
                let by_shift = -place.zoom * by_pixel;
                let curvature = -1.0 / (spot.depth_m * spot.depth_m);
                Some([darkness, by_zoom, by_shift.x, by_shift.y].map(|d| d * curvature))
            })
            .collect();
        let sums = Sums::new(texture.columns, seen.iter().copied());
        let mut rows = Vec::with_capacity(n);
        for k in 0..n {
            let Some((here, (mean, true))) = seen[k].zip(sums.mean(k)) else { continue };
            let row = Vector4::from_fn(|c, _| here[c] - mean[c]);
            rows.push((f64::from(texture.rough[k]) * UNIT_PER_M, row));
        }
        let residuals: Vec<f64> = rows.iter().map(|(residual, _)| *residual).collect();
        let sigma = mad_sigma(&residuals, 0.0);
        if rows.len() < LEAST_CELLS || !(sigma > 0.0) {
            return None;
        }
        let mut normal = Self { information: Matrix4::zeros(), score: Vector4::zeros() };
        for (residual, row) in rows {
            let u = residual / (TUKEY * sigma);
            if u.abs() < 1.0 {
                let weight = ((1.0 - u * u) / sigma).powi(2);
                normal.information.ger(weight, &row, &row, 1.0);
                normal.score.axpy(weight * residual, &row, 1.0);
            }
        }
        Some(normal)
    }
}

/// Where the depth map lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) center: Pixel,
    pub(super) zoom: f64,
    pub(super) shift_px: [f64; 2],
}

impl Place {
    fn from_center(&self, at: Pixel) -> Vector2<f64> {
        let [dx, dy] = self.shift_px;
        Vector2::new(at.x - dx - self.center.x, at.y - dy - self.center.y)
    }
}

/// What these frames' normal equations say: contrast, and what zoom and shift are off.
fn solve(information: &Matrix4<f64>, score: &Vector4<f64>) -> Option<(f64, Vector3<f64>)> {
    let solved = information.cholesky()?.solve(score);
    Some((solved[0], solved.fixed_rows::<3>(1) / solved[0]))
}

/// Finds contrast and place, starting from a place that is right within half a square. `look` tells where a pixel of
/// frame i's depth map looks at a place. `None` where the print does not stand out.
pub(super) fn find(
    print: &Print,
    start: Place,
    textures: &[&Texture],
    look: impl Fn(usize, &Place, Pixel) -> Option<Spot> + Sync,
) -> Option<Imprint> {
    let mut place = start;
    let mut normals: Vec<Normal> = Vec::new();
    for _ in 0..5 {
        normals = textures
            .iter()
            .enumerate()
            .filter_map(|(i, texture)| {
                Normal::new(print, texture, &place, |pixel| look(i, &place, pixel))
            })
            .collect();
        let (information, score) = total(&normals);
        let (_, off) = solve(&information, &score)?;
        // A step longer than an edge is wide would leave what is linear.
        let longest = (off.y.hypot(off.z) / 3.0).max(off.x.abs() / 0.02).max(1.0);
        place.zoom += off.x / longest;
        place.shift_px[0] += off.y / longest;
        place.shift_px[1] += off.z / longest;
    }
    let n = normals.len();
    if n < LEAST_FRAMES {
        return None;
    }
    let (information, score) = total(&normals);
    let (contrast_m, off) = solve(&information, &score)?;
    let mut covariance = Matrix3::zeros();
    let mut variance = 0.0;
    let share = (n as f64 - 1.0) / n as f64;
    for normal in &normals {
        let (without, place) = solve(&(information - normal.information), &(score - normal.score))?;
        let change = place - off;
        covariance.ger(share, &change, &change, 1.0);
        variance += share * (without - contrast_m).powi(2);
    }
    let contrast_sigma_m = variance.sqrt();
    if !(contrast_m.abs() > LEAST_CONTRAST * contrast_sigma_m) {
        return None;
    }
    Some(Imprint {
        place: [place.zoom, place.shift_px[0], place.shift_px[1]],
        covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
        contrast_m,
        contrast_sigma_m,
        n_frames: n,
    })
}

fn total(normals: &[Normal]) -> (Matrix4<f64>, Vector4<f64>) {
    normals.iter().fold((Matrix4::zeros(), Vector4::zeros()), |(information, score), normal| {
        (information + normal.information, score + normal.score)
    })
}
