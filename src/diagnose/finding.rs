//! What a finding says.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::{Basis, Check, Code, Tolerances};
use crate::{calibrate::Estimate, recording::Defect};

/// The judgement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Unit {
    /// Percent.
    #[serde(rename = "%")]
    Percent,
    /// Pixels.
    #[serde(rename = "px")]
    Px,
    /// Millimetres.
    #[serde(rename = "mm")]
    Mm,
    /// Degrees.
    #[serde(rename = "deg")]
    Degrees,
    /// A number of things.
    #[serde(rename = "")]
    Count,
}

impl Unit {
    /// How much of the library's unit (a fraction, metres) one of it is.
    pub const fn in_library(self) -> f64 {
        match self {
            Self::Percent => 0.01,
            Self::Mm => 1e-3,
            Self::Px | Self::Degrees | Self::Count => 1.0,
        }
    }

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
    pub name: Cow<'static, str>,
    /// The number.
    pub value: f64,
    /// Its standard deviation, where it is an estimate.
    pub sigma: Option<f64>,
}

impl Evidence {
    pub(crate) const fn number(name: &'static str, value: f64) -> Self {
        Self { name: Cow::Borrowed(name), value, sigma: None }
    }

    pub(crate) const fn estimate(name: &'static str, Estimate { value, sigma }: Estimate) -> Self {
        Self { name: Cow::Borrowed(name), value, sigma: Some(sigma) }
    }
}

/// Evidence as a map from its names.
mod by_name {
    use std::{borrow::Cow, collections::BTreeMap};

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::Evidence;

    #[derive(Serialize, Deserialize)]
    struct Number {
        value: Option<f64>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        sigma: Option<f64>,
    }

    pub(super) fn serialize<S: Serializer>(
        all: &[Evidence],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_map(
            all.iter().map(|e| (&e.name, Number { value: Some(e.value), sigma: e.sigma })),
        )
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vec<Evidence>, D::Error> {
        let map = BTreeMap::<String, Number>::deserialize(from)?;
        let evidence = |(name, Number { value, sigma })| Evidence {
            name: Cow::Owned(name),
            value: Option::unwrap_or(value, f64::NAN),
            sigma,
        };
        Ok(map.into_iter().map(evidence).collect())
    }
}

/// A row of the table of quantities, as people read it. A cell without a number says `—`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// What was measured.
    pub name: String,
    /// What it is according to the factory, or ought to be.
    pub factory: String,
    /// What it is.
    pub measured: String,
    /// Where this is not the value of the finding.
    pub difference: Option<String>,
}

/// What to record to be able to tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToRecord {
    /// Views from many sides, for the focal length.
    ManySides,
    /// Views turned in the image, for the principal point.
    Turned,
    /// Views that reach into the corners, for the distortion.
    Corners,
    /// Views at several distances, for the line of depth over distance.
    Distances,
    /// Tilted views, for the place of depth against colour.
    Tilted,
    /// Any views of the board with depth.
    WithDepth,
    /// Views without glare, for noise and holes.
    Unhindered,
    /// Any sharp view of the board.
    Sharp,
    /// Metadata.
    Metadata,
}

impl ToRecord {
    /// In a sentence.
    pub const fn words(self) -> &'static str {
        match self {
            Self::ManySides => {
                "Record 20 or more frames moving round the board, tilted by 20 to 45 degrees in different directions: \
                 from fronto-parallel views alone focal length and distance cannot be told apart."
            }
            Self::Turned => {
                "Record 20 or more frames with the board tilted by 20 to 45 degrees to all sides and turned in the \
                 image by 90 degrees in some of them."
            }
            Self::Corners => {
                "Record 20 or more frames with the board tilted by 20 to 45 degrees in different directions and \
                 reaching into the corners of the image."
            }
            Self::Distances => {
                "Record the board at several distances (0.2 m to 0.5 m), 20 or more frames, tilted in different \
                 directions, so that the focal length can be measured, too."
            }
            Self::Tilted => {
                "Record 20 or more frames with the board tilted by 20 to 45 degrees to all sides, at 0.2 m to 0.4 m: \
                 depth that does not vary over the image looks the same wherever it lies."
            }
            Self::WithDepth => "Record the board at 0.2 m to 0.4 m with depth.",
            Self::Unhindered => {
                "Record the board at 0.2 m to 0.4 m, not too slantingly, without direct sunlight."
            }
            Self::Sharp => "Record frames that show the board sharp and from the front.",
            Self::Metadata => "Record with an app that saves the intrinsics.",
        }
    }
}

/// One thing that was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// What was found, in sentences with the numbers.
    pub claim: String,
    /// How it was tested, in a sentence; empty where the claim says it all.
    pub test: String,
    /// The numbers behind it.
    #[serde(with = "by_name")]
    pub evidence: Vec<Evidence>,
    /// What the person should do now. Empty where nothing is.
    pub what_to_do: String,
    /// With *unknown*: what to record to be able to tell, which `what_to_do` then says.
    pub to_record: Option<ToRecord>,
    /// What is wrong, where it could be removed: of a fault, and of a deviation that is significant though within the
    /// tolerance (*info*), which is corrected only where that is asked for.
    pub defect: Option<Defect>,
    /// What the finding rests on.
    pub basis: Basis,
    /// Its row of the table of quantities; `None` where there is no quantity to show.
    #[serde(skip)]
    pub quantity: Option<Quantity>,
}

impl Finding {
    /// Nothing known yet.
    pub(crate) fn new(code: Code, tolerances: &Tolerances) -> Self {
        let Check { unit, basis, .. } = *code.check();
        Self {
            code,
            verdict: Verdict::Unknown,
            value: None,
            sigma: None,
            unit,
            tolerance: tolerances.shown(code),
            claim: String::new(),
            test: String::new(),
            evidence: Vec::new(),
            what_to_do: String::new(),
            to_record: None,
            defect: None,
            basis,
            quantity: None,
        }
    }

    /// Nothing can be told: why, and what to record.
    pub(super) fn unknown(mut self, claim: String, to_record: ToRecord) -> Self {
        self.claim = claim;
        self.record(to_record);
        self
    }

    /// What to record to be able to tell.
    pub(super) fn record(&mut self, to_record: ToRecord) {
        to_record.words().clone_into(&mut self.what_to_do);
        self.to_record = Some(to_record);
    }

    /// The row of a quantity that is called as the check is.
    pub(super) fn show(&mut self, factory: impl Into<String>, measured: impl Into<String>) {
        self.quantity = Some(Quantity {
            name: self.title().to_owned(),
            factory: factory.into(),
            measured: measured.into(),
            difference: None,
        });
    }

    /// The deviation and its sigma, in the library's unit (a fraction, metres, pixels).
    pub(super) fn measured(&mut self, deviation: Estimate) {
        self.value = Some(deviation.value / self.unit.in_library());
        self.sigma = Some(deviation.sigma / self.unit.in_library());
    }

    /// The tolerance in words, for the end of a test.
    pub(super) fn tolerance_words(&self) -> String {
        let tolerance = self.tolerance.unwrap_or(f64::NAN);
        format!("tolerance {tolerance:.1} {}", self.unit.symbol())
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

    /// Claim and test.
    pub fn summary(&self) -> String {
        if self.test.is_empty() {
            return self.claim.clone();
        }
        format!("{} {}", self.claim, self.test)
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
