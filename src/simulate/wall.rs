//! What is round the sheet.

use crate::math;

use super::random::{Random, Subject, mixed};

/// The wall the sheet is taped to. Positions are metres in the plane of the board.
#[derive(Clone, Debug, PartialEq)]
pub enum Wall {
    /// Of one colour, without end.
    Plain {
        /// 0 to 1.
        reflectance: f64,
    },
    /// An office wall: rough paint, tape, a framed whiteboard with scribbles on one side.
    Office(Office),
}

/// The things on an office wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Office {
    seed: u64,
    /// The board's own rectangle, which nothing covers: its width and height.
    board_m: [f64; 2],
    /// Inner side of the whiteboard's frame: a point on it, and the unit normal that points into the whiteboard.
    frame: Line,
    tapes: Vec<Tape>,
    strokes: Vec<Stroke>,
}

/// A straight line of ink, from one point to another.
type Stroke = [[f64; 2]; 2];

#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    point: [f64; 2],
    normal: [f64; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Tape {
    center: [f64; 2],
    along: [f64; 2],
    half_m: [f64; 2],
    gain: f64,
}

/// Width of the whiteboard's frame, metres.
const FRAME_M: f64 = 0.016;
/// How far frame and whiteboard stand out from the wall, metres.
const FRAME_PROUD_M: f64 = 0.012;
/// Half the width of a stroke, metres.
const PEN_M: f64 = 1.0e-3;
/// Reflectance of the wall.
const PAINT: f64 = 0.74;
/// The sheet stands off the wall by this much, metres.
const GAP_M: f64 = 0.5e-3;

impl Wall {
    /// An office wall round a board of this width and height, metres; `seed` chooses what is where.
    pub fn office(seed: u64, board_m: [f64; 2]) -> Self {
        let mut random = Random::new(seed, Subject::Wall, 0);
        let [width, height] = board_m;
        // Left or right of the sheet, nearly upright.
        let side = if random.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let tilt = random.between(-0.06, 0.06);
        let distance = random.between(0.05, 0.075);
        let x = if side < 0.0 { -distance } else { width + distance };
        let normal = [side * math::cos(tilt), side * math::sin(tilt)];
        let frame = Line { point: [x, height / 2.0], normal };
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        let tapes = corners
            .into_iter()
            .map(|[x, y]| {
                let out = |u: f64, size: f64| if u > 0.0 { size } else { 0.0 } + (u - size / 2.0).signum() * 0.02;
                let angle = random.between(0.0, std::f64::consts::PI);
                Tape {
                    center: [
                        out(x, width) + random.between(-0.006, 0.006),
                        out(y, height) + random.between(-0.006, 0.006),
                    ],
                    along: [math::cos(angle), math::sin(angle)],
                    half_m: [random.between(0.012, 0.028), random.between(0.006, 0.0095)],
                    gain: random.between(0.93, 1.05),
                }
            })
            .collect();
        let mut strokes = Vec::new();
        for _ in 0..3 {
            let mut at =
                [x + side * random.between(FRAME_M + 0.02, 0.14), random.between(0.0, height)];
            for _ in 0..12 {
                let next =
                    [at[0] + random.between(-0.02, 0.02), at[1] + random.between(-0.025, 0.025)];
                strokes.push([at, next]);
                at = next;
            }
        }
        Self::Office(Office { seed: mixed(seed), board_m, frame, tapes, strokes })
    }

    /// Reflectance of the bare wall, 0 to 1.
    pub(super) fn reflectance(&self) -> f64 {
        match self {
            Self::Plain { reflectance } => *reflectance,
            Self::Office(_) => PAINT,
        }
    }

    /// How far behind the board's plane the wall is here, metres.
    pub(super) fn depth_behind_m(&self, at: [f64; 2]) -> f64 {
        match self {
            Self::Plain { .. } => 0.0,
            Self::Office(office) if office.beyond_frame(at) > 0.0 => GAP_M - FRAME_PROUD_M,
            Self::Office(_) => GAP_M,
        }
    }

    /// Distance to the edge of what stands out from the wall, metres.
    pub(super) fn edge_distance_m(&self, at: [f64; 2]) -> f64 {
        match self {
            Self::Plain { .. } => f64::INFINITY,
            Self::Office(office) => office.beyond_frame(at).abs(),
        }
    }

    /// By how much the things on the wall change what is seen here; `pixel_m` is the size of a pixel on the wall. The
    /// board itself is never covered.
    pub(super) fn change(&self, at: [f64; 2], pixel_m: f64) -> f64 {
        match self {
            Self::Plain { .. } => 1.0,
            Self::Office(office) => office.change(at, pixel_m),
        }
    }
}

impl Office {
    /// Distance beyond the frame's inner side, metres; negative on the wall.
    fn beyond_frame(&self, [x, y]: [f64; 2]) -> f64 {
        let Line { point, normal } = self.frame;
        (x - point[0]) * normal[0] + (y - point[1]) * normal[1]
    }

    fn change(&self, at: [f64; 2], pixel_m: f64) -> f64 {
        // Tape and the like keep off the board by a few millimetres.
        const CLEAR_M: f64 = 3e-3;
        let outside = |u: f64, size: f64| (-u).max(u - size);
        let [width, height] = self.board_m;
        if outside(at[0], width).max(outside(at[1], height)) < CLEAR_M {
            return 1.0;
        }
        // 1 inside, 0 outside, a slope of one pixel between.
        let cover = |distance: f64| (0.5 - distance / pixel_m).clamp(0.0, 1.0);
        let mut change = 1.0;
        for tape in &self.tapes {
            let d = [at[0] - tape.center[0], at[1] - tape.center[1]];
            let along = (d[0] * tape.along[0] + d[1] * tape.along[1]).abs() - tape.half_m[0];
            let across = (d[1] * tape.along[0] - d[0] * tape.along[1]).abs() - tape.half_m[1];
            change *= 1.0 + (tape.gain - 1.0) * cover(along.max(across));
        }
        let beyond = self.beyond_frame(at);
        if beyond > -FRAME_M {
            // From the wall inwards: a shadow, aluminium, a dark groove, the whiteboard.
            let shadow = 1.0 - 0.45 * (1.0 - (-beyond / FRAME_M).clamp(0.0, 1.0));
            let profile = |u: f64| match u {
                u if u < 0.10 => 0.08,
                u if u < 0.45 => 0.45 + 0.9 * (u - 0.10),
                u if u < 0.55 => 0.95,
                u if u < 0.85 => 0.60,
                _ => 0.12,
            };
            let whiteboard = 1.18;
            let u = beyond / FRAME_M;
            let on_frame = if (0.0..1.0).contains(&u) { profile(u) } else { whiteboard };
            let frame = cover(-beyond);
            change *= shadow * (1.0 - frame) + on_frame * frame;
            if u > 1.0 {
                let near2 = |stroke: &Stroke| squared_distance(*stroke, at);
                let ink = self.strokes.iter().map(near2).fold(f64::INFINITY, f64::min).sqrt();
                change *= 1.0 - 0.6 * cover(ink - PEN_M);
            }
        }
        if beyond < 0.0 {
            // Rough paint, two octaves; finer than a pixel it averages out.
            for (size_m, amplitude) in [(4e-3, 0.012), (25e-3, 0.02)] {
                let visible = (size_m / (2.0 * pixel_m)).min(1.0);
                change *= 1.0 + amplitude * visible * self.rough(at, size_m);
            }
        }
        change
    }

    /// Values between −1 and 1 at the knots of a grid, interpolated.
    fn rough(&self, [x, y]: [f64; 2], size_m: f64) -> f64 {
        let (u, v) = (x / size_m, y / size_m);
        let (i, j) = (u.floor(), v.floor());
        let knot = |i: f64, j: f64| {
            let word = self.seed ^ (i as i64 as u64) << 32 ^ (j as i64 as u64 & 0xffff_ffff);
            (mixed(word ^ size_m.to_bits()) >> 40) as f64 / f64::from(1 << 23) - 1.0
        };
        let (fu, fv) = (u - i, v - j);
        (knot(i, j) * (1.0 - fu) + knot(i + 1.0, j) * fu) * (1.0 - fv)
            + (knot(i, j + 1.0) * (1.0 - fu) + knot(i + 1.0, j + 1.0) * fu) * fv
    }
}

/// Squared distance of a point to a stroke.
fn squared_distance([from, to]: Stroke, at: [f64; 2]) -> f64 {
    let (d, p) = ([to[0] - from[0], to[1] - from[1]], [at[0] - from[0], at[1] - from[1]]);
    let length2 = d[0] * d[0] + d[1] * d[1];
    let t =
        if length2 > 0.0 { ((p[0] * d[0] + p[1] * d[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let (x, y) = (p[0] - t * d[0], p[1] - t * d[1]);
    x * x + y * y
}
