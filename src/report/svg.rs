//! What all figures share: numbers as text, scales, axes.

use crate::{diagnose::numbers::minus, math};
use maud::{Markup, html};

/// Width of every figure in its own units. The page shows two beside each other on a desk and one on a phone, so the
/// same drawing is read at 0.75 to 1.2 CSS pixels per unit; the style sheet sets the letters larger on a phone.
pub(super) const WIDTH: f64 = 480.0;

/// A coordinate as text, to a hundredth of a unit. A number that is not finite is a defect of the caller; it is
/// drawn at 0 rather than breaking the page.
pub(super) fn n(value: f64) -> String {
    debug_assert!(value.is_finite(), "a coordinate is {value}");
    let hundredths = if value.is_finite() { (value * 100.0).round() } else { 0.0 };
    if hundredths.abs() > 1e15 {
        return format!("{}", hundredths / 100.0);
    }
    // There are ten thousands of these in a page: whole numbers are written several times faster.
    let sign = if hundredths < 0.0 { "-" } else { "" };
    let hundredths = hundredths.abs() as u64;
    match (hundredths / 100, hundredths % 100) {
        (whole, 0) => format!("{sign}{whole}"),
        (whole, part) if part % 10 == 0 => format!("{sign}{whole}.{}", part / 10),
        (whole, part) => format!("{sign}{whole}.{part:02}"),
    }
}

/// As [`n`], to a tenth of a unit: for marks laid over an image's pixels, of which there are thousands.
pub(super) fn tenth(value: f64) -> String {
    n((value * 10.0).round() / 10.0)
}

/// Takes values to coordinates, linearly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Values at both ends.
    pub(super) domain: [f64; 2],
    /// Coordinates at both ends.
    pub(super) range: [f64; 2],
}

impl Scale {
    /// The coordinate of a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        let [d0, d1] = self.domain;
        let [r0, r1] = self.range;
        r0 + (value - d0) / (d1 - d0) * (r1 - r0)
    }

    /// The coordinate of a value, held inside the range.
    pub(super) fn clamped(&self, value: f64) -> f64 {
        let [d0, d1] = self.domain;
        self.at(value.clamp(d0.min(d1), d0.max(d1)))
    }

    /// About `count` round values inside the domain.
    pub(super) fn ticks(&self, count: usize) -> Ticks {
        Ticks::new(self.domain, count)
    }
}

/// Round values along an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    /// The values, ascending.
    pub(super) values: Vec<f64>,
    /// Digits after the point that tell them apart.
    decimals: usize,
}

impl Ticks {
    /// About `count` multiples of 1, 2 or 5 times a power of ten inside the domain.
    pub(super) fn new(domain: [f64; 2], count: usize) -> Self {
        let step = round_step((domain[1] - domain[0]).abs() / count.max(1) as f64);
        let (low, high) = (domain[0].min(domain[1]), domain[0].max(domain[1]));
        // A hair of slack, so that 0.3 counts as a multiple of 0.1.
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        let decimals = (-math::log10(step) - 1e-9).ceil().max(0.0) as usize;
        Self { values: (first..=last).map(|i| i as f64 * step).collect(), decimals }
    }

    /// The text beside a tick.
    pub(super) fn label(&self, value: f64) -> String {
        minus(&format!("{value:.*}", self.decimals))
    }
}

/// The least multiple of 1, 2 or 5 times a power of ten that is not below `step`.
pub(super) fn round_step(step: f64) -> f64 {
    if !(step.is_finite() && step > 0.0) {
        return 1.0;
    }
    let power = math::pow(10f64, math::log10(step).floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= step * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A domain that holds all values with some air, or `fallback` where there are none.
pub(super) fn domain_of(values: impl IntoIterator<Item = f64>, fallback: [f64; 2]) -> [f64; 2] {
    let [low, high] = values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    if low > high {
        return fallback;
    }
    let air = if high > low { 0.06 * (high - low) } else { 0.5 * low.abs().max(1.0) };
    [low - air, high + air]
}

/// A drawing area with a horizontal and a vertical scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plot {
    pub(super) x: Scale,
    pub(super) y: Scale,
    /// Height of the whole drawing with its margins.
    pub(super) height: f64,
}

/// Room for the letters round a plot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Margins {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

/// Room for ticks and titles on the left and below, and for a title above the y axis.
pub(super) const MARGINS: Margins = Margins { left: 44.0, right: 12.0, top: 42.0, bottom: 48.0 };

impl Plot {
    /// A plot of [`WIDTH`] × `height`, y growing upwards.
    pub(super) fn new(x: [f64; 2], y: [f64; 2], height: f64, margins: Margins) -> Self {
        Self {
            x: Scale { domain: x, range: [margins.left, WIDTH - margins.right] },
            y: Scale { domain: y, range: [height - margins.bottom, margins.top] },
            height,
        }
    }

    /// The `viewBox` attribute.
    pub(super) fn view_box(&self) -> String {
        format!("0 0 {} {}", n(WIDTH), n(self.height))
    }

    /// Ticks and title below the plot.
    pub(super) fn x_axis(&self, title: &str) -> Markup {
        let ticks = self.x.ticks(6);
        let [bottom, _] = self.y.range;
        html! {
            g class="axis" {
                line x1=(n(self.x.range[0])) x2=(n(self.x.range[1])) y1=(n(bottom)) y2=(n(bottom)) {}
                @for &value in &ticks.values {
                    @let x = n(self.x.at(value));
                    line x1=(x) x2=(x) y1=(n(bottom)) y2=(n(bottom + 4.0)) {}
                    text x=(x) y=(n(bottom + 18.0)) text-anchor="middle" { (ticks.label(value)) }
                }
                text class="title" x=(n(f64::midpoint(self.x.range[0], self.x.range[1])))
                    y=(n(bottom + 38.0)) text-anchor="middle" { (title) }
            }
        }
    }

    /// Faint lines at the ticks, with their values, and the title above them.
    pub(super) fn y_axis(&self, title: &str) -> Markup {
        let ticks = self.y.ticks(5);
        let [left, right] = self.x.range;
        html! {
            g class="axis" {
                @for &value in &ticks.values {
                    @let y = n(self.y.at(value));
                    line class="grid" x1=(n(left)) x2=(n(right)) y1=(y) y2=(y) {}
                    text x=(n(left - 8.0)) y=(y) text-anchor="end" dominant-baseline="central" {
                        (ticks.label(value))
                    }
                }
                text class="title" x="0" y=(n(self.y.range[1] - 24.0)) { (title) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_written_as_short_as_they_are() {
        for value in (-2_000..2_000).map(|i| f64::from(i) * 0.0371) {
            let rounded = (value * 100.0).round() / 100.0;
            assert_eq!(n(value), format!("{}", if rounded == 0.0 { 0.0 } else { rounded }));
        }
        for (value, text) in [(-0.001, "0"), (1e9 + 0.25, "1000000000.25"), (-12.006, "-12.01")] {
            assert_eq!(n(value), text);
        }
        assert_eq!(n(1e20), "100000000000000000000");
    }

    #[test]
    fn round_ticks() {
        for (domain, count, expected) in [
            ([0.0, 1.0], 5, vec!["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]),
            ([170.0, 230.0], 6, vec!["170", "180", "190", "200", "210", "220", "230"]),
            ([-3.2, 14.1], 4, vec!["0", "5", "10"]),
            ([-0.021, 0.011], 3, vec!["−0.02", "0.00"]),
            ([529.5, 530.4], 4, vec!["529.5", "530.0"]),
            ([530.0, 530.0], 4, vec!["530"]),
        ] {
            let ticks = Ticks::new(domain, count);
            let labels: Vec<String> = ticks.values.iter().map(|&v| ticks.label(v)).collect();
            assert_eq!(labels, expected, "{domain:?}");
        }
    }

    #[test]
    fn coordinates_are_short_and_finite() {
        assert_eq!([n(1.0 / 3.0), n(-0.001), n(480.0)], ["0.33", "0", "480"]);
        assert_eq!(minus("-0.00"), "0.00");
        assert_eq!(minus("-6.2"), "−6.2");
    }

    #[test]
    fn scales() {
        let scale = Scale { domain: [10.0, 20.0], range: [100.0, 0.0] };
        assert_eq!([scale.at(10.0), scale.at(15.0), scale.clamped(30.0)], [100.0, 50.0, 0.0]);
        assert_eq!(domain_of([f64::NAN], [0.0, 1.0]), [0.0, 1.0]);
        let [low, high] = domain_of([5.0], [0.0, 1.0]);
        assert!(low < 5.0 && 5.0 < high);
    }
}
