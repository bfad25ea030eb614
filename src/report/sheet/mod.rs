//! The printed target as files: PDF and SVG as shapes, PNG as pixels. All three show the same
//! [`Sheet`](crate::board::Sheet).

mod letters;
mod pdf;
mod raster;
mod svg;

pub use pdf::sheet_pdf;
pub use raster::{sheet_image, sheet_png};
pub use svg::sheet_svg;

/// A number with at most five digits after the point: 10 nm where it counts millimetres.
fn number(value: f64) -> String {
    let value = (value * 1e5).round() / 1e5;
    format!("{}", if value == 0.0 { 0.0 } else { value }) // Not −0.
}
