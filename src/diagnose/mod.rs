//! Findings: what is wrong, by how much, how sure.
//!
//! [`diagnose`] takes a [`Case`] (what was read, seen, calibrated and compared) and gives one [`Finding`] per check.
//! A finding has a [`Code`], a [`Verdict`] under the caller's [`Tolerances`], value and sigma with [`Unit`], the
//! evidence in numbers and in a sentence, what to do, and the [`Defect`](crate::recording::Defect) it calls for.
//!
//! The rule behind every verdict, in [`Verdict::of`]: a *fault* is significant (beyond 3 σ) **and** relevant (beyond
//! the tolerance); *ok* means that a fault of relevant size would have been seen; what is neither is *unknown*, and
//! the finding says what to record to be able to tell.
//!
//! One file per finding; the text of `truedepth explain CODE` ([`Code::explanation`]) is that file's own
//! documentation.
//!
//! ```
//! use truedepth::{calibrate::Estimate, diagnose::{Code, Verdict}};
//!
//! // 6 % too long and sure of it; 6 % and anything but sure; surely within 1 %.
//! let verdict = |value, sigma| Verdict::of(Estimate { value, sigma }, 0.01);
//! assert_eq!(verdict(-0.06, 0.001), Verdict::Fault);
//! assert_eq!(verdict(-0.06, 0.030), Verdict::Unknown);
//! assert_eq!(verdict(0.002, 0.001), Verdict::Ok);
//! assert!(Code::TD201.explanation().starts_with("# TD201: focal length"));
//! ```
//!
//! Not here: pixels, pictures, and the corrections themselves: a finding names its correction, the shell applies it.

mod case;
mod code;
mod device;
mod finding;
mod inspect;
mod pair;
mod registry;

mod td101_files;
mod td102_dropped_frames;
mod td103_metadata_incomplete;
mod td104_depth_unit;
mod td105_depth_not_metric;
mod td201_focal_length;
mod td202_principal_point;
mod td203_not_rectified;
mod td204_rectified_twice;
mod td205_factory_changed;
mod td301_depth_scale;
mod td302_depth_bias;
mod td303_depth_noise;
mod td401_zoom;
mod td402_shift;
mod td403_mirrored;
mod td501_distortion_centre;
mod td502_reference_dimensions;
mod td503_intrinsics_size;
mod td504_field_of_view;

#[cfg(test)]
mod tests;

pub use case::{Case, diagnose};
pub use code::{Code, UnknownCode};
pub use device::{Device, Sensor, depth_state};
pub use finding::{Evidence, Finding, Tolerances, Unit, Verdict};
pub use inspect::{Inspection, inspect};
pub use pair::{AcrossApis, Comparison, SameApi, Side, compare, pairs};
pub use registry::{
    Api, Certainty, Entry, Identity, KnownIssue, PaperFocal, Registry, RegistryError, Sheet,
    paper_focals,
};
