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
pub(crate) mod numbers;
mod pair;
mod registry;
mod tolerances;

#[cfg(test)]
mod tests;

code::checks! {
    TD101 td101_files;
    TD102 td102_dropped_frames;
    TD103 td103_metadata_incomplete;
    TD104 td104_depth_unit;
    TD105 td105_depth_not_metric;
    TD201 td201_focal_length;
    TD202 td202_principal_point;
    TD203 td203_not_rectified;
    TD204 td204_rectified_twice;
    TD205 td205_factory_changed;
    TD301 td301_depth_scale;
    TD302 td302_depth_bias;
    TD303 td303_depth_noise;
    TD401 td401_zoom;
    TD402 td402_shift;
    TD403 td403_mirrored;
    TD501 td501_distortion_centre;
    TD502 td502_reference_dimensions;
    TD503 td503_intrinsics_size;
    TD504 td504_field_of_view;
}

use case::Known;

pub use case::{Case, diagnose};
pub use code::{Basis, Check, Tolerance, UnknownCode};
pub use device::{Device, Sensor, depth_state};
pub use finding::{Evidence, Finding, Quantity, ToRecord, Unit, Verdict};
pub use inspect::{Inspection, inspect};
pub use pair::{AcrossApis, Comparison, SameApi, Side, compare, pairs};
pub use registry::{
    Api, Certainty, Entry, Identity, KnownIssue, PaperFocal, Registry, RegistryError, Sheet,
    paper_focals,
};
pub use tolerances::{ToleranceError, Tolerances};
