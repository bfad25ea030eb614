#![doc = include_str!("td303_depth_noise.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::plain,
};
use crate::depth::{STILL_PX, TemporalNoise};
use crate::math;

pub(super) const CHECK: Check = Check {
    title: "Depth noise and holes",
    unit: Unit::Percent,
    basis: Basis::Depth,
    tolerance: Tolerance::fixed(MANY_HOLES_PERCENT),
};

/// Share of holes within the sensor's reach beyond which a recording is short of depth, percent.
const MANY_HOLES_PERCENT: f64 = 10.0;
/// Holes are judged where at least this share of the board's pixels is within reach.
const LEAST_IN_REACH: f64 = 0.2;
/// Noise of single pixels of a sound sensor: σ² = floor² + (z²·growth)², measured on the published recordings.
const FLOOR_M: f64 = 0.17e-3;
const GROWTH_PER_M: f64 = 2.2e-3;
/// So many times that is no sound sensor's noise.
const MUCH: f64 = 4.0;

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD303, &case.tolerances);
    let Some(found) = case.registration else {
        finding.show("", "—");
        finding.evidence = evidence_between_frames(case.temporal_noise);
        let claim = format!(
            "Cannot tell how noisy depth is: no own camera, or too few frames with depth on the board. {}",
            between_frames(case.temporal_noise),
        );
        return finding.unknown(claim, ToRecord::Unhindered);
    };
    let pattern = &found.pattern;
    let expected_m = math::hypot(FLOOR_M, found.center_m * found.center_m * GROWTH_PER_M);
    let times = pattern.pixel_noise_m / expected_m;
    let holes = &pattern.holes;
    let in_reach = holes.n_pixels_in_reach as f64 / holes.n_pixels.max(1) as f64;
    let share = holes.share_in_reach().filter(|_| in_reach >= LEAST_IN_REACH);
    finding.value = share.map(|share| 100.0 * share);
    finding.show("", format!("{} mm noise", plain(1e3 * pattern.pixel_noise_m, 2)));
    if let (Some(row), Some(percent)) = (&mut finding.quantity, finding.value) {
        row.difference = Some(format!("{} % holes", plain(percent, 2)));
    }
    finding.evidence = vec![
        Evidence::number("pixel_noise_mm", 1e3 * pattern.pixel_noise_m),
        Evidence::number("pixel_noise_of_a_sound_sensor_mm", 1e3 * expected_m),
        Evidence::number("frame_to_frame_mm", 1e3 * pattern.frame_noise_m),
        Evidence::number("same_in_all_frames_mm", 1e3 * pattern.fixed_m),
        Evidence::number("n_pixels_on_board", holes.n_pixels as f64),
        Evidence::number("n_holes_on_board", holes.n_holes as f64),
        Evidence::number("n_pixels_in_reach", holes.n_pixels_in_reach as f64),
        Evidence::number("n_holes_in_reach", holes.n_holes_in_reach as f64),
    ];
    finding.evidence.extend(evidence_between_frames(case.temporal_noise));
    let numbers = format!(
        "single pixels scatter by {:.2} mm about small planes ({times:.1} times what a sound sensor does at {:.2} m), \
         places of the image by {:.2} mm from frame to frame, and {:.2} mm stay in all frames",
        1e3 * pattern.pixel_noise_m,
        found.center_m,
        1e3 * pattern.frame_noise_m,
        1e3 * pattern.fixed_m,
    );
    let noisy = times > MUCH;
    let torn = share.is_some_and(|share| 100.0 * share > MANY_HOLES_PERCENT);
    let gaps = share.map_or_else(
        || {
            format!(
                "only {:.1} % of the board's pixels were at 0.2 m or more and seen under 60 degrees at most; holes are \
                 judged from 20 % on",
                100.0 * in_reach
            )
        },
        |share| format!("{:.2} % of the pixels on the board within reach are holes", 100.0 * share),
    );
    finding.claim = format!(
        "{}: {numbers}; {gaps}. {}",
        match (noisy, torn) {
            (true, _) => "Depth is noisier than a sound sensor's",
            (false, true) => "Depth has many holes",
            (false, false) => "Depth is as noisy as a sound sensor's",
        },
        between_frames(case.temporal_noise),
    );
    match (noisy || torn, share) {
        (true, _) => {
            finding.verdict = Verdict::Warning;
            let record = ToRecord::Unhindered.words();
            finding.what_to_do = format!("Clean the front glass, and look for sunlight. {record}");
        }
        (false, None) => finding.record(ToRecord::Unhindered),
        (false, Some(_)) => finding.verdict = Verdict::Ok,
    }
    finding
}

/// What single pixels do between frames in which nothing moved, in a sentence.
fn between_frames(found: Option<&TemporalNoise>) -> String {
    let n_successive = found.map_or(0, |found| found.n_successive);
    let Some(at) = found.and_then(TemporalNoise::most_seen) else {
        let why = if n_successive == 0 {
            "no two successive frames show the board with depth".to_owned()
        } else {
            format!(
                "in none of {n_successive} pairs of successive frames did the board stand still (to {STILL_PX} px)"
            )
        };
        return format!(
            "What comes and goes at a pixel from frame to frame cannot be told: {why}."
        );
    };
    format!(
        "Where nothing moved between successive frames (pairs: {}), a pixel comes and goes by {:.3} ± {:.3} mm at \
         {:.2} m, of {:.2} mm within one frame: the rest is pattern and print, which averaging frames leaves.",
        at.n_pairs,
        1e3 * at.noise_m.value,
        1e3 * at.noise_m.sigma,
        at.depth_m,
        1e3 * at.one_frame_m,
    )
}

fn evidence_between_frames(found: Option<&TemporalNoise>) -> Vec<Evidence> {
    let Some(found) = found else { return Vec::new() };
    let mut evidence = vec![
        Evidence::number("n_successive_pairs", found.n_successive as f64),
        Evidence::number("n_still_pairs", found.n_still as f64),
    ];
    if let Some(at) = found.most_seen() {
        evidence.push(Evidence::number("temporal_noise_mm", 1e3 * at.noise_m.value));
        evidence.push(Evidence::number("temporal_noise_sigma_mm", 1e3 * at.noise_m.sigma));
    }
    evidence
}
