//! `truedepth correct REC -o OUT`

use std::{
    fs,
    path::{Path, PathBuf},
};

use truedepth::{
    audit::{Method, Options},
    correct::{Because, Plan, Progress, Sampling, Step, Which, correct_observed},
    diagnose::{self, Api, KnownIssue},
    recording::{Recording, Sink, WholeFolder},
    report::{self, wire},
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
    let mut sink = WholeFolder::create(&args.output)?;
    let only: Vec<&str> = args.only.iter().map(String::as_str).collect();
    let asked = Asked {
        path: &args.recording,
        steps: args.what.chosen(),
        which: match (&only[..], args.within_tolerance) {
            ([], false) => Which::Faults,
            ([], true) => Which::Significant,
            (names, _) => Which::Only(names),
        },
        sampling: match args.sampling {
            SamplingChoice::EdgeAware => Sampling::EdgeAware,
            SamplingChoice::Nearest => Sampling::Nearest,
        },
        devices: &args.devices,
        input: &args.input,
    };
    let (plan, findings) = plan(&asked, &recording, terminal)?;
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
    let json = report::to_json(&wire::Document::Correct(Box::new(document)));
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
    pub(super) which: Which<'a>,
    pub(super) sampling: Sampling,
    pub(super) devices: &'a DevicesArgs,
    pub(super) input: &'a InputArgs,
}

/// What is to be done, and the findings that ask for it.
pub(super) fn plan(
    asked: &Asked<'_>,
    recording: &Recording,
    terminal: &Terminal,
) -> Result<(Plan, Vec<wire::FindingInfo>), Failure> {
    let sampling = asked.sampling;
    let by_audit = |audit: &wire::Audit| -> Result<_, Failure> {
        let plan = audit.plan(asked.which, sampling)?;
        let taken = |finding: &&wire::FindingInfo| {
            plan.steps().iter().any(|(_, because)| because.name() == finding.code)
        };
        for finding in audit.findings.iter().filter(taken) {
            terminal.detail(&format!("{}: {}", finding.code, finding.summary));
        }
        let left = audit.findings.iter().filter(|f| f.correction.is_some() && !taken(f));
        if asked.which == Which::Faults {
            for finding in left {
                terminal.say(&format!(
                    "left alone, within the tolerance: {}: {} (--within-tolerance corrects it)",
                    finding.code, finding.summary
                ));
            }
        }
        let findings = audit.findings.iter().filter(taken).cloned().collect();
        Ok((plan, findings))
    };
    let only = |plan: Plan| match asked.which {
        Which::Only(names) => plan.only(names),
        _ => plan,
    };
    match asked.steps {
        Steps::Audit => {
            let mut options = Options::new(Method::Auto);
            options.board = input::board(&asked.input.board)?;
            by_audit(&wire::Audit::from(&observed(recording, &options, terminal)?))
        }
        Steps::With(path) => match input::document(path)? {
            wire::Document::Audit(audit) => by_audit(&audit),
            _ => Ok((only(Plan::from_camera(&input::camera(path)?, sampling)?), Vec::new())),
        },
        Steps::Faults(faults) => {
            let said = recording.factory().map(|f| f.intrinsics).ok_or_else(|| {
                Failure::new(format!("{} has no factory metadata", recording.place()))
            })?;
            let plan = Plan::from_faults(faults.iter().copied(), &said, sampling)?;
            Ok((only(plan), Vec::new()))
        }
        Steps::Pair { av, ar } => Ok((only(by_equations(asked, recording, av, ar)?), Vec::new())),
    }
}

/// The paper's equations from both APIs' metadata.
fn by_equations(
    asked: &Asked<'_>,
    recording: &Recording,
    av: Option<&str>,
    ar: Option<&str>,
) -> Result<Plan, Failure> {
    let registry = input::registry(asked.devices.devices.as_deref())?;
    let shown = asked.path.display().to_string();
    let side = |text: Option<&str>, api: Api| -> Result<diagnose::Side, Failure> {
        let side = input::side(text.unwrap_or(&shown), &registry, asked.input)?;
        Ok(diagnose::Side { api: Some(api), ..side })
    };
    let pair = diagnose::compare(side(av, Api::AvFoundation)?, side(ar, Api::ArKit)?);
    let across = pair.across.ok_or_else(|| Failure::new("both sides are of one API"))?;
    let width = recording.factory().map_or(640, |f| f.intrinsics.width) as f64;
    let is_ar = av.is_some();
    let step = match across.issue {
        Some(KnownIssue::DepthZoom) if is_ar => Some(Step::DepthZoom { zoom: across.depth_zoom }),
        Some(KnownIssue::FocalLength) => {
            let (px, sheet) = match is_ar {
                true => (across.ar_corrected_px, &pair.second.sheet),
                false => (across.av_corrected_px, &pair.first.sheet),
            };
            Some(Step::Focal { focal_px: px * width / sheet.reference[0] })
        }
        _ => None,
    };
    let steps = step.into_iter().map(|step| (step, Because::Equations)).collect();
    Ok(Plan::because(steps, asked.sampling)?)
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
    for step in &document.steps {
        let mut parameters: Vec<String> =
            step.parameters.iter().map(|(name, value)| format!("{name} {value:.6}")).collect();
        parameters.extend(step.how.clone());
        text.push_str(&format!(
            "  {:<17} {}   ({})\n",
            step.step,
            parameters.join(", "),
            step.because
        ));
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
