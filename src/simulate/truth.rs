//! `truth.json`: what is true of a simulated recording.
//!
//! A file format of its own, versioned by [`SCHEMA`] and apart from the report's, because it answers another question:
//! the report says what was found, this what there was to find. Every name carries its unit; nothing in here is a
//! domain type, so that renaming one does not change a file.

use serde::{Deserialize, Serialize};

use super::{plan::Plan, scene::TrueCorner};

/// The version of the format. Fields may be added within a version; none changes its meaning.
pub const SCHEMA: &str = "truedepth.truth/1";

/// The whole of `truth.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// [`SCHEMA`].
    pub schema: String,
    /// The seed everything random was made from.
    pub seed: u64,
    /// Name of the simulated device.
    pub device: String,
    /// The faults as they are written on the command line; empty where nothing is wrong.
    pub faults: Vec<String>,
    /// The board in short form, with its layout.
    pub board: String,
    /// c of the print's surface, metres (see `Surface`); zeros for a flat board.
    pub surface_coefficients_m: Vec<f64>,
    /// The camera as it is, at the size of the images.
    pub camera: TrueCamera,
    /// The camera as the metadata have it: focal length, pixels.
    pub factory_focal_px: f64,
    /// The camera as the metadata have it: principal point, pixels.
    pub factory_center_px: [f64; 2],
    /// Both images are mirrored left for right. Poses and camera are those before mirroring, corners those after.
    pub mirrored: bool,
    /// The depth sensor.
    pub depth: TrueDepth,
    /// Every frame, in order of time.
    pub frames: Vec<TrueFrame>,
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueCamera {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal length, pixels; the same along both axes.
    pub focal_px: f64,
    /// Principal point, pixels; integers are pixel centres.
    pub center_px: [f64; 2],
    /// `rectified`, `distorted` or `rectified_twice`.
    pub stream: String,
    /// Takes a pixel of the image to its rectilinear place: p' = c + (1 + m(r))·(p − c), m interpolated linearly.
    /// `None` for a rectified stream.
    pub undistortion: Option<TrueTable>,
}

/// A radial table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueTable {
    /// c, pixels.
    pub center_px: [f64; 2],
    /// Radius of the last sample, pixels; samples are evenly spaced from 0.
    pub max_radius_px: f64,
    /// m.
    pub magnification: Vec<f64>,
}

/// A depth sensor: sensor depth = scale · true depth + bias + noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueDepth {
    /// Measured over true.
    pub scale: f64,
    /// Measured minus true, metres.
    pub bias_m: f64,
    /// Depth pixel p holds what the colour image has at c + zoom·(p − shift − c), c the true principal point.
    pub zoom: [f64; 2],
    /// As above, pixels.
    pub shift_px: [f64; 2],
    /// The depth map alone is mirrored left for right.
    pub mirrored: bool,
    /// σ(z)² = `noise_floor_m`² + (z²·`noise_per_m`)².
    pub noise_floor_m: f64,
    /// As above, per metre.
    pub noise_per_m: f64,
    /// Depths are multiples of this, metres.
    pub unit_m: f64,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueFrame {
    /// As in the names of its images, milliseconds.
    pub timestamp: i64,
    /// Rotation of `color_from_board` (board x right, y down, z into the board; camera x right, y down, z forward)
    /// as axis times angle, radians.
    pub rotation_vector_rad: [f64; 3],
    /// Translation of `color_from_board`, metres.
    pub translation_m: [f64; 3],
    /// Blur of the lens, pixels.
    pub blur_sigma_px: f64,
    /// Rotation of the board during the exposure (camera's frame), radians.
    pub motion_rotation_rad: [f64; 3],
    /// Translation of the board during the exposure (camera's frame), metres.
    pub motion_translation_m: [f64; 3],
    /// The corners within the image, by ascending id, in the middle of the exposure.
    pub corners: Vec<Corner>,
}

/// A corner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Corner {
    /// Id, as OpenCV's `getChessboardCorners()` counts from 4.6 on.
    pub id: usize,
    /// Column in the image as written, pixels; integers are pixel centres.
    pub x_px: f64,
    /// Row.
    pub y_px: f64,
}

impl Truth {
    /// What is true of the recording made after this plan.
    pub(super) fn of(plan: &Plan) -> Self {
        let camera = plan.true_camera();
        let intrinsics = camera.intrinsics;
        let factory = plan.factory().intrinsics;
        let sensor = plan.sensor_with_faults();
        let undistortion = plan.undistortion().map(|table| TrueTable {
            center_px: [table.center.x, table.center.y],
            max_radius_px: table.max_radius_px,
            magnification: table.magnification,
        });
        Self {
            schema: SCHEMA.to_owned(),
            seed: plan.seed,
            device: plan.device.name.to_owned(),
            faults: plan.faults.texts(),
            board: plan.board_text(),
            surface_coefficients_m: plan.surface().coefficients_m.to_vec(),
            camera: TrueCamera {
                width: intrinsics.width,
                height: intrinsics.height,
                focal_px: intrinsics.fx,
                center_px: [intrinsics.cx, intrinsics.cy],
                stream: plan.stream().name().to_owned(),
                undistortion,
            },
            factory_focal_px: factory.fx,
            factory_center_px: [factory.cx, factory.cy],
            mirrored: plan.is_mirrored(),
            depth: TrueDepth {
                scale: sensor.scale,
                bias_m: sensor.bias_m,
                zoom: sensor.zoom,
                shift_px: sensor.shift_px,
                mirrored: plan.is_depth_mirrored(),
                noise_floor_m: sensor.noise_floor_m,
                noise_per_m: sensor.noise_per_m,
                unit_m: sensor.unit_m,
            },
            frames: (0..plan.n_frames).map(|frame| TrueFrame::of(plan, frame)).collect(),
        }
    }

    /// As JSON text, one line per frame's corner list being left to tools.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers, texts and lists always serialise")
    }
}

impl TrueFrame {
    fn of(plan: &Plan, frame: usize) -> Self {
        let scene = plan.scene(frame);
        let corner = |c: TrueCorner| Corner { id: c.id, x_px: c.pixel.x, y_px: c.pixel.y };
        Self {
            timestamp: plan.timestamp(frame),
            rotation_vector_rad: scene.color_from_board.rotation.scaled_axis().into(),
            translation_m: scene.color_from_board.translation.into(),
            blur_sigma_px: scene.blur_sigma_px,
            motion_rotation_rad: scene.motion.rotation_rad.into(),
            motion_translation_m: scene.motion.translation_m.into(),
            corners: plan.corners(&scene).into_iter().map(corner).collect(),
        }
    }
}
