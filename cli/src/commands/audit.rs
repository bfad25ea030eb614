//! `truedepth audit REC...`

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use indicatif::ProgressBar;
use truedepth::{
    audit::{Audit, Options, audit},
    image::Rgb,
    measure::{FrameMeasurement, Method, Observer, Progress},
    recording::{Found, Recording},
    report::{self, Overview, Pictures, Thumbnails, Typed},
    wire,
};

use crate::{
    args::{self, AuditArgs},
    failure::Failure,
    files::{self, ReportFolder},
    input,
    outcome::Outcome,
    terminal::Terminal,
};

pub(crate) fn run(args: &AuditArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let options = options(args)?;
    let mut worst = Outcome::Clean;
    let mut found = Vec::new();
    for path in &args.recordings {
        match input::recordings(path, &args.input) {
            Ok(inside) => {
                // The only one of a folder or archive is opened by what was typed; another by where it is in there.
                let typed = (inside.len() == 1).then(|| path.display().to_string());
                found.extend(inside.into_iter().map(|found| (typed.clone(), found)));
            }
            Err(failure) if args.recordings.len() == 1 => return Err(failure),
            Err(failure) => {
                terminal.failure(&failure);
                worst = Outcome::NotAllRan;
            }
        }
    }
    let alone = args.recordings.len() == 1 && found.len() == 1;
    let mut taken = BTreeSet::new();
    let mut beside = Vec::new();
    for (index, (typed, found)) in found.into_iter().enumerate() {
        if index > 0 && !args.json {
            terminal.result("\n")?;
        }
        let folder = report_folder(args, &found.name, alone, &mut taken);
        let typed = typed.unwrap_or_else(|| found.place());
        match one((found, typed), &options, folder.as_deref(), args, terminal) {
            Ok((outcome, overview)) => {
                worst = worst.max(outcome);
                beside.push(overview);
            }
            Err(failure) if alone => return Err(failure),
            Err(failure) => {
                terminal.failure(&failure);
                worst = Outcome::NotAllRan;
            }
        }
    }
    if !args.json && beside.len() > 1 {
        terminal.result("\n")?;
        terminal.lines(&report::overview(&beside, terminal.width()))?;
    }
    Ok(worst)
}

/// What was typed, as the library understands it.
fn options(args: &AuditArgs) -> Result<Options, Failure> {
    let method = match (&args.calibration, args.method) {
        (Some(path), _) => Method::Given(Box::new(input::known_camera(path)?)),
        (None, args::Method::Auto) => Method::Auto,
        (None, args::Method::Paper) => Method::Paper,
    };
    let mut options = Options::new(method);
    options.max_views = args.views;
    options.board = input::board(&args.input.board)?;
    for text in &args.tolerances {
        options.tolerances = options.tolerances.with(text)?;
    }
    Ok(options)
}

/// Where the report of a recording goes; `None` for no report. Of several recordings each gets a folder of its own.
fn report_folder(
    args: &AuditArgs,
    name: &str,
    alone: bool,
    taken: &mut BTreeSet<PathBuf>,
) -> Option<PathBuf> {
    let parent = match &args.output {
        Some(folder) if alone => return Some(folder.clone()),
        Some(folder) => folder.as_path(),
        None if args.json => return None,
        None => Path::new(""),
    };
    // A name may come out of an archive: take its last part only, and never a dot.
    let name = name.rsplit(['/', '\\']).next().unwrap_or_default();
    let name = if name.trim_matches('.').is_empty() { "recording" } else { name };
    // Two recordings of one run may have one name.
    (1..)
        .map(|n| match n {
            1 => parent.join(format!("{name}-report")),
            n => parent.join(format!("{name}-report-{n}")),
        })
        .find(|path| taken.insert(path.clone()))
}

/// Audits one recording: the result to stdout, the report into its folder.
fn one(
    (found, recording_typed): (Found, String),
    options: &Options,
    folder: Option<&Path>,
    args: &AuditArgs,
    terminal: &Terminal,
) -> Result<(Outcome, Overview), Failure> {
    // A folder that must not be written is better known before the work than after.
    let folder = folder.map(ReportFolder::new).transpose()?;
    let recording = found.open()?;
    terminal.detail(&format!("{}: {} frames", recording.place(), recording.frames.len()));
    let thumbnails = folder.as_ref().map(|_| Thumbnails::new(&recording));
    let audit = watched(&recording, options, thumbnails.as_ref(), terminal)?;
    let board = options.board.as_ref().or(recording.board.as_ref());
    if let (Some(said), Some(seen)) = (board.and_then(|board| board.layout), audit.layout)
        && said != seen
    {
        terminal.warn(&format!(
            "{}: the board is said to have the layout `{}`, the one in the images is `{}`: taken as seen",
            audit.name,
            said.name(),
            seen.name()
        ));
    }
    let json = wire::to_json(&wire::Audit::new(&audit, args.detail.detail()));
    let report = folder.as_ref().map(|folder| folder.json().display().to_string());
    let typed = Typed { recording: recording_typed, report };
    if let (Some(folder), Some(thumbnails)) = (&folder, thumbnails) {
        let pictures = Pictures::read_beside(&recording, &audit, thumbnails)?;
        folder.write(&json, &report::page(&audit, &pictures, &typed))?;
    }
    if args.json {
        terminal.result(&json)?;
    } else {
        terminal.lines(&report::summary(&audit, &typed, terminal.width()))?;
    }
    if let Some(folder) = folder {
        terminal.say(&format!("report: {}", folder.html().display()));
        if args.open {
            show(&folder, terminal);
        }
    }
    let outcome = if audit.has_faults() { Outcome::Faults } else { Outcome::Clean };
    Ok((outcome, Overview::of(&audit, &typed)))
}

/// The audit, with a progress bar.
pub(crate) fn observed(
    recording: &Recording,
    options: &Options,
    terminal: &Terminal,
) -> Result<Audit, Failure> {
    watched(recording, options, None, terminal)
}

/// The same; small photos are made on the way where they are wanted.
fn watched(
    recording: &Recording,
    options: &Options,
    thumbnails: Option<&Thumbnails>,
    terminal: &Terminal,
) -> Result<Audit, Failure> {
    let bar = terminal.progress(&recording.name, recording.frames.len());
    let result = audit(recording, options, &Watch { recording, bar: &bar, thumbnails });
    bar.finish_and_clear();
    Ok(result?)
}

/// Moves the progress bar, and makes small photos.
struct Watch<'a> {
    recording: &'a Recording,
    bar: &'a ProgressBar,
    thumbnails: Option<&'a Thumbnails>,
}

impl Observer for Watch<'_> {
    fn progress(&self, Progress { stage, done, total }: Progress) {
        self.bar.set_message(format!("{}: {}", self.recording.name, stage.name()));
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
    }

    fn begins(&self, _: usize) -> bool {
        self.thumbnails.is_some_and(Thumbnails::wants_all)
    }

    fn looked(&self, frame: usize, _: &FrameMeasurement, image: Option<&Rgb>) {
        if let (Some(thumbnails), Some(image)) = (self.thumbnails, image) {
            thumbnails.see(frame, image);
        }
    }
}

/// The report as a page, with the recording's images.
pub(crate) fn page(recording: &Recording, audit: &Audit, typed: &Typed) -> Result<String, Failure> {
    Ok(report::page(audit, &Pictures::read(recording, audit)?, typed))
}

/// Opens the report. Where no program does, that is said, and how to open it; the audit itself has run.
pub(crate) fn show(folder: &ReportFolder, terminal: &Terminal) {
    if let Err(failure) = files::open(&folder.html()) {
        terminal.failure(&failure);
    }
}
