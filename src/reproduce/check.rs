//! A printed number beside ours.

use crate::{calibrate::Estimate, math};

/// What the comparison says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Status {
    /// The same to the printed digits, or within 3 σ of what was measured.
    Agrees,
    /// Measured, and not the same.
    Differs,
    /// The printed number does not follow from the paper's own: a slip in print.
    Slip,
    /// The data are not there.
    NoData,
}

impl Status {
    /// `agrees`, `differs`, `slip` or `no_data`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Differs => "differs",
            Self::Slip => "slip",
            Self::NoData => "no_data",
        }
    }
}

/// A number as printed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Printed {
    /// Its value.
    pub value: f64,
    /// Its digits after the point.
    pub decimals: usize,
}

/// One number of the paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What it is.
    pub what: String,
    /// As the paper prints it; `None` where it prints none.
    pub printed: Option<Printed>,
    /// As recomputed (σ 0) or measured; `None` without data.
    pub ours: Option<Estimate>,
    /// Of both.
    pub unit: &'static str,
    /// The comparison.
    pub status: Status,
    /// What there is to say; may be empty.
    pub note: String,
}

/// Half a unit of the last digit, and a hair for the binary representation.
fn rounding(printed: Printed) -> f64 {
    0.5 * math::pow(10.0, -(printed.decimals as f64)) + 1e-9
}

impl Check {
    /// Recomputed from the paper's own numbers: what does not come out to the printed digits is a slip.
    pub(super) fn recomputed(
        what: String,
        printed: Printed,
        ours: f64,
        unit: &'static str,
    ) -> Self {
        let agrees = (ours - printed.value).abs() <= rounding(printed);
        let status = if agrees { Status::Agrees } else { Status::Slip };
        let ours = Some(Estimate { value: ours, sigma: 0.0 });
        Self { what, printed: Some(printed), ours, unit, status, note: String::new() }
    }

    /// Read or measured in the data.
    pub(super) fn measured(
        what: String,
        printed: Option<Printed>,
        ours: Option<Estimate>,
        unit: &'static str,
    ) -> Self {
        let status = match (printed, ours) {
            (_, None) => Status::NoData,
            (None, _) => Status::Agrees,
            (Some(printed), Some(ours)) => {
                let sigma = if ours.sigma.is_finite() { ours.sigma } else { 0.0 };
                let within = (ours.value - printed.value).abs() <= rounding(printed) + 3.0 * sigma;
                if within { Status::Agrees } else { Status::Differs }
            }
        };
        Self { what, printed, ours, unit, status, note: String::new() }
    }

    pub(super) fn noted(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Ours minus printed.
    pub fn difference(&self) -> Option<f64> {
        Some(self.ours?.value - self.printed?.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_digits_decide() {
        let printed = Printed { value: 1.20, decimals: 2 };
        let status = |ours| Check::recomputed(String::new(), printed, ours, "%").status;
        assert_eq!(
            [status(1.1951), status(1.2049), status(1.206)],
            [Status::Agrees, Status::Agrees, Status::Slip]
        );
        let measured = |value, sigma| {
            Check::measured(String::new(), Some(printed), Some(Estimate { value, sigma }), "%")
                .status
        };
        assert_eq!(measured(1.3, 0.04), Status::Agrees);
        assert_eq!(measured(1.3, 0.01), Status::Differs);
        assert_eq!(measured(1.3, f64::NAN), Status::Differs);
        assert_eq!(Check::measured(String::new(), Some(printed), None, "%").status, Status::NoData);
    }
}
