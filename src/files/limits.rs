//! What untrusted files may ask for.

use crate::image;

/// Bounds on what is read, so that a hostile file costs no more than an honest one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Files in a folder or archive.
    pub files: usize,
    /// Bytes of a single file, unpacked.
    pub file_bytes: u64,
    /// Bytes of an archive, unpacked. An archive that declares more is refused when it is opened, and no file in it
    /// may unpack to more than it declares.
    pub total_bytes: u64,
    /// Size of a single image.
    pub image: image::Limits,
}

impl Default for Limits {
    /// 100 000 files of up to 64 MiB, 8 GiB in all, images as [`image::Limits`]: an hour of VGA at 10 frames per
    /// second, or a single colour image of 16 million pixels that does not compress at all.
    fn default() -> Self {
        Self {
            files: 100_000,
            file_bytes: 64 << 20,
            total_bytes: 8 << 30,
            image: image::Limits::default(),
        }
    }
}
