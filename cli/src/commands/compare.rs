//! `truedepth compare AV AR`

use truedepth::{
    diagnose::{self, Comparison, Registry},
    report::Tone,
    wire,
};

use crate::{args::CompareArgs, failure::Failure, input, outcome::Outcome, terminal::Terminal};

pub(crate) fn run(args: &CompareArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let registry = input::registry(args.devices.devices.as_deref())?;
    if args.list {
        terminal.result(&list(&registry))?;
        return Ok(Outcome::Clean);
    }
    let pairs = match (&args.av, &args.ar) {
        (Some(av), Some(ar)) => {
            let side = |text: &str| input::side(text, &registry, &args.input);
            vec![diagnose::compare(side(av)?, side(ar)?)]
        }
        _ => diagnose::pairs(&registry),
    };
    if args.json.json {
        let document = wire::Compare::new(&pairs);
        terminal.result(&wire::to_json(&document))?;
    } else {
        let texts: Vec<String> = pairs.iter().map(|pair| words(pair, terminal)).collect();
        terminal.result(&texts.join("\n"))?;
    }
    Ok(Outcome::Clean)
}

fn list(registry: &Registry) -> String {
    registry
        .entries()
        .iter()
        .map(|entry| {
            let issues: Vec<&str> = entry.issues.iter().map(|issue| issue.name()).collect();
            format!(
                "{:<26}  f {:7.2} px at {}x{}   {:<36}  {}\n",
                entry.name(),
                entry.sheet.focal_px,
                entry.sheet.reference[0],
                entry.sheet.reference[1],
                entry.product,
                issues.join(", ")
            )
        })
        .collect()
}

fn words(pair: &Comparison, terminal: &Terminal) -> String {
    let (a, b) = (&pair.first.sheet, &pair.second.sheet);
    let head =
        format!("{:<28}{:>26}{:>26}{:>14}", "", pair.first.name, pair.second.name, "difference");
    let mut text = format!("{}\n", terminal.paint(Tone::Strong, &head));
    let mut row = |name: &str, first: String, second: String, difference: String| {
        text.push_str(&format!("{name:<28}{first:>26}{second:>26}{difference:>14}\n"));
    };
    let place = |[x, y]: [f64; 2]| format!("{x:.2}, {y:.2}");
    let percent = |first: f64, second: f64| format!("{:+.3} %", 100.0 * (second / first - 1.0));
    let dimensions = |[w, h]: [f64; 2]| format!("{w}x{h}");
    row(
        "reference dimensions",
        dimensions(a.reference),
        dimensions(b.reference),
        percent(a.reference[0], b.reference[0]),
    );
    row(
        "depth focal length, px",
        format!("{:.2}", a.focal_px),
        format!("{:.2}", b.focal_px),
        percent(a.focal_px, b.focal_px),
    );
    row(
        "  at 640 columns",
        format!("{:.2}", a.focal_at_px(640.0)),
        format!("{:.2}", b.focal_at_px(640.0)),
        percent(a.focal_at_px(640.0), b.focal_at_px(640.0)),
    );
    row("principal point, px", place(a.center), place(b.center), String::new());
    let center = |sheet: &diagnose::Sheet| sheet.distortion_center.map_or("-".to_owned(), place);
    row("distortion centre, px", center(a), center(b), String::new());
    let equal = |sheet: &diagnose::Sheet| match sheet.centers_equal() {
        Some(true) => "yes".to_owned(),
        Some(false) => "no".to_owned(),
        None => "-".to_owned(),
    };
    row("  equals principal point", equal(a), equal(b), String::new());
    if let Some(across) = &pair.across {
        let [x, y] = across.depth_zoom;
        let at_640 = |px: f64, sheet: &diagnose::Sheet| {
            format!("{px:.2} = {:.2} at 640", px * 640.0 / sheet.reference[0])
        };
        row("zoom for ARKit's depth", String::new(), format!("{x:.4}, {y:.4}"), String::new());
        row(
            "f by the paper's equations",
            at_640(across.av_corrected_px, a),
            at_640(across.ar_corrected_px, b),
            String::new(),
        );
        let issue = match across.issue {
            Some(diagnose::KnownIssue::DepthZoom) => "issue 1: use the zoom, not the equations",
            Some(_) => "issue 2: use the equations (or calibrate), not the zoom",
            None => "neither issue: use neither correction",
        };
        text.push_str(&format!("{issue}\n"));
    }
    for finding in &pair.findings {
        text.push_str(&format!(
            "\n{}  {}  {}\n",
            finding.code,
            finding.verdict.name(),
            finding.claim
        ));
        if !finding.what_to_do.is_empty() {
            text.push_str(&format!("       → {}\n", finding.what_to_do));
        }
    }
    text
}
