//! ChArUco corners of an image, each with its own uncertainty.
//!
//! A person sees the chessboard first and the markers in it second; so does the [`Detector`]:
//!
//! 1. `saddle`: crossings of two edges in a smoothed image;
//! 2. `lattice`: who is whose neighbour, along the edges;
//! 3. `identify` and, where motion smears the markers, `blurred`: which part of the board it is, by the joint vote of
//!    all visible markers, accepted only with a clear lead over the runner-up;
//! 4. `refine`: every corner the board should show, to sub-pixel, with its standard deviation.
//!
//! `docs/method/detect.md` has the equations, pictures of each step (made by [`Detector::trace`]), and what was
//! measured. The cost is one pass over the pixels at half resolution and about 3 µs per corner: half a millisecond for
//! a sharp picture of 640 × 480 pixels. Coarser and finer levels are tried only where no board is found.
//!
//! An [`Observation`] holds what was found *and* what was not taken, with the reason. The detector may miss a corner;
//! it does not invent one: later steps drop, they never relabel.
//!
//! ```
//! use truedepth::{board::CharucoBoard, detect::Detector, image::Gray};
//!
//! let board: CharucoBoard = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse()?;
//! let detector = Detector::new(&board);
//! let nothing = detector.detect(&Gray::new(640, 480, vec![0; 640 * 480]));
//! assert!(nothing.corners.is_empty() && nothing.identity.is_none());
//! # Ok::<(), truedepth::board::Error>(())
//! ```
//!
//! Not here: camera models and poses. Nothing below knows a focal length.

mod blurred;
mod detector;
mod identify;
mod lattice;
mod map;
mod pyramid;
mod refine;
mod saddle;
mod trace;
mod window;

pub use detector::Detector;
pub use trace::Trace;

use crate::{
    board::{CharucoBoard, Layout},
    geom::Pixel,
};

/// What was seen of a board in one image.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Observation {
    /// Corners, by ascending id. Empty where no board was identified.
    pub corners: Vec<Corner>,
    /// How the board was told from all others; `None` where it was not.
    pub identity: Option<Identity>,
    /// Candidates that were not taken, with the reason.
    #[serde(rename = "rejected")]
    pub rejects: Vec<Reject>,
}

/// Where corners lie on the board, in squares from its outer corner, and in the image.
pub(crate) fn cells_and_pixels(board: &CharucoBoard, corners: &[Corner]) -> [Vec<Pixel>; 2] {
    let cell = |corner: &Corner| {
        let (column, row) = board.corner_cell(corner.id);
        Pixel::new(column as f64 + 1.0, row as f64 + 1.0)
    };
    [corners.iter().map(cell).collect(), corners.iter().map(|corner| corner.pixel).collect()]
}

/// One inner corner of the board.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Corner {
    /// Id as [`CharucoBoard::corner`](crate::board::CharucoBoard::corner) counts.
    pub id: usize,
    /// Where it lies.
    #[serde(flatten)]
    pub pixel: Pixel,
    /// Standard deviation of each coordinate, pixels.
    pub sigma_px: f64,
}

/// How the board was identified.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Identity {
    /// Which squares are white.
    pub layout: Layout,
    /// The image shows the board mirrored (ids are still those of the board).
    pub mirrored: bool,
    /// Black and white are exchanged on the print.
    pub inverted: bool,
    /// Ids of the markers whose bits voted, ascending. Markers of the board that are hidden, out of sight or too faint
    /// are not among them.
    #[serde(rename = "marker_ids")]
    pub markers: Vec<usize>,
    /// Lead over the runner-up placement, as a log-likelihood ratio in nats.
    #[serde(rename = "margin_nats")]
    pub margin: f64,
}

/// A candidate that was not taken.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Reject {
    /// Where.
    #[serde(flatten)]
    pub pixel: Pixel,
    /// Why.
    pub reason: Reason,
}

/// Why a candidate was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[non_exhaustive]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// A lattice without anything like a marker in its squares.
    NoMarkers,
    /// A lattice whose markers do not agree on one place of the board.
    Ambiguous,
    /// A lattice beside the one that was identified: another board, or a part cut off from it.
    SecondLattice,
    /// A node of the lattice where the board has no corner.
    OffBoard,
    /// The board has a corner here, the image shows no crossing of two edges.
    NoCrossing,
    /// A crossing too far from where its neighbours say the corner is.
    OffLattice,
    /// A crossing too uncertain to be of use.
    Uncertain,
}

impl Reason {
    /// One word or two, as the JSON writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoMarkers => "no_markers",
            Self::Ambiguous => "ambiguous",
            Self::SecondLattice => "second_lattice",
            Self::OffBoard => "off_board",
            Self::NoCrossing => "no_crossing",
            Self::OffLattice => "off_lattice",
            Self::Uncertain => "uncertain",
        }
    }
}
