//! What was drawn, as `truedepth overlay --json` and `undistort --json` print it.

use serde::Serialize;

use super::{After, DepthPictures, Drawn, DrawnFrame, LensDrawn, LensFrame, Shown};
use crate::{
    correct::{Rectifier, Step},
    recording::Recording,
    wire::Document,
};

/// Depth over colour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OverlayDocument {
    /// Name of the recording.
    pub recording: String,
    /// `depth` or `edges`.
    pub shown: String,
    /// Depths at the ends of the colours; `null` where each frame has its own.
    pub range_m: Option<[f64; 2]>,
    /// The corrections shown beside it.
    pub steps: Vec<Step>,
    /// The recording shown beside it.
    pub beside: Option<String>,
    /// In order.
    pub frames: Vec<DrawnFrame>,
    /// Frames without colour or depth.
    pub left_out: Vec<usize>,
    /// Contact sheet and animation.
    pub other_files: Vec<String>,
}

/// Original, forward table, inverse table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UndistortDocument {
    /// Name of the recording.
    pub recording: String,
    /// `tables` or `camera`.
    pub lens: String,
    /// `rectified`, `distorted`, `rectified_twice` or `unknown`.
    pub state: String,
    /// Frames in which the board was measured.
    pub n_frames_measured: usize,
    /// Rows and columns of the board in them.
    pub n_lines: usize,
    /// Distance of corners from straight lines: as recorded, resampled with the forward table, and with the inverse
    /// table; `null` where nothing was measured.
    pub rms_px: Option<[f64; 3]>,
    /// In order.
    pub frames: Vec<LensFrame>,
}

impl Document for OverlayDocument {
    const SCHEMA: &'static str = "truedepth.overlay/1";
}

impl Document for UndistortDocument {
    const SCHEMA: &'static str = "truedepth.undistort/1";
}

impl OverlayDocument {
    /// What was drawn.
    pub fn new(pictures: &DepthPictures<'_>, drawn: &Drawn) -> Self {
        let shown = match pictures.style.shown {
            Shown::Depth => "depth",
            Shown::Edges => "edges",
        };
        Self {
            recording: pictures.recording.name.clone(),
            shown: shown.to_owned(),
            range_m: drawn.range_m,
            steps: match pictures.after {
                After::Corrected(plan) => plan.steps().to_vec(),
                _ => Vec::new(),
            },
            beside: match pictures.after {
                After::Recording(other) => Some(other.name.clone()),
                _ => None,
            },
            frames: drawn.frames.clone(),
            left_out: drawn.left_out.clone(),
            other_files: drawn.others.clone(),
        }
    }
}

impl UndistortDocument {
    /// What was drawn and measured.
    pub fn new(recording: &Recording, rectifier: &Rectifier, drawn: &LensDrawn) -> Self {
        Self {
            recording: recording.name.clone(),
            lens: rectifier.name().to_owned(),
            state: drawn.straightness.state().name().to_owned(),
            n_frames_measured: drawn.straightness.n_frames(),
            n_lines: drawn.straightness.n_lines(),
            rms_px: drawn.straightness.rms_px(),
            frames: drawn.frames.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{RadialTable, TablePair},
        correct::{BoardLine, Plan},
        files::Memory,
        geom::Pixel,
        recording::Defect,
        report::{Animation, DepthStyle, Flip, LensPictures, Range, sample},
        wire::to_json,
    };

    fn golden(name: &str, document: &impl Document) {
        sample::assert_golden(&format!("report/golden/{name}"), &to_json(document));
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
        golden("overlay.json", &OverlayDocument::new(&pictures, &drawn));
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
        golden("undistort.json", &UndistortDocument::new(&recording, &rectifier, &drawn));
    }
}
