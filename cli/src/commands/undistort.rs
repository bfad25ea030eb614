//! `truedepth undistort REC -o DIR`

use truedepth::{
    correct::Rectifier,
    files::AtomicFolder,
    recording::Recording,
    report::{self, LensPictures},
    wire,
};

use super::correct::refuse_inside;
use crate::{args::UndistortArgs, failure::Failure, input, outcome::Outcome, terminal::Terminal};

pub(crate) fn run(args: &UndistortArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    refuse_inside(&args.output, &args.recording)?;
    let recording = Recording::open(&args.recording, &input::limits(&args.input))?;
    let rectifier = rectifier(args, &recording)?;
    let mut sink = AtomicFolder::create(&args.output)?;
    let board = input::board(&args.input.board)?.or_else(|| recording.board.clone());
    if board.is_none() {
        terminal
            .say("the board is not known, so that nothing is measured; give --board to measure");
    }
    let pictures = LensPictures {
        recording: &recording,
        rectifier: &rectifier,
        board: board.as_ref(),
        frames: args.which.chosen(recording.frames.len()),
    };
    let bar = terminal.progress("drawing", recording.frames.len());
    let drawn = pictures.draw(&mut sink, &mut |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    sink.commit()?;
    if args.json.json {
        let document = report::UndistortDocument::new(&recording, &rectifier, &drawn);
        terminal.result(&wire::to_json(&document))?;
    } else {
        terminal.result(&format!(
            "{}: {} pictures\n{}\n",
            args.output.display(),
            drawn.frames.len(),
            report::state_in_words(&rectifier, &drawn.straightness)
        ))?;
    }
    Ok(Outcome::Clean)
}

/// The lens: that of the calibration given, else the recording's tables.
fn rectifier(args: &UndistortArgs, recording: &Recording) -> Result<Rectifier, Failure> {
    if let Some(path) = &args.with {
        return Rectifier::of_camera(&input::camera(path)?).ok_or_else(|| {
            Failure::new(format!("the model in {} has no distortion", path.display()))
                .hint("calibrate with one that has: `truedepth calibrate REC --model brown --json`")
        });
    }
    let tables = recording.factory().and_then(|factory| factory.tables.clone());
    tables.map(|tables| Rectifier::Tables(Box::new(tables))).ok_or_else(|| {
        Failure::new(format!("{} has no lens distortion tables", recording.place())).hint(
            "older apps save none; take the lens from a calibration: `truedepth calibrate REC --model brown --json > \
             lens.json`, then --with lens.json",
        )
    })
}
