//! A few frames with what the detector saw in them.

use maud::{Markup, html};

use crate::{
    audit::{Audit, FrameAudit},
    report::{overlay::Overlay, photo::Photo, svg::n, words},
};

/// The most that a page shows: enough to see how it went, few enough to keep page and work small.
const MAX_FRAMES: usize = 12;

/// Frames worth looking at, in order: the four whose view fits worst, the frame with the fewest corners, and others
/// spread evenly over the recording; at most twelve, all with a colour image.
pub fn frames_to_show(audit: &Audit) -> Vec<usize> {
    let with_image: Vec<usize> =
        (0..audit.frames.len()).filter(|&frame| audit.frames[frame].color.is_some()).collect();
    let mut worst = with_image.clone();
    worst.sort_by(|&a, &b| rms(&audit.frames[b]).total_cmp(&rms(&audit.frames[a])));
    let mut chosen: Vec<usize> =
        worst.into_iter().filter(|&f| rms(&audit.frames[f]) > 0.0).take(4).collect();
    chosen.extend(
        with_image.iter().copied().min_by_key(|&f| audit.frames[f].observation.corners.len()),
    );
    chosen.sort_unstable();
    chosen.dedup();
    let wanted = MAX_FRAMES.min(with_image.len());
    let others: Vec<usize> =
        with_image.into_iter().filter(|frame| !chosen.contains(frame)).collect();
    let missing = wanted.saturating_sub(chosen.len());
    chosen.extend((0..missing).map(|i| others[i * others.len() / missing]));
    chosen.sort_unstable();
    chosen
}

fn rms(frame: &FrameAudit) -> f64 {
    frame.own_view.as_ref().or(frame.factory_view.as_ref()).map_or(0.0, |view| view.rms_px)
}

/// Images with corners, ids, markers and rejects over them; nothing where there are no photos of known frames.
pub(super) fn gallery(audit: &Audit, photos: &[Photo]) -> Markup {
    let shown: Vec<(&Photo, &FrameAudit)> =
        photos.iter().filter_map(|photo| Some((photo, audit.frames.get(photo.frame)?))).collect();
    if shown.is_empty() {
        return html! {};
    }
    html! {
        section class="gallery" id="frames" aria-labelledby="frames-title" {
            h2 id="frames-title" { "What the detector saw" }
            p class="lead" {
                "Of " (words::count(audit.frames.len(), "frame")) ", the worst and a spread of the others. Rings are \
                 corners with their ids, outlines are where markers must be, crosses are candidates that were not \
                 taken. Rings that miss a corner of the chessboard would make everything above worthless."
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
                @for (photo, frame) in shown { li { (picture(audit, photo, frame)) } }
            }
        }
    }
}

fn picture(audit: &Audit, photo: &Photo, frame: &FrameAudit) -> Markup {
    let (width, height) = photo.size_px;
    let overlay = Overlay::new(&frame.observation, &audit.board, photo.size_px);
    let name = frame.color.clone().unwrap_or_else(|| format!("frame {}", photo.frame));
    let rms = rms(frame);
    let fit = if rms > 0.0 { format!(", RMS {} px", words::plain(rms, 2)) } else { String::new() };
    let corners = words::count(overlay.corners.len(), "corner");
    let rejected = words::count(overlay.rejects.len(), "reject");
    // Integers are pixel centres: the image reaches from −0.5.
    let view_box = format!("-0.5 -0.5 {} {}", n(width as f64), n(height as f64));
    html! {
        figure {
            button type="button" class="zoom" aria-label=(format!("Enlarge {name}")) {
                span class="picture" style=(format!("aspect-ratio: {width} / {height}")) {
                    img src=(photo.data_uri()) alt=(format!("Colour image {name}, {corners} found")) loading="lazy";
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn worst_and_spread() {
        let mut audit = sample::audit();
        let frames = frames_to_show(&audit);
        assert_eq!(frames.len(), MAX_FRAMES.min(audit.frames.len()));
        assert!(frames.windows(2).all(|pair| pair[0] < pair[1]), "{frames:?}");
        // Many frames, one of them bad: it is among those shown.
        let template = audit.frames[0].clone();
        audit.frames = (0..200).map(|_| template.clone()).collect();
        audit.frames[117].own_view.as_mut().expect("the sample has one").rms_px = 9.0;
        audit.frames[5].color = None;
        let frames = frames_to_show(&audit);
        assert_eq!(frames.len(), MAX_FRAMES);
        assert!(frames.contains(&117) && !frames.contains(&5), "{frames:?}");
        assert!(
            frames.last().is_some_and(|&last| last > 150),
            "spread over the recording: {frames:?}"
        );
        audit.frames.clear();
        assert!(frames_to_show(&audit).is_empty());
    }
}
