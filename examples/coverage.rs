//! Are the uncertainties true? Simulates recordings, audits each, and counts how often the 95 % intervals hold the
//! truth, how often a zoom is told, and how often a sound recording is called faulty.
//!
//! ```text
//! cargo run --release --example coverage -- --recordings 200
//! ```
//!
//! `--seed N` takes other recordings: recording i is drawn from seed N + i, and N is 1000 otherwise.
//!
//! Recordings are simulated as corners with noise and whole depth maps with noise, holes and quantisation
//! ([`truedepth::simulate::Plan::glimpse`]); `--rendered N` renders the first N of them as pictures, too, and detects
//! the board in these.

#![allow(clippy::print_stdout, reason = "the study's outcome goes there")]

use std::sync::Arc;

use rayon::prelude::{IntoParallelIterator, ParallelIterator};
use truedepth::{
    audit::{Audit, Options, audit, judge},
    calibrate::{Estimate, Lens, MAX_VIEWS},
    diagnose::{Code, Finding, Tolerances, Verdict},
    files::{Limits, Memory},
    measure::{Method, Silent},
    recording::{Recording, StreamState},
    simulate::{Device, Faults, Plan},
};

/// Recordings of all devices in turn, with 15 to 30 frames, half of the boards wavy.
fn plan(index: usize, seed: usize, faults: &[&str]) -> Plan {
    let names = ["ipad-12.9-5gen", "ipad-12.9-4gen", "iphone-13"];
    let device = Device::named(names[index % names.len()]).expect("is known");
    let mut plan = Plan::new(device, (seed + index) as u64);
    let mut all = faults.to_vec();
    if index % 2 == 1 {
        all.push("bent=0.8mm");
    }
    plan.faults = Faults::parse(all).expect("faults that can be");
    plan.n_frames = 15 + index * 7 % 16;
    plan
}

fn judged(plan: &Plan) -> Audit {
    let measurer = plan.measurer(|_, depth| Some(depth)).expect("depth fits colour");
    let measured = measurer.finish(plan.about(), &Method::Auto, MAX_VIEWS, &Silent);
    judge(measured.expect("measures"), Tolerances::default())
}

fn rendered(plan: &Plan) -> Audit {
    let files = plan.write(Memory::new("simulated"), |_| ()).expect("writes");
    let recording = Recording::from_files(Arc::new(files), &Limits::default()).expect("opens");
    audit(&recording, &Options::new(Method::Auto), &Silent).expect("audits")
}

/// (value − truth) and σ of everything that was estimated.
fn errors(plan: &Plan, audit: &Audit) -> Vec<(&'static str, f64, f64)> {
    let truth = plan.truth();
    let camera = plan.true_camera().intrinsics;
    let mut errors = Vec::new();
    let mut add =
        |name, found: Estimate, truth: f64| errors.push((name, found.value - truth, found.sigma));
    if let Some(calibration) = &audit.calibration {
        let relative = |e: Estimate, by: f64| Estimate { value: e.value / by, sigma: e.sigma / by };
        add("focal, relative", relative(calibration.focal_px(), camera.fx), 1.0);
    }
    // The principal point is not free in the model that is mostly chosen, but it is in the test of the distortion.
    let lens = match (plan.stream(), factory_has_tables(plan)) {
        (StreamState::Rectified, _) => Lens::None,
        (_, true) => Lens::InverseTable,
        (_, false) => Lens::FreeRadial,
    };
    let test = audit.distortion.as_ref();
    if let Some(h) = test.and_then(|t| t.hypotheses.iter().find(|h| h.lens == lens)) {
        add("centre x, px", h.center_px[0], camera.cx);
        add("centre y, px", h.center_px[1], camera.cy);
    }
    if let Some(found) = &audit.registration {
        add("depth scale", found.scale, truth.depth.scale);
        add("depth bias, m", found.bias_m, truth.depth.bias_m);
        add("zoom", found.zoom, truth.depth.zoom[0]);
        add("shift x, px", found.shift_px[0], truth.depth.shift_px[0]);
        add("shift y, px", found.shift_px[1], truth.depth.shift_px[1]);
        // Each witness for itself.
        add("zoom, slopes", found.slopes.zoom, truth.depth.zoom[0]);
        add("shift x, slopes", found.slopes.shift_px[0], truth.depth.shift_px[0]);
        add("shift y, slopes", found.slopes.shift_px[1], truth.depth.shift_px[1]);
        if let Some(print) = &found.imprint {
            add("zoom, print", print.zoom, truth.depth.zoom[0]);
            add("shift x, print", print.shift_px[0], truth.depth.shift_px[0]);
            add("shift y, print", print.shift_px[1], truth.depth.shift_px[1]);
        }
    }
    errors
}

fn factory_has_tables(plan: &Plan) -> bool {
    plan.factory().tables.is_some()
}

fn table(title: &str, plans: &[Plan], audits: &[Audit]) {
    println!("{title}: {} recordings", plans.len());
    println!(
        "{:>16} {:>5} {:>11} {:>11} {:>11} {:>9} {:>9}",
        "", "n", "bias", "spread", "median σ", "in 95 %", "RMS z"
    );
    let all: Vec<_> = plans.iter().zip(audits).flat_map(|(p, a)| errors(p, a)).collect();
    let mut names: Vec<&str> = Vec::new();
    for (name, ..) in &all {
        if !names.contains(name) {
            names.push(name);
        }
    }
    for name in names {
        let of: Vec<_> = all.iter().filter(|e| e.0 == name).collect();
        let n = of.len() as f64;
        let bias = of.iter().map(|e| e.1).sum::<f64>() / n;
        let spread = (of.iter().map(|e| (e.1 - bias).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let mut sigmas: Vec<f64> = of.iter().map(|e| e.2).collect();
        sigmas.sort_by(f64::total_cmp);
        let held = of.iter().filter(|e| e.1.abs() <= 1.96 * e.2).count() as f64;
        let z = (of.iter().map(|e| (e.1 / e.2).powi(2)).sum::<f64>() / n).sqrt();
        println!(
            "{name:>16} {n:>5} {bias:>+11.6} {spread:>11.6} {:>11.6} {:>7.1} % {z:>9.2}",
            sigmas[sigmas.len() / 2],
            100.0 * held / n
        );
    }
    // Streams that are as the lens drew them are no slip of the check.
    let is_true = |plan: &Plan, code: Code| {
        let made = |name: &str| plan.faults.defects().iter().any(|d| d.name().starts_with(name));
        match code {
            Code::TD203 => plan.stream() == StreamState::Distorted,
            Code::TD301 => made("depth-scale"),
            Code::TD302 => made("depth-bias"),
            Code::TD401 => made("depth-zoom"),
            Code::TD402 => made("depth-shift"),
            _ => false,
        }
    };
    let count = |title: &str, which: &dyn Fn(&Plan, &Finding) -> bool| {
        let mut codes: Vec<String> = plans
            .iter()
            .zip(audits)
            .flat_map(|(plan, a)| a.findings.iter().filter(|f| which(plan, f)))
            .map(|f| f.code.to_string())
            .collect();
        codes.sort();
        let counts: Vec<String> = codes
            .chunk_by(|a, b| a == b)
            .map(|chunk| format!("{} in {}", chunk[0], chunk.len()))
            .collect();
        println!(
            "{title}: {}",
            if counts.is_empty() { "none".to_owned() } else { counts.join(", ") }
        );
    };
    count("false faults", &|p, f| f.verdict == Verdict::Fault && !is_true(p, f.code));
    count("true faults found", &|p, f| f.verdict == Verdict::Fault && is_true(p, f.code));
    count("cannot tell", &|_, f| f.verdict == Verdict::Unknown);
    println!();
}

/// Those of one half: flat boards (0) or wavy ones (1).
fn half<T: Clone>(all: &[T], which: usize) -> Vec<T> {
    all.iter().skip(which).step_by(2).cloned().collect()
}

/// The number after a flag.
fn number(flag: &str) -> Option<usize> {
    let arguments: Vec<String> = std::env::args().collect();
    let at = arguments.iter().position(|a| a == flag)?;
    Some(arguments.get(at + 1)?.parse().expect("a number"))
}

fn main() {
    let n = number("--recordings").unwrap_or(200);
    let seed = number("--seed").unwrap_or(1000);
    let study = |title: &str, n: usize, faults: &[&str], how: fn(&Plan) -> Audit| {
        let plans: Vec<Plan> = (0..n).map(|i| plan(i, seed, faults)).collect();
        let audits: Vec<Audit> = (0..n).into_par_iter().map(|i| how(&plans[i])).collect();
        table(title, &plans, &audits);
        for (which, name) in [(0, "of these flat boards"), (1, "of these wavy boards")] {
            table(name, &half(&plans, which), &half(&audits, which));
        }
        audits
    };
    study("sound", n, &[], judged);
    let zoomed = study(
        "zoom 0.9507, shift 3 and -2 px, depth 1.5 % too long and 2 mm too far",
        n.div_ceil(2),
        &["depth-zoom=0.9507", "depth-shift=3px,-2px", "depth-scale=1.5%", "depth-bias=2mm"],
        judged,
    );
    let mut sigmas: Vec<f64> = zoomed
        .iter()
        .filter_map(|a| a.registration.as_ref())
        .map(|r| (1.0 - r.zoom.value) / r.zoom.sigma)
        .collect();
    sigmas.sort_by(f64::total_cmp);
    println!(
        "zoom 0.9507 is told from 1 at {:.1} sigma (smallest), {:.1} (median)\n",
        sigmas[0],
        sigmas[sigmas.len() / 2]
    );
    if let Some(n) = number("--rendered") {
        study("sound, the same as corners", n, &[], judged);
        study("sound, rendered", n, &[], rendered);
    }
}
