//! Which frames take part.

use super::{Error, FrameCorners, Input, RejectedFrame, Rejection, problem::Measured};
use crate::{
    board::CharucoBoard,
    camera::{Camera, Distortion},
    detect::Corner,
    geom::{Board, Color, Pose, Vector3},
    math,
    pose::{self, View, Weighting},
};

/// Corners a view needs where the paper's rule does not apply: its pose takes three, the rest tells of the camera.
pub(super) const MIN_CORNERS: usize = 6;

/// "Min. number of corners" of the paper's code.
const PAPER_MIN_CORNERS: usize = 9;

/// The paper's position grid, metres.
const PAPER_GRID_M: f64 = 0.04;

/// Views whose common corners lie within this share of the image's width of each other are the same picture.
const SAME_PICTURE_SHARE: f64 = 0.04;

/// Frames that take part, and those that do not.
pub(super) struct Gathered {
    pub(super) views: Vec<Measured>,
    pub(super) rejected: Vec<RejectedFrame>,
}

impl Gathered {
    /// Leaves the views out that are not among these (indices, ascending).
    pub(super) fn keep_only(&mut self, indices: &[usize]) {
        let n_chosen = indices.len();
        for (index, view) in std::mem::take(&mut self.views).into_iter().enumerate() {
            if indices.binary_search(&index).is_ok() {
                self.views.push(view);
            } else {
                let reason = Rejection::NotChosen { n_chosen };
                self.rejected.push(RejectedFrame { frame: view.frame, reason });
            }
        }
    }
}

/// The factory's camera as an ideal pinhole, as the paper takes it.
fn pinhole(input: &Input<'_>) -> Camera {
    Camera { intrinsics: *input.factory, distortion: Distortion::None }
}

/// The paper's selection: frames in the order given, at least 9 corners, camera at least 4 cm from every accepted one.
pub(super) fn as_the_paper(input: &Input<'_>) -> Gathered {
    let camera = pinhole(input);
    let mut views: Vec<Measured> = Vec::new();
    let mut positions: Vec<Vector3<f64>> = Vec::new();
    let mut rejected = Vec::new();
    for FrameCorners { frame, corners } in input.frames {
        let (frame, n_corners) = (*frame, corners.len());
        let mut reject = |reason| rejected.push(RejectedFrame { frame, reason });
        if n_corners < PAPER_MIN_CORNERS {
            reject(Rejection::FewCorners { n_corners, needed: PAPER_MIN_CORNERS });
            continue;
        }
        let view = match View::from_corners(frame, input.board, &camera, corners, Weighting::Equal)
        {
            Ok(view) => view,
            Err(error) => {
                reject(Rejection::NoPose(error));
                continue;
            }
        };
        let position = view.camera_position_m();
        let near = positions
            .iter()
            .zip(&views)
            .map(|(other, accepted)| ((position - other).norm(), accepted.frame))
            .find(|(distance_m, _)| *distance_m < PAPER_GRID_M);
        if let Some((distance_m, accepted)) = near {
            reject(Rejection::NearAccepted { accepted, distance_m });
            continue;
        }
        positions.push(position);
        views.push(measured(input.board, frame, corners.clone(), view.color_from_board));
    }
    Gathered { views, rejected }
}

/// All frames with at least `min_corners` corners that spread in both directions of the board, by frame.
pub(super) fn all_usable(input: &Input<'_>, min_corners: usize, weighting: Weighting) -> Gathered {
    let camera = pinhole(input);
    let mut frames: Vec<&FrameCorners> = input.frames.iter().collect();
    frames.sort_by_key(|f| f.frame);
    let mut views = Vec::new();
    let mut rejected = Vec::new();
    for FrameCorners { frame, corners } in frames {
        let (frame, n_corners) = (*frame, corners.len());
        let mut corners = corners.clone();
        corners.sort_by_key(|c| c.id);
        let fitted = if n_corners < min_corners {
            Err(Rejection::FewCorners { n_corners, needed: min_corners })
        } else if narrow_spread(input.board, &corners) < MIN_SPREAD_SQUARES {
            Err(Rejection::NarrowCorners { n_corners })
        } else {
            pose::start(frame, input.board, &camera, &corners, weighting).map_err(Rejection::NoPose)
        };
        match fitted {
            Ok(pose) => views.push(measured(input.board, frame, corners, pose)),
            Err(reason) => rejected.push(RejectedFrame { frame, reason }),
        }
    }
    Gathered { views, rejected }
}

/// Two full rows of corners have a spread of half a square across.
const MIN_SPREAD_SQUARES: f64 = 0.4;

/// The smaller standard deviation of the corners' places on the board, in squares.
fn narrow_spread(board: &CharucoBoard, corners: &[Corner]) -> f64 {
    let at: Vec<[f64; 2]> = corners
        .iter()
        .map(|c| {
            let (column, row) = board.corner_cell(c.id);
            [column as f64, row as f64]
        })
        .collect();
    let n = at.len() as f64;
    let mean = at.iter().fold([0.0; 2], |m, p| [m[0] + p[0] / n, m[1] + p[1] / n]);
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for p in &at {
        let d = [p[0] - mean[0], p[1] - mean[1]];
        xx += d[0] * d[0] / n;
        xy += d[0] * d[1] / n;
        yy += d[1] * d[1] / n;
    }
    let smaller = 0.5 * (xx + yy - math::hypot(xx - yy, 2.0 * xy));
    smaller.max(0.0).sqrt()
}

fn measured(
    board: &CharucoBoard,
    frame: usize,
    corners: Vec<Corner>,
    pose: Pose<Color, Board>,
) -> Measured {
    let points: Vec<_> = corners.iter().map(|c| board.corner(c.id).coords).collect();
    let weights = vec![1.0; corners.len()];
    Measured { frame, corners, points, weights, pose }
}

/// For each view the number of the picture it is one of: views that show the board in nearly the same place count
/// once, because whatever is wrong in one (a board that is not flat) is wrong in the other the same way.
///
/// Views are taken by falling number of corners (then by where these lie), not by frame, so that the order of the
/// recording does not matter; each joins the nearest leader, or leads a picture of its own.
pub(super) fn pictures(views: &[&Measured], width_px: usize) -> Vec<usize> {
    let corners: Vec<&[Corner]> = views.iter().map(|view| view.corners.as_slice()).collect();
    pictures_of(&corners, width_px)
}

/// The same from the corners of each view, by ids in ascending order.
pub(crate) fn pictures_of(views: &[&[Corner]], width_px: usize) -> Vec<usize> {
    let near_px = SAME_PICTURE_SHARE * width_px as f64;
    let key = |view: &[Corner]| {
        let x: f64 = view.iter().map(|c| c.pixel.x).sum();
        let y: f64 = view.iter().map(|c| c.pixel.y).sum();
        (x, y)
    };
    let mut order: Vec<usize> = (0..views.len()).collect();
    order.sort_by(|&a, &b| {
        let (ka, kb) = (key(views[a]), key(views[b]));
        (views[b].len().cmp(&views[a].len()))
            .then(ka.0.total_cmp(&kb.0))
            .then(ka.1.total_cmp(&kb.1))
    });
    let middles: Vec<_> = views.iter().map(|view| Middle::of(view)).collect();
    let mut leaders: Vec<usize> = Vec::new();
    let mut picture = vec![0; views.len()];
    for index in order {
        let nearest = leaders
            .iter()
            .enumerate()
            .filter(|(_, leader)| !middles[**leader].is_far_from(&middles[index], near_px))
            .filter_map(|(number, &leader)| {
                Some((distance_px(views[leader], views[index], near_px)?, number))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        picture[index] = match nearest {
            Some((_, number)) => number,
            None => {
                leaders.push(index);
                leaders.len() - 1
            }
        };
    }
    picture
}

/// The middle of a view's corners, where these have ids without gaps.
struct Middle {
    ids: Option<(usize, usize)>,
    pixel: [f64; 2],
}

impl Middle {
    fn of(corners: &[Corner]) -> Self {
        let n = corners.len();
        let ids = match corners {
            [first, .., last] if last.id - first.id == n - 1 => Some((first.id, last.id)),
            _ => None,
        };
        let mean = |of: fn(&Corner) -> f64| corners.iter().map(of).sum::<f64>() / n as f64;
        Self { ids, pixel: [mean(|c| c.pixel.x), mean(|c| c.pixel.y)] }
    }

    /// Certainly? The mean distance of the same corners is no less than the distance of their middles.
    fn is_far_from(&self, other: &Self, near_px: f64) -> bool {
        let [x, y] = [0, 1].map(|k| self.pixel[k] - other.pixel[k]);
        self.ids.is_some()
            && self.ids == other.ids
            && x * x + y * y > near_px * near_px * (1.0 + 1e-9)
    }
}

/// The mean distance of common corners, by ids in ascending order; `None` where there are fewer than four, and where it
/// is `near_px` or more.
fn distance_px(a: &[Corner], b: &[Corner], near_px: f64) -> Option<f64> {
    let (mut i, mut j) = (0, 0);
    let (mut sum, mut n) = (0.0, 0_u32);
    let far = near_px * a.len().min(b.len()) as f64;
    while let (Some(p), Some(q)) = (a.get(i), b.get(j)) {
        match p.id.cmp(&q.id) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                let [x, y] = p.pixel - q.pixel;
                sum += (x * x + y * y).sqrt();
                if sum >= far {
                    return None; // However many there are.
                }
                n += 1;
                i += 1;
                j += 1;
            }
        }
    }
    Some(sum / f64::from(n)).filter(|mean| n >= 4 && *mean < near_px)
}

/// The largest angle between the optical axis and the board's normal, degrees.
pub(super) fn max_tilt_deg<'a>(poses: impl Iterator<Item = &'a Pose<Color, Board>>) -> f64 {
    poses
        .map(|pose| math::acos(pose.rotation.matrix()[(2, 2)].abs().min(1.0)).to_degrees())
        .fold(0.0, f64::max)
}

/// Refuses fewer than `needed` views.
pub(super) fn require(
    input: &Input<'_>,
    gathered: &Gathered,
    needed: usize,
    min_corners: usize,
) -> Result<(), Error> {
    if gathered.views.len() < needed {
        return Err(Error::TooFewViews {
            n_frames: input.frames.len(),
            n_views: gathered.views.len(),
            needed,
            min_corners,
        });
    }
    Ok(())
}

pub(super) const fn paper_min_corners() -> usize {
    PAPER_MIN_CORNERS
}
