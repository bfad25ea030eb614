//! `truedepth calibrate REC`

use std::path::Path;

use truedepth::{
    board::CharucoBoard,
    calibrate::{
        self, Calibration, Estimate, FrameCorners, Input as Views, Method, Model, RollingShutter,
        calibrate_from, coverage, guess_intrinsics,
    },
    camera::Camera,
    measure::{Measurer, look_for_board},
    recording::{Factory, Recording},
    wire::{
        self,
        export::{self, Format},
    },
};

use crate::{
    args::{self, CalibrateArgs, ExportFormat},
    failure::Failure,
    files::{Replace, write_together},
    input::{self, Input},
    outcome::Outcome,
    terminal::{Bar, Terminal},
};

pub(crate) fn run(args: &CalibrateArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let format = args.export.as_deref().map(|file| format_of(file, args.format)).transpose()?;
    let seen = look(args, terminal)?;
    let method = method(args, &seen);
    let named = match method {
        Method::Paper => "paper",
        Method::Auto | Method::Unaided => "auto",
        Method::Robust(_) => "model",
        Method::Plain(_) => "plain",
    };
    let (name, calibration) = measure(&seen, method, args.views)?;
    let factory = seen.factory.as_ref();
    let detail = args.detail.detail();
    let document =
        || wire::to_json(&wire::Calibration::new(&name, named, factory, &calibration, detail));
    if let (Some(file), Some(format)) = (&args.export, format) {
        let text = match format {
            None => document(),
            Some(format) => exported(file, format, &name, &calibration.camera, terminal),
        };
        let replace = if args.force { Replace::WhatIsThere } else { Replace::Nothing };
        write_together(&[(file.clone(), text.into_bytes())], replace)?;
        terminal.say(&format!("calibration: {}", file.display()));
    }
    if args.json.json {
        terminal.result(&document())?;
    } else {
        let factory_px = factory.map(|f| f.intrinsics.focal_px());
        let how = match named {
            "paper" => "--method paper",
            "auto" => "--method auto",
            "plain" => "--model, as OpenCV's calibrateCamera",
            _ => "--model",
        };
        let model = format!("{} ({how})", calibration.model.name());
        let rows = [("recording", name.clone()), ("model", model)].into_iter();
        let rows = rows.chain(table(&calibration, factory_px, seen.n_images));
        let lines: String = rows.map(|(name, value)| format!("{name:<16}  {value}\n")).collect();
        terminal.result(&lines)?;
    }
    if 2 * seen.frames.len() < seen.n_images {
        terminal.warn(&format!(
            "the board was found in {} of {} images: look at what is seen of it with `truedepth detect`, and check \
             --board",
            seen.frames.len(),
            seen.n_images
        ));
    }
    if let Some(sigma_px) = calibration.unknown_px() {
        let missing = coverage(&seen.views(&seen.start())).advice();
        terminal.say(&format!(
            "cannot tell everywhere in the image: there a point may be drawn {sigma_px:.1} px off (1 σ){}",
            missing.map_or(String::new(), |advice| format!("; {advice}"))
        ));
    }
    Ok(Outcome::Clean)
}

/// What was seen of the board.
struct Seen {
    name: String,
    board: CharucoBoard,
    factory: Option<Factory>,
    size_px: [usize; 2],
    /// Those with corners.
    frames: Vec<FrameCorners>,
    n_images: usize,
}

impl Seen {
    fn views<'a>(&'a self, factory: &'a truedepth::camera::Intrinsics) -> Views<'a> {
        let tables = self.factory.as_ref().and_then(|f| f.tables.as_ref());
        Views { board: &self.board, factory, tables, frames: &self.frames }
    }

    /// The factory's intrinsics, or a guess.
    fn start(&self) -> truedepth::camera::Intrinsics {
        match &self.factory {
            Some(factory) => factory.intrinsics,
            None => guess_intrinsics(&self.board, &self.frames, self.size_px),
        }
    }
}

fn method(args: &CalibrateArgs, seen: &Seen) -> Method {
    let model = args.model.as_deref();
    match model.and_then(|name| Model::ALL.into_iter().find(|m| m.name() == name)) {
        Some(model) if args.plain => Method::Plain(model),
        Some(model) => Method::Robust(model),
        None if matches!(args.method, args::Method::Paper) => Method::Paper,
        None if seen.factory.is_none() => Method::Unaided,
        None => Method::Auto,
    }
}

/// The corners of all images, in order.
fn look(args: &CalibrateArgs, terminal: &Terminal) -> Result<Seen, Failure> {
    let given = input::board(&args.input.board)?;
    let known = |own: Option<&CharucoBoard>, place: &str| {
        given.as_ref().or(own).cloned().ok_or_else(|| {
            Failure::new(format!("{place}: the board is not known"))
                .hint("say which with --board, like --board 10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL")
        })
    };
    let place = args.recording.display().to_string();
    let recording = match Input::at(&args.recording, &args.input)? {
        Input::Image(file) => input::images(&place, vec![file], &args.input)?,
        Input::Recordings(found) => {
            let n = found.len();
            let mut found = found.into_iter();
            let (Some(one), None) = (found.next(), found.next()) else {
                let message = format!("{place} holds {n} recordings; a calibration is of one");
                return Err(Failure::new(message).hint("name one of them"));
            };
            one.open()?
        }
    };
    let board = known(recording.board.as_ref(), recording.place())?;
    let n_images = recording.frames.iter().filter(|frame| frame.color.is_some()).count();
    let (frames, size_px) = corners(&recording, &board, terminal)?;
    let factory = recording.factory().and_then(|factory| factory.at_size(size_px));
    Ok(Seen { name: recording.name.clone(), board, factory, size_px, frames, n_images })
}

/// Searches all images; those of another size than the first are refused.
fn corners(
    recording: &Recording,
    board: &CharucoBoard,
    terminal: &Terminal,
) -> Result<(Vec<FrameCorners>, [usize; 2]), Failure> {
    let name = &recording.name;
    let bar = terminal.progress(name, recording.frames.len());
    let mut size_px = None;
    let mut seen = Vec::new();
    let searched = look_for_board(recording, &Measurer::new(board), &Bar(&bar), |frame, found| {
        let found = found?;
        let size = found.size_px.unwrap_or_default();
        let first = *size_px.get_or_insert(size);
        if size != first {
            return Err(Failure::new(format!(
                "{name}: images of {}x{} and of {}x{} pixels; a calibration is of one size",
                first[0], first[1], size[0], size[1]
            ))
            .hint("put images of one camera and one size into a folder of their own"));
        }
        if found.n_corners > 0 {
            seen.push(FrameCorners { frame, corners: found.observation.corners });
        }
        Ok(())
    });
    bar.finish_and_clear();
    searched?;
    let size_px =
        size_px.ok_or_else(|| Failure::new(format!("{name}: there is no image in it")))?;
    Ok((seen, size_px))
}

fn measure(
    seen: &Seen,
    method: Method,
    max_views: usize,
) -> Result<(String, calibrate::Calibration), Failure> {
    if seen.frames.is_empty() {
        return Err(Failure::new(format!("{}: the board was not seen in any image", seen.name))
            .hint("check --board with `truedepth detect`"));
    }
    let start = seen.start();
    let views = seen.views(&start);
    let calibration = calibrate_from(&views, method, max_views).map_err(|error| {
        let failure = Failure::new(format!("{}: no intrinsics: cannot tell: {error}", seen.name));
        match coverage(&views).advice() {
            Some(advice) => failure.hint(advice),
            None => failure,
        }
    })?;
    Ok((seen.name.clone(), calibration))
}

/// A format by its name, or else by that of the file; `None` is our own.
fn format_of(file: &Path, typed: Option<ExportFormat>) -> Result<Option<Format>, Failure> {
    if let Some(format) = typed {
        return Ok(match format {
            ExportFormat::Truedepth => None,
            ExportFormat::Opencv => Some(Format::OpenCv),
            ExportFormat::Kalibr => Some(Format::Kalibr),
            ExportFormat::Mrcal => Some(Format::Mrcal),
            ExportFormat::Colmap => Some(Format::Colmap),
            ExportFormat::Ros => Some(Format::Ros),
            ExportFormat::Open3d => Some(Format::Open3d),
        });
    }
    let extension = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "json" => Ok(None),
        "yml" | "yaml" => Ok(Some(Format::OpenCv)),
        "cameramodel" => Ok(Some(Format::Mrcal)),
        "txt" => Ok(Some(Format::Colmap)),
        _ => Err(Failure::new(format!("{}: no format ends like that", file.display()))
            .hint("end it in .yml, .cameramodel, .txt or .json, or say --format")),
    }
}

/// The camera in this format; what the format does not hold is said.
fn exported(
    file: &Path,
    format: Format,
    name: &str,
    camera: &Camera,
    terminal: &Terminal,
) -> String {
    let exported = export::calibration(camera, name, format);
    if let Some(residual) = exported.residual {
        terminal.warn(&format!(
            "{}: {} does not hold this lens; the one written differs by {:.3} px (RMS; at most {:.3} px)",
            file.display(),
            format.name(),
            residual.rms_px,
            residual.max_px
        ));
    }
    exported.text
}

type Row = (&'static str, String);

/// So many of something.
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// What a person wants to know, in columns.
fn table(calibration: &Calibration, factory_px: Option<f64>, n_images: usize) -> Vec<Row> {
    let mut rows = camera_rows(calibration, factory_px);
    let n_views = calibration.views.len();
    let without = n_images.saturating_sub(n_views + calibration.rejected.len());
    rows.push((
        "fit",
        format!(
            "rms {:.3} px over {} corners of {} views; of {}, {without} without the board and {} not used; {} left out",
            calibration.rms_px,
            calibration.n_corners(),
            n_views,
            count(n_images, "image"),
            calibration.rejected.len(),
            count(calibration.outliers.len(), "outlier"),
        ),
    ));
    if let Some(chosen) = &calibration.chosen {
        let ratio = chosen.focal_sigma_ratio;
        let cost = match ratio.is_finite() {
            true => {
                format!("; with all of them, σ from corner noise would be {ratio:.2} times smaller")
            }
            false => String::new(),
        };
        rows.push((
            "views chosen",
            format!(
                "the {} that tell most, of {} ({}){cost} (--views N)",
                chosen.n_chosen,
                chosen.n_usable,
                count(chosen.n_pictures, "different picture")
            ),
        ));
    }
    rows.extend(board_row(calibration));
    rows.extend(stability_rows(calibration));
    for (i, candidate) in calibration.candidates.iter().enumerate() {
        rows.push((
            if i == 0 { "models tried" } else { "" },
            format!(
                "{:<18}  rms {} px, held out {} px, focal length {} px",
                candidate.model.name(),
                number(candidate.rms_px),
                held_out(candidate.held_out_rms_px, candidate.held_out_sigma_px),
                with_sigma(candidate.focal_px, 2),
            ),
        ));
    }
    for (i, surface) in calibration.surfaces.iter().enumerate() {
        rows.push((
            if i == 0 { "boards tried" } else { "" },
            format!(
                "{:<18}  rms {} px, held out {} px, focal length {} px",
                surface.kind.name(),
                number(surface.rms_px),
                held_out(surface.held_out_rms_px, surface.held_out_sigma_px),
                with_sigma(surface.focal_px, 2),
            ),
        ));
    }
    rows
}

fn camera_rows(calibration: &Calibration, factory_px: Option<f64>) -> Vec<Row> {
    let k = &calibration.camera.intrinsics;
    // The fit's own number is the horizontal one.
    let sigma = calibration.focal_px().sigma * k.focal_px() / k.fx;
    let mut focal = with_sigma(Estimate { value: k.focal_px(), sigma }, 2) + " px";
    if k.fx != k.fy {
        focal.push_str(&format!(" (fx {:.2}, fy {:.2})", k.fx, k.fy));
    }
    if let Some(factory) = factory_px {
        let difference = 100.0 * (k.focal_px() / factory - 1.0);
        focal.push_str(&format!("   factory {factory:.2} px, {difference:+.2} %"));
    }
    let fixed = match (calibration.parameter("center_x_px"), factory_px) {
        (Some(_), _) => "",
        (None, Some(_)) => " (the factory's, not measured)",
        (None, None) => " (not measured)",
    };
    let center = [(k.cx, "center_x_px"), (k.cy, "center_y_px")].map(|(value, name)| {
        let free = calibration.parameter(name);
        with_sigma(Estimate { value, sigma: free.map_or(f64::NAN, |e| e.sigma) }, 2)
    });
    let mut rows = vec![
        ("focal length", focal),
        ("principal point", format!("({}, {}) px{fixed}", center[0], center[1])),
    ];
    for parameter in &calibration.parameters {
        if !parameter.name.ends_with("_px") {
            let value = with_sigma(parameter.estimate, 4);
            rows.push(("", format!("{} {value}", parameter.name)));
        }
    }
    rows
}

fn board_row(calibration: &Calibration) -> Option<Row> {
    let surface = calibration.surface.as_ref()?;
    let times =
        |factor: f64, e: Estimate| Estimate { value: factor * e.value, sigma: factor * e.sigma };
    let mut text = format!(
        "not flat ({}): {} mm from its highest to its lowest corner",
        surface.kind.name(),
        with_sigma(times(1e3, surface.size_m()), 3)
    );
    if let Some([stretch, shear]) = surface.print.map(|print| print.map(|e| times(100.0, e))) {
        text.push_str(&format!(
            "; print stretched by {} %, sheared by {} %",
            with_sigma(stretch, 3),
            with_sigma(shear, 3),
        ));
    }
    Some(("board", text))
}

fn stability_rows(calibration: &Calibration) -> Vec<Row> {
    let mut rows = Vec::new();
    let k = &calibration.camera.intrinsics;
    // Of the mean of both focal lengths.
    let mean = k.focal_px() / k.fx;
    if let Some(halves) = calibration.split_half_focal_px {
        let [a, b] = halves.map(|half| {
            with_sigma(Estimate { value: mean * half.value, sigma: mean * half.sigma }, 2)
        });
        rows.push(("two halves", format!("focal length {a} px and {b} px")));
    }
    let without: Vec<f64> =
        calibration.left_out.iter().map(|l| mean * l.focal_px).filter(|f| f.is_finite()).collect();
    if let (Some(low), Some(high)) =
        (without.iter().copied().reduce(f64::min), without.iter().copied().reduce(f64::max))
    {
        rows.push(("each left out", format!("focal length {low:.2} to {high:.2} px")));
    }
    if let Some(RollingShutter { residual_share: share, focal_shift_px: shift, .. }) =
        calibration.rolling_shutter
    {
        let percent = 100.0 * share;
        let [still, moving] = RollingShutter::STILL_TO_MOVING;
        let words = if share < moving {
            format!(
                "views moved while read: with velocities residuals fall to {percent:.0} %, and the focal length comes \
                 out {shift:+.2} px away, less surely; hold the device still"
            )
        } else if share < still {
            format!(
                "views moved a little while read: with velocities residuals fall to {percent:.0} %, and the focal \
                 length comes out {shift:+.2} px away, less surely"
            )
        } else {
            format!("none: velocities while read leave residuals at {percent:.0} %")
        };
        rows.push(("rolling shutter", words));
    }
    let grid =
        calibration.median_distance_m().and_then(|m| calibration.projection_uncertainty(17, 13, m));
    if let Some(grid) = grid {
        let sigmas: Vec<f64> = grid.sigma_px.iter().copied().filter(|s| s.is_finite()).collect();
        let at = |index: usize| grid.sigma_px[index];
        rows.push((
            "projection",
            format!(
                "± {:.2} px in the middle, ± {:.2} px at worst, for points {:.2} m away{}",
                at(grid.sigma_px.len() / 2),
                sigmas.iter().copied().fold(0.0, f64::max),
                grid.depth_m,
                match grid.sigma_px.len() - sigmas.len() {
                    0 => String::new(),
                    n => format!(
                        "; {:.0} % of the image is beyond the lens model",
                        100.0 * n as f64 / grid.sigma_px.len() as f64
                    ),
                }
            ),
        ));
    }
    rows
}

fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:.3}") } else { "-".to_owned() }
}

fn held_out(value: f64, sigma: f64) -> String {
    with_sigma(Estimate { value, sigma }, 3)
}

fn with_sigma(Estimate { value, sigma }: Estimate, decimals: usize) -> String {
    match (value.is_finite(), sigma.is_finite()) {
        (true, true) => format!("{value:.decimals$} ± {sigma:.decimals$}"),
        (true, false) => format!("{value:.decimals$}"),
        (false, _) => "-".to_owned(),
    }
}
