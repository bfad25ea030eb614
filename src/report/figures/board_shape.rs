//! The board as it is: how far each of its corners lies off its best plane.

use maud::html;

use super::{
    Figure, Table,
    heat::{BAR_HEIGHT, Heat, Ramp, Tile},
};
use crate::{
    audit::Audit,
    calibrate::{Estimate, SurfaceKind},
    report::{
        svg::{WIDTH, n},
        words::{in_mm, plain, signed, signed_with_sigma, value_and_sigma},
    },
};

/// Heights of the corners; nothing where held-out pictures are predicted as well with a flat board.
pub(in crate::report) fn board_shape(audit: &Audit) -> Option<Figure> {
    let surface = audit.calibration.as_ref()?.surface.as_ref()?;
    let board = &audit.board;
    let columns = board.squares_x.checked_sub(1).filter(|c| *c > 0)?;
    let rows = board.squares_y.checked_sub(1).filter(|r| *r > 0)?;
    let estimates: Vec<Estimate> = surface
        .heights_m
        .iter()
        .zip(&surface.sigmas_m)
        .map(|(&value, &sigma)| in_mm(Estimate { value, sigma }))
        .collect();
    if estimates.len() != columns * rows {
        return None;
    }
    let side = (WIDTH / columns as f64).min(80.0);
    let left = 0.5 * (WIDTH - side * columns as f64);
    let drawn_height = side * rows as f64;
    let heat = Heat::new(Ramp::Diverging, estimates.iter().map(|e| e.value), 0.05);
    let decimals = if surface.peak_to_valley_m() < 0.4e-3 { 2 } else { 1 };
    let tiles: Vec<Tile> = estimates
        .iter()
        .enumerate()
        .map(|(id, height)| {
            let (column, row) = board.corner_cell(id);
            Tile {
                area: [left + side * column as f64, side * row as f64, side, side],
                value: height.value,
                label: (side >= 34.0).then(|| signed(height.value, decimals)),
                tip: format!("corner {id}: {} mm", signed_with_sigma(*height, 3)),
            }
        })
        .collect();
    let form = match surface.kind {
        SurfaceKind::Bend => "bent like a sheet (two parabolas)",
        SurfaceKind::Free => "free, smooth",
        SurfaceKind::Flat => "flat",
    };
    let drawing = html! {
        (heat.tiles(&tiles))
        (heat.bar("mm", ["towards the camera", "away"], drawn_height))
    };
    let mut rows: Vec<Vec<String>> = estimates
        .iter()
        .enumerate()
        .map(|(id, height)| {
            let (column, row) = board.corner_cell(id);
            vec![
                id.to_string(),
                (column + 1).to_string(),
                (row + 1).to_string(),
                signed(height.value, 3),
                plain(height.sigma, 3),
            ]
        })
        .collect();
    rows.sort_by_key(|row| row[0].parse::<usize>().unwrap_or(usize::MAX));
    Some(Figure {
        id: "board-shape",
        title: "The shape of the board".to_owned(),
        caption: format!(
            "How far each corner lies off the board's best plane, seen from the front; {} mm from the lowest to the \
             highest. Form: {form}. It was estimated together with the camera because pictures that were held out are \
             predicted better with it. A flatter board (glue the print onto glass) makes every σ on this page smaller.",
            value_and_sigma(in_mm(surface.size_m()), 2),
        ),
        legend: Vec::new(),
        view_box: format!("0 0 {} {}", n(WIDTH), n(drawn_height + BAR_HEIGHT)),
        drawing,
        table: Table { header: vec!["corner", "column", "row", "height, mm", "σ, mm"], rows },
    })
}
