//! Noise for the tests of this room.

/// Normal numbers, always the same ones.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}
