//! What the shells choose, and what they are told on the way.

use crate::{
    board::CharucoBoard,
    calibrate::{KnownCamera, MAX_VIEWS},
    diagnose::Tolerances,
};

/// Where the own intrinsics come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// As the paper: one focal length, everything else as the factory says, views on a 4 cm grid, at least 9 corners.
    Paper,
    /// The camera model that predicts held-out corners best.
    Auto,
    /// A camera known from elsewhere; nothing is calibrated.
    Given(Box<KnownCamera>),
}

impl Method {
    /// `paper`, `auto` or `given`: stable, for machines.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Auto => "auto",
            Self::Given(_) => "given",
        }
    }
}

/// Choices of an audit.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where the own intrinsics come from.
    pub method: Method,
    /// The board, where the recording does not tell or tells wrong; goes before the recording's own.
    pub board: Option<CharucoBoard>,
    /// What still counts as true.
    pub tolerances: Tolerances,
    /// Calibrate from so many views at most, as [`calibrate_from`](crate::calibrate::calibrate_from).
    pub max_views: usize,
}

impl Options {
    /// This method, the recording's board, default tolerances, views as many as calibrations take.
    pub fn new(method: Method) -> Self {
        Self { method, board: None, tolerances: Tolerances::default(), max_views: MAX_VIEWS }
    }
}

/// A part of the job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Images are decoded and corners detected; counted in frames.
    Detect,
    /// Intrinsics are estimated; one step.
    Calibrate,
    /// Depth is compared and findings are made; one step.
    Judge,
}

impl Stage {
    /// What is going on, for a progress bar: `detecting`, `calibrating`, `judging`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Detect => "detecting",
            Self::Calibrate => "calibrating",
            Self::Judge => "judging",
        }
    }
}

/// How far a stage has come. With several threads reports may arrive out of order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Which part of the job.
    pub stage: Stage,
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}
