//! The transcendental functions, the same to the last bit on every platform.
//!
//! The standard library leaves them to the platform's C library: sin, cos, ln, exp and atan2 differ in their last bits
//! between glibc, Apple's and WebAssembly's, for 3 to 14 of 100 arguments. Here they are those of the crate `libm`
//! (musl's, in Rust, errors below one unit in the last place); nalgebra uses the same by its feature `libm-force`.
//! `tests/it/tidy.rs` forbids the standard library's in the other rooms.
//!
//! What is exact is not here: + − × ÷, `sqrt`, `abs`, rounding, and `powi` of a constant small exponent, which is
//! multiplication.

pub(crate) use libm::{acos, atan, atan2, cos, exp, log as ln, log1p as ln_1p, log10, pow, sin};

/// √(x² + y²), as the formula says: exact to two units in the last place where both are 0 or between 1e-150 and 1e150
/// in size, which holds for pixels, metres and radians. Beyond that squares overflow to ∞, or vanish.
#[inline(always)]
pub(crate) fn hypot(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits, not values: these hold on every platform, or the promise of the module does not.
    #[test]
    fn same_bits_everywhere() {
        let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|v| v.to_bits()).collect() };
        let x = 0.737_281_9;
        let all = [
            acos(x),
            atan(x),
            atan2(x, -0.3),
            cos(x),
            exp(x),
            hypot(x, 0.3),
            ln(x),
            ln_1p(x),
            log10(x),
            pow(x, 2.2),
            sin(x),
        ];
        assert_eq!(bits(&all), EXPECTED);
        let std = [
            x.acos(),
            x.atan(),
            x.atan2(-0.3),
            x.cos(),
            x.exp(),
            x.hypot(0.3),
            x.ln(),
            x.ln_1p(),
            x.log10(),
            x.powf(2.2),
            x.sin(),
        ];
        for (ours, theirs) in all.into_iter().zip(std) {
            assert!((ours - theirs).abs() <= 2.0 * f64::EPSILON * theirs.abs(), "{ours} {theirs}");
        }
    }

    #[test]
    fn hypot_in_its_domain() {
        for scale in [1e-150, 1e-20, 1.0, 1e20, 1e150] {
            assert!((hypot(3.0 * scale, 4.0 * scale) / (5.0 * scale) - 1.0).abs() < 1e-15);
        }
        assert_eq!(hypot(0.0, -0.0), 0.0);
        assert!(hypot(f64::NAN, 1.0).is_nan());
        assert_eq!(hypot(f64::NEG_INFINITY, 1.0), f64::INFINITY);
    }

    const EXPECTED: [u64; 11] = [
        0x3fe7_bc7b_a558_03c8,
        0x3fe4_5479_3aca_599a,
        0x3fff_50d7_84df_7dbb,
        0x3fe7_b086_b62e_8aea,
        0x4000_b8d3_0baf_44cc,
        0x3fe9_78ab_a0ce_88d8,
        0xbfd3_8198_ca70_e2c9,
        0x3fe1_ac9e_b1e8_1c22,
        0xbfc0_f162_131b_8765,
        0x3fe0_5db5_5cee_3e1e,
        0x3fe5_834d_8dfc_95de,
    ];
}
