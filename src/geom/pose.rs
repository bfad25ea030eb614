//! Rigid transformations between frames.

use std::{fmt, marker::PhantomData, ops::Mul};

use nalgebra::Vector3;

use super::Point;

/// A rotation in space, as an orthonormal matrix.
pub type Rotation = nalgebra::Rotation3<f64>;

/// Takes coordinates in `B` to coordinates in `A`; name the value `a_from_b`.
///
/// ```text
/// x_A = R · x_B + t
/// ```
///
/// The wrong order does not compile:
///
/// ```compile_fail
/// use truedepth::geom::{Board, Color, Depth, Pose};
/// fn wrong(color_from_board: Pose<Color, Board>, depth_from_color: Pose<Depth, Color>) {
///     let _ = color_from_board * depth_from_color;
/// }
/// ```
pub struct Pose<A, B> {
    /// The rotational part.
    pub rotation: Rotation,
    /// The translational part, metres: where the origin of `B` lies in `A`.
    pub translation: Vector3<f64>,
    frames: PhantomData<fn(B) -> A>,
}

impl<A, B> Pose<A, B> {
    /// The pose with this rotation and translation (metres).
    pub const fn new(rotation: Rotation, translation: Vector3<f64>) -> Self {
        Self { rotation, translation, frames: PhantomData }
    }

    /// The pose that changes no coordinates.
    pub fn identity() -> Self {
        Self::new(Rotation::identity(), Vector3::zeros())
    }

    /// Takes coordinates in `A` to coordinates in `B`.
    pub fn inverse(&self) -> Pose<B, A> {
        let rotation = self.rotation.inverse();
        Pose::new(rotation, -(rotation * self.translation))
    }
}

impl<A, B> Mul<Point<B>> for Pose<A, B> {
    type Output = Point<A>;
    fn mul(self, point: Point<B>) -> Point<A> {
        Point::from_coords(self.rotation * point.coords + self.translation)
    }
}

impl<A, B, C> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;
    fn mul(self, other: Pose<B, C>) -> Pose<A, C> {
        Pose::new(
            self.rotation * other.rotation,
            self.rotation * other.translation + self.translation,
        )
    }
}

// By hand: a derive would ask the same of the frames, which have no values.
impl<A, B> Clone for Pose<A, B> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A, B> Copy for Pose<A, B> {}
impl<A, B> fmt::Debug for Pose<A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pose")
            .field("rotation_vector_rad", &self.rotation.scaled_axis().as_slice())
            .field("translation_m", &self.translation.as_slice())
            .finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Board, Color};

    #[test]
    fn inverse_undoes() {
        let color_from_board: Pose<Color, Board> = Pose::new(
            Rotation::from_scaled_axis(Vector3::new(0.3, -0.8, 1.1)),
            Vector3::new(0.1, 0.2, 0.3),
        );
        let p: Point<Board> = Point::new(0.5, -0.25, 0.125);
        let back = color_from_board.inverse() * (color_from_board * p);
        assert!((back.coords - p.coords).norm() < 1e-15);
        let same = color_from_board.inverse() * color_from_board;
        assert!(same.rotation.angle() < 1e-12 && same.translation.norm() < 1e-15);
    }
}
