//! Two sets of factory parameters of one device against each other: AVFoundation's and ARKit's, or one API's twice.
//!
//! The paper's tables, their derived columns, and both of its corrections:
//!
//! ```text
//! zoom            = IRD_av / IRD_ar                              issue 1
//! f_av corrected  = f_av² / f_ar                                 issue 2, AVFoundation
//! f_ar corrected  = f_ar · (1 + 2·(1 − f_ar / f_av))             issue 2, ARKit
//! ```
//!
//! all at the reference dimensions (IRD); times W / IRD_w for an image W pixels wide.

use super::{
    Api, Finding, KnownIssue, Registry, Sheet, td205_factory_changed, td502_reference_dimensions,
};
use crate::math;
use crate::recording::Defect;

/// One side of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// Where the numbers come from, for people.
    pub name: String,
    /// The way they were read, where it is known.
    pub api: Option<Api>,
    /// The numbers.
    pub sheet: Sheet,
}

/// What both sides of different APIs say together: the paper's derived columns and corrections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcrossApis {
    /// "Intrinsics difference to ARKit": f_ar / f_av − 1.
    pub focal_difference: f64,
    /// "Reference dimension difference to ARKit": IRD_ar / IRD_av − 1, width and height.
    pub reference_difference: [f64; 2],
    /// Which issue the pair shows; `None` for neither.
    pub issue: Option<KnownIssue>,
    /// Issue 1: what ARKit's depth map has to be zoomed by about the principal point, horizontally and vertically.
    pub depth_zoom: [f64; 2],
    /// Issue 2: AVFoundation's focal length corrected, at the reference dimensions, pixels.
    pub av_corrected_px: f64,
    /// Issue 2: ARKit's focal length corrected, at the reference dimensions, pixels.
    pub ar_corrected_px: f64,
}

impl AcrossApis {
    /// What is wrong with a recording by this API, after the paper.
    pub fn defect(&self, api: Api) -> Option<Defect> {
        // The metadata's focal length over the corrected one.
        let focal = |ratio: f64| Some(Defect::Focal { ratio });
        match (self.issue?, api) {
            (KnownIssue::DepthZoom, Api::ArKit) => {
                Some(Defect::DepthZoom { zoom: self.depth_zoom })
            }
            (KnownIssue::FocalLength, Api::AvFoundation) => focal(1.0 + self.focal_difference),
            (KnownIssue::FocalLength, Api::ArKit) => {
                focal(1.0 / (1.0 - 2.0 * self.focal_difference))
            }
            _ => None,
        }
    }
}

/// What two sides of one API say together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SameApi {
    /// Whether both are the same unit: same reference dimensions, principal point and distortion centre.
    pub same_unit: bool,
    /// f_second / f_first − 1.
    pub focal_difference: f64,
    /// Second minus first, pixels at the reference dimensions.
    pub center_shift_px: [f64; 2],
}

/// Two sheets side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// AVFoundation's, or the first.
    pub first: Side,
    /// ARKit's, or the second.
    pub second: Side,
    /// Columns the paper has; `None` where both sides are of one API.
    pub across: Option<AcrossApis>,
    /// `None` where the sides are of different APIs.
    pub same: Option<SameApi>,
    /// TD205 or TD401, TD201 and TD502, as far as two sheets tell.
    pub findings: Vec<Finding>,
}

/// Beyond this the focal lengths of both APIs differ. The paper's pairs differ by 0.0003 % (rounding) or by 7.5 %.
const SAME_FOCAL: f64 = 0.005;
/// Beyond this the reference dimensions differ: 0 %, 5.2 % and 42.9 % in the paper.
const SAME_REFERENCE: f64 = 0.001;
/// Nothing but a changed calibration moves a place at the reference dimensions by more.
const UNCHANGED_PX: f64 = 0.02;

/// Compares what AVFoundation and ARKit say of one device, or, where both are known to be of one API, what one API
/// says at two times. Sides given the wrong way round are swapped. Sides of unknown API are taken in the order given,
/// unless they have one unit's principal point at the same reference dimensions.
pub fn compare(first: Side, second: Side) -> Comparison {
    let swapped = first.api == Some(Api::ArKit) && second.api != Some(Api::ArKit)
        || second.api == Some(Api::AvFoundation) && first.api.is_none();
    let (first, second) = if swapped { (second, first) } else { (first, second) };
    let (a, b) = (first.sheet, second.sheet);
    let focal_difference = b.focal_px / a.focal_px - 1.0;
    let same = SameApi {
        same_unit: is_same_unit(&a, &b),
        focal_difference,
        center_shift_px: [b.center[0] - a.center[0], b.center[1] - a.center[1]],
    };
    let of_one_api = match (first.api, second.api) {
        (Some(one), Some(other)) => one == other,
        _ => same.same_unit,
    };
    if of_one_api {
        let findings = vec![td205_factory_changed::between(&first, &second, &same)];
        return Comparison { first, second, across: None, same: Some(same), findings };
    }
    let reference_difference =
        [b.reference[0] / a.reference[0] - 1.0, b.reference[1] / a.reference[1] - 1.0];
    let issue = if focal_difference.abs() > SAME_FOCAL {
        Some(KnownIssue::FocalLength)
    } else if reference_difference.iter().any(|d| d.abs() > SAME_REFERENCE) {
        Some(KnownIssue::DepthZoom)
    } else {
        None
    };
    let across = AcrossApis {
        focal_difference,
        reference_difference,
        issue,
        depth_zoom: [a.reference[0] / b.reference[0], a.reference[1] / b.reference[1]],
        av_corrected_px: a.focal_px * a.focal_px / b.focal_px,
        ar_corrected_px: b.focal_px * (1.0 + 2.0 * (1.0 - b.focal_px / a.focal_px)),
    };
    let findings = vec![td502_reference_dimensions::between(&a, &b, &across)];
    Comparison { first, second, across: Some(across), same: None, findings }
}

/// Two recordings of one unit share the principal point at the reference dimensions; no two units of the paper do.
fn is_same_unit(a: &Sheet, b: &Sheet) -> bool {
    let near = |[x, y]: [f64; 2], [u, v]: [f64; 2]| math::hypot(x - u, y - v) < UNCHANGED_PX;
    let centers = match (a.distortion_center, b.distortion_center) {
        (Some(a), Some(b)) => near(a, b),
        _ => true,
    };
    a.reference == b.reference && near(a.center, b.center) && centers
}

/// All pairs of rows that are AVFoundation's and ARKit's view of one device and version.
pub fn pairs(registry: &Registry) -> Vec<Comparison> {
    let side = |entry: &super::Entry| Side {
        name: entry.name(),
        api: Some(entry.api),
        sheet: entry.sheet,
    };
    registry
        .entries()
        .iter()
        .filter(|entry| entry.api == Api::AvFoundation)
        .filter_map(|av| {
            let ar = registry.entries().iter().find(|other| {
                other.api == Api::ArKit && other.device == av.device && other.version == av.version
            })?;
            Some(compare(side(av), side(ar)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::{Code, Verdict};

    fn of(first: &str, second: &str) -> Comparison {
        let registry = Registry::published();
        let side = |name: &str| {
            let entry = registry.get(name).unwrap_or_else(|| panic!("{name}"));
            Side { name: entry.name(), api: Some(entry.api), sheet: entry.sheet }
        };
        compare(side(first), side(second))
    }

    /// The paper's worked equations to its printed digits.
    #[test]
    fn worked_equations() {
        let pair = of("ipad-12.9-5gen/ios14/av", "ipad-12.9-5gen/ios14/ar").across.unwrap();
        let at_vga = |px: f64, reference: f64| format!("{:.2}", px * 640.0 / reference);
        assert_eq!(at_vga(pair.av_corrected_px, 2016.0), "525.97");
        assert_eq!(at_vga(pair.ar_corrected_px, 2880.0), "361.58");
        let sheet = |row: &str| Registry::published().get(row).unwrap().sheet.focal_px;
        for (api, row, corrected_px) in [
            (Api::AvFoundation, "ipad-12.9-5gen/ios14/av", pair.av_corrected_px),
            (Api::ArKit, "ipad-12.9-5gen/ios14/ar", pair.ar_corrected_px),
        ] {
            let Some(Defect::Focal { ratio }) = pair.defect(api) else { panic!() };
            assert!((sheet(row) / ratio - corrected_px).abs() < 1e-9);
        }
        let zoom = of("ipad-12.9-4gen/v2/av", "ipad-12.9-4gen/v2/ar").across.unwrap().depth_zoom;
        assert_eq!(zoom.map(|z| format!("{z:.4}")), ["0.9507", "0.9507"]);
    }

    /// "Intrinsics difference" and "reference dimension difference" of all ten pairs, in percent with the paper's one
    /// decimal; its 42.0 is 42.9.
    #[test]
    fn derived_columns_of_all_pairs() {
        let pairs = pairs(&Registry::published());
        assert_eq!(pairs.len(), 10);
        for pair in &pairs {
            let across = pair.across.unwrap();
            let (focal, reference, issue) = match pair.first.name.split('/').next().unwrap() {
                "ipad-11-3gen" | "ipad-12.9-5gen" => ("7.5", "42.9", Some(KnownIssue::FocalLength)),
                "ipad-11-2gen" | "ipad-12.9-4gen" => ("0.0", "5.2", Some(KnownIssue::DepthZoom)),
                _ => ("0.0", "0.0", None),
            };
            let percent = |d: f64| format!("{:.1}", 100.0 * d.abs());
            assert_eq!(percent(across.focal_difference), focal, "{}", pair.first.name);
            for d in across.reference_difference {
                assert_eq!(percent(d), reference, "{}", pair.first.name);
            }
            assert_eq!(across.issue, issue, "{}", pair.first.name);
            let verdict = if issue.is_some() { Verdict::Warning } else { Verdict::Ok };
            assert_eq!(pair.findings[0].verdict, verdict);
        }
    }

    #[test]
    fn order_does_not_matter_and_a_changed_calibration_is_seen() {
        let (av, ar) = ("ipad-11-2gen/v1/av", "ipad-11-2gen/v1/ar");
        assert_eq!(of(av, ar), of(ar, av));
        let changed = of("ipad-12.9-5gen/ios14/av", "ipad-12.9-5gen/ios15/av");
        assert_eq!(changed.findings[0].code, Code::TD205);
        assert_eq!(changed.findings[0].verdict, Verdict::Warning);
        assert!((changed.same.unwrap().focal_difference + 0.000_926).abs() < 1e-6);
        let same = of("ipad-12.9-5gen/ios14/ar", "ipad-12.9-5gen/ios14/ar");
        assert_eq!(same.findings[0].verdict, Verdict::Ok);
        let others = of("ipad-11-3gen/v1/av", "ipad-11-3gen/v2/av");
        assert_eq!(others.findings[0].verdict, Verdict::Unknown);
    }
}
