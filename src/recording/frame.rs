//! One moment of a recording.

use std::sync::Arc;

use crate::{
    camera::{Intrinsics, TablePair},
    geom::Pixel,
};

/// One moment: a colour image and its depth map, each where present.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// What people call it: the timestamp in the file's name, the file's name, a number.
    pub id: String,
    /// Time since the first frame of the recording, nanoseconds.
    pub t_ns: i64,
    /// The colour image.
    pub color: Option<FrameImage>,
    /// The depth map.
    pub depth: Option<FrameImage>,
}

impl Frame {
    /// What the factory says about the camera, at the size of the depth map; of a frame without one, at that of the
    /// colour image.
    pub fn factory(&self) -> Option<&Factory> {
        let mut images = [&self.depth, &self.color].into_iter().flatten();
        images.find_map(|image| image.factory.as_deref())
    }
}

/// An image of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameImage {
    /// Name of its file inside the recording; in memory, whatever messages shall call it.
    pub file: String,
    /// Columns and rows, where the metadata tell them: an image of another size is an error.
    pub size: Option<[usize; 2]>,
    /// What the factory says about the camera, at the size of this image: one and the same for all images of which it
    /// says the same.
    pub factory: Option<Arc<Factory>>,
}

impl FrameImage {
    /// An image of this name, of which nothing else is known.
    pub fn named(file: impl Into<String>) -> Self {
        Self { file: file.into(), size: None, factory: None }
    }
}

/// Factory metadata of one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Factory {
    /// Intrinsics at the size of the image.
    pub intrinsics: Intrinsics,
    /// `intrinsicMatrixReferenceDimensions`, pixels.
    pub reference_dimensions: Option<[f64; 2]>,
    /// Lens distortion centre at the size of the image. Scaled by the ratio of the sizes without a half-pixel shift,
    /// as the capture app scaled the principal point: where the file has both at one place, so have we.
    pub distortion_center: Option<Pixel>,
    /// Both lookup tables at the size of the image.
    pub tables: Option<TablePair>,
    /// Pixel size at the reference dimensions, metres.
    pub pixel_size_m: Option<f64>,
    /// Depth-to-colour pose as delivered: rows of [R|t], t in metres.
    pub extrinsics: Option<[[f64; 4]; 3]>,
    /// `depthDataAccuracy`: Some(true) = absolute.
    pub depth_absolute: Option<bool>,
    /// `isDepthDataFiltered`.
    pub depth_filtered: Option<bool>,
    /// `GeometricDistortionCorrectionEnabled` of the colour device.
    pub geometric_distortion_correction: Option<bool>,
    /// `DeviceType`, e.g. `AVCaptureDeviceTypeBuiltInTrueDepthCamera`.
    pub device_type: Option<String>,
    /// Horizontal field of view as the device format states it, radians.
    pub field_of_view_rad: Option<f64>,
}

/// Sizes whose shapes differ by more than this share are not the same picture at two sizes.
const SAME_SHAPE: f64 = 0.01;

/// Whether two images may show the same picture at two sizes.
pub(crate) fn same_shape(a: [usize; 2], b: [usize; 2]) -> bool {
    let shape = |[width, height]: [usize; 2]| width as f64 / height as f64;
    (shape(a) / shape(b) - 1.0).abs() <= SAME_SHAPE
}

impl Factory {
    /// Only a pinhole, and nothing else known.
    pub fn pinhole(intrinsics: Intrinsics) -> Self {
        Self {
            intrinsics,
            reference_dimensions: None,
            distortion_center: None,
            tables: None,
            pixel_size_m: None,
            extrinsics: None,
            depth_absolute: None,
            depth_filtered: None,
            geometric_distortion_correction: None,
            device_type: None,
            field_of_view_rad: None,
        }
    }

    /// Columns and rows of the image.
    pub fn size(&self) -> [usize; 2] {
        [self.intrinsics.width, self.intrinsics.height]
    }

    /// The same at another size of the image. `None` for a size of another shape: whether it was cropped or squeezed is
    /// not known.
    pub fn at_size(&self, size: [usize; 2]) -> Option<Self> {
        let own = self.size();
        if own == size {
            return Some(self.clone());
        }
        if !same_shape(own, size) {
            return None;
        }
        let [sx, sy] = [0, 1].map(|i| size[i] as f64 / own[i] as f64);
        let place = |p: Pixel| Pixel::new(p.x * sx, p.y * sy);
        let tables = self.tables.as_ref().map(|t| t.at_scale([sx, sy], size));
        Some(Self {
            intrinsics: self.intrinsics.at_size(size),
            distortion_center: self.distortion_center.map(place),
            tables,
            ..self.clone()
        })
    }
}
