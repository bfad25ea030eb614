#![doc = include_str!("td102_dropped_frames.md")]

use super::{Basis, Case, Check, Code, Evidence, Finding, Known, Unit, Verdict};
use crate::solve::median;

pub(super) const CHECK: Check =
    Check { title: "Dropped frames", unit: Unit::Count, basis: Basis::Metadata, tolerance: None };

/// An interval longer than so many usual ones has lost a frame.
const LONG: f64 = 1.5;

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD102, &case.tolerances);
    let intervals_s: Vec<f64> =
        case.t_ns.windows(2).map(|pair| 1e-9 * (pair[1] - pair[0]) as f64).collect();
    if intervals_s.len() < 3 {
        finding.verdict = Verdict::Info;
        finding.claim =
            format!("{} frames are too few to tell a rhythm, or a gap in it.", case.t_ns.len());
        return finding;
    }
    let usual_s = median(&intervals_s);
    let lost = |interval_s: &f64| {
        if *interval_s > LONG * usual_s { (interval_s / usual_s).round() - 1.0 } else { 0.0 }
    };
    let n_gaps = intervals_s.iter().filter(|i| lost(i) > 0.0).count();
    let n_lost: f64 = intervals_s.iter().map(lost).sum();
    finding.value = Some(n_gaps as f64);
    finding.evidence = vec![
        Evidence::number("usual_interval_s", usual_s),
        Evidence::number("longest_interval_s", intervals_s.iter().copied().fold(0.0, f64::max)),
        Evidence::number("n_missing_by_the_rhythm", n_lost),
    ];
    if n_gaps == 0 {
        finding.verdict = Verdict::Ok;
        finding.claim = format!(
            "{} frames follow each other every {usual_s:.3} s without a gap.",
            case.t_ns.len()
        );
    } else {
        finding.verdict = Verdict::Info;
        finding.claim = format!(
            "Frames usually follow each other every {usual_s:.3} s; in {} {n_lost:.0} more would have \
             fitted.",
            if n_gaps == 1 { "one gap".to_owned() } else { format!("{n_gaps} gaps") }
        );
        finding.what_to_do =
            "Nothing for a calibration: each frame stands for itself. Whoever tracks through time \
                              has to use the timestamps, not the count."
                .to_owned();
    }
    finding
}
