//! What can be wrong with a recording.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use crate::board::length_m;

/// One thing that is wrong with a recording: injected by [`simulate`](crate::simulate), found by
/// [`diagnose`](crate::diagnose), removed by [`correct`](crate::correct). Written and read as `name` or `name=value`.
///
/// Parameters relate what the files say to what is true, so that they hold for every frame. Numbers of the metadata
/// are at the size of the images; where [`IntrinsicsScale`](Self::IntrinsicsScale) is present they are those that it
/// has scaled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Defect {
    /// `focal=6.6%`: the factory's focal length is `ratio` times the true one (as text: how much longer).
    Focal {
        /// Factory over true.
        ratio: f64,
    },
    /// `center=4px,-2px`: the factory's principal point is the true one plus this.
    Center {
        /// Factory minus true, pixels of the image.
        shift_px: [f64; 2],
    },
    /// `intrinsics-scale=0.8`: the intrinsics are for images of another size.
    IntrinsicsScale {
        /// What fx and cx, and what fy and cy, have to be multiplied by.
        factor: [f64; 2],
    },
    /// `distorted`: the images are as the lens drew them, although the metadata or their use call them rectified.
    Distorted,
    /// `rectified-twice`: the lens correction was applied to images that were rectified already.
    RectifiedTwice,
    /// `depth-scale=1.5%`: the sensor's depth is `ratio` times the true one (as text: how much longer), plus the bias.
    DepthScale {
        /// Sensor over true.
        ratio: f64,
    },
    /// `depth-bias=2mm`: the sensor's depth is the true one, scaled, plus this.
    DepthBias {
        /// Sensor minus true, metres.
        bias_m: f64,
    },
    /// `depth-zoom=0.9507`: the depth map shows a window of the image, `zoom` as wide and high and centred at the
    /// principal point; depth pixel p holds what the colour image has at c + zoom·(p − shift − c).
    DepthZoom {
        /// Width of the window over the width of the image, and height.
        zoom: [f64; 2],
    },
    /// `depth-shift=3px,0px`: everything in the depth map lies this far to the right of and below its place in the
    /// colour image.
    DepthShift {
        /// Depth minus colour, pixels.
        shift_px: [f64; 2],
    },
    /// `mirrored`: colour image and depth map are mirrored, left for right, as ARKit delivers them.
    Mirrored,
    /// `depth-mirrored`: the depth map is mirrored against the colour image, left for right.
    DepthMirrored,
}

/// A defect that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DefectError {
    /// A name nobody knows.
    #[error("`{0}` is not a known fault; known are {known}", known = forms())]
    Name(String),
    /// A value in a wrong form.
    #[error("`{text}`: write {form}")]
    Value {
        /// As given.
        text: String,
        /// How it is written.
        form: &'static str,
    },
    /// A value no camera has.
    #[error("`{text}` is not possible: take {range}")]
    Range {
        /// As written.
        text: String,
        /// What is possible.
        range: &'static str,
    },
    /// Two that exclude each other, or the same twice.
    #[error("`{0}` and `{1}` exclude each other; take one of them")]
    Conflict(Defect, Defect),
}

/// What there is to know of a kind of defect.
struct Kind {
    name: &'static str,
    /// How it is written, with an example of its value.
    form: &'static str,
    /// What the example does.
    words: &'static str,
    /// The step that removes it.
    step: &'static str,
    /// What values are possible; empty where there is none.
    range: &'static str,
}

const fn kind(
    name: &'static str,
    form: &'static str,
    words: &'static str,
    step: &'static str,
    range: &'static str,
) -> Kind {
    Kind { name, form, words, step, range }
}

/// In the order of the enum.
#[rustfmt::skip]
const KINDS: [Kind; 11] = [
    kind("focal", "focal=6.6%", "factory focal length 6.6 % above the true one", "focal", "-90% to 900%"),
    kind("center", "center=4px,-2px", "factory principal point 4 px right of and 2 px above the true one",
         "center", "at most 10000 px"),
    kind("intrinsics-scale", "intrinsics-scale=0.8", "metadata for images 1.25 times as large",
         "scale-intrinsics", "0.001 to 1000"),
    kind("distorted", "distorted", "images not rectified although the metadata say so", "undistort", ""),
    kind("rectified-twice", "rectified-twice", "lens correction applied to rectified images again", "undistort", ""),
    kind("depth-scale", "depth-scale=1.5%", "depth 1.5 % too long", "depth", "-50% to 100%"),
    kind("depth-bias", "depth-bias=2mm", "depth 2 mm too long", "depth", "at most 200mm up or down"),
    kind("depth-zoom", "depth-zoom=0.9507", "depth map shows the middle 95.07 % of the image, as with ARKit",
         "zoom", "0.5 to 2"),
    kind("depth-shift", "depth-shift=3px,0px", "depth lies 3 px to the right of the colour image",
         "shift", "at most 200 px up or down"),
    kind("mirrored", "mirrored", "colour and depth mirrored left for right, as with ARKit", "mirror", ""),
    kind("depth-mirrored", "depth-mirrored", "depth alone mirrored left for right", "mirror", ""),
];

fn forms() -> String {
    KINDS.map(|kind| kind.form).join(", ")
}

impl Defect {
    /// The names of all steps of a correction, in the order of [`Defect::known`].
    pub const STEPS: [&'static str; 8] =
        ["focal", "center", "scale-intrinsics", "undistort", "depth", "zoom", "shift", "mirror"];

    /// Every defect as it is written, and what it does; for help texts.
    pub fn known() -> impl Iterator<Item = (&'static str, &'static str)> {
        KINDS.iter().map(|kind| (kind.form, kind.words))
    }

    const fn kind(&self) -> &'static Kind {
        &KINDS[match self {
            Self::Focal { .. } => 0,
            Self::Center { .. } => 1,
            Self::IntrinsicsScale { .. } => 2,
            Self::Distorted => 3,
            Self::RectifiedTwice => 4,
            Self::DepthScale { .. } => 5,
            Self::DepthBias { .. } => 6,
            Self::DepthZoom { .. } => 7,
            Self::DepthShift { .. } => 8,
            Self::Mirrored => 9,
            Self::DepthMirrored => 10,
        }]
    }

    /// Its name, as it is written before the `=`: stable, for machines.
    pub const fn name(&self) -> &'static str {
        self.kind().name
    }

    /// The step of a correction that removes it, one of [`STEPS`](Self::STEPS): stable, for machines.
    pub const fn step(&self) -> &'static str {
        self.kind().step
    }

    /// True where images or depth maps are wrong, false where only metadata are.
    pub const fn is_in_data(&self) -> bool {
        !matches!(self, Self::Focal { .. } | Self::Center { .. } | Self::IntrinsicsScale { .. })
    }

    /// True where the two cannot both be.
    fn excludes(&self, other: &Self) -> bool {
        self.name() == other.name()
            || [self, other].iter().all(|defect| defect.step() == "undistort")
    }

    /// Whether all of these can be wrong with one recording: no value that no camera has, none twice.
    pub fn check<'a>(defects: impl IntoIterator<Item = &'a Self>) -> Result<(), DefectError> {
        let mut seen: Vec<&Self> = Vec::new();
        for defect in defects {
            if !defect.is_possible() {
                return Err(DefectError::Range {
                    text: defect.to_string(),
                    range: defect.kind().range,
                });
            }
            if let Some(&&other) = seen.iter().find(|other| defect.excludes(other)) {
                return Err(DefectError::Conflict(other, *defect));
            }
            seen.push(defect);
        }
        Ok(())
    }

    fn is_possible(&self) -> bool {
        let both = |values: [f64; 2], low: f64, high: f64| {
            values.iter().all(|value| (low..=high).contains(value))
        };
        match *self {
            Self::Focal { ratio } => (0.1..=10.0).contains(&ratio),
            Self::DepthScale { ratio } => (0.5..=2.0).contains(&ratio),
            Self::Center { shift_px } => both(shift_px, -1e4, 1e4),
            Self::IntrinsicsScale { factor } => both(factor, 1e-3, 1e3),
            Self::DepthBias { bias_m } => bias_m.abs() <= 0.2,
            Self::DepthZoom { zoom } => both(zoom, 0.5, 2.0),
            Self::DepthShift { shift_px } => both(shift_px, -200.0, 200.0),
            Self::Distorted | Self::RectifiedTwice | Self::Mirrored | Self::DepthMirrored => true,
        }
    }
}

impl FromStr for Defect {
    type Err = DefectError;

    fn from_str(text: &str) -> Result<Self, DefectError> {
        let (name, value) = match text.trim().split_once('=') {
            Some((name, value)) => (name.trim(), Some(value.trim())),
            None => (text.trim(), None),
        };
        let Some(Kind { form, range, .. }) = KINDS.iter().find(|kind| kind.name == name) else {
            return Err(DefectError::Name(text.to_owned()));
        };
        let wrong = || DefectError::Value { text: text.to_owned(), form };
        if value.is_some() != form.contains('=') {
            return Err(wrong());
        }
        let value = value.unwrap_or_default();
        let percent = || -> Result<f64, DefectError> {
            let percent = value.strip_suffix('%').and_then(number).ok_or_else(wrong)?;
            Ok(1.0 + percent / 100.0)
        };
        let pair = |unit: &str| -> Result<[f64; 2], DefectError> {
            let one = |text: &str| number(text.trim().strip_suffix(unit)?);
            let (x, y) = value.split_once(',').ok_or_else(wrong)?;
            Ok([one(x).ok_or_else(wrong)?, one(y).ok_or_else(wrong)?])
        };
        let one_or_two = || pair("").or_else(|_| Ok([number(value).ok_or_else(wrong)?; 2]));
        let defect = match name {
            "focal" => Self::Focal { ratio: percent()? },
            "center" => Self::Center { shift_px: pair("px")? },
            "intrinsics-scale" => Self::IntrinsicsScale { factor: one_or_two()? },
            "distorted" => Self::Distorted,
            "rectified-twice" => Self::RectifiedTwice,
            "depth-scale" => Self::DepthScale { ratio: percent()? },
            "depth-bias" => Self::DepthBias { bias_m: length_m(value).map_err(|_| wrong())? },
            "depth-zoom" => Self::DepthZoom { zoom: one_or_two()? },
            "depth-shift" => Self::DepthShift { shift_px: pair("px")? },
            "mirrored" => Self::Mirrored,
            _ => Self::DepthMirrored,
        };
        match defect.is_possible() {
            true => Ok(defect),
            false => Err(DefectError::Range { text: text.to_owned(), range }),
        }
    }
}

/// A finite number.
fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|n: &f64| n.is_finite())
}

impl fmt::Display for Defect {
    /// As it is read: to twelve digits (what was typed, without the last bits of its conversion), or to the precision.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(12).max(1) - 1;
        let short = |x: f64| format!("{x:.digits$e}").parse::<f64>().unwrap_or(x);
        // A difference of ratios has the ratio's digits.
        let percent = |ratio: f64| {
            let percent = 100.0 * (ratio - 1.0);
            let decimals = digits.saturating_sub(2);
            format!("{percent:.decimals$}").parse::<f64>().unwrap_or(percent) + 0.0 // no "-0"
        };
        write!(f, "{}", self.name())?;
        match *self {
            Self::Focal { ratio } | Self::DepthScale { ratio } => write!(f, "={}%", percent(ratio)),
            Self::Center { shift_px: [x, y] } | Self::DepthShift { shift_px: [x, y] } => {
                write!(f, "={}px,{}px", short(x), short(y))
            }
            Self::IntrinsicsScale { factor: [x, y] } | Self::DepthZoom { zoom: [x, y] } => {
                write!(f, "={}", short(x))?;
                if x == y { Ok(()) } else { write!(f, ",{}", short(y)) }
            }
            Self::DepthBias { bias_m } => write!(f, "={}mm", short(bias_m * 1000.0)),
            Self::Distorted | Self::RectifiedTwice | Self::Mirrored | Self::DepthMirrored => Ok(()),
        }
    }
}

/// What was done to the images of a stream after the lens drew them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StreamState {
    /// Straight lines are straight: rectified, or of a lens that needs no rectification.
    Rectified,
    /// Nothing: as the lens drew them.
    Distorted,
    /// Bent the other way: the correction was applied to what was straight already.
    RectifiedTwice,
    /// The recording does not tell.
    Unknown,
}

impl StreamState {
    /// `rectified`, `distorted`, `rectified_twice` or `unknown`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rectified => "rectified",
            Self::Distorted => "distorted",
            Self::RectifiedTwice => "rectified_twice",
            Self::Unknown => "unknown",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        for (kind, (form, _)) in KINDS.iter().zip(Defect::known()) {
            let defect: Defect = form.parse().unwrap();
            assert_eq!((defect.to_string().as_str(), defect.name()), (form, kind.name));
            assert!(Defect::STEPS.contains(&defect.step()));
            let json = serde_json::to_string(&defect).unwrap();
            assert!(json.starts_with(&format!("{{\"kind\":\"{}\"", kind.name)), "{json}");
            assert_eq!(serde_json::from_str::<Defect>(&json).unwrap(), defect);
        }
        for text in [
            "focal=-0.7%",
            "depth-bias=-0.3mm",
            "depth-zoom=1",
            "center=0px,0.125px",
            "depth-zoom=0.95,0.96",
        ] {
            assert_eq!(text.parse::<Defect>().unwrap().to_string(), text);
        }
        assert_eq!("depth-bias=0.2cm".parse(), Ok(Defect::DepthBias { bias_m: 0.002 }));
        assert_eq!(" focal = 6.6 % ".parse(), Ok(Defect::Focal { ratio: 1.066 }));
        let found = [
            Defect::Focal { ratio: 565.12 / 533.307_731 },
            Defect::Center { shift_px: [1.0 / 3.0, -2.0 / 3.0] },
        ];
        assert_eq!(
            found.map(|d| format!("{d:.5}")),
            ["focal=5.97%", "center=0.33333px,-0.66667px"]
        );
    }

    #[test]
    fn what_cannot_be_is_refused_with_the_remedy() {
        for (text, remedy) in [
            ("vocal=3%", "focal=6.6%"),
            ("none", "focal=6.6%"),
            ("", "distorted"),
            ("focal", "focal=6.6%"),
            ("focal=6.6", "focal=6.6%"),
            ("focal=nan%", "focal=6.6%"),
            ("focal=-95%", "-90%"),
            ("depth-bias=2", "depth-bias=2mm"),
            ("depth-shift=3px", "depth-shift=3px,0px"),
            ("depth-shift=3,0", "depth-shift=3px,0px"),
            ("depth-zoom=95%", "depth-zoom=0.9507"),
            ("depth-zoom=0", "0.5 to 2"),
            ("mirrored=yes", "write mirrored"),
        ] {
            let error = text.parse::<Defect>().unwrap_err().to_string();
            assert!(error.contains(remedy), "{text}: {error}");
        }
        for texts in [["distorted", "rectified-twice"], ["focal=1%", "focal=2%"]] {
            let defects = texts.map(|text| text.parse::<Defect>().unwrap());
            assert!(matches!(Defect::check(&defects), Err(DefectError::Conflict(..))), "{texts:?}");
        }
        for defect in [
            Defect::DepthZoom { zoom: [f64::NAN, 1.0] },
            Defect::DepthShift { shift_px: [0.0, 1e3] },
            Defect::Focal { ratio: 0.0 },
            Defect::DepthBias { bias_m: f64::INFINITY },
            Defect::IntrinsicsScale { factor: [0.0, 1.0] },
            Defect::Center { shift_px: [f64::NAN, 0.0] },
        ] {
            assert!(matches!(Defect::check([&defect]), Err(DefectError::Range { .. })), "{defect}");
        }
    }
}
