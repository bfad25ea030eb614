//! From lattice or board coordinates to the image: a homography and, where enough corners are known, a smooth bend.

use nalgebra::{SMatrix, SVector};

use crate::geom::Pixel;

/// A smooth map from the plane of the board, in squares, to the image.
///
/// A homography takes perspective; a polynomial of its residuals (of second degree from 16 corners on, third from 36)
/// takes lens distortion and waviness. The polynomial is damped, so that beyond the corners it does not run away.
#[derive(Clone, Debug)]
pub(super) struct SmoothMap {
    /// Normalisation of the plane: centre and scale.
    center: [f64; 2],
    scale: f64,
    /// Homography from the normalised plane to pixels, row by row; the last entry is 1.
    h: [f64; 9],
    /// Coefficients of the monomials for x and y.
    bend: Vec<[f64; 2]>,
}

/// Monomials of (u, v) up to third degree, by degree.
fn monomials(u: f64, v: f64) -> [f64; 10] {
    [1.0, u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v]
}

impl SmoothMap {
    /// The map through these corners (plane coordinates in squares, pixel), in the least-squares sense; `None` for
    /// fewer than four or where they lie on a line.
    pub(super) fn fit(corners: &[([f64; 2], Pixel)]) -> Option<Self> {
        let mut map = Self::homography(corners)?;
        map.fit_bend(corners);
        Some(map)
    }

    /// As [`fit`](Self::fit), without the bend: stiff, so that a wrong corner stands out.
    pub(super) fn homography(corners: &[([f64; 2], Pixel)]) -> Option<Self> {
        let n = corners.len();
        if n < 4 {
            return None;
        }
        let (mut center, mut pixel_center) = ([0.0; 2], [0.0; 2]);
        for ([x, y], q) in corners {
            center = [center[0] + x / n as f64, center[1] + y / n as f64];
            pixel_center = [pixel_center[0] + q.x / n as f64, pixel_center[1] + q.y / n as f64];
        }
        let (mut spread, mut pixel_spread, mut moments) = (0.0, 0.0, [0.0; 3]);
        for ([x, y], q) in corners {
            let (dx, dy) = (x - center[0], y - center[1]);
            moments = [moments[0] + dx * dx, moments[1] + dx * dy, moments[2] + dy * dy];
            spread += (dx.abs() + dy.abs()) / n as f64;
            pixel_spread +=
                ((q.x - pixel_center[0]).abs() + (q.y - pixel_center[1]).abs()) / n as f64;
        }
        let [xx, xy, yy] = moments;
        if xx * yy - xy * xy < 1e-6 * (xx + yy) * (xx + yy) {
            return None; // All on a line.
        }
        if !(spread > 0.0 && pixel_spread > 0.0) {
            return None;
        }
        let (scale, pixel_scale) = (1.0 / spread, 1.0 / pixel_spread);
        let normalised: Vec<[f64; 4]> = corners
            .iter()
            .map(|(p, q)| {
                [
                    (p[0] - center[0]) * scale,
                    (p[1] - center[1]) * scale,
                    (q.x - pixel_center[0]) * pixel_scale,
                    (q.y - pixel_center[1]) * pixel_scale,
                ]
            })
            .collect();
        // x·w = h·(u, v, 1) with w = 1 + h6·u + h7·v is linear in h; dividing by the last w makes it geometric.
        let mut h = SVector::<f64, 8>::zeros();
        for pass in 0..3 {
            // The equations of x and y share their blocks: Σ p pᵀ, −Σ x p (u v), Σ (x² + y²)(u v)(u v)ᵀ, p = (u v 1).
            let (mut pp, mut xp, mut yp) = ([0.0; 6], [0.0; 6], [0.0; 6]);
            let mut last = [0.0; 6];
            for &[u, v, x, y] in &normalised {
                let w = if pass == 0 { 1.0 } else { 1.0 + h[6] * u + h[7] * v };
                if !(w > 0.05) {
                    return None; // A corner behind the camera: not a picture of a plane.
                }
                let weight = 1.0 / (w * w);
                let products = [u * u, u * v, v * v, u, v, 1.0].map(|product| product * weight);
                let square = x * x + y * y;
                for k in 0..6 {
                    pp[k] += products[k];
                    xp[k] += x * products[k];
                    yp[k] += y * products[k];
                    last[k] += square * products[k];
                }
            }
            let mut ata = SMatrix::<f64, 8, 8>::zeros();
            let mut atb = SVector::<f64, 8>::zeros();
            let [uu, uv, vv, u, v, n] = pp;
            for (at, p) in [(0, xp), (3, yp)] {
                let block = [[uu, uv, u], [uv, vv, v], [u, v, n]];
                let cross = [[p[0], p[1], p[3]], [p[1], p[2], p[4]]];
                for i in 0..3 {
                    for j in 0..3 {
                        ata[(at + i, at + j)] = block[i][j];
                    }
                    for j in 0..2 {
                        ata[(6 + j, at + i)] = -cross[j][i];
                    }
                    atb[at + i] = p[3 + i];
                }
            }
            (ata[(6, 6)], ata[(7, 6)], ata[(7, 7)]) = (last[0], last[1], last[2]);
            (atb[6], atb[7]) = (-last[3], -last[4]);
            let trace = ata.trace();
            for i in 0..8 {
                ata[(i, i)] += 1e-12 * trace;
            }
            h = ata.cholesky()?.solve(&atb);
        }
        if normalised.iter().any(|&[u, v, ..]| !(1.0 + h[6] * u + h[7] * v > 0.05)) {
            return None;
        }
        let row = |a: usize, shift: f64| {
            [
                h[a] / pixel_scale + shift * h[6],
                h[a + 1] / pixel_scale + shift * h[7],
                h[a + 2] / pixel_scale + shift,
            ]
        };
        let (rx, ry) = (row(0, pixel_center[0]), row(3, pixel_center[1]));
        let h = [rx[0], rx[1], rx[2], ry[0], ry[1], ry[2], h[6], h[7], 1.0];
        Some(Self { center, scale, h, bend: Vec::new() })
    }

    fn fit_bend(&mut self, corners: &[([f64; 2], Pixel)]) {
        let terms = match corners.len() {
            0..16 => return,
            16..36 => 6,
            _ => 10,
        };
        let mut ata = SMatrix::<f64, 10, 10>::identity();
        let mut atb = SMatrix::<f64, 10, 2>::zeros();
        for (p, q) in corners {
            let Some(at) = self.at(p[0], p[1]) else { return };
            let m = monomials(
                (p[0] - self.center[0]) * self.scale,
                (p[1] - self.center[1]) * self.scale,
            );
            for i in 0..terms {
                // The lower triangle is all that the decomposition reads.
                for j in 0..=i {
                    ata[(i, j)] += m[i] * m[j];
                }
                atb[(i, 0)] += m[i] * (q.x - at.x);
                atb[(i, 1)] += m[i] * (q.y - at.y);
            }
        }
        let damping = 0.02 * corners.len() as f64;
        for i in 0..terms {
            ata[(i, i)] += damping - 1.0; // One is there already, for the terms left out.
        }
        if let Some(cholesky) = ata.cholesky() {
            let solution = cholesky.solve(&atb);
            self.bend = (0..terms).map(|i| [solution[(i, 0)], solution[(i, 1)]]).collect();
        }
    }

    /// Where the point of the plane lies in the image; `None` beyond the horizon.
    pub(super) fn at(&self, x: f64, y: f64) -> Option<Pixel> {
        let (u, v) = ((x - self.center[0]) * self.scale, (y - self.center[1]) * self.scale);
        let h = &self.h;
        let w = h[6] * u + h[7] * v + h[8];
        if !(w > 0.02) {
            return None;
        }
        let mut pixel =
            Pixel::new((h[0] * u + h[1] * v + h[2]) / w, (h[3] * u + h[4] * v + h[5]) / w);
        if !self.bend.is_empty() {
            // Outside the known corners (about ±2 normalised) the bend stays what it is at their rim.
            let m = monomials(u.clamp(-2.2, 2.2), v.clamp(-2.2, 2.2));
            for (c, m) in self.bend.iter().zip(m) {
                pixel.x += c[0] * m;
                pixel.y += c[1] * m;
            }
        }
        Some(pixel)
    }

    /// Pixels per square along both axes of the plane: the columns of the Jacobian.
    pub(super) fn axes(&self, x: f64, y: f64) -> Option<[[f64; 2]; 2]> {
        const H: f64 = 0.05;
        let d = |a: Pixel, b: Pixel| [(b.x - a.x) / (2.0 * H), (b.y - a.y) / (2.0 * H)];
        Some([d(self.at(x - H, y)?, self.at(x + H, y)?), d(self.at(x, y - H)?, self.at(x, y + H)?)])
    }
}

/// Length of a vector of pixels: not `hypot`, which guards against overflow at many times the cost.
pub(super) fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_perspective_and_bend() {
        // A projective view of 9 x 7 corners through a lens with 2 % of radial distortion at the rim.
        let truth = |x: f64, y: f64| {
            let w = 1.0 + 0.03 * x - 0.02 * y;
            let (px, py) =
                ((40.0 * x + 3.0 * y + 60.0) / w - 320.0, (-2.0 * x + 38.0 * y + 70.0) / w - 240.0);
            let m = 1.0 + 0.02 * (px * px + py * py) / (400.0 * 400.0);
            Pixel::new(320.0 + m * px, 240.0 + m * py)
        };
        let all: Vec<([f64; 2], Pixel)> = (0..63)
            .map(|i| (f64::from(i % 9), f64::from(i / 9)))
            .map(|(x, y)| ([x, y], truth(x, y)))
            .collect();
        let map = SmoothMap::fit(&all).unwrap();
        let worst =
            all.iter().map(|(p, q)| map.at(p[0], p[1]).unwrap().distance(*q)).fold(0.0, f64::max);
        assert!(worst < 0.3, "{worst} px");
        // Four corners: exact.
        let four: Vec<_> = [0, 4, 58, 62].map(|i| all[i]).to_vec();
        let map = SmoothMap::fit(&four).unwrap();
        assert!(four.iter().all(|(p, q)| map.at(p[0], p[1]).unwrap().distance(*q) < 1e-6));
        assert!(SmoothMap::fit(&all[..9]).is_none(), "a single row does not span the plane");
    }
}
