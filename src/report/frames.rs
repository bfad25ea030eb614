//! Which frames are drawn, and how they are gone through: in batches on all cores, results in order.

use super::Error;
use crate::{par, recording::Recording};

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

/// Works on frames in batches, on all cores, and hands the results on in order. The first error, in order, ends it.
pub(super) fn in_batches<T: Send>(
    frames: &[usize],
    work: impl Fn(&usize) -> Result<T, Error> + Sync,
    take: impl FnMut(usize, T) -> Result<(), Error>,
) -> Result<(), Error> {
    par::try_batches(frames, BATCH, work, take)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evenly_spread() {
        let items: Vec<usize> = (0..50).collect();
        assert_eq!(spread(&items, 3), [0, 24, 49]);
        assert_eq!(spread(&items[..2], 3), [0, 1]);
        assert_eq!(spread(&items, 1), [0]);
    }
}
