//! Images resampled by a map.
//!
//! A smooth map takes neighbours to neighbours: along a row the source pixel advances by one, and now and then by none
//! or two. Each row is cut into runs in which it advances by exactly one, so that within a run all reads are
//! contiguous and the compiler turns the loop into vector code without a gather, for the processor at hand.

use super::{PixelMap, Sampling};
use crate::{
    image::{DepthMap, Rgb},
    par::vectorized,
};

/// Neighbours that differ by more than this part of their depth lie on different surfaces. A plane seen at 75 degrees
/// steps by 0.9 % per pixel at a focal length of 430 px, and steps between things are larger.
pub const EDGE: f32 = 0.02;

/// Pixels of a row whose sources are neighbours in a row.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// First pixel of the result.
    to: u32,
    /// Upper left neighbour of the first source.
    from: u32,
    n: u32,
}

/// Runs, and the fractions of every pixel in them, one after the other.
struct Compiled {
    runs: Vec<Run>,
    fractions: Vec<[f32; 2]>,
}

/// Sources up to half a pixel outside take the border; farther out there is none.
fn compile(map: &PixelMap) -> Compiled {
    let (width, height) = (map.width, map.height);
    let mut compiled = Compiled { runs: Vec::new(), fractions: Vec::new() };
    if width < 2 || height < 2 {
        return compiled;
    }
    let (right, bottom) = (width as f32 - 1.0, height as f32 - 1.0);
    let mut last: Option<(usize, u32)> = None;
    for (to, &[x, y]) in map.source.iter().enumerate() {
        if !(x >= -0.5 && y >= -0.5 && x <= right + 0.5 && y <= bottom + 0.5) {
            continue;
        }
        let (x, y) = (x.clamp(0.0, right), y.clamp(0.0, bottom));
        let (x0, y0) = ((x as usize).min(width - 2), (y as usize).min(height - 2));
        let from = (y0 * width + x0) as u32;
        compiled.fractions.push([x - x0 as f32, y - y0 as f32]);
        let goes_on = last.is_some_and(|(l, f)| l + 1 == to && f + 1 == from)
            && to % width != 0
            // Round the end of a source row the next one begins.
            && x0 != 0;
        if goes_on {
            let run = compiled.runs.last_mut().expect("something went before");
            run.n += 1;
        } else {
            compiled.runs.push(Run { to: to as u32, from, n: 1 });
        }
        last = Some((to, from));
    }
    compiled
}

/// Resamples colour images bilinearly; black where there is no source.
pub struct ColorWarp {
    width: usize,
    height: usize,
    runs: Vec<Run>,
    /// Horizontal fraction in 1/128, once per channel.
    fx: Vec<u8>,
    /// Vertical fraction in 1/256, once per channel.
    fy: Vec<u8>,
}

impl ColorWarp {
    /// Prepares the map; worth it from the first image on.
    pub fn new(map: &PixelMap) -> Self {
        let Compiled { runs, fractions } = compile(map);
        let fx = |[x, _]: &[f32; 2]| [((x * 128.0 + 0.5) as u8).min(127); 3];
        let fy = |[_, y]: &[f32; 2]| [((y * 256.0 + 0.5) as u16).min(255) as u8; 3];
        Self {
            width: map.width,
            height: map.height,
            runs,
            fx: fractions.iter().flat_map(fx).collect(),
            fy: fractions.iter().flat_map(fy).collect(),
        }
    }

    /// The image resampled. Panics where it has another size than the map.
    pub fn apply(&self, image: &Rgb) -> Rgb {
        assert_eq!([image.width(), image.height()], [self.width, self.height], "size of the map");
        let mut out = vec![[0u8; 3]; self.width * self.height];
        let source = image.pixels().as_flattened();
        let result = out.as_flattened_mut();
        vectorized(
            #[inline(always)]
            || {
                let mut at = 0;
                for run in &self.runs {
                    let n = 3 * run.n as usize;
                    let (to, from) = (3 * run.to as usize, 3 * run.from as usize);
                    let below = from + 3 * self.width;
                    blend(
                        &mut result[to..to + n],
                        [&source[from..from + n + 3], &source[below..below + n + 3]],
                        &self.fx[at..at + n],
                        &self.fy[at..at + n],
                    );
                    at += n;
                }
            },
        );
        Rgb::new(self.width, self.height, out)
    }
}

/// Values worked on at once. Runs are short where a map zooms (20 pixels at 5 %), so that what is left over after whole
/// vectors would cost as much as they do: instead the last vector overlaps the one before.
const LANES: usize = 16;

/// Where vectors begin that cover `n` values, at least [`LANES`] of them.
#[inline(always)]
fn vectors(n: usize) -> impl Iterator<Item = usize> {
    let last = n - LANES;
    (0..last).step_by(LANES).chain([last])
}

/// The values that a vector begins with.
#[inline(always)]
fn lanes<T>(values: &[T], at: usize) -> &[T; LANES] {
    values[at..].first_chunk().expect("a vector fits")
}

/// Bilinear in 16-bit fixed point: 7 bits across, 8 down. Rows hold one pixel more than `out`.
#[inline(always)]
fn blend(out: &mut [u8], [upper, lower]: [&[u8]; 2], fx: &[u8], fy: &[u8]) {
    let n = out.len();
    let one = |[a, b, c, d]: [u8; 4], fx: u8, fy: u8| {
        let (x, y) = (i16::from(fx), i16::from(fy) << 7);
        let wide = |v: u8| i16::from(v);
        let top = (wide(a) << 7) + (wide(b) - wide(a)) * x;
        let bottom = (wide(c) << 7) + (wide(d) - wide(c)) * x;
        let step = ((i32::from(bottom - top) * i32::from(y)) >> 16) as i16;
        ((top + 2 * step + 64) >> 7) as u8
    };
    if n < LANES {
        for i in 0..n {
            out[i] = one([upper[i], upper[i + 3], lower[i], lower[i + 3]], fx[i], fy[i]);
        }
        return;
    }
    for at in vectors(n) {
        let (a, b) = (lanes(upper, at), lanes(upper, at + 3));
        let (c, d) = (lanes(lower, at), lanes(lower, at + 3));
        let (x, y) = (lanes(fx, at), lanes(fy, at));
        let mut vector = [0; LANES];
        for i in 0..LANES {
            vector[i] = one([a[i], b[i], c[i], d[i]], x[i], y[i]);
        }
        out[at..at + LANES].copy_from_slice(&vector);
    }
}

/// Resamples depth maps, and takes scale and bias out: truth = (sensor − bias) / scale. Depth stays z along the axis.
pub struct DepthWarp {
    width: usize,
    height: usize,
    runs: Vec<Run>,
    fx: Vec<f32>,
    fy: Vec<f32>,
}

impl DepthWarp {
    /// Prepares the map.
    pub fn new(map: &PixelMap, sampling: Sampling) -> Self {
        let Compiled { runs, fractions } = compile(map);
        let snap = |f: f32| match sampling {
            Sampling::EdgeAware => f,
            Sampling::Nearest => f32::from(u8::from(f >= 0.5)),
        };
        Self {
            width: map.width,
            height: map.height,
            runs,
            fx: fractions.iter().map(|f| snap(f[0])).collect(),
            fy: fractions.iter().map(|f| snap(f[1])).collect(),
        }
    }

    /// The map resampled; NaN where there is no source. Panics where it has another size than this map.
    pub fn apply(&self, depth: &DepthMap) -> DepthMap {
        assert_eq!([depth.width(), depth.height()], [self.width, self.height], "size of the map");
        let source = depth.depth_m();
        let mut out = vec![f32::NAN; self.width * self.height];
        vectorized(
            #[inline(always)]
            || {
                let mut at = 0;
                for run in &self.runs {
                    let n = run.n as usize;
                    let (to, from) = (run.to as usize, run.from as usize);
                    let below = from + self.width;
                    join(
                        &mut out[to..to + n],
                        [&source[from..from + n + 1], &source[below..below + n + 1]],
                        &self.fx[at..at + n],
                        &self.fy[at..at + n],
                    );
                    at += n;
                }
            },
        );
        DepthMap::new(self.width, self.height, out)
    }
}

/// Bilinear on one surface, else the nearest. Comparisons with a hole (NaN) are false, and the nearest may be one.
#[inline(always)]
fn join(out: &mut [f32], [upper, lower]: [&[f32]; 2], fx: &[f32], fy: &[f32]) {
    let n = out.len();
    let one = |[a, b, c, d]: [f32; 4], x: f32, y: f32| {
        let tolerance = EDGE * a;
        let smooth = ((a - b).abs() <= tolerance)
            & ((c - d).abs() <= tolerance)
            & ((a - c).abs() <= tolerance)
            & ((b - d).abs() <= tolerance);
        let (top, bottom) = (a + (b - a) * x, c + (d - c) * x);
        let blended = top + (bottom - top) * y;
        let (upper, lower) = (if x < 0.5 { a } else { b }, if x < 0.5 { c } else { d });
        let nearest = if y < 0.5 { upper } else { lower };
        if smooth { blended } else { nearest }
    };
    if n < LANES {
        for i in 0..n {
            out[i] = one([upper[i], upper[i + 1], lower[i], lower[i + 1]], fx[i], fy[i]);
        }
        return;
    }
    for at in vectors(n) {
        let (a, b) = (lanes(upper, at), lanes(upper, at + 1));
        let (c, d) = (lanes(lower, at), lanes(lower, at + 1));
        let (x, y) = (lanes(fx, at), lanes(fy, at));
        let mut vector = [0.0; LANES];
        for i in 0..LANES {
            vector[i] = one([a[i], b[i], c[i], d[i]], x[i], y[i]);
        }
        out[at..at + LANES].copy_from_slice(&vector);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Pixel;

    /// A map with everything in it: turned, stretched, partly outside.
    fn map(width: usize, height: usize) -> PixelMap {
        PixelMap::new(width, height, |p| {
            let (x, y) = (p.x - 20.0, p.y - 15.0);
            (p.x != 7.0).then(|| Pixel::new(20.3 + 0.93 * x - 0.11 * y, 14.6 + 0.12 * x + 1.05 * y))
        })
    }

    fn noise(n: usize) -> impl Iterator<Item = u8> {
        let mut state = 7u32;
        (0..n).map(move |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        })
    }

    /// Straight from the definition, in f64.
    fn slow(
        value: impl Fn(usize, usize) -> f64,
        size: (usize, usize),
        [x, y]: [f32; 2],
    ) -> Option<f64> {
        let (right, bottom) = (size.0 as f64 - 1.0, size.1 as f64 - 1.0);
        let (x, y) = (f64::from(x), f64::from(y));
        if !(x >= -0.5 && y >= -0.5 && x <= right + 0.5 && y <= bottom + 0.5) {
            return None;
        }
        let (x, y) = (x.clamp(0.0, right), y.clamp(0.0, bottom));
        let (x0, y0) = (x.floor() as usize, y.floor() as usize);
        let (x1, y1) = ((x0 + 1).min(size.0 - 1), (y0 + 1).min(size.1 - 1));
        let (fx, fy) = (x - x0 as f64, y - y0 as f64);
        let top = value(x0, y0) * (1.0 - fx) + value(x1, y0) * fx;
        let bottom = value(x0, y1) * (1.0 - fx) + value(x1, y1) * fx;
        Some(top * (1.0 - fy) + bottom * fy)
    }

    #[test]
    fn colour_as_defined() {
        let (width, height) = (41, 31);
        let image = Rgb::new(
            width,
            height,
            noise(3 * width * height).collect::<Vec<_>>().as_chunks::<3>().0.to_vec(),
        );
        let map = map(width, height);
        let out = ColorWarp::new(&map).apply(&image);
        let mut n_inside = 0;
        for (pixel, at) in out.pixels().iter().zip(&map.source) {
            for channel in 0..3 {
                let value = |x: usize, y: usize| f64::from(image.pixels()[y * width + x][channel]);
                match slow(value, (width, height), *at) {
                    None => assert_eq!(pixel[channel], 0),
                    Some(expected) => {
                        n_inside += 1;
                        // Fractions are rounded to 1/128 and 1/256: up to 255/256 + 255/512 + 1/2 of a grey level,
                        // and at the last column and row 1/128 of the neighbour.
                        let error = (f64::from(pixel[channel]) - expected).abs();
                        assert!(error < 3.5, "{at:?}: {pixel:?} for {expected}");
                    }
                }
            }
        }
        assert!(n_inside > 2000);
        let identity = PixelMap::new(width, height, Some);
        let same = ColorWarp::new(&identity).apply(&image);
        let inner = |image: &Rgb| -> Vec<[u8; 3]> {
            image
                .pixels()
                .chunks(width)
                .take(height - 1)
                .flat_map(|row| row[..width - 1].to_vec())
                .collect()
        };
        assert_eq!(inner(&same), inner(&image));
    }

    #[test]
    fn depth_never_blends_across_holes_or_edges() {
        let (width, height) = (41, 31);
        // Two slanted surfaces 100 mm apart, and holes.
        let near = |x: usize, y: usize| 0.3 + 0.0005 * x as f32 + 0.0002 * y as f32;
        let holes: Vec<bool> = noise(width * height).map(|v| v < 20).collect();
        let depth_m: Vec<f32> = (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let far = if x > 22 { 0.1 } else { 0.0 };
                if holes[i] { f32::NAN } else { near(x, y) + far }
            })
            .collect();
        let depth = DepthMap::new(width, height, depth_m.clone());
        let map = map(width, height);
        for sampling in [Sampling::EdgeAware, Sampling::Nearest] {
            let out = DepthWarp::new(&map, sampling).apply(&depth);
            let mut n = 0;
            for (&z, &[x, y]) in out.depth_m().iter().zip(&map.source) {
                if z.is_nan() {
                    continue;
                }
                n += 1;
                // Every depth is that of one of the surfaces at this place, not of something between them.
                let (sx, sy) = (x.clamp(0.0, 40.0), y.clamp(0.0, 30.0));
                let plane = 0.3 + 0.0005 * sx + 0.0002 * sy;
                let error = (z - plane).abs().min((z - plane - 0.1).abs());
                assert!(error <= 0.000_36, "{sampling:?} at {x}, {y}: {z}");
            }
            assert!(n > 700, "{n}");
        }
        // Exactly on pixels nothing is lost, holes beside them or not.
        let identity = PixelMap::new(width, height, Some);
        let same = DepthWarp::new(&identity, Sampling::EdgeAware).apply(&depth);
        assert!(same.depth_m().iter().zip(&depth_m).all(|(a, b)| a.to_bits() == b.to_bits()
            || (a - b).abs() < 1e-7
            || (a.is_nan() && b.is_nan())));
    }
}
