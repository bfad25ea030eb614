//! Verbs that draw.

use std::path::PathBuf;

use truedepth::board;

use super::{InputArgs, JsonArgs, correct::WhatArgs, paper::DevicesArgs};

/// Draw depth over colour: stills, a contact sheet, an animation; before and after a correction
///
/// One picture per frame: the colour image in grey, under it every pixel's depth in the colours of viridis (equal steps
/// look equally large, also to the colour-blind), a bar that says how many millimetres each colour is, and dark red
/// stripes where the sensor measured nothing. With --edges it draws lines instead where depth jumps: they must lie
/// where things end in the colour image. With one of --with, --fault, --av, --ar or --audit each picture has two
/// panels, before and after.
///
/// Writes overlay_TIMESTAMP.png, sheet.png (up to 48 frames at a glance), and with --animate overlay.apng (any browser
/// plays it). The folder appears as a whole or not at all.
#[derive(Debug, clap::Args)]
#[command(
    after_help = OVERLAY_EXAMPLES,
    mut_arg("with", |arg| arg.value_name("FILE|REC").help(WITH).long_help(WITH_LONG)),
    mut_arg("faults", |arg| arg.help(FAULT))
)]
pub(crate) struct OverlayArgs {
    /// The recording: a folder as the capture app writes it, or a zip of it
    #[arg(value_name = "REC")]
    pub(crate) recording: PathBuf,

    /// The folder to write; new or empty
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,

    #[command(flatten)]
    pub(crate) which: FramesArgs,

    /// Depths that the ends of the colours stand for, like 150mm..400mm; or `frame` for each frame's own
    ///
    /// Without it they are those of all frames, but for one pixel in fifty at either end: a colour is then one depth
    /// in all pictures.
    #[arg(long, value_name = "NEAR..FAR", value_parser = range)]
    pub(crate) range: Option<DepthRange>,

    /// How much of the image the colours cover
    #[arg(long, value_name = "PERCENT", default_value = "65%", value_parser = percent)]
    pub(crate) opacity: f64,

    /// Draw lines where depth jumps, over the colour image, instead of colours
    #[arg(long)]
    pub(crate) edges: bool,

    /// Show everything the other way round, left for right, as one sees oneself in a mirror
    #[arg(long)]
    pub(crate) flip: bool,

    /// Write an animation, too: frame by frame, or before and after by turns
    #[arg(long)]
    pub(crate) animate: bool,

    /// Beside it: corrected for what an audit finds, as `correct` does without further options
    #[arg(long, conflicts_with_all = ["with", "faults", "ar", "av"])]
    pub(crate) audit: bool,

    #[command(flatten)]
    pub(crate) what: WhatArgs,

    #[command(flatten)]
    pub(crate) devices: DevicesArgs,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

const WITH: &str = "Beside it: corrected by a calibration or a report, or another recording";
const WITH_LONG: &str = "Beside it: corrected by a calibration or a report, or another recording

What `truedepth calibrate --json` printed; the report.json of an audit; or a recording whose frames have the same \
timestamps, like what `truedepth correct` wrote.";
const FAULT: &str =
    "Beside it: corrected for this fault, as `correct` does; may be given several times";

const OVERLAY_EXAMPLES: &str = "\
Examples:
  truedepth overlay my-recording -o pictures
  truedepth overlay my-recording -o pictures --frames 0,4,10-19 --range 150mm..400mm
  truedepth overlay my-recording -o pictures --edges --audit
  truedepth overlay arkit -o pictures --fault depth-zoom=0.9507 --animate
  truedepth correct my-recording -o fixed && truedepth overlay my-recording -o pictures --with fixed";

/// Show what the lens' tables do: original, forward table, inverse table, side by side; and which is straight
///
/// Figure 7 of arXiv:2201.10865 for every frame. Apple's forward table takes straight images to distorted ones, so that
/// an image resampled with it comes out straight if it was distorted; the inverse table does the opposite. Where the
/// board is seen, its rows and columns are measured in all three: how far corners lie from straight lines (RMS), and
/// which of the three is straightest by more than chance. Bows are drawn ten times as large as they are.
///
/// Recordings without tables (old apps save none) need --with and a calibration whose model has a distortion.
/// Only pictures are written; `truedepth correct` writes the rectified recording. Exits with 0 whatever it finds.
#[derive(Debug, clap::Args)]
#[command(after_help = UNDISTORT_EXAMPLES)]
pub(crate) struct UndistortArgs {
    /// The recording: a folder as the capture app writes it, or a zip of it
    #[arg(value_name = "REC")]
    pub(crate) recording: PathBuf,

    /// The folder to write; new or empty
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,

    /// Take the lens from a calibration instead of the recording's tables
    ///
    /// What `truedepth calibrate --json` printed, or the report.json of an audit; its model must have a distortion,
    /// like that of `calibrate --model brown`.
    #[arg(long, value_name = "FILE")]
    pub(crate) with: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) which: FramesArgs,

    #[command(flatten)]
    pub(crate) input: InputArgs,

    #[command(flatten)]
    pub(crate) json: JsonArgs,
}

const UNDISTORT_EXAMPLES: &str = "\
Examples:
  truedepth undistort my-recording -o lens
  truedepth undistort my-recording -o lens --frames 0-9 --json | jq .state
  truedepth calibrate old --model brown --json > lens.json && truedepth undistort old -o lens --with lens.json";

/// Which frames.
#[derive(Debug, clap::Args)]
pub(crate) struct FramesArgs {
    /// Draw these frames only, like 0,4,10-19; counted from 0 as in reports
    #[arg(long, value_name = "LIST", value_parser = frames, conflicts_with = "every")]
    pub(crate) frames: Option<FrameList>,

    /// Draw every so many-th frame
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) every: Option<u32>,
}

impl FramesArgs {
    /// The frames asked for of a recording of so many; `None` for all.
    pub(crate) fn chosen(&self, n_frames: usize) -> Option<Vec<usize>> {
        match (&self.frames, self.every) {
            (Some(list), _) => Some(list.0.clone()),
            (None, Some(n)) => Some((0..n_frames).step_by(n as usize).collect()),
            (None, None) => None,
        }
    }
}

/// Frames by number, ascending.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FrameList(Vec<usize>);

fn frames(text: &str) -> Result<FrameList, String> {
    let wrong = || "write numbers and ranges from 0 to 99999, like 0,4,10-19".to_owned();
    let number = |text: &str| match text.trim().parse::<usize>() {
        Ok(n) if n < 100_000 => Ok(n),
        _ => Err(wrong()),
    };
    let mut list = Vec::new();
    for part in text.split(',') {
        match part.split_once('-') {
            Some((from, to)) if number(from)? <= number(to)? => {
                list.extend(number(from)?..=number(to)?)
            }
            Some(_) => return Err(wrong()),
            None => list.push(number(part)?),
        }
    }
    list.sort_unstable();
    list.dedup();
    Ok(FrameList(list))
}

/// Over which depths the colours run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum DepthRange {
    Frame,
    Given([f64; 2]),
}

fn range(text: &str) -> Result<DepthRange, String> {
    if text == "frame" {
        return Ok(DepthRange::Frame);
    }
    let wrong = || "write NEAR..FAR with units, like 150mm..400mm, or `frame`".to_owned();
    let (near, far) = text.split_once("..").ok_or_else(wrong)?;
    let length = |text: &str| board::length_m(text.trim()).map_err(|_| wrong());
    match [length(near)?, length(far)?] {
        [near, far] if near >= 0.0 && far > near + 1e-4 && far <= 100.0 => {
            Ok(DepthRange::Given([near, far]))
        }
        _ => Err("FAR must lie beyond NEAR, and both between 0 and 100 m".to_owned()),
    }
}

fn percent(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
    match number {
        Some(number) if (0.0..=100.0).contains(&number) => Ok(number / 100.0),
        _ => Err("write 0% to 100%".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_frames() {
        assert_eq!(frames("3,0,5-7,6"), Ok(FrameList(vec![0, 3, 5, 6, 7])));
        for text in ["", "a", "1-", "-1", "7-3", "1,,2", "1.5", "0-99999999"] {
            assert!(frames(text).unwrap_err().contains("10-19"), "{text}");
        }
    }

    #[test]
    fn ranges_and_percents() {
        assert_eq!(range("frame"), Ok(DepthRange::Frame));
        assert_eq!(range("150mm..0.4m"), Ok(DepthRange::Given([0.15, 0.4])));
        for text in ["150..400", "400mm..150mm", "1mm", "0m..200m", "-1m..1m"] {
            assert!(range(text).is_err(), "{text}");
        }
        assert_eq!(percent("65%"), Ok(0.65));
        for text in ["65", "-1%", "101%", "nan%"] {
            assert!(percent(text).is_err(), "{text}");
        }
    }
}
