//! What comes and goes between successive depth maps in which nothing moved.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::Patches;
use crate::{
    calibrate::Estimate,
    detect::Corner,
    geom::Pixel,
    image::DepthMap,
    math,
    solve::{mad_sigma, mean, median, standard_error},
};

/// Noise of single pixels from one frame to the next.
///
/// Of a plane that moves a little, the *inverse* depths of two frames differ by a plane, exactly, whatever the camera;
/// with that taken out, what both frames show alike drops out of their difference: the sensor's pattern, the print, the
/// board's heights. No calibration enters.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct TemporalNoise {
    /// By distance, nearest first; empty where no two successive frames show the board standing still.
    pub by_range: Vec<NoiseAtRange>,
    /// Pairs of successive frames with depth and board in both.
    pub n_successive: usize,
    /// Those in which the board stood still: the median corner moved by [`STILL_PX`] at most.
    pub n_still: usize,
}

impl TemporalNoise {
    /// At the distance at which most pixels were compared.
    pub fn most_seen(&self) -> Option<&NoiseAtRange> {
        self.by_range.iter().max_by_key(|at| at.n_pixels)
    }
}

/// Noise of single pixels at some distance.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct NoiseAtRange {
    /// Median distance of the pixels, metres.
    pub depth_m: f64,
    /// Standard deviation of a pixel between frames, metres.
    pub noise_m: Estimate,
    /// That of a pixel about the small plane of its neighbours in one of these frames, metres: what stays and what
    /// comes and goes.
    pub one_frame_m: f64,
    /// Pairs of frames.
    pub n_pairs: usize,
    /// Pixels compared, over all pairs.
    pub n_pixels: usize,
}

/// A board whose median corner moved by less stood still: the print, as blurred as the sensor shows it, then changes by
/// a tenth of its contrast.
pub const STILL_PX: f64 = 1.0;

/// Every so many pixels, along rows and columns, one is compared: noise is alike over two or three.
const STEP_PX: usize = 8;
/// Distances are told apart in steps of this, metres.
const RANGE_STEP_M: f64 = 0.05;
/// Fewer pixels say little about a pair.
const LEAST_PIXELS: usize = 60;
/// A pixel so many σ off the common plane shows something else.
const OUTLIER_SIGMAS: f64 = 4.0;

/// Single pixels of a depth map on the board, always the same ones of the image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lattice {
    /// Column and row, and depth in metres; row by row.
    pixels: Vec<([u16; 2], f32)>,
}

impl Lattice {
    /// Of the part of the map from `low` to `high` (exclusive), where there is board.
    pub(super) fn new(
        map: &DepthMap,
        [left, top]: [usize; 2],
        [right, bottom]: [usize; 2],
        on_board: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let mut pixels = Vec::new();
        for y in (top.next_multiple_of(STEP_PX)..bottom.min(map.height())).step_by(STEP_PX) {
            for x in (left.next_multiple_of(STEP_PX)..right.min(map.width())).step_by(STEP_PX) {
                let depth_m = map.at(x, y);
                if depth_m > 0.0 && on_board(x, y) {
                    pixels.push(([x as u16, y as u16], depth_m));
                }
            }
        }
        Self { pixels }
    }
}

/// Compares successive frames as they come.
#[derive(Clone, Debug, Default)]
pub struct NoiseBetweenFrames {
    n_successive: usize,
    n_still: usize,
    by_range: BTreeMap<usize, Vec<PairAtRange>>,
}

impl NoiseBetweenFrames {
    /// Two successive frames, each with what was seen of the board and what its depth map says.
    pub fn add(&mut self, before: (&[Corner], &Patches), after: (&[Corner], &Patches)) {
        let Some(moved_px) = motion_px(before.0, after.0) else { return };
        self.n_successive += 1;
        if moved_px > STILL_PX {
            return;
        }
        self.n_still += 1;
        let one_frame: Vec<(f64, f64)> = [before.1, after.1]
            .iter()
            .flat_map(|patches| &patches.measured)
            .map(|patch| (patch.inverse_per_m.recip(), patch.noise_m))
            .collect();
        for (bin, pixels) in compared(&before.1.lattice, &after.1.lattice) {
            let near: Vec<f64> = one_frame
                .iter()
                .filter(|(depth_m, _)| range_bin(*depth_m) == bin)
                .map(|(_, noise_m)| *noise_m)
                .collect();
            // Pixels just beyond a distance may have no patch of their own.
            if pixels.len() < LEAST_PIXELS || near.is_empty() {
                continue;
            }
            let residuals: Vec<f64> = pixels.iter().map(|(_, residual_m)| *residual_m).collect();
            self.by_range.entry(bin).or_default().push(PairAtRange {
                depth_m: median(&pixels.iter().map(|(depth_m, _)| *depth_m).collect::<Vec<_>>()),
                // Both frames' noise is in the difference.
                variance: 0.5 * mad_sigma(&residuals, 0.0).powi(2),
                one_frame_m: median(&near),
                n: pixels.len(),
            });
        }
    }

    /// What all pairs say.
    pub fn finish(self) -> TemporalNoise {
        let Self { n_successive, n_still, by_range } = self;
        let by_range = by_range.into_values().map(|pairs| at_range(&pairs)).collect();
        TemporalNoise { by_range, n_successive, n_still }
    }
}

/// What one pair says at some distance.
#[derive(Clone, Debug)]
struct PairAtRange {
    depth_m: f64,
    variance: f64,
    one_frame_m: f64,
    n: usize,
}

fn range_bin(depth_m: f64) -> usize {
    (depth_m / RANGE_STEP_M) as usize
}

fn at_range(pairs: &[PairAtRange]) -> NoiseAtRange {
    let of = |value: fn(&PairAtRange) -> f64| pairs.iter().map(value).collect::<Vec<f64>>();
    let variances = of(|pair| pair.variance);
    let noise_m = mean(&variances).sqrt();
    let n_pixels = pairs.iter().map(|pair| pair.n).sum::<usize>();
    // σ of a σ by the median deviation of n numbers: 1.17·σ/√n. Pairs scatter by more where the light changes.
    let from_pixels = 1.17 * noise_m / (n_pixels as f64).sqrt();
    let from_pairs =
        if pairs.len() > 2 { standard_error(&variances) / (2.0 * noise_m) } else { 0.0 };
    NoiseAtRange {
        depth_m: median(&of(|pair| pair.depth_m)),
        noise_m: Estimate { value: noise_m, sigma: from_pixels.max(from_pairs) },
        one_frame_m: median(&of(|pair| pair.one_frame_m)),
        n_pairs: pairs.len(),
        n_pixels,
    }
}

/// How far the median corner moved; `None` for fewer than six in common.
fn motion_px(before: &[Corner], after: &[Corner]) -> Option<f64> {
    let moved: Vec<f64> = before
        .iter()
        .filter_map(|corner| {
            let Pixel { x, y } = after.iter().find(|other| other.id == corner.id)?.pixel;
            Some(math::hypot(x - corner.pixel.x, y - corner.pixel.y))
        })
        .collect();
    (moved.len() >= 6).then(|| median(&moved))
}

/// Depth and difference (m) of each pixel that both measured, the common plane taken out of the inverse depths, by
/// distance.
fn compared(before: &Lattice, after: &Lattice) -> BTreeMap<usize, Vec<(f64, f64)>> {
    let others: BTreeMap<[u16; 2], f32> = after.pixels.iter().copied().collect();
    let rows: Vec<(Vector3<f64>, f64, f64)> = before
        .pixels
        .iter()
        .filter_map(|([x, y], depth_m)| {
            let other_m = f64::from(*others.get(&[*x, *y])?);
            let depth_m = f64::from(*depth_m);
            let row = Vector3::new(1.0, f64::from(*x) / 640.0, f64::from(*y) / 640.0);
            Some((row, other_m.recip() - depth_m.recip(), depth_m))
        })
        .collect();
    let mut plane = Vector3::zeros();
    let mut reach = f64::INFINITY;
    for _ in 0..6 {
        let (mut ata, mut atb) = (Matrix3::zeros(), Vector3::zeros());
        for (row, difference, _) in &rows {
            if (difference - row.dot(&plane)).abs() <= reach {
                ata += row * row.transpose();
                atb += row * *difference;
            }
        }
        let Some(inverse) = ata.try_inverse() else { return BTreeMap::new() };
        plane = inverse * atb;
        let left: Vec<f64> = rows.iter().map(|(row, d, _)| d - row.dot(&plane)).collect();
        reach = OUTLIER_SIGMAS * mad_sigma(&left, 0.0);
    }
    let mut bins: BTreeMap<usize, Vec<(f64, f64)>> = BTreeMap::new();
    for (row, difference, depth_m) in rows {
        let residual_m = (difference - row.dot(&plane)) * depth_m * depth_m;
        bins.entry(range_bin(depth_m)).or_default().push((depth_m, residual_m));
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::{super::test_noise::Noise, *};
    use crate::{board::CharucoBoard, depth::patches};

    /// A slanting board that comes nearer by 0.2 mm and turns a little from frame to frame, before a sensor with a
    /// pattern of 0.3 mm that stays; its corners move by so many pixels.
    fn noise_of(sigma_m: f64, moved_px: f64, n_frames: usize) -> TemporalNoise {
        let board = CharucoBoard::paper(0.020875).expect("a board");
        let mut noise = Noise(11);
        let pattern: Vec<f64> = (0..640 * 480).map(|_| 3e-4 * noise.normal()).collect();
        let seen: Vec<(Vec<Corner>, Patches)> = (0..n_frames)
            .map(|k| {
                let k = k as f64;
                let depth = |i: usize| {
                    let (x, y) = ((i % 640) as f64, (i / 640) as f64);
                    let inverse = 4.4 + 0.004 * k + (3e-3 + 2e-6 * k) * (x - 320.0) + 2e-4 * y;
                    let one = inverse.recip() + pattern[i] * (inverse.recip() / 0.25).powi(2);
                    (one + sigma_m * noise.normal()) as f32
                };
                let map = DepthMap::new(640, 480, (0..640 * 480).map(depth).collect());
                let corners: Vec<Corner> = (0..board.n_corners())
                    .map(|id| {
                        let at = board.corner(id).coords;
                        let pixel =
                            Pixel::new(40.0 + 2600.0 * at.x + moved_px * k, 30.0 + 2600.0 * at.y);
                        Corner { id, pixel, sigma_px: 0.05 }
                    })
                    .collect();
                let patches = patches(&map, &board, &corners).expect("a board");
                (corners, patches)
            })
            .collect();
        let mut found = NoiseBetweenFrames::default();
        for pair in seen.windows(2) {
            found.add((&pair[0].0, &pair[0].1), (&pair[1].0, &pair[1].1));
        }
        found.finish()
    }

    #[test]
    fn what_stays_drops_out_and_what_comes_and_goes_is_found() {
        let found = noise_of(1e-4, 0.2, 5);
        assert_eq!((found.n_successive, found.n_still), (4, 4));
        assert!(found.by_range.len() >= 2, "{found:?}");
        for at in &found.by_range {
            let off = (at.noise_m.value - 1e-4) / at.noise_m.sigma;
            assert!(off.abs() < 4.0 && at.noise_m.sigma < 1e-5, "{at:?}");
            // Within one frame the pattern counts, too.
            let pattern_m = 3e-4 * (at.depth_m / 0.25).powi(2);
            assert!((at.one_frame_m / pattern_m.hypot(1e-4) - 1.0).abs() < 0.15, "{at:?}");
        }
        let few = noise_of(1e-4, 0.2, 2);
        assert!(few.by_range.iter().all(|at| at.n_pairs == 1 && at.noise_m.sigma > 0.0));
    }

    #[test]
    fn a_board_that_moves_tells_nothing() {
        let found = noise_of(1e-4, 1.5, 3);
        assert_eq!((found.n_successive, found.n_still, found.by_range.len()), (2, 0, 0));
        assert_eq!(NoiseBetweenFrames::default().finish(), TemporalNoise::default());
    }
}
