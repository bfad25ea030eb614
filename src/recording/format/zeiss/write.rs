//! Recordings written in the format they are read from.

use super::{BOARD, CAMERA_METADATA, DEPTH_METADATA, DEPTH_UNIT_M};
use crate::{
    board::{CharucoBoard, Dictionary},
    files::{self, Output},
    image::{DepthMap, Rgb},
    recording::{Factory, board_to_toml},
};

/// Writes a recording frame by frame, metadata in the very spelling of the capture app, so that the programs of
/// others read it too.
///
/// Metadata are appended as frames come: if the process is killed, the frames written so far can be read.
#[derive(Debug)]
pub struct Writer<O: Output> {
    output: O,
    n_frames: usize,
}

impl<O: Output> Writer<O> {
    /// A recording without frames.
    pub fn new(output: O) -> Self {
        Self { output, n_frames: 0 }
    }

    /// Adds a frame taken `t_ms` milliseconds after some beginning; both images have the size of
    /// `factory.intrinsics`.
    pub fn frame(
        &mut self,
        t_ms: i64,
        color: &Rgb,
        depth: &DepthMap,
        factory: &Factory,
    ) -> Result<(), files::Error> {
        self.encoded_frame(t_ms, &color.to_png(), &encode_depth(depth), factory)
    }

    /// As [`frame`](Self::frame), from images that are PNG already: as they were read, or encoded on several threads.
    /// The depth image must count 10⁻⁴ m ([`encode_depth`]).
    pub fn encoded_frame(
        &mut self,
        t_ms: i64,
        color_png: &[u8],
        depth_png: &[u8],
        factory: &Factory,
    ) -> Result<(), files::Error> {
        self.output.write(&format!("rgb_{t_ms}.png"), color_png)?;
        self.output.write(&format!("depth_{t_ms}.png"), depth_png)?;
        self.metadata(t_ms, factory, factory.size())
    }

    /// Adds the metadata of a frame whose images were written to the [output](Self::output) under the names
    /// `rgb_T.png` and `depth_T.png`: `factory` at the size of the depth map, and the size of the
    /// colour image.
    pub fn metadata(
        &mut self,
        t_ms: i64,
        factory: &Factory,
        color_size: [usize; 2],
    ) -> Result<(), files::Error> {
        let before = if self.n_frames == 0 { "[\n" } else { "," };
        self.n_frames += 1;
        let depth = format!("{before}{}", depth_record(t_ms, factory));
        self.output.append(DEPTH_METADATA, depth.as_bytes())?;
        let camera = format!("{before}{}", camera_record(t_ms, factory, color_size));
        self.output.append(CAMERA_METADATA, camera.as_bytes())
    }

    /// Describes the board, in `board.toml`; a dictionary of one's own gets its file beside it.
    pub fn board(&mut self, board: &CharucoBoard) -> Result<(), files::Error> {
        if Dictionary::is_file(board.dictionary.name()) {
            self.output
                .write(board.dictionary.name(), board.dictionary.to_opencv_yaml().as_bytes())?;
        }
        self.output.write(BOARD, board_to_toml(board).as_bytes())
    }

    /// Where the recording is written to: for any other file, like `truth.json`.
    pub fn output(&mut self) -> &mut O {
        &mut self.output
    }

    /// Ends the metadata, and hands the output back. Without it they are read as far as they go.
    pub fn finish(mut self) -> Result<O, files::Error> {
        let end: &[u8] = if self.n_frames == 0 { b"[\n]\n" } else { b"\n]\n" };
        self.output.append(DEPTH_METADATA, end)?;
        self.output.append(CAMERA_METADATA, end)?;
        Ok(self.output)
    }
}

/// A depth map as this format stores it: 16-bit grey PNG counting 10⁻⁴ m.
pub fn encode_depth(depth: &DepthMap) -> Vec<u8> {
    depth.to_png(DEPTH_UNIT_M)
}

fn depth_record(timestamp: i64, factory: &Factory) -> String {
    let k = &factory.intrinsics;
    let mut record = Record::default();
    record.number("Accuracy", factory.depth_absolute.map(i64::from));
    record.bool("DepthDataFiltered", factory.depth_filtered);
    for (i, row) in factory.extrinsics.iter().flatten().enumerate() {
        let [x, y, z, t_m] = *row;
        record.tuple(&format!("ExtrinsicMatrix.{i}"), &[x, y, z, t_m * 1000.0]);
    }
    record.number("Height", Some(k.height));
    record.tuple("IntrinsicMatrix.0", &[k.fx, 0.0, k.cx]);
    record.tuple("IntrinsicMatrix.1", &[0.0, k.fy, k.cy]);
    record.tuple("IntrinsicMatrix.2", &[0.0, 0.0, 1.0]);
    // The centre is written at the reference size; where that is not known, the depth map is its own reference.
    let size = [k.width as f64, k.height as f64];
    let center = factory.distortion_center.or(factory.tables.as_ref().map(|t| t.inverse.center));
    let reference = factory.reference_dimensions.or(center.map(|_| size));
    if let Some(reference) = reference {
        record.tuple("IntrinsicMatrixReferenceDimensions", &reference);
        if let Some(c) = center {
            let center = [c.x * reference[0] / size[0], c.y * reference[1] / size[1]];
            record.tuple("LensDistortionCenter", &center);
        }
    }
    if let Some(tables) = &factory.tables {
        record.list("LensDistortionInverseLookupTable", &tables.inverse.magnification);
        record.list("LensDistortionLookupTable", &tables.forward.magnification);
    }
    record.number("PixelSize", factory.pixel_size_m.map(|m| Python(m * 1000.0)));
    record.number("Timestamp", Some(timestamp));
    record.number("Width", Some(k.width));
    record.finish()
}

fn camera_record(timestamp: i64, factory: &Factory, [width, height]: [usize; 2]) -> String {
    let mut record = Record::default();
    if let Some(device) = &factory.device_type {
        record.entry("DeviceType", &serde_json::Value::from(device.as_str()).to_string());
    }
    let key = "GeometricDistortionCorrectionEnabled";
    record.bool(key, factory.geometric_distortion_correction);
    record.number("Height", Some(height));
    record.number("Timestamp", Some(timestamp));
    record
        .number("VideoFieldOfView", factory.field_of_view_rad.map(|rad| Python(rad.to_degrees())));
    record.number("Width", Some(width));
    record.finish()
}

/// A number that both JSON and Python read back to the last bit.
struct Python(f64);

impl std::fmt::Display for Python {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

/// Numbers as the app writes tuples, a string: `"(1.0, 0.0)"`.
pub(super) fn tuple(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|&v| Python(v).to_string()).collect();
    format!("\"({})\"", values.join(", "))
}

/// A JSON object in the app's spelling: sorted keys, two spaces, ` : `.
#[derive(Default)]
struct Record(String);

impl Record {
    fn entry(&mut self, key: &str, value: &str) {
        let comma = if self.0.is_empty() { "" } else { ",\n" };
        self.0 += &format!("{comma}  \"{key}\" : {value}");
    }

    fn number(&mut self, key: &str, value: Option<impl std::fmt::Display>) {
        if let Some(value) = value {
            self.entry(key, &value.to_string());
        }
    }

    fn bool(&mut self, key: &str, value: Option<bool>) {
        self.number(key, value);
    }

    fn tuple(&mut self, key: &str, values: &[f64]) {
        self.entry(key, &tuple(values));
    }

    fn list(&mut self, key: &str, values: &[f64]) {
        let values: Vec<String> = values.iter().map(|&v| format!("    {}", Python(v))).collect();
        self.entry(key, &format!("[\n{}\n  ]", values.join(",\n")));
    }

    fn finish(self) -> String {
        format!("{{\n{}\n}}", self.0)
    }
}
