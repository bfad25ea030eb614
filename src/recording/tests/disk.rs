//! Recordings on disk.

use std::{fs, path::PathBuf, thread};

use super::{TIMES, assert_message, color, depth, factory, zips::good_zip};
use crate::{
    files::{Limits, NewFolder},
    recording::{Recording, Writer, discover},
};

/// A new folder, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path =
            PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("target/tmp/recording").join(name);
        fs::remove_dir_all(&path).ok();
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).ok();
    }
}

fn write(path: &std::path::Path) {
    let mut writer = Writer::new(NewFolder::create(path).unwrap());
    for (i, t) in TIMES.into_iter().enumerate() {
        writer.frame(t, &color(i), &depth(i), &factory()).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn folders_and_zips_on_disk() {
    let scratch = Scratch::new("folders");
    let limits = Limits::default();
    write(&scratch.0.join("one"));
    let one = Recording::open(scratch.0.join("one"), &limits).unwrap();
    assert_eq!((one.name.as_str(), one.frames.len()), ("one", 3));
    assert_eq!(one.color(0).unwrap(), color(0));
    assert_eq!(Recording::open(&scratch.0, &limits).unwrap().name, "one");

    fs::write(scratch.0.join("zipped.zip"), good_zip()).unwrap();
    let zipped = Recording::open(scratch.0.join("zipped.zip"), &limits).unwrap();
    assert_eq!((zipped.name.as_str(), &zipped.frames), ("zipped", &one.frames));
    thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for i in [0, 1, 2].repeat(20) {
                    assert_eq!(zipped.gray(i).unwrap(), color(i).to_gray());
                }
            });
        }
    });

    write(&scratch.0.join("two"));
    let names: Vec<String> =
        discover(&scratch.0, &limits).unwrap().into_iter().map(|found| found.name).collect();
    assert_eq!(names, ["one", "two"]);
    let error = Recording::open(&scratch.0, &limits).unwrap_err();
    assert_message(&error, &["folders holds 2 recordings (one, two): name one"]);
    // Nothing is overwritten.
    let error = NewFolder::create(&scratch.0.join("two")).unwrap_err();
    assert_message(&error, &["two: the folder is not empty; name a new one"]);
}

#[test]
fn bad_paths() {
    let scratch = Scratch::new("bad");
    let limits = Limits::default();
    let open = |path: PathBuf| Recording::open(path, &limits).unwrap_err();
    assert_message(&open(scratch.0.clone()), &["bad is not a recording", "found nothing at all"]);
    assert_message(&open(scratch.0.join("nowhere")), &["nowhere: ", "check that it is there"]);
    fs::write(scratch.0.join("notes.txt"), "hello").unwrap();
    assert_message(
        &open(scratch.0.join("notes.txt")),
        &["notes.txt is not a recording", "no zip archive"],
    );
    fs::write(scratch.0.join("broken.zip"), b"PK\x03\x04 and nothing more").unwrap();
    assert_message(&open(scratch.0.join("broken.zip")), &["broken.zip: damaged or truncated zip"]);

    // Files that cannot be read, also for root: folders under their names.
    let rec = scratch.0.join("rec");
    write(&rec);
    fs::remove_file(rec.join("rgb_53692.png")).unwrap();
    fs::create_dir(rec.join("rgb_53692.png")).unwrap();
    let recording = Recording::open(&rec, &limits).unwrap();
    let error = recording.gray(0).unwrap_err();
    assert_message(&error, &["rec/rgb_53692.png: not a file; check that it is there"]);
    assert_eq!(recording.gray(1).unwrap(), color(1).to_gray());
    fs::remove_file(rec.join("DepthMetadata.json")).unwrap();
    fs::create_dir(rec.join("DepthMetadata.json")).unwrap();
    assert_message(&open(rec.clone()), &["rec/DepthMetadata.json: not a file"]);
    let limits = Limits { files: 3, ..Limits::default() };
    let error = Recording::open(&rec, &limits).unwrap_err();
    assert_message(&error, &["more than 3 files; give the folder of the recording itself"]);
}

#[cfg(unix)]
#[test]
fn links_and_loops() {
    let scratch = Scratch::new("links");
    let rec = scratch.0.join("rec");
    write(&rec);
    std::os::unix::fs::symlink(&scratch.0, scratch.0.join("loop")).unwrap();
    std::os::unix::fs::symlink("nowhere.png", rec.join("rgb_99999.png")).unwrap();
    let recording = Recording::open(&scratch.0, &Limits::default()).unwrap();
    assert_eq!(recording.frames.len(), 4);
    let error = recording.gray(3).unwrap_err();
    assert_message(&error, &["rec/rgb_99999.png: No such file"]);
    // A link to the recording itself is followed: whoever names it means it.
    std::os::unix::fs::symlink(&rec, scratch.0.join("alias")).unwrap();
    assert_eq!(
        Recording::open(scratch.0.join("alias"), &Limits::default()).unwrap().frames.len(),
        4
    );
}
