//! `truedepth calibrate REC`

use std::path::Path;

use truedepth::{
    board::CharucoBoard,
    calibrate::{
        self, FrameCorners, Input as Views, Method, Model, RollingShutter, calibrate_from,
        coverage, guess_intrinsics,
    },
    export::{self, Format},
    measure::{Measurer, look_for_board},
    recording::{Factory, Recording},
    report::{self, wire},
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
    let document = wire::Calibration::new(&name, named, seen.factory.as_ref(), &calibration);
    if let (Some(file), Some(format)) = (&args.export, format) {
        write(file, format, &document, args, terminal)?;
    }
    if args.json.json {
        let document = wire::Document::Calibrate(Box::new(document));
        terminal.result(&report::to_json(&document))?;
    } else {
        terminal.result(&table(&document, seen.n_images))?;
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

fn write(
    file: &Path,
    format: Option<Format>,
    document: &wire::Calibration,
    args: &CalibrateArgs,
    terminal: &Terminal,
) -> Result<(), Failure> {
    let text = match format {
        None => report::to_json(&wire::Document::Calibrate(Box::new(document.clone()))),
        Some(format) => {
            let exported = export::calibration(&document.camera()?, &document.recording, format);
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
    };
    let replace = if args.force { Replace::WhatIsThere } else { Replace::Nothing };
    write_together(&[(file.to_owned(), text.into_bytes())], replace)?;
    terminal.say(&format!("calibration: {}", file.display()));
    Ok(())
}

type Row = (&'static str, String);

/// So many of something.
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// What a person wants to know, in columns.
fn table(calibration: &wire::Calibration, n_images: usize) -> String {
    let how = match calibration.method.as_str() {
        "paper" => "--method paper",
        "auto" => "--method auto",
        "plain" => "--model, as OpenCV's calibrateCamera",
        _ => "--model",
    };
    let mut rows = vec![
        ("recording", calibration.recording.clone()),
        ("model", format!("{} ({how})", calibration.model)),
    ];
    rows.extend(camera_rows(calibration));
    let without = n_images.saturating_sub(calibration.n_views + calibration.rejected.len());
    rows.push((
        "fit",
        format!(
            "rms {:.3} px over {} corners of {} views; of {}, {without} without the board and {} not used; {} left out",
            calibration.rms_px,
            calibration.n_corners,
            calibration.n_views,
            count(n_images, "image"),
            calibration.rejected.len(),
            count(calibration.outliers.len(), "outlier"),
        ),
    ));
    if let Some(chosen) = &calibration.chosen {
        let cost = chosen.focal_sigma_ratio.map_or(String::new(), |ratio| {
            format!("; with all of them, σ from corner noise would be {ratio:.2} times smaller")
        });
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
                candidate.model,
                number(candidate.rms_px),
                held_out(candidate.held_out_rms_px, candidate.held_out_sigma_px),
                focal(candidate.focal_px, candidate.focal_sigma_px),
            ),
        ));
    }
    for (i, surface) in calibration.surfaces.iter().enumerate() {
        rows.push((
            if i == 0 { "boards tried" } else { "" },
            format!(
                "{:<18}  rms {} px, held out {} px, focal length {} px",
                surface.kind,
                number(surface.rms_px),
                held_out(surface.held_out_rms_px, surface.held_out_sigma_px),
                focal(surface.focal_px, surface.focal_sigma_px),
            ),
        ));
    }
    rows.iter().map(|(name, value)| format!("{name:<16}  {value}\n")).collect()
}

fn camera_rows(calibration: &wire::Calibration) -> Vec<Row> {
    let mut focal = with_sigma(calibration.focal_px, calibration.focal_sigma_px, 2);
    focal.push_str(" px");
    let [fx, fy] = calibration.focal_xy_px;
    if fx != fy {
        focal.push_str(&format!(" (fx {fx:.2}, fy {fy:.2})"));
    }
    if let (Some(factory), Some(difference)) =
        (calibration.factory_focal_px, calibration.focal_difference_percent)
    {
        focal.push_str(&format!("   factory {factory:.2} px, {difference:+.2} %"));
    }
    let sigma_of =
        |name: &str| calibration.parameters.iter().find(|p| p.name == name).and_then(|p| p.sigma);
    let is_free = calibration.parameters.iter().any(|p| p.name == "center_x_px");
    let fixed = match (is_free, calibration.factory_focal_px) {
        (true, _) => "",
        (false, Some(_)) => " (the factory's, not measured)",
        (false, None) => " (not measured)",
    };
    let [x, y] = calibration.principal_point_px;
    let center = [(x, "center_x_px"), (y, "center_y_px")]
        .map(|(value, name)| with_sigma(value, sigma_of(name), 2));
    let mut rows = vec![
        ("focal length", focal),
        ("principal point", format!("({}, {}) px{fixed}", center[0], center[1])),
    ];
    for parameter in &calibration.parameters {
        if !parameter.name.ends_with("_px") {
            let value = with_sigma(parameter.value, parameter.sigma, 4);
            rows.push(("", format!("{} {value}", parameter.name)));
        }
    }
    rows
}

fn board_row(calibration: &wire::Calibration) -> Option<Row> {
    let surface = calibration.board_surface.as_ref()?;
    let mut text = format!(
        "not flat ({}): {} mm from its highest to its lowest corner",
        surface.kind,
        with_sigma(surface.peak_to_valley_mm?, surface.peak_to_valley_sigma_mm, 3)
    );
    if let (Some(stretch), Some(shear)) = (surface.print_stretch, surface.print_shear) {
        let percent =
            |value: f64, sigma: Option<f64>| with_sigma(100.0 * value, sigma.map(|s| 100.0 * s), 3);
        text.push_str(&format!(
            "; print stretched by {} %, sheared by {} %",
            percent(stretch, surface.print_stretch_sigma),
            percent(shear, surface.print_shear_sigma),
        ));
    }
    Some(("board", text))
}

fn stability_rows(calibration: &wire::Calibration) -> Vec<Row> {
    let mut rows = Vec::new();
    if let Some([a, b]) = calibration.split_half_focal_px {
        let [sigma_a, sigma_b] = calibration.split_half_focal_sigma_px.unwrap_or([None, None]);
        let [a, b] = [with_sigma(a, sigma_a, 2), with_sigma(b, sigma_b, 2)];
        rows.push(("two halves", format!("focal length {a} px and {b} px")));
    }
    let without: Vec<f64> = calibration.left_out.iter().filter_map(|l| l.focal_px).collect();
    if let (Some(low), Some(high)) =
        (without.iter().copied().reduce(f64::min), without.iter().copied().reduce(f64::max))
    {
        rows.push(("each left out", format!("focal length {low:.2} to {high:.2} px")));
    }
    if let Some(wire::RollingShutter {
        residual_share: Some(share),
        focal_shift_px: Some(shift),
        ..
    }) = &calibration.rolling_shutter
    {
        let percent = 100.0 * share;
        let [still, moving] = RollingShutter::STILL_TO_MOVING;
        let words = if *share < moving {
            format!(
                "views moved while read: with velocities residuals fall to {percent:.0} %, and the focal length comes \
                 out {shift:+.2} px away, less surely; hold the device still"
            )
        } else if *share < still {
            format!(
                "views moved a little while read: with velocities residuals fall to {percent:.0} %, and the focal \
                 length comes out {shift:+.2} px away, less surely"
            )
        } else {
            format!("none: velocities while read leave residuals at {percent:.0} %")
        };
        rows.push(("rolling shutter", words));
    }
    if let Some(grid) = &calibration.projection_uncertainty {
        let sigmas: Vec<f64> = grid.sigma_px.iter().copied().flatten().collect();
        let at = |index: usize| grid.sigma_px.get(index).copied().flatten().unwrap_or(f64::NAN);
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

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |v| format!("{v:.3}"))
}

fn held_out(value: Option<f64>, sigma: Option<f64>) -> String {
    value.map_or("-".to_owned(), |v| with_sigma(v, sigma, 3))
}

fn focal(value: Option<f64>, sigma: Option<f64>) -> String {
    value.map_or("-".to_owned(), |f| with_sigma(f, sigma, 2))
}

fn with_sigma(value: f64, sigma: Option<f64>, decimals: usize) -> String {
    match sigma {
        Some(sigma) => format!("{value:.decimals$} ± {sigma:.decimals$}"),
        None => format!("{value:.decimals$}"),
    }
}
