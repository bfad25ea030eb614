//! Independent things done side by side.

/// The results of `one` for all items, in their order; on all cores where the feature `parallel` is on.
#[cfg(feature = "parallel")]
pub(crate) fn abreast<T: Sync, R: Send>(items: &[T], one: impl Fn(&T) -> R + Sync) -> Vec<R> {
    use rayon::prelude::{IntoParallelRefIterator, ParallelIterator};
    // Items are few and long: each is a task of its own.
    items.par_iter().map(&one).collect()
}

/// The results of `one` for all items, in their order; on all cores where the feature `parallel` is on.
#[cfg(not(feature = "parallel"))]
pub(crate) fn abreast<T, R>(items: &[T], one: impl Fn(&T) -> R) -> Vec<R> {
    items.iter().map(one).collect()
}

/// The results of both.
#[cfg(feature = "parallel")]
pub(crate) fn both<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    rayon::join(a, b)
}

/// The results of both.
#[cfg(not(feature = "parallel"))]
pub(crate) fn both<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
    (a(), b())
}
