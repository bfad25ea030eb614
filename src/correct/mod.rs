//! Corrections applied: a recording in, a true one out, with provenance.
//!
//! A [`Plan`] is a list of [`Defect`](crate::recording::Defect)s to remove, each with a [`Reason`]: what an audit found
//! ([`Plan::of_audit`]), a camera known from elsewhere ([`Plan::of_camera`]), or what the caller names. [`correct`]
//! applies it frame by frame into an [`Output`](crate::files::Output), never in place: images through one resampling
//! however many steps move pixels, metadata with all the keys it does not understand, every other file as it is. It
//! hands back what was done, [`Corrected`], for `provenance.json`.
//!
//! Depth is resampled by [`Sampling::EdgeAware`] or [`Sampling::Nearest`]; neither blends a measurement with a hole or
//! across an edge. Equations and measured errors: `docs/method/correct.md`.
//!
//! ```
//! use truedepth::{correct::Plan, recording::Defect};
//!
//! // What the paper's issue 1 asks for.
//! let plan = Plan::given(&["depth-zoom=0.9507".parse()?])?;
//! assert!(plan.changes_depth() && !plan.changes_color());
//! assert!(Plan::given(&[Defect::DepthZoom { zoom: [0.0; 2] }]).is_err());
//! # Ok::<(), truedepth::correct::Error>(())
//! ```
//!
//! Not here: what is wrong ([`diagnose`](crate::diagnose)), the spelling of `provenance.json`
//! ([`wire`](crate::wire)).

mod error;
mod job;
mod map;
mod plan;
mod straight;
mod warp;

pub use error::Error;
pub use job::{Corrected, Corrector, FileHash, Progress, correct, correct_observed};
pub use map::PixelMap;
pub use plan::{Plan, Reason, Sampling, Selection, Step};
pub use straight::{BoardLine, Rectifier, Straightness, Treatment, board_lines};
pub use warp::{ColorWarp, DepthWarp, EDGE};
