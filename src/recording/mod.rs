//! Recordings, whatever app wrote them: frames in order of time, factory metadata, images on demand.
//!
//! A [`Recording`] has [`Frame`]s in order of time: a colour image and a depth map each, with its [`Factory`] metadata
//! at the image's own size; what is odd but not fatal is listed as a [`Problem`]. Images are decoded when they are
//! asked for, on as many threads as ask. A recording comes from [`Files`] in one of the [`FORMATS`] ([`discover`] tells
//! which recordings a folder or archive holds), or from images in memory ([`Recording::in_memory`]). A [`Writer`] puts
//! frames into an [`Output`].
//!
//! Everything read is untrusted: names are checked, lengths and sizes are bounded by [`Limits`], and what does not
//! fit is an [`Error`] with file, place and remedy. Lengths are metres and angles radians, whatever the files say; the
//! unit in which a format stores depth stays inside that format.
//!
//! ```
//! # use std::sync::Arc;
//! # use truedepth::{camera::Intrinsics, image::{DepthMap, Rgb}};
//! use truedepth::files::{Limits, Memory};
//! use truedepth::recording::{Factory, Recording, Writer};
//!
//! # let intrinsics = Intrinsics { fx: 9.0, fy: 9.0, cx: 3.5, cy: 2.5, width: 8, height: 6 };
//! # let factory = Factory::pinhole(intrinsics);
//! # let (color, depth) = (Rgb::new(8, 6, vec![[7; 3]; 48]), DepthMap::new(8, 6, vec![0.25; 48]));
//! let mut writer = Writer::new(Memory::new("example"));
//! writer.frame(500, &color, &depth, &factory)?;
//! let recording = Recording::from_files(Arc::new(writer.finish()?), &Limits::default())?;
//! assert_eq!(recording.frames.len(), 1);
//! assert_eq!(recording.depth(0)?.at(3, 3), 0.25);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What can be wrong with a recording is a [`Defect`].
//!
//! Not here: what the images show, whether the metadata are true.

mod board_file;
mod defect;
mod discover;
mod error;
mod format;
mod frame;
mod memory;
mod problem;
#[cfg(test)]
mod tests;

pub use board_file::{board_from_toml, board_to_toml};
pub use defect::{Defect, DefectError, StreamState};
pub use discover::{Found, discover_in};
#[cfg(feature = "fs")]
pub use discover::{discover, discover_nested};
pub use error::Error;
pub use format::{FORMATS, Format, OVERLAY_ENDING, Writer, encode_depth, factories_in_metadata};
pub(crate) use frame::same_shape;
pub use frame::{Factory, Frame, FrameImage};
pub use problem::Problem;

use std::{fmt, io::Read, sync::Arc};

use format::{Contents, Opened};

use crate::{
    board::CharucoBoard,
    camera::Intrinsics,
    files::{self, Files, Limits, Output},
    image::{DepthMap, Gray, Rgb},
};

/// Where the images of a recording come from: what a format implements. Each is asked for by the index of its frame and
/// the name of its file, from any thread.
pub trait Images: Send + Sync {
    /// A colour image.
    fn color(&self, frame: usize, file: &str) -> Result<Rgb, Error>;

    /// A colour image as grey.
    fn gray(&self, frame: usize, file: &str) -> Result<Gray, Error> {
        Ok(self.color(frame, file)?.to_gray())
    }

    /// A depth map: metres, NaN where nothing was measured.
    fn depth(&self, frame: usize, file: &str) -> Result<DepthMap, Error>;

    /// What tells the size of colour images and of depth maps, for messages.
    fn metadata_files(&self) -> [&str; 2] {
        ["its metadata", "its metadata"]
    }

    /// Whether a file is named like an image of a frame, and so would count as one if it could.
    fn is_image(&self, file: &str) -> bool {
        let _ = file;
        false
    }

    /// Whether images and metadata are stored in our own layout, so that a file can be copied as it is.
    fn stores_as_ours(&self) -> bool {
        false
    }

    /// Writes the metadata files of our own layout once more, with what `edit` says of each frame by its id; what is
    /// not understood stays as it is. Formats of another layout write nothing.
    fn rewrite_metadata(
        &self,
        edit: &dyn Fn(&str) -> MetadataEdit,
        output: &mut dyn Output,
    ) -> Result<(), Error> {
        let _ = (edit, output);
        Ok(())
    }
}

/// What a frame's metadata say instead of what they said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MetadataEdit {
    /// Intrinsics at the size of the depth map.
    pub intrinsics: Option<Intrinsics>,
    /// The images are rectified now: lookup tables become zero, so that whoever applies them does no harm, and
    /// `GeometricDistortionCorrectionEnabled` becomes true.
    pub rectified: bool,
}

/// A recording: frames in order of time, what the files say about the camera, and what was odd in the files.
/// Images are decoded only when asked for, so that memory does not grow with the number of frames.
pub struct Recording {
    /// Name of the folder or archive, for people.
    pub name: String,
    /// The [`Format`] it was read from by name, or `memory`.
    pub format: &'static str,
    /// The board, where the recording tells it.
    pub board: Option<CharucoBoard>,
    /// Frames in order of time: every time at which there is an image.
    pub frames: Vec<Frame>,
    /// What is odd, but not fatal.
    pub problems: Vec<Problem>,
    /// The first metadata of the file, for recordings none of whose frames has its own.
    fallback: Option<Arc<Factory>>,
    /// `None` in memory.
    contents: Option<Contents>,
    images: Arc<dyn Images>,
}

impl Recording {
    /// Opens the one recording in a folder or zip archive. Several are an error that names them: see [`discover`].
    #[cfg(feature = "fs")]
    pub fn open(path: impl AsRef<std::path::Path>, limits: &Limits) -> Result<Self, Error> {
        let path = path.as_ref();
        discover::only(&path.display().to_string(), discover(path, limits)?)?.open()
    }

    /// Opens the one recording among these files.
    pub fn from_files(files: Arc<dyn Files>, limits: &Limits) -> Result<Self, Error> {
        let place = files.place().to_owned();
        discover::only(&place, discover_in(files, limits)?)?.open()
    }

    /// All of these files are colour images, whatever their names.
    pub fn of_images(name: &str, files: Arc<dyn Files>, limits: &Limits) -> Result<Self, Error> {
        let contents = Contents::new(files, "", limits);
        let opened = format::open_images(&contents, |_| true)?;
        Ok(Self::of(name.to_owned(), "images", contents, opened))
    }

    fn of(name: String, format: &'static str, contents: Contents, opened: Opened) -> Self {
        let Opened { board, frames, problems, fallback, images } = opened;
        let contents = Some(contents);
        Self { name, format, board, frames, problems, fallback, contents, images }
    }

    /// Where it is: the path of the folder or archive, and the folder inside; in memory, its name.
    pub fn place(&self) -> &str {
        self.contents.as_ref().map_or(&self.name, Contents::place)
    }

    /// The factory metadata that stand for the whole recording, at the size of its depth maps: those of the first frame
    /// that has any, else the first of the file. Where they differ between frames `problems` says so.
    pub fn factory(&self) -> Option<&Factory> {
        self.frames.iter().find_map(Frame::factory).or(self.fallback.as_deref())
    }

    /// The colour image of a frame, as grey.
    pub fn gray(&self, frame: usize) -> Result<Gray, Error> {
        let image = self.color_image(frame)?;
        let gray = self.images.gray(frame, &image.file)?;
        self.check_size(frame, image, [gray.width(), gray.height()], 0)?;
        Ok(gray)
    }

    /// The colour image of a frame.
    pub fn color(&self, frame: usize) -> Result<Rgb, Error> {
        let image = self.color_image(frame)?;
        let rgb = self.images.color(frame, &image.file)?;
        self.check_size(frame, image, [rgb.width(), rgb.height()], 0)?;
        Ok(rgb)
    }

    /// The depth map of a frame.
    pub fn depth(&self, frame: usize) -> Result<DepthMap, Error> {
        let image = self.frames.get(frame).and_then(|f| f.depth.as_ref());
        let image = image.ok_or_else(|| self.absent("depth image", frame))?;
        let map = self.images.depth(frame, &image.file)?;
        self.check_size(frame, image, [map.width(), map.height()], 1)?;
        Ok(map)
    }

    /// How images and metadata are stored.
    pub fn images(&self) -> &dyn Images {
        &*self.images
    }

    /// The bytes of any file of the recording, like those that [`FrameImage::file`] names.
    pub fn file(&self, name: &str) -> Result<Vec<u8>, Error> {
        self.contents(name)?.read(name)
    }

    /// A file of the recording from its beginning on, for what need not lie in memory as a whole.
    pub fn open_file(&self, name: &str) -> Result<Box<dyn Read + '_>, Error> {
        self.contents(name)?.open(name)
    }

    /// The names of all files of the recording, folders inside included, in order. None in memory.
    pub fn file_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.contents.iter().flat_map(Contents::names).collect();
        names.sort_unstable();
        names
    }

    /// Whether it was read from files; a recording in memory has none.
    pub fn has_files(&self) -> bool {
        self.contents.is_some()
    }

    fn contents(&self, name: &str) -> Result<&Contents, Error> {
        let missing = || files::Error::File {
            file: self.path(name),
            why: "a recording in memory has no files".into(),
        };
        self.contents.as_ref().ok_or_else(|| missing().into())
    }

    fn color_image(&self, frame: usize) -> Result<&FrameImage, Error> {
        let image = self.frames.get(frame).and_then(|f| f.color.as_ref());
        image.ok_or_else(|| self.absent("colour image", frame))
    }

    fn absent(&self, what: &'static str, frame: usize) -> Error {
        Error::Absent { path: self.place().to_owned(), what, frame }
    }

    /// An image must have the size that the metadata say: the intrinsics hold for no other. A colour image must have
    /// the shape of its depth map, or which depth belongs to which pixel is not known.
    fn check_size(
        &self,
        frame: usize,
        image: &FrameImage,
        size: [usize; 2],
        kind: usize,
    ) -> Result<(), Error> {
        let depth = self.frames[frame].depth.as_ref().and_then(|depth| depth.size);
        let (expected, kind) = match (image.size, depth) {
            (Some(expected), _) if expected != size => (expected, kind),
            (_, Some(depth)) if !same_shape(depth, size) => (depth, 1),
            _ => return Ok(()),
        };
        Err(Error::ImageSize {
            file: self.path(&image.file),
            size,
            said_by: self.images.metadata_files()[kind].to_owned(),
            expected,
            frame: self.frames[frame].id.clone(),
        })
    }

    /// A file of the recording, for messages.
    fn path(&self, name: &str) -> String {
        files::join(self.place(), name)
    }
}

impl fmt::Debug for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recording")
            .field("place", &self.place())
            .field("format", &self.format)
            .field("board", &self.board)
            .field("frames", &self.frames.len())
            .field("problems", &self.problems)
            .finish_non_exhaustive()
    }
}
