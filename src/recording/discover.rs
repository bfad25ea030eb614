//! Which recordings a folder or an archive holds.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    sync::Arc,
};

use super::{
    Error, Recording,
    format::{Contents, FORMATS, Format},
};
use crate::files::{Files, Limits, join};

/// A recording that has been found, but not read yet.
#[derive(Clone)]
pub struct Found {
    /// Name of its folder or archive, for people.
    pub name: String,
    /// How it is stored.
    pub format: &'static Format,
    files: Arc<dyn Files>,
    folder: String,
    limits: Limits,
}

impl Found {
    /// Reads the metadata; images wait until they are asked for.
    pub fn open(self) -> Result<Recording, Error> {
        let contents = Contents::new(self.files, &self.folder, &self.limits);
        let opened = (self.format.open)(&contents)?;
        Ok(Recording::of(self.name, self.format.name, contents, opened))
    }

    /// Where it is: the path of the folder or archive, and the folder inside.
    pub fn place(&self) -> String {
        join(self.files.place(), &self.folder)
    }
}

impl fmt::Debug for Found {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, format, .. } = self;
        let mut text = f.debug_struct("Found");
        text.field("name", name)
            .field("format", &format.name)
            .field("place", &self.place())
            .finish()
    }
}

/// All recordings in a folder (up to four folders deep) or zip archive, by name. At least one, else
/// [`Error::NotARecording`].
#[cfg(feature = "fs")]
pub fn discover(path: &std::path::Path, limits: &Limits) -> Result<Vec<Found>, Error> {
    match crate::files::open(path, limits)? {
        Some(files) => discover_in(files, limits),
        None => {
            let what = if path.is_file() { "file that is no zip archive" } else { "special file" };
            let path = path.display().to_string();
            Err(Error::NotARecording { path, found: format!("a {what}") })
        }
    }
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
    let folder = crate::files::Folder::open(path, limits)?;
    for name in folder.names() {
        if name.to_ascii_lowercase().ends_with(".zip") {
            found.extend(or_none(discover(&path.join(name), limits))?);
        }
    }
    Ok(found)
}

/// All recordings among these files, by name. At least one, else [`Error::NotARecording`].
///
/// A folder that is a recording itself is one: folders further inside are not looked at.
pub fn discover_in(files: Arc<dyn Files>, limits: &Limits) -> Result<Vec<Found>, Error> {
    let names = files.names();
    if names.len() > limits.files {
        let what = format!("{} files are more than the limit of {}", names.len(), limits.files);
        let file = files.place().to_owned();
        return Err(crate::files::Error::Limit { file, what }.into());
    }
    let found = FORMATS.iter().find_map(|format| {
        let folders: BTreeSet<&str> = names
            .iter()
            .filter(|name| (format.recognises)(name))
            .map(|name| name.rsplit_once('/').map_or("", |(folder, _)| folder))
            .collect();
        (!folders.is_empty()).then_some((format, folders))
    });
    let Some((format, folders)) = found else {
        let path = files.place().to_owned();
        return Err(Error::NotARecording { path, found: describe(names) });
    };
    let is_inside_another = |folder: &str| {
        !folder.is_empty()
            && (folders.contains("")
                || folder.match_indices('/').any(|(at, _)| folders.contains(&folder[..at])))
    };
    let found = |&folder: &&str| Found {
        name: name_of(files.place(), folder),
        format,
        files: Arc::clone(&files),
        folder: folder.to_owned(),
        limits: limits.clone(),
    };
    Ok(folders.iter().filter(|folder| !is_inside_another(folder)).map(found).collect())
}

/// The single recording of a source.
pub(super) fn only(place: &str, mut found: Vec<Found>) -> Result<Found, Error> {
    match (found.pop(), found.is_empty()) {
        (Some(only), true) => Ok(only),
        (last, _) => {
            let names = found.into_iter().chain(last).map(|found| found.folder).collect();
            Err(Error::Several { path: place.to_owned(), names })
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
