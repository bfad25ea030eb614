//! Is the depth map mirrored against the colour image?

use super::{Patches, corner_on};
use crate::{
    board::CharucoBoard,
    calibrate::BoardSurface,
    pose::View,
    solve::{mad_sigma, median},
};

/// Depth at a corner of the board, read where the colour image shows the corner and at the mirrored place, metres;
/// `None` on holes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerDepth {
    /// Id of the corner.
    pub id: usize,
    /// At the corner.
    pub straight_m: Option<f64>,
    /// At (width − 1 − x, y).
    pub mirrored_m: Option<f64>,
}

/// How many frames speak for a depth map that lies as the colour image does, and how many for one mirrored left for
/// right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Handedness {
    /// Frames that depth fits straight, and mirrored does not.
    pub n_straight: usize,
    /// Frames that depth fits mirrored, and straight does not.
    pub n_mirrored: usize,
    /// Frames that both fit, or neither: straight on, or beside the board.
    pub n_open: usize,
}

/// A frame speaks where the scatter of one reading is so many times that of the other.
const CLEAR_RATIO: f64 = 4.0;
/// Scatter below this says nothing more, metres: noise, and a board that is not flat.
const LEAST_SCATTER_M: f64 = 0.001;
/// Corners a frame needs in either reading.
const LEAST_CORNERS: usize = 9;

/// Compares, frame by frame, how the depths read at the corners and at their mirrored places scatter about the board.
/// Only the scatter counts, so that neither scale, bias nor a wrong focal length matters much.
pub fn handedness(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    views: &[(&View, &Patches)],
) -> Handedness {
    let mut found = Handedness::default();
    for (view, patches) in views {
        let scatter = |read: fn(&CornerDepth) -> Option<f64>| {
            let errors_m: Vec<f64> = patches
                .corners
                .iter()
                .filter_map(|seen| {
                    let point = view.color_from_board * corner_on(board, surface, seen.id);
                    Some(read(seen)? - point.z())
                })
                .collect();
            let enough = errors_m.len() >= LEAST_CORNERS;
            enough.then(|| mad_sigma(&errors_m, median(&errors_m)).max(LEAST_SCATTER_M))
        };
        match (scatter(|s| s.straight_m), scatter(|s| s.mirrored_m)) {
            (Some(a), Some(b)) if b > CLEAR_RATIO * a => found.n_straight += 1,
            (Some(a), Some(b)) if a > CLEAR_RATIO * b => found.n_mirrored += 1,
            _ => found.n_open += 1,
        }
    }
    found
}
