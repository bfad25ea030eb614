//! `truedepth reproduce DIR`

use std::path::{Path, PathBuf};

use truedepth::{
    recording::discover_nested,
    report::{self, PaperPictures, Tone},
    reproduce::{Data, Reproduction, Status, reproduce},
    wire,
};

use crate::{
    args::ReproduceArgs,
    failure::Failure,
    files::{self, ReportFolder},
    input,
    outcome::Outcome,
    terminal::Terminal,
};

pub(crate) fn run(args: &ReproduceArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    // A folder that must not be written is better known before the work than after.
    let folder = match (&args.output, args.json.json) {
        (Some(path), _) => Some(ReportFolder::new(path)?),
        (None, true) => None,
        (None, false) => Some(ReportFolder::new(&PathBuf::from("paper-reproduced"))?),
    };
    let found = discover_nested(&args.folder, &input::limits(&args.input))?;
    if found.is_empty() {
        terminal.say(&format!(
            "no recordings in {}: only what follows from the printed numbers is computed",
            args.folder.display()
        ));
    }
    let mut data = Vec::new();
    for found in found {
        data.push(Data::new(found.open()?));
    }
    let bar = terminal.progress("reproducing", data.len());
    let place = args.folder.display().to_string();
    let paper = reproduce(&place, data, &mut |what| {
        bar.set_message(what.to_owned());
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    let document = wire::Reproduce::from(&paper);
    let json = wire::to_json(&document);
    if let Some(folder) = &folder {
        folder.write(&json, &report::paper_page(&paper, &PaperPictures::read(&paper)?))?;
    }
    if args.json.json {
        terminal.result(&json)?;
    } else {
        terminal.result(&words(&paper, terminal))?;
    }
    if let Some(folder) = folder {
        terminal.say(&format!("report: {}", folder.html().display()));
        if args.open {
            files::open(Path::new(&folder.html()))?;
        }
    }
    Ok(Outcome::Clean)
}

/// Sections with all that does not agree, and all that was measured.
fn words(paper: &Reproduction, terminal: &Terminal) -> String {
    let mut text = String::new();
    for section in &paper.sections {
        let agree = section.checks.iter().filter(|c| c.status == Status::Agrees).count();
        let title = terminal.paint(Tone::Strong, section.title);
        text.push_str(&format!("{title}: {agree} of {} agree\n", section.checks.len()));
        let long = section.checks.len() > 30;
        for check in section.checks.iter().filter(|c| !long || c.status != Status::Agrees) {
            let (tone, word) = match check.status {
                Status::Agrees => (Tone::Good, "agrees"),
                Status::Differs => (Tone::Unsure, "differs"),
                Status::Slip => (Tone::Bad, "slip"),
                Status::NoData => (Tone::Faint, "no data"),
            };
            let [printed, ours, difference] = report::check_cells(check);
            let word = terminal.paint(tone, &format!("{word:<8}"));
            text.push_str(&format!("  {word} {}: printed {printed}, ours {ours}", check.what));
            if check.printed.is_some() && check.status != Status::Agrees {
                text.push_str(&format!(" ({difference})"));
            }
            if !check.note.is_empty() {
                text.push_str(&format!("; {}", check.note));
            }
            text.push('\n');
        }
    }
    text.push_str(&terminal.paint(Tone::Strong, "Missing"));
    text.push('\n');
    for missing in &paper.missing {
        text.push_str(&format!("  {}: {}\n", missing.what, missing.how));
    }
    text
}
