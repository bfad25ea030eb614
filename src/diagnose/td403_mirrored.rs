#![doc = include_str!("td403_mirrored.md")]

use super::{
    Basis, Case, Check, Code, Evidence, Finding, Known, ToRecord, Unit, Verdict, numbers::plain,
};
use crate::{depth::Handedness, recording::Defect};

pub(super) const CHECK: Check =
    Check { title: "Mirroring", unit: Unit::Count, basis: Basis::Board, tolerance: None };

pub(super) fn check(case: &Case<'_>, _: &Known) -> Finding {
    let mut finding = Finding::new(Code::TD403, &case.tolerances);
    let (mirrored, n) = case.n_mirrored_of;
    if n == 0 {
        finding.show("", "—");
        let claim =
            "Cannot tell whether the images are mirrored: the board was not seen in any frame.";
        return finding.unknown(claim.to_owned(), ToRecord::Sharp);
    }
    finding.value = Some(mirrored as f64);
    finding.evidence = vec![
        Evidence::number("n_mirrored", mirrored as f64),
        Evidence::number("n_identified", n as f64),
    ];
    // The markers decode one way only; a single frame against all others is more likely a slip than a mirror.
    if 2 * mirrored > n {
        finding.verdict = Verdict::Fault;
        finding.claim = format!(
            "The images are mirrored: in {mirrored} of {n} frames the markers read only as in a mirror."
        );
        finding.what_to_do = "Mirror colour and depth back, and the principal point with them. Make sure first that \
                              the board is not printed mirrored or seen through its back."
            .to_owned();
        finding.defect = Some(Defect::Mirrored);
    } else if mirrored > 0 {
        finding.verdict = Verdict::Warning;
        finding.claim = format!(
            "{mirrored} of {n} frames look mirrored and the others do not: frames of two kinds, or a wrong reading."
        );
        finding.what_to_do = "Look at these frames.".to_owned();
    } else {
        finding.verdict = Verdict::Ok;
        finding.claim =
            format!("The images are not mirrored: the markers read straight in all {n} frames.");
    }
    if let Some(depth) = case.handedness {
        add_depth(&mut finding, depth);
    }
    let n = finding.value.unwrap_or(0.0);
    finding.show("", if n > 0.0 { format!("in {} frames", plain(n, 0)) } else { "no".to_owned() });
    finding
}

/// Frames that must agree before depth alone counts as mirrored.
const LEAST_FRAMES: usize = 3;

/// Depth against colour, beside what the markers say of both.
fn add_depth(finding: &mut Finding, depth: Handedness) {
    let Handedness { n_straight, n_mirrored, n_open } = depth;
    finding.evidence.extend([
        Evidence::number("n_depth_straight", n_straight as f64),
        Evidence::number("n_depth_mirrored", n_mirrored as f64),
        Evidence::number("n_depth_open", n_open as f64),
    ]);
    let clear = n_straight + n_mirrored;
    if n_mirrored >= LEAST_FRAMES && 10 * n_mirrored >= 9 * clear {
        let colour = std::mem::replace(&mut finding.verdict, Verdict::Fault);
        finding.value = Some(n_mirrored as f64);
        finding.claim = format!(
            "The depth maps are mirrored against the colour images: in {n_mirrored} of {clear} frames with a tilted \
             board depth fits the board only when it is mirrored. {}",
            finding.claim
        );
        // Colour mirrored and depth straight: it is colour that has to be turned, and that is what the finding says.
        if colour != Verdict::Fault {
            finding.what_to_do = "Mirror the depth maps back, left for right.".to_owned();
            finding.defect = Some(Defect::DepthMirrored);
        }
    } else if n_straight >= LEAST_FRAMES {
        finding.claim += &format!(
            " Depth lies as colour does in {n_straight} of {clear} frames with a tilted board."
        );
    }
}
