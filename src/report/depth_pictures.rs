//! Depth over colour for a whole recording: a picture per frame, a contact sheet, and an animation.

use super::{
    DepthStyle, Error,
    depth_style::{depth_range_m, n_edges},
    drawing::{Panel, Plate, contact_sheet},
    frames::{chosen, in_batches, spread},
};
use crate::{
    correct::{Corrector, Plan},
    files::Output,
    image::{DepthMap, Rgb, animated_png},
    recording::{Frame, Recording},
};

/// Width of the panel of a picture with one panel, and with two.
const PANEL_WIDTHS: [usize; 2] = [1280, 960];
/// Width of a panel of the animation.
const MOVING_WIDTH: usize = 640;
/// The most frames of an animation, and the most pairs: it is built in memory, 1.2 MB each.
const MOST_MOVING: [usize; 2] = [48, 24];
/// How long a frame is shown, and each of a pair, which is there to be looked at.
const DELAY_MS: [u16; 2] = [250, 800];
/// The most pictures of a contact sheet, and their width.
const MOST_SMALL: usize = 48;
const SMALL_WIDTH: usize = 240;
/// Frames whose depths tell the range of the colours.
const MOST_RANGED: usize = 12;

/// What is shown beside the recording.
#[derive(Clone, Copy)]
pub enum After<'a> {
    /// Nothing.
    Nothing,
    /// The recording as it would be after these corrections.
    Corrected(&'a Plan),
    /// Another recording's frames of the same ids.
    Recording(&'a Recording),
}

/// Over which depths the colours run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// All that is seen in a spread of the frames: one colour is one depth in all pictures.
    Recording,
    /// Of each frame its own: the most to be seen in each.
    Frame,
    /// These, metres.
    Given([f64; 2]),
}

/// Left for right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flip {
    /// As recorded.
    No,
    /// The other way round: mirrored recordings as others see the scene, others as in a mirror.
    Yes,
}

/// What is drawn.
pub struct DepthPictures<'a> {
    /// Of this recording.
    pub recording: &'a Recording,
    /// What is shown beside it.
    pub after: After<'a>,
    /// Indices of frames; all where `None`.
    pub frames: Option<Vec<usize>>,
    /// Over which depths the colours run.
    pub range: Range,
    /// How depth is laid over colour; its range is `range`'s.
    pub style: DepthStyle,
    /// Left for right.
    pub flip: Flip,
    /// Whether an animation is written too.
    pub animation: Animation,
}

/// Whether an animation is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Animation {
    /// None.
    No,
    /// `overlay.apng`: all frames one after the other; of pairs before and after by turns. At most 48, or 24 pairs,
    /// spread evenly.
    Yes,
}

/// What was drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Frames with both images, in order.
    pub frames: Vec<DrawnFrame>,
    /// Frames that were left out, because they lack colour or depth (or, beside another recording, that frame there).
    pub left_out: Vec<usize>,
    /// Depths that the ends of the colours stand for, metres, where they are the same in all pictures.
    pub range_m: Option<[f64; 2]>,
    /// Files beside the frames' own: the contact sheet, the animation.
    pub others: Vec<String>,
}

/// One picture.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct DrawnFrame {
    /// Index in the recording.
    pub frame: usize,
    /// As written in the file.
    pub id: String,
    /// Its name.
    pub file: String,
    /// Fraction of the depth map without measurement; after the correction, too, where there is one.
    pub holes: Vec<f64>,
    /// Median of the depths, metres; NaN where there are none.
    pub median_m: Vec<f64>,
}

/// One side of a picture.
struct Shot {
    title: &'static str,
    color: Rgb,
    depth: DepthMap,
}

impl DepthPictures<'_> {
    /// Draws into the sink, frames in batches on all cores; `observer` is told how many of how many are done.
    ///
    /// Errors: a frame that is not there; no frame with both colour and depth; images of different sizes; files that
    /// cannot be read or written. After an error the sink holds part of the files and must be dropped.
    pub fn draw<S: Output>(
        &self,
        sink: &mut S,
        observer: &mut dyn FnMut(usize, usize),
    ) -> Result<Drawn, Error> {
        let asked = chosen(self.recording, self.frames.as_deref())?;
        let (frames, left_out): (Vec<usize>, Vec<usize>) =
            asked.iter().partition(|&&frame| self.other(frame).is_some());
        if frames.is_empty() {
            return Err(self.nothing(&asked));
        }
        let corrector = match self.after {
            After::Corrected(plan) => Some(Corrector::new(self.recording, plan)?),
            _ => None,
        };
        let corrector = corrector.as_ref();
        let style = match self.range {
            Range::Frame => None,
            Range::Given(range_m) => Some(DepthStyle { range_m, ..self.style }),
            Range::Recording => Some(DepthStyle { range_m: self.common(&frames)?, ..self.style }),
        };
        let mut drawn = Drawn {
            frames: Vec::new(),
            left_out,
            range_m: style.map(|s| s.range_m),
            others: Vec::new(),
        };
        let small = spread(&frames, MOST_SMALL);
        let mut thumbnails = Vec::new();
        in_batches(
            &frames,
            |&frame| {
                let shots = self.shots(frame, corrector)?;
                let style = style.unwrap_or_else(|| self.own(&shots));
                let width = PANEL_WIDTHS[shots.len() - 1].max(shots[0].color.width());
                let plate = self.plate(frame, &shots, &style, width);
                let image = plate.draw(plate.panels[0].image.height() as f64 / 60.0);
                let thumbnail = small.contains(&frame).then(|| {
                    let shot = shots.last().expect("at least one");
                    style.over(&shot.color, &shot.depth, SMALL_WIDTH)
                });
                let holes = shots.iter().map(|shot| holes(&shot.depth)).collect();
                let median_m = shots.iter().map(|shot| median_m(&shot.depth)).collect();
                let source = &self.recording.frames[frame];
                let file = format!("overlay_{}.png", source.id.replace('/', "_"));
                let done = DrawnFrame { frame, id: source.id.clone(), file, holes, median_m };
                Ok::<_, Error>((done, image.to_png(), thumbnail))
            },
            |index, (done, png, thumbnail)| {
                sink.write(&done.file, &png)?;
                thumbnails.extend(thumbnail.map(|t| (format!("frame {}", done.frame), t)));
                drawn.frames.push(done);
                observer(index + 1, frames.len());
                Ok(())
            },
        )?;
        if thumbnails.len() > 1 {
            let heading = match self.after {
                After::Nothing => self.recording.name.clone(),
                _ => format!("{}, corrected", self.recording.name),
            };
            let bar = style.and_then(|style| style.bar());
            sink.write("sheet.png", &contact_sheet(heading, thumbnails, bar).to_png())?;
            drawn.others.push("sheet.png".to_owned());
        }
        if self.animation == Animation::Yes {
            let moving = self.moving(&frames, corrector, style)?;
            sink.write("overlay.apng", &moving)?;
            drawn.others.push("overlay.apng".to_owned());
        }
        Ok(drawn)
    }

    /// Of a spread of the frames the one with most edges in its depth, drawn with these titles: its index and picture.
    pub(super) fn most_edges(&self, titles: [&'static str; 2]) -> Result<(usize, Rgb), Error> {
        let frames = chosen(self.recording, self.frames.as_deref())?;
        let whole: Vec<usize> =
            frames.iter().copied().filter(|&f| self.other(f).is_some()).collect();
        let mut best: Option<(usize, usize)> = None;
        for frame in spread(&whole, MOST_RANGED) {
            let n = n_edges(&self.recording.depth(frame)?);
            if best.is_none_or(|(most, _)| n > most) {
                best = Some((n, frame));
            }
        }
        let Some((_, frame)) = best else { return Err(self.nothing(&frames)) };
        let corrector = match self.after {
            After::Corrected(plan) => Some(Corrector::new(self.recording, plan)?),
            _ => None,
        };
        let mut shots = self.shots(frame, corrector.as_ref())?;
        for (shot, title) in shots.iter_mut().zip(titles) {
            shot.title = title;
        }
        let plate = self.plate(frame, &shots, &self.style, MOVING_WIDTH);
        Ok((frame, plate.draw(plate.panels[0].image.height() as f64 / 36.0)))
    }

    /// All plates of the animation; they are drawn again, smaller.
    fn moving(
        &self,
        frames: &[usize],
        corrector: Option<&Corrector<'_>>,
        style: Option<DepthStyle>,
    ) -> Result<Vec<u8>, Error> {
        let pair = usize::from(!matches!(self.after, After::Nothing));
        let mut images: Vec<Rgb> = Vec::new();
        in_batches(
            &spread(frames, MOST_MOVING[pair]),
            |&frame| {
                let shots = self.shots(frame, corrector)?;
                let style = style.unwrap_or_else(|| self.own(&shots));
                let plates = shots.chunks(1).map(|shot| {
                    let plate = self.plate(frame, shot, &style, MOVING_WIDTH);
                    plate.draw(plate.panels[0].image.height() as f64 / 48.0)
                });
                Ok::<_, Error>(plates.collect::<Vec<Rgb>>())
            },
            |_, plates| {
                images.extend(plates);
                Ok(())
            },
        )?;
        let size = |image: &Rgb| (image.width(), image.height());
        let first = size(&images[0]);
        images.retain(|image| size(image) == first);
        Ok(animated_png(images.len(), DELAY_MS[pair], images))
    }

    /// The frame's index beside the recording, where everything is there.
    fn other(&self, frame: usize) -> Option<usize> {
        let whole = |frame: &Frame| frame.color.is_some() && frame.depth.is_some();
        let source = &self.recording.frames[frame];
        if !whole(source) {
            return None;
        }
        match self.after {
            After::Recording(other) => {
                other.frames.iter().position(|f| f.id == source.id && whole(f))
            }
            _ => Some(frame),
        }
    }

    fn nothing(&self, asked: &[usize]) -> Error {
        let has = |part: fn(&Frame) -> bool| asked.iter().any(|&f| part(&self.recording.frames[f]));
        let (what, remedy) = if !has(|f| f.depth.is_some()) {
            ("a depth image", "copy the depth_*.png files, too")
        } else if !has(|f| f.color.is_some()) {
            ("a colour image", "copy the rgb_*.png files, too")
        } else if matches!(self.after, After::Recording(_)) {
            ("a frame of the same time in the other recording", "give its own correction")
        } else {
            (
                "both colour and depth",
                "copy the rgb_*.png and depth_*.png files of the same moments",
            )
        };
        let recording = self.recording.place().to_owned();
        Error::NothingToDraw { recording, n_frames: asked.len(), what, remedy }
    }

    /// The sides of a frame's picture, of one size.
    fn shots(&self, frame: usize, corrector: Option<&Corrector<'_>>) -> Result<Vec<Shot>, Error> {
        let other = self.other(frame).expect("frames without were left out");
        let alone = matches!(self.after, After::Nothing);
        let title = if alone { "depth over colour" } else { "before" };
        let mut shots = vec![Shot {
            title,
            color: self.recording.color(frame)?,
            depth: self.recording.depth(frame)?,
        }];
        let after = |color, depth| Shot { title: "after", color, depth };
        match (self.after, corrector) {
            (After::Recording(there), _) => {
                shots.push(after(there.color(other)?, there.depth(other)?))
            }
            (_, Some(corrector)) => {
                shots.push(after(corrector.color(frame)?, corrector.depth(frame)?));
            }
            _ => {}
        }
        for shot in &mut shots {
            let sizes = [
                [shot.color.width(), shot.color.height()],
                [shot.depth.width(), shot.depth.height()],
            ];
            if sizes[0] != sizes[1] {
                let recording = self.recording.place().to_owned();
                let what = ["the colour image", "the depth map"];
                return Err(Error::Sizes { recording, frame, what, sizes });
            }
            if self.flip == Flip::Yes {
                shot.color = shot.color.mirrored();
                shot.depth = shot.depth.mirrored();
            }
        }
        Ok(shots)
    }

    fn plate(&self, frame: usize, shots: &[Shot], style: &DepthStyle, width: usize) -> Plate {
        let source = &self.recording.frames[frame];
        let panel = |shot: &Shot| Panel {
            title: match style.bar() {
                Some(_) => shot.title.to_owned(),
                None => format!(
                    "{}: edges of the depth",
                    shot.title.replace("depth over colour", "as recorded")
                ),
            },
            foot: foot(&shot.depth),
            image: style.over(&shot.color, &shot.depth, width),
        };
        Plate {
            heading: format!(
                "{} · frame {frame} (0 to {}) · {}",
                self.recording.name,
                self.recording.frames.len() - 1,
                source.id
            ),
            panels: shots.iter().map(panel).collect(),
            bar: style.bar(),
        }
    }

    /// The range of a spread of the frames.
    fn common(&self, frames: &[usize]) -> Result<[f64; 2], Error> {
        let mut maps = Vec::new();
        for frame in spread(frames, MOST_RANGED) {
            maps.push(self.recording.depth(frame)?);
        }
        Ok(depth_range_m(&maps).unwrap_or(self.style.range_m))
    }

    fn own(&self, shots: &[Shot]) -> DepthStyle {
        let range_m = depth_range_m(shots.iter().map(|shot| &shot.depth));
        DepthStyle { range_m: range_m.unwrap_or(self.style.range_m), ..self.style }
    }
}

fn foot(depth: &DepthMap) -> String {
    let share = 100.0 * holes(depth);
    match median_m(depth) {
        median if median.is_nan() => "no depth at all".to_owned(),
        median => format!("median {:.1} mm · without depth {share:.1} %", 1e3 * median),
    }
}

fn holes(depth: &DepthMap) -> f64 {
    let holes = depth.depth_m().iter().filter(|z| z.is_nan()).count();
    holes as f64 / depth.depth_m().len().max(1) as f64
}

fn median_m(depth: &DepthMap) -> f64 {
    let mut depths: Vec<f32> = depth.depth_m().iter().copied().filter(|z| !z.is_nan()).collect();
    if depths.is_empty() {
        return f64::NAN;
    }
    let middle = depths.len() / 2;
    f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1)
}
