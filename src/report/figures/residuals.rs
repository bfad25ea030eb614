//! Where in the image corners are off, and to which side.

use maud::html;

use super::{Figure, Key, Table, views_of};
use crate::{
    audit::Audit,
    geom::Pixel,
    math,
    report::{
        svg::{WIDTH, n, round_step},
        words::{plain, signed},
    },
};

/// Cells along the longer side of the image.
const CELLS: f64 = 10.0;
/// Corners that a cell's mean must rest on.
const MIN_CORNERS: usize = 4;

/// The residual of every corner of every view, and their means over cells of the image.
pub(in crate::report) fn residual_field(audit: &Audit) -> Option<Figure> {
    let [columns, rows] = audit.frames.iter().find_map(|frame| frame.size_px)?;
    let views = views_of(audit);
    let residuals: Vec<(Pixel, [f64; 2])> = views
        .iter()
        .flat_map(|view| view.corners.iter().zip(&view.residuals_px))
        .map(|(corner, residual)| (corner.pixel, *residual))
        .filter(|(pixel, [x, y])| (pixel.x + pixel.y + x + y).is_finite())
        .collect();
    let mut lengths: Vec<f64> = residuals.iter().map(|(_, [x, y])| math::hypot(*x, *y)).collect();
    lengths.sort_by(f64::total_cmp);
    let typical = *lengths.get(lengths.len() * 9 / 10)?;
    let (width, height) = (columns as f64, rows as f64);
    let cell_px = (width.max(height) / CELLS).max(1.0);
    // Nine of ten lines stay within half a cell; the factor is a round number, so that it can be said.
    let gain = round_step(0.25 * cell_px / typical.max(1e-6)).min(1e4);
    let cells = cell_means(&residuals, cell_px);
    let scale = WIDTH / width;
    let drawn_height = height * scale;
    let to = |p: Pixel| [scale * (p.x + 0.5), scale * (p.y + 0.5)];
    let arrow = |pixel: Pixel, [dx, dy]: [f64; 2]| {
        let [x, y] = to(pixel);
        format!("M{} {}l{} {}", n(x), n(y), n(scale * gain * dx), n(scale * gain * dy))
    };
    let single: String =
        residuals.iter().map(|(pixel, residual)| arrow(*pixel, *residual)).collect();
    let key_px = round_step(typical);
    let drawing = html! {
        rect class="image-frame" x="0.5" y="0.5" width=(n(WIDTH - 1.0)) height=(n(drawn_height - 1.0)) {}
        path class="residuals" d=(single) {}
        g class="cell-means" {
            @for cell in &cells {
                @let [x, y] = to(cell.center);
                @let [dx, dy] = cell.mean.map(|d| scale * gain * d);
                g class="mark" data-tip=(format!(
                    "near ({}, {}): {} px right, {} px down, mean of {} corners, RMS {} px",
                    plain(cell.center.x, 0), plain(cell.center.y, 0), signed(cell.mean[0], 3), signed(cell.mean[1], 3),
                    cell.n, plain(cell.rms, 3)
                )) {
                    line x1=(n(x)) y1=(n(y)) x2=(n(x + dx)) y2=(n(y + dy)) {}
                    circle cx=(n(x)) cy=(n(y)) r="2" {}
                }
            }
        }
        g class="scale-bar" transform=(format!("translate(0 {})", n(drawn_height + 22.0))) {
            line x1="1" x2=(n(1.0 + scale * gain * key_px)) y1="0" y2="0" {}
            text x=(n(9.0 + scale * gain * key_px)) y="0" dominant-baseline="central" {
                (crate::report::words::trimmed(key_px, 3)) " px of residual (drawn " (plain(gain, 0)) " times larger)"
            }
        }
    };
    Some(Figure {
        id: "residuals",
        title: "Where corners are off".to_owned(),
        caption: format!(
            "The image plane, {columns}x{rows} px, with {} corners of {} views: each line runs from where a corner was \
             predicted towards where it was seen. Heavy lines are means over cells. No pattern is good; lines that \
             all point in or out, more so towards the border, are lens distortion that the model does not know.",
            residuals.len(),
            views.len()
        ),
        legend: vec![
            Key { class: "residual", words: "a corner in a view" },
            Key { class: "cell-mean", words: "mean over a cell" },
        ],
        view_box: format!("0 0 {} {}", n(WIDTH), n(drawn_height + 40.0)),
        drawing,
        table: Table {
            header: vec!["x, px", "y, px", "mean right, px", "mean down, px", "RMS, px", "corners"],
            rows: cells
                .iter()
                .map(|c| {
                    vec![
                        plain(c.center.x, 0),
                        plain(c.center.y, 0),
                        signed(c.mean[0], 3),
                        signed(c.mean[1], 3),
                        plain(c.rms, 3),
                        c.n.to_string(),
                    ]
                })
                .collect(),
        },
    })
}

/// A square of the image.
struct Cell {
    /// Mean position of its corners.
    center: Pixel,
    mean: [f64; 2],
    rms: f64,
    n: usize,
}

fn cell_means(residuals: &[(Pixel, [f64; 2])], cell_px: f64) -> Vec<Cell> {
    let mut cells: std::collections::BTreeMap<[i64; 2], Vec<(Pixel, [f64; 2])>> =
        std::collections::BTreeMap::new();
    for (pixel, residual) in residuals {
        let key = [(pixel.y / cell_px).floor() as i64, (pixel.x / cell_px).floor() as i64];
        cells.entry(key).or_default().push((*pixel, *residual));
    }
    cells
        .into_values()
        .filter(|members| members.len() >= MIN_CORNERS)
        .map(|members| {
            let n = members.len() as f64;
            let mean_of =
                |value: fn(&(Pixel, [f64; 2])) -> f64| members.iter().map(value).sum::<f64>() / n;
            Cell {
                center: Pixel::new(mean_of(|m| m.0.x), mean_of(|m| m.0.y)),
                mean: [mean_of(|m| m.1[0]), mean_of(|m| m.1[1])],
                rms: mean_of(|m| m.1[0].powi(2) + m.1[1].powi(2)).sqrt(),
                n: members.len(),
            }
        })
        .collect()
}
