//! How the camera is led round the board.

use std::f64::consts::{PI, TAU};

use super::{
    random::{Random, Subject},
    scene::{Motion, Scene},
};
use crate::{
    board::CharucoBoard,
    camera::Camera,
    geom::{Board, Color, Pixel, Pose, Rotation, Vector3},
    math,
};

/// How a recording goes about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trajectory {
    /// Hand-held round the board, one frame each half second, as one records for a calibration: 0.17 to 0.4 m away
    /// (nearer before a wider lens),
    /// tilted by up to 50°, turned by up to 60°, the board partly outside the image, some frames blurred by motion.
    HandHeld,
    /// Straight before the board at 0.2 m and nearly still, as one records to check depth.
    FrontoParallel,
}

/// One moment of a trajectory.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) color_from_board: Pose<Color, Board>,
    pub(super) motion: Motion,
    pub(super) blur_sigma_px: f64,
    /// As [`Light::gradient`](super::Light::gradient).
    pub(super) gradient: [f64; 2],
}

impl Trajectory {
    /// Frames in a recording of this kind, where nothing else is asked.
    pub const fn usual_frames(self) -> usize {
        match self {
            Self::HandHeld => 25,
            Self::FrontoParallel => 5,
        }
    }

    /// `hand-held` or `fronto-parallel`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::HandHeld => "hand-held",
            Self::FrontoParallel => "fronto-parallel",
        }
    }

    /// What the camera sees at frame `frame`.
    pub(super) fn view(
        self,
        board: &CharucoBoard,
        camera: &Camera,
        seed: u64,
        frame: usize,
    ) -> View {
        match self {
            Self::HandHeld => hand_held(board, camera, seed, frame),
            Self::FrontoParallel => fronto_parallel(board, camera, seed, frame),
        }
    }
}

fn hand_held(board: &CharucoBoard, camera: &Camera, seed: u64, frame: usize) -> View {
    let mut random = Random::new(seed, Subject::Trajectory, frame);
    let [width_m, height_m] = size_m(board);
    // Distances are for the paper's board (209 mm wide) and a lens of 530 px on 640; others are seen as large.
    let lens = camera.intrinsics.focal_px() / camera.intrinsics.width as f64 / (530.0 / 640.0);
    let reach = lens * math::hypot(width_m, height_m) / 0.267;
    // The golden angle spreads the directions of any number of frames evenly.
    let azimuth = frame as f64 * PI * (3.0 - 5f64.sqrt()) + random.between(-0.4, 0.4);
    let mut color_from_board = Pose::identity();
    for attempt in 0..100 {
        let tilt = random.between(0.0, 50f64.to_radians());
        let turn = random.between(-1.0, 1.0) * 60f64.to_radians();
        // The further the attempts go, the more of the board comes into sight.
        let ease = f64::from(attempt) / 100.0;
        let distance_m = reach * (random.between(0.17, 0.40) * (1.0 - ease) + 0.4 * ease);
        let spread = 1.0 - ease;
        let target = Vector3::new(
            width_m * (0.5 + spread * random.between(-0.3, 0.3)),
            height_m * (0.5 + spread * random.between(-0.3, 0.3)),
            0.0,
        );
        let aim = [0.0; 2].map(|_: f64| spread * random.between(-0.12, 0.12));
        color_from_board = looking(camera, [azimuth, tilt, turn], target, aim, distance_m);
        let scene = Scene::ideal(board.clone(), camera.clone(), color_from_board);
        if scene.corners().len() >= 14.min(board.n_corners()) {
            break;
        }
    }
    // Most frames are held still, one in four is not, one in a dozen not at all.
    let way_px = match random.between(0.0, 1.0) {
        u if u < 0.67 => random.between(0.1, 1.0),
        u if u < 0.92 => random.between(1.0, 3.0),
        _ => random.between(3.0, 7.0),
    };
    let heading = random.between(0.0, TAU);
    let per_px = color_from_board.translation.z / camera.intrinsics.focal_px();
    let way_m = way_px * per_px;
    let motion = Motion {
        rotation_rad: Vector3::new(0.0, 0.0, way_px / 600.0 * random.normal()),
        translation_m: way_m
            * Vector3::new(math::cos(heading), math::sin(heading), 0.3 * random.normal()),
    };
    View {
        color_from_board,
        motion,
        blur_sigma_px: random.between(0.5, 0.85),
        gradient: [0.0; 2].map(|_: f64| random.between(-0.35, 0.35)),
    }
}

fn fronto_parallel(board: &CharucoBoard, camera: &Camera, seed: u64, frame: usize) -> View {
    // One stand for all frames, and a tremor from frame to frame.
    let mut stand = Random::new(seed, Subject::Trajectory, 0);
    let mut tremor = Random::new(seed, Subject::Trajectory, frame + 1);
    let mut about =
        |stands: f64, trembles: f64| stand.between(-stands, stands) + trembles * tremor.normal();
    let [width_m, height_m] = size_m(board);
    let azimuth = about(PI, 0.0);
    let tilt = about(0.05, 0.002).abs();
    let turn = about(0.05, 0.002);
    let target =
        Vector3::new(width_m / 2.0 + about(0.01, 5e-4), height_m / 2.0 + about(0.01, 5e-4), 0.0);
    let distance_m = 0.2 + about(0.006, 5e-4);
    let gradient = [about(0.15, 0.0), about(0.15, 0.0)];
    let per_px = distance_m / camera.intrinsics.focal_px();
    let way = Vector3::new(about(0.0, 0.2), about(0.0, 0.2), 0.0);
    View {
        color_from_board: looking(camera, [azimuth, tilt, turn], target, [0.0; 2], distance_m),
        motion: Motion { rotation_rad: Vector3::zeros(), translation_m: way * per_px },
        blur_sigma_px: 0.6,
        gradient,
    }
}

fn size_m(board: &CharucoBoard) -> [f64; 2] {
    [board.squares_x, board.squares_y].map(|n| n as f64 * board.square_m)
}

/// The board tilted by `tilt` about an axis across `azimuth` and turned by `turn` about the optical axis, with the
/// point `target` of the board at depth `distance_m`, seen `aim` image sizes away from the middle.
fn looking(
    camera: &Camera,
    [azimuth, tilt, turn]: [f64; 3],
    target: Vector3<f64>,
    aim: [f64; 2],
    distance_m: f64,
) -> Pose<Color, Board> {
    let axis = Vector3::new(math::cos(azimuth), math::sin(azimuth), 0.0);
    let rotation = Rotation::from_scaled_axis(axis * tilt)
        * Rotation::from_scaled_axis(Vector3::new(0.0, 0.0, turn));
    let size = [camera.intrinsics.width, camera.intrinsics.height].map(|n| n as f64);
    let at = Pixel::new((0.5 + aim[0]) * size[0], (0.5 + aim[1]) * size[1]);
    let [u, v] = camera.intrinsics.ray_from_pixel(at);
    Pose::new(rotation, Vector3::new(u, v, 1.0) * distance_m - rotation * target)
}
