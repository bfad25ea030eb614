//! Numbers that describe many numbers. Values that are not finite are the caller's to remove.

/// The mean; NaN of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The standard deviation with n − 1 in the denominator; NaN of fewer than two.
pub fn standard_deviation(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return f64::NAN;
    }
    let mean = mean(values);
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

/// The standard deviation of the mean of independent values; NaN of fewer than two.
pub fn standard_error(values: &[f64]) -> f64 {
    standard_deviation(values) / (values.len() as f64).sqrt()
}

/// √(mean of squares); NaN of nothing.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// The median, for an even count the mean of the middle two; NaN of nothing.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The value below which a `fraction` (0 to 1) of the values lies, interpolated linearly between neighbours (Hyndman
/// and Fan 1996, type 7, as numpy); NaN of nothing.
pub fn quantile(values: &[f64], fraction: f64) -> f64 {
    let Some(last) = values.len().checked_sub(1) else { return f64::NAN };
    let mut sorted = values.to_vec();
    let at = fraction.clamp(0.0, 1.0) * last as f64;
    let index = at as usize;
    let (_, &mut low, above) = sorted.select_nth_unstable_by(index, f64::total_cmp);
    let share = at - index as f64;
    if share == 0.0 {
        return low;
    }
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    low + share * (high - low)
}

/// The standard deviation of a normal distribution with the same median absolute deviation from `center`: what the
/// spread is when up to half of the values are outliers. NaN of nothing.
pub fn mad_sigma(values: &[f64], center: f64) -> f64 {
    let deviations: Vec<f64> = values.iter().map(|v| (v - center).abs()).collect();
    // 1/Φ⁻¹(3/4)
    1.482_602_218_505_602 * median(&deviations)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(mean(&values), 2.5);
        assert_eq!(median(&values), 2.5);
        assert_eq!(median(&values[..3]), 3.0);
        assert_eq!(quantile(&values, 0.0), 1.0);
        assert_eq!(quantile(&values, 1.0), 4.0);
        assert!((quantile(&values, 0.9) - 3.7).abs() < 1e-15);
        assert!((standard_deviation(&values) - (5.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((standard_error(&values) - (5.0_f64 / 12.0).sqrt()).abs() < 1e-15);
        assert!((rms(&values) - 7.5_f64.sqrt()).abs() < 1e-15);
        assert!((mad_sigma(&values, 2.5) - 1.482_602_218_505_602).abs() < 1e-15);
    }

    #[test]
    fn nothing_is_nan() {
        assert!(mean(&[]).is_nan() && median(&[]).is_nan() && standard_deviation(&[1.0]).is_nan());
        assert!(mad_sigma(&[], 0.0).is_nan() && rms(&[]).is_nan());
    }
}
