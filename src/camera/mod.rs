//! Camera models: one file per model.
//!
//! A [`Camera`] is a pinhole ([`Intrinsics`]) with a [`Distortion`]. [`Camera::project`] takes a point in front of
//! the camera to the pixel where the lens draws it, [`Camera::unproject`] takes that pixel back to the direction it
//! came from; on each model's stated domain they undo each other.
//!
//! Not here: how parameters are found ([`calibrate`](crate::calibrate)), images.

mod brown;
mod intrinsics;
mod radial_table;

pub use brown::Brown;
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

impl Camera {
    /// The pixel where the lens draws this point; `None` at or behind the camera's plane (z ≤ 0) and outside the
    /// domain of the distortion model.
    pub fn project(&self, point: Point<Color>) -> Option<Pixel> {
        if !(point.z() > 0.0) {
            return None;
        }
        let [u, v] = [point.x() / point.z(), point.y() / point.z()];
        match &self.distortion {
            Distortion::None => Some(self.intrinsics.pixel_from_ray([u, v])),
            Distortion::Brown(brown) => {
                Some(self.intrinsics.pixel_from_ray(brown.distort([u, v])?))
            }
            Distortion::Table(tables) => tables.distort(self.intrinsics.pixel_from_ray([u, v])),
        }
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
