//! Loops compiled for the processor at hand.

use fearless_simd::{Level, dispatch};

/// Runs `kernel` in a copy compiled for the widest vectors that this processor has: the compiler makes vectors of its
/// plain loops.
///
/// The kernel and what it calls in its loops must be `#[inline(always)]`, or they are compiled for the oldest
/// processor after all. Results are the same on all processors: the order of floating-point operations is kept, and
/// none are fused.
#[inline(always)]
pub(crate) fn vectorized<R>(kernel: impl FnOnce() -> R) -> R {
    dispatch!(Level::new(), _simd => kernel())
}

/// Σ a·b of two slices of one length, in eight sums that the compiler makes vectors of.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (c + g)) + ((b + f) + (d + h)) + rest
}
