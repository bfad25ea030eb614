//! How values are spread: bins and a smooth curve.

use maud::{Markup, html};

use crate::math;
use crate::report::svg::{Plot, n};

/// Counts of values in bins of equal width.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bins {
    /// Left edge of the first.
    pub(super) start: f64,
    /// Width of each.
    pub(super) width: f64,
    /// Values in each.
    pub(super) counts: Vec<usize>,
}

impl Bins {
    /// Counts values in bins from `start` to at least `end`; what lies outside is not counted.
    pub(super) fn new(values: &[f64], [start, end]: [f64; 2], width: f64) -> Self {
        let mut counts = vec![0; (((end - start) / width).ceil() as usize).clamp(1, 10_000)];
        for value in values {
            let bin = ((value - start) / width).floor();
            if bin >= 0.0 && bin < counts.len() as f64 {
                counts[bin as usize] += 1;
            }
        }
        Self { start, width, counts }
    }

    /// Left edge, right edge and count of each.
    pub(super) fn iter(&self) -> impl Iterator<Item = (f64, f64, usize)> {
        self.counts.iter().enumerate().map(|(i, &count)| {
            let left = self.start + i as f64 * self.width;
            (left, left + self.width, count)
        })
    }

    /// The largest count.
    pub(super) fn max(&self) -> usize {
        self.counts.iter().copied().max().unwrap_or(0)
    }
}

/// A Gaussian kernel density estimate at `at`, in values per unit (its integral is the number of values):
///
/// ```text
/// f(x) = Σᵢ φ((x − xᵢ)/h)/h,   h = 0.9·min(s, IQR/1.34)·n^(−1/5)
/// ```
///
/// (Silverman, *Density Estimation*, 1986, equation 3.31.) `min_width` bounds h from below, so that values which are
/// quantised alike do not become a needle.
fn density(values: &[f64], at: &[f64], min_width: f64) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    if n == 0 {
        return vec![0.0; at.len()];
    }
    let mean = sorted.iter().sum::<f64>() / n as f64;
    let deviation = (sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
    let range = (sorted[(n - 1) * 3 / 4] - sorted[(n - 1) / 4]) / 1.34;
    let spread = if range > 0.0 { deviation.min(range) } else { deviation };
    let h = (0.9 * spread * math::pow(n as f64, -0.2)).max(min_width);
    let norm = 1.0 / (h * (2.0 * std::f64::consts::PI).sqrt());
    let kernel = |x: f64| {
        // Beyond 5 h nothing can be seen of a value.
        let from = sorted.partition_point(|v| *v < x - 5.0 * h);
        let near = sorted[from..].iter().take_while(|v| **v <= x + 5.0 * h);
        near.map(|v| norm * math::exp(-0.5 * ((x - v) / h).powi(2))).sum()
    };
    at.iter().map(|&x| kernel(x)).collect()
}

/// The density of `values` over a plot whose y counts values in bins of `bin` width.
pub(super) fn density_curve(plot: &Plot, values: &[f64], bin: f64, class: &str) -> Markup {
    const STEPS: i32 = 160;
    let [low, high] = plot.x.domain;
    let at: Vec<f64> =
        (0..=STEPS).map(|i| low + (high - low) * f64::from(i) / f64::from(STEPS)).collect();
    let points: Vec<String> = density(values, &at, 0.5 * bin)
        .into_iter()
        .zip(&at)
        .map(|(per_unit, &x)| format!("{},{}", n(plot.x.at(x)), n(plot.y.clamped(per_unit * bin))))
        .collect();
    html! { polyline class=(format!("curve {class}")) points=(points.join(" ")) {} }
}

/// The median; `None` of nothing.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    (n > 0).then(|| f64::midpoint(sorted[(n - 1) / 2], sorted[n / 2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_every_value_inside() {
        let bins = Bins::new(&[0.0, 0.5, 1.0, 2.999, 3.0, -0.1, f64::NAN], [0.0, 3.0], 1.0);
        assert_eq!(bins.counts, [2, 1, 1]);
        assert_eq!(bins.iter().last(), Some((2.0, 3.0, 1)));
        assert_eq!(bins.max(), 2);
    }

    #[test]
    fn density_integrates_to_the_number_of_values() {
        let values: Vec<f64> = (0..200).map(|i| f64::from(i * i % 97) / 10.0).collect();
        let at: Vec<f64> = (-400..800).map(|i| f64::from(i) / 40.0).collect();
        let sum: f64 = density(&values, &at, 0.1).iter().sum::<f64>() / 40.0;
        assert!((sum - 200.0).abs() < 0.1, "{sum}");
        // Alike values make a hump of the smallest width, no needle and no NaN.
        let needle = density(&[5.0; 9], &[5.0], 0.5)[0];
        assert!((needle - 9.0 / (0.5 * (2.0 * std::f64::consts::PI).sqrt())).abs() < 1e-9);
        assert_eq!(density(&[], &[1.0], 0.5), [0.0]);
    }

    #[test]
    fn medians() {
        assert_eq!(
            [median(&[]), median(&[3.0]), median(&[4.0, 1.0])],
            [None, Some(3.0), Some(2.5)]
        );
    }
}
