//! Depth against colour, all views at once: scale, bias, zoom and shift of the sensor.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::{
    Patch, Patches,
    between::{BIAS, N, Plane, Prior, SCALE, SHIFT, Step, ZOOM, between_frames},
    imprint::{self, Imprint, Place, Print, Spot},
    join::{Joined, Seen, join},
    pattern::{Holes, MAX_INCIDENCE_DEG, NEAR_M, Pattern, Residual},
    rays::RayGrid,
    relief::Relief,
    stance::{Stance, moved_cameras, stances},
    texture::Texture,
};
use crate::{
    board::CharucoBoard,
    calibrate::{BoardSurface, Estimate, Parameter, pictures_of},
    camera::Camera,
    detect::Corner,
    geom::Pixel,
    math, par,
    pose::View,
    solve::mad_sigma,
};

/// How the depth sensor stands to the colour camera and to the truth, from the board's whole surface in all views.
///
/// ```text
/// sensor(q) = scale · Z(p) + bias,    p = c + zoom·(q − shift − c)
/// ```
///
/// q is a pixel of the depth map, p the pixel of the colour image whose depth it holds, Z the depth of the board there
/// and c the principal point. A true recording has scale 1, bias 0, zoom 1, shift 0.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Registration {
    /// 1 for a true sensor.
    pub scale: Estimate,
    /// Sensor where the board is at 0, metres: of something halfway between the print's white and its black, where the
    /// sensor tells them apart ([`Imprint::contrast_m`]).
    pub bias_m: Estimate,
    /// Width of the window of the colour image that the depth map shows over the width of the image: 1 where they are
    /// aligned, 0.9507 for the ARKit recordings of the paper's iPads.
    pub zoom: Estimate,
    /// How far depth lies right of and below its place, pixels.
    pub shift_px: [Estimate; 2],
    /// Of scale, bias (m), zoom, shift x, shift y (px).
    pub covariance: [[f64; 5]; 5],
    /// Mean depth of the board over all patches, metres.
    pub center_m: f64,
    /// Smallest and largest depth of the board, metres.
    pub range_m: [f64; 2],
    /// Frames with depth on the board.
    pub n_frames: usize,
    /// Which they are: indices in the recording, ascending.
    pub frames: Vec<usize>,
    /// Patches of the depth maps on the board.
    pub n_patches: usize,
    /// Zoom and shift by the slopes of tilted views alone.
    pub slopes: Slopes,
    /// Zoom and shift by the print in the depth maps alone; `None` where it does not stand out of the noise.
    pub imprint: Option<Imprint>,
    /// How far the two lie apart: χ² over its three degrees of freedom, 1 on average where their σ are right.
    pub disagreement: Option<f64>,
    /// Whether the depth map is distorted as the colour image is, as a share: 0 where it is, 1 where it is the other
    /// way, with zoom and shift free. `None` where nothing tells what the other way would be.
    pub lens_share: Option<Estimate>,
    /// What is left: by frame, over the image, from pixel to pixel.
    pub pattern: Pattern,
}

/// Zoom and shift from how the depth of tilted views slopes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Slopes {
    /// As in [`Registration`].
    pub zoom: Estimate,
    /// As in [`Registration`], pixels.
    pub shift_px: [Estimate; 2],
}

impl Registration {
    /// Sensor minus board at this depth of the board, metres.
    pub fn error_at_m(&self, board_m: f64) -> Estimate {
        let [[ss, sb, ..], [_, bb, ..], ..] = self.covariance;
        let variance = board_m * board_m * ss + 2.0 * board_m * sb + bb;
        Estimate {
            value: (self.scale.value - 1.0) * board_m + self.bias_m.value,
            sigma: variance.max(0.0).sqrt(),
        }
    }

    /// Correlation of scale and bias, −1 to 1.
    pub fn scale_bias_correlation(&self) -> f64 {
        (self.covariance[0][1] / (self.scale.sigma * self.bias_m.sigma)).clamp(-1.0, 1.0)
    }
}

/// What a registration starts from.
#[derive(Clone, Copy)]
pub struct RegisterInput<'a> {
    /// The board.
    pub board: &'a CharucoBoard,
    /// The camera that the views were found with.
    pub camera: &'a Camera,
    /// The camera's free numbers with their σ; without any it is taken as exact.
    pub parameters: &'a [Parameter],
    /// Their covariance, row-major: n·n numbers for n parameters.
    pub covariance: &'a [f64],
    /// The board's shape; without, it is taken as flat.
    pub surface: Option<&'a BoardSurface>,
    /// Views of the board, each with what the depth map of its frame says.
    pub views: &'a [(&'a View, &'a Patches)],
    /// Which pixel of the colour image a pixel of the depth map would show if the one were distorted and the other not:
    /// of a distorted image where the lens puts the pixel, of a rectified one where the tables rectify it to.
    pub other_state: Option<&'a OtherState<'a>>,
}

/// See [`RegisterInput::other_state`].
pub type OtherState<'a> = dyn Fn(Pixel) -> Option<Pixel> + Sync + 'a;

type Numbers = SVector<f64, N>;
type Square = SMatrix<f64, N, N>;

/// A step is the last but one where no number moves by more than this share of its σ.
const SMALL_STEP: f64 = 1e-3;
/// Frames below this number of patches say nothing about a plane.
const LEAST_PATCHES: usize = 12;
/// Frames below this number do not even disagree.
const LEAST_FRAMES: usize = 3;
/// Tukey's biweight keeps 95 % efficiency under normal noise with this multiple of the standard deviation.
const TUKEY: f64 = 4.685;
/// The sensor's noise is alike within cells; a frame shows about so many of them. Only a start: how much the sensor
/// adds to a plane's error is estimated.
const NOISE_CELLS: f64 = 30.0;
/// Noise of a patch relative to others, metres: σ² = floor² + (z²·growth)², after the published recordings.
const NOISE_FLOOR_M: f64 = 0.17e-3;
const NOISE_GROWTH_PER_M: f64 = 2.2e-3;

/// Finds scale, bias, zoom and shift with their covariance. `None` for fewer than three frames with depth on the
/// board, and for a covariance that is not one of the parameters.
///
/// **Two levels.** Within a frame, robustly, the patches say by which plane the sensor's depth differs from the
/// board's: three numbers β (as a change of m in m·X = 1), and what each of the five unknowns would do to them, G.
/// Between frames
///
/// ```text
/// βᵢ = Gᵢ·δθ + εᵢ,   cov εᵢ = κ²·(Σᵢ(pose) + ρ·Σᵢ(sensor))
/// ```
///
/// Σ(pose) follows from the corners' σ, Σ(sensor) has the shape that smooth noise of the sensor gives a plane; κ is
/// found by restricted maximum likelihood, so that their sizes are what the frames scatter by, and ρ is integrated out.
/// Residuals within a frame may be correlated in any way: they only count through β.
///
/// **The board's rim** is not where it is thought to be where the board is wavy: its heights are known at the corners,
/// and a third of its surface lies beyond the outermost of them. That error is the same in all frames, and so neither
/// noise of the poses nor of the sensor: its plane is three more unknowns, known beforehand as well as the heights of
/// the corners tell of what is beyond them.
///
/// **σ** is the larger of this model's and of a sandwich estimator clustered by picture, and to it is added what the
/// camera's own covariance does (poses and rays follow each number of the camera). Not in it: a wrong square length
/// (the scale is wrong by as much), errors of the board's surface other than its plane, and what a wrong camera *model*
/// does.
pub fn register(input: &RegisterInput<'_>) -> Option<Registration> {
    let RegisterInput { board, camera, parameters, surface, views, other_state, .. } = *input;
    if input.covariance.len() != parameters.len().pow(2) {
        return None;
    }
    let moved = moved_cameras(camera, parameters);
    let only_views: Vec<&View> = views.iter().map(|(view, _)| *view).collect();
    let stances = stances(board, surface, camera, &moved, &only_views);
    let scene = Scene {
        board,
        relief: Relief::new(board, surface),
        rays: RayGrid::new(camera),
        moved: moved.iter().map(|pair| pair.each_ref().map(RayGrid::new)).collect(),
        center: Pixel::new(camera.intrinsics.cx, camera.intrinsics.cy),
        lens: other_state.map(|other| {
            let k = &camera.intrinsics;
            RayGrid::of([k.width, k.height], |p| other(p).map(|at| [at.x - p.x, at.y - p.y]))
        }),
    };
    type Frames<'f> = Vec<(&'f Stance, &'f Patches)>;
    let (frames, corners): (Frames<'_>, Vec<&[Corner]>) = stances
        .iter()
        .filter_map(|stance| {
            let (view, patches) = views.iter().find(|(view, _)| view.frame == stance.frame)?;
            Some(((stance, *patches), view.corners.as_slice()))
        })
        .unzip();
    let pictures = pictures_of(&corners, camera.intrinsics.width);

    let prior = Prior::new(scene.relief.plane_covariance());
    let planes_at = |theta: &Numbers, with_camera: bool| -> Option<Vec<Plane>> {
        let planes =
            par::map(&frames, |(stance, patches)| scene.plane(stance, patches, theta, with_camera));
        let numbered = planes.into_iter().zip(&pictures);
        let planes: Vec<Plane> = numbered
            .filter_map(|(plane, picture)| Some(Plane { picture: *picture, ..plane? }))
            .collect();
        (planes.len() >= LEAST_FRAMES).then_some(planes)
    };
    let step_at = |planes: &[Plane], theta: &Numbers| {
        let gains: Vec<_> = planes.iter().map(|plane| plane.gain).collect();
        between_frames(planes, &gains, theta, &prior)
    };
    let by_slopes = || {
        let mut theta = prior.mean;
        for _ in 0..12 {
            let step = step_at(&planes_at(&theta, false)?, &theta)?;
            theta += step.delta;
            let sigma = step.covariance.diagonal().map(f64::sqrt);
            if step.delta.component_div(&sigma).amax() < SMALL_STEP {
                break;
            }
        }
        // What the camera's numbers do costs more than all else, and only counts where the others are best.
        let planes = planes_at(&theta, true)?;
        let step = step_at(&planes, &theta)?;
        theta += step.delta;
        Some((planes, step, theta))
    };
    let (print, found) = par::join(|| Print::new(board), by_slopes);
    let (planes, step, theta) = found?;
    let textures: Vec<&Texture> = frames.iter().map(|(_, patches)| &patches.texture).collect();
    let look = |frame: usize, place: &Place, at| {
        let mut pixel = place.looked_at(at);
        if place.lens != 0.0 {
            let ([x, y], _) = scene.lens.as_ref()?.at(pixel)?;
            pixel = Pixel::new(pixel.x + place.lens * x, pixel.y + place.lens * y);
        }
        scene.spot(frames[frame].0, pixel)
    };
    let lens = scene.lens.as_ref();
    let print_seen = imprint::find(&print, scene.place(&theta), (&textures, &pictures), look, lens);
    let lens_share = scene.lens.as_ref().and_then(|_| {
        let slopes = lens_by_slopes(&planes, &theta, &scene.relief, input)?;
        let seen = print_seen.as_ref().and_then(|seen| seen.with_lens.as_ref());
        let both = seen.and_then(|seen| join(&slopes, ZOOM, seen));
        let (value, covariance) = both.map_or(slopes.found, |both| both.estimate);
        Some(Estimate { value: value[N], sigma: covariance[(N, N)].max(0.0).sqrt() })
    });
    let slopes = Seen { found: (theta, with_camera(&step, input)), by_picture: step.by_picture };
    let (imprint, both) =
        print_seen.map(|seen| (seen.imprint, join(&slopes, ZOOM, &seen.place))).unzip();
    let witnesses =
        Witnesses { slopes, imprint, both: both.flatten(), darkness: print.darkness, lens_share };
    Some(assemble(input, &scene, &frames, (&planes, witnesses)))
}

struct Scene<'a> {
    board: &'a CharucoBoard,
    relief: Relief,
    rays: RayGrid,
    moved: Vec<[RayGrid; 2]>,
    center: Pixel,
    /// By how many pixels of the colour image a depth map of the other distortion state would look elsewhere.
    lens: Option<RayGrid>,
}

/// Where a ray meets the board.
struct Hit {
    depth_m: f64,
    /// How it changes with the plane by which the board's surface is not where its corners say.
    by_board: Vector3<f64>,
}

/// A patch before the board.
struct Sight {
    /// Depth of the board where the patch looks, metres.
    board_m: f64,
    /// Sensor minus model, metres.
    residual_m: f64,
    /// By m.
    by_plane: Vector3<f64>,
    /// By the unknowns.
    by_theta: Numbers,
    /// By the share of the other distortion state.
    by_lens: f64,
}

impl Scene<'_> {
    /// Where a depth pixel looks.
    fn looked_at(&self, at: Pixel, theta: &Numbers) -> Pixel {
        self.place(theta).looked_at(at)
    }

    fn place(&self, theta: &Numbers) -> Place {
        let shift_px = SHIFT.map(|k| theta[k]);
        Place { center: self.center, zoom: theta[ZOOM], shift_px, lens: 0.0 }
    }

    /// The board's depth along a ray; `None` beside the board.
    fn board_depth(&self, stance: &Stance, ray: [f64; 2]) -> Option<f64> {
        Some(self.hit(stance, ray)?.depth_m)
    }

    /// Where a ray meets the board's own plane: the depth, metres, and the place on the board; `None` beside it.
    fn flat_hit(&self, stance: &Stance, ray: [f64; 2]) -> Option<(f64, Vector3<f64>)> {
        let ray = Vector3::new(ray[0], ray[1], 1.0);
        let flat_m = stance.plane.dot(&ray).recip();
        if !(flat_m > 0.0 && flat_m.is_finite()) {
            return None;
        }
        let size_m = self.size_m();
        let pose = &stance.color_from_board;
        let on_board = pose.rotation.inverse() * (ray * flat_m - pose.translation);
        let inside = |x: f64, size: f64| (0.0..=size).contains(&x);
        (inside(on_board.x, size_m[0]) && inside(on_board.y, size_m[1]))
            .then_some((flat_m, on_board))
    }

    fn size_m(&self) -> [f64; 2] {
        [self.board.squares_x, self.board.squares_y].map(|n| n as f64 * self.board.square_m)
    }

    /// Where a ray meets the board; `None` beside it.
    fn hit(&self, stance: &Stance, ray: [f64; 2]) -> Option<Hit> {
        let (flat_m, on_board) = self.flat_hit(stance, ray)?;
        let height_m = self.relief.height_m(on_board.x, on_board.y);
        let by_height = flat_m / stance.distance_m;
        let from_middle = on_board.xy() - 0.5 * Vector2::from(self.size_m());
        Some(Hit {
            depth_m: flat_m + by_height * height_m,
            by_board: by_height * Vector3::new(1.0, from_middle.x, from_middle.y),
        })
    }

    fn sight(&self, stance: &Stance, patch: &Patch, theta: &Numbers) -> Option<Sight> {
        let at = patch.at;
        let p = self.looked_at(at, theta);
        let (ray, [by_x, by_y]) = self.rays.at(p)?;
        let Hit { depth_m, by_board } = self.hit(stance, ray)?;
        let board_m = depth_m + by_board.dot(&theta.fixed_rows::<3>(0));
        let (scale, bias_m, zoom) = (theta[SCALE], theta[BIAS], theta[ZOOM]);
        let square = board_m * board_m;
        let m = &stance.plane;
        let slope = [by_x, by_y].map(|by| -square * (m.x * by[0] + m.y * by[1]));
        let lens = self.lens.as_ref().and_then(|grid| grid.at(p)).map_or([0.0; 2], |(by, _)| by);
        let from_center =
            [at.x - theta[SHIFT[0]] - self.center.x, at.y - theta[SHIFT[1]] - self.center.y];
        Some(Sight {
            board_m,
            residual_m: patch.inverse_per_m.recip() - (scale * board_m + bias_m),
            by_plane: -scale * square * Vector3::new(ray[0], ray[1], 1.0),
            by_theta: Numbers::from([
                scale * by_board.x,
                scale * by_board.y,
                scale * by_board.z,
                board_m,
                1.0,
                scale * (slope[0] * from_center[0] + slope[1] * from_center[1]),
                -scale * zoom * slope[0],
                -scale * zoom * slope[1],
            ]),
            by_lens: scale * (slope[0] * lens[0] + slope[1] * lens[1]),
        })
    }

    /// Where on the board a pixel of the colour image looks; `None` beside it.
    fn spot(&self, stance: &Stance, pixel: Pixel) -> Option<Spot> {
        let (ray, by) = self.rays.at(pixel)?;
        let depth_m = self.board_depth(stance, ray)?;
        let to_board = stance.color_from_board.rotation.inverse();
        let ray = Vector3::new(ray[0], ray[1], 1.0);
        let on_board = to_board * (ray * depth_m - stance.color_from_board.translation);
        // X = Z·ray, and Z = 1/(m·ray) but for the board's heights.
        let by_pixel = by.map(|[dx, dy]| {
            let d = Vector3::new(dx, dy, 0.0);
            (to_board * (d * depth_m - ray * (depth_m * depth_m * stance.plane.dot(&d)))).xy()
        });
        let by_pixel = Matrix2::from_columns(&by_pixel);
        Some(Spot { on_board_m: on_board.xy(), by_pixel, depth_m })
    }

    /// How the model's depth changes by one σ of each of the camera's numbers, poses standing still, metres.
    fn by_camera(&self, stance: &Stance, at: Pixel, theta: &Numbers) -> Vec<f64> {
        let p = self.looked_at(at, theta);
        let depth = |grid: &RayGrid| self.board_depth(stance, grid.at(p)?.0);
        self.moved
            .iter()
            // At the very rim of board or lens it may be beside it: nothing is known there.
            .map(|[up, down]| {
                depth(up).zip(depth(down)).map_or(0.0, |(up, down)| theta[SCALE] * (up - down))
            })
            .collect()
    }

    /// Whether the sensor is made to measure the board where this depth pixel looks.
    fn in_reach(&self, stance: &Stance, at: Pixel, theta: &Numbers) -> bool {
        let Some((ray, _)) = self.rays.at(self.looked_at(at, theta)) else { return false };
        let ray = Vector3::new(ray[0], ray[1], 1.0);
        let cos_incidence = (stance.plane.dot(&ray) / (stance.plane.norm() * ray.norm())).abs();
        let far_enough = self.board_depth(stance, [ray.x, ray.y]).is_some_and(|m| m >= NEAR_M);
        far_enough && cos_incidence >= math::cos(MAX_INCIDENCE_DEG.to_radians())
    }

    fn sights<'p>(
        &self,
        stance: &Stance,
        patches: &'p Patches,
        theta: &Numbers,
    ) -> Vec<(&'p Patch, Sight)> {
        patches
            .measured
            .iter()
            .filter_map(|patch| {
                // The whole patch lies on the board where its corners do.
                let half = 0.5 * (patches.side_px as f64 - 1.0);
                let on_board = [(-half, -half), (half, -half), (-half, half), (half, half)]
                    .iter()
                    .all(|(dx, dy)| {
                        let p = self.looked_at(Pixel::new(patch.at.x + dx, patch.at.y + dy), theta);
                        let seen = self.rays.at(p);
                        seen.is_some_and(|(ray, _)| self.flat_hit(stance, ray).is_some())
                    });
                if !on_board {
                    return None;
                }
                Some((patch, self.sight(stance, patch, theta)?))
            })
            .collect()
    }

    /// The first level: one frame's plane, robustly.
    fn plane(
        &self,
        stance: &Stance,
        patches: &Patches,
        theta: &Numbers,
        with_camera: bool,
    ) -> Option<Plane> {
        let sights = self.sights(stance, patches, theta);
        let n = sights.len();
        if n < LEAST_PATCHES {
            return None;
        }
        let precision: Vec<f64> = sights.iter().map(|(_, s)| noise_m(s.board_m).powi(-2)).collect();
        let mut robust = vec![1.0; n];
        let mut beta = Vector3::zeros();
        let mut inverse = Matrix3::identity();
        for round in 0..10 {
            let mut normal = Matrix3::zeros();
            let mut right = Vector3::zeros();
            for (((_, s), p), w) in sights.iter().zip(&precision).zip(&robust) {
                normal.ger(p * w, &s.by_plane, &s.by_plane, 1.0);
                right.axpy(p * w * s.residual_m, &s.by_plane, 1.0);
            }
            inverse = normal.try_inverse()?;
            beta = inverse * right;
            let left: Vec<f64> = sights
                .iter()
                .zip(&precision)
                .map(|((_, s), p)| (s.residual_m - s.by_plane.dot(&beta)) * p.sqrt())
                .collect();
            // Least absolute deviations first: up to half of the patches may show something else.
            let sigma = mad_sigma(&left, 0.0).max(0.1);
            for (w, e) in robust.iter_mut().zip(&left) {
                *w = if round < 5 {
                    (e.abs() / sigma).max(0.1).recip()
                } else {
                    let u = e / (TUKEY * sigma);
                    if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
                };
            }
        }
        let mut gain = SMatrix::<f64, 3, N>::zeros();
        let mut by_lens = Vector3::zeros();
        let mut by_camera = vec![Vector3::zeros(); if with_camera { self.moved.len() } else { 0 }];
        for (((patch, s), p), w) in sights.iter().zip(&precision).zip(&robust) {
            let projected = inverse * s.by_plane * (p * w);
            gain.ger(1.0, &projected, &s.by_theta, 1.0);
            by_lens += projected * s.by_lens;
            if with_camera {
                for (sum, d) in by_camera.iter_mut().zip(self.by_camera(stance, patch.at, theta)) {
                    *sum += projected * d;
                }
            }
        }
        for (sum, m) in by_camera.iter_mut().zip(&stance.by_camera) {
            *sum += m;
        }
        let depths = sights.iter().map(|(_, s)| s.board_m);
        Some(Plane {
            frame: stance.frame,
            picture: 0,
            beta,
            gain,
            by_lens,
            by_camera,
            pose: stance.covariance,
            sensor: inverse * (n as f64 / NOISE_CELLS),
            n_patches: n,
            board_m: [
                depths.clone().sum(),
                depths.clone().fold(f64::INFINITY, f64::min),
                depths.fold(0.0, f64::max),
            ],
        })
    }
}

/// σ of a patch, up to a factor that does not matter.
fn noise_m(board_m: f64) -> f64 {
    math::hypot(NOISE_FLOOR_M, board_m * board_m * NOISE_GROWTH_PER_M)
}

/// Adds what the camera's own covariance does.
fn with_camera<const M: usize>(
    step: &Step<M>,
    &RegisterInput { parameters, covariance: of_camera, .. }: &RegisterInput<'_>,
) -> SMatrix<f64, M, M> {
    let mut covariance = step.covariance;
    let n = parameters.len();
    let sigma = |k: usize| parameters[k].estimate.sigma;
    for (k, l) in (0..n).flat_map(|k| (0..n).map(move |l| (k, l))) {
        let correlation = of_camera[k * n + l] / (sigma(k) * sigma(l));
        if correlation.is_finite() {
            covariance.ger(correlation, &step.by_camera[k], &step.by_camera[l], 1.0);
        }
    }
    covariance
}

/// With the share of the other distortion state, by one step from where the other numbers are best.
fn lens_by_slopes(
    planes: &[Plane],
    theta: &Numbers,
    relief: &Relief,
    input: &RegisterInput<'_>,
) -> Option<Seen<{ N + 1 }>> {
    let gains: Vec<_> = planes
        .iter()
        .map(|plane| {
            let mut gain = SMatrix::<f64, 3, { N + 1 }>::zeros();
            gain.fixed_columns_mut::<N>(0).copy_from(&plane.gain);
            gain.set_column(N, &plane.by_lens);
            gain
        })
        .collect();
    let theta = theta.push(0.0);
    let step = between_frames(planes, &gains, &theta, &Prior::new(relief.plane_covariance()))?;
    let found = (theta + step.delta, with_camera(&step, input));
    Some(Seen { found, by_picture: step.by_picture })
}

/// What zoom and shift are judged by.
struct Witnesses {
    slopes: Seen<N>,
    imprint: Option<Imprint>,
    both: Option<Joined<N>>,
    /// Mean darkness of the board, −½ for paper, ½ for ink.
    darkness: f64,
    lens_share: Option<Estimate>,
}

fn assemble(
    input: &RegisterInput<'_>,
    scene: &Scene<'_>,
    frames: &[(&Stance, &Patches)],
    (planes, witnesses): (&[Plane], Witnesses),
) -> Registration {
    let Witnesses {
        slopes: Seen { found: (theta, covariance), .. },
        imprint,
        both,
        darkness,
        lens_share,
    } = witnesses;
    let estimate = |theta: &Numbers, covariance: &Square, k: usize| Estimate {
        value: theta[k],
        sigma: covariance[(k, k)].max(0.0).sqrt(),
    };
    let slopes = Slopes {
        zoom: estimate(&theta, &covariance, ZOOM),
        shift_px: SHIFT.map(|k| estimate(&theta, &covariance, k)),
    };
    let disagreement = both.as_ref().map(|both| both.disagreement);
    let (mut theta, mut covariance) = both.map_or((theta, covariance), |both| both.estimate);
    if let Some(imprint) = &imprint {
        // A board that is darker than grey is measured too far by its share of the contrast.
        theta[BIAS] -= darkness * imprint.contrast_m.value;
        covariance[(BIAS, BIAS)] += (darkness * imprint.contrast_m.sigma).powi(2);
    }
    let estimate = |k: usize| estimate(&theta, &covariance, k);
    let n_patches = planes.iter().map(|p| p.n_patches).sum::<usize>();
    let mut frames_used: Vec<usize> = planes.iter().map(|p| p.frame).collect();
    frames_used.sort_unstable();
    let mut holes = Holes::default();
    let mut residuals = Vec::with_capacity(n_patches);
    for (stance, patches) in frames {
        for (patch, sight) in scene.sights(stance, patches, &theta) {
            holes.add(
                patch.n + patch.n_holes,
                patch.n_holes,
                scene.in_reach(stance, patch.at, &theta),
            );
            residuals.push(Residual {
                frame: stance.frame,
                at: patch.at,
                residual_m: sight.residual_m,
                noise_m: patch.noise_m,
            });
        }
        for &(at, n_holes) in &patches.torn {
            let seen = scene.rays.at(scene.looked_at(at, &theta));
            if seen.is_some_and(|(ray, _)| scene.flat_hit(stance, ray).is_some()) {
                holes.add(patches.side_px.pow(2), n_holes, scene.in_reach(stance, at, &theta));
            }
        }
    }
    Registration {
        scale: estimate(SCALE),
        bias_m: estimate(BIAS),
        zoom: estimate(ZOOM),
        shift_px: SHIFT.map(estimate),
        covariance: std::array::from_fn(|i| {
            std::array::from_fn(|j| covariance[(SCALE + i, SCALE + j)])
        }),
        center_m: planes.iter().map(|p| p.board_m[0]).sum::<f64>() / n_patches as f64,
        range_m: [
            planes.iter().map(|p| p.board_m[1]).fold(f64::INFINITY, f64::min),
            planes.iter().map(|p| p.board_m[2]).fold(0.0, f64::max),
        ],
        n_frames: planes.len(),
        frames: frames_used,
        slopes,
        imprint,
        disagreement,
        lens_share,
        n_patches,
        pattern: Pattern::new(&input.camera.intrinsics, &residuals, holes),
    }
}
