//! Where the files of a recording come from: named readers.

use std::{collections::BTreeMap, io::Read};

use super::{Error, Sink};

/// The files of one or more recordings, by name. Readable from several threads at once.
pub trait Source: Send + Sync {
    /// Where the files are, for people: a path, a URL.
    fn place(&self) -> &str;

    /// The names of all files, relative to the place, with `/` between folders.
    fn names(&self) -> &[String];

    /// The whole content of a file; [`Error::Limit`] where it is longer than `max_bytes`.
    fn read(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error>;

    /// A file from its beginning on, for what need not lie in memory as a whole; bounded like [`read`](Self::read).
    fn open(&self, name: &str, max_bytes: u64) -> Result<Box<dyn Read + '_>, Error> {
        Ok(Box::new(std::io::Cursor::new(self.read(name, max_bytes)?)))
    }
}

/// Files in memory: to read a recording that came some other way than through a file system, or to write one.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    place: String,
    names: Vec<String>,
    files: BTreeMap<String, Vec<u8>>,
}

impl Memory {
    /// No files yet, at this place.
    pub fn new(place: impl Into<String>) -> Self {
        Self { place: place.into(), ..Self::default() }
    }

    /// Adds a file or replaces it.
    pub fn insert(&mut self, name: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        self.files.insert(name.into(), bytes.into());
        self.names = self.files.keys().cloned().collect();
    }

    /// The file of this name.
    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.get(name).map(Vec::as_slice)
    }

    fn bounded(&self, name: &str, max_bytes: u64) -> Result<&[u8], Error> {
        let file = join(&self.place, name);
        match self.get(name) {
            None => Err(Error::File { file, why: "no such file".into() }),
            Some(bytes) if bytes.len() as u64 > max_bytes => Err(too_long(file, max_bytes)),
            Some(bytes) => Ok(bytes),
        }
    }

    /// All files by name, in order.
    pub fn files(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.files
    }
}

impl Source for Memory {
    fn place(&self) -> &str {
        &self.place
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn read(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        self.bounded(name, max_bytes).map(<[u8]>::to_vec)
    }

    fn open(&self, name: &str, max_bytes: u64) -> Result<Box<dyn Read + '_>, Error> {
        Ok(Box::new(self.bounded(name, max_bytes)?))
    }
}

impl Sink for Memory {
    fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        self.insert(name, bytes);
        Ok(())
    }
}

/// Folder and file name with a `/` between them, where there is a folder.
pub(super) fn join(folder: &str, name: &str) -> String {
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
}

pub(super) fn too_long(file: String, max_bytes: u64) -> Error {
    Error::Limit { file, what: format!("longer than the limit of {max_bytes} bytes for one file") }
}
