//! Random numbers that never change: by seed, subject and frame, not by who asks first.

use rand_pcg::{Pcg64, rand_core::Rng};

/// What random numbers are for. Each subject of each frame has its own stream, so that more noise in one does not
/// move another, and frames can be made in any order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Subject {
    Trajectory = 1,
    Wall = 2,
    Image = 3,
    Depth = 4,
    Corners = 5,
}

/// One stream of random numbers.
///
/// `rand_pcg` promises that its streams stay as they are ("value stability" in the rand book); everything that is
/// made from them is made here, because the distributions of `rand` carry no such promise.
pub(super) struct Random(Pcg64);

impl Random {
    /// The stream for this subject of frame `frame` of a recording with this seed.
    pub(super) fn new(seed: u64, subject: Subject, frame: usize) -> Self {
        // Streams of one PCG differ little at first; unlike states do not.
        let mut state = seed;
        for word in [subject as u64, frame as u64] {
            state = mixed(state ^ mixed(word));
        }
        Self(Pcg64::new(
            u128::from(state) << 64 | u128::from(mixed(state)),
            u128::from(mixed(!state)),
        ))
    }

    /// Any 64 bits.
    pub(super) fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Evenly between `low` and `high`.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        const UNIT: f64 = 1.0 / (1u64 << 53) as f64;
        low + (high - low) * ((self.bits() >> 11) as f64 * UNIT)
    }

    /// Nearly normal with mean 0 and standard deviation 1: the sum of four 16-bit numbers (Irwin-Hall), which never
    /// leaves ±3.46. One draw per number makes noise as cheap as a picture needs.
    pub(super) fn normal(&mut self) -> f64 {
        let bits = self.bits();
        let sum: u64 = (0..4).map(|i| bits >> (16 * i) & 0xffff).sum();
        // Four times the mean 65535/2; standard deviation √(4·(65536² − 1)/12).
        (sum as f64 - 131_070.0) / 37_837.224_784_9
    }
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014, doi 10.1145/2660193.2660195).
pub(super) fn mixed(word: u64) -> u64 {
    let z = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_streams_never_change() {
        // Written down once; a new version of a dependency must not move any recording.
        let first = |seed, subject, frame| Random::new(seed, subject, frame).bits();
        assert_eq!(
            [
                first(0, Subject::Image, 0),
                first(0, Subject::Image, 1),
                first(2, Subject::Image, 0),
                first(1, Subject::Image, 0),
            ],
            [
                4_808_337_596_808_888_500,
                139_114_001_178_727_023,
                7_822_921_403_107_619_535,
                2_823_446_516_158_888_183
            ]
        );
    }

    #[test]
    fn normal_has_its_moments() {
        let mut random = Random::new(7, Subject::Image, 0);
        let n = 200_000;
        let draws: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        let moment = |k: i32| draws.iter().map(|d| d.powi(k)).sum::<f64>() / f64::from(n);
        assert!(moment(1).abs() < 0.01, "{}", moment(1));
        assert!((moment(2) - 1.0).abs() < 0.01, "{}", moment(2));
        assert!(moment(3).abs() < 0.03, "{}", moment(3));
        // Irwin-Hall of four has the excess kurtosis −6/(5·4).
        assert!((moment(4) - 2.7).abs() < 0.05, "{}", moment(4));
    }
}
