//! A few frames to look at closely: depth over colour, edges of depth over colour, and the cloud in space.

use maud::{Markup, PreEscaped, html};
use serde::Serialize;

use crate::{
    audit::{Audit, FrameAudit},
    camera::{Camera, Distortion},
    depth::{BoardDepth, MAX_ERROR_M},
    diagnose::Correction,
    geom::{Board, Color, Pixel, Pose},
    pose::View,
    report::{
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

/// One way to see the recording: with the factory's camera as it is, or with the own camera and corrected depth.
struct Case<'a> {
    label: String,
    camera: Camera,
    scale: f64,
    bias_m: f64,
    depth: Option<&'a BoardDepth>,
    view: fn(&FrameAudit) -> Option<&View>,
}

fn cases(audit: &Audit) -> Vec<Case<'_>> {
    let factory = audit.factory.as_ref().map(|factory| Case {
        label: "before: as the factory says".to_owned(),
        camera: Camera { intrinsics: factory.intrinsics, distortion: Distortion::None },
        scale: 1.0,
        bias_m: 0.0,
        depth: audit.factory_depth.as_ref(),
        view: |frame| frame.factory_view.as_ref(),
    });
    let correction = audit.findings.iter().find_map(|finding| match finding.correction {
        Some(Correction::Depth { scale, bias_m }) => Some((scale, bias_m)),
        _ => None,
    });
    let own = audit.camera.as_ref().map(|camera| {
        let (scale, bias_m) = correction.unwrap_or((1.0, 0.0));
        let depth = if correction.is_some() { ", depth corrected" } else { "" };
        Case {
            label: format!("after: own camera{depth}"),
            camera: camera.clone(),
            scale,
            bias_m,
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
            scale: case.scale,
            bias_m: case.bias_m,
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
                if case.scale == 1.0 && case.bias_m == 0.0 {
                    ""
                } else {
                    ", before the depth is corrected"
                }
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
            div class="scale-of-colours" id="space-scale" hidden {
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

fn depth_over_colour(audit: &Audit, shown: &[&Closeup]) -> Markup {
    let error = |depth: Option<&BoardDepth>, frame: usize| {
        let found = depth.and_then(|depth| depth.frames.iter().find(|f| f.frame == frame));
        let error_m = found.and_then(|found| found.median_error_m);
        error_m.map_or("—".to_owned(), |error_m| signed(1e3 * error_m, 2))
    };
    html! {
        figure class="figure compare" id="over" {
            h3 { "Depth over colour" }
            div class="stage" { img alt="The frame’s colour image"; canvas role="img" aria-label="Its depth" {} }
            input type="range" min="0" max="100" value="50" aria-label="How much of the picture shows depth, percent";
            div class="scale-of-colours" { span class="near" {} span class="ramp" {} span class="far" {} }
            figcaption {
                "Left of the line depth, right of it colour; grey is without measurement. Depth should end where things \
                 end in the image."
            }
            details class="data" {
                summary { "Numbers behind “Depth over colour”" }
                div class="scroll" tabindex="0" role="region" aria-label="Numbers behind “Depth over colour”" {
                    table {
                        thead { tr {
                            @for title in ["frame", "image", "without measurement, %", "factory error, mm", "own error, mm"] {
                                th scope="col" { (title) }
                            }
                        } }
                        tbody {
                            @for closeup in shown {
                                @let frame = &audit.frames[closeup.frame];
                                tr {
                                    td { (closeup.frame) }
                                    td { (frame.color.clone().unwrap_or_default()) }
                                    td { (frame.holes.map_or("—".to_owned(), |holes| plain(100.0 * holes, 1))) }
                                    td { (error(audit.factory_depth.as_ref(), closeup.frame)) }
                                    td { (error(audit.own_depth.as_ref(), closeup.frame)) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn edges(_audit: &Audit) -> Markup {
    html! {
        figure class="figure compare" id="edges" {
            h3 { "Edges of depth on colour" }
            div class="stage" { img alt="The frame’s colour image"; canvas role="img" aria-label="Edges of its depth" {} }
            input type="range" min="0" max="100" value="100" aria-label="How much of the picture shows edges, percent";
            figcaption {
                "Where the depth bends or jumps, drawn on the colour image up to the line. Edges that all lie beside \
                 what they belong to, more so towards the border, are a wrong zoom; all to one side, a shift."
            }
        }
    }
}
