//! A few of the recording's images, small enough to travel inside a page.

use jpeg_encoder::{ColorType, Encoder};

use crate::image::Rgb;

/// How large a photo is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotoSize {
    /// A drawing whose words must stay legible: as it is, up to 4000 pixels wide.
    Whole,
    /// To look at a corner: at most 800 pixels wide.
    Large,
    /// To see which frame it is and whether the board was found: at most 320 pixels wide.
    Small,
}

impl PhotoSize {
    /// Images wider than this are made smaller by a whole factor.
    const fn max_width(self) -> usize {
        match self {
            Self::Whole => 4000,
            Self::Large => 800,
            Self::Small => 320,
        }
    }
}

/// Of 100. Print edges stay clean; a 640x480 image takes some 30 kB.
const JPEG_QUALITY: u8 = 72;

/// An image of the recording as a JPEG.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Columns and rows of the recording's image; the JPEG may be smaller by a whole factor.
    pub size_px: (usize, usize),
    /// The file.
    pub jpeg: Vec<u8>,
}

impl Photo {
    /// The photo of an image. Panics where the image has no pixels.
    pub fn new(frame: usize, image: &Rgb, size: PhotoSize) -> Self {
        let small = shrunk(image, size.max_width());
        let mut jpeg = Vec::new();
        let side = |pixels: usize| {
            u16::try_from(pixels).expect("a shrunk image is at most 65535 pixels a side")
        };
        Encoder::new(&mut jpeg, JPEG_QUALITY)
            .encode(
                small.pixels().as_flattened(),
                side(small.width()),
                side(small.height()),
                ColorType::Rgb,
            )
            .expect("the number of bytes is right and writing to memory does not fail");
        Self { frame, size_px: (image.width(), image.height()), jpeg }
    }

    /// The JPEG as a `data:` address.
    pub fn data_uri(&self) -> String {
        format!("data:image/jpeg;base64,{}", base64(&self.jpeg))
    }
}

/// The image at most so wide: the mean of square blocks of pixels, incomplete blocks dropped. Values are averaged as
/// stored: for a thumbnail the difference to linear light cannot be seen.
fn shrunk(image: &Rgb, max_width: usize) -> Rgb {
    // A very tall image is made smaller by more than its width asks for, down to at least one pixel.
    let factor =
        image.width().div_ceil(max_width).max(image.height().div_ceil(4 * max_width)).max(1);
    let (width, height) = ((image.width() / factor).max(1), (image.height() / factor).max(1));
    if factor == 1 {
        return image.clone();
    }
    let mut pixels = Vec::with_capacity(width * height);
    let columns = (width * factor).min(image.width());
    // Rows of a block are added channel by channel first, which vectors do; then what lies side by side.
    let mut sums = vec![0_u32; 3 * columns];
    for y in 0..height {
        sums.fill(0);
        let rows = y * factor..((y + 1) * factor).min(image.height());
        for row in rows.clone() {
            let row = image.pixels()[row * image.width()..][..columns].as_flattened();
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += u32::from(*value));
        }
        let mean = MeanOf::new((rows.len() * factor.min(columns)) as u32);
        let (triples, _) = sums.as_chunks::<3>();
        pixels.extend(triples.chunks(factor).map(|block| {
            let mut sum = [0; 3];
            for triple in block {
                (0..3).for_each(|channel| sum[channel] += triple[channel]);
            }
            sum.map(|sum| mean.of(sum))
        }));
    }
    Rgb::new(width, height, pixels)
}

/// Divides sums of so many values by their number, rounded to nearest, without dividing.
#[derive(Clone, Copy)]
struct MeanOf {
    count: u32,
    /// ⌊2³²/count⌋ + 1: a product with it is right as long as sum·count stays below 2³².
    inverse: u64,
}

impl MeanOf {
    fn new(count: u32) -> Self {
        Self { count, inverse: (1 << 32) / u64::from(count) + 1 }
    }

    #[inline]
    fn of(self, sum: u32) -> u8 {
        let rounded = sum + self.count / 2;
        if self.count < 4096 {
            ((u64::from(rounded) * self.inverse) >> 32) as u8
        } else {
            (rounded / self.count) as u8
        }
    }
}

/// RFC 4648, section 4.
pub(super) fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let letter = |bits: u32, shift: u32| ALPHABET[(bits >> shift) as usize & 63];
    let mut text = Vec::with_capacity(bytes.len().div_ceil(3) * 4);
    let (triples, rest) = bytes.as_chunks::<3>();
    for &[a, b, c] in triples {
        let bits = u32::from_be_bytes([0, a, b, c]);
        text.extend([18, 12, 6, 0].map(|shift| letter(bits, shift)));
    }
    match *rest {
        [a] => {
            let bits = u32::from_be_bytes([0, a, 0, 0]);
            text.extend([letter(bits, 18), letter(bits, 12), b'=', b'=']);
        }
        [a, b] => {
            let bits = u32::from_be_bytes([0, a, b, 0]);
            text.extend([letter(bits, 18), letter(bits, 12), letter(bits, 6), b'=']);
        }
        _ => {}
    }
    String::from_utf8(text).expect("the alphabet is ASCII")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rfc_4648_vectors() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[255, 239, 190]), "/+++");
    }

    #[test]
    fn large_images_shrink_by_whole_factors() {
        let image =
            Rgb::new(1601, 3, (0..1601 * 3).map(|i| [(i % 1601 / 3 * 3 % 256) as u8; 3]).collect());
        let small = shrunk(&image, 534);
        assert_eq!((small.width(), small.height()), (533, 1));
        assert_eq!(small.pixels()[7], [21; 3]);
        let photo = Photo::new(4, &image, PhotoSize::Large);
        assert_eq!(photo.size_px, (1601, 3));
        assert_eq!(&photo.jpeg[..3], &[0xff, 0xd8, 0xff]);
        assert!(photo.data_uri().starts_with("data:image/jpeg;base64,/9j/"));
    }

    #[test]
    fn means_are_rounded_as_by_division() {
        for count in (1..4200).step_by(7).chain([1, 2, 4, 9, 16, 4095, 4096, 4097]) {
            let mean = MeanOf::new(count);
            for value in 0..=255 {
                for sum in [value * count, value * count + count / 2, (value * count).max(1) - 1] {
                    let sum = sum.min(255 * count);
                    assert_eq!(mean.of(sum), ((sum + count / 2) / count) as u8, "{sum}/{count}");
                }
            }
        }
    }

    #[test]
    fn extreme_shapes() {
        for (width, height) in [(1, 1), (1, 200_000), (900, 1)] {
            let photo = Photo::new(
                0,
                &Rgb::new(width, height, vec![[9; 3]; width * height]),
                PhotoSize::Small,
            );
            assert_eq!(photo.size_px, (width, height));
        }
    }
}
