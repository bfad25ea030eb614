//! The frames that can be confused. They are types without values.

/// The printed board: x along the first row of squares, y down the rows, z *into* the board (away from a viewer in
/// front of it), origin at the outer corner of the first square. OpenCV's convention from 4.6 on.
#[derive(Debug)]
pub enum Board {}

/// The colour camera: x right, y down, z forward out of the lens.
#[derive(Debug)]
pub enum Color {}

/// The depth camera, axes as [`Color`]. Apple delivers depth already registered to the colour camera, so the two
/// differ only where a recording is at fault.
#[derive(Debug)]
pub enum Depth {}
