//! What a finding says.

use super::Code;
use crate::{calibrate::Estimate, recording::Defect};

/// The judgement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Verdict {
    /// Significant and relevant: the data are wrong.
    Fault,
    /// Not wrong by a number, but it will hurt whoever does not know.
    Warning,
    /// Cannot tell from this recording.
    Unknown,
    /// Significant, but within the tolerance; or a fact worth knowing.
    Info,
    /// A fault of relevant size would have been seen.
    Ok,
}

impl Verdict {
    /// The verdict on a deviation (0 = true) with its sigma under a tolerance, all in one unit.
    ///
    /// ```text
    /// |v| > 3σ and |v| > tolerance        fault
    /// |v| + 2σ ≤ tolerance                info where |v| > 3σ, ok otherwise
    /// anything else                       unknown
    /// ```
    ///
    /// A deviation within the tolerance whose interval reaches beyond it is *unknown*, too: "ok" must mean that a fault
    /// would have been seen. Two sigmas make that sure to 97.7 %, since only one side counts. What is not a number is
    /// *unknown*.
    pub fn of(deviation: Estimate, tolerance: f64) -> Self {
        let (size, sigma) = (deviation.value.abs(), deviation.sigma);
        let significant = size > 3.0 * sigma;
        if significant && size > tolerance {
            Self::Fault
        } else if size + 2.0 * sigma <= tolerance {
            if significant { Self::Info } else { Self::Ok }
        } else {
            Self::Unknown
        }
    }

    /// `fault`, `warning`, `unknown`, `info` or `ok`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fault => "fault",
            Self::Warning => "warning",
            Self::Unknown => "unknown",
            Self::Info => "info",
            Self::Ok => "ok",
        }
    }
}

/// What the value of a finding counts. Findings speak to people: lengths are millimetres here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unit {
    /// Percent.
    Percent,
    /// Pixels.
    Px,
    /// Millimetres.
    Mm,
    /// Degrees.
    Degrees,
    /// A number of things.
    Count,
}

impl Unit {
    /// `%`, `px`, `mm`, `deg` or nothing: stable, for machines and people.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Percent => "%",
            Self::Px => "px",
            Self::Mm => "mm",
            Self::Degrees => "deg",
            Self::Count => "",
        }
    }
}

/// A number that speaks for the verdict.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Stable name in the style of `factory_focal_px`; carries the unit.
    pub name: &'static str,
    /// The number.
    pub value: f64,
    /// Its standard deviation, where it is an estimate.
    pub sigma: Option<f64>,
}

/// One thing that was checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Which check.
    pub code: Code,
    /// The judgement.
    pub verdict: Verdict,
    /// What was measured: the deviation from what ought to be, in `unit`. `None` where nothing could be measured.
    pub value: Option<f64>,
    /// Standard deviation of `value`. `None` where the value is no estimate (metadata, counts).
    pub sigma: Option<f64>,
    /// Unit of value, sigma and tolerance.
    pub unit: Unit,
    /// Beyond this a significant deviation is a fault; `None` where the check knows no tolerance.
    pub tolerance: Option<f64>,
    /// What was found, in one sentence with the numbers and the test that was applied.
    pub summary: String,
    /// The numbers behind it.
    pub evidence: Vec<Evidence>,
    /// What the person should do now; with *unknown*, what to record to be able to tell. Empty where nothing is.
    pub what_to_do: String,
    /// What is wrong, where it could be removed: of a fault, and of a deviation that is significant though within the
    /// tolerance (*info*), which is corrected only where that is asked for.
    pub defect: Option<Defect>,
}

impl Evidence {
    pub(super) const fn number(name: &'static str, value: f64) -> Self {
        Self { name, value, sigma: None }
    }

    pub(super) const fn estimate(name: &'static str, Estimate { value, sigma }: Estimate) -> Self {
        Self { name, value, sigma: Some(sigma) }
    }
}

impl Finding {
    /// Nothing known yet.
    pub(crate) const fn new(code: Code, unit: Unit) -> Self {
        Self {
            code,
            verdict: Verdict::Unknown,
            value: None,
            sigma: None,
            unit,
            tolerance: None,
            summary: String::new(),
            evidence: Vec::new(),
            what_to_do: String::new(),
            defect: None,
        }
    }

    /// Names the defect where there is one for sure: a fault, or a deviation that is significant though within the
    /// tolerance.
    pub(super) fn name_if_significant(&mut self, defect: Defect) {
        if matches!(self.verdict, Verdict::Fault | Verdict::Info) {
            self.defect = Some(defect);
        }
    }

    /// A few words that name the check, e.g. `Focal length`.
    pub fn title(&self) -> &'static str {
        self.code.title()
    }
}

/// What still counts as true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Focal length against the factory's, fraction (0.01 = 1 %).
    pub focal: f64,
    /// Depth scale, fraction.
    pub depth_scale: f64,
    /// Depth bias, metres.
    pub depth_bias_m: f64,
    /// Residual lens distortion at the corner of the image, pixels.
    pub distortion_px: f64,
    /// Principal point against the factory's, along either axis, pixels.
    pub principal_point_px: f64,
    /// Zoom of depth against colour, fraction.
    pub zoom: f64,
    /// Shift of depth against colour, along either axis, pixels.
    pub shift_px: f64,
}

impl Default for Tolerances {
    /// 1 % for focal length and depth scale (at 0.3 m, 3 mm: the sensor's own noise), 3 mm for the bias for the same
    /// reason, 1 px for distortion (a straight line is then still straight to the eye); 1 % for the zoom (3 px at the
    /// image's edge) and 1 px for the shift: depth then belongs to its pixel or the next; 2 px for the principal
    /// point, which calibrations determine worst and lenses move by a pixel when they focus.
    fn default() -> Self {
        Self {
            focal: 0.01,
            depth_scale: 0.01,
            depth_bias_m: 0.003,
            distortion_px: 1.0,
            principal_point_px: 2.0,
            zoom: 0.01,
            shift_px: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule() {
        for (value, sigma, expected) in [
            (-0.06, 0.002, Verdict::Fault),
            (0.06, 0.03, Verdict::Unknown),  // relevant, but uncertain
            (0.004, 0.001, Verdict::Info),   // significant, but small, and surely small
            (0.001, 0.001, Verdict::Ok),     // a fault would have been seen
            (0.001, 0.02, Verdict::Unknown), // a fault could hide
            (0.009, 0.001, Verdict::Unknown),
            (f64::NAN, 0.001, Verdict::Unknown),
            (0.0, f64::INFINITY, Verdict::Unknown),
        ] {
            assert_eq!(Verdict::of(Estimate { value, sigma }, 0.01), expected, "{value} ± {sigma}");
        }
    }
}
