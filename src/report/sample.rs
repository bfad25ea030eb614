//! A small audit for the tests of this room, and pictures of it.

pub(super) use crate::audit::sample::{assert_golden, audit, recording, rich_audit};
use crate::{
    image::{DepthMap, Rgb},
    report::{Closeup, Photo, PhotoSize, Pictures},
};

/// Grey pictures, and a depth map.
pub(super) fn pictures() -> Pictures {
    let pixels = (0..64 * 48).map(|i| [(i % 64 * 4) as u8; 3]).collect();
    let image = Rgb::new(64, 48, pixels);
    let photo =
        |frame| Photo { size_px: (640, 480), ..Photo::new(frame, &image, PhotoSize::Large) };
    let map =
        DepthMap::new(640, 480, (0..640 * 480).map(|i| 0.2 + 1e-4 * (i % 640) as f32).collect());
    Pictures { photos: [0, 7].map(photo).to_vec(), closeups: vec![Closeup::new(7, &map)] }
}
