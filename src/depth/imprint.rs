//! The print, seen in the depth map: a second witness of zoom and shift.

use nalgebra::{Cholesky, Matrix2, Matrix4, Matrix5, SMatrix, SVector, Vector2, Vector4, Vector5};

use super::{
    join::Seen,
    rays::RayGrid,
    texture::{NOTHING, Sums, Texture, UNIT_PER_M},
};

use crate::{
    board::{CharucoBoard, Layout},
    calibrate::Estimate,
    geom::Pixel,
    math, par,
    solve::mad_sigma,
};

/// What the print in the depth maps says of where they lie on the colour images.
///
/// Structured light measures white paper a little nearer than black ink: by a tenth of a millimetre in the published
/// recordings. The depth map so shows the chessboard, faintly, and where it shows it is where it lies, whatever the
/// sensor's slow errors and the board's heights are.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Imprint {
    /// As in [`Registration`](super::Registration).
    pub zoom: Estimate,
    /// As in [`Registration`](super::Registration), pixels.
    pub shift_px: [Estimate; 2],
    /// Of zoom, shift x and shift y (px): leaving out each picture in turn, and what the size of the neighbourhood
    /// changes.
    pub covariance: [[f64; 3]; 3],
    /// How much nearer white is measured than black, as the sensor blurs it, metres.
    pub contrast_m: Estimate,
    /// Frames that took part.
    pub n_frames: usize,
}

/// What the print says.
pub(super) struct PrintSeen {
    pub(super) imprint: Imprint,
    /// Zoom and shift (px).
    pub(super) place: Seen<3>,
    /// Zoom, shift (px) and the share of the other distortion state.
    pub(super) with_lens: Option<Seen<4>>,
}

/// What the choice of the neighbourhood moves zoom and shift (px) by: on the published recordings, 35 or 55 pixels
/// instead of 45 change them by so much, in no one direction. Leaving out pictures does not tell of it.
const NEIGHBOURHOOD_SIGMA: [f64; 3] = [0.0008, 0.12, 0.12];
/// The same for the share of the other distortion state, of lenses that bend by some pixels.
const NEIGHBOURHOOD_SIGMA_LENS: f64 = 0.1;

/// The print's contrast must stand out of the noise by so much; the place is a ratio to it, biased and skewed where it
/// does not (by 1/this² of itself).
const LEAST_CONTRAST: f64 = 7.0;
/// Steps towards the place; from a few pixels away five are enough.
const MAX_STEPS: usize = 12;
/// Steps of zoom, shift (px) and share below these are the last: a tenth of the best σ.
const SMALL: [f64; 3] = [1e-4, 0.02, 0.01];
/// No step is longer than this, an edge's width.
const EDGE: [f64; 3] = [0.02, 3.0, 0.5];
/// So near to the place all is linear.
const LINEAR: [f64; 3] = [0.01, 1.0, 0.3];
/// Steps of zoom, shift and share by which it is tried how the place follows.
const TRIED: [f64; 4] = [5e-3, 0.5, 0.5, 0.1];
/// What the normal equations say of a step, as a share of it, at the least: 0.7 to 1 in recordings.
const LEAST_RESPONSE: f64 = 0.2;
/// Fewer different pictures tell no σ.
const LEAST_PICTURES: usize = 5;
/// A frame with fewer cells says nothing.
const LEAST_CELLS: usize = 200;
/// How widely the sensor itself smooths, pixels (a Gaussian's σ): of 2 to 10, this explains most of the three published
/// recordings' texture, or nearly. Where the sensor smooths otherwise the place is the same, and its σ a little larger.
const SENSOR_BLUR_PX: f64 = 8.0;
/// Tukey's constant: 95 % efficiency.
const TUKEY: f64 = 4.685;

/// The print at a row of sharpnesses.
pub(super) struct Print {
    /// Raster cells per metre.
    per_m: f64,
    /// Paper round the board, metres.
    margin_m: f64,
    columns: usize,
    rows: usize,
    /// Mean darkness of the board without its margin.
    pub(super) darkness: f64,
    /// (σ in metres, darkness −½ to ½), by σ.
    levels: Vec<(f64, Vec<f32>)>,
}

impl Print {
    pub(super) fn new(board: &CharucoBoard) -> Self {
        // Markers have 6 to 10 cells; blurred as the sensor does it, 16 cells a square show all that is left.
        let per_square = if board.squares_x.max(board.squares_y) > 40 { 8 } else { 16 };
        let per_m = per_square as f64 / board.square_m;
        // A square of paper all round: the sensor blurs the margin into the board's rim.
        let [columns, rows] =
            [board.squares_x, board.squares_y].map(|squares| (squares + 2) * per_square);
        let layout = board.layout.unwrap_or(Layout::New);
        let at = |i: usize| (i as f64 + 0.5) / per_m - board.square_m;
        let mut raster: Vec<f32> = (0..columns * rows)
            .map(|i| match board.is_white_at(layout, at(i % columns), at(i / columns)) {
                Some(false) => 0.5,
                _ => -0.5,
            })
            .collect();
        let board_only = (0..columns * rows).filter(|i| {
            let inside = |k: usize, n: usize| (per_square..n - per_square).contains(&k);
            inside(i % columns, columns) && inside(i / columns, rows)
        });
        let n = (board.squares_x * board.squares_y * per_square * per_square) as f64;
        let darkness = board_only.map(|i| f64::from(raster[i])).sum::<f64>() / n;
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
        Self { per_m, margin_m: board.square_m, columns, rows, darkness, levels }
    }

    /// Darkness and its derivative (per metre) at a place, at the level nearest to this blur; `None` beside the board.
    fn at(&self, level: &[f32], at_m: &Vector2<f64>) -> Option<(f64, Vector2<f64>)> {
        let [x, y] = [at_m.x, at_m.y].map(|m| (m + self.margin_m) * self.per_m - 0.5);
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
        let nearness = |(each, _): &&(f64, Vec<f32>)| math::ln(each / sigma_m).abs();
        let best = self.levels.iter().min_by(|a, b| nearness(a).total_cmp(&nearness(b)));
        best.map_or(&[], |(_, level)| level)
    }
}

/// Blurs in place with a Gaussian of this σ, the rim repeated.
fn blur(raster: &mut Vec<f32>, (columns, rows): (usize, usize), sigma: f64) {
    let radius = (3.0 * sigma).ceil() as usize;
    let mut weights: Vec<f32> = (0..=2 * radius)
        .map(|i| math::exp(-0.5 * ((i as f64 - radius as f64) / sigma).powi(2)) as f32)
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

/// A frame's normal equations: contrast (metres), and contrast times what zoom, shift and the share of the other
/// distortion state are off.
#[derive(Clone)]
struct Normal {
    frame: usize,
    information: Matrix5<f64>,
    score: Vector5<f64>,
}

impl Normal {
    /// Cells where they look now, compared with their neighbours.
    fn new(
        print: &Print,
        (frame, texture): (usize, &Texture),
        place: &Place,
        look: impl Fn(Pixel) -> Option<Spot>,
        lens: Option<&RayGrid>,
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
        let blur_px = math::hypot(SENSOR_BLUR_PX, texture.cell_px as f64 / 12.0_f64.sqrt());
        let level = print.level(blur_px * scale / f64::from(n_spots.max(1)));
        // Darkness and its derivatives, as depth: what is measured too far by d has an inverse depth less by d/z².
        let seen: Vec<Option<[f64; 5]>> = (0..n)
            .map(|k| {
                let spot = spots[k].as_ref()?;
                let (darkness, by_board) = print.at(level, &spot.on_board_m)?;
                let by_pixel = spot.by_pixel.transpose() * by_board;
                let by_zoom = by_pixel.dot(&place.off_center(texture.at(k)));
                let by_shift = -place.zoom * by_pixel;
                let lens = lens.and_then(|grid| grid.at(place.looked_at(texture.at(k))));
                let by_lens = lens.map_or(0.0, |([x, y], _)| by_pixel.dot(&Vector2::new(x, y)));
                let curvature = -1.0 / (spot.depth_m * spot.depth_m);
                Some([darkness, by_zoom, by_shift.x, by_shift.y, by_lens].map(|d| d * curvature))
            })
            .collect();
        let sums = Sums::new(texture.columns, seen.iter().copied());
        let mut rows = Vec::with_capacity(n);
        for k in 0..n {
            let Some((here, (mean, true))) = seen[k].zip(sums.mean(k)) else { continue };
            let row = Vector5::from_fn(|c, _| here[c] - mean[c]);
            rows.push((f64::from(texture.rough[k]) * UNIT_PER_M, row));
        }
        let residuals: Vec<f64> = rows.iter().map(|(residual, _)| *residual).collect();
        let sigma = mad_sigma(&residuals, 0.0);
        if rows.len() < LEAST_CELLS || !(sigma > 0.0) {
            return None;
        }
        let mut normal = Self { frame, information: Matrix5::zeros(), score: Vector5::zeros() };
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
    /// Share of the other distortion state.
    pub(super) lens: f64,
}

impl Place {
    /// Where a pixel of the depth map looks in the colour image, but for the other distortion state.
    pub(super) fn looked_at(&self, at: Pixel) -> Pixel {
        let from = self.off_center(at);
        Pixel::new(self.center.x + self.zoom * from.x, self.center.y + self.zoom * from.y)
    }

    fn moved(&self, step: &Vector4<f64>) -> Self {
        let [x, y] = self.shift_px;
        let shift_px = [x + step.y, y + step.z];
        Self { zoom: self.zoom + step.x, shift_px, lens: self.lens + step.w, ..*self }
    }

    fn off_center(&self, at: Pixel) -> Vector2<f64> {
        let [dx, dy] = self.shift_px;
        Vector2::new(at.x - dx - self.center.x, at.y - dy - self.center.y)
    }
}

/// What these frames' normal equations say: contrast (metres), and what zoom, shift and, of five numbers, the share of
/// the other state are off.
fn solve<const M: usize>(
    information: &Matrix5<f64>,
    score: &Vector5<f64>,
) -> Option<SVector<f64, M>> {
    let information = information.fixed_view::<M, M>(0, 0).into_owned();
    let mut solved = Cholesky::new(information)?.solve(&score.fixed_rows::<M>(0).into_owned());
    let contrast_m = solved[0];
    solved.iter_mut().skip(1).for_each(|off| *off /= contrast_m);
    Some(solved)
}

/// What the frames say at the best place.
struct Best<const M: usize> {
    place: Place,
    contrast_m: f64,
    /// Of contrast (metres), zoom, shift and, of five numbers, the share of the other state.
    covariance: SMatrix<f64, M, M>,
    /// By how much each picture moves them.
    by_picture: Vec<(usize, SVector<f64, M>)>,
    n_frames: usize,
}

impl<const M: usize> Best<M> {
    /// Without contrast.
    fn seen<const K: usize>(&self) -> Seen<K> {
        let [x, y] = self.place.shift_px;
        let place = Vector4::new(self.place.zoom, x, y, self.place.lens);
        let rows = |(picture, by): &(usize, SVector<f64, M>)| {
            (*picture, by.fixed_rows::<K>(1).into_owned())
        };
        Seen {
            found: (
                place.fixed_rows::<K>(0).into_owned(),
                self.covariance.fixed_view::<K, K>(1, 1).into_owned(),
            ),
            by_picture: self.by_picture.iter().map(rows).collect(),
        }
    }
}

/// What is looked at.
struct Looks<'a> {
    print: &'a Print,
    textures: &'a [&'a Texture],
    /// For each texture the number of the picture that it is one of.
    pictures: &'a [usize],
    spot: &'a (dyn Fn(usize, &Place, Pixel) -> Option<Spot> + Sync),
    lens: Option<&'a RayGrid>,
}

impl Looks<'_> {
    /// The best place, from one that is right within half a square, and its covariance by leaving out each picture in
    /// turn (jackknife): frames of one picture have the sensor's pattern and the board's dents at the same places, and
    /// tell nothing of what these do. With M = 5 the share of the other distortion state is free.
    fn best<const M: usize>(&self, start: Place) -> Option<Best<M>> {
        let Converged { place, normals, step_by_off } = self.converge::<M>(start)?;
        let (information, score) = total(&normals);
        let all = solve::<M>(&information, &score)?;
        let mut pictures: Vec<(usize, Normal)> = Vec::new();
        for normal in &normals {
            let picture = self.pictures[normal.frame];
            match pictures.iter_mut().find(|(seen, _)| *seen == picture) {
                Some((_, sum)) => {
                    sum.information += normal.information;
                    sum.score += normal.score;
                }
                None => pictures.push((picture, normal.clone())),
            }
        }
        let n = pictures.len() as f64;
        let by_picture = pictures
            .iter()
            .map(|(picture, own)| {
                let others = (information - own.information, score - own.score);
                let mut by = all - solve::<M>(&others.0, &others.1)?;
                let step = step_by_off * place_of(&by);
                (1..M).for_each(|k| by[k] = step[k - 1]);
                Some((*picture, by * ((n - 1.0) / n).sqrt()))
            })
            .collect::<Option<Vec<_>>>()?;
        let mut covariance = SMatrix::<f64, M, M>::zeros();
        by_picture.iter().for_each(|(_, by)| covariance.ger(1.0, by, by, 1.0));
        let sigmas = NEIGHBOURHOOD_SIGMA.into_iter().chain([NEIGHBOURHOOD_SIGMA_LENS]);
        for (k, sigma) in (1..M).zip(sigmas) {
            covariance[(k, k)] += sigma * sigma;
        }
        let n_frames = normals.len();
        Some(Best { place, contrast_m: all[0], covariance, by_picture, n_frames })
    }

    /// The best place, the normal equations there, and how it follows what they say that it is off.
    fn converge<const M: usize>(&self, start: Place) -> Option<Converged> {
        let mut place = start;
        let mut step_by_off = None;
        let mut normals = Vec::new();
        for _ in 0..MAX_STEPS {
            let off;
            (normals, off) = self.off::<M>(&place)?;
            if step_by_off.is_none() && longest(&off, &LINEAR) < 1.0 {
                step_by_off = Some(self.step_by_off::<M>(&place, &off)?);
            }
            let step = step_by_off.map_or(off, |by| by * off);
            // A step longer than an edge is wide would leave what is linear.
            place = place.moved(&(step / longest(&step, &EDGE).max(1.0)));
            if step_by_off.is_some() && longest(&step, &SMALL) < 1.0 {
                break;
            }
        }
        Some(Converged { place, normals, step_by_off: step_by_off? })
    }

    /// The normal equations at a place, and by how much they say that it is off, to be added to it.
    fn off<const M: usize>(&self, place: &Place) -> Option<(Vec<Normal>, Vector4<f64>)> {
        let frames: Vec<usize> = (0..self.textures.len()).collect();
        let each = par::map(&frames, |&i| {
            let spot = |pixel| (self.spot)(i, place, pixel);
            Normal::new(self.print, (i, self.textures[i]), place, spot, self.lens)
        });
        let normals: Vec<Normal> = each.into_iter().flatten().collect();
        let (information, score) = total(&normals);
        let solved = solve::<M>(&information, &score)?;
        Some((normals, place_of(&solved)))
    }

    /// How far to step for what the normal equations say that a place is off.
    ///
    /// Were the print in the depth maps exactly as blurred as the one it is compared with, it would be that far. Where
    /// it is more so, the same change of what frames say moves the place farther, by half as much again in recordings:
    /// found by moving it a little.
    fn step_by_off<const M: usize>(
        &self,
        place: &Place,
        off: &Vector4<f64>,
    ) -> Option<Matrix4<f64>> {
        let mut towards = Matrix4::identity();
        for k in 0..M - 1 {
            let mut step = Vector4::zeros();
            step[k] = TRIED[k];
            let (_, there) = self.off::<M>(&place.moved(&step))?;
            towards.set_column(k, &((off - there) / TRIED[k]));
        }
        // Where the way is not towards the place, it is not near one.
        let is_near = (0..M - 1).all(|k| towards[(k, k)] > LEAST_RESPONSE);
        towards.try_inverse().filter(|_| is_near)
    }
}

/// Where it is best.
struct Converged {
    place: Place,
    normals: Vec<Normal>,
    /// How far the place moves for what the normal equations say that it is off.
    step_by_off: Matrix4<f64>,
}

/// Zoom, shift and, of five numbers, share of the other state; without contrast.
fn place_of<const M: usize>(numbers: &SVector<f64, M>) -> Vector4<f64> {
    Vector4::from_fn(|k, _| numbers.get(k + 1).copied().unwrap_or(0.0))
}

/// The longest of a step's parts, of those given.
fn longest(step: &Vector4<f64>, parts: &[f64; 3]) -> f64 {
    let [zoom, shift_px, lens] = parts;
    (step.x / zoom).abs().max(math::hypot(step.y, step.z) / shift_px).max((step.w / lens).abs())
}

/// Finds contrast and place, starting from a place that is right within half a square. `look` tells where a pixel of
/// frame i's depth map looks at a place. `None` where the print does not stand out, or in fewer than five pictures.
pub(super) fn find(
    print: &Print,
    start: Place,
    (textures, pictures): (&[&Texture], &[usize]),
    look: impl Fn(usize, &Place, Pixel) -> Option<Spot> + Sync,
    lens: Option<&RayGrid>,
) -> Option<PrintSeen> {
    let looks = Looks { print, textures, pictures, spot: &look, lens: None };
    let best = looks.best::<4>(start)?;
    let Best { place, contrast_m, covariance, ref by_picture, n_frames } = best;
    if by_picture.len() < LEAST_PICTURES {
        return None;
    }
    let estimate =
        |k: usize, value: f64| Estimate { value, sigma: covariance[(k, k)].max(0.0).sqrt() };
    let contrast_m = estimate(0, contrast_m);
    if !(contrast_m.value.abs() > LEAST_CONTRAST * contrast_m.sigma) {
        return None;
    }
    let with_lens = lens.and_then(|_| Some(Looks { lens, ..looks }.best::<5>(place)?.seen::<4>()));
    let imprint = Imprint {
        zoom: estimate(1, place.zoom),
        shift_px: [2, 3].map(|k| estimate(k, place.shift_px[k - 2])),
        covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i + 1, j + 1)])),
        contrast_m,
        n_frames,
    };
    Some(PrintSeen { imprint, place: best.seen::<3>(), with_lens })
}

fn total(normals: &[Normal]) -> (Matrix5<f64>, Vector5<f64>) {
    normals.iter().fold((Matrix5::zeros(), Vector5::zeros()), |(information, score), normal| {
        (information + normal.information, score + normal.score)
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation2;

    use super::{super::test_noise::Noise, *};
    use crate::image::DepthMap;

    const CENTER: Pixel = Pixel { x: 319.5, y: 239.5 };

    /// A board straight before a pinhole, 0.5 mm to the pixel, its middle at the image's, turned a little more in each
    /// frame: edges along the rows of pixels would fall between the same cells everywhere.
    fn spot(frame: usize, pixel: Pixel) -> Spot {
        let turn = Rotation2::new(0.11 + 0.23 * frame as f64);
        let middle = Vector2::new(10.0, 8.0) * (0.5 * 0.020875);
        let from = Vector2::new(pixel.x - CENTER.x, pixel.y - CENTER.y) * 0.0005;
        Spot {
            on_board_m: middle + turn * from,
            by_pixel: turn.into_inner() * 0.0005,
            depth_m: 0.25,
        }
    }

    fn place(zoom: f64, shift_px: [f64; 2]) -> Place {
        Place { center: CENTER, zoom, shift_px, lens: 0.0 }
    }

    fn board() -> CharucoBoard {
        let board = CharucoBoard::paper(0.020875).expect("a board");
        CharucoBoard { layout: Some(Layout::Legacy), ..board }
    }

    /// What is measured of a flat board.
    struct Measured {
        /// Where depth lies.
        place: Place,
        contrast_m: f64,
        /// How widely the sensor blurs the print, metres on the board: a pixel is half a millimetre.
        blur_m: f64,
        noise_m: f64,
    }

    impl Measured {
        /// What is found in so many frames.
        fn found(&self, n_frames: usize, seed: u64) -> Option<Imprint> {
            let print = Print::new(&board());
            let level = print.level(self.blur_m);
            let mut noise = Noise(seed);
            let mut depth = |frame: usize, i: usize| {
                let at = Pixel::new((i % 640) as f64, (i / 640) as f64);
                let on = spot(frame, self.place.looked_at(at)).on_board_m;
                let dark = print.at(level, &on).map_or(-0.5, |(dark, _)| dark);
                (0.25 + self.contrast_m * dark + self.noise_m * noise.normal()) as f32
            };
            let textures: Vec<Texture> = (0..n_frames)
                .map(|frame| {
                    let depths = (0..640 * 480).map(|i| depth(frame, i)).collect();
                    Texture::new(&DepthMap::new(640, 480, depths), [0, 0], [640, 480])
                })
                .collect();
            let textures: Vec<&Texture> = textures.iter().collect();
            let look = |frame: usize, place: &Place, at| Some(spot(frame, place.looked_at(at)));
            let pictures: Vec<usize> = (0..n_frames).collect();
            let found = |pictures: &[usize]| {
                find(&print, place(1.0, [0.0; 2]), (&textures, pictures), look, None)
            };
            // One picture, however often it is seen, tells no σ.
            assert!(found(&vec![0; n_frames]).is_none());
            found(&pictures).map(|seen| seen.imprint)
        }
    }

    /// From where it is looked for, six pixels at the board's rim.
    #[test]
    fn the_print_tells_zoom_and_shift() {
        for contrast_m in [0.0003, -0.0003] {
            let measured = Measured {
                place: place(0.98, [2.4, -1.7]),
                contrast_m,
                blur_m: 0.004,
                noise_m: 0.0003,
            };
            let seen = measured.found(6, 3).expect("stands out");
            assert_eq!(seen.n_frames, 6);
            assert!((seen.zoom.value - 0.98).abs() < 5e-4, "{seen:?}");
            for (axis, truth) in seen.shift_px.iter().zip(measured.place.shift_px) {
                assert!((axis.value - truth).abs() < 0.06, "{seen:?}");
                assert!(axis.sigma < 0.2, "{seen:?}");
            }
            // Of the blurs that the print is kept with, the nearest is taken: a step is 1.4.
            assert!((seen.contrast_m.value / contrast_m - 1.0).abs() < 0.2, "{seen:?}");
        }
    }

    /// A print more blurred than it is taken for, or less, under noise: errors against the σ that leaving out frames
    /// tells.
    #[test]
    fn sigma_is_true_whatever_the_blur() {
        const N: usize = 8;
        let (zoom, shift_px) = (0.99, [1.2, -0.7]);
        for blur_m in [0.002, 0.0065] {
            let (mut squares, mut variances) = ([0.0; 3], [0.0; 3]);
            for seed in 0..N {
                let place = place(zoom, shift_px);
                let measured = Measured { place, contrast_m: 0.0004, blur_m, noise_m: 0.001 };
                let seen = measured.found(8, 40 + seed as u64).expect("stands out");
                let [x, y] = [0, 1].map(|i| seen.shift_px[i].value - shift_px[i]);
                for (k, off) in [seen.zoom.value - zoom, x, y].into_iter().enumerate() {
                    squares[k] += off * off;
                    variances[k] += seen.covariance[k][k] - NEIGHBOURHOOD_SIGMA[k].powi(2);
                }
            }
            let ratio: f64 = (0..3).map(|k| squares[k] / variances[k] / 3.0).sum();
            println!("{blur_m} m: errors² over σ² {ratio:.2}");
            assert!((0.4..1.6).contains(&ratio), "{blur_m}: {ratio}");
        }
    }

    #[test]
    fn without_contrast_it_says_nothing() {
        let place = place(1.0, [0.0; 2]);
        let nothing = Measured { place, contrast_m: 0.0, blur_m: 0.004, noise_m: 0.0003 };
        assert_eq!(nothing.found(6, 3), None);
    }
}
