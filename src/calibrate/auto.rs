//! The best of several models, by how well they predict pictures that took no part.

use super::{
    Candidate, Chosen, Error, Estimate, Input, Model, Outlier, RejectedFrame, SurfaceCandidate,
    fit::{Data, Fit, Start, Wanted, fit},
    model::{Aspect, Center, Shape, Warp},
    problem::Measured,
    select::most_telling,
    surface::{Form, Sheet, Surface},
    views::{self, MIN_CORNERS, all_usable},
    weigh::{drop_outliers, weigh},
};
use crate::{
    camera::{Camera, Distortion, Intrinsics},
    detect::Corner,
    geom::{Board, Color, Pose, Vector3},
    par,
    pose::Weighting,
    solve::{Loss, mean, standard_error},
};

/// A focal length less certain than this share of itself is none.
pub(super) const MAX_FOCAL_SIGMA: f64 = 0.03;

/// Pictures a calibration needs: fewer cannot even disagree.
pub(super) const MIN_PICTURES: usize = 3;

/// Corners up to so many standard deviations count in full, beyond only linearly: 1 % of normal ones do.
const LOSS: Loss = Loss::Huber { threshold: 3.0 };

/// The last step is smaller than some 1e-3 σ, its error than the square of that.
const COST_TOLERANCE: f64 = 1e-10;

/// Views, weighed, without outliers, ready for any model.
pub(super) struct Prepared {
    pub(super) views: Vec<Measured>,
    pub(super) outliers: Vec<Outlier>,
    pub(super) rejected: Vec<RejectedFrame>,
    pub(super) chosen: Option<Chosen>,
    pub(super) pictures: Vec<usize>,
    pub(super) sheet: Sheet,
    /// What is taken for known of the board's shape.
    pub(super) surface: Surface,
    /// Its numbers as far as known.
    pub(super) form: Form,
    /// All surfaces tried.
    pub(super) surfaces: Vec<SurfaceCandidate>,
    /// A camera near every other: where fits start.
    pub(super) near: Intrinsics,
    /// Its k1 and k2, where they were free.
    pub(super) near_warp: Vec<f64>,
}

impl Prepared {
    pub(super) fn references(&self) -> Vec<&Measured> {
        self.views.iter().collect()
    }

    pub(super) fn n_pictures(&self) -> usize {
        self.pictures.iter().max().map_or(0, |last| last + 1)
    }

    /// The RMS of 2-D distances over held-out pictures, pixels; σ from the scatter between pictures.
    pub(super) fn held_out_rms_px(&self, fit: &Fit) -> Estimate {
        let weights: f64 = self.views.iter().flat_map(|v| &v.weights).sum();
        let n = self.views.iter().map(|v| v.corners.len()).sum::<usize>() as f64;
        // Each pose took six residuals' worth from 2n.
        let degrees = 2.0 * n - 6.0 * self.views.len() as f64;
        let total: f64 = fit.held_out.iter().sum();
        let value = (total / weights * (2.0 * n / degrees)).sqrt();
        // σ of a mean of squares, taken through the root.
        let share = standard_error(&fit.held_out) / mean(&fit.held_out);
        Estimate { value, sigma: 0.5 * value * share }
    }
}

/// Gathers all usable views; weighs their corners and finds outliers under a model that no lens of ours is far from
/// (focal length, centre, k1, k2), so that what is left out does not depend on the model judged later; decides by
/// held-out pictures (one-standard-error rule) what the board's shape is taken to be.
pub(super) fn prepare(input: &Input<'_>, max_views: usize) -> Result<Prepared, Error> {
    let weighting = Weighting::Sigma { floor_px: 0.1 };
    let mut gathered = all_usable(input, MIN_CORNERS, weighting);
    views::require(input, &gathered, MIN_PICTURES, MIN_CORNERS)?;
    let choice = most_telling(input, &gathered.views, weighting, max_views.max(MIN_PICTURES));
    let chosen = choice.map(|(indices, chosen)| {
        gathered.keep_only(&indices);
        chosen
    });
    let mut prepared = Prepared {
        views: gathered.views,
        outliers: Vec::new(),
        rejected: gathered.rejected,
        chosen,
        pictures: Vec::new(),
        sheet: Sheet::new(input.board),
        surface: Surface::Flat,
        form: Form::default(),
        surfaces: Vec::new(),
        near: *input.factory,
        near_warp: Vec::new(),
    };
    let pinhole = Camera { intrinsics: *input.factory, distortion: Distortion::None };
    let first = residuals_px(&prepared, &pinhole);
    weigh(&mut prepared.views, &first, 1.0);
    // Once with a loss that forgives gross errors, once with those gone.
    for loss in [Loss::Cauchy { scale: 3.0 }, LOSS] {
        let (shape, fit) = flexible(input, &mut prepared, loss)?;
        let camera = shape.camera(input.factory, input.tables, &fit.free);
        for (view, pose) in prepared.views.iter_mut().zip(&fit.poses) {
            view.pose = *pose;
        }
        prepared.surface = shape.surface;
        prepared.form = fit.form(&shape);
        prepared.near = shape.intrinsics(input.factory, &fit.free);
        prepared.near_warp = match shape.warp {
            Warp::FreeRadial2 => shape.warp_numbers(&fit.free).to_vec(),
            _ => Vec::new(),
        };
        let residuals = residuals_px(&prepared, &camera);
        let n_corners: usize = residuals.iter().map(Vec::len).sum();
        let taken = (fit.free.len() + 6 * residuals.len()) as f64;
        weigh(&mut prepared.views, &residuals, 1.0 - taken / (2 * n_corners) as f64);
        let (corners, frames) = drop_outliers(&mut prepared.views, &residuals, MIN_CORNERS);
        prepared.outliers.extend(corners);
        prepared.rejected.extend(frames);
        if prepared.views.len() < MIN_PICTURES {
            return Err(Error::TooFewViews {
                n_frames: input.frames.len(),
                n_views: prepared.views.len(),
                needed: MIN_PICTURES,
                min_corners: MIN_CORNERS,
            });
        }
    }
    prepared.outliers.sort_by_key(|o| (o.frame, o.id));
    prepared.rejected.sort_by_key(|r| r.frame);
    prepared.pictures = views::pictures(&prepared.references(), input.factory.width);
    Ok(prepared)
}

/// The most flexible camera that the views determine, with the surface that held-out pictures ask for, fitted.
fn flexible<'a>(
    input: &Input<'_>,
    prepared: &mut Prepared,
    loss: Loss,
) -> Result<(Shape<'a>, Fit), Error> {
    prepared.pictures = views::pictures(&prepared.references(), input.factory.width);
    if prepared.n_pictures() < MIN_PICTURES {
        return Err(underdetermined(prepared, None));
    }
    let determined = |fit: &Fit| {
        let focal = fit.focal_px();
        focal.sigma <= MAX_FOCAL_SIGMA * focal.value
    };
    let shape_of = |center, warp, surface| Shape { center, warp, aspect: Aspect::Fixed, surface };
    let cameras = [
        (Center::Free, Warp::FreeRadial2),
        (Center::Free, Warp::None),
        (Center::Fixed, Warp::None),
    ];
    let mut surfaces = vec![Surface::Flat, Surface::Bend, Surface::Free];
    surfaces.retain(|surface| prepared.sheet.allows(*surface));
    let mut closest: Option<Estimate> = None;
    let mut tried = Vec::new();
    for (center, warp) in cameras {
        let fits = par::map(&surfaces, |surface| {
            let shape = shape_of(center, warp, *surface);
            Some((shape, fit_with(input, prepared, shape, (loss, Wanted::Camera))?))
        });
        // A camera that a flat board does not determine, no other board does.
        match fits.first() {
            Some(Some((_, flat))) if determined(flat) => {
                tried = fits.into_iter().flatten().filter(|(_, fit)| determined(fit)).collect();
                break;
            }
            Some(Some((_, flat))) => {
                let focal = flat.focal_px();
                closest = focal.sigma.is_finite().then_some(focal).or(closest);
            }
            _ => {}
        }
    }
    if tried.is_empty() {
        return Err(underdetermined(prepared, closest));
    }
    let (chosen, behind) = simplest(&tried.iter().map(|(_, fit)| fit).collect::<Vec<_>>());
    prepared.surfaces = tried
        .iter()
        .zip(behind)
        .map(|((shape, fit), behind_best_sigmas)| SurfaceCandidate {
            kind: shape.surface.kind(),
            rms_px: shape_rms_px(input, prepared, *shape, fit),
            held_out_rms_px: prepared.held_out_rms_px(fit).value,
            held_out_sigma_px: prepared.held_out_rms_px(fit).sigma,
            behind_best_sigmas,
            focal_px: fit.focal_px(),
        })
        .collect();
    Ok(tried.swap_remove(chosen))
}

/// The first of these fits, ordered from simple to flexible, that predicts held-out pictures within one standard error
/// of the best; and by how many each lies behind.
fn simplest(fits: &[&Fit]) -> (usize, Vec<f64>) {
    let score = |fit: &Fit| mean(&fit.held_out);
    let Some(best) = fits.iter().min_by(|a, b| score(a).total_cmp(&score(b))) else {
        return (0, Vec::new());
    };
    let behind: Vec<f64> = fits.iter().map(|fit| behind_sigmas(fit, best)).collect();
    (behind.iter().position(|b| *b <= 1.0).unwrap_or(0), behind)
}

/// Observed minus projected, on the board as it is known; a corner that does not project is infinitely far off.
fn residuals_px(prepared: &Prepared, camera: &Camera) -> Vec<Vec<[f64; 2]>> {
    let form = &prepared.form;
    residuals(prepared, camera, (prepared.surface, form), prepared.views.iter().map(|v| v.pose))
}

/// The same with a surface and poses of its own.
fn residuals(
    prepared: &Prepared,
    camera: &Camera,
    (surface, form): (Surface, &Form),
    poses: impl Iterator<Item = Pose<Color, Board>>,
) -> Vec<Vec<[f64; 2]>> {
    let of_view = |(view, pose): (&Measured, Pose<Color, Board>)| {
        let of_corner = |(corner, point): (&Corner, &Vector3<f64>)| {
            let numbers = (form.shared.as_slice(), form.knots_m.as_slice());
            let place = prepared.sheet.lifted(surface, (corner.id, point), numbers);
            match camera.project(pose * place) {
                Some(pixel) => corner.pixel - pixel,
                None => [f64::INFINITY; 2],
            }
        };
        view.corners.iter().zip(&view.points).map(of_corner).collect()
    };
    prepared.views.iter().zip(poses).map(of_view).collect()
}

/// A shape fitted to prepared views.
pub(super) fn fit_prepared(
    input: &Input<'_>,
    prepared: &Prepared,
    shape: Shape<'_>,
) -> Option<Fit> {
    fit_with(input, prepared, shape, (LOSS, Wanted::Camera))
}

/// The same, and what motion while rows are read does to the centre.
pub(super) fn fit_in_motion(
    input: &Input<'_>,
    prepared: &Prepared,
    shape: Shape<'_>,
) -> Option<Fit> {
    fit_with(input, prepared, shape, (LOSS, Wanted::CameraInMotion))
}

fn fit_with(
    input: &Input<'_>,
    prepared: &Prepared,
    shape: Shape<'_>,
    (loss, wanted): (Loss, Wanted),
) -> Option<Fit> {
    let references = prepared.references();
    let all = (references.as_slice(), prepared.pictures.as_slice());
    let data = Data { wanted, ..data(input, prepared, all, loss) };
    let poses: Vec<_> = prepared.views.iter().map(|v| v.pose).collect();
    let mut free = shape.start(&prepared.near);
    if matches!(shape.warp, Warp::FreeRadial1 | Warp::FreeRadial2 | Warp::FreeBrown) {
        let n_numbers = shape.warp_numbers(&free).len();
        let first = if shape.center == Center::Free { 3 } else { 1 };
        let numbers = free[first..first + n_numbers].iter_mut();
        numbers.zip(&prepared.near_warp).for_each(|(number, near)| *number = *near);
    }
    let mut knots_m = &[][..];
    if shape.surface == prepared.surface {
        let n_camera = shape.n_camera(&free);
        free[n_camera..].copy_from_slice(&prepared.form.shared);
        knots_m = &prepared.form.knots_m;
    }
    fit(shape, &data, Start { free: &free, knots_m, poses: &poses })
}

/// The same fit once more, with all that is known of the surface and of the poses.
pub(super) fn in_full(
    input: &Input<'_>,
    prepared: &Prepared,
    shape: Shape<'_>,
    whole: &Fit,
) -> Option<Fit> {
    let references = prepared.references();
    let data = data(input, prepared, (&references, &prepared.pictures), LOSS);
    fit(shape, &Data { wanted: Wanted::Everything, ..data }, whole.start())
}

fn data<'a>(
    input: &'a Input<'_>,
    prepared: &'a Prepared,
    (views, pictures): (&'a [&'a Measured], &'a [usize]),
    loss: Loss,
) -> Data<'a> {
    Data {
        factory: input.factory,
        views,
        pictures,
        loss,
        sheet: &prepared.sheet,
        cost_tolerance: COST_TOLERANCE,
        wanted: Wanted::Camera,
    }
}

/// A fit to every other view, beginning with `first`; `None` where these do not determine the focal length.
pub(super) fn half_focal_px(
    input: &Input<'_>,
    prepared: &Prepared,
    shape: Shape<'_>,
    whole: &Fit,
    first: usize,
) -> Option<Estimate> {
    let half: Vec<&Measured> = prepared.views.iter().skip(first).step_by(2).collect();
    let poses: Vec<_> = whole.poses.iter().copied().skip(first).step_by(2).collect();
    let pictures = views::pictures(&half, input.factory.width);
    let data = data(input, prepared, (&half, &pictures), LOSS);
    if data.n_pictures() < MIN_PICTURES {
        return None;
    }
    let focal = fit(shape, &data, Start { poses: &poses, ..whole.start() })?.focal_px();
    (focal.sigma <= MAX_FOCAL_SIGMA * focal.value).then_some(focal)
}

/// All models that the views determine, and the one chosen.
///
/// A model is judged by the pictures it was not fitted to: intrinsics from all other pictures, the six numbers of
/// each pose from the picture itself. The pose is fitted to *all* its corners, not to some to predict the rest: every
/// model has the same six, so that they favour none, and no corner is lost to the judgement. What remains is, but for
/// noise, how far the intrinsics are from those the picture itself would ask for, weighed by what it can know.
///
/// One-standard-error rule (Breiman et al. 1984): the simplest model whose held-out mean square is within one
/// standard error of the best one's; the error is that of the *difference*, picture by picture, in which what is
/// common to both models (blur, a wavy board) cancels.
pub(super) fn choose(
    input: &Input<'_>,
    prepared: &Prepared,
    models: &[Model],
) -> Result<(Model, Vec<(Candidate, Fit)>), Error> {
    let fits = par::map(models, |&model| {
        let fit = fit_prepared(input, prepared, model.shape(input.tables, prepared.surface)?)?;
        let focal = fit.focal_px();
        (focal.sigma <= MAX_FOCAL_SIGMA * focal.value).then_some((model, fit))
    });
    let fits: Vec<(Model, Fit)> = fits.into_iter().flatten().collect();
    if fits.is_empty() {
        return Err(underdetermined(prepared, None));
    }
    let (chosen, behind) = simplest(&fits.iter().map(|(_, fit)| fit).collect::<Vec<_>>());
    let model = fits[chosen].0;
    let candidates = fits
        .iter()
        .zip(behind)
        .map(|((model, fit), behind_best_sigmas)| {
            let candidate = Candidate {
                model: *model,
                rms_px: rms_px(input, prepared, *model, fit),
                held_out_rms_px: prepared.held_out_rms_px(fit).value,
                held_out_sigma_px: prepared.held_out_rms_px(fit).sigma,
                behind_best_sigmas,
                focal_px: fit.focal_px(),
            };
            (candidate, fit.clone())
        })
        .collect();
    Ok((model, candidates))
}

/// By how many standard errors of the difference `fit` predicts worse than `best`.
pub(super) fn behind_sigmas(fit: &Fit, best: &Fit) -> f64 {
    let differences: Vec<f64> =
        fit.held_out.iter().zip(&best.held_out).map(|(a, b)| a - b).collect();
    let behind = mean(&differences);
    if behind == 0.0 {
        return 0.0;
    }
    behind / standard_error(&differences)
}

pub(super) fn underdetermined(prepared: &Prepared, focal_px: Option<Estimate>) -> Error {
    Error::Underdetermined {
        n_views: prepared.views.len(),
        n_pictures: prepared.n_pictures(),
        max_tilt_deg: views::max_tilt_deg(prepared.views.iter().map(|v| &v.pose)),
        focal_px,
    }
}

fn rms_px(input: &Input<'_>, prepared: &Prepared, model: Model, fit: &Fit) -> f64 {
    match model.shape(input.tables, prepared.surface) {
        Some(shape) => shape_rms_px(input, prepared, shape, fit),
        None => f64::NAN,
    }
}

/// The RMS of 2-D distances under a fit, all corners alike.
pub(super) fn shape_rms_px(
    input: &Input<'_>,
    prepared: &Prepared,
    shape: Shape<'_>,
    fit: &Fit,
) -> f64 {
    let camera = shape.camera(input.factory, input.tables, &fit.free);
    let form = fit.form(&shape);
    let poses = fit.poses.iter().copied();
    let residuals = residuals(prepared, &camera, (shape.surface, &form), poses);
    let (mut squares, mut n) = (0.0, 0);
    for [x, y] in residuals.into_iter().flatten() {
        squares += x * x + y * y;
        n += 1;
    }
    (squares / f64::from(n)).sqrt()
}
