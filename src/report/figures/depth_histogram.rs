//! Depth of the board and depth of the sensor, as the paper's figure 5 (arXiv:2201.10865).

use maud::{Markup, html};

use super::{
    Figure, Key, Table,
    density::{Bins, density_curve, median},
};
use crate::{
    audit::Audit,
    calibrate::Estimate,
    depth::BoardDepth,
    report::{
        svg::{MARGINS, Plot, n, round_step},
        words::{count, in_mm, plain, value_and_sigma},
    },
};

/// The paper's bins.
const BIN_MM: f64 = 1.0;
/// With more bins than this none of them can be seen any more; they grow then.
const MAX_BINS: f64 = 90.0;

/// Depth under one camera.
struct Case<'a> {
    id: &'static str,
    title: &'static str,
    with: &'static str,
    depth: &'a BoardDepth,
    board_mm: Vec<f64>,
    sensor_mm: Vec<f64>,
}

/// What the figures share, so that they can be compared.
#[derive(Clone, Copy)]
struct Frame {
    range_mm: [f64; 2],
    bin_mm: f64,
    most: usize,
}

/// One figure with the factory's intrinsics and one with the own camera, over the same bins, where there is depth.
pub(in crate::report) fn depth_histograms(audit: &Audit) -> Vec<Figure> {
    let factory = audit.factory_depth.as_ref().map(|depth| {
        let title = "Depth with the factory's intrinsics";
        Case::new("depth-factory", title, "With the factory's intrinsics", depth)
    });
    let own = audit.own_depth.as_ref().map(|depth| {
        let title = "Depth with the own intrinsics";
        Case::new("depth-own", title, "With the own intrinsics", depth)
    });
    let mut cases: Vec<Case<'_>> = factory.into_iter().chain(own).collect();
    cases.retain(|case| !case.board_mm.is_empty());
    let both = |case: &Case<'_>| [case.board_mm.clone(), case.sensor_mm.clone()];
    let all: Vec<f64> = cases.iter().flat_map(both).flatten().collect();
    let Some(range_mm) = range_mm(&all) else { return Vec::new() };
    let bin_mm = BIN_MM.max(round_step((range_mm[1] - range_mm[0]) / MAX_BINS));
    let most =
        cases.iter().flat_map(both).map(|values| Bins::new(&values, range_mm, bin_mm).max()).max();
    let frame = Frame { range_mm, bin_mm, most: most.unwrap_or(1) };
    cases.iter().map(|case| case.figure(frame)).collect()
}

/// The paper's 170 to 230 mm where the depths lie within; else whole centimetres round them. One in a hundred at
/// either end may lie outside: where the sensor saw something else than the board, it may have seen very far.
fn range_mm(depths_mm: &[f64]) -> Option<[f64; 2]> {
    let mut sorted = depths_mm.to_vec();
    sorted.sort_by(f64::total_cmp);
    let low = *sorted.get(sorted.len() / 100)?;
    let high = *sorted.get(sorted.len() * 99 / 100)?;
    let range = if low >= 170.0 && high < 230.0 {
        [170.0, 230.0]
    } else {
        [(low / 10.0).floor() * 10.0, (high / 10.0).floor() * 10.0 + 10.0]
    };
    range.iter().all(|bound| bound.is_finite()).then_some(range)
}

impl<'a> Case<'a> {
    /// The depths of all corners of all frames. Errors of any size are in: to leave out the large ones would hide what
    /// the figure is there to show.
    fn new(
        id: &'static str,
        title: &'static str,
        with: &'static str,
        depth: &'a BoardDepth,
    ) -> Self {
        let samples = || depth.frames.iter().flat_map(|frame| &frame.samples);
        let board_mm = samples().map(|sample| 1e3 * sample.board_m).collect();
        let sensor_mm = samples().map(|sample| 1e3 * sample.sensor_m).collect();
        Self { id, title, with, depth, board_mm, sensor_mm }
    }

    fn figure(&self, Frame { range_mm, bin_mm, most }: Frame) -> Figure {
        let (board, sensor) = (&self.board_mm, &self.sensor_mm);
        let plot = Plot::new(range_mm, [0.0, most as f64 * 1.12], 300.0, MARGINS);
        let board_bins = Bins::new(board, range_mm, bin_mm);
        let sensor_bins = Bins::new(sensor, range_mm, bin_mm);
        let drawing = html! {
            (plot.y_axis("corners in a bin"))
            (bars(&plot, &board_bins, "series-board", "board"))
            (bars(&plot, &sensor_bins, "series-sensor", "sensor"))
            (density_curve(&plot, board, bin_mm, "series-board"))
            (density_curve(&plot, sensor, bin_mm, "series-sensor"))
            (medians(&plot, board, sensor))
            (plot.x_axis("depth, mm"))
        };
        let rows = board_bins
            .iter()
            .zip(&sensor_bins.counts)
            .filter(|((.., in_board), in_sensor)| *in_board + **in_sensor > 0)
            .map(|((from, to, in_board), in_sensor)| {
                vec![plain(from, 0), plain(to, 0), in_board.to_string(), in_sensor.to_string()]
            })
            .collect();
        Figure {
            id: self.id,
            title: self.title.to_owned(),
            caption: self.caption(bin_mm),
            legend: vec![
                Key { class: "series-board", words: "board, from its pose" },
                Key { class: "series-sensor", words: "sensor" },
            ],
            view_box: plot.view_box(),
            drawing,
            table: Table {
                header: vec!["from, mm", "to, mm", "board, corners", "sensor, corners"],
                rows,
            },
        }
    }

    fn caption(&self, bin_mm: f64) -> String {
        let error = self.depth.mean_of_medians_m.map(in_mm);
        let side = if error.is_some_and(|e| e.value < 0.0) { "in front of" } else { "behind" };
        let size = error.map(|e| value_and_sigma(Estimate { value: e.value.abs(), ..e }, 2));
        let n_medians =
            self.depth.frames.iter().filter(|frame| frame.median_error_m.is_some()).count();
        format!(
            "{} the board lies {} mm {side} what the sensor measures (mean of the medians of {}). Of a true recording \
             both humps stand on top of each other. Bins of {bin_mm} mm.",
            self.with,
            size.as_deref().unwrap_or("—"),
            count(n_medians, "frame"),
        )
    }
}

fn bars(plot: &Plot, bins: &Bins, class: &str, name: &str) -> Markup {
    html! {
        g class=(format!("bars {class}")) {
            @for (from, to, count) in bins.iter().filter(|(.., count)| *count > 0) {
                @let (x, y) = (plot.x.at(from), plot.y.at(count as f64));
                rect class="mark" x=(n(x)) y=(n(y)) width=(n(plot.x.at(to) - x)) height=(n(plot.y.at(0.0) - y))
                    data-tip=(format!("{name}, {} to {} mm: {count} corners", plain(from, 0), plain(to, 0))) {}
            }
        }
    }
}

/// Both medians as lines, with their values above the plot, to the left and to the right of each other.
fn medians(plot: &Plot, board: &[f64], sensor: &[f64]) -> Markup {
    let medians =
        [(median(board), "series-board", "board"), (median(sensor), "series-sensor", "sensor")];
    let left_is_board = median(board) <= median(sensor);
    html! {
        g class="medians" {
            @for (value, class, name) in medians {
                @if let Some(value) = value {
                    @let x = n(plot.x.at(value));
                    @let before = (name == "board") == left_is_board;
                    line class=(class) x1=(x) x2=(x) y1=(n(plot.y.range[0])) y2=(n(plot.y.range[1] - 4.0)) {}
                    text class=(class) x=(x) dx=(if before { "-4" } else { "4" }) y=(n(plot.y.range[1] + 4.0))
                        text-anchor=(if before { "end" } else { "start" }) {
                        (name) " " (plain(value, 1))
                    }
                }
            }
        }
    }
}
