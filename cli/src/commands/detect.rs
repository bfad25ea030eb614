//! `truedepth detect PATH...`

use std::{
    collections::BTreeMap,
    convert::Infallible,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::Instant,
};

use truedepth::{
    board::CharucoBoard,
    image::Rgb,
    measure::{FrameMeasurement, Measurer, Observer, Progress, look_for_board},
    recording::{Found, Recording},
    report::Overlay,
    wire::{self, DetectedImage},
};

use crate::{
    args::DetectArgs,
    failure::Failure,
    files::{OverlayFolder, Overwrite, write_atomically},
    input::{self, Input},
    outcome::Outcome,
    terminal::{Bar, Terminal},
};

pub(crate) fn run(args: &DetectArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let board = input::board(&args.input.board)?;
    let overwrite = if args.force { Overwrite::Yes } else { Overwrite::No };
    let folder = args.overlay.as_deref().map(|path| OverlayFolder::new(path, overwrite));
    let mut search = Search {
        board: board.as_ref(),
        args,
        terminal,
        overlays: folder.transpose()?,
        measurer: None,
        images: Vec::new(),
        outcome: Outcome::Clean,
    };
    // Images named one by one are searched together: all cores have work, and the order stays as it was given.
    let mut alone = Vec::new();
    for path in &args.paths {
        match Input::at(path, &args.input) {
            Ok(Input::Image(file)) => alone.push(file),
            Ok(Input::Recordings(found)) => {
                let before = search.images(std::mem::take(&mut alone));
                search.or_go_on(before)?;
                let done = search.recordings(found);
                search.or_go_on(done)?;
            }
            Err(failure) => search.or_go_on(Err(failure))?,
        }
    }
    let done = search.images(alone);
    search.or_go_on(done)?;
    let Search { images, outcome, .. } = search;
    if let (Some(folder), false) = (&args.overlay, images.is_empty()) {
        terminal.say(&format!("overlays: {}", folder.display()));
    }
    if args.json.json {
        let document = wire::Detect { images };
        terminal.result(&wire::to_json(&document))?;
    } else {
        terminal.result(&table(&images))?;
    }
    Ok(outcome)
}

/// What is the same for all paths, and what has come of them.
struct Search<'a> {
    board: Option<&'a CharucoBoard>,
    args: &'a DetectArgs,
    terminal: &'a Terminal,
    overlays: Option<OverlayFolder>,
    /// That of the latest board: what it has prepared, and its memory, serve all images of that board.
    measurer: Option<Measurer>,
    images: Vec<DetectedImage>,
    outcome: Outcome,
}

impl Search<'_> {
    fn failed(&mut self, failure: &Failure) {
        self.terminal.failure(failure);
        self.outcome = Outcome::NotAllRan;
    }

    /// Where it is one path of several that cannot be searched, says so; the rest goes on.
    fn or_go_on(&mut self, done: Result<(), Failure>) -> Result<(), Failure> {
        match done {
            Err(failure) if self.args.paths.len() > 1 => self.failed(&failure),
            other => return other,
        }
        Ok(())
    }

    /// Images that were named one by one.
    fn images(&mut self, files: Vec<PathBuf>) -> Result<(), Failure> {
        let name = match files.as_slice() {
            [] => return Ok(()),
            [only] => only.display().to_string(),
            _ => "images".to_owned(),
        };
        let board = self.board.ok_or_else(|| unknown_board(&files[0].display().to_string()))?;
        let recording = input::images(&name, files, &self.args.input)?;
        self.recording(&recording, board);
        Ok(())
    }

    /// The colour images of recordings, each in order of time.
    fn recordings(&mut self, found: Vec<Found>) -> Result<(), Failure> {
        for found in found {
            let recording = found.open()?;
            let board = self
                .board
                .or(recording.board.as_ref())
                .ok_or_else(|| unknown_board(recording.place()))?;
            self.recording(&recording, board);
        }
        Ok(())
    }

    /// Searches all colour images, side by side; what is found is kept in their order.
    fn recording(&mut self, recording: &Recording, board: &CharucoBoard) {
        let measurer = match self.measurer.take() {
            Some(measurer) if measurer.board() == board => measurer,
            _ => Measurer::new(board),
        };
        let pictures: Vec<Option<PathBuf>> = recording
            .frames
            .iter()
            .map(|frame| {
                let file = &frame.color.as_ref()?.file;
                let short = file.rsplit('/').next().unwrap_or(file);
                let picture = match recording.format {
                    "images" => short.to_owned(),
                    _ => format!("{}-{short}", recording.name),
                };
                Some(self.overlays.as_mut()?.place(Path::new(&picture)))
            })
            .collect();
        let bar = self.terminal.progress(&recording.name, recording.frames.len());
        let times = Mutex::new(vec![[None; 3]; recording.frames.len()]);
        let failed = Mutex::new(Vec::new());
        let watch = Watch { bar: Bar(&bar), board, pictures: &pictures, times, failed };
        let mut found = Vec::new();
        let Ok(()) = look_for_board(recording, &measurer, &watch, |frame, one| {
            found.push((frame, one.map_err(Failure::from)));
            Ok::<_, Infallible>(())
        });
        bar.finish_and_clear();
        self.measurer = Some(measurer);
        let times = watch.times.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut failed: BTreeMap<usize, Failure> =
            watch.failed.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().collect();
        for (frame, one) in found {
            let one = failed.remove(&frame).map_or(one, Err);
            match one {
                Ok(one) => {
                    let file = one.color.as_deref().unwrap_or_default();
                    let [start, decoded, looked] = times[frame];
                    let milliseconds = |from: Option<Instant>, to: Option<Instant>| {
                        let both = from.zip(to).filter(|_| self.args.timings);
                        both.map(|(from, to)| 1e3 * (to - from).as_secs_f64())
                    };
                    self.images.push(DetectedImage {
                        path: Path::new(recording.place()).join(file).display().to_string(),
                        size_px: one.size_px.unwrap_or_default(),
                        decode_ms: milliseconds(start, decoded),
                        detect_ms: milliseconds(decoded, looked),
                        observation: one.observation,
                    });
                }
                Err(failure) => self.failed(&failure),
            }
        }
    }
}

/// Looks at the clock, and draws what was found.
struct Watch<'a> {
    bar: Bar<'a>,
    board: &'a CharucoBoard,
    /// Where to draw it, for each frame.
    pictures: &'a [Option<PathBuf>],
    /// Begun, decoded, looked at.
    times: Mutex<Vec<[Option<Instant>; 3]>>,
    /// Pictures that could not be written.
    failed: Mutex<Vec<(usize, Failure)>>,
}

impl Watch<'_> {
    fn mark(&self, frame: usize, step: usize) {
        let now = Some(Instant::now());
        self.times.lock().unwrap_or_else(PoisonError::into_inner)[frame][step] = now;
    }
}

impl Observer for Watch<'_> {
    fn progress(&self, progress: Progress) {
        self.bar.progress(progress);
    }

    fn begins(&self, frame: usize) -> bool {
        self.mark(frame, 0);
        self.pictures[frame].is_some()
    }

    fn decoded(&self, frame: usize) {
        self.mark(frame, 1);
    }

    fn looked(&self, frame: usize, found: &FrameMeasurement, image: Option<&Rgb>) {
        self.mark(frame, 2);
        if let (Some(path), Some(image)) = (&self.pictures[frame], image) {
            let size = (image.width(), image.height());
            let overlay = Overlay::new(&found.observation, self.board, size);
            if let Err(failure) = write_atomically(path, &overlay.draw(image).to_png()) {
                self.failed.lock().unwrap_or_else(PoisonError::into_inner).push((frame, failure));
            }
        }
    }
}

fn unknown_board(what: &str) -> Failure {
    Failure::new(format!("{what}: the board is not known"))
        .hint("say which with --board, like --board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL")
}

/// One line per image.
fn table(images: &[DetectedImage]) -> String {
    let width = images.iter().map(|image| image.path.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for image in images {
        let path = &image.path;
        let n = image.observation.corners.len();
        let found = match &image.observation.identity {
            Some(identity) => {
                let layout = identity.layout.name();
                let mirrored = if identity.mirrored { " mirrored" } else { "" };
                let inverted = if identity.inverted { " inverted" } else { "" };
                format!("{n:>4} corners  {layout}{mirrored}{inverted}")
            }
            None => "   no board".to_owned(),
        };
        text.push_str(&format!("{path:width$}  {found:<21}"));
        if let (Some(decode), Some(detect)) = (image.decode_ms, image.detect_ms) {
            text.push_str(&format!("  decoded in {decode:.1} ms, searched in {detect:.1} ms"));
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    let n_found = images.iter().filter(|image| image.observation.identity.is_some()).count();
    let n_corners: usize = images.iter().map(|image| image.observation.corners.len()).sum();
    text.push_str(&format!("{n_corners} corners; board in {n_found} of {} images\n", images.len()));
    text
}
