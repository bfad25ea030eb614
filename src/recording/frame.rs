//! One moment of a recording.

use std::sync::Arc;

use crate::{
    camera::{Intrinsics, TablePair},
    geom::Pixel,
};

/// One moment: a colour image, its depth map and its metadata, each where present.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Time since the first frame of the recording, nanoseconds.
    pub t_ns: i64,
    /// The timestamp as written in the file (ZEISS app: milliseconds since boot). Names the frame for people.
    pub timestamp: i64,
    /// Name of the colour image inside the recording.
    pub color: Option<String>,
    /// Name of the depth image inside the recording.
    pub depth: Option<String>,
    /// What the factory says about the camera at this frame: one and the same for all frames of which it says the same.
    pub factory: Option<Arc<Factory>>,
    /// Columns and rows of the colour image after the colour camera's metadata.
    pub(super) color_size: Option<[usize; 2]>,
}

/// Factory metadata of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Factory {
    /// Intrinsics at the size of the depth map.
    pub intrinsics: Intrinsics,
    /// `intrinsicMatrixReferenceDimensions`, pixels.
    pub reference_dimensions: Option<[f64; 2]>,
    /// Lens distortion centre at the size of the depth map. Scaled by the ratio of the sizes without a half-pixel
    /// shift, as the app scaled the principal point: where the file has both at one place, so have we.
    pub distortion_center: Option<Pixel>,
    /// Both lookup tables at the size of the depth map.
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

    /// Columns and rows of the depth map.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.intrinsics.width, self.intrinsics.height]
    }
}
