//! Which recordings a folder or an archive holds.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    sync::Arc,
};

use super::{Error, Limits, Recording, Source, source::join, zeiss};

/// A recording that has been found, but not read yet.
#[derive(Clone)]
pub struct Found {
    /// Name of its folder or archive, for people.
    pub name: String,
    source: Arc<dyn Source>,
    folder: String,
    limits: Limits,
}

impl Found {
    /// Reads the metadata; images wait until they are asked for.
    pub fn open(self) -> Result<Recording, Error> {
        zeiss::open(self.source, &self.folder, self.name, &self.limits)
    }

    /// Where it is: the path of the folder or archive, and the folder inside.
    pub fn place(&self) -> String {
        join(self.source.place(), &self.folder)
    }
}

impl fmt::Debug for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Found").field("name", &self.name).field("place", &self.place()).finish()
    }
}

/// All recordings in a folder (up to four folders deep) or zip archive, by name. At least one, else
/// [`Error::NotARecording`].
#[cfg(feature = "fs")]
pub fn discover(path: &std::path::Path, limits: &Limits) -> Result<Vec<Found>, Error> {
    use std::io::Read;

    let fail = |error| super::folder::file_error(path, &error);
    let metadata = std::fs::metadata(path).map_err(fail)?;
    if metadata.is_dir() {
        return discover_in(Arc::new(super::Folder::open(path, limits)?), limits);
    }
    let not_a_recording =
        |found: String| Err(Error::NotARecording { path: path.display().to_string(), found });
    if !metadata.is_file() {
        return not_a_recording("neither a file nor a folder".into());
    }
    let mut start = Vec::new();
    std::fs::File::open(path).map_err(fail)?.take(4).read_to_end(&mut start).map_err(fail)?;
    // A zip starts with its first file, or with its end where it has none.
    if start != *b"PK\x03\x04" && start != *b"PK\x05\x06" {
        return not_a_recording("a file that is no zip archive".into());
    }
    discover_in(Arc::new(super::Archive::open(path, limits)?), limits)
}

/// As [`discover`], also inside the zip archives of a folder, as published data are packed; the archives after the
/// folders, by name. None is no error here, but a path that cannot be read is.
#[cfg(feature = "fs")]
pub fn discover_nested(path: &std::path::Path, limits: &Limits) -> Result<Vec<Found>, Error> {
    let or_none = |found| match found {
        Err(Error::NotARecording { .. }) => Ok(Vec::new()),
        other => other,
    };
    if !path.is_dir() {
        return discover(path, limits);
    }
    let mut found = or_none(discover(path, limits))?;
    let folder = super::Folder::open(path, limits)?;
    for name in folder.names() {
        if name.to_ascii_lowercase().ends_with(".zip") {
            found.extend(or_none(discover(&path.join(name), limits))?);
        }
    }
    Ok(found)
}

/// All recordings among the files of a source, by name. At least one, else [`Error::NotARecording`].
///
/// A folder that is a recording itself is one: folders further inside are not looked at.
pub fn discover_in(source: Arc<dyn Source>, limits: &Limits) -> Result<Vec<Found>, Error> {
    let names = source.names();
    if names.len() > limits.files {
        let what = format!("{} files are more than the limit of {}", names.len(), limits.files);
        return Err(Error::Limit { file: source.place().to_owned(), what });
    }
    let mut folders = BTreeSet::new();
    for name in names {
        let (folder, file) = name.rsplit_once('/').unwrap_or(("", name));
        if zeiss::is_telltale(file) {
            folders.insert(folder);
        }
    }
    let outermost = |folder: &str| {
        !folder.is_empty()
            && (folders.contains("")
                || folder.match_indices('/').any(|(at, _)| folders.contains(&folder[..at])))
    };
    let found: Vec<Found> = folders
        .iter()
        .filter(|folder| !outermost(folder))
        .map(|&folder| Found {
            name: name_of(source.place(), folder),
            source: Arc::clone(&source),
            folder: folder.to_owned(),
            limits: limits.clone(),
        })
        .collect();
    if found.is_empty() {
        let path = source.place().to_owned();
        return Err(Error::NotARecording { path, found: describe(names) });
    }
    Ok(found)
}

/// The single recording of a source.
pub(super) fn only(source_place: &str, mut found: Vec<Found>) -> Result<Found, Error> {
    match (found.pop(), found.is_empty()) {
        (Some(only), true) => Ok(only),
        (last, _) => {
            let names = found.into_iter().chain(last).map(|found| found.folder).collect();
            Err(Error::Several { path: source_place.to_owned(), names })
        }
    }
}

/// The last part of the path, without `.zip`.
fn name_of(place: &str, folder: &str) -> String {
    let last = |path: &str| -> Option<String> {
        let part = path.rsplit(['/', '\\']).find(|part| !part.is_empty() && *part != ".")?;
        Some(part.to_owned())
    };
    if let Some(name) = last(folder) {
        return name;
    }
    let name = last(place).unwrap_or_else(|| "recording".to_owned());
    match name.len().checked_sub(4).filter(|&at| name.is_char_boundary(at)) {
        Some(at) if name[at..].eq_ignore_ascii_case(".zip") => name[..at].to_owned(),
        _ => name,
    }
}

/// What is there, for the message that it is no recording.
fn describe(names: &[String]) -> String {
    if names.is_empty() {
        return "nothing at all".into();
    }
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    for name in names {
        let file = name.rsplit('/').next().unwrap_or(name);
        let kind = file.rsplit_once('.').map_or("no extension", |(_, extension)| extension);
        *kinds.entry(kind.chars().filter(|c| !c.is_control()).take(12).collect()).or_default() += 1;
    }
    let mut kinds: Vec<(usize, String)> = kinds.into_iter().map(|(kind, n)| (n, kind)).collect();
    kinds.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    let list: Vec<String> = kinds.iter().take(4).map(|(n, kind)| format!("{n} {kind}")).collect();
    format!("{} files ({})", names.len(), list.join(", "))
}
