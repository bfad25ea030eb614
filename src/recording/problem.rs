//! What is odd in the files of a recording, but not fatal.

use std::fmt;

/// Something odd in the files that did not stop the reading. Its text says what it means for the result.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Problem {
    /// A metadata file is not there.
    MetadataMissing {
        /// The file.
        file: &'static str,
    },
    /// A metadata file ends after a whole record, but without its end: whoever wrote it was stopped. Nothing is lost.
    MetadataUnfinished {
        /// The file.
        file: &'static str,
    },
    /// Metadata entries for which there is no image.
    MetadataWithoutImages {
        /// Timestamps as written.
        timestamps: Vec<i64>,
    },
    /// Images for which a metadata file has no entry.
    ImagesWithoutMetadata {
        /// The metadata file.
        file: &'static str,
        /// Timestamps as written.
        timestamps: Vec<i64>,
    },
    /// Colour images without a depth image of the same time.
    ColorWithoutDepth {
        /// Timestamps as written.
        timestamps: Vec<i64>,
    },
    /// Depth images without a colour image of the same time.
    DepthWithoutColor {
        /// Timestamps as written.
        timestamps: Vec<i64>,
    },
    /// Several metadata entries of one time; the first of them counts.
    DuplicateMetadata {
        /// The metadata file.
        file: &'static str,
        /// Timestamps as written, each once.
        timestamps: Vec<i64>,
    },
    /// Several images of one time (`rgb_7.png`, `rgb_007.png`); the first by name counts.
    DuplicateImages {
        /// The names that do not count.
        names: Vec<String>,
    },
    /// Metadata entries that are not in order of time. They were paired by time, so nothing is lost.
    MetadataOutOfOrder {
        /// The metadata file.
        file: &'static str,
        /// The first timestamp that is earlier than the one before it.
        timestamp: i64,
    },
    /// Files that are named like images of a frame, but not after a time.
    UnusableNames {
        /// The names.
        names: Vec<String>,
    },
    /// The factory intrinsics are not the same in all frames.
    IntrinsicsVary {
        /// Smallest and largest fx, pixels.
        fx_px: [f64; 2],
        /// Smallest and largest cx, pixels.
        cx_px: [f64; 2],
        /// Smallest and largest cy, pixels.
        cy_px: [f64; 2],
    },
    /// Reference dimensions of another shape than the depth map, so that distortion centre and tables cannot be
    /// scaled to it; they are left out.
    ReferenceShape {
        /// Timestamp of the first such record.
        timestamp: i64,
        /// Reference dimensions, pixels.
        reference: [f64; 2],
        /// Columns and rows of the depth map.
        size: [usize; 2],
    },
    /// Only one of the two lookup tables is there; it is left out.
    SingleTable {
        /// Timestamp of the first such record.
        timestamp: i64,
        /// The key that is missing.
        missing: &'static str,
    },
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |timestamps: &[i64]| shorten(timestamps.iter().map(ToString::to_string));
        match self {
            Self::MetadataMissing { file } => {
                write!(f, "{file} is missing: what it says about the camera is not known")
            }
            Self::MetadataUnfinished { file } => write!(
                f,
                "{file} has no end: the app that wrote it was stopped; all of its records are whole and are used"
            ),
            Self::MetadataWithoutImages { timestamps } => write!(
                f,
                "{} metadata entries have no image: {}",
                timestamps.len(),
                list(timestamps)
            ),
            Self::ImagesWithoutMetadata { file, timestamps } => write!(
                f,
                "{} frames have no entry in {file}: {}",
                timestamps.len(),
                list(timestamps)
            ),
            Self::ColorWithoutDepth { timestamps } => write!(
                f,
                "{} colour images have no depth image: {}",
                timestamps.len(),
                list(timestamps)
            ),
            Self::DepthWithoutColor { timestamps } => write!(
                f,
                "{} depth images have no colour image: {}",
                timestamps.len(),
                list(timestamps)
            ),
            Self::DuplicateMetadata { file, timestamps } => write!(
                f,
                "{file} has several entries for {} times, of which the first counts: {}",
                timestamps.len(),
                list(timestamps)
            ),
            Self::DuplicateImages { names } => write!(
                f,
                "{} images repeat the time of another and do not count: {}",
                names.len(),
                shorten(names.iter().cloned())
            ),
            Self::MetadataOutOfOrder { file, timestamp } => write!(
                f,
                "{file} is not in order of time, first at {timestamp}; frames are paired by time, so nothing is lost"
            ),
            Self::UnusableNames { names } => write!(
                f,
                "{} files are named like images, but not after a time in milliseconds, and do not count: {}",
                names.len(),
                shorten(names.iter().cloned())
            ),
            Self::IntrinsicsVary { fx_px, cx_px, cy_px } => write!(
                f,
                "the factory intrinsics vary between frames: fx {} to {} px, cx {} to {} px, cy {} to {} px",
                fx_px[0], fx_px[1], cx_px[0], cx_px[1], cy_px[0], cy_px[1]
            ),
            Self::ReferenceShape { timestamp, reference, size } => write!(
                f,
                "the reference dimensions {}x{} have another shape than the depth map of {}x{} (first at \
                 {timestamp}): distortion centre and tables are left out",
                reference[0], reference[1], size[0], size[1]
            ),
            Self::SingleTable { timestamp, missing } => write!(
                f,
                "{missing} is missing beside the other table (first at {timestamp}): no table is used"
            ),
        }
    }
}

/// The first few, and how many more.
fn shorten(items: impl ExactSizeIterator<Item = String>) -> String {
    const SHOWN: usize = 5;
    let more = items.len().saturating_sub(SHOWN);
    let mut text = items.take(SHOWN).collect::<Vec<_>>().join(", ");
    if more > 0 {
        text += &format!(" and {more} more");
    }
    text
}
