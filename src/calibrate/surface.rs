//! The board as it is: not quite flat, not quite as printed.

use super::{BoardSurface, Estimate, SurfaceKind};
use crate::{
    board::CharucoBoard,
    geom::{Board, Matrix3, Point, Vector3},
    solve::DenseCholesky,
};

/// How flat a board is taken to be before anything was seen: the σ of heights as a share of the board's longer side.
/// Paper, card and foam board bend by about that (the paper's board: 0.8 mm on 209 mm); glass is flatter, and then the
/// corners say so.
const SIGMA_SHARE: f64 = 0.005;

/// Over how many squares the height of a free surface is alike beforehand: paper glued onto card ripples with about
/// twice that from crest to crest.
const SMOOTH_SQUARES: f64 = 2.0;

/// How far a print may be stretched and sheared: printers are good to a tenth of a percent.
const PRINT_SIGMA: f64 = 1e-3;

/// A free surface has a height for each corner; beyond so many its equations would take longer than they are worth.
const MAX_FREE_CORNERS: usize = 200;

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

/// The numbers of a surface: those shared (bend, or stretch and shear), and the heights of all corners, metres (none
/// unless the surface is free).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Form {
    pub(super) shared: Vec<f64>,
    pub(super) heights_m: Vec<f64>,
}

/// A board, and what is known of its shape beforehand.
#[derive(Clone, Debug)]
pub(super) struct Sheet {
    center: [f64; 2],
    half: [f64; 2],
    sigma_m: f64,
    /// The inverse covariance of the heights, row-major.
    precision: Vec<f64>,
    corners: Vec<Vector3<f64>>,
}

impl Sheet {
    /// The heights of a free surface are a Gaussian process beforehand: σ as above, correlation of Matérn's form with
    /// ν = 3/2 (once differentiable), (1 + d)·exp(−d), d = √3·distance/length.
    pub(super) fn new(board: &CharucoBoard) -> Self {
        let half = [board.squares_x, board.squares_y].map(|n| 0.5 * n as f64 * board.square_m);
        let sigma_m = SIGMA_SHARE * 2.0 * half[0].max(half[1]);
        let n = board.n_corners();
        let corners: Vec<Vector3<f64>> = (0..n).map(|id| board.corner(id).coords).collect();
        let mut sheet = Self { center: half, half, sigma_m, precision: Vec::new(), corners };
        if n <= MAX_FREE_CORNERS {
            let corners = &sheet.corners;
            let scale = 3.0_f64.sqrt() / (SMOOTH_SQUARES * board.square_m);
            let covariance = (0..n * n)
                .map(|at| {
                    let d = scale * (corners[at / n] - corners[at % n]).norm();
                    sigma_m * sigma_m * (1.0 + d) * (-d).exp()
                })
                .collect();
            if let Some(factor) = DenseCholesky::new(covariance, n) {
                sheet.precision = factor.inverse();
            }
        }
        sheet
    }

    /// A board of which no free surface is asked.
    pub(super) fn flat(board: &CharucoBoard) -> Self {
        let half = [board.squares_x, board.squares_y].map(|n| 0.5 * n as f64 * board.square_m);
        let sigma_m = SIGMA_SHARE * 2.0 * half[0].max(half[1]);
        Self { center: half, half, sigma_m, precision: Vec::new(), corners: Vec::new() }
    }

    /// Is the board small enough for this surface?
    pub(super) fn allows(&self, surface: Surface) -> bool {
        surface != Surface::Free || !self.precision.is_empty()
    }

    /// The inverse covariance of the heights beforehand; empty where the surface has none.
    pub(super) fn height_precision(&self, surface: Surface) -> &[f64] {
        if surface == Surface::Free { &self.precision } else { &[] }
    }

    /// How many heights are free.
    pub(super) fn n_heights(&self, surface: Surface) -> usize {
        if surface == Surface::Free { self.corners.len() } else { 0 }
    }

    /// The precision (1/σ²) of each of the shared numbers beforehand.
    pub(super) fn shared_precision(&self, surface: Surface) -> f64 {
        match surface {
            Surface::Flat => 0.0,
            Surface::Bend => 1.0 / (self.sigma_m * self.sigma_m),
            Surface::Free => 1.0 / (PRINT_SIGMA * PRINT_SIGMA),
        }
    }

    /// How a corner moves with each of the shared numbers.
    #[inline]
    pub(super) fn by_shared(&self, surface: Surface, point: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let [x, y] = [point.x - self.center[0], point.y - self.center[1]];
        match surface {
            Surface::Flat => [Vector3::zeros(); 2],
            // As mrcal's `calobject_warp`.
            Surface::Bend => {
                [x / self.half[0], y / self.half[1]].map(|s| Vector3::new(0.0, 0.0, 1.0 - s * s))
            }
            Surface::Free => [Vector3::new(x, -y, 0.0), Vector3::new(y, x, 0.0)],
        }
    }

    /// Where a corner of the flat board really lies, metres.
    #[inline]
    pub(super) fn lifted(
        &self,
        surface: Surface,
        (id, point): (usize, &Vector3<f64>),
        (shared, heights_m): (&[f64], &[f64]),
    ) -> Point<Board> {
        let mut place = *point;
        for (by, number) in self.by_shared(surface, point).iter().zip(shared) {
            place += by * *number;
        }
        if let Some(height) = heights_m.get(id) {
            place.z += height;
        }
        Point::from_coords(place)
    }

    /// The height of all corners by each of the surface's numbers.
    fn by_numbers(&self, surface: Surface) -> impl Iterator<Item = Vec<f64>> {
        let shared = (0..surface.n_shared()).map(move |k| {
            self.corners.iter().map(|corner| self.by_shared(surface, corner)[k].z).collect()
        });
        let heights = (0..self.n_heights(surface))
            .map(|k| (0..self.corners.len()).map(|id| f64::from(u8::from(k == id))).collect());
        shared.chain(heights)
    }

    /// How the board's own plane (the best one through its corners) moves with each of the surface's numbers, as a step
    /// (ω, τ) of a pose in the board's frame: radians, metres.
    pub(super) fn plane_steps(&self, surface: Surface) -> Vec<[f64; 6]> {
        self.by_numbers(surface)
            .map(|column| {
                let plane = best_plane(&self.corners, &column);
                [plane.z, -plane.y, 0.0, 0.0, 0.0, plane.x]
            })
            .collect()
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
            .map(|column| {
                let plane = best_plane(corners, &column);
                let flat = |p: &Vector3<f64>| plane.x + plane.y * p.x + plane.z * p.y;
                corners.iter().zip(column).map(|(place, height)| height - flat(place)).collect()
            })
            .collect();
        let n_numbers = columns.len();
        let n = covariance.len().isqrt();
        let first = n - n_numbers;
        let numbers: Vec<f64> = form.shared.iter().chain(&form.heights_m).copied().collect();
        let mut heights_m = Vec::with_capacity(corners.len());
        let mut sigmas_m = Vec::with_capacity(corners.len());
        for id in 0..corners.len() {
            heights_m.push(numbers.iter().zip(&columns).map(|(c, column)| c * column[id]).sum());
            let mut variance = 0.0;
            for (i, a) in columns.iter().enumerate() {
                for (j, b) in columns.iter().enumerate() {
                    variance += a[id] * covariance[(first + i) * n + first + j] * b[id];
                }
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

/// The plane z = p.x + p.y·x + p.z·y nearest to these heights.
fn best_plane(places: &[Vector3<f64>], heights: &[f64]) -> Vector3<f64> {
    let (mut ata, mut atb) = (Matrix3::zeros(), Vector3::zeros());
    for (place, height) in places.iter().zip(heights) {
        let row = Vector3::new(1.0, place.x, place.y);
        ata += row * row.transpose();
        atb += row * *height;
    }
    ata.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * atb)
}
