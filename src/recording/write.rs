//! Recordings written in the format they are read from.

use super::{
    Error, Factory, board_to_toml,
    zeiss::{BOARD, CAMERA_METADATA, DEPTH_METADATA, DEPTH_UNIT_M},
};
use crate::{
    board::{CharucoBoard, Dictionary},
    image::{DepthMap, Rgb},
};

/// Where files are written to: a folder, memory, an upload.
pub trait Sink {
    /// Writes a whole file.
    fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error>;

    /// Writes a file of which `fill` hands over piece after piece, for what need not lie in memory as a whole.
    fn stream(&mut self, name: &str, fill: &mut Fill<'_>) -> Result<(), Error> {
        let mut whole = Vec::new();
        fill(&mut |bytes| {
            whole.extend_from_slice(bytes);
            Ok(())
        })?;
        self.write(name, &whole)
    }
}

/// Takes the next piece of a file.
pub type Push<'a> = dyn FnMut(&[u8]) -> Result<(), Error> + 'a;

/// Hands the pieces of a file over.
pub type Fill<'a> = dyn FnMut(&mut Push<'_>) -> Result<(), Error> + 'a;

/// Writes a recording frame by frame, metadata in the very spelling of the capture app, so that the programs of
/// others read it too.
#[derive(Debug)]
pub struct Writer<S: Sink> {
    sink: S,
    depth_records: Vec<(i64, String)>,
    camera_records: Vec<(i64, String)>,
}

impl<S: Sink> Writer<S> {
    /// A recording without frames.
    pub fn new(sink: S) -> Self {
        Self { sink, depth_records: Vec::new(), camera_records: Vec::new() }
    }

    /// Adds a frame taken `timestamp` milliseconds after some beginning.
    pub fn frame(
        &mut self,
        timestamp: i64,
        color: &Rgb,
        depth: &DepthMap,
        factory: &Factory,
    ) -> Result<(), Error> {
        self.encoded_frame(timestamp, &color.to_png(), &encode_depth(depth), factory)
    }

    /// Adds a frame whose images are PNG already: as they were read, or encoded on several threads. The depth image
    /// must count 10⁻⁴ m ([`encode_depth`]), and both must have the size of `factory.intrinsics`.
    pub fn encoded_frame(
        &mut self,
        timestamp: i64,
        color_png: &[u8],
        depth_png: &[u8],
        factory: &Factory,
    ) -> Result<(), Error> {
        self.sink.write(&format!("rgb_{timestamp}.png"), color_png)?;
        self.sink.write(&format!("depth_{timestamp}.png"), depth_png)?;
        self.depth_records.push((timestamp, depth_record(timestamp, factory)));
        self.camera_records.push((timestamp, camera_record(timestamp, factory)));
        Ok(())
    }

    /// Describes the board, in `board.toml`; a dictionary of one's own gets its file beside it.
    pub fn board(&mut self, board: &CharucoBoard) -> Result<(), Error> {
        if Dictionary::is_file(board.dictionary.name()) {
            self.sink
                .write(board.dictionary.name(), board.dictionary.to_opencv_yaml().as_bytes())?;
        }
        self.sink.write(BOARD, board_to_toml(board).as_bytes())
    }

    /// Adds any other file, like `truth.json`.
    pub fn file(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        self.sink.write(name, bytes)
    }

    /// Writes the metadata, in order of time, and hands the sink back. Without it the recording is incomplete.
    pub fn finish(mut self) -> Result<S, Error> {
        for (file, records) in
            [(DEPTH_METADATA, &mut self.depth_records), (CAMERA_METADATA, &mut self.camera_records)]
        {
            records.sort_by_key(|&(timestamp, _)| timestamp);
            let records: Vec<&str> = records.iter().map(|(_, text)| text.as_str()).collect();
            self.sink.write(file, format!("[\n{}\n]\n", records.join(",")).as_bytes())?;
        }
        Ok(self.sink)
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

fn camera_record(timestamp: i64, factory: &Factory) -> String {
    let mut record = Record::default();
    if let Some(device) = &factory.device_type {
        record.entry("DeviceType", &serde_json::Value::from(device.as_str()).to_string());
    }
    let key = "GeometricDistortionCorrectionEnabled";
    record.bool(key, factory.geometric_distortion_correction);
    record.number("Height", Some(factory.intrinsics.height));
    record.number("Timestamp", Some(timestamp));
    record
        .number("VideoFieldOfView", factory.field_of_view_rad.map(|rad| Python(rad.to_degrees())));
    record.number("Width", Some(factory.intrinsics.width));
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
