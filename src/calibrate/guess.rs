//! A first guess of a camera of which nothing is known.

use super::FrameCorners;
use crate::{
    board::CharucoBoard,
    camera::Intrinsics,
    geom::{Homography, Pixel},
    solve::median,
};

/// A view straight on tells no focal length: what its equations leave of f⁻² is rounding and noise below this share.
const LEAST_SHARE: f64 = 0.01;

/// Intrinsics to start from: the principal point in the middle of the image, square pixels, and the focal length that
/// the views of the board ask for; the image's larger side where they ask for none.
///
/// With both, each view's homography H = (h₁ h₂ h₃) from the board to pixels about the middle gives two equations for
/// f⁻² (Zhang, *A flexible new technique for camera calibration*, 2000): h₁ᵀ·ω·h₂ = 0 and h₁ᵀ·ω·h₁ = h₂ᵀ·ω·h₂ with
/// ω = diag(f⁻², f⁻², 1). The median over all views is taken.
pub fn guess_intrinsics(
    board: &CharucoBoard,
    frames: &[FrameCorners],
    [width, height]: [usize; 2],
) -> Intrinsics {
    let cx = 0.5 * (width as f64 - 1.0);
    let cy = 0.5 * (height as f64 - 1.0);
    let found: Vec<f64> =
        frames.iter().filter_map(|frame| focal_px(board, frame, [cx, cy])).collect();
    let usual = width.max(height) as f64;
    let f = if found.is_empty() { usual } else { median(&found).clamp(0.2 * usual, 10.0 * usual) };
    Intrinsics { fx: f, fy: f, cx, cy, width, height }
}

fn focal_px(board: &CharucoBoard, frame: &FrameCorners, [cx, cy]: [f64; 2]) -> Option<f64> {
    // Of the order of one, both sides.
    let on_board = |id: usize| {
        let corner = board.corner(id);
        Pixel::new(corner.x() / board.square_m, corner.y() / board.square_m)
    };
    let seen: Vec<_> = frame.corners.iter().filter(|c| c.id < board.n_corners()).collect();
    let from: Vec<Pixel> = seen.iter().map(|c| on_board(c.id)).collect();
    let to: Vec<Pixel> =
        seen.iter().map(|c| Pixel::new((c.pixel.x - cx) / cx, (c.pixel.y - cy) / cx)).collect();
    if from.len() < 8 {
        return None;
    }
    let h = Homography::from_points(&from, &to)?.matrix;
    let [a, b] = [h.column(0), h.column(1)];
    // Both equations as p·f⁻² + q = 0.
    let equations = [
        (a.x * b.x + a.y * b.y, a.z * b.z),
        (a.x * a.x + a.y * a.y - b.x * b.x - b.y * b.y, a.z * a.z - b.z * b.z),
    ];
    let pp: f64 = equations.iter().map(|(p, _)| p * p).sum();
    let pq: f64 = equations.iter().map(|(p, q)| p * q).sum();
    let whole = a.x * a.x + a.y * a.y + b.x * b.x + b.y * b.y;
    let inverse_square = -pq / pp;
    (pp.sqrt() > LEAST_SHARE * whole && inverse_square > 0.0).then(|| cx / inverse_square.sqrt())
}
