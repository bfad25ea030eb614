//! The same work on one core or on all of them, in narrow vectors or in wide ones, with the same result.
//!
//! Results come in the order of the items whatever the threads did, and the error that is reported is that of the first
//! failing item in that order. Without the feature `parallel` everything runs on the calling thread.
//!
//! Not here: loops written for one width of vectors; they take the `Simd` of `fearless_simd` themselves.

use std::{
    iter::Sum,
    ops::{Add, AddAssign, Mul},
    sync::atomic::{AtomicUsize, Ordering},
};

use fearless_simd::{Level, dispatch};

/// The results of `one` for all items, in their order. Each item is a task of its own: items are few and long.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], one: impl Fn(&T) -> R + Sync) -> Vec<R> {
    indexed(items, |_, item| one(item))
}

/// The results of `one` for all items, in their order, or the error of the first item that fails.
///
/// No item is begun once one before it has failed, so that a failure costs no more than what is under way.
pub(crate) fn try_map<T: Sync, R: Send, E: Send>(
    items: &[T],
    one: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    until_failure(items, one).into_iter().flatten().collect()
}

/// As [`try_map`], `size` items at a time: hands their results on in order, with their indices, up to the first error.
/// What is in memory does not grow with the number of items.
pub(crate) fn try_batches<T: Sync, R: Send, E: Send>(
    items: &[T],
    size: usize,
    one: impl Fn(&T) -> Result<R, E> + Sync,
    mut take: impl FnMut(usize, R) -> Result<(), E>,
) -> Result<(), E> {
    for (batch, items) in items.chunks(size).enumerate() {
        let results = until_failure(items, &one).into_iter().flatten();
        for (index, result) in results.enumerate() {
            take(batch * size + index, result?)?;
        }
    }
    Ok(())
}

/// The results of both.
pub(crate) fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    #[cfg(feature = "parallel")]
    return rayon::join(a, b);
    #[cfg(not(feature = "parallel"))]
    (a(), b())
}

/// Calls `one` with each chunk of `size` values, the last may be shorter, and its index.
pub(crate) fn for_each_chunk<T: Send>(
    values: &mut [T],
    size: usize,
    one: impl Fn(usize, &mut [T]) + Sync,
) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        values.par_chunks_mut(size).enumerate().for_each(|(index, chunk)| one(index, chunk));
    }
    #[cfg(not(feature = "parallel"))]
    values.chunks_mut(size).enumerate().for_each(|(index, chunk)| one(index, chunk));
}

/// The results of `one` for all items and their indices.
fn indexed<T: Sync, R: Send>(items: &[T], one: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.par_iter().enumerate().map(|(index, item)| one(index, item)).collect()
    }
    #[cfg(not(feature = "parallel"))]
    items.iter().enumerate().map(|(index, item)| one(index, item)).collect()
}

/// The results of `one`; `None` only behind the first error.
fn until_failure<T: Sync, R: Send, E: Send>(
    items: &[T],
    one: impl Fn(&T) -> Result<R, E> + Sync,
) -> Vec<Option<Result<R, E>>> {
    // All items before the first failure known so far are still done: one of them may fail too.
    let first_failure = AtomicUsize::new(usize::MAX);
    indexed(items, |index, item| {
        if index > first_failure.load(Ordering::Relaxed) {
            return None;
        }
        let result = one(item);
        if result.is_err() {
            first_failure.fetch_min(index, Ordering::Relaxed);
        }
        Some(result)
    })
}

/// Runs `work` on so many threads.
#[cfg(test)]
pub(crate) fn on_threads<R: Send>(n: usize, work: impl FnOnce() -> R + Send) -> R {
    #[cfg(feature = "parallel")]
    return rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(work);
    #[cfg(not(feature = "parallel"))]
    (n, work()).1
}

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
pub(crate) fn dot<T>(a: &[T], b: &[T]) -> T
where
    T: Copy + Default + Add<Output = T> + AddAssign + Mul<Output = T> + Sum,
{
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [T::default(); 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: T = a_rest.iter().zip(b_rest).map(|(&a, &b)| a * b).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (c + g)) + ((b + f) + (d + h)) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The square, but 30, 31 and 45 fail.
    fn square(&i: &usize) -> Result<usize, usize> {
        if [30, 31, 45].contains(&i) { Err(i) } else { Ok(i * i) }
    }

    #[test]
    fn in_order_and_up_to_the_first_error() {
        let items: Vec<usize> = (0..50).collect();
        for threads in [1, 3] {
            on_threads(threads, || {
                assert_eq!(map(&items, |i| 2 * i), (0..50).map(|i| 2 * i).collect::<Vec<_>>());
                assert_eq!(try_map(&items, square), Err(30));
                assert_eq!(try_map(&items[..30], square).unwrap()[29], 29 * 29);
                for size in [1, 8, 100] {
                    let mut seen = Vec::new();
                    let error = try_batches(&items, size, square, |index, value| {
                        assert_eq!(value, index * index);
                        seen.push(index);
                        Ok(())
                    });
                    assert_eq!((error, seen), (Err(30), (0..30).collect()), "{size}");
                }
                assert_eq!(join(|| 1, || "b"), (1, "b"));
                let mut values = [1; 10];
                for_each_chunk(&mut values, 4, |index, chunk| chunk.fill(chunk.len() * index));
                assert_eq!(values, [0, 0, 0, 0, 4, 4, 4, 4, 4, 4]);
            });
        }
    }

    #[test]
    fn nothing_is_begun_after_a_failure() {
        let begun = AtomicUsize::new(0);
        let failing = |&i: &usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            if i == 3 { Err(i) } else { Ok(i) }
        };
        let items: Vec<usize> = (0..1000).collect();
        assert_eq!(on_threads(1, || try_map(&items, failing)), Err(3));
        assert_eq!(begun.into_inner(), 4);
    }

    #[test]
    fn a_dot_product() {
        let a: Vec<f64> = (0..19).map(f64::from).collect();
        assert_eq!(dot(&a, &a), (0..19).map(|i| f64::from(i * i)).sum::<f64>());
    }
}
