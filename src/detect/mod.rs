//! ChArUco corners of an image, each with its own uncertainty. (skeleton: types only)

use crate::{
    board::{CharucoBoard, Layout},
    geom::Pixel,
    image::Gray,
};

/// What was seen of a board in one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Corners, by ascending id. Empty where no board was identified.
    pub corners: Vec<Corner>,
    /// How the board was told from all others; `None` where it was not.
    pub identity: Option<Identity>,
    /// Candidates that were not taken, with the reason.
    pub rejects: Vec<Reject>,
}

/// One inner corner of the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Id as [`CharucoBoard::corner`] counts.
    pub id: usize,
    /// Where it lies.
    pub pixel: Pixel,
    /// Standard deviation of each coordinate, pixels.
    pub sigma_px: f64,
}

/// How the board was identified.
#[derive(Clone, Debug, PartialEq)]
pub struct Identity {
    /// Which squares are white.
    pub layout: Layout,
    /// The image shows the board mirrored (ids are still those of the board).
    pub mirrored: bool,
    /// Black and white are exchanged on the print.
    pub inverted: bool,
    /// Markers whose bits voted.
    pub n_markers: usize,
    /// Lead over the runner-up placement, as a log-likelihood ratio in nats.
    pub margin: f64,
}

/// A candidate that was not taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Reject {
    /// Where.
    pub pixel: Pixel,
    /// Why.
    pub reason: Reason,
}

/// Why a candidate was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// skeleton
    OffLattice,
}

/// Finds a board in images.
#[derive(Clone, Debug)]
pub struct Detector {
    board: CharucoBoard,
}

impl Detector {
    /// A detector for this board; where the board's layout is not given it is found from the image.
    pub fn new(board: &CharucoBoard) -> Self {
        Self { board: board.clone() }
    }

    /// The board's corners in `image`. May miss, does not invent.
    pub fn detect(&self, _image: &Gray) -> Observation {
        let _ = &self.board;
        Observation { corners: Vec::new(), identity: None, rejects: Vec::new() }
    }
}
