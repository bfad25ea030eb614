//! Depth laid over colour, one picture at a time.

use super::drawing::{Bar, HOLE, is_light, mix, viridis};
use crate::image::{DepthMap, Rgb};

/// What is drawn of the depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Every pixel's depth, by colour.
    Depth,
    /// Lines where depth jumps, over the colour image: they must lie where things end in it.
    Edges,
}

/// How depth is laid over colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthStyle {
    /// Depths that the ends of the colour map stand for, metres; what lies outside has the colour of the end.
    pub range_m: [f64; 2],
    /// How much of the colour image is covered: 0 to 1.
    pub opacity: f64,
    /// What is drawn.
    pub shown: Shown,
}

/// Lines where depth jumps.
const EDGE: [u8; 3] = [255, 122, 26];
/// A step of this part of the depth is an edge: 2 mm at 0.2 m, ten times the noise of the mean of 25 pixels there.
const STEP: f32 = 0.010;
/// Pixels on either side of an edge that are averaged, and how far their middles lie from it.
const HALF_BOX: usize = 2;
const REACH: usize = 3;
/// A hole this narrow, pixels, is taken for the shadow that the nearer thing throws.
const SHADOW: usize = 24;

/// The range of depths in some maps: all but one in fifty at either end, in whole centimetres. `None` where nothing
/// was measured.
pub fn depth_range_m<'a>(maps: impl IntoIterator<Item = &'a DepthMap>) -> Option<[f64; 2]> {
    // A ninth of the pixels tells the same, and a map of any size costs no more than that.
    let mut depths: Vec<f32> = Vec::new();
    for map in maps {
        let rows = map.depth_m().chunks(map.width().max(1)).step_by(3);
        depths.extend(rows.flat_map(|row| row.iter().step_by(3)).filter(|z| !z.is_nan()));
    }
    depths.sort_by(f32::total_cmp);
    let at = |part: usize| depths.get((depths.len().saturating_sub(1)) * part / 100).copied();
    let [near, far] = [at(2)?, at(98)?].map(|z| 100.0 * f64::from(z));
    let [near, far] = [near.floor(), far.ceil()];
    Some([near / 100.0, (if far > near { far } else { near + 1.0 }) / 100.0])
}

impl DepthStyle {
    /// Depth over colour, `width` pixels wide. Panics where the images differ in size.
    pub(super) fn over(&self, color: &Rgb, depth: &DepthMap, width: usize) -> Rgb {
        let size = (color.width(), color.height());
        assert_eq!(size, (depth.width(), depth.height()), "colour and depth of one size");
        let factor = width as f64 / size.0 as f64;
        let height = (size.1 as f64 * factor).round().max(1.0) as usize;
        let back = |at: usize, n: usize| (((at as f64 + 0.5) / factor) as usize).min(n - 1);
        let mut image = super::drawing::scaled(color, width);
        let mut pixels = image.pixels().to_vec();
        match self.shown {
            Shown::Depth => {
                for (y, row) in pixels.chunks_mut(width).enumerate() {
                    for (x, pixel) in row.iter_mut().enumerate() {
                        let z = depth.at(back(x, size.0), back(y, size.1));
                        self.tint(pixel, z, is_light(x, y, height as f64 / 60.0));
                    }
                }
            }
            Shown::Edges => {
                let edges = edges(depth);
                for (y, row) in pixels.chunks_mut(width).enumerate() {
                    for (x, pixel) in row.iter_mut().enumerate() {
                        mix(pixel, [20, 22, 26], 0.25);
                        if edges[back(y, size.1) * size.0 + back(x, size.0)] {
                            *pixel = EDGE;
                        }
                    }
                }
            }
        }
        image = Rgb::new(width, pixels.len() / width.max(1), pixels);
        image
    }

    /// The colour image only gives its lightness: its hues must not be taken for depth.
    fn tint(&self, pixel: &mut [u8; 3], z: f32, light: bool) {
        let [r, g, b] = pixel.map(u32::from);
        *pixel = [((299 * r + 587 * g + 114 * b + 500) / 1000) as u8; 3];
        let [near, far] = self.range_m;
        let over = match z.is_nan() {
            true => HOLE[usize::from(light)],
            false => viridis((f64::from(z) - near) / (far - near)),
        };
        mix(pixel, over, self.opacity);
    }

    /// What its colours mean; nothing where there are none.
    pub(super) fn bar(&self) -> Option<Bar> {
        (self.shown == Shown::Depth).then_some(Bar { range_m: self.range_m })
    }
}

/// How many pixels are an edge of the depth.
pub(super) fn n_edges(depth: &DepthMap) -> usize {
    edges(depth).iter().filter(|edge| **edge).count()
}

/// Where depth jumps: the last pixels of the nearer thing before its shadow, and steps between surfaces that go on with
/// their slopes on both sides.
fn edges(depth: &DepthMap) -> Vec<bool> {
    let (width, height) = (depth.width(), depth.height());
    let z = depth.depth_m();
    let mean = box_means(depth);
    let mut marked = vec![false; z.len()];
    for (n, m, stride, across) in [(width, height, 1, width), (height, width, width, 1)] {
        for line in 0..m {
            let at = |i: usize| line * across + i * stride;
            // Steps on surfaces that are measured on both sides; the largest within reach is the edge.
            let step = |i: usize| -> f32 {
                if i < 3 * REACH || i + 3 * REACH >= n {
                    return 0.0;
                }
                let [a, b, c, d] =
                    [i - 3 * REACH, i - REACH, i + REACH, i + 3 * REACH].map(|i| mean[at(i)]);
                let step = (c - b) - 0.5 * ((b - a) + (d - c));
                if step.abs() > STEP * b { step.abs() } else { 0.0 }
            };
            let steps: Vec<f32> = (0..n).map(step).collect();
            for i in 0..n {
                // A step answers once more, half as strongly, where the outer boxes meet it.
                let near = &steps[i.saturating_sub(2 * REACH + 1)..(i + 2 * REACH + 2).min(n)];
                if steps[i] > 0.0 && near.iter().all(|s| *s <= steps[i]) {
                    // Two pixels, so that the line can be seen.
                    marked[at(i)] = true;
                    marked[at(i - 1)] = true;
                }
            }
            // Shadows: measured, a narrow hole, and something farther behind it.
            let mut last: Option<usize> = None;
            for i in 0..n {
                if z[at(i)].is_nan() {
                    continue;
                }
                if let Some(l) = last
                    && (2..=SHADOW).contains(&(i - l))
                {
                    let (a, b) = (z[at(l)], z[at(i)]);
                    if (a - b).abs() > 2.0 * STEP * a.min(b) {
                        marked[at(if a < b { l } else { i })] = true;
                    }
                }
                last = Some(i);
            }
        }
    }
    marked
}

/// The mean of the measurements in the box round each pixel; NaN where more than half of them are missing.
fn box_means(depth: &DepthMap) -> Vec<f32> {
    let (width, height) = (depth.width(), depth.height());
    let side = 2 * HALF_BOX + 1;
    let mut rows = vec![(0.0f32, 0u32); width * height];
    for y in 0..height {
        for x in 0..width {
            let window = x.saturating_sub(HALF_BOX)..(x + HALF_BOX + 1).min(width);
            rows[y * width + x] = depth.depth_m()[y * width..][window]
                .iter()
                .filter(|z| !z.is_nan())
                .fold((0.0, 0), |(sum, n), z| (sum + z, n + 1));
        }
    }
    let mut means = vec![f32::NAN; width * height];
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut n) = (0.0, 0);
            for row in y.saturating_sub(HALF_BOX)..(y + HALF_BOX + 1).min(height) {
                let (s, k) = rows[row * width + x];
                sum += s;
                n += k;
            }
            if 2 * n as usize > side * side {
                means[y * width + x] = sum / n as f32;
            }
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    const STYLE: DepthStyle = DepthStyle { range_m: [0.2, 0.4], opacity: 1.0, shown: Shown::Depth };

    #[test]
    fn colours_say_depth_and_holes_look_like_nothing_else() {
        let color = Rgb::new(3, 1, vec![[200, 10, 10]; 3]);
        let depth = DepthMap::new(3, 1, vec![0.2, f32::NAN, 9.0]);
        let drawn = STYLE.over(&color, &depth, 3);
        assert_eq!(drawn.pixels()[0], viridis(0.0));
        assert!(HOLE.contains(&drawn.pixels()[1]));
        assert_eq!(drawn.pixels()[2], viridis(1.0));
        // Without cover there is only the image's lightness.
        let bare = DepthStyle { opacity: 0.0, ..STYLE }.over(&color, &depth, 3);
        assert_eq!(bare.pixels(), [[67; 3]; 3]);
        // Every colour of the map is far from those of a hole.
        for i in 0..=255 {
            let [r, g, b] = viridis(f64::from(i) / 255.0).map(i32::from);
            for hole in HOLE.map(|h| h.map(i32::from)) {
                let apart = (r - hole[0]).abs() + (g - hole[1]).abs() + (b - hole[2]).abs();
                assert!(apart > 60, "{i}");
            }
        }
    }

    #[test]
    fn edges_are_steps_and_shadows_not_slopes() {
        let (width, height) = (80, 60);
        let map = |z: &dyn Fn(usize, usize) -> f32| {
            let depth = (0..width * height).map(|i| z(i % width, i / width)).collect();
            edges(&DepthMap::new(width, height, depth))
        };
        let slope = |x: usize, y: usize| 0.2 + 0.002 * x as f32 + 0.001 * y as f32;
        assert!(map(&slope).iter().all(|e| !e), "a slope is no edge");
        let steps = map(&|x, y| slope(x, y) + if x >= 40 { 0.02 } else { 0.0 });
        let columns: Vec<usize> = (0..width).filter(|x| steps[30 * width + x]).collect();
        assert!(
            !columns.is_empty() && columns.iter().all(|x| (38..=41).contains(x)),
            "{columns:?}"
        );
        let shadow = map(&|x, y| match x {
            0..40 => slope(x, y),
            40..50 => f32::NAN,
            _ => slope(x, y) + 0.2,
        });
        let columns: Vec<usize> = (0..width).filter(|x| shadow[30 * width + x]).collect();
        assert_eq!(columns, [39], "the near side of the shadow");
    }

    #[test]
    fn ranges() {
        let map = |depth: Vec<f32>| DepthMap::new(depth.len(), 1, depth);
        let many: Vec<f32> = (0..3000).map(|i| 0.2034 + 0.0001 * (i / 3) as f32).collect();
        let found = depth_range_m([&map(many)]).unwrap();
        assert_eq!(found, [0.20, 0.31]);
        assert_eq!(depth_range_m([&map(vec![f32::NAN; 9])]), None);
        assert_eq!(depth_range_m([&map(vec![0.25; 9])]), Some([0.25, 0.26]));
    }
}
