//! The formats that recordings are read from: one file or folder each, one line in [`FORMATS`].

mod images;
mod zeiss;

pub use images::OVERLAY_ENDING;
pub(super) use images::open as open_images;
pub use zeiss::{Writer, encode_depth, factories_in_metadata};

use std::{io::Read, sync::Arc};

use super::{Error, Factory, Frame, Images, Problem};
use crate::{
    board::CharucoBoard,
    files::{self, Files, Limits},
    image,
};

/// A way in which recordings are stored.
pub struct Format {
    /// `zeiss`, `images`: for machines.
    pub name: &'static str,
    /// What people call it.
    pub title: &'static str,
    /// Whether it holds depth; without it there is nothing to audit.
    pub has_depth: bool,
    /// Whether a file of this name (with the folders above it inside a folder or archive) makes the folder it lies in
    /// a recording of this format.
    pub(super) recognises: fn(&str) -> bool,
    /// Reads what is there, but no image.
    pub(super) open: fn(&Contents) -> Result<Opened, Error>,
}

/// In the order in which they are tried: the first that recognises anything in a folder or archive is taken for all of
/// it.
pub const FORMATS: &[Format] = &[zeiss::FORMAT, images::FORMAT];

/// What a format makes of the files of a recording.
pub(super) struct Opened {
    pub(super) board: Option<CharucoBoard>,
    /// In order of time.
    pub(super) frames: Vec<Frame>,
    pub(super) problems: Vec<Problem>,
    /// The first factory metadata of the file, for recordings none of whose frames has its own.
    pub(super) fallback: Option<Arc<Factory>>,
    pub(super) images: Arc<dyn Images>,
}

/// The files of one recording: those in one folder of a folder or archive, and in the folders inside it.
#[derive(Clone)]
pub(super) struct Contents {
    files: Arc<dyn Files>,
    /// The folder with a `/` behind it, or nothing.
    prefix: String,
    place: String,
    limits: Limits,
}

impl Contents {
    pub(super) fn new(files: Arc<dyn Files>, folder: &str, limits: &Limits) -> Self {
        let place = files::join(files.place(), folder).trim_end_matches('/').to_owned();
        let prefix = if folder.is_empty() { String::new() } else { format!("{folder}/") };
        Self { files, prefix, place, limits: limits.clone() }
    }

    /// Where it is: the path of the folder or archive, and the folder inside.
    pub(super) fn place(&self) -> &str {
        &self.place
    }

    /// A file of the recording, for messages.
    pub(super) fn path(&self, name: &str) -> String {
        files::join(&self.place, name)
    }

    /// The names of all files, folders inside included.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.files.names().iter().filter_map(|name| name.strip_prefix(self.prefix.as_str()))
    }

    /// The names of the files that lie in no folder inside.
    pub(super) fn names_here(&self) -> Vec<&str> {
        self.names().filter(|name| !name.contains('/')).collect()
    }

    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        Ok(self.files.read(&format!("{}{name}", self.prefix), self.limits.file_bytes)?)
    }

    pub(super) fn open(&self, name: &str) -> Result<Box<dyn Read + '_>, Error> {
        Ok(self.files.open(&format!("{}{name}", self.prefix), self.limits.file_bytes)?)
    }

    /// An image, by one of the decoders of `image`.
    pub(super) fn decode<T>(
        &self,
        name: &str,
        decode: impl Fn(&[u8], &image::Limits) -> Result<T, image::Error>,
    ) -> Result<T, Error> {
        decode(&self.read(name)?, &self.limits.image)
            .map_err(|source| Error::Image { file: self.path(name), source })
    }
}
