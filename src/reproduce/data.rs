//! Which of the published recordings a recording is.

use crate::{
    diagnose::{Registry, Sheet},
    recording::{Problem, Recording},
};

/// What a recording is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Set {
    /// `FrontCamCalibrationDataset`: moving round the board.
    Calibration,
    /// `DepthEvalDataset`: a few frames straight at the board.
    DepthEval,
}

impl Set {
    /// `calibration` or `depth_eval`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Calibration => "calibration",
            Self::DepthEval => "depth_eval",
        }
    }
}

/// A recording of the published data.
#[derive(Debug)]
pub struct Data {
    /// What it is for.
    pub set: Set,
    /// As in the registry; `None` where neither its name nor its metadata tell.
    pub device: Option<String>,
    /// The frames.
    pub recording: Recording,
}

/// Parts of folder names, and the device they mean. The longer come first.
const NAMES: [(&[&str], &str); 9] = [
    (&["iphone11pro"], "iphone-11-pro"),
    (&["iphone12pro"], "iphone-12-pro"),
    (&["iphone12"], "iphone-12"),
    (&["iphone13"], "iphone-13"),
    (&["ipadpro11", "2gen"], "ipad-11-2gen"),
    (&["ipadpro11", "3gen"], "ipad-11-3gen"),
    (&["ipadpro12", "4gen"], "ipad-12.9-4gen"),
    (&["ipadpro12", "5gen"], "ipad-12.9-5gen"),
    (&["ipadpro129", "5gen"], "ipad-12.9-5gen"),
];

/// Recordings this short are no calibration, where the folder does not say what they are for.
const SHORT: usize = 12;

impl Data {
    /// Tells set and device by the folders' names, else by length and metadata.
    pub fn new(recording: Recording) -> Self {
        let plain = |text: &str| -> String {
            text.chars()
                .filter(char::is_ascii_alphanumeric)
                .collect::<String>()
                .to_ascii_lowercase()
        };
        let place = plain(recording.place());
        let set = if place.contains("deptheval") {
            Set::DepthEval
        } else if place.contains("calibrationdataset") || recording.frames.len() >= SHORT {
            Set::Calibration
        } else {
            Set::DepthEval
        };
        let name = plain(&recording.name);
        let named = NAMES
            .iter()
            .find(|(parts, _)| parts.iter().all(|part| name.contains(part)))
            .map(|(_, device)| (*device).to_owned());
        let registry = Registry::published();
        let told = || {
            let sheet = recording.factory().and_then(Sheet::from_factory)?;
            Some(registry.identify(&sheet).matches.first()?.device.clone())
        };
        Self { set, device: named.or_else(told), recording }
    }

    /// Frames that the metadata list, images or not.
    pub fn n_listed(&self) -> usize {
        let more = self.recording.problems.iter().find_map(|problem| match problem {
            Problem::MetadataWithoutImages { timestamps } => Some(timestamps.len()),
            _ => None,
        });
        self.recording.frames.len() + more.unwrap_or(0)
    }
}
