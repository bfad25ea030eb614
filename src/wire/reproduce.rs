//! The paper, reproduced.

use serde::Serialize;

use super::{Compare, Document, PairInfo};
use crate::{
    diagnose::{Registry, pairs},
    reproduce::{Check, Missing, Reproduction},
};

/// Every number of the paper that could be computed again: what `truedepth reproduce --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reproduce {
    /// The recordings it was made from.
    pub data: Vec<DataInfo>,
    /// Printed numbers beside ours.
    pub sections: Vec<SectionInfo>,
    /// How straight images are: figure 7.
    pub lenses: Vec<LensInfo>,
    /// Both APIs of each device of the paper's tables.
    pub pairs: Vec<PairInfo>,
    /// What is not here.
    pub missing: Vec<Missing>,
}

/// A recording of the published data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DataInfo {
    /// Its name.
    pub recording: String,
    /// `calibration` or `depth_eval`.
    pub set: String,
    /// As in the registry.
    pub device: Option<String>,
    /// Frames with images.
    pub n_frames: usize,
    /// Frames that the metadata list.
    pub n_frames_listed: usize,
}

/// Numbers that belong together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SectionInfo {
    /// `equations`, `focal`, `depth`, `devices`, `recorded` or `lens`.
    pub id: String,
    /// For people.
    pub title: String,
    /// Its numbers.
    pub checks: Vec<CheckInfo>,
}

/// A printed number beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckInfo {
    /// What it is.
    pub what: String,
    /// As printed; `null` where the paper prints none.
    pub printed: Option<f64>,
    /// Digits after the point in print.
    pub decimals: Option<usize>,
    /// Recomputed or measured; `null` without data.
    pub ours: Option<f64>,
    /// Standard deviation of what was measured.
    pub sigma: Option<f64>,
    /// Ours minus printed.
    pub difference: Option<f64>,
    /// Of all of them.
    pub unit: String,
    /// `agrees`, `differs`, `slip` or `no_data`.
    pub status: String,
    /// What there is to say.
    pub note: Option<String>,
}

/// Straightness of one recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LensInfo {
    /// Its name.
    pub recording: String,
    /// `tables` or `camera`.
    pub lens: String,
    /// `rectified`, `distorted`, `rectified_twice` or `unknown`.
    pub state: String,
    /// Distance of corners from straight lines: as recorded, with the forward table, with the inverse table.
    pub rms_px: Option<[f64; 3]>,
}

impl Document for Reproduce {
    const SCHEMA: &'static str = "truedepth.reproduce/1";
}

impl From<&Check> for CheckInfo {
    fn from(check: &Check) -> Self {
        Self {
            what: check.what.clone(),
            printed: check.printed.map(|p| p.value),
            decimals: check.printed.map(|p| p.decimals),
            ours: check.ours.map(|ours| ours.value),
            sigma: check.ours.map(|ours| ours.sigma).filter(|sigma| *sigma > 0.0),
            difference: check.difference(),
            unit: check.unit.to_owned(),
            status: check.status.name().to_owned(),
            note: (!check.note.is_empty()).then(|| check.note.clone()),
        }
    }
}

impl From<&Reproduction> for Reproduce {
    fn from(paper: &Reproduction) -> Self {
        Self {
            data: paper
                .data
                .iter()
                .map(|data| DataInfo {
                    recording: data.recording.name.clone(),
                    set: data.set.name().to_owned(),
                    device: data.device.clone(),
                    n_frames: data.recording.frames.len(),
                    n_frames_listed: data.n_listed(),
                })
                .collect(),
            sections: paper
                .sections
                .iter()
                .map(|section| SectionInfo {
                    id: section.id.to_owned(),
                    title: section.title.to_owned(),
                    checks: section.checks.iter().map(CheckInfo::from).collect(),
                })
                .collect(),
            lenses: paper
                .lens
                .iter()
                .map(|lens| LensInfo {
                    recording: paper.data[lens.data].recording.name.clone(),
                    lens: lens.rectifier.name().to_owned(),
                    state: lens.straightness.state().name().to_owned(),
                    rms_px: lens.straightness.rms_px(),
                })
                .collect(),
            pairs: Compare::new(&pairs(&Registry::published())).pairs,
            missing: paper.missing.clone(),
        }
    }
}
