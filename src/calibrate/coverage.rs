//! Where the views stood, and which are missing.

use super::{Calibration, Input, views};
use crate::{
    detect::Corner,
    geom::{Board, Color, Pose},
    math,
    pose::{View, Weighting},
};

/// The image is looked at in so many cells each way.
const CELLS: usize = 3;

/// A view tilted less says little about the focal length.
const TILTED_DEG: f64 = 15.0;

/// A ninth of the image with fewer of all corners says next to nothing of the lens there.
const LEAST_SHARE: f64 = 0.01;
/// A calibration this uncertain somewhere in the image is not known there, pixels.
const UNKNOWN_PX: f64 = 1.0;

/// From which sides and where in the image the board was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// The views, by frame.
    pub views: Vec<Tilt>,
    /// Cells across the image.
    pub columns: usize,
    /// Cells down the image.
    pub rows: usize,
    /// Corners in each cell, row by row from the top left.
    pub n_corners: Vec<usize>,
}

/// How the board was tilted in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tilt {
    /// Index of the frame.
    pub frame: usize,
    /// Angle between the optical axis and the board's normal, degrees.
    pub tilt_deg: f64,
    /// Which part of the board is nearest: 0° the right in the image, 90° the bottom, 180° the left, −90° the top.
    pub nearest_deg: f64,
}

/// What the views of a calibration cover: all frames in which a pose can be found with the factory's intrinsics.
pub fn coverage(input: &Input<'_>) -> Coverage {
    let gathered = views::all_usable(input, 4, Weighting::Equal);
    let views = gathered.views.iter().map(|v| (v.frame, &v.pose, v.corners.as_slice()));
    Coverage::of(views, [input.factory.width, input.factory.height])
}

impl Coverage {
    /// The parts of the image, row by row from the top left.
    pub const PLACES: [&str; CELLS * CELLS] = [
        "top left",
        "top",
        "top right",
        "left",
        "middle",
        "right",
        "bottom left",
        "bottom",
        "bottom right",
    ];

    /// What these views (index of the frame, pose, corners) cover of an image of so many columns and rows.
    pub fn of<'a>(
        views: impl Iterator<Item = (usize, &'a Pose<Color, Board>, &'a [Corner])>,
        [width, height]: [usize; 2],
    ) -> Self {
        let mut coverage = Self {
            views: Vec::new(),
            columns: CELLS,
            rows: CELLS,
            n_corners: vec![0; CELLS * CELLS],
        };
        let cell = |at: f64, size: usize| {
            (((at + 0.5) / size as f64 * CELLS as f64).max(0.0) as usize).min(CELLS - 1)
        };
        for (frame, pose, corners) in views {
            // Into the board: it leans to where the board is nearest.
            let normal = pose.rotation.matrix().column(2).into_owned();
            let flip = if normal.z < 0.0 { -1.0 } else { 1.0 };
            coverage.views.push(Tilt {
                frame,
                tilt_deg: math::acos(normal.z.abs().min(1.0)).to_degrees(),
                nearest_deg: math::atan2(flip * normal.y, flip * normal.x).to_degrees(),
            });
            for corner in corners {
                let column = cell(corner.pixel.x, width);
                let row = cell(corner.pixel.y, height);
                coverage.n_corners[row * CELLS + column] += 1;
            }
        }
        coverage
    }

    /// The sides of the board of which no view has it nearest, within 45° and tilted by 15° or more: `right`, `bottom`,
    /// `left`, `top`.
    pub fn missing_tilts(&self) -> Vec<&'static str> {
        const SIDES: [(f64, &str); 4] =
            [(0.0, "right"), (90.0, "bottom"), (180.0, "left"), (-90.0, "top")];
        let towards = |view: &Tilt, side_deg: f64| {
            let off = (view.nearest_deg - side_deg).rem_euclid(360.0);
            view.tilt_deg >= TILTED_DEG && off.min(360.0 - off) <= 45.0
        };
        SIDES
            .into_iter()
            .filter(|(side_deg, _)| !self.views.iter().any(|v| towards(v, *side_deg)))
            .map(|(_, name)| name)
            .collect()
    }

    /// The parts of the image without a corner, or with hardly any: `top left`, `middle`, `bottom` and the like.
    pub fn missing_places(&self) -> Vec<&'static str> {
        let all: usize = self.n_corners.iter().sum();
        let is_missing = |n: usize| n == 0 || (n as f64) < LEAST_SHARE * all as f64;
        let missing = self.n_corners.iter().zip(Self::PLACES).filter(|(n, _)| is_missing(**n));
        missing.map(|(_, name)| name).collect()
    }

    /// What to record; `None` where nothing is missing.
    pub fn advice(&self) -> Option<String> {
        let mut wishes = Vec::new();
        let tilts = self.missing_tilts();
        if tilts.len() == 4 {
            wishes.push("views tilted by 20° to 45° to all sides (all are straight on)".to_owned());
        } else if !tilts.is_empty() {
            let sides = tilts.join(", ");
            wishes.push(format!(
                "views tilted by 20° to 45° with this side of the board nearest: {sides}"
            ));
        }
        let places = self.missing_places();
        if !places.is_empty() {
            wishes.push(format!("the board in these parts of the image: {}", places.join(", ")));
        }
        (!wishes.is_empty()).then(|| format!("record {}", wishes.join("; ")))
    }
}

impl Calibration {
    /// The largest σ of the projection in the image, pixels, where it is so large that the calibration is not known
    /// there (above 1 px at the views' median distance); `None` where it is known everywhere.
    pub fn unknown_px(&self) -> Option<f64> {
        let grid = self.projection_uncertainty(17, 13, self.median_distance_m()?)?;
        let worst = grid.sigma_px.into_iter().filter(|s| !s.is_nan()).fold(0.0, f64::max);
        (worst > UNKNOWN_PX).then_some(worst)
    }

    /// The tilt of each view used.
    pub fn tilts_deg(&self) -> Vec<f64> {
        self.views.iter().map(View::tilt_rad).map(f64::to_degrees).collect()
    }
}
