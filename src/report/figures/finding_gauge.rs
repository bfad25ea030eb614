//! One finding at a glance: the value with its interval against the tolerance.

use maud::{Markup, html};

use crate::{
    diagnose::{Finding, Unit},
    report::{
        svg::{Scale, n},
        words::{difference, trimmed, unit},
    },
};

const WIDTH: f64 = 240.0;
const HEIGHT: f64 = 46.0;

/// A strip with the band of what still counts as true, the value, and its interval of 3 σ; `None` where the finding
/// has no value or no tolerance.
pub(in crate::report) fn finding_gauge(finding: &Finding) -> Option<Markup> {
    let value = finding.value.filter(|value| value.is_finite())?;
    let tolerance = finding.tolerance.filter(|t| t.is_finite() && *t > 0.0)?;
    let spread = 3.0 * finding.sigma.filter(|sigma| sigma.is_finite()).unwrap_or(0.0);
    // A hopeless interval must not shrink the value and the band to a dot.
    let spread_shown = spread.min(8.0 * tolerance.max(value.abs()));
    let reach = 1.15 * (value.abs() + spread_shown).max(1.6 * tolerance);
    let x = Scale { domain: [-reach, reach], range: [0.0, WIDTH] };
    let (low, high) = (x.clamped(value - spread_shown), x.clamped(value + spread_shown));
    let middle = 16.0;
    let bound = |side: f64| {
        let text = trimmed(side * tolerance, 3);
        let sign = if side > 0.0 { "+" } else { "" };
        let symbol = if finding.unit == Unit::Count {
            String::new()
        } else {
            format!(" {}", unit(finding.unit))
        };
        (n(x.at(side * tolerance)), format!("{sign}{text}{symbol}"))
    };
    // Where the band is narrow its two labels would lie on each other.
    let is_narrow = x.at(tolerance) - x.at(-tolerance) < 90.0;
    let words = format!(
        "{}; it counts as true within ±{} {}",
        difference(finding),
        trimmed(tolerance, 3),
        unit(finding.unit)
    );
    Some(html! {
        svg class="gauge" viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" aria-label=(words) {
            line class="rail" x1="0" x2=(n(WIDTH)) y1=(n(middle)) y2=(n(middle)) {}
            rect class="band" x=(n(x.at(-tolerance))) width=(n(x.at(tolerance) - x.at(-tolerance))) y=(n(middle - 11.0))
                height="22" rx="2" {}
            line class="zero" x1=(n(x.at(0.0))) x2=(n(x.at(0.0))) y1=(n(middle - 11.0)) y2=(n(middle + 11.0)) {}
            @if spread > 0.0 {
                line class="whisker" x1=(n(low)) x2=(n(high)) y1=(n(middle)) y2=(n(middle)) {}
            }
            circle class="dot" cx=(n(x.at(value))) cy=(n(middle)) r="5" {}
            @if is_narrow {
                text x=(n(x.at(0.0))) y=(n(HEIGHT - 4.0)) text-anchor="middle" {
                    "±" (trimmed(tolerance, 3)) " " (unit(finding.unit))
                }
            } @else {
                @for side in [-1.0, 1.0] {
                    @let (x, label) = bound(side);
                    text x=(x) y=(n(HEIGHT - 4.0)) text-anchor="middle" { (label) }
                }
            }
        }
    })
}
