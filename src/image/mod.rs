//! Grey, colour and depth images, and how to sample them.
//!
//! Images are row-major with the origin at the centre of the top-left pixel. A [`DepthMap`] holds metres, and NaN
//! where nothing was measured: never 0, so that arithmetic cannot mistake a hole for a distance.
//!
//! Not here: files (bytes in, bytes out in `codec`), what the pixels show.

mod animation;
mod codec;
mod depth_map;
mod gray;
mod jpeg;
mod rgb;
mod unfiltered;

pub use animation::animated_png;
pub use codec::{Error, Limits};
pub use depth_map::DepthMap;
pub use gray::Gray;
pub use rgb::Rgb;

/// Every row the other way round.
fn mirrored<T: Copy>(width: usize, pixels: &[T]) -> Vec<T> {
    pixels.chunks(width.max(1)).flat_map(|row| row.iter().rev().copied()).collect()
}
