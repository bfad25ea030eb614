//! A zip archive that is written.

use std::{
    collections::BTreeMap,
    io::{Seek, Write},
};

use zip::{CompressionMethod, ZipWriter, result::ZipError, write::SimpleFileOptions};

use super::{Error, Output};

/// A zip archive that is written file by file: into a file, or into memory with a `Cursor`.
///
/// Images are packed already, so that they are stored as they are; everything else is deflated. Files that are
/// [appended](Output::append) to are kept in memory until [`finish`](Self::finish).
pub struct ZipOutput<W: Write + Seek> {
    /// Of the archive, for messages.
    name: String,
    zip: ZipWriter<W>,
    growing: BTreeMap<String, Vec<u8>>,
}

impl<W: Write + Seek> ZipOutput<W> {
    /// An archive without files; `name` is what messages call it.
    pub fn new(name: impl Into<String>, writer: W) -> Self {
        Self { name: name.into(), zip: ZipWriter::new(writer), growing: BTreeMap::new() }
    }

    /// Writes what is still to be written and the list of files, and hands the writer back.
    pub fn finish(mut self) -> Result<W, Error> {
        for (name, bytes) in std::mem::take(&mut self.growing) {
            self.write(&name, &bytes)?;
        }
        self.zip.finish().map_err(|e| zip_error(&self.name, e))
    }
}

impl<W: Write + Seek> Output for ZipOutput<W> {
    fn create(&mut self, name: &str) -> Result<Box<dyn Write + '_>, Error> {
        let packed = [".png", ".jpg", ".jpeg"].iter().any(|end| name.ends_with(end));
        let method = if packed { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        // One time for all files: the same recording makes the same archive.
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .large_file(true)
            .last_modified_time(zip::DateTime::default());
        self.zip.start_file(name, options).map_err(|e| zip_error(&self.name, e))?;
        Ok(Box::new(&mut self.zip))
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        self.growing.entry(name.to_owned()).or_default().extend_from_slice(bytes);
        Ok(())
    }
}

fn zip_error(file: &str, error: ZipError) -> Error {
    Error::File { file: file.to_owned(), why: error.to_string() }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::files::{Archive, Files, Limits};

    #[test]
    fn what_is_written_reads_back() {
        let mut zip = ZipOutput::new("z.zip", Cursor::new(Vec::new()));
        zip.append("log.json", b"[1").unwrap();
        zip.write("folder/a.png", &[1; 1000]).unwrap();
        zip.append("log.json", b",2]").unwrap();
        zip.write("b.txt", &[b'x'; 1000]).unwrap();
        let bytes = zip.finish().unwrap().into_inner();
        assert!(bytes.len() < 2000, "{} bytes: text is packed", bytes.len());
        let archive = Archive::from_bytes("z.zip", bytes, &Limits::default()).unwrap();
        assert_eq!(archive.names(), ["b.txt", "folder/a.png", "log.json"]);
        assert_eq!(archive.read("log.json", 100).unwrap(), b"[1,2]");
        assert_eq!(archive.read("folder/a.png", 1000).unwrap(), [1; 1000]);
    }
}
