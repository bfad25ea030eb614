#![doc = include_str!("td105_depth_not_metric.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
};
use crate::solve::median;

pub(super) const CHECK: Check = Check {
    title: "Depth metric",
    unit: Unit::Percent,
    basis: Basis::Metadata,
    tolerance: Tolerance::fixed(100.0 * COARSE_SHARE),
};

/// Steps as coarse as this share of the depth hide the sensor's noise.
const COARSE_SHARE: f64 = 0.003;
/// An 8-bit image has no more levels.
const LEVELS_8_BIT: usize = 256;
/// Relative spread of the board's depth in a frame that tells which way depth runs.
const LEAST_SPREAD: f64 = 0.1;

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD105, &case.tolerances);
    if case.steps.is_empty() {
        let claim = "Cannot tell whether depth is metric: no frame has depth on the board.";
        return finding.unknown(claim.to_owned(), ToRecord::WithDepth);
    }
    let share = median(&case.steps.iter().map(|s| s.step_share).collect::<Vec<_>>());
    let levels = case.steps.iter().map(|s| s.n_levels).max().unwrap_or(0);
    let (n_with, n_against) = directions(case);
    finding.value = Some(100.0 * share);
    finding.evidence = vec![
        Evidence::number("step_percent_of_depth", 100.0 * share),
        Evidence::number("n_levels_at_most", levels as f64),
        Evidence::number("n_frames_that_grow_with_the_board", n_with as f64),
        Evidence::number("n_frames_that_shrink_with_the_board", n_against as f64),
    ];
    let coarse = share > COARSE_SHARE && levels <= LEVELS_8_BIT;
    let relative = case.factory.and_then(|f| f.depth_absolute) == Some(false);
    let (verdict, claim, what_to_do) = if n_against >= 3 && n_against > 4 * n_with {
        (
            Verdict::Fault,
            format!(
                "Depth is not depth: in {n_against} of {} frames it falls where the board is farther. It is perhaps \
                 disparity.",
                n_against + n_with
            ),
            "Take the reciprocal before it is used as depth, or record depth (kCVPixelFormatType_DepthFloat32).",
        )
    } else if coarse {
        (
            Verdict::Warning,
            format!(
                "Depth comes in coarse steps of {:.2} % of itself, at most {levels} levels in a frame: it was stored \
                 with 8 bits.",
                100.0 * share
            ),
            "Save depth as 16-bit integers or floats. What was rounded away cannot be put back.",
        )
    } else if relative {
        (
            Verdict::Warning,
            "The file says that depth has relative accuracy only: it orders things, it does not measure them."
                .to_owned(),
            "Record with the TrueDepth camera and without filtering; portrait photos hold relative disparity.",
        )
    } else {
        (
            Verdict::Ok,
            format!(
                "Depth is metric: it grows with the board's and comes in steps of {:.3} % of itself.",
                100.0 * share
            ),
            "",
        )
    };
    finding.verdict = verdict;
    finding.claim = claim;
    what_to_do.clone_into(&mut finding.what_to_do);
    finding
}

/// Frames in which the sensor's depth grows with the board's, and in which it falls.
fn directions(case: &Case<'_>) -> (usize, usize) {
    let Some(depth) = case.own_depth.or(case.factory_depth) else { return (0, 0) };
    let mut counts = (0, 0);
    for frame in &depth.frames {
        let n = frame.samples.len() as f64;
        let mean_board = frame.samples.iter().map(|s| s.board_m).sum::<f64>() / n;
        let mean_sensor = frame.samples.iter().map(|s| s.sensor_m).sum::<f64>() / n;
        let (mut bb, mut bs, mut ss) = (0.0, 0.0, 0.0);
        for s in &frame.samples {
            let (b, s) = (s.board_m / mean_board - 1.0, s.sensor_m / mean_sensor - 1.0);
            bb += b * b;
            bs += b * s;
            ss += s * s;
        }
        let correlation = bs / (bb * ss).sqrt();
        if n < 9.0 || !((bb / n).sqrt() > 0.5 * LEAST_SPREAD) {
            continue;
        }
        if correlation > 0.8 {
            counts.0 += 1;
        } else if correlation < -0.8 {
            counts.1 += 1;
        }
    }
    counts
}
