//! The fast way through the PNG files of phones.
//!
//! iOS writes 8-bit RGBA without row filters, which leaves long matches to the decompressor: zlib-rs takes three
//! quarters of the time of the decompressor inside the `png` crate on them, and about half as long again on the
//! filtered 16-bit depth. So exactly the files that need nothing but decompression are decoded here.

use flate2::{Decompress, FlushDecompress, Status};

/// Deflate cannot expand by more than this (a match of 258 bytes takes at least 2 bits), so a header that claims
/// more is lying.
const MAX_RATIO: usize = 1032;

/// Bytes inflated at once: much more than the 32 KiB that the decompressor then puts aside, little enough to be still
/// in the cache when the rows become pixels.
const PIECE_BYTES: usize = 256 << 10;

/// Width, height and pixels; `convert` tells how a row of 8-bit samples with so many channels (grey, grey and alpha,
/// RGB, RGBA) becomes pixels.
///
/// `None` for every file that is not simple, sound in all its checksums, and of at most `max_pixels`: what the
/// general decoder has to say about it, image or error, counts.
pub(super) fn decode<T>(
    png: &[u8],
    max_pixels: u64,
    convert: impl Fn(usize) -> fn(&[u8], &mut Vec<T>),
) -> Option<(usize, usize, Vec<T>)> {
    let mut chunks = Chunks(png.strip_prefix(b"\x89PNG\r\n\x1a\n")?);
    let (b"IHDR", header) = chunks.next()? else { return None };
    let (&width, header) = header.split_first_chunk::<4>()?;
    let (&height, header) = header.split_first_chunk::<4>()?;
    let [width, height] = [width, height].map(u32::from_be_bytes);
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > max_pixels {
        return None;
    }
    // Bit depth, colour type, compression, filter method, interlacing.
    let channels = match *header {
        [8, 0, 0, 0, 0] => 1,
        [8, 4, 0, 0, 0] => 2,
        [8, 2, 0, 0, 0] => 3,
        [8, 6, 0, 0, 0] => 4,
        _ => return None,
    };
    let (width, height) = (width as usize, height as usize);
    let row_bytes = width.checked_mul(channels)?.checked_add(1)?;
    if row_bytes.checked_mul(height)? / MAX_RATIO > png.len() {
        return None;
    }
    let data = compressed(png.len(), chunks)?;

    let append = convert(channels);
    let mut pixels = Vec::with_capacity(width * height);
    let mut inflate = Decompress::new(true);
    let mut piece = vec![0; (PIECE_BYTES / row_bytes).clamp(1, height) * row_bytes];
    let mut n_rows = 0;
    while n_rows < height {
        // Filters, if any, show in the first row: taken alone, little time is lost on the wrong way.
        let rows = if n_rows == 0 { 1 } else { (piece.len() / row_bytes).min(height - n_rows) };
        let piece = &mut piece[..rows * row_bytes];
        let (before, rest) = (inflate.total_out(), &data[inflate.total_in() as usize..]);
        inflate.decompress(rest, piece, FlushDecompress::None).ok()?;
        if (inflate.total_out() - before) as usize != piece.len() {
            return None;
        }
        for row in piece.chunks_exact(row_bytes) {
            let (0, samples) = row.split_first()? else { return None };
            append(samples, &mut pixels);
        }
        n_rows += rows;
    }
    // Nothing may follow but the checksum.
    let rest = &data[inflate.total_in() as usize..];
    let n_bytes = inflate.total_out();
    let status = inflate.decompress(rest, &mut [0], FlushDecompress::Finish).ok()?;
    let whole = inflate.total_in() as usize == data.len() && inflate.total_out() == n_bytes;
    (whole && status == Status::StreamEnd).then_some((width, height, pixels))
}

/// The compressed pixels in one piece, for one sound PNG image.
fn compressed(capacity: usize, chunks: Chunks<'_>) -> Option<Vec<u8>> {
    let mut data = Vec::with_capacity(capacity);
    let mut after_pixels = false;
    for (kind, content) in chunks {
        match (kind, content) {
            (b"IDAT", content) if !after_pixels => data.extend_from_slice(content),
            (b"IEND", []) => return Some(data),
            // Transparency and animation change what the pixels mean; unknown critical chunks may.
            (b"tRNS" | b"acTL" | b"fcTL" | b"fdAT", _) => return None,
            ([b'a'..=b'z', ..], _) => after_pixels = !data.is_empty(),
            _ => return None,
        }
    }
    None
}

/// The chunks of a PNG after its signature, kind and content, up to the first whose checksum is wrong.
struct Chunks<'a>(&'a [u8]);

impl<'a> Iterator for Chunks<'a> {
    type Item = (&'a [u8; 4], &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (&len, rest) = self.0.split_first_chunk::<4>()?;
        let len = u32::from_be_bytes(len) as usize;
        let (body, rest) = rest.split_at_checked(len.checked_add(4)?)?;
        let (&crc, rest) = rest.split_first_chunk::<4>()?;
        if crc32fast::hash(body) != u32::from_be_bytes(crc) {
            return None;
        }
        self.0 = rest;
        body.split_first_chunk::<4>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Gray, Limits, Rgb};

    /// A PNG with this header and these chunks between header and end.
    fn png(header: [u8; 13], chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        let all = [(b"IHDR", &header[..])]
            .into_iter()
            .chain(chunks.iter().copied())
            .chain([(b"IEND", &[][..])]);
        for (kind, data) in all {
            let body = [&kind[..], data].concat();
            bytes.extend((data.len() as u32).to_be_bytes());
            bytes.extend(&body);
            bytes.extend(crc32fast::hash(&body).to_be_bytes());
        }
        bytes
    }

    fn deflate(bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(2 * bytes.len() + 100);
        flate2::Compress::new(flate2::Compression::fast(), true)
            .compress_vec(bytes, &mut out, flate2::FlushCompress::Finish)
            .unwrap();
        out
    }

    fn taken_of(png: &[u8], max_pixels: u64) -> bool {
        decode(png, max_pixels, |_| |row: &[u8], out| out.push(row.len())).is_some()
    }

    const HEADER: [u8; 13] = [0, 0, 0, 2, 0, 0, 0, 2, 8, 6, 0, 0, 0];
    const RGBA: [u8; 18] = [0, 1, 2, 3, 255, 4, 5, 6, 255, 0, 7, 8, 9, 0, 10, 11, 12, 255];

    #[test]
    fn plain_files_are_taken_and_all_others_left() {
        let data = deflate(&RGBA);
        let (a, b) = data.split_at(7);
        let expected = Rgb::new(2, 2, vec![[1, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12]]);
        let filtered = deflate(&[&[1][..], &RGBA[1..]].concat());
        let filtered_later = deflate(&[&RGBA[..9], &[1], &RGBA[10..]].concat());
        let longer = deflate(&[&RGBA[..], &[0]].concat());
        let shorter = deflate(&RGBA[..17]);
        let behind = [&data[..], b"x"].concat();
        let mut deep = HEADER;
        deep[8] = 16;
        let mut large = HEADER;
        large[0] = 1; // 16 million columns of nothing.
        // What is in the file, and whether it is taken.
        for (what, bytes, taken) in [
            ("plain", png(HEADER, &[(b"IDAT", &data)]), true),
            ("two pieces", png(HEADER, &[(b"IDAT", a), (b"IDAT", b)]), true),
            ("an empty piece", png(HEADER, &[(b"IDAT", a), (b"IDAT", b""), (b"IDAT", b)]), true),
            (
                "other chunks",
                png(HEADER, &[(b"eXIf", b"?"), (b"IDAT", &data), (b"tEXt", b"?")]),
                true,
            ),
            ("an interruption", png(HEADER, &[(b"IDAT", a), (b"tEXt", b"?"), (b"IDAT", b)]), false),
            ("transparency", png(HEADER, &[(b"tRNS", b"??"), (b"IDAT", &data)]), false),
            ("an unknown critical chunk", png(HEADER, &[(b"CRIT", b""), (b"IDAT", &data)]), false),
            ("a filter", png(HEADER, &[(b"IDAT", &filtered)]), false),
            ("a filter in the last row", png(HEADER, &[(b"IDAT", &filtered_later)]), false),
            ("too many bytes", png(HEADER, &[(b"IDAT", &longer)]), false),
            ("too few bytes", png(HEADER, &[(b"IDAT", &shorter)]), false),
            ("bytes behind the pixels", png(HEADER, &[(b"IDAT", &behind)]), false),
            ("no pixels", png(HEADER, &[]), false),
            ("16 bits", png(deep, &[(b"IDAT", &data)]), false),
            ("a lying header", png(large, &[(b"IDAT", &data)]), false),
        ] {
            assert_eq!(taken_of(&bytes, 1 << 40), taken, "{what}");
            if taken {
                assert!(!taken_of(&bytes, 3), "{what}");
                assert_eq!(Rgb::from_png(&bytes, &Limits::default()).unwrap(), expected, "{what}");
                for n in 0..bytes.len() {
                    assert!(!taken_of(&bytes[..n], 1 << 40), "{what}, {n} bytes");
                }
                for i in 0..bytes.len() {
                    let mut flipped = bytes.clone();
                    flipped[i] ^= 4;
                    assert!(!taken_of(&flipped, 1 << 40), "{what}, byte {i}");
                }
            }
        }
    }

    /// More than one piece, and rows longer than a piece.
    #[test]
    fn large_images() {
        for (width, height) in [(640, 480), (300_000, 3), (3, 100_000)] {
            let samples = (0..width * height).map(|i: usize| ((i * i) >> 7) as u8);
            let gray = Gray::new(width, height, samples.collect());
            let rows = gray.pixels().chunks(width);
            let bytes: Vec<u8> =
                rows.flat_map(|row| [0].into_iter().chain(row.iter().copied())).collect();
            let mut header = HEADER;
            header[..4].copy_from_slice(&(width as u32).to_be_bytes());
            header[4..8].copy_from_slice(&(height as u32).to_be_bytes());
            header[9] = 0;
            let png = png(header, &[(b"IDAT", &deflate(&bytes))]);
            assert!(taken_of(&png, 1 << 40), "{width}x{height}");
            assert!(Gray::from_png(&png, &Limits::default()).unwrap() == gray, "{width}x{height}");
        }
    }

    #[test]
    fn every_number_of_channels() {
        for (color, channels) in [(0, 1), (4, 2), (2, 3), (6, 4_u8)] {
            let row: Vec<u8> = [0].into_iter().chain(10..10 + 2 * channels).collect();
            let mut header = HEADER;
            (header[7], header[9]) = (1, color);
            let bytes = png(header, &[(b"IDAT", &deflate(&row))]);
            assert!(taken_of(&bytes, 2), "{channels} channels");
            // The general decoder sees the same once a filter keeps the file from the fast way: Sub, then undone.
            let mut sub = row.clone();
            sub[0] = 1;
            for i in (1 + usize::from(channels)..sub.len()).rev() {
                sub[i] -= sub[i - usize::from(channels)];
            }
            let other = png(header, &[(b"IDAT", &deflate(&sub))]);
            assert!(!taken_of(&other, 2));
            let limits = Limits::default();
            assert_eq!(
                Gray::from_png(&bytes, &limits).unwrap(),
                Gray::from_png(&other, &limits).unwrap()
            );
            assert_eq!(
                Rgb::from_png(&bytes, &limits).unwrap(),
                Rgb::from_png(&other, &limits).unwrap()
            );
        }
    }
}
