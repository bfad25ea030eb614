//! The figures of the page: each a drawing, a caption that says what to see, and the numbers behind it.
//!
//! Marks that carry a number have the class `mark` and an attribute `data-tip`; the page's script shows it under a
//! pointer and, with the arrow keys, under the keyboard.

mod board_shape;
mod coverage;
mod density;
mod depth_error;
mod depth_histogram;
mod depth_map;
mod finding_gauge;
mod focal;
mod heat;
mod hypotheses;
mod residuals;
mod uncertainty;
mod view_rms;

use maud::{Markup, html};

use crate::{audit::Audit, pose::View, report::words::unbroken};

pub(super) use board_shape::board_shape;
pub(super) use coverage::{image_coverage, view_angles};
pub(super) use depth_error::{error_by_frame, error_by_range, error_histogram};
pub(super) use depth_histogram::depth_histograms;
pub(super) use depth_map::{error_map, noise_map, pattern_map};
pub(super) use finding_gauge::finding_gauge;
pub(super) use focal::focal_lengths;
pub(super) use hypotheses::{rms_by_lens, rms_by_model};
pub(super) use residuals::residual_field;
pub(super) use uncertainty::projection_uncertainty;
pub(super) use view_rms::rms_by_view;

/// The ids of all figures, in the order of the page: `report.html#residuals` opens at that one. A figure whose data a
/// recording does not have is left out.
pub const FIGURES: [&str; 17] = [
    "depth-factory",
    "depth-own",
    "depth-error",
    "depth-frames",
    "depth-range",
    "depth-map",
    "depth-pattern",
    "depth-noise",
    "focal",
    "lens",
    "models",
    "uncertainty",
    "residuals",
    "views",
    "coverage",
    "angles",
    "board-shape",
];

/// The views that the calibration rests on; without one, those with the own camera or the factory's.
fn views_of(audit: &Audit) -> Vec<&View> {
    match &audit.calibration {
        Some(calibration) => calibration.views.iter().collect(),
        None => audit
            .frames
            .iter()
            .filter_map(|f| f.own_view.as_ref().or(f.factory_view.as_ref()))
            .collect(),
    }
}

/// A figure of the page.
pub(super) struct Figure {
    /// Names it in the page, e.g. for links.
    pub(super) id: &'static str,
    /// What it shows, in a few words.
    pub(super) title: String,
    /// What to see.
    pub(super) caption: String,
    /// What stands for what, where there is more than one thing.
    pub(super) legend: Vec<Key>,
    /// `viewBox` of the drawing.
    pub(super) view_box: String,
    /// The inside of the drawing.
    pub(super) drawing: Markup,
    /// The numbers.
    pub(super) table: Table,
}

/// An entry of a legend: the CSS class that colours and shapes it, and its words.
pub(super) struct Key {
    pub(super) class: &'static str,
    pub(super) words: &'static str,
}

/// The numbers behind a figure.
pub(super) struct Table {
    /// Column titles, with units.
    pub(super) header: Vec<&'static str>,
    /// Cells, as text.
    pub(super) rows: Vec<Vec<String>>,
}

impl Figure {
    /// As HTML.
    pub(super) fn to_html(&self) -> Markup {
        let title = format!("{}-title", self.id);
        html! {
            figure id=(self.id) class="figure" {
                h3 id=(title) { (self.title) }
                @if !self.legend.is_empty() {
                    ul class="legend" {
                        @for key in &self.legend { li class=(key.class) { (key.words) } }
                    }
                }
                svg class="plot" viewBox=(self.view_box) role="img" aria-labelledby=(title) tabindex="0" {
                    (self.drawing)
                }
                figcaption { (unbroken(&self.caption)) }
                (self.table.to_html(&format!("Numbers behind “{}”", self.title)))
            }
        }
    }
}

impl Table {
    /// As HTML, folded.
    pub(super) fn to_html(&self, summary: &str) -> Markup {
        html! {
            details class="data" {
                summary { (summary) }
                div class="scroll" tabindex="0" role="region" aria-label=(summary) {
                    table {
                        thead { tr { @for title in &self.header { th scope="col" { (title) } } } }
                        tbody {
                            @for row in &self.rows { tr { @for cell in row { td { (cell) } } } }
                        }
                    }
                }
            }
        }
    }
}
