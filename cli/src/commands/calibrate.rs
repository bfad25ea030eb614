//! `truedepth calibrate REC`

use truedepth::{
    audit::{Method, Options},
    recording::Recording,
    report::{self, wire},
};

use super::audit::observed;
use crate::{
    args::{self, CalibrateArgs},
    failure::Failure,
    input,
    outcome::Outcome,
    terminal::Terminal,
};

pub(crate) fn run(args: &CalibrateArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let mut options = Options::new(match args.method {
        args::Method::Auto => Method::Auto,
        args::Method::Paper => Method::Paper,
    });
    options.board = input::board(&args.input.board)?;
    let recording = Recording::open(&args.recording, &input::limits(&args.input))?;
    let audit = observed(&recording, &options, terminal)?;
    let why = audit.no_calibration.clone();
    let Some(calibration) = wire::Audit::from(&audit).calibration else {
        let why = why.unwrap_or_else(|| "the recording does not determine any".to_owned());
        let message = format!("{}: no intrinsics: {why}", recording.place());
        return Err(Failure::new(message).hint(
            "record 20 views or more of the whole board, tilted in all directions, near and far",
        ));
    };
    if args.json.json {
        let document = wire::Document::Calibrate(Box::new(calibration));
        terminal.result(&report::to_json(&document))?;
    } else {
        terminal.result(&table(&calibration))?;
    }
    Ok(Outcome::Clean)
}

/// What a person wants to know, in columns.
fn table(calibration: &wire::Calibration) -> String {
    let mut rows = vec![
        ("recording", calibration.recording.clone()),
        ("model", format!("{} (--method {})", calibration.model, calibration.method)),
    ];
    let mut focal = with_sigma(calibration.focal_px, calibration.focal_sigma_px, 2);
    focal.push_str(" px");
    if let (Some(factory), Some(difference)) =
        (calibration.factory_focal_px, calibration.focal_difference_percent)
    {
        focal.push_str(&format!("   factory {factory:.2} px, {difference:+.2} %"));
    }
    rows.push(("focal length", focal));
    let [x, y] = calibration.principal_point_px;
    rows.push(("principal point", format!("({x:.2}, {y:.2}) px")));
    for parameter in &calibration.parameters {
        if !parameter.name.ends_with("_px") {
            rows.push((
                "",
                format!("{} {}", parameter.name, with_sigma(parameter.value, parameter.sigma, 4)),
            ));
        }
    }
    rows.push((
        "fit",
        format!(
            "rms {:.3} px over {} corners of {} views, {} outliers left out",
            calibration.rms_px,
            calibration.n_corners,
            calibration.n_views,
            calibration.outliers.len()
        ),
    ));
    if let Some([a, b]) = calibration.split_half_focal_px {
        rows.push(("two halves", format!("focal length {a:.2} px and {b:.2} px")));
    }
    for (i, candidate) in calibration.candidates.iter().enumerate() {
        let number = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.3}"));
        rows.push((
            if i == 0 { "models tried" } else { "" },
            format!(
                "{:<18}  rms {} px, held out {} px, focal length {}",
                candidate.model,
                number(candidate.rms_px),
                number(candidate.held_out_rms_px),
                candidate.focal_px.map_or("-".to_owned(), |f| with_sigma(
                    f,
                    candidate.focal_sigma_px,
                    2
                )),
            ),
        ));
    }
    rows.iter().map(|(name, value)| format!("{name:<16}  {value}\n")).collect()
}

fn with_sigma(value: f64, sigma: Option<f64>, decimals: usize) -> String {
    match sigma {
        Some(sigma) => format!("{value:.decimals$} ± {sigma:.decimals$}"),
        None => format!("{value:.decimals$}"),
    }
}
