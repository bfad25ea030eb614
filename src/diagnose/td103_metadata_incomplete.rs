#![doc = include_str!("td103_metadata_incomplete.md")]

use super::{Basis, Case, Check, Code, Evidence, Finding, Known, Unit, Verdict};
use crate::recording::Problem;

pub(super) const CHECK: Check =
    Check { title: "Metadata", unit: Unit::Count, basis: Basis::Metadata, tolerance: None };

/// What this check speaks of; the others are [`td101_files`](super::td101_files)'s.
pub(super) fn is_about_metadata(problem: &Problem) -> bool {
    matches!(
        problem,
        Problem::MetadataMissing { .. }
            | Problem::MetadataWithoutImages { .. }
            | Problem::ImagesWithoutMetadata { .. }
            | Problem::DuplicateMetadata { .. }
            | Problem::MetadataOutOfOrder { .. }
            | Problem::ReferenceShape { .. }
            | Problem::SingleTable { .. }
    )
}

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD103, &case.tolerances);
    let about: Vec<&Problem> = case.problems.iter().filter(|p| is_about_metadata(p)).collect();
    finding.value = Some(about.len() as f64);
    finding.evidence = vec![Evidence::number("n_frames", case.n_frames as f64)];
    if about.is_empty() {
        finding.verdict = Verdict::Ok;
        finding.claim = format!("The metadata are complete for all {} frames.", case.n_frames);
        return finding;
    }
    let lost = about.iter().any(|problem| {
        matches!(
            problem,
            Problem::MetadataMissing { .. }
                | Problem::ImagesWithoutMetadata { .. }
                | Problem::ReferenceShape { .. }
                | Problem::SingleTable { .. }
        )
    });
    finding.verdict = if lost { Verdict::Warning } else { Verdict::Info };
    let list: Vec<String> = about.iter().map(ToString::to_string).collect();
    finding.claim = format!("{}.", list.join("; "));
    finding.what_to_do = if lost {
        "Look whether the metadata file was cut off: the app writes it last, and from several threads. What is missing \
         was left out here, not guessed."
    } else {
        "Nothing need be done: entries are paired with images by time."
    }
    .to_owned();
    finding
}
