//! Files that leave: never over somebody else's, never half written.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
    process, thread,
    time::{Duration, Instant},
};

use truedepth::recording::OVERLAY_ENDING;

use crate::failure::Failure;

const JSON: &str = "report.json";
const HTML: &str = "report.html";

/// Every `report.json` of ours says so in its `schema`.
const SCHEMA: &str = "truedepth.";

/// A folder that may take a report: it is new, empty, or holds an older report of ours.
#[derive(Debug)]
pub(crate) struct ReportFolder {
    path: PathBuf,
}

impl ReportFolder {
    /// Refuses a folder with anything in it but an older report of ours.
    pub(crate) fn new(path: &Path) -> Result<Self, Failure> {
        let shown = path.display();
        let refuse = |why: &str| {
            let message = format!("{shown} {why}; nothing was written");
            Err(Failure::new(message).hint("name a new folder with -o"))
        };
        if path.exists() {
            if !path.is_dir() {
                return refuse("is a file, not a folder for a report");
            }
            let mut entries = fs::read_dir(path)
                .map_err(|e| Failure::from(e).within(format!("cannot look into {shown}")))?;
            if entries.next().is_some() && !is_our_report(&path.join(JSON)) {
                return refuse("is not empty and holds no report of truedepth");
            }
        }
        Ok(Self { path: path.to_owned() })
    }

    pub(crate) fn html(&self) -> PathBuf {
        self.path.join(HTML)
    }

    pub(crate) fn json(&self) -> PathBuf {
        self.path.join(JSON)
    }

    /// Writes both files, the machine's first: it marks the folder as ours.
    pub(crate) fn write(&self, json: &str, html: &str) -> Result<(), Failure> {
        let shown = self.path.display();
        fs::create_dir_all(&self.path).map_err(|e| {
            Failure::from(e)
                .within(format!("cannot make the folder {shown}"))
                .hint("name a folder that can be written with -o")
        })?;
        write_atomically(&self.path.join(JSON), json.as_bytes())?;
        write_atomically(&self.path.join(HTML), html.as_bytes())
    }
}

/// A folder that takes pictures of what was found, one per image.
#[derive(Debug)]
pub(crate) struct OverlayFolder {
    path: PathBuf,
    /// Names given out, in lower case: not every file system tells `A` from `a`.
    taken: HashSet<String>,
}

impl OverlayFolder {
    /// Makes the folder. Refuses one with anything in it unless `overwrite` says that files of the same names may go.
    pub(crate) fn new(path: &Path, overwrite: Overwrite) -> Result<Self, Failure> {
        let shown = path.display();
        let unusable = |e| {
            Failure::from(e)
                .within(format!("cannot use the folder {shown}"))
                .hint("name a folder that can be written with --overlay")
        };
        if path.exists() && !path.is_dir() {
            let message = format!("{shown} is a file, not a folder for pictures");
            return Err(Failure::new(message).hint("name a new folder with --overlay"));
        }
        fs::create_dir_all(path).map_err(unusable)?;
        if overwrite == Overwrite::No && fs::read_dir(path).map_err(unusable)?.next().is_some() {
            let message = format!("{shown} is not empty; nothing was written");
            return Err(Failure::new(message)
                .hint("name a new folder with --overlay, or allow this one with --force"));
        }
        Ok(Self { path: path.to_owned(), taken: HashSet::new() })
    }

    /// Where the picture of an image goes: NAME.overlay.png, with a number where that was given out before. The order
    /// of the images decides, not what lies in the folder. No photo has such a name, so that none is written over.
    pub(crate) fn place(&mut self, image: &Path) -> PathBuf {
        let stem = image.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = (1_usize..)
            .map(|n| if n == 1 { stem.clone() } else { format!("{stem}-{n}") })
            .find(|name| self.taken.insert(name.to_lowercase()))
            .expect("there are more numbers than images");
        self.path.join(format!("{name}{OVERLAY_ENDING}"))
    }
}

/// Whether files of the same names may go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overwrite {
    No,
    Yes,
}

/// True for a `report.json` that says it is one of ours.
fn is_our_report(path: &Path) -> bool {
    let Ok(text) = fs::read_to_string(path) else { return false };
    serde_json::from_str::<serde_json::Value>(&text).is_ok_and(|report| {
        report["schema"].as_str().is_some_and(|schema| schema.starts_with(SCHEMA))
    })
}

/// Writes to a neighbour and renames it, so that a reader sees the old file or the new one, never half of one.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let shown = path.display();
    let name = path.file_name().ok_or_else(|| Failure::new(format!("{shown} names no file")))?;
    let temporary =
        path.with_file_name(format!(".{}.{}.tmp", name.to_string_lossy(), process::id()));
    fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path)).map_err(|e| {
        let _ = fs::remove_file(&temporary); // It may never have come to be.
        Failure::from(e)
            .within(format!("cannot write {shown}"))
            .hint("is the disk full, or the folder not yours to write?")
    })
}

/// New files that belong together. They replace what is there where that was asked for; else a file that is there
/// already and holds anything else is refused before any is written.
pub(crate) fn write_together(
    files: &[(PathBuf, Vec<u8>)],
    replace: Replace,
) -> Result<(), Failure> {
    if replace == Replace::Nothing {
        for (path, bytes) in files {
            if path.exists() && !fs::read(path).is_ok_and(|there| there == *bytes) {
                let message = format!("{} is there already; nothing was written", path.display());
                return Err(Failure::new(message).hint("--force replaces it; or name another"));
            }
        }
    }
    if let Some(folder) = files.first().and_then(|(path, _)| path.parent()) {
        fs::create_dir_all(folder).map_err(|e| {
            Failure::from(e).within(format!("cannot make the folder {}", folder.display()))
        })?;
    }
    files.iter().try_for_each(|(path, bytes)| write_atomically(path, bytes))
}

/// What may be written over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Replace {
    Nothing,
    WhatIsThere,
}

/// An address a browser opens, for an existing file.
pub(crate) fn file_url(path: &Path) -> String {
    let absolute = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let mut url = String::from("file://");
    for byte in absolute.to_string_lossy().bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' => {
                url.push(char::from(byte));
            }
            _ => url.push_str(&format!("%{byte:02X}")),
        }
    }
    url
}

/// How systems open a file in the program for it, the usual one first: program and first arguments.
#[cfg(target_os = "macos")]
const OPENERS: [(&str, &[&str]); 1] = [("open", &[])];
#[cfg(windows)]
const OPENERS: [(&str, &[&str]); 1] = [("cmd", &["/C", "start", ""])];
#[cfg(not(any(target_os = "macos", windows)))]
const OPENERS: [(&str, &[&str]); 4] =
    [("xdg-open", &[]), ("gio", &["open"]), ("wslview", &[]), ("sensible-browser", &[])];

/// A program that has not complained for so long has shown the file.
const OPENS_WITHIN: Duration = Duration::from_secs(2);

/// Shows a file with the first program of the system that does. Errors: none does; the hint says what to open by hand.
pub(crate) fn open(path: &Path) -> Result<(), Failure> {
    let mut tried = Vec::new();
    for (program, first) in OPENERS {
        let started = process::Command::new(program)
            .args(first)
            .arg(path)
            .stdin(process::Stdio::null())
            .stdout(process::Stdio::null())
            .stderr(process::Stdio::null())
            .spawn();
        match started {
            Ok(child) => match shows(child) {
                true => return Ok(()),
                false => tried.push(format!("`{program}` failed")),
            },
            Err(e) => tried.push(format!("`{program}`: {e}")),
        }
    }
    let message = format!("no program opens {} ({})", path.display(), tried.join("; "));
    Err(Failure::new(message).hint(format!("open {} in a browser", file_url(path))))
}

/// False where the program ends at once and says that it failed. Some stay as long as the window they open.
fn shows(mut child: process::Child) -> bool {
    let start = Instant::now();
    while start.elapsed() < OPENS_WITHIN {
        match child.try_wait() {
            Ok(Some(status)) => return status.success(),
            Ok(None) => thread::sleep(Duration::from_millis(20)),
            Err(_) => return true,
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder of this test's own, gone when dropped.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("truedepth-{}-{name}", process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            fs::remove_dir_all(&self.0).ok();
        }
    }

    #[test]
    fn a_report_replaces_a_report_and_nothing_else() {
        let scratch = Scratch::new("report");
        let dir = scratch.0.join("new");
        let report =
            |html| ReportFolder::new(&dir)?.write(r#"{"schema":"truedepth.audit/1"}"#, html);
        report("one").unwrap();
        report("two").unwrap();
        assert_eq!(fs::read_to_string(dir.join(HTML)).unwrap(), "two");
        assert_eq!(fs::read_dir(&dir).unwrap().count(), 2, "no temporary file stays behind");

        for json in ["", "{}", r#"{"schema": 1}"#, r#"{"schema":"else/1"}"#, "no json"] {
            fs::write(dir.join(JSON), json).unwrap();
            assert!(ReportFolder::new(&dir).is_err(), "{json}");
        }
        fs::remove_file(dir.join(JSON)).unwrap();
        assert!(report("three").is_err(), "a report.html that may be anyone's");
        assert_eq!(fs::read_to_string(dir.join(HTML)).unwrap(), "two");
        assert!(ReportFolder::new(&dir.join(HTML)).is_err(), "a file");
    }

    #[test]
    fn pictures_get_names_of_their_own_and_never_replace_anything_unasked() {
        let scratch = Scratch::new("overlay");
        let dir = scratch.0.join("deep/er");
        let mut folder = OverlayFolder::new(&dir, Overwrite::No).unwrap();
        for (image, expected) in [
            ("a/rgb.png", "rgb.overlay.png"),
            ("b/rgb.jpg", "rgb-2.overlay.png"),
            ("b/RGB.jpg", "RGB-3.overlay.png"),
            ("rgb-2.png", "rgb-2-2.overlay.png"),
            ("rgb.v2.png", "rgb.v2.overlay.png"),
        ] {
            assert_eq!(folder.place(Path::new(image)), dir.join(expected), "{image}");
        }
        OverlayFolder::new(&dir, Overwrite::No).unwrap();
        fs::write(dir.join("mine"), "").unwrap();
        assert!(OverlayFolder::new(&dir, Overwrite::No).is_err());
        assert!(OverlayFolder::new(&dir, Overwrite::Yes).is_ok());
        assert!(OverlayFolder::new(&dir.join("mine"), Overwrite::Yes).is_err(), "a file");
    }

    #[test]
    fn urls() {
        let path = Path::new("/nowhere/a b#ü.html");
        assert_eq!(file_url(path), "file:///nowhere/a%20b%23%C3%BC.html");
    }
}
