//! A few frames to look at closely: depth over colour, edges of depth over colour, and the cloud in space.

use maud::{Markup, PreEscaped, html};
use serde::Serialize;

use crate::{
    audit::Audit,
    calibrate::Estimate,
    camera::{Camera, Distortion},
    correct::{Plan, Selection},
    depth::{BoardDepth, MAX_ERROR_M},
    geom::{Board, Color, Pixel, Pose},
    measure::FrameMeasurement,
    pose::View,
    report::{
        figures::Table,
        pictures::{Closeup, DEPTH_UNIT_M, Pictures},
        words::{self, plain, signed},
    },
};

/// Nodes of a camera's rays along the image's sides. Between them rays are interpolated: with a lens of 20 px of
/// distortion that costs less than 0.05 px.
const RAY_NODES: [usize; 2] = [33, 25];

/// What the script draws from.
#[derive(Serialize)]
struct Scene {
    /// What one step of a stored depth stands for.
    unit_m: f64,
    size_px: [usize; 2],
    /// Squares along a row and a column, and their side.
    board: (usize, usize, f64),
    states: Vec<State>,
    frames: Vec<Frame>,
    /// Of every frame, `color_from_board` in each state: rows of the rotation, then the translation in metres.
    poses: Vec<Vec<Option<[f64; 12]>>>,
    alignment: Option<Alignment>,
}

/// Colour pixel = centre + zoom · (depth pixel − shift − centre).
#[derive(Serialize)]
struct Alignment {
    zoom: f64,
    shift_px: [f64; 2],
    center_px: [f64; 2],
}

/// How pixels and depths become points.
#[derive(Serialize)]
struct State {
    label: String,
    /// Columns and rows of `rays`, whose first and last nodes are the first and last pixel centres.
    nodes: [usize; 2],
    /// x/z and y/z at each node; nothing where the camera model ends.
    rays: Vec<Option<[f64; 2]>>,
    /// Depth = (sensor − bias) / scale.
    scale: f64,
    bias_m: f64,
    /// Where a pixel of the depth map belongs in the colour image; nothing where that is the same pixel.
    moved: Option<Moved>,
    /// Images and world are mirrored: in the board's frame that is before and behind.
    mirrored: bool,
}

/// The depth pixel q, mirrored first where so, belongs to the colour pixel centre + zoom · (q − shift − centre).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Moved {
    mirrored: bool,
    zoom: f64,
    shift_px: [f64; 2],
    center_px: [f64; 2],
}

#[derive(Serialize)]
struct Frame {
    frame: usize,
    columns: usize,
    rows: usize,
    step: usize,
    /// 16-bit little-endian numbers, base64.
    depth: String,
    /// What to see in each state.
    words: Vec<String>,
}

/// What the faults of an audit ask to be done to depth and images, beside the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Corrected {
    scale: f64,
    bias_m: f64,
    moved: Option<Moved>,
    mirrored: bool,
}

impl Corrected {
    const NOTHING: Self = Self { scale: 1.0, bias_m: 0.0, moved: None, mirrored: false };

    /// What `truedepth correct` would do; nothing where it would find no way.
    fn of(audit: &Audit, center_px: [f64; 2]) -> Self {
        let Ok(plan) = Plan::of_audit(audit, Selection::Faults) else { return Self::NOTHING };
        let ([zoom, _], shift_px) = (plan.zoom(), plan.shift_px());
        let mirrored = plan.mirrors_depth() && !plan.mirrors_color();
        let moves = mirrored || zoom != 1.0 || shift_px != [0.0; 2];
        let (scale, bias_m) = plan.depth_scale_and_bias();
        Self {
            scale,
            bias_m,
            moved: moves.then_some(Moved { mirrored, zoom, shift_px, center_px }),
            mirrored: plan.mirrors_color(),
        }
    }

    fn words(&self) -> String {
        let mut words = String::new();
        let is_scaled = self.scale != 1.0 || self.bias_m != 0.0;
        let moved = self.moved.is_some_and(|m| m.zoom != 1.0 || m.shift_px != [0.0; 2]);
        let turned = self.moved.is_some_and(|m| m.mirrored);
        for (is_so, what) in [
            (is_scaled, ", depth corrected"),
            (moved, ", depth moved to its colour"),
            (turned, ", depth mirrored back"),
            (self.mirrored, ", images mirrored back"),
        ] {
            if is_so {
                words.push_str(what);
            }
        }
        words
    }
}

/// One way to see the recording: with the factory's camera as it is, or with the own camera and corrected depth.
struct Case<'a> {
    label: String,
    camera: Camera,
    corrected: Corrected,
    depth: Option<&'a BoardDepth>,
    view: fn(&FrameMeasurement) -> Option<&View>,
}

fn cases(audit: &Audit) -> Vec<Case<'_>> {
    let factory = audit.factory.as_ref().map(|factory| Case {
        label: "before: as the factory says".to_owned(),
        camera: Camera { intrinsics: factory.intrinsics, distortion: Distortion::None },
        corrected: Corrected::NOTHING,
        depth: audit.factory_depth.as_ref(),
        view: |frame| frame.factory_view.as_ref(),
    });
    let own = audit.camera.as_ref().map(|camera| {
        let corrected = Corrected::of(audit, [camera.intrinsics.cx, camera.intrinsics.cy]);
        Case {
            label: format!("after: own camera{}", corrected.words()),
            camera: camera.clone(),
            corrected,
            depth: audit.own_depth.as_ref(),
            view: |frame| frame.own_view.as_ref(),
        }
    });
    factory.into_iter().chain(own).collect()
}

impl State {
    fn new(case: &Case<'_>, size_px: [usize; 2]) -> Self {
        // A pinhole's rays are linear: four of them are all of them.
        let nodes = if case.camera.distortion == Distortion::None { [2, 2] } else { RAY_NODES };
        let at = |index: usize, axis: usize| {
            (size_px[axis].max(1) - 1) as f64 * index as f64 / (nodes[axis] - 1) as f64
        };
        let node = |index: usize| {
            let pixel = Pixel::new(at(index % nodes[0], 0), at(index / nodes[0], 1));
            let ray = case.camera.unproject(pixel)?;
            ray.iter().all(|r| r.is_finite()).then_some(ray.map(|r| rounded(r, 1e6)))
        };
        Self {
            label: case.label.clone(),
            nodes,
            rays: (0..nodes[0] * nodes[1]).map(node).collect(),
            scale: case.corrected.scale,
            bias_m: case.corrected.bias_m,
            moved: case.corrected.moved,
            mirrored: case.corrected.mirrored,
        }
    }
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

fn numbers(pose: &Pose<Color, Board>) -> [f64; 12] {
    let (r, t) = (pose.rotation.matrix(), &pose.translation);
    std::array::from_fn(|i| rounded(if i < 9 { r[(i / 3, i % 3)] } else { t[i - 9] }, 1e6))
}

/// Where the sensor sees the board's corners in a frame, for people.
fn words_of(case: &Case<'_>, frame: usize) -> String {
    let depth = case.depth.and_then(|depth| depth.frames.iter().find(|f| f.frame == frame));
    let Some(depth) = depth else { return "Depth was not compared in this frame.".to_owned() };
    let limit = plain(1e3 * MAX_ERROR_M, 0);
    match depth.median_error_m {
        None => format!("At all corners the sensor is more than {limit} mm off the board."),
        Some(error_m) => {
            let side = if error_m > 0.0 { "in front of" } else { "behind" };
            format!(
                "At the corners the sensor sees the surface {} mm {side} the board (median of {}{}).",
                plain(1e3 * error_m.abs(), 2),
                words::count(depth.samples.len() - depth.n_beyond, "corner"),
                if case.corrected == Corrected::NOTHING { "" } else { ", before the correction" }
            )
        }
    }
}

/// Depth and colour of a few frames; nothing where no frame has both.
pub(super) fn closeups(audit: &Audit, pictures: &Pictures) -> Option<Markup> {
    let shown: Vec<&Closeup> = pictures
        .closeups
        .iter()
        .filter(|closeup| pictures.photos.iter().any(|photo| photo.frame == closeup.frame))
        .filter(|closeup| closeup.frame < audit.frames.len())
        .collect();
    let cases = cases(audit);
    let size_px = audit.frames.iter().find_map(|frame| frame.size_px);
    let (Some(size_px), false, false) = (size_px, shown.is_empty(), cases.is_empty()) else {
        return None;
    };
    let scene = Scene {
        unit_m: DEPTH_UNIT_M,
        size_px,
        board: (audit.board.squares_x, audit.board.squares_y, audit.board.square_m),
        states: cases.iter().map(|case| State::new(case, size_px)).collect(),
        frames: shown
            .iter()
            .map(|closeup| Frame {
                frame: closeup.frame,
                columns: closeup.columns,
                rows: closeup.rows,
                step: closeup.step,
                depth: closeup.to_base64(),
                words: cases.iter().map(|case| words_of(case, closeup.frame)).collect(),
            })
            .collect(),
        poses: audit
            .frames
            .iter()
            .map(|frame| {
                cases
                    .iter()
                    .map(|case| (case.view)(frame).map(|view| numbers(&view.color_from_board)))
                    .collect()
            })
            .collect(),
        alignment: audit.registration.as_ref().zip(audit.camera.as_ref()).map(|(r, camera)| {
            Alignment {
                zoom: r.zoom.value,
                shift_px: r.shift_px.map(|shift| shift.value),
                center_px: [camera.intrinsics.cx, camera.intrinsics.cy],
            }
        }),
    };
    let json = serde_json::to_string(&scene).expect("numbers and strings always serialise");
    Some(html! {
        section class="closeups" id="closer" aria-labelledby="closer-title" {
            h2 id="closer-title" { "Look for yourself" }
            fieldset class="choice" id="closeup-frames" {
                legend { "Frame" }
                @for (index, closeup) in shown.iter().enumerate() {
                    label {
                        input type="radio" name="closeup" value=(index) checked[index == 0];
                        " " (closeup.frame)
                    }
                }
            }
            noscript { p { "These three drawings need the page's script; everything else is readable without." } }
            (space(&cases, audit))
            div class="figures" {
                (depth_over_colour(audit, &shown))
                (edges(audit))
            }
            // `<` in a string would end the element; nothing else of HTML counts inside it.
            script type="application/json" id="scene-data" { (PreEscaped(json.replace('<', "\\u003c"))) }
        }
    })
}

fn space(cases: &[Case<'_>], audit: &Audit) -> Markup {
    let n_poses =
        audit.frames.iter().filter(|f| cases.iter().any(|c| (c.view)(f).is_some())).count();
    html! {
        figure class="figure" id="space" {
            h3 id="space-title" { "The sensor's points, the board and the cameras" }
            div class="controls" {
                @if cases.len() > 1 {
                    fieldset class="choice" id="space-state" {
                        legend { "Points and poses" }
                        @for (index, case) in cases.iter().enumerate() {
                            label {
                                input type="radio" name="space-state" value=(index) checked[index == 0];
                                " " (case.label)
                            }
                        }
                    }
                }
                fieldset class="choice" id="space-colour" {
                    legend { "Colour" }
                    label { input type="radio" name="space-colour" value="photo" checked; " photo" }
                    label { input type="radio" name="space-colour" value="distance"; " distance from the board" }
                }
                label class="choice" { input type="checkbox" id="space-cameras" checked; " cameras" }
                div class="choice" id="space-sides" {
                    button type="button" data-side="oblique" { "Oblique" }
                    button type="button" data-side="edge" { "Edge on" }
                    button type="button" data-side="front" { "Front" }
                    button type="button" data-zoom="1.25" aria-label="Nearer" { "+" }
                    button type="button" data-zoom="0.8" aria-label="Farther" { "−" }
                }
            }
            canvas id="space-view" tabindex="0" role="img" aria-labelledby="space-title" aria-describedby="space-words"
                width="900" height="560" {}
            div class="scale-of-colours off-board" id="space-scale" hidden {
                span { "20 mm in front" } span class="ramp" {} span { "20 mm behind the board" }
            }
            output id="space-words" aria-live="polite" {}
            figcaption {
                "Grey lines are the board as the camera saw it, points are what the sensor measured, pyramids are the \
                 camera in all " (words::count(n_poses, "view")) ", the frame's own drawn strong. Of a true recording \
                 the points lie on the board: look at it edge on. Drag to turn, with two fingers or the wheel to come \
                 nearer, with the right button or Shift to move; with the keyboard: arrows, + and −, Home."
            }
        }
    }
}

/// A stage with the frame's photo below and drawings over it; the script fills them and moves the line between them.
fn stage(layers: &[(&str, &str)], slider: &str, at: u32) -> Markup {
    html! {
        div class="stage" {
            img alt="The frame’s colour image";
            @for (class, words) in layers {
                div class=(format!("layer {class}")) { canvas role="img" aria-label=(words) {} }
            }
        }
        input type="range" min="0" max="100" value=(at) aria-label=(slider);
    }
}

fn depth_over_colour(audit: &Audit, shown: &[&Closeup]) -> Markup {
    let error = |depth: Option<&BoardDepth>, frame: usize| {
        let found = depth.and_then(|depth| depth.frames.iter().find(|f| f.frame == frame));
        let error_m = found.and_then(|found| found.median_error_m);
        error_m.map_or("—".to_owned(), |error_m| signed(1e3 * error_m, 2))
    };
    let row = |closeup: &&Closeup| {
        let frame = &audit.frames[closeup.frame];
        vec![
            closeup.frame.to_string(),
            frame.color.clone().unwrap_or_default(),
            frame.holes.map_or("—".to_owned(), |holes| plain(100.0 * holes, 1)),
            error(audit.factory_depth.as_ref(), closeup.frame),
            error(audit.own_depth.as_ref(), closeup.frame),
        ]
    };
    let table = Table {
        header: vec![
            "frame",
            "image",
            "without measurement, %",
            "factory error, mm",
            "own error, mm",
        ],
        rows: shown.iter().map(row).collect(),
    };
    html! {
        figure class="figure compare" id="over" {
            h3 { "Depth over colour" }
            fieldset class="choice" {
                legend { "Show" }
                label { input type="radio" name="over-shows" value="depth" checked; " depth" }
                label { input type="radio" name="over-shows" value="distance"; " distance from the board" }
            }
            (stage(&[("left", "Its depth")], "How much of the picture shows depth, percent", 50))
            div class="scale-of-colours" { span class="near" {} span class="ramp" {} span class="far" {} }
            div class="scale-of-colours off-board" hidden {
                span { "20 mm in front" } span class="ramp" {} span { "20 mm behind the board" }
            }
            output {}
            figcaption {
                "Left of the line depth, right of it colour; grey is without measurement. Depth should end where \
                 things end in the image. Distance from the board is the error of every single pixel: of a true \
                 recording the board is pale all over, before or after the correction as chosen above."
            }
            (table.to_html("Numbers behind “Depth over colour”"))
        }
    }
}

/// Bends and jumps of the depth over the photo, as recorded and moved to where the registration says they belong.
fn edges(audit: &Audit) -> Markup {
    let registration = audit.registration.as_ref();
    let rows = registration.map(|r| {
        let row = |name: &str, estimate: Estimate, decimals: usize| {
            vec![name.to_owned(), plain(estimate.value, decimals), plain(estimate.sigma, decimals)]
        };
        vec![
            row("zoom of depth against colour", r.zoom, 5),
            row("shift to the right, px", r.shift_px[0], 3),
            row("shift down, px", r.shift_px[1], 3),
        ]
    });
    let layers = [
        ("left", "Edges of its depth as recorded"),
        ("right", "The same edges moved by zoom and shift"),
    ];
    html! {
        figure class="figure compare" id="edges" {
            h3 { "Edges of depth on colour" }
            (stage(
                if rows.is_some() { &layers } else { &layers[..1] },
                "Left of it edges as recorded, percent",
                if rows.is_some() { 50 } else { 100 },
            ))
            @if rows.is_some() {
                ul class="legend" {
                    li class="edges-before" { "left: as recorded" }
                    li class="edges-after" { "right: moved by the measured zoom and shift" }
                }
            }
            figcaption {
                "Where the depth bends or jumps, drawn on the colour image. Edges that all lie beside what they belong \
                 to, more so towards the border, are a wrong zoom; all to one side, a shift."
                @if let Some(r) = registration {
                    (words::unbroken(&format!(
                        " Measured from the board’s whole surface in {}: zoom {}, shift {} px right and {} px down.",
                        words::count(r.n_frames, "frame"),
                        words::value_and_sigma(r.zoom, 4),
                        words::signed_with_sigma(r.shift_px[0], 2),
                        words::signed_with_sigma(r.shift_px[1], 2),
                    )))
                }
            }
            @if let Some(rows) = rows {
                (Table { header: vec!["depth against colour", "value", "σ"], rows }.to_html("Numbers behind “Edges”"))
            }
        }
    }
}
