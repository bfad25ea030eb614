//! Everything that the data allow.

use super::{
    Check, Data, Missing, Printed, Section, Set,
    paper::{FOCAL, PUBLISHED, Published, WHERE},
    recompute,
};
use crate::{
    audit::{Audit, Options, audit},
    calibrate::{Estimate, KnownCamera},
    correct::{Rectifier, Straightness, Treatment, board_lines},
    diagnose::{Entry, Registry, Sheet},
    measure::{self, Method, Silent},
    recording::StreamState,
};

/// The paper, reproduced.
#[derive(Debug)]
pub struct Reproduction {
    /// Where the data were looked for.
    pub place: String,
    /// What was found, in order.
    pub data: Vec<Data>,
    /// Printed numbers beside ours.
    pub sections: Vec<Section>,
    /// Depth against the board: figure 5.
    pub depth: Vec<DepthEvaluation>,
    /// Straightness of the images: figure 7.
    pub lens: Vec<Lens>,
    /// What cannot be reproduced here, and how to.
    pub missing: Vec<Missing>,
}

/// Depth of one recording straight at the board, with the factory's and the own intrinsics.
#[derive(Debug)]
pub struct DepthEvaluation {
    /// Index into the data.
    pub data: usize,
    /// As it is sold.
    pub title: String,
    /// Both comparisons.
    pub audit: Box<Audit>,
    /// Whether the own intrinsics come from a calibration recording of this device.
    pub has_own: bool,
}

/// Straightness of one recording's images.
#[derive(Debug)]
pub struct Lens {
    /// Index into the data.
    pub data: usize,
    /// As it is sold.
    pub title: String,
    /// What was measured.
    pub straightness: Straightness,
    /// The lens it was measured with.
    pub rectifier: Rectifier,
    /// The frame in which most of the board was seen.
    pub frame: usize,
}

/// What is known of one calibration recording.
struct Calibrated {
    data: usize,
    paper: Audit,
    auto: Audit,
}

/// Reproduces the paper from these recordings; `observer` is told what is being worked on.
///
/// Errors: as [`audit()`]: a file that cannot be read or decoded.
pub fn reproduce(
    place: &str,
    data: Vec<Data>,
    observer: &mut dyn FnMut(&str),
) -> Result<Reproduction, measure::Error> {
    let registry = Registry::published();
    let mut calibrated = Vec::new();
    for (index, one) in data.iter().enumerate().filter(|(_, one)| one.set == Set::Calibration) {
        observer(&format!("{}: calibrating", one.recording.name));
        let run = |method| audit(&one.recording, &Options::new(method), &Silent);
        calibrated.push(Calibrated {
            data: index,
            paper: run(Method::Paper)?,
            auto: run(Method::Auto)?,
        });
    }
    let mut depth = Vec::new();
    for (index, one) in data.iter().enumerate().filter(|(_, one)| one.set == Set::DepthEval) {
        observer(&format!("{}: depth against the board", one.recording.name));
        let own = calibrated
            .iter()
            .find(|c| one.device.is_some() && data[c.data].device == one.device)
            .and_then(|c| c.paper.camera.clone());
        let has_own = own.is_some();
        let method =
            own.map_or(Method::Paper, |camera| Method::Given(Box::new(KnownCamera::exact(camera))));
        let audit = Box::new(audit(&one.recording, &Options::new(method), &Silent)?);
        depth.push(DepthEvaluation { data: index, title: title(one), audit, has_own });
    }
    let lens: Vec<Lens> = calibrated.iter().filter_map(|c| lens(&data[c.data], c)).collect();
    let sections = vec![
        recompute::equations(&registry),
        focal(&data, &calibrated),
        depth_errors(&data, &depth),
        recompute::devices(&registry),
        recorded(&data, &registry),
        straightness(&lens),
    ];
    let missing = missing(&data, &lens);
    Ok(Reproduction { place: place.to_owned(), data, sections, depth, lens, missing })
}

/// What people call the device.
fn title(data: &Data) -> String {
    let published = PUBLISHED.iter().find(|p| Some(p.device) == data.device.as_deref());
    published.map_or_else(|| data.recording.name.clone(), |p| p.title.to_owned())
}

fn published(data: &Data) -> Option<&'static Published> {
    PUBLISHED.iter().find(|p| Some(p.device) == data.device.as_deref())
}

/// What keeps our numbers from being those of the whole recording; empty where nothing does.
fn partly(data: &Data) -> String {
    let (here, listed) = (data.recording.frames.len(), data.n_listed());
    if here < listed { format!("{here} of {listed} frames are here") } else { String::new() }
}

fn focal_of(audit: &Audit) -> Option<Estimate> {
    audit.calibration.as_ref().map(|calibration| calibration.focal_px())
}

/// The table of section 5.1.
fn focal(data: &[Data], calibrated: &[Calibrated]) -> Section {
    let mut checks = recompute::focal_differences();
    for one in calibrated {
        let source = &data[one.data];
        let name = title(source);
        let own = focal_of(&one.paper);
        let factory = one.paper.factory.as_ref().map(|f| f.intrinsics.focal_px());
        if let Some(row) = nearest_row(source, factory) {
            let exact = |value| Estimate { value, sigma: 0.0 };
            let check = Check::measured(
                format!("{name}: factory focal length, row “{}”", row.title),
                Some(Printed { value: row.factory_px, decimals: 2 }),
                factory.map(exact),
                "px",
            );
            checks.push(explained(check));
            checks.push(
                Check::measured(
                    format!("{name}: focal length as the paper calibrates, row “{}”", row.title),
                    Some(Printed { value: row.own_px, decimals: 2 }),
                    own,
                    "px",
                )
                .noted(partly(source)),
            );
        }
        if let Some(p) = published(source) {
            let decimals = p.factory_decimals;
            checks.push(Check::measured(
                format!("{name}: factory focal length, README of the data"),
                Some(Printed { value: p.focal[0], decimals }),
                factory.map(|value| Estimate { value, sigma: 0.0 }),
                "px",
            ));
            checks.push(
                Check::measured(
                    format!("{name}: focal length as the paper calibrates, README of the data"),
                    Some(Printed { value: p.focal[1], decimals: 2 }),
                    own,
                    "px",
                )
                .noted(format!(
                    "the published Python gives {:.2} px with OpenCV 4.5.5",
                    p.rerun_px
                )),
            );
            let percent = own.zip(factory).map(|(own, factory)| Estimate {
                value: 100.0 * (own.value / factory - 1.0),
                sigma: 100.0 * own.sigma / factory,
            });
            checks.push(Check::measured(
                format!("{name}: difference, README of the data"),
                Some(Printed { value: p.focal[2], decimals: 2 }),
                percent,
                "%",
            ));
        }
        checks.push(
            Check::measured(
                format!("{name}: focal length with lens and board's shape"),
                None,
                focal_of(&one.auto),
                "px",
            )
            .noted("beyond the paper: the model that predicts held-out views best"),
        );
    }
    Section {
        id: "focal",
        title: "Focal lengths (section 5.1)",
        lead: "The printed differences recomputed, and the calibrations repeated as the paper makes them: one focal \
               length, views on a 4 cm grid, at least 9 corners."
            .to_owned(),
        checks,
    }
}

/// The row of the table whose factory focal length is nearest.
fn nearest_row(data: &Data, factory_px: Option<f64>) -> Option<&'static super::FocalRow> {
    let factory_px = factory_px?;
    FOCAL.iter().filter(|row| Some(row.device) == data.device.as_deref()).min_by(|a, b| {
        (a.factory_px - factory_px).abs().total_cmp(&(b.factory_px - factory_px).abs())
    })
}

/// Section 4.2.
fn depth_errors(data: &[Data], evaluations: &[DepthEvaluation]) -> Section {
    let mut checks = Vec::new();
    for one in evaluations {
        let in_mm = |e: Estimate| Estimate { value: 1e3 * e.value, sigma: 1e3 * e.sigma };
        let error = |depth: &Option<crate::depth::BoardDepth>| {
            depth.as_ref().and_then(|depth| depth.mean_of_medians_m).map(in_mm)
        };
        let known = published(&data[one.data]);
        let of = |i: usize| known.map(|p| Printed { value: p.depth_mm[i], decimals: 2 });
        let words = known.map_or(String::new(), |p| format!("the paper: {}", p.depth_words));
        checks.push(
            Check::measured(
                format!(
                    "{}: depth error with factory intrinsics (published Python today)",
                    one.title
                ),
                of(0),
                error(&one.audit.factory_depth),
                "mm",
            )
            .noted(words),
        );
        if one.has_own {
            checks.push(Check::measured(
                format!("{}: depth error with own intrinsics (published Python today)", one.title),
                of(1),
                error(&one.audit.own_depth),
                "mm",
            ));
        }
    }
    Section {
        id: "depth",
        title: "Depth against the board (section 4.2, figure 5)",
        lead: "Board minus sensor at the corners, errors beyond 20 mm dropped, median of each frame, mean over frames. \
               σ is the spread over frames; what all frames share (focal length, board) is not in it. The paper prints \
               bounds in words; the numbers beside ours are its published Python's, run with OpenCV 4.5.5."
            .to_owned(),
        checks,
    }
}

/// Device tables against the metadata of the recordings.
fn recorded(data: &[Data], registry: &Registry) -> Section {
    let mut checks = Vec::new();
    let mut seen: Vec<Sheet> = Vec::new();
    for one in data {
        let Some(sheet) = one.recording.factory().and_then(Sheet::from_factory) else { continue };
        if seen.contains(&sheet) {
            continue;
        }
        seen.push(sheet);
        let Some(entry) = registry.identify(&sheet).matches.first().copied() else { continue };
        if one.device.as_deref().is_none_or(|device| device == entry.device) {
            checks.extend(against_row(one, &sheet, entry));
        }
    }
    Section {
        id: "recorded",
        title: "The device tables against the recordings' metadata",
        lead: "Each recording beside the row nearest to it, at the reference dimensions."
            .to_owned(),
        checks,
    }
}

fn against_row(data: &Data, sheet: &Sheet, entry: &Entry) -> Vec<Check> {
    let mut columns = vec![
        ("reference width", sheet.reference[0], entry.sheet.reference[0]),
        ("reference height", sheet.reference[1], entry.sheet.reference[1]),
        ("depth focal length", sheet.focal_px, entry.sheet.focal_px),
        ("depth cx", sheet.center[0], entry.sheet.center[0]),
        ("depth cy", sheet.center[1], entry.sheet.center[1]),
    ];
    if let (Some(ours), Some(printed)) = (sheet.distortion_center, entry.sheet.distortion_center) {
        columns.push(("distortion centre x", ours[0], printed[0]));
        columns.push(("distortion centre y", ours[1], printed[1]));
    }
    columns
        .into_iter()
        .map(|(column, ours, value)| {
            let decimals = if column.starts_with("reference") { 0 } else { 2 };
            let check = Check::measured(
                format!("{} ({}): {column}, row {}", title(data), data.set.name(), entry.name()),
                Some(Printed { value, decimals }),
                Some(Estimate { value: ours, sigma: 0.0 }),
                "px",
            );
            explained(check)
        })
        .collect()
}

/// Why a number of the metadata is not the printed one.
fn explained(check: Check) -> Check {
    match check.difference() {
        _ if check.status != super::Status::Differs => check,
        Some(d) if (0.0..0.01).contains(&d) => check.noted("cut off instead of rounded"),
        Some(d) if d.abs() > 0.05 => {
            check.noted("recorded at another time than the row, or by another unit")
        }
        _ => check,
    }
}

/// Figure 7, measured.
fn straightness(lens: &[Lens]) -> Section {
    let mut checks = Vec::new();
    for one in lens {
        let Some(rms) = one.straightness.rms_px() else { continue };
        for (treatment, rms) in Treatment::ALL.into_iter().zip(rms) {
            let check = Check::measured(
                format!("{}: RMS distance of corners from lines, {}", one.title, treatment.name()),
                None,
                Some(Estimate { value: rms, sigma: 0.0 }),
                "px",
            );
            checks.push(match (treatment, one.straightness.state()) {
                (Treatment::Original, StreamState::Rectified) => {
                    check.noted("straight as recorded: the paper is right here")
                }
                (Treatment::Original, StreamState::Distorted) => {
                    let mut check = check.noted(
                        "not rectified, against the paper's “all images are already rectified”",
                    );
                    check.status = super::Status::Differs;
                    check
                }
                _ => check,
            });
        }
    }
    Section {
        id: "lens",
        title: "Is the image rectified? (figure 7)",
        lead: "The paper resamples one image with either table and finds by eye that it was straight before. Here the \
               board's rows and columns are measured in all frames; recordings without tables are measured with their \
               own calibrated lens."
            .to_owned(),
        checks,
    }
}

fn lens(data: &Data, calibrated: &Calibrated) -> Option<Lens> {
    let audit = &calibrated.auto;
    let tables = audit.factory.as_ref().and_then(|factory| factory.tables.clone());
    let rectifier = match tables {
        Some(tables) => Rectifier::Tables(Box::new(tables)),
        None => audit.camera.as_ref().and_then(Rectifier::of_camera)?,
    };
    let mut straightness = Straightness::default();
    for frame in &audit.frames {
        let lines = Treatment::ALL
            .map(|t| board_lines(&audit.board, &frame.observation, |p| rectifier.place(t, p)));
        straightness.add([&lines[0], &lines[1], &lines[2]]);
    }
    let n_corners = |frame: &usize| audit.frames[*frame].observation.corners.len();
    // The first of those with most corners: the figure is the same whenever it is made.
    let frame = (0..audit.frames.len()).rev().max_by_key(n_corners)?;
    Some(Lens { data: calibrated.data, title: title(data), straightness, rectifier, frame })
}

/// What is not here.
fn missing(data: &[Data], lens: &[Lens]) -> Vec<Missing> {
    let mut missing = Vec::new();
    for p in &PUBLISHED {
        for (set, folder) in
            [(Set::Calibration, "FrontCamCalibrationDataset"), (Set::DepthEval, "DepthEvalDataset")]
        {
            if !data.iter().any(|d| d.set == set && d.device.as_deref() == Some(p.device)) {
                missing.push(Missing {
                    what: format!("{}: {folder}", p.title),
                    how: format!("{WHERE}; give `truedepth reproduce` the folder"),
                });
            }
        }
    }
    for one in data {
        let (here, listed) = (one.recording.frames.len(), one.n_listed());
        if here < listed {
            missing.push(Missing {
                what: format!("{}: {} of {listed} frames", one.recording.place(), listed - here),
                how: format!("{WHERE}: the metadata list them, the images are not here"),
            });
        }
    }
    let devices: Vec<&str> = FOCAL
        .iter()
        .filter(|row| !PUBLISHED.iter().any(|p| p.device == row.device))
        .map(|row| row.title)
        .collect();
    missing.push(Missing {
        what: format!("Focal lengths of {}", devices.join(", ")),
        how: "never published; record a board with such a device and run `truedepth audit`"
            .to_owned(),
    });
    missing.push(Missing {
        what: "Figure 3 and issue 1: depth over colour under ARKit".to_owned(),
        how: "no ARKit recording was published, and the capture app's ARKit side writes no files; `truedepth overlay \
              REC --fault depth-zoom=0.9507` draws the same from a recording of your own"
            .to_owned(),
    });
    if data.iter().any(|d| d.set == Set::Calibration) && lens.is_empty() {
        missing.push(Missing {
            what: "Figure 7: what the tables do".to_owned(),
            how: "the calibration recordings here have neither tables nor a lens that could be calibrated".to_owned(),
        });
    }
    missing
}
