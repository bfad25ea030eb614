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

use std::{
    collections::{BTreeMap, BTreeSet},
    mem,
    sync::Arc,
};

use super::{
    Error, Factory, Limits, Problem, Recording, Source, board_file, json,
    metadata::{At, CameraRecord, DepthRecord},
    pairing,
    source::join,
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

/// Whether this format has a file of this name.
#[cfg(feature = "fs")]
pub(super) fn is_ours(name: &str) -> bool {
    is_telltale(name) || [CAMERA_METADATA, BOARD, CHECKER_SIZE].contains(&name)
}

/// The recording in `folder` of the source; empty: at its top.
pub(super) fn open(
    source: Arc<dyn Source>,
    folder: &str,
    name: String,
    limits: &Limits,
) -> Result<Recording, Error> {
    let place = join(source.place(), folder);
    let place = place.trim_end_matches('/').to_owned();
    let prefix = if folder.is_empty() { String::new() } else { format!("{folder}/") };
    let names: Vec<&str> = source
        .names()
        .iter()
        .filter_map(|name| name.strip_prefix(prefix.as_str()).filter(|rest| !rest.contains('/')))
        .collect();
    let mut problems = Vec::new();
    let images = pairing::images(names.iter().copied(), &mut problems);
    if images.is_empty() {
        return Err(Error::NoImages { path: place });
    }
    let read = |file: &str| -> Result<Option<Vec<u8>>, Error> {
        if !names.contains(&file) {
            return Ok(None);
        }
        source.read(&format!("{prefix}{file}"), limits.file_bytes).map(Some)
    };

    let open = |file: &str| source.open(&format!("{prefix}{file}"), limits.file_bytes);
    let whole = |file: &str| source.read(&format!("{prefix}{file}"), limits.file_bytes);
    let (depth_file, camera_file) = (join(&place, DEPTH_METADATA), join(&place, CAMERA_METADATA));

    // Every record is checked, also those without an image. Records of metadata are longer than all else that is kept
    // of a frame: none is kept, and frames of which they say the same share what they say.
    let mut odd = Vec::new();
    let mut depth_records = Vec::new();
    if names.contains(&DEPTH_METADATA) {
        let mut last = None;
        let whole = || whole(DEPTH_METADATA);
        json::each_record(&depth_file, open(DEPTH_METADATA)?, whole, &mut |r: DepthRecord| {
            let record = depth_records.len() + 1;
            let at = At { file: &depth_file, record, timestamp: r.timestamp };
            depth_records.push((r.timestamp, shared(&mut last, r.factory(at, &mut odd)?)));
            // One mention of each kind is enough: all frames come from one camera.
            odd.dedup_by_key(|problem| mem::discriminant(problem));
            Ok(())
        })?;
    } else {
        problems.push(Problem::MetadataMissing { file: DEPTH_METADATA });
    }
    let mut camera_records = Vec::new();
    if names.contains(&CAMERA_METADATA) {
        let whole = || whole(CAMERA_METADATA);
        json::each_record(&camera_file, open(CAMERA_METADATA)?, whole, &mut |r: CameraRecord| {
            camera_records.push(r);
            Ok(())
        })?;
    } else {
        problems.push(Problem::MetadataMissing { file: CAMERA_METADATA });
    }
    let board = match read(BOARD)? {
        Some(bytes) => {
            let file = join(&place, BOARD);
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
                Some(board_file::from_checker_size(&join(&place, CHECKER_SIZE), &bytes)?)
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
    problems.extend(odd);
    problems.extend(variation(factories.values().map(Arc::as_ref)));

    let fallback = factories.values().next().cloned();
    let frames = pairing::frames(
        images,
        |t| factories.remove(&t),
        |t| {
            let (_, camera) = camera_records.get(&t)?;
            Some([camera.width as usize, camera.height as usize])
        },
    );
    Ok(Recording {
        name,
        board,
        frames,
        problems,
        fallback,
        place,
        prefix,
        source,
        limits: limits.clone(),
    })
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
