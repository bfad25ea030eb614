//! Zip archives that are read.

use std::{
    collections::BTreeMap,
    io::{self, Cursor, Read, Seek, SeekFrom},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use zip::{CompressionMethod, ZipArchive, result::ZipError};

use super::{Error, Files, Limits, join, too_long};

/// A zip archive. Nothing is ever unpacked to disk.
///
/// Refused as a whole, with the name of the culprit: names that lead out of the archive (`../`, absolute), links,
/// and more files or bytes than the [`Limits`] allow. No file may unpack to more than the archive declares, so the
/// limits hold whatever it claims.
pub struct Archive {
    place: String,
    names: Vec<String>,
    entries: BTreeMap<String, Entry>,
    open: Box<dyn Open>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    index: usize,
    bytes: u64,
}

/// A [`ZipArchive`] over any kind of reader.
trait Open: Send + Sync {
    /// Unpacks at most `max_bytes` of a file.
    fn unpack(&self, index: usize, max_bytes: u64) -> Result<Vec<u8>, ZipError>;
}

impl<R: Read + Seek + Clone + Send + Sync> Open for ZipArchive<R> {
    fn unpack(&self, index: usize, max_bytes: u64) -> Result<Vec<u8>, ZipError> {
        // The clone shares the directory, and has its own place in the file.
        let mut archive = self.clone();
        let mut bytes = Vec::new();
        archive.by_index(index)?.take(max_bytes).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

impl Archive {
    /// An archive in memory; `place` is its name for messages.
    pub fn from_bytes(
        place: impl Into<String>,
        bytes: impl Into<Arc<[u8]>>,
        limits: &Limits,
    ) -> Result<Self, Error> {
        Self::new(place.into(), Cursor::new(bytes.into()), limits)
    }

    /// An archive on disk.
    #[cfg(feature = "fs")]
    pub fn open(path: &std::path::Path, limits: &Limits) -> Result<Self, Error> {
        let file =
            std::fs::File::open(path).map_err(|error| super::folder::file_error(path, &error))?;
        let file = super::folder::SharedFile::new(file);
        Self::new(path.display().to_string(), file, limits)
    }

    fn new<R: Read + Seek + Clone + Send + Sync + 'static>(
        place: String,
        reader: R,
        limits: &Limits,
    ) -> Result<Self, Error> {
        // An entry takes 46 bytes and its name; what a hostile directory costs in memory is a multiple of its length.
        let allowance = (1 << 20) + 512 * limits.files as u64;
        let metered = Metered { inner: reader, left: Arc::new(AtomicU64::new(allowance)) };
        let left = Arc::clone(&metered.left);
        let archive = ZipArchive::new(metered).map_err(|error| zip_error(&place, &error))?;
        left.store(u64::MAX, Ordering::Relaxed);

        let limit = |what: String| Err(Error::Limit { file: place.clone(), what });
        if archive.len() > limits.files {
            return limit(format!(
                "{} files are more than the limit of {}",
                archive.len(),
                limits.files
            ));
        }
        let mut entries = BTreeMap::new();
        let mut total_bytes = 0_u64;
        for index in 0..archive.len() {
            let entry = archive.by_index_data(index).map_err(|error| zip_error(&place, &error))?;
            let name = String::from_utf8_lossy(entry.name_raw()).replace('\\', "/");
            let refuse = |why: &str| {
                let name: String = name.chars().filter(|c| !c.is_control()).take(200).collect();
                Err(Error::Archive { file: place.clone(), why: format!("`{name}` {why}") })
            };
            if leads_out(&name) {
                return refuse(
                    "leads out of the archive, so the archive is not trusted; unpack it yourself, look at it, and \
                     give the folder",
                );
            }
            if entry.is_symlink() {
                return refuse("is a link, which is not followed; pack the file itself");
            }
            if entry.is_dir()
                || name.split('/').any(|part| part.starts_with('.') || part == "__MACOSX")
            {
                continue; // What systems leave beside the files.
            }
            if entry.encrypted() {
                return refuse(
                    "is encrypted; unpack the archive with its password and give the folder",
                );
            }
            if !matches!(
                entry.compression(),
                CompressionMethod::Stored | CompressionMethod::Deflated
            ) {
                return refuse(
                    "is packed by a method that is not supported; unpack the archive and give the folder",
                );
            }
            total_bytes = total_bytes.saturating_add(entry.size());
            entries.insert(name, Entry { index, bytes: entry.size() });
        }
        if total_bytes > limits.total_bytes {
            return limit(format!(
                "unpacks to {total_bytes} bytes, which is more than the limit of {}",
                limits.total_bytes
            ));
        }
        let names = entries.keys().cloned().collect();
        Ok(Self { place, names, entries, open: Box::new(archive) })
    }
}

impl Files for Archive {
    fn place(&self) -> &str {
        &self.place
    }

    fn names(&self) -> &[String] {
        &self.names
    }

    fn read(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        let file = join(&self.place, name);
        let Some(&Entry { index, bytes: declared }) = self.entries.get(name) else {
            return Err(Error::File { file, why: "no such file in the archive".into() });
        };
        if declared > max_bytes {
            return Err(too_long(file, max_bytes));
        }
        // One byte more than declared tells a lie from the truth.
        let bytes =
            self.open.unpack(index, declared + 1).map_err(|error| zip_error(&file, &error))?;
        if bytes.len() as u64 != declared {
            let why = format!(
                "unpacks to another length than the {declared} bytes that the archive declares; it is damaged or \
                 hostile, copy it again from where it came"
            );
            return Err(Error::Archive { file, why });
        }
        Ok(bytes)
    }
}

/// Whether a name points anywhere but into the archive.
fn leads_out(name: &str) -> bool {
    let drive = name.as_bytes().get(1) == Some(&b':');
    name.starts_with('/')
        || drive
        || name.contains('\0')
        || name.split('/').any(|part| part == "..")
}

fn zip_error(file: &str, error: &ZipError) -> Error {
    let file = file.to_owned();
    let why = match error {
        ZipError::Io(error) if error.kind() == io::ErrorKind::QuotaExceeded => {
            return Error::Limit {
                file,
                what: "the list of files in the archive is longer than the limit".into(),
            };
        }
        ZipError::UnsupportedArchive(why) => {
            format!("{why}; unpack the archive and give the folder")
        }
        other => format!("damaged or truncated zip ({other}); copy it again from where it came"),
    };
    Error::Archive { file, why }
}

/// A reader that stops after an allowance of bytes, shared by its clones.
#[derive(Clone)]
struct Metered<R> {
    inner: R,
    left: Arc<AtomicU64>,
}

impl<R: Read> Read for Metered<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        let taken = self
            .left
            .try_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(n as u64));
        match taken {
            Ok(_) => Ok(n),
            Err(_) => Err(io::ErrorKind::QuotaExceeded.into()),
        }
    }
}

impl<R: Seek> Seek for Metered<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.inner.seek(to)
    }
}
