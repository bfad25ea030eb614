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

// What is inlined into vectors is a function, as a closure bound to a name cannot be `#[inline(always)]`.
impl<I: Simd> Rows<I> {
    #[inline(always)]
    fn weighted(&self, i: usize) -> f64x8<I> {
        self.weight * self.derivatives[i]
    }
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
        // Two rows of the triangle at a time: derivatives are loaded once for both.
        for i in (0..self.n - self.n % 2).step_by(2) {
            let [wa, va] = [a.weighted(i), a.weighted(i + 1)];
            let [wb, vb] = [b.weighted(i), b.weighted(i + 1)];
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
            let (wa, wb) = (a.weighted(i), b.weighted(i));
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
        for i in 0..n_block {
            add_sums(&mut normal.v[i * n_block..][..=i], &mut products);
        }
        for i in 0..n_shared {
            add_sums(&mut normal.w[i * n_block..][..n_block], &mut products);
            add_sums(&mut normal.u[i * n_shared..][..=i], &mut products);
        }
        let mut right = self.right.iter();
        add_sums(normal.h, &mut right);
        add_sums(normal.g, &mut right);
    }
}

/// Adds the sum of the next lanes to each number.
#[inline(always)]
fn add_sums<I: Simd>(to: &mut [f64], lanes: &mut std::slice::Iter<'_, f64x8<I>>) {
    for (to, lanes) in to.iter_mut().zip(lanes) {
        *to += sum(*lanes);
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
