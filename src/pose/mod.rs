//! Where the board stood in front of the camera.
//!
//! A [`View`] is the board seen in one frame: its corners, its pose `color_from_board`, and what the pose leaves
//! unexplained. A plane seen from afar can be explained by two poses; both are refined and the better is taken.
//!
//! ```
//! use truedepth::board::CharucoBoard;
//! use truedepth::camera::{Camera, Distortion, Intrinsics};
//! use truedepth::detect::Corner;
//! use truedepth::geom::{Board, Color, Pose, Rotation, Vector3};
//! use truedepth::pose::{View, Weighting};
//!
//! let board: CharucoBoard = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse()?;
//! let intrinsics = Intrinsics { fx: 436.5, fy: 436.5, cx: 321.6, cy: 239.5, width: 640, height: 480 };
//! let camera = Camera { intrinsics, distortion: Distortion::None };
//! let truth: Pose<Color, Board> =
//!     Pose::new(Rotation::from_scaled_axis(Vector3::new(0.4, -0.3, 0.1)), Vector3::new(-0.1, -0.08, 0.3));
//! let corners: Vec<Corner> = (0..board.n_corners())
//!     .map(|id| Corner { id, pixel: camera.project(truth * board.corner(id)).unwrap(), sigma_px: 0.05 })
//!     .collect();
//! let view = View::from_corners(0, &board, &camera, &corners, Weighting::Equal)?;
//! assert!((view.color_from_board.translation - truth.translation).norm() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here: intrinsics (they are given), several views at once, boards that are not flat.

mod planar;

mod refine;

pub use refine::{advance, d_pixel_d_pose};

use crate::{
    board::CharucoBoard,
    camera::Camera,
    detect::Corner,
    geom::{Board, Color, Point, Pose, Vector3},
    math,
};

/// The board seen in one frame.
#[derive(Clone, Debug)]
pub struct View {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// The corners this pose was found from.
    pub corners: Vec<Corner>,
    /// Where the board stands.
    pub color_from_board: Pose<Color, Board>,
    /// Observed minus projected, pixels, for each corner.
    pub residuals_px: Vec<[f64; 2]>,
    /// Root mean square of the residuals' lengths (the 2-D distance, as OpenCV's calibrateCamera), pixels.
    pub rms_px: f64,
}

/// How much each corner says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weighting {
    /// All the same, as OpenCV.
    Equal,
    /// By 1/(σ² + floor²) with the corner's own σ: the floor is what no corner is better than (an uneven board, a lens
    /// not quite described).
    Sigma {
        /// Pixels.
        floor_px: f64,
    },
}

/// A pose that cannot be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Fewer corners than a pose needs.
    #[error("frame {frame}: {n_corners} corners; a pose needs at least 4")]
    TooFewCorners {
        /// Index of the frame.
        frame: usize,
        /// How many there are.
        n_corners: usize,
    },
    /// Corners that leave the pose open.
    #[error(
        "frame {frame}: {n_corners} corners that lie (nearly) on one line; a pose needs a spread in both directions"
    )]
    Collinear {
        /// Index of the frame.
        frame: usize,
        /// How many there are.
        n_corners: usize,
    },
    /// A corner the board does not have.
    #[error("frame {frame}: corner {id}, but the board has {n_corners} corners, counted from 0")]
    UnknownCorner {
        /// Index of the frame.
        frame: usize,
        /// As given.
        id: usize,
        /// How many the board has.
        n_corners: usize,
    },
    /// A corner at no pixel, or where this camera sees nothing.
    #[error(
        "frame {frame}: corner {id} at ({x_px}, {y_px}) px is outside what the camera model covers"
    )]
    OutsideCamera {
        /// Index of the frame.
        frame: usize,
        /// The corner.
        id: usize,
        /// Column.
        x_px: f64,
        /// Row.
        y_px: f64,
    },
    /// No pose in front of the camera explains the corners.
    #[error("frame {frame}: no pose in front of the camera explains the {n_corners} corners")]
    BehindCamera {
        /// Index of the frame.
        frame: usize,
        /// How many there are.
        n_corners: usize,
    },
}

impl Weighting {
    /// The weight of both coordinates of a corner. A σ that is not a positive number weighs as none: the floor alone,
    /// or nothing.
    pub fn weight(self, corner: &Corner) -> f64 {
        match self {
            Self::Equal => 1.0,
            Self::Sigma { floor_px } => {
                let sigma = if corner.sigma_px > 0.0 { corner.sigma_px } else { 0.0 };
                let variance = sigma * sigma + floor_px * floor_px;
                if variance > 0.0 { 1.0 / variance } else { 0.0 }
            }
        }
    }
}

impl View {
    /// The pose of least (weighted) squared reprojection error, from corners with known `camera`.
    ///
    /// Costs some 50 µs. Needs at least 4 corners not on one line, each inside the camera model's domain.
    pub fn from_corners(
        frame: usize,
        board: &CharucoBoard,
        camera: &Camera,
        corners: &[Corner],
        weighting: Weighting,
    ) -> Result<Self, Error> {
        let pose = pose_of(frame, board, camera, corners, weighting, Polish::Full)?;
        Self::at_pose(frame, board, camera, corners, pose)
    }

    /// The view with this pose as given, its residuals computed.
    pub fn at_pose(
        frame: usize,
        board: &CharucoBoard,
        camera: &Camera,
        corners: &[Corner],
        color_from_board: Pose<Color, Board>,
    ) -> Result<Self, Error> {
        let points: Vec<Point<Board>> = corners.iter().map(|c| board.corner(c.id)).collect();
        Self::at_pose_of(frame, &points, camera, corners, color_from_board)
    }

    /// As [`at_pose`](Self::at_pose), with the place of each corner on a board that need not be flat.
    pub fn at_pose_of(
        frame: usize,
        points: &[Point<Board>],
        camera: &Camera,
        corners: &[Corner],
        color_from_board: Pose<Color, Board>,
    ) -> Result<Self, Error> {
        let mut residuals_px = Vec::with_capacity(corners.len());
        let mut squares = 0.0;
        for (&Corner { id, pixel, .. }, &point) in corners.iter().zip(points) {
            let projected = camera
                .project(color_from_board * point)
                .ok_or(Error::OutsideCamera { frame, id, x_px: pixel.x, y_px: pixel.y })?;
            let residual = pixel - projected;
            squares += residual[0] * residual[0] + residual[1] * residual[1];
            residuals_px.push(residual);
        }
        let rms_px = (squares / corners.len() as f64).sqrt();
        Ok(Self { frame, corners: corners.to_vec(), color_from_board, residuals_px, rms_px })
    }

    /// Where the camera stood, in the board's frame, metres.
    pub fn camera_position_m(&self) -> Vector3<f64> {
        self.color_from_board.inverse().translation
    }

    /// The angle between the optical axis and the board's normal, radians: 0 for a view straight on.
    pub fn tilt_rad(&self) -> f64 {
        let normal = self.color_from_board.rotation * Vector3::z();
        math::acos(normal.z.abs().min(1.0))
    }
}

/// How well a pose has to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Polish {
    /// At its minimum.
    Full,
    /// Near it: something else goes on from there.
    Start,
}

/// The sum of squares is good to this share, and the pose to 1e-5 of its σ.
const FULL_TOLERANCE: f64 = 1e-10;

/// As `FULL_TOLERANCE`, where a larger problem goes on from there.
const START_TOLERANCE: f64 = 1e-3;

/// A pose near the one of [`View::from_corners`], for half its time: a start for something larger. Of two poses that
/// explain the corners it is the same one.
///
/// Errors: as there.
pub(crate) fn start(
    frame: usize,
    board: &CharucoBoard,
    camera: &Camera,
    corners: &[Corner],
    weighting: Weighting,
) -> Result<Pose<Color, Board>, Error> {
    pose_of(frame, board, camera, corners, weighting, Polish::Start)
}

fn pose_of(
    frame: usize,
    board: &CharucoBoard,
    camera: &Camera,
    corners: &[Corner],
    weighting: Weighting,
    polish: Polish,
) -> Result<Pose<Color, Board>, Error> {
    let n_corners = corners.len();
    if n_corners < 4 {
        return Err(Error::TooFewCorners { frame, n_corners });
    }
    let mut points = Vec::with_capacity(n_corners);
    let mut rays = Vec::with_capacity(n_corners);
    let mut sightings = Vec::with_capacity(n_corners);
    for corner in corners {
        let &Corner { id, pixel, .. } = corner;
        if id >= board.n_corners() {
            return Err(Error::UnknownCorner { frame, id, n_corners: board.n_corners() });
        }
        let outside = || Error::OutsideCamera { frame, id, x_px: pixel.x, y_px: pixel.y };
        let ray = camera.unproject(pixel).filter(|r| r[0].is_finite() && r[1].is_finite());
        rays.push(ray.ok_or_else(outside)?);
        let point = board.corner(id);
        points.push(point);
        sightings.push(refine::Sighting { point, pixel, weight: weighting.weight(corner) });
    }
    let starts = planar::both_poses(&points, &rays).ok_or(Error::Collinear { frame, n_corners })?;
    let cost_tolerance = match polish {
        Polish::Start if starts.len() == 1 => START_TOLERANCE,
        Polish::Start | Polish::Full => FULL_TOLERANCE,
    };
    let mut best: Option<(Pose<Color, Board>, f64)> = None;
    for start in starts {
        let Some((pose, cost)) = refine::refine(camera, &sightings, start, cost_tolerance) else {
            continue;
        };
        let in_front = points.iter().all(|&point| (pose * point).z() > 0.0);
        if in_front && best.as_ref().is_none_or(|(_, least)| cost < *least) {
            best = Some((pose, cost));
        }
    }
    let (pose, _) = best.ok_or(Error::BehindCamera { frame, n_corners })?;
    Ok(pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{Brown, Distortion, Intrinsics, RadialTable, TablePair},
        geom::{Pixel, Rotation},
    };

    fn board() -> CharucoBoard {
        "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL".parse().unwrap()
    }

    fn cameras() -> Vec<Camera> {
        let intrinsics =
            Intrinsics { fx: 436.5, fy: 439.5, cx: 321.6, cy: 239.5, width: 640, height: 480 };
        let center = Pixel::new(320.1, 240.9);
        let table = (0..42).map(|i| -0.01 * (f64::from(i) / 41.0).powi(2)).collect();
        let table = RadialTable::new(center, 402.0, table).unwrap();
        [
            Distortion::None,
            Distortion::Brown(Brown { k1: 0.07, k2: -0.1, p1: 0.001, p2: -0.002, k3: 0.02 }),
            Distortion::Table(TablePair::from_inverse(table)),
        ]
        .into_iter()
        .map(|distortion| Camera { intrinsics, distortion })
        .collect()
    }

    /// The board's centre straight ahead at `distance_m`, tilted by `tilt_rad` about an axis in the image at
    /// `azimuth_rad`, and turned in the image by `roll_rad`.
    fn pose(tilt_rad: f64, azimuth_rad: f64, roll_rad: f64, distance_m: f64) -> Pose<Color, Board> {
        let axis = Vector3::new(azimuth_rad.cos(), azimuth_rad.sin(), 0.0);
        let rotation = Rotation::from_scaled_axis(axis * tilt_rad)
            * Rotation::from_scaled_axis(Vector3::z() * roll_rad);
        let centre = Vector3::new(5.0 * 0.020875, 4.0 * 0.020875, 0.0);
        Pose::new(rotation, Vector3::new(0.01, -0.005, distance_m) - rotation * centre)
    }

    fn seen(camera: &Camera, pose: &Pose<Color, Board>, noise_px: f64) -> Vec<Corner> {
        let board = board();
        (0..board.n_corners())
            .filter_map(|id| {
                let pixel = camera.project(*pose * board.corner(id))?;
                let wobble = [(id as f64 * 12.9).sin(), (id as f64 * 78.2).cos()];
                let pixel =
                    Pixel::new(pixel.x + noise_px * wobble[0], pixel.y + noise_px * wobble[1]);
                Some(Corner { id, pixel, sigma_px: 0.1 })
            })
            .collect()
    }

    #[test]
    fn recovers_poses_with_every_lens() {
        for camera in cameras() {
            for tilt in [0.0, 0.05, 0.4, 0.9] {
                for azimuth in [0.0, 1.0, 2.5, 4.0] {
                    for roll in [0.0, 1.5, 3.1] {
                        let truth = pose(tilt, azimuth, roll, 0.28);
                        let corners = seen(&camera, &truth, 0.0);
                        let view =
                            View::from_corners(7, &board(), &camera, &corners, Weighting::Equal)
                                .unwrap();
                        let found = view.color_from_board;
                        assert!(view.rms_px < 1e-7, "{tilt} {azimuth} {roll} {}", view.rms_px);
                        assert!((found.translation - truth.translation).norm() < 1e-8);
                        let turned = found.rotation.matrix() - truth.rotation.matrix();
                        assert!(turned.norm() < 1e-8);
                        assert!((view.tilt_rad() - tilt).abs() < 1e-6);
                    }
                }
            }
        }
    }

    /// A small far board: the wrong one of the two poses must not win.
    #[test]
    fn takes_the_better_of_both_poses() {
        let camera = &cameras()[0];
        let mut n = 0;
        for azimuth in 0..24 {
            let truth = pose(0.5, f64::from(azimuth) * 0.26, 0.3, 0.9);
            let mut corners = seen(camera, &truth, 0.05);
            corners.retain(|c| c.id % 9 < 4 && c.id / 9 < 4);
            let view = View::from_corners(0, &board(), camera, &corners, Weighting::Equal).unwrap();
            let off = (view.color_from_board.rotation.inverse() * truth.rotation).angle();
            n += usize::from(off < 0.15);
        }
        assert_eq!(n, 24);
    }

    #[test]
    fn four_corners_are_enough() {
        let camera = &cameras()[1];
        let truth = pose(0.5, 0.7, 0.2, 0.3);
        let mut corners = seen(camera, &truth, 0.0);
        corners.retain(|c| [0, 8, 54, 62].contains(&c.id));
        let view = View::from_corners(0, &board(), camera, &corners, Weighting::Equal).unwrap();
        assert!((view.color_from_board.translation - truth.translation).norm() < 1e-8);
        corners.pop();
        let error =
            View::from_corners(0, &board(), camera, &corners, Weighting::Equal).unwrap_err();
        assert_eq!(error, Error::TooFewCorners { frame: 0, n_corners: 3 });
    }

    #[test]
    fn refuses_what_has_no_pose() {
        let camera = &cameras()[1];
        let truth = pose(0.5, 0.7, 0.2, 0.3);
        let all = seen(camera, &truth, 0.0);
        let fit = |corners: &[Corner]| {
            View::from_corners(3, &board(), camera, corners, Weighting::Sigma { floor_px: 0.1 })
        };
        let line: Vec<Corner> = all.iter().filter(|c| c.id < 9).copied().collect();
        assert_eq!(fit(&line).unwrap_err(), Error::Collinear { frame: 3, n_corners: 9 });
        let mut unknown = all.clone();
        unknown[5].id = 63;
        assert!(matches!(fit(&unknown), Err(Error::UnknownCorner { id: 63, .. })));
        let mut nowhere = all.clone();
        nowhere[5].pixel.x = f64::NAN;
        assert!(matches!(fit(&nowhere), Err(Error::OutsideCamera { id: 5, .. })));
    }

    /// A corner far off with a large σ says little.
    #[test]
    fn weighs_by_sigma() {
        let camera = &cameras()[0];
        let truth = pose(0.5, 0.7, 0.2, 0.3);
        let mut corners = seen(camera, &truth, 0.0);
        corners[0].pixel.x += 2.0;
        corners[0].sigma_px = 20.0;
        let error = |weighting| {
            let view = View::from_corners(0, &board(), camera, &corners, weighting).unwrap();
            (view.color_from_board.translation - truth.translation).norm()
        };
        let weighed = error(Weighting::Sigma { floor_px: 0.0 });
        assert!(weighed < 0.01 * error(Weighting::Equal), "{weighed}");
    }

    #[test]
    fn derivative_by_pose_matches_differences() {
        let camera = &cameras()[1];
        let pose = pose(0.5, 0.7, 0.2, 0.3);
        let point = board().corner(17);
        let turned = pose.rotation * point.coords;
        let (_, by_point) = camera.project_with_jacobian(pose * point).unwrap();
        for k in 0..6 {
            let h = 1e-6;
            let [low, high] = [-h, h].map(|h| {
                let mut step = [0.0; 6];
                step[k] = h;
                camera.project(advance(&pose, &step) * point).unwrap()
            });
            let numeric = [(high.x - low.x) / (2.0 * h), (high.y - low.y) / (2.0 * h)];
            for row in 0..2 {
                let analytic = d_pixel_d_pose(by_point[row], &turned)[k];
                assert!((analytic - numeric[row]).abs() < 1e-4, "{k} {row}");
            }
        }
    }
}
