//! Loops compiled for the processor at hand.

use std::{
    iter::Sum,
    ops::{AddAssign, Mul},
};

pub(super) use crate::solve::vectorized;

/// Σ a·b of two slices of one length, in eight sums that the compiler makes vectors of.
#[inline(always)]
pub(super) fn dot<T>(a: &[T], b: &[T]) -> T
where
    T: Copy + Default + AddAssign + Mul<Output = T> + Sum,
{
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [T::default(); 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: T = a_rest.iter().zip(b_rest).map(|(&a, &b)| a * b).sum();
    [sums.into_iter().sum(), rest].into_iter().sum()
}
