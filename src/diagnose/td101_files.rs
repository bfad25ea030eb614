#![doc = include_str!("td101_files.md")]

use super::td103_metadata_incomplete::is_about_metadata;
use super::{Case, Code, Evidence, Finding, Unit, Verdict};
use crate::recording::Problem;

pub(super) fn check(case: &Case<'_>) -> Finding {
    let mut finding = Finding::new(Code::TD101, Unit::Count);
    let about: Vec<&Problem> = case.problems.iter().filter(|p| !is_about_metadata(p)).collect();
    let n = about.len();
    finding.value = Some(n as f64);
    finding.evidence = vec![Evidence::number("n_frames", case.n_frames as f64)];
    if n == 0 {
        finding.verdict = Verdict::Ok;
        finding.summary = format!("All files of the {} frames belong together.", case.n_frames);
        return finding;
    }
    let harmless = about.iter().all(|p| matches!(p, Problem::IntrinsicsVary { .. }));
    finding.verdict = if harmless { Verdict::Info } else { Verdict::Warning };
    let list: Vec<String> = about.iter().map(ToString::to_string).collect();
    finding.summary = format!("{}.", list.join("; "));
    finding.what_to_do = if harmless {
        "Nothing need be done: frames are paired by time, so that what is missing costs only itself."
    } else {
        "Look whether files were lost on the way; what is missing was left out here."
    }
    .to_owned();
    finding
}
