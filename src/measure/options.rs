//! What front ends choose, and what they are told on the way.

use super::FrameMeasurement;
use crate::{calibrate::KnownCamera, image::Rgb};

/// Where the measured intrinsics come from.
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

/// Is told how far the job has come, and may look at images on the way. Called from any thread.
pub trait Observer: Sync {
    /// A step is done.
    fn progress(&self, progress: Progress) {
        let _ = progress;
    }

    /// A frame is going to be looked at. Whether its colour image is wanted in colour, for [`looked`](Self::looked).
    fn begins(&self, frame: usize) -> bool {
        let _ = frame;
        false
    }

    /// The colour image of a frame is decoded.
    fn decoded(&self, frame: usize) {
        let _ = frame;
    }

    /// The board was looked for in the colour image of a frame; with the image where it was wanted, so that it need not
    /// be decoded again.
    fn looked(&self, frame: usize, found: &FrameMeasurement, image: Option<&Rgb>) {
        let _ = (frame, found, image);
    }
}

/// Wants to be told nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {}
