//! The correction itself, frame by frame.

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};

use super::{
    Error, Plan,
    map::{Geometry, PixelMap},
    warp::{ColorWarp, DepthWarp},
};
use crate::{
    camera::Intrinsics,
    files::{self, Output},
    geom::Pixel,
    image::{DepthMap, Rgb},
    par,
    recording::{Factory, Frame, FrameImage, MetadataEdit, Recording, Writer, encode_depth},
};

/// What is written beside the corrected files; never carried over as an ordinary file.
const PROVENANCE: &str = "provenance.json";

/// A file of the input and its SHA-256.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileHash {
    /// Its name.
    pub name: String,
    /// In hexadecimal digits.
    pub sha256: String,
}

/// What was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrected {
    /// Every file of the input, by name.
    pub files: Vec<FileHash>,
    /// SHA-256 of the lines "hash, two blanks, name, newline" of all files: of what `sha256sum *` prints.
    pub input_sha256: String,
    /// Files that were left out, because they do not count in the input either.
    pub left_out: Vec<String>,
    /// The pinhole that the metadata said.
    pub before: Option<Intrinsics>,
    /// The pinhole that they say now.
    pub after: Option<Intrinsics>,
    /// Frames written.
    pub n_frames: usize,
    /// Depth measurements in the input's and in the output's maps.
    pub n_depths: [u64; 2],
    /// The input's own `provenance.json`, where it is a corrected recording already.
    pub previous: Option<Vec<u8>>,
}

/// How far it has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Frames done.
    pub done: usize,
    /// Frames in all.
    pub total: usize,
}

/// Applies the plan to a recording and writes the result. See [`correct_observed`] to be told how far it has come.
///
/// Nothing is written for a plan whose needs the recording cannot meet. After an error the output holds part of the
/// files and must be dropped.
pub fn correct<O: Output>(
    recording: &Recording,
    plan: &Plan,
    output: &mut O,
) -> Result<Corrected, Error> {
    correct_observed(recording, plan, output, &mut |_| {})
}

/// As [`correct`]; calls `observer` after every frame.
///
/// What is written is in our own layout, whatever format was read: a recording that is stored like that keeps the names
/// of its files and what is not understood of its metadata; of another, images and metadata are written anew and all
/// other files are carried over.
pub fn correct_observed<O: Output>(
    recording: &Recording,
    plan: &Plan,
    output: &mut O,
    observer: &mut dyn FnMut(Progress),
) -> Result<Corrected, Error> {
    let reference = recording.factory().map(|f| f.intrinsics);
    let edited = |factory: &Factory| plan.intrinsics(&factory.intrinsics);
    let corrector = Corrector::new(recording, plan)?;
    let total = recording.frames.len();
    // All that grows with the number of files, in one piece: images come and go, and what is kept between them would
    // leave holes too small for the next.
    let names = recording.file_names();
    let mut hashes: Vec<Option<[u8; 32]>> = vec![None; names.len()];
    let mut set = |name: &str, hash: [u8; 32]| {
        if let Ok(slot) = names.binary_search(&name) {
            hashes[slot] = Some(hash);
        }
    };
    let mut n_depths = [0; 2];
    let is_ours = recording.images().stores_as_ours();
    let times = times_ms(recording);
    let mut writer = Writer::new(&mut *output);
    // Batches bound the memory, whatever the number of frames.
    const BATCH: usize = 16;
    let frames: Vec<usize> = (0..total).collect();
    par::try_batches(
        &frames,
        BATCH,
        |&index| corrector.frame(index, times[index]),
        |index, images| {
            let mut color_size = None;
            for image in images {
                writer.output().write(&image.name, &image.bytes)?;
                n_depths = [0, 1].map(|i| n_depths[i] + image.n_depths[i]);
                color_size = color_size.or(image.color_size);
                if let Some((name, hash)) = image.read {
                    set(&name, hash);
                }
            }
            let frame = &recording.frames[index];
            if let (false, Some(factory)) = (is_ours, frame.factory()) {
                let factory = plan.factory(factory);
                writer.metadata(times[index], &factory, color_size.unwrap_or(factory.size()))?;
            }
            observer(Progress { done: index + 1, total });
            Ok::<_, Error>(())
        },
    )?;
    if is_ours {
        let by_id: BTreeMap<&str, &Frame> =
            recording.frames.iter().map(|frame| (frame.id.as_str(), frame)).collect();
        let edit = |id: &str| {
            let factory = by_id.get(id).and_then(|f| f.factory()).or(recording.factory());
            let intrinsics = factory.and_then(|f| Some(edited(f)).filter(|k| f.intrinsics != *k));
            MetadataEdit { intrinsics, rectified: plan.lens().is_some() }
        };
        recording.images().rewrite_metadata(&edit, writer.output())?;
        for name in recording.images().metadata_files() {
            if names.binary_search(&name).is_ok() {
                set(name, hash_of_file(recording, name)?);
            }
        }
    } else {
        if let Some(board) = &recording.board {
            writer.board(board)?;
        }
        writer.finish()?;
    }
    let mut left_out = Vec::new();
    let mut previous = None;
    for (&name, hash) in names.iter().zip(&mut hashes) {
        if hash.is_some() {
            continue;
        }
        *hash = Some(hash_of_file(recording, name)?);
        if name == PROVENANCE {
            previous = Some(recording.file(name)?);
        } else if recording.images().is_image(name) {
            left_out.push(name.to_owned());
        } else {
            files::copy(recording.open_file(name)?, output, name)?;
        }
    }
    let files: Vec<FileHash> = names
        .iter()
        .zip(hashes.iter().flatten())
        .map(|(name, hash)| FileHash { name: (*name).to_owned(), sha256: hexadecimal(hash) })
        .collect();
    let mut all = Sha256::new();
    for FileHash { name, sha256 } in &files {
        all.update(format!("{sha256}  {name}\n"));
    }
    Ok(Corrected {
        input_sha256: hexadecimal(&all.finalize()),
        files,
        left_out,
        before: reference,
        after: recording.factory().map(edited),
        n_frames: total,
        n_depths,
        previous,
    })
}

/// The times in the names of our own layout, milliseconds: each its own, in order.
fn times_ms(recording: &Recording) -> Vec<i64> {
    let mut last = -1;
    let mut next = |t_ns: i64| {
        last = (t_ns / 1_000_000).max(last + 1);
        last
    };
    recording.frames.iter().map(|frame| next(frame.t_ns)).collect()
}

fn hash_of_file(recording: &Recording, name: &str) -> Result<[u8; 32], Error> {
    let mut hash = Sha256::new();
    files::each_piece(name, recording.open_file(name)?, &mut |bytes| {
        hash.update(bytes);
        Ok(())
    })?;
    Ok(hash.finalize().into())
}

fn hexadecimal(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// An image to write.
struct Done {
    name: String,
    bytes: Vec<u8>,
    /// The file that was read, and its hash.
    read: Option<(String, [u8; 32])>,
    /// Columns and rows of a colour image.
    color_size: Option<[usize; 2]>,
    /// Depth measurements before and after.
    n_depths: [u64; 2],
}

/// What moves the pixels of a frame; `None` where they stay.
struct Warps {
    color: Option<ColorWarp>,
    /// Columns and rows of the colour image that `color` is for.
    color_size: [usize; 2],
    depth: Option<DepthWarp>,
}

impl Warps {
    /// Of a frame with these metadata and a colour image of this size; of the size of the depth map where not given.
    fn new(
        recording: &Recording,
        plan: &Plan,
        factory: Option<&Factory>,
        color_size: Option<[usize; 2]>,
    ) -> Result<Self, Error> {
        let after = factory.map(|f| plan.intrinsics(&f.intrinsics));
        let geometry = Geometry::new(plan, factory, after, recording.place())?;
        let mut warps = Self { color: None, color_size: [0; 2], depth: None };
        let missing = |step| Error::Missing {
            recording: recording.place().to_owned(),
            step,
            what: "factory metadata",
            remedy: "record with an app that saves them",
        };
        if let (Some(defect), None) = (plan.in_metadata(), after) {
            return Err(missing(defect.step()));
        }
        if !plan.resamples_depth() {
            return Ok(warps);
        }
        let Some(Intrinsics { width, height, .. }) = after else { return Err(missing("shift")) };
        if plan.lens().is_some() {
            let [w, h] = color_size.unwrap_or([width, height]);
            warps.color_size = [w, h];
            let [sx, sy] = [w as f64 / width as f64, h as f64 / height as f64];
            let map = PixelMap::new(w, h, |at| {
                let source = geometry.color_source(Pixel::new(at.x / sx, at.y / sy))?;
                Some(Pixel::new(source.x * sx, source.y * sy))
            });
            warps.color = Some(ColorWarp::new(&map));
        }
        let map = PixelMap::new(width, height, |at| geometry.depth_source(at));
        warps.depth = Some(DepthWarp::new(&map, plan.sampling()));
        Ok(warps)
    }
}

/// Corrected images without files: one frame at a time, on as many threads as ask.
pub struct Corrector<'a> {
    recording: &'a Recording,
    plan: &'a Plan,
    usual: Warps,
}

impl<'a> Corrector<'a> {
    /// Prepares the plan. Errors: the recording lacks what the plan needs.
    pub fn new(recording: &'a Recording, plan: &'a Plan) -> Result<Self, Error> {
        // One map for all frames of the same metadata, which is nearly always all of them.
        let color = recording.frames.iter().find_map(|frame| frame.color.as_ref()?.size);
        let usual = Warps::new(recording, plan, recording.factory(), color)?;
        Ok(Self { recording, plan, usual })
    }

    /// The colour image of a frame, corrected.
    pub fn color(&self, index: usize) -> Result<Rgb, Error> {
        self.correct_color(index, self.recording.color(index)?)
    }

    /// The depth map of a frame, corrected.
    pub fn depth(&self, index: usize) -> Result<DepthMap, Error> {
        self.correct_depth(index, self.recording.depth(index)?)
    }

    /// As [`color`](Self::color), for an image of the frame that is decoded already.
    pub fn correct_color(&self, index: usize, image: Rgb) -> Result<Rgb, Error> {
        let warps = self.warps(index, Some([image.width(), image.height()]))?;
        Ok(color(image, self.plan, warps.get(&self.usual)))
    }

    /// As [`depth`](Self::depth), for a map of the frame that is decoded already.
    pub fn correct_depth(&self, index: usize, map: DepthMap) -> Result<DepthMap, Error> {
        let warps = self.warps(index, None)?;
        Ok(depth(map, self.plan, warps.get(&self.usual)))
    }

    /// Frames of other metadata or another size than the recording's get maps of their own.
    fn warps(&self, index: usize, color_size: Option<[usize; 2]>) -> Result<OwnWarps, Error> {
        let factory = self.recording.frames[index].factory().or(self.recording.factory());
        let other = self.recording.factory() != factory
            || color_size
                .is_some_and(|size| self.usual.color.is_some() && size != self.usual.color_size);
        Ok(OwnWarps(if other && self.plan.resamples_depth() {
            Some(Warps::new(self.recording, self.plan, factory, color_size)?)
        } else {
            None
        }))
    }

    /// The images of one frame as files.
    fn frame(&self, index: usize, t_ms: i64) -> Result<Vec<Done>, Error> {
        let (recording, plan) = (self.recording, self.plan);
        let is_ours = recording.images().stores_as_ours();
        let source = &recording.frames[index];
        let read = |image: &FrameImage| -> Result<Option<Vec<u8>>, Error> {
            Ok(if recording.has_files() { Some(recording.file(&image.file)?) } else { None })
        };
        let hashed = |image: &FrameImage, bytes: &Option<Vec<u8>>| {
            bytes.as_ref().map(|bytes| (image.file.clone(), Sha256::digest(bytes).into()))
        };
        let mut outputs = Vec::new();
        if let Some(image) = &source.color {
            let stored = read(image)?;
            let read = hashed(image, &stored);
            let mut color_size = None;
            let bytes = match stored.filter(|_| is_ours && !plan.changes_color()) {
                Some(bytes) => bytes,
                None => {
                    let corrected = self.color(index)?;
                    color_size = Some([corrected.width(), corrected.height()]);
                    corrected.to_png()
                }
            };
            let name = if is_ours { image.file.clone() } else { format!("rgb_{t_ms}.png") };
            outputs.push(Done { name, bytes, read, color_size, n_depths: [0; 2] });
        }
        if let Some(image) = &source.depth {
            let stored = read(image)?;
            let read = hashed(image, &stored);
            let (bytes, n_depths) = match stored.filter(|_| is_ours && !plan.changes_depth()) {
                Some(bytes) => (bytes, [0; 2]),
                None => {
                    let map = recording.depth(index)?;
                    let count = |map: &DepthMap| {
                        map.depth_m().iter().filter(|z| !z.is_nan()).count() as u64
                    };
                    let before = count(&map);
                    let map = self.correct_depth(index, map)?;
                    (encode_depth(&map), [before, count(&map)])
                }
            };
            let name = if is_ours { image.file.clone() } else { format!("depth_{t_ms}.png") };
            outputs.push(Done { name, bytes, read, color_size: None, n_depths });
        }
        Ok(outputs)
    }
}

/// Maps of one frame, where it has any of its own.
struct OwnWarps(Option<Warps>);

impl OwnWarps {
    fn get<'a>(&'a self, usual: &'a Warps) -> &'a Warps {
        self.0.as_ref().unwrap_or(usual)
    }
}

fn color(mut image: Rgb, plan: &Plan, warps: &Warps) -> Rgb {
    if plan.mirrors_color() {
        image = image.mirrored();
    }
    match &warps.color {
        Some(warp) => warp.apply(&image),
        None => image,
    }
}

fn depth(mut map: DepthMap, plan: &Plan, warps: &Warps) -> DepthMap {
    if plan.mirrors_depth() {
        map = map.mirrored();
    }
    if let Some(warp) = &warps.depth {
        map = warp.apply(&map);
    }
    let (scale, bias_m) = plan.depth_scale_and_bias();
    if (scale, bias_m) != (1.0, 0.0) {
        let (factor, bias_m) = (1.0 / scale as f32, bias_m as f32);
        let depth_m = map.depth_m().iter().map(|z| (z - bias_m) * factor).collect();
        map = DepthMap::new(map.width(), map.height(), depth_m);
    }
    map
}
