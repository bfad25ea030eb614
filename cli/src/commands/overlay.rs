//! `truedepth overlay REC -o DIR`

use std::path::Path;

use truedepth::{
    correct::{Plan, Selection},
    files::AtomicFolder,
    recording::Recording,
    report::{self, After, Animation, DepthPictures, DepthStyle, Drawn, Flip, Range, Shown},
    wire,
};

use super::correct::{Asked, plan, refuse_inside};
use crate::{
    args::{DepthRange, OverlayArgs, Steps},
    failure::Failure,
    input,
    outcome::Outcome,
    terminal::Terminal,
};

/// What is taken where nothing at all was measured: the distances at which a face is held.
const ANY_RANGE_M: [f64; 2] = [0.15, 0.6];

pub(crate) fn run(args: &OverlayArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    refuse_inside(&args.output, &args.recording)?;
    let recording = Recording::open(&args.recording, &input::limits(&args.input))?;
    // A folder that must not be written is better known before the work than after.
    let mut sink = AtomicFolder::create(&args.output)?;
    let beside = Beside::new(args, &recording, terminal)?;
    let shown = if args.edges { Shown::Edges } else { Shown::Depth };
    let pictures = DepthPictures {
        recording: &recording,
        after: match &beside {
            Beside::Nothing => After::Nothing,
            Beside::Plan(plan) => After::Corrected(plan),
            Beside::Recording(other) => After::Recording(other),
        },
        frames: args.which.chosen(recording.frames.len()),
        range: match args.range {
            None => Range::Recording,
            Some(DepthRange::Frame) => Range::Frame,
            Some(DepthRange::Given(range_m)) => Range::Given(range_m),
        },
        style: DepthStyle { range_m: ANY_RANGE_M, opacity: args.opacity, shown },
        flip: if args.flip { Flip::Yes } else { Flip::No },
        animation: if args.animate { Animation::Yes } else { Animation::No },
    };
    let bar = terminal.progress("drawing", recording.frames.len());
    let drawn = pictures.draw(&mut sink, &mut |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    sink.commit()?;
    if args.json.json {
        let document = report::OverlayDocument::new(&pictures, &drawn);
        terminal.result(&wire::to_json(&document))?;
    } else {
        terminal.result(&words(&drawn, &args.output))?;
    }
    Ok(Outcome::Clean)
}

/// What is shown beside the recording.
enum Beside {
    Nothing,
    Plan(Plan),
    Recording(Box<Recording>),
}

impl Beside {
    fn new(
        args: &OverlayArgs,
        recording: &Recording,
        terminal: &Terminal,
    ) -> Result<Self, Failure> {
        let chosen = args.what.chosen();
        if let Steps::With(path) = chosen
            && input::is_recording(path, &args.input)
        {
            let other = Recording::open(path, &input::limits(&args.input))?;
            return Ok(Self::Recording(Box::new(other)));
        }
        if matches!(chosen, Steps::Audit) && !args.audit {
            return Ok(Self::Nothing);
        }
        let asked = Asked {
            path: &args.recording,
            steps: chosen,
            selection: Selection::Faults,
            devices: &args.devices,
            input: &args.input,
        };
        let (plan, _) = plan(&asked, recording, terminal)?;
        if plan.is_empty() {
            terminal.say(&format!(
                "{}: nothing to correct; before and after are the same",
                recording.name
            ));
        }
        Ok(Self::Plan(plan))
    }
}

fn words(drawn: &Drawn, output: &Path) -> String {
    let mut text = format!("{}: {} pictures", output.display(), drawn.frames.len());
    for other in &drawn.others {
        text.push_str(&format!(", {other}"));
    }
    text.push('\n');
    if let Some([near, far]) = drawn.range_m {
        text.push_str(&format!("  colours from {:.0} to {:.0} mm\n", 1e3 * near, 1e3 * far));
    }
    let holes = |i: usize| {
        let of: Vec<f64> = drawn.frames.iter().filter_map(|f| f.holes.get(i).copied()).collect();
        (!of.is_empty()).then(|| 100.0 * of.iter().sum::<f64>() / of.len() as f64)
    };
    match (holes(0), holes(1)) {
        (Some(before), Some(after)) => {
            text.push_str(&format!("  without depth {before:.1} % before, {after:.1} % after\n"));
        }
        (Some(holes), None) => text.push_str(&format!("  without depth {holes:.1} %\n")),
        _ => {}
    }
    if !drawn.left_out.is_empty() {
        let list: Vec<String> = drawn.left_out.iter().map(ToString::to_string).collect();
        text.push_str(&format!(
            "  left out, for lack of colour or depth: frames {}\n",
            list.join(", ")
        ));
    }
    text
}
