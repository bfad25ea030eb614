//! What the capture app wrote about the camera, frame by frame, checked and in our units.
//!
//! The app has already scaled the intrinsics from the reference dimensions to the depth map (`IntrinsicMatrix` is
//! taken as it is); distortion centre and pixel size it has not.

use serde::Deserialize;

use super::json::Tuple;
use crate::{
    camera::{Intrinsics, RadialTable, TablePair},
    geom::Pixel,
    recording::{Error, Factory, Problem},
};

/// A record of `DepthMetadata.json`; keys that are not listed here are of no use to us.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct DepthRecord {
    #[serde(rename = "Timestamp")]
    pub(super) timestamp: i64,
    #[serde(rename = "Width")]
    width: u32,
    #[serde(rename = "Height")]
    height: u32,
    #[serde(rename = "IntrinsicMatrix.0")]
    intrinsic_row_0: Tuple<3>,
    #[serde(rename = "IntrinsicMatrix.1")]
    intrinsic_row_1: Tuple<3>,
    #[serde(rename = "IntrinsicMatrixReferenceDimensions")]
    reference: Option<Tuple<2>>,
    #[serde(rename = "LensDistortionCenter")]
    center: Option<Tuple<2>>,
    #[serde(rename = "LensDistortionLookupTable")]
    forward: Option<Vec<f64>>,
    #[serde(rename = "LensDistortionInverseLookupTable")]
    inverse: Option<Vec<f64>>,
    #[serde(rename = "ExtrinsicMatrix.0")]
    extrinsic_row_0: Option<Tuple<4>>,
    #[serde(rename = "ExtrinsicMatrix.1")]
    extrinsic_row_1: Option<Tuple<4>>,
    #[serde(rename = "ExtrinsicMatrix.2")]
    extrinsic_row_2: Option<Tuple<4>>,
    #[serde(rename = "PixelSize")]
    pixel_size_mm: Option<f64>,
    #[serde(rename = "Accuracy")]
    accuracy: Option<i64>,
    #[serde(rename = "DepthDataFiltered")]
    filtered: Option<bool>,
}

/// A record of `CameraMetadata.json`.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct CameraRecord {
    #[serde(rename = "Timestamp")]
    pub(super) timestamp: i64,
    #[serde(rename = "Width")]
    pub(super) width: u32,
    #[serde(rename = "Height")]
    pub(super) height: u32,
    #[serde(rename = "DeviceType")]
    device_type: Option<String>,
    #[serde(rename = "GeometricDistortionCorrectionEnabled")]
    geometric_distortion_correction: Option<bool>,
    #[serde(rename = "VideoFieldOfView")]
    field_of_view_deg: Option<f64>,
}

/// Where a record stands, for messages.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub(super) file: &'a str,
    pub(super) record: usize,
    pub(super) timestamp: i64,
}

impl At<'_> {
    /// An error about the value of a key unless it is `valid`.
    pub(super) fn require(
        self,
        valid: bool,
        key: &'static str,
        value: impl ToString,
        expected: impl Into<String>,
    ) -> Result<(), Error> {
        if valid { Ok(()) } else { Err(self.invalid(key, value, expected)) }
    }

    /// An error about the value of a key.
    fn invalid(
        self,
        key: &'static str,
        value: impl ToString,
        expected: impl Into<String>,
    ) -> Error {
        Error::Value {
            file: self.file.to_owned(),
            record: self.record,
            timestamp: self.timestamp,
            key,
            value: value.to_string(),
            valid: expected.into(),
        }
    }
}

impl DepthRecord {
    /// The factory metadata in our units, without what only the colour camera's record tells.
    pub(super) fn factory(
        &self,
        at: At<'_>,
        problems: &mut Vec<Problem>,
    ) -> Result<Factory, Error> {
        let intrinsics = self.intrinsics(at)?;
        let reference = self.reference.map(|Tuple(size)| size);
        if let Some([w, h]) = reference {
            let valid = (1.0..=1e5).contains(&w) && (1.0..=1e5).contains(&h);
            let key = "IntrinsicMatrixReferenceDimensions";
            at.require(valid, key, format!("({w}, {h})"), "two sizes of 1 to 100000 pixels")?;
        }
        let (distortion_center, tables) = self.distortion(at, &intrinsics, reference, problems)?;
        if let Some(size) = self.pixel_size_mm {
            at.require(
                size > 0.0 && size < 1.0,
                "PixelSize",
                size,
                "more than 0 and less than 1 mm",
            )?;
        }
        let rows = (self.extrinsic_row_0, self.extrinsic_row_1, self.extrinsic_row_2);
        let extrinsics = if let (Some(a), Some(b), Some(c)) = rows {
            Some([a, b, c].map(|Tuple([x, y, z, t_mm])| [x, y, z, t_mm / 1000.0]))
        } else {
            None
        };
        Ok(Factory {
            intrinsics,
            reference_dimensions: reference,
            distortion_center,
            tables,
            pixel_size_m: self.pixel_size_mm.map(|mm| mm / 1000.0),
            extrinsics,
            depth_absolute: self.accuracy.map(|accuracy| accuracy == 1),
            depth_filtered: self.filtered,
            geometric_distortion_correction: None,
            device_type: None,
            field_of_view_rad: None,
        })
    }

    fn intrinsics(&self, at: At<'_>) -> Result<Intrinsics, Error> {
        for (key, size) in [("Width", self.width), ("Height", self.height)] {
            at.require((1..=100_000).contains(&size), key, size, "1 to 100000 pixels")?;
        }
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        let Tuple([fx, skew, cx]) = self.intrinsic_row_0;
        let Tuple([skew_y, fy, cy]) = self.intrinsic_row_1;
        // Fields of view from 0.6° to 170°.
        let focal = 0.04 * w.max(h)..=100.0 * w.max(h);
        let near = |c: f64, size: f64| c > -0.5 * size && c < 1.5 * size;
        let rows = [
            ("IntrinsicMatrix.0", self.intrinsic_row_0, fx, skew, cx, w),
            ("IntrinsicMatrix.1", self.intrinsic_row_1, fy, skew_y, cy, h),
        ];
        for (key, Tuple([a, b, c]), f, skew, centre, size) in rows {
            let valid = focal.contains(&f) && skew.abs() <= 1e-9 * f && near(centre, size);
            at.require(
                valid,
                key,
                format!("({a}, {b}, {c})"),
                format!(
                    "a focal length of {} to {} px, a skew of 0 and a principal point of {} to {} px for a depth map \
                     of {w}x{h}",
                    focal.start(),
                    focal.end(),
                    -0.5 * size,
                    1.5 * size
                ),
            )?;
        }
        Ok(Intrinsics { fx, fy, cx, cy, width: self.width as usize, height: self.height as usize })
    }

    /// Distortion centre and tables at the size of the depth map.
    fn distortion(
        &self,
        at: At<'_>,
        intrinsics: &Intrinsics,
        reference: Option<[f64; 2]>,
        problems: &mut Vec<Problem>,
    ) -> Result<(Option<Pixel>, Option<TablePair>), Error> {
        // Without a table AVFoundation says (0, 0), which then means "none" (AVCameraCalibrationData.h).
        let no_table = self.forward.is_none() && self.inverse.is_none();
        let center = self.center.map(|Tuple(c)| c).filter(|&c| !(no_table && c == [0.0, 0.0]));
        let (Some([x, y]), Some([w, h])) = (center, reference) else {
            let key = "LensDistortionCenter";
            let need = "given together with IntrinsicMatrixReferenceDimensions where there is a lookup table";
            at.require(no_table, key, "missing or without a scale", need)?;
            return Ok((None, None));
        };
        at.require(
            x > -0.5 * w && x < 1.5 * w && y > -0.5 * h && y < 1.5 * h,
            "LensDistortionCenter",
            format!("({x}, {y})"),
            format!("in or near the image of {w}x{h} pixels (IntrinsicMatrixReferenceDimensions)"),
        )?;
        let size = [intrinsics.width, intrinsics.height];
        let scale = [size[0] as f64 / w, size[1] as f64 / h];
        if (scale[0] / scale[1] - 1.0).abs() > 0.01 {
            let timestamp = at.timestamp;
            problems.push(Problem::ReferenceShape { timestamp, reference: [w, h], size });
            return Ok((None, None));
        }
        let center = Pixel::new(x * size[0] as f64 / w, y * size[1] as f64 / h);
        let (forward, inverse) = match (&self.forward, &self.inverse) {
            (Some(forward), Some(inverse)) => (forward, inverse),
            (None, None) => return Ok((Some(center), None)),
            (None, _) => {
                let missing = "LensDistortionLookupTable";
                problems.push(Problem::SingleTable { timestamp: at.timestamp, missing });
                return Ok((Some(center), None));
            }
            (_, None) => {
                let missing = "LensDistortionInverseLookupTable";
                problems.push(Problem::SingleTable { timestamp: at.timestamp, missing });
                return Ok((Some(center), None));
            }
        };
        // Tables of nothing but zeros are what a rectified recording says (ours do, `MetadataEdit`): no table.
        if forward.iter().chain(inverse).all(|&m| m == 0.0) {
            return Ok((Some(center), None));
        }
        let radius = RadialTable::farthest_corner_px(center, size[0], size[1]);
        let table = |key, samples: &[f64]| {
            // Apple's own reach 0.15 at the corner of the widest lens.
            let absurd = samples.iter().find(|m| m.abs() >= 1.0);
            if let Some(m) = absurd {
                at.require(
                    false,
                    key,
                    m,
                    "between -1 and 1 everywhere: a magnification minus one",
                )?;
            }
            RadialTable::new(center, radius, samples.to_vec()).map_err(|error| {
                let value = format!("{} numbers: {error}", samples.len());
                at.invalid(key, value, "a table of the lens")
            })
        };
        let forward = table("LensDistortionLookupTable", forward)?;
        let inverse = table("LensDistortionInverseLookupTable", inverse)?;
        Ok((Some(center), Some(TablePair { forward, inverse })))
    }
}

impl CameraRecord {
    /// Checks the record, and adds to the factory metadata what it tells.
    pub(super) fn complete(&self, at: At<'_>, factory: Option<&mut Factory>) -> Result<(), Error> {
        for (key, size) in [("Width", self.width), ("Height", self.height)] {
            at.require((1..=100_000).contains(&size), key, size, "1 to 100000 pixels")?;
        }
        if let Some(fov) = self.field_of_view_deg {
            at.require(
                fov > 0.0 && fov < 180.0,
                "VideoFieldOfView",
                fov,
                "more than 0 and less than 180 degrees",
            )?;
        }
        if let Some(factory) = factory {
            factory.geometric_distortion_correction = self.geometric_distortion_correction;
            factory.device_type.clone_from(&self.device_type);
            factory.field_of_view_rad = self.field_of_view_deg.map(f64::to_radians);
        }
        Ok(())
    }
}
