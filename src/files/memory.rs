//! Files in memory.

use std::{
    collections::BTreeMap,
    io::{Read, Write},
};

use super::{Error, Files, Output, join, too_long};

/// Files in memory: to read what came some other way than through a file system, or to write there.
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
        *self.file(name.into()) = bytes.into();
    }

    /// The file of this name.
    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.get(name).map(Vec::as_slice)
    }

    /// All files by name, in order.
    pub fn files(&self) -> &BTreeMap<String, Vec<u8>> {
        &self.files
    }

    /// The file of this name, empty where it is new.
    fn file(&mut self, name: String) -> &mut Vec<u8> {
        if let Err(at) = self.names.binary_search(&name) {
            self.names.insert(at, name.clone());
        }
        self.files.entry(name).or_default()
    }

    fn bounded(&self, name: &str, max_bytes: u64) -> Result<&[u8], Error> {
        let file = join(&self.place, name);
        match self.get(name) {
            None => Err(Error::File { file, why: "no such file".into() }),
            Some(bytes) if bytes.len() as u64 > max_bytes => Err(too_long(file, max_bytes)),
            Some(bytes) => Ok(bytes),
        }
    }
}

impl Files for Memory {
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

impl Output for Memory {
    fn create(&mut self, name: &str) -> Result<Box<dyn Write + '_>, Error> {
        let file = self.file(name.to_owned());
        file.clear();
        Ok(Box::new(file))
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        self.file(name.to_owned()).extend_from_slice(bytes);
        Ok(())
    }
}
