//! What each camera model leaves unexplained.

use maud::html;

use super::{Figure, Key, Table};
use crate::{
    audit::Audit,
    report::{
        svg::{Margins, Plot, n},
        words::{self, plain},
    },
};

const ROW: f64 = 34.0;

/// RMS of every model tried, on the corners it was fitted to and on those held out.
pub(in crate::report) fn rms_by_model(audit: &Audit) -> Option<Figure> {
    let calibration = audit.calibration.as_ref()?;
    let candidates: Vec<_> =
        calibration.candidates.iter().filter(|c| c.rms_px.is_finite()).collect();
    let most = candidates
        .iter()
        .flat_map(|c| [c.rms_px, c.held_out_rms_px])
        .filter(|rms| rms.is_finite())
        .max_by(f64::total_cmp)?;
    let margins = Margins { left: 176.0, right: 14.0, top: 16.0, bottom: 48.0 };
    let plot =
        Plot::new([0.0, 1.08 * most], [0.0, 1.0], 72.0 + ROW * candidates.len() as f64, margins);
    let drawing = html! {
        @for (index, candidate) in candidates.iter().enumerate() {
            @let y = plot.y.range[1] + ROW * (index as f64 + 0.5);
            @let is_chosen = candidate.model == calibration.model;
            g class=(if is_chosen { "model chosen" } else { "model" }) {
                text class="row" x="0" y=(n(y)) dominant-baseline="central" {
                    (words::model_short(candidate.model)) @if is_chosen { ", chosen" }
                }
                line class="stem" x1=(n(plot.x.at(0.0))) x2=(n(plot.x.at(candidate.rms_px))) y1=(n(y)) y2=(n(y)) {}
                circle class="mark dot fitted" cx=(n(plot.x.at(candidate.rms_px))) cy=(n(y)) r="5"
                    data-tip=(format!("fitted: {} px", plain(candidate.rms_px, 3))) {}
                @if candidate.held_out_rms_px.is_finite() {
                    @let x = plot.x.at(candidate.held_out_rms_px);
                    rect class="mark dot held-out" x=(n(x - 4.5)) y=(n(y - 4.5)) width="9" height="9"
                        transform=(format!("rotate(45 {} {})", n(x), n(y)))
                        data-tip=(format!("held out: {} px", plain(candidate.held_out_rms_px, 3))) {}
                }
            }
        }
        (plot.x_axis("RMS of corner distances, px"))
    };
    Some(Figure {
        id: "models",
        title: "What each camera model leaves unexplained".to_owned(),
        caption: "The model with the smallest error on corners it had not seen is chosen. If the models with Apple's \
                  table lie far left of those without, the stream still carries the lens' distortion."
            .to_owned(),
        legend: vec![
            Key { class: "fitted", words: "on the corners it was fitted to" },
            Key { class: "held-out", words: "on corners held out" },
        ],
        view_box: plot.view_box(),
        drawing,
        table: Table {
            header: vec!["model", "RMS fitted, px", "RMS held out, px"],
            rows: candidates
                .iter()
                .map(|c| {
                    vec![words::model(c.model).to_owned(), plain(c.rms_px, 4), plain(c.held_out_rms_px, 4)]
                })
                .collect(),
        },
    })
}
