//! `truedepth demo`

use std::sync::Arc;

use truedepth::{
    audit::{Audit, Options},
    calibrate::Estimate,
    files::{Limits, Memory},
    measure::Method,
    recording::{Defect, Recording},
    report::{self, Tone, Typed},
    simulate::{Device, Faults, Plan, Truth},
    wire,
};

use super::audit::{observed, page, show};
use crate::{
    args::DemoArgs,
    failure::Failure,
    files::{ReportFolder, file_url, write_atomically},
    outcome::Outcome,
    terminal::Terminal,
};

/// The tablet of the paper's issue 2 (arXiv:2201.10865), as bad as it was measured there.
const DEVICE: &str = "ipad-12.9-5gen";
/// What the recording is called in the commands that are shown.
const RECORDING: &str = "ipad";
const FAULTS: [Defect; 2] = [Defect::Focal { ratio: 1.066 }, Defect::DepthScale { ratio: 1.015 }];

pub(crate) fn run(args: &DemoArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let folder = ReportFolder::new(&args.output)?;
    let mut plan = Plan::new(Device::named(DEVICE)?, args.seed);
    plan.faults = Faults::new(FAULTS)?;
    plan.n_frames = 30;

    let faults: Vec<String> = FAULTS.iter().map(ToString::to_string).collect();
    terminal.say(&format!(
        "simulating {} frames of an {} with {}",
        plan.n_frames,
        plan.device.product,
        faults.join(" and ")
    ));
    let bar = terminal.progress("rendering", plan.n_frames);
    let memory = plan.write(Memory::new(DEVICE), |done| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    let recording = Recording::from_files(Arc::new(memory), &Limits::default())?;

    terminal.say("auditing it as if nothing were known of it\n");
    let audit = observed(&recording, &Options::new(Method::Auto), terminal)?;
    let json = wire::to_json(&wire::Audit::new(&audit, wire::Detail::Summary));
    let typed = Typed {
        recording: RECORDING.to_owned(),
        report: Some(folder.json().display().to_string()),
    };
    folder.write(&json, &page(&recording, &audit, &typed)?)?;
    let truth = plan.truth();
    write_atomically(&args.output.join("truth.json"), truth.to_json().as_bytes())?;

    if args.json.json {
        terminal.result(&json)?;
    } else {
        terminal.lines(&report::summary(&audit, &typed, terminal.width()))?;
        terminal.result(&beside(&truth, &audit, terminal))?;
    }
    let flags: Vec<String> = faults.iter().map(|fault| format!("--fault {fault}")).collect();
    terminal.say(&format!("\nthe report:    {}", file_url(&folder.html())));
    terminal.say(&format!(
        "the recording, which the commands above want:\n               \
         truedepth simulate --device {DEVICE} {} --frames {} --seed {} -o {RECORDING}",
        flags.join(" "),
        plan.n_frames,
        plan.seed
    ));
    terminal.say("your own:      truedepth audit REC");
    if args.open {
        show(&folder, terminal);
    }
    Ok(if audit.has_faults() { Outcome::Faults } else { Outcome::Clean })
}

/// What was put into the simulation beside what came out of the audit.
fn beside(truth: &Truth, found: &Audit, terminal: &Terminal) -> String {
    let estimate = |estimate: Option<Estimate>, decimals: usize| match estimate {
        Some(Estimate { value, sigma }) => format!("{value:.decimals$} ± {sigma:.decimals$}"),
        None => "cannot tell".to_owned(),
    };
    let focal_px = found
        .calibration
        .as_ref()
        .map(|c| Estimate { value: c.camera.intrinsics.focal_px(), sigma: c.focal_px().sigma });
    let rows = [
        ("focal length, px", format!("{:.2}", truth.camera.focal_px), estimate(focal_px, 2)),
        (
            "depth scale",
            format!("{:.4}", truth.depth.scale),
            estimate(found.registration.as_ref().map(|r| r.scale), 4),
        ),
        ("stream", truth.camera.stream.clone(), found.distortion_state.name().to_owned()),
    ];
    let head = format!("{:<18}{:<14}{}", "", "truth", "found");
    let mut text = format!("\n{}\n", terminal.paint(Tone::Strong, &head));
    for (name, truth, found) in rows {
        text.push_str(&format!("{name:<18}{truth:<14}{found}\n"));
    }
    text
}
