//! Panels side by side with their words, and the bar that says what the colours mean.

use super::{Area, Canvas, Ink, viridis};
use crate::{geom::Pixel, image::Rgb, report::svg::Ticks};

const PAPER: [u8; 3] = [251, 250, 248];
const TEXT: [u8; 3] = [27, 29, 33];
const FAINT: [u8; 3] = [90, 95, 104];
/// Dark and light stripes where nothing was measured; no colour of the map is near.
pub(in crate::report) const HOLE: [[u8; 3]; 2] = [[120, 24, 74], [214, 140, 178]];

/// One picture with its words.
pub(in crate::report) struct Panel {
    /// Above it.
    pub(in crate::report) title: String,
    /// Below it; may be empty.
    pub(in crate::report) foot: String,
    pub(in crate::report) image: Rgb,
}

/// What the colours mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct Bar {
    /// Depth at its ends, metres.
    pub(in crate::report) range_m: [f64; 2],
}

/// Panels side by side under one heading.
pub(in crate::report) struct Plate {
    pub(in crate::report) heading: String,
    pub(in crate::report) panels: Vec<Panel>,
    pub(in crate::report) bar: Option<Bar>,
}

impl Plate {
    /// As one image. `unit` is the height of a capital of its words, pixels: about a 60th of what is seen at once.
    pub(in crate::report) fn draw(&self, unit: f64) -> Rgb {
        let px = |units: f64| (units * unit).round() as usize;
        let (margin, gap) = (px(2.0), px(1.6));
        let has_feet = self.panels.iter().any(|panel| !panel.foot.is_empty());
        let (top, bottom) = (margin + px(4.6), if has_feet { px(2.4) } else { 0 } + margin);
        let panels_width: usize = self.panels.iter().map(|panel| panel.image.width() + gap).sum();
        let bar_width = if self.bar.is_some() { px(9.5) } else { 0 };
        let height = self.panels.iter().map(|panel| panel.image.height()).max().unwrap_or(0);
        let width = 2 * margin + panels_width.saturating_sub(gap) + bar_width;
        let mut canvas = Canvas::new(width, top + height + bottom, PAPER);
        let strong = Ink { size: unit, weight: 0.17 * unit, color: TEXT };
        let faint = Ink { size: 0.9 * unit, weight: 0.125 * unit, color: FAINT };
        let at = |x: usize, y: f64| Pixel::new(x as f64, y);
        canvas.text(at(margin, (margin + px(1.0)) as f64), &self.heading, faint);
        let mut x = margin;
        for panel in &self.panels {
            canvas.text(at(x, top as f64 - 0.8 * unit), &panel.title, strong);
            canvas.put((x, top), &panel.image);
            let below = (top + panel.image.height()) as f64 + 1.9 * unit;
            canvas.text(at(x, below), &panel.foot, faint);
            x += panel.image.width() + gap;
        }
        if let Some(bar) = self.bar {
            let (head, tail) = (px(0.8), px(3.6));
            let length = height.saturating_sub(head + tail).max(1);
            let area = Area { x, y: top + head, width: px(1.8), height: length };
            bar.draw(&mut canvas, area, faint);
            let swatch = Area { x, y: top + height - px(1.8), width: px(1.8), height: px(1.8) };
            for (dx, dy) in
                (0..swatch.height).flat_map(|dy| (0..swatch.width).map(move |dx| (dx, dy)))
            {
                let one = Area { x: swatch.x + dx, y: swatch.y + dy, width: 1, height: 1 };
                canvas.fill(one, HOLE[usize::from(is_light(dx, dy, unit))]);
            }
            let beside = at(x + px(2.5), (swatch.y + px(1.35)) as f64);
            canvas.text(beside, "no depth", faint);
        }
        canvas.finish()
    }
}

impl Bar {
    /// Near at the top, as things near are drawn in front.
    fn draw(self, canvas: &mut Canvas, area: Area, ink: Ink) {
        let [near, far] = self.range_m.map(|m| 1e3 * m);
        for row in 0..area.height {
            let value = (row as f64 + 0.5) / area.height as f64;
            let line = Area { y: area.y + row, height: 1, ..area };
            canvas.fill(line, viridis(value));
        }
        let title = Pixel::new(area.x as f64, area.y as f64 - 1.6 * ink.size);
        canvas.text(title, "depth, mm", ink);
        let ticks = Ticks::new([near, far], 8);
        for &value in &ticks.values {
            let y = area.y as f64 + (value - near) / (far - near) * area.height as f64 - 0.5;
            let right = (area.x + area.width) as f64;
            let (from, to) = (Pixel::new(right, y), Pixel::new(right + 0.5 * ink.size, y));
            canvas.line(from, to, 0.12 * ink.size, ink.color);
            let label = Pixel::new(right + 0.9 * ink.size, y + 0.5 * ink.size);
            canvas.text(label, &ticks.label(value), ink);
        }
    }
}

/// Which stripe of a hole a pixel of the picture lies in.
pub(in crate::report) fn is_light(x: usize, y: usize, unit: f64) -> bool {
    let period = (0.8 * unit).round().max(4.0) as usize;
    (x + y) % period < period / 3
}

/// Small pictures in rows, each with its words above it.
pub(in crate::report) fn contact_sheet(
    heading: String,
    shots: Vec<(String, Rgb)>,
    bar: Option<Bar>,
) -> Rgb {
    const UNIT: f64 = 11.0;
    let columns = (1..=8).find(|c| 3 * c * c >= 4 * shots.len()).unwrap_or(8);
    let cell = shots
        .iter()
        .fold((0, 0), |(w, h), (_, image)| (image.width().max(w), image.height().max(h)));
    let step = (cell.0 + 12, cell.1 + 26);
    let rows = shots.len().div_ceil(columns);
    let columns = columns.min(shots.len());
    let mut canvas = Canvas::new(columns * step.0 - 12.min(columns * step.0), rows * step.1, PAPER);
    for (index, (title, image)) in shots.iter().enumerate() {
        let (x, y) = (index % columns * step.0, index / columns * step.1 + 22);
        let ink = Ink { size: 9.0, weight: 1.2, color: FAINT };
        canvas.text(Pixel::new(x as f64, y as f64 - 6.0), title, ink);
        canvas.put((x, y), image);
    }
    let image = canvas.finish();
    Plate { heading, panels: vec![Panel { title: String::new(), foot: String::new(), image }], bar }
        .draw(UNIT)
}
