#![doc = include_str!("td104_depth_unit.md")]

use super::{Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Unit, Verdict};
use crate::{
    math,
    recording::Defect,
    solve::{mad_sigma, median},
};

pub(super) const CHECK: Check =
    Check { title: "Unit of depth", unit: Unit::Count, basis: Basis::Metadata, tolerance: None };

/// Samples that make a median.
const LEAST_SAMPLES: usize = 20;
/// No focal length is wrong by so much; no unit differs from metres by less.
const FAR_OFF: f64 = 3.0;

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD104, &case.tolerances);
    let depth = case.own_depth.or(case.factory_depth);
    let ratios: Vec<f64> = depth
        .iter()
        .flat_map(|d| &d.frames)
        .flat_map(|f| &f.samples)
        .map(|s| math::ln(s.sensor_m / s.board_m))
        .filter(|ln| ln.is_finite())
        .collect();
    if ratios.len() < LEAST_SAMPLES {
        let claim = "Cannot tell the unit of depth: it was hardly measured on the board.";
        return finding.unknown(claim.to_owned(), ToRecord::WithDepth);
    }
    let middle = median(&ratios);
    let ratio = math::exp(middle);
    finding.value = Some(ratio);
    finding.evidence = vec![
        Evidence::number("sensor_over_board", ratio),
        Evidence::number("scatter_of_the_ratio_percent", 100.0 * mad_sigma(&ratios, middle)),
        Evidence::number("n_samples", ratios.len() as f64),
    ];
    if ratio < FAR_OFF && ratio > FAR_OFF.recip() {
        finding.verdict = Verdict::Ok;
        finding.claim = format!(
            "Depth is in metres: on the board the sensor says {ratio:.3} times the board's depth."
        );
        return finding;
    }
    finding.verdict = Verdict::Fault;
    let power = math::log10(ratio).round();
    let unit = math::pow(10f64, power);
    finding.claim = format!(
        "Depth is in the wrong unit: on the board the sensor says {ratio:.3} times the board's depth."
    );
    finding.test = format!(
        "Median of {} samples; no camera is wrong by a factor of {FAR_OFF:.0}.",
        ratios.len()
    );
    finding.what_to_do = if power == 0.0 {
        "Find out what the numbers count: the factor is no power of ten. Check the size of the board's squares, too."
    } else {
        "Divide depth by the power of ten, or tell the reader the unit. Check the size of the board's squares, too."
    }
    .to_owned();
    if power != 0.0 {
        finding.defect = Some(Defect::DepthScale { ratio: unit });
    }
    finding
}
