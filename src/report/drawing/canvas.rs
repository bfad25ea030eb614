//! Pixels to draw into, with coverage blending.

use super::letters;
use crate::{geom::Pixel, image::Rgb, math};

/// A text's look: height of its capitals and thickness of its strokes, pixels, and colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct Ink {
    pub(in crate::report) size: f64,
    pub(in crate::report) weight: f64,
    pub(in crate::report) color: [u8; 3],
}

/// A rectangle of whole pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) struct Area {
    pub(in crate::report) x: usize,
    pub(in crate::report) y: usize,
    pub(in crate::report) width: usize,
    pub(in crate::report) height: usize,
}

/// An image to draw into. What lies outside is not drawn.
pub(in crate::report) struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    pub(in crate::report) fn new(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self { width, height, pixels: vec![color; width * height] }
    }

    pub(in crate::report) fn of(image: Rgb) -> Self {
        Self { width: image.width(), height: image.height(), pixels: image.pixels().to_vec() }
    }

    pub(in crate::report) fn finish(self) -> Rgb {
        Rgb::new(self.width, self.height, self.pixels)
    }

    pub(in crate::report) fn fill(&mut self, area: Area, color: [u8; 3]) {
        for y in area.y..(area.y + area.height).min(self.height) {
            for x in area.x..(area.x + area.width).min(self.width) {
                self.pixels[y * self.width + x] = color;
            }
        }
    }

    pub(in crate::report) fn put(&mut self, at: (usize, usize), image: &Rgb) {
        let width = image.width().min(self.width.saturating_sub(at.0));
        for (row, line) in image.pixels().chunks(image.width().max(1)).enumerate() {
            let y = at.1 + row;
            if y < self.height {
                self.pixels[y * self.width + at.0..][..width].copy_from_slice(&line[..width]);
            }
        }
    }

    /// A line with round ends.
    pub(in crate::report) fn line(&mut self, a: Pixel, b: Pixel, width: f64, color: [u8; 3]) {
        let [dx, dy] = b - a;
        let length2 = (dx * dx + dy * dy).max(1e-12);
        let reach = width / 2.0;
        let range = |low: f64, high: f64, size: usize| {
            // Saturates: a line far outside draws nothing.
            let low = (low - reach - 1.0).max(0.0) as usize;
            low..((high + reach + 2.0).max(0.0) as usize).min(size)
        };
        for y in range(a.y.min(b.y), a.y.max(b.y), self.height) {
            for x in range(a.x.min(b.x), a.x.max(b.x), self.width) {
                let [px, py] = Pixel::new(x as f64, y as f64) - a;
                let along = ((px * dx + py * dy) / length2).clamp(0.0, 1.0);
                let distance = math::hypot(px - along * dx, py - along * dy);
                let coverage = (0.5 + reach - distance).clamp(0.0, 1.0);
                if coverage > 0.0 {
                    mix(&mut self.pixels[y * self.width + x], color, coverage);
                }
            }
        }
    }

    /// A line of text, its baseline's left end at a place.
    pub(in crate::report) fn text(&mut self, at: Pixel, text: &str, ink: Ink) {
        let place = |p: Pixel| Pixel::new(at.x + p.x, at.y + p.y);
        for stroke in letters::strokes(text, ink.size) {
            for pair in stroke.windows(2) {
                self.line(place(pair[0]), place(pair[1]), ink.weight, ink.color);
            }
        }
    }
}

/// Blends a colour over another one.
pub(in crate::report) fn mix(under: &mut [u8; 3], over: [u8; 3], part: f64) {
    for (channel, target) in under.iter_mut().zip(over) {
        let blended = f64::from(*channel) + part * (f64::from(target) - f64::from(*channel));
        *channel = blended.round() as u8;
    }
}

/// The image at another width, bilinearly; for sizes from half to several times its own.
pub(in crate::report) fn scaled(image: &Rgb, width: usize) -> Rgb {
    let (w, h) = (image.width(), image.height());
    if width == w || w == 0 || h == 0 {
        return image.clone();
    }
    let height = (h * width).div_ceil(w).max(1);
    let source = |at: usize, from: usize, to: usize| {
        let at = ((at as f64 + 0.5) * from as f64 / to as f64 - 0.5).clamp(0.0, from as f64 - 1.0);
        (at as usize, (at as usize + 1).min(from - 1), at.fract())
    };
    let columns: Vec<_> = (0..width).map(|x| source(x, w, width)).collect();
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let (y0, y1, fy) = source(y, h, height);
        let (upper, lower) = (&image.pixels()[y0 * w..][..w], &image.pixels()[y1 * w..][..w]);
        for &(x0, x1, fx) in &columns {
            pixels.push([0, 1, 2].map(|i| {
                let at = |row: &[[u8; 3]], x: usize| f64::from(row[x][i]);
                let top = at(upper, x0) + fx * (at(upper, x1) - at(upper, x0));
                let bottom = at(lower, x0) + fx * (at(lower, x1) - at(lower, x0));
                (top + fy * (bottom - top)).round() as u8
            }));
        }
    }
    Rgb::new(width, height, pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_outside_is_not_drawn() {
        let mut canvas = Canvas::new(20, 10, [9; 3]);
        canvas.fill(Area { x: 15, y: 8, width: 99, height: 99 }, [1; 3]);
        canvas.put((18, 9), &Rgb::new(4, 4, vec![[2; 3]; 16]));
        canvas.line(Pixel::new(-1e9, -5.0), Pixel::new(-3.0, 1e9), 3.0, [3; 3]);
        let ink = Ink { size: 8.0, weight: 1.0, color: [4; 3] };
        canvas.text(Pixel::new(30.0, 30.0), "far", ink);
        let image = canvas.finish();
        assert_eq!(image.pixels().iter().filter(|p| **p == [1; 3]).count(), 8);
        assert_eq!(image.pixels().iter().filter(|p| **p == [2; 3]).count(), 2);
        assert_eq!(image.pixels().iter().filter(|p| **p == [9; 3]).count(), 190);
    }

    #[test]
    fn text_stands_where_it_is_told() {
        let mut canvas = Canvas::new(60, 20, [0; 3]);
        let ink = Ink { size: 8.0, weight: 1.0, color: [255; 3] };
        canvas.text(Pixel::new(30.0, 15.0), "HH", ink);
        let image = canvas.finish();
        let inked = |x: &usize| (0..20).any(|y| image.pixels()[y * 60 + x][0] > 128);
        let columns: Vec<usize> = (0..60).filter(inked).collect();
        assert_eq!([columns[0], columns[columns.len() - 1]], [30, 44]);
        assert!((0..60).all(|x| image.pixels()[17 * 60 + x] == [0; 3]), "nothing below the line");
    }

    #[test]
    fn scaling_keeps_the_ends() {
        let image = Rgb::new(2, 1, vec![[0; 3], [200; 3]]);
        let row: Vec<u8> = scaled(&image, 8).pixels()[..8].iter().map(|p| p[0]).collect();
        assert_eq!(row, [0, 0, 25, 75, 125, 175, 200, 200]);
        assert_eq!(scaled(&image, 2), image);
    }
}
