//! `truedepth correct`

use std::path::PathBuf;

use clap::{ValueEnum, builder::PossibleValuesParser};
use truedepth::recording::Defect;

use super::{InputArgs, JsonArgs, paper::DevicesArgs};

#[derive(Debug, clap::Args)]
pub(crate) struct CorrectArgs {
    /// The recording: a folder as the capture app writes it, or a zip of it
    #[arg(value_name = "REC")]
    pub(crate) recording: PathBuf,

    /// The folder to write; new or empty, and not inside the recording
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: PathBuf,

    #[command(flatten)]
    pub(crate) what: WhatArgs,

    /// Take only these steps, also where what was found is within the tolerance
    ///
    /// Of an audit or a report: what is significant, if not a fault, is corrected by the step that names it.
    #[arg(long, value_name = "STEP", value_delimiter = ',', value_parser = PossibleValuesParser::new(Defect::STEPS))]
    pub(crate) only: Vec<String>,

    /// Correct all that is significant, not faults alone
    ///
    /// Of an audit or a report: deviations beyond 3 sigma that lie within the tolerance (`info`) as well. Mind that
    /// a board printed 0.5 % too large looks like depth 0.5 % too short.
    #[arg(long, conflicts_with = "only")]
    pub(crate) within_tolerance: bool,

    /// How depth is resampled
    #[arg(long, default_value = "edge-aware")]
    pub(crate) sampling: SamplingChoice,

    /// Write the output even where nothing is to be corrected
    #[arg(long)]
    pub(crate) always: bool,

    #[command(flatten)]
    pub(crate) devices: DevicesArgs,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

/// Where the corrections come from; without any of these, from an audit.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
pub(crate) struct WhatArgs {
    /// Correct by a calibration or a report instead of auditing
    ///
    /// What `truedepth calibrate --json` printed: focal length and centre of that camera go into the metadata, its
    /// distortion out of the images. Or the report.json of an audit: what it found is corrected.
    #[arg(long, value_name = "FILE")]
    pub(crate) with: Option<PathBuf>,

    /// Say what is wrong instead of auditing, as `simulate` does; may be given several times
    ///
    /// One of focal=6.6% (the metadata's is so much too long), center=4px,-2px, distorted, rectified-twice,
    /// depth-scale=1.5%, depth-bias=2mm, depth-zoom=0.9507, depth-shift=3px,0px, mirrored, depth-mirrored.
    #[arg(long = "fault", value_name = "FAULT")]
    pub(crate) faults: Vec<Defect>,

    /// REC is AVFoundation's; correct it by the paper's equations with ARKit's metadata of the device
    ///
    /// A recording, a DepthMetadata.json, or a row of the registry (`truedepth compare --list`).
    #[arg(long, value_name = "AR")]
    pub(crate) ar: Option<String>,

    /// REC is ARKit's; correct it by the paper's equations with AVFoundation's metadata of the device
    ///
    /// Depending on the pair: focal length, or zoom of the depth maps.
    #[arg(long, value_name = "AV")]
    pub(crate) av: Option<String>,
}

impl WhatArgs {
    /// Which of them was given.
    pub(crate) fn chosen(&self) -> Steps<'_> {
        match self {
            Self { with: Some(path), .. } => Steps::With(path),
            Self { ar: Some(ar), .. } => Steps::Pair { av: None, ar: Some(ar) },
            Self { av: Some(av), .. } => Steps::Pair { av: Some(av), ar: None },
            Self { faults, .. } if !faults.is_empty() => Steps::Faults(faults),
            _ => Steps::Audit,
        }
    }
}

/// Where the corrections come from.
#[derive(Clone, Copy)]
pub(crate) enum Steps<'a> {
    Audit,
    With(&'a std::path::Path),
    Faults(&'a [Defect]),
    /// The recording is the side that is not given.
    Pair {
        av: Option<&'a str>,
        ar: Option<&'a str>,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SamplingChoice {
    /// Bilinear on one surface, else the nearest measurement
    EdgeAware,
    /// The nearest measurement
    Nearest,
}

pub(crate) const CORRECT_EXAMPLES: &str = "\
Examples:
  truedepth correct my-recording -o fixed
  truedepth audit moving -o report && truedepth correct still -o fixed --with report/report.json
  truedepth calibrate moving --json > camera.json && truedepth correct still -o fixed --with camera.json --only focal
  truedepth correct arkit -o fixed --fault mirrored --fault depth-zoom=0.9507
  truedepth correct my-recording -o fixed --ar ipad-12.9-5gen/ios15/ar";
