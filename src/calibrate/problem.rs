//! Reprojection as a bordered least-squares problem: intrinsics shared, one pose per view.

use super::{
    model::{Aspect, Center, Shape, Warp, brown},
    surface::Sheet,
};
use crate::{
    camera::{Brown, Intrinsics, RadialTable},
    detect::Corner,
    geom::{Board, Color, Pixel, Pose, Vector3},
    pose,
    solve::{BlockNormal, Bordered, Loss, Row, vectorized},
};

/// One view as the solver sees it.
#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub(super) frame: usize,
    pub(super) corners: Vec<Corner>,
    /// Where each corner lies on the board, metres.
    pub(super) points: Vec<Vector3<f64>>,
    /// The inverse variance of both its coordinates, 1/px².
    pub(super) weights: Vec<f64>,
    /// Where the board stands, as far as known.
    pub(super) pose: Pose<Color, Board>,
}

pub(super) struct Reprojection<'a, const S: usize> {
    pub(super) shape: Shape<'a>,
    pub(super) factory: &'a Intrinsics,
    pub(super) views: &'a [&'a Measured],
    pub(super) loss: Loss,
    pub(super) sheet: &'a Sheet,
}

/// A pixel and its derivatives.
struct Drawn<const S: usize> {
    pixel: [f64; 2],
    by_point: [[f64; 3]; 2],
    by_shared: [[f64; S]; 2],
}

/// The camera of one state, ready to project.
struct Ready<'a> {
    pinhole: Intrinsics,
    aspect: f64,
    /// Where fy/fx stands among the shared numbers, where it is free.
    aspect_at: Option<usize>,
    center: Center,
    n_warp: usize,
    lens: ReadyLens<'a>,
}

enum ReadyLens<'a> {
    None,
    Table(&'a RadialTable),
    FreeTable { scaled: RadialTable, whole: &'a RadialTable },
    Brown { lens: Brown, first_dip: f64 },
}

impl<'a, const S: usize> Reprojection<'a, S> {
    fn ready(&self, shared: &[f64; S]) -> Ready<'a> {
        let numbers = self.shape.warp_numbers(shared);
        let lens = match self.shape.warp {
            Warp::None => ReadyLens::None,
            Warp::Table(table) => ReadyLens::Table(table),
            Warp::FreeTable(whole) => {
                ReadyLens::FreeTable { scaled: whole.scaled(numbers[0]), whole }
            }
            Warp::FreeRadial1 | Warp::FreeRadial2 | Warp::FreeBrown => {
                let lens = brown(numbers);
                ReadyLens::Brown { lens, first_dip: lens.first_dip() }
            }
        };
        Ready {
            pinhole: self.shape.intrinsics(self.factory, shared),
            aspect: self.shape.aspect_ratio(self.factory, shared),
            aspect_at: (self.shape.aspect == Aspect::Free).then(|| self.shape.n_camera(shared) - 1),
            center: self.shape.center,
            n_warp: numbers.len(),
            lens,
        }
    }
}

impl Ready<'_> {
    /// Where a point of the camera's frame is drawn; `None` behind the camera and outside the lens' domain.
    #[inline(always)]
    fn project<const S: usize>(&self, point: &Vector3<f64>) -> Option<Drawn<S>> {
        if !(point.z > 0.0) {
            return None;
        }
        let Intrinsics { fx, fy, cx, cy, .. } = self.pinhole;
        let inverse_z = 1.0 / point.z;
        let [u, v] = [point.x * inverse_z, point.y * inverse_z];
        let mut by_shared = [[0.0; S]; 2];
        // Derivatives by the ray, and those by focal length and centre.
        let (pixel, [[a, b], [c, d]]) = match &self.lens {
            ReadyLens::None => {
                self.by_pinhole(&mut by_shared, [u, v], None);
                ([fx * u + cx, fy * v + cy], [[fx, 0.0], [0.0, fy]])
            }
            ReadyLens::Table(table) => {
                let straight = Pixel::new(fx * u + cx, fy * v + cy);
                let (pixel, j) = table.invert_with_jacobian(straight)?;
                self.by_pinhole(&mut by_shared, [u, v], Some(j));
                let [[a, b], [c, d]] = j;
                ([pixel.x, pixel.y], [[a * fx, b * fy], [c * fx, d * fy]])
            }
            ReadyLens::FreeTable { scaled, whole } => {
                let straight = Pixel::new(fx * u + cx, fy * v + cy);
                let (pixel, j) = scaled.invert_with_jacobian(straight)?;
                self.by_pinhole(&mut by_shared, [u, v], Some(j));
                // straight = c + (1 + a·m(r))·(pixel − c) held fixed: J⁻¹·dpixel = −m(r)·(pixel − c)·da.
                let [[a, b], [c, d]] = j;
                let [x, y] = pixel - whole.center;
                let m = whole.magnification_at(x.hypot(y));
                by_shared[0][3] = -m * (a * x + b * y);
                by_shared[1][3] = -m * (c * x + d * y);
                ([pixel.x, pixel.y], [[a * fx, b * fy], [c * fx, d * fy]])
            }
            ReadyLens::Brown { lens: brown, first_dip } => {
                let distorted @ [x, y] = brown.distort_before(*first_dip, [u, v])?;
                self.by_pinhole(&mut by_shared, distorted, None);
                let [k_x, k_y] = brown.d_distorted_d_parameters([u, v]);
                for (i, (k_x, k_y)) in k_x.into_iter().zip(k_y).take(self.n_warp).enumerate() {
                    by_shared[0][3 + i] = fx * k_x;
                    by_shared[1][3 + i] = fy * k_y;
                }
                let [[a, b], [c, d]] = brown.d_distorted_d_ray([u, v]);
                ([fx * x + cx, fy * y + cy], [[fx * a, fx * b], [fy * c, fy * d]])
            }
        };
        let by_point = [
            [a * inverse_z, b * inverse_z, -(a * u + b * v) * inverse_z],
            [c * inverse_z, d * inverse_z, -(c * u + d * v) * inverse_z],
        ];
        Some(Drawn { pixel, by_point, by_shared })
    }

    /// Derivatives by focal length and centre of (fx·x + cx, fy·y + cy), followed by a map with Jacobian `after`.
    #[inline(always)]
    fn by_pinhole<const S: usize>(
        &self,
        by_shared: &mut [[f64; S]; 2],
        [x, y]: [f64; 2],
        after: Option<[[f64; 2]; 2]>,
    ) {
        let [[a, b], [c, d]] = after.unwrap_or([[1.0, 0.0], [0.0, 1.0]]);
        if let Some(at) = self.aspect_at {
            by_shared[0][at] = b * self.pinhole.fx * y;
            by_shared[1][at] = d * self.pinhole.fx * y;
        }
        let y = self.aspect * y;
        by_shared[0][0] = a * x + b * y;
        by_shared[1][0] = c * x + d * y;
        if self.center == Center::Free {
            by_shared[0][1] = a;
            by_shared[0][2] = b;
            by_shared[1][1] = c;
            by_shared[1][2] = d;
        }
    }
}

/// So many residuals go through the normal equations together, an even number.
const ROWS_AT_ONCE: usize = 8;

/// How far a view may turn (radians) and shift (metres) while the rows of its image are read: a hand leads a camera by
/// a quarter of a radian and some centimetres a second, and reading takes some ten milliseconds.
const MOTION_SIGMA: [f64; 6] = [4e-3, 4e-3, 4e-3, 2e-3, 2e-3, 2e-3];

impl<const S: usize> Reprojection<'_, S> {
    /// Adds all residuals of a view; `own` takes the derivatives by the pose, and the time at which the corner's row is
    /// read (from −½ at the top to ½ at the bottom of the image), to those by the block's parameters.
    fn add_view<const B: usize>(
        &self,
        index: usize,
        numbers: (&[f64; S], &[f64]),
        pose: &Pose<Color, Board>,
        normal: &mut BlockNormal<S, B>,
        own: impl Fn(&[f64; 6], f64) -> [f64; B],
    ) -> bool {
        vectorized(
            #[inline(always)]
            || self.add_corners(index, numbers, pose, normal, own),
        )
    }

    #[inline(always)]
    fn add_corners<const B: usize>(
        &self,
        index: usize,
        (shared, heights_m): (&[f64; S], &[f64]),
        pose: &Pose<Color, Board>,
        normal: &mut BlockNormal<S, B>,
        own: impl Fn(&[f64; 6], f64) -> [f64; B],
    ) -> bool {
        if !(shared[0] > 0.0) {
            return false;
        }
        let ready = self.ready(shared);
        let view = self.views[index];
        let rotation = *pose.rotation.matrix();
        let normal_axis = rotation.column(2).into_owned();
        let surface = self.shape.surface;
        let numbers = self.shape.surface_numbers(shared);
        let first = S - numbers.len();
        let per_row = (self.factory.height as f64).recip();
        if !heights_m.is_empty() {
            normal.reserve_loose(view.corners.len());
        }
        let mut rows = [Row::ZERO; ROWS_AT_ONCE];
        let mut n_rows = 0;
        for (index, corner) in view.corners.iter().enumerate() {
            let point = &view.points[index];
            let place = self.sheet.lifted(surface, (corner.id, point), (numbers, heights_m));
            let turned = rotation * place.coords;
            let Some(drawn) = ready.project::<S>(&(turned + pose.translation)) else {
                return false;
            };
            let residual = [corner.pixel.x - drawn.pixel[0], corner.pixel.y - drawn.pixel[1]];
            let square = view.weights[index] * (residual[0].powi(2) + residual[1].powi(2));
            let weight = view.weights[index] * self.loss.weight(square);
            let time = (corner.pixel.y + 0.5) * per_row - 0.5;
            normal.add_cost(0.5 * self.loss.rho(square));
            for axis in 0..2 {
                let by_point = drawn.by_point[axis];
                let along =
                    |v: &Vector3<f64>| by_point[0] * v.x + by_point[1] * v.y + by_point[2] * v.z;
                let row = &mut rows[n_rows];
                row.weight = weight;
                row.residual = residual[axis];
                row.d_shared = drawn.by_shared[axis];
                if !numbers.is_empty() {
                    let by_surface = self.sheet.by_shared(surface, point);
                    for (derivative, by) in row.d_shared[first..].iter_mut().zip(by_surface) {
                        *derivative = along(&(rotation * by));
                    }
                }
                row.d_block = own(&pose::d_pixel_d_pose(by_point, &turned), time);
                if !heights_m.is_empty() {
                    normal.add_loose(row, (corner.id, along(&normal_axis)));
                }
                n_rows += 1;
            }
            if n_rows == ROWS_AT_ONCE {
                normal.add_rows(&rows);
                n_rows = 0;
            }
        }
        rows[n_rows..].fill(Row::ZERO);
        normal.add_rows(&rows);
        true
    }

    /// The normal equations of a view that moves while its rows are read: its pose, and by how much it turns and shifts
    /// from the first row to the last; `None` outside the problem's domain.
    pub(super) fn moving_view(
        &self,
        index: usize,
        numbers: (&[f64; S], &[f64]),
        pose: &Pose<Color, Board>,
    ) -> Option<BlockNormal<S, 12>> {
        let mut normal = BlockNormal::ZERO;
        let whole = self.add_view(index, numbers, pose, &mut normal, |by_pose, time| {
            std::array::from_fn(|k| if k < 6 { by_pose[k] } else { time * by_pose[k - 6] })
        });
        for (k, sigma) in MOTION_SIGMA.into_iter().enumerate() {
            let mut unit = [0.0; 12];
            unit[6 + k] = 1.0;
            normal.add_row(sigma.powi(-2), 0.0, &[0.0; S], &unit);
        }
        whole.then_some(normal)
    }
}

impl<const S: usize> Bordered<S, 6> for Reprojection<'_, S> {
    type Block = Pose<Color, Board>;

    fn linearize_block(
        &self,
        index: usize,
        shared: &[f64; S],
        heights_m: &[f64],
        pose: &Self::Block,
        normal: &mut BlockNormal<S, 6>,
    ) -> bool {
        self.add_view(index, (shared, heights_m), pose, normal, |by_pose, _| *by_pose)
    }

    fn shared_precision(&self) -> [f64; S] {
        let first = S - self.shape.surface.n_shared();
        let precision = self.sheet.shared_precision(self.shape.surface);
        std::array::from_fn(|i| if i < first { 0.0 } else { precision })
    }

    fn loose_precision(&self) -> &[f64] {
        self.sheet.height_precision(self.shape.surface)
    }

    fn advance_block(&self, pose: &Self::Block, step: &[f64; 6]) -> Self::Block {
        pose::advance(pose, step)
    }
}

#[cfg(test)]
#[allow(clippy::needless_range_loop, reason = "rows and columns of a Jacobian read as such")]
mod tests {
    use super::*;
    use crate::{calibrate::surface::Surface, geom::Rotation};

    #[test]
    fn jacobians_match_differences() {
        let factory =
            Intrinsics { fx: 436.5, fy: 441.25, cx: 321.6, cy: 238.4, width: 640, height: 480 };
        let table = (0..42).map(|i| -0.002 + 0.06 * (f64::from(i) / 41.0).powi(3)).collect();
        let table = RadialTable::new(Pixel::new(324.1, 236.9), 403.0, table).unwrap();
        check(&factory, shape(Center::Fixed, Warp::None), [450.0]);
        check(&factory, shape(Center::Fixed, Warp::Table(&table)), [450.0]);
        check(&factory, shape(Center::Free, Warp::None), [450.0, 318.0, 243.0]);
        check(&factory, shape(Center::Free, Warp::Table(&table)), [450.0, 318.0, 243.0]);
        check(&factory, shape(Center::Free, Warp::FreeTable(&table)), [450.0, 318.0, 243.0, 0.6]);
        check(&factory, shape(Center::Free, Warp::FreeRadial1), [450.0, 318.0, 243.0, 0.07]);
        check(&factory, shape(Center::Free, Warp::FreeRadial2), [450.0, 318.0, 243.0, 0.07, -0.1]);
        let brown = shape(Center::Free, Warp::FreeBrown);
        check(&factory, brown, [450.0, 318.0, 243.0, 0.07, -0.1, 0.001, -0.002, 0.03]);
        let aspect = Shape { aspect: Aspect::Free, ..brown };
        check(&factory, aspect, [450.0, 318.0, 243.0, 0.07, -0.1, 0.001, -0.002, 0.03, 1.02]);
    }

    fn shape(center: Center, warp: Warp<'_>) -> Shape<'_> {
        Shape { center, warp, aspect: Aspect::Fixed, surface: Surface::Flat }
    }

    /// Against differences, and against the camera of the same numbers.
    fn check<const S: usize>(factory: &Intrinsics, shape: Shape<'_>, shared: [f64; S]) {
        assert_eq!(shape.names().len(), S);
        let sheet = Sheet::new(&crate::calibrate::synthetic::board());
        let problem =
            Reprojection { shape, factory, views: &[], loss: Loss::Squared, sheet: &sheet };
        let camera = shape.camera(factory, None, &shared);
        let turn = Rotation::from_scaled_axis(Vector3::new(0.4, -0.3, 0.2));
        for i in 0..40 {
            let board =
                Vector3::new(f64::from(i % 8) * 0.03 - 0.1, f64::from(i / 8) * 0.03 - 0.06, 0.0);
            let point = turn * board + Vector3::new(0.011, 0.007, 0.3);
            let drawn = problem.ready(&shared).project::<S>(&point).unwrap();
            let expected = camera.project(crate::geom::Point::from_coords(point)).unwrap();
            assert!((drawn.pixel[0] - expected.x).hypot(drawn.pixel[1] - expected.y) < 1e-10);
            for k in 0..S {
                let h = 1e-6 * shared[k].abs().max(0.1);
                let [low, high] = [-h, h].map(|h| {
                    let mut moved = shared;
                    moved[k] += h;
                    problem.ready(&moved).project::<S>(&point).unwrap().pixel
                });
                for row in 0..2 {
                    let numeric = (high[row] - low[row]) / (2.0 * h);
                    let analytic = drawn.by_shared[row][k];
                    assert!(
                        (analytic - numeric).abs() < 1e-5 * numeric.abs().max(1.0),
                        "{shape:?} {k} {row}: {analytic} {numeric}"
                    );
                }
            }
            for k in 0..3 {
                let h = 1e-8;
                let [low, high] = [-h, h].map(|h| {
                    let mut moved = point;
                    moved[k] += h;
                    problem.ready(&shared).project::<S>(&moved).unwrap().pixel
                });
                for row in 0..2 {
                    let numeric = (high[row] - low[row]) / (2.0 * h);
                    assert!((drawn.by_point[row][k] - numeric).abs() < 1e-2, "{shape:?} {k} {row}");
                }
            }
        }
    }
}
