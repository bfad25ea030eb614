//! Folders on disk.

use std::{
    fs::{self, File, OpenOptions},
    io::{self, BufWriter, Read, Seek, SeekFrom, Write},
    path::{Component, Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use super::{Error, Files, Limits, Output, join, too_long};

/// How many folders deep files are listed.
const MAX_DEPTH: usize = 4;

/// Names that end so are files' names.
const FILE_ENDINGS: [&str; 6] = [".png", ".jpg", ".jpeg", ".json", ".toml", ".txt"];

/// A folder on disk and the folders in it, up to four deep. Links to folders are not followed, so that a loop does
/// no harm.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    place: String,
    names: Vec<String>,
}

impl Folder {
    /// Lists the folder.
    pub fn open(path: &Path, limits: &Limits) -> Result<Self, Error> {
        let mut folder =
            Self { path: path.to_owned(), place: path.display().to_string(), names: Vec::new() };
        folder.list("", 0, limits)?;
        folder.names.sort();
        Ok(folder)
    }

    fn list(&mut self, inside: &str, depth: usize, limits: &Limits) -> Result<(), Error> {
        let path = self.path.join(inside);
        let fail = |error| file_error(&path, &error);
        let mut folders = Vec::new();
        for entry in fs::read_dir(&path).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            // A name that is no Unicode is none of ours.
            let Ok(name) = entry.file_name().into_string() else { continue };
            if name.starts_with('.') {
                continue;
            }
            let is_folder = entry.file_type().map_err(fail)?.is_dir();
            // A folder under the name of a file must fail when that is read, not vanish.
            if is_folder && !FILE_ENDINGS.iter().any(|end| name.ends_with(end)) {
                folders.push(join(inside, &name));
            } else {
                self.names.push(join(inside, &name));
            }
            if self.names.len() + folders.len() > limits.files {
                let what = format!(
                    "more than {} files; give the folder of the recording itself",
                    limits.files
                );
                return Err(Error::Limit { file: self.place.clone(), what });
            }
        }
        if depth < MAX_DEPTH {
            for name in folders {
                self.list(&name, depth + 1, limits)?;
            }
        }
        Ok(())
    }
}

impl Files for Folder {
    fn place(&self) -> &str {
        &self.place
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn read(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        read(&self.path.join(name), max_bytes)
    }

    fn open(&self, name: &str, max_bytes: u64) -> Result<Box<dyn Read + '_>, Error> {
        open(&self.path.join(name), max_bytes)
    }
}

/// The whole of a file on disk.
pub(super) fn read(path: &Path, max_bytes: u64) -> Result<Vec<u8>, Error> {
    let (file, length) = open_file(path)?;
    let mut bytes = Vec::with_capacity(length.min(max_bytes) as usize + 1);
    file.take(max_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|error| file_error(path, &error))?;
    if bytes.len() as u64 > max_bytes {
        return Err(too_long(path.display().to_string(), max_bytes));
    }
    Ok(bytes)
}

/// A file on disk from its beginning on.
pub(super) fn open(path: &Path, max_bytes: u64) -> Result<Box<dyn Read>, Error> {
    let (file, length) = open_file(path)?;
    if length > max_bytes {
        return Err(too_long(path.display().to_string(), max_bytes));
    }
    // It may grow while it is read.
    Ok(Box::new(file.take(max_bytes)))
}

/// A file and its length.
fn open_file(path: &Path) -> Result<(File, u64), Error> {
    let fail = |error| file_error(path, &error);
    // Asked before opening: opening a pipe would wait for ever.
    let metadata = fs::metadata(path).map_err(fail)?;
    if !metadata.is_file() {
        let why = "not a file".to_owned();
        return Err(Error::File { file: path.display().to_string(), why });
    }
    Ok((File::open(path).map_err(fail)?, metadata.len()))
}

/// A new folder that fills up file by file: what is written is there even if the process is killed.
#[derive(Clone, Debug)]
pub struct NewFolder {
    path: PathBuf,
}

impl NewFolder {
    /// Makes the folder, and those above it. Refused where it is already there and not empty: nothing is overwritten.
    pub fn create(path: &Path) -> Result<Self, Error> {
        fs::create_dir_all(path).map_err(|error| file_error(path, &error))?;
        let mut entries = fs::read_dir(path).map_err(|error| file_error(path, &error))?;
        if entries.next().is_some() {
            return Err(not_empty(path));
        }
        Ok(Self { path: path.to_owned() })
    }
}

impl Output for NewFolder {
    fn create(&mut self, name: &str) -> Result<Box<dyn Write + '_>, Error> {
        create(&place_in(&self.path, name)?)
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        append(&place_in(&self.path, name)?, bytes)
    }
}

pub(super) fn not_empty(path: &Path) -> Error {
    Error::Taken {
        file: path.display().to_string(),
        why: "the folder is not empty; name a new one".into(),
    }
}

/// Where a file of this name goes in a folder; the folders inside are made.
pub(super) fn place_in(folder: &Path, name: &str) -> Result<PathBuf, Error> {
    let inside = Path::new(name);
    if name.is_empty() || !inside.components().all(|part| matches!(part, Component::Normal(_))) {
        let why = "not a name of a file inside a folder".to_owned();
        return Err(Error::File { file: name.to_owned(), why });
    }
    let path = folder.join(inside);
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|e| file_error(folder, &e))?;
    }
    Ok(path)
}

/// Begins a file.
pub(super) fn create(path: &Path) -> Result<Box<dyn Write>, Error> {
    Ok(Box::new(BufWriter::new(File::create(path).map_err(|e| file_error(path, &e))?)))
}

/// Adds to the end of a file.
pub(super) fn append(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .and_then(|mut file| file.write_all(bytes))
        .map_err(|e| file_error(path, &e))
}

pub(super) fn file_error(path: &Path, error: &io::Error) -> Error {
    Error::io(&path.display().to_string(), error)
}

/// A file that several readers share, each with its own place in it. The lock is held while bytes are fetched, not
/// while anybody works on them.
#[derive(Clone, Debug)]
pub(super) struct SharedFile {
    file: Arc<Mutex<File>>,
    position: u64,
}

impl SharedFile {
    pub(super) fn new(file: File) -> Self {
        Self { file: Arc::new(Mutex::new(file)), position: 0 }
    }
}

impl Read for SharedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // Whoever panicked under the lock left no state behind: the position is set anew each time.
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(self.position))?;
        let n = file.read(buffer)?;
        self.position += n as u64;
        Ok(n)
    }
}

impl Seek for SharedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let base = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(by) => self.position.checked_add_signed(by),
            SeekFrom::End(by) => {
                let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
                file.metadata()?.len().checked_add_signed(by)
            }
        };
        self.position = base.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}
