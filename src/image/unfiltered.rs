//! The fast way through the PNG files of phones.
//!
//! iOS writes 8-bit RGBA without row filters, which leaves long matches to the decompressor: zlib-rs takes three
//! quarters of the time of the decompressor inside the `png` crate on them, and about half as long again on the
//! filtered 16-bit depth. So exactly the files that need nothing but decompression are decoded here.

use flate2::{Decompress, FlushDecompress, Status};

/// Deflate cannot expand by more than this (a match of 258 bytes takes at least 2 bits), so a header that claims
/// more is lying.
const MAX_RATIO: usize = 1032;

/// The pixels of a PNG, each row after one byte to be skipped.
pub(super) struct Rows {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Grey, grey and alpha, RGB or RGBA.
    pub(super) channels: usize,
    bytes: Vec<u8>,
}

impl Rows {
    /// `None` for every file that is not simple, sound in all its checksums, and of at most `max_pixels`: what the
    /// general decoder has to say about it, image or error, counts.
    pub(super) fn decode(png: &[u8], max_pixels: u64) -> Option<Self> {
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
        let n_bytes = row_bytes.checked_mul(height)?;
        if n_bytes / MAX_RATIO > png.len() {
            return None;
        }

        let mut pixels = Vec::with_capacity(png.len());
        let mut after_pixels = false;
        loop {
            match chunks.next()? {
                (b"IDAT", data) if !after_pixels => pixels.extend_from_slice(data),
                (b"IEND", []) => break,
                // Transparency and animation change what the pixels mean; unknown critical chunks may.
                (b"tRNS" | b"acTL" | b"fcTL" | b"fdAT", _) => return None,
                ([b'a'..=b'z', ..], _) => after_pixels = !pixels.is_empty(),
                _ => return None,
            }
        }
        let mut bytes = vec![0; n_bytes];
        let mut inflate = Decompress::new(true);
        // Filters, if any, show in the first row: then no time is lost on the wrong way.
        inflate.decompress(&pixels, &mut bytes[..1], FlushDecompress::None).ok()?;
        if bytes[0] != 0 || inflate.total_out() != 1 {
            return None;
        }
        let rest = &pixels[inflate.total_in() as usize..];
        let status = inflate.decompress(rest, &mut bytes[1..], FlushDecompress::Finish).ok()?;
        let whole = inflate.total_in() as usize == pixels.len();
        if status != Status::StreamEnd || inflate.total_out() as usize != n_bytes || !whole {
            return None;
        }
        let unfiltered = bytes.chunks_exact(row_bytes).all(|row| row[0] == 0);
        unfiltered.then_some(Self { width, height, channels, bytes })
    }

    /// The rows in order, samples only.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.bytes.chunks_exact(self.width * self.channels + 1).map(|row| &row[1..])
    }
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
        let mut out = Vec::with_capacity(bytes.len() + 100);
        flate2::Compress::new(flate2::Compression::fast(), true)
            .compress_vec(bytes, &mut out, flate2::FlushCompress::Finish)
            .unwrap();
        out
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
            assert_eq!(Rows::decode(&bytes, 1 << 40).is_some(), taken, "{what}");
            if taken {
                assert!(Rows::decode(&bytes, 3).is_none(), "{what}");
                assert_eq!(Rgb::from_png(&bytes, &Limits::default()).unwrap(), expected, "{what}");
                for n in 0..bytes.len() {
                    assert!(Rows::decode(&bytes[..n], 1 << 40).is_none(), "{what}, {n} bytes");
                }
                for i in 0..bytes.len() {
                    let mut flipped = bytes.clone();
                    flipped[i] ^= 4;
                    assert!(Rows::decode(&flipped, 1 << 40).is_none(), "{what}, byte {i}");
                }
            }
        }
    }

    #[test]
    fn every_number_of_channels() {
        for (color, channels) in [(0, 1), (4, 2), (2, 3), (6, 4_u8)] {
            let row: Vec<u8> = [0].into_iter().chain(10..10 + 2 * channels).collect();
            let mut header = HEADER;
            (header[7], header[9]) = (1, color);
            let bytes = png(header, &[(b"IDAT", &deflate(&row))]);
            assert!(Rows::decode(&bytes, 2).is_some(), "{channels} channels");
            // The general decoder sees the same once a filter keeps the file from the fast way: Sub, then undone.
            let mut sub = row.clone();
            sub[0] = 1;
            for i in (1 + usize::from(channels)..sub.len()).rev() {
                sub[i] -= sub[i - usize::from(channels)];
            }
            let other = png(header, &[(b"IDAT", &deflate(&sub))]);
            assert!(Rows::decode(&other, 2).is_none());
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
