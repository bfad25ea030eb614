//! PNG bytes to images and back.

use super::{DepthMap, Gray, Rgb};

/// What an untrusted image may ask for.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Pixels at most; a header that asks for more is refused before anything is allocated.
    pub pixels: u64,
}

impl Default for Limits {
    /// 200 million pixels, about twice the largest camera sensor in a phone.
    fn default() -> Self {
        Self { pixels: 200_000_000 }
    }
}

/// An image that cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The bytes end early, fail a checksum or break the format.
    #[error("damaged or truncated PNG: {0}")]
    Damaged(String),
    /// A kind of image that is not used here.
    #[error("{0}")]
    Unsupported(String),
    /// More pixels than the limits allow.
    #[error("{width}x{height} pixels are more than the limit of {limit}")]
    Limits {
        /// Columns the header asks for.
        width: u64,
        /// Rows the header asks for.
        height: u64,
        /// Pixels allowed.
        limit: u64,
    },
}

impl Gray {
    /// Decodes an 8- or 16-bit PNG of any colour type to grey.
    pub fn from_png(_bytes: &[u8], _limits: &Limits) -> Result<Self, Error> {
        Err(Error::Unsupported("skeleton".into()))
    }
    /// Encodes as PNG.
    pub fn to_png(&self) -> Vec<u8> {
        Vec::new()
    }
}

impl Rgb {
    /// Decodes an 8- or 16-bit PNG of any colour type; alpha is dropped.
    pub fn from_png(_bytes: &[u8], _limits: &Limits) -> Result<Self, Error> {
        Err(Error::Unsupported("skeleton".into()))
    }
    /// Encodes as PNG.
    pub fn to_png(&self) -> Vec<u8> {
        Vec::new()
    }
}

impl DepthMap {
    /// Decodes a 16-bit grey PNG whose values count `unit_m` metres; 0 becomes NaN.
    pub fn from_png(_bytes: &[u8], _unit_m: f64, _limits: &Limits) -> Result<Self, Error> {
        Err(Error::Unsupported("skeleton".into()))
    }
    /// Encodes as a 16-bit grey PNG in units of `unit_m` metres, NaN as 0, rounded to nearest, capped at 65535.
    pub fn to_png(&self, _unit_m: f64) -> Vec<u8> {
        Vec::new()
    }
}
