#![doc = include_str!("td101_files.md")]

use super::td103_metadata_incomplete::is_about_metadata;
use super::{Basis, Case, Check, Code, Evidence, Finding, Known, Unit, Verdict};
use crate::recording::Problem;

pub(super) const CHECK: Check = Check {
    title: "Files and pairing",
    unit: Unit::Count,
    basis: Basis::Metadata,
    tolerance: None,
};

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD101, &case.tolerances);
    let about: Vec<&Problem> = case.problems.iter().filter(|p| !is_about_metadata(p)).collect();
    let n = about.len();
    finding.value = Some(n as f64);
    finding.evidence = vec![Evidence::number("n_frames", case.n_frames as f64)];
    if n == 0 {
        finding.verdict = Verdict::Ok;
        finding.claim = format!("All files of the {} frames belong together.", case.n_frames);
        return finding;
    }
    let harmless = about.iter().all(|p| matches!(p, Problem::IntrinsicsVary { .. }));
    finding.verdict = if harmless { Verdict::Info } else { Verdict::Warning };
    let list: Vec<String> = about.iter().map(ToString::to_string).collect();
    finding.claim = format!("{}.", list.join("; "));
    finding.what_to_do = if harmless {
        "Nothing need be done: frames are paired by time, so that what is missing costs only itself."
    } else {
        "Look whether files were lost on the way; what is missing was left out here."
    }
    .to_owned();
    finding
}
