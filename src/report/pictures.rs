//! What a page shows of the recording itself: photos of its frames, and a few frames with their depth.

use std::{
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
};

use super::photo::{Photo, PhotoSize, base64};
use crate::{
    audit::Audit,
    image::{DepthMap, Rgb},
    measure::FrameMeasurement,
    par,
    recording::{self, Recording},
};

/// The most photos in a page; of a longer recording a spread.
const MAX_PHOTOS: usize = 60;
/// Photos large enough to look at a corner.
const MAX_LARGE: usize = 12;
/// Frames with depth. Each takes 205 kB of the page.
const MAX_CLOSEUPS: usize = 4;
/// A depth map wider than this is thinned out: the same for the eye at a quarter of the size.
const MAX_COLUMNS: usize = 320;
/// What one step of a stored depth stands for: the capture app's own unit.
pub(super) const DEPTH_UNIT_M: f64 = 1e-4;

/// Images of a recording for its page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// In order of frames.
    pub photos: Vec<Photo>,
    /// In order of frames; each of these frames has a large photo.
    pub closeups: Vec<Closeup>,
}

/// The depth of a frame, small enough to travel inside a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Closeup {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Columns and rows that are kept.
    pub columns: usize,
    /// As `columns`.
    pub rows: usize,
    /// Every so many-th pixel of the depth map is kept, in both directions, from the first on.
    pub step: usize,
    /// Row by row, in steps of 0.1 mm; 0 where there is no measurement or one beyond 6.5 m.
    pub depth: Vec<u16>,
}

impl Closeup {
    /// Thins out a depth map. Pixels are taken as they are: a mean would make depth where there is none.
    pub fn new(frame: usize, map: &DepthMap) -> Self {
        let step =
            map.width().div_ceil(MAX_COLUMNS).max(map.height().div_ceil(2 * MAX_COLUMNS)).max(1);
        let (columns, rows) = (map.width().div_ceil(step), map.height().div_ceil(step));
        let stored = |depth_m: f32| {
            let steps = (f64::from(depth_m) / DEPTH_UNIT_M).round();
            // NaN is in no range.
            if (1.0..=f64::from(u16::MAX)).contains(&steps) { steps as u16 } else { 0 }
        };
        let rows_kept = map.depth_m().chunks(map.width().max(1)).step_by(step);
        let depth =
            rows_kept.flat_map(|row| row.iter().step_by(step)).map(|&d| stored(d)).collect();
        Self { frame, columns, rows, step, depth }
    }

    /// The depth as 16-bit little-endian numbers in base64.
    pub(super) fn to_base64(&self) -> String {
        let bytes: Vec<u8> = self.depth.iter().flat_map(|depth| depth.to_le_bytes()).collect();
        base64(&bytes)
    }
}

/// Small photos made while an audit looks at the images, so that these need not be decoded again.
#[derive(Debug)]
pub struct Thumbnails(Mutex<BTreeMap<usize, Photo>>, bool);

impl Thumbnails {
    /// For this recording. One so long that its page shows a spread only gets none: most would be made for nothing.
    pub fn new(recording: &Recording) -> Self {
        Self(Mutex::default(), recording.frames.len() <= MAX_PHOTOS)
    }

    /// Whether photos of all frames are wanted.
    pub fn wants_all(&self) -> bool {
        self.1
    }

    /// Keeps a small photo of this frame. From any thread.
    pub fn see(&self, frame: usize, image: &Rgb) {
        if self.1 {
            let photo = Photo::new(frame, image, PhotoSize::Small);
            self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(frame, photo);
        }
    }
}

impl Pictures {
    /// Reads what a page of this audit shows, on all cores where the feature `parallel` is on: every frame small (of
    /// more than 60 a spread), twelve of them large (the four whose view fits worst, the frame with the fewest corners,
    /// others spread evenly), and depth of four in which much of the board was seen.
    ///
    /// Errors: as [`Recording::color`] and [`Recording::depth`], of the first frame that has one.
    pub fn read(recording: &Recording, audit: &Audit) -> Result<Self, recording::Error> {
        Self::read_beside(recording, audit, Thumbnails::new(recording))
    }

    /// As [`read`](Self::read), with the small photos that there are already.
    ///
    /// Errors: as there.
    pub fn read_beside(
        recording: &Recording,
        audit: &Audit,
        thumbnails: Thumbnails,
    ) -> Result<Self, recording::Error> {
        let choice = Choice::new(audit);
        let made = thumbnails.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        let photo = |&frame: &usize| -> Result<Photo, recording::Error> {
            if let (Some(photo), false) = (made.get(&frame), choice.large.contains(&frame)) {
                return Ok(photo.clone());
            }
            let size =
                if choice.large.contains(&frame) { PhotoSize::Large } else { PhotoSize::Small };
            Ok(Photo::new(frame, &recording.color(frame)?, size))
        };
        let closeup = |&frame: &usize| -> Result<Closeup, recording::Error> {
            Ok(Closeup::new(frame, &recording.depth(frame)?))
        };
        Ok(Self {
            photos: par::try_map(&choice.photos, photo)?,
            closeups: par::try_map(&choice.closeups, closeup)?,
        })
    }
}

/// Which frames are shown how; all in order.
#[derive(Debug, PartialEq)]
struct Choice {
    photos: Vec<usize>,
    large: Vec<usize>,
    closeups: Vec<usize>,
}

impl Choice {
    fn new(audit: &Audit) -> Self {
        let frames = &audit.frames;
        let with_image: Vec<usize> =
            (0..frames.len()).filter(|&f| frames[f].color.is_some() && frames[f].in_full).collect();
        let closeups = closeups(frames);
        let mut worst = with_image.clone();
        worst.sort_by(|&a, &b| rms_px(&frames[b]).total_cmp(&rms_px(&frames[a])));
        worst.retain(|&frame| rms_px(&frames[frame]) > 0.0);
        let fewest =
            with_image.iter().copied().min_by_key(|&f| frames[f].observation.corners.len());
        let first = worst.into_iter().take(4).chain(fewest).chain(closeups.iter().copied());
        let large = completed(first.collect(), &with_image, MAX_LARGE);
        let photos = completed(large.clone(), &with_image, MAX_PHOTOS);
        Self { photos, large, closeups }
    }
}

/// Frames with colour, depth and a view, spread over those that show at least as many corners as the middle one.
fn closeups(frames: &[FrameMeasurement]) -> Vec<usize> {
    let n_corners = |frame: usize| frames[frame].observation.corners.len();
    let mut able: Vec<usize> = (0..frames.len())
        .filter(|&frame| {
            let f = &frames[frame];
            let has_view = f.own_view.is_some() || f.factory_view.is_some();
            f.color.is_some() && f.depth.is_some() && has_view
        })
        .collect();
    let mut counts: Vec<usize> = able.iter().map(|&frame| n_corners(frame)).collect();
    counts.sort_unstable();
    if let Some(&middle) = counts.get(counts.len() / 2) {
        able.retain(|&frame| n_corners(frame) >= middle);
    }
    completed(Vec::new(), &able, MAX_CLOSEUPS)
}

/// `chosen` with others of `all` spread evenly, up to `wanted` in all; in order.
fn completed(mut chosen: Vec<usize>, all: &[usize], wanted: usize) -> Vec<usize> {
    chosen.sort_unstable();
    chosen.dedup();
    let others: Vec<usize> = all.iter().copied().filter(|frame| !chosen.contains(frame)).collect();
    let missing = wanted.saturating_sub(chosen.len()).min(others.len());
    chosen.extend((0..missing).map(|i| others[i * others.len() / missing]));
    chosen.sort_unstable();
    chosen
}

/// How well the board's pose explains the corners; 0 where there is no pose.
pub(super) fn rms_px(frame: &FrameMeasurement) -> f64 {
    frame.own_view.as_ref().or(frame.factory_view.as_ref()).map_or(0.0, |view| view.rms_px)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn worst_and_spread() {
        let mut audit = sample::audit();
        let choice = Choice::new(&audit);
        assert_eq!(choice.photos.len(), audit.frames.len());
        assert_eq!(choice.closeups.len(), MAX_CLOSEUPS);
        assert!(choice.photos.windows(2).all(|pair| pair[0] < pair[1]), "{choice:?}");
        // Many frames, one of them bad: it is among those shown large.
        let template = audit.frames[0].clone();
        audit.measured.frames = (0..200).map(|_| template.clone()).collect();
        audit.measured.frames[117].own_view.as_mut().expect("the sample has one").rms_px = 9.0;
        audit.measured.frames[5].color = None;
        let Choice { photos, large, closeups } = Choice::new(&audit);
        assert_eq!(
            [photos.len(), large.len(), closeups.len()],
            [MAX_PHOTOS, MAX_LARGE, MAX_CLOSEUPS]
        );
        assert!(large.contains(&117) && !photos.contains(&5), "{photos:?} {large:?}");
        assert!(photos.last().is_some_and(|&last| last > 150), "spread: {photos:?}");
        assert!(closeups.iter().all(|frame| large.contains(frame)), "{closeups:?} {large:?}");
        assert!(large.iter().all(|frame| photos.contains(frame)), "{photos:?} {large:?}");
        audit.measured.frames.clear();
        assert_eq!(Choice::new(&audit).photos, [0; 0]);
    }

    #[test]
    fn depth_is_thinned_out_and_never_blended() {
        let mut depth_m = vec![0.25; 642 * 3];
        depth_m[0] = f32::NAN;
        depth_m[1] = 0.1; // passed over
        depth_m[3] = 7.0;
        depth_m[2 * 642 + 639] = 0.5;
        let closeup = Closeup::new(5, &DepthMap::new(642, 3, depth_m));
        assert_eq!((closeup.columns, closeup.rows, closeup.step), (214, 1, 3));
        assert_eq!(closeup.depth[..3], [0, 0, 2500]);
        let small = Closeup::new(5, &DepthMap::new(2, 2, vec![0.1, 6.6, -1.0, 0.0001]));
        assert_eq!((small.step, &small.depth[..]), (1, &[1000, 0, 0, 1][..]));
        assert_eq!(small.to_base64(), "6AMAAAAAAQA=");
    }
}
