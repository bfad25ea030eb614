//! The normal equations of eight residuals at once.

use fearless_simd::{Simd, f64x8, prelude::*};

use super::BlockNormal;

/// So many residuals lie side by side.
pub(crate) const LANES: usize = 8;

/// As [`Row`](super::Row), of eight residuals side by side.
#[derive(Clone, Copy)]
pub(crate) struct Rows<I: Simd, const S: usize, const B: usize> {
    pub(crate) weight: f64x8<I>,
    pub(crate) residual: f64x8<I>,
    pub(crate) d_shared: [f64x8<I>; S],
    pub(crate) d_block: [f64x8<I>; B],
}

/// What goes to a [`BlockNormal`] in the end: eight sums of each of its numbers, whose order of addition is the same on
/// every processor.
pub(crate) struct Sums<I: Simd, const S: usize, const B: usize> {
    u: [[f64x8<I>; S]; S],
    w: [[f64x8<I>; B]; S],
    v: [[f64x8<I>; B]; B],
    g: [f64x8<I>; S],
    h: [f64x8<I>; B],
}

impl<I: Simd, const S: usize, const B: usize> Sums<I, S, B> {
    #[inline(always)]
    pub(crate) fn zero(simd: I) -> Self {
        let zero = f64x8::splat(simd, 0.0);
        Self { u: [[zero; S]; S], w: [[zero; B]; S], v: [[zero; B]; B], g: [zero; S], h: [zero; B] }
    }

    /// Both coordinates of eight pixels.
    #[inline(always)]
    pub(crate) fn add(&mut self, [a, b]: &[Rows<I, S, B>; 2]) {
        for i in 0..B {
            let (wa, wb) = (a.weight * a.d_block[i], b.weight * b.d_block[i]);
            for j in 0..=i {
                self.v[i][j] += wa * a.d_block[j] + wb * b.d_block[j];
            }
            self.h[i] += wa * a.residual + wb * b.residual;
        }
        for i in 0..S {
            let (wa, wb) = (a.weight * a.d_shared[i], b.weight * b.d_shared[i]);
            for j in 0..B {
                self.w[i][j] += wa * a.d_block[j] + wb * b.d_block[j];
            }
            for j in 0..=i {
                self.u[i][j] += wa * a.d_shared[j] + wb * b.d_shared[j];
            }
            self.g[i] += wa * a.residual + wb * b.residual;
        }
    }

    #[inline(always)]
    pub(crate) fn add_to(&self, normal: &mut BlockNormal<S, B>) {
        for i in 0..B {
            for j in 0..=i {
                normal.v[i][j] += sum(self.v[i][j]);
            }
            normal.h[i] += sum(self.h[i]);
        }
        for i in 0..S {
            for j in 0..B {
                normal.w[i][j] += sum(self.w[i][j]);
            }
            for j in 0..=i {
                normal.u[i][j] += sum(self.u[i][j]);
            }
            normal.g[i] += sum(self.g[i]);
        }
    }
}

/// The sum of all lanes.
#[inline(always)]
pub(crate) fn sum<I: Simd>(lanes: f64x8<I>) -> f64 {
    let (low, high) = lanes.split();
    let (low, high) = (low + high).split();
    let pair = low + high;
    pair[0] + pair[1]
}
