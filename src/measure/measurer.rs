//! Looks at one frame after the other.

use std::sync::Arc;

use super::{Error, FrameMeasurement, keep::Keeper};
use crate::{
    board::CharucoBoard,
    depth::{Lattice, NoiseBetweenFrames},
    detect::{Detector, Observation},
    image::{DepthMap, Gray},
    recording::{Factory, Frame, Problem, Recording, same_shape},
};

/// What is known of a recording beside its images.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// What people call it.
    pub name: String,
    /// Where it is, for messages.
    pub place: String,
    /// What was odd in the files.
    pub problems: Vec<Problem>,
    /// The factory metadata that stand for the whole recording.
    pub factory: Option<Factory>,
}

impl About {
    /// What this recording says of itself.
    pub fn recording(recording: &Recording) -> Self {
        Self {
            name: recording.name.clone(),
            place: recording.place().to_owned(),
            problems: recording.problems.clone(),
            factory: recording.factory().cloned(),
        }
    }
}

/// Measures a recording frame by frame, as long as frames come.
pub struct Measurer {
    detector: Detector,
    pub(super) frames: Vec<FrameMeasurement>,
    keeper: Keeper,
    pub(super) noise: NoiseBetweenFrames,
}

impl Measurer {
    /// Looks for this board.
    pub fn new(board: &CharucoBoard) -> Self {
        Self {
            detector: Detector::new(board),
            frames: Vec::new(),
            keeper: Keeper::new(board),
            noise: NoiseBetweenFrames::default(),
        }
    }

    /// The board that is looked for.
    pub fn board(&self) -> &CharucoBoard {
        self.detector.board()
    }

    /// Detects the board in the colour image of a frame. On any thread.
    pub fn look(&self, frame: &Frame, color: &Gray) -> FrameMeasurement {
        self.seen(frame, [color.width(), color.height()], self.detector.detect(color))
    }

    /// As [`look`](Self::look) where the corners are known already: from a detector of one's own, or simulated.
    pub fn seen(
        &self,
        frame: &Frame,
        size_px: [usize; 2],
        observation: Observation,
    ) -> FrameMeasurement {
        let mut found = FrameMeasurement::blank(frame);
        let own = frame.color.as_ref().and_then(|image| image.factory.as_ref());
        found.factory = match own.filter(|factory| factory.size() == size_px) {
            Some(factory) => Some(Arc::clone(factory)),
            None => frame.factory().and_then(|f| f.at_size(size_px)).map(Arc::new),
        };
        found.size_px = Some(size_px);
        found.n_corners = observation.corners.len();
        found.observation = observation;
        found
    }

    /// Reads a frame's depth map where the board was seen. On any thread. Its size may be another than that of the
    /// colour image, but not its shape.
    pub fn look_at_depth(
        &self,
        found: &mut FrameMeasurement,
        map: &DepthMap,
        place: &str,
    ) -> Result<(), Error> {
        let color_size = found.size_px.unwrap_or([map.width(), map.height()]);
        let depth_size = [map.width(), map.height()];
        if !same_shape(color_size, depth_size) {
            return Err(Error::Sizes {
                recording: place.to_owned(),
                color: found.color.clone().unwrap_or_default(),
                color_size,
                depth: found.depth.clone().unwrap_or_default(),
                depth_size,
            });
        }
        found.read_depth(map, self.board());
        Ok(())
    }

    /// Takes what was found, frame by frame in order of time.
    pub fn add(&mut self, found: FrameMeasurement) {
        self.frames.push(found);
        if let [.., before, after] = self.frames.as_mut_slice() {
            if let (Some(a), Some(b)) = (&before.patches, &after.patches) {
                self.noise.add((&before.observation.corners, a), (&after.observation.corners, b));
            }
            // Compared with both neighbours: what is only for that goes.
            if let Some(patches) = &mut before.patches {
                patches.lattice = Lattice::default();
            }
            let index = self.frames.len() - 2;
            self.keeper.add(index, &mut self.frames);
        }
    }

    /// Frames so far, in order of time.
    pub fn frames(&self) -> &[FrameMeasurement] {
        &self.frames
    }

    /// Nothing more comes.
    pub(super) fn close(&mut self) {
        if let Some(last) = self.frames.len().checked_sub(1) {
            self.keeper.add(last, &mut self.frames);
        }
        self.keeper.finish(&mut self.frames);
    }
}
