//! The checks: what is fixed of each, under a stable code.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

use super::Unit;

/// What is fixed of a check; every check's file has one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// A few words that name it, e.g. `Focal length`.
    pub title: &'static str,
    /// Of its value, sigma and tolerance.
    pub unit: Unit,
    /// What it rests on.
    pub basis: Basis,
    /// Beyond it a significant deviation is a fault; `None` where the check knows none.
    pub tolerance: Option<Tolerance>,
}

/// What still counts as true unless the caller says otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// As `--tolerance NAME=VALUE` has it; `None` where it cannot be set. Checks of one name have one tolerance.
    pub name: Option<&'static str>,
    /// In the unit of the check.
    pub default: f64,
}

impl Tolerance {
    /// One that the caller may set.
    pub(super) const fn named(name: &'static str, default: f64) -> Option<Self> {
        Some(Self { name: Some(name), default })
    }

    /// One that is the same for all.
    pub(super) const fn fixed(default: f64) -> Option<Self> {
        Some(Self { name: None, default })
    }
}

/// What a check rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// The files and their metadata.
    Metadata,
    /// Frames in which the board was seen.
    Board,
    /// The views of the calibration.
    Views,
    /// Frames with depth on the board, under the estimated camera.
    Depth,
}

impl Basis {
    /// True where nothing can be told without the estimated camera.
    pub const fn needs_camera(self) -> bool {
        matches!(self, Self::Views | Self::Depth)
    }
}

/// A code and the file of its check, which has its explanation beside it: all that registers a check, in order.
macro_rules! checks {
    ($($code:ident $file:ident;)*) => {
        $(mod $file;)*

        /// A check. Codes are stable: TD1xx the recording, TD2xx the camera, TD3xx depth, TD4xx alignment, TD5xx
        /// metadata.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        #[non_exhaustive]
        pub enum Code {
            $(#[doc = concat!("`", stringify!($file), "`")] $code,)*
        }

        impl Code {
            /// All of them, in order.
            pub const ALL: &[Self] = &[$(Self::$code),*];

            /// `TD201` and the like.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$code => stringify!($code),)* }
            }

            /// What is fixed of it.
            pub const fn check(self) -> &'static Check {
                match self { $(Self::$code => &$file::CHECK,)* }
            }

            const fn markdown(self) -> &'static str {
                match self { $(Self::$code => include_str!(concat!(stringify!($file), ".md")),)* }
            }
        }

        /// One finding per check, in order of their codes.
        fn findings(case: &Case<'_>, known: &Known) -> Vec<Finding> {
            vec![$($file::check(case, known)),*]
        }
    };
}
pub(super) use checks;

use super::Code;

impl Code {
    /// A few words that name the check.
    pub const fn title(self) -> &'static str {
        self.check().title
    }

    /// What the check measures, why it matters, how, and what to do, with its tolerance: the Markdown behind
    /// `truedepth explain`.
    pub fn explanation(self) -> String {
        let markdown = self.markdown();
        let (title, rest) = markdown.split_once('\n').unwrap_or((markdown, ""));
        let Check { unit, tolerance, .. } = self.check();
        let tolerance = match tolerance {
            None => String::new(),
            Some(Tolerance { name: None, default }) => {
                format!("\nTolerance: {default} {}.\n", unit.symbol())
            }
            Some(Tolerance { name: Some(name), default }) => format!(
                "\nTolerance: {default} {}, unless `truedepth audit --tolerance {name}=VALUE` says otherwise.\n",
                unit.symbol()
            ),
        };
        format!("{title}\n{tolerance}{rest}")
    }
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
        assert!(Code::TD201.explanation().contains("Tolerance: 1 %, unless"));
        for code in Code::ALL {
            let text = code.explanation();
            assert!(text.starts_with(&format!("# {code}: ")), "{text}");
            let headings: Vec<&str> = text.lines().filter(|l| l.starts_with("## ")).collect();
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
