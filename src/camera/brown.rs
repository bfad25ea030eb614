//! Brown-Conrady distortion.

use crate::math;

use std::ops::{Add, Mul, Sub};

/// A number, or several side by side.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Add<f64, Output = Self>
    + Mul<f64, Output = Self>
{
}

impl<T> Real for T where
    T: Copy
        + Add<Output = T>
        + Sub<Output = T>
        + Mul<Output = T>
        + Add<f64, Output = T>
        + Mul<f64, Output = T>
{
}

/// The polynomials of Brown and Conrady, in OpenCV's order and notation.
///
/// With (x, y) the direction (x/z, y/z) and r² = x² + y²:
///
/// ```text
/// x' = x·(1 + k1·r² + k2·r⁴ + k3·r⁶) + 2·p1·x·y + p2·(r² + 2x²)
/// y' = y·(1 + k1·r² + k2·r⁴ + k3·r⁶) + p1·(r² + 2y²) + 2·p2·x·y
/// ```
///
/// (D. C. Brown, *Close-range camera calibration*, 1971; OpenCV, `calib3d`, five-coefficient model.)
///
/// **Valid domain.** The directions up to the radius where the radial map r·(1 + k1·r² + k2·r⁴ + k3·r⁶) first stops
/// increasing, as far as the full map keeps its orientation (determinant of its Jacobian > 0). Beyond it the
/// polynomial folds the image over itself and means nothing; every method says `None` there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brown {
    /// Radial, r².
    pub k1: f64,
    /// Radial, r⁴.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial, r⁶.
    pub k3: f64,
}

/// How closely [`Brown::undistort`] is undone by [`Brown::distort`], relative to max(1, length of the direction).
const UNDISTORT_TOLERANCE: f64 = 1e-13;

impl Brown {
    /// No distortion.
    pub const ZERO: Self = Self { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };

    /// k1 k2 p1 p2 k3: OpenCV's order, and that of the columns of [`d_distorted_d_parameters`].
    ///
    /// [`d_distorted_d_parameters`]: Self::d_distorted_d_parameters
    pub const fn parameters(&self) -> [f64; 5] {
        [self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    /// The inverse of [`parameters`](Self::parameters).
    pub const fn from_parameters([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self { k1, k2, p1, p2, k3 }
    }

    /// Where the lens draws this direction (both as x/z, y/z); `None` outside the valid domain.
    pub fn distort(&self, ray: [f64; 2]) -> Option<[f64; 2]> {
        self.is_valid(ray).then(|| self.polynomial(ray))
    }

    /// The direction that the lens draws at this place (both as x/z, y/z); `None` where no direction of the valid
    /// domain is drawn there.
    ///
    /// Found by Newton's method from the solution of the radial part alone. `distort` of the result differs from
    /// `ray` by at most 1e-13·max(1, |ray|): 1e-10 px in any camera of ours.
    pub fn undistort(&self, ray: [f64; 2]) -> Option<[f64; 2]> {
        let radius = math::hypot(ray[0], ray[1]);
        if !radius.is_finite() {
            return None;
        }
        let tolerance = UNDISTORT_TOLERANCE * radius.max(1.0);
        let scale = if radius > 0.0 { self.radial_inverse(radius) / radius } else { 1.0 };
        let mut x = [ray[0] * scale, ray[1] * scale];
        let residual = |x: [f64; 2]| {
            let d = self.polynomial(x);
            [ray[0] - d[0], ray[1] - d[1]]
        };
        let mut error = residual(x);
        let mut size = math::hypot(error[0], error[1]);
        for _ in 0..50 {
            if size <= tolerance {
                break;
            }
            let [[a, b], [c, d]] = self.d_distorted_d_ray(x);
            let det = a * d - b * c;
            let step = [(d * error[0] - b * error[1]) / det, (a * error[1] - c * error[0]) / det];
            let mut fraction = 1.0;
            loop {
                let next = [x[0] + fraction * step[0], x[1] + fraction * step[1]];
                let next_error = residual(next);
                let next_size = math::hypot(next_error[0], next_error[1]);
                if next_size < size {
                    (x, error, size) = (next, next_error, next_size);
                    break;
                }
                fraction *= 0.5;
                if fraction < 1e-3 {
                    // No descent: either at the limit of f64, or there is no such direction.
                    return (size <= 4.0 * tolerance && self.is_valid(x)).then_some(x);
                }
            }
        }
        (size <= tolerance && self.is_valid(x)).then_some(x)
    }

    /// Partial derivatives of the distorted direction (rows x', y') by the direction (columns x, y). Meaningful in
    /// the valid domain.
    #[inline(always)]
    pub fn d_distorted_d_ray(&self, ray: [f64; 2]) -> [[f64; 2]; 2] {
        self.by_ray(ray)
    }

    /// As [`d_distorted_d_ray`](Self::d_distorted_d_ray).
    #[inline(always)]
    pub(crate) fn by_ray<T: Real>(&self, [x, y]: [T; 2]) -> [[T; 2]; 2] {
        let r2 = x * x + y * y;
        let radial = self.radial(r2);
        // d radial / d r²
        let slope = r2 * (r2 * (3.0 * self.k3) + 2.0 * self.k2) + self.k1;
        let (x2, y2) = (x * 2.0, y * 2.0);
        let cross = x2 * y * slope + x2 * self.p1 + y2 * self.p2;
        [
            [radial + x2 * x * slope + y2 * self.p1 + x * (6.0 * self.p2), cross],
            [cross, radial + y2 * y * slope + y * (6.0 * self.p1) + x2 * self.p2],
        ]
    }

    /// Partial derivatives of the distorted direction (rows x', y') by k1 k2 p1 p2 k3 (columns).
    #[inline(always)]
    pub fn d_distorted_d_parameters(&self, ray: [f64; 2]) -> [[f64; 5]; 2] {
        Self::by_parameters(ray)
    }

    /// As [`d_distorted_d_parameters`](Self::d_distorted_d_parameters).
    #[inline(always)]
    pub(crate) fn by_parameters<T: Real>([x, y]: [T; 2]) -> [[T; 5]; 2] {
        let r2 = x * x + y * y;
        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let cross = x * y * 2.0;
        [
            [x * r2, x * r4, cross, r2 + x * x * 2.0, x * r6],
            [y * r2, y * r4, r2 + y * y * 2.0, cross, y * r6],
        ]
    }

    /// 1 + k1·r² + k2·r⁴ + k3·r⁶
    #[inline(always)]
    fn radial<T: Real>(&self, r2: T) -> T {
        r2 * (r2 * (r2 * self.k3 + self.k2) + self.k1) + 1.0
    }

    /// The radius |(x/z, y/z)| where the radial map first stops increasing; infinite where it never does.
    pub fn max_radius(&self) -> f64 {
        // Smallest positive root of the derivative 1 + 3·k1·s + 5·k2·s² + 7·k3·s³, s = r². It starts at 1; between
        // its own extrema it is monotonic, so that the first sign change can be bracketed and bisected.
        let derivative =
            |s: f64| 1.0 + s * (3.0 * self.k1 + s * (5.0 * self.k2 + s * 7.0 * self.k3));
        let mut low = 0.0;
        for turn in self.extrema_of_slope().into_iter().flatten() {
            if derivative(turn) <= 0.0 {
                return bisect(derivative, low, turn).sqrt();
            }
            low = turn;
        }
        // Beyond the last extremum: does it fall to −∞?
        let leading = [self.k3, self.k2, self.k1].into_iter().find(|&k| k != 0.0).unwrap_or(0.0);
        if leading >= 0.0 {
            return f64::INFINITY;
        }
        let mut high = low.max(1e-3) * 2.0;
        while derivative(high) > 0.0 {
            high *= 2.0;
            if high > 1e12 {
                return f64::INFINITY;
            }
        }
        bisect(derivative, low, high).sqrt()
    }

    /// In the valid domain?
    fn is_valid(&self, ray: [f64; 2]) -> bool {
        self.is_valid_before(self.first_dip(), ray)
    }

    /// The r² of the first extremum of the radial map's slope at which the slope is no longer positive; infinite where
    /// there is none.
    pub(crate) fn first_dip(&self) -> f64 {
        let dips = |turn: &f64| !(self.radial_slope(*turn) > 0.0);
        self.extrema_of_slope().into_iter().flatten().find(dips).unwrap_or(f64::INFINITY)
    }

    /// d(r·radial)/dr at s = r².
    #[inline(always)]
    pub(crate) fn radial_slope<T: Real>(&self, s: T) -> T {
        s * (s * (s * (7.0 * self.k3) + 5.0 * self.k2) + 3.0 * self.k1) + 1.0
    }

    /// In the valid domain, the first dip being known?
    #[inline(always)]
    fn is_valid_before(&self, first_dip: f64, [x, y]: [f64; 2]) -> bool {
        let s = x * x + y * y;
        // NaN is beyond everything.
        if !(self.radial_slope(s) > 0.0) || first_dip < s {
            return false;
        }
        let [[a, b], [c, d]] = self.d_distorted_d_ray([x, y]);
        a > 0.0 && a * d - b * c > 0.0
    }

    /// Where the lens draws this direction, in the valid domain.
    #[inline(always)]
    pub(crate) fn polynomial<T: Real>(&self, [x, y]: [T; 2]) -> [T; 2] {
        let (xx, yy, cross) = (x * x, y * y, x * y * 2.0);
        let r2 = xx + yy;
        let radial = self.radial(r2);
        [
            x * radial + cross * self.p1 + (r2 + xx * 2.0) * self.p2,
            y * radial + (r2 + yy * 2.0) * self.p1 + cross * self.p2,
        ]
    }

    /// The positive s = r² where 3·k1 + 10·k2·s + 21·k3·s² = 0, ascending.
    fn extrema_of_slope(&self) -> [Option<f64>; 2] {
        let (a, b, c) = (21.0 * self.k3, 5.0 * self.k2, 3.0 * self.k1); // a·s² + 2b·s + c
        let positive = |s: f64| (s > 0.0 && s.is_finite()).then_some(s);
        if a == 0.0 {
            return [positive(-c / (2.0 * b)), None];
        }
        let discriminant = b * b - a * c;
        if !(discriminant > 0.0) {
            return [None, None];
        }
        // The stable pair of formulas: no difference of nearly equal numbers.
        let q = -(b + discriminant.sqrt().copysign(b));
        let (s, t) = (q / a, c / q);
        [positive(s.min(t)), positive(s.max(t))]
    }

    /// The radius whose radial map is `distorted`, or the edge of the domain where there is none: a start for Newton.
    fn radial_inverse(&self, distorted: f64) -> f64 {
        let map = |r: f64| {
            let s = r * r;
            r * (1.0 + s * (self.k1 + s * (self.k2 + s * self.k3)))
        };
        let edge = self.max_radius();
        if edge.is_finite() && map(edge) <= distorted {
            return edge * (1.0 - 1e-6);
        }
        let (mut low, mut high) = (0.0, if edge.is_finite() { edge } else { distorted.max(1e-3) });
        while map(high) < distorted && high < 1e12 {
            high *= 2.0;
        }
        let mut r = distorted.clamp(low, high);
        for _ in 0..60 {
            let s = r * r;
            let error = map(r) - distorted;
            if error > 0.0 {
                high = r
            } else {
                low = r
            }
            let slope = 1.0 + s * (3.0 * self.k1 + s * (5.0 * self.k2 + s * 7.0 * self.k3));
            let next = r - error / slope;
            let next = if next > low && next < high { next } else { f64::midpoint(low, high) };
            if (next - r).abs() <= 1e-9 * r.max(1e-3) {
                return next;
            }
            r = next;
        }
        r
    }
}

/// Where a function with f(low) > 0 ≥ f(high) changes sign.
fn bisect(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..200 {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if f(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lenses with every coefficient at work, and the extremes.
    const LENSES: &[Brown] = &[
        Brown { k1: 0.07, k2: -0.11, p1: 0.002, p2: -0.0015, k3: 0.03 },
        Brown { k1: -0.35, k2: 0.14, p1: -0.001, p2: 0.0007, k3: -0.02 },
        Brown { k1: -0.2, k2: 0.0, p1: 0.003, p2: 0.002, k3: 0.0 },
        Brown { k1: 0.3, k2: 0.2, p1: -0.01, p2: 0.01, k3: 0.1 },
        Brown { k1: 0.0, k2: 0.0, p1: 0.005, p2: -0.003, k3: -0.4 },
        Brown { k1: -1.6, k2: 1.0, p1: 0.001, p2: 0.001, k3: 0.1 },
        Brown::ZERO,
    ];

    fn grid() -> impl Iterator<Item = [f64; 2]> {
        (-10..=10).flat_map(|i| (-8..=8).map(move |j| [f64::from(i) * 0.08, f64::from(j) * 0.08]))
    }

    #[test]
    fn undistort_undoes_distort() {
        for lens in LENSES {
            let mut n = 0;
            for ray in grid() {
                let Some(distorted) = lens.distort(ray) else { continue };
                n += 1;
                let back = lens.undistort(distorted).unwrap_or_else(|| panic!("{lens:?} {ray:?}"));
                // Near the fold the map is flat and the direction is ill-determined; what is promised is its image.
                let again = lens.distort(back).unwrap();
                let error = (again[0] - distorted[0]).hypot(again[1] - distorted[1]);
                assert!(error <= 4e-13, "{lens:?} {ray:?}: {error}");
                let [[a, b], [c, d]] = lens.d_distorted_d_ray(ray);
                if a * d - b * c > 0.05 {
                    let error = (back[0] - ray[0]).hypot(back[1] - ray[1]);
                    assert!(error < 1e-10, "{lens:?} {ray:?}: {error}");
                }
            }
            assert!(n > 60, "{lens:?}: the domain has only {n} points of the grid");
        }
    }

    #[test]
    fn agrees_with_opencv() {
        // cv2.projectPoints([[0.3, -0.2, 1]], 0, 0, I, [0.07, -0.11, 0.002, -0.0015, 0.03]), OpenCV 4.14.
        let [x, y] = LENSES[0].distort([0.3, -0.2]).unwrap();
        assert!((x - 0.301_487_073).abs() < 1e-12 && (y - -0.200_861_382).abs() < 1e-12, "{x} {y}");
    }

    #[test]
    fn jacobians_match_differences() {
        let h = 1e-6;
        for lens in LENSES {
            for ray in grid().filter(|&ray| lens.distort(ray).is_some()) {
                let by_ray = lens.d_distorted_d_ray(ray);
                for column in 0..2 {
                    let mut step = [[ray[0], ray[1]]; 2];
                    step[0][column] -= h;
                    step[1][column] += h;
                    let [low, high] = step.map(|ray| lens.polynomial(ray));
                    for row in 0..2 {
                        let numeric = (high[row] - low[row]) / (2.0 * h);
                        assert!((by_ray[row][column] - numeric).abs() < 1e-8, "{lens:?} {ray:?}");
                    }
                }
                let by_parameters = lens.d_distorted_d_parameters(ray);
                for column in 0..5 {
                    let [low, high] = [-h, h].map(|h| {
                        let mut parameters = lens.parameters();
                        parameters[column] += h;
                        Brown::from_parameters(parameters).polynomial(ray)
                    });
                    for row in 0..2 {
                        let numeric = (high[row] - low[row]) / (2.0 * h);
                        assert!(
                            (by_parameters[row][column] - numeric).abs() < 1e-8,
                            "{lens:?} {ray:?} parameter {column}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn edge_of_the_domain() {
        // 1 − 3·0.2·s = 0 at s = 5/3.
        let barrel = Brown { k1: -0.2, ..Brown::ZERO };
        let edge = (5.0_f64 / 3.0).sqrt();
        assert!((barrel.max_radius() - edge).abs() < 1e-9);
        assert!(barrel.distort([edge - 1e-6, 0.0]).is_some());
        assert!(barrel.distort([edge + 1e-6, 0.0]).is_none());
        // Beyond the fold of one dip the polynomial rises again: still outside.
        let dip = Brown { k1: -1.6, k2: 1.0, k3: 0.1, ..Brown::ZERO };
        assert!(dip.distort([dip.max_radius() + 1.0, 0.0]).is_none());
        assert!(dip.polynomial([dip.max_radius() + 1.0, 0.0])[0] > 0.0);
        // A place that no direction of the domain reaches.
        assert!(barrel.undistort([2.0 * edge, 0.0]).is_none());
        assert_eq!(Brown::ZERO.max_radius(), f64::INFINITY);
        assert!((Brown { k1: 0.3, ..Brown::ZERO }).max_radius().is_infinite());
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(barrel.distort([bad, 0.0]).is_none() && barrel.undistort([bad, 0.0]).is_none());
        }
    }
}
