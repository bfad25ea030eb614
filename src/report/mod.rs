//! What leaves the library for readers: HTML, SVG, and the words for a terminal.
//!
//! An [`Audit`](crate::audit::Audit) leaves in three forms that say the same. [`wire`](crate::wire) is the versioned
//! form for programs; [`summary`] is what a person reads in ten seconds on a terminal, as lines of
//! [`Span`]s with a [`Tone`] each ([`overview`]: several recordings beside each other); [`page`] is one HTML file with
//! the verdicts first and the evidence behind them,
//! with the recording's [`Pictures`]: photos ([`Photo`]) with what the detector saw in them ([`Overlay`]), and a few
//! frames with their depth ([`Closeup`]) to lay over each other and to turn in space.
//! [`sheet_pdf`], [`sheet_svg`] and [`sheet_png`] are the printed target.
//!
//! The page loads nothing from anywhere, and every string that came out of a file is escaped on the way into it.
//! Nothing here judges: words, numbers and verdicts come from [`diagnose`](crate::diagnose).
//!
//! ```
//! use truedepth::report::{Tone, Typed, summary};
//!
//! # fn show(audit: &truedepth::audit::Audit) {
//! for line in summary(audit, &Typed::of(audit), 100) {
//!     for span in line.spans {
//!         print!("{}", if span.tone == Tone::Bad { span.text.to_uppercase() } else { span.text });
//!     }
//!     println!();
//! }
//! # }
//! ```
//!
//! Not here: files (callers write what they are given), colours of a terminal, verdicts.

mod depth_pictures;
mod depth_style;
mod documents;
mod drawing;
mod error;
mod figures;
mod frames;
mod html;
mod lens_pictures;
mod next;
mod overlay;
mod paper;
mod photo;
mod pictures;
mod sheet;
mod svg;
mod text;
mod words;

#[cfg(test)]
mod sample;

pub use depth_pictures::{After, Animation, DepthPictures, Drawn, DrawnFrame, Flip, Range};
pub use depth_style::{DepthStyle, Shown, depth_range_m};
pub use documents::{OverlayDocument, UndistortDocument};
pub use error::Error;
pub use figures::FIGURES;
pub use html::page;
pub use lens_pictures::{LensDrawn, LensFrame, LensPictures, state_in_words};
pub use next::Typed;
pub use overlay::Overlay;
pub use paper::{PaperPictures, check_cells, paper_page};
pub use photo::{Photo, PhotoSize};
pub use pictures::{Closeup, Pictures, Thumbnails};
pub use sheet::{sheet_image, sheet_pdf, sheet_png, sheet_svg};
pub use text::{Line, Overview, Span, Tone, overview, summary};
