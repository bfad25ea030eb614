//! The main job: a recording in, everything that can be known of it out.
//!
//! [`audit`] detects the board in every frame, calibrates, compares the sensor's depth with the board's under the
//! factory's and under the own intrinsics, and judges. Its [`Audit`] holds all that the shells show. Images are
//! decoded, looked at and dropped one by one, so that memory does not grow with the number of frames; with the
//! feature `parallel` frames are looked at on all cores, with the same result bit by bit.
//!
//! [`audit_seen`] does the same from corners and depth maps that are known already.
//!
//! A recording in which no board is seen is not an error: the findings then say "cannot tell", and what to record.
//!
//! ```no_run
//! use truedepth::{
//!     audit::{Method, Options, audit},
//!     recording::{Limits, Recording},
//! };
//!
//! let recording = Recording::open("ipad", &Limits::default())?;
//! let audit = audit(&recording, &Options::new(Method::Auto))?;
//! for finding in &audit.findings {
//!     println!("{} {}: {}", finding.code, finding.verdict.name(), finding.summary);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here: reading arguments, printing, time; pictures and files ([`report`](crate::report)).

mod conclude;
mod job;
mod options;

pub use conclude::{Seen, audit_seen};
pub use job::{Audit, Error, FrameAudit, Witness, audit, audit_observed, audit_watched};
pub use options::{Method, Options, Progress, Stage};
