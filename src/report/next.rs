//! What to type next.

use crate::{
    audit::Audit,
    diagnose::{
        Api, Certainty, Code, Entry, Finding, Identity, KnownIssue, Registry, Sheet, Verdict,
    },
};

/// What was typed to come to an audit, so that its report can say what to type next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Typed {
    /// The recording: its path, as it can be typed again.
    pub recording: String,
    /// Where the report's `report.json` lies; `None` where none is written.
    pub report: Option<String>,
}

impl Typed {
    /// Where nothing is known but the audit: the recording by its name.
    pub fn of(audit: &Audit) -> Self {
        Self { recording: audit.name.clone(), report: None }
    }
}

/// A command, and what it is good for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NextStep {
    /// Completes "to ...".
    pub(super) to: &'static str,
    pub(super) command: String,
}

/// What to type next, in this order; nothing where nothing is wrong and nothing open.
pub(super) fn next_steps(audit: &Audit, typed: &Typed) -> Vec<NextStep> {
    let fixed = quoted(&format!("{}-corrected", last_part(&audit.name)));
    let recording = quoted(&typed.recording);
    let step = |to, command| NextStep { to, command };
    let is_open =
        |f: &&Finding| matches!(f.verdict, Verdict::Fault | Verdict::Warning | Verdict::Unknown);
    let mut steps = Vec::new();
    let can_correct = |f: &Finding| f.verdict == Verdict::Fault && f.defect.is_some();
    if audit.findings.iter().any(can_correct) {
        let with =
            typed.report.as_ref().map_or(String::new(), |r| format!(" --with {}", quoted(r)));
        steps.push(step("correct it", format!("truedepth correct {recording} -o {fixed}{with}")));
        steps.push(step("check that", format!("truedepth audit {fixed}")));
    } else if audit.calibration.is_none()
        && audit.camera.is_none()
        && audit.findings.iter().any(|f| f.verdict == Verdict::Unknown)
    {
        steps.push(step("look again, once recorded as said", "truedepth audit NEW".to_owned()));
        steps.push(step(
            "take the camera from a recording that moves round the board",
            format!(
                "truedepth calibrate MOVING --json > camera.json && \
                 truedepth audit {recording} --calibration camera.json"
            ),
        ));
        if let Some(row) = other_side(audit) {
            steps.push(step(
                "correct what is known of this very device, unmeasured",
                format!("truedepth correct {recording} -o {fixed} {row}"),
            ));
        }
    }
    let first = super::words::by_severity(audit).into_iter().find(is_open);
    steps.extend(first.map(|finding| step("read more", explain_command(finding))));
    steps
}

/// What to type to read more of one finding.
pub(super) fn explain_command(finding: &Finding) -> String {
    format!("truedepth explain {}", finding.code)
}

/// What the registry knows of this camera and the recording bears out or cannot tell, in a sentence.
pub(super) fn known_of_this_camera(audit: &Audit) -> Option<String> {
    let registry = Registry::published();
    let identity = identity(audit, &registry)?;
    let issues: Vec<&str> = identity
        .issues
        .iter()
        .filter(|issue| {
            let code = match issue {
                KnownIssue::DepthZoom => Code::TD401,
                KnownIssue::FocalLength => Code::TD201,
                KnownIssue::NotRectified => Code::TD203,
            };
            let verdict = audit.findings.iter().find(|f| f.code == code).map(|f| f.verdict);
            matches!(verdict, Some(Verdict::Fault | Verdict::Unknown) | None)
        })
        .map(|issue| issue.words())
        .collect();
    let which = match identity.certainty {
        Certainty::Unit => "this very device",
        _ => "this camera",
    };
    (!issues.is_empty()).then(|| format!("Known of {which}: {}.", issues.join("; ")))
}

fn identity<'a>(audit: &Audit, registry: &'a Registry) -> Option<Identity<'a>> {
    let sheet = Sheet::from_factory(audit.factory.as_ref()?)?;
    let identity = registry.identify(&sheet);
    (identity.certainty >= Certainty::Camera).then_some(identity)
}

/// The flag of `correct` that names the other API's row of this very device, where the paper's equations correct it.
fn other_side(audit: &Audit) -> Option<String> {
    let registry = Registry::published();
    let identity = identity(audit, &registry)?;
    if identity.certainty != Certainty::Unit {
        return None;
    }
    let own = identity.matches.first()?;
    let needed = match own.api {
        Api::AvFoundation => KnownIssue::FocalLength,
        Api::ArKit => KnownIssue::DepthZoom,
    };
    if !identity.issues.contains(&needed) {
        return None;
    }
    let is_other =
        |e: &&Entry| e.device == own.device && e.version == own.version && e.api != own.api;
    let other = registry.entries().iter().find(is_other)?;
    Some(format!("--{} {}", other.api.name(), other.name()))
}

/// The last part of a path, or of a name out of an archive.
fn last_part(name: &str) -> &str {
    let last = name.trim_end_matches(['/', '\\']).rsplit(['/', '\\']).next().unwrap_or_default();
    if last.trim_matches('.').is_empty() { "recording" } else { last }
}

/// As a POSIX shell takes it for one word that is no option.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_./-+:=@%,".contains(c);
    let word = if word.starts_with('-') { format!("./{word}") } else { word.to_owned() };
    if !word.is_empty() && word.chars().all(is_plain) {
        return word;
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    fn commands(audit: &Audit, typed: &Typed) -> Vec<String> {
        next_steps(audit, typed).into_iter().map(|step| step.command).collect()
    }

    #[test]
    fn a_fault_with_a_correction_is_corrected_and_checked() {
        let audit = sample::audit();
        let typed = Typed {
            recording: "my data/ipad".to_owned(),
            report: Some("ipad-report/report.json".to_owned()),
        };
        assert_eq!(
            commands(&audit, &typed),
            [
                "truedepth correct 'my data/ipad' -o iPadPro12_5gen-corrected --with ipad-report/report.json",
                "truedepth audit iPadPro12_5gen-corrected",
                "truedepth explain TD201",
            ]
        );
    }

    #[test]
    fn what_cannot_be_told_is_recorded_again() {
        let mut audit = sample::audit();
        audit.measured.calibration = None;
        audit.measured.camera = None;
        audit.findings.retain(|f| f.verdict != Verdict::Fault);
        let commands = commands(&audit, &Typed::of(&audit));
        assert_eq!(commands[0], "truedepth audit NEW");
        assert!(commands[1].ends_with("truedepth audit iPadPro12_5gen --calibration camera.json"));
        assert!(
            commands.last().is_some_and(|last| last == "truedepth explain TD301"),
            "{commands:?}"
        );
        audit.findings.clear();
        assert_eq!(next_steps(&audit, &Typed::of(&audit)), []);
    }

    #[test]
    fn names_are_words_of_a_shell() {
        for (word, expected) in [
            ("iPad_1/rec-2", "iPad_1/rec-2"),
            ("a b", "'a b'"),
            ("it's", r"'it'\''s'"),
            ("-rf", "./-rf"),
            ("$(x)", "'$(x)'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(word), expected);
        }
        assert_eq!([last_part("a/b/"), last_part(".."), last_part("x")], ["b", "recording", "x"]);
    }
}
