//! A folder that comes to be as a whole or not at all.

use std::{
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
};

use super::{
    Error, Output,
    folder::{append, create, file_error, not_empty, place_in},
};

/// A folder written under another name beside its place, and renamed when it is whole.
///
/// If the process is killed on the way, a hidden folder `.NAME.0.partial` stays, never half a folder NAME; the next
/// `AtomicFolder` of the same name removes it. Dropped without [`commit`](Self::commit), it leaves nothing.
#[derive(Debug)]
pub struct AtomicFolder {
    target: PathBuf,
    partial: PathBuf,
    /// Held as long as this process is at work: a partial folder whose lock is free is nobody's.
    lock: Option<File>,
}

const LOCK: &str = ".lock";
const PARTIAL: &str = ".partial";

impl AtomicFolder {
    /// A folder to be, at `target`. Refused where that is there already, unless it is an empty folder.
    pub fn create(target: &Path) -> Result<Self, Error> {
        let fail = |why: &str| Error::File { file: target.display().to_string(), why: why.into() };
        let name = target
            .file_name()
            .and_then(|name| name.to_str())
            .ok_or_else(|| fail("names no folder; name a new one"))?;
        refuse_unless_free(target)?;
        let parent = match target.parent() {
            Some(parent) if parent != Path::new("") => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        fs::create_dir_all(&parent).map_err(|e| file_error(&parent, &e))?;
        remove_leftovers(&parent, name);
        // Whoever is at work on the same name has a number of its own.
        let partial = (0..1000)
            .map(|n| parent.join(format!(".{name}.{n}{PARTIAL}")))
            .find_map(|partial| match fs::create_dir(&partial) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => None,
                Err(e) => Some(Err(file_error(&partial, &e))),
                Ok(()) => Some(Ok(partial)),
            })
            .unwrap_or_else(|| Err(fail("too many runs are writing it; wait for them")))?;
        let mut folder = Self { target: target.to_owned(), partial, lock: None };
        let lock = folder.partial.join(LOCK);
        let file = File::create_new(&lock).map_err(|e| file_error(&lock, &e))?;
        // Where the file system knows no locks, leftovers stay.
        let _ = file.try_lock();
        folder.lock = Some(file);
        Ok(folder)
    }

    /// Brings everything to the disk and gives the folder its name.
    pub fn commit(mut self) -> Result<(), Error> {
        sync_all(&self.partial)?;
        refuse_unless_free(&self.target)?;
        if cfg!(windows) && self.target.exists() {
            fs::remove_dir(&self.target).map_err(|e| file_error(&self.target, &e))?;
        }
        fs::rename(&self.partial, &self.target).map_err(|e| file_error(&self.target, &e))?;
        // The lock goes last, so that a folder without one is never at work; hidden, it does no harm if it stays.
        self.lock = None;
        let _ = fs::remove_file(self.target.join(LOCK));
        if let Some(parent) = self.partial.parent() {
            // The name is there; that it is on the disk as well is beyond what some file systems promise.
            let _ = sync_folder(parent);
        }
        Ok(())
    }
}

impl AtomicFolder {
    /// Where a file of this name goes.
    fn place(&self, name: &str) -> Result<PathBuf, Error> {
        place_in(&self.partial, if name == LOCK { "" } else { name })
    }
}

impl Output for AtomicFolder {
    fn create(&mut self, name: &str) -> Result<Box<dyn Write + '_>, Error> {
        create(&self.place(name)?)
    }

    fn append(&mut self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        append(&self.place(name)?, bytes)
    }
}

/// Brings a folder and all in it to the disk. They are listed instead of remembered: there may be many.
fn sync_all(folder: &Path) -> Result<(), Error> {
    let fail = |e| file_error(folder, &e);
    for entry in fs::read_dir(folder).map_err(fail)? {
        let entry = entry.map_err(fail)?;
        let path = entry.path();
        if entry.file_type().map_err(fail)?.is_dir() {
            sync_all(&path)?;
        } else {
            // Writing has begun long ago; this waits for the rest of it.
            File::open(&path)
                .and_then(|file| file.sync_all())
                .map_err(|e| file_error(&path, &e))?;
        }
    }
    sync_folder(folder).map_err(fail)
}

impl Drop for AtomicFolder {
    fn drop(&mut self) {
        if self.lock.take().is_some() {
            // After an error; what cannot be removed now, the next run removes.
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

fn refuse_unless_free(target: &Path) -> Result<(), Error> {
    match fs::symlink_metadata(target) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(e) => Err(file_error(target, &e)),
        Ok(there) if !there.is_dir() => Err(Error::Taken {
            file: target.display().to_string(),
            why: "it is there already; name a new folder".to_owned(),
        }),
        Ok(_) => {
            let mut entries = fs::read_dir(target).map_err(|e| file_error(target, &e))?;
            match entries.next() {
                None => Ok(()),
                Some(_) => Err(not_empty(target)),
            }
        }
    }
}

/// Removes what killed runs have left of a folder of this name.
fn remove_leftovers(parent: &Path, name: &str) {
    let Ok(entries) = fs::read_dir(parent) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let number = path
            .file_name()
            .and_then(|file| file.to_str())
            .and_then(|file| file.strip_prefix('.')?.strip_prefix(name))
            .and_then(|rest| rest.strip_prefix('.')?.strip_suffix(PARTIAL));
        if !number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit())) {
            continue;
        }
        let _ = match File::open(path.join(LOCK)) {
            Ok(lock) if lock.try_lock().is_ok() => fs::remove_dir_all(&path),
            Ok(_) => Ok(()),
            // Killed between making the folder and its lock, or while removing somebody's leftovers.
            Err(_) => fs::remove_dir_all(&path),
        };
    }
}

#[cfg(unix)]
fn sync_folder(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}
