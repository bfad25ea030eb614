//! The names of the checks.

use std::{fmt, str::FromStr};

/// name, title, file of the explanation.
macro_rules! codes {
    ($($code:ident, $file:literal, $title:literal;)*) => {
        /// A check. Codes are stable: TD1xx the recording, TD2xx the camera, TD3xx depth, TD4xx alignment, TD5xx
        /// metadata.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Code {
            $(#[doc = $title] $code,)*
        }

        impl Code {
            /// All of them, in order.
            pub const ALL: &[Self] = &[$(Self::$code),*];

            /// `TD201` and the like.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$code => stringify!($code),)* }
            }

            /// A few words that name the check.
            pub const fn title(self) -> &'static str {
                match self { $(Self::$code => $title,)* }
            }

            /// What the check measures, why it matters, how, and what to do: the Markdown behind
            /// `truedepth explain`.
            pub const fn explanation(self) -> &'static str {
                match self { $(Self::$code => include_str!(concat!($file, ".md")),)* }
            }
        }
    };
}

codes! {
    TD101, "td101_files", "Files and pairing";
    TD102, "td102_dropped_frames", "Dropped frames";
    TD103, "td103_metadata_incomplete", "Metadata";
    TD104, "td104_depth_unit", "Unit of depth";
    TD105, "td105_depth_not_metric", "Depth metric";
    TD201, "td201_focal_length", "Focal length";
    TD202, "td202_principal_point", "Principal point";
    TD203, "td203_not_rectified", "Lens distortion in the images";
    TD204, "td204_rectified_twice", "Rectified twice";
    TD205, "td205_factory_changed", "Factory calibration changed";
    TD301, "td301_depth_scale", "Depth scale";
    TD302, "td302_depth_bias", "Depth bias";
    TD303, "td303_depth_noise", "Depth noise and holes";
    TD401, "td401_zoom", "Depth-to-colour zoom";
    TD402, "td402_shift", "Depth-to-colour shift";
    TD403, "td403_mirrored", "Mirroring";
    TD501, "td501_distortion_centre", "Principal point and distortion centre";
    TD502, "td502_reference_dimensions", "Reference dimensions";
    TD503, "td503_intrinsics_size", "Size the intrinsics are for";
    TD504, "td504_field_of_view", "Field of view";
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no code.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not the code of a finding; known are {known}", known = known())]
pub struct UnknownCode(pub String);

/// All names, for the message.
fn known() -> String {
    Code::ALL.iter().map(|code| code.name()).collect::<Vec<_>>().join(", ")
}

impl FromStr for Code {
    type Err = UnknownCode;

    /// By name, in any case.
    fn from_str(text: &str) -> Result<Self, UnknownCode> {
        let text = text.trim();
        Self::ALL
            .iter()
            .copied()
            .find(|code| code.name().eq_ignore_ascii_case(text))
            .ok_or_else(|| UnknownCode(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_texts() {
        assert_eq!("td201".parse(), Ok(Code::TD201));
        assert!("TD999".parse::<Code>().is_err());
        assert!(Code::ALL.windows(2).all(|pair| pair[0] < pair[1]), "in order");
        for code in Code::ALL {
            let headings: Vec<&str> =
                code.explanation().lines().filter(|l| l.starts_with("## ")).collect();
            let [a, b, c, d, e, f] = headings[..] else { panic!("{code}: {headings:?}") };
            assert_eq!(
                [a, b, c, d, f],
                [
                    "## What it measures",
                    "## Why it matters",
                    "## How",
                    "## What to do",
                    "## References"
                ],
                "{code}"
            );
            assert!(
                e == "## Correction (safe)" || e == "## Correction (changes the data)",
                "{code}: {e}"
            );
        }
    }
}
