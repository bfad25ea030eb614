//! The paper's figure 7: each frame as recorded, resampled with the forward and with the inverse table, side by side,
//! and how straight the board's lines are in each.

use super::{
    Error,
    drawing::{Canvas, Panel, Plate},
    frames::{chosen, in_batches},
};
use crate::{
    board::CharucoBoard,
    correct::{self, BoardLine, ColorWarp, Rectifier, Straightness, Treatment, board_lines},
    detect::{Detector, Observation},
    files::Output,
    geom::Pixel,
    image::Rgb,
    recording::{Recording, StreamState},
};

/// Bows are drawn so many times larger than they are.
const BOW: f64 = 10.0;
const LINE: [u8; 3] = [0, 158, 115];
const BENT: [u8; 3] = [230, 97, 0];

/// What is drawn.
pub struct LensPictures<'a> {
    /// Of this recording.
    pub recording: &'a Recording,
    /// The lens.
    pub rectifier: &'a Rectifier,
    /// To measure by; `None` for pictures alone.
    pub board: Option<&'a CharucoBoard>,
    /// Indices of frames; all where `None`.
    pub frames: Option<Vec<usize>>,
}

/// What was drawn and measured.
#[derive(Clone, Debug, PartialEq)]
pub struct LensDrawn {
    /// Frames with a colour image, in order.
    pub frames: Vec<LensFrame>,
    /// Over all of them.
    pub straightness: Straightness,
}

/// One picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct LensFrame {
    /// Index in the recording.
    pub frame: usize,
    /// As written in the file.
    pub id: String,
    /// Its name.
    pub file: String,
    /// Distance of corners from their lines under each of [`Treatment::ALL`], root mean square, pixels; `None` where
    /// too little of the board was seen.
    pub rms_px: Option<[f64; 3]>,
}

impl LensPictures<'_> {
    /// Draws into the sink, frames in batches on all cores; `observer` is told how many of how many are done.
    ///
    /// Errors: a frame that is not there; no colour image; images of another size than the lens is for; files that
    /// cannot be read or written.
    pub fn draw<S: Output>(
        &self,
        sink: &mut S,
        observer: &mut dyn FnMut(usize, usize),
    ) -> Result<LensDrawn, Error> {
        let asked = chosen(self.recording, self.frames.as_deref())?;
        let has_color = |frame: &usize| self.recording.frames[*frame].color.is_some();
        let frames: Vec<usize> = asked.iter().copied().filter(has_color).collect();
        let Some(&first) = frames.first() else {
            return Err(Error::NothingToDraw {
                recording: self.recording.place().to_owned(),
                n_frames: asked.len(),
                what: "a colour image",
                remedy: "copy the rgb_*.png files, too",
            });
        };
        let image = self.recording.color(first)?;
        let size = [image.width(), image.height()];
        if let Rectifier::Camera(camera) = self.rectifier {
            camera.check_size(size, self.recording.place()).map_err(correct::Error::from)?;
        }
        let warps =
            Treatment::ALL.map(|t| ColorWarp::new(&self.rectifier.map(t, size[0], size[1])));
        let detector = self.board.map(Detector::new);
        let mut drawn = LensDrawn { frames: Vec::new(), straightness: Straightness::default() };
        in_batches(
            &frames,
            |&frame| {
                let image = self.recording.color(frame)?;
                let found = [image.width(), image.height()];
                if found != size {
                    let recording = self.recording.place().to_owned();
                    let what = ["its colour image", "that of other frames"];
                    return Err(Error::Sizes { recording, frame, what, sizes: [found, size] });
                }
                let observation = detector.as_ref().map(|d| d.detect(&image.to_gray()));
                let (plate, lines) = self.plate(frame, &image, &warps, observation.as_ref());
                let source = &self.recording.frames[frame];
                let mut one = Straightness::default();
                one.add([&lines[0], &lines[1], &lines[2]]);
                let file = format!("undistort_{}.png", source.id.replace('/', "_"));
                let done = LensFrame { frame, id: source.id.clone(), file, rms_px: one.rms_px() };
                Ok((done, plate.draw(size[1] as f64 / 48.0).to_png(), lines))
            },
            |index, (done, png, lines)| {
                sink.write(&done.file, &png)?;
                drawn.straightness.add([&lines[0], &lines[1], &lines[2]]);
                drawn.frames.push(done);
                observer(index + 1, frames.len());
                Ok(())
            },
        )?;
        Ok(drawn)
    }

    /// The picture of one frame alone. Errors as [`draw`](Self::draw).
    pub(super) fn one(&self, frame: usize) -> Result<Rgb, Error> {
        let image = self.recording.color(frame)?;
        let (width, height) = (image.width(), image.height());
        let warps = Treatment::ALL.map(|t| ColorWarp::new(&self.rectifier.map(t, width, height)));
        let observation = self.board.map(|board| Detector::new(board).detect(&image.to_gray()));
        let (plate, _) = self.plate(frame, &image, &warps, observation.as_ref());
        Ok(plate.draw(height as f64 / 36.0))
    }

    fn plate(
        &self,
        frame: usize,
        image: &Rgb,
        warps: &[ColorWarp; 3],
        observation: Option<&Observation>,
    ) -> (Plate, [Vec<BoardLine>; 3]) {
        let lines = Treatment::ALL.map(|treatment| match (self.board, observation) {
            (Some(board), Some(observation)) => {
                board_lines(board, observation, |p| self.rectifier.place(treatment, p))
            }
            _ => Vec::new(),
        });
        let panels = Treatment::ALL
            .into_iter()
            .zip(warps)
            .zip(&lines)
            .map(|((treatment, warp), lines)| {
                let treated = match treatment {
                    Treatment::Original => image.clone(),
                    _ => warp.apply(image),
                };
                panel(self.rectifier, treatment, &treated, lines)
            })
            .collect();
        let source = &self.recording.frames[frame];
        let heading = format!(
            "{} · frame {frame} · {} · orange: bows of the board's rows and columns, {BOW} times as large",
            self.recording.name, source.id
        );
        (Plate { heading, panels, bar: None }, lines)
    }
}

fn panel(rectifier: &Rectifier, treatment: Treatment, image: &Rgb, lines: &[BoardLine]) -> Panel {
    let title = match (treatment, rectifier) {
        (Treatment::Original, _) => "original",
        (Treatment::Forward, Rectifier::Tables(_)) => "forward table (undistorts)",
        (Treatment::Inverse, Rectifier::Tables(_)) => "inverse table (distorts)",
        (Treatment::Forward, Rectifier::Camera(_)) => "undistorted by the calibration",
        (Treatment::Inverse, Rectifier::Camera(_)) => "distorted once more by the calibration",
    };
    let mut canvas = Canvas::of(image.clone());
    for line in lines {
        let ends = (line.on_line[0], line.on_line[line.on_line.len() - 1]);
        canvas.line(ends.0, ends.1, 1.0, LINE);
        let bow =
            |(p, q): (&Pixel, &Pixel)| Pixel::new(q.x + BOW * (p.x - q.x), q.y + BOW * (p.y - q.y));
        let bent: Vec<Pixel> = line.points.iter().zip(&line.on_line).map(bow).collect();
        for pair in bent.windows(2) {
            canvas.line(pair[0], pair[1], 1.6, BENT);
        }
    }
    let mut one = Straightness::default();
    one.add([lines, lines, lines]);
    let foot = match one.rms_px() {
        Some([rms, ..]) => format!("{} lines, straight to {rms:.2} px RMS", lines.len()),
        None => "too little of the board seen to measure".to_owned(),
    };
    Panel { title: title.to_owned(), foot, image: canvas.finish() }
}

/// What was measured, in one sentence.
pub fn state_in_words(rectifier: &Rectifier, straightness: &Straightness) -> String {
    let Some([original, forward, inverse]) = straightness.rms_px() else {
        return "The board was not seen, so that nothing was measured.".to_owned();
    };
    let [undone, done] = match rectifier {
        Rectifier::Tables(_) => ["after the forward table", "after the inverse table"],
        Rectifier::Camera(_) => ["undistorted by the calibration", "distorted by it once more"],
    };
    let numbers = format!(
        "as recorded the board's lines are straight to {original:.2} px RMS, {undone} to {forward:.2} px, {done} to \
         {inverse:.2} px"
    );
    match straightness.state() {
        StreamState::Rectified => format!("Already straight: {numbers}."),
        StreamState::Distorted => {
            format!("Not rectified: {numbers}. `truedepth correct` takes the distortion out.")
        }
        StreamState::RectifiedTwice => format!("Rectified once too often: {numbers}."),
        StreamState::Unknown => format!("Cannot tell: {numbers}; record more frames of the board."),
    }
}
