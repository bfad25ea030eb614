//! What a registration leaves: where in the image, how noisy, how full of holes.

use super::MAX_ERROR_M;
use crate::{
    camera::Intrinsics,
    geom::Pixel,
    solve::{mad_sigma, median, rms},
};

/// Depth on the board after scale, bias, zoom and shift are taken out.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Pattern {
    /// Side of a cell of the map, pixels.
    pub cell_px: usize,
    /// Cells along a row.
    pub columns: usize,
    /// Cells, row by row.
    pub cells: Vec<PatternCell>,
    /// Standard deviation of single pixels about a small plane, metres: the median over all patches.
    pub pixel_noise_m: f64,
    /// Standard deviation of a patch from frame to frame at the same place of the image, metres: slow noise of the
    /// sensor and errors of the poses.
    pub frame_noise_m: f64,
    /// RMS of the map's medians, metres: what stays the same in all frames.
    pub fixed_m: f64,
    /// Pixels without measurement on the board.
    pub holes: Holes,
}

/// A cell of the map of residuals.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PatternCell {
    /// Sensor minus model, metres: the median over the frames' medians. NaN where no frame showed the board.
    pub median_m: f64,
    /// Frames that showed the board here.
    pub n_frames: usize,
    /// Patches.
    pub n_patches: usize,
}

/// How many pixels on the board have no measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Holes {
    /// Pixels on the board.
    pub n_pixels: usize,
    /// Of them without measurement.
    pub n_holes: usize,
    /// Pixels on the board where the sensor is made to measure: [`NEAR_M`] away or more, seen under
    /// [`MAX_INCIDENCE_DEG`] at most.
    pub n_pixels_in_reach: usize,
    /// Of them without measurement.
    pub n_holes_in_reach: usize,
}

/// TrueDepth is made for faces: what is nearer is often not measured, metres.
pub const NEAR_M: f64 = 0.2;
/// What is seen more slantingly is often not measured, degrees between ray and normal.
pub const MAX_INCIDENCE_DEG: f64 = 60.0;

impl Holes {
    /// Share of holes in reach; `None` where there is no pixel in reach.
    pub fn share_in_reach(&self) -> Option<f64> {
        let n = self.n_pixels_in_reach;
        (n > 0).then(|| self.n_holes_in_reach as f64 / n as f64)
    }

    pub(super) fn add(&mut self, n_pixels: usize, n_holes: usize, in_reach: bool) {
        self.n_pixels += n_pixels;
        self.n_holes += n_holes;
        if in_reach {
            self.n_pixels_in_reach += n_pixels;
            self.n_holes_in_reach += n_holes;
        }
    }
}

/// A patch of a frame on the board.
#[derive(Clone, Copy, Debug)]
pub(super) struct Residual {
    pub(super) frame: usize,
    pub(super) at: Pixel,
    pub(super) residual_m: f64,
    pub(super) noise_m: f64,
}

/// Side of a cell: a sixteenth of the image's width.
const CELLS_ACROSS: usize = 16;

impl Pattern {
    /// From residuals grouped by frame; those beyond [`MAX_ERROR_M`] show something else than the board.
    pub(super) fn new(size: &Intrinsics, residuals: &[Residual], holes: Holes) -> Self {
        let residuals: Vec<Residual> =
            residuals.iter().filter(|r| r.residual_m.abs() <= MAX_ERROR_M).copied().collect();
        let cell_px = size.width.div_ceil(CELLS_ACROSS).max(1);
        let (columns, rows) = (size.width.div_ceil(cell_px), size.height.div_ceil(cell_px));
        let mut medians: Vec<Vec<f64>> = vec![Vec::new(); columns * rows];
        let mut counts = vec![0; columns * rows];
        let mut deviations = Vec::with_capacity(residuals.len());
        let cell = |r: &Residual| {
            let along = |x: f64, n: usize| ((x + 0.5).max(0.0) as usize / cell_px).min(n - 1);
            along(r.at.y, rows) * columns + along(r.at.x, columns)
        };
        for frame in residuals.chunk_by(|a, b| a.frame == b.frame) {
            let mut of_frame: Vec<(usize, f64)> =
                frame.iter().map(|r| (cell(r), r.residual_m)).collect();
            of_frame.sort_by_key(|(cell, _)| *cell);
            for chunk in of_frame.chunk_by(|a, b| a.0 == b.0) {
                let values: Vec<f64> = chunk.iter().map(|(_, r)| *r).collect();
                medians[chunk[0].0].push(median(&values));
                counts[chunk[0].0] += chunk.len();
            }
        }
        let cells: Vec<PatternCell> = medians
            .iter()
            .zip(&counts)
            .map(|(values, &n_patches)| PatternCell {
                median_m: median(values),
                n_frames: values.len(),
                n_patches,
            })
            .collect();
        for residual in &residuals {
            deviations.push(residual.residual_m - cells[cell(residual)].median_m);
        }
        let noises: Vec<f64> = residuals.iter().map(|r| r.noise_m).collect();
        // A cell that one frame alone showed is that frame's error, no pattern.
        let fixed: Vec<f64> =
            cells.iter().filter(|c| c.n_frames >= 3).map(|c| c.median_m).collect();
        Self {
            cell_px,
            columns,
            cells,
            pixel_noise_m: median(&noises),
            frame_noise_m: mad_sigma(&deviations, 0.0),
            fixed_m: rms(&fixed),
            holes,
        }
    }
}
