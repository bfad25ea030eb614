//! For programs: versioned JSON, and calibrations as other programs read them ([`export`]).
//!
//! Every [`Document`] has a `schema` of its own, a `version` of the program, and fields that carry their units: metres,
//! pixels, radians. What is estimated is `{"value": .., "sigma": ..}`; what is not known is `null`, never NaN. Results
//! serialise themselves in their own rooms; golden files in `golden/` hold every byte. Within a schema's number a new
//! field may appear, an old one neither changes nor goes.
//!
//! Two documents are read back, [`Input`]: the [`Known`] part of a calibration, and what an audit has found.
//!
//! ```
//! use truedepth::wire::{Detect, to_json};
//!
//! let json = to_json(&Detect { images: Vec::new() });
//! assert!(json.starts_with("{\n  \"schema\": \"truedepth.detect/1\","));
//! assert!(json.ends_with("  \"images\": []\n}\n"));
//! ```
//!
//! Not here: files, pages, words.

mod audit;
mod calibration;
mod correct;
mod detect;
mod devices;
mod error;
pub mod export;
mod json;
mod reproduce;

pub use audit::{Audit, Board, DeviceInfo, FactoryInfo, KnownAudit};
pub use calibration::{Calibration, Detail, Distortion, Known, Number, Parameter, Table};
pub use correct::{Correct, PinholeInfo};
pub use detect::{Detect, DetectedImage};
pub use devices::{Compare, IdentityInfo, Inspect, PairCorrections, PairInfo, SheetInfo, SideInfo};
pub use error::Error;
pub use reproduce::{CheckInfo, DataInfo, LensInfo, Reproduce, SectionInfo};

use serde::{Deserialize, Serialize};

/// A whole file.
pub trait Document: Serialize {
    /// Its kind and version, like `truedepth.audit/1`.
    const SCHEMA: &'static str;
}

/// The document as JSON: indented, with a final newline, nine digits to a number.
pub fn to_json<T: Document>(document: &T) -> String {
    #[derive(Serialize)]
    struct File<'a, T> {
        schema: &'static str,
        version: &'static str,
        #[serde(flatten)]
        document: &'a T,
    }
    json::to_json(&File { schema: T::SCHEMA, version: env!("CARGO_PKG_VERSION"), document })
}

/// A document that is read back.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "schema")]
pub enum Input {
    /// What `truedepth calibrate --json` printed.
    #[serde(rename = "truedepth.calibrate/1")]
    Calibration(Box<Known>),
    /// What `truedepth audit --json` printed, or `report.json`.
    #[serde(rename = "truedepth.audit/1")]
    Audit(Box<KnownAudit>),
}

impl Input {
    /// Reads a file that this or a newer program wrote; fields that are not known are passed over.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        serde_json::from_str(text).map_err(|error| Error::Document(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        audit::sample,
        camera::{self, Brown, RadialTable, TablePair},
        correct::{Plan, Reason, Selection, Step},
        detect::Observation,
        diagnose,
        files::Memory,
        geom::Pixel,
        recording::Defect,
    };

    fn golden(name: &str, document: &impl Document) {
        sample::assert_golden(&format!("wire/golden/{name}"), &to_json(document));
    }

    #[test]
    fn detect() {
        let audit = sample::audit();
        let mut observation = audit.frames[0].observation.clone();
        observation.corners.truncate(3);
        let image = |path: &str, size_px, observation, detect_ms| DetectedImage {
            path: path.to_owned(),
            size_px,
            observation,
            decode_ms: None,
            detect_ms,
        };
        let seen = image("rec/rgb_1.png", [640, 480], observation, Some(4.25));
        let nothing = Observation { corners: Vec::new(), identity: None, rejects: Vec::new() };
        let unseen = image("a.png", [32, 16], nothing, None);
        golden("detect.json", &Detect { images: vec![seen, unseen] });
    }

    #[test]
    fn calibrate() {
        let audit = sample::audit();
        let calibration = audit.calibration.as_ref().unwrap();
        let factory = audit.factory.as_ref();
        let new = |detail| Calibration::new(&audit.name, "auto", factory, calibration, detail);
        golden("calibrate.json", &new(Detail::Summary));
        let value: serde_json::Value =
            serde_json::from_str(&to_json(&new(Detail::Frames))).unwrap();
        let view = &value["views"][0];
        let n = view["n_corners"].as_u64().map(|n| n as usize);
        assert_eq!(view["corners"].as_array().map(Vec::len), n);
        assert_eq!(view["residuals_px"].as_array().map(Vec::len), n);
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
        let right = Known::new(audit.factory.as_ref(), &calibration);
        let known = right.known().expect("a calibration");
        assert_eq!(known.camera, calibration.camera);
        assert_eq!(known.parameters, calibration.parameters);
        assert_eq!(known.covariance, calibration.covariance);
        type Spoil = fn(&mut Known);
        let wrong: [(Spoil, &str); 6] = [
            (|c| c.parameters[0].name = "warp".to_owned(), "warp, which no camera model has"),
            (|c| c.parameters[0].number.sigma = None, "without a σ"),
            (|c| c.parameters[0].number.sigma = Some(0.0), "without a σ"),
            (|c| c.parameters[0].number.sigma = Some(7.0), "a covariance that is not"),
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
        let audit = sample::audit();
        let json = to_json(&Audit::new(&audit, Detail::Summary));
        sample::assert_golden("wire/golden/audit.json", &json);
        // What was found comes back, and asks for the same.
        let Ok(Input::Audit(back)) = Input::from_json(&json) else { panic!("{json}") };
        let plan = back.plan(Selection::Faults).unwrap();
        let asked = Plan::of_audit(&audit, Selection::Faults).unwrap();
        assert_eq!(plan.steps().len(), asked.steps().len());
        let code = |plan: &Plan| plan.steps()[0].reason;
        assert_eq!(code(&plan), code(&asked));
        let value: serde_json::Value =
            serde_json::from_str(&to_json(&Audit::new(&audit, Detail::Frames))).unwrap();
        let frame = &value["frames"][0];
        assert_eq!(
            frame["observation"]["corners"].as_array().map(Vec::len),
            frame["n_corners"].as_u64().map(|n| n as usize)
        );
        assert_eq!(frame["own_view"]["rotation_vector_rad"].as_array().map(Vec::len), Some(3));
        assert!(frame["depth_at_corners"][0]["sensor_m"].is_f64());
    }

    #[test]
    fn compare() {
        let pairs = diagnose::pairs(&diagnose::Registry::published());
        let some = [&pairs[2], &pairs[7]].map(Clone::clone);
        golden("compare.json", &Compare::new(&some));
    }

    #[test]
    fn correct() {
        let recording = sample::recording();
        let audit = sample::audit();
        let plan = Plan::of_audit(&audit, Selection::Faults).unwrap();
        assert_eq!(plan.steps().len(), 1, "{plan:?}");
        let mut steps = plan.steps().to_vec();
        steps.push(Step { defect: Defect::DepthZoom { zoom: [0.95; 2] }, reason: Reason::Given });
        let plan = Plan::new(steps, None).unwrap();
        let mut sink = Memory::new("fixed");
        let done = crate::correct::correct(&recording, &plan, &mut sink).unwrap();
        let findings = audit.findings.into_iter().filter(|f| f.defect.is_some()).collect();
        let mut document = Correct::new(&recording, &plan, done, findings);
        // How a PNG is compressed is the encoder's affair.
        document.files.values_mut().for_each(|hash| hash.replace_range(8.., "..."));
        document.input_sha256.replace_range(.., "...");
        document.files.retain(|name, _| !name.ends_with(".png"));
        golden("correct.json", &document);
    }

    /// Without data: what follows from the printed numbers, and what is missing.
    #[test]
    fn reproduce() {
        let paper = crate::reproduce::reproduce("nowhere", Vec::new(), &mut |_| ()).unwrap();
        let mut document = Reproduce::from(&paper);
        // `compare.json` holds them.
        document.pairs.clear();
        golden("reproduce.json", &document);
    }

    #[test]
    fn inspect() {
        let recording = sample::recording();
        let registry = diagnose::Registry::published();
        let inspection = diagnose::inspect(&recording, &registry);
        golden("inspect.json", &Inspect::new(&recording, &inspection));
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
            let json = to_json(&Calibration::new("r", "auto", None, &calibration, Detail::Summary));
            let Input::Calibration(back) = Input::from_json(&json).unwrap() else {
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
            let error = Input::from_json(text).unwrap_err().to_string();
            assert!(error.contains("truedepth calibrate --json"), "{error}");
        }
        let audit = sample::audit();
        let good = Known::new(None, audit.calibration.as_ref().unwrap());
        assert!(good.camera().is_ok());
        let folding =
            || Table { center_px: [1.0, 1.0], max_radius_px: 9.0, magnification: vec![0.0, -3.0] };
        for bad in [
            Known { focal_xy_px: [0.0, 530.0], ..good.clone() },
            Known { focal_xy_px: [530.0, f64::INFINITY], ..good.clone() },
            Known { principal_point_px: [f64::NAN, 1.0], ..good.clone() },
            Known { image_size_px: [0, 480], ..good.clone() },
            Known {
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
        let json = to_json(&Audit::new(&audit, Detail::Summary));
        assert!(json.contains("\"sigma\": null") && json.contains("\"own_rms_px\": null"));
        assert!(Input::from_json(&json).is_ok());
    }
}
