//! Verbs about the paper's devices and issues.

use std::path::PathBuf;

use super::{InputArgs, JsonArgs};

/// Devices beside the published ones.
#[derive(Debug, clap::Args)]
pub(crate) struct DevicesArgs {
    /// Your own devices, beside the published ones
    ///
    /// A TOML file with one table [[device]] per row: name, version, api ("av" or "ar"), reference, focal_px,
    /// center_px, all at the reference dimensions; optionally product, distortion_center_px, color_focal_px,
    /// color_center_px and issues (of "depth-zoom", "focal-length", "not-rectified").
    #[arg(long, value_name = "FILE")]
    pub(crate) devices: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct InspectArgs {
    /// The recording: a folder as the capture app writes it, or a zip of it
    #[arg(value_name = "REC")]
    pub(crate) recording: PathBuf,

    #[command(flatten)]
    pub(crate) devices: DevicesArgs,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

pub(crate) const INSPECT_EXAMPLES: &str = "\
Examples:
  truedepth inspect my-recording
  truedepth inspect my-recording --devices mine.toml
  truedepth inspect my-recording --json | jq .identity";

#[derive(Debug, clap::Args)]
pub(crate) struct CompareArgs {
    /// AVFoundation's side: a recording, a DepthMetadata.json, or a row of the registry like ipad-12.9-5gen/ios14/av
    #[arg(value_name = "AV", required_unless_present_any = ["list", "all"])]
    pub(crate) av: Option<String>,

    /// ARKit's side; or the second of two recordings of one device
    #[arg(value_name = "AR", required_unless_present_any = ["list", "all"])]
    pub(crate) ar: Option<String>,

    /// Name all rows of the registry, and stop
    #[arg(long, conflicts_with_all = ["av", "all", "json"])]
    pub(crate) list: bool,

    /// Compare every device of the registry that has rows of both APIs
    #[arg(long, conflicts_with = "av")]
    pub(crate) all: bool,

    #[command(flatten)]
    pub(crate) devices: DevicesArgs,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

pub(crate) const COMPARE_EXAMPLES: &str = "\
Examples:
  truedepth compare --list
  truedepth compare ipad-12.9-5gen/ios14/av ipad-12.9-5gen/ios14/ar
  truedepth compare last-year this-year
  truedepth compare my-recording ipad-12.9-5gen/ios15/ar
  truedepth compare --all --json";

/// Compute the numbers and figures of arXiv:2201.10865 again, from its published data, each beside the printed one
///
/// DIR is a checkout of ZEISS/iPad_TrueDepth_Issue_Eval, or any folder with some of its recordings inside, also in
/// zips: FrontCamCalibrationDataset/* and DepthEvalDataset/*. Repeats the calibrations (section 5.1), compares
/// depth with the board (figure 5, with factory and own intrinsics), recomputes the worked equations and the
/// derived columns of the device tables, checks the tables against the recordings' metadata, and measures whether
/// images are rectified (figure 7). Says where the paper is off, and what is not there and how to get it. Without
/// any recording only what follows from the printed numbers is computed.
///
/// Leaves report.html and report.json in ./paper-reproduced, or where -o says. Exits with 0 whatever it finds.
#[derive(Debug, clap::Args)]
#[command(after_help = REPRODUCE_EXAMPLES)]
pub(crate) struct ReproduceArgs {
    /// The data: a folder, or a zip
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,

    /// Where the report goes [default: ./paper-reproduced; none with --json]
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,

    /// Open the report in a browser
    #[arg(long)]
    pub(crate) open: bool,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

const REPRODUCE_EXAMPLES: &str = "\
Examples:
  git clone https://github.com/ZEISS/iPad_TrueDepth_Issue_Eval && truedepth reproduce iPad_TrueDepth_Issue_Eval
  truedepth reproduce iPad_TrueDepth_Issue_Eval -o paper --open
  truedepth reproduce iPad_TrueDepth_Issue_Eval --json | jq '.sections[].checks[] | select(.status == \"slip\")'";
