//! What the metadata alone tell: no board, no image.

use super::{
    Basis, Case, Code, Device, Evidence, Finding, Identity, Known, KnownIssue, Registry, Sheet,
    Tolerances, Verdict, td101_files, td102_dropped_frames, td103_metadata_incomplete,
    td205_factory_changed, td501_distortion_centre, td502_reference_dimensions,
    td503_intrinsics_size, td504_field_of_view,
};
use crate::{
    board::CharucoBoard,
    recording::{Recording, StreamState},
};

/// What the metadata alone tell of a recording.
#[derive(Clone, Debug)]
pub struct Inspection<'a> {
    /// The kind of sensor and the camera.
    pub device: Device,
    /// The factory's parameters at the reference dimensions; `None` where the metadata lack them.
    pub sheet: Option<Sheet>,
    /// Which known device it is; `None` without a sheet.
    pub identity: Option<Identity<'a>>,
    /// By code: TD101 to TD103, TD205, TD5xx as an audit would find them, and TD201, TD203, TD401 as *warning* where
    /// the registry or the metadata give reason to expect a fault that only an audit can measure.
    pub findings: Vec<Finding>,
}

/// Looks at the metadata of a recording; images are not read.
pub fn inspect<'a>(recording: &Recording, registry: &'a Registry) -> Inspection<'a> {
    let factory = recording.factory();
    let sheet = factory.and_then(Sheet::from_factory);
    let identity = sheet.as_ref().map(|sheet| registry.identify(sheet));
    // The checks of metadata never look at the board; a case has one all the same.
    let board = recording.board.clone().unwrap_or_else(|| {
        CharucoBoard::paper(0.020_875).expect("the paper's board has a square of 20.875 mm")
    });
    let t_ns: Vec<i64> = recording.frames.iter().map(|f| f.t_ns).collect();
    let case = Case {
        problems: &recording.problems,
        n_frames: recording.frames.len(),
        factory,
        t_ns: &t_ns,
        ..Case::unseen(&board, Tolerances::default())
    };
    let known = Known { state: StreamState::Unknown, focal: None };
    let mut findings = vec![
        td101_files::check(&case, &known),
        td102_dropped_frames::check(&case, &known),
        td103_metadata_incomplete::check(&case, &known),
        td205_factory_changed::check(&case, &known),
        td502_reference_dimensions::check(&case, &known),
    ];
    findings.extend(identity.iter().flat_map(expected));
    let known_rectified = findings.iter().all(|f| f.code != Code::TD203);
    if let Some(false) = factory.and_then(|f| f.geometric_distortion_correction)
        && known_rectified
    {
        findings.push(correction_was_off());
    }
    findings.extend([
        td501_distortion_centre::check(&case, &known),
        td503_intrinsics_size::check(&case, &known),
        td504_field_of_view::check(&case, &known),
    ]);
    findings.sort_by_key(|finding| finding.code);
    Inspection { device: Device::from_factory(factory), sheet, identity, findings }
}

/// A fault to expect of this device, not measured.
fn expected(identity: &Identity<'_>) -> Vec<Finding> {
    identity
        .issues
        .iter()
        .map(|issue| {
            let mut finding = expected_by_metadata(match issue {
                KnownIssue::DepthZoom => Code::TD401,
                KnownIssue::FocalLength => Code::TD201,
                KnownIssue::NotRectified => Code::TD203,
            });
            let rows: Vec<String> = identity.matches.iter().map(|e| e.name()).collect();
            finding.claim = format!(
                "Known of this camera ({}): {}. Not measured here.",
                rows.join(", "),
                issue.words()
            );
            finding.what_to_do =
                "Record a ChArUco board with it and run `truedepth audit`, which measures it; \
                                  `truedepth correct` then removes it."
                    .to_owned();
            if let Some(difference) = identity.focal_difference {
                finding.evidence =
                    vec![Evidence::number("focal_against_nearest_percent", 100.0 * difference)];
            }
            finding
        })
        .collect()
}

/// A warning that rests on metadata alone.
fn expected_by_metadata(code: Code) -> Finding {
    let finding = Finding::new(code, &Tolerances::default());
    Finding { verdict: Verdict::Warning, basis: Basis::Metadata, ..finding }
}

fn correction_was_off() -> Finding {
    let mut finding = expected_by_metadata(Code::TD203);
    finding.claim = "The file says that Apple's distortion correction was off \
                       (GeometricDistortionCorrectionEnabled is false): expect images that are not rectified. Not \
                       measured here."
        .to_owned();
    finding.what_to_do =
        "Record a ChArUco board with it and run `truedepth audit`, which measures it.".to_owned();
    finding
}
