//! Board minus sensor: how it is spread, frame by frame, and against the distance.

use maud::{Markup, html};

use super::{
    Figure, Key, Table,
    density::{Bins, density_curve, median},
};
use crate::{
    audit::Audit,
    depth::{BoardDepth, FrameDepth, MAX_ERROR_M},
    report::{
        svg::{MARGINS, Plot, domain_of, n},
        words::{count, in_mm, plain, signed, signed_with_sigma},
    },
};

const FACTORY: Key = Key { class: "series-factory", words: "with the factory's intrinsics" };
const OWN: Key = Key { class: "series-own", words: "with the own intrinsics" };

/// What there is to compare: legend entry, short name and depth.
fn cases(audit: &Audit) -> Vec<(Key, &'static str, &BoardDepth)> {
    let cases = [
        (FACTORY, "factory", audit.factory_depth.as_ref()),
        (OWN, "own", audit.own_depth.as_ref()),
    ];
    cases
        .into_iter()
        .filter_map(|(key, name, depth)| Some((key, name, depth?)))
        .filter(|(.., depth)| depth.frames.iter().any(|frame| frame.median_error_m.is_some()))
        .collect()
}

fn errors_mm(depth: &BoardDepth) -> Vec<f64> {
    depth.frames.iter().flat_map(FrameDepth::kept).map(|sample| 1e3 * sample.error_m()).collect()
}

/// Errors of all corners.
pub(in crate::report) fn error_histogram(audit: &Audit) -> Option<Figure> {
    const BIN_MM: f64 = 0.5;
    let limit = 1e3 * MAX_ERROR_M;
    let cases = cases(audit);
    let all: Vec<f64> = cases.iter().flat_map(|(.., depth)| errors_mm(depth)).collect();
    let reach = all.iter().map(|error| error.abs()).max_by(f64::total_cmp)?;
    let reach = ((reach / 5.0).floor() * 5.0 + 5.0).min(limit);
    let range = [-reach, reach];
    let binned: Vec<Bins> =
        cases.iter().map(|(.., depth)| Bins::new(&errors_mm(depth), range, BIN_MM)).collect();
    let most = binned.iter().map(Bins::max).max()?;
    let plot = Plot::new(range, [0.0, most as f64 * 1.08], 300.0, MARGINS);
    let drawing = html! {
        (plot.y_axis("corners in a bin"))
        @for ((key, name, depth), bins) in cases.iter().zip(&binned) {
            g class=(format!("bars {}", key.class)) {
                @for (from, to, count) in bins.iter().filter(|(.., count)| *count > 0) {
                    @let (x, y) = (plot.x.at(from), plot.y.at(count as f64));
                    rect class="mark" x=(n(x)) y=(n(y)) width=(n(plot.x.at(to) - x))
                        height=(n(plot.y.at(0.0) - y))
                        data-tip=(format!("{name}, {} to {} mm: {count} corners", signed(from, 1), signed(to, 1))) {}
                }
            }
            (density_curve(&plot, &errors_mm(depth), BIN_MM, key.class))
        }
        (zero_line_vertical(&plot))
        (plot.x_axis("board − sensor, mm"))
    };
    let rows = (0..binned[0].counts.len())
        .filter(|&bin| binned.iter().any(|bins| bins.counts[bin] > 0))
        .map(|bin| {
            let from = range[0] + bin as f64 * BIN_MM;
            let counts = binned.iter().map(|bins| bins.counts[bin].to_string());
            [signed(from, 1), signed(from + BIN_MM, 1)].into_iter().chain(counts).collect()
        })
        .collect();
    let means = cases.iter().filter_map(|(_, name, depth)| {
        let mean = depth.mean_of_medians_m?;
        Some(format!("{name} {} mm", signed_with_sigma(in_mm(mean), 2)))
    });
    Some(Figure {
        id: "depth-error",
        title: "Depth error of every corner".to_owned(),
        caption: format!(
            "Right of zero the sensor measures too near. Mean of the frames' medians: {}. Errors beyond {} mm are \
             left out, as the paper does. Bins of {BIN_MM} mm.",
            means.collect::<Vec<_>>().join(", "),
            plain(limit, 0),
        ),
        legend: cases.into_iter().map(|(key, ..)| key).collect(),
        view_box: plot.view_box(),
        drawing,
        table: Table {
            header: ["from, mm", "to, mm"]
                .into_iter()
                .chain(header_of(binned.len(), audit, ["factory, corners", "own, corners"]))
                .collect(),
            rows,
        },
    })
}

/// The column titles of the cases there are.
fn header_of(
    n_cases: usize,
    audit: &Audit,
    [factory, own]: [&'static str; 2],
) -> Vec<&'static str> {
    match (n_cases, audit.factory_depth.is_some()) {
        (1, true) => vec![factory],
        (1, false) => vec![own],
        _ => vec![factory, own],
    }
}

fn zero_line_vertical(plot: &Plot) -> Markup {
    let x = n(plot.x.at(0.0));
    html! { line class="zero" x1=(x) x2=(x) y1=(n(plot.y.range[0])) y2=(n(plot.y.range[1])) {} }
}

fn zero_line_horizontal(plot: &Plot) -> Markup {
    let y = n(plot.y.at(0.0));
    html! { line class="zero" x1=(n(plot.x.range[0])) x2=(n(plot.x.range[1])) y1=(y) y2=(y) {} }
}

/// The median error of every frame.
pub(in crate::report) fn error_by_frame(audit: &Audit) -> Option<Figure> {
    let cases = cases(audit);
    let frames = &cases.first()?.2.frames;
    let median_of = |depth: &BoardDepth, frame: usize| {
        let found = depth.frames.iter().find(|other| other.frame == frame)?;
        found.median_error_m.map(|error_m| 1e3 * error_m)
    };
    let medians: Vec<(usize, Vec<Option<f64>>)> = frames
        .iter()
        .map(|frame| {
            (frame.frame, cases.iter().map(|(.., depth)| median_of(depth, frame.frame)).collect())
        })
        .collect();
    let values = medians.iter().flat_map(|(_, values)| values.iter().flatten().copied());
    let last = audit.frames.len().max(2) as f64 - 1.0;
    let plot =
        Plot::new([-0.5, last + 0.5], domain_of(values.chain([0.0]), [-1.0, 1.0]), 300.0, MARGINS);
    let drawing = html! {
        (plot.y_axis("board − sensor, mm"))
        (zero_line_horizontal(&plot))
        @for (frame, values) in &medians {
            @let x = n(plot.x.at(*frame as f64));
            @if let [Some(a), Some(b)] = values[..] {
                line class="link" x1=(x) x2=(x) y1=(n(plot.y.at(a))) y2=(n(plot.y.at(b))) {}
            }
            @for ((key, name, _), value) in cases.iter().zip(values) {
                @if let Some(value) = value {
                    g class=(key.class) {
                        circle class="mark dot" cx=(x) cy=(n(plot.y.at(*value))) r="4.5"
                            data-tip=(format!("frame {frame}, {name}: {} mm", signed(*value, 2))) {}
                    }
                }
            }
        }
        (plot.x_axis("frame"))
    };
    let rows = medians
        .iter()
        .zip(frames)
        .map(|((frame, values), depth)| {
            let cells = values.iter().map(|value| value.map_or("—".to_owned(), |v| signed(v, 2)));
            let counts = [depth.samples.len() - depth.n_beyond, depth.n_beyond, depth.n_holes];
            let image = audit.frames.get(*frame).and_then(|f| f.color.clone()).unwrap_or_default();
            [frame.to_string(), image]
                .into_iter()
                .chain(cells)
                .chain(counts.map(|count| count.to_string()))
                .collect()
        })
        .collect();
    let header = ["frame", "image"]
        .into_iter()
        .chain(header_of(cases.len(), audit, ["factory, mm", "own, mm"]))
        .chain(["corners", "beyond 20 mm", "holes"])
        .collect();
    Some(Figure {
        id: "depth-frames",
        title: "Depth error of every frame".to_owned(),
        caption: format!(
            "Each point is the median over the board's corners in one frame. Points on the line are true; a drift \
             along the recording, or a single frame far off, would show here.{}",
            out_of_reach(&cases)
        ),
        legend: cases.into_iter().map(|(key, ..)| key).collect(),
        view_box: plot.view_box(),
        drawing,
        table: Table { header, rows },
    })
}

/// How many frames have no point because all their errors are too large, in a sentence; nothing where none is.
fn out_of_reach(cases: &[(Key, &'static str, &BoardDepth)]) -> String {
    let sentences = cases.iter().filter_map(|(_, name, depth)| {
        let is_beyond = |frame: &&FrameDepth| frame.n_beyond > 0 && frame.median_error_m.is_none();
        let n = depth.frames.iter().filter(is_beyond).count();
        (n > 0).then(|| {
            format!(" Without a point, all corners beyond 20 mm: {} ({name}).", count(n, "frame"))
        })
    });
    sentences.collect()
}

/// The error of every corner against its distance, where the distances differ enough to see a slope.
pub(in crate::report) fn error_by_range(audit: &Audit) -> Option<Figure> {
    const MIN_RANGE_MM: f64 = 30.0;
    const CELL_MM: f64 = 20.0;
    let cases = cases(audit);
    let (key, name, depth) = cases.into_iter().next_back()?;
    let points: Vec<[f64; 2]> = depth
        .frames
        .iter()
        .flat_map(FrameDepth::kept)
        .map(|sample| [1e3 * sample.board_m, 1e3 * sample.error_m()])
        .collect();
    let x = domain_of(points.iter().map(|p| p[0]), [0.0, 1.0]);
    if x[1] - x[0] < MIN_RANGE_MM {
        return None;
    }
    let y = domain_of(points.iter().map(|p| p[1]).chain([0.0]), [-1.0, 1.0]);
    let plot = Plot::new(x, y, 300.0, MARGINS);
    let dots: String = points
        .iter()
        .map(|[x, y]| format!("M{} {}h0", n(plot.x.at(*x)), n(plot.y.at(*y))))
        .collect();
    let cells = cells_along(&points, CELL_MM);
    let line: Vec<String> = cells
        .iter()
        .map(|cell| format!("{},{}", n(plot.x.at(cell.center)), n(plot.y.at(cell.median))))
        .collect();
    let drawing = html! {
        (plot.y_axis("board − sensor, mm"))
        (zero_line_horizontal(&plot))
        g class=(key.class) {
            path class="cloud" d=(dots) {}
            polyline class="curve" points=(line.join(" ")) {}
            @for cell in &cells {
                circle class="mark dot" cx=(n(plot.x.at(cell.center))) cy=(n(plot.y.at(cell.median))) r="4.5"
                    data-tip=(format!(
                        "{} mm away: median {} mm of {} corners", plain(cell.center, 0), signed(cell.median, 2), cell.n
                    )) {}
            }
        }
        (plot.x_axis("depth of the board, mm"))
    };
    Some(Figure {
        id: "depth-range",
        title: "Depth error against distance".to_owned(),
        caption: format!(
            "With the {name} intrinsics. A level band is a bias; a slope is a wrong scale or focal length; a bend is \
             the sensor's own."
        ),
        legend: vec![
            Key { class: "series-cloud", words: "a corner in a frame" },
            Key { class: key.class, words: "median over 20 mm of distance" },
        ],
        view_box: plot.view_box(),
        drawing,
        table: Table {
            header: vec!["distance, mm", "median error, mm", "corners"],
            rows: cells
                .iter()
                .map(|cell| vec![plain(cell.center, 0), signed(cell.median, 2), cell.n.to_string()])
                .collect(),
        },
    })
}

/// A stretch of distance.
struct Cell {
    center: f64,
    median: f64,
    n: usize,
}

/// Medians over stretches of equal width; stretches with fewer than ten points say nothing and are left out.
fn cells_along(points: &[[f64; 2]], width: f64) -> Vec<Cell> {
    let mut cells: std::collections::BTreeMap<i64, Vec<f64>> = std::collections::BTreeMap::new();
    for [x, y] in points {
        cells.entry((x / width).floor() as i64).or_default().push(*y);
    }
    cells
        .into_iter()
        .filter(|(_, errors)| errors.len() >= 10)
        .filter_map(|(index, errors)| {
            let center = (index as f64 + 0.5) * width;
            Some(Cell { center, median: median(&errors)?, n: errors.len() })
        })
        .collect()
}
