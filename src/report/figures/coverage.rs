//! Where in the image the board was seen, and from which sides.

use std::f64::consts::TAU;

use maud::html;

use super::{Figure, Key, Table, views_of};
use crate::{
    audit::Audit,
    calibrate::{Coverage, Tilt},
    math,
    pose::View,
    report::{
        svg::{WIDTH, n},
        words::{count, plain},
    },
};

/// Between these angles a view says most about the focal length.
const BEST_DEG: [f64; 2] = [20.0, 45.0];

fn coverage_of(views: &[&View], size: [usize; 2]) -> Coverage {
    let views = views.iter().map(|v| (v.frame, &v.color_from_board, v.corners.as_slice()));
    Coverage::of(views, size)
}

/// What is missing, in a sentence.
fn missing(coverage: &Coverage) -> String {
    match coverage.advice() {
        Some(advice) => format!("Missing: {advice}."),
        None => "Nothing is missing.".to_owned(),
    }
}

/// Every corner of every view on the image, and how many in each ninth of it.
pub(in crate::report) fn image_coverage(audit: &Audit) -> Option<Figure> {
    let size = audit.frames.iter().find_map(|frame| frame.size_px)?;
    let views = views_of(audit);
    let coverage = coverage_of(&views, size);
    let total: usize = coverage.n_corners.iter().sum();
    if total == 0 {
        return None;
    }
    let scale = WIDTH / size[0] as f64;
    let drawn_height = size[1] as f64 * scale;
    let dots: String = views
        .iter()
        .flat_map(|view| &view.corners)
        .map(|corner| {
            format!(
                "M{} {}h0",
                n(scale * (corner.pixel.x + 0.5)),
                n(scale * (corner.pixel.y + 0.5))
            )
        })
        .collect();
    let columns = coverage.columns;
    let (width, height) = (WIDTH / columns as f64, drawn_height / coverage.rows as f64);
    let parts: Vec<(f64, f64, &str, usize)> = coverage
        .n_corners
        .iter()
        .enumerate()
        .map(|(i, &corners)| {
            (
                width * (i % columns) as f64,
                height * (i / columns) as f64,
                Coverage::PLACES[i],
                corners,
            )
        })
        .collect();
    let drawing = html! {
        rect class="image-frame" x="0.5" y="0.5" width=(n(WIDTH - 1.0)) height=(n(drawn_height - 1.0)) {}
        path class="cloud strong" d=(dots) {}
        @for (x, y, name, corners) in &parts {
            @let class = if *corners == 0 { "mark part empty" } else { "mark part" };
            rect class=(class) x=(n(*x)) y=(n(*y)) width=(n(width)) height=(n(height))
                data-tip=(format!("{name}: {}", count(*corners, "corner"))) {}
            text class="halo" x=(n(x + 0.5 * width)) y=(n(y + 0.5 * height)) text-anchor="middle"
                dominant-baseline="central" { (corners) }
        }
    };
    Some(Figure {
        id: "coverage",
        title: "Where in the image the board was seen".to_owned(),
        caption: format!(
            "The image plane, {}x{} px, with the {total} corners of {}, and how many lie in each ninth of it. The lens \
             is known where corners are; a part without any is a guess. {}",
            size[0],
            size[1],
            count(views.len(), "view"),
            missing(&coverage)
        ),
        legend: vec![Key { class: "series-cloud", words: "a corner in a view" }],
        view_box: format!("0 0 {} {}", n(WIDTH), n(drawn_height)),
        drawing,
        table: Table {
            header: vec!["part of the image", "corners", "share, %"],
            rows: parts
                .iter()
                .map(|(.., name, corners)| {
                    let share = 100.0 * *corners as f64 / total as f64;
                    vec![(*name).to_owned(), corners.to_string(), plain(share, 1)]
                })
                .collect(),
        },
    })
}

/// From which sides the board was seen: the angle between its normal and the optical axis, and its nearest side.
pub(in crate::report) fn view_angles(audit: &Audit) -> Option<Figure> {
    const RADIUS: f64 = 142.0;
    const CENTER: [f64; 2] = [240.0, 172.0];
    const RINGS_DEG: [f64; 5] = [15.0, 30.0, 45.0, 60.0, 75.0];
    let views = views_of(audit);
    let size = audit.frames.iter().find_map(|frame| frame.size_px)?;
    let coverage = coverage_of(&views, size);
    let tilts: Vec<(&Tilt, &View)> = coverage
        .views
        .iter()
        .zip(views.iter().copied())
        .filter(|(t, _)| t.tilt_deg.is_finite() && t.nearest_deg.is_finite())
        .collect();
    let most = tilts.iter().map(|(t, _)| t.tilt_deg).max_by(f64::total_cmp)?;
    let reach = RINGS_DEG.into_iter().find(|ring| *ring >= most).unwrap_or(90.0).max(45.0);
    let radius = |deg: f64| RADIUS * deg / reach;
    let place = |t: &Tilt| {
        let angle = t.nearest_deg.to_radians();
        [0, 1].map(|axis| {
            let along = if axis == 0 { math::cos(angle) } else { math::sin(angle) };
            CENTER[axis] + radius(t.tilt_deg) * along
        })
    };
    let [cx, cy] = CENTER.map(n);
    let [low, high] = BEST_DEG.map(radius);
    let sides = [
        ("right nearest", [CENTER[0] + RADIUS + 8.0, CENTER[1]], "start"),
        ("left nearest", [CENTER[0] - RADIUS - 8.0, CENTER[1]], "end"),
        ("top nearest", [CENTER[0], CENTER[1] - RADIUS - 12.0], "middle"),
        ("bottom nearest", [CENTER[0], CENTER[1] + RADIUS + 14.0], "middle"),
    ];
    let drawing = html! {
        circle class="best" cx=(cx) cy=(cy) r=(n(f64::midpoint(low, high))) stroke-width=(n(high - low)) {}
        @for ring in RINGS_DEG.into_iter().filter(|ring| *ring <= reach) {
            circle class="ring" cx=(cx) cy=(cy) r=(n(radius(ring))) {}
            @let at = math::sin(TAU / 8.0) * radius(ring);
            text class="halo small" x=(n(CENTER[0] + at)) y=(n(CENTER[1] - at)) text-anchor="middle"
                dominant-baseline="central" { (plain(ring, 0)) "°" }
        }
        g class="axis" {
            line class="grid" x1=(n(CENTER[0] - RADIUS)) x2=(n(CENTER[0] + RADIUS)) y1=(cy) y2=(cy) {}
            line class="grid" y1=(n(CENTER[1] - RADIUS)) y2=(n(CENTER[1] + RADIUS)) x1=(cx) x2=(cx) {}
            @for (words, [x, y], anchor) in sides {
                text x=(n(x)) y=(n(y)) text-anchor=(anchor) dominant-baseline="central" { (words) }
            }
        }
        g class="series-own" {
            @for (tilt, view) in &tilts {
                @let [x, y] = place(tilt);
                circle class="mark dot" cx=(n(x)) cy=(n(y)) r="4.5" data-tip=(format!(
                    "frame {}: tilted by {}°, {} mm away", tilt.frame, plain(tilt.tilt_deg, 0),
                    plain(1e3 * view.camera_position_m().norm(), 0)
                )) {}
            }
        }
    };
    let n_best =
        tilts.iter().filter(|(t, _)| (BEST_DEG[0]..=BEST_DEG[1]).contains(&t.tilt_deg)).count();
    let missing_sides = coverage.missing_tilts();
    let sides = match missing_sides.len() {
        0 => "Every side of the board was nearest in some view.".to_owned(),
        _ => format!("Never nearest: {}.", missing_sides.join(", ")),
    };
    Some(Figure {
        id: "angles",
        title: "From which sides the board was seen".to_owned(),
        caption: format!(
            "Each point is a view: the farther out, the more the board was tilted; its direction says which side of \
             the board was nearest in the image. The band from {} to {} degrees tells the focal length best: {} of {} \
             lie in it. Points all in the middle cannot tell focal length from distance. {sides}",
            BEST_DEG[0],
            BEST_DEG[1],
            n_best,
            count(tilts.len(), "view"),
        ),
        legend: vec![
            Key { class: "series-own", words: "a view" },
            Key { class: "best-band square", words: "20° to 45°" },
        ],
        view_box: "0 0 480 344".to_owned(),
        drawing,
        table: Table {
            header: vec![
                "frame",
                "tilt, degrees",
                "nearest side, degrees",
                "distance, mm",
                "corners",
            ],
            rows: tilts
                .iter()
                .map(|(tilt, view)| {
                    vec![
                        tilt.frame.to_string(),
                        plain(tilt.tilt_deg, 1),
                        plain(tilt.nearest_deg, 0),
                        plain(1e3 * view.camera_position_m().norm(), 0),
                        view.corners.len().to_string(),
                    ]
                })
                .collect(),
        },
    })
}
