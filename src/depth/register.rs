//! Depth against colour, all views at once: scale, bias, zoom and shift of the sensor.

use nalgebra::{Cholesky, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::{
    Patch, Patches,
    imprint::{self, Imprint, Place, Print, Spot, Texture},
    join::{Joined, Seen, join},
    pattern::{Holes, MAX_INCIDENCE_DEG, NEAR_M, Pattern, Residual},
    rays::RayGrid,
    relief::Relief,
    stance::{Stance, moved_cameras, stances},
};
use crate::{
    board::CharucoBoard,
    calibrate::{Calibration, Estimate, abreast, both},
    camera::Camera,
    geom::Pixel,
    pose::View,
    solve::{Pooled, Reduced, larger, mad_sigma},
};

/// How the depth sensor stands to the colour camera and to the truth, from the board's whole surface in all views.
///
/// ```text
/// sensor(q) = scale · Z(p) + bias,    p = c + zoom·(q − shift − c)
/// ```
///
/// q is a pixel of the depth map, p the pixel of the colour image whose depth it holds, Z the depth of the board there
/// and c the principal point. A true recording has scale 1, bias 0, zoom 1, shift 0.
#[derive(Clone, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// The calibration it comes from: its covariance and the board's surface enter; without, the camera is taken as
    /// exact and the board as flat.
    pub calibration: Option<&'a Calibration>,
    /// Views of the board, each with what the depth map of its frame says.
    pub views: &'a [(&'a View, &'a Patches)],
    /// Which pixel of the colour image a pixel of the depth map would show if the one were distorted and the other not:
    /// of a distorted image where the lens puts the pixel, of a rectified one where the tables rectify it to.
    pub other_state: Option<&'a OtherState<'a>>,
}

/// See [`RegisterInput::other_state`].
pub type OtherState<'a> = dyn Fn(Pixel) -> Option<Pixel> + Sync + 'a;

/// The unknowns: the plane by which the board's surface is not where its corners say (height of its middle, slopes
/// along its rows and columns), then the five of [`Registration`]; the share of the other distortion state comes after
/// these, where it is asked for.
const N: usize = 8;
const SCALE: usize = 3;
const BIAS: usize = 4;
const ZOOM: usize = 5;
const SHIFT: [usize; 2] = [6, 7];
type Numbers = SVector<f64, N>;
type Square = SMatrix<f64, N, N>;

/// Scale, bias (m), zoom, shift (px) and share that no recording is farther from the truth than by about this: keeps
/// what the views do not determine from running away. Weak beside any recording that tells anything.
const PRIOR_SIGMA: [f64; 6] = [0.3, 0.1, 0.3, 60.0, 60.0, 3.0];
/// Frames below this number of patches say nothing about a plane.
const LEAST_PATCHES: usize = 12;
/// Frames below this number do not even disagree.
const LEAST_FRAMES: usize = 3;
/// Tukey's biweight keeps 95 % efficiency under normal noise with this multiple of the standard deviation.
const TUKEY: f64 = 4.685;
/// Beyond this Mahalanobis distance a frame counts only linearly: 1 % of normal ones do (3 degrees of freedom).
const FRAME_HUBER: f64 = 3.368;
/// Beyond this it does not count at all: a single frame that is wrong by a hundred σ would make all others seem noisy.
const FRAME_LOST: f64 = 10.0;
/// The sensor's noise is alike within cells; a frame shows about so many of them. Only a start: how much the sensor
/// adds to a plane's error is estimated.
const NOISE_CELLS: f64 = 30.0;
/// How far from that start it may be, beforehand: one standard deviation of the common logarithm of ρ.
const RATIO_DECADES: f64 = 1.5;
/// What is less likely than the likeliest by this does not count.
const LEAST_SHARE: f64 = 1e-4;
/// Noise of a patch relative to others, metres: σ² = floor² + (z²·growth)², after the published recordings.
const NOISE_FLOOR_M: f64 = 0.17e-3;
const NOISE_GROWTH_PER_M: f64 = 2.2e-3;

/// Finds scale, bias, zoom and shift with their covariance. `None` for fewer than three frames with depth on the
/// board.
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
/// **σ** is the larger of this model's and of a sandwich estimator clustered by frame, and to it is added what the
/// camera's own covariance does (poses and rays follow each number of the camera). Not in it: a wrong square length
/// (the scale is wrong by as much), errors of the board's surface other than its plane, and what a wrong camera *model*
/// does.
pub fn register(input: &RegisterInput<'_>) -> Option<Registration> {
    let RegisterInput { board, camera, calibration, views, other_state } = *input;
    let surface = calibration.and_then(|c| c.surface.as_ref());
    let parameters = calibration.map_or(&[][..], |c| &c.parameters);
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
    let frames: Vec<(&Stance, &Patches)> = stances
        .iter()
        .filter_map(|stance| {
            let (_, patches) = views.iter().find(|(view, _)| view.frame == stance.frame)?;
            Some((stance, *patches))
        })
        .collect();

    let prior = Prior::new(scene.relief.plane_covariance());
    let planes_at = |theta: &Numbers, with_camera: bool| -> Option<Vec<Plane>> {
        let planes =
            abreast(&frames, |(stance, patches)| scene.plane(stance, patches, theta, with_camera));
        let planes: Vec<Plane> = planes.into_iter().flatten().collect();
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
            if step.delta.component_div(&prior.sigma()).amax() < 1e-7 {
                break;
            }
        }
        // What the camera's numbers do costs more than all else, and only counts where the others are best.
        let planes = planes_at(&theta, true)?;
        let step = step_at(&planes, &theta)?;
        theta += step.delta;
        Some((planes, step, theta))
    };
    let (print, found) = both(|| Print::new(board), by_slopes);
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
    let print_seen = imprint::find(&print, scene.place(&theta), &textures, look, lens);
    // Frames as the planes count them.
    let of_frame = |texture: usize| frames[texture].0.frame;
    let lens_share = scene.lens.as_ref().and_then(|_| {
        let slopes = lens_by_slopes(&planes, &theta, &scene.relief, calibration)?;
        let seen = print_seen.as_ref().and_then(|seen| seen.with_lens.as_ref());
        let both = seen.and_then(|seen| join(&slopes, ZOOM, seen, of_frame));
        let (value, covariance) = both.map_or(slopes.found, |both| both.estimate);
        Some(Estimate { value: value[N], sigma: covariance[(N, N)].max(0.0).sqrt() })
    });
    let slopes = Seen { found: (theta, with_camera(&step, calibration)), by_frame: step.by_frame };
    let (imprint, both) =
        print_seen.map(|seen| (seen.imprint, join(&slopes, ZOOM, &seen.place, of_frame))).unzip();
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

/// What one frame says.
pub(super) struct Plane {
    /// Index of the frame in the recording.
    frame: usize,
    /// By which plane the sensor differs from the model.
    beta: Vector3<f64>,
    /// By the unknowns.
    gain: SMatrix<f64, 3, N>,
    /// By the share of the other distortion state.
    by_lens: Vector3<f64>,
    /// By one σ of each of the camera's numbers.
    by_camera: Vec<Vector3<f64>>,
    pose: Matrix3<f64>,
    sensor: Matrix3<f64>,
    n_patches: usize,
    /// Sum, smallest and largest depth of the board.
    board_m: [f64; 3],
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

    /// Where a ray meets the board; `None` beside it.
    fn hit(&self, stance: &Stance, ray: [f64; 2]) -> Option<Hit> {
        let ray = Vector3::new(ray[0], ray[1], 1.0);
        let flat_m = stance.plane.dot(&ray).recip();
        if !(flat_m > 0.0 && flat_m.is_finite()) {
            return None;
        }
        let size_m =
            [self.board.squares_x, self.board.squares_y].map(|n| n as f64 * self.board.square_m);
        let pose = &stance.color_from_board;
        let on_board = pose.rotation.inverse() * (ray * flat_m - pose.translation);
        let inside = |x: f64, size: f64| (0.0..=size).contains(&x);
        if !(inside(on_board.x, size_m[0]) && inside(on_board.y, size_m[1])) {
            return None;
        }
        let height_m = self.relief.height_m(on_board.x, on_board.y);
        let by_height = flat_m / stance.distance_m;
        let from_middle = on_board.xy() - 0.5 * Vector2::from(size_m);
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
        far_enough && cos_incidence >= MAX_INCIDENCE_DEG.to_radians().cos()
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
                        seen.is_some_and(|(ray, _)| self.board_depth(stance, ray).is_some())
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
    NOISE_FLOOR_M.hypot(board_m * board_m * NOISE_GROWTH_PER_M)
}

/// The second level, for M unknowns: all but the share of the other distortion state, or with it.
struct Step<const M: usize> {
    delta: SVector<f64, M>,
    covariance: SMatrix<f64, M, M>,
    /// By how much each frame (index in the recording) moves them.
    by_frame: Vec<(usize, SVector<f64, M>)>,
    /// What one σ of each of the camera's numbers does to them.
    by_camera: Vec<SVector<f64, M>>,
}

/// What each of the unknowns does to each frame's plane.
type Gains<const M: usize> = [SMatrix<f64, 3, M>];

/// What is known of the unknowns before anything was measured.
struct Prior<const M: usize> {
    mean: SVector<f64, M>,
    covariance: SMatrix<f64, M, M>,
    precision: SMatrix<f64, M, M>,
}

impl<const M: usize> Prior<M> {
    fn new(of_board: Matrix3<f64>) -> Self {
        let mut mean = SVector::zeros();
        (mean[SCALE], mean[ZOOM]) = (1.0, 1.0);
        let sigma = |k: usize| PRIOR_SIGMA[k.saturating_sub(SCALE)];
        let mut covariance =
            SMatrix::<f64, M, M>::from_diagonal(&SVector::from_fn(|k, _| sigma(k).powi(2)));
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_board);
        let precision = covariance.try_inverse().expect("a covariance");
        Self { mean, covariance, precision }
    }

    fn sigma(&self) -> SVector<f64, M> {
        self.covariance.diagonal().map(f64::sqrt)
    }
}

/// ρ, how much the sensor adds to what the poses are unsure by, is not known and often not well told: the likelihood
/// may have two hills, poses alone and the sensor alone, with different answers. So all of them count as far as they
/// are likely (ρ is integrated out), and their differences are part of σ.
fn between_frames<const M: usize>(
    planes: &[Plane],
    gains: &Gains<M>,
    theta: &SVector<f64, M>,
    prior: &Prior<M>,
) -> Option<Step<M>> {
    let tried: Vec<(f64, Weighed<M>)> = (-16..=16)
        .filter_map(|i| {
            let decades = f64::from(i) / 4.0;
            let weighed = weigh(planes, gains, (theta, prior), 10f64.powf(decades))?;
            let unlikely = 0.5 * (decades / RATIO_DECADES).powi(2);
            Some((weighed.likelihood - unlikely, weighed))
        })
        .collect();
    let most = tried.iter().map(|(ln, _)| *ln).fold(f64::NEG_INFINITY, f64::max);
    let likely: Vec<(f64, &Weighed<M>)> = tried
        .iter()
        .map(|(ln, weighed)| ((ln - most).exp(), weighed))
        .filter(|(share, _)| *share > LEAST_SHARE)
        .collect();
    let whole: f64 = likely.iter().map(|(share, _)| share).sum();
    let likely = likely.into_iter().map(|(share, weighed)| (share / whole, weighed));

    let n_camera = planes.first().map_or(0, |p| p.by_camera.len());
    let mut step = Step {
        delta: likely.clone().map(|(share, weighed)| weighed.delta * share).sum(),
        covariance: SMatrix::zeros(),
        by_frame: planes.iter().map(|plane| (plane.frame, SVector::zeros())).collect(),
        by_camera: vec![SVector::zeros(); n_camera],
    };
    for (share, Weighed { delta, information, parts, weights, .. }) in likely {
        let inverse = Cholesky::new(*information)?.inverse();
        let all = Reduced { information: information.as_slice().to_vec(), score: vec![0.0; M] };
        // Without it where a frame alone determines a number.
        let clustered = Pooled::new(&all, parts)?.clustered(M).unwrap_or_default();
        let covariance =
            SMatrix::<f64, M, M>::from_column_slice(&larger(inverse.as_slice(), &clustered));
        let apart = delta - step.delta;
        step.covariance += (covariance + apart * apart.transpose()) * share;
        for (k, sum) in step.by_camera.iter_mut().enumerate() {
            let mut score = SVector::<f64, M>::zeros();
            for ((plane, gain), precision) in planes.iter().zip(gains).zip(weights) {
                score += gain.transpose() * (precision * plane.by_camera[k]);
            }
            *sum -= inverse * score * share;
        }
        for ((_, sum), part) in step.by_frame.iter_mut().zip(parts) {
            *sum += inverse * SVector::<f64, M>::from_column_slice(&part.score) * share;
        }
    }
    Some(step)
}

struct Weighed<const M: usize> {
    delta: SVector<f64, M>,
    information: SMatrix<f64, M, M>,
    /// What each frame alone says: its information, and what it still asks for.
    parts: Vec<Reduced>,
    /// The precision of each frame's plane.
    weights: Vec<Matrix3<f64>>,
    likelihood: f64,
}

fn weigh<const M: usize>(
    planes: &[Plane],
    gains: &Gains<M>,
    (theta, prior): (&SVector<f64, M>, &Prior<M>),
    ratio: f64,
) -> Option<Weighed<M>> {
    struct Said<const M: usize> {
        inverse: Matrix3<f64>,
        information: SMatrix<f64, M, M>,
        score: SVector<f64, M>,
    }
    let mut determinants = 0.0;
    let said: Vec<Said<M>> = planes
        .iter()
        .zip(gains)
        .map(|(plane, gain)| {
            let covariance = plane.pose + plane.sensor * ratio;
            let inverse = covariance.try_inverse()?;
            determinants += covariance.determinant().ln();
            let weighted = gain.transpose() * inverse;
            Some(Said { inverse, information: weighted * gain, score: weighted * plane.beta })
        })
        .collect::<Option<_>>()?;
    let n_numbers = (3 * planes.len()) as f64;
    let mut robust = vec![1.0; planes.len()];
    let mut delta = SVector::<f64, M>::zeros();
    let mut variance = 1.0;
    let mut information = SMatrix::<f64, M, M>::zeros();
    let mut beyond = 0.0;
    for _ in 0..15 {
        information = prior.precision;
        let mut score = prior.precision * (prior.mean - theta);
        for (said, w) in said.iter().zip(&robust) {
            information += said.information * (w / variance);
            score += said.score * (w / variance);
        }
        let factor = Cholesky::new(information)?;
        delta = factor.solve(&score);
        let squares: Vec<f64> = planes
            .iter()
            .zip(gains)
            .zip(&said)
            .map(|((plane, gain), said)| {
                let e = plane.beta - gain * delta;
                e.dot(&(said.inverse * e))
            })
            .collect();
        // What was known beforehand costs no freedom.
        let n_found = M as f64 - factor.solve(&prior.precision).trace();
        let n_counted = 3.0 * robust.iter().filter(|w| **w > 0.0).count() as f64;
        variance = squares.iter().zip(&robust).map(|(s, w)| s * w).sum::<f64>()
            / (n_counted - n_found).max(1.0);
        beyond = 0.0;
        for (w, s) in robust.iter_mut().zip(&squares) {
            let distance = (s / variance).sqrt();
            *w = if distance > FRAME_LOST { 0.0 } else { (FRAME_HUBER / distance).min(1.0) };
            beyond += FRAME_HUBER * (distance.min(FRAME_LOST) - FRAME_HUBER).max(0.0);
        }
    }
    let n_found = M as f64 - Cholesky::new(information)?.solve(&prior.precision).trace();
    let root = Cholesky::new(prior.covariance)?.unpack();
    let ln_scaled = Cholesky::new(root.transpose() * information * root)?.ln_determinant();
    let off = theta + delta - prior.mean;
    // Frames that count less, or not at all, are not for nothing: the loss is the sum of weighted squares and what lies
    // beyond.
    let likelihood = -0.5
        * (determinants + n_numbers * variance.ln() + beyond + ln_scaled - n_found
            + off.dot(&(prior.precision * off)));
    let shares = said.iter().zip(&robust).map(|(said, w)| (said, w / variance));
    let weights = shares.clone().map(|(said, share)| said.inverse * share).collect();
    let parts = shares
        .map(|(said, share)| Reduced {
            information: (said.information * share).as_slice().to_vec(),
            score: ((said.score - said.information * delta) * share).as_slice().to_vec(),
        })
        .collect();
    Some(Weighed { delta, information, parts, weights, likelihood })
}

/// Adds what the camera's own covariance does.
fn with_camera<const M: usize>(
    step: &Step<M>,
    calibration: Option<&Calibration>,
) -> SMatrix<f64, M, M> {
    let mut covariance = step.covariance;
    let Some(calibration) = calibration else { return covariance };
    let n = calibration.parameters.len();
    let sigma = |k: usize| calibration.parameters[k].estimate.sigma;
    for (k, l) in (0..n).flat_map(|k| (0..n).map(move |l| (k, l))) {
        let correlation = calibration.covariance[k * n + l] / (sigma(k) * sigma(l));
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
    calibration: Option<&Calibration>,
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
    let found = (theta + step.delta, with_camera(&step, calibration));
    Some(Seen { found, by_frame: step.by_frame })
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
            if seen.is_some_and(|(ray, _)| scene.board_depth(stance, ray).is_some()) {
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
