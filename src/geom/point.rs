//! A position in space, in the coordinates of a frame.

use std::{fmt, marker::PhantomData};

use nalgebra::Vector3;

/// A position in the coordinates of frame `F`, metres.
pub struct Point<F> {
    /// x, y, z in metres.
    pub coords: Vector3<f64>,
    frame: PhantomData<fn() -> F>,
}

impl<F> Point<F> {
    /// The point at (`x`, `y`, `z`) metres.
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { coords: Vector3::new(x, y, z), frame: PhantomData }
    }

    /// The point with these coordinates, metres.
    pub const fn from_coords(coords: Vector3<f64>) -> Self {
        Self { coords, frame: PhantomData }
    }

    /// x, metres.
    pub fn x(&self) -> f64 {
        self.coords.x
    }

    /// y, metres.
    pub fn y(&self) -> f64 {
        self.coords.y
    }

    /// z, metres.
    pub fn z(&self) -> f64 {
        self.coords.z
    }
}

// By hand: a derive would ask the same of the frame, which has no values.
impl<F> Clone for Point<F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F> Copy for Point<F> {}
impl<F> PartialEq for Point<F> {
    fn eq(&self, other: &Self) -> bool {
        self.coords == other.coords
    }
}
impl<F> fmt::Debug for Point<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}, {}, {}) m", self.coords.x, self.coords.y, self.coords.z)
    }
}
