//! Single files on disk, named one by one.

use std::{
    collections::BTreeMap,
    io::Read,
    path::{Path, PathBuf},
};

use super::{Error, Files, folder, join};

/// Single files on disk. One alone lies in its folder under its own name; several are called by their paths.
#[derive(Clone, Debug)]
pub struct Paths {
    place: String,
    names: Vec<String>,
    paths: BTreeMap<String, PathBuf>,
}

impl Paths {
    /// These files; whether they are there is seen when they are read.
    pub fn new(paths: Vec<PathBuf>) -> Self {
        let alone = match paths.as_slice() {
            [only] => only.parent().zip(only.file_name()),
            _ => None,
        };
        let place = alone.map_or(String::new(), |(folder, _)| folder.display().to_string());
        let called = |path: &Path| match alone {
            Some((_, name)) => name.to_string_lossy().into_owned(),
            None => path.display().to_string(),
        };
        let mut by_name = BTreeMap::new();
        let mut names = Vec::new();
        for path in &paths {
            let name = called(path);
            by_name.insert(name.clone(), path.clone());
            names.push(name);
        }
        Self { place, names, paths: by_name }
    }

    fn path(&self, name: &str) -> Result<&Path, Error> {
        let missing = || Error::File { file: join(&self.place, name), why: "no such file".into() };
        self.paths.get(name).map(PathBuf::as_path).ok_or_else(missing)
    }
}

impl Files for Paths {
    fn place(&self) -> &str {
        &self.place
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn read(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        folder::read(self.path(name)?, max_bytes)
    }

    fn open(&self, name: &str, max_bytes: u64) -> Result<Box<dyn Read + '_>, Error> {
        folder::open(self.path(name)?, max_bytes)
    }
}
