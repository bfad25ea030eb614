//! Recordings of images that are in memory already.

use std::sync::Arc;

use super::{Error, Frame, FrameImage, Images, Recording};
use crate::{
    board::CharucoBoard,
    image::{DepthMap, Rgb},
};

/// Images in memory, by the index of their frame.
struct Held(Vec<(Option<Rgb>, Option<DepthMap>)>);

impl Held {
    fn absent(what: &'static str, frame: usize, file: &str) -> Error {
        Error::Absent { path: file.to_owned(), what, frame }
    }
}

impl Images for Held {
    fn color(&self, frame: usize, file: &str) -> Result<Rgb, Error> {
        let image = self.0.get(frame).and_then(|(color, _)| color.clone());
        image.ok_or_else(|| Self::absent("colour image", frame, file))
    }

    fn depth(&self, frame: usize, file: &str) -> Result<DepthMap, Error> {
        let map = self.0.get(frame).and_then(|(_, depth)| depth.clone());
        map.ok_or_else(|| Self::absent("depth image", frame, file))
    }
}

impl Recording {
    /// A recording of images that are in memory: from a camera, a file of one's own, another language.
    ///
    /// `frames` are in order of time. Which images a frame has is told by the images; where its [`Frame::color`] or
    /// [`Frame::depth`] is missing beside one, nothing is known of that image but what it shows.
    pub fn in_memory(
        name: impl Into<String>,
        board: Option<CharucoBoard>,
        frames: Vec<(Frame, Option<Rgb>, Option<DepthMap>)>,
    ) -> Self {
        let mut held = Vec::with_capacity(frames.len());
        let frames = frames
            .into_iter()
            .map(|(frame, color, depth)| {
                let of = |info: Option<FrameImage>, what: &str| {
                    info.unwrap_or_else(|| FrameImage::named(format!("{what} {}", frame.id)))
                };
                let color_info = color.is_some().then(|| of(frame.color.clone(), "colour image"));
                let depth_info = depth.is_some().then(|| of(frame.depth.clone(), "depth map"));
                held.push((color, depth));
                Frame { id: frame.id, t_ns: frame.t_ns, color: color_info, depth: depth_info }
            })
            .collect();
        Self {
            name: name.into(),
            format: "memory",
            board,
            frames,
            problems: Vec::new(),
            fallback: None,
            contents: None,
            images: Arc::new(Held(held)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{camera::Intrinsics, recording::Factory};

    #[test]
    fn each_image_has_its_own_size_and_metadata() {
        let k = Intrinsics { fx: 9.0, fy: 9.0, cx: 3.5, cy: 2.5, width: 8, height: 6 };
        let factory = Arc::new(Factory::pinhole(k));
        let large = Arc::new(factory.at_size([24, 18]).expect("the same shape"));
        assert_eq!((large.intrinsics.fx, large.intrinsics.cx), (27.0, 10.5));
        assert_eq!(factory.at_size([24, 17]), None, "another shape");
        let image = |file: &str, factory: &Arc<Factory>| {
            let size = Some(factory.size());
            Some(FrameImage { file: file.into(), size, factory: Some(Arc::clone(factory)) })
        };
        let frame = Frame {
            id: "first".into(),
            t_ns: 0,
            color: image("c", &large),
            depth: image("d", &factory),
        };
        let bare = Frame { id: "second".into(), t_ns: 1, color: None, depth: None };
        let color = || Some(Rgb::new(24, 18, vec![[1; 3]; 24 * 18]));
        let map = Some(DepthMap::new(8, 6, vec![0.5; 48]));
        let frames = vec![(frame, color(), map), (bare, color(), None)];
        let recording = Recording::in_memory("m", None, frames);
        assert_eq!(recording.color(0).expect("is there").width(), 24);
        assert_eq!(recording.gray(1).expect("is there").height(), 18);
        assert_eq!(recording.depth(0).expect("is there").at(7, 5), 0.5);
        assert_eq!(recording.factory(), Some(&*factory));
        assert!(recording.frames[1].color.is_some() && recording.frames[1].depth.is_none());
        let error = recording.depth(1).expect_err("no depth").to_string();
        assert!(error.contains("no depth image at frame 1"), "{error}");
        assert!(recording.file("x").is_err() && recording.file_names().is_empty());
        assert!(!recording.has_files());
    }
}
