//! Zip archives, honest and hostile.

use std::{
    io::{Cursor, Write},
    sync::Arc,
    thread,
};

use zip::{ZipWriter, write::SimpleFileOptions};

use super::{assert_message, color, good, open, read_all};
use crate::{
    files::{Archive, Limits},
    recording::{Error, Recording},
};

/// A zip of these files, some of them as links.
fn zip<'a>(files: impl IntoIterator<Item = (&'a str, &'a [u8])>) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        if let Some(name) = name.strip_prefix("link:") {
            let target = std::str::from_utf8(bytes).unwrap();
            writer.add_symlink(name, target, SimpleFileOptions::default()).unwrap();
        } else {
            writer.start_file(name, SimpleFileOptions::default()).unwrap();
            writer.write_all(bytes).unwrap();
        }
    }
    writer.finish().unwrap().into_inner()
}

pub(super) fn good_zip() -> Vec<u8> {
    let good = good();
    let mut files: Vec<(&str, &[u8])> =
        good.files().iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    files.push(("__MACOSX/._rgb_53692.png", b"junk"));
    files.push(("._rgb_53692.png", b"junk"));
    files.push(("sub/", b""));
    zip(files)
}

pub(super) fn read_zip(bytes: Vec<u8>, limits: &Limits) -> Result<Recording, Error> {
    read_all(Arc::new(Archive::from_bytes("a.zip", bytes, limits)?), limits)
}

#[test]
fn zips_read_as_folders_do() {
    let zipped = read_zip(good_zip(), &Limits::default()).unwrap();
    let plain = open(good()).unwrap();
    assert_eq!((zipped.name.as_str(), zipped.place()), ("a", "a.zip"));
    assert_eq!(zipped.frames, plain.frames);
    assert_eq!(zipped.problems, []);
    assert_eq!(zipped.color(1).unwrap(), plain.color(1).unwrap());
    // From several threads at once.
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for i in [0, 1, 2].repeat(20) {
                    assert_eq!(zipped.gray(i).unwrap(), color(i).to_gray());
                }
            });
        }
    });
}

#[test]
fn hostile_zips_are_refused_by_name() {
    let png = color(0).to_png();
    for (name, expected) in [
        ("../rgb_1.png", "`../rgb_1.png` leads out of the archive"),
        ("a/../../rgb_1.png", "leads out"),
        ("/etc/rgb_1.png", "`/etc/rgb_1.png` leads out"),
        ("C:\\rgb_1.png", "leads out"),
        ("a\\..\\rgb_1.png", "leads out"),
        ("link:rgb_1.png", "`rgb_1.png` is a link"),
    ] {
        let bytes = zip([("rgb_5.png", png.as_slice()), (name, b"/etc/passwd")]);
        let error = read_zip(bytes, &Limits::default()).unwrap_err();
        assert_message(
            &error,
            &["a.zip: ", expected, "give the folder"].map(|part| {
                if name.starts_with("link") && part == "give the folder" {
                    "pack the file itself"
                } else {
                    part
                }
            }),
        );
    }
    // An encrypted file: its bit in the central directory.
    let mut bytes = zip([("rgb_5.png", png.as_slice())]);
    let central = bytes.windows(4).rposition(|w| w == b"PK\x01\x02").unwrap();
    bytes[central + 8] |= 1;
    let error = read_zip(bytes, &Limits::default()).unwrap_err();
    assert_message(&error, &["a.zip: `rgb_5.png` is encrypted", "password"]);
    // A method that is not compiled in: bzip2 is 12.
    let mut bytes = zip([("rgb_5.png", png.as_slice())]);
    bytes[central + 10] = 12;
    let error = read_zip(bytes, &Limits::default()).unwrap_err();
    assert_message(&error, &["a.zip: `rgb_5.png` is packed by a method that is not supported"]);
    // Cut, and no zip at all.
    let bytes = good_zip();
    let error = read_zip(bytes[..bytes.len() / 2].to_vec(), &Limits::default()).unwrap_err();
    assert_message(&error, &["a.zip: damaged or truncated zip", "copy it again"]);
    assert!(read_zip(Vec::new(), &Limits::default()).is_err());
}

#[test]
fn bombs_meet_their_limits() {
    let zeros = vec![0; 80 << 20];
    let bomb = zip([("rgb_1.png", zeros.as_slice()), ("DepthMetadata.json", &zeros)]);
    assert!(bomb.len() < 1 << 20, "{} bytes", bomb.len());
    let error = read_zip(bomb.clone(), &Limits::default()).unwrap_err();
    assert_message(&error, &["a.zip/DepthMetadata.json: longer than the limit of 67108864 bytes"]);
    let limits = Limits { total_bytes: 100 << 20, ..Limits::default() };
    let error = read_zip(bomb.clone(), &limits).unwrap_err();
    assert_message(&error, &["a.zip: unpacks to 167772160 bytes", "limit of 104857600"]);
    // The same with small sizes in its headers: what it unpacks to is measured, not believed.
    let mut liar = bomb;
    for signature in [b"PK\x01\x02", b"PK\x03\x04"] {
        let offset = if signature[2] == 1 { 24 } else { 22 };
        let at: Vec<usize> =
            (0..liar.len() - 4).filter(|&i| liar[i..i + 4] == *signature).collect();
        for at in at {
            liar[at + offset..at + offset + 4].copy_from_slice(&1000_u32.to_le_bytes());
        }
    }
    let error = read_zip(liar, &Limits::default()).unwrap_err();
    assert_message(&error, &["a.zip/DepthMetadata.json: ", "declared", "copy it again"]);

    let limits = Limits { files: 8, ..Limits::default() };
    assert_message(
        &read_zip(good_zip(), &limits).unwrap_err(),
        &["a.zip: ", "files are more than the limit of 8"],
    );
    assert_message(
        &read_all(Arc::new(good()), &limits).unwrap_err(),
        &["rec: 9 files are more than the limit of 8"],
    );
    // A directory that is longer than its files could be.
    let name = "n".repeat(60_000);
    let names: Vec<String> = (0..30).map(|i| format!("{name}{i}")).collect();
    let many = zip(names.iter().map(|name| (name.as_str(), &b""[..])));
    let limits = Limits { files: 40, ..Limits::default() };
    assert_message(&read_zip(many, &limits).unwrap_err(), &["a.zip: the list of files"]);
}
