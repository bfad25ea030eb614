//! The normal equations of eight residuals at once.
//!
//! How many parameters there are is known when running, not when compiling: the sums go through memory in any case, and
//! one copy of this code serves problems of all sizes.

use fearless_simd::{Simd, f64x8, prelude::*};

use super::MAX_SHARED;

/// So many residuals lie side by side.
pub(crate) const LANES: usize = 8;

/// A residual depends on so many parameters at the most, those of its block and the shared ones together.
pub(crate) const MAX_PARAMETERS: usize = MAX_SHARED + 12;

/// As [`Row`](super::Row), of eight residuals side by side. The derivatives are those by the block's parameters, then
/// those by the shared ones; what lies behind them does not count.
#[derive(Clone, Copy)]
pub(crate) struct Rows<I: Simd> {
    pub(crate) weight: f64x8<I>,
    pub(crate) residual: f64x8<I>,
    pub(crate) derivatives: [f64x8<I>; MAX_PARAMETERS],
}

/// What goes to a [`BlockNormal`](super::BlockNormal) in the end: eight sums of each of its numbers, whose order of
/// addition is the same on every processor.
pub(crate) struct Sums<I: Simd> {
    /// The lower triangle, row by row.
    products: Vec<f64x8<I>>,
    right: [f64x8<I>; MAX_PARAMETERS],
    n: usize,
}

impl<I: Simd> Sums<I> {
    /// Of so many parameters.
    #[inline(always)]
    pub(crate) fn zero(simd: I, n: usize) -> Self {
        let zero = f64x8::splat(simd, 0.0);
        Self { products: vec![zero; n * (n + 1) / 2], right: [zero; MAX_PARAMETERS], n }
    }

    /// Both coordinates of eight pixels.
    #[inline(always)]
    pub(crate) fn add(&mut self, [a, b]: &[Rows<I>; 2]) {
        let mut rest = &mut self.products[..];
        let weighted = |i: usize| (a.weight * a.derivatives[i], b.weight * b.derivatives[i]);
        // Two rows of the triangle at a time: derivatives are loaded once for both.
        for i in (0..self.n - self.n % 2).step_by(2) {
            let ((wa, wb), (va, vb)) = (weighted(i), weighted(i + 1));
            let (row, below) = rest.split_at_mut(i + 1);
            let (next, below) = below.split_at_mut(i + 2);
            let derivatives = a.derivatives.iter().zip(&b.derivatives);
            for ((sum, next), (da, db)) in row.iter_mut().zip(&mut *next).zip(derivatives) {
                *sum += wa * *da + wb * *db;
                *next += va * *da + vb * *db;
            }
            next[i + 1] += va * a.derivatives[i + 1] + vb * b.derivatives[i + 1];
            self.right[i] += wa * a.residual + wb * b.residual;
            self.right[i + 1] += va * a.residual + vb * b.residual;
            rest = below;
        }
        if let (Some(i), false) = (self.n.checked_sub(1), self.n.is_multiple_of(2)) {
            let (wa, wb) = weighted(i);
            for ((sum, da), db) in rest.iter_mut().zip(&a.derivatives).zip(&b.derivatives) {
                *sum += wa * *da + wb * *db;
            }
            self.right[i] += wa * a.residual + wb * b.residual;
        }
    }

    /// Adds the sums over all lanes.
    ///
    /// Panics where they are of another number of parameters.
    #[inline(always)]
    pub(crate) fn add_to(&self, normal: &mut NormalParts<'_>) {
        let (n_block, n_shared) = (normal.h.len(), normal.g.len());
        assert_eq!(self.n, n_block + n_shared, "parameters");
        let mut products = self.products.iter();
        let mut add = |to: &mut [f64]| {
            to.iter_mut().zip(&mut products).for_each(|(to, lanes)| *to += sum(*lanes));
        };
        for i in 0..n_block {
            add(&mut normal.v[i * n_block..][..=i]);
        }
        for i in 0..n_shared {
            add(&mut normal.w[i * n_block..][..n_block]);
            add(&mut normal.u[i * n_shared..][..=i]);
        }
        let right = normal.h.iter_mut().chain(&mut *normal.g);
        right.zip(&self.right).for_each(|(to, lanes)| *to += sum(*lanes));
    }
}

/// The numbers of a [`BlockNormal`](super::BlockNormal), whatever the number of its parameters; matrices row by row.
pub(crate) struct NormalParts<'a> {
    pub(super) u: &'a mut [f64],
    pub(super) w: &'a mut [f64],
    pub(super) v: &'a mut [f64],
    pub(super) g: &'a mut [f64],
    pub(super) h: &'a mut [f64],
}

/// The sum of all lanes.
#[inline(always)]
pub(crate) fn sum<I: Simd>(lanes: f64x8<I>) -> f64 {
    let (low, high) = lanes.split();
    let (low, high) = (low + high).split();
    let pair = low + high;
    pair[0] + pair[1]
}
