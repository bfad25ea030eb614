//! Named bytes in and out, whatever they are: nothing here knows what a recording is.
//!
//! [`Files`] hands over named files: a [`Folder`], a zip [`Archive`], single files by their [`Paths`], or [`Memory`].
//! [`Output`] takes them: [`Memory`], a [`ZipOutput`], an [`AtomicFolder`] that comes to be as a whole or not at all,
//! or a [`NewFolder`] that fills up file by file and keeps what is there if the process is killed.
//!
//! Everything read is untrusted: names are checked, and lengths and counts are bounded by [`Limits`].
//!
//! ```
//! use truedepth::files::{Files, Memory, Output};
//!
//! let mut memory = Memory::new("example");
//! memory.write("a.txt", b"one")?;
//! memory.append("a.txt", b", two")?;
//! assert_eq!(memory.read("a.txt", 100)?, b"one, two");
//! # Ok::<(), truedepth::files::Error>(())
//! ```
//!
//! Not here: what the bytes mean.

mod archive;
#[cfg(feature = "fs")]
mod atomic;
mod error;
#[cfg(feature = "fs")]
mod folder;
mod limits;
mod memory;
#[cfg(feature = "fs")]
mod paths;
mod zip_output;

pub use archive::Archive;
#[cfg(feature = "fs")]
pub use atomic::AtomicFolder;
pub use error::Error;
#[cfg(feature = "fs")]
pub use folder::{Folder, NewFolder};
pub use limits::Limits;
pub use memory::Memory;
#[cfg(feature = "fs")]
pub use paths::Paths;
pub use zip_output::ZipOutput;

use std::io::{self, Read, Write};

/// Named files that can be read, from several threads at once.
pub trait Files: Send + Sync {
    /// Where the files are, for people: a path, a URL.
    fn place(&self) -> &str;

    /// The names of all files, relative to the place, with `/` between folders.
    fn names(&self) -> &[String];

    /// The whole content of a file; [`Error::Limit`] where it is longer than `max_bytes`.
    fn read(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error>;

    /// A file from its beginning on, for what need not lie in memory as a whole; bounded like [`read`](Self::read).
    fn open(&self, name: &str, max_bytes: u64) -> Result<Box<dyn Read + '_>, Error> {
        Ok(Box::new(io::Cursor::new(self.read(name, max_bytes)?)))
    }
}

/// Where named files are written to.
pub trait Output {
    /// Begins a file, to be written piece by piece; one of that name is replaced.
    fn create(&mut self, name: &str) -> Result<Box<dyn Write + '_>, Error>;

    /// Adds to the end of a file, which is made where it is not there yet.
    fn append(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error>;

    /// Writes a whole file.
    fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let mut file = self.create(name)?;
        file.write_all(bytes).and_then(|()| file.flush()).map_err(|e| Error::io(name, &e))
    }
}

impl<O: Output + ?Sized> Output for &mut O {
    fn create(&mut self, name: &str) -> Result<Box<dyn Write + '_>, Error> {
        (**self).create(name)
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        (**self).append(name, bytes)
    }
}

/// Copies a file into an output under its name, piece by piece.
pub fn copy(reader: impl Read, output: &mut dyn Output, name: &str) -> Result<(), Error> {
    let mut file = output.create(name)?;
    each_piece(name, reader, &mut |bytes| file.write_all(bytes).map_err(|e| Error::io(name, &e)))?;
    file.flush().map_err(|e| Error::io(name, &e))
}

/// Hands a file that is called `file` in messages to `take`, piece by piece.
pub fn each_piece(
    file: &str,
    mut reader: impl Read,
    take: &mut dyn FnMut(&[u8]) -> Result<(), Error>,
) -> Result<(), Error> {
    let mut buffer = vec![0; 1 << 16];
    loop {
        match reader.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(n) => take(&buffer[..n])?,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(Error::io(file, &error)),
        }
    }
}

/// Folder and file name with a `/` between them, where there is a folder.
pub(crate) fn join(folder: &str, name: &str) -> String {
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
}

fn too_long(file: String, max_bytes: u64) -> Error {
    Error::Limit { file, what: format!("longer than the limit of {max_bytes} bytes for one file") }
}

/// The files in a folder or zip archive; `None` for a path that is neither.
#[cfg(feature = "fs")]
pub fn open(
    path: &std::path::Path,
    limits: &Limits,
) -> Result<Option<std::sync::Arc<dyn Files>>, Error> {
    use std::sync::Arc;

    let fail = |error: io::Error| Error::io(&path.display().to_string(), &error);
    let metadata = std::fs::metadata(path).map_err(fail)?;
    if metadata.is_dir() {
        return Ok(Some(Arc::new(Folder::open(path, limits)?)));
    }
    if metadata.is_file() && is_zip(path).map_err(fail)? {
        return Ok(Some(Arc::new(Archive::open(path, limits)?)));
    }
    Ok(None)
}

/// Whether a file begins as zip archives do: with their first file, or with their end where they have none.
#[cfg(feature = "fs")]
fn is_zip(path: &std::path::Path) -> io::Result<bool> {
    let mut start = Vec::new();
    std::fs::File::open(path)?.take(4).read_to_end(&mut start)?;
    Ok(start == *b"PK\x03\x04" || start == *b"PK\x05\x06")
}
