//! `truedepth inspect REC`

use truedepth::{
    diagnose::{Certainty, Inspection, Verdict, inspect},
    recording::Recording,
    report::Tone,
    wire,
};

use crate::{args::InspectArgs, failure::Failure, input, outcome::Outcome, terminal::Terminal};

pub(crate) fn run(args: &InspectArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let registry = input::registry(args.devices.devices.as_deref())?;
    let recording = Recording::open(&args.recording, &input::limits(&args.input))?;
    let inspection = inspect(&recording, &registry);
    if args.json.json {
        terminal.result(&wire::to_json(&wire::Inspect::new(&recording, &inspection)))?;
    } else {
        terminal.result(&words(&recording, &inspection, terminal))?;
        terminal.say(&format!(
            "\nnext: truedepth audit {}   measures what the metadata only let expect",
            args.recording.display()
        ));
    }
    let faults = inspection.findings.iter().any(|f| f.verdict == Verdict::Fault);
    Ok(if faults { Outcome::Faults } else { Outcome::Clean })
}

/// What a person wants to know.
fn words(recording: &Recording, inspection: &Inspection<'_>, terminal: &Terminal) -> String {
    let mut text = terminal.paint(Tone::Strong, &recording.name);
    let sensor = inspection.device.sensor.name();
    text.push_str(&format!(" · {} frames · sensor {sensor}\n\n", recording.frames.len()));
    let mut row = |name: &str, value: String| text.push_str(&format!("  {name:<20}{value}\n"));
    if let Some(identity) = &inspection.identity {
        let info = wire::IdentityInfo::from(identity);
        row(
            "device",
            match identity.certainty {
                Certainty::Unit => {
                    format!("{} (this very unit is published)", info.products.join(" or "))
                }
                Certainty::Camera => {
                    format!("{} (same camera; another unit)", info.products.join(" or "))
                }
                Certainty::SensorOnly => format!(
                    "unknown; reference dimensions as {}, focal length {:+.1} % off",
                    info.products.join(", "),
                    info.focal_difference_percent.unwrap_or_default()
                ),
                Certainty::Unknown => {
                    "unknown: no published device has these dimensions".to_owned()
                }
            },
        );
        if identity.certainty >= Certainty::Camera {
            row("as in the registry", info.matches.join(", "));
        }
    }
    if let Some(sheet) = &inspection.sheet {
        let [w, h] = sheet.reference;
        let [x, y] = sheet.center;
        row("reference", format!("{w}x{h}"));
        row(
            "focal length",
            format!(
                "{:.2} px at the reference, {:.2} px at 640 columns",
                sheet.focal_px,
                sheet.focal_at_px(640.0)
            ),
        );
        row("principal point", format!("({x:.2}, {y:.2}) px at the reference"));
        if let (Some([x, y]), Some(distance)) =
            (sheet.distortion_center, sheet.center_distance_px())
        {
            row("distortion centre", format!("({x:.2}, {y:.2}) px, {distance:.2} px apart"));
        }
    }
    if let Some(factory) = recording.factory() {
        let yes = |flag: Option<bool>, yes: &str, no: &str| match flag {
            Some(true) => yes.to_owned(),
            Some(false) => no.to_owned(),
            None => "not said".to_owned(),
        };
        row("Apple's correction", yes(factory.geometric_distortion_correction, "on", "off"));
        row("tables", if factory.tables.is_some() { "both" } else { "none" }.to_owned());
        row(
            "depth",
            format!(
                "{}, {}",
                yes(factory.depth_absolute, "absolute", "relative"),
                yes(factory.depth_filtered, "filtered", "not filtered")
            ),
        );
    }
    text.push('\n');
    for finding in &inspection.findings {
        let tone = Tone::of(finding.verdict);
        let verdict = terminal.paint(tone, &format!("{:<8}", finding.verdict.name()));
        text.push_str(&format!("{}  {verdict}  {}\n", finding.code, finding.claim));
        if !finding.what_to_do.is_empty() && finding.verdict <= Verdict::Warning {
            text.push_str(&format!("                 → {}\n", finding.what_to_do));
        }
    }
    text
}
