//! The correction itself, frame by frame.

use sha2::{Digest, Sha256};

use super::{
    Error, Plan,
    map::{Geometry, PixelMap},
    warp::{ColorWarp, DepthWarp},
};
use crate::{
    camera::Intrinsics,
    image::{DepthMap, Rgb},
    par,
    recording::{Amendment, Factory, Recording, Sink, encode_depth},
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
/// Nothing is written for a plan whose needs the recording cannot meet. After an error the sink holds part of the
/// files and must be dropped.
pub fn correct<S: Sink>(
    recording: &Recording,
    plan: &Plan,
    sink: &mut S,
) -> Result<Corrected, Error> {
    correct_observed(recording, plan, sink, &mut |_| {})
}

/// As [`correct`]; calls `observer` after every frame.
pub fn correct_observed<S: Sink>(
    recording: &Recording,
    plan: &Plan,
    sink: &mut S,
    observer: &mut dyn FnMut(Progress),
) -> Result<Corrected, Error> {
    let reference = recording.factory().map(|f| f.intrinsics);
    let amended = |factory: &Factory| plan.intrinsics(&factory.intrinsics);
    let corrector = Corrector::new(recording, plan)?;
    let total = recording.frames.len();
    // All that grows with the number of files, in one piece: images come and go, and what is kept between them would
    // leave holes too small for the next.
    let names = recording.file_names();
    let mut hashes: Vec<Option<[u8; 32]>> = vec![None; names.len()];
    let slot = |name: &str| names.binary_search(&name).expect("files of the recording are listed");
    let mut n_depths = [0; 2];
    // Batches bound the memory, whatever the number of frames.
    const BATCH: usize = 16;
    let frames: Vec<usize> = (0..total).collect();
    par::try_batches(
        &frames,
        BATCH,
        |&frame| corrector.frame(frame),
        |frame, outputs| {
            for output in outputs {
                sink.write(output.name, &output.bytes)?;
                n_depths = [0, 1].map(|i| n_depths[i] + output.n_depths[i]);
                hashes[slot(output.name)] = Some(output.hash);
            }
            observer(Progress { done: frame + 1, total });
            Ok::<_, Error>(())
        },
    )?;
    let amendment = |timestamp| {
        let frame = recording.frame_at(timestamp);
        let factory = frame.and_then(|f| f.factory.as_deref()).or(recording.factory());
        Amendment {
            intrinsics: factory.map(amended).filter(|k| factory.is_none_or(|f| f.intrinsics != *k)),
            rectified: plan.lens().is_some(),
        }
    };
    for name in recording.metadata_names() {
        hashes[slot(name)] = Some(hash_of_file(recording, name)?);
        sink.stream(name, &mut |push| recording.amended_metadata(name, &amendment, push))?;
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
        } else if recording.is_image_name(name) {
            left_out.push(name.to_owned());
        } else {
            sink.stream(name, &mut |push| recording.pieces(name, push))?;
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
        after: recording.factory().map(amended),
        n_frames: total,
        n_depths,
        previous,
    })
}

fn hash_of_file(recording: &Recording, name: &str) -> Result<[u8; 32], Error> {
    let mut hash = Sha256::new();
    recording.pieces(name, &mut |bytes| {
        hash.update(bytes);
        Ok(())
    })?;
    Ok(hash.finalize().into())
}

fn hexadecimal(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A file to write in place of one that was read.
struct Output<'a> {
    name: &'a str,
    /// Of what was read.
    hash: [u8; 32],
    bytes: Vec<u8>,
    /// Depth measurements before and after.
    n_depths: [u64; 2],
}

/// What moves the pixels of a frame; `None` where they stay.
struct Warps {
    color: Option<ColorWarp>,
    depth: Option<DepthWarp>,
}

impl Warps {
    fn new(recording: &Recording, plan: &Plan, factory: Option<&Factory>) -> Result<Self, Error> {
        let after = factory.map(|f| plan.intrinsics(&f.intrinsics));
        let geometry = Geometry::new(plan, factory, after, recording.place())?;
        let mut warps = Self { color: None, depth: None };
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
            let map = PixelMap::new(width, height, |at| geometry.color_source(at));
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
        let usual = Warps::new(recording, plan, recording.factory())?;
        Ok(Self { recording, plan, usual })
    }

    /// The colour image of a frame, corrected.
    pub fn color(&self, index: usize) -> Result<Rgb, Error> {
        self.correct_color(index, self.recording.rgb(index)?)
    }

    /// The depth map of a frame, corrected.
    pub fn depth(&self, index: usize) -> Result<DepthMap, Error> {
        self.correct_depth(index, self.recording.depth(index)?)
    }

    /// As [`color`](Self::color), for an image of the frame that is decoded already.
    pub fn correct_color(&self, index: usize, image: Rgb) -> Result<Rgb, Error> {
        let warps = self.warps(index)?;
        Ok(color(image, self.plan, warps.get(&self.usual)))
    }

    /// As [`depth`](Self::depth), for a map of the frame that is decoded already.
    pub fn correct_depth(&self, index: usize, map: DepthMap) -> Result<DepthMap, Error> {
        let warps = self.warps(index)?;
        Ok(depth(map, self.plan, warps.get(&self.usual)))
    }

    /// Frames of other metadata than the recording's get maps of their own.
    fn warps(&self, index: usize) -> Result<OwnWarps, Error> {
        Ok(OwnWarps(match self.recording.frames[index].factory.as_deref() {
            Some(factory)
                if self.recording.factory() != Some(factory) && self.plan.resamples_depth() =>
            {
                Some(Warps::new(self.recording, self.plan, Some(factory))?)
            }
            _ => None,
        }))
    }

    /// The files of one frame.
    fn frame(&self, index: usize) -> Result<Vec<Output<'_>>, Error> {
        let (recording, plan) = (self.recording, self.plan);
        let source = &recording.frames[index];
        let mut outputs = Vec::new();
        if let Some(name) = &source.color {
            let read = recording.file(name)?;
            let hash = Sha256::digest(&read).into();
            let bytes = if plan.changes_color() { self.color(index)?.to_png() } else { read };
            outputs.push(Output { name, hash, bytes, n_depths: [0; 2] });
        }
        if let Some(name) = &source.depth {
            let read = recording.file(name)?;
            let hash = Sha256::digest(&read).into();
            if plan.changes_depth() {
                let map = recording.depth(index)?;
                let count =
                    |map: &DepthMap| map.depth_m().iter().filter(|z| !z.is_nan()).count() as u64;
                let before = count(&map);
                let map = self.correct_depth(index, map)?;
                let n_depths = [before, count(&map)];
                outputs.push(Output { name, hash, bytes: encode_depth(&map), n_depths });
            } else {
                outputs.push(Output { name, hash, bytes: read, n_depths: [0; 2] });
            }
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
