//! How far off the calibration may draw a point, over the image.

use maud::html;

use super::{
    Figure, Table,
    heat::{BAR_HEIGHT, Heat, Ramp, Tile},
};
use crate::{
    audit::Audit,
    report::{
        svg::{WIDTH, n},
        words::plain,
    },
};

/// Places across and down; every other one is labelled.
const PLACES: [usize; 2] = [13, 9];

/// One σ of the projection at each place of the image, at the distance at which the board was seen.
pub(in crate::report) fn projection_uncertainty(audit: &Audit) -> Option<Figure> {
    let calibration = audit.calibration.as_ref()?;
    let depth_m = calibration.median_distance_m()?;
    let [columns, rows] = PLACES;
    let grid = calibration.projection_uncertainty(columns, rows, depth_m)?;
    let pinhole = &calibration.camera.intrinsics;
    let scale = WIDTH / pinhole.width as f64;
    let drawn_height = pinhole.height as f64 * scale;
    let finite = || grid.sigma_px.iter().copied().filter(|s| s.is_finite());
    let [least, most] = [finite().min_by(f64::total_cmp)?, finite().max_by(f64::total_cmp)?];
    let decimals = if most < 0.2 { 3 } else { 2 };
    let heat = Heat::new(Ramp::Sequential, grid.sigma_px.iter().copied(), 0.0);
    // Each place stands for what is nearest to it: cells at the border are half as wide.
    let step = [WIDTH / (columns - 1) as f64, drawn_height / (rows - 1) as f64];
    let edges = |i: usize, step: f64, end: f64| {
        let low = (step * (i as f64 - 0.5)).max(0.0);
        [low, (step * (i as f64 + 0.5)).min(end) - low]
    };
    let tiles: Vec<Tile> = (0..columns * rows)
        .map(|at| {
            let [x, width] = edges(at % columns, step[0], WIDTH);
            let [y, height] = edges(at / columns, step[1], drawn_height);
            let (pixel, sigma_px) = (grid.pixels[at], grid.sigma_px[at]);
            Tile {
                area: [x, y, width, height],
                value: sigma_px,
                label: None,
                tip: format!(
                    "({}, {}) px: σ {} px, {} mm sideways",
                    plain(pixel.x, 0),
                    plain(pixel.y, 0),
                    plain(sigma_px, decimals),
                    plain(1e3 * grid.sigma_m[at], 3)
                ),
            }
        })
        .collect();
    let labels = (0..columns * rows)
        .filter(|at| (at % columns) % 2 == 1 && (at / columns) % 2 == 1)
        .filter(|at| grid.sigma_px[*at].is_finite());
    let drawing = html! {
        (heat.tiles(&tiles))
        g class="heat" {
            @for at in labels {
                text class="in-cell" x=(n(step[0] * (at % columns) as f64)) y=(n(step[1] * (at / columns) as f64))
                    text-anchor="middle" dominant-baseline="central" { (plain(grid.sigma_px[at], decimals)) }
            }
        }
        (heat.bar("px", ["", "one σ of the projection"], drawn_height))
    };
    Some(Figure {
        id: "uncertainty",
        title: "How sure the camera is, over the image".to_owned(),
        caption: format!(
            "One standard deviation of where the own camera draws a point {} mm away, in its worst direction: {} px at \
             best, {} px at worst. It grows where no corner was seen; do not measure where the shade is strong. \
             What the camera model cannot know is not in it: see the held-out marks above.",
            plain(1e3 * depth_m, 0),
            plain(least, decimals),
            plain(most, decimals),
        ),
        legend: Vec::new(),
        view_box: format!("0 0 {} {}", n(WIDTH), n(drawn_height + BAR_HEIGHT)),
        drawing,
        table: Table {
            header: vec!["x, px", "y, px", "σ, px", "σ sideways, mm"],
            rows: (0..columns * rows)
                .map(|at| {
                    vec![
                        plain(grid.pixels[at].x, 0),
                        plain(grid.pixels[at].y, 0),
                        plain(grid.sigma_px[at], 4),
                        plain(1e3 * grid.sigma_m[at], 4),
                    ]
                })
                .collect(),
        },
    })
}
