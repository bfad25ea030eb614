//! `truedepth detect PATH...`

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use rayon::prelude::*;
use truedepth::{
    board::CharucoBoard,
    detect::Detector,
    image::{Gray, Rgb},
    recording::{Found, Recording},
    report::{
        self, Overlay,
        wire::{self, DetectedImage},
    },
};

use crate::{
    args::DetectArgs,
    failure::Failure,
    files::{OverlayFolder, Overwrite, write_atomically},
    input::{self, Input},
    outcome::Outcome,
    terminal::Terminal,
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
        detector: None,
        images: Vec::new(),
        outcome: Outcome::Clean,
    };
    // Images named one by one are searched together: all cores have work, and the order stays as it was given.
    let mut alone = Vec::new();
    for path in &args.paths {
        match Input::at(path, &args.input) {
            Ok(Input::Images(files)) => alone.extend(files),
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
        let document = wire::Document::Detect(wire::Detect { images });
        terminal.result(&report::to_json(&document))?;
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
    detector: Option<Detector>,
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

    /// Images of their own.
    fn images(&mut self, files: Vec<PathBuf>) -> Result<(), Failure> {
        let Some(first) = files.first() else { return Ok(()) };
        let first = first.display().to_string();
        let board = self.board.ok_or_else(|| unknown_board(&first))?;
        let what = if files.len() == 1 { first } else { "images".to_owned() };
        let limits = input::limits(&self.args.input).image;
        let images = files
            .into_iter()
            .map(|file| Image {
                shown: file.display().to_string(),
                overlay: self.overlays.as_mut().map(|folder| folder.place(&file)),
                source: file,
            })
            .collect();
        let decoded = |file: &Path, image: Result<_, truedepth::image::Error>| {
            image.map_err(|e| Failure::from(e).within(format!("cannot read {}", file.display())))
        };
        self.all(
            &what,
            images,
            board,
            &Decode {
                gray: |file: &PathBuf| decoded(file, Gray::decode(&input::read(file)?, &limits)),
                rgb: |file: &PathBuf| {
                    let bytes = input::read(file)?;
                    Rgb::decode(&bytes, &limits).map_err(Failure::from)
                },
            },
        );
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

    fn recording(&mut self, recording: &Recording, board: &CharucoBoard) {
        let frames = recording.frames.iter().enumerate();
        let images = frames
            .filter_map(|(index, frame)| {
                let name = Path::new(frame.color.as_ref()?);
                let short = name.file_name().unwrap_or_default().to_string_lossy();
                let picture = format!("{}-{short}", recording.name);
                Some(Image {
                    shown: Path::new(recording.place()).join(name).display().to_string(),
                    overlay: self.overlays.as_mut().map(|f| f.place(Path::new(&picture))),
                    source: index,
                })
            })
            .collect();
        self.all(
            &recording.name,
            images,
            board,
            &Decode {
                gray: |&index: &usize| Ok(recording.gray(index)?),
                rgb: |&index: &usize| Ok(recording.rgb(index)?),
            },
        );
    }

    /// Searches all, side by side; what is found is kept in their order.
    fn all<S, G, R>(
        &mut self,
        what: &str,
        images: Vec<Image<S>>,
        board: &CharucoBoard,
        decode: &Decode<G, R>,
    ) where
        S: Sync,
        G: Fn(&S) -> Result<Gray, Failure> + Sync,
        R: Fn(&S) -> Result<Rgb, Failure> + Sync,
    {
        let detector = match self.detector.take() {
            Some(detector) if detector.board() == board => detector,
            _ => Detector::new(board),
        };
        let bar = self.terminal.progress(what, images.len());
        let found: Vec<Result<DetectedImage, Failure>> = images
            .par_iter()
            .map(|image| {
                let found = self.one(image, &detector, decode);
                bar.inc(1);
                found
            })
            .collect();
        bar.finish_and_clear();
        self.detector = Some(detector);
        for image in found {
            match image {
                Ok(image) => self.images.push(image),
                Err(failure) => self.failed(&failure),
            }
        }
    }

    /// Decodes and searches one image, looks at the clock, and draws.
    fn one<S, G, R>(
        &self,
        image: &Image<S>,
        detector: &Detector,
        decode: &Decode<G, R>,
    ) -> Result<DetectedImage, Failure>
    where
        G: Fn(&S) -> Result<Gray, Failure>,
        R: Fn(&S) -> Result<Rgb, Failure>,
    {
        let start = Instant::now();
        let gray = (decode.gray)(&image.source)?;
        let decoded = Instant::now();
        let observation = detector.detect(&gray);
        let detected = Instant::now();
        let size = (gray.width(), gray.height());
        let mut found = DetectedImage::new(image.shown.clone(), size.into(), &observation);
        if self.args.timings {
            found.decode_ms = Some(1e3 * (decoded - start).as_secs_f64());
            found.detect_ms = Some(1e3 * (detected - decoded).as_secs_f64());
        }
        if let Some(path) = &image.overlay {
            let overlay = Overlay::new(&observation, detector.board(), size);
            write_atomically(path, &overlay.draw(&(decode.rgb)(&image.source)?).to_png())?;
        }
        Ok(found)
    }
}

fn unknown_board(what: &str) -> Failure {
    Failure::new(format!("{what}: the board is not known"))
        .hint("say which with --board, like --board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL")
}

/// One image to search.
struct Image<S> {
    /// As the output names it.
    shown: String,
    source: S,
    /// Where to draw what was found.
    overlay: Option<PathBuf>,
}

/// How to read an image: grey for the detector, in colour for people.
struct Decode<G, R> {
    gray: G,
    rgb: R,
}

/// One line per image.
fn table(images: &[DetectedImage]) -> String {
    let width = images.iter().map(|image| image.path.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for image in images {
        let path = &image.path;
        let found = match &image.layout {
            Some(layout) => {
                let identity = image.identity.as_ref();
                let mirrored = if identity.is_some_and(|i| i.mirrored) { " mirrored" } else { "" };
                let inverted = if identity.is_some_and(|i| i.inverted) { " inverted" } else { "" };
                format!("{:>4} corners  {layout}{mirrored}{inverted}", image.corners.len())
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
    let n_found = images.iter().filter(|image| image.board_found).count();
    let n_corners: usize = images.iter().map(|image| image.corners.len()).sum();
    text.push_str(&format!("{n_corners} corners; board in {n_found} of {} images\n", images.len()));
    text
}
