//! From a scene to an image.

use super::{
    print::PrintedPlane,
    random::{Random, Subject},
    scene::{Light, Motion, Noise, Scene, Sight, Tone, TrueCorner},
};
use crate::{
    geom::{Pixel, Point},
    image::{Gray, Rgb},
    math, par,
};

/// An image and what is true of it.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The image.
    pub image: Rgb,
    /// The corners in it, by ascending id.
    pub corners: Vec<TrueCorner>,
}

impl Rendered {
    /// The image as grey. Where [`Light::tint`] and [`Light::flare`] are neutral, red, green and blue are this grey.
    pub fn gray(&self) -> Gray {
        self.image.to_gray()
    }
}

/// The image the camera of this scene takes. `seed` chooses the noise.
///
/// A pixel holds the mean over its area, in closed form: with [`Noise::None`] and [`Tone::Linear`] the only error is
/// the rounding to whole grey levels (checked in `the_mean_over_a_pixel`). All blur is symmetric about the pixel, so
/// that it moves no corner.
pub fn render(scene: &Scene, seed: u64) -> Rendered {
    render_frame(scene, seed, 0)
}

/// As [`render`], with the noise of frame `frame`.
pub(super) fn render_frame(scene: &Scene, seed: u64, frame: usize) -> Rendered {
    let light = received(scene);
    let image = developed(scene, &light, &mut Random::new(seed, Subject::Image, frame));
    Rendered { image, corners: scene.corners() }
}

/// One number per pixel of the image and of a rim round it, which lens and motion need.
struct Plane {
    width: usize,
    height: usize,
    rim: usize,
    values: Vec<f32>,
}

impl Plane {
    /// Width with the rim.
    fn stride(&self) -> usize {
        self.width + 2 * self.rim
    }

    /// The pixel with this column and row of the plane, rim included.
    fn pixel(&self, column: usize, row: usize) -> Pixel {
        Pixel::new(column as f64 - self.rim as f64, row as f64 - self.rim as f64)
    }

    /// Calls `band(first row, values)` for bands of `ROWS` rows with their rims; the bands know nothing of each other.
    fn for_each_band(&mut self, band: impl Fn(usize, &mut [f32]) + Sync) {
        /// Enough to share the work at a band's edge, few enough to keep all cores busy.
        const ROWS: usize = 16;
        let size = ROWS * self.stride();
        par::for_each_chunk(&mut self.values, size, |i, values| band(i * ROWS, values));
    }

    /// Calls `row(index, values)` for every row with its rim.
    fn for_each_row(&mut self, row: impl Fn(usize, &mut [f32]) + Sync) {
        let stride = self.stride();
        self.for_each_band(|first, values| {
            values.chunks_mut(stride).enumerate().for_each(|(y, values)| row(first + y, values));
        });
    }
}

/// Reflectance as the pixels receive it, through lens and motion.
fn received(scene: &Scene) -> Plane {
    let flow = Flow::new(scene);
    let lens_reach = (3.5 * scene.blur_sigma_px).ceil() as usize;
    let motion_reach = (flow.longest_px / 2.0).ceil() as usize;
    let rim = if lens_reach + motion_reach == 0 { 0 } else { lens_reach + motion_reach + 1 };
    let sharp = sharp(scene, rim);
    let moved = if flow.longest_px > 0.0 { moved(&sharp, &flow) } else { sharp };
    if lens_reach > 0 { blurred(&moved, scene.blur_sigma_px) } else { moved }
}

/// The mean reflectance over every pixel.
fn sharp(scene: &Scene, rim: usize) -> Plane {
    let (width, height) = (scene.camera.intrinsics.width, scene.camera.intrinsics.height);
    let values = vec![0.0; (width + 2 * rim) * (height + 2 * rim)];
    let mut plane = Plane { width, height, rim, values };
    let sight = Sight::new(scene);
    let printed = PrintedPlane::new(&scene.board, &scene.print, scene.wall.reflectance());
    // A pixel's trace on the board is not evenly dense: the mean over it shifts an edge by up to change/12 pixels, and
    // n² less where the pixel is cut into n x n.
    const SHIFT_PX: f64 = 2e-4;
    let cut = (sight.density_change() / 12.0 / SHIFT_PX).sqrt().ceil().clamp(1.0, 16.0) as usize;
    let stride = plane.stride();
    // (0, 0) is the outer corner of the first pixel of the plane.
    let board_at = |x: f64, y: f64| {
        let pixel = Pixel::new(x - rim as f64 - 0.5, y - rim as f64 - 0.5);
        sight.hit(pixel).map_or([f64::NAN; 2], |hit| hit.square)
    };
    let corners = |row: usize| -> Vec<([f64; 2], [usize; 2])> {
        (0..=stride)
            .map(|column| {
                let square = board_at(column as f64, row as f64);
                (square, printed.interval(square))
            })
            .collect()
    };
    plane.for_each_band(|first, values| {
        let mut above = corners(first);
        for (row, values) in (first..).zip(values.chunks_mut(stride)) {
            let below = corners(row + 1);
            for (column, value) in values.iter_mut().enumerate() {
                let four = [above[column], above[column + 1], below[column + 1], below[column]];
                let uniform = if four.iter().any(|(square, _)| square[0].is_nan()) {
                    Some(scene.wall.reflectance())
                } else {
                    let axis = |axis: usize| four.iter().map(move |(_, interval)| interval[axis]);
                    let low = [0, 1].map(|a| axis(a).min().unwrap_or(0));
                    let high = [0, 1].map(|a| axis(a).max().unwrap_or(0));
                    printed.uniform(low, high)
                };
                let mean = || {
                    let inside = |x: f64, y: f64| board_at(column as f64 + x, row as f64 + y);
                    pixel_mean(&printed, four.map(|(square, _)| square), cut, inside)
                };
                *value = uniform.unwrap_or_else(mean) as f32;
                let [from, to] = [four[0].0, four[2].0];
                let at = [0, 1].map(|i| f64::midpoint(from[i], to[i]) * scene.board.square_m);
                if !at[0].is_nan() {
                    let diagonal2 = (to[0] - from[0]).powi(2) + (to[1] - from[1]).powi(2);
                    let pixel_m = (diagonal2 / 2.0).sqrt() * scene.board.square_m;
                    *value *= scene.wall.change(at, pixel_m) as f32;
                }
            }
            above = below;
        }
    });
    plane
}

/// The mean reflectance over a pixel whose corners (clockwise from the top left) lie at `outline` on the board, cut
/// into `cut` x `cut` parts; `inside` takes a position within the pixel, from (0, 0) to (1, 1), to the board.
fn pixel_mean(
    printed: &PrintedPlane,
    outline: [[f64; 2]; 4],
    cut: usize,
    inside: impl Fn(f64, f64) -> [f64; 2],
) -> f64 {
    if cut == 1 {
        return quad_mean(printed, outline);
    }
    let point = |i: usize, j: usize| match (i, j) {
        (0, 0) => outline[0],
        (i, 0) if i == cut => outline[1],
        (i, j) if i == cut && j == cut => outline[2],
        (0, j) if j == cut => outline[3],
        _ => inside(i as f64 / cut as f64, j as f64 / cut as f64),
    };
    let mut sum = 0.0;
    let mut above: Vec<[f64; 2]> = (0..=cut).map(|i| point(i, 0)).collect();
    for j in 1..=cut {
        let below: Vec<[f64; 2]> = (0..=cut).map(|i| point(i, j)).collect();
        for i in 0..cut {
            sum += quad_mean(printed, [above[i], above[i + 1], below[i + 1], below[i]]);
        }
        above = below;
    }
    sum / (cut * cut) as f64
}

/// The mean reflectance over a quadrilateral on the board.
fn quad_mean(printed: &PrintedPlane, outline: [[f64; 2]; 4]) -> f64 {
    let (mut integral, mut area) = (0.0, 0.0);
    for i in 0..4 {
        let (from, to) = (outline[i], outline[(i + 1) % 4]);
        integral += printed.along(from, to);
        area += (from[0] - outline[0][0] + to[0] - outline[0][0]) / 2.0 * (to[1] - from[1]);
    }
    if area.abs() > 1e-14 { printed.mean(integral, area) } else { printed.at(outline[0]) }
}

/// How the image of the board moves during the exposure, at the knots of a grid over the image.
struct Flow {
    columns: usize,
    /// Displacement from the beginning to the end of the exposure, pixels.
    knots: Vec<[f64; 2]>,
    longest_px: f64,
}

impl Flow {
    /// Knots stand this far apart, beginning `STEP_PX` outside the image. The flow of a plane is a quadratic function
    /// of the ray; between knots 16 px apart, linear interpolation is right to a thousandth of it.
    const STEP_PX: usize = 16;

    fn new(scene: &Scene) -> Self {
        let (width, height) = (scene.camera.intrinsics.width, scene.camera.intrinsics.height);
        let (columns, rows) = (width / Self::STEP_PX + 4, height / Self::STEP_PX + 4);
        if scene.motion == Motion::NONE {
            return Self { columns, knots: Vec::new(), longest_px: 0.0 };
        }
        let sight = Sight::new(scene);
        let displacement = |pixel: Pixel| {
            let hit = sight.hit_plane(pixel)?;
            let [u, v] = scene.camera.unproject(pixel)?;
            let z = hit.depth_m;
            let point = Point::new(u * z, v * z, z);
            let jacobian = scene.camera.d_pixel_d_point(point)?;
            let moved = scene.motion.of(point);
            Some(jacobian.map(|row| row[0] * moved.x + row[1] * moved.y + row[2] * moved.z))
        };
        let knots: Vec<[f64; 2]> = (0..columns * rows)
            .map(|i| {
                let at = |i: usize| (i * Self::STEP_PX) as f64 - Self::STEP_PX as f64;
                // Where no board is in sight there is nothing to blur.
                displacement(Pixel::new(at(i % columns), at(i / columns))).unwrap_or([0.0; 2])
            })
            .collect();
        let longest_px = knots.iter().map(|[x, y]| math::hypot(*x, *y)).fold(0.0, f64::max);
        Self { columns, knots, longest_px }
    }

    /// Displacement at this pixel of the image, pixels; constant beyond the grid.
    fn at(&self, pixel: Pixel) -> [f64; 2] {
        let rows = self.knots.len() / self.columns;
        let place = |u: f64, n: usize| {
            let at = (u / Self::STEP_PX as f64 + 1.0).clamp(0.0, (n - 1) as f64);
            let index = (at as usize).min(n - 2);
            (index, at - index as f64)
        };
        let ((i, fx), (j, fy)) = (place(pixel.x, self.columns), place(pixel.y, rows));
        let knot = |i: usize, j: usize| self.knots[j * self.columns + i];
        let (a, b, c, d) = (knot(i, j), knot(i + 1, j), knot(i, j + 1), knot(i + 1, j + 1));
        [0, 1].map(|k| {
            (a[k] * (1.0 - fx) + b[k] * fx) * (1.0 - fy) + (c[k] * (1.0 - fx) + d[k] * fx) * fy
        })
    }
}

/// Every pixel becomes the mean over the way it travels, half before and half after.
fn moved(sharp: &Plane, flow: &Flow) -> Plane {
    let mut plane = Plane { values: vec![0.0; sharp.values.len()], ..*sharp };
    let stride = sharp.stride();
    let (last_x, last_y) = ((stride - 1) as f64, (sharp.values.len() / stride - 1) as f64);
    let at = |x: f64, y: f64| {
        let (x, y) = (x.clamp(0.0, last_x), y.clamp(0.0, last_y));
        let (x0, y0) = (x as usize, y as usize);
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let (x1, y1) = ((x0 + 1).min(stride - 1), (y0 + 1).min(last_y as usize));
        let p = |x: usize, y: usize| sharp.values[y * stride + x];
        (p(x0, y0) * (1.0 - fx) + p(x1, y0) * fx) * (1.0 - fy)
            + (p(x0, y1) * (1.0 - fx) + p(x1, y1) * fx) * fy
    };
    let pixel = |column, row| sharp.pixel(column, row);
    plane.for_each_row(|row, values| {
        for (column, value) in values.iter_mut().enumerate() {
            let [dx, dy] = flow.at(pixel(column, row));
            // Two samples per pixel of way: bilinear interpolation fills what lies between.
            let n = (2.0 * (dx * dx + dy * dy).sqrt()).ceil() as usize;
            if n <= 1 {
                *value = sharp.values[row * stride + column];
                continue;
            }
            let sum: f32 = (0..n)
                .map(|i| {
                    let time = (i as f64 + 0.5) / n as f64 - 0.5;
                    at(column as f64 + time * dx, row as f64 + time * dy)
                })
                .sum();
            *value = sum / n as f32;
        }
    });
    plane
}

/// Convolved with a Gaussian.
fn blurred(plane: &Plane, sigma_px: f64) -> Plane {
    let radius = (3.5 * sigma_px).ceil() as usize;
    let weights: Vec<f64> = (0..=2 * radius)
        .map(|i| math::exp(-0.5 * ((i as f64 - radius as f64) / sigma_px).powi(2)))
        .collect();
    let total: f64 = weights.iter().sum();
    let weights: Vec<f32> = weights.iter().map(|w| (w / total) as f32).collect();
    let stride = plane.stride();
    let rows = plane.values.len() / stride;
    let mut across = Plane { values: vec![0.0; plane.values.len()], ..*plane };
    across.for_each_row(|y, out| {
        let row = &plane.values[y * stride..][..stride];
        out.copy_from_slice(row); // The rim's own ends, which no pixel of the image reaches.
        let Some(inner) = stride.checked_sub(2 * radius) else { return };
        let out = &mut out[radius..][..inner];
        out.fill(0.0);
        for (i, weight) in weights.iter().enumerate() {
            for (out, value) in out.iter_mut().zip(&row[i..][..inner]) {
                *out += weight * value;
            }
        }
    });
    let mut down = Plane { values: vec![0.0; plane.values.len()], ..*plane };
    down.for_each_row(|y, out| {
        for (i, weight) in weights.iter().enumerate() {
            let from = (y + i).saturating_sub(radius).min(rows - 1);
            for (out, value) in out.iter_mut().zip(&across.values[from * stride..][..stride]) {
                *out += weight * value;
            }
        }
    });
    down
}

/// From reflectance to grey levels.
fn developed(scene: &Scene, reflectance: &Plane, random: &mut Random) -> Rgb {
    let Light { exposure, gradient, vignetting, tint, flare } = scene.light;
    let (width, height) = (reflectance.width, reflectance.height);
    let tone = ToneTable::new(scene.tone);
    let (middle_x, middle_y) = ((width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0);
    let far2 = (middle_x * middle_x + middle_y * middle_y).max(1.0);
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let row = &reflectance.values[(y + reflectance.rim) * reflectance.stride()..];
        let dy = y as f64 - middle_y;
        for (x, &value) in row[reflectance.rim..][..width].iter().enumerate() {
            let dx = x as f64 - middle_x;
            let slope = gradient[0] * dx / width as f64 + gradient[1] * dy / height as f64;
            let shading = (1.0 + slope) * (1.0 - vignetting * (dx * dx + dy * dy) / far2);
            let light = exposure * shading * f64::from(value);
            let (before, after) = match scene.noise {
                Noise::None => (0.0, 0.0),
                Noise::Gray { sigma } => (0.0, sigma * random.normal()),
                Noise::Sensor { full_well_e, read_e } => {
                    let signal_e = light.max(0.0) * full_well_e;
                    ((signal_e + read_e * read_e).sqrt() / full_well_e * random.normal(), 0.0)
                }
            };
            pixels.push([0, 1, 2].map(|c| {
                // Rounds to nearest; a cast from float saturates at 0 and 255.
                (tone.level(light * tint[c] + flare[c] + before) + after + 0.5) as u8
            }));
        }
    }
    Rgb::new(width, height, pixels)
}

/// A tone curve: exact for [`Tone::Linear`], else tabulated (sRGB: to better than 0.02 grey levels).
enum ToneTable {
    Linear,
    Table(Vec<f64>),
}

impl ToneTable {
    const STEPS: usize = 4096;

    fn new(tone: Tone) -> Self {
        match tone {
            Tone::Linear => Self::Linear,
            Tone::Srgb => Self::Table(
                (0..=Self::STEPS)
                    .map(|i| 255.0 * srgb_from_linear(i as f64 / Self::STEPS as f64))
                    .collect(),
            ),
        }
    }

    /// The grey level of this much light, not rounded.
    fn level(&self, light: f64) -> f64 {
        match self {
            Self::Linear => 255.0 * light,
            Self::Table(table) => {
                let at = light.clamp(0.0, 1.0) * Self::STEPS as f64;
                let index = (at as usize).min(Self::STEPS - 1);
                table[index] + (at - index as f64) * (table[index + 1] - table[index])
            }
        }
    }
}

/// IEC 61966-2-1.
fn srgb_from_linear(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * math::pow(light, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        board::CharucoBoard,
        camera::{Camera, Distortion, Intrinsics, RadialTable, TablePair},
        geom::{Board, Color, Pose, Rotation, Vector3},
        simulate::{Handedness, Polarity, Surface},
    };

    /// A camera with a field of view as a phone's, whatever its size.
    fn camera(width: usize, height: usize) -> Camera {
        let f = 0.885 * width as f64;
        let (cx, cy) = (0.497 * width as f64, 0.503 * height as f64);
        let intrinsics = Intrinsics { fx: f, fy: f, cx, cy, width, height };
        Camera { intrinsics, distortion: Distortion::None }
    }

    fn lens(camera: &Camera) -> Distortion {
        let Intrinsics { cx, cy, width, height, .. } = camera.intrinsics;
        let center = Pixel::new(cx + 1.5, cy - 2.0);
        let samples = (0..42).map(|i| 0.05 * (f64::from(i) / 41.0).powi(2)).collect();
        let radius = RadialTable::farthest_corner_px(center, width, height);
        let inverse = RadialTable::new(center, radius, samples).unwrap();
        Distortion::Table(TablePair::from_inverse(inverse))
    }

    fn pose(tilt: Vector3<f64>, distance_m: f64) -> Pose<Color, Board> {
        let rotation = Rotation::from_scaled_axis(tilt);
        let middle = rotation * Vector3::new(0.104, 0.0835, 0.0);
        Pose::new(rotation, Vector3::new(0.0, 0.0, distance_m) - middle)
    }

    fn board(text: &str) -> CharucoBoard {
        text.parse().unwrap()
    }

    fn scene(width: usize, height: usize, tilt: Vector3<f64>) -> Scene {
        let paper = board("10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL:legacy");
        Scene::ideal(paper, camera(width, height), pose(tilt, 0.3))
    }

    /// Every pixel against many point samples of the board, for every kind of print, camera and surface.
    #[test]
    fn the_mean_over_a_pixel() {
        let tilted = Vector3::new(0.6, -0.5, 0.3);
        let mut scenes =
            vec![scene(64, 48, tilted), scene(160, 120, tilted), scene(64, 48, tilted)];
        scenes[2].camera.distortion = lens(&scenes[2].camera);
        for (text, tilt) in [
            ("7x5:30mm:21mm:4X4_50", Vector3::new(-0.4, 0.3, 1.4)),
            ("6x9:20mm:15mm:6X6_250:legacy", Vector3::new(0.0, 0.0, 0.0)),
        ] {
            scenes.push(Scene::ideal(board(text), camera(80, 60), pose(tilt, 0.35)));
        }
        let mut printed_otherwise = scene(64, 48, tilted);
        printed_otherwise.print.handedness = Handedness::Mirrored;
        printed_otherwise.print.polarity = Polarity::WhiteOnBlack;
        printed_otherwise.surface = Surface::taped_sheet(2e-3);
        scenes.push(printed_otherwise);
        for scene in &scenes {
            let plane = sharp(scene, 0);
            let sight = Sight::new(scene);
            let width_m = scene.board.squares_x as f64 * scene.board.square_m;
            let reflectance = |pixel: Pixel| {
                let square = sight.hit(pixel).expect("the board's plane fills the image").square;
                let [mut x, y] = square.map(|s| s * scene.board.square_m);
                if scene.print.handedness == Handedness::Mirrored {
                    x = width_m - x;
                }
                let height_m = scene.board.squares_y as f64 * scene.board.square_m;
                let margin = scene.print.margin_m;
                match scene.board.is_white_at(scene.print.layout, x, y) {
                    Some(white) if white == (scene.print.polarity == Polarity::BlackOnWhite) => {
                        scene.print.paper
                    }
                    Some(_) => scene.print.ink,
                    None if (-margin..width_m + margin).contains(&x)
                        && (-margin..height_m + margin).contains(&y) =>
                    {
                        scene.print.paper
                    }
                    None => scene.wall.reflectance(),
                }
            };
            let mut worst: f64 = 0.0;
            let contrast = scene.print.paper - scene.print.ink;
            for (i, &value) in plane.values.iter().enumerate().step_by(23) {
                let (x, y) = ((i % plane.width) as f64, (i / plane.width) as f64);
                // Rows of samples stand askew, lest an edge along the pixels meets all samples of a row at once.
                const N: usize = 150;
                let sum: f64 = (0..N * N)
                    .map(|k| {
                        let (a, b) = ((k % N) as f64 + 0.5, (k / N) as f64 + 0.5);
                        let askew =
                            |a: f64, b: f64| (a / N as f64 + b / (N * N) as f64) % 1.0 - 0.5;
                        reflectance(Pixel::new(x + askew(a, b), y + askew(b, a)))
                    })
                    .sum();
                worst = worst.max((f64::from(value) - sum / (N * N) as f64).abs() / contrast);
            }
            // The samples themselves are good to about 1/(2·150) per crossing edge, several edges a pixel.
            assert!(worst < 3e-3, "{}: {worst}", scene.board.squares_x);
        }
    }

    /// Where an edge crosses a row of pixels, the sum of the row says how much of it is dark: exact for a straight
    /// edge, hence a measurement of the renderer far below a thousandth of a pixel.
    #[test]
    fn edges_are_where_they_belong() {
        for (width, height, tilt) in [
            (640, 480, Vector3::new(0.0, 0.9, 0.05)),
            (640, 480, Vector3::new(0.1, -0.8, -0.1)),
            (640, 480, Vector3::new(0.0, 0.0, 0.0)),
            (160, 120, Vector3::new(0.0, 0.8, 0.05)),
        ] {
            let mut scene = scene(width, height, tilt);
            if width < 640 {
                scene.color_from_board = pose(tilt, 0.14); // Edges long enough to be told from the markers.
            }
            let plane = sharp(&scene, 0);
            let (ink, paper) = (scene.print.ink, scene.print.paper);
            let size = scene.board.square_m;
            let project = |s: f64, t: f64| {
                let point = scene.color_from_board * Point::new(s * size, t * size, 0.0);
                scene.camera.project(point).expect("in front")
            };
            let sight = Sight::new(&scene);
            let (mut sum, mut worst, mut n) = (0.0, 0.0_f64, 0);
            for (column, row) in (1..10).flat_map(|c| (0..8).map(move |r| (c, r))) {
                // Close to the row's middle lie markers; the rows of pixels just inside the square do not meet them.
                let (top, bottom) = (
                    project(column as f64, row as f64 + 0.01),
                    project(column as f64, row as f64 + 0.24),
                );
                let first = top.y.ceil().max(0.0) as usize;
                for y in first..(bottom.y.floor().max(0.0) as usize).min(height) {
                    let along = (y as f64 - top.y) / (bottom.y - top.y);
                    let truth = top.x + along * (bottom.x - top.x);
                    let reach = 2.0;
                    if truth < 3.0 || truth > width as f64 - 4.0 {
                        continue;
                    }
                    let (from, to) = ((truth - reach) as usize, (truth + reach) as usize);
                    // These pixels must see nothing but the two squares: neither marker nor other squares.
                    let only_the_edge = [(from, -0.5), (from, 0.5), (to, -0.5), (to, 0.5)]
                        .into_iter()
                        .filter_map(|(x, dy)| {
                            let dx = if x == from { -0.5 } else { 0.5 };
                            sight.hit(Pixel::new(x as f64 + dx, y as f64 + dy))
                        })
                        .all(|hit| {
                            (hit.square[0] - column as f64).abs() < 1.0
                                && (0.0..0.25).contains(&(hit.square[1] - row as f64))
                        });
                    if !only_the_edge {
                        continue;
                    }
                    let values = &plane.values[y * width..][from..=to];
                    let bright: f64 =
                        values.iter().map(|&v| (f64::from(v) - ink) / (paper - ink)).sum();
                    let right_is_bright = scene.board.is_white(scene.print.layout, column, row);
                    let edge = if right_is_bright {
                        to as f64 + 0.5 - bright
                    } else {
                        from as f64 - 0.5 + bright
                    };
                    sum += edge - truth;
                    worst = worst.max((edge - truth).abs());
                    n += 1;
                }
            }
            assert!(n >= 20, "{width} {tilt:?}: {n} crossings");
            let bias = sum / f64::from(n);
            assert!(bias.abs() < 2e-4 && worst < 1e-3, "{width} {tilt:?}: {bias} {worst} ({n})");
        }
    }

    /// Fronto-parallel and centred on a corner, the neighbourhood of the corner looks the same turned by 180°; lens and
    /// motion must leave it so.
    #[test]
    fn blur_moves_no_corner() {
        let mut scene = scene(161, 121, Vector3::zeros());
        (scene.camera.intrinsics.cx, scene.camera.intrinsics.cy) = (80.0, 60.0);
        let corner = scene.board.corner(31);
        scene.color_from_board =
            Pose::new(Rotation::identity(), Vector3::new(0.0, 0.0, 0.12) - corner.coords);
        scene.blur_sigma_px = 0.8;
        scene.motion.translation_m = Vector3::new(4e-3, -1e-3, 0.0);
        let plane = received(&scene);
        let at = |dx: i32, dy: i32| {
            let (x, y) = ((80 + dx) as usize + plane.rim, (60 + dy) as usize + plane.rim);
            plane.values[y * plane.stride() + x]
        };
        let contrast = scene.print.paper - scene.print.ink;
        for (dx, dy) in (-3..=3).flat_map(|dx| (-3..=3).map(move |dy| (dx, dy))) {
            let error = f64::from(at(dx, dy) - at(-dx, -dy)).abs() / contrast;
            assert!(error < 1e-5, "({dx}, {dy}): {error}");
        }
        // 4 mm at 0.12 m are 4.7 px: no black and white touch any more.
        let step = f64::from(at(2, -3) - at(1, -3)).abs() / contrast;
        assert!((0.05..0.35).contains(&step), "{step}");
    }
}
