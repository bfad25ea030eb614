//! PNG and JPEG bytes to images, and images to PNG.

use std::io::{Cursor, ErrorKind};

use super::{DepthMap, Gray, Rgb, extend, jpeg, rgb::luma, unfiltered};

/// What an untrusted image may ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The bytes end early, fail a checksum or break the format.
    #[error("damaged or truncated {format} ({reason}): copy the file again from where it came")]
    Damaged {
        /// `PNG` or `JPEG`.
        format: &'static str,
        /// What the decoder met.
        reason: String,
    },
    /// A kind of image that is not used here.
    #[error("{0}")]
    Unsupported(String),
    /// More pixels than the limits allow.
    #[error("{width}x{height} pixels are more than the limit of {limit} pixels")]
    Limits {
        /// Columns the header asks for.
        width: u64,
        /// Rows the header asks for.
        height: u64,
        /// Pixels allowed.
        limit: u64,
    },
}

/// What the first bytes of a file say it is.
enum Format {
    Png,
    Jpeg,
}

impl Format {
    fn of(bytes: &[u8]) -> Result<Self, Error> {
        if bytes.starts_with(b"\x89PNG") {
            return Ok(Self::Png);
        }
        if bytes.starts_with(b"\xff\xd8") {
            return Ok(Self::Jpeg);
        }
        let after = |n: usize| bytes.get(n..).unwrap_or_default();
        let brand = after(4).strip_prefix(b"ftyp").and_then(|rest| rest.get(..4));
        let found = match (bytes, brand) {
            (b"", _) => {
                let message = "the file is empty: copy it again from where it came";
                return Err(Error::Unsupported(message.into()));
            }
            (_, Some(b"heic" | b"heix" | b"heim" | b"heis" | b"hevc" | b"mif1" | b"msf1")) => {
                "a HEIC image"
            }
            (_, Some(b"avif" | b"avis")) => "an AVIF image",
            (_, Some(_)) => "a video",
            ([b'B', b'M', ..], _) => "a BMP image",
            ([b'G', b'I', b'F', b'8', ..], _) => "a GIF image",
            ([b'I', b'I', b'*' | b'+', 0, ..] | [b'M', b'M', 0, b'*' | b'+', ..], _) => {
                "a TIFF or raw image"
            }
            ([b'P', b'1'..=b'7', b'\n' | b' ' | b'\r', ..], _) => "a PNM image",
            ([b'%', b'P', b'D', b'F', ..], _) => "a PDF",
            ([b'P', b'K', 3 | 5, ..], _) => "a zip archive",
            ([0xff, 0x0a, ..] | [0, 0, 0, 12, b'J', b'X', b'L', b' ', ..], _) => "a JPEG XL image",
            ([0, 0, 0, 12, b'j', b'P', b' ', b' ', ..] | [0xff, 0x4f, 0xff, 0x51, ..], _) => {
                "a JPEG 2000 image"
            }
            _ if bytes.starts_with(b"RIFF") && after(8).starts_with(b"WEBP") => "a WebP image",
            _ => "no image that is known here",
        };
        Err(Error::Unsupported(format!(
            "neither PNG nor JPEG but {found}: convert it to PNG, which keeps every pixel"
        )))
    }
}

impl Gray {
    /// Decodes a PNG as [`from_png`](Self::from_png) or a JPEG as [`from_jpeg`](Self::from_jpeg), whichever its first
    /// bytes say it is. Other kinds of files are [`Error::Unsupported`], with their name where it is known.
    pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Self, Error> {
        match Format::of(bytes)? {
            Format::Png => Self::from_png(bytes, limits),
            Format::Jpeg => Self::from_jpeg(bytes, limits),
        }
    }

    /// Decodes an 8-bit grey or colour JPEG, baseline or progressive. A colour image's luma channel is taken as it is
    /// stored, which differs from [`Rgb::to_gray`] of its colours by rounding and where colours were cut to 0 to 255.
    ///
    /// The orientation that EXIF data may ask for is ignored: pixels stay where the sensor has them, and so do the
    /// camera's intrinsics. JPEG has no checksums: of damage only what breaks the coding is seen.
    pub fn from_jpeg(bytes: &[u8], limits: &Limits) -> Result<Self, Error> {
        let (width, height, pixels) = jpeg::gray(bytes, limits)?;
        Ok(Self::new(width, height, pixels))
    }

    /// Decodes a PNG of any colour type and bit depth to grey: colours by their luma as [`Rgb::to_gray`], 16 bits by
    /// their higher byte, alpha dropped. Checksums are verified to the last byte.
    pub fn from_png(bytes: &[u8], limits: &Limits) -> Result<Self, Error> {
        let (width, height, pixels) =
            decode_eight_bits(bytes, limits, |channels| match channels {
                1 => |row: &[u8], out: &mut Vec<u8>| out.extend_from_slice(row),
                2 => |row: &[u8], out: &mut Vec<u8>| {
                    extend(
                        out,
                        row.as_chunks::<2>().0,
                        #[inline(always)]
                        |[gray, _]| gray,
                    );
                },
                3 => |row: &[u8], out: &mut Vec<u8>| {
                    extend(out, row.as_chunks::<3>().0, luma);
                },
                _ => |row: &[u8], out: &mut Vec<u8>| {
                    extend(
                        out,
                        row.as_chunks().0,
                        #[inline(always)]
                        |rgba| {
                            // Whole words: vectors are made of them more easily than of three bytes in four.
                            let word = u32::from_le_bytes(rgba);
                            luma([word as u8, (word >> 8) as u8, (word >> 16) as u8])
                        },
                    );
                },
            })?;
        Ok(Self::new(width, height, pixels))
    }

    /// Encodes as PNG, fast rather than small. Panics for an image without pixels, which PNG cannot hold.
    pub fn to_png(&self) -> Vec<u8> {
        let size = (self.width(), self.height());
        encode(size, png::ColorType::Grayscale, png::BitDepth::Eight, self.pixels())
    }

    /// As [`to_png`](Self::to_png), but small rather than fast, and with the scale at which it is meant to be printed,
    /// pixels per inch. PNG stores it to a whole number of pixels per metre.
    pub fn to_png_at(&self, dpi: f64) -> Vec<u8> {
        let per_metre = (dpi / 0.0254).round() as u32;
        let size = (self.width(), self.height());
        encode_with(
            size,
            png::ColorType::Grayscale,
            png::BitDepth::Eight,
            self.pixels(),
            |encoder| {
                encoder.set_compression(png::Compression::Balanced);
                encoder.set_pixel_dims(Some(png::PixelDimensions {
                    xppu: per_metre,
                    yppu: per_metre,
                    unit: png::Unit::Meter,
                }));
            },
        )
    }
}

impl Rgb {
    /// Decodes a PNG as [`from_png`](Self::from_png) or a JPEG as [`from_jpeg`](Self::from_jpeg), whichever its first
    /// bytes say it is. Other kinds of files are [`Error::Unsupported`], with their name where it is known.
    pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Self, Error> {
        match Format::of(bytes)? {
            Format::Png => Self::from_png(bytes, limits),
            Format::Jpeg => Self::from_jpeg(bytes, limits),
        }
    }

    /// Decodes an 8-bit grey or colour JPEG, baseline or progressive; grey becomes three equal channels. Orientation
    /// and damage as for [`Gray::from_jpeg`].
    pub fn from_jpeg(bytes: &[u8], limits: &Limits) -> Result<Self, Error> {
        let (width, height, pixels) = jpeg::rgb(bytes, limits)?;
        Ok(Self::new(width, height, pixels))
    }

    /// Decodes a PNG of any colour type and bit depth: grey becomes three equal channels, 16 bits their higher byte,
    /// alpha is dropped. Checksums are verified to the last byte.
    pub fn from_png(bytes: &[u8], limits: &Limits) -> Result<Self, Error> {
        let (width, height, pixels) =
            decode_eight_bits(bytes, limits, |channels| match channels {
                1 => |row: &[u8], out: &mut Vec<[u8; 3]>| {
                    extend(
                        out,
                        row,
                        #[inline(always)]
                        |gray| [gray; 3],
                    );
                },
                2 => |row: &[u8], out: &mut Vec<[u8; 3]>| {
                    extend(
                        out,
                        row.as_chunks::<2>().0,
                        #[inline(always)]
                        |[gray, _]| [gray; 3],
                    );
                },
                3 => |row: &[u8], out: &mut Vec<[u8; 3]>| {
                    out.extend_from_slice(row.as_chunks::<3>().0)
                },
                _ => |row: &[u8], out: &mut Vec<[u8; 3]>| {
                    extend(
                        out,
                        row.as_chunks::<4>().0,
                        #[inline(always)]
                        |[r, g, b, _]| [r, g, b],
                    );
                },
            })?;
        Ok(Self::new(width, height, pixels))
    }

    /// Encodes as PNG, fast rather than small. Panics for an image without pixels, which PNG cannot hold.
    pub fn to_png(&self) -> Vec<u8> {
        let size = (self.width(), self.height());
        encode(size, png::ColorType::Rgb, png::BitDepth::Eight, self.pixels().as_flattened())
    }
}

impl DepthMap {
    /// Decodes a 16-bit grey PNG whose values count `unit_m` metres; 0 becomes NaN. Fewer bits or colours are
    /// refused: such files hold a picture of depth, not depth.
    pub fn from_png(bytes: &[u8], unit_m: f64, limits: &Limits) -> Result<Self, Error> {
        let (width, height, depth_m) = decode(bytes, limits, Samples::AsStored, |color| {
            if color != png::ColorType::Grayscale {
                return Err(not_depth(&format!("{color:?}")));
            }
            Ok(Box::new(move |row: &[u8], out: &mut Vec<f32>| {
                extend(
                    out,
                    row.as_chunks::<2>().0,
                    #[inline(always)]
                    |sample| match u16::from_be_bytes(sample) {
                        0 => f32::NAN,
                        count => (f64::from(count) * unit_m) as f32,
                    },
                );
            }))
        })?;
        Ok(Self::new(width, height, depth_m))
    }

    /// Encodes as a 16-bit grey PNG in units of `unit_m` metres, NaN as 0, rounded to nearest, within 1 to 65535.
    /// Fast rather than small. Panics for a map without pixels, which PNG cannot hold.
    pub fn to_png(&self, unit_m: f64) -> Vec<u8> {
        let counts: Vec<[u8; 2]> = self
            .depth_m()
            .iter()
            .map(|&depth_m| {
                let count = (f64::from(depth_m) / unit_m).round();
                // A measurement must not turn into the sign for "none".
                if count.is_nan() { 0 } else { count.clamp(1.0, 65535.0) as u16 }.to_be_bytes()
            })
            .collect();
        let size = (self.width(), self.height());
        encode(size, png::ColorType::Grayscale, png::BitDepth::Sixteen, counts.as_flattened())
    }
}

/// Width, height and pixels of an image of any kind. `convert` tells how a row of 8-bit samples with so many channels
/// (grey, grey and alpha, RGB, RGBA) becomes pixels.
fn decode_eight_bits<T: Clone + 'static>(
    bytes: &[u8],
    limits: &Limits,
    convert: impl Fn(usize) -> fn(&[u8], &mut Vec<T>),
) -> Result<(usize, usize, Vec<T>), Error> {
    if let Some(image) = unfiltered::decode(bytes, limits.pixels, &convert) {
        return Ok(image);
    }
    // The decoder looks palettes up, so that what it hands over never is one.
    decode(bytes, limits, Samples::Eight, |color| Ok(Box::new(convert(color.samples()))))
}

/// What the rows handed to a [`Convert`] hold.
#[derive(Clone, Copy, PartialEq)]
enum Samples {
    /// 8 bits: palettes looked up, fewer bits scaled to the full range, more bits cut.
    Eight,
    /// 16 bits as stored; other depths are refused.
    AsStored,
}

/// Appends one decoded row to the pixels.
type Convert<T> = Box<dyn Fn(&[u8], &mut Vec<T>)>;

fn decode<T: Clone>(
    bytes: &[u8],
    limits: &Limits,
    samples: Samples,
    convert: impl FnOnce(png::ColorType) -> Result<Convert<T>, Error>,
) -> Result<(usize, usize, Vec<T>), Error> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    // Texts and colour profiles are compressed by strangers and of no use here.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    if samples == Samples::Eight {
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    }
    let header = decoder.read_header_info().map_err(damaged)?;
    let (width, height) = (u64::from(header.width), u64::from(header.height));
    if width * height > limits.pixels {
        return Err(Error::Limits { width, height, limit: limits.pixels });
    }
    let mut reader = decoder.read_info().map_err(damaged)?;
    let (color, depth) = reader.output_color_type();
    if samples == Samples::AsStored && depth != png::BitDepth::Sixteen {
        return Err(not_depth(&format!("{}-bit", depth as u8)));
    }
    let append = convert(color)?;
    let (width, height) = (width as usize, height as usize);
    let n = width * height;
    // Reserved, not touched: pages are only taken as rows arrive, so a lying header costs nothing.
    let mut pixels = Vec::new();
    let too_large = || Error::Unsupported(format!("no memory for {width}x{height} pixels"));
    pixels.try_reserve_exact(n).map_err(|_| too_large())?;
    if reader.info().interlaced {
        let len = reader.output_buffer_size().ok_or_else(too_large)?;
        let mut frame = Vec::new();
        frame.try_reserve_exact(len).map_err(|_| too_large())?;
        frame.resize(len, 0);
        reader.next_frame(&mut frame).map_err(damaged)?;
        append(&frame, &mut pixels);
    } else {
        let len = reader.output_line_size(width as u32).ok_or_else(too_large)?;
        let mut row = vec![0; len];
        while reader.read_row(&mut row).map_err(damaged)?.is_some() {
            append(&row, &mut pixels);
        }
    }
    reader.finish().map_err(damaged)?;
    if pixels.len() != n {
        return Err(broken(format!("{} of {n} pixels", pixels.len())));
    }
    Ok((width, height, pixels))
}

fn not_depth(kind: &str) -> Error {
    Error::Unsupported(format!(
        "a depth image must be 16-bit grey, this one is {kind}: it is a picture of depth without a scale; \
         export the measurements themselves"
    ))
}

fn broken(reason: String) -> Error {
    Error::Damaged { format: "PNG", reason }
}

fn damaged(error: png::DecodingError) -> Error {
    match error {
        png::DecodingError::IoError(e) if e.kind() == ErrorKind::UnexpectedEof => {
            broken("the data end early".into())
        }
        png::DecodingError::LimitsExceeded => {
            Error::Unsupported("a row or chunk of this PNG asks for more than 64 MiB".into())
        }
        other => broken(other.to_string()),
    }
}

fn encode(
    size: (usize, usize),
    color: png::ColorType,
    depth: png::BitDepth,
    data: &[u8],
) -> Vec<u8> {
    encode_with(size, color, depth, data, |_| ())
}

pub(super) fn side(n: usize) -> u32 {
    u32::try_from(n).expect("an image in memory has fewer than 2³² columns")
}

/// An encoder for images of this kind.
pub(super) fn start(
    bytes: &mut Vec<u8>,
    (width, height): (usize, usize),
    color: png::ColorType,
    depth: png::BitDepth,
) -> png::Encoder<'static, &mut Vec<u8>> {
    let mut encoder = png::Encoder::new(bytes, side(width), side(height));
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder
}

fn encode_with(
    size: (usize, usize),
    color: png::ColorType,
    depth: png::BitDepth,
    data: &[u8],
    more: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = start(&mut bytes, size, color, depth);
    encoder.set_compression(png::Compression::Fast);
    more(&mut encoder);
    encoder
        .write_header()
        .and_then(|mut writer| {
            writer.write_image_data(data)?;
            writer.finish()
        })
        .expect("memory takes all bytes, and the image has at least one pixel");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stores 16-bit RGBA samples as any kind of PNG, for what our own encoder does not write.
    fn png_of(
        (width, height): (u32, u32),
        color: png::ColorType,
        depth: png::BitDepth,
        data: &[u8],
        more: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        more(&mut encoder);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    fn noise(n: usize) -> Vec<u8> {
        let mut state = 7u32;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect()
    }

    #[test]
    fn round_trips() {
        let gray = Gray::new(31, 17, noise(31 * 17));
        assert_eq!(Gray::from_png(&gray.to_png(), &Limits::default()).unwrap(), gray);
        let rgb = Rgb::new(31, 17, noise(31 * 17 * 3).as_chunks::<3>().0.to_vec());
        assert_eq!(Rgb::from_png(&rgb.to_png(), &Limits::default()).unwrap(), rgb);
        assert_eq!(Gray::from_png(&rgb.to_png(), &Limits::default()).unwrap(), rgb.to_gray());
        let depth = DepthMap::new(3, 2, vec![f32::NAN, 0.2, 0.20006, 6.5535, 9.0, 1e-6]);
        let back = DepthMap::from_png(&depth.to_png(1e-4), 1e-4, &Limits::default()).unwrap();
        assert!(back.at(0, 0).is_nan());
        // Rounded to the nearest count; beyond the last count it is capped, and never becomes 0.
        for (i, expected) in [(1, 0.2), (2, 0.2001), (3, 6.5535), (4, 6.5535), (5, 1e-4)] {
            assert!((back.depth_m()[i] - expected).abs() < 1e-7, "{i}: {}", back.depth_m()[i]);
        }
    }

    #[test]
    fn every_colour_type_and_bit_depth() {
        use png::{BitDepth, ColorType};
        let plain = |_: &mut png::Encoder<'_, &mut Vec<u8>>| ();
        // An audit reads either, and must come to the same.
        let gray = |bytes: &[u8]| {
            let gray = Gray::from_png(bytes, &Limits::default()).unwrap();
            assert_eq!(Rgb::from_png(bytes, &Limits::default()).unwrap().to_gray(), gray);
            gray.pixels().to_vec()
        };
        let rgb =
            |bytes: &[u8]| Rgb::from_png(bytes, &Limits::default()).unwrap().pixels().to_vec();

        // Two pixels of each kind. 16 bits keep their higher byte.
        let bytes =
            png_of((2, 1), ColorType::Grayscale, BitDepth::Sixteen, &[10, 255, 20, 0], plain);
        assert_eq!(gray(&bytes), [10, 20]);
        assert_eq!(rgb(&bytes), [[10; 3], [20; 3]]);
        let bytes =
            png_of((2, 1), ColorType::GrayscaleAlpha, BitDepth::Eight, &[10, 0, 20, 255], plain);
        assert_eq!(gray(&bytes), [10, 20]);
        assert_eq!(rgb(&bytes), [[10; 3], [20; 3]]);
        let colors = [[200, 100, 50], [1, 2, 3]];
        let luma_of = colors.map(luma);
        let bytes =
            png_of((2, 1), ColorType::Rgba, BitDepth::Eight, &[200, 100, 50, 0, 1, 2, 3, 9], plain);
        assert_eq!(gray(&bytes), luma_of);
        assert_eq!(rgb(&bytes), colors);
        let data = [200, 9, 100, 9, 50, 9, 1, 9, 2, 9, 3, 9];
        let bytes = png_of((2, 1), ColorType::Rgb, BitDepth::Sixteen, &data, plain);
        assert_eq!(gray(&bytes), luma_of);
        assert_eq!(rgb(&bytes), colors);
        // Bits count up to white: 1-bit 0/1, 2-bit 0..3.
        let bytes = png_of((3, 1), ColorType::Grayscale, BitDepth::One, &[0b1010_0000], plain);
        assert_eq!(gray(&bytes), [255, 0, 255]);
        let bytes = png_of((4, 1), ColorType::Grayscale, BitDepth::Two, &[0b0001_1011], plain);
        assert_eq!(gray(&bytes), [0, 85, 170, 255]);
        // Palettes, with and without alpha.
        let palette = |alpha: bool| {
            png_of((2, 1), ColorType::Indexed, BitDepth::Four, &[0x10], |encoder| {
                encoder.set_palette(vec![1, 2, 3, 200, 100, 50]);
                if alpha {
                    encoder.set_trns(vec![0, 255]);
                }
            })
        };
        for bytes in [palette(false), palette(true)] {
            assert_eq!(rgb(&bytes), colors);
            assert_eq!(gray(&bytes), luma_of);
        }
    }

    /// PNG as Adam7 passes of 16-bit grey, value = 1000·row + column; unfiltered, in stored deflate blocks.
    fn interlaced(width: usize, height: usize) -> Vec<u8> {
        let passes = [
            (0, 0, 8, 8),
            (4, 0, 8, 8),
            (0, 4, 4, 8),
            (2, 0, 4, 4),
            (0, 2, 2, 4),
            (1, 0, 2, 2),
            (0, 1, 1, 2),
        ];
        let mut data = Vec::new();
        for (x0, y0, dx, dy) in passes {
            for y in (y0..height).step_by(dy) {
                let row: Vec<u8> = (x0..width)
                    .step_by(dx)
                    .flat_map(|x| ((1000 * y + x) as u16).to_be_bytes())
                    .collect();
                if !row.is_empty() {
                    data.push(0);
                    data.extend(row);
                }
            }
        }
        let (a, b) = data.iter().fold((1u32, 0u32), |(a, b), &byte| {
            let a = (a + u32::from(byte)) % 65521;
            (a, (b + a) % 65521)
        });
        let len = data.len() as u16;
        let mut zlib = vec![0x78, 0x01, 1];
        zlib.extend(len.to_le_bytes());
        zlib.extend((!len).to_le_bytes());
        zlib.extend(data);
        zlib.extend((b << 16 | a).to_be_bytes());
        let mut header = Vec::new();
        header.extend((width as u32).to_be_bytes());
        header.extend((height as u32).to_be_bytes());
        header.extend([16, 0, 0, 0, 1]);
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        for (kind, body) in [(b"IHDR", header), (b"IDAT", zlib), (b"IEND", Vec::new())] {
            bytes.extend((body.len() as u32).to_be_bytes());
            let chunk: Vec<u8> = kind.iter().copied().chain(body).collect();
            bytes.extend(&chunk);
            bytes.extend(crc32(&chunk).to_be_bytes());
        }
        bytes
    }

    #[test]
    fn interlaced_images_read() {
        let bytes = interlaced(11, 9);
        let depth = DepthMap::from_png(&bytes, 1.0, &Limits::default()).unwrap();
        let gray = Gray::from_png(&bytes, &Limits::default()).unwrap();
        for y in 0..9 {
            for x in 0..11 {
                let value = 1000 * y + x;
                let expected = if value == 0 { f32::NAN } else { value as f32 };
                assert_eq!(depth.at(x, y).to_bits(), expected.to_bits(), "({x}, {y})");
                assert_eq!(usize::from(gray.row(y)[x]), value >> 8, "({x}, {y})");
            }
        }
    }

    #[test]
    fn truncated_or_flipped_is_an_error_and_never_a_panic() {
        let whole = Rgb::new(20, 9, noise(20 * 9 * 3).as_chunks::<3>().0.to_vec()).to_png();
        for n in 0..whole.len() {
            let error = Rgb::from_png(&whole[..n], &Limits::default()).unwrap_err();
            assert!(matches!(error, Error::Damaged { .. }), "{n} bytes: {error}");
        }
        // Every byte stands under some checksum or is checked itself.
        for i in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[i] ^= 0x10;
            assert!(Rgb::from_png(&bytes, &Limits::default()).is_err(), "byte {i}");
            assert!(Gray::from_png(&bytes, &Limits::default()).is_err(), "byte {i}");
        }
    }

    #[test]
    fn limits_come_before_memory() {
        // A header of 2³¹−1 columns and rows with nothing behind it.
        let mut bytes = Gray::new(1, 1, vec![0]).to_png();
        for side in [16..20, 20..24] {
            bytes[side].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
        }
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        for limit in [200_000_000, 10] {
            let error = Gray::from_png(&bytes, &Limits { pixels: limit }).unwrap_err();
            assert!(matches!(error, Error::Limits { limit: l, .. } if l == limit), "{error}");
        }
        // Without any limit it must still not try.
        assert!(Gray::from_png(&bytes, &Limits { pixels: u64::MAX }).is_err());
        assert!(
            Gray::from_png(&Gray::new(5, 2, vec![0; 10]).to_png(), &Limits { pixels: 10 }).is_ok()
        );
        assert!(
            Gray::from_png(&Gray::new(11, 1, vec![0; 11]).to_png(), &Limits { pixels: 10 })
                .is_err()
        );
    }

    /// The checksum of PNG, bit by bit.
    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |c, _| {
                if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 }
            })
        })
    }

    #[test]
    fn pictures_of_depth_are_refused() {
        let gray = Gray::new(2, 2, vec![1; 4]).to_png();
        let rgb = Rgb::new(2, 2, vec![[1; 3]; 4]).to_png();
        for bytes in [gray, rgb] {
            let error = DepthMap::from_png(&bytes, 1e-4, &Limits::default()).unwrap_err();
            assert!(error.to_string().contains("16-bit grey"), "{error}");
        }
    }

    #[test]
    fn the_first_bytes_tell_the_format_whatever_the_name() {
        let image = Gray::new(3, 2, vec![7; 6]);
        assert_eq!(Gray::decode(&image.to_png(), &Limits::default()), Ok(image));
        for (bytes, name) in [
            (b"".as_slice(), "empty"),
            (b"\0\0\0\x28ftypheic\0\0\0\0", "HEIC"),
            (b"\0\0\0\x20ftypmif1\0\0\0\0", "HEIC"),
            (b"\0\0\0\x20ftypavif", "AVIF"),
            (b"\0\0\0\x14ftypqt  ", "video"),
            (b"BM\x36\x10", "BMP"),
            (b"GIF89a", "GIF"),
            (b"II*\0\x08\0\0\0", "TIFF"),
            (b"MM\0*\0\0\0\x08", "TIFF"),
            (b"P5\n3 2\n255\n", "PNM"),
            (b"RIFF\x24\0\0\0WEBPVP8 ", "WebP"),
            (b"RIFF\x24\0\0\0AVI LIST", "no image"),
            (b"\xff\x0a\xfa\x3f", "JPEG XL"),
            (b"PK\x03\x04", "zip"),
            (b"%PDF-1.7", "PDF"),
            (b"hello", "no image"),
            (b"P", "no image"),
        ] {
            for error in [
                Gray::decode(bytes, &Limits::default()).unwrap_err(),
                Rgb::decode(bytes, &Limits::default()).unwrap_err(),
            ] {
                assert!(matches!(error, Error::Unsupported(_)), "{name}: {error}");
                assert!(error.to_string().contains(name), "{name}: {error}");
            }
        }
    }
}
