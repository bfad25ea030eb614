//! The views that tell most, where there are more than are worth their time.

use super::{
    Chosen, Input,
    model::{Aspect, Center, Shape, Warp},
    problem::{Measured, Reprojection},
    surface::{Sheet, Surface},
    views,
};
use crate::{
    pose::Weighting,
    solve::{BlockNormal, Bordered, Cholesky, Loss, Reduced},
};

/// Focal length, centre, k1 and k2: what any camera of ours may leave open.
const N: usize = 5;

type Information = [[f64; N]; N];

/// What is known beforehand of each number, as a share of what all views say: the first views are compared by it.
const PRIOR_SHARE: f64 = 1e-6;

/// The indices, ascending, of the `limit` views that together tell most about the camera, and how much; `None` where
/// there are no more than that, or the views say nothing.
///
/// Greedy D-optimal design (Fedorov, *Theory of optimal experiments*, 1972): the next view is the one whose
/// information, its pose eliminated, lets the determinant of the information gathered so far grow most. That finds at
/// least 1 − 1/e of the best choice's gain, since the gain only shrinks with what is known already (Nemhauser, Wolsey,
/// Fisher 1978).
///
/// Of views that show the same picture one is taken before any gets a second: what is wrong in one is wrong in the
/// others, and σ, found from the scatter between pictures, must not be diluted.
pub(super) fn most_telling(
    input: &Input<'_>,
    measured: &[Measured],
    weighting: Weighting,
    limit: usize,
) -> Option<(Vec<usize>, Chosen)> {
    if measured.len() <= limit {
        return None;
    }
    let (center, warp, surface) = (Center::Free, Warp::FreeRadial2, Surface::Flat);
    let shape = Shape { center, warp, aspect: Aspect::Fixed, surface };
    let weighed: Vec<Measured> = measured
        .iter()
        .map(|view| {
            let weights = view.corners.iter().map(|corner| weighting.weight(corner)).collect();
            Measured { weights, ..view.clone() }
        })
        .collect();
    let references: Vec<&Measured> = weighed.iter().collect();
    let sheet = Sheet::flat(input.board);
    let factory = input.factory;
    let problem =
        Reprojection { shape, factory, views: &references, loss: Loss::Squared, sheet: &sheet };
    let shared = [factory.fx, factory.cx, factory.cy, 0.0, 0.0];
    let of_view = |index: usize| {
        let mut normal = BlockNormal::zero(N);
        let pose = &weighed[index].pose;
        let mut reduced = Reduced::zero(N);
        let seen = problem.linearize_block(index, &shared, &[], pose, &mut normal)
            && normal.reduce_into(&mut reduced);
        let at = |i: usize, j: usize| reduced.information[i * N + j];
        seen.then(|| std::array::from_fn(|i| std::array::from_fn(|j| at(i, j))))
    };
    let said: Vec<Information> =
        (0..weighed.len()).map(|i| of_view(i).unwrap_or([[0.0; N]; N])).collect();
    let mut all = said.iter().fold([[0.0; N]; N], sum);
    // In units of what all views say, numbers of any size are alike.
    let scale: [f64; N] = std::array::from_fn(|i| all[i][i].sqrt().recip());
    if scale.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let scaled = |matrix: &Information| -> Information {
        std::array::from_fn(|i| std::array::from_fn(|j| matrix[i][j] * scale[i] * scale[j]))
    };
    let said: Vec<Information> = said.iter().map(scaled).collect();
    all = scaled(&all);

    let pictures = views::pictures(&references, factory.width);
    let n_pictures = pictures.iter().max().map_or(0, |last| last + 1);
    let mut known: Information =
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { PRIOR_SHARE } else { 0.0 }));
    let mut taken = vec![false; said.len()];
    let mut shown = vec![0_usize; n_pictures];
    for _ in 0..limit {
        let open = |index: &usize| !taken[*index];
        // The pictures shown least often come first.
        let least = (0..said.len()).filter(open).map(|i| shown[pictures[i]]).min()?;
        let gain = |index: usize| log_determinant(&sum(known, &said[index]));
        let best = (0..said.len())
            .filter(|i| open(i) && shown[pictures[*i]] == least)
            .map(|index| (gain(index), index))
            .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        taken[best.1] = true;
        shown[pictures[best.1]] += 1;
        known = sum(known, &said[best.1]);
    }
    let chosen: Vec<usize> = (0..said.len()).filter(|i| taken[*i]).collect();
    let variance = |information: &Information| {
        Cholesky::new(information).map_or(f64::INFINITY, |factor| factor.inverse()[0][0])
    };
    let told = Chosen {
        n_usable: said.len(),
        n_chosen: chosen.len(),
        n_pictures,
        focal_sigma_ratio: (variance(&known) / variance(&all)).sqrt(),
    };
    Some((chosen, told))
}

fn sum(mut a: Information, b: &Information) -> Information {
    a.as_flattened_mut().iter_mut().zip(b.as_flattened()).for_each(|(a, b)| *a += b);
    a
}

/// ln det of a positive definite matrix; −∞ of any other.
fn log_determinant(matrix: &Information) -> f64 {
    Cholesky::new(matrix).map_or(f64::NEG_INFINITY, |factor| factor.log_determinant())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_determinants() {
        let mut matrix = [[0.0; N]; N];
        for i in 0..N {
            matrix[i][i] = (i + 1) as f64;
        }
        assert!((log_determinant(&matrix) - 120.0_f64.ln()).abs() < 1e-14);
        matrix[1][0] = 0.5; // Below the diagonal is enough: 1·2 − 0.25 instead of 2.
        assert!((log_determinant(&matrix) - (120.0_f64 * 1.75 / 2.0).ln()).abs() < 1e-14);
        matrix[3][3] = -1.0;
        assert_eq!(log_determinant(&matrix), f64::NEG_INFINITY);
    }
}
