#![doc = include_str!("td202_principal_point.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Tolerance, Unit, Verdict,
    numbers::plain, td503_intrinsics_size,
};
use crate::{
    calibrate::{Estimate, Lens},
    camera::Intrinsics,
    math,
    recording::{Defect, StreamState},
};

pub(super) const CHECK: Check = Check {
    title: "Principal point",
    unit: Unit::Px,
    basis: Basis::Views,
    tolerance: Tolerance::named("principal-point", 2.0),
};

/// The principal point, free, under what is in the stream.
fn measured(case: &Case<'_>, state: StreamState) -> Option<[Estimate; 2]> {
    let lens = match (state, case.factory?.tables.is_some()) {
        (StreamState::Distorted, true) => Lens::InverseTable,
        (StreamState::Distorted, false) => Lens::FreeRadial,
        (StreamState::Rectified, _) => Lens::None,
        (StreamState::RectifiedTwice, _) => Lens::ForwardTable,
        (StreamState::Unknown, _) => return None,
    };
    case.distortion?.hypotheses.iter().find(|h| h.lens == lens).map(|h| h.center_px)
}

/// The factory's principal point where it lies in these images, and whether that is where a mirror puts it: where the
/// markers read mirrored, either the images are (and the point with them) or the print is; the measured point tells.
fn expected(case: &Case<'_>, own: [Estimate; 2]) -> Option<([f64; 2], bool)> {
    let Intrinsics { cx, cy, width, .. } = case.factory?.intrinsics;
    let mirrored_x = width as f64 - 1.0 - cx;
    let (mirrored, n) = case.n_mirrored_of;
    let off = |x: f64| (own[0].value - x).abs();
    if 2 * mirrored > n && off(mirrored_x) < off(cx) {
        Some(([mirrored_x, cy], true))
    } else {
        Some(([cx, cy], false))
    }
}

pub(super) fn check(case: &Case<'_>, known: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD202, &case.tolerances);
    let tolerance_px = case.tolerances.of(finding.code);
    let cell = |place: Option<[f64; 2]>| match place {
        Some([x, y]) => format!("{}, {} px", plain(x, 2), plain(y, 2)),
        None => "—".to_owned(),
    };
    let factory_cell = cell(case.factory.map(|f| [f.intrinsics.cx, f.intrinsics.cy]));
    let measured = measured(case, known.state).filter(|_| case.poor_fit().is_none());
    let expected = measured.and_then(|own| expected(case, own));
    let (Some(own), Some((factory, is_mirrored))) = (measured, expected) else {
        let why = match case.poor_fit() {
            Some(why) => why,
            None if case.factory.is_none() => "the recording has no factory intrinsics".to_owned(),
            None if case.camera.is_some() => "the distortion of the stream is not known".to_owned(),
            None => case.why_no_camera(),
        };
        finding.show(factory_cell, cell(None));
        let claim = format!("Cannot tell whether the factory's principal point is right: {why}.");
        return finding.unknown(claim, ToRecord::Turned);
    };
    let off = [0, 1].map(|i| Estimate { value: own[i].value - factory[i], sigma: own[i].sigma });
    // The worse of both axes: a fault in one is a fault, and ok must mean both.
    finding.verdict = Verdict::of(off[0], tolerance_px).min(Verdict::of(off[1], tolerance_px));
    let length_px = math::hypot(off[0].value, off[1].value);
    finding.value = Some(length_px);
    // Along its own direction, both axes taken as independent.
    let share = |i: usize| if length_px > 0.0 { off[i].value / length_px } else { 0.5f64.sqrt() };
    finding.sigma = Some(math::hypot(share(0) * off[0].sigma, share(1) * off[1].sigma));
    finding.show(factory_cell, cell(Some([own[0].value, own[1].value])));
    finding.evidence = vec![
        Evidence::estimate("center_x_px", own[0]),
        Evidence::estimate("center_y_px", own[1]),
        Evidence::number("factory_center_x_px", factory[0]),
        Evidence::number("factory_center_y_px", factory[1]),
    ];
    let words = match finding.verdict {
        Verdict::Fault => "The factory's principal point is wrong",
        Verdict::Info => {
            "The factory's principal point is right within the tolerance, if not exactly"
        }
        Verdict::Ok => "The factory's principal point is right",
        Verdict::Unknown | Verdict::Warning => {
            "Cannot tell whether the factory's principal point is right"
        }
    };
    finding.claim = format!(
        "{words}: ({:.2} ± {:.2}, {:.2} ± {:.2}) px instead of ({:.2}, {:.2}) px.",
        own[0].value, own[0].sigma, own[1].value, own[1].sigma, factory[0], factory[1],
    );
    finding.test = format!("Either axis judged by itself; {}.", finding.tolerance_words());
    if is_mirrored {
        finding.claim += " The images are mirrored, and so the factory's is taken mirrored, too.";
    }
    match finding.verdict {
        Verdict::Fault => {
            finding.what_to_do =
                "Use the measured principal point together with the measured focal length."
                    .to_owned();
        }
        Verdict::Unknown | Verdict::Warning => finding.record(ToRecord::Turned),
        Verdict::Info | Verdict::Ok => {}
    }
    if let Some(k) = td503_intrinsics_size::scaled(case) {
        let shift_px = [k.cx - own[0].value, k.cy - own[1].value];
        finding.name_if_significant(Defect::Center { shift_px });
    }
    finding
}
