//! JPEG bytes to pixels.
//!
//! The frame header is read here first, so that limits hold before the decoder allocates anything, and so that kinds
//! of JPEG that are not read are called by their name.

use zune_jpeg::{
    JpegDecoder,
    errors::DecodeErrors,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

use super::{Error, Limits, rgb::luma};

/// What the frame header tells.
struct Frame {
    width: usize,
    height: usize,
    components: u8,
}

/// Width, height and luma. A colour image holds its luma as a channel of its own; that channel is the answer, as in
/// OpenCV's `IMREAD_GRAYSCALE`.
pub(super) fn gray(bytes: &[u8], limits: &Limits) -> Result<(usize, usize, Vec<u8>), Error> {
    let frame = frame(bytes, limits)?;
    let (width, height) = (frame.width, frame.height);
    if frame.components == 1 {
        let gray = pixels(&mut decoder(bytes, &frame, ColorSpace::Luma)?, width * height)?;
        return Ok((width, height, gray));
    }
    // All three channels: asked for luma alone, zune-jpeg 0.5.15 takes wrong rows of progressive images whose colour
    // is stored in every other row (4:4:0).
    let mut decoder = decoder(bytes, &frame, ColorSpace::YCbCr)?;
    if decoder.input_colorspace() == Some(ColorSpace::RGB) {
        let (width, height, rgb) = rgb(bytes, limits)?;
        return Ok((width, height, rgb.into_iter().map(luma).collect()));
    }
    let samples = pixels(&mut decoder, 3 * width * height)?;
    Ok((width, height, samples.as_chunks::<3>().0.iter().map(|&[y, _, _]| y).collect()))
}

/// Width, height and pixels; grey becomes three equal channels.
pub(super) fn rgb(bytes: &[u8], limits: &Limits) -> Result<(usize, usize, Vec<[u8; 3]>), Error> {
    let frame = frame(bytes, limits)?;
    let n = frame.width * frame.height;
    if frame.components == 1 {
        let gray = pixels(&mut decoder(bytes, &frame, ColorSpace::Luma)?, n)?;
        return Ok((frame.width, frame.height, gray.into_iter().map(|y| [y; 3]).collect()));
    }
    let samples = pixels(&mut decoder(bytes, &frame, ColorSpace::RGB)?, 3 * n)?;
    Ok((frame.width, frame.height, samples.as_chunks::<3>().0.to_vec()))
}

/// Walks the segments up to the frame header (ITU-T T.81, B.1.1.4 and B.2.2) and refuses what is not read here.
fn frame(bytes: &[u8], limits: &Limits) -> Result<Frame, Error> {
    let early = || Error::Damaged { format: "JPEG", reason: "the data end early".into() };
    let mut rest = bytes.get(2..).ok_or_else(early)?;
    loop {
        // Padding may stand before a marker; decoders also step over stray bytes.
        let start = rest.iter().position(|&byte| byte == 0xff).ok_or_else(early)?;
        rest = &rest[start..];
        let fill = rest.iter().position(|&byte| byte != 0xff).ok_or_else(early)?;
        let marker = rest[fill];
        rest = &rest[fill + 1..];
        match marker {
            // Stuffing, restarts and starts have no length.
            0x00 | 0x01 | 0xd0..=0xd8 => continue,
            // The entropy-coded data or the end, and no frame header yet.
            0xd9 | 0xda => {
                let reason = "no frame header before the image data".into();
                return Err(Error::Damaged { format: "JPEG", reason });
            }
            _ => (),
        }
        let (&len, _) = rest.split_first_chunk::<2>().ok_or_else(early)?;
        let len = usize::from(u16::from_be_bytes(len));
        let segment = rest.get(2..len).ok_or_else(early)?;
        rest = &rest[len..];
        // C4, C8 and CC are tables and a reserved code among the frame headers.
        if !matches!(marker, 0xc0..=0xcf) || matches!(marker, 0xc4 | 0xc8 | 0xcc) {
            continue;
        }
        let &[precision, h1, h0, w1, w0, components, ref channels @ ..] = segment else {
            return Err(early());
        };
        let refuse = |kind: &str| {
            Err(Error::Unsupported(format!(
                "{kind} JPEG: only 8-bit grey and colour, baseline or progressive, is read; \
                 save the image as PNG"
            )))
        };
        match marker {
            0xc0..=0xc2 if precision != 8 => return refuse(&format!("{precision}-bit")),
            0xc0..=0xc2 => (),
            0xc3 => return refuse("lossless"),
            0xc9..=0xcb => return refuse("arithmetic-coded"),
            _ => return refuse("hierarchical"),
        }
        match components {
            1 | 3 => (),
            4 => return refuse("CMYK"),
            _ => return refuse(&format!("{components}-channel")),
        }
        // Samplings of the channels, four bits across and four down, each after its channel's name. zune-jpeg 0.5.15
        // answers with wrong pixels for some where luma has four rows or columns to one of colour.
        let samplings: Vec<u8> = channels.iter().skip(1).step_by(3).copied().collect();
        match *samplings {
            [_] if components == 1 => (),
            [0x11 | 0x21 | 0x12 | 0x22, 0x11, 0x11] if components == 3 => (),
            _ => return refuse("unusually sampled"),
        }
        let (width, height) = (u16::from_be_bytes([w1, w0]), u16::from_be_bytes([h1, h0]));
        if height == 0 {
            return refuse("line-counting"); // Its height stands behind the first scan.
        }
        if width == 0 {
            let reason = "it is 0 pixels wide".into();
            return Err(Error::Damaged { format: "JPEG", reason });
        }
        if u64::from(width) * u64::from(height) > limits.pixels {
            let (width, height) = (u64::from(width), u64::from(height));
            return Err(Error::Limits { width, height, limit: limits.pixels });
        }
        // Restarts hide a missing end from the decoder, and what stood before (a thumbnail) has an end of its own.
        if !rest.windows(2).rev().any(|pair| pair == [0xff, 0xd9]) {
            return Err(early());
        }
        return Ok(Frame { width: width.into(), height: height.into(), components });
    }
}

/// A decoder that has read the headers, and read the same in them as [`frame`].
fn decoder<'a>(
    bytes: &'a [u8],
    frame: &Frame,
    output: ColorSpace,
) -> Result<JpegDecoder<ZCursor<&'a [u8]>>, Error> {
    let options = DecoderOptions::default()
        // What is damaged must not come back as grey pixels.
        .set_strict_mode(true)
        .set_max_width(frame.width)
        .set_max_height(frame.height)
        .jpeg_set_out_colorspace(output);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| damaged(&e))?;
    if decoder.dimensions() != Some((frame.width, frame.height)) {
        let reason = "two frame headers that differ".into();
        return Err(Error::Damaged { format: "JPEG", reason });
    }
    Ok(decoder)
}

fn pixels(decoder: &mut JpegDecoder<ZCursor<&[u8]>>, len: usize) -> Result<Vec<u8>, Error> {
    let mut samples = Vec::new();
    samples
        .try_reserve_exact(len)
        .map_err(|_| Error::Unsupported(format!("no memory for {len} bytes of pixels")))?;
    samples.resize(len, 0);
    decoder.decode_into(&mut samples).map_err(|e| damaged(&e))?;
    Ok(samples)
}

fn damaged(error: &DecodeErrors) -> Error {
    Error::Damaged { format: "JPEG", reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

    use super::{
        super::{Gray, Rgb},
        *,
    };

    /// Smooth colours, so that what differs between two decoders is rounding.
    fn colors(width: usize, height: usize) -> Vec<u8> {
        let mut rgb = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let wave = |fx: f64, fy: f64| 128.0 + 60.0 * (fx * x as f64 + fy * y as f64).sin();
                rgb.extend(
                    [wave(0.11, 0.05), wave(0.03, 0.12), wave(-0.07, 0.08)].map(|v| v as u8),
                );
            }
        }
        rgb
    }

    fn encoded(
        data: &[u8],
        (width, height): (usize, usize),
        color: ColorType,
        set: impl FnOnce(&mut Encoder<&mut Vec<u8>>),
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 95);
        set(&mut encoder);
        encoder.encode(data, width as u16, height as u16, color).unwrap();
        bytes
    }

    /// Every kind of coding at every alignment to the blocks: the colours come back to a few grey levels, and the
    /// luma channel fits them.
    #[test]
    fn every_kind_reads_the_same() {
        use SamplingFactor as S;
        let samplings = [S::R_4_4_4, S::R_4_2_2, S::R_4_4_0, S::R_4_2_0];
        for (width, height) in
            [(1, 1), (7, 3), (8, 8), (16, 16), (17, 9), (31, 33), (9, 70), (64, 48)]
        {
            let data = colors(width, height);
            for sampling in samplings {
                for (progressive, restart) in
                    [(false, 0), (false, 1), (false, 3), (true, 0), (true, 1), (true, 3)]
                {
                    let what = format!("{width}x{height} {sampling:?} {progressive} {restart}");
                    let bytes = encoded(&data, (width, height), ColorType::Rgb, |encoder| {
                        encoder.set_sampling_factor(sampling);
                        encoder.set_progressive(progressive);
                        encoder.set_restart_interval(restart);
                    });
                    let rgb = Rgb::decode(&bytes, &Limits::default()).expect(&what);
                    let gray = Gray::decode(&bytes, &Limits::default()).expect(&what);
                    assert_eq!((rgb.width(), rgb.height()), (width, height));
                    assert_eq!((gray.width(), gray.height()), (width, height));
                    for (i, original) in data.as_chunks::<3>().0.iter().enumerate() {
                        let back = rgb.pixels()[i];
                        let y = i32::from(gray.pixels()[i]);
                        assert!(
                            (y - i32::from(luma(back))).abs() <= 2,
                            "{what}: luma of pixel {i}"
                        );
                        assert!((y - i32::from(luma(*original))).abs() <= 8, "{what}: pixel {i}");
                    }
                }
            }
            let grey: Vec<u8> = data.as_chunks::<3>().0.iter().map(|&rgb| luma(rgb)).collect();
            for progressive in [false, true] {
                let bytes = encoded(&grey, (width, height), ColorType::Luma, |encoder| {
                    encoder.set_progressive(progressive);
                });
                let gray = Gray::decode(&bytes, &Limits::default()).unwrap();
                let rgb = Rgb::decode(&bytes, &Limits::default()).unwrap();
                // A single channel has its own size, whatever its sampling says (T.81, A.2.2).
                let mut odd = bytes.clone();
                let coding = if progressive { 0xc2 } else { 0xc0 };
                let frame = bytes.windows(2).position(|pair| pair == [0xff, coding]).unwrap();
                odd[frame + 11] = 0x22;
                assert_eq!(Gray::decode(&odd, &Limits::default()), Ok(gray.clone()));
                for (i, &y) in grey.iter().enumerate() {
                    assert!(gray.pixels()[i].abs_diff(y) <= 6, "{width}x{height} pixel {i}");
                    assert_eq!(rgb.pixels()[i], [gray.pixels()[i]; 3]);
                }
            }
        }
    }

    #[test]
    fn exif_does_not_turn_the_image() {
        let (width, height) = (24, 16);
        // A TIFF of one entry: orientation (0x0112), short, 1 value, 6: to be turned right for display.
        let exif =
            [b"MM\0*\0\0\0\x08\0\x01".as_slice(), b"\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"]
                .concat();
        let data = colors(width, height);
        let plain = encoded(&data, (width, height), ColorType::Rgb, |_| ());
        let turned = encoded(&data, (width, height), ColorType::Rgb, |encoder| {
            encoder.add_exif_metadata(&exif).unwrap();
        });
        assert!(turned.len() > plain.len());
        let decode = |bytes: &[u8]| Rgb::decode(bytes, &Limits::default()).unwrap();
        assert_eq!(decode(&turned), decode(&plain));
    }

    #[test]
    fn limits_hold_before_anything_is_decoded() {
        let whole = encoded(&colors(40, 30), (40, 30), ColorType::Rgb, |_| ());
        assert!(Gray::decode(&whole, &Limits { pixels: 1200 }).is_ok());
        let frame = whole.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
        // The image data are gone: the answer comes from the header.
        let mut head = whole[..frame + 19].to_vec();
        for limit in [1199, 0] {
            let expected = Error::Limits { width: 40, height: 30, limit };
            assert_eq!(Gray::decode(&head, &Limits { pixels: limit }), Err(expected.clone()));
            assert_eq!(Rgb::decode(&head, &Limits { pixels: limit }), Err(expected));
        }
        head[frame + 5..frame + 9].fill(0xff);
        let expected = Error::Limits { width: 65535, height: 65535, limit: 200_000_000 };
        assert_eq!(Gray::decode(&head, &Limits::default()), Err(expected));
    }

    #[test]
    fn kinds_that_are_not_read_are_named() {
        let whole = encoded(&colors(16, 16), (16, 16), ColorType::Rgb, |_| ());
        let frame = whole.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
        for (at, value, name) in [
            (1, 0xc3, "lossless"),
            (1, 0xc9, "arithmetic"),
            (1, 0xc6, "hierarchical"),
            (4, 12, "12-bit"),
            (6, 0, "line-counting"),
            (9, 4, "CMYK"),
            (9, 2, "2-channel"),
            (11, 0x41, "unusually sampled"),
            (11, 0x42, "unusually sampled"),
            (11, 0x14, "unusually sampled"),
            (14, 0x21, "unusually sampled"),
        ] {
            let mut bytes = whole.clone();
            bytes[frame + at] = value;
            for error in [
                Gray::decode(&bytes, &Limits::default()).unwrap_err(),
                Rgb::decode(&bytes, &Limits::default()).unwrap_err(),
            ] {
                assert!(matches!(error, Error::Unsupported(_)), "{name}: {error}");
                assert!(error.to_string().contains(name), "{name}: {error}");
                assert!(error.to_string().contains("save the image as PNG"), "{error}");
            }
        }
    }

    #[test]
    fn truncated_is_an_error_and_damage_never_a_panic() {
        for progressive in [false, true] {
            let whole = encoded(&colors(40, 30), (40, 30), ColorType::Rgb, |encoder| {
                encoder.set_progressive(progressive);
                encoder.set_sampling_factor(SamplingFactor::R_4_2_0);
                encoder.set_restart_interval(2);
            });
            let sound = Rgb::decode(&whole, &Limits::default()).unwrap();
            for n in 2..whole.len() {
                // Without its last bytes, which hold no pixels, an image may still be whole.
                match Rgb::decode(&whole[..n], &Limits::default()) {
                    Ok(image) => assert!(image == sound, "{progressive}: {n} of {}", whole.len()),
                    Err(error) => assert!(matches!(error, Error::Damaged { .. }), "{n}: {error}"),
                }
            }
            for i in 0..whole.len() {
                for flip in [0x01, 0x10, 0xff] {
                    let mut bytes = whole.clone();
                    bytes[i] ^= flip;
                    let limits = Limits { pixels: 100_000 };
                    let size = Rgb::decode(&bytes, &limits).map(|image| image.pixels().len());
                    assert!(size.is_err() || size.is_ok_and(|n| n <= 100_000));
                    Gray::decode(&bytes, &limits).ok();
                }
            }
        }
    }
}
