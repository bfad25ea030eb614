//! How straight the board's lines are in an image, and would be in an image rectified by a lens.
//!
//! A pinhole shows straight lines as straight lines, wherever the board stands: what is left is the lens (and the
//! board's own waviness, the same in every panel). This is the paper's figure 7 as a number.

use super::PixelMap;
use crate::{
    board::CharucoBoard,
    camera::{Camera, Distortion, TablePair},
    detect::Observation,
    geom::Pixel,
    math,
    recording::StreamState,
    solve::{mean, standard_error},
};

/// What describes a lens.
#[derive(Clone, Debug, PartialEq)]
pub enum Rectifier {
    /// Apple's lookup tables, each as the file has it.
    Tables(Box<TablePair>),
    /// A calibrated camera with distortion.
    Camera(Box<Camera>),
}

/// An image before and after rectification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Treatment {
    /// As recorded.
    Original,
    /// Resampled with the forward table (rectilinear → distorted): what straightens a distorted image.
    Forward,
    /// Resampled with the inverse table (distorted → rectilinear): what bends a straight one.
    Inverse,
}

impl Treatment {
    /// All of them, as the paper's figure shows them.
    pub const ALL: [Self; 3] = [Self::Original, Self::Forward, Self::Inverse];

    /// `original`, `forward` or `inverse`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Original => "original",
            Self::Forward => "forward",
            Self::Inverse => "inverse",
        }
    }
}

impl Rectifier {
    /// The lens of a camera; `None` where it has no distortion.
    pub fn of_camera(camera: &Camera) -> Option<Self> {
        (camera.distortion != Distortion::None).then(|| Self::Camera(Box::new(camera.clone())))
    }

    /// `tables` or `camera`: stable, for machines.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Tables(_) => "tables",
            Self::Camera(_) => "camera",
        }
    }

    /// Where each pixel of the treated image comes from.
    pub fn map(&self, treatment: Treatment, width: usize, height: usize) -> PixelMap {
        PixelMap::new(width, height, |at| self.source(treatment, at))
    }

    fn source(&self, treatment: Treatment, at: Pixel) -> Option<Pixel> {
        match (treatment, self) {
            (Treatment::Original, _) => Some(at),
            (Treatment::Forward, Self::Tables(tables)) => tables.forward.apply(at),
            (Treatment::Inverse, Self::Tables(tables)) => tables.inverse.apply(at),
            (Treatment::Forward, Self::Camera(camera)) => distort(camera, at),
            (Treatment::Inverse, Self::Camera(camera)) => undistort(camera, at),
        }
    }

    /// Where a pixel of the recorded image lies in the treated one.
    pub fn place(&self, treatment: Treatment, at: Pixel) -> Option<Pixel> {
        match (treatment, self) {
            (Treatment::Original, _) => Some(at),
            (Treatment::Forward, Self::Tables(tables)) => tables.forward.invert(at),
            (Treatment::Inverse, Self::Tables(tables)) => tables.inverse.invert(at),
            (Treatment::Forward, Self::Camera(camera)) => undistort(camera, at),
            (Treatment::Inverse, Self::Camera(camera)) => distort(camera, at),
        }
    }
}

fn distort(camera: &Camera, at: Pixel) -> Option<Pixel> {
    camera.project_ray(camera.intrinsics.ray_from_pixel(at))
}

fn undistort(camera: &Camera, at: Pixel) -> Option<Pixel> {
    Some(camera.intrinsics.pixel_from_ray(camera.unproject(at)?))
}

/// A row or column of the board's corners in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardLine {
    /// Its corners, in order.
    pub points: Vec<Pixel>,
    /// The point of the fitted line nearest to each.
    pub on_line: Vec<Pixel>,
}

impl BoardLine {
    /// Sum of squared distances from the line, pixels², and their degrees of freedom.
    fn squares(&self) -> (f64, usize) {
        let sum = self.points.iter().zip(&self.on_line).map(|(p, q)| p.distance(*q).powi(2)).sum();
        (sum, self.points.len() - 2)
    }
}

/// A line needs so many corners: with fewer there is little to be bent.
const LEAST_ON_LINE: usize = 4;

/// The board's rows and columns in a treated image, each with the line that fits best (total least squares).
pub fn board_lines(
    board: &CharucoBoard,
    observation: &Observation,
    place: impl Fn(Pixel) -> Option<Pixel>,
) -> Vec<BoardLine> {
    let corners: Vec<((usize, usize), Pixel)> = observation
        .corners
        .iter()
        .filter_map(|corner| Some((board.corner_cell(corner.id), place(corner.pixel)?)))
        .collect();
    let mut lines = Vec::new();
    for (axis, n) in [(1, board.squares_y), (0, board.squares_x)] {
        for line in 0..n {
            let on = |(column, row): (usize, usize)| [column, row][axis] == line;
            let mut points: Vec<(usize, Pixel)> = corners
                .iter()
                .filter(|(cell, _)| on(*cell))
                .map(|&((column, row), p)| ([column, row][1 - axis], p))
                .collect();
            points.sort_by_key(|(along, _)| *along);
            if points.len() >= LEAST_ON_LINE {
                lines.push(fitted(points.into_iter().map(|(_, p)| p).collect()));
            }
        }
    }
    lines
}

fn fitted(points: Vec<Pixel>) -> BoardLine {
    let n = points.len() as f64;
    let (cx, cy) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.x / n, y + p.y / n));
    let [xx, xy, yy] = points.iter().fold([0.0; 3], |[a, b, c], p| {
        let (x, y) = (p.x - cx, p.y - cy);
        [a + x * x, b + x * y, c + y * y]
    });
    // The direction of the larger eigenvalue of the scatter.
    let angle = 0.5 * math::atan2(2.0 * xy, xx - yy);
    let (dx, dy) = (math::cos(angle), math::sin(angle));
    let foot = |p: &Pixel| {
        let along = (p.x - cx) * dx + (p.y - cy) * dy;
        Pixel::new(cx + along * dx, cy + along * dy)
    };
    BoardLine { on_line: points.iter().map(foot).collect(), points }
}

/// Straightness of a recording's lines under each treatment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Straightness {
    /// Of each frame with lines: sums of squares under each of [`Treatment::ALL`] and their degrees of freedom.
    frames: Vec<([f64; 3], usize)>,
    n_lines: usize,
}

/// No corner is seen better than this, pixels; without it noise-free lines had no ratio.
const NO_BETTER_PX: f64 = 0.01;
/// Frames needed for a verdict: a spread of fewer says little.
const LEAST_FRAMES: usize = 4;

impl Straightness {
    /// Adds a frame's lines under each of [`Treatment::ALL`]; a frame whose lines differ in number (a corner leaves the
    /// lens' domain) is left out.
    pub fn add(&mut self, lines: [&[BoardLine]; 3]) {
        let sum = |lines: &[BoardLine]| {
            lines.iter().map(BoardLine::squares).fold((0.0, 0), |(s, n), (t, m)| (s + t, n + m))
        };
        let sums = lines.map(sum);
        let n = sums[0].1;
        if n > 0 && sums.iter().all(|(_, other)| *other == n) {
            self.frames.push((sums.map(|(squares, _)| squares), n));
            self.n_lines += lines[0].len();
        }
    }

    /// Frames that count.
    pub fn n_frames(&self) -> usize {
        self.frames.len()
    }

    /// Rows and columns of the board in them.
    pub fn n_lines(&self) -> usize {
        self.n_lines
    }

    /// Root mean square distance of corners from their lines under each of [`Treatment::ALL`], pixels; `None` where no
    /// frame counts.
    pub fn rms_px(&self) -> Option<[f64; 3]> {
        let n: usize = self.frames.iter().map(|(_, n)| n).sum();
        let rms = |i: usize| (self.frames.iter().map(|(s, _)| s[i]).sum::<f64>() / n as f64).sqrt();
        (n > 0).then(|| [0, 1, 2].map(rms))
    }

    /// What the lines say: the straightest treatment, where it is straighter than each other one by more than 3 σ of
    /// the mean over frames of the logarithm of their mean squares' ratio. Ratios, because how much a lens bends lines
    /// depends on where in the image they lie.
    pub fn state(&self) -> StreamState {
        if self.frames.len() < LEAST_FRAMES {
            return StreamState::Unknown;
        }
        let straighter = |i: usize, j: usize| {
            let square = |s: f64, n: usize| s / n as f64 + NO_BETTER_PX.powi(2);
            let ratios: Vec<f64> = self
                .frames
                .iter()
                .map(|&(s, n)| math::ln(square(s[j], n) / square(s[i], n)))
                .collect();
            mean(&ratios) > 3.0 * standard_error(&ratios)
        };
        let best = (0..3).find(|&i| (0..3).all(|j| j == i || straighter(i, j)));
        match best.map(|i| Treatment::ALL[i]) {
            Some(Treatment::Original) => StreamState::Rectified,
            Some(Treatment::Forward) => StreamState::Distorted,
            Some(Treatment::Inverse) => StreamState::RectifiedTwice,
            None => StreamState::Unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{Brown, Intrinsics},
        detect::Corner,
    };

    fn camera() -> Camera {
        let intrinsics =
            Intrinsics { fx: 590.0, fy: 590.0, cx: 318.0, cy: 241.0, width: 640, height: 480 };
        let brown = Brown { k1: 0.08, k2: -0.02, p1: 0.0, p2: 0.0, k3: 0.0 };
        Camera { intrinsics, distortion: Distortion::Brown(brown) }
    }

    /// A board seen in perspective, then bent by `bend`.
    fn seen(board: &CharucoBoard, turn: f64, bend: impl Fn(Pixel) -> Pixel) -> Observation {
        let corner = |id: usize| {
            let p = board.corner(id);
            let (x, y) = (p.x() - 0.1, p.y() - 0.08);
            let z = 0.28 + turn * x + 0.3 * y;
            let pixel = bend(Pixel::new(318.0 + 590.0 * x / z, 241.0 + 590.0 * y / z));
            Corner { id, pixel, sigma_px: 0.05 }
        };
        let corners = (0..board.n_corners()).map(corner).collect();
        Observation { corners, identity: None, rejects: Vec::new() }
    }

    fn measured(bend: impl Fn(Pixel) -> Pixel + Copy) -> Straightness {
        let board = CharucoBoard::paper(0.020_875).unwrap();
        let rectifier = Rectifier::of_camera(&camera()).unwrap();
        let mut straightness = Straightness::default();
        for i in 0..6 {
            let observation = seen(&board, 0.1 * f64::from(i) - 0.25, bend);
            let lines = Treatment::ALL
                .map(|t| board_lines(&board, &observation, |p| rectifier.place(t, p)));
            straightness.add([&lines[0], &lines[1], &lines[2]]);
        }
        straightness
    }

    #[test]
    fn the_right_treatment_is_found() {
        let camera = camera();
        let straight = measured(|p| p);
        assert_eq!((straight.n_frames(), straight.n_lines()), (6, 96));
        assert_eq!(straight.state(), StreamState::Rectified);
        let distorted = measured(|p| distort(&camera, p).unwrap());
        assert_eq!(distorted.state(), StreamState::Distorted);
        let [original, forward, inverse] = distorted.rms_px().unwrap();
        assert!(
            forward < 1e-6 && original > 0.2 && inverse > 1.8 * original,
            "{original} {inverse}"
        );
        let twice = measured(|p| undistort(&camera, p).unwrap());
        assert_eq!(twice.state(), StreamState::RectifiedTwice);
        assert_eq!(Straightness::default().state(), StreamState::Unknown);
        assert_eq!(Straightness::default().rms_px(), None);
    }

    /// What is drawn and what is measured are the same mapping, one the inverse of the other.
    #[test]
    fn places_and_sources_undo_each_other() {
        let table = |sign: f64| {
            let m = (0..42).map(|i| sign * 2e-5 * f64::from(i * i)).collect();
            crate::camera::RadialTable::new(Pixel::new(317.0, 239.0), 401.0, m).unwrap()
        };
        let tables = TablePair { forward: table(1.0), inverse: table(-1.0) };
        for rectifier in
            [Rectifier::of_camera(&camera()).unwrap(), Rectifier::Tables(Box::new(tables))]
        {
            for treatment in Treatment::ALL {
                let at = Pixel::new(500.0, 100.0);
                let back = rectifier.source(treatment, rectifier.place(treatment, at).unwrap());
                assert!(back.unwrap().distance(at) < 1e-6, "{treatment:?}");
            }
        }
    }
}
