//! Everything that is measured of a recording before anything is judged, frame by frame or as a whole.
//!
//! A [`Measurer`] looks at one frame after the other: [`look`](Measurer::look) detects the board,
//! [`look_at_depth`](Measurer::look_at_depth) reads depth where it was seen, both on any thread; [`add`](Measurer::add)
//! takes what was found in order of time; [`finish`](Measurer::finish) calibrates, compares depth with the board, and
//! registers it with colour. [`measure`] is the loop over a [`Recording`](crate::recording::Recording). Images are
//! dropped as soon as they were looked at, and of frames that look alike all but some are summarised, so that memory
//! does not grow with the number of frames ([`MAX_FRAMES_IN_FULL`]).
//!
//! ```no_run
//! use truedepth::{
//!     files::Limits,
//!     measure::{Method, Silent, measure},
//!     recording::Recording,
//! };
//!
//! let recording = Recording::open("ipad", &Limits::default())?;
//! let board = recording.board.clone().ok_or("which board?")?;
//! let found = measure(&recording, board, &Method::Auto, 120, &Silent)?;
//! println!("{} frames with the board", found.n_frames_with_board());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here: verdicts ([`diagnose`](crate::diagnose)).

mod camera;
mod error;
mod frame;
mod job;
mod keep;
mod measurer;
mod options;

pub use error::Error;
pub use frame::FrameMeasurement;
pub use job::{Measurements, look_for_board, measure};
pub use keep::MAX_FRAMES_IN_FULL;
pub use measurer::{About, Measurer};
pub use options::{Method, Observer, Progress, Silent, Stage};

pub use camera::SAME_CAMERA;
