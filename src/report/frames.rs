//! Which frames are drawn, and how they are gone through: in batches on all cores, results in order.

use super::Error;
use crate::recording::Recording;

/// Frames worked on at once: bounds the memory, whatever the number of frames.
const BATCH: usize = 8;

/// The frames asked for, or all; an error names one that is not there.
pub(super) fn chosen(recording: &Recording, asked: Option<&[usize]>) -> Result<Vec<usize>, Error> {
    let n_frames = recording.frames.len();
    let Some(asked) = asked else { return Ok((0..n_frames).collect()) };
    match asked.iter().find(|frame| **frame >= n_frames) {
        Some(&frame) => {
            Err(Error::NoFrame { recording: recording.place().to_owned(), n_frames, frame })
        }
        None => Ok(asked.to_vec()),
    }
}

/// At most so many of them, spread evenly, first and last among them.
pub(super) fn spread(frames: &[usize], most: usize) -> Vec<usize> {
    if frames.len() <= most {
        return frames.to_vec();
    }
    (0..most).map(|i| frames[i * (frames.len() - 1) / (most - 1).max(1)]).collect()
}

/// Works on items in batches, on all cores, and hands the results on in order. The first error, in order, ends it.
pub(super) fn in_batches<I: Sync, T: Send, E: Send>(
    items: &[I],
    work: impl Fn(&I) -> Result<T, E> + Sync,
    mut take: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    for (batch, items) in items.chunks(BATCH).enumerate() {
        #[cfg(feature = "parallel")]
        let done: Vec<Result<T, E>> = {
            use rayon::prelude::{IntoParallelRefIterator, ParallelIterator};
            items.par_iter().map(&work).collect()
        };
        #[cfg(not(feature = "parallel"))]
        let done: Vec<Result<T, E>> = items.iter().map(&work).collect();
        for (index, result) in done.into_iter().enumerate() {
            take(batch * BATCH + index, result?)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_order_and_up_to_the_first_error() {
        let items: Vec<usize> = (0..50).collect();
        let mut seen = Vec::new();
        let error = in_batches(
            &items,
            |&i| if i == 30 || i == 31 { Err(i) } else { Ok(i * i) },
            |index, value| {
                assert_eq!(value, index * index);
                seen.push(index);
                Ok(())
            },
        );
        assert_eq!((error, seen), (Err(30), (0..30).collect()));
        assert_eq!(spread(&items, 3), [0, 24, 49]);
        assert_eq!(spread(&items[..2], 3), [0, 1]);
        assert_eq!(spread(&items, 1), [0]);
    }
}
