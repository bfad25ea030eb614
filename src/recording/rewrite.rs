//! Metadata written again with a few values changed: keys that are not understood here, their order and the digits of
//! their numbers stay as they are.

use serde::{
    Deserialize, Deserializer,
    de::{MapAccess, Visitor},
};
use serde_json::value::RawValue;

use super::{
    Error, Push, Recording, json,
    write::tuple,
    zeiss::{CAMERA_METADATA, DEPTH_METADATA},
};
use crate::camera::Intrinsics;

/// What a frame's metadata say instead of what they said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Amendment {
    /// Intrinsics at the size of the depth map.
    pub intrinsics: Option<Intrinsics>,
    /// The images are rectified now: lookup tables become zero, so that whoever applies them does no harm, and
    /// `GeometricDistortionCorrectionEnabled` becomes true.
    pub rectified: bool,
}

impl Recording {
    /// The metadata files that are there.
    pub fn metadata_names(&self) -> Vec<&'static str> {
        let names = self.file_names();
        [DEPTH_METADATA, CAMERA_METADATA].into_iter().filter(|file| names.contains(file)).collect()
    }

    /// A metadata file as it is but for what `amend` says of each time (the timestamp as written), piece by piece.
    pub fn amended_metadata(
        &self,
        file: &str,
        amend: &dyn Fn(i64) -> Amendment,
        push: &mut Push<'_>,
    ) -> Result<(), Error> {
        let mut begun = false;
        let whole = || self.file(file);
        let reader = self.open_file(file)?;
        json::each_record(&self.path(file), reader, whole, &mut |mut record: Record| {
            if let Some(timestamp) = record.timestamp() {
                record.amend(&amend(timestamp));
            }
            push(if begun { b"," } else { b"[\n" })?;
            begun = true;
            push(record.to_text().as_bytes())
        })?;
        push(if begun { b"\n]\n" } else { b"[\n]\n" })
    }
}

/// An object with the order of its keys and the text of its values.
struct Record(Vec<(String, String)>);

impl Record {
    fn timestamp(&self) -> Option<i64> {
        self.0.iter().find(|(key, _)| key == "Timestamp")?.1.parse().ok()
    }

    /// Changes the values of keys that are there; none is added.
    fn amend(&mut self, amendment: &Amendment) {
        for (key, value) in &mut self.0 {
            match (key.as_str(), &amendment.intrinsics) {
                ("IntrinsicMatrix.0", Some(k)) => *value = tuple(&[k.fx, 0.0, k.cx]),
                ("IntrinsicMatrix.1", Some(k)) => *value = tuple(&[0.0, k.fy, k.cy]),
                _ => {}
            }
            if amendment.rectified {
                match key.as_str() {
                    "GeometricDistortionCorrectionEnabled" => *value = "true".to_owned(),
                    "LensDistortionLookupTable" | "LensDistortionInverseLookupTable" => {
                        // Only lists of numbers get here: opening the recording has checked that.
                        let n = value.matches(',').count() + 1;
                        let zeros = vec!["    0.0"; n].join(",\n");
                        *value = format!("[\n{zeros}\n  ]");
                    }
                    _ => {}
                }
            }
        }
    }

    fn to_text(&self) -> String {
        let entries: Vec<String> = self
            .0
            .iter()
            .map(|(key, value)| format!("  {} : {value}", serde_json::Value::from(key.as_str())))
            .collect();
        format!("{{\n{}\n}}", entries.join(",\n"))
    }
}

impl<'de> Deserialize<'de> for Record {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;

        impl<'de> Visitor<'de> for Entries {
            type Value = Record;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a record, `{...}`")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Record, A::Error> {
                let mut entries = Vec::new();
                while let Some((key, value)) = map.next_entry::<String, Box<RawValue>>()? {
                    entries.push((key, value.get().to_owned()));
                }
                Ok(Record(entries))
            }
        }

        deserializer.deserialize_map(Entries)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        image::{DepthMap, Rgb},
        recording::{Factory, Limits, Memory, Sink, Writer},
    };

    #[test]
    fn what_is_not_understood_stays_as_it_is() {
        let k = Intrinsics { fx: 9.0, fy: 9.0, cx: 3.5, cy: 2.5, width: 8, height: 6 };
        let mut writer = Writer::new(Memory::new("m"));
        let (color, depth) =
            (Rgb::new(8, 6, vec![[7; 3]; 48]), DepthMap::new(8, 6, vec![0.25; 48]));
        writer.frame(500, &color, &depth, &Factory::pinhole(k)).unwrap();
        let mut memory = writer.finish().unwrap();
        let text = "[\n{\n  \"Zeta\" : {\"b\" : [1e0,  2]},\n  \"IntrinsicMatrix.0\" : \"(9.0, 0.0, 3.5)\",\n  \
                    \"IntrinsicMatrix.1\" : \"(0.0, 9.0, 2.5)\",\n  \"Height\" : 6,\n  \"Width\" : 8,\n  \
                    \"LensDistortionCenter\" : \"(4.0, 3.0)\",\n  \
                    \"IntrinsicMatrixReferenceDimensions\" : \"(8.0, 6.0)\",\n  \
                    \"LensDistortionLookupTable\" : [\n    1e-3,\n    2.50e-3\n  ],\n  \
                    \"LensDistortionInverseLookupTable\" : [\n    -1e-3,\n    -2.50e-3\n  ],\n  \
                    \"Alpha \\\"q\\\"\" : 6.7641117311723065e-06,\n  \"Timestamp\" : 500\n}\n]\n";
        memory.insert(DEPTH_METADATA, text);
        let recording = Recording::from_source(Arc::new(memory), &Limits::default()).unwrap();
        assert!(recording.factory().unwrap().tables.is_some());
        let amended = |file, amendment| {
            let mut memory = Memory::default();
            let amend = &|_| amendment;
            memory.stream(file, &mut |push| recording.amended_metadata(file, amend, push)).unwrap();
            String::from_utf8(memory.get(file).unwrap().to_vec()).unwrap()
        };
        assert_eq!(recording.metadata_names(), [DEPTH_METADATA, CAMERA_METADATA]);
        assert_eq!(amended(DEPTH_METADATA, Amendment::default()), text);
        assert_eq!(
            amended(CAMERA_METADATA, Amendment::default()).as_bytes(),
            recording.file(CAMERA_METADATA).unwrap()
        );

        let intrinsics = Some(Intrinsics { fx: 8.5, fy: 8.25, cx: 3.0, cy: 2.0, ..k });
        let amended = amended(DEPTH_METADATA, Amendment { intrinsics, rectified: true });
        for (from, to) in [
            ("(9.0, 0.0, 3.5)", "(8.5, 0.0, 3.0)"),
            ("(0.0, 9.0, 2.5)", "(0.0, 8.25, 2.0)"),
            ("    1e-3,\n    2.50e-3", "    0.0,\n    0.0"),
            ("    -1e-3,\n    -2.50e-3", "    0.0,\n    0.0"),
        ] {
            assert!(text.contains(from) && amended.contains(to) && !amended.contains(from));
        }
        assert!(
            amended.contains("6.7641117311723065e-06") && amended.contains("{\"b\" : [1e0,  2]}")
        );
    }
}
