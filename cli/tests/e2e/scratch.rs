//! Folders and recordings for one test each.

use std::{
    fs,
    io::{Cursor, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
};

use truedepth::{
    board::CharucoBoard,
    camera::Intrinsics,
    files::NewFolder,
    image::{DepthMap, Rgb},
    recording::{Factory, Writer},
};

/// A folder of one test's own, gone when dropped.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new() -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let n = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("truedepth-e2e-{}-{n}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).expect("the temporary folder can be written");
        Self(path)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    pub(crate) fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.join(name);
        fs::write(&path, bytes).expect("the temporary folder can be written");
        path
    }

    /// A whole and honest recording of three frames in which there is no board to see.
    pub(crate) fn blank_recording(&self, name: &str) -> PathBuf {
        let path = self.join(name);
        let (width, height) = (64, 48);
        let factory = Factory {
            intrinsics: Intrinsics { fx: 50.0, fy: 50.0, cx: 31.5, cy: 23.5, width, height },
            reference_dimensions: None,
            distortion_center: None,
            tables: None,
            pixel_size_m: None,
            extrinsics: None,
            depth_absolute: Some(true),
            depth_filtered: Some(false),
            geometric_distortion_correction: None,
            device_type: Some("AVCaptureDeviceTypeBuiltInTrueDepthCamera".into()),
            field_of_view_rad: None,
        };
        let color = Rgb::new(width, height, vec![[90, 120, 90]; width * height]);
        let depth = DepthMap::new(width, height, vec![0.3; width * height]);
        let mut writer = Writer::new(NewFolder::create(&path).expect("a new folder"));
        for timestamp in [1000, 1500, 2000] {
            writer.frame(timestamp, &color, &depth, &factory).expect("it can be written");
        }
        writer.board(&CharucoBoard::paper(0.020875).expect("the paper's board")).expect("as above");
        writer.finish().expect("as above");
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).ok();
    }
}

/// A zip archive of these files.
pub(crate) fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).expect("a plain name");
        zip.write_all(bytes).expect("memory takes everything");
    }
    zip.finish().expect("as above").into_inner()
}

/// The files of a folder, with `prefix` before their names.
pub(crate) fn files_of(folder: &Path, prefix: &str) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| {
            let path = entry.expect("it lists").path();
            let name = path.file_name().expect("a file").to_string_lossy().into_owned();
            (format!("{prefix}{name}"), fs::read(&path).expect("it reads"))
        })
        .collect();
    files.sort();
    files
}

/// The names in a folder, sorted.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("it lists").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
