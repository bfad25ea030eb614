//! What the paper measured itself.

/// A focal length of arXiv:2201.10865, section 5.1: the factory's, and what a ChArUco board gave, at 640x480 by
/// AVFoundation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperFocal {
    /// As [`Entry::device`](super::Entry::device); a device without a row there has a name in the same style.
    pub device: &'static str,
    /// Which unit, where the paper has several.
    pub unit: &'static str,
    /// What the device said, pixels.
    pub factory_px: f64,
    /// What the paper measured, pixels.
    pub charuco_px: f64,
}

/// The table of section 5.1, row by row as printed.
#[rustfmt::skip]
const TABLE: [(&str, &str, f64, f64); 10] = [
    ("iphone-11-pro", "v1", 435.14, 431.24),
    ("iphone-11-pro", "v2", 436.49, 432.93),
    ("iphone-12", "", 434.93, 427.39),
    ("iphone-12-pro", "", 434.76, 427.79),
    ("iphone-13", "", 433.73, 421.73),
    ("ipad-11-2gen", "", 596.75, 602.56),
    ("ipad-11-3gen", "", 571.28, 532.60),
    ("ipad-12.9-4gen", "v1", 597.76, 591.49),
    ("ipad-12.9-4gen", "v2", 595.33, 602.51),
    ("ipad-12.9-5gen", "", 565.85, 531.97),
];

/// All focal lengths that the paper measured. Without a σ: the paper prints none.
pub fn paper_focals() -> Vec<PaperFocal> {
    TABLE
        .iter()
        .map(|&(device, unit, factory_px, charuco_px)| PaperFocal {
            device,
            unit,
            factory_px,
            charuco_px,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last column of the printed table, percent; it was computed from numbers with more digits, and four rows
    /// deviate from the quotient of the printed ones by up to 0.05.
    #[test]
    fn differences_are_the_printed_ones() {
        let printed = [0.90, 0.81, 1.73, 1.60, 2.77, 0.97, 6.77, 1.10, 1.20, 5.99];
        for (row, printed) in paper_focals().iter().zip(printed) {
            let percent = 100.0 * (1.0 - row.charuco_px / row.factory_px).abs();
            assert!((percent - printed).abs() < 0.06, "{row:?}: {percent:.2} %, printed {printed}");
        }
    }
}
