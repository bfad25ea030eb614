//! `truedepth correct REC -o OUT`

use std::{
    fs,
    path::{Path, PathBuf},
};

use truedepth::{
    audit::Options,
    correct::{Plan, Progress, Reason, Sampling, Selection, Step, correct_observed},
    diagnose::{self, Api, Finding},
    files::{AtomicFolder, Output},
    measure::Method,
    recording::Recording,
    wire,
};

use super::audit::observed;
use crate::{
    args::{CorrectArgs, DevicesArgs, InputArgs, SamplingChoice, Steps},
    failure::Failure,
    input,
    outcome::Outcome,
    terminal::Terminal,
};

/// What the output's own description is called.
const PROVENANCE: &str = "provenance.json";

pub(crate) fn run(args: &CorrectArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    refuse_inside(&args.output, &args.recording)?;
    let recording = Recording::open(&args.recording, &input::limits(&args.input))?;
    // A folder that must not be written is better known before the work than after.
    let mut sink = AtomicFolder::create(&args.output)?;
    let only: Vec<&str> = args.only.iter().map(String::as_str).collect();
    let asked = Asked {
        path: &args.recording,
        steps: args.what.chosen(),
        selection: match (&only[..], args.within_tolerance) {
            ([], false) => Selection::Faults,
            ([], true) => Selection::Significant,
            (names, _) => Selection::Only(names),
        },
        devices: &args.devices,
        input: &args.input,
    };
    let (plan, findings) = plan(&asked, &recording, terminal)?;
    let plan = plan.sampled(match args.sampling {
        SamplingChoice::EdgeAware => Sampling::EdgeAware,
        SamplingChoice::Nearest => Sampling::Nearest,
    });
    if plan.is_empty() && !args.always {
        terminal.say(&format!("{}: nothing to correct; nothing was written", recording.name));
        return Ok(Outcome::Clean);
    }
    let bar = terminal.progress("correcting", recording.frames.len());
    let done = correct_observed(&recording, &plan, &mut sink, &mut |Progress { done, .. }| {
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    let document = wire::Correct::new(&recording, &plan, done, findings);
    let words = words(&document, &args.output);
    let json = wire::to_json(&document);
    sink.write(PROVENANCE, json.as_bytes())?;
    sink.commit()?;
    if args.json.json {
        terminal.result(&json)?;
    } else {
        terminal.result(&words)?;
    }
    terminal.say(&format!("next: truedepth audit {}", args.output.display()));
    Ok(Outcome::Clean)
}

/// What was asked for.
pub(super) struct Asked<'a> {
    /// Of this recording.
    pub(super) path: &'a Path,
    pub(super) steps: Steps<'a>,
    pub(super) selection: Selection<'a>,
    pub(super) devices: &'a DevicesArgs,
    pub(super) input: &'a InputArgs,
}

/// What is to be done, and the findings that ask for it.
pub(super) fn plan(
    asked: &Asked<'_>,
    recording: &Recording,
    terminal: &Terminal,
) -> Result<(Plan, Vec<Finding>), Failure> {
    let said = || {
        let none = || Failure::new(format!("{} has no factory metadata", recording.place()));
        recording.factory().map(|f| f.intrinsics).ok_or_else(none)
    };
    let plan = match asked.steps {
        Steps::Audit => {
            let mut options = Options::new(Method::Auto);
            options.board = input::board(&asked.input.board)?;
            let audit = observed(recording, &options, terminal)?;
            let plan = Plan::of_audit(&audit, asked.selection)?;
            let findings = taken(asked, &plan, audit.findings, terminal);
            return Ok((plan, findings));
        }
        Steps::With(path) => match input::document(path)? {
            wire::Input::Audit(audit) => {
                let plan = audit.plan(asked.selection)?;
                let findings = taken(asked, &plan, audit.findings, terminal);
                return Ok((plan, findings));
            }
            _ => Plan::of_camera(&input::camera(path)?, &said()?)?,
        },
        Steps::Faults(defects) => Plan::given(defects)?,
        Steps::Pair { av, ar } => by_equations(asked, av, ar)?,
    };
    let plan = match asked.selection {
        Selection::Only(names) => plan.only(names),
        _ => plan,
    };
    Ok((plan, Vec::new()))
}

/// The findings that the plan follows; those that it leaves alone are said.
fn taken(
    asked: &Asked<'_>,
    plan: &Plan,
    findings: Vec<Finding>,
    terminal: &Terminal,
) -> Vec<Finding> {
    let (taken, left): (Vec<_>, Vec<_>) = findings
        .into_iter()
        .filter(|finding| finding.defect.is_some())
        .partition(|f| plan.steps().iter().any(|step| step.reason == Reason::Finding(f.code)));
    for finding in &taken {
        terminal.detail(&format!("{}: {}", finding.code, finding.claim));
    }
    if asked.selection == Selection::Faults {
        for finding in left {
            terminal.say(&format!(
                "left alone, within the tolerance: {}: {} (--within-tolerance corrects it)",
                finding.code, finding.claim
            ));
        }
    }
    taken
}

/// The paper's equations from both APIs' metadata.
fn by_equations(asked: &Asked<'_>, av: Option<&str>, ar: Option<&str>) -> Result<Plan, Failure> {
    let registry = input::registry(asked.devices.devices.as_deref())?;
    let shown = asked.path.display().to_string();
    let side = |text: Option<&str>, api: Api| -> Result<diagnose::Side, Failure> {
        let side = input::side(text.unwrap_or(&shown), &registry, asked.input)?;
        Ok(diagnose::Side { api: Some(api), ..side })
    };
    let pair = diagnose::compare(side(av, Api::AvFoundation)?, side(ar, Api::ArKit)?);
    let across = pair.across.ok_or_else(|| Failure::new("both sides are of one API"))?;
    // The recording is the side that is not given.
    let defect = across.defect(if av.is_some() { Api::ArKit } else { Api::AvFoundation });
    let step = |defect| Step { defect, reason: Reason::Equations };
    Ok(Plan::new(defect.into_iter().map(step).collect(), None)?)
}

/// The output must not lie in the input, nor the other way round.
pub(super) fn refuse_inside(output: &Path, input: &Path) -> Result<(), Failure> {
    let (Some(output), Some(input)) = (resolved(output), resolved(input)) else { return Ok(()) };
    if output.starts_with(&input) || input.starts_with(&output) {
        let message = format!(
            "{} and {} lie in each other; nothing was written",
            output.display(),
            input.display()
        );
        return Err(Failure::new(message).hint("name a new folder beside the recording with -o"));
    }
    Ok(())
}

/// The path without links, also where its last parts are not there yet.
fn resolved(path: &Path) -> Option<PathBuf> {
    let absolute = std::path::absolute(path).ok()?;
    let there = absolute.ancestors().find(|ancestor| ancestor.exists())?;
    let rest = absolute.strip_prefix(there).ok()?;
    Some(fs::canonicalize(there).ok()?.join(rest))
}

/// What was done.
fn words(document: &wire::Correct, output: &Path) -> String {
    let mut text = format!("{}: {} frames\n", output.display(), document.n_frames);
    for Step { defect, reason } in &document.steps {
        text.push_str(&format!("  {:<17} {defect:.6}   ({})\n", defect.step(), reason.name()));
    }
    if let (Some(before), Some(after)) = (&document.factory_before, &document.factory_after)
        && before != after
    {
        let pinhole = |p: &wire::PinholeInfo| {
            format!(
                "f {:.2} px, centre ({:.2}, {:.2})",
                f64::midpoint(p.focal_xy_px[0], p.focal_xy_px[1]),
                p.principal_point_px[0],
                p.principal_point_px[1]
            )
        };
        text.push_str(&format!("  metadata said {}, say {}\n", pinhole(before), pinhole(after)));
    }
    if !document.left_out.is_empty() {
        text.push_str(&format!(
            "  left out, because they do not count in the input either: {}\n",
            document.left_out.join(", ")
        ));
    }
    text
}
