//! Points, pixels, poses and homographies, with frames as types.
//!
//! A [`Pose<A, B>`] takes coordinates of frame `B` to coordinates of frame `A` and is named `a_from_b`; poses compose
//! only where the frames meet, so that a wrong order does not compile.
//!
//! ```
//! use truedepth::geom::{Board, Color, Point, Pose, Rotation, Vector3};
//!
//! let color_from_board: Pose<Color, Board> = Pose::new(Rotation::identity(), Vector3::new(0.0, 0.0, 0.2));
//! let corner: Point<Board> = Point::new(0.02, 0.04, 0.0);
//! let seen: Point<Color> = color_from_board * corner;
//! assert_eq!(seen.z(), 0.2);
//! ```
//!
//! Not here: cameras, images, anything that knows a pixel's value.

mod frame;
mod homography;
mod pixel;
mod point;
mod pose;

pub use frame::{Board, Color, Depth};
pub use homography::Homography;
pub use nalgebra::{Matrix3, Vector3};
pub use pixel::Pixel;
pub use point::Point;
pub use pose::{Pose, Rotation};
