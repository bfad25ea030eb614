//! The format of the capture app of Urban et al. (ZEISS/iPad_TrueDepth_Issue_App), the one format read so far.
//!
//! | file | content |
//! |---|---|
//! | `rgb_<ms>.png` | colour, 8-bit RGBA (RGB and grey are read too) |
//! | `depth_<ms>.png` | 16-bit grey, 10⁻⁴ m each, 0 = no measurement |
//! | `DepthMetadata.json` | one record per depth frame: intrinsics, distortion centre and tables |
//! | `CameraMetadata.json` | one record per colour frame: device, field of view, distortion correction |
//! | `board.toml`, `checkersize.txt` | the board, where somebody has described it |
//! | `NAME.yml` | the dictionary that `board.toml` names, where it is none of OpenCV's |
//! | `Accelerometer.txt`, `Gyroscope.txt` | not read |
//!
//! The app appends metadata from several threads without a lock, so their order means nothing, and a crash leaves
//! them cut.

mod json;
mod metadata;
mod pairing;
mod rewrite;
mod write;

pub use write::{Writer, encode_depth};

use std::{
    collections::{BTreeMap, BTreeSet},
    mem,
    sync::Arc,
};

use json::End;
use metadata::{At, CameraRecord, DepthRecord};

use super::{Contents, Format};
use crate::{
    files::Output,
    image::{DepthMap, Gray, Rgb},
    recording::{Error, Factory, Images, MetadataEdit, Opened, Problem, board_file},
};

pub(super) const FORMAT: Format = Format {
    name: "zeiss",
    title: "the recording format of the ZEISS capture app",
    has_depth: true,
    recognises: |path| is_telltale(path.rsplit('/').next().unwrap_or(path)),
    open,
};

pub(super) const DEPTH_METADATA: &str = "DepthMetadata.json";
pub(super) const CAMERA_METADATA: &str = "CameraMetadata.json";
pub(super) const BOARD: &str = "board.toml";
pub(super) const CHECKER_SIZE: &str = "checkersize.txt";

/// Metres per count of a depth image. (The paper's evaluation says 10⁻⁵ in a comment, and divides by 10⁴.)
pub(super) const DEPTH_UNIT_M: f64 = 1e-4;

/// Relative difference of intrinsics beyond which frames are said to differ: the app writes single precision.
const FLOAT_NOISE: f64 = 1e-6;

/// Whether a file of this name makes the folder it lies in a recording.
pub(super) fn is_telltale(name: &str) -> bool {
    name == DEPTH_METADATA || pairing::parse_name(name).is_some()
}

/// Decodes images when they are asked for.
struct ZeissImages(Contents);

impl Images for ZeissImages {
    fn color(&self, _: usize, file: &str) -> Result<Rgb, Error> {
        self.0.decode(file, Rgb::from_png)
    }

    fn gray(&self, _: usize, file: &str) -> Result<Gray, Error> {
        self.0.decode(file, Gray::from_png)
    }

    fn depth(&self, _: usize, file: &str) -> Result<DepthMap, Error> {
        self.0.decode(file, |bytes, limits| DepthMap::from_png(bytes, DEPTH_UNIT_M, limits))
    }

    fn metadata_files(&self) -> [&str; 2] {
        [CAMERA_METADATA, DEPTH_METADATA]
    }

    fn is_image(&self, file: &str) -> bool {
        pairing::parse_name(file).is_some()
    }

    fn stores_as_ours(&self) -> bool {
        true
    }

    fn rewrite_metadata(
        &self,
        edit: &dyn Fn(&str) -> MetadataEdit,
        output: &mut dyn Output,
    ) -> Result<(), Error> {
        rewrite::metadata(&self.0, edit, output)
    }
}

/// Reads the recording among these files.
fn open(contents: &Contents) -> Result<Opened, Error> {
    let names = contents.names_here();
    let mut problems = Vec::new();
    let images = pairing::images(names.iter().copied(), &mut problems);
    if images.is_empty() {
        return Err(Error::NoImages { path: contents.place().to_owned() });
    }
    let read = |file: &str| -> Result<Option<Vec<u8>>, Error> {
        if !names.contains(&file) {
            return Ok(None);
        }
        contents.read(file).map(Some)
    };
    let (depth_file, camera_file) = (contents.path(DEPTH_METADATA), contents.path(CAMERA_METADATA));

    // Every record is checked, also those without an image. Records of metadata are longer than all else that is kept
    // of a frame: none is kept, and frames of which they say the same share what they say.
    let mut odd = Vec::new();
    let mut cut = Vec::new();
    let mut depth_records = Vec::new();
    if names.contains(&DEPTH_METADATA) {
        let mut last = None;
        let reader = contents.open(DEPTH_METADATA)?;
        let whole = || contents.read(DEPTH_METADATA);
        let end = json::each_record(&depth_file, reader, whole, &mut |r: DepthRecord| {
            let record = depth_records.len() + 1;
            let at = At { file: &depth_file, record, timestamp: r.timestamp };
            depth_records.push((r.timestamp, shared(&mut last, r.factory(at, &mut odd)?)));
            // One mention of each kind is enough: all frames come from one camera.
            odd.dedup_by_key(|problem| mem::discriminant(problem));
            Ok(())
        })?;
        cut.extend((end == End::Open).then_some(DEPTH_METADATA));
    } else {
        problems.push(Problem::MetadataMissing { file: DEPTH_METADATA });
    }
    let mut camera_records = Vec::new();
    if names.contains(&CAMERA_METADATA) {
        let reader = contents.open(CAMERA_METADATA)?;
        let whole = || contents.read(CAMERA_METADATA);
        let end = json::each_record(&camera_file, reader, whole, &mut |r: CameraRecord| {
            camera_records.push(r);
            Ok(())
        })?;
        cut.extend((end == End::Open).then_some(CAMERA_METADATA));
    } else {
        problems.push(Problem::MetadataMissing { file: CAMERA_METADATA });
    }
    let board = match read(BOARD)? {
        Some(bytes) => {
            let file = contents.path(BOARD);
            let beside = |name: &str| {
                read(name)?.ok_or_else(|| Error::Board {
                    file: file.clone(),
                    why: format!("its dictionary {name} is not there; put it beside board.toml"),
                })
            };
            Some(board_file::from_toml(&file, &bytes, beside)?)
        }
        None => match read(CHECKER_SIZE)? {
            Some(bytes) => {
                Some(board_file::from_checker_size(&contents.path(CHECKER_SIZE), &bytes)?)
            }
            None => None,
        },
    };

    let time = |r: &(i64, Arc<Factory>)| r.0;
    let depth_records = pairing::by_time(DEPTH_METADATA, depth_records, time, &mut problems);
    let mut factories: BTreeMap<i64, Arc<Factory>> = depth_records
        .into_iter()
        .map(|(timestamp, (_, (_, factory)))| (timestamp, factory))
        .collect();
    let time = |r: &CameraRecord| r.timestamp;
    let camera_records = pairing::by_time(CAMERA_METADATA, camera_records, time, &mut problems);
    let timestamps: Vec<i64> =
        factories.keys().filter(|t| !images.contains_key(t)).copied().collect();
    if !timestamps.is_empty() {
        problems.push(Problem::MetadataWithoutImages { timestamps });
    }
    for (file, known) in [
        (DEPTH_METADATA, factories.keys().copied().collect::<BTreeSet<_>>()),
        (CAMERA_METADATA, camera_records.keys().copied().collect()),
    ] {
        let timestamps: Vec<i64> = images.keys().filter(|t| !known.contains(t)).copied().collect();
        // Where the whole file is missing that has been said.
        if !(timestamps.is_empty() || problems.contains(&Problem::MetadataMissing { file })) {
            problems.push(Problem::ImagesWithoutMetadata { file, timestamps });
        }
    }

    let mut last = None;
    for (&timestamp, (record, camera)) in &camera_records {
        let at = At { file: &camera_file, record: *record, timestamp };
        let slot = factories.get_mut(&timestamp);
        let mut complete = slot.as_deref().map(|factory| Factory::clone(factory));
        camera.complete(at, complete.as_mut())?;
        if let (Some(slot), Some(complete)) = (slot, complete) {
            *slot = shared(&mut last, complete);
        }
    }
    problems.extend(cut.into_iter().map(|file| Problem::MetadataUnfinished { file }));
    problems.extend(odd);
    problems.extend(variation(factories.values().map(Arc::as_ref)));

    let fallback = factories.values().next().cloned();
    let mut scaled = None;
    let frames = pairing::frames(images, |timestamp, mut frame| {
        let factory = factories.remove(&timestamp);
        if let Some(depth) = &mut frame.depth {
            depth.size = factory.as_deref().map(Factory::size);
            depth.factory = factory.clone();
        }
        if let Some(color) = &mut frame.color {
            let camera = camera_records.get(&timestamp).map(|(_, camera)| camera);
            color.size = camera.map(|camera| [camera.width as usize, camera.height as usize]);
            let size = color.size.or(factory.as_deref().map(Factory::size));
            color.factory = match (factory, size) {
                (Some(factory), Some(size)) if factory.size() == size => Some(factory),
                (Some(factory), Some(size)) => {
                    factory.at_size(size).map(|factory| shared(&mut scaled, factory))
                }
                _ => None,
            };
        }
        frame
    });
    let images = Arc::new(ZeissImages(contents.clone()));
    Ok(Opened { board, frames, problems, fallback, images })
}

/// The last one again where it says the same.
fn shared(last: &mut Option<Arc<Factory>>, factory: Factory) -> Arc<Factory> {
    match last {
        Some(last) if **last == factory => Arc::clone(last),
        _ => Arc::clone(last.insert(Arc::new(factory))),
    }
}

/// What a `DepthMetadata.json` says about the camera, record by record; `file` names it in messages.
pub fn factories_in_metadata(file: &str, bytes: &[u8]) -> Result<Vec<Factory>, Error> {
    let records: Vec<DepthRecord> = json::records(file, bytes)?;
    let mut odd = Vec::new();
    records
        .iter()
        .enumerate()
        .map(|(i, depth)| {
            depth.factory(At { file, record: i + 1, timestamp: depth.timestamp }, &mut odd)
        })
        .collect()
}

/// Whether the intrinsics of the frames differ.
fn variation<'a>(factories: impl Iterator<Item = &'a Factory>) -> Option<Problem> {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let [mut fx_px, mut cx_px, mut cy_px] = [none; 3];
    for Factory { intrinsics: k, .. } in factories {
        for (range, value) in [(&mut fx_px, k.fx), (&mut cx_px, k.cx), (&mut cy_px, k.cy)] {
            *range = [range[0].min(value), range[1].max(value)];
        }
    }
    let differ = |[low, high]: [f64; 2]| high - low > FLOAT_NOISE * high.abs();
    [fx_px, cx_px, cy_px].into_iter().any(differ).then_some(Problem::IntrinsicsVary {
        fx_px,
        cx_px,
        cy_px,
    })
}
