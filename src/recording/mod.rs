//! Recordings as the capture apps write them: frames paired by time, factory metadata, limits.
//!
//! A [`Source`] hands over named files: a [`Folder`], a zip [`Archive`], or [`Memory`]. [`discover`] tells which
//! recordings are in it, and [`Recording`] is one of them: its [`Frame`]s in order of time, each with the names of
//! its images and its [`Factory`] metadata; what is odd but not fatal is listed as a [`Problem`]. Images are decoded
//! when they are asked for, on as many threads as ask. A [`Writer`] puts frames into a [`Sink`] in the same format.
//!
//! Everything read is untrusted: names are checked, lengths and sizes are bounded by [`Limits`], and what does not
//! fit is an [`Error`] with file, place and remedy. Lengths are metres and angles radians, whatever the files say;
//! pixels are those of the depth map.
//!
//! ```
//! # use std::sync::Arc;
//! # use truedepth::{camera::Intrinsics, image::{DepthMap, Rgb}};
//! use truedepth::recording::{Factory, Limits, Memory, Recording, Writer};
//!
//! # let intrinsics = Intrinsics { fx: 9.0, fy: 9.0, cx: 3.5, cy: 2.5, width: 8, height: 6 };
//! # let factory = Factory::pinhole(intrinsics);
//! # let (color, depth) = (Rgb::new(8, 6, vec![[7; 3]; 48]), DepthMap::new(8, 6, vec![0.25; 48]));
//! let mut writer = Writer::new(Memory::new("example"));
//! writer.frame(500, &color, &depth, &factory)?;
//! let recording = Recording::from_source(Arc::new(writer.finish()?), &Limits::default())?;
//! assert_eq!(recording.frames.len(), 1);
//! assert_eq!(recording.depth(0)?.at(3, 3), 0.25);
//! # Ok::<(), truedepth::recording::Error>(())
//! ```
//!
//! What can be wrong with a recording is a [`Defect`].
//!
//! Not here: what the images show, whether the metadata are true.

mod archive;
mod board_file;
mod defect;
mod discover;
mod error;
#[cfg(feature = "fs")]
mod folder;
mod frame;
mod json;
mod limits;
mod metadata;
mod pairing;
mod problem;
mod rewrite;
mod source;
#[cfg(test)]
mod tests;
#[cfg(feature = "fs")]
mod whole;
mod write;
mod zeiss;

pub use archive::Archive;
pub use board_file::{board_from_toml, board_to_toml};
pub use defect::{Defect, DefectError, StreamState};
pub use discover::{Found, discover_in};
#[cfg(feature = "fs")]
pub use discover::{discover, discover_nested};
pub use error::Error;
#[cfg(feature = "fs")]
pub use folder::{Folder, FolderSink};
pub use frame::{Factory, Frame};
pub use limits::Limits;
pub use problem::Problem;
pub use rewrite::Amendment;
pub use source::{Memory, Source};
#[cfg(feature = "fs")]
pub use whole::WholeFolder;
pub use write::{Fill, Push, Sink, Writer, encode_depth};
pub use zeiss::factories_in_metadata;

use std::{
    fmt,
    io::{self, Read},
    sync::Arc,
};

use crate::{
    board::CharucoBoard,
    image::{self, DepthMap, Gray, Rgb},
};

/// A recording: frames in order of time, what the files say about the camera, and what was odd in the files.
/// Images are decoded only when asked for, so that memory does not grow with the number of frames.
pub struct Recording {
    /// Name of the folder or archive, for people.
    pub name: String,
    /// The board, where the recording tells it.
    pub board: Option<CharucoBoard>,
    /// Frames in order of time: every time at which there is an image.
    pub frames: Vec<Frame>,
    /// What is odd, but not fatal.
    pub problems: Vec<Problem>,
    /// The first metadata of the file, for recordings none of whose frames has its own.
    fallback: Option<Arc<Factory>>,
    place: String,
    prefix: String,
    source: Arc<dyn Source>,
    limits: Limits,
}

impl Recording {
    /// Opens the one recording in a folder or zip archive. Several are an error that names them: see [`discover`].
    #[cfg(feature = "fs")]
    pub fn open(path: impl AsRef<std::path::Path>, limits: &Limits) -> Result<Self, Error> {
        let path = path.as_ref();
        discover::only(&path.display().to_string(), discover(path, limits)?)?.open()
    }

    /// Opens the one recording among the files of a source.
    pub fn from_source(source: Arc<dyn Source>, limits: &Limits) -> Result<Self, Error> {
        let place = source.place().to_owned();
        discover::only(&place, discover_in(source, limits)?)?.open()
    }

    /// Where it is: the path of the folder or archive, and the folder inside.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// The factory metadata that stand for the whole recording: those of the first frame that has any, else the
    /// first of the file. Where they differ between frames `problems` says so.
    pub fn factory(&self) -> Option<&Factory> {
        self.frames.iter().find_map(|frame| frame.factory.as_deref()).or(self.fallback.as_deref())
    }

    /// The colour image of a frame, as grey.
    pub fn gray(&self, frame: usize) -> Result<Gray, Error> {
        let gray = self.color(frame, Gray::from_png)?;
        self.check_color(frame, [gray.width(), gray.height()])?;
        Ok(gray)
    }

    /// The colour image of a frame.
    pub fn rgb(&self, frame: usize) -> Result<Rgb, Error> {
        let rgb = self.color(frame, Rgb::from_png)?;
        self.check_color(frame, [rgb.width(), rgb.height()])?;
        Ok(rgb)
    }

    /// The depth map of a frame.
    pub fn depth(&self, frame: usize) -> Result<DepthMap, Error> {
        let name = self.image(frame, "depth image", |frame| frame.depth.as_deref())?;
        let bytes = self.file(name)?;
        let depth = DepthMap::from_png(&bytes, zeiss::DEPTH_UNIT_M, &self.limits.image)
            .map_err(|source| Error::Image { file: self.path(name), source })?;
        let expected = self.frames[frame].factory.as_deref().map(Factory::size);
        let size = [depth.width(), depth.height()];
        self.check_size(frame, name, size, zeiss::DEPTH_METADATA, expected)?;
        Ok(depth)
    }

    /// The bytes of any file of the recording, like those that [`Frame::color`] and [`Frame::depth`] name.
    pub fn file(&self, name: &str) -> Result<Vec<u8>, Error> {
        self.source.read(&format!("{}{name}", self.prefix), self.limits.file_bytes)
    }

    /// Hands a file over piece by piece, for what need not lie in memory as a whole.
    pub fn pieces(&self, name: &str, push: &mut Push<'_>) -> Result<(), Error> {
        let mut file = self.open_file(name)?;
        let mut buffer = vec![0; 1 << 16];
        loop {
            match file.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(n) => push(&buffer[..n])?,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => {
                    return Err(Error::File { file: self.path(name), why: error.to_string() });
                }
            }
        }
    }

    fn open_file(&self, name: &str) -> Result<Box<dyn Read + '_>, Error> {
        self.source.open(&format!("{}{name}", self.prefix), self.limits.file_bytes)
    }

    /// The frame of a time as the files write it.
    pub fn frame_at(&self, timestamp: i64) -> Option<&Frame> {
        let index = self.frames.binary_search_by_key(&timestamp, |frame| frame.timestamp).ok()?;
        Some(&self.frames[index])
    }

    /// The names of all files of the recording, folders inside included, in order.
    pub fn file_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self
            .source
            .names()
            .iter()
            .filter_map(|name| name.strip_prefix(self.prefix.as_str()))
            .collect();
        names.sort_unstable();
        names
    }

    /// Whether a file is named like an image of a frame, and so would count as one if it could.
    pub fn is_image_name(&self, name: &str) -> bool {
        pairing::parse_name(name).is_some()
    }

    fn color<T>(
        &self,
        frame: usize,
        decode: impl Fn(&[u8], &image::Limits) -> Result<T, image::Error>,
    ) -> Result<T, Error> {
        let name = self.image(frame, "colour image", |frame| frame.color.as_deref())?;
        let bytes = self.file(name)?;
        decode(&bytes, &self.limits.image)
            .map_err(|source| Error::Image { file: self.path(name), source })
    }

    fn image(
        &self,
        frame: usize,
        what: &'static str,
        name: impl Fn(&Frame) -> Option<&str>,
    ) -> Result<&str, Error> {
        self.frames.get(frame).and_then(name).ok_or_else(|| Error::Absent {
            path: self.place.clone(),
            what,
            frame,
        })
    }

    /// The colour image must have the size that its own metadata say, and that of the depth map: the intrinsics
    /// hold for no other.
    fn check_color(&self, frame: usize, size: [usize; 2]) -> Result<(), Error> {
        let Frame { color, color_size, factory, .. } = &self.frames[frame];
        let name = color.as_deref().unwrap_or_default();
        self.check_size(frame, name, size, zeiss::CAMERA_METADATA, *color_size)?;
        self.check_size(
            frame,
            name,
            size,
            zeiss::DEPTH_METADATA,
            factory.as_deref().map(Factory::size),
        )
    }

    fn check_size(
        &self,
        frame: usize,
        name: &str,
        size: [usize; 2],
        said_by: &str,
        expected: Option<[usize; 2]>,
    ) -> Result<(), Error> {
        match expected {
            Some(expected) if expected != size => Err(Error::ImageSize {
                file: self.path(name),
                size,
                said_by: said_by.to_owned(),
                expected,
                timestamp: self.frames[frame].timestamp,
            }),
            _ => Ok(()),
        }
    }

    /// A file of the recording, for messages.
    fn path(&self, name: &str) -> String {
        source::join(&self.place, name)
    }
}

impl fmt::Debug for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recording")
            .field("place", &self.place)
            .field("board", &self.board)
            .field("frames", &self.frames.len())
            .field("problems", &self.problems)
            .finish_non_exhaustive()
    }
}
