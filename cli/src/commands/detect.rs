//! `truedepth detect PATH...`

use std::{path::Path, time::Instant};

use rayon::prelude::*;
use truedepth::{
    board::CharucoBoard,
    detect::Detector,
    image::Gray,
    recording::Recording,
    report::{
        self,
        wire::{self, DetectedImage},
    },
};

use crate::{
    args::DetectArgs,
    failure::Failure,
    input::{self, Input},
    outcome::Outcome,
    terminal::Terminal,
};

pub(crate) fn run(args: &DetectArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let board = input::board(&args.input.board)?;
    let mut images = Vec::new();
    let mut outcome = Outcome::Clean;
    for path in &args.paths {
        match searched(path, board.as_ref(), args, terminal) {
            Ok(found) => {
                for image in found {
                    match image {
                        Ok(image) => images.push(image),
                        Err(failure) => {
                            terminal.failure(&failure);
                            outcome = Outcome::NotAllRan;
                        }
                    }
                }
            }
            Err(failure) if args.paths.len() == 1 => return Err(failure),
            Err(failure) => {
                terminal.failure(&failure);
                outcome = Outcome::NotAllRan;
            }
        }
    }
    if args.json.json {
        let document = wire::Document::Detect(wire::Detect { images });
        terminal.result(&report::to_json(&document))?;
    } else {
        terminal.result(&table(&images))?;
    }
    Ok(outcome)
}

type Searched = Vec<Result<DetectedImage, Failure>>;

/// All images at a path, searched, in order.
fn searched(
    path: &Path,
    board: Option<&CharucoBoard>,
    args: &DetectArgs,
    terminal: &Terminal,
) -> Result<Searched, Failure> {
    let unknown = |what: &str| {
        Failure::new(format!("{what}: the board is not known"))
            .hint("say which with --board, like --board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL")
    };
    match Input::at(path, &args.input)? {
        Input::Recordings(found) => {
            let mut all = Vec::new();
            for found in found {
                let recording = found.open()?;
                let board =
                    board.or(recording.board.as_ref()).ok_or_else(|| unknown(recording.place()))?;
                all.extend(in_recording(&recording, board, args, terminal));
            }
            Ok(all)
        }
        Input::Images(files) => {
            let board = board.ok_or_else(|| unknown(&path.display().to_string()))?;
            let detector = Detector::new(board);
            let bar = terminal.progress(&path.display().to_string(), files.len());
            let found = files
                .par_iter()
                .map(|file| {
                    let image = timed(&file.display().to_string(), &detector, args, || {
                        let bytes = input::read(file)?;
                        Gray::from_png(&bytes, &input::limits(&args.input).image).map_err(|e| {
                            Failure::from(e).within(format!("cannot read {}", file.display()))
                        })
                    });
                    bar.inc(1);
                    image
                })
                .collect();
            bar.finish_and_clear();
            Ok(found)
        }
    }
}

/// The colour images of a recording, searched, in order of time.
fn in_recording(
    recording: &Recording,
    board: &CharucoBoard,
    args: &DetectArgs,
    terminal: &Terminal,
) -> Searched {
    let detector = Detector::new(board);
    let frames: Vec<(usize, &String)> = recording
        .frames
        .iter()
        .enumerate()
        .filter_map(|(index, frame)| Some((index, frame.color.as_ref()?)))
        .collect();
    let bar = terminal.progress(&recording.name, frames.len());
    let found = frames
        .par_iter()
        .map(|(index, name)| {
            let shown = Path::new(recording.place()).join(name).display().to_string();
            let image = timed(&shown, &detector, args, || Ok(recording.gray(*index)?));
            bar.inc(1);
            image
        })
        .collect();
    bar.finish_and_clear();
    found
}

/// Decodes and searches one image, and looks at the clock.
fn timed(
    shown: &str,
    detector: &Detector,
    args: &DetectArgs,
    decode: impl FnOnce() -> Result<Gray, Failure>,
) -> Result<DetectedImage, Failure> {
    let start = Instant::now();
    let image = decode()?;
    let decoded = Instant::now();
    let observation = detector.detect(&image);
    let detected = Instant::now();
    let mut found =
        DetectedImage::new(shown.to_owned(), [image.width(), image.height()], &observation);
    if args.timings {
        found.decode_ms = Some(1e3 * (decoded - start).as_secs_f64());
        found.detect_ms = Some(1e3 * (detected - decoded).as_secs_f64());
    }
    Ok(found)
}

/// One line per image.
fn table(images: &[DetectedImage]) -> String {
    let width = images.iter().map(|image| image.path.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for image in images {
        let path = &image.path;
        let found = match &image.layout {
            Some(layout) => format!("{:>4} corners  {layout}", image.corners.len()),
            None => "   no board".to_owned(),
        };
        text.push_str(&format!("{path:width$}  {found:<21}"));
        if let (Some(decode), Some(detect)) = (image.decode_ms, image.detect_ms) {
            text.push_str(&format!("  decoded in {decode:.1} ms, searched in {detect:.1} ms"));
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    let n_found = images.iter().filter(|image| image.board_found).count();
    let n_corners: usize = images.iter().map(|image| image.corners.len()).sum();
    text.push_str(&format!("{n_corners} corners; board in {n_found} of {} images\n", images.len()));
    text
}
