//! The paper, reproduced, as one HTML file: printed numbers beside ours, figures beside what they show.

mod pictures;

pub use pictures::PaperPictures;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{
    figures::{self, Figure},
    html::head,
    words::{count, plain, signed, unbroken, value_and_sigma},
};
use crate::{
    diagnose::{Comparison, Entry, Registry, pairs},
    reproduce::{Check, Reproduction, Section, Status},
};

/// What this page has beyond the report.
const STYLE: &str = "
.quantities .note { display: block; color: var(--ink-2); font-size: 0.8125rem; font-weight: 400; }
.quantities > p, .evidence > p { color: var(--ink-2); max-width: 42rem; margin-top: 0.4rem; }
.quantities details.data table, .evidence details.data table { min-width: 100%; }
.plate { margin-top: 1.5rem; }
.plate img { display: block; width: 100%; height: auto; border-radius: 4px; }
.plate figcaption { max-width: 48rem; }
td.center { white-space: nowrap; }
.missing li { padding: 0.5rem 0; border-bottom: 1px solid var(--rule); overflow-wrap: anywhere; }
.missing code { color: var(--ink-2); }
";

/// Ids of the histograms: factory and own, per device.
const HISTOGRAMS: [&str; 8] = [
    "figure5-a-factory",
    "figure5-a-own",
    "figure5-b-factory",
    "figure5-b-own",
    "figure5-c-factory",
    "figure5-c-own",
    "figure5-d-factory",
    "figure5-d-own",
];

/// The page. The same reproduction and pictures give the same bytes.
pub fn paper_page(paper: &Reproduction, pictures: &PaperPictures) -> String {
    let histograms = histograms(paper);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            (head("arXiv:2201.10865, reproduced · truedepth", STYLE))
            body {
                a class="skip" href="#findings" { "Skip to the numbers" }
                (header(paper))
                main {
                    (outcome(paper))
                    @for section in &paper.sections {
                        (numbers(section))
                        @match section.id {
                            "depth" if !histograms.is_empty() => {
                                section class="evidence" id="figure-5" {
                                    h2 { "Figure 5: depth of the board and of the sensor" }
                                    div class="figures" { @for figure in &histograms { (figure.to_html()) } }
                                }
                            }
                            "devices" => (device_table()),
                            "lens" => (plates("figure-7", "Figure 7: original, forward table, inverse table",
                                &pictures.lens)),
                            _ => {}
                        }
                    }
                    (plates("figure-3", "Figure 3: depth over colour under ARKit", &pictures.zoom))
                    (missing(paper))
                }
                footer {
                    p {
                        "truedepth " (env!("CARGO_PKG_VERSION")) " · the same for programs: report.json, schema "
                        code { "truedepth.reproduce/1" }
                    }
                }
                div id="tip" role="status" aria-live="polite" hidden {}
                script {
                    (PreEscaped("\"use strict\";\n"))
                    (PreEscaped(include_str!("../html/script/theme.js")))
                    (PreEscaped(include_str!("../html/script/tips.js")))
                }
            }
        }
    };
    markup.into_string()
}

fn header(paper: &Reproduction) -> Markup {
    let data: Vec<String> = paper
        .data
        .iter()
        .map(|d| {
            let frames = d.recording.frames.len();
            format!(
                "{} ({}, {})",
                d.recording.name,
                d.set.name().replace('_', " "),
                count(frames, "frame")
            )
        })
        .collect();
    html! {
        header class="top" {
            div class="bar" {
                p class="brand" { "truedepth" span { " reproduce" } }
                button type="button" id="theme" aria-pressed="false" hidden { "Dark" }
            }
            h1 { "On the Issues of TrueDepth Sensor Data for Computer Vision Tasks Across Different iPad Generations" }
            p class="device" { "Urban, Lindemeier, Dobbelstein, Haenel, arXiv:2201.10865: its numbers, computed again" }
            p class="board" {
                @if data.is_empty() { "No recordings in " (paper.place) ": only what follows from printed numbers." }
                @else { "From " (data.join(", ")) "." }
            }
            nav aria-label="Parts of this page" {
                @for section in &paper.sections { a href=(format!("#{}", section.id)) { (section.title) } " " }
                a href="#missing" { "What is missing" }
            }
        }
    }
}

/// How many of the numbers agree.
fn outcome(paper: &Reproduction) -> Markup {
    let checks = || paper.sections.iter().flat_map(|section| &section.checks);
    let number = |status| checks().filter(|c| c.status == status && c.printed.is_some()).count();
    let all = checks().filter(|check| check.printed.is_some()).count();
    html! {
        section class="findings" id="findings" {
            p class="headline" {
                (number(Status::Agrees)) " of " (all) " printed numbers come out the same."
            }
            p class="lead" {
                (number(Status::Slip)) " do not follow from the paper's own numbers (slips in print), "
                (number(Status::Differs)) " differ in the data. Each is marked below with what there is to say."
            }
        }
    }
}

fn chip(status: Status) -> Markup {
    let (class, words) = match status {
        Status::Agrees => ("chip ok", "AGREES"),
        Status::Differs => ("chip warning", "DIFFERS"),
        Status::Slip => ("chip fault", "SLIP IN PRINT"),
        Status::NoData => ("chip unknown", "NO DATA"),
    };
    html! { span class=(class) { (words) } }
}

const HEADER: [&str; 3] = ["printed", "ours", "difference"];

fn numbers(section: &Section) -> Markup {
    // Of long tables what agrees is folded.
    let long = section.checks.len() > 30;
    let (shown, folded): (Vec<&Check>, Vec<&Check>) =
        section.checks.iter().partition(|check| !long || check.status != Status::Agrees);
    let title = format!("{}-title", section.id);
    html! {
        section class="quantities" id=(section.id) aria-labelledby=(title) {
            h2 id=(title) { (section.title) }
            p { (unbroken(&section.lead)) }
            @if section.checks.is_empty() {
                p { "No recordings for this here; see below what is missing." }
            } @else {
                div class="scroll" tabindex="0" role="region" aria-labelledby=(title) { (table(&shown)) }
            }
            @if !folded.is_empty() {
                details class="data" {
                    summary { (folded.len()) " that agree" }
                    div class="scroll" tabindex="0" role="region" aria-label="Numbers that agree" { (table(&folded)) }
                }
            }
        }
    }
}

fn table(checks: &[&Check]) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th scope="col" { "number" }
                    @for title in HEADER { th scope="col" class="number" { (title) } }
                    th scope="col" { "outcome" }
                }
            }
            tbody {
                @for check in checks {
                    tr {
                        th scope="row" {
                            (check.what)
                            @if !check.note.is_empty() { span class="note" { (check.note) } }
                        }
                        @for (title, cell) in HEADER.iter().zip(check_cells(check)) {
                            td class="number" data-title=(title) { (cell) }
                        }
                        td class="verdict" {
                            @if check.printed.is_some() || check.status != Status::Agrees { (chip(check.status)) }
                        }
                    }
                }
            }
        }
    }
}

/// A number of the paper as people read it: printed, ours, difference; a dash where there is none.
pub fn check_cells(check: &Check) -> [String; 3] {
    let unit = if check.unit.is_empty() { String::new() } else { format!(" {}", check.unit) };
    let decimals = check.printed.map_or(2, |printed| printed.decimals);
    let printed = check.printed.map(|p| format!("{}{unit}", plain(p.value, p.decimals)));
    let ours = check.ours.map(|ours| match ours.sigma {
        0.0 => format!("{}{unit}", plain(ours.value, decimals)),
        _ => format!("{}{unit}", value_and_sigma(ours, 2)),
    });
    let difference = check.difference().map(|d| format!("{}{unit}", signed(d, decimals)));
    [printed, ours, difference].map(|cell| cell.unwrap_or_else(|| "—".to_owned()))
}

fn histograms(paper: &Reproduction) -> Vec<Figure> {
    let mut all = Vec::new();
    for evaluation in &paper.depth {
        let mut figures = figures::depth_histograms(&evaluation.audit);
        if !evaluation.has_own {
            figures.truncate(1);
        }
        for mut figure in figures {
            let Some(id) = HISTOGRAMS.get(all.len()) else { return all };
            figure.id = id;
            figure.title = format!("{}: {}", evaluation.title, figure.title.to_lowercase());
            all.push(figure);
        }
    }
    all
}

/// All twenty rows.
fn device_table() -> Markup {
    let registry = Registry::published();
    let place = |[x, y]: [f64; 2]| format!("{x:.2}, {y:.2}");
    let row = |entry: &Entry| -> [String; 8] {
        let sheet = &entry.sheet;
        let equal = match sheet.centers_equal() {
            Some(true) => "yes",
            Some(false) => "no",
            None => "—",
        };
        [
            entry.name(),
            sheet.distortion_center.map_or("—".to_owned(), place),
            format!("{}x{}", sheet.reference[0], sheet.reference[1]),
            format!("{:.2}", sheet.focal_px),
            place(sheet.center),
            equal.to_owned(),
            sheet.color_focal_px.map_or("—".to_owned(), |f| format!("{f:.2}")),
            sheet.color_center.map_or("—".to_owned(), place),
        ]
    };
    let pair = |pair: &Comparison| -> Option<[String; 6]> {
        let across = pair.across.as_ref()?;
        let at_640 = |px: f64, width: f64| format!("{:.2}", px * 640.0 / width);
        Some([
            pair.first.name.trim_end_matches("/av").to_owned(),
            format!("{:.2} %", 100.0 * across.focal_difference),
            format!("{:.2} %", 100.0 * across.reference_difference[0]),
            across.issue.map_or("none", |issue| issue.name()).to_owned(),
            format!("{:.4}", across.depth_zoom[0]),
            format!(
                "{}, {}",
                at_640(across.av_corrected_px, pair.first.sheet.reference[0]),
                at_640(across.ar_corrected_px, pair.second.sheet.reference[0])
            ),
        ])
    };
    let rows: Vec<[String; 8]> = registry.entries().iter().map(row).collect();
    let derived: Vec<[String; 6]> = pairs(&registry).iter().filter_map(pair).collect();
    html! {
        section class="evidence" id="device-table" {
            h2 { "All rows, with the derived columns" }
            p { "Pixels at the reference dimensions; colour at the size of the colour image." }
            (wide("Device rows", &[
                "row", "distortion centre", "reference", "depth f", "depth centre", "centres equal", "colour f",
                "colour centre",
            ], &rows))
            p { "Both APIs of each device: differences, the issue they show, and the paper's corrections; each is \
                 meant for its own issue only." }
            (wide("Pairs of both APIs", &[
                "device", "depth f, ARKit against AVFoundation", "reference, the same", "issue", "zoom (issue 1)",
                "f at 640 columns by the equations, px (issue 2)",
            ], &derived))
        }
    }
}

fn wide<const N: usize>(name: &str, header: &[&str; N], rows: &[[String; N]]) -> Markup {
    html! {
        div class="scroll" tabindex="0" role="region" aria-label=(name) {
            table {
                thead { tr { @for title in header { th scope="col" { (title) } } } }
                tbody { @for row in rows { tr { @for cell in row { td class="center" { (cell) } } } } }
            }
        }
    }
}

fn plates(id: &str, title: &str, plates: &[pictures::PlatePicture]) -> Markup {
    html! {
        @if !plates.is_empty() {
            section class="evidence" id=(id) {
                h2 { (title) }
                @for plate in plates {
                    figure class="plate" {
                        img src=(plate.photo.data_uri()) alt=(plate.caption)
                            width=(plate.photo.size_px.0) height=(plate.photo.size_px.1);
                        figcaption { (plate.caption) }
                    }
                }
            }
        }
    }
}

fn missing(paper: &Reproduction) -> Markup {
    html! {
        section class="files" id="missing" {
            h2 { "What is missing, and how to get it" }
            ul class="missing" style="list-style: none; padding: 0" {
                @for missing in &paper.missing { li { (missing.what) ": " code { (missing.how) } } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::reproduce;

    #[test]
    fn without_data_it_is_a_page_too() {
        let paper = reproduce("nowhere <b>", Vec::new(), &mut |_| ()).unwrap();
        let page = paper_page(&paper, &PaperPictures::default());
        assert!(page.contains("nowhere &lt;b&gt;") && !page.contains("NaN"));
        assert!(page.contains("525.97") && page.contains("361.58") && page.contains("42.0 %"));
        assert!(!page.contains("http://") && !page.contains("https://"), "the page loads nothing");
        for tag in ["section", "table", "figure", "details", "div", "span"] {
            let (open, close) = (format!("<{tag}"), format!("</{tag}>"));
            assert_eq!(page.matches(&open).count(), page.matches(&close).count(), "{tag}");
        }
        let ids: Vec<&str> =
            page.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
        let mut unique = ids.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), ids.len(), "{ids:?}");
    }
}
