//! How well each view fits.

use maud::html;

use super::{Figure, Key, Table};
use crate::{
    audit::Audit,
    report::{
        svg::{MARGINS, Plot, n},
        words::plain,
    },
};

/// RMS of every view, by the own camera and the board's shape as calibrated, with the factory's intrinsics beside it.
pub(in crate::report) fn rms_by_view(audit: &Audit) -> Option<Figure> {
    let views: Vec<(usize, Option<f64>, Option<f64>, usize)> = audit
        .frames
        .iter()
        .enumerate()
        .map(|(frame, f)| {
            let rms = |view: Option<&crate::pose::View>| {
                view.map(|v| v.rms_px).filter(|rms| rms.is_finite())
            };
            (
                frame,
                rms(f.factory_view.as_ref()),
                rms(f.own_view.as_ref()),
                f.observation.corners.len(),
            )
        })
        .filter(|(_, factory, own, _)| factory.is_some() || own.is_some())
        .collect();
    let most = views
        .iter()
        .flat_map(|(_, factory, own, _)| [*factory, *own])
        .flatten()
        .max_by(f64::total_cmp)?;
    let last = audit.frames.len().max(2) as f64 - 1.0;
    let plot = Plot::new([-0.5, last + 0.5], [0.0, 1.08 * most.max(1e-3)], 300.0, MARGINS);
    let bar = 0.72 * (plot.x.at(1.0) - plot.x.at(0.0));
    let drawing = html! {
        (plot.y_axis("RMS, px"))
        @for (frame, factory, own, n_corners) in &views {
            @let x = plot.x.at(*frame as f64);
            @if let Some(rms) = own {
                rect class="mark series-own bar" x=(n(x - bar / 2.0)) width=(n(bar)) y=(n(plot.y.at(*rms)))
                    height=(n(plot.y.at(0.0) - plot.y.at(*rms)))
                    data-tip=(format!("frame {frame}, own: {} px over {n_corners} corners", plain(*rms, 3))) {}
            }
            @if let Some(rms) = factory {
                line class="mark series-factory level" x1=(n(x - bar / 2.0)) x2=(n(x + bar / 2.0))
                    y1=(n(plot.y.at(*rms))) y2=(n(plot.y.at(*rms)))
                    data-tip=(format!("frame {frame}, factory: {} px over {n_corners} corners", plain(*rms, 3))) {}
            }
        }
        (plot.x_axis("frame"))
    };
    let cell = |rms: Option<f64>| rms.map_or("—".to_owned(), |rms| plain(rms, 4));
    Some(Figure {
        id: "views",
        title: "How well each view fits".to_owned(),
        caption: "Distance between the corners as seen and as the camera model predicts them. One tall bar is a \
                  blurred or wrong view; tall bars throughout are a wrong model or a board that is not flat. With the \
                  factory's intrinsics the board is taken for flat; with the own ones it has the shape that was \
                  found, in the frames that the calibration used."
            .to_owned(),
        legend: vec![
            Key { class: "series-own square", words: "own intrinsics" },
            Key { class: "series-factory level", words: "factory intrinsics" },
        ],
        view_box: plot.view_box(),
        drawing,
        table: Table {
            header: vec!["frame", "image", "corners", "factory RMS, px", "own RMS, px"],
            rows: views
                .into_iter()
                .map(|(frame, factory, own, n_corners)| {
                    let image = audit.frames[frame].color.clone().unwrap_or_default();
                    vec![frame.to_string(), image, n_corners.to_string(), cell(factory), cell(own)]
                })
                .collect(),
        },
    })
}
