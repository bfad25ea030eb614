//! From a device and its faults to a recording.

use super::{
    device::Device,
    fault::Faults,
    render::render_frame,
    scene::{Light, Noise, Scene, Tone, TrueCorner},
    sensor::{DepthSensor, measure_frame},
    surface::Surface,
    trajectory::Trajectory,
    truth::Truth,
    wall::Wall,
};
use crate::{
    board::{CharucoBoard, Dictionary, Layout},
    camera::{Camera, Distortion, Intrinsics, RadialTable, TablePair},
    files::Output,
    geom::Pixel,
    image::{DepthMap, Rgb},
    par,
    recording::{Defect, Error, Factory, StreamState, Writer, encode_depth},
};

/// What to simulate: everything that follows is decided by these fields.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The device.
    pub device: Device,
    /// What is wrong with it.
    pub faults: Faults,
    /// The board; where it does not state its layout, the old one.
    pub board: CharucoBoard,
    /// How the camera is led.
    pub trajectory: Trajectory,
    /// Frames to take.
    pub n_frames: usize,
    /// The depth sensor, but for the faults.
    pub sensor: DepthSensor,
    /// Chooses views, motion, noise, holes and what is on the wall.
    pub seed: u64,
}

/// One frame of a simulated recording.
#[derive(Clone, Debug)]
pub struct SimulatedFrame {
    /// As in the names of its files, milliseconds.
    pub timestamp: i64,
    /// The colour image.
    pub color: Rgb,
    /// The depth map.
    pub depth: DepthMap,
    /// Where the corners truly are in `color`.
    pub corners: Vec<TrueCorner>,
}

impl Plan {
    /// The paper's board (squares of 20.875 mm, old layout) led by hand before a faultless device.
    pub fn new(device: Device, seed: u64) -> Self {
        let dictionary = Dictionary::predefined("ARUCO_ORIGINAL")
            .expect("ARUCO_ORIGINAL is among the predefined dictionaries");
        let square_m = 0.020_875;
        let board = CharucoBoard {
            layout: Some(Layout::Legacy),
            ..CharucoBoard::new((10, 8), square_m, square_m / 2.0, dictionary)
                .expect("the paper's board can be")
        };
        let trajectory = Trajectory::HandHeld;
        Self {
            device,
            faults: Faults::NONE,
            board,
            trajectory,
            n_frames: trajectory.usual_frames(),
            sensor: DepthSensor::TRUEDEPTH,
            seed,
        }
    }

    /// The camera as it is. Its images may then be mirrored ([`is_mirrored`](Self::is_mirrored)).
    pub fn true_camera(&self) -> Camera {
        let mut intrinsics = self.device.factory_intrinsics();
        for defect in self.faults.defects() {
            match defect {
                Defect::Focal { ratio } => {
                    intrinsics.fx /= ratio;
                    intrinsics.fy /= ratio;
                }
                Defect::Center { shift_px: [x, y] } => {
                    intrinsics.cx -= x;
                    intrinsics.cy -= y;
                }
                _ => (),
            }
        }
        let distortion = self.undistortion().map_or(Distortion::None, |inverse| {
            Distortion::Table(TablePair::from_inverse(inverse))
        });
        Camera { intrinsics, distortion }
    }

    /// The metadata of every frame.
    pub fn factory(&self) -> Factory {
        let claims_rectified = self.device.stream == StreamState::Rectified
            || self.has(Defect::Distorted)
            || self.has(Defect::RectifiedTwice);
        let mut factory = self.device.factory(claims_rectified);
        for defect in self.faults.defects() {
            if let Defect::IntrinsicsScale { factor: [x, y] } = defect {
                let k = &mut factory.intrinsics;
                (k.fx, k.cx, k.fy, k.cy) = (k.fx / x, k.cx / x, k.fy / y, k.cy / y);
            }
        }
        factory
    }

    fn has(&self, defect: Defect) -> bool {
        self.faults.defects().contains(&defect)
    }

    /// What was done to the images after the lens drew them.
    pub fn stream(&self) -> StreamState {
        if self.has(Defect::Distorted) {
            StreamState::Distorted
        } else if self.has(Defect::RectifiedTwice) {
            StreamState::RectifiedTwice
        } else {
            self.device.stream
        }
    }

    /// The table that takes a pixel of the image to its rectilinear place; `None` for a rectified stream.
    pub(super) fn undistortion(&self) -> Option<RadialTable> {
        let tables = self.device.tables();
        match self.stream() {
            StreamState::Rectified | StreamState::Unknown => None,
            StreamState::Distorted => Some(tables.inverse),
            // The second correction moved each pixel as the inverse table says; the forward table brings it back.
            StreamState::RectifiedTwice => Some(tables.forward),
        }
    }

    /// Whether colour and depth are mirrored left for right.
    pub fn is_mirrored(&self) -> bool {
        self.has(Defect::Mirrored)
    }

    /// Whether the depth map alone is mirrored left for right.
    pub fn is_depth_mirrored(&self) -> bool {
        self.has(Defect::DepthMirrored)
    }

    /// The shape of the print.
    pub(super) fn surface(&self) -> Surface {
        match self.faults.bent_m {
            0.0 => Surface::FLAT,
            bent_m => Surface::taped_sheet(bent_m),
        }
    }

    pub(super) fn sensor_with_faults(&self) -> DepthSensor {
        let mut sensor = self.sensor;
        for defect in self.faults.defects() {
            match defect {
                Defect::DepthScale { ratio } => sensor.scale *= ratio,
                Defect::DepthBias { bias_m } => sensor.bias_m += bias_m,
                Defect::DepthZoom { zoom: [x, y] } => {
                    sensor.zoom[0] *= x;
                    sensor.zoom[1] *= y;
                }
                Defect::DepthShift { shift_px: [x, y] } => {
                    sensor.shift_px[0] += x;
                    sensor.shift_px[1] += y;
                }
                _ => (),
            }
        }
        sensor
    }

    fn layout(&self) -> Layout {
        self.board.layout.unwrap_or(Layout::Legacy)
    }

    /// The board in short form.
    pub(super) fn board_text(&self) -> String {
        let CharucoBoard { squares_x, squares_y, square_m, marker_m, dictionary, .. } = &self.board;
        let (dictionary, layout) = (dictionary.name(), self.layout().name());
        format!("{squares_x}x{squares_y}:{square_m}m:{marker_m}m:{dictionary}:{layout}")
    }

    /// When frame `frame` was taken, milliseconds since some beginning; half a second apart.
    pub fn timestamp(&self, frame: usize) -> i64 {
        const FIRST_MS: i64 = 50_000;
        const STEP_MS: i64 = 500;
        FIRST_MS + STEP_MS * frame as i64
    }

    /// What stands before the camera at frame `frame`.
    pub fn scene(&self, frame: usize) -> Scene {
        let camera = self.true_camera();
        let view = self.trajectory.view(&self.board, &camera, self.seed, frame);
        let board = CharucoBoard { layout: Some(self.layout()), ..self.board.clone() };
        let size_m = [board.squares_x, board.squares_y].map(|n| n as f64 * board.square_m);
        let mut scene = Scene::ideal(board, camera, view.color_from_board);
        // After the published recordings: ink at grey levels near 50, paper near 190, noise of about 1.
        scene.print.ink = 0.045;
        scene.print.paper = 0.82;
        scene.surface = self.surface();
        scene.wall = Wall::office(self.seed, size_m);
        scene.motion = view.motion;
        scene.blur_sigma_px = view.blur_sigma_px;
        scene.light = Light {
            exposure: 0.62,
            gradient: view.gradient,
            vignetting: 0.18,
            tint: [1.07, 1.0, 0.88],
            flare: [0.016, 0.008, 0.006],
        };
        scene.tone = Tone::Srgb;
        scene.noise = Noise::Sensor { full_well_e: 14_000.0, read_e: 8.0 };
        scene
    }

    /// The corners of a scene as the recording shows them.
    pub(super) fn corners(&self, scene: &Scene) -> Vec<TrueCorner> {
        let mut corners = scene.corners();
        if self.is_mirrored() {
            let Intrinsics { width, .. } = scene.camera.intrinsics;
            for corner in &mut corners {
                corner.pixel = Pixel::new(width as f64 - 1.0 - corner.pixel.x, corner.pixel.y);
            }
        }
        corners
    }

    /// Renders frame `frame`.
    pub fn frame(&self, frame: usize) -> SimulatedFrame {
        let scene = self.scene(frame);
        let mut color = render_frame(&scene, self.seed, frame).image;
        let depth = measure_frame(&scene, &self.sensor_with_faults(), self.seed, frame);
        if self.is_mirrored() {
            let pixels = mirrored(color.width(), color.pixels());
            color = Rgb::new(color.width(), color.height(), pixels);
        }
        SimulatedFrame {
            timestamp: self.timestamp(frame),
            color,
            depth: self.as_recorded(depth),
            corners: self.corners(&scene),
        }
    }

    /// The depth map as it comes out of the device: mirrored where it is.
    pub(super) fn as_recorded(&self, depth: DepthMap) -> DepthMap {
        if self.is_mirrored() == self.is_depth_mirrored() {
            return depth;
        }
        let depth_m = mirrored(depth.width(), depth.depth_m());
        DepthMap::new(depth.width(), depth.height(), depth_m)
    }

    /// What is true of the recording.
    pub fn truth(&self) -> Truth {
        Truth::of(self)
    }

    /// Writes the recording, with `board.toml` and `truth.json`. `done` is called after every frame with the number
    /// of frames written.
    pub fn write<S: Output>(&self, sink: S, mut done: impl FnMut(usize)) -> Result<S, Error> {
        let mut writer = Writer::new(sink);
        let factory = self.factory();
        // Batches bound the memory, whatever the number of frames.
        const BATCH: usize = 16;
        let frames: Vec<usize> = (0..self.n_frames).collect();
        par::try_batches(
            &frames,
            BATCH,
            |&frame| {
                let simulated = self.frame(frame);
                let files = (simulated.color.to_png(), encode_depth(&simulated.depth));
                Ok((simulated.timestamp, files))
            },
            |frame, (timestamp, (color_png, depth_png))| {
                writer.encoded_frame(timestamp, &color_png, &depth_png, &factory)?;
                done(frame + 1);
                Ok::<_, Error>(())
            },
        )?;
        let board = CharucoBoard { layout: Some(self.layout()), ..self.board.clone() };
        writer.board(&board)?;
        writer.output().write("truth.json", self.truth().to_json().as_bytes())?;
        Ok(writer.finish()?)
    }
}

/// Every row the other way round.
fn mirrored<T: Copy>(width: usize, pixels: &[T]) -> Vec<T> {
    pixels.chunks(width).flat_map(|row| row.iter().rev().copied()).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        files::{Limits, Memory},
        geom::{Homography, Point},
        recording::Recording,
    };

    fn plan(device: &str, faults: &[&str]) -> Plan {
        let mut plan = Plan::new(Device::named(device).unwrap(), 5);
        plan.faults = Faults::parse(faults.iter().copied()).unwrap();
        plan
    }

    fn written(plan: &Plan) -> Memory {
        plan.write(Memory::new("simulated"), |_| ()).unwrap()
    }

    /// Sensor depth minus true depth at the corners of frame `frame`, metres, and the true depth.
    fn depth_errors(plan: &Plan, frame: usize) -> Vec<(f64, f64)> {
        let scene = plan.scene(frame);
        let depth = plan.frame(frame).depth;
        scene
            .corners()
            .iter()
            .filter_map(|corner| {
                let z = (scene.color_from_board * scene.printed_corner(corner.id)).z();
                Some((depth.bilinear(corner.pixel)? - z, z))
            })
            .collect()
    }

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        let values: Vec<f64> = values.collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn true_corners_are_where_the_camera_draws_them() {
        for (device, faults) in [
            ("ipad-12.9-5gen", &["focal=6.6%", "bent=0.8mm"][..]),
            ("ipad-12.9-4gen", &["mirrored"]),
            ("iphone-13", &["rectified-twice"]),
        ] {
            let plan = plan(device, faults);
            let truth = plan.truth();
            assert_eq!(truth.frames.len(), 25);
            for (frame, true_frame) in truth.frames.iter().enumerate() {
                let scene = plan.scene(frame);
                assert!(true_frame.corners.len() >= 14, "{device} {frame}");
                for corner in &true_frame.corners {
                    let x_px = if plan.is_mirrored() { 639.0 - corner.x_px } else { corner.x_px };
                    // The other way round: the ray of the pixel, taken to the corner's depth, is the corner.
                    let [u, v] = scene.camera.unproject(Pixel::new(x_px, corner.y_px)).unwrap();
                    let point = scene.color_from_board * scene.printed_corner(corner.id);
                    let z = point.z();
                    let error = (point.coords
                        - Point::<crate::geom::Color>::new(u * z, v * z, z).coords)
                        .norm();
                    assert!(error < 1e-9, "{device} {frame} {corner:?}: {error} m");
                }
            }
        }
    }

    #[test]
    fn views_are_as_one_records_them() {
        let plan = plan("ipad-12.9-5gen", &[]);
        let board = &plan.board;
        let views: Vec<Scene> = (0..25).map(|frame| plan.scene(frame)).collect();
        let tilts: Vec<f64> = views
            .iter()
            .map(|s| s.color_from_board.rotation.matrix()[(2, 2)].acos().to_degrees())
            .collect();
        assert!(tilts.iter().all(|t| *t <= 50.0), "{tilts:?}");
        assert!(tilts.iter().filter(|t| **t > 30.0).count() >= 5, "{tilts:?}");
        assert!(tilts.iter().filter(|t| **t < 20.0).count() >= 3, "{tilts:?}");
        let middle = board.corner(31);
        let depths: Vec<f64> = views.iter().map(|s| (s.color_from_board * middle).z()).collect();
        assert!(depths.iter().all(|z| (0.12..0.5).contains(z)), "{depths:?}");
        let partial = views.iter().filter(|s| s.corners().len() < board.n_corners()).count();
        assert!((3..=22).contains(&partial), "{partial} of 25 partly outside");

        let still = Plan { trajectory: Trajectory::FrontoParallel, n_frames: 5, ..plan };
        for frame in 0..5 {
            let scene = still.scene(frame);
            let z = (scene.color_from_board * middle).z();
            assert!((0.19..0.21).contains(&z), "{z}");
            assert!(scene.color_from_board.rotation.matrix()[(2, 2)].acos().to_degrees() < 5.0);
        }
    }

    #[test]
    fn depth_without_fault_is_true_within_its_noise() {
        let plan = plan("ipad-12.9-5gen", &[]);
        let errors: Vec<(f64, f64)> = (0..6).flat_map(|frame| depth_errors(&plan, frame)).collect();
        assert!(errors.len() > 150, "{}", errors.len());
        // Interpolation between pixels averages some of the noise away: 0.6 to 1 of it remain.
        let ratio = mean(errors.iter().map(|(d, z)| (d / plan.sensor.noise_m(*z)).powi(2))).sqrt();
        assert!((0.6..1.05).contains(&ratio), "{ratio}");
        let bias_m = mean(errors.iter().map(|(d, _)| *d));
        assert!(bias_m.abs() < 0.05e-3, "{bias_m}");
        let holes =
            mean(plan.frame(0).depth.depth_m().iter().map(|z| f64::from(u8::from(z.is_nan()))));
        assert!((0.005..0.3).contains(&holes), "{holes}");
    }

    #[test]
    fn faults_show_in_the_depth() {
        let clean = plan("ipad-12.9-5gen", &[]);
        let scaled = plan("ipad-12.9-5gen", &["depth-scale=1.5%", "depth-bias=-2mm"]);
        for frame in 0..3 {
            // Noise and holes are the same in both, so that the difference is the fault but for the rounding.
            for ((a, z), (b, _)) in
                depth_errors(&clean, frame).into_iter().zip(depth_errors(&scaled, frame))
            {
                assert!((b - a - (0.015 * z - 0.002)).abs() < 1.1e-4, "{z}: {a} {b}");
            }
        }

        let mut zoomed = plan("ipad-12.9-5gen", &["depth-zoom=0.9507", "depth-shift=3px,-2px"]);
        zoomed.sensor = DepthSensor::PERFECT;
        let scene = zoomed.scene(1);
        let depth = zoomed.frame(1).depth;
        let c = scene.camera.intrinsics;
        let mut n = 0;
        for corner in scene.corners() {
            // Content of the colour image at q lies at c + (q − c)/zoom + shift in the depth map.
            let at = Pixel::new(
                c.cx + (corner.pixel.x - c.cx) / 0.9507 + 3.0,
                c.cy + (corner.pixel.y - c.cy) / 0.9507 - 2.0,
            );
            let Some(measured) = depth.bilinear(at) else { continue };
            let z = (scene.color_from_board * scene.printed_corner(corner.id)).z();
            assert!((measured - z).abs() < 5e-6, "{corner:?}: {measured} {z}");
            n += 1;
        }
        assert!(n > 10, "{n}");
    }

    #[test]
    fn faults_show_in_the_camera() {
        let faulty = plan("ipad-12.9-5gen", &["focal=6.6%", "center=4px,-2px"]);
        let (factory, truth) = (faulty.factory().intrinsics, faulty.true_camera().intrinsics);
        assert!((factory.fx / truth.fx - 1.066).abs() < 1e-12);
        assert!((factory.cx - truth.cx - 4.0).abs() < 1e-9);
        assert!((factory.cy - truth.cy + 2.0).abs() < 1e-9);
        assert_eq!(factory, plan("ipad-12.9-5gen", &[]).factory().intrinsics);

        // Straight lines stay straight exactly where the stream is rectified.
        let bend_px = |device: &str, faults: &[&str]| {
            let plan = plan(device, faults);
            let worst = |frame: usize| {
                let scene = plan.scene(frame);
                let corners = scene.corners();
                let flat: Vec<Pixel> = corners
                    .iter()
                    .map(|c| scene.board.corner(c.id))
                    .map(|p| Pixel::new(p.x(), p.y()))
                    .collect();
                let seen: Vec<Pixel> = corners.iter().map(|c| c.pixel).collect();
                let map = Homography::from_points(&flat, &seen).unwrap();
                flat.iter()
                    .zip(&seen)
                    .map(|(p, q)| map.map(*p).unwrap().distance(*q))
                    .fold(0.0, f64::max)
            };
            (0..6).map(worst).fold(0.0, f64::max)
        };
        assert!(bend_px("ipad-12.9-5gen", &["focal=6.6%"]) < 1e-6);
        assert!(bend_px("ipad-12.9-5gen", &["distorted"]) > 2.0);
        assert!(bend_px("ipad-12.9-5gen", &["rectified-twice"]) > 2.0);
        assert!(bend_px("ipad-12.9-5gen", &["bent=0.8mm"]) > 0.2);
        assert!(bend_px("ipad-12.9-4gen", &[]) > 0.2);
        let claims = |faults: &[&str]| {
            plan("ipad-12.9-4gen", faults).factory().geometric_distortion_correction
        };
        assert_eq!((claims(&[]), claims(&["distorted"])), (Some(false), Some(true)));
    }

    #[test]
    fn mirrored_images_are_the_plain_ones_the_other_way_round() {
        let frame = |faults: &[&str]| plan("ipad-12.9-5gen", faults).frame(2);
        let (plain, both, depth) = (frame(&[]), frame(&["mirrored"]), frame(&["depth-mirrored"]));
        assert_eq!(mirrored(640, both.color.pixels()), plain.color.pixels());
        assert_eq!(both.corners[0].pixel.x, 639.0 - plain.corners[0].pixel.x);
        assert_eq!(depth.color, plain.color);
        let bits = |values: &[f32]| values.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&mirrored(640, both.depth.depth_m())), bits(plain.depth.depth_m()));
        assert_eq!(bits(both.depth.depth_m()), bits(depth.depth.depth_m()));
    }

    #[test]
    fn what_is_written_is_a_recording() {
        for (device, tables) in [("ipad-12.9-5gen", true), ("iphone-11-pro", false)] {
            let mut plan = plan(device, &["focal=-1%"]);
            plan.n_frames = 3;
            let files = written(&plan);
            let truth: Truth =
                serde_json::from_slice(files.get("truth.json").expect("written")).unwrap();
            assert_eq!(truth, plan.truth());
            assert_eq!(truth.board.parse::<CharucoBoard>().unwrap(), plan.board);
            let recording = Recording::from_files(Arc::new(files), &Limits::default()).unwrap();
            assert!(recording.problems.is_empty(), "{:?}", recording.problems);
            assert_eq!(recording.board.as_ref(), Some(&plan.board));
            assert_eq!(recording.frames.len(), 3);
            assert_eq!(recording.frames[1].id, truth.frames[1].timestamp.to_string());
            let (factory, read) = (plan.factory(), recording.frames[2].factory().unwrap());
            assert!((read.intrinsics.fx - factory.intrinsics.fx).abs() < 1e-9);
            assert_eq!(read.geometric_distortion_correction, Some(tables));
            assert_eq!(read.tables.is_some(), tables);
            if let (Some(read), Some(written)) = (&read.tables, factory.tables) {
                assert_eq!(read.inverse.magnification, written.inverse.magnification);
                assert!(read.inverse.center.distance(written.inverse.center) < 1e-9);
            }
            let frame = plan.frame(1);
            assert_eq!(recording.color(1).unwrap(), frame.color);
            let pairs = recording.depth(1).unwrap();
            for (a, b) in pairs.depth_m().iter().zip(frame.depth.depth_m()) {
                assert!(a.is_nan() == b.is_nan() && !((a - b).abs() > 1e-6), "{a} {b}");
            }
        }
    }

    /// Same plan, same bytes: on one thread and on three.
    #[test]
    fn threads_change_nothing() {
        let mut plan = plan("ipad-12.9-4gen", &["bent=0.8mm", "depth-zoom=0.95"]);
        plan.n_frames = 3;
        let on = |threads| par::on_threads(threads, || written(&plan));
        let (one, three) = (on(1), on(3));
        assert_eq!(one.files(), three.files());
        let other = Plan { seed: 6, ..plan.clone() };
        assert_ne!(written(&other).files(), one.files());
    }
}
