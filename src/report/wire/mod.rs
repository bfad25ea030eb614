//! The machine-readable output, version 1: what other programs may rely on.
//!
//! Names are stable and carry their units; a new field may appear, an old one neither changes nor goes within a
//! version. What is not known is `null`, never NaN. Nothing else in the library is serialised outward: these types
//! are copies, so that a renamed field inside does not change a file outside (golden files in `golden/` hold them).
//!
//! ```
//! use truedepth::report::{to_json, wire};
//!
//! let document = wire::Document::Detect(wire::Detect { images: Vec::new() });
//! let json = to_json(&document);
//! assert_eq!(json, "{\n  \"schema\": \"truedepth.detect/1\",\n  \"images\": []\n}\n");
//! assert!(matches!(wire::Document::from_json(&json)?, wire::Document::Detect(_)));
//! # Ok::<(), truedepth::report::Error>(())
//! ```

mod audit;
mod calibration;
mod correct;
mod detect;
mod devices;
mod pictures;
mod reproduce;

pub use audit::{
    Alignment, Audit, Board, Depth, DepthNoise, DeviceInfo, EvidenceInfo, FactoryInfo, FindingInfo,
    Frame, FrameDepthInfo, PrintWitness, ResidualMap, TemporalNoiseInfo, Witness,
};
pub use calibration::{
    BoardSurface, Calibration, Candidate, Distortion, DistortionTest, Hypothesis, LeftOut, Outlier,
    Parameter, ProjectionUncertainty, Rejected, RollingShutter, Surface, Table, View,
};
pub use correct::{Correct, PinholeInfo};
pub use detect::{Detect, DetectedCorner, DetectedIdentity, DetectedImage, RejectedCorner};
pub use devices::{Compare, IdentityInfo, Inspect, PairCorrections, PairInfo, SheetInfo, SideInfo};
pub use pictures::{Overlay, OverlayFrame, TreatmentsInfo, Undistort, UndistortFrame};
pub use reproduce::{CheckInfo, DataInfo, LensInfo, MissingInfo, Reproduce, SectionInfo};

use serde::{Deserialize, Serialize};

use super::Error;
use crate::calibrate::Model;

/// A whole file; its `schema` says which.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "schema")]
pub enum Document {
    /// What `truedepth detect --json` prints.
    #[serde(rename = "truedepth.detect/1")]
    Detect(Detect),
    /// What `truedepth calibrate --json` prints, and `truedepth audit --calibration FILE` reads.
    #[serde(rename = "truedepth.calibrate/1")]
    Calibrate(Box<Calibration>),
    /// What `truedepth audit --json` prints and `report.json` holds.
    #[serde(rename = "truedepth.audit/1")]
    Audit(Box<Audit>),
    /// What `truedepth inspect --json` prints.
    #[serde(rename = "truedepth.inspect/1")]
    Inspect(Box<Inspect>),
    /// What `truedepth compare --json` prints.
    #[serde(rename = "truedepth.compare/1")]
    Compare(Compare),
    /// What `truedepth correct --json` prints and `provenance.json` holds.
    #[serde(rename = "truedepth.correct/1", skip_deserializing)]
    Correct(Box<Correct>),
    /// What `truedepth overlay --json` prints.
    #[serde(rename = "truedepth.overlay/1", skip_deserializing)]
    Overlay(Box<Overlay>),
    /// What `truedepth undistort --json` prints.
    #[serde(rename = "truedepth.undistort/1")]
    Undistort(Box<Undistort>),
    /// What `truedepth reproduce --json` prints and its `report.json` holds.
    #[serde(rename = "truedepth.reproduce/1")]
    Reproduce(Box<Reproduce>),
}

impl Document {
    /// Reads a file that this or a newer program of wire version 1 wrote; fields that are not known are passed over.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|error| Error::Document(error.to_string()))
    }
}

/// The stable name of a model.
pub(super) const fn model_name(model: Model) -> &'static str {
    match model {
        Model::Focal => "focal",
        Model::FocalTable => "focal+table",
        Model::FocalCentre => "focal+centre",
        Model::FocalTableCentre => "focal+table+centre",
        Model::Brown => "brown",
        Model::BrownAspect => "brown+aspect",
    }
}

/// What is not finite is not known.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{self, Brown, RadialTable, TablePair},
        correct::{BoardLine, Plan, Reason, Rectifier, Selection, Step},
        detect::Observation,
        diagnose,
        files::Memory,
        geom::Pixel,
        recording::Defect,
        report::{
            After, Animation, DepthPictures, DepthStyle, Flip, LensPictures, Range, Shown, sample,
            to_json,
        },
    };

    fn golden(name: &str, document: &Document) {
        let json = to_json(document);
        sample::assert_golden(name, &json);
        if matches!(document, Document::Correct(_) | Document::Overlay(_)) {
            return;
        }
        // What was written reads back; numbers only lose what lies beyond nine digits.
        let back = Document::from_json(&json).unwrap();
        assert_eq!(to_json(&back), json);
    }

    #[test]
    fn detect() {
        let audit = sample::audit();
        let mut seen = DetectedImage::new(
            "rec/rgb_1.png".to_owned(),
            [640, 480],
            &audit.frames[0].observation,
        );
        seen.corners.truncate(3);
        seen.detect_ms = Some(4.25);
        let nothing = Observation { corners: Vec::new(), identity: None, rejects: Vec::new() };
        let unseen = DetectedImage::new("a.png".to_owned(), [32, 16], &nothing);
        golden("detect.json", &Document::Detect(Detect { images: vec![seen, unseen] }));
    }

    #[test]
    fn calibrate() {
        let audit = sample::audit();
        let calibration = audit.calibration.as_ref().unwrap();
        let wire = Calibration::new(&audit.name, "auto", audit.factory.as_ref(), calibration);
        golden("calibrate.json", &Document::Calibrate(Box::new(wire)));
    }

    #[test]
    fn a_known_camera_brings_its_covariance() {
        let audit = sample::audit();
        let mut calibration = audit.measured.calibration.clone().unwrap();
        let sigmas: Vec<f64> = calibration.parameters.iter().map(|p| p.estimate.sigma).collect();
        let n = sigmas.len();
        calibration.covariance = (0..n * n)
            .map(|at| sigmas[at / n] * sigmas[at % n] * if at % (n + 1) == 0 { 1.0 } else { 0.3 })
            .collect();
        let right = Calibration::new(&audit.name, "auto", audit.factory.as_ref(), &calibration);
        let known = right.known().expect("a calibration");
        assert_eq!(known.camera, calibration.camera);
        assert_eq!(known.parameters, calibration.parameters);
        assert_eq!(known.covariance, calibration.covariance);
        type Spoil = fn(&mut Calibration);
        let wrong: [(Spoil, &str); 6] = [
            (|c| c.parameters[0].name = "warp".to_owned(), "warp, which no camera model has"),
            (|c| c.parameters[0].sigma = None, "without a σ"),
            (|c| c.parameters[0].sigma = Some(0.0), "without a σ"),
            (|c| c.parameters[0].sigma = Some(7.0), "a covariance that is not"),
            (|c| c.covariance[0].push(Some(0.0)), "a covariance that is not"),
            (|c| c.covariance[0][0] = None, "a covariance that is not"),
        ];
        for (spoil, words) in wrong {
            let mut spoilt = right.clone();
            spoil(&mut spoilt);
            let error = spoilt.known().expect_err(words).to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn audit() {
        golden("audit.json", &Document::Audit(Box::new(Audit::from(&sample::audit()))));
    }

    #[test]
    fn compare() {
        let pairs = diagnose::pairs(&diagnose::Registry::published());
        let some = [&pairs[2], &pairs[7]].map(Clone::clone);
        golden("compare.json", &Document::Compare(Compare::new(&some)));
    }

    #[test]
    fn correct() {
        let recording = sample::recording();
        let audit = Audit::from(&sample::audit());
        let mut plan = audit.plan(Selection::Faults).unwrap();
        assert_eq!(plan, Plan::of_audit(&sample::audit(), Selection::Faults).unwrap());
        assert_eq!(plan.steps().len(), 1, "{plan:?}");
        let mut steps = plan.steps().to_vec();
        steps.push(Step { defect: Defect::DepthZoom { zoom: [0.95; 2] }, reason: Reason::Given });
        plan = Plan::new(steps, None).unwrap();
        let mut sink = Memory::new("fixed");
        let done = crate::correct::correct(&recording, &plan, &mut sink).unwrap();
        let faults = audit.faults().cloned().collect();
        let mut document = Correct::new(&recording, &plan, done, faults);
        // How a PNG is compressed is the encoder's affair.
        document.files.values_mut().for_each(|hash| hash.replace_range(8.., "..."));
        document.input_sha256.replace_range(.., "...");
        document.files.retain(|name, _| !name.ends_with(".png"));
        golden("correct.json", &Document::Correct(Box::new(document)));
    }

    #[test]
    fn overlay() {
        let recording = sample::recording();
        let plan = Plan::given(&[Defect::DepthZoom { zoom: [0.95; 2] }]).unwrap();
        let pictures = DepthPictures {
            recording: &recording,
            after: After::Corrected(&plan),
            frames: None,
            range: Range::Given([0.2, 0.3]),
            style: DepthStyle { range_m: [0.2, 0.3], opacity: 0.5, shown: Shown::Depth },
            flip: Flip::No,
            animation: Animation::Yes,
        };
        let mut sink = Memory::new("pictures");
        let drawn = pictures.draw(&mut sink, &mut |_, _| ()).unwrap();
        assert_eq!(sink.files().len(), 2, "a picture and an animation; no sheet of one");
        golden("overlay.json", &Document::Overlay(Box::new(Overlay::new(&pictures, &drawn))));
    }

    /// Without data: what follows from the printed numbers, and what is missing.
    #[test]
    fn reproduce() {
        let paper = crate::reproduce::reproduce("nowhere", Vec::new(), &mut |_| ()).unwrap();
        let mut document = Reproduce::from(&paper);
        // `compare.json` holds them.
        document.pairs.clear();
        golden("reproduce.json", &Document::Reproduce(Box::new(document)));
    }

    #[test]
    fn undistort() {
        let recording = sample::recording();
        let table = |sign: f64| {
            let magnification = (0..42).map(|i| sign * 1e-5 * f64::from(i * i)).collect();
            RadialTable::new(Pixel::new(320.5, 241.1), 400.25, magnification).unwrap()
        };
        let rectifier =
            Rectifier::Tables(Box::new(TablePair { forward: table(1.0), inverse: table(-1.0) }));
        let pictures = LensPictures {
            recording: &recording,
            rectifier: &rectifier,
            board: recording.board.as_ref(),
            frames: Some(vec![0]),
        };
        let mut sink = Memory::new("pictures");
        let mut drawn = pictures.draw(&mut sink, &mut |_, _| ()).unwrap();
        assert_eq!(drawn.straightness.n_frames(), 0, "there is no board in the sample's image");
        // What it looks like with numbers.
        let line = |bow: f64| {
            vec![BoardLine {
                points: (0..5).map(|i| Pixel::new(f64::from(i), bow * f64::from(i % 2))).collect(),
                on_line: (0..5).map(|i| Pixel::new(f64::from(i), 0.4 * bow)).collect(),
            }]
        };
        drawn.straightness.add([&line(0.5), &line(0.25), &line(1.0)]);
        drawn.frames[0].rms_px = drawn.straightness.rms_px();
        let document = Undistort::new(&recording, &rectifier, &drawn);
        golden("undistort.json", &Document::Undistort(Box::new(document)));
    }

    #[test]
    fn inspect() {
        let recording = sample::recording();
        let registry = diagnose::Registry::published();
        let inspection = diagnose::inspect(&recording, &registry);
        golden("inspect.json", &Document::Inspect(Box::new(Inspect::new(&recording, &inspection))));
    }

    #[test]
    fn a_camera_comes_back() {
        let audit = sample::audit();
        let mut calibration = audit.measured.calibration.clone().unwrap();
        let table = |sign: f64| {
            let magnification = (0..42).map(|i| sign * 1e-5 * f64::from(i * i)).collect();
            RadialTable::new(Pixel::new(320.5, 241.1), 400.25, magnification).unwrap()
        };
        for distortion in [
            camera::Distortion::None,
            camera::Distortion::Brown(Brown { k1: 0.07, k2: -0.1, p1: 1e-4, p2: -2e-4, k3: 0.01 }),
            camera::Distortion::Table(TablePair { forward: table(-1.0), inverse: table(1.0) }),
        ] {
            calibration.camera.distortion = distortion;
            let json = to_json(&Document::Calibrate(Box::new(Calibration::new(
                "r",
                "auto",
                None,
                &calibration,
            ))));
            let Document::Calibrate(back) = Document::from_json(&json).unwrap() else {
                panic!("{json}")
            };
            let camera = back.camera().unwrap();
            let pixel = Pixel::new(612.0, 31.0);
            let [expected, found] =
                [&calibration.camera, &camera].map(|c| c.unproject(pixel).unwrap());
            assert!((expected[0] - found[0]).abs() + (expected[1] - found[1]).abs() < 1e-8);
        }
    }

    #[test]
    fn documents_that_are_none() {
        for text in [
            "",
            "{}",
            "[]",
            "{\"schema\": \"truedepth.audit/2\"}",
            "{\"schema\": \"truedepth.detect/1\"}",
        ] {
            let error = Document::from_json(text).unwrap_err().to_string();
            assert!(error.contains("truedepth calibrate --json"), "{error}");
        }
        let audit = sample::audit();
        let good = Calibration::new("r", "auto", None, audit.calibration.as_ref().unwrap());
        assert!(good.camera().is_ok());
        let folding =
            || Table { center_px: [1.0, 1.0], max_radius_px: 9.0, magnification: vec![0.0, -3.0] };
        for bad in [
            Calibration { focal_xy_px: [0.0, 530.0], ..good.clone() },
            Calibration { focal_xy_px: [530.0, f64::INFINITY], ..good.clone() },
            Calibration { principal_point_px: [f64::NAN, 1.0], ..good.clone() },
            Calibration { image_size_px: [0, 480], ..good.clone() },
            Calibration {
                distortion: Distortion::Table { forward: folding(), inverse: folding() },
                ..good.clone()
            },
        ] {
            assert!(bad.camera().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_null() {
        let mut audit = sample::audit();
        audit.findings[1].sigma = Some(f64::NAN);
        audit.measured.frames[0].own_view.as_mut().unwrap().rms_px = f64::INFINITY;
        let json = to_json(&Document::Audit(Box::new(Audit::from(&audit))));
        assert!(json.contains("\"sigma\": null") && json.contains("\"own_rms_px\": null"));
        assert!(Document::from_json(&json).is_ok());
    }
}
