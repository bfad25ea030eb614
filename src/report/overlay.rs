//! What the detector saw, drawn over the image it saw it in.

use maud::{Markup, html};

use super::svg::tenth;
use crate::{
    board::CharucoBoard,
    detect::Observation,
    geom::{Homography, Pixel},
    image::Rgb,
    math,
};

/// What there is to draw over one image, in pixels of that image (integers are pixel centres).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    /// Corners with their ids.
    pub corners: Vec<(usize, Pixel)>,
    /// Lines between neighbouring corners.
    pub lattice: Vec<[Pixel; 2]>,
    /// Outlines of the markers that were identified, where the corners say they must be: those that voted. Markers that
    /// are hidden, or leave the image, have none.
    pub markers: Vec<[Pixel; 4]>,
    /// Candidates that were not taken.
    pub rejects: Vec<Pixel>,
}

impl Overlay {
    /// What to draw over an image of `size` (columns, rows).
    ///
    /// Markers are placed by the homography of all corners, so the lens may move them by a pixel or two; corners are
    /// exactly where the detector put them. Without at least six corners no marker is drawn.
    pub fn new(observation: &Observation, board: &CharucoBoard, size: (usize, usize)) -> Self {
        let corners: Vec<(usize, Pixel)> =
            observation.corners.iter().map(|c| (c.id, c.pixel)).collect();
        let mut lattice = Vec::new();
        for &(id, pixel) in &corners {
            let (column, _) = board.corner_cell(id);
            let columns = board.squares_x - 1;
            let right = (column + 1 < columns).then_some(id + 1);
            for neighbour in [right, Some(id + columns)].into_iter().flatten() {
                if let Some(&(_, other)) = corners.iter().find(|(id, _)| *id == neighbour) {
                    lattice.push([pixel, other]);
                }
            }
        }
        let rejects = observation.rejects.iter().map(|reject| reject.pixel).collect();
        Self {
            lattice,
            markers: markers(observation, board, size).unwrap_or_default(),
            corners,
            rejects,
        }
    }

    /// As an SVG group in the coordinates of the image. Sizes of marks follow the image, so that they look the same
    /// at every resolution.
    pub(super) fn to_svg(&self, width: usize) -> Markup {
        let unit = width as f64 / 640.0;
        html! {
            g class="overlay" {
                g class="overlay-markers" {
                    @for marker in &self.markers { polygon points=(points(marker)) {} }
                }
                g class="overlay-lattice" {
                    @if !self.lattice.is_empty() { path d=(segments(&self.lattice)) {} }
                }
                g class="overlay-rejects" {
                    @if !self.rejects.is_empty() { path d=(crosses(&self.rejects, 4.0 * unit)) {} }
                }
                g class="overlay-corners" {
                    @for (_, pixel) in &self.corners {
                        circle cx=(tenth(pixel.x)) cy=(tenth(pixel.y)) r=(tenth(3.5 * unit)) {}
                    }
                }
                g class="overlay-ids" font-size=(tenth(11.0 * unit)) {
                    @for (id, pixel) in &self.corners {
                        text x=(tenth(pixel.x + 5.0 * unit)) y=(tenth(pixel.y - 5.0 * unit)) { (id) }
                    }
                }
            }
        }
    }

    /// Drawn into a copy of the image: markers blue, lattice and corners orange with their ids, rejects magenta.
    ///
    /// Small images are enlarged by a whole factor, up to four, to at least 1280 columns where that suffices, because
    /// an id needs more pixels than a small image has between its corners.
    pub fn draw(&self, image: &Rgb) -> Rgb {
        let factor = (1280 / image.width().max(1)).clamp(1, 4);
        let mut canvas = Canvas::new(image, factor);
        let unit = ((image.width() * factor) as f64 / 1280.0).max(1.0);
        // Integers are pixel centres in the small image and in the large one.
        let k = factor as f64;
        let large = |p: Pixel| Pixel::new((p.x + 0.5) * k - 0.5, (p.y + 0.5) * k - 0.5);
        for marker in &self.markers {
            let marker = marker.map(large);
            for side in 0..4 {
                canvas.line(marker[side], marker[(side + 1) % 4], 2.0 * unit, MARKER);
            }
        }
        let radius = 6.0 * unit;
        for &segment in &self.lattice {
            let [from, to] = segment.map(large);
            // Up to the rings, so that the corner itself stays visible in them.
            let [dx, dy] = to - from;
            let length = math::hypot(dx, dy);
            if length > 2.0 * radius {
                let (x, y) = (dx * radius / length, dy * radius / length);
                let ends = (Pixel::new(from.x + x, from.y + y), Pixel::new(to.x - x, to.y - y));
                canvas.line(ends.0, ends.1, unit, CORNER);
            }
        }
        for Pixel { x, y } in self.rejects.iter().copied().map(large) {
            let r = 5.0 * unit;
            canvas.line(Pixel::new(x - r, y - r), Pixel::new(x + r, y + r), 1.6 * unit, REJECT);
            canvas.line(Pixel::new(x - r, y + r), Pixel::new(x + r, y - r), 1.6 * unit, REJECT);
        }
        for &(_, pixel) in &self.corners {
            canvas.ring(large(pixel), radius, 1.8 * unit, CORNER);
        }
        let cell = (2.0 * unit).round() as i64;
        for &(id, pixel) in &self.corners {
            let Pixel { x, y } = large(pixel);
            let digits = id.to_string().len() as i64;
            let (x, y) = (x + 0.9 * radius, y - 0.9 * radius);
            let at = (x.round() as i64 + cell / 2, y.round() as i64 - 5 * cell);
            // Squares are black and white: on a plate of its own the id can be read on both.
            let margin = cell / 2 + 1;
            let plate = ((4 * digits - 1) * cell + 2 * margin, 5 * cell + 2 * margin);
            canvas.fill((at.0 - margin, at.1 - margin), plate, PLATE);
            canvas.number(id, at, cell, ID);
        }
        canvas.finish()
    }
}

/// The markers' outlines by the homography of all corners; `None` where there are too few or they lie on a line.
fn markers(
    observation: &Observation,
    board: &CharucoBoard,
    size: (usize, usize),
) -> Option<Vec<[Pixel; 4]>> {
    let identity = observation.identity.as_ref()?;
    if observation.corners.len() < 6 {
        return None;
    }
    let on_board = |id| {
        let corner = board.corner(id);
        Pixel::new(corner.x(), corner.y())
    };
    let from: Vec<Pixel> = observation.corners.iter().map(|c| on_board(c.id)).collect();
    let to: Vec<Pixel> = observation.corners.iter().map(|c| c.pixel).collect();
    let image_from_board = Homography::from_points(&from, &to)?;
    let margin_m = (board.square_m - board.marker_m) / 2.0;
    let inside = |p: &Pixel| {
        p.x >= -0.5 && p.y >= -0.5 && p.x <= size.0 as f64 - 0.5 && p.y <= size.1 as f64 - 0.5
    };
    let voted = |id: &usize| identity.markers.binary_search(id).is_ok();
    let markers = board.markers(identity.layout).into_iter().filter(|cell| voted(&cell.id));
    let outlines = markers.filter_map(|cell| {
        let x = cell.column as f64 * board.square_m + margin_m;
        let y = cell.row as f64 * board.square_m + margin_m;
        let side = board.marker_m;
        let mut outline = [Pixel::new(0.0, 0.0); 4];
        for (corner, (dx, dy)) in
            outline.iter_mut().zip([(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)])
        {
            *corner = image_from_board.map(Pixel::new(x + dx, y + dy)).filter(inside)?;
        }
        Some(outline)
    });
    Some(outlines.collect())
}

fn points(outline: &[Pixel]) -> String {
    outline.iter().map(|p| format!("{},{}", tenth(p.x), tenth(p.y))).collect::<Vec<_>>().join(" ")
}

fn segments(segments: &[[Pixel; 2]]) -> String {
    segments
        .iter()
        .map(|[a, b]| format!("M{} {}L{} {}", tenth(a.x), tenth(a.y), tenth(b.x), tenth(b.y)))
        .collect()
}

fn crosses(at: &[Pixel], radius: f64) -> String {
    let r = radius;
    at.iter()
        .flat_map(|p| {
            [
                [Pixel::new(p.x - r, p.y - r), Pixel::new(p.x + r, p.y + r)],
                [Pixel::new(p.x - r, p.y + r), Pixel::new(p.x + r, p.y - r)],
            ]
        })
        .map(|segment| segments(&[segment]))
        .collect()
}

// Colours of Okabe and Ito that stay apart for the colour-blind and from grey paper.
const CORNER: [u8; 3] = [230, 97, 0];
const MARKER: [u8; 3] = [0, 114, 178];
const REJECT: [u8; 3] = [204, 60, 150];
const PLATE: [u8; 3] = [40, 24, 8];
const ID: [u8; 3] = [255, 200, 120];

/// An image to draw into, with coverage blending.
struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    /// The image, enlarged by bilinear interpolation.
    fn new(image: &Rgb, factor: usize) -> Self {
        let (width, height) = (image.width() * factor, image.height() * factor);
        let source = |at: usize, size: usize| {
            let at = ((at as f64 + 0.5) / factor as f64 - 0.5).clamp(0.0, size as f64 - 1.0);
            (at as usize, (at as usize + 1).min(size - 1), at.fract())
        };
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let (y0, y1, fy) = source(y, image.height());
            for x in 0..width {
                let (x0, x1, fx) = source(x, image.width());
                let at = |x: usize, y: usize| image.pixels()[y * image.width() + x].map(f64::from);
                let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
                pixels.push([0, 1, 2].map(|i| {
                    let top = a[i] + fx * (b[i] - a[i]);
                    let bottom = c[i] + fx * (d[i] - c[i]);
                    (top + fy * (bottom - top)).round() as u8
                }));
            }
        }
        Self { width, height, pixels }
    }

    fn finish(self) -> Rgb {
        Rgb::new(self.width, self.height, self.pixels)
    }

    /// Blends `color` into every pixel within the box by the coverage that its distance to a shape's edge gives.
    fn shade(
        &mut self,
        [low, high]: [Pixel; 2],
        color: [u8; 3],
        outside_px: impl Fn(Pixel) -> f64,
    ) {
        let range = |low: f64, high: f64, size: usize| {
            let low = (low - 1.0).max(0.0) as usize; // Saturates: a shape far outside draws nothing.
            let high = ((high + 2.0).max(0.0) as usize).min(size);
            low..high
        };
        for y in range(low.y, high.y, self.height) {
            for x in range(low.x, high.x, self.width) {
                let coverage = (0.5 - outside_px(Pixel::new(x as f64, y as f64))).clamp(0.0, 1.0);
                for (channel, target) in self.pixels[y * self.width + x].iter_mut().zip(color) {
                    let blended =
                        f64::from(*channel) + coverage * (f64::from(target) - f64::from(*channel));
                    *channel = blended.round() as u8;
                }
            }
        }
    }

    fn line(&mut self, a: Pixel, b: Pixel, width: f64, color: [u8; 3]) {
        let [dx, dy] = b - a;
        let length2 = (dx * dx + dy * dy).max(1e-12);
        let distance = move |p: Pixel| {
            let [px, py] = p - a;
            let along = ((px * dx + py * dy) / length2).clamp(0.0, 1.0);
            math::hypot(px - along * dx, py - along * dy)
        };
        let reach = width / 2.0;
        let low = Pixel::new(a.x.min(b.x) - reach, a.y.min(b.y) - reach);
        let high = Pixel::new(a.x.max(b.x) + reach, a.y.max(b.y) + reach);
        self.shade([low, high], color, |p| distance(p) - reach);
    }

    fn ring(&mut self, center: Pixel, radius: f64, width: f64, color: [u8; 3]) {
        let reach = radius + width;
        let low = Pixel::new(center.x - reach, center.y - reach);
        let high = Pixel::new(center.x + reach, center.y + reach);
        self.shade([low, high], color, |p| (p.distance(center) - radius).abs() - width / 2.0);
    }

    /// Digits of 3x5 cells, `cell` pixels each, their top left corner at `at`.
    fn number(&mut self, number: usize, at: (i64, i64), cell: i64, color: [u8; 3]) {
        for (index, digit) in number.to_string().bytes().enumerate() {
            let rows = DIGITS[usize::from(digit - b'0')];
            for (row, bits) in rows.into_iter().enumerate() {
                for column in 0..3 {
                    if bits >> (2 - column) & 1 == 0 {
                        continue;
                    }
                    let x = at.0 + (index as i64 * 4 + column) * cell;
                    let y = at.1 + row as i64 * cell;
                    self.fill((x, y), (cell, cell), color);
                }
            }
        }
    }

    fn fill(&mut self, (x, y): (i64, i64), (width, height): (i64, i64), color: [u8; 3]) {
        for y in y.max(0)..(y + height).min(self.height as i64) {
            for x in x.max(0)..(x + width).min(self.width as i64) {
                self.pixels[y as usize * self.width + x as usize] = color;
            }
        }
    }
}

/// The ten digits, five rows of three bits each.
const DIGITS: [[u8; 5]; 10] = [
    [0b111, 0b101, 0b101, 0b101, 0b111],
    [0b010, 0b110, 0b010, 0b010, 0b111],
    [0b111, 0b001, 0b111, 0b100, 0b111],
    [0b111, 0b001, 0b111, 0b001, 0b111],
    [0b101, 0b101, 0b111, 0b001, 0b001],
    [0b111, 0b100, 0b111, 0b001, 0b111],
    [0b111, 0b100, 0b111, 0b101, 0b111],
    [0b111, 0b001, 0b010, 0b010, 0b010],
    [0b111, 0b101, 0b111, 0b101, 0b111],
    [0b111, 0b101, 0b111, 0b001, 0b111],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        board::Layout,
        detect::{Corner, Identity},
    };

    /// The board seen straight on: square 20 px, first corner at (30, 40).
    fn observation(board: &CharucoBoard, n_corners: usize) -> Observation {
        let corner = |id: usize| {
            let (column, row) = board.corner_cell(id);
            let pixel = Pixel::new(30.0 + 20.0 * column as f64, 40.0 + 20.0 * row as f64);
            Corner { id, pixel, sigma_px: 0.05 }
        };
        let identity = Identity {
            layout: Layout::Legacy,
            mirrored: false,
            inverted: false,
            markers: (0..40).collect(),
            margin: 50.0,
        };
        Observation {
            corners: (0..n_corners).map(corner).collect(),
            identity: Some(identity),
            rejects: Vec::new(),
        }
    }

    #[test]
    fn markers_stand_in_their_squares() {
        let board: CharucoBoard = "10x8:20mm:10mm:ARUCO_ORIGINAL".parse().unwrap();
        let overlay = Overlay::new(&observation(&board, 63), &board, (640, 480));
        assert_eq!(overlay.markers.len(), 40);
        assert_eq!(overlay.lattice.len(), 8 * 7 + 9 * 6);
        // The first marker fills the middle of the first square, whose lower right corner is corner 0.
        for (corner, (x, y)) in
            overlay.markers[0].iter().zip([(15.0, 25.0), (25.0, 25.0), (25.0, 35.0), (15.0, 35.0)])
        {
            assert!(corner.distance(Pixel::new(x, y)) < 1e-6, "{corner:?}");
        }
        // In a smaller image the markers outside are not drawn.
        let cut = Overlay::new(&observation(&board, 63), &board, (120, 480));
        assert!(cut.markers.len() < 40 && cut.markers.iter().flatten().all(|p| p.x < 120.0));
        // Nor those that did not vote.
        let mut partly = observation(&board, 63);
        partly.identity.as_mut().unwrap().markers = vec![0, 3, 39];
        let partly = Overlay::new(&partly, &board, (640, 480));
        assert_eq!(partly.markers, [0, 3, 39].map(|id| overlay.markers[id]));
        assert!(Overlay::new(&observation(&board, 5), &board, (640, 480)).markers.is_empty());
        // One row of corners lies on a line: no homography, no markers.
        assert!(Overlay::new(&observation(&board, 9), &board, (640, 480)).markers.is_empty());
    }

    #[test]
    fn drawing_marks_the_corners_and_nothing_far_away() {
        let board: CharucoBoard = "10x8:20mm:10mm:ARUCO_ORIGINAL".parse().unwrap();
        let gray = Rgb::new(320, 240, vec![[128; 3]; 320 * 240]);
        let mut overlay = Overlay::new(&observation(&board, 63), &board, (320, 240));
        overlay.rejects.push(Pixel::new(-50.0, 1e9));
        let drawn = overlay.draw(&gray);
        // Four times as large.
        assert_eq!((drawn.width(), drawn.height()), (1280, 960));
        let at = |x: usize, y: usize| drawn.pixels()[y * 1280 + x];
        // Corner 0 at (30, 40) lies at (121.5, 161.5): untouched itself, with a ring of radius 6 around it.
        assert_eq!(at(121, 161), [128; 3]);
        // The pixel at its left is 6.52 away: 0.88 of it lie within the ring's width of 1.8.
        assert_eq!(at(115, 161), [218, 101, 15]);
        // Halfway to corner 1 the lattice's line, one pixel wide, covers half of each of two rows.
        assert_eq!([at(161, 161), at(161, 162)], [[179, 113, 64]; 2]);
        // The id right above: a plate with a zero in it.
        assert_eq!(at(128, 146), ID);
        assert_eq!(at(130, 148), PLATE);
        // The first marker's left edge at 15 lies at 61.5.
        assert_eq!([at(61, 120), at(62, 120)], [MARKER; 2]);
        assert_eq!(at(1200, 920), [128; 3]);

        let nothing = Overlay::default();
        let large = Rgb::new(1280, 2, vec![[9, 8, 7]; 2560]);
        assert_eq!(nothing.draw(&large), large, "large enough as it is");
        let two = Rgb::new(2, 1, vec![[0, 0, 0], [200, 100, 40]]);
        let row: Vec<u8> = nothing.draw(&two).pixels()[..8].iter().map(|p| p[0]).collect();
        assert_eq!(row, [0, 0, 25, 75, 125, 175, 200, 200]);
        let empty = Rgb::new(0, 0, Vec::new());
        assert_eq!(nothing.draw(&empty), empty);
    }
}
