//! The whole of it: from frames to measurements.

use std::{
    borrow::Cow,
    sync::atomic::{AtomicUsize, Ordering},
};

use super::{
    About, Error, FrameMeasurement, Measurer, Method, Observer, Progress, Stage,
    camera::{MeasuredCamera, measured_camera},
    frame::scaled,
};
use crate::{
    board::{CharucoBoard, Layout},
    calibrate::{BoardSurface, Calibration, DistortionTest, KnownCamera, Parameter},
    camera::{Camera, Distortion},
    depth::{
        BoardDepth, Handedness, Patches, RegisterInput, Registration, TemporalNoise, against_board,
        handedness, register,
    },
    geom::Pixel,
    par,
    pose::{View, Weighting},
    recording::{Factory, Problem, Recording},
};

/// Views with fewer corners are not compared: the paper's least number, too.
const LEAST_CORNERS: usize = 9;

/// Frames that are looked at before what was found is sorted in: bounds the memory, whatever the number of frames.
const BATCH: usize = 64;

/// Everything that was measured of a recording.
#[derive(Clone, Debug)]
pub struct Measurements {
    /// Name of the recording, for people.
    pub name: String,
    /// Where the measured intrinsics come from, as it was asked for.
    pub method: Method,
    /// The board that was looked for, with its layout where it was seen.
    pub board: CharucoBoard,
    /// The layout that was seen in most frames.
    pub layout: Option<Layout>,
    /// What was odd in the files.
    pub problems: Vec<Problem>,
    /// The factory's metadata at the size of the colour images: those of the first frame that has any.
    pub factory: Option<Factory>,
    /// Every frame of the recording, in order of time; `frame` indices elsewhere point in here.
    pub frames: Vec<FrameMeasurement>,
    /// The measured intrinsics; `None` where the recording does not determine any (`no_calibration` says why) or they
    /// were given.
    pub calibration: Option<Calibration>,
    /// Why there is no calibration, in a sentence, where there is none.
    pub no_calibration: Option<String>,
    /// The measured camera: calibrated or given.
    pub camera: Option<Camera>,
    /// Where it is given: what is known of it.
    pub given: Option<KnownCamera>,
    /// Depth against the board with the factory's intrinsics taken as an ideal pinhole, as the paper does.
    pub factory_depth: Option<BoardDepth>,
    /// Depth against the board with the measured camera.
    pub own_depth: Option<BoardDepth>,
    /// Depth against colour and truth, from the board's whole surface with the measured camera, in pixels of the depth
    /// map; `None` without a camera, and where too few frames have depth on the board.
    pub registration: Option<Registration>,
    /// What comes and goes between successive depth maps in which nothing moved.
    pub temporal_noise: TemporalNoise,
    /// Whether the depth maps are mirrored against the colour images; `None` where no pose of the board is known.
    pub handedness: Option<Handedness>,
    /// How much of the lens' distortion is left in the stream, from the pixels; `None` where the views do not tell.
    pub distortion: Option<DistortionTest>,
}

impl Measurements {
    /// Frames in which the board was seen.
    pub fn n_frames_with_board(&self) -> usize {
        self.frames.iter().filter(|f| f.n_corners > 0).count()
    }

    /// Frames that look like others and are summarised: only their counts are used.
    pub fn n_frames_summarised(&self) -> usize {
        self.frames.iter().filter(|f| !f.in_full).count()
    }

    /// Columns and rows of the colour images, where one was read.
    pub fn size_px(&self) -> Option<[usize; 2]> {
        self.frames.iter().find_map(|f| f.size_px)
    }

    /// Frames whose markers read only as in a mirror, and all whose markers read.
    pub fn n_mirrored_of(&self) -> (usize, usize) {
        let identified = self.frames.iter().filter_map(|f| f.observation.identity.as_ref());
        identified.fold((0, 0), |(n_mirrored, n), i| (n_mirrored + usize::from(i.mirrored), n + 1))
    }
}

/// Measures all frames of a recording, on all cores; `max_views` as
/// [`calibrate_from`](crate::calibrate::calibrate_from).
///
/// Errors: a file that cannot be read or decoded (the first in order of time, whatever the threads do), no colour image
/// at all, colour and depth of different shape, a camera given for images of another size or of another camera.
pub fn measure(
    recording: &Recording,
    board: CharucoBoard,
    method: &Method,
    max_views: usize,
    observer: &dyn Observer,
) -> Result<Measurements, Error> {
    let total = recording.frames.len();
    if recording.frames.iter().all(|f| f.color.is_none()) {
        let recording = recording.place().to_owned();
        return Err(Error::NoImages { recording, n_frames: total });
    }
    let mut measurer = Measurer::new(&board);
    let indices: Vec<usize> = (0..total).collect();
    let steps = Steps::new(observer, total);
    for batch in indices.chunks(BATCH) {
        let found = par::try_map(batch, |&index| {
            let found = look(recording, &measurer, index, observer)?;
            steps.one_done();
            Ok::<_, Error>(found)
        })?;
        found.into_iter().for_each(|found| measurer.add(found));
    }
    measurer.finish(About::recording(recording), method, max_views, observer)
}

/// Looks for the board in all colour images, on all cores, and hands on what was found, in order of time, together with
/// the index of its frame; depth is not read. An image that cannot be decoded does not stop the others unless `take`
/// says so: its error ends the search.
pub fn look_for_board<E>(
    recording: &Recording,
    measurer: &Measurer,
    observer: &dyn Observer,
    mut take: impl FnMut(usize, Result<FrameMeasurement, Error>) -> Result<(), E>,
) -> Result<(), E> {
    let with_color = |index: &usize| recording.frames[*index].color.is_some();
    let indices: Vec<usize> = (0..recording.frames.len()).filter(with_color).collect();
    let steps = Steps::new(observer, indices.len());
    for batch in indices.chunks(BATCH) {
        let found = par::map(batch, |&index| {
            let found = look_at_color(recording, measurer, index, observer);
            steps.one_done();
            found
        });
        for (index, found) in batch.iter().zip(found) {
            take(*index, found)?;
        }
    }
    Ok(())
}

/// Counts frames that were looked at, from any thread.
struct Steps<'a> {
    observer: &'a dyn Observer,
    done: AtomicUsize,
    total: usize,
}

impl<'a> Steps<'a> {
    fn new(observer: &'a dyn Observer, total: usize) -> Self {
        observer.progress(Progress { stage: Stage::Detect, done: 0, total });
        Self { observer, done: AtomicUsize::new(0), total }
    }

    fn one_done(&self) {
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        self.observer.progress(Progress { stage: Stage::Detect, done, total: self.total });
    }
}

/// One colour image: decoded, the corners detected, the image dropped.
fn look_at_color(
    recording: &Recording,
    measurer: &Measurer,
    index: usize,
    observer: &dyn Observer,
) -> Result<FrameMeasurement, Error> {
    let (gray, image) = if observer.begins(index) {
        let image = recording.color(index)?;
        (image.to_gray(), Some(image))
    } else {
        (recording.gray(index)?, None)
    };
    observer.decoded(index);
    let found = measurer.look(&recording.frames[index], &gray);
    observer.looked(index, &found, image.as_ref());
    Ok(found)
}

/// One frame: as [`look_at_color`], and depth read at the corners.
fn look(
    recording: &Recording,
    measurer: &Measurer,
    index: usize,
    observer: &dyn Observer,
) -> Result<FrameMeasurement, Error> {
    let frame = &recording.frames[index];
    if frame.color.is_none() {
        return Ok(FrameMeasurement::blank(frame));
    }
    let mut found = look_at_color(recording, measurer, index, observer)?;
    if frame.depth.is_some() && found.n_corners > 0 {
        measurer.look_at_depth(&mut found, &recording.depth(index)?, recording.place())?;
    }
    Ok(found)
}

impl Measurer {
    /// Calibrates, and compares depth with the board and with colour.
    ///
    /// Errors: a camera given for images of another size or of another camera.
    pub fn finish(
        mut self,
        mut about: About,
        method: &Method,
        max_views: usize,
        observer: &dyn Observer,
    ) -> Result<Measurements, Error> {
        self.close();
        let mut board = self.board().clone();
        let Self { mut frames, noise, .. } = self;
        let layout = most_seen_layout(&frames, board.layout);
        // What is seen goes before what was said: markers of the other layout are nowhere near.
        board.layout = layout.or(board.layout);
        // All that is measured in colour images is compared at their size.
        let size_px = frames.iter().find_map(|f| f.size_px);
        about.factory =
            about.factory.and_then(|f| size_px.map_or(Some(f.clone()), |s| f.at_size(s)));

        observer.progress(Progress { stage: Stage::Calibrate, done: 0, total: 1 });
        let own = measured_camera(&about, (method, max_views), &board, &frames)?;
        observer.progress(Progress { stage: Stage::Calibrate, done: 1, total: 1 });

        observer.progress(Progress { stage: Stage::Judge, done: 0, total: 1 });
        for (index, frame) in frames.iter_mut().enumerate() {
            let corners = &frame.observation.corners;
            if corners.len() < LEAST_CORNERS {
                continue;
            }
            let factory = frame.factory.as_deref().or(about.factory.as_ref());
            frame.factory_view = factory.map(|f| f.intrinsics).and_then(|intrinsics| {
                let camera = Camera { intrinsics, distortion: Distortion::None };
                View::from_corners(index, &board, &camera, corners, Weighting::Equal).ok()
            });
            frame.own_view = own.view(index, &board, corners);
        }
        let factory = about.factory.as_ref();
        let factory_depth =
            factory.is_some().then(|| compare(&board, None, &frames, |f| f.factory_view.as_ref()));
        let own_depth = own
            .camera
            .is_some()
            .then(|| compare(&board, own.surface(), &frames, |f| f.own_view.as_ref()));
        let pairs = own.views_with_depth(&frames);
        let registration = own
            .camera
            .as_ref()
            .and_then(|camera| registration(camera, &own, &board, &frames, &pairs, factory));
        let handedness = (!pairs.is_empty()).then(|| handedness(&board, own.surface(), &pairs));
        drop(pairs);
        let distortion = own.distortion(&about, &board, &frames);
        let MeasuredCamera { camera, calibration, given, why_not } = own;
        let measured = Measurements {
            name: about.name,
            method: method.clone(),
            board,
            layout,
            problems: about.problems,
            factory: about.factory,
            frames,
            calibration,
            no_calibration: why_not,
            camera,
            given,
            factory_depth,
            own_depth,
            registration,
            temporal_noise: noise.finish(),
            handedness,
            distortion,
        };
        observer.progress(Progress { stage: Stage::Judge, done: 1, total: 1 });
        Ok(measured)
    }
}

/// Depth against colour, in pixels of the depth map.
fn registration(
    camera: &Camera,
    own: &MeasuredCamera,
    board: &CharucoBoard,
    frames: &[FrameMeasurement],
    pairs: &[(&View, &Patches)],
    factory: Option<&Factory>,
) -> Option<Registration> {
    let scale = pairs.first().and_then(|(view, _)| frames[view.frame].depth_scale());
    let depth_size = pairs.first().and_then(|(view, _)| frames[view.frame].depth_size_px);
    let (parameters, covariance) = own.uncertainty();
    let (mut camera, mut parameters, mut covariance) =
        (Cow::Borrowed(camera), Cow::Borrowed(parameters), Cow::Borrowed(covariance));
    let mut tables = factory.and_then(|f| f.tables.clone());
    let mut views: Vec<(Cow<'_, View>, &Patches)> =
        pairs.iter().map(|(view, patches)| (Cow::Borrowed(*view), *patches)).collect();
    if let (Some(scale), Some(size)) = (scale, depth_size) {
        // The map is of another size: everything goes to its pixels.
        views.retain(|(view, _)| frames[view.frame].depth_size_px == Some(size));
        for (view, _) in &mut views {
            let view = view.to_mut();
            view.corners = view.corners.iter().map(|corner| scaled(*corner, scale)).collect();
            view.residuals_px =
                view.residuals_px.iter().map(|r| [r[0] * scale[0], r[1] * scale[1]]).collect();
            view.rms_px *= f64::midpoint(scale[0], scale[1]);
        }
        camera = Cow::Owned(camera.at_size(size));
        tables = factory.and_then(|f| f.at_size(size)).and_then(|f| f.tables);
        (parameters, covariance) = {
            let (parameters, covariance) = in_other_pixels(&parameters, &covariance, scale);
            (Cow::Owned(parameters), Cow::Owned(covariance))
        };
    }
    let pinhole = Camera { intrinsics: camera.intrinsics, distortion: Distortion::None };
    let other = |at: Pixel| match (&camera.distortion, &tables) {
        // The colour image is distorted: a rectified depth map shows where the lens puts its pixels.
        (Distortion::Brown(_) | Distortion::Table(_), _) => {
            camera.project_ray(pinhole.unproject(at)?)
        }
        (Distortion::None, Some(tables)) => tables.undistort(at),
        (Distortion::None, None) => None,
    };
    let known = camera.distortion != Distortion::None || tables.is_some();
    let views: Vec<(&View, &Patches)> =
        views.iter().map(|(view, patches)| (view.as_ref(), *patches)).collect();
    register(&RegisterInput {
        board,
        camera: &camera,
        parameters: &parameters,
        covariance: &covariance,
        surface: own.surface(),
        views: &views,
        other_state: if known { Some(&other) } else { None },
    })
}

/// Parameters and their covariance with numbers of pixels for an image of another size.
fn in_other_pixels(
    parameters: &[Parameter],
    covariance: &[f64],
    scale: [f64; 2],
) -> (Vec<Parameter>, Vec<f64>) {
    let factor = |parameter: &Parameter| match parameter.name {
        "focal_px" | "center_x_px" => scale[0],
        "center_y_px" => scale[1],
        _ => 1.0,
    };
    let n = parameters.len();
    let at = |i: usize| factor(&parameters[i / n]) * factor(&parameters[i % n]);
    let covariance = covariance.iter().enumerate().map(|(i, v)| v * at(i)).collect();
    let mut parameters = parameters.to_vec();
    for parameter in &mut parameters {
        let factor = factor(parameter);
        parameter.estimate.value *= factor;
        parameter.estimate.sigma *= factor;
    }
    (parameters, covariance)
}

fn most_seen_layout(frames: &[FrameMeasurement], said: Option<Layout>) -> Option<Layout> {
    let count = |layout| {
        frames
            .iter()
            .filter_map(|f| f.observation.identity.as_ref())
            .filter(|i| i.layout == layout)
            .count()
    };
    let (legacy, new) = (count(Layout::Legacy), count(Layout::New));
    match legacy + new {
        0 => None,
        _ if new > legacy => Some(Layout::New),
        _ if new == legacy => said.or(Some(Layout::Legacy)),
        _ => Some(Layout::Legacy),
    }
}

fn compare<'a>(
    board: &CharucoBoard,
    surface: Option<&BoardSurface>,
    frames: &'a [FrameMeasurement],
    view: impl Fn(&'a FrameMeasurement) -> Option<&'a View>,
) -> BoardDepth {
    let sensed: Vec<_> = frames
        .iter()
        .filter(|frame| !frame.sensor_m.is_empty())
        .filter_map(|frame| {
            let view = view(frame)?;
            // A view may have left out corners of the observation; both are in order of ids.
            let mut seen = frame.observation.corners.iter().zip(&frame.sensor_m);
            let sensor_m: Vec<_> = view
                .corners
                .iter()
                .map(|corner| {
                    seen.find(|(seen, _)| seen.id == corner.id).and_then(|(_, depth)| *depth)
                })
                .collect();
            Some((view, sensor_m))
        })
        .collect();
    let pairs: Vec<_> =
        sensed.iter().map(|(view, sensor_m)| (*view, sensor_m.as_slice())).collect();
    against_board(board, surface, &pairs)
}
