//! The frames with what the detector saw in them.

use maud::{Markup, PreEscaped, html};

use crate::{
    audit::Audit,
    measure::FrameMeasurement,
    par,
    report::{overlay::Overlay, photo::Photo, pictures::rms_px, svg::n, words},
};

/// Images with corners, ids, markers and rejects over them; nothing where there are no photos of known frames.
pub(super) fn gallery(audit: &Audit, photos: &[Photo]) -> Option<Markup> {
    let shown: Vec<(&Photo, &FrameMeasurement)> =
        photos.iter().filter_map(|photo| Some((photo, audit.frames.get(photo.frame)?))).collect();
    if shown.is_empty() {
        return None;
    }
    let pictures = par::map(&shown, |(photo, frame)| picture(audit, photo, frame));
    Some(html! {
        section class="gallery" id="frames" aria-labelledby="frames-title" {
            h2 id="frames-title" { "What the detector saw" }
            p class="lead" {
                @if shown.len() < audit.frames.len() {
                    (shown.len()) " of " (words::count(audit.frames.len(), "frame")) ". "
                } @else { "All " (words::count(audit.frames.len(), "frame")) ". " }
                "Rings are corners with their ids, outlines are where markers must be, crosses are candidates that \
                 were not taken. Rings that miss a corner of the chessboard would make everything above worthless. \
                 A frame opens large; there the arrow keys leaf through them, and a corner tells its numbers."
            }
            fieldset class="layers" {
                legend { "Show" }
                @for (layer, words) in
                    [("corners", "corners"), ("ids", "ids"), ("markers", "markers"), ("rejects", "rejects")]
                {
                    label {
                        input type="checkbox" id=(format!("show-{layer}")) checked[layer != "ids"];
                        " " (words)
                    }
                }
            }
            ul class="frames" {
                @for picture in pictures { li { (picture) } }
            }
        }
    })
}

fn picture(audit: &Audit, photo: &Photo, frame: &FrameMeasurement) -> Markup {
    let (width, height) = photo.size_px;
    let overlay = Overlay::new(&frame.observation, &audit.board, photo.size_px);
    let name = frame.color.clone().unwrap_or_else(|| format!("frame {}", photo.frame));
    let rms = rms_px(frame);
    let fit = if rms > 0.0 { format!(", RMS {} px", words::plain(rms, 2)) } else { String::new() };
    let corners = words::count(overlay.corners.len(), "corner");
    let rejected = words::count(overlay.rejects.len(), "reject");
    // Integers are pixel centres: the image reaches from −0.5.
    let view_box = format!("-0.5 -0.5 {} {}", n(width as f64), n(height as f64));
    html! {
        figure {
            button type="button" class="zoom" aria-label=(format!("Enlarge {name}")) {
                span class="picture" style=(format!("aspect-ratio: {width} / {height}")) {
                    img id=(format!("photo-{}", photo.frame)) src=(PreEscaped(photo.data_uri())) loading="lazy"
                        alt=(format!("Colour image {name}, {corners} found"));
                    svg viewBox=(view_box) aria-hidden="true" { (overlay.to_svg(width)) }
                }
            }
            figcaption {
                span class="name" { (name) }
                span class="facts" { "frame " (photo.frame) ", " (corners) ", " (rejected) (fit) }
            }
        }
    }
}
