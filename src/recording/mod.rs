//! Recordings as the capture apps write them: frames paired by time, factory metadata, limits. (skeleton: types only)

use crate::{
    board::CharucoBoard,
    camera::{Intrinsics, TablePair},
    geom::Pixel,
    image::{DepthMap, Gray, Rgb},
};

/// A recording: frames in order of time, what the files say about the camera, and what was odd in the files.
/// Images are decoded only when asked for, so that memory does not grow with the number of frames.
#[derive(Debug)]
pub struct Recording {
    /// Name of the folder or archive member, for people.
    pub name: String,
    /// The board, where the recording tells it.
    pub board: Option<CharucoBoard>,
    /// Frames in order of time.
    pub frames: Vec<Frame>,
    /// What is odd, but not fatal.
    pub problems: Vec<Problem>,
    // + private: the named readers (trait Source), limits
}

/// One moment: a colour image, its depth map and its metadata, each where present.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Time since the first frame of the recording, nanoseconds.
    pub t_ns: i64,
    /// The timestamp as written in the file (ZEISS app: milliseconds since boot). Names the frame for people.
    pub timestamp: i64,
    /// Name of the colour image inside the recording.
    pub color: Option<String>,
    /// Name of the depth image inside the recording.
    pub depth: Option<String>,
    /// What the factory says about the camera at this frame.
    pub factory: Option<Factory>,
}

/// Factory metadata of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Factory {
    /// Intrinsics at the size of the depth map.
    pub intrinsics: Intrinsics,
    /// `intrinsicMatrixReferenceDimensions`, pixels.
    pub reference_dimensions: Option<[f64; 2]>,
    /// Lens distortion centre at the size of the depth map (scaled as Apple scales the principal point).
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

/// Something odd in the files that did not stop the reading.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Problem {
    /// Metadata entries for which there is no image.
    MetadataWithoutImages {
        /// Timestamps as written.
        timestamps: Vec<i64>,
    },
    // ...
}

impl Recording {
    /// The colour image of a frame, as grey.
    pub fn gray(&self, _frame: usize) -> Result<Gray, Error> {
        Err(Error::Skeleton)
    }
    /// The colour image of a frame.
    pub fn rgb(&self, _frame: usize) -> Result<Rgb, Error> {
        Err(Error::Skeleton)
    }
    /// The depth map of a frame.
    pub fn depth(&self, _frame: usize) -> Result<DepthMap, Error> {
        Err(Error::Skeleton)
    }
}

/// skeleton
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// skeleton
    #[error("skeleton")]
    Skeleton,
}
