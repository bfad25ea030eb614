//! The pose of least reprojection error.

use nalgebra::Vector3;

use crate::{
    camera::Camera,
    geom::{Board, Color, Pixel, Point, Pose, Rotation},
    par::vectorized,
    solve::{Arrow, BlockNormal, Bordered, BySchur, Effort, Row, minimize},
};

/// A board point, where it was seen, and the weight of both its residuals.
#[derive(Clone, Copy)]
pub(super) struct Sighting {
    pub(super) point: Point<Board>,
    pub(super) pixel: Pixel,
    pub(super) weight: f64,
}

struct Reprojection<'a> {
    camera: &'a Camera,
    sightings: &'a [Sighting],
}

impl Bordered<6> for Reprojection<'_> {
    type Block = Pose<Color, Board>;

    fn linearize_block(
        &self,
        _index: usize,
        _shared: &[f64],
        _loose: &[f64],
        pose: &Self::Block,
        normal: &mut BlockNormal<6>,
    ) -> bool {
        vectorized(
            #[inline(always)]
            || {
                for pair in self.sightings.chunks(2) {
                    let mut rows = [Row::ZERO; 4];
                    for (sighting, rows) in pair.iter().zip(rows.as_chunks_mut::<2>().0) {
                        let turned = pose.rotation * sighting.point.coords;
                        let point: Point<Color> = Point::from_coords(turned + pose.translation);
                        let Some((pixel, by_point)) = self.camera.project_with_jacobian(point)
                        else {
                            return false;
                        };
                        let weight = sighting.weight;
                        let residual = sighting.pixel - pixel;
                        for ((r, d), row) in residual.into_iter().zip(by_point).zip(rows) {
                            let d_block = d_pixel_d_pose(d, &turned);
                            *row = Row { weight, residual: r, d_block };
                            normal.add_cost(0.5 * weight * r * r);
                        }
                    }
                    normal.add_block_rows(&rows);
                }
                true
            },
        )
    }

    fn advance_block(&self, pose: &Self::Block, step: &[f64; 6]) -> Self::Block {
        advance(pose, step)
    }
}

/// The derivative of one pixel coordinate by a step of the pose, from that by the point in the camera's frame;
/// `turned` is the board point after the rotation alone.
///
/// A step (ω, τ) moves the pose to (exp(ω)·R, t + τ): ∂p/∂ω·δ = δ × turned, so that d·(δ × turned) = δ·(turned × d).
#[inline(always)]
pub fn d_pixel_d_pose(by_point: [f64; 3], turned: &Vector3<f64>) -> [f64; 6] {
    let [a, b, c] = by_point;
    [turned.y * c - turned.z * b, turned.z * a - turned.x * c, turned.x * b - turned.y * a, a, b, c]
}

/// The pose after a step (ω, τ): exp(ω)·R, t + τ (radians, metres).
pub fn advance(pose: &Pose<Color, Board>, step: &[f64; 6]) -> Pose<Color, Board> {
    let turn = Rotation::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
    // Products of many small rotations drift off orthonormality by rounding; one step of renormalising undoes it.
    let rotation = turn * pose.rotation;
    let m = rotation.matrix();
    let x = m.column(0).normalize();
    let y = (m.column(1) - x * x.dot(&m.column(1))).normalize();
    let m = nalgebra::Matrix3::from_columns(&[x, y, x.cross(&y)]);
    Pose::new(
        Rotation::from_matrix_unchecked(m),
        pose.translation + Vector3::new(step[3], step[4], step[5]),
    )
}

/// The nearest minimum from `start`, to this share of the sum of squares, and its weighted sum of squares; `None` where
/// `start` does not project.
pub(super) fn refine(
    camera: &Camera,
    sightings: &[Sighting],
    start: Pose<Color, Board>,
    cost_tolerance: f64,
) -> Option<(Pose<Color, Board>, f64)> {
    let problem = Reprojection { camera, sightings };
    let start = Arrow { shared: Vec::new(), loose: Vec::new(), blocks: vec![start] };
    let effort = Effort { cost_tolerance, ..Effort::default() };
    let minimum = minimize(&BySchur(&problem), start, effort)?;
    Some((minimum.state.blocks[0], 2.0 * minimum.cost))
}
