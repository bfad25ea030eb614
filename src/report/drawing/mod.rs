//! What pictures that are pixels are drawn with: a canvas, letters, a colour map.

mod canvas;
mod letters;
mod plate;
mod viridis;

pub(in crate::report) use canvas::{Area, Canvas, Ink, mix, scaled};
pub(in crate::report) use plate::{Bar, HOLE, Panel, Plate, contact_sheet, is_light};
pub(in crate::report) use viridis::viridis;
