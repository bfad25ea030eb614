//! What camera models, and assumptions about the stream, leave unexplained.

use maud::html;

use super::{Figure, Key, Table};
use crate::{
    audit::Audit,
    calibrate::Lens,
    report::{
        svg::{Margins, Plot, n},
        words::{self, plain},
    },
};

const HEIGHT: f64 = 34.0;

/// What was assumed, and how well it explains the corners.
struct Row {
    name: &'static str,
    fitted_px: f64,
    held_out_px: f64,
    is_chosen: bool,
}

/// RMS of every model tried, on the corners it was fitted to and on those held out.
pub(in crate::report) fn rms_by_model(audit: &Audit) -> Option<Figure> {
    let calibration = audit.calibration.as_ref()?;
    let rows: Vec<Row> = calibration
        .candidates
        .iter()
        .map(|candidate| Row {
            name: words::model_short(candidate.model),
            fitted_px: candidate.rms_px,
            held_out_px: candidate.held_out_rms_px,
            is_chosen: candidate.model == calibration.model,
        })
        .collect();
    let title = "What each camera model leaves unexplained";
    let caption = "Chosen is the simplest model that predicts pictures it had not seen as well as the best one, to \
                   within a standard error. Further left is better; far apart marks in a row are a model that fits \
                   noise.";
    figure("models", title, caption, "model", &rows)
}

/// RMS under every assumption about the lens' distortion.
pub(in crate::report) fn rms_by_lens(audit: &Audit) -> Option<Figure> {
    let test = audit.distortion.as_ref()?;
    let rows: Vec<Row> = test
        .hypotheses
        .iter()
        .map(|hypothesis| Row {
            name: lens(hypothesis.lens),
            fitted_px: hypothesis.rms_px,
            held_out_px: hypothesis.held_out_rms_px,
            is_chosen: false,
        })
        .collect();
    let title = "Is the stream rectified?";
    let caption = "The assumption furthest left explains the corners best. If “as the lens drew it” lies far left of \
                   “rectified”, the images still carry the lens' distortion; the free ones show how much is left for \
                   any distortion to explain.";
    figure("lens", title, caption, "the stream is", &rows)
}

const fn lens(lens: Lens) -> &'static str {
    match lens {
        Lens::None => "rectified",
        Lens::InverseTable => "as the lens drew it",
        Lens::ForwardTable => "rectified twice",
        Lens::FreeTable => "a share of the table",
        Lens::FreeRadial => "free, radial",
    }
}

fn figure(
    id: &'static str,
    title: &str,
    caption: &str,
    what: &'static str,
    rows: &[Row],
) -> Option<Figure> {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.fitted_px.is_finite()).collect();
    let most = rows
        .iter()
        .flat_map(|row| [row.fitted_px, row.held_out_px])
        .filter(|rms| rms.is_finite())
        .max_by(f64::total_cmp)?;
    let margins = Margins { left: 176.0, right: 14.0, top: 16.0, bottom: 48.0 };
    let height = margins.top + margins.bottom + HEIGHT * rows.len() as f64;
    let plot = Plot::new([0.0, 1.08 * most.max(1e-3)], [0.0, 1.0], height, margins);
    let drawing = html! {
        @for (index, row) in rows.iter().enumerate() {
            @let y = plot.y.range[1] + HEIGHT * (index as f64 + 0.5);
            @let fitted = plot.x.at(row.fitted_px);
            g class=(if row.is_chosen { "model chosen" } else { "model" }) {
                text class="row" x="0" y=(n(y)) dominant-baseline="central" {
                    (row.name) @if row.is_chosen { ", chosen" }
                }
                line class="stem" x1=(n(plot.x.at(0.0))) x2=(n(fitted)) y1=(n(y)) y2=(n(y)) {}
                circle class="mark dot fitted" cx=(n(fitted)) cy=(n(y)) r="5"
                    data-tip=(format!("{}, fitted: {} px", row.name, plain(row.fitted_px, 3))) {}
                @if row.held_out_px.is_finite() {
                    @let x = plot.x.at(row.held_out_px);
                    rect class="mark dot held-out" x=(n(x - 4.5)) y=(n(y - 4.5)) width="9" height="9"
                        transform=(format!("rotate(45 {} {})", n(x), n(y)))
                        data-tip=(format!("{}, held out: {} px", row.name, plain(row.held_out_px, 3))) {}
                }
            }
        }
        (plot.x_axis("RMS of corner distances, px"))
    };
    let cells =
        |row: &&Row| vec![row.name.to_owned(), plain(row.fitted_px, 4), plain(row.held_out_px, 4)];
    Some(Figure {
        id,
        title: title.to_owned(),
        caption: caption.to_owned(),
        legend: vec![
            Key { class: "fitted", words: "on the corners it was fitted to" },
            Key { class: "held-out", words: "on pictures held out" },
        ],
        view_box: plot.view_box(),
        drawing,
        table: Table {
            header: vec![what, "RMS fitted, px", "RMS held out, px"],
            rows: rows.iter().map(cells).collect(),
        },
    })
}
