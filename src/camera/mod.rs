//! Camera models: one file per model.
//!
//! A [`Camera`] is a pinhole ([`Intrinsics`]) with a [`Distortion`]. [`Camera::project`] takes a point in front of
//! the camera to the pixel where the lens draws it, [`Camera::unproject`] takes that pixel back to the direction it
//! came from; on each model's stated domain they undo each other.
//!
//! ```
//! use truedepth::camera::{Brown, Camera, Distortion, Intrinsics};
//! use truedepth::geom::Point;
//!
//! let intrinsics = Intrinsics { fx: 436.5, fy: 436.5, cx: 321.6, cy: 239.5, width: 640, height: 480 };
//! let lens = Brown { k1: 0.07, k2: -0.1, p1: 1e-3, p2: -1e-3, k3: 0.02 };
//! let camera = Camera { intrinsics, distortion: Distortion::Brown(lens) };
//! let pixel = camera.project(Point::new(0.05, -0.03, 0.2)).expect("in front of the camera");
//! let [x, y] = camera.unproject(pixel).expect("inside the lens's domain");
//! assert!((x - 0.25).abs() < 1e-12 && (y + 0.15).abs() < 1e-12);
//! ```
//!
//! Not here: how parameters are found ([`calibrate`](crate::calibrate)), images.

mod brown;
mod intrinsics;
mod radial_table;

pub use brown::Brown;
pub(crate) use brown::Real;
pub use intrinsics::Intrinsics;
pub use radial_table::{RadialTable, TablePair};

use crate::geom::{Color, Pixel, Point};

/// How the lens bends a straight line.
#[derive(Clone, Debug, PartialEq)]
pub enum Distortion {
    /// Not at all: the image is rectified.
    None,
    /// Brown-Conrady polynomials.
    Brown(Brown),
    /// Apple's radial lookup tables.
    Table(TablePair),
}

/// A pinhole camera with lens distortion.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The pinhole.
    pub intrinsics: Intrinsics,
    /// The lens.
    pub distortion: Distortion,
}

/// A camera for images of another size.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the calibration given is for images of {}x{} pixels, {recording} has {}x{}: give one made at that size",
    .given[0], .given[1], .size[0], .size[1]
)]
pub struct OtherSize {
    /// Where the recording is.
    pub recording: String,
    /// Columns and rows of the camera given.
    pub given: [usize; 2],
    /// Columns and rows of the images.
    pub size: [usize; 2],
}

/// A camera model that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A lookup table with fewer than two samples.
    #[error(
        "a lens distortion table with {n_samples} samples; it needs at least 2 (Apple's have 42)"
    )]
    TableTooShort {
        /// How many there are.
        n_samples: usize,
    },
    /// A radius that is not positive.
    #[error("a lens distortion table up to a radius of {max_radius_px} px; it must be positive")]
    TableRadius {
        /// As given.
        max_radius_px: f64,
    },
    /// A centre that is no place.
    #[error("a lens distortion table about ({x_px}, {y_px}) px; both must be numbers")]
    TableCenter {
        /// As given.
        x_px: f64,
        /// As given.
        y_px: f64,
    },
    /// A sample that is no number.
    #[error("sample {index} of a lens distortion table is {value}; it must be a number")]
    TableSample {
        /// Position in the table, from 0.
        index: usize,
        /// As given.
        value: f64,
    },
    /// A table that maps two pixels to one place.
    #[error("a lens distortion table folds the image over at {radius_px:.1} px from its centre")]
    TableFolds {
        /// Where the fold begins.
        radius_px: f64,
    },
}

impl Camera {
    /// The same camera for images of another size, as [`Intrinsics::at_size`].
    pub fn at_size(&self, size: [usize; 2]) -> Self {
        let Intrinsics { width, height, .. } = self.intrinsics;
        let scale = [size[0] as f64 / width as f64, size[1] as f64 / height as f64];
        let distortion = match &self.distortion {
            Distortion::Table(tables) => Distortion::Table(tables.at_scale(scale, size)),
            // Polynomials are of rays, whatever the pixels.
            other => other.clone(),
        };
        Self { intrinsics: self.intrinsics.at_size(size), distortion }
    }

    /// Refuses images of another size than it is for; `recording` names them in the error.
    pub fn check_size(&self, size: [usize; 2], recording: &str) -> Result<(), OtherSize> {
        let given = [self.intrinsics.width, self.intrinsics.height];
        if given == size {
            return Ok(());
        }
        Err(OtherSize { recording: recording.to_owned(), given, size })
    }

    /// The pixel where the lens draws this point; `None` at or behind the camera's plane (z ≤ 0) and outside the
    /// domain of the distortion model.
    pub fn project(&self, point: Point<Color>) -> Option<Pixel> {
        if !(point.z() > 0.0) {
            return None;
        }
        self.project_ray([point.x() / point.z(), point.y() / point.z()])
    }

    /// The pixel where the lens draws this direction (x/z, y/z); `None` outside the domain of the distortion model.
    pub fn project_ray(&self, ray: [f64; 2]) -> Option<Pixel> {
        match &self.distortion {
            Distortion::None => Some(self.intrinsics.pixel_from_ray(ray)),
            Distortion::Brown(brown) => Some(self.intrinsics.pixel_from_ray(brown.distort(ray)?)),
            Distortion::Table(tables) => tables.distort(self.intrinsics.pixel_from_ray(ray)),
        }
    }

    /// The pixel of [`project`](Self::project) and its partial derivatives (rows x, y, pixels) by the point (columns
    /// x, y, z, metres); `None` where there is no projection.
    pub fn project_with_jacobian(&self, point: Point<Color>) -> Option<(Pixel, [[f64; 3]; 2])> {
        let z = point.z();
        if !(z > 0.0) {
            return None;
        }
        let ray @ [u, v] = [point.x() / z, point.y() / z];
        let Intrinsics { fx, fy, .. } = self.intrinsics;
        let (pixel, [[a, b], [c, d]]) = match &self.distortion {
            Distortion::None => (self.intrinsics.pixel_from_ray(ray), [[fx, 0.0], [0.0, fy]]),
            Distortion::Brown(brown) => {
                let pixel = self.intrinsics.pixel_from_ray(brown.distort(ray)?);
                let [[a, b], [c, d]] = brown.d_distorted_d_ray(ray);
                (pixel, [[fx * a, fx * b], [fy * c, fy * d]])
            }
            Distortion::Table(tables) => {
                let straight = self.intrinsics.pixel_from_ray(ray);
                let (pixel, [[a, b], [c, d]]) = tables.inverse.invert_with_jacobian(straight)?;
                (pixel, [[a * fx, b * fy], [c * fx, d * fy]])
            }
        };
        let jacobian = [[a / z, b / z, -(a * u + b * v) / z], [c / z, d / z, -(c * u + d * v) / z]];
        Some((pixel, jacobian))
    }

    /// The partial derivatives of [`project_with_jacobian`](Self::project_with_jacobian) alone.
    pub fn d_pixel_d_point(&self, point: Point<Color>) -> Option<[[f64; 3]; 2]> {
        Some(self.project_with_jacobian(point)?.1)
    }

    /// The direction (x/z, y/z) that the lens draws at this pixel; `None` outside the domain of the distortion
    /// model.
    pub fn unproject(&self, pixel: Pixel) -> Option<[f64; 2]> {
        match &self.distortion {
            Distortion::None => Some(self.intrinsics.ray_from_pixel(pixel)),
            Distortion::Brown(brown) => brown.undistort(self.intrinsics.ray_from_pixel(pixel)),
            Distortion::Table(tables) => {
                Some(self.intrinsics.ray_from_pixel(tables.undistort(pixel)?))
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::needless_range_loop, reason = "rows and columns of a Jacobian read as such")]
mod tests {
    use super::*;
    use crate::math;

    /// Every model with all of its numbers at work.
    fn battery() -> Vec<Camera> {
        let intrinsics =
            Intrinsics { fx: 436.5, fy: 441.25, cx: 321.6, cy: 238.4, width: 640, height: 480 };
        let center = Pixel::new(324.1, 236.9);
        let magnification =
            (0..42).map(|i| -0.002 + 0.06 * (f64::from(i) / 41.0).powi(3)).collect();
        let max_radius_px = RadialTable::farthest_corner_px(center, 640, 480);
        let inverse = RadialTable::new(center, max_radius_px, magnification).unwrap();
        [
            Distortion::None,
            Distortion::Brown(Brown { k1: 0.07, k2: -0.11, p1: 0.002, p2: -0.0015, k3: 0.03 }),
            Distortion::Brown(Brown { k1: -0.3, k2: 0.1, p1: -0.001, p2: 0.002, k3: -0.01 }),
            Distortion::Table(TablePair::from_inverse(inverse)),
        ]
        .into_iter()
        .map(|distortion| Camera { intrinsics, distortion })
        .collect()
    }

    /// Points in front of the camera that fill the image and a rim round it.
    fn points() -> impl Iterator<Item = Point<Color>> {
        [0.2, 0.33, 1.5].into_iter().flat_map(|z| {
            (-6..=6).flat_map(move |i| {
                (-5..=5).map(move |j| {
                    Point::new(
                        (f64::from(i) * 0.13 + 0.01) * z,
                        (f64::from(j) * 0.12 - 0.01) * z,
                        z,
                    )
                })
            })
        })
    }

    #[test]
    fn unproject_undoes_project() {
        for camera in battery() {
            for point in points() {
                let pixel = camera.project(point).expect("in the domain");
                let [u, v] = camera.unproject(pixel).expect("in the domain");
                let error = math::hypot(u - point.x() / point.z(), v - point.y() / point.z());
                assert!(error < 1e-12, "{camera:?} {point:?}: {error}");
            }
        }
    }

    #[test]
    fn project_undoes_unproject() {
        for camera in battery() {
            for (x, y) in (0..=16).flat_map(|i| (0..=12).map(move |j| (i * 40, j * 40))) {
                let pixel = Pixel::new(f64::from(x) - 0.5, f64::from(y) - 0.5);
                let [u, v] = camera.unproject(pixel).expect("in the domain");
                let again = camera.project(Point::new(u, v, 1.0)).expect("in the domain");
                assert!(again.distance(pixel) < 1e-9, "{camera:?} {pixel:?}");
            }
        }
    }

    #[test]
    fn jacobian_matches_differences() {
        for camera in battery() {
            for point in points() {
                let (pixel, analytic) = camera.project_with_jacobian(point).expect("in the domain");
                assert_eq!(Some(pixel), camera.project(point));
                let h = 1e-7 * point.z();
                for column in 0..3 {
                    let [low, high] = [-h, h].map(|h| {
                        let mut moved = point;
                        moved.coords[column] += h;
                        camera.project(moved).expect("in the domain")
                    });
                    let numeric = [(high.x - low.x) / (2.0 * h), (high.y - low.y) / (2.0 * h)];
                    for row in 0..2 {
                        let error = (analytic[row][column] - numeric[row]).abs() * point.z();
                        assert!(error < 1e-4, "{camera:?} {point:?} {row} {column}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_behind_the_camera() {
        for camera in battery() {
            for z in [0.0, -0.2, f64::NAN] {
                assert!(camera.project(Point::new(0.01, 0.01, z)).is_none());
                assert!(camera.project_with_jacobian(Point::new(0.01, 0.01, z)).is_none());
            }
        }
    }
}
