//! What was named on the command line, opened.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use truedepth::{
    board::{CharucoBoard, Dictionary},
    calibrate::KnownCamera,
    camera::Camera,
    diagnose::{self, Registry, Sheet},
    files::{Limits, Paths},
    image,
    recording::{self, Found, Recording, board_from_toml},
    wire,
};

use crate::{
    args::{BoardArgs, BoardArgument, InputArgs},
    failure::Failure,
};

/// What a file may ask for.
pub(crate) fn limits(args: &InputArgs) -> Limits {
    if !args.trust {
        return Limits::default();
    }
    // Far beyond any honest recording; still finite, because lengths of hostile files are summed up.
    Limits {
        files: 100_000_000,
        file_bytes: 1 << 40,
        total_bytes: 1 << 50,
        image: image::Limits { pixels: 1 << 40 },
    }
}

/// The recordings in a folder or archive; their metadata are not read yet. Folders of images alone are none: there is
/// no depth in them to look at.
pub(crate) fn recordings(path: &Path, args: &InputArgs) -> Result<Vec<Found>, Failure> {
    let found = recording::discover(path, &limits(args))?;
    match found.iter().find(|found| !found.format.has_depth) {
        None => Ok(found),
        Some(images) => {
            let message =
                format!("{} is {}: there is no depth in it", path.display(), images.format.title);
            Err(Failure::new(message).hint(
                "give a recording; `truedepth calibrate` and `truedepth detect` take images alone",
            ))
        }
    }
}

/// Whether a path holds a recording, or would if it were whole; else it is a file of another kind.
pub(crate) fn is_recording(path: &Path, args: &InputArgs) -> bool {
    path.is_dir() || recording::discover(path, &limits(args)).is_ok()
}

/// What can be searched for a board.
pub(crate) enum Input {
    /// The recordings in a folder or archive, folders of images among them.
    Recordings(Vec<Found>),
    /// A single image.
    Image(PathBuf),
}

impl Input {
    /// A file is an archive by its first bytes, or else an image, whatever its name.
    pub(crate) fn at(path: &Path, args: &InputArgs) -> Result<Self, Failure> {
        match recording::discover(path, &limits(args)) {
            Ok(found) => Ok(Self::Recordings(found)),
            Err(recording::Error::NotARecording { .. }) if path.is_dir() => {
                let shown = path.display();
                let message = format!("{shown} holds neither a recording nor a PNG or JPEG image");
                Err(Failure::new(message).hint("name a folder that does, or an image"))
            }
            Err(recording::Error::NotARecording { .. })
                if path.is_file() && !has_extension(path, &["zip"]) =>
            {
                Ok(Self::Image(path.to_owned()))
            }
            Err(e) => Err(e.into()),
        }
    }
}

/// Images that were named one by one.
pub(crate) fn images(
    name: &str,
    paths: Vec<PathBuf>,
    args: &InputArgs,
) -> Result<Recording, Failure> {
    Ok(Recording::of_images(name, Arc::new(Paths::new(paths)), &limits(args))?)
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|own| extensions.iter().any(|one| own.eq_ignore_ascii_case(one)))
}

/// A whole file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|e| unreadable(path, e))
}

fn unreadable(path: &Path, e: std::io::Error) -> Failure {
    Failure::from(e)
        .within(format!("cannot read {}", path.display()))
        .hint("check that it is there, and that you have the right to read it")
}

/// The board that was given, if one was.
pub(crate) fn board(args: &BoardArgs) -> Result<Option<CharucoBoard>, Failure> {
    args.board.as_ref().map(board_of).transpose()
}

/// The board that was typed.
pub(crate) fn board_of(argument: &BoardArgument) -> Result<CharucoBoard, Failure> {
    match argument {
        BoardArgument::Board(board) => Ok(board.clone()),
        BoardArgument::WithFile(text) => CharucoBoard::from_short_form(text, |name| {
            let path = Path::new(name);
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            let yaml = text_of(path)?;
            Dictionary::from_opencv_yaml(&file, &yaml)
                .map_err(|e| Failure::from(e).within(format!("cannot use the dictionary {name}")))
        }),
        BoardArgument::File(path) => {
            let toml = text_of(path).map_err(|failure| {
                failure.hint(
                    "--board takes a board.toml, or text like 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL",
                )
            })?;
            let beside = |name: &str| {
                let path = path.with_file_name(name);
                fs::read(&path).map_err(|e| recording::Error::Board {
                    file: path.display().to_string(),
                    why: format!(
                        "{e}; the dictionary that a board.toml names has to lie beside it"
                    ),
                })
            };
            Ok(board_from_toml(&path.display().to_string(), &toml, beside)?)
        }
    }
}

/// The published devices, and those of the user's own file.
pub(crate) fn registry(devices: Option<&Path>) -> Result<Registry, Failure> {
    let mut registry = Registry::published();
    if let Some(path) = devices {
        registry.extend(&path.display().to_string(), &text_of(path)?)?;
    }
    Ok(registry)
}

/// One side of a comparison: a row of the registry, a recording, or a DepthMetadata.json.
pub(crate) fn side(
    text: &str,
    registry: &Registry,
    args: &InputArgs,
) -> Result<diagnose::Side, Failure> {
    if let Some(entry) = registry.get(text) {
        let (name, api) = (entry.name(), Some(entry.api));
        return Ok(diagnose::Side { name, api, sheet: entry.sheet });
    }
    let path = Path::new(text);
    if !path.exists() {
        let message = format!("{text} is neither a file or folder nor a row of the registry");
        return Err(Failure::new(message).hint("`truedepth compare --list` names all rows"));
    }
    let factory = if path.is_file() && has_extension(path, &["json"]) {
        let factories = recording::factories_in_metadata(text, &read(path)?)?;
        factories.into_iter().next()
    } else {
        Recording::open(path, &limits(args))?.factory().cloned()
    };
    let sheet = factory.as_ref().and_then(Sheet::from_factory).ok_or_else(|| {
        Failure::new(format!("{text} has no factory metadata with reference dimensions"))
            .hint("record with an app that saves IntrinsicMatrixReferenceDimensions")
    })?;
    Ok(diagnose::Side { name: text.to_owned(), api: None, sheet })
}

/// A file that is text.
fn text_of(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|e| unreadable(path, e))
}

/// A calibration, or the report of an audit.
pub(crate) fn document(path: &Path) -> Result<wire::Input, Failure> {
    let within = |failure: Failure| failure.within(format!("cannot use {}", path.display()));
    wire::Input::from_json(&text_of(path)?).map_err(|e| within(e.into()))
}

/// The camera that `truedepth calibrate --json` or `audit --json` wrote.
pub(crate) fn camera(path: &Path) -> Result<Camera, Failure> {
    known(path)?.camera().map_err(|e| no_calibration(path, e.into()))
}

/// The same with what the calibration knows of its errors.
pub(crate) fn known_camera(path: &Path) -> Result<KnownCamera, Failure> {
    known(path)?.known().map_err(|e| no_calibration(path, e.into()))
}

fn known(path: &Path) -> Result<wire::Known, Failure> {
    let wrong = |failure: Failure| no_calibration(path, failure);
    let text = fs::read_to_string(path).map_err(|e| unreadable(path, e))?;
    match wire::Input::from_json(&text).map_err(|e| wrong(e.into()))? {
        wire::Input::Calibration(known) => Ok(*known),
        wire::Input::Audit(audit) => {
            audit.calibration.ok_or_else(|| wrong(Failure::new("this audit did not calibrate")))
        }
    }
}

fn no_calibration(path: &Path, failure: Failure) -> Failure {
    let hint = "give what `truedepth calibrate REC --json` printed, or the report.json of an audit that calibrated";
    failure.within(format!("{} holds no calibration", path.display())).hint(hint)
}
