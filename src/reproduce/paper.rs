//! The numbers that arXiv:2201.10865 and its repository print, as printed.

/// A row of the table of focal lengths (section 5.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalRow {
    /// As in the registry of devices; its devices without metadata tables have names of the same form.
    pub device: &'static str,
    /// As printed.
    pub title: &'static str,
    /// Factory's fx at 640 columns, pixels.
    pub factory_px: f64,
    /// By ChArUco calibration, pixels.
    pub own_px: f64,
    /// Their difference, percent of the factory's.
    pub difference_percent: f64,
}

const fn row(
    device: &'static str,
    title: &'static str,
    [factory_px, own_px, difference_percent]: [f64; 3],
) -> FocalRow {
    FocalRow { device, title, factory_px, own_px, difference_percent }
}

/// The table of focal lengths.
pub const FOCAL: [FocalRow; 10] = [
    row("iphone-11-pro", "iPhone 11 Pro V1", [435.14, 431.24, 0.90]),
    row("iphone-11-pro", "iPhone 11 Pro V2", [436.49, 432.93, 0.81]),
    row("iphone-12", "iPhone 12", [434.93, 427.39, 1.73]),
    row("iphone-12-pro", "iPhone 12 Pro", [434.76, 427.79, 1.60]),
    row("iphone-13", "iPhone 13", [433.73, 421.73, 2.77]),
    row("ipad-11-2gen", "iPad 11\" 2gen", [596.75, 602.56, 0.97]),
    row("ipad-11-3gen", "iPad 11\" 3gen", [571.28, 532.60, 6.77]),
    row("ipad-12.9-4gen", "iPad 12.9\" 4gen V1", [597.76, 591.49, 1.10]),
    row("ipad-12.9-4gen", "iPad 12.9\" 4gen V2", [595.33, 602.51, 1.20]),
    row("ipad-12.9-5gen", "iPad 12.9\" 5gen", [565.85, 531.97, 5.99]),
];

/// What the repository's own README says of one of its recordings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// As in the registry.
    pub device: &'static str,
    /// As it is sold.
    pub title: &'static str,
    /// Factory's fx, pixels, and by calibration, pixels, and their difference, percent of the factory's: README.
    pub focal: [f64; 3],
    /// Decimals of the factory's fx as printed.
    pub factory_decimals: usize,
    /// What the published Python gives with OpenCV 4.5.5 today on the whole recording, pixels.
    pub rerun_px: f64,
    /// Median depth errors (board − sensor) of the same run, factory and own intrinsics, millimetres.
    pub depth_mm: [f64; 2],
    /// The paper's words on the depth error with factory intrinsics (section 4.2).
    pub depth_words: &'static str,
}

/// The repository's three recordings.
pub const PUBLISHED: [Published; 3] = [
    Published {
        device: "iphone-11-pro",
        title: "iPhone 11 Pro",
        focal: [436.5, 434.61, -0.43],
        factory_decimals: 1,
        rerun_px: 434.10,
        depth_mm: [-0.58, -1.78],
        depth_words: "within 1 mm",
    },
    Published {
        device: "ipad-12.9-4gen",
        title: "iPad 12.9\" 4gen",
        focal: [595.34, 602.38, 1.18],
        factory_decimals: 2,
        rerun_px: 601.86,
        depth_mm: [-0.64, 1.49],
        depth_words: "within 1 mm",
    },
    Published {
        device: "ipad-12.9-5gen",
        title: "iPad 12.9\" 5gen",
        focal: [565.12, 530.04, -6.21],
        factory_decimals: 2,
        rerun_px: 528.97,
        depth_mm: [13.69, 0.49],
        depth_words: "more than 14 mm",
    },
];

/// Printed derived columns of the device tables: difference of the depth intrinsics to ARKit's, and of the reference
/// dimensions, percent; by device.
pub(super) const DERIVED: [(&str, f64, f64); 5] = [
    ("ipad-11-3gen", 7.5, 42.0),
    ("ipad-12.9-5gen", 7.5, 42.0),
    ("ipad-11-2gen", 0.0, 5.2),
    ("ipad-12.9-4gen", 0.0, 5.2),
    ("iphone-11-pro", 0.0, 0.0),
];

/// The worked equations: pixels at 640 columns, for AVFoundation and for ARKit; and the zoom of issue 1.
pub(super) const EQUATIONS: [f64; 3] = [525.97, 361.58, 0.9507];

/// Where the recordings are.
pub(super) const WHERE: &str = "git clone github.com/ZEISS/iPad_TrueDepth_Issue_Eval";
