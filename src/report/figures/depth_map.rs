//! The error of the depth over the image: as it is, and what is left of it; and how noisy single pixels are.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::{
    Figure, Table,
    density::median,
    heat::{BAR_HEIGHT, Heat, Ramp, Tile},
};
use crate::{
    audit::Audit,
    camera::{Camera, Distortion},
    depth::{BoardDepth, FrameDepth},
    geom::{Pixel, Point},
    measure::FrameMeasurement,
    pose::View,
    report::{
        svg::{WIDTH, n},
        words::{count, plain, signed},
    },
};

/// Cells along a row of the image.
const CELLS: usize = 16;
/// Corners that the median of a cell must rest on.
const MIN_CORNERS: usize = 3;
/// Patches that the median of a cell must rest on.
const MIN_PATCHES: usize = 5;

/// Square cells over the image.
struct Cells {
    size: [usize; 2],
    side_px: f64,
    columns: usize,
}

impl Cells {
    fn over(size: [usize; 2]) -> Self {
        let side_px = (size[0] as f64 / CELLS as f64).max(1.0);
        Self { size, side_px, columns: CELLS }
    }

    /// Values by cell, row by row.
    fn grouped(&self, values: impl Iterator<Item = (Pixel, f64)>) -> BTreeMap<usize, Vec<f64>> {
        let mut cells: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for (pixel, value) in values.filter(|(p, v)| (p.x + p.y + v).is_finite()) {
            let [column, row] =
                [pixel.x, pixel.y].map(|x| ((x + 0.5) / self.side_px).max(0.0) as usize);
            cells.entry(row * self.columns + column.min(self.columns - 1)).or_default().push(value);
        }
        cells
    }

    /// The middle of a cell, pixels.
    fn middle(&self, cell: usize) -> [f64; 2] {
        [cell % self.columns, cell / self.columns].map(|i| (i as f64 + 0.5) * self.side_px - 0.5)
    }

    /// Where a cell is drawn.
    fn area(&self, cell: usize) -> [f64; 4] {
        let scale = WIDTH / self.size[0] as f64;
        let side = scale * self.side_px;
        let top = side * (cell / self.columns) as f64;
        // The last row may be cut off by the image's border.
        let height = side.min(self.drawn_height() - top).max(0.0);
        [side * (cell % self.columns) as f64, top, side, height]
    }

    fn drawn_height(&self) -> f64 {
        WIDTH * self.size[1] as f64 / self.size[0] as f64
    }

    fn drawing(&self, heat: &Heat, tiles: &[Tile], bar: &Markup) -> Markup {
        html! {
            rect class="image-frame" x="0.5" y="0.5" width=(n(WIDTH - 1.0)) height=(n(self.drawn_height() - 1.0)) {}
            (heat.tiles(tiles))
            (bar)
        }
    }

    fn view_box(&self) -> String {
        format!("0 0 {} {}", n(WIDTH), n(self.drawn_height() + BAR_HEIGHT))
    }
}

/// Board minus sensor at the corners, cell by cell, with the own camera where there is one.
pub(in crate::report) fn error_map(audit: &Audit) -> Option<Figure> {
    let size = audit.frames.iter().find_map(|frame| frame.size_px)?;
    let cells = Cells::over(size);
    let medians = |depth: &BoardDepth| -> BTreeMap<usize, (f64, usize)> {
        let kept = depth.frames.iter().flat_map(FrameDepth::kept);
        let grouped = cells.grouped(kept.map(|sample| (sample.pixel, 1e3 * sample.error_m())));
        grouped
            .into_iter()
            .filter(|(_, errors)| errors.len() >= MIN_CORNERS)
            .filter_map(|(cell, errors)| Some((cell, (median(&errors)?, errors.len()))))
            .collect()
    };
    let [own, factory] =
        [&audit.own_depth, &audit.factory_depth].map(|depth| depth.as_ref().map(medians));
    let (shown, name) = match (&own, &factory) {
        (Some(own), _) if !own.is_empty() => (own, "own"),
        (_, Some(factory)) => (factory, "factory's"),
        _ => return None,
    };
    let heat = Heat::new(Ramp::Diverging, shown.values().map(|(error, _)| *error), 0.5);
    let tiles: Vec<Tile> = shown
        .iter()
        .map(|(&cell, &(error, n_corners))| {
            let [x, y] = cells.middle(cell);
            Tile {
                area: cells.area(cell),
                value: error,
                label: None,
                tip: format!(
                    "near ({}, {}) px: {} mm, median of {}",
                    plain(x, 0),
                    plain(y, 0),
                    signed(error, 2),
                    count(n_corners, "corner")
                ),
            }
        })
        .collect();
    let sizes: Vec<f64> = shown.values().map(|(error, _)| *error).collect();
    let [low, high] = [
        sizes.iter().copied().min_by(f64::total_cmp)?,
        sizes.iter().copied().max_by(f64::total_cmp)?,
    ];
    let cell_of = |map: &Option<BTreeMap<usize, (f64, usize)>>, cell: usize| {
        let found = map.as_ref().and_then(|map| map.get(&cell));
        found.map_or("—".to_owned(), |(error, _)| signed(*error, 2))
    };
    let rows = shown
        .iter()
        .map(|(&cell, &(_, n_corners))| {
            let [x, y] = cells.middle(cell);
            let at = [plain(x, 0), plain(y, 0)];
            let errors = [cell_of(&factory, cell), cell_of(&own, cell)];
            at.into_iter().chain(errors).chain([n_corners.to_string()]).collect()
        })
        .collect();
    let bar = heat.bar("mm", ["sensor too far", "too near"], cells.drawn_height());
    Some(Figure {
        id: "depth-map",
        title: "Depth error over the image".to_owned(),
        caption: format!(
            "Board minus sensor with the {name} intrinsics: medians over cells of {} px, from {} to {} mm. One shade \
             throughout is a wrong scale, bias or focal length; a slope from side to side or from the middle outwards \
             is a lens, a zoom or a sensor of its own shape.",
            plain(cells.side_px, 0),
            signed(low, 1),
            signed(high, 1),
        ),
        legend: Vec::new(),
        view_box: cells.view_box(),
        drawing: cells.drawing(&heat, &tiles, &bar),
        table: Table { header: vec!["x, px", "y, px", "factory, mm", "own, mm", "corners"], rows },
    })
}

/// What is left over the board's whole surface once scale, bias, zoom and shift are taken out.
pub(in crate::report) fn pattern_map(audit: &Audit) -> Option<Figure> {
    let registration = audit.registration.as_ref()?;
    let size = audit.frames.iter().find_map(|frame| frame.size_px)?;
    let pattern = &registration.pattern;
    let cells = Cells { size, side_px: pattern.cell_px as f64, columns: pattern.columns };
    // The page has one sign: board minus sensor.
    let known: Vec<(usize, f64, usize)> = pattern
        .cells
        .iter()
        .enumerate()
        .filter(|(_, cell)| cell.median_m.is_finite())
        .map(|(at, cell)| (at, -1e3 * cell.median_m, cell.n_frames))
        .collect();
    if known.is_empty() {
        return None;
    }
    let heat = Heat::new(Ramp::Diverging, known.iter().map(|(_, left, _)| *left), 0.25);
    let tiles: Vec<Tile> = known
        .iter()
        .map(|&(cell, left, n_frames)| {
            let [x, y] = cells.middle(cell);
            Tile {
                area: cells.area(cell),
                value: left,
                label: None,
                tip: format!(
                    "near ({}, {}) px: {} mm left, in {}",
                    plain(x, 0),
                    plain(y, 0),
                    signed(left, 2),
                    count(n_frames, "frame")
                ),
            }
        })
        .collect();
    let bar = heat.bar("mm", ["sensor too far", "too near"], cells.drawn_height());
    Some(Figure {
        id: "depth-pattern",
        title: "What is left of the depth error".to_owned(),
        caption: format!(
            "The board's whole surface in {}, scale, bias, zoom and shift taken out: {} mm (RMS) stay the same in all \
             frames, {} mm come and go from frame to frame. Rings or stripes are the sensor's own pattern; no \
             correction here takes them out.",
            count(registration.n_frames, "frame"),
            plain(1e3 * pattern.fixed_m, 2),
            plain(1e3 * pattern.frame_noise_m, 2),
        ),
        legend: Vec::new(),
        view_box: cells.view_box(),
        drawing: cells.drawing(&heat, &tiles, &bar),
        table: Table {
            header: vec!["x, px", "y, px", "left, mm", "frames"],
            rows: known
                .iter()
                .map(|&(cell, left, n_frames)| {
                    let [x, y] = cells.middle(cell);
                    vec![plain(x, 0), plain(y, 0), signed(left, 3), n_frames.to_string()]
                })
                .collect(),
        },
    })
}

/// How much single pixels scatter about small planes on the board, over the image.
pub(in crate::report) fn noise_map(audit: &Audit) -> Option<Figure> {
    let size = audit.frames.iter().find_map(|frame| frame.size_px)?;
    let factory = audit
        .factory
        .as_ref()
        .map(|f| Camera { intrinsics: f.intrinsics, distortion: Distortion::None });
    let patches: Vec<(Pixel, f64, f64)> = audit
        .frames
        .iter()
        .filter_map(|frame| {
            let (view, camera) = match (&frame.own_view, &audit.camera) {
                (Some(view), Some(camera)) => (view, camera),
                _ => (frame.factory_view.as_ref()?, factory.as_ref()?),
            };
            Some(noise_of(frame, &outline(audit, view, camera)?))
        })
        .flatten()
        .collect();
    let cells = Cells::over(size);
    let grouped = cells.grouped(patches.iter().map(|(at, noise_mm, _)| (*at, *noise_mm)));
    let known: Vec<(usize, f64, usize)> = grouped
        .into_iter()
        .filter(|(_, noises)| noises.len() >= MIN_PATCHES)
        .filter_map(|(cell, noises)| Some((cell, median(&noises)?, noises.len())))
        .collect();
    if known.is_empty() {
        return None;
    }
    let overall = median(&patches.iter().map(|(_, noise_mm, _)| *noise_mm).collect::<Vec<_>>())?;
    let distance_m = median(&patches.iter().map(|(.., depth_m)| *depth_m).collect::<Vec<_>>())?;
    let heat = Heat::new(Ramp::Sequential, known.iter().map(|(_, noise, _)| *noise), 0.1);
    let tiles: Vec<Tile> = known
        .iter()
        .map(|&(cell, noise_mm, n_patches)| {
            let [x, y] = cells.middle(cell);
            let tip = format!(
                "near ({}, {}) px: {} mm, median of {n_patches} patches",
                plain(x, 0),
                plain(y, 0),
                plain(noise_mm, 2)
            );
            Tile { area: cells.area(cell), value: noise_mm, label: None, tip }
        })
        .collect();
    let bar = heat.bar("mm", ["", "one σ of a pixel"], cells.drawn_height());
    Some(Figure {
        id: "depth-noise",
        title: "Noise of the depth over the image".to_owned(),
        caption: format!(
            "How far single pixels scatter about small planes on the board: {} mm in the middle of all, at {} mm \
             distance. It grows with distance and slant; a place of its own that is strongly shaded is dirt on the \
             glass, or light from outside.",
            plain(overall, 2),
            plain(1e3 * distance_m, 0),
        ),
        legend: Vec::new(),
        view_box: cells.view_box(),
        drawing: cells.drawing(&heat, &tiles, &bar),
        table: Table {
            header: vec!["x, px", "y, px", "noise, mm", "patches"],
            rows: known
                .iter()
                .map(|&(cell, noise_mm, n_patches)| {
                    let [x, y] = cells.middle(cell);
                    vec![plain(x, 0), plain(y, 0), plain(noise_mm, 3), n_patches.to_string()]
                })
                .collect(),
        },
    })
}

/// The four corners of the sheet in the image.
fn outline(audit: &Audit, view: &View, camera: &Camera) -> Option<[Pixel; 4]> {
    let board = &audit.board;
    let [width_m, height_m] =
        [board.squares_x, board.squares_y].map(|squares| squares as f64 * board.square_m);
    let at = |x, y| camera.project(view.color_from_board * Point::new(x, y, 0.0));
    Some([at(0.0, 0.0)?, at(width_m, 0.0)?, at(width_m, height_m)?, at(0.0, height_m)?])
}

/// Place, noise (mm) and depth (m) of a frame's patches inside the outline.
fn noise_of(frame: &FrameMeasurement, outline: &[Pixel; 4]) -> Vec<(Pixel, f64, f64)> {
    let side = |a: Pixel, b: Pixel, p: Pixel| (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    let inside = |p: Pixel| {
        let sides: [f64; 4] = std::array::from_fn(|i| side(outline[i], outline[(i + 1) % 4], p));
        sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)
    };
    let measured = frame.patches.iter().flat_map(|patches| &patches.measured);
    measured
        .filter(|patch| inside(patch.at))
        .map(|patch| (patch.at, 1e3 * patch.noise_m, patch.inverse_per_m.recip()))
        .collect()
}
