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
