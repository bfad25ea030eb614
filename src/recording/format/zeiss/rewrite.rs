//! Metadata written again with a few values changed: keys that are not understood here, their order and the digits of
//! their numbers stay as they are.

use serde::{
    Deserialize, Deserializer,
    de::{MapAccess, Visitor},
};
use serde_json::value::RawValue;

use super::{CAMERA_METADATA, DEPTH_METADATA, json, write::tuple};
use crate::{
    files::{self, Output},
    recording::{Contents, Error, MetadataEdit},
};

/// Writes the metadata files as they are but for what `edit` says of each frame, one record at a time.
pub(super) fn metadata(
    contents: &Contents,
    edit: &dyn Fn(&str) -> MetadataEdit,
    output: &mut dyn Output,
) -> Result<(), Error> {
    let names = contents.names_here();
    for file in [DEPTH_METADATA, CAMERA_METADATA].into_iter().filter(|file| names.contains(file)) {
        let mut output = output.create(file)?;
        let mut push = |bytes: &[u8]| {
            output.write_all(bytes).map_err(|e| Error::Files(files::Error::io(file, &e)))
        };
        let mut begun = false;
        let whole = || contents.read(file);
        let reader = contents.open(file)?;
        json::each_record(&contents.path(file), reader, whole, &mut |mut record: Record| {
            if let Some(timestamp) = record.timestamp() {
                record.edit(&edit(&timestamp.to_string()));
            }
            push(if begun { b"," } else { b"[\n" })?;
            begun = true;
            push(record.to_text().as_bytes())
        })?;
        push(if begun { b"\n]\n" } else { b"[\n]\n" })?;
        output.flush().map_err(|e| files::Error::io(file, &e))?;
    }
    Ok(())
}

/// An object with the order of its keys and the text of its values.
struct Record(Vec<(String, String)>);

impl Record {
    fn timestamp(&self) -> Option<i64> {
        self.0.iter().find(|(key, _)| key == "Timestamp")?.1.parse().ok()
    }

    /// Changes the values of keys that are there; none is added.
    fn edit(&mut self, edit: &MetadataEdit) {
        for (key, value) in &mut self.0 {
            match (key.as_str(), &edit.intrinsics) {
                ("IntrinsicMatrix.0", Some(k)) => *value = tuple(&[k.fx, 0.0, k.cx]),
                ("IntrinsicMatrix.1", Some(k)) => *value = tuple(&[0.0, k.fy, k.cy]),
                _ => {}
            }
            if edit.rectified {
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
        camera::Intrinsics,
        files::{Limits, Memory},
        image::{DepthMap, Rgb},
        recording::{Factory, Recording, Writer},
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
        let recording = Recording::from_files(Arc::new(memory), &Limits::default()).unwrap();
        assert!(recording.factory().unwrap().tables.is_some());
        let edited = |file, edit: MetadataEdit| {
            let mut memory = Memory::default();
            recording.images().rewrite_metadata(&|_| edit, &mut memory).unwrap();
            String::from_utf8(memory.get(file).unwrap().to_vec()).unwrap()
        };
        assert_eq!(edited(DEPTH_METADATA, MetadataEdit::default()), text);
        assert_eq!(
            edited(CAMERA_METADATA, MetadataEdit::default()).as_bytes(),
            recording.file(CAMERA_METADATA).unwrap()
        );

        let intrinsics = Some(Intrinsics { fx: 8.5, fy: 8.25, cx: 3.0, cy: 2.0, ..k });
        let edited = edited(DEPTH_METADATA, MetadataEdit { intrinsics, rectified: true });
        for (from, to) in [
            ("(9.0, 0.0, 3.5)", "(8.5, 0.0, 3.0)"),
            ("(0.0, 9.0, 2.5)", "(0.0, 8.25, 2.0)"),
            ("    1e-3,\n    2.50e-3", "    0.0,\n    0.0"),
            ("    -1e-3,\n    -2.50e-3", "    0.0,\n    0.0"),
        ] {
            assert!(text.contains(from) && edited.contains(to) && !edited.contains(from));
        }
        assert!(
            edited.contains("6.7641117311723065e-06") && edited.contains("{\"b\" : [1e0,  2]}")
        );
    }
}
