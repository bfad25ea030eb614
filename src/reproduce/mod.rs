//! The paper (arXiv:2201.10865), reproduced: every number and figure that its published data allow, beside the printed.
//!
//! [`reproduce`] takes the recordings that were found ([`Data`]) and gives a [`Reproduction`]: [`Section`]s of
//! [`Check`]s, each with the printed number, ours and a [`Status`]; the depth comparisons behind figure 5 and the
//! straightness behind figure 7; and what is [`Missing`], with how to get it. What follows from the paper's own numbers
//! is recomputed also without any data, and where it does not come out to the printed digits that is a
//! [`Status::Slip`].
//!
//! ```
//! use truedepth::reproduce::{Status, reproduce};
//!
//! let paper = reproduce("nowhere", Vec::new(), &mut |_| ())?;
//! let worked = &paper.sections[0].checks;
//! assert!(worked.iter().all(|check| check.status == Status::Agrees));
//! assert!(paper.missing.iter().any(|missing| missing.how.contains("git clone")));
//! # Ok::<(), truedepth::measure::Error>(())
//! ```
//!
//! Not here: pages and pictures ([`report`](crate::report)), looking for recordings
//! ([`recording`](crate::recording)).

mod check;
mod data;
mod job;
mod paper;
mod recompute;

pub use check::{Check, Printed, Status};
pub use data::{Data, Set};
pub use job::{DepthEvaluation, Lens, Reproduction, reproduce};
pub use paper::{FOCAL, FocalRow, PUBLISHED, Published};

/// Numbers that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Names it in files: stable.
    pub id: &'static str,
    /// For people.
    pub title: &'static str,
    /// What it shows.
    pub lead: String,
    /// Its numbers.
    pub checks: Vec<Check>,
}

/// Something of the paper that cannot be reproduced here.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Missing {
    /// What.
    pub what: String,
    /// How to get it.
    pub how: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All slips that the paper's own numbers give away, and no other.
    #[test]
    fn slips() {
        let paper = reproduce("nowhere", Vec::new(), &mut |_| ()).unwrap();
        let slips: Vec<&str> = paper
            .sections
            .iter()
            .flat_map(|section| &section.checks)
            .filter(|check| check.status == Status::Slip)
            .map(|check| check.what.split(':').next().unwrap_or_default())
            .collect();
        assert_eq!(
            slips,
            [
                "iPhone 11 Pro V2",
                "iPad 12.9\" 4gen V1",
                "iPad 12.9\" 4gen V2",
                "ipad-11-3gen/v1",
                "ipad-11-3gen/v2",
                "ipad-12.9-5gen/ios14",
                "ipad-12.9-5gen/ios15",
                "ipad-12.9-5gen/ios14/av",
                "ipad-12.9-5gen/ios15/av",
                "iphone-11-pro/ios14/av",
            ]
        );
    }
}
