//! The focal length beside the factory's, and beside what is published of devices like this one.

use maud::html;

use super::{Figure, Key, Table};
use crate::{
    audit::Audit,
    calibrate::Estimate,
    diagnose::{Api, Certainty, Code, Registry, Sheet, paper_focals},
    report::{
        svg::{Margins, Plot, domain_of, n},
        words::{self, plain, signed, value_and_sigma},
    },
};

const ROW: f64 = 30.0;

/// The own focal length, its two halves and that of every model tried, beside the factory's and published ones.
pub(in crate::report) fn focal_lengths(audit: &Audit) -> Option<Figure> {
    let calibration = audit.calibration.as_ref()?;
    let factory = audit.factory.as_ref().map(|factory| factory.intrinsics.focal_px());
    let tolerance = audit.findings.iter().find(|f| f.code == Code::TD201).and_then(|f| f.tolerance);
    let mut estimates: Vec<(String, Estimate, &str)> = Vec::new();
    if let Some(focal) = words::focal(audit) {
        estimates.push(("measured".to_owned(), focal, "series-own"));
    }
    for (half, name) in
        calibration.split_half_focal_px.iter().flatten().zip(["first half", "second half"])
    {
        estimates.push((format!("{name} of the views"), *half, "series-half"));
    }
    for candidate in &calibration.candidates {
        let chosen = if candidate.model == calibration.model { ", chosen" } else { "" };
        let name = format!("{}{chosen}", words::model_short(candidate.model));
        estimates.push((name, candidate.focal_px, "series-candidate"));
    }
    let published = published(audit);
    let has_published = !published.is_empty();
    estimates.extend(published);
    estimates.retain(|(_, estimate, _)| estimate.value.is_finite());
    let spread = |estimate: &Estimate| {
        // A σ beyond a tenth of the value tells nothing; it must not squeeze the others.
        let sigma =
            if estimate.sigma.is_finite() { estimate.sigma.min(0.1 * estimate.value) } else { 0.0 };
        [estimate.value - 3.0 * sigma, estimate.value + 3.0 * sigma]
    };
    let band = factory.zip(tolerance).map(|(factory, percent)| {
        [factory * (1.0 - percent / 100.0), factory * (1.0 + percent / 100.0)]
    });
    let bounds = estimates.iter().flat_map(|(_, estimate, _)| spread(estimate));
    let x = domain_of(bounds.chain(factory).chain(band.into_iter().flatten()), [0.0, 1.0]);
    let height = 92.0 + ROW * estimates.len() as f64;
    let margins = Margins { left: 176.0, right: 14.0, top: 40.0, bottom: 48.0 };
    let plot = Plot::new(x, [0.0, 1.0], height, margins);
    let (top, bottom) = (plot.y.range[1], plot.y.range[0]);
    let drawing = html! {
        @if let Some([low, high]) = band {
            rect class="band" x=(n(plot.x.at(low))) width=(n(plot.x.at(high) - plot.x.at(low))) y=(n(top - 4.0))
                height=(n(bottom - top + 4.0)) {}
        }
        @if let Some(factory) = factory {
            @let x = n(plot.x.at(factory));
            @let is_right = plot.x.at(factory) > 400.0;
            line class="factory" x1=(x) x2=(x) y1=(n(top - 10.0)) y2=(n(bottom)) {}
            text class="factory" x=(x) dx=(if is_right { "6" } else { "0" }) y=(n(top - 16.0))
                text-anchor=(if is_right { "end" } else { "middle" }) {
                "factory " (plain(factory, 2))
            }
        }
        @for (index, (name, estimate, class)) in estimates.iter().enumerate() {
            @let y = n(top + ROW * (index as f64 + 0.5) + 4.0);
            @let [low, high] = spread(estimate);
            g class=(class) {
                text class="row" x="0" y=(y) dominant-baseline="central" { (name) }
                @if high > low {
                    line class="whisker" x1=(n(plot.x.at(low))) x2=(n(plot.x.at(high))) y1=(y) y2=(y) {}
                }
                circle class="mark dot" cx=(n(plot.x.at(estimate.value))) cy=(y) r=(if high > low { "5" } else { "4" })
                    data-tip=(format!("{name}: {} px", value_and_sigma(*estimate, 2))) {}
            }
        }
        (plot.x_axis("focal length, px"))
    };
    let difference =
        |value: f64| factory.map_or("—".to_owned(), |f| signed(100.0 * (value / f - 1.0), 2));
    let factory_row =
        factory.map(|f| vec!["factory".to_owned(), plain(f, 2), "—".to_owned(), "0".to_owned()]);
    let estimate_rows = estimates.iter().map(|(name, estimate, _)| {
        let Estimate { value, sigma } = *estimate;
        vec![name.clone(), plain(value, 2), plain(sigma, 3), difference(value)]
    });
    let against = match (words::focal(audit), factory) {
        (Some(own), Some(factory)) => format!(
            "Measured {} px against the factory's {} px: {} %. ",
            value_and_sigma(own, 2),
            plain(factory, 2),
            signed(100.0 * (own.value / factory - 1.0), 2)
        ),
        _ => String::new(),
    };
    Some(Figure {
        id: "focal",
        title: "Focal length beside the factory's".to_owned(),
        caption: format!(
            "{against}Points with 3 σ; the shaded band is what still counts as true. Where both halves of the views \
             agree within their σ, the σ can be believed.{}",
            if has_published {
                " Rings are published without σ: factory values of this camera, and what the paper measured of it."
            } else {
                ""
            }
        ),
        legend: [
            Some(Key { class: "series-own", words: "measured" }),
            Some(Key { class: "series-half", words: "from half of the views" }),
            Some(Key { class: "series-candidate", words: "other camera models" }),
            has_published.then_some(Key { class: "series-published", words: "published" }),
        ]
        .into_iter()
        .flatten()
        .collect(),
        view_box: plot.view_box(),
        drawing,
        table: Table {
            header: vec!["from", "focal length, px", "σ, px", "against factory, %"],
            rows: factory_row.into_iter().chain(estimate_rows).collect(),
        },
    })
}

/// What is published of this camera, at the size of these images: factory values of the registry, and what the paper
/// measured (arXiv:2201.10865, section 5.1) of the same devices by the same API.
fn published(audit: &Audit) -> Vec<(String, Estimate, &'static str)> {
    let Some(factory) = &audit.factory else { return Vec::new() };
    let Some(sheet) = Sheet::from_factory(factory) else { return Vec::new() };
    let registry = Registry::published();
    let identity = registry.identify(&sheet);
    if identity.certainty < Certainty::Camera {
        return Vec::new();
    }
    let width = factory.intrinsics.width as f64;
    let without_sigma = |value| Estimate { value, sigma: f64::NAN };
    let row = |name: String, value| (name, without_sigma(value), "series-published");
    let mut rows: Vec<_> = identity
        .matches
        .iter()
        .map(|e| row(format!("{} {}", e.device, e.version), e.sheet.focal_at_px(width)))
        .collect();
    // The paper calibrated at 640 columns, by AVFoundation.
    let is_like_the_paper = |device: &str| {
        width == 640.0
            && identity.matches.iter().any(|e| e.api == Api::AvFoundation && e.device == device)
    };
    let measured = paper_focals().into_iter().filter(|paper| is_like_the_paper(paper.device));
    rows.extend(measured.map(|paper| {
        let name = format!("paper, {} {}", paper.device, paper.unit);
        row(name.trim_end().to_owned(), paper.charuco_px)
    }));
    rows
}
