//! A number over a plane: cells of the image or of the board in shades.
//!
//! Shade is never the only sign: cells carry their number where there is room for it, and otherwise the sign of what
//! is far from zero.

use maud::{Markup, html};

use crate::math;
use crate::report::{svg::n, words::trimmed};

/// Shades on either side of the middle of a diverging ramp, and of a sequential one above its first.
const SHADES: usize = 4;
/// Width of a step of the bar below the drawing.
const STEP: f64 = 26.0;
/// Room that the bar takes.
pub(super) const BAR_HEIGHT: f64 = 46.0;

/// Which numbers there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ramp {
    /// From 0 upwards.
    Sequential,
    /// On both sides of 0.
    Diverging,
}

/// Takes numbers to shades.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heat {
    ramp: Ramp,
    /// The number at which the last shade begins to be the right one; round, so that it can be said.
    reach: f64,
}

/// A cell of the drawing, in its own units.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    /// Left, top, width, height.
    pub(super) area: [f64; 4],
    pub(super) value: f64,
    /// Written into the cell; without it the sign is, where the number is far from zero.
    pub(super) label: Option<String>,
    pub(super) tip: String,
}

impl Heat {
    /// For these numbers: one in twenty may be beyond the last shade. At least `least`, so that noise does not look
    /// like a mountain.
    pub(super) fn new(ramp: Ramp, values: impl Iterator<Item = f64>, least: f64) -> Self {
        let mut sizes: Vec<f64> = values.filter(|v| v.is_finite()).map(f64::abs).collect();
        sizes.sort_by(f64::total_cmp);
        let large = sizes.get(sizes.len().saturating_sub(1) * 19 / 20).copied().unwrap_or(0.0);
        Self { ramp, reach: round_reach(large.max(least)) }
    }

    /// −4 to 4.
    fn shade(&self, value: f64) -> i32 {
        let shades = SHADES as f64;
        (value / self.reach * shades).round().clamp(-shades, shades) as i32
    }

    fn class(&self, value: f64) -> String {
        match (self.ramp, self.shade(value)) {
            (Ramp::Sequential, shade) => format!("shade q{}", shade.max(0)),
            (Ramp::Diverging, shade) if shade < 0 => format!("shade m{}", -shade),
            (Ramp::Diverging, shade) => format!("shade p{shade}"),
        }
    }

    /// The cells; those without a finite number are left out.
    pub(super) fn tiles(&self, tiles: &[Tile]) -> Markup {
        let known = tiles.iter().filter(|tile| tile.value.is_finite());
        html! {
            g class="heat" {
                @for Tile { area: [x, y, width, height], value, label, tip } in known {
                    rect class=(format!("mark {}", self.class(*value))) x=(n(*x)) y=(n(*y)) width=(n(*width))
                        height=(n(*height)) data-tip=(tip) {}
                    @let (cx, cy) = (x + 0.5 * width, y + 0.5 * height);
                    @match label {
                        Some(label) => {
                            text class="in-cell" x=(n(cx)) y=(n(cy)) text-anchor="middle" dominant-baseline="central" {
                                (label)
                            }
                        }
                        None => (self.sign(*value, [cx, cy])),
                    }
                }
            }
        }
    }

    /// A plus or a minus where the number is far from zero.
    fn sign(&self, value: f64, [x, y]: [f64; 2]) -> Markup {
        const ARM: f64 = 4.0;
        if self.ramp == Ramp::Sequential || self.shade(value).abs() < 2 {
            return html! {};
        }
        let across = format!("M{} {}h{}", n(x - ARM), n(y), n(2.0 * ARM));
        let down = format!("M{} {}v{}", n(x), n(y - ARM), n(2.0 * ARM));
        let path = if value > 0.0 { across + &down } else { across };
        html! { path class="sign" d=(path) {} }
    }

    /// Which shade is which number, as a bar at this height of the drawing; `ends` says what lies beyond its ends.
    pub(super) fn bar(&self, unit: &str, ends: [&str; 2], top: f64) -> Markup {
        let shades = SHADES as i32;
        let first = if self.ramp == Ramp::Diverging { -shades } else { 0 };
        let at = |shade: i32| STEP * f64::from(shade - first);
        let value = |shade: i32| self.reach * f64::from(shade) / f64::from(shades);
        let labelled: Vec<i32> =
            if first < 0 { vec![-shades, 0, shades] } else { vec![0, shades / 2, shades] };
        let words = |shade: i32| {
            let number = match self.ramp {
                Ramp::Diverging if shade != 0 => signed_trimmed(value(shade)),
                _ => trimmed(value(shade), 4),
            };
            if shade == shades { format!("{number} {unit}") } else { number }
        };
        let width = at(shades + 1);
        html! {
            g class="heat-bar" transform=(format!("translate(1 {})", n(top + 10.0))) {
                @for shade in first..=shades {
                    rect class=(self.class(value(shade))) x=(n(at(shade))) y="0" width=(n(STEP)) height="12" {}
                }
                @for shade in labelled {
                    @let anchor = if shade == first { "start" } else { "middle" };
                    @let x = if shade == first { 0.0 } else { at(shade) + 0.5 * STEP };
                    text x=(n(x)) y="28" text-anchor=(anchor) { (words(shade)) }
                }
                text x=(n(width + 22.0)) y="11" {
                    @if first < 0 { "− " (ends[0]) " · + " (ends[1]) } @else { (ends[1]) }
                }
            }
        }
    }
}

/// The least number of a fine set of round ones that is not below `reach`: shades must not be spent on what is not
/// there.
fn round_reach(reach: f64) -> f64 {
    if !(reach.is_finite() && reach > 0.0) {
        return 1.0;
    }
    let power = math::pow(10f64, math::log10(reach).floor());
    let round = [1.0, 1.2, 1.6, 2.0, 2.4, 3.0, 4.0, 5.0, 6.0, 8.0];
    round.into_iter().find(|r| r * power >= reach * (1.0 - 1e-9)).unwrap_or(10.0) * power
}

fn signed_trimmed(value: f64) -> String {
    let text = trimmed(value, 4);
    if value > 0.0 { format!("+{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shades_follow_numbers() {
        let heat = Heat::new(Ramp::Diverging, [0.1, -0.7, f64::NAN, 0.3].into_iter(), 0.0);
        assert!(heat.reach > 0.29 && heat.reach < 1.1, "{heat:?}");
        let heat = Heat { ramp: Ramp::Diverging, reach: 1.0 };
        for (value, class) in [
            (0.0, "shade p0"),
            (0.12, "shade p0"),
            (0.26, "shade p1"),
            (-0.26, "shade m1"),
            (7.0, "shade p4"),
            (-7.0, "shade m4"),
        ] {
            assert_eq!(heat.class(value), class, "{value}");
        }
        let least = Heat::new(Ramp::Sequential, [1e-9].into_iter(), 0.5);
        assert_eq!((least.reach, least.class(1e-9)), (0.5, "shade q0".to_owned()));
        assert_eq!(Heat::new(Ramp::Sequential, std::iter::empty(), 0.5).reach, 0.5);
        assert_eq!(
            [5.5, 0.1, 97.0, 0.0].map(round_reach).map(|r| trimmed(r, 3)),
            ["6", "0.1", "100", "1"]
        );
    }

    #[test]
    fn a_cell_without_a_number_is_not_drawn() {
        let tile =
            |value| Tile { area: [0.0, 0.0, 9.0, 9.0], value, label: None, tip: "tip".to_owned() };
        let heat = Heat { ramp: Ramp::Diverging, reach: 1.0 };
        let drawn = heat.tiles(&[tile(f64::NAN), tile(0.9), tile(-0.9)]).into_string();
        assert_eq!((drawn.matches("<rect").count(), drawn.matches("<path").count()), (2, 2));
    }
}
