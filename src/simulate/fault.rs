//! What is wrong with a simulated recording.

use crate::{
    board::length_m,
    recording::{Defect, DefectError},
};

/// What is wrong with a simulated recording, and with the print of the board.
#[derive(Clone, Debug, PartialEq)]
pub struct Faults {
    /// Of the recording, each kind at most once.
    defects: Vec<Defect>,
    /// Highest minus lowest point of a wavy print, metres.
    pub(super) bent_m: f64,
}

const BENT: &str = "bent=0.8mm";

impl Faults {
    /// Nothing is wrong.
    pub const NONE: Self = Self { defects: Vec::new(), bent_m: 0.0 };

    /// These defects, with a flat print; refused where two exclude each other, or where no view of the board is left.
    pub fn new(defects: impl IntoIterator<Item = Defect>) -> Result<Self, DefectError> {
        let defects: Vec<Defect> = defects.into_iter().collect();
        Defect::check(&defects)?;
        for defect in &defects {
            let range = match defect {
                Defect::Focal { ratio } if !(0.7..=1.3).contains(ratio) => "-30% to 30%",
                Defect::Center { shift_px } if shift_px.iter().any(|px| px.abs() > 100.0) => {
                    "at most 100 px up or down"
                }
                // Beyond, the principal point lies where no reader believes it.
                Defect::IntrinsicsScale { factor }
                    if factor.iter().any(|f| !(0.7..=2.0).contains(f)) =>
                {
                    "0.7 to 2"
                }
                _ => continue,
            };
            return Err(DefectError::Range { text: defect.to_string(), range });
        }
        Ok(Self { defects, bent_m: 0.0 })
    }

    /// Reads each text as a [`Defect`]; `none` is none, and `bent=0.8mm` a print that is wavy by this much.
    pub fn parse<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Self, DefectError> {
        let (mut defects, mut bent_m) = (Vec::new(), 0.0);
        for text in texts {
            match text.trim().split_once('=') {
                Some(("bent", value)) => {
                    bent_m = length_m(value)
                        .map_err(|_| DefectError::Value { text: text.to_owned(), form: BENT })?;
                    if !(0.0..=5e-3).contains(&bent_m) {
                        return Err(DefectError::Range {
                            text: text.to_owned(),
                            range: "0mm to 5mm",
                        });
                    }
                }
                None if text.trim() == "none" => {}
                _ => defects.push(text.parse()?),
            }
        }
        Ok(Self { bent_m, ..Self::new(defects)? })
    }

    /// Every fault as it is written, and what it does; for help texts. The first is `none`.
    pub fn known() -> impl Iterator<Item = (&'static str, &'static str)> {
        let bent = (BENT, "the print is wavy by 0.8 mm (the board's fault, not the device's)");
        [("none", "nothing is wrong")].into_iter().chain(Defect::known()).chain([bent])
    }

    /// What is wrong with the recording, as it was given.
    pub fn defects(&self) -> &[Defect] {
        &self.defects
    }

    /// All of it, as it is read.
    pub(super) fn texts(&self) -> Vec<String> {
        let bent_mm = format!("{:.11e}", 1e3 * self.bent_m).parse().unwrap_or(1e3 * self.bent_m);
        let bent = (self.bent_m > 0.0).then(|| format!("bent={bent_mm}mm"));
        self.defects.iter().map(ToString::to_string).chain(bent).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_print_is_no_defect_of_the_recording() {
        let faults = Faults::parse(["focal=1%", "bent=0.8mm", "none", "mirrored"]).unwrap();
        assert_eq!(faults.texts(), ["focal=1%", "mirrored", "bent=0.8mm"]);
        assert_eq!(Faults::parse(["none"]), Ok(Faults::NONE));
        for (text, remedy) in [
            ("bent=6mm", "0mm to 5mm"),
            ("focal=60%", "30%"),
            ("bent=2", BENT),
            ("bent", "focal=6.6%"),
            ("none=1", "focal"),
        ] {
            let error = Faults::parse([text]).unwrap_err().to_string();
            assert!(error.contains(remedy), "{text}: {error}");
        }
        assert!(matches!(
            Faults::parse(["distorted", "rectified-twice"]),
            Err(DefectError::Conflict(..))
        ));
    }
}
