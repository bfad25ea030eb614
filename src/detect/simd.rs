//! Loops compiled for the processor at hand.

use fearless_simd::{Level, dispatch};

/// Runs `kernel` in a copy compiled for the widest vectors that this processor has: the compiler makes vectors of its
/// plain loops.
///
/// The kernel and what it calls in its loops must be `#[inline(always)]`, or they are compiled for the oldest
/// processor after all. Results are the same on all processors: the order of floating-point operations is kept, and
/// none are fused.
#[inline(always)]
pub(super) fn vectorized<R>(kernel: impl FnOnce() -> R) -> R {
    dispatch!(Level::new(), _simd => kernel())
}
