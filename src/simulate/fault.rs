//! Faults to choose from.

use std::{fmt, str::FromStr};

use crate::board::length_m;

/// One thing that is wrong with a recording, written and read as `name` or `name=value`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// `focal=6.6%`: the factory's focal length is the true one times (1 + excess).
    Focal {
        /// Factory over true, minus 1.
        excess: f64,
    },
    /// `center=4px,-2px`: the factory's principal point is the true one plus this.
    Center {
        /// Factory minus true, pixels of the image.
        shift_px: [f64; 2],
    },
    /// `distorted`: the images are as the lens drew them, although the metadata call them rectified.
    Distorted,
    /// `rectified-twice`: the lens correction was applied to images that were rectified already.
    RectifiedTwice,
    /// `depth-scale=1.5%`: the sensor's depth is the true one times (1 + excess).
    DepthScale {
        /// Sensor over true, minus 1.
        excess: f64,
    },
    /// `depth-bias=2mm`: the sensor's depth is the true one plus this.
    DepthBias {
        /// Sensor minus true, metres.
        bias_m: f64,
    },
    /// `depth-zoom=0.9507`: the depth map shows a window of the image, `zoom` as wide and high and centred at the
    /// principal point; depth pixel p holds what the colour image has at c + zoom·(p − c).
    DepthZoom {
        /// Width of the window over the width of the image.
        zoom: f64,
    },
    /// `depth-shift=3px,0px`: everything in the depth map lies this far to the right of and below its place in the
    /// colour image.
    DepthShift {
        /// Depth minus colour, pixels.
        shift_px: [f64; 2],
    },
    /// `mirrored`: colour image and depth map are mirrored, left for right, as ARKit delivers them.
    Mirrored,
    /// `depth-mirrored`: the depth map alone is mirrored, left for right.
    DepthMirrored,
    /// `bent=0.8mm`: the print is wavy by this much from valley to peak; a fault of the board, not of the device.
    Bent {
        /// Highest minus lowest point, metres.
        peak_to_valley_m: f64,
    },
}

/// A fault that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FaultError {
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
    #[error("`{text}` is beyond what is simulated: take {range}")]
    Range {
        /// As given.
        text: String,
        /// What is possible.
        range: &'static str,
    },
    /// Two faults that exclude each other, or the same twice.
    #[error("`{0}` and `{1}` exclude each other; take one of them")]
    Conflict(Fault, Fault),
}

/// Names, an example with the form of the value, and what the fault does.
const KNOWN: [(&str, &str, &str); 12] = [
    ("none", "none", "nothing is wrong"),
    ("focal", "focal=6.6%", "factory focal length 6.6 % above the true one"),
    (
        "center",
        "center=4px,-2px",
        "factory principal point 4 px right of and 2 px above the true one",
    ),
    ("distorted", "distorted", "images not rectified although the metadata say so"),
    ("rectified-twice", "rectified-twice", "lens correction applied to rectified images again"),
    ("depth-scale", "depth-scale=1.5%", "depth 1.5 % too long"),
    ("depth-bias", "depth-bias=2mm", "depth 2 mm too long"),
    (
        "depth-zoom",
        "depth-zoom=0.9507",
        "depth map shows the middle 95.07 % of the image, as with ARKit",
    ),
    ("depth-shift", "depth-shift=3px,0px", "depth lies 3 px to the right of the colour image"),
    ("mirrored", "mirrored", "colour and depth mirrored left for right, as with ARKit"),
    ("depth-mirrored", "depth-mirrored", "depth alone mirrored left for right"),
    ("bent", "bent=0.8mm", "the print is wavy by 0.8 mm (the board's fault, not the device's)"),
];

fn forms() -> String {
    KNOWN.map(|(_, form, _)| form).join(", ")
}

impl Fault {
    /// Every fault as it is written, and what it does; for help texts. The first is `none`.
    pub fn known() -> impl Iterator<Item = (&'static str, &'static str)> {
        KNOWN.into_iter().map(|(_, form, words)| (form, words))
    }

    /// True where the two cannot both be.
    fn excludes(self, other: Self) -> bool {
        let streams = [self, other].map(|f| matches!(f, Self::Distorted | Self::RectifiedTwice));
        std::mem::discriminant(&self) == std::mem::discriminant(&other) || streams == [true; 2]
    }
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let (name, value) = match text.trim().split_once('=') {
            Some((name, value)) => (name.trim(), Some(value.trim())),
            None => (text.trim(), None),
        };
        let Some((name, form, _)) = KNOWN.into_iter().skip(1).find(|(known, ..)| *known == name)
        else {
            return Err(FaultError::Name(text.to_owned()));
        };
        let wrong = || FaultError::Value { text: text.to_owned(), form };
        let value = || value.ok_or_else(wrong);
        let percent = || -> Result<f64, FaultError> {
            number(value()?.strip_suffix('%').ok_or_else(wrong)?)
                .map(|p| p / 100.0)
                .ok_or_else(wrong)
        };
        let metres = || length_m(value()?).map_err(|_| wrong());
        let pixels = || -> Result<[f64; 2], FaultError> {
            let (x, y) = value()?.split_once(',').ok_or_else(wrong)?;
            let px = |text: &str| number(text.trim().strip_suffix("px")?);
            Ok([px(x).ok_or_else(wrong)?, px(y).ok_or_else(wrong)?])
        };
        let within = |fault: Self, inside: bool, range: &'static str| match inside {
            true => Ok(fault),
            false => Err(FaultError::Range { text: text.to_owned(), range }),
        };
        let small = |[x, y]: [f64; 2]| x.abs() <= 100.0 && y.abs() <= 100.0;
        match name {
            "focal" => {
                let excess = percent()?;
                within(Self::Focal { excess }, excess.abs() <= 0.3, "at most 30% up or down")
            }
            "center" => {
                let shift_px = pixels()?;
                within(Self::Center { shift_px }, small(shift_px), "at most 100 px up or down")
            }
            "depth-scale" => {
                let excess = percent()?;
                within(Self::DepthScale { excess }, excess.abs() <= 0.5, "at most 50% up or down")
            }
            "depth-bias" => {
                let bias_m = metres()?;
                within(Self::DepthBias { bias_m }, bias_m.abs() <= 0.1, "at most 100mm up or down")
            }
            "depth-zoom" => {
                let zoom = number(value()?).ok_or_else(wrong)?;
                within(Self::DepthZoom { zoom }, (0.5..=2.0).contains(&zoom), "0.5 to 2")
            }
            "depth-shift" => {
                let shift_px = pixels()?;
                within(Self::DepthShift { shift_px }, small(shift_px), "at most 100 px up or down")
            }
            "bent" => {
                let peak_to_valley_m = metres()?;
                let inside = (0.0..=5e-3).contains(&peak_to_valley_m);
                within(Self::Bent { peak_to_valley_m }, inside, "0mm to 5mm")
            }
            flag => {
                if text.contains('=') {
                    return Err(wrong());
                }
                Ok(match flag {
                    "distorted" => Self::Distorted,
                    "rectified-twice" => Self::RectifiedTwice,
                    "depth-mirrored" => Self::DepthMirrored,
                    _ => Self::Mirrored,
                })
            }
        }
    }
}

/// A finite number.
fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|n: &f64| n.is_finite())
}

impl fmt::Display for Fault {
    /// As it is read.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Twelve digits: what was typed, without the last bit of the conversion to metres.
        let short = |x: f64| format!("{x:.11e}").parse::<f64>().unwrap_or(x);
        match *self {
            Self::Focal { excess } => write!(f, "focal={}%", short(excess * 100.0)),
            Self::Center { shift_px: [x, y] } => write!(f, "center={x}px,{y}px"),
            Self::Distorted => write!(f, "distorted"),
            Self::RectifiedTwice => write!(f, "rectified-twice"),
            Self::DepthScale { excess } => write!(f, "depth-scale={}%", short(excess * 100.0)),
            Self::DepthBias { bias_m } => write!(f, "depth-bias={}mm", short(bias_m * 1000.0)),
            Self::DepthZoom { zoom } => write!(f, "depth-zoom={zoom}"),
            Self::DepthShift { shift_px: [x, y] } => write!(f, "depth-shift={x}px,{y}px"),
            Self::Mirrored => write!(f, "mirrored"),
            Self::DepthMirrored => write!(f, "depth-mirrored"),
            Self::Bent { peak_to_valley_m } => {
                write!(f, "bent={}mm", short(peak_to_valley_m * 1000.0))
            }
        }
    }
}

/// Faults that go together, each kind at most once.
#[derive(Clone, Debug, PartialEq)]
pub struct Faults(Vec<Fault>);

impl Faults {
    /// Nothing is wrong.
    pub const NONE: Self = Self(Vec::new());

    /// These faults; refused where two exclude each other.
    pub fn new(faults: impl IntoIterator<Item = Fault>) -> Result<Self, FaultError> {
        let faults: Vec<Fault> = faults.into_iter().collect();
        for (i, &fault) in faults.iter().enumerate() {
            if let Some(&other) = faults[..i].iter().find(|other| fault.excludes(**other)) {
                return Err(FaultError::Conflict(other, fault));
            }
        }
        Ok(Self(faults))
    }

    /// Reads each text as a fault; `none` is none.
    pub fn parse<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Self, FaultError> {
        let faults: Result<Vec<Fault>, FaultError> =
            texts.into_iter().filter(|text| text.trim() != "none").map(str::parse).collect();
        Self::new(faults?)
    }

    /// One after the other, as they were given.
    pub fn iter(&self) -> impl Iterator<Item = Fault> {
        self.0.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        for (form, _) in Fault::known().skip(1) {
            let fault: Fault = form.parse().unwrap();
            assert_eq!(fault.to_string(), form);
        }
        for text in
            ["focal=-0.7%", "depth-bias=-0.3mm", "depth-zoom=1", "bent=0mm", "center=0px,0.125px"]
        {
            assert_eq!(text.parse::<Fault>().unwrap().to_string(), text);
        }
        assert_eq!("depth-bias=0.2cm".parse(), Ok(Fault::DepthBias { bias_m: 0.002 }));
        assert_eq!(" focal = 6.6 % ".parse(), Ok(Fault::Focal { excess: 0.066 }));
    }

    #[test]
    fn what_cannot_be_is_refused_with_the_remedy() {
        for (text, remedy) in [
            ("vocal=3%", "focal=6.6%"),
            ("none=1", "focal=6.6%"),
            ("", "distorted"),
            ("focal", "focal=6.6%"),
            ("focal=6.6", "focal=6.6%"),
            ("focal=nan%", "focal=6.6%"),
            ("focal=60%", "30%"),
            ("depth-bias=2", "depth-bias=2mm"),
            ("depth-shift=3px", "depth-shift=3px,0px"),
            ("depth-shift=3,0", "depth-shift=3px,0px"),
            ("depth-zoom=95%", "depth-zoom=0.9507"),
            ("depth-zoom=0", "0.5 to 2"),
            ("mirrored=yes", "write mirrored"),
        ] {
            let error = text.parse::<Fault>().unwrap_err().to_string();
            assert!(error.contains(remedy), "{text}: {error}");
        }
        for texts in [["distorted", "rectified-twice"], ["focal=1%", "focal=2%"]] {
            assert!(matches!(Faults::parse(texts), Err(FaultError::Conflict(..))), "{texts:?}");
        }
        assert_eq!(Faults::parse(["none"]), Ok(Faults::NONE));
        assert_eq!(Faults::parse(["focal=1%", "mirrored"]).unwrap().iter().count(), 2);
    }
}
