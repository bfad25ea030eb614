//! Fills the pages in `docs/method` with what the published recordings say, and draws their figures.
//!
//! ```text
//! cargo run --release --example evidence -- ../shared/data/zeiss/FrontCamCalibrationDataset docs/method
//! ```
//!
//! In each page the lines between `<!-- made by examples/evidence.rs -->` and `<!-- end -->` are replaced.

use std::{fmt::Write, fs, path::Path, sync::Arc};

use truedepth::{
    audit::{Audit, Options, audit},
    calibrate::{Estimate, Lens},
    correct::{DepthWarp, PixelMap, Sampling},
    depth::Pattern,
    files::{Limits, Memory},
    geom::Pixel,
    image::DepthMap,
    measure::{Method, Silent},
    recording::{FrameImage, Recording, encode_depth},
};

const RECORDINGS: [(&str, &str); 3] = [
    ("iPadPro12_5gen_iOS15", "iPad 12.9\" 5gen"),
    ("iPadPro12_4gen_iOS15", "iPad 12.9\" 4gen"),
    ("iPhone11Pro_iOS14", "iPhone 11 Pro"),
];
const LENSES: [(Lens, &str); 5] = [
    (Lens::None, "nothing"),
    (Lens::InverseTable, "inverse table"),
    (Lens::ForwardTable, "forward table"),
    (Lens::FreeTable, "free share of the table"),
    (Lens::FreeRadial, "free k1 (k2)"),
];
const BEGIN: &str = "<!-- made by examples/evidence.rs -->\n";
const END: &str = "<!-- end -->";

fn main() {
    let mut arguments = std::env::args().skip(1);
    let (Some(data), Some(pages)) = (arguments.next(), arguments.next()) else {
        panic!("give the folder of the recordings and that of the pages");
    };
    let (data, pages) = (Path::new(&data), Path::new(&pages));
    let run = |recording: &Recording, method| {
        audit(recording, &Options::new(method), &Silent).expect("audits")
    };
    let open = |name: &str| Recording::open(data.join(name), &Limits::default()).expect("opens");
    let all: Vec<(&str, Audit, Audit)> = RECORDINGS
        .iter()
        .map(|(name, title)| {
            let recording = open(name);
            (*title, run(&recording, Method::Auto), run(&recording, Method::Paper))
        })
        .collect();
    fill(pages, "what-the-paper-missed.md", &models(&all));
    fill(pages, "distortion.md", &hypotheses(&all));
    fill(pages, "depth.md", &depth(&all));
    fs::write(pages.join("residual-maps.svg"), maps(&all)).expect("writes");
    let mut warped = String::from(
        "| recording | depth maps | zoom by slopes | by the print | both | against as recorded | shift by slopes, px | by the \
         print | both | apart | TD401, TD402 |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for ((name, title), (_, plain, _)) in RECORDINGS.iter().zip(&all) {
        let as_recorded = plain.registration.as_ref().expect("registers").zoom;
        row(&mut warped, title, "as recorded", plain, as_recorded.value);
        for zoom in [0.9507, 1.0 / 0.9507] {
            let files = warp(data, name, &open(name), zoom);
            let recording =
                Recording::from_files(Arc::new(files), &Limits::default()).expect("opens");
            let audit = run(&recording, Method::Auto);
            row(&mut warped, title, &format!("warped by {zoom:.4}"), &audit, as_recorded.value);
        }
    }
    fill(pages, "alignment.md", &warped);
    let mut samplings = String::from(
        "| recording | places | 7x7 quadratic to map, mm | to edge-aware | to nearest | measured after, % | nearest, % \
         |\n|---|---|---|---|---|---|---|\n",
    );
    for (name, title) in RECORDINGS {
        samplings.push_str(&resampled(&open(name), title));
    }
    fill(pages, "correct.md", &samplings);
}

fn fill(pages: &Path, name: &str, text: &str) {
    let path = pages.join(name);
    let page = fs::read_to_string(&path).expect("the page is there");
    let begin = page.find(BEGIN).expect("a place to fill") + BEGIN.len();
    let end = begin + page[begin..].find(END).expect("its end");
    fs::write(&path, format!("{}{text}{}", &page[..begin], &page[end..])).expect("writes");
}

fn pm(e: Estimate, digits: usize) -> String {
    format!("{:.digits$} ± {:.digits$}", e.value, e.sigma)
}

/// Every model of every device.
fn models(all: &[(&str, Audit, Audit)]) -> String {
    let mut out = String::from(
        "| device | model | focal length, px | against factory | RMS, px | held out, px |\n|---|---|---|---|---|---|\n",
    );
    for (title, auto, paper) in all {
        let factory = auto.factory.as_ref().expect("metadata").intrinsics.fx;
        let calibration = auto.calibration.as_ref().expect("calibrates");
        let mut line = |model: &str, focal: Estimate, rms: f64, held_out: &str| {
            let percent = 100.0 * (focal.value / factory - 1.0);
            writeln!(
                out,
                "| {title} | {model} | {} | {percent:+.2} % | {rms:.3} | {held_out} |",
                pm(focal, 2)
            )
            .expect("a string grows");
        };
        let by_paper = paper.calibration.as_ref().expect("calibrates");
        line("as the paper", by_paper.focal_px(), by_paper.rms_px, "");
        for candidate in &calibration.candidates {
            let chosen = candidate.model == calibration.model;
            let name = candidate.model.name();
            let name = if chosen { format!("**{name}**") } else { name.to_owned() };
            line(
                &name,
                candidate.focal_px,
                candidate.rms_px,
                &format!("{:.3}", candidate.held_out_rms_px),
            );
        }
    }
    out
}

/// What lies between stream and pinhole.
fn hypotheses(all: &[(&str, Audit, Audit)]) -> String {
    let mut out = String::from(
        "| device | between stream and pinhole | RMS, px | with a flat board | focal length, px | principal point, px |\n\
         |---|---|---|---|---|---|\n",
    );
    for (title, auto, _) in all {
        let test = auto.distortion.as_ref().expect("tells");
        for (lens, name) in LENSES {
            let Some(h) = test.hypotheses.iter().find(|h| h.lens == lens) else { continue };
            let [x, y] = h.center_px;
            writeln!(
                out,
                "| {title} | {name} | {:.3} | {:.3} | {} | {}, {} |",
                h.rms_px,
                h.flat_rms_px,
                pm(h.focal_px, 2),
                pm(x, 1),
                pm(y, 1)
            )
            .expect("a string grows");
        }
    }
    out += "\n| device | share of the table | displacement at the corner, px | state | the file says corrected |\n\
            |---|---|---|---|---|\n";
    for (title, auto, _) in all {
        let test = auto.distortion.as_ref().expect("tells");
        let flag = auto.factory.as_ref().and_then(|f| f.geometric_distortion_correction);
        writeln!(
            out,
            "| {title} | {} | {} | {} | {} |",
            test.amplitude.map_or("no table".to_owned(), |a| pm(a, 3)),
            pm(test.corner_shift_px, 2),
            auto.distortion_state.name(),
            flag.map_or("nothing", |on| if on { "yes" } else { "no" }),
        )
        .expect("a string grows");
    }
    out
}

fn depth(all: &[(&str, Audit, Audit)]) -> String {
    let mut out = String::from(
        "| device | scale | bias, mm | sensor − board at the mean distance | pixel noise | frame to frame | in all frames | holes within reach |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for (title, auto, _) in all {
        let r = auto.registration.as_ref().expect("registers");
        let mm = |e: Estimate| Estimate { value: 1e3 * e.value, sigma: 1e3 * e.sigma };
        let p = &r.pattern;
        writeln!(
            out,
            "| {title} | {} | {} | {} mm at {:.0} mm | {:.2} mm | {:.2} mm | {:.2} mm | {:.2} % |",
            pm(r.scale, 4),
            pm(mm(r.bias_m), 2),
            pm(mm(r.error_at_m(r.center_m)), 2),
            1e3 * r.center_m,
            1e3 * p.pixel_noise_m,
            1e3 * p.frame_noise_m,
            1e3 * p.fixed_m,
            100.0 * p.holes.share_in_reach().unwrap_or(f64::NAN),
        )
        .expect("a string grows");
    }
    out
}

fn row(out: &mut String, title: &str, what: &str, audit: &Audit, before: f64) {
    let r = audit.registration.as_ref().expect("registers");
    let verdict = |code: &str| {
        audit.findings.iter().find(|f| f.code.name() == code).expect("is checked").verdict.name()
    };
    let both = |[x, y]: [Estimate; 2]| format!("{}, {}", pm(x, 2), pm(y, 2));
    let print = r.imprint.as_ref();
    writeln!(
        out,
        "| {title} | {what} | {} | {} | {} | {:+.2} % | {} | {} | {} | {} | {}, {} |",
        pm(r.slopes.zoom, 4),
        print.map_or_else(String::new, |p| pm(p.zoom, 4)),
        pm(r.zoom, 4),
        100.0 * (r.zoom.value / before - 1.0),
        both(r.slopes.shift_px),
        print.map_or_else(String::new, |p| both(p.shift_px)),
        both(r.shift_px),
        r.disagreement.map_or_else(String::new, |d| format!("{d:.1}")),
        verdict("TD401"),
        verdict("TD402"),
    )
    .expect("a string grows");
}

/// The recording with depth maps that show the window of this size about the principal point.
fn warp(data: &Path, name: &str, recording: &Recording, zoom: f64) -> Memory {
    let mut files = Memory::new("warped");
    for entry in fs::read_dir(data.join(name)).expect("lists") {
        let entry = entry.expect("lists");
        let file = entry.file_name().into_string().expect("a plain name");
        files.insert(file, fs::read(entry.path()).expect("reads"));
    }
    let factory = recording.factory().expect("metadata").intrinsics;
    for (index, frame) in recording.frames.iter().enumerate() {
        let Some(FrameImage { file, .. }) = &frame.depth else { continue };
        let map = recording.depth(index).expect("decodes");
        let (width, height) = (map.width(), map.height());
        let from = |q: usize, c: f64| (c + zoom * (q as f64 - c)).round();
        let depth_m = (0..width * height)
            .map(|i| {
                let (x, y) = (from(i % width, factory.cx), from(i / width, factory.cy));
                if x < 0.0 || y < 0.0 { f32::NAN } else { map.at(x as usize, y as usize) }
            })
            .collect();
        files.insert(file.clone(), encode_depth(&DepthMap::new(width, height, depth_m)));
    }
    files
}

/// What resampling costs: real depth maps moved by the paper's zoom, against a quadratic through 7x7 measurements.
fn resampled(recording: &Recording, title: &str) -> String {
    const HALF: usize = 3;
    let factory = recording.factory().expect("metadata").intrinsics;
    let (width, height, zoom) = (factory.width, factory.height, 0.9507);
    let source = |q: Pixel| {
        Pixel::new(factory.cx + (q.x - factory.cx) / zoom, factory.cy + (q.y - factory.cy) / zoom)
    };
    let map = PixelMap::new(width, height, |q| Some(source(q)));
    let warps = [Sampling::EdgeAware, Sampling::Nearest].map(|how| DepthWarp::new(&map, how));
    // Of the map as it is, then of both samplings: squares, sum and number of the errors in millimetres.
    let mut errors = [[0.0; 3]; 3];
    let mut n_measured = [0usize; 3];
    for frame in 0..recording.frames.len() {
        let depth = recording.depth(frame).expect("decodes");
        let moved = warps.each_ref().map(|warp| warp.apply(&depth));
        for (n, map) in n_measured.iter_mut().zip([&depth, &moved[0], &moved[1]]) {
            *n += map.depth_m().iter().filter(|z| !z.is_nan()).count();
        }
        for v in (0..height).step_by(7) {
            for u in (0..width).step_by(7) {
                let p = source(Pixel::new(u as f64, v as f64));
                if !(p.x >= 4.0
                    && p.y >= 4.0
                    && p.x < width as f64 - 5.0
                    && p.y < height as f64 - 5.0)
                {
                    continue;
                }
                let (x, y) = (p.x.round() as usize, p.y.round() as usize);
                let Some(smooth) = quadratic(&depth, [x, y], HALF) else { continue };
                let truth = smooth(p.x - x as f64, p.y - y as f64);
                let own = f64::from(depth.at(x, y)) - smooth(0.0, 0.0);
                let [edge_aware, nearest] = moved.each_ref().map(|m| f64::from(m.at(u, v)) - truth);
                for (sums, error) in errors.iter_mut().zip([own, edge_aware, nearest]) {
                    let mm = 1e3 * error;
                    *sums = [sums[0] + mm * mm, sums[1] + mm, sums[2] + 1.0];
                }
            }
        }
    }
    let cell =
        |[squares, sum, n]: [f64; 3]| format!("{:.3} ({:+.4})", (squares / n).sqrt(), sum / n);
    // All of the map comes to lie in a window of the zoom's size.
    let kept = |n: usize| 100.0 * n as f64 / (zoom * zoom * n_measured[0] as f64);
    format!(
        "| {title} | {:.0} | {} | {} | {} | {:.2} | {:.2} |\n",
        errors[0][2],
        cell(errors[0]),
        cell(errors[1]),
        cell(errors[2]),
        kept(n_measured[1]),
        kept(n_measured[2]),
    )
}

/// The least-squares quadratic through the measurements around a pixel, by the offset from it; `None` where one is
/// missing or lies on another surface.
fn quadratic(
    depth: &DepthMap,
    [x, y]: [usize; 2],
    half: usize,
) -> Option<impl Fn(f64, f64) -> f64> {
    let side = 2 * half + 1;
    let center = depth.at(x, y);
    let terms = |u: f64, v: f64| nalgebra::Vector6::new(1.0, u, v, u * u, u * v, v * v);
    let (mut normal, mut right) = (nalgebra::Matrix6::zeros(), nalgebra::Vector6::zeros());
    for i in 0..side * side {
        let (du, dv) = ((i % side) as f64 - half as f64, (i / side) as f64 - half as f64);
        let z = depth.at(x + i % side - half, y + i / side - half);
        if !((z - center).abs() <= 0.1 * center) {
            return None;
        }
        let t = terms(du, dv);
        normal += t * t.transpose();
        right += t * f64::from(z);
    }
    let fit = normal.cholesky()?.solve(&right);
    Some(move |u: f64, v: f64| terms(u, v).dot(&fit))
}

/// What stays the same in all frames, over the image: blue where the sensor is nearer than the board, red where farther.
fn maps(all: &[(&str, Audit, Audit)]) -> String {
    const CELL: usize = 14;
    let mut out = String::new();
    let step = 17 * CELL;
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"11\">",
        3 * step,
        12 * CELL + 50
    )
    .expect("a string grows");
    for (i, (title, auto, _)) in all.iter().enumerate() {
        let pattern: &Pattern = &auto.registration.as_ref().expect("registers").pattern;
        let left = i * step;
        writeln!(out, "<text x=\"{left}\" y=\"12\">{}</text>", title.replace('"', "&quot;"))
            .expect("a string grows");
        for (k, cell) in pattern.cells.iter().enumerate() {
            if cell.n_frames < 3 {
                continue;
            }
            let (x, y) = (left + k % pattern.columns * CELL, 18 + k / pattern.columns * CELL);
            let share = (1e3 * cell.median_m).clamp(-1.0, 1.0);
            let pale = (255.0 * (1.0 - share.abs())) as u8;
            let (r, g, b) = if share > 0.0 { (255, pale, pale) } else { (pale, pale, 255) };
            writeln!(
                out,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{CELL}\" height=\"{CELL}\" fill=\"rgb({r},{g},{b})\"/>"
            )
            .expect("a string grows");
        }
    }
    writeln!(
        out,
        "<text x=\"0\" y=\"{}\">sensor minus board: blue −1 mm, white 0, red +1 mm; medians over the frames; empty where \
         fewer than three showed the board</text>\n</svg>",
        12 * CELL + 40
    )
    .expect("a string grows");
    out
}
