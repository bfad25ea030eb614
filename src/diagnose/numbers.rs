//! Numbers as people read them: with their sign, their σ, and as many digits as it leaves.

use crate::{calibrate::Estimate, math};

/// The number with a true minus sign, and no sign on zero.
pub(crate) fn minus(number: &str) -> String {
    match number.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => number.to_owned(),
    }
}

/// The value and its σ, with two digits of the σ, and no more than `max_decimals` after the point. A σ that is not
/// finite is left out.
pub(crate) fn value_and_sigma(estimate: Estimate, max_decimals: usize) -> String {
    let Estimate { value, sigma } = estimate;
    if !value.is_finite() {
        return "—".to_owned();
    }
    if !(sigma.is_finite() && sigma > 0.0) {
        return minus(&format!("{value:.max_decimals$}"));
    }
    let decimals = decimals_of_sigma(sigma).min(max_decimals);
    // A σ below the last digit shown is not zero: say that it is smaller.
    let smallest = math::pow(10.0, -(decimals as f64));
    let sigma = if sigma < 0.5 * smallest {
        format!("< {smallest:.decimals$}")
    } else {
        format!("{sigma:.decimals$}")
    };
    format!("{} ± {sigma}", minus(&format!("{value:.decimals$}")))
}

/// As [`value_and_sigma`], with a sign before what is positive.
pub(crate) fn signed_with_sigma(estimate: Estimate, max_decimals: usize) -> String {
    let text = value_and_sigma(estimate, max_decimals);
    let value = text.split(' ').next().unwrap_or_default();
    let is_positive = !value.starts_with('−') && value.contains(|c: char| matches!(c, '1'..='9'));
    if is_positive { format!("+{text}") } else { text }
}

/// Digits after the point that show two digits of a σ.
fn decimals_of_sigma(sigma: f64) -> usize {
    // 0.0995 rounds to 0.10 and 9.95 to 10: the exponent is that of the rounded σ.
    let exponent = math::log10(sigma * 1.005).floor();
    (1.0 - exponent).max(0.0) as usize
}

/// The value with its sign, `+0.3` or `−6.2`.
pub(crate) fn signed(value: f64, decimals: usize) -> String {
    let text = plain(value, decimals);
    let is_zero = !text.contains(|c: char| c.is_ascii_digit() && c != '0');
    if is_zero || text.starts_with('−') { text } else { format!("+{text}") }
}

/// The value, without a sign where it is positive; a dash where it is no number.
pub(crate) fn plain(value: f64, decimals: usize) -> String {
    if value.is_finite() { minus(&format!("{value:.decimals$}")) } else { "—".to_owned() }
}

/// The value without zeros at its end.
pub(crate) fn trimmed(value: f64, decimals: usize) -> String {
    let text = plain(value, decimals);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Metres as millimetres.
pub(crate) fn in_mm(estimate: Estimate) -> Estimate {
    Estimate { value: 1e3 * estimate.value, sigma: 1e3 * estimate.sigma }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_sigma() {
        for (value, sigma, expected) in [
            (530.0361, 0.352, "530.04 ± 0.35"),
            (530.0361, 0.0152, "530.036 ± 0.015"),
            (-6.214, 0.0996, "−6.21 ± 0.10"),
            (-6.214, 9.96, "−6 ± 10"),
            (-6.214, 120.0, "−6 ± 120"),
            (1.0, 0.0002, "1.000 ± < 0.001"),
            (1.0, 0.0, "1.000"),
            (1.0, f64::NAN, "1.000"),
            (-0.0001, 0.0001, "0.000 ± < 0.001"),
            (f64::NAN, 1.0, "—"),
        ] {
            assert_eq!(value_and_sigma(Estimate { value, sigma }, 3), expected);
        }
    }

    #[test]
    fn signs_and_zeros() {
        assert_eq!([signed(0.26, 1), signed(-0.26, 1), signed(-0.01, 1)], ["+0.3", "−0.3", "0.0"]);
        let estimate = |value| Estimate { value, sigma: 0.25 };
        assert_eq!(
            [0.5, -0.5, 0.001].map(|value| signed_with_sigma(estimate(value), 1)),
            ["+0.5 ± 0.2", "−0.5 ± 0.2", "0.0 ± 0.2"]
        );
        assert_eq!(
            [trimmed(20.875, 3), trimmed(20.0, 3), trimmed(200.0, 0)],
            ["20.875", "20", "200"]
        );
    }
}
