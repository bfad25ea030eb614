//! What follows from the paper's printed numbers alone, without any data.

use super::{
    Check, Printed, Section,
    paper::{DERIVED, EQUATIONS, FOCAL},
};
use crate::diagnose::{Api, Comparison, Entry, Registry, pairs};

fn printed(value: f64, decimals: usize) -> Printed {
    Printed { value, decimals }
}

/// Both worked equations and the zoom.
pub(super) fn equations(registry: &Registry) -> Section {
    let pair = |device: &str, version: &str| {
        let all = pairs(registry);
        let name = format!("{device}/{version}/av");
        all.into_iter().find(|pair| pair.first.name == name).expect("published rows are there")
    };
    let second = pair("ipad-12.9-5gen", "ios14");
    let across = second.across.expect("rows of both APIs");
    let at_640 = |px: f64, side: &crate::diagnose::Side| px * 640.0 / side.sheet.reference[0];
    let first = pair("ipad-12.9-4gen", "v2").across.expect("rows of both APIs");
    let checks = vec![
        Check::recomputed(
            "Issue 2, AVFoundation: f_av² / f_ar · 640/2016 = 1781.78² / 1916.17 · 640/2016"
                .to_owned(),
            printed(EQUATIONS[0], 2),
            at_640(across.av_corrected_px, &second.first),
            "px",
        ),
        Check::recomputed(
            "Issue 2, ARKit: f_ar · (1 + 2·(1 − f_ar/f_av)) · 640/2880".to_owned(),
            printed(EQUATIONS[1], 2),
            at_640(across.ar_corrected_px, &second.second),
            "px",
        ),
        Check::recomputed(
            "Issue 1, zoom of the width: 3088/3248".to_owned(),
            printed(EQUATIONS[2], 4),
            first.depth_zoom[0],
            "",
        ),
        Check::recomputed(
            "Issue 1, zoom of the height: 2316/2436".to_owned(),
            printed(EQUATIONS[2], 4),
            first.depth_zoom[1],
            "",
        ),
    ];
    Section {
        id: "equations",
        title: "The worked equations",
        lead: "What the paper computes in its text, from its own device tables.".to_owned(),
        checks,
    }
}

/// The column "difference" of the table of focal lengths.
pub(super) fn focal_differences() -> Vec<Check> {
    FOCAL
        .iter()
        .map(|row| {
            let percent = 100.0 * (row.own_px - row.factory_px).abs() / row.factory_px;
            let check = Check::recomputed(
                format!(
                    "{}: difference of {:.2} and {:.2} px",
                    row.title, row.factory_px, row.own_px
                ),
                printed(row.difference_percent, 2),
                percent,
                "%",
            );
            let cut = (100.0 * percent).floor() / 100.0;
            match check.status {
                super::Status::Slip if (cut - row.difference_percent).abs() < 1e-9 => {
                    check.noted("cut off instead of rounded")
                }
                super::Status::Slip => check.noted("does not follow from the two focal lengths"),
                _ => check,
            }
        })
        .collect()
}

/// Derived columns of the device tables, and what must hold between their columns.
pub(super) fn devices(registry: &Registry) -> Section {
    let mut checks = Vec::new();
    for pair in pairs(registry) {
        let device = pair.first.name.split('/').next().unwrap_or_default();
        let Some((_, focal, reference)) = DERIVED.iter().find(|(name, ..)| *name == device) else {
            continue;
        };
        checks.extend(derived(&pair, *focal, *reference));
    }
    for entry in registry.entries().iter().filter(|e| e.source == "arXiv:2201.10865") {
        checks.extend(color_focal(entry));
        checks.extend(color_center(registry, entry));
    }
    Section {
        id: "devices",
        title: "The device tables",
        lead: "Derived columns of all twenty rows, and whether the colour camera's columns follow from the depth \
               camera's: both are one camera, at two sizes. Rows that agree throughout are counted, the others shown."
            .to_owned(),
        checks,
    }
}

fn derived(pair: &Comparison, focal: f64, reference: f64) -> Vec<Check> {
    let Some(across) = &pair.across else { return Vec::new() };
    let name = pair.first.name.trim_end_matches("/av");
    let focal = Check::recomputed(
        format!("{name}: depth intrinsics, ARKit against AVFoundation"),
        printed(focal, 1),
        100.0 * across.focal_difference.abs(),
        "%",
    );
    let reference = Check::recomputed(
        format!("{name}: reference dimensions, ARKit against AVFoundation"),
        printed(reference, 1),
        100.0 * across.reference_difference[0].abs(),
        "%",
    );
    let reference = match reference.status {
        super::Status::Slip => reference.noted("2880/2016 is 1.4286"),
        _ => reference,
    };
    vec![focal, reference]
}

/// Columns of the colour image that the paper's colour columns are for.
fn color_width(api: Api) -> f64 {
    if api == Api::ArKit { 1440.0 } else { 640.0 }
}

/// The colour focal length is the depth's at the colour image's width; printed to 0.01 px, as is the other.
fn color_focal(entry: &Entry) -> Option<Check> {
    let width = color_width(entry.api);
    let mut check = Check::recomputed(
        format!("{}: colour focal length from the depth's", entry.name()),
        printed(entry.sheet.color_focal_px?, 2),
        entry.sheet.focal_at_px(width),
        "px",
    );
    // The depth's is printed to 0.01 px at the reference, and two of them are cut off: 0.015 px at most.
    if check.difference()?.abs() < 0.015 {
        check.status = super::Status::Agrees;
    } else {
        check.note = "the depth column of the same row says otherwise".to_owned();
    }
    Some(check)
}

/// The colour centre lies beside the depth centre by what it does in other rows of the same camera.
fn color_center(registry: &Registry, entry: &Entry) -> Option<Check> {
    let offset = |entry: &Entry| -> Option<[f64; 2]> {
        let width = color_width(entry.api);
        let height = 0.75 * width;
        let [cx, cy] = entry.sheet.color_center?;
        let [x, y] = entry.sheet.center;
        Some([
            cx - x * width / entry.sheet.reference[0],
            cy - y * height / entry.sheet.reference[1],
        ])
    };
    let own = offset(entry)?;
    // Of other devices: two rows of one device may share their slip.
    let others: Vec<[f64; 2]> = registry
        .entries()
        .iter()
        .filter(|other| {
            other.api == entry.api
                && other.sheet.reference == entry.sheet.reference
                && other.device != entry.device
        })
        .filter_map(offset)
        .collect();
    // Conventions of pixel centres differ by at most half a pixel; and where a crop adds to it, as on the 7-megapixel
    // camera under ARKit (0.72 px), it does so on all of its units.
    let axis = (0..2).find(|&axis| {
        let alone = others.iter().all(|other| (other[axis] - own[axis]).abs() > 0.3);
        own[axis].abs() > 0.5 && alone && !others.is_empty()
    })?;
    let expected = others.iter().map(|other| other[axis]).sum::<f64>() / others.len() as f64;
    let center = entry.sheet.color_center?[axis];
    let name = ["cx", "cy"][axis];
    let check = Check::recomputed(
        format!("{}: colour {name} from the depth's and other units of this camera", entry.name()),
        printed(center, 2),
        center - own[axis] + expected,
        "px",
    );
    let note = "farther from the depth's than on any other unit, and than pixel centres can explain: a wrong digit?";
    Some(check.noted(note))
}
