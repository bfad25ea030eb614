#![doc = include_str!("td504_field_of_view.md")]

use super::{Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Unit, Verdict};
use crate::math;

pub(super) const CHECK: Check =
    Check { title: "Field of view", unit: Unit::Degrees, basis: Basis::Metadata, tolerance: None };

/// Horizontal fields of view that front and rear cameras with depth have, with a margin, degrees: from the 51° of
/// iPads to the 122° of an uncorrected ultra-wide camera.
const PLAUSIBLE_DEG: [f64; 2] = [30.0, 130.0];
/// The device format states the field of view of its own crop; nearer than this the two agree, degrees.
const SAME_DEG: f64 = 2.0;

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD504, &case.tolerances);
    let Some(factory) = case.factory else {
        let claim = "The recording has no factory intrinsics.".to_owned();
        return finding.unknown(claim, ToRecord::Metadata);
    };
    let k = factory.intrinsics;
    let angle_deg = (2.0 * math::atan(k.width as f64 / (2.0 * k.fx))).to_degrees();
    finding.value = Some(angle_deg);
    finding.evidence = vec![Evidence::number("factory_focal_px", k.focal_px())];
    let [least, most] = PLAUSIBLE_DEG;
    if !(least..=most).contains(&angle_deg) {
        finding.verdict = Verdict::Fault;
        finding.claim = format!(
            "The factory's focal length of {:.1} px makes a field of view of {angle_deg:.1} degrees, which no such \
             camera has ({least:.0} to {most:.0}).",
            k.focal_px()
        );
        finding.what_to_do =
            "Find out for which size of image the intrinsics were meant (TD503).".to_owned();
        return finding;
    }
    finding.verdict = Verdict::Ok;
    finding.claim = format!(
        "The factory's focal length makes a plausible field of view of {angle_deg:.1} degrees."
    );
    if let Some(stated_deg) = factory.field_of_view_rad.map(f64::to_degrees) {
        finding.evidence.push(Evidence::number("stated_field_of_view_deg", stated_deg));
        if (stated_deg - angle_deg).abs() > SAME_DEG {
            finding.verdict = Verdict::Info;
            finding.claim = format!(
                "The factory's focal length makes a field of view of {angle_deg:.1} degrees, the device's format \
                 states {stated_deg:.1}."
            );
            finding.what_to_do = "Do not compute a focal length from the stated field of view: it is that of another \
                                  crop of the sensor."
                .to_owned();
        }
    }
    finding
}
