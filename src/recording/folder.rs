//! Recordings on disk.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use super::{
    Error, Fill, Limits, Sink, Source,
    source::{join, too_long},
    zeiss,
};

/// How many folders deep recordings are looked for.
const MAX_DEPTH: usize = 4;

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
            // A folder under the name of a file of ours must fail when it is read, not vanish.
            if is_folder && !zeiss::is_ours(&name) {
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

impl Source for Folder {
    fn place(&self) -> &str {
        &self.place
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn read(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        let path = self.path.join(name);
        let (file, length) = open_file(&path)?;
        let mut bytes = Vec::with_capacity(length.min(max_bytes) as usize + 1);
        file.take(max_bytes.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(|error| file_error(&path, &error))?;
        if bytes.len() as u64 > max_bytes {
            return Err(too_long(path.display().to_string(), max_bytes));
        }
        Ok(bytes)
    }

    fn open(&self, name: &str, max_bytes: u64) -> Result<Box<dyn Read + '_>, Error> {
        let path = self.path.join(name);
        let (file, length) = open_file(&path)?;
        if length > max_bytes {
            return Err(too_long(path.display().to_string(), max_bytes));
        }
        // It may grow while it is read.
        Ok(Box::new(file.take(max_bytes)))
    }
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

/// A folder that is written to.
#[derive(Clone, Debug)]
pub struct FolderSink {
    path: PathBuf,
}

impl FolderSink {
    /// Makes the folder, and those above it. Refused where it is already there and not empty: nothing is overwritten.
    pub fn create(path: &Path) -> Result<Self, Error> {
        fs::create_dir_all(path).map_err(|error| file_error(path, &error))?;
        let mut entries = fs::read_dir(path).map_err(|error| file_error(path, &error))?;
        if entries.next().is_some() {
            return Err(Error::File {
                file: path.display().to_string(),
                why: "the folder is not empty; name a new one".into(),
            });
        }
        Ok(Self { path: path.to_owned() })
    }
}

impl Sink for FolderSink {
    fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let path = self.path.join(name);
        fs::write(&path, bytes).map_err(|error| file_error(&path, &error))
    }

    fn stream(&mut self, name: &str, fill: &mut Fill<'_>) -> Result<(), Error> {
        fill_file(&self.path.join(name), fill)
    }
}

/// Writes a file piece by piece.
pub(super) fn fill_file(path: &Path, fill: &mut Fill<'_>) -> Result<(), Error> {
    let fail = |error| file_error(path, &error);
    let mut file = BufWriter::new(File::create(path).map_err(fail)?);
    fill(&mut |bytes| file.write_all(bytes).map_err(fail))?;
    file.flush().map_err(fail)
}

pub(super) fn file_error(path: &Path, error: &io::Error) -> Error {
    Error::File { file: path.display().to_string(), why: error.to_string() }
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
