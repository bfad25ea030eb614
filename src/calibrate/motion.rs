//! What a wrong calibration would cost, at each place of the image.

use super::Calibration;
use crate::{
    camera::Camera,
    geom::{Board, Color, Pixel, Point, Pose, Vector3},
    math,
    solve::Response,
};

/// How the camera as a whole moves against the boards when its numbers change and all poses follow; with the
/// covariance of both.
///
/// A longer focal length with every board farther away draws nearly the same pictures: the error of a calibration is
/// what is left once the poses have followed. As in mrcal ("mean-pcam"), a point seen at a pixel is carried to the
/// frame of each board, the calibration is disturbed, the point is brought back from each, and the mean of all is
/// projected.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanMotion {
    /// The covariance of the camera's parameters and, after these, of the mean rotation (radians) and translation
    /// (metres) of the boards in the camera's frame: row-major.
    covariance: Vec<f64>,
    n_camera: usize,
}

/// The covariance of all shared numbers.
pub(super) struct Joint<'a> {
    /// Row-major, the camera's first, the surface's last.
    pub(super) covariance: &'a [f64],
    /// Of a residual of unit weight.
    pub(super) variance: f64,
    pub(super) n_camera: usize,
}

impl MeanMotion {
    /// From each pose's own covariance for unit variance and how it follows the other numbers, and the covariance of
    /// these; `planes` is how the board's own plane moves with each of the surface's numbers.
    ///
    /// A board whose heights all rise by a millimetre and whose poses all sink by as much is the same board: where it
    /// stands is where its own plane does.
    ///
    /// A step (ω, τ) of a pose moves a point p of the camera's frame by ω × (p − t) + τ = ω × p + (τ − ω × t).
    pub(super) fn new(
        responses: Vec<Response<6>>,
        poses: &[Pose<Color, Board>],
        planes: &[[f64; 6]],
        &Joint { covariance, variance, n_camera }: &Joint<'_>,
    ) -> Self {
        let n = covariance.len().isqrt();
        let share = 1.0 / poses.len() as f64;
        let mut follows = vec![[0.0; 6]; n];
        let mut own = [[0.0; 6]; 6];
        for ((pose_covariance, mut response), pose) in responses.into_iter().zip(poses) {
            for (step, plane) in response[n - planes.len()..].iter_mut().zip(planes) {
                let turn = pose.rotation * Vector3::new(plane[0], plane[1], plane[2]);
                let shift = pose.rotation * Vector3::new(plane[3], plane[4], plane[5]);
                let moved = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
                (0..6).for_each(|k| step[k] += moved[k]);
            }
            for (sum, step) in follows.iter_mut().zip(&response) {
                let moved = about_camera(pose, step);
                (0..6).for_each(|k| sum[k] += share * moved[k]);
            }
            // Q·V⁻¹·Qᵀ: columns first, then rows.
            let half = pose_covariance.map(|row| about_camera(pose, &row));
            let columns: [[f64; 6]; 6] =
                std::array::from_fn(|j| about_camera(pose, &std::array::from_fn(|i| half[i][j])));
            for i in 0..6 {
                for j in 0..6 {
                    own[i][j] += variance * share * share * columns[j][i];
                }
            }
        }
        let size = n_camera + 6;
        let mut joint = vec![0.0; size * size];
        // Covariance of the numbers with the motion, one column of six at a time.
        let with_motion: Vec<[f64; 6]> = (0..n)
            .map(|i| {
                let mut sum = [0.0; 6];
                for (j, follow) in follows.iter().enumerate() {
                    (0..6).for_each(|k| sum[k] += covariance[i * n + j] * follow[k]);
                }
                sum
            })
            .collect();
        for i in 0..n_camera {
            joint[i * size..i * size + n_camera]
                .copy_from_slice(&covariance[i * n..i * n + n_camera]);
            for k in 0..6 {
                joint[i * size + n_camera + k] = with_motion[i][k];
                joint[(n_camera + k) * size + i] = with_motion[i][k];
            }
        }
        for a in 0..6 {
            for b in 0..6 {
                let sum: f64 = follows.iter().zip(&with_motion).map(|(f, w)| f[a] * w[b]).sum();
                joint[(n_camera + a) * size + n_camera + b] = sum + own[a][b];
            }
        }
        Self { covariance: joint, n_camera }
    }
}

/// A step of a pose as one about the camera's own centre.
fn about_camera(pose: &Pose<Color, Board>, step: &[f64; 6]) -> [f64; 6] {
    let turn = Vector3::new(step[0], step[1], step[2]);
    let shift = Vector3::new(step[3], step[4], step[5]) - turn.cross(&pose.translation);
    [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}

/// How far off the calibration may draw a point, over the image, for points at one depth.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ProjectionUncertainty {
    /// Places across the image.
    pub columns: usize,
    /// Places down the image.
    pub rows: usize,
    /// How far the points are in front of the camera (z), metres.
    pub depth_m: f64,
    /// The pixel of each place, row by row from the top left.
    #[serde(skip)]
    pub pixels: Vec<Pixel>,
    /// One standard deviation of the projection in its worst direction, pixels, row by row; NaN where the lens model
    /// covers nothing.
    pub sigma_px: Vec<f64>,
    /// The same sideways at `depth_m`, metres.
    pub sigma_m: Vec<f64>,
}

impl Calibration {
    /// The projection's uncertainty on an even grid of places from corner to corner of the image, for points `depth_m`
    /// in front of the camera; `None` for fewer than two places across or down, a depth that is not positive, or a
    /// calibration without covariance of its poses.
    ///
    /// Covers what corner noise and disagreement between pictures leave open in the camera's numbers, the board's shape
    /// and the poses together. It does not cover what no picture contradicts (a model too stiff for the lens; see the
    /// held-out error of the [`candidates`](Self::candidates) for that).
    pub fn projection_uncertainty(
        &self,
        columns: usize,
        rows: usize,
        depth_m: f64,
    ) -> Option<ProjectionUncertainty> {
        let motion = self.motion.as_ref()?;
        if columns < 2 || rows < 2 || !(depth_m > 0.0 && depth_m.is_finite()) {
            return None;
        }
        let pinhole = &self.camera.intrinsics;
        let focal_px = pinhole.focal_px();
        let at = |i: usize, n: usize, size: usize| i as f64 / (n - 1) as f64 * (size as f64 - 1.0);
        let disturbed = Disturbed::new(self);
        let mut pixels = Vec::with_capacity(columns * rows);
        let mut sigma_px = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                let pixel =
                    Pixel::new(at(column, columns, pinhole.width), at(row, rows, pinhole.height));
                pixels.push(pixel);
                sigma_px.push(disturbed.sigma_px(motion, pixel, depth_m).unwrap_or(f64::NAN));
            }
        }
        let sigma_m = sigma_px.iter().map(|s| s * depth_m / focal_px).collect();
        Some(ProjectionUncertainty { columns, rows, depth_m, pixels, sigma_px, sigma_m })
    }
}

/// A camera, and two disturbed ones for each of its free parameters.
struct Disturbed<'a> {
    camera: &'a Camera,
    /// Step, and the cameras a step up and down.
    beside: Vec<(f64, [Camera; 2])>,
}

impl<'a> Disturbed<'a> {
    fn new(calibration: &'a Calibration) -> Self {
        let beside = calibration
            .parameters
            .iter()
            .map(|parameter| {
                let sigma = parameter.estimate.sigma;
                let step = if sigma > 0.0 && sigma.is_finite() { 0.1 * sigma } else { 1e-6 };
                let moved =
                    |step: f64| super::model::moved(&calibration.camera, parameter.name, step);
                (step, [moved(step), moved(-step)])
            })
            .collect();
        Self { camera: &calibration.camera, beside }
    }

    /// The square root of the larger eigenvalue of the pixel's covariance.
    fn sigma_px(&self, motion: &MeanMotion, pixel: Pixel, depth_m: f64) -> Option<f64> {
        let [u, v] = self.camera.unproject(pixel)?;
        let point = Point::<Color>::new(u * depth_m, v * depth_m, depth_m);
        let mut by = Vec::with_capacity(motion.n_camera + 6);
        for (step, [high, low]) in &self.beside {
            let [dx, dy] = high.project(point)? - low.project(point)?;
            by.push([dx / (2.0 * step), dy / (2.0 * step)]);
        }
        let [x, y] = self.camera.d_pixel_d_point(point)?;
        let [x, y] = [x, y].map(|row| crate::pose::d_pixel_d_pose(row, &point.coords));
        by.extend((0..6).map(|k| [x[k], y[k]]));
        let size = by.len();
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for (i, a) in by.iter().enumerate() {
            for (j, b) in by.iter().enumerate() {
                let c = motion.covariance[i * size + j];
                xx += a[0] * c * b[0];
                xy += a[0] * c * b[1];
                yy += a[1] * c * b[1];
            }
        }
        let larger = 0.5 * (xx + yy + math::hypot(xx - yy, 2.0 * xy));
        Some(larger.max(0.0).sqrt())
    }
}
