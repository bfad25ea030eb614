//! A folder of photos: colour images alone, in order of their names.

use std::sync::Arc;

use super::{Contents, Format, Opened};
use crate::{
    image::{DepthMap, Gray, Rgb},
    recording::{Error, Frame, FrameImage, Images},
};

/// How our own pictures of what was found end; they are no photos.
pub const OVERLAY_ENDING: &str = ".overlay.png";

pub(super) const FORMAT: Format = Format {
    name: "images",
    title: "a folder of images",
    has_depth: false,
    recognises: |path| !path.contains('/') && is_photo(path),
    open: |contents| open(contents, is_photo),
};

fn is_photo(name: &str) -> bool {
    let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
    let known = ["png", "jpg", "jpeg"].iter().any(|one| ending.eq_ignore_ascii_case(one));
    known && !name.ends_with(OVERLAY_ENDING)
}

/// Those files that are images.
pub(in crate::recording) fn open(
    contents: &Contents,
    is_photo: fn(&str) -> bool,
) -> Result<Opened, Error> {
    let frame = |name: &str| Frame {
        id: name.to_owned(),
        t_ns: 0,
        color: Some(FrameImage::named(name)),
        depth: None,
    };
    let frames = contents.names().filter(|name| is_photo(name)).map(frame).collect();
    let images = Arc::new(Photos(contents.clone()));
    Ok(Opened { board: None, frames, problems: Vec::new(), fallback: None, images })
}

struct Photos(Contents);

impl Images for Photos {
    fn color(&self, _: usize, file: &str) -> Result<Rgb, Error> {
        self.0.decode(file, Rgb::decode)
    }

    fn gray(&self, _: usize, file: &str) -> Result<Gray, Error> {
        self.0.decode(file, Gray::decode)
    }

    fn depth(&self, frame: usize, _: &str) -> Result<DepthMap, Error> {
        let path = self.0.place().to_owned();
        Err(Error::Absent { path, what: "depth image", frame })
    }
}
