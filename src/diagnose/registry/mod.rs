//! Devices and what is published of their factory calibration, with the issues each is known to have.

mod identify;
mod paper;
mod published;
mod user;

pub use identify::{Certainty, Identity};
pub use paper::{PaperFocal, paper_focals};
pub use user::RegistryError;

use crate::math;
use crate::recording::Factory;

/// The way a recording was captured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Api {
    /// `AVCaptureSession` with depth output.
    AvFoundation,
    /// `ARSession` with face tracking.
    ArKit,
}

impl Api {
    /// `av` or `ar`: stable, for names and machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::AvFoundation => "av",
            Self::ArKit => "ar",
        }
    }

    /// `AVFoundation` or `ARKit`, for people.
    pub const fn title(self) -> &'static str {
        match self {
            Self::AvFoundation => "AVFoundation",
            Self::ArKit => "ARKit",
        }
    }
}

/// What is known to be wrong with a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum KnownIssue {
    /// Issue 1 of the paper: depth appears zoomed relative to colour under ARKit.
    DepthZoom,
    /// Issue 2 of the paper: the factory's focal length is too long by 6 to 7 %, under both APIs.
    FocalLength,
    /// Images carry the lens' distortion, although the paper calls them rectified.
    NotRectified,
}

impl KnownIssue {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::DepthZoom, Self::FocalLength, Self::NotRectified];

    /// `depth-zoom`, `focal-length` or `not-rectified`: stable, for files and machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::DepthZoom => "depth-zoom",
            Self::FocalLength => "focal-length",
            Self::NotRectified => "not-rectified",
        }
    }

    /// What it is, for people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::DepthZoom => {
                "depth is zoomed against colour under ARKit (issue 1 of the paper; finding TD401)"
            }
            Self::FocalLength => {
                "the factory's focal length is 6 to 7 % too long (issue 2 of the paper; finding TD201)"
            }
            Self::NotRectified => "the images are not rectified (finding TD203)",
        }
    }
}

/// Factory parameters as an API delivers them, pixels at the reference dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// `intrinsicMatrixReferenceDimensions`.
    pub reference: [f64; 2],
    /// Depth focal length.
    pub focal_px: f64,
    /// Depth principal point.
    pub center: [f64; 2],
    /// `lensDistortionCenter`, where there is one.
    pub distortion_center: Option<[f64; 2]>,
    /// Colour focal length at the size of the colour image (640x480 under AVFoundation, 1440x1080 under ARKit).
    pub color_focal_px: Option<f64>,
    /// Colour principal point at the size of the colour image.
    pub color_center: Option<[f64; 2]>,
}

/// Both are printed to a hundredth of a pixel.
const SAME_PLACE_PX: f64 = 0.01;

impl Sheet {
    /// What a recording's metadata say; `None` where they have no reference dimensions.
    pub fn from_factory(factory: &Factory) -> Option<Self> {
        let reference = factory.reference_dimensions?;
        let k = &factory.intrinsics;
        let scale = [reference[0] / k.width as f64, reference[1] / k.height as f64];
        let place = |x: f64, y: f64| [x * scale[0], y * scale[1]];
        Some(Self {
            reference,
            focal_px: k.fx * scale[0],
            center: place(k.cx, k.cy),
            distortion_center: factory.distortion_center.map(|c| place(c.x, c.y)),
            color_focal_px: None,
            color_center: None,
        })
    }

    /// Distance of distortion centre and principal point, pixels at the reference dimensions.
    pub fn center_distance_px(&self) -> Option<f64> {
        let [x, y] = self.distortion_center?;
        Some(math::hypot(x - self.center[0], y - self.center[1]))
    }

    /// The paper's column "LDC equals PP".
    pub fn centers_equal(&self) -> Option<bool> {
        // Half a unit of the last printed digit of slack: 0.01 in print may be 0.0149 in the files.
        Some(self.center_distance_px()? < 1.5 * SAME_PLACE_PX)
    }

    /// The depth focal length at an image this wide, pixels.
    pub fn focal_at_px(&self, width: f64) -> f64 {
        self.focal_px * width / self.reference[0]
    }
}

/// One row of the registry.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Like `ipad-12.9-5gen`.
    pub device: String,
    /// As it is sold.
    pub product: String,
    /// Which unit or version of the system, like `v1` or `ios15`.
    pub version: String,
    /// The way it was read.
    pub api: Api,
    /// The numbers.
    pub sheet: Sheet,
    /// What is known to be wrong.
    pub issues: Vec<KnownIssue>,
    /// Who says so.
    pub source: String,
}

impl Entry {
    /// `DEVICE/VERSION/API`, like `ipad-12.9-5gen/ios15/av`.
    pub fn name(&self) -> String {
        format!("{}/{}/{}", self.device, self.version, self.api.name())
    }
}

/// Devices by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Registry {
    entries: Vec<Entry>,
}

impl Registry {
    /// The twenty rows of the paper.
    pub fn published() -> Self {
        Self { entries: published::entries() }
    }

    /// All rows, the published ones first.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The row of this name, in any case.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name().eq_ignore_ascii_case(name.trim()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_rows_with_names_of_their_own() {
        let registry = Registry::published();
        assert_eq!(registry.entries().len(), 20);
        let mut names: Vec<String> = registry.entries().iter().map(Entry::name).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), 20);
        let entry = registry.get("iPad-12.9-5gen/iOS14/AV").unwrap();
        assert_eq!((entry.sheet.focal_px, entry.api), (1781.78, Api::AvFoundation));
        assert!(registry.get("ipad-12.9-5gen/ios14").is_none());
    }

    /// "LDC equals PP": no for both ultra-wide iPads under both APIs, yes otherwise.
    #[test]
    fn centres_equal_as_printed() {
        for entry in Registry::published().entries() {
            let printed = !entry.issues.contains(&KnownIssue::FocalLength);
            assert_eq!(entry.sheet.centers_equal(), Some(printed), "{}", entry.name());
        }
    }

    /// Every AVFoundation row's colour focal length is its depth focal length at 640 columns, to the printed digits,
    /// and every ARKit row's at 1440; but for the iPhone's iOS 14 row, which is off by 0.59 px.
    #[test]
    fn colour_and_depth_agree_but_for_one_row() {
        for entry in Registry::published().entries() {
            let width = if entry.api == Api::ArKit { 1440.0 } else { 640.0 };
            let error = entry.sheet.color_focal_px.unwrap() - entry.sheet.focal_at_px(width);
            if entry.name() == "iphone-11-pro/ios14/av" {
                assert!((error - 0.59).abs() < 0.005, "{error}");
            } else {
                assert!(error.abs() < 0.011, "{}: {error}", entry.name());
            }
        }
    }
}
