//! The normal equations of eight residuals at once.
//!
//! How many parameters there are is known when running, not when compiling: the sums go through memory in any case, and
//! one copy of this code serves problems of all sizes.

use fearless_simd::{Simd, f64x8, prelude::*};

use super::{BlockNormal, MAX_SHARED};

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

/// What goes to a [`BlockNormal`] in the end: eight sums of each of its numbers, whose order of addition is the same on
/// every processor.
pub(crate) struct Sums<I: Simd> {
    /// The lower triangle, row by row.
    products: Vec<f64x8<I>>,
    right: Vec<f64x8<I>>,
}

impl<I: Simd> Sums<I> {
    /// Of so many parameters.
    #[inline(always)]
    pub(crate) fn zero(simd: I, n: usize) -> Self {
        let zero = f64x8::splat(simd, 0.0);
        Self { products: vec![zero; n * (n + 1) / 2], right: vec![zero; n] }
    }

    /// Both coordinates of eight pixels.
    #[inline(always)]
    pub(crate) fn add(&mut self, [a, b]: &[Rows<I>; 2]) {
        let mut rest = &mut self.products[..];
        for (i, right) in self.right.iter_mut().enumerate() {
            let (wa, wb) = (a.weight * a.derivatives[i], b.weight * b.derivatives[i]);
            let (row, below) = rest.split_at_mut(i + 1);
            for ((sum, da), db) in row.iter_mut().zip(&a.derivatives).zip(&b.derivatives) {
                *sum += wa * *da + wb * *db;
            }
            *right += wa * a.residual + wb * b.residual;
            rest = below;
        }
    }

    /// The sums over all lanes.
    #[inline(always)]
    pub(crate) fn total(&self) -> Totals {
        Totals {
            products: self.products.iter().map(|s| sum(*s)).collect(),
            right: self.right.iter().map(|s| sum(*s)).collect(),
        }
    }
}

/// What [`Sums`] come to: the lower triangle row by row, and the right-hand side.
pub(crate) struct Totals {
    products: Vec<f64>,
    right: Vec<f64>,
}

impl Totals {
    /// Panics where they are of another number of parameters.
    pub(crate) fn add_to<const B: usize>(&self, normal: &mut BlockNormal<B>) {
        let n_shared = normal.n_shared();
        assert_eq!(self.right.len(), B + n_shared, "parameters");
        let mut products = self.products.iter();
        for (i, row) in normal.v.iter_mut().enumerate() {
            row[..=i].iter_mut().zip(&mut products).for_each(|(sum, product)| *sum += product);
        }
        for (i, by_block) in normal.w.iter_mut().enumerate() {
            let by_shared = &mut normal.u[i * n_shared..=i * n_shared + i];
            let row = by_block.iter_mut().chain(by_shared);
            row.zip(&mut products).for_each(|(sum, product)| *sum += product);
        }
        let right = normal.h.iter_mut().chain(&mut normal.g);
        right.zip(&self.right).for_each(|(sum, product)| *sum += product);
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
