//! What still counts as true: the checks' own tolerances, and what the caller makes of them.

use std::str::FromStr;

use super::{Code, Tolerance};

/// What still counts as true, for every check that has a tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// By [`Code`], in the unit of the check.
    shown: [Option<f64>; Code::ALL.len()],
}

/// A text that sets no tolerance.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write one of {}", Tolerances::defaults())]
pub struct ToleranceError;

impl Tolerances {
    /// Of a check, in the library's unit (a fraction, metres, pixels).
    ///
    /// Panics: the check has none.
    pub(super) fn of(&self, code: Code) -> f64 {
        let shown = self.shown(code).expect("a check asks for its own tolerance, and states one");
        shown * code.check().unit.in_library()
    }

    /// Of a check, in its unit; `None` where it has none.
    pub fn shown(&self, code: Code) -> Option<f64> {
        self.shown[code as usize]
    }

    /// All that can be set, as they are written, with the defaults: `focal=1%, ...`.
    pub fn defaults() -> String {
        let mut texts: Vec<String> = Vec::new();
        for code in Code::ALL {
            if let Some(Tolerance { name: Some(name), default }) = code.check().tolerance {
                let text = format!("{name}={default}{}", code.check().unit.symbol());
                if !texts.contains(&text) {
                    texts.push(text);
                }
            }
        }
        texts.join(", ")
    }

    /// As these, with what a text like `focal=0.5%` says.
    pub fn with(mut self, text: &str) -> Result<Self, ToleranceError> {
        let (name, value) = text.split_once('=').ok_or(ToleranceError)?;
        let mut is_known = false;
        for &code in Code::ALL {
            if code.check().tolerance.is_some_and(|t| t.name == Some(name.trim())) {
                let number = value.trim().strip_suffix(code.check().unit.symbol());
                let number = number.and_then(|n| f64::from_str(n.trim()).ok());
                let valid = number.filter(|n| n.is_finite() && *n >= 0.0);
                self.shown[code as usize] = Some(valid.ok_or(ToleranceError)?);
                is_known = true;
            }
        }
        if is_known { Ok(self) } else { Err(ToleranceError) }
    }
}

impl Default for Tolerances {
    /// 1 % for focal length and depth scale (at 0.3 m, 3 mm: the sensor's own noise), 3 mm for the bias for the same
    /// reason, 1 px for distortion (a straight line is then still straight to the eye); 1 % for the zoom (3 px at the
    /// image's edge) and 1 px for the shift: depth then belongs to its pixel or the next; 2 px for the principal
    /// point, which calibrations determine worst and lenses move by a pixel when they focus.
    fn default() -> Self {
        let default = |code: Code| code.check().tolerance.map(|tolerance| tolerance.default);
        Self { shown: std::array::from_fn(|i| default(Code::ALL[i])) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_counts() {
        let usual = Tolerances::default();
        assert_eq!((usual.of(Code::TD201), usual.of(Code::TD302)), (0.01, 0.003));
        assert_eq!((usual.shown(Code::TD302), usual.shown(Code::TD101)), (Some(3.0), None));
        let set = usual.with("focal=0.5%").unwrap().with("distortion=2 px").unwrap();
        assert_eq!((set.of(Code::TD201), set.of(Code::TD301)), (0.005, 0.01));
        assert_eq!((set.of(Code::TD203), set.of(Code::TD204)), (2.0, 2.0));
        for text in ["focal", "focal=1", "focal=-1%", "focal=x%", "depth-bias=3px", "vocal=1%"] {
            let error = usual.with(text).unwrap_err().to_string();
            assert!(error.contains("focal=1%, principal-point=2px, distortion=1px"), "{error}");
        }
    }
}
