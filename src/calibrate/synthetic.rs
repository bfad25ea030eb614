//! Corners of known cameras, for tests.

use super::FrameCorners;
use crate::{
    board::CharucoBoard,
    camera::{Camera, Distortion, Intrinsics, RadialTable, TablePair},
    detect::Corner,
    geom::{Board, Color, Pixel, Point, Pose, Rotation, Vector3},
    math,
};

pub(super) const FACTORY: Intrinsics =
    Intrinsics { fx: 565.0, fy: 565.0, cx: 320.6, cy: 241.2, width: 640, height: 480 };

pub(super) fn board() -> CharucoBoard {
    CharucoBoard::paper(0.020875).unwrap()
}

/// Pseudo-random numbers: a 64-bit linear congruence (Knuth's MMIX), its upper bits.
pub(super) struct Random(pub(super) u64);

impl Random {
    /// Evenly from `low` to `high`.
    pub(super) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// Normal with unit variance (Box and Muller).
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * math::ln(1.0 - self.uniform(0.0, 1.0))).sqrt();
        radius * math::cos(self.uniform(0.0, std::f64::consts::TAU))
    }
}

/// What to make.
#[derive(Clone)]
pub(super) struct Scene {
    pub(super) camera: Camera,
    pub(super) n_views: usize,
    /// Tilt against the optical axis: from, to (radians).
    pub(super) tilt_rad: [f64; 2],
    pub(super) noise_px: f64,
    /// Amplitude of a smooth bump of the board, metres, of random form.
    pub(super) wave_m: f64,
}

impl Scene {
    pub(super) fn new(distortion: Distortion) -> Self {
        let intrinsics = Intrinsics { fx: 531.0, fy: 531.0, cx: 321.5, cy: 240.4, ..FACTORY };
        Self {
            camera: Camera { intrinsics, distortion },
            n_views: 15,
            tilt_rad: [0.15, 0.75],
            noise_px: 0.1,
            wave_m: 0.0,
        }
    }

    pub(super) fn frames(&self, seed: u64) -> Vec<FrameCorners> {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1);
        for _ in 0..8 {
            random.uniform(0.0, 1.0);
        }
        let wave = [(); 4].map(|()| random.uniform(-1.0, 1.0));
        (0..self.n_views)
            .map(|frame| {
                let tilt = random.uniform(self.tilt_rad[0], self.tilt_rad[1]);
                let azimuth = random.uniform(0.0, std::f64::consts::TAU);
                let roll = random.uniform(-0.4, 0.4);
                let at = [(-0.03, 0.03), (-0.03, 0.03), (0.24, 0.42)]
                    .map(|(low, high)| random.uniform(low, high));
                let pose = pose(tilt, azimuth, roll, at);
                FrameCorners { frame, corners: self.see(&pose, wave, &mut random) }
            })
            .collect()
    }

    /// The board's corners inside the image, one in ten missing.
    pub(super) fn see(
        &self,
        pose: &Pose<Color, Board>,
        wave: [f64; 4],
        random: &mut Random,
    ) -> Vec<Corner> {
        let board = board();
        (0..board.n_corners())
            .filter_map(|id| {
                let flat = board.corner(id);
                let [s, t] = [flat.x() / 0.104 - 1.0, flat.y() / 0.0835 - 1.0];
                let form =
                    wave[0] * s * s + wave[1] * t * t + wave[2] * s * t + wave[3] * s * s * s;
                let point = Point::new(flat.x(), flat.y(), self.wave_m * form);
                let pixel = self.camera.project(*pose * point)?;
                let noise = [random.normal(), random.normal()];
                let missing = random.uniform(0.0, 1.0) < 0.1;
                let pixel = Pixel::new(
                    pixel.x + self.noise_px * noise[0],
                    pixel.y + self.noise_px * noise[1],
                );
                let inside = (2.0..637.0).contains(&pixel.x) && (2.0..477.0).contains(&pixel.y);
                // The σ claimed is half the true one: only ratios of σ may matter.
                (inside && !missing).then_some(Corner { id, pixel, sigma_px: 0.5 * self.noise_px })
            })
            .collect()
    }
}

/// The board's centre at this place (metres), tilted about an axis in the image at `azimuth`, rolled (radians).
pub(super) fn pose(tilt: f64, azimuth: f64, roll: f64, at: [f64; 3]) -> Pose<Color, Board> {
    let axis = Vector3::new(math::cos(azimuth), math::sin(azimuth), 0.0);
    let rotation =
        Rotation::from_scaled_axis(axis * tilt) * Rotation::from_scaled_axis(Vector3::z() * roll);
    let centre = Vector3::new(5.0 * 0.020875, 4.0 * 0.020875, 0.0);
    Pose::new(rotation, Vector3::new(at[0], at[1], at[2]) - rotation * centre)
}

/// Tables as the 4th-generation iPad has them: −1 % at the corner.
pub(super) fn tables() -> TablePair {
    let center = Pixel::new(318.3, 240.0);
    let magnification = (0..42)
        .map(|i| {
            let s = (f64::from(i) / 41.0).powi(2);
            -0.011 * s * (1.0 - 0.1 * s)
        })
        .collect();
    let radius = RadialTable::farthest_corner_px(center, 640, 480);
    TablePair::from_inverse(RadialTable::new(center, radius, magnification).unwrap())
}
