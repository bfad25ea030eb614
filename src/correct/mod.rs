//! Corrections applied: a recording in, a true one out, with provenance.
//!
//! A [`Plan`] is a set of [`Step`]s, each with its parameters: what an audit found ([`Plan::from_findings`]), a camera
//! known from elsewhere ([`Plan::from_camera`]), or faults told by the caller ([`Plan::from_faults`]). [`correct`]
//! applies it frame by frame into a [`Sink`](crate::recording::Sink), never in place: images through one resampling
//! however many steps move pixels, metadata with all the keys it does not understand, every other file as it is. It
//! hands back what was done, [`Corrected`], for `provenance.json`.
//!
//! Depth is resampled by [`Sampling::EdgeAware`] or [`Sampling::Nearest`]; neither blends a measurement with a hole or
//! across an edge. Equations and measured errors: `docs/method/correct.md`.
//!
//! ```
//! use truedepth::correct::{Plan, Sampling, Step};
//!
//! // What the paper's issue 1 asks for.
//! let plan = Plan::new(vec![Step::DepthZoom { zoom: [0.9507; 2] }], Sampling::EdgeAware)?;
//! assert!(plan.changes_depth() && !plan.changes_color());
//! assert!(Plan::new(vec![Step::DepthZoom { zoom: [0.0; 2] }], Sampling::EdgeAware).is_err());
//! # Ok::<(), truedepth::correct::Error>(())
//! ```
//!
//! Not here: what is wrong ([`diagnose`](crate::diagnose)), the spelling of `provenance.json`
//! ([`report::wire`](crate::report::wire)).

mod error;
mod job;
mod map;
mod plan;
mod straight;
mod warp;

pub use error::Error;
pub use job::{Corrected, Corrector, FileHash, Progress, correct, correct_observed};
pub use map::PixelMap;
pub use plan::{Because, Called, Lens, Mirrored, Plan, Sampling, Step, Which};
pub use straight::{BoardLine, Rectifier, Straightness, StreamState, Treatment, board_lines};
pub use warp::{ColorWarp, DepthWarp, EDGE};
