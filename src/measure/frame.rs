//! What is known of one frame.

use std::sync::Arc;

use crate::{
    board::CharucoBoard,
    depth::{Patches, patches, sense},
    detect::{Corner, Observation},
    geom::Pixel,
    image::DepthMap,
    pose::View,
    recording::{Factory, Frame},
};

/// What was measured of one frame.
#[derive(Clone, Debug)]
pub struct FrameMeasurement {
    /// What people call the frame.
    pub id: String,
    /// Time since the first frame, nanoseconds.
    pub t_ns: i64,
    /// Name of the colour image inside the recording.
    pub color: Option<String>,
    /// Name of the depth image inside the recording.
    pub depth: Option<String>,
    /// What the factory says about the camera, at the size of the colour image.
    pub factory: Option<Arc<Factory>>,
    /// Columns and rows of the colour image.
    pub size_px: Option<[usize; 2]>,
    /// Columns and rows of the depth map, where it was read.
    pub depth_size_px: Option<[usize; 2]>,
    /// Corners that were seen.
    pub n_corners: usize,
    /// False where the frame looks like others and is summarised: then [`observation`](Self::observation) has no
    /// corners, and nothing below is there.
    pub in_full: bool,
    /// What was seen of the board.
    pub observation: Observation,
    /// The sensor's depth at each corner, metres; `None` on holes. Empty where the frame has no depth or no corner.
    pub sensor_m: Vec<Option<f64>>,
    /// The depth map in and round the board's outline; `None` where there is none.
    pub patches: Option<Patches>,
    /// Fraction of the depth map without measurement; `None` where it was not read.
    pub holes: Option<f64>,
    /// The board's pose with the factory's intrinsics.
    pub factory_view: Option<View>,
    /// The board's pose with the measured camera.
    pub own_view: Option<View>,
}

impl FrameMeasurement {
    /// Nothing seen yet.
    pub(super) fn blank(frame: &Frame) -> Self {
        Self {
            id: frame.id.clone(),
            t_ns: frame.t_ns,
            color: frame.color.as_ref().map(|image| image.file.clone()),
            depth: frame.depth.as_ref().map(|image| image.file.clone()),
            factory: None,
            size_px: None,
            depth_size_px: None,
            n_corners: 0,
            in_full: true,
            observation: Observation { corners: Vec::new(), identity: None, rejects: Vec::new() },
            sensor_m: Vec::new(),
            patches: None,
            holes: None,
            factory_view: None,
            own_view: None,
        }
    }

    /// What the depth map says where the board was seen.
    pub(super) fn read_depth(&mut self, map: &DepthMap, board: &CharucoBoard) {
        let size = [map.width(), map.height()];
        self.depth_size_px = Some(size);
        let corners = self.corners_in_depth();
        self.sensor_m = sense(map, &corners);
        self.patches = patches(map, board, &corners);
        let n_holes = map.depth_m().iter().filter(|depth| depth.is_nan()).count();
        self.holes = Some(n_holes as f64 / map.depth_m().len() as f64);
    }

    /// The corners in pixels of the depth map.
    fn corners_in_depth(&self) -> Vec<Corner> {
        let corners = &self.observation.corners;
        match self.depth_scale() {
            None => corners.clone(),
            Some(scale) => corners.iter().map(|corner| scaled(*corner, scale)).collect(),
        }
    }

    /// Pixels of the depth map to a pixel of the colour image, where that is not one.
    pub(super) fn depth_scale(&self) -> Option<[f64; 2]> {
        let (color, depth) = (self.size_px?, self.depth_size_px?);
        (color != depth).then(|| [0, 1].map(|i| depth[i] as f64 / color[i] as f64))
    }

    /// Keeps what is short; the rest goes.
    pub(super) fn summarise(&mut self) {
        self.in_full = false;
        self.observation.corners = Vec::new();
        self.observation.rejects = Vec::new();
        if let Some(identity) = &mut self.observation.identity {
            identity.markers = Vec::new();
        }
        self.sensor_m = Vec::new();
        self.patches = None;
    }
}

/// A corner in another size of the image.
pub(super) fn scaled(corner: Corner, [sx, sy]: [f64; 2]) -> Corner {
    let pixel = Pixel::new(corner.pixel.x * sx, corner.pixel.y * sy);
    Corner { pixel, sigma_px: corner.sigma_px * f64::midpoint(sx, sy), ..corner }
}
