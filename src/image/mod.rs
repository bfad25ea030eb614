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

use crate::par::vectorized;

/// Adds every pixel, converted. Pixels are many: as vectors, which `convert` is part of where it is
/// `#[inline(always)]`.
fn extend<A: Copy, B: Copy + Default>(out: &mut Vec<B>, pixels: &[A], convert: impl Fn(A) -> B) {
    let start = out.len();
    out.resize(start + pixels.len(), B::default());
    let out = &mut out[start..];
    vectorized(
        #[inline(always)]
        || {
            for (out, &pixel) in out.iter_mut().zip(pixels) {
                *out = convert(pixel);
            }
        },
    );
}

/// Every row the other way round.
fn mirrored<T: Copy>(width: usize, pixels: &[T]) -> Vec<T> {
    pixels.chunks(width.max(1)).flat_map(|row| row.iter().rev().copied()).collect()
}
