//! A recording without pictures: corners and depth maps as a detector and a sensor would give them.

use std::sync::Arc;

use super::{
    plan::Plan,
    random::{Random, Subject},
    scene::Scene,
    sensor::measure_frame,
};
use crate::{
    board::Layout,
    detect::{Corner, Identity, Observation},
    geom::Pixel,
    image::DepthMap,
    math,
    measure::{self, About, Measurer},
    recording::{Frame, FrameImage},
};

/// What is known of a frame once it was looked at.
#[derive(Clone, Debug)]
pub struct Glimpse {
    /// The corners, with noise of the σ they carry.
    pub observation: Observation,
    /// The depth map, from the same sensor as in a rendered frame.
    pub depth: DepthMap,
}

/// σ of a corner in a sharp image, pixels: that of the published recordings' sharp frames once the board's shape is
/// out of the way (0.06 to 0.16 px RMS of both coordinates together).
const SHARP_PX: f64 = 0.06;
/// What a pixel of motion during the exposure adds to it.
const PER_MOTION: f64 = 0.06;

impl Plan {
    /// What a recording of this plan says of itself.
    pub fn about(&self) -> About {
        let name = "simulated".to_owned();
        About { place: name.clone(), name, problems: Vec::new(), factory: Some(self.factory()) }
    }

    /// All frames as [`glimpse`](Self::glimpse) sees them, measured; `depth` may change a frame's depth map or take it
    /// away.
    ///
    /// Errors: a changed depth map of another shape.
    pub fn measurer(
        &self,
        depth: impl Fn(usize, DepthMap) -> Option<DepthMap>,
    ) -> Result<Measurer, measure::Error> {
        let factory = Arc::new(self.factory());
        let size_px = factory.size();
        let mut measurer = Measurer::new(&self.board);
        for frame in 0..self.n_frames {
            let Glimpse { observation, depth: map } = self.glimpse(frame);
            let image = |file: &str| {
                let factory = Some(Arc::clone(&factory));
                Some(FrameImage { file: file.to_owned(), size: Some(size_px), factory })
            };
            let id = self.timestamp(frame).to_string();
            let t_ns = 500_000_000 * frame as i64;
            let (color, depth_image) = (image("color"), image("depth"));
            let frame_of = Frame { id, t_ns, color, depth: depth_image };
            let mut found = measurer.seen(&frame_of, size_px, observation);
            if let Some(map) = depth(frame, map) {
                measurer.look_at_depth(&mut found, &map, "simulated")?;
            }
            measurer.add(found);
        }
        Ok(measurer)
    }

    /// Frame `frame` without rendering and detecting: true corners with normal noise whose σ grows with the frame's
    /// motion, and the depth map. A thousand times as many recordings can be judged in this way as with pictures; what
    /// is not in it are the detector's own slips (wrong places of corners that are half hidden, blur that σ does not
    /// tell).
    pub fn glimpse(&self, frame: usize) -> Glimpse {
        self.glimpse_of(frame, frame)
    }

    /// Frame `frame` twice, as if board and camera had stood still: with noise of its own each.
    pub fn glimpses_of_one_pose(&self, frame: usize) -> [Glimpse; 2] {
        [frame, self.n_frames + frame].map(|noise| self.glimpse_of(frame, noise))
    }

    /// The scene of one frame with the noise of another.
    fn glimpse_of(&self, frame: usize, noise: usize) -> Glimpse {
        let scene = self.scene(frame);
        let sigma_px = math::hypot(SHARP_PX, PER_MOTION * motion_px(&scene));
        let mut random = Random::new(self.seed, Subject::Corners, noise);
        let [width, height] =
            [scene.camera.intrinsics.width, scene.camera.intrinsics.height].map(|n| n as f64);
        let corners: Vec<Corner> = self
            .corners(&scene)
            .into_iter()
            .map(|corner| {
                let (dx, dy) = (random.normal(), random.normal());
                let pixel =
                    Pixel::new(corner.pixel.x + sigma_px * dx, corner.pixel.y + sigma_px * dy);
                Corner { id: corner.id, pixel, sigma_px }
            })
            // A detector needs the neighbourhood of a corner.
            .filter(|c| c.pixel.x > 4.0 && c.pixel.y > 4.0)
            .filter(|c| c.pixel.x < width - 5.0 && c.pixel.y < height - 5.0)
            .collect();
        let identity = (corners.len() >= 4).then(|| Identity {
            layout: self.board.layout.unwrap_or(Layout::Legacy),
            mirrored: self.is_mirrored(),
            inverted: false,
            markers: (0..corners.len() / 2).collect(),
            margin: 100.0,
        });
        let depth =
            self.as_recorded(measure_frame(&scene, &self.sensor_with_faults(), self.seed, noise));
        Glimpse { observation: Observation { corners, identity, rejects: Vec::new() }, depth }
    }
}

/// How far the middle of the image moves during the exposure, pixels.
fn motion_px(scene: &Scene) -> f64 {
    let distance_m = scene.color_from_board.translation.z.max(0.1);
    let per_m = scene.camera.intrinsics.focal_px() / distance_m;
    per_m * scene.motion.translation_m.xy().norm()
}
