//! Which frames are kept in full: those whose views differ most.

use super::FrameMeasurement;
use crate::{
    board::CharucoBoard,
    detect::cells_and_pixels,
    geom::{Homography, Pixel},
};

/// So many frames with the board are kept in full, whatever the length of the recording: twice what a calibration
/// takes. Of more, those whose views differ most.
pub const MAX_FRAMES_IN_FULL: usize = 240;

/// Frames are thinned out in lots: so many may be kept beyond.
const LOT: usize = 64;

/// Where the four outer corners of a board are seen: two frames that show them at the same places show one view.
type Outline = [Pixel; 4];

/// Chooses as frames come.
pub(super) struct Keeper {
    board: CharucoBoard,
    /// Frames in full with the board, by index.
    kept: Vec<(usize, Outline, usize)>,
}

impl Keeper {
    pub(super) fn new(board: &CharucoBoard) -> Self {
        Self { board: board.clone(), kept: Vec::new() }
    }

    /// Counts a frame in; summarises others where there are too many.
    pub(super) fn add(&mut self, index: usize, frames: &mut [FrameMeasurement]) {
        let frame = &frames[index];
        let Some(outline) = self.outline(frame) else { return };
        self.kept.push((index, outline, frame.n_corners));
        if self.kept.len() > MAX_FRAMES_IN_FULL + LOT {
            self.thin(frames);
        }
    }

    /// The last lot.
    pub(super) fn finish(&mut self, frames: &mut [FrameMeasurement]) {
        if self.kept.len() > MAX_FRAMES_IN_FULL {
            self.thin(frames);
        }
    }

    fn outline(&self, frame: &FrameMeasurement) -> Option<Outline> {
        let [cells, pixels] = cells_and_pixels(&self.board, &frame.observation.corners);
        let map = Homography::from_points(&cells, &pixels)?;
        let (right, bottom) = (self.board.squares_x as f64, self.board.squares_y as f64);
        let at = |x, y| map.map(Pixel::new(x, y));
        Some([at(0.0, 0.0)?, at(right, 0.0)?, at(right, bottom)?, at(0.0, bottom)?])
    }

    /// Of the two frames that look most alike the one with fewer corners goes, the later one of equals, until few
    /// enough are left.
    fn thin(&mut self, frames: &mut [FrameMeasurement]) {
        let n = self.kept.len();
        let distance = |a: usize, b: usize| {
            let pairs = self.kept[a].1.iter().zip(&self.kept[b].1);
            pairs.map(|(p, q)| (p.x - q.x).powi(2) + (p.y - q.y).powi(2)).fold(0.0, f64::max)
        };
        let mut is_left = vec![true; n];
        // The nearest later neighbour of each, looked for again where it has gone.
        let nearest = |a: usize, is_left: &[bool]| {
            (a + 1..n)
                .filter(|&b| is_left[b])
                .map(|b| (distance(a, b), b))
                .min_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)))
        };
        let mut neighbours: Vec<Option<(f64, usize)>> =
            (0..n).map(|a| nearest(a, &is_left)).collect();
        for _ in MAX_FRAMES_IN_FULL..n {
            let closest = (0..n)
                .filter(|&a| is_left[a])
                .filter_map(|a| Some((neighbours[a]?, a)))
                .min_by(|x, y| x.0.0.total_cmp(&y.0.0).then(x.1.cmp(&y.1)));
            let Some(((_, b), a)) = closest else { break };
            let goes = if self.kept[a].2 < self.kept[b].2 { a } else { b };
            is_left[goes] = false;
            frames[self.kept[goes].0].summarise();
            for other in 0..goes {
                if is_left[other] && neighbours[other].is_some_and(|(_, to)| to == goes) {
                    neighbours[other] = nearest(other, &is_left);
                }
            }
        }
        let mut left = is_left.iter();
        self.kept.retain(|_| *left.next().expect("one each"));
    }
}
