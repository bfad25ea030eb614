//! Reprojection as a bordered least-squares problem: intrinsics shared, one pose per view.
//!
//! Eight corners go through the projection and into the normal equations side by side.

use std::borrow::Cow;

use fearless_simd::{Level, Simd, dispatch, f64x8, prelude::*};

use super::{
    model::{Aspect, Center, Shape, Warp, brown},
    surface::{Sheet, Surface},
};
use crate::{
    camera::{Brown, Intrinsics, RadialTable},
    detect::Corner,
    geom::{Board, Color, Matrix3, Pixel, Pose, Vector3},
    math, pose,
    solve::{BlockNormal, Bordered, LANES, Loss, MAX_PARAMETERS, NormalParts, Rows, Sums, sum},
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

pub(super) struct Reprojection<'a> {
    pub(super) shape: Shape<'a>,
    pub(super) factory: &'a Intrinsics,
    pub(super) views: &'a [&'a Measured],
    pub(super) loss: Loss,
    pub(super) sheet: &'a Sheet,
}

/// Eight pixels and their derivatives by the points.
struct Drawn<I: Simd> {
    pixel: [f64x8<I>; 2],
    by_point: [[f64x8<I>; 3]; 2],
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
    /// And the table of which a free share it is, where it is.
    Table(Cow<'a, RadialTable>, Option<&'a RadialTable>),
    Brown {
        lens: Brown,
        first_dip: f64,
    },
}

impl<'a> Reprojection<'a> {
    fn ready(&self, shared: &[f64]) -> Ready<'a> {
        let numbers = self.shape.warp_numbers(shared);
        let lens = match self.shape.warp {
            Warp::None => ReadyLens::None,
            Warp::Table(table) => ReadyLens::Table(Cow::Borrowed(table), None),
            Warp::FreeTable(whole) => {
                ReadyLens::Table(Cow::Owned(whole.scaled(numbers[0])), Some(whole))
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
    /// Where points of the camera's frame are drawn; `None` where one is behind the camera or outside the lens' domain.
    /// The derivatives by the camera's free numbers are written to `by_shared`.
    #[inline(always)]
    fn project<I: Simd>(
        &self,
        simd: I,
        [x, y, z]: [f64x8<I>; 3],
        by_shared: &mut [&mut [f64x8<I>]; 2],
    ) -> Option<Drawn<I>> {
        if !z.simd_gt(0.0).all_true() {
            return None;
        }
        let Intrinsics { fx, fy, cx, cy, .. } = self.pinhole;
        let splat = |number: f64| f64x8::splat(simd, number);
        let zero = splat(0.0);
        let inverse_z = splat(1.0) / z;
        let [u, v] = [x * inverse_z, y * inverse_z];
        // Derivatives by the ray, and those by focal length and centre.
        let (pixel, [[a, b], [c, d]]) = match &self.lens {
            ReadyLens::None => {
                self.by_pinhole(by_shared, [u, v], [[splat(1.0), zero], [zero, splat(1.0)]]);
                ([u * fx + cx, v * fy + cy], [[splat(fx), zero], [zero, splat(fy)]])
            }
            ReadyLens::Table(table, whole) => {
                let [straight_x, straight_y] = [u * fx + cx, v * fy + cy];
                let (mut pixel, mut j) = ([[0.0; LANES]; 2], [[[0.0; LANES]; 2]; 2]);
                for lane in 0..LANES {
                    let straight = Pixel::new(straight_x[lane], straight_y[lane]);
                    let (bent, [[a, b], [c, d]]) = table.invert_with_jacobian(straight)?;
                    (pixel[0][lane], pixel[1][lane]) = (bent.x, bent.y);
                    (j[0][0][lane], j[0][1][lane]) = (a, b);
                    (j[1][0][lane], j[1][1][lane]) = (c, d);
                }
                if let Some(whole) = whole {
                    // straight = c + (1 + a·m(r))·(pixel − c) held fixed: J⁻¹·dpixel = −m(r)·(pixel − c)·da.
                    let mut by_amplitude = [[0.0; LANES]; 2];
                    for lane in 0..LANES {
                        let [x, y] = Pixel::new(pixel[0][lane], pixel[1][lane]) - whole.center;
                        let m = whole.magnification_at(math::hypot(x, y));
                        for axis in 0..2 {
                            let [a, b] = j[axis];
                            by_amplitude[axis][lane] = -m * (a[lane] * x + b[lane] * y);
                        }
                    }
                    for axis in 0..2 {
                        by_shared[axis][3] = f64x8::simd_from(simd, by_amplitude[axis]);
                    }
                }
                let load = |numbers: [f64; LANES]| f64x8::simd_from(simd, numbers);
                let [a, b] = [load(j[0][0]), load(j[0][1])];
                let [c, d] = [load(j[1][0]), load(j[1][1])];
                self.by_pinhole(by_shared, [u, v], [[a, b], [c, d]]);
                ([load(pixel[0]), load(pixel[1])], [[a * fx, b * fy], [c * fx, d * fy]])
            }
            ReadyLens::Brown { lens: brown, first_dip } => {
                let [[a, b], [c, d]] = brown.by_ray([u, v]);
                let s = u * u + v * v;
                // As in `Brown`; NaN is beyond everything.
                let valid = brown.radial_slope(s).simd_gt(0.0)
                    & s.simd_le(*first_dip)
                    & a.simd_gt(0.0)
                    & (a * d - b * c).simd_gt(0.0);
                if !valid.all_true() {
                    return None;
                }
                let [x, y] = brown.polynomial([u, v]);
                self.by_pinhole(by_shared, [x, y], [[splat(1.0), zero], [zero, splat(1.0)]]);
                let [k_x, k_y] = Brown::by_parameters([u, v]);
                for i in 0..self.n_warp {
                    by_shared[0][3 + i] = k_x[i] * fx;
                    by_shared[1][3 + i] = k_y[i] * fy;
                }
                ([x * fx + cx, y * fy + cy], [[a * fx, b * fx], [c * fy, d * fy]])
            }
        };
        let by_point = [
            [a * inverse_z, b * inverse_z, -(a * u + b * v) * inverse_z],
            [c * inverse_z, d * inverse_z, -(c * u + d * v) * inverse_z],
        ];
        Some(Drawn { pixel, by_point })
    }

    /// Derivatives by focal length and centre of (fx·x + cx, fy·y + cy), followed by a map with this Jacobian.
    #[inline(always)]
    fn by_pinhole<I: Simd>(
        &self,
        by_shared: &mut [&mut [f64x8<I>]; 2],
        [x, y]: [f64x8<I>; 2],
        [[a, b], [c, d]]: [[f64x8<I>; 2]; 2],
    ) {
        if let Some(at) = self.aspect_at {
            by_shared[0][at] = b * y * self.pinhole.fx;
            by_shared[1][at] = d * y * self.pinhole.fx;
        }
        let y = y * self.aspect;
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

/// How far a view may turn (radians) and shift (metres) while the rows of its image are read, at the most: a hand leads
/// a camera by a quarter of a radian and some centimetres a second, and reading takes up to some ten milliseconds.
pub(super) const MOTION_SIGMA: [f64; 6] = [4e-3, 4e-3, 4e-3, 2e-3, 2e-3, 2e-3];

/// Eight points after a rotation.
#[inline(always)]
fn rotated<I: Simd>(m: &Matrix3<f64>, [x, y, z]: [f64x8<I>; 3]) -> [f64x8<I>; 3] {
    [
        x * m[(0, 0)] + y * m[(0, 1)] + z * m[(0, 2)],
        x * m[(1, 0)] + y * m[(1, 1)] + z * m[(1, 2)],
        x * m[(2, 0)] + y * m[(2, 1)] + z * m[(2, 2)],
    ]
}

/// A number of each of up to eight items; lanes beyond the last are that one again.
#[inline(always)]
fn gather<I: Simd, T>(simd: I, items: &[T], number: impl Fn(&T) -> f64) -> f64x8<I> {
    let last = items.len() - 1;
    f64x8::from_fn(
        simd,
        #[inline(always)]
        |lane| number(&items[lane.min(last)]),
    )
}

/// What a view says beside its normal equations.
struct ViewSums {
    /// Half the (robust) sum of squares.
    half_rho: f64,
    /// For each corner, where heights are free, by its height: the other parameters' products, its own, and the
    /// right-hand side.
    by_height: Vec<f64>,
}

/// How many numbers a pose has.
const POSE: usize = 6;

impl Reprojection<'_> {
    /// Adds all residuals of a view. Its own parameters are its pose, and where there are twice as many by how much
    /// this changes from the first row to the last.
    fn add_view<const B: usize>(
        &self,
        index: usize,
        (shared, knots_m): (&[f64], &[f64]),
        pose: &Pose<Color, Board>,
        normal: &mut BlockNormal<B>,
    ) -> bool {
        if !(shared[0] > 0.0) {
            return false;
        }
        let view = ReadyView {
            ready: self.ready(shared),
            view: self.views[index],
            surface: self.shape.surface,
            surface_numbers: self.shape.surface_numbers(shared),
            knots_m,
            sheet: self.sheet,
            loss: self.loss,
            per_row: (self.factory.height as f64).recip(),
            n_own: B,
            n_shared: shared.len(),
        };
        let Some(sums) = view.add(pose, &mut normal.parts()) else { return false };
        normal.add_cost(sums.half_rho);
        let corners = &self.views[index].corners;
        if !knots_m.is_empty() {
            normal.reserve_loose(corners.len());
        }
        for (corner, numbers) in corners.iter().zip(sums.by_height.chunks(B + shared.len() + 2)) {
            let by_block = std::array::from_fn(|i| numbers[i]);
            let (by_shared, own) = numbers[B..].split_at(shared.len());
            normal.push_loose(corner.id, (by_shared, by_block), (own[0], own[1]));
        }
        if let Some(mixture) = self.sheet.mixture(self.shape.surface) {
            normal.mix_loose(mixture);
        }
        true
    }

    /// The normal equations of a view that moves while its rows are read: its pose, and by how much it turns and shifts
    /// from the first row to the last; `None` outside the problem's domain.
    pub(super) fn moving_view(
        &self,
        index: usize,
        numbers: (&[f64], &[f64]),
        pose: &Pose<Color, Board>,
    ) -> Option<BlockNormal<12>> {
        let mut normal = BlockNormal::zero(numbers.0.len());
        self.add_view(index, numbers, pose, &mut normal).then_some(normal)
    }
}

/// A view and all that its residuals depend on but its pose. Nothing in here depends on the number of parameters when
/// compiled: there is one copy for each width of vectors.
struct ReadyView<'a> {
    ready: Ready<'a>,
    view: &'a Measured,
    surface: Surface,
    surface_numbers: &'a [f64],
    knots_m: &'a [f64],
    sheet: &'a Sheet,
    loss: Loss,
    /// 1/height of the image.
    per_row: f64,
    n_own: usize,
    n_shared: usize,
}

impl ReadyView<'_> {
    /// Adds to normal equations; `None`, and nothing added, outside the problem's domain.
    fn add(&self, pose: &Pose<Color, Board>, normal: &mut NormalParts<'_>) -> Option<ViewSums> {
        dispatch!(Level::new(), simd => self.add_lanes(simd, pose, normal))
    }

    #[inline(always)]
    fn add_lanes<I: Simd>(
        &self,
        simd: I,
        pose: &Pose<Color, Board>,
        normal: &mut NormalParts<'_>,
    ) -> Option<ViewSums> {
        let Self { ready, view, knots_m, sheet, .. } = self;
        let m = pose.rotation.matrix();
        let n_parameters = self.n_own + self.n_shared;
        let n_camera = self.n_shared - self.surface_numbers.len();
        let mut sums = Sums::zero(simd, n_parameters);
        let zero = f64x8::splat(simd, 0.0);
        let mut cost = zero;
        let mut by_height = Vec::new();
        if !knots_m.is_empty() {
            by_height.reserve(view.corners.len() * (n_parameters + 2));
        }
        let nothing = Rows { weight: zero, residual: zero, derivatives: [zero; MAX_PARAMETERS] };
        let mut rows = [nothing; 2];
        for start in (0..view.corners.len()).step_by(LANES) {
            let n = (view.corners.len() - start).min(LANES);
            let points = &view.points[start..start + n];
            let corners = &view.corners[start..start + n];
            let x = gather(simd, points, |p| p.x);
            let y = gather(simd, points, |p| p.y);
            let mut place = [x, y, gather(simd, points, |p| p.z)];
            let by_surface = sheet.by_shared(self.surface, [x, y]);
            for (by, number) in by_surface.iter().zip(self.surface_numbers) {
                for k in 0..3 {
                    place[k] += by[k] * *number;
                }
            }
            if !knots_m.is_empty() {
                place[2] += gather(simd, corners, |c| sheet.height_m(c.id, knots_m));
            }
            let turned = rotated(m, place);
            let t = &pose.translation;
            let [tx, ty, tz] = turned;
            let mut by_shared =
                rows.each_mut().map(|row| &mut row.derivatives[self.n_own..n_parameters]);
            let drawn = ready.project(simd, [tx + t.x, ty + t.y, tz + t.z], &mut by_shared)?;
            let seen = [gather(simd, corners, |c| c.pixel.x), gather(simd, corners, |c| c.pixel.y)];
            let weights = &view.weights[start..start + n];
            let given = f64x8::from_fn(simd, |lane| weights.get(lane).copied().unwrap_or(0.0));
            let residual = [seen[0] - drawn.pixel[0], seen[1] - drawn.pixel[1]];
            let square = given * (residual[0] * residual[0] + residual[1] * residual[1]);
            let weight = match self.loss {
                Loss::Squared => {
                    cost += square;
                    given
                }
                loss => {
                    cost += f64x8::from_fn(simd, |lane| loss.rho(square[lane]));
                    given * f64x8::from_fn(simd, |lane| loss.weight(square[lane]))
                }
            };
            let time = (seen[1] + 0.5) * self.per_row - 0.5;
            for (axis, row) in rows.iter_mut().enumerate() {
                let [a, b, c] = drawn.by_point[axis];
                (row.weight, row.residual) = (weight, residual[axis]);
                let by_pose = [ty * c - tz * b, tz * a - tx * c, tx * b - ty * a, a, b, c];
                let (own, shared) = row.derivatives.split_at_mut(self.n_own);
                let (still, moving) = own.split_at_mut(POSE);
                still.copy_from_slice(&by_pose);
                for (by, by_pose) in moving.iter_mut().zip(by_pose) {
                    *by = time * by_pose;
                }
                for (derivative, by) in shared[n_camera..self.n_shared].iter_mut().zip(by_surface) {
                    let [x, y, z] = rotated(m, by);
                    *derivative = a * x + b * y + c * z;
                }
            }
            sums.add(&rows);
            if !knots_m.is_empty() {
                let [[a, b, c], [d, e, f]] = drawn.by_point;
                let [x, y, z] = [m[(0, 2)], m[(1, 2)], m[(2, 2)]];
                let by_itself = [a * x + b * y + c * z, d * x + e * y + f * z];
                let [wa, wb] = [weight * by_itself[0], weight * by_itself[1]];
                let [a, b] = &rows;
                let mut products = [zero; MAX_PARAMETERS + 2];
                for i in 0..n_parameters {
                    products[i] = wa * a.derivatives[i] + wb * b.derivatives[i];
                }
                products[n_parameters] = wa * by_itself[0] + wb * by_itself[1];
                products[n_parameters + 1] = wa * a.residual + wb * b.residual;
                for lane in 0..n {
                    by_height.extend(products[..n_parameters + 2].iter().map(|p| p[lane]));
                }
            }
        }
        sums.add_to(normal);
        Some(ViewSums { half_rho: 0.5 * sum(cost), by_height })
    }
}

impl Bordered<6> for Reprojection<'_> {
    type Block = Pose<Color, Board>;

    fn linearize_block(
        &self,
        index: usize,
        shared: &[f64],
        knots_m: &[f64],
        pose: &Self::Block,
        normal: &mut BlockNormal<6>,
    ) -> bool {
        self.add_view(index, (shared, knots_m), pose, normal)
    }

    fn shared_precision(&self) -> Vec<f64> {
        let mut precision = vec![0.0; self.shape.names().len()];
        let of_surface = self.sheet.shared_precision(self.shape.surface);
        precision.extend(vec![of_surface; self.shape.surface.n_shared()]);
        precision
    }

    fn loose_precision(&self) -> &[f64] {
        self.sheet.knot_precision(self.shape.surface)
    }

    fn advance_block(&self, pose: &Self::Block, step: &[f64; 6]) -> Self::Block {
        pose::advance(pose, step)
    }
}

#[cfg(test)]
#[allow(clippy::needless_range_loop, reason = "rows and columns of a Jacobian read as such")]
mod tests {
    use super::*;
    use crate::geom::Rotation;

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

    /// The pixel of one point, its derivatives by the point, and those by the shared numbers.
    type One<const S: usize> = ([f64; 2], [[f64; 3]; 2], [[f64; S]; 2]);

    fn one<const S: usize>(ready: &Ready<'_>, point: &Vector3<f64>) -> One<S> {
        dispatch!(Level::new(), simd => {
            let lanes = [point.x, point.y, point.z].map(|c| f64x8::splat(simd, c));
            let mut by_shared = [[f64x8::splat(simd, 0.0); S]; 2];
            let [x, y] = &mut by_shared;
            let drawn = ready.project(simd, lanes, &mut [x, y]).unwrap();
            (
                drawn.pixel.map(|p| p[7]),
                drawn.by_point.map(|row| row.map(|d| d[7])),
                by_shared.map(|row| row.map(|d| d[7])),
            )
        })
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
            let (pixel, by_point, by_shared) = one::<S>(&problem.ready(&shared), &point);
            let expected = camera.project(crate::geom::Point::from_coords(point)).unwrap();
            assert!(math::hypot(pixel[0] - expected.x, pixel[1] - expected.y) < 1e-10);
            for k in 0..S {
                let h = 1e-6 * shared[k].abs().max(0.1);
                let [low, high] = [-h, h].map(|h| {
                    let mut moved = shared;
                    moved[k] += h;
                    one::<S>(&problem.ready(&moved), &point).0
                });
                for row in 0..2 {
                    let numeric = (high[row] - low[row]) / (2.0 * h);
                    let analytic = by_shared[row][k];
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
                    one::<S>(&problem.ready(&shared), &moved).0
                });
                for row in 0..2 {
                    let numeric = (high[row] - low[row]) / (2.0 * h);
                    assert!((by_point[row][k] - numeric).abs() < 1e-2, "{shape:?} {k} {row}");
                }
            }
        }
    }
}
