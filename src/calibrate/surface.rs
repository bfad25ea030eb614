//! The board as it is: not quite flat, not quite as printed.

use super::{BoardSurface, Estimate, SurfaceKind};
use crate::{
    board::CharucoBoard,
    camera::Real,
    geom::{Board, Matrix3, Point, Pose, Rotation, Vector3},
    math,
    solve::{DenseCholesky, Mixture},
};

/// How flat a board is taken to be before anything was seen: the σ of heights as a share of the board's longer side.
/// Paper, card and foam board bend by about that (the paper's board: 0.8 mm on 209 mm); glass is flatter, and then the
/// corners say so.
const SIGMA_SHARE: f64 = 0.005;

/// Over how many knots the height of a free surface is alike beforehand; each corner of a board of some ten by ten
/// squares is a knot. Paper glued onto card ripples with about twice that from crest to crest.
const SMOOTH_KNOTS: f64 = 2.0;

/// The correlation of the heights of two places so far apart, beforehand, where knots lie `pitch_m` apart: of Matérn's
/// form with ν = 3/2.
pub(crate) fn alike(apart_m: f64, pitch_m: f64) -> f64 {
    let d = 3.0_f64.sqrt() * apart_m / (SMOOTH_KNOTS * pitch_m);
    (1.0 + d) * math::exp(-d)
}

/// How far a print may be stretched and sheared: printers are good to a tenth of a percent.
const PRINT_SIGMA: f64 = 1e-3;

/// A free surface has a height for each corner of a board with up to so many; on a larger one the corners lie on a
/// surface through the heights of so many knots. A sheet of paper ripples with its size, not with that of its squares.
const MAX_KNOTS: usize = 200;

/// What is taken for known of the board's shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Surface {
    Flat,
    /// Two parabolas.
    Bend,
    /// A smooth surface, and a print slightly stretched and sheared.
    Free,
}

impl Surface {
    /// Its numbers among the shared ones.
    pub(super) const fn n_shared(self) -> usize {
        match self {
            Self::Flat => 0,
            Self::Bend | Self::Free => 2,
        }
    }

    pub(super) const fn kind(self) -> SurfaceKind {
        match self {
            Self::Flat => SurfaceKind::Flat,
            Self::Bend => SurfaceKind::Bend,
            Self::Free => SurfaceKind::Free,
        }
    }
}

/// The numbers of a surface: those shared (bend, or stretch and shear), and the heights of all knots, metres (none
/// unless the surface is free).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Form {
    pub(super) shared: Vec<f64>,
    pub(super) knots_m: Vec<f64>,
}

/// A board, and what is known of its shape beforehand.
#[derive(Clone, Debug)]
pub(super) struct Sheet {
    center: [f64; 2],
    half: [f64; 2],
    sigma_m: f64,
    /// The inverse covariance of the knots' heights, row-major.
    precision: Vec<f64>,
    /// How the heights of the corners follow from those of the knots; `None` where corners are knots.
    mixture: Option<Mixture>,
    corners: Vec<Vector3<f64>>,
    knots: Vec<Vector3<f64>>,
}

impl Sheet {
    /// The heights of a free surface's knots are a Gaussian process beforehand: σ as above, correlation of Matérn's
    /// form with ν = 3/2 (once differentiable), (1 + d)·exp(−d), d = √3·distance/length. Between knots the surface is
    /// that of cubic convolution (Keys 1981).
    pub(super) fn new(board: &CharucoBoard) -> Self {
        Self::on_knots(board, MAX_KNOTS)
    }

    fn on_knots(board: &CharucoBoard, max_knots: usize) -> Self {
        let flat = Self::flat(board);
        let n_corners = board.n_corners();
        let corners: Vec<Vector3<f64>> = (0..n_corners).map(|id| board.corner(id).coords).collect();
        let [columns, rows] = [board.squares_x, board.squares_y].map(|n| n - 1);
        let (mixture, knots, pitch_m) = if n_corners <= max_knots {
            (None, corners.clone(), board.square_m)
        } else {
            let [across, down] = knots_along([columns, rows], max_knots);
            let [dx, dy] = [across.pitch(), down.pitch()].map(|pitch| pitch * board.square_m);
            let knots = (0..across.n_knots * down.n_knots).map(|at| {
                let (i, j) = (at % across.n_knots, at / across.n_knots);
                corners[0] + Vector3::new(i as f64 * dx, j as f64 * dy, 0.0)
            });
            let shares = (0..n_corners).map(|id| {
                let (column, row) = board.corner_cell(id);
                let by_row = down.shares(row);
                let of_row = |(j, b): (usize, f64)| {
                    across.shares(column).into_iter().map(move |(i, a)| (i, j, a * b))
                };
                let shares = by_row.into_iter().flat_map(of_row);
                shares.map(|(i, j, share)| (j * across.n_knots + i, share)).collect()
            });
            let n_parameters = across.n_knots * down.n_knots;
            let mixture = Mixture { shares: shares.collect(), n_parameters };
            (Some(mixture), knots.collect(), (dx * dy).sqrt())
        };
        let n = knots.len();
        let covariance = (0..n * n)
            .map(|at| {
                let apart_m = (knots[at / n] - knots[at % n]).norm();
                flat.sigma_m * flat.sigma_m * alike(apart_m, pitch_m)
            })
            .collect();
        let precision = DenseCholesky::new(covariance, n).map(|factor| factor.inverse());
        Self { precision: precision.unwrap_or_default(), mixture, corners, knots, ..flat }
    }

    /// A board of which no free surface is asked.
    pub(super) fn flat(board: &CharucoBoard) -> Self {
        let half = [board.squares_x, board.squares_y].map(|n| 0.5 * n as f64 * board.square_m);
        let sigma_m = SIGMA_SHARE * 2.0 * half[0].max(half[1]);
        Self {
            center: half,
            half,
            sigma_m,
            precision: Vec::new(),
            mixture: None,
            corners: Vec::new(),
            knots: Vec::new(),
        }
    }

    /// Was it made for this surface?
    pub(super) fn allows(&self, surface: Surface) -> bool {
        surface != Surface::Free || !self.precision.is_empty()
    }

    /// The inverse covariance of the knots' heights beforehand; empty where the surface has none.
    pub(super) fn knot_precision(&self, surface: Surface) -> &[f64] {
        if surface == Surface::Free { &self.precision } else { &[] }
    }

    /// How many heights are free.
    pub(super) fn n_knots(&self, surface: Surface) -> usize {
        if surface == Surface::Free { self.precision.len().isqrt() } else { 0 }
    }

    /// How the heights of the corners follow from those of the knots, where they are not the same.
    pub(super) fn mixture(&self, surface: Surface) -> Option<&Mixture> {
        self.mixture.as_ref().filter(|_| surface == Surface::Free)
    }

    /// The height of a corner of a free surface, metres; of any other there are no knots, and it is zero.
    #[inline]
    pub(super) fn height_m(&self, id: usize, knots_m: &[f64]) -> f64 {
        match &self.mixture {
            None => knots_m.get(id).copied().unwrap_or(0.0),
            Some(_) if knots_m.is_empty() => 0.0,
            Some(mixture) => mixture.shares[id].iter().map(|(k, share)| share * knots_m[*k]).sum(),
        }
    }

    /// The precision (1/σ²) of each of the shared numbers beforehand.
    pub(super) fn shared_precision(&self, surface: Surface) -> f64 {
        match surface {
            Surface::Flat => 0.0,
            Surface::Bend => 1.0 / (self.sigma_m * self.sigma_m),
            Surface::Free => 1.0 / (PRINT_SIGMA * PRINT_SIGMA),
        }
    }

    /// How a corner at (x, y) of the board moves with each of the shared numbers.
    #[inline(always)]
    pub(super) fn by_shared<T: Real>(&self, surface: Surface, [x, y]: [T; 2]) -> [[T; 3]; 2] {
        let [x, y] = [x + -self.center[0], y + -self.center[1]];
        let zero = x * 0.0;
        match surface {
            Surface::Flat => [[zero; 3]; 2],
            // As mrcal's `calobject_warp`.
            Surface::Bend => {
                let [x, y] = [x * self.half[0].recip(), y * self.half[1].recip()];
                [[zero, zero, x * x * -1.0 + 1.0], [zero, zero, y * y * -1.0 + 1.0]]
            }
            Surface::Free => [[x, y * -1.0, zero], [y, x, zero]],
        }
    }

    /// Where a corner of the flat board really lies, metres.
    #[inline]
    pub(super) fn lifted(
        &self,
        surface: Surface,
        (id, point): (usize, &Vector3<f64>),
        (shared, knots_m): (&[f64], &[f64]),
    ) -> Point<Board> {
        let mut place = *point;
        for (by, number) in self.by_shared(surface, [point.x, point.y]).into_iter().zip(shared) {
            place += Vector3::from(by) * *number;
        }
        place.z += self.height_m(id, knots_m);
        Point::from_coords(place)
    }

    /// The height of all corners by each of the surface's numbers.
    fn by_numbers(&self, surface: Surface) -> Vec<Vec<f64>> {
        let mut columns: Vec<Vec<f64>> = (0..surface.n_shared())
            .map(|k| {
                let by = |corner: &Vector3<f64>| self.by_shared(surface, [corner.x, corner.y])[k];
                self.corners.iter().map(|corner| by(corner)[2]).collect()
            })
            .collect();
        let first = columns.len();
        columns.resize(first + self.n_knots(surface), vec![0.0; self.corners.len()]);
        for id in 0..if surface == Surface::Free { self.corners.len() } else { 0 } {
            match &self.mixture {
                None => columns[first + id][id] = 1.0,
                Some(mixture) => {
                    for &(knot, share) in &mixture.shares[id] {
                        columns[first + knot][id] = share;
                    }
                }
            }
        }
        columns
    }

    /// How the board's own plane (the best one through its corners) moves with each of the surface's numbers, as a step
    /// (ω, τ) of a pose in the board's frame: radians, metres.
    pub(super) fn plane_steps(&self, surface: Surface) -> Vec<[f64; 6]> {
        self.by_numbers(surface)
            .iter()
            .map(|column| {
                let plane = best_plane(&self.corners, column);
                [plane.z, -plane.y, 0.0, 0.0, 0.0, plane.x]
            })
            .collect()
    }

    /// Of the sums of numbers that are the numbers themselves, those of a free surface's knots (the last) become their
    /// heights from the board's own plane.
    pub(super) fn take_planes_out(&self, surface: Surface, numbers: &mut [Vec<f64>]) {
        let n_knots = self.n_knots(surface);
        let first = numbers.len() - n_knots;
        let by_knot = &self.by_numbers(surface)[surface.n_shared()..];
        let planes: Vec<_> = by_knot.iter().map(|by| best_plane(&self.corners, by)).collect();
        for (weights, at) in numbers[first..].iter_mut().zip(&self.knots) {
            for (weight, plane) in weights[first..].iter_mut().zip(&planes) {
                *weight -= plane.x + plane.y * at.x + plane.z * at.y;
            }
        }
    }

    /// The board's own plane (the best one through its corners) in the frame that these numbers count heights from:
    /// its pose beside that of the frame.
    pub(super) fn plane_pose(&self, surface: Surface, form: &Form) -> Pose<Board, Board> {
        let numbers = form.shared.iter().chain(&form.knots_m);
        let mut step = [0.0; 6];
        for (by, number) in self.plane_steps(surface).iter().zip(numbers) {
            step.iter_mut().zip(by).for_each(|(sum, by)| *sum += by * number);
        }
        let [x, y, z] = [step[0], step[1], step[2]];
        let turned = Rotation::from_scaled_axis(Vector3::new(x, y, z));
        Pose::new(turned, Vector3::new(step[3], step[4], step[5]))
    }

    /// The board's shape, from its numbers and the covariance of all free numbers (row-major, the surface's last);
    /// `None` for a flat board.
    pub(super) fn surface(
        &self,
        surface: Surface,
        form: &Form,
        covariance: &[f64],
    ) -> Option<BoardSurface> {
        if surface == Surface::Flat {
            return None;
        }
        let corners = &self.corners;
        // The height of each corner by each number of the surface, the best plane taken out: the poses have it.
        let columns: Vec<Vec<f64>> = self
            .by_numbers(surface)
            .into_iter()
            .map(|column| {
                let plane = best_plane(corners, &column);
                let flat = |p: &Vector3<f64>| plane.x + plane.y * p.x + plane.z * p.y;
                corners.iter().zip(column).map(|(place, height)| height - flat(place)).collect()
            })
            .collect();
        let n_numbers = columns.len();
        let n = covariance.len().isqrt();
        let first = n - n_numbers;
        let numbers: Vec<f64> = form.shared.iter().chain(&form.knots_m).copied().collect();
        let mut heights_m = Vec::with_capacity(corners.len());
        let mut sigmas_m = Vec::with_capacity(corners.len());
        for id in 0..corners.len() {
            heights_m.push(numbers.iter().zip(&columns).map(|(c, column)| c * column[id]).sum());
            let by: Vec<f64> = columns.iter().map(|column| column[id]).collect();
            let mut variance = 0.0;
            for (i, a) in by.iter().enumerate() {
                let row = &covariance[(first + i) * n + first..][..by.len()];
                variance += a * row.iter().zip(&by).map(|(c, b)| c * b).sum::<f64>();
            }
            sigmas_m.push(variance.max(0.0).sqrt());
        }
        let print = (surface == Surface::Free).then(|| {
            [0, 1].map(|i| Estimate {
                value: form.shared[i],
                sigma: covariance[(first + i) * n + first + i].max(0.0).sqrt(),
            })
        });
        Some(BoardSurface { kind: surface.kind(), heights_m, sigmas_m, print })
    }
}

/// Knots along one side of a board, spread evenly from its first corner to its last.
#[derive(Clone, Copy, Debug)]
struct Along {
    n_corners: usize,
    n_knots: usize,
}

/// As many knots as there may be, alike apart along both sides as far as their numbers allow: at least four along each.
fn knots_along(n_corners: [usize; 2], max_knots: usize) -> [Along; 2] {
    let spread = |pitch: f64| {
        n_corners.map(|n_corners| {
            let n_knots = ((n_corners - 1) as f64 / pitch) as usize + 1;
            Along { n_corners, n_knots: n_knots.max(n_corners.min(4)) }
        })
    };
    let mut pitch = 1.0;
    while spread(pitch).iter().map(|along| along.n_knots).product::<usize>() > max_knots {
        pitch *= 1.01;
    }
    spread(pitch)
}

impl Along {
    /// From knot to knot, in squares.
    fn pitch(self) -> f64 {
        (self.n_corners - 1) as f64 / (self.n_knots - 1) as f64
    }

    /// The knots that the height of a corner follows from, and how much each of them: Keys' cubic convolution with a =
    /// −½, beyond the border the straight line through the last two.
    fn shares(self, corner: usize) -> Vec<(usize, f64)> {
        let at = corner as f64 / self.pitch();
        let inside = (at.floor() as usize).min(self.n_knots - 2);
        let t = at - inside as f64;
        let kernel = [
            ((-0.5 * t + 1.0) * t - 0.5) * t,
            (1.5 * t - 2.5) * t * t + 1.0,
            ((-1.5 * t + 2.0) * t + 0.5) * t,
            (0.5 * t - 0.5) * t * t,
        ];
        let mut shares = vec![0.0; self.n_knots];
        for (k, share) in kernel.into_iter().enumerate() {
            match inside + k {
                0 => {
                    shares[0] += 2.0 * share;
                    shares[1] -= share;
                }
                beyond if beyond > self.n_knots => {
                    shares[self.n_knots - 1] += 2.0 * share;
                    shares[self.n_knots - 2] -= share;
                }
                knot => shares[knot - 1] += share,
            }
        }
        shares.into_iter().enumerate().filter(|(_, share)| share.abs() > 1e-12).collect()
    }
}

/// The plane z = p.x + p.y·x + p.z·y nearest to these heights.
pub(super) fn best_plane(places: &[Vector3<f64>], heights: &[f64]) -> Vector3<f64> {
    let (mut ata, mut atb) = (Matrix3::zeros(), Vector3::zeros());
    for (place, height) in places.iter().zip(heights) {
        let row = Vector3::new(1.0, place.x, place.y);
        ata += row * row.transpose();
        atb += row * *height;
    }
    ata.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * atb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        calibrate::{
            Input,
            fit::{Data, Start, Wanted, fit},
            model::{Aspect, Center, Shape, Warp},
            problem::Measured,
            synthetic::{self, FACTORY, Scene},
            views::{all_usable, pictures},
        },
        camera::Distortion,
        pose::Weighting,
        solve::{Loss, rms},
    };

    /// A plane through the knots is a plane through the corners; a smooth surface is met between them.
    #[test]
    fn knots_carry_smooth_surfaces() {
        for (text, n_knots) in [("20x15:14mm:7mm:4X4_250", 192), ("40x30:7mm:3.5mm:6X6_1000", 192)]
        {
            let board: CharucoBoard = text.parse().unwrap();
            let sheet = Sheet::new(&board);
            assert_eq!(sheet.n_knots(Surface::Free), n_knots);
            let [across, down] = knots_along([board.squares_x - 1, board.squares_y - 1], MAX_KNOTS);
            let pitch = [across, down].map(|along| along.pitch() * board.square_m);
            let at_knots = |form: fn(f64, f64) -> f64| -> Vec<f64> {
                let place = |k: usize| [k % across.n_knots, k / across.n_knots];
                let place = |k| std::array::from_fn(|i| place(k)[i] as f64 * pitch[i]);
                (0..n_knots).map(place).map(|[x, y]: [f64; 2]| form(x, y)).collect()
            };
            let worst = |form: fn(f64, f64) -> f64| {
                let knots_m = at_knots(form);
                let origin = board.corner(0).coords;
                (0..board.n_corners())
                    .map(|id| {
                        let place = board.corner(id).coords - origin;
                        (sheet.height_m(id, &knots_m) - form(place.x, place.y)).abs()
                    })
                    .fold(0.0, f64::max)
            };
            assert!(worst(|x, y| 1e-3 + 0.02 * x - 0.01 * y) < 1e-12, "{text}");
            // Half a millimetre, 120 mm from crest to crest; at the border the second derivative is not known.
            let ripple = |x: f64, y: f64| 2.5e-4 * ((52.0 * x).sin() + (52.0 * y).cos());
            assert!(worst(ripple) < 6e-5, "{text}: {}", worst(ripple));
        }
    }

    /// The paper's board with fewer knots than corners: the same calibration to well below its σ.
    #[test]
    fn fewer_knots_say_the_same() {
        let board = synthetic::board();
        let scene = Scene { wave_m: 5e-4, noise_px: 0.1, ..Scene::new(Distortion::None) };
        let frames = scene.frames(5);
        let input = Input { board: &board, factory: &FACTORY, tables: None, frames: &frames };
        let gathered = all_usable(&input, 6, Weighting::Equal);
        let views: Vec<&Measured> = gathered.views.iter().collect();
        let poses: Vec<_> = gathered.views.iter().map(|v| v.pose).collect();
        let (center, aspect, surface) = (Center::Free, Aspect::Fixed, Surface::Free);
        let shape = Shape { center, warp: Warp::None, aspect, surface };
        let [all, few] = [MAX_KNOTS, 40].map(|max_knots| {
            let sheet = Sheet::on_knots(&board, max_knots);
            let data = Data {
                factory: &FACTORY,
                views: &views,
                pictures: &pictures(&views, 640),
                loss: Loss::Squared,
                sheet: &sheet,
                cost_tolerance: 1e-12,
                wanted: Wanted::Everything,
            };
            let free = shape.start(&FACTORY);
            let fit =
                fit(shape, &data, Start { free: &free, knots_m: &[], poses: &poses }).unwrap();
            let covariance = fit.covariance.as_ref().unwrap();
            let found = sheet.surface(surface, &fit.form(&shape), covariance).unwrap();
            (fit.knots_m.len(), fit.focal_px(), found)
        });
        assert_eq!((all.0, few.0), (63, 35));
        let focal = (all.1.value - few.1.value) / all.1.sigma;
        assert!(focal.abs() < 0.2, "{focal}");
        assert!((few.1.sigma / all.1.sigma - 1.0).abs() < 0.1, "{:?} {:?}", all.1, few.1);
        let off: Vec<f64> = (0..board.n_corners())
            .map(|id| (all.2.heights_m[id] - few.2.heights_m[id]) / all.2.sigmas_m[id])
            .collect();
        assert!(rms(&off) < 0.5, "{}", rms(&off));
    }
}
