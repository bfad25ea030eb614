//! The calibration itself.

use super::{
    Calibration, Candidate, DistortionTest, Error, Input, LeftOutPicture, Method, Model, Parameter,
    RollingShutter,
    auto::{self, MAX_FOCAL_SIGMA, MIN_PICTURES, Prepared},
    distortion,
    fit::{Data, Fit, Start, Wanted, fit},
    model::{Center, Shape},
    problem::Measured,
    surface::{Form, Sheet, Surface},
    views,
};
use crate::{
    geom::{Board, Point},
    par,
    pose::View,
    solve::Loss,
};

/// The intrinsics that explain these corners.
///
/// The same input gives the same bytes; the order of `input.frames` matters to [`Method::Paper`] alone, whose choice
/// of views depends on it. 50 views with 60 corners each take some milliseconds ([`Method::Plain`]) to some tens of
/// milliseconds ([`Method::Auto`]).
///
/// Errors: too few usable views; views that do not determine the focal length to within 3 % (all straight on, or all
/// the same); a model that needs tables without tables; factory intrinsics that make no camera.
pub fn calibrate(input: &Input<'_>, method: Method) -> Result<Calibration, Error> {
    calibrate_from(input, method, MAX_VIEWS)
}

/// From more views than this the most telling ones are chosen: σ shrinks with the root of their number at best, time
/// grows with it, and a hand does not take so many different pictures.
pub const MAX_VIEWS: usize = 120;

/// As [`calibrate`], from `max_views` views at most: where there are more, those are chosen that together tell most
/// about the camera, and [`Calibration::chosen`] says so. [`Method::Paper`] and [`Method::Plain`] take all.
///
/// Errors: as there.
pub fn calibrate_from(
    input: &Input<'_>,
    method: Method,
    max_views: usize,
) -> Result<Calibration, Error> {
    let factory = input.factory;
    let positive = |f: f64| f > 0.0 && f.is_finite();
    if !(positive(factory.fx)
        && positive(factory.fy)
        && factory.cx.is_finite()
        && factory.cy.is_finite())
    {
        return Err(Error::Factory {
            fx_px: factory.fx,
            fy_px: factory.fy,
            cx_px: factory.cx,
            cy_px: factory.cy,
        });
    }
    match method {
        Method::Paper => {
            let gathered = views::as_the_paper(input);
            views::require(input, &gathered, 3, views::paper_min_corners())?;
            plain(input, method, Model::Focal, gathered)
        }
        Method::Plain(model) => {
            let weighting = crate::pose::Weighting::Equal;
            let gathered = views::all_usable(input, 4, weighting);
            views::require(input, &gathered, 3, 4)?;
            plain(input, method, model, gathered)
        }
        Method::Robust(model) => {
            let shape =
                model.shape(input.tables, Surface::Flat).ok_or(Error::NoTables { model })?;
            let prepared = auto::prepare(input, max_views)?;
            let shape = Shape { surface: prepared.surface, ..shape };
            let fit = auto::fit_prepared(input, &prepared, shape)
                .ok_or_else(|| auto::underdetermined(&prepared, None))?;
            robust(input, method, model, prepared, &fit, Vec::new())
        }
        Method::Auto | Method::Unaided => {
            let prepared = auto::prepare(input, max_views)?;
            let models = match method {
                Method::Unaided => &Model::UNAIDED[..],
                _ => &Model::SQUARE[..],
            };
            let (model, mut found) = auto::choose(input, &prepared, models)?;
            let at = found.iter().position(|(c, _)| c.model == model).unwrap_or(0);
            let fit = found[at].1.clone();
            let candidates = found.drain(..).map(|(candidate, _)| candidate).collect();
            robust(input, method, model, prepared, &fit, candidates)
        }
    }
}

/// How much of the lens' distortion is left in the stream, as [`Method::Auto`] finds it beside its calibration; `None`
/// where the views do not tell.
pub fn distortion_test(input: &Input<'_>) -> Option<DistortionTest> {
    distortion::test(input, &auto::prepare(input, MAX_VIEWS).ok()?)
}

/// The last step is smaller than 1e-4 σ, its error than the square of that.
const PLAIN_TOLERANCE: f64 = 1e-12;

/// All views and corners alike, no loss.
fn plain(
    input: &Input<'_>,
    method: Method,
    model: Model,
    views::Gathered { views, rejected }: views::Gathered,
) -> Result<Calibration, Error> {
    let shape = model.shape(input.tables, Surface::Flat).ok_or(Error::NoTables { model })?;
    let references: Vec<&Measured> = views.iter().collect();
    let pictures = views::pictures(&references, input.factory.width);
    let sheet = Sheet::flat(input.board);
    let data = Data {
        factory: input.factory,
        views: &references,
        pictures: &pictures,
        loss: Loss::Squared,
        sheet: &sheet,
        cost_tolerance: PLAIN_TOLERANCE,
        wanted: Wanted::Everything,
    };
    let poses: Vec<_> = views.iter().map(|v| v.pose).collect();
    let free = shape.start(input.factory);
    let fit = fit(shape, &data, Start { free: &free, knots_m: &[], poses: &poses });
    let prepared = Prepared {
        views,
        outliers: Vec::new(),
        rejected,
        chosen: None,
        pictures,
        sheet,
        surface: Surface::Flat,
        form: Form::default(),
        surfaces: Vec::new(),
        near: *input.factory,
        near_warp: Vec::new(),
    };
    let fit = fit.ok_or_else(|| auto::underdetermined(&prepared, None))?;
    let result = Parts { method, model, shape, candidates: Vec::new() };
    assemble(input, result, prepared, &fit)
}

fn robust(
    input: &Input<'_>,
    method: Method,
    model: Model,
    prepared: Prepared,
    fit: &Fit,
    candidates: Vec<Candidate>,
) -> Result<Calibration, Error> {
    let shape = model.shape(input.tables, prepared.surface).ok_or(Error::NoTables { model })?;
    let half = |first| auto::half_focal_px(input, &prepared, shape, fit, first);
    let (distortion, (halves, full)) = par::join(
        || distortion::test(input, &prepared),
        || {
            par::join(
                || par::join(|| half(0), || half(1)),
                || auto::in_full(input, &prepared, shape, fit),
            )
        },
    );
    let full = full.ok_or_else(|| auto::underdetermined(&prepared, None))?;
    let parts = Parts { method, model, shape, candidates };
    let mut calibration = assemble(input, parts, prepared, &full)?;
    calibration.split_half_focal_px = match halves {
        (Some(a), Some(b)) => Some([a, b]),
        _ => None,
    };
    calibration.distortion = distortion;
    Ok(calibration)
}

struct Parts<'a> {
    method: Method,
    model: Model,
    shape: Shape<'a>,
    candidates: Vec<Candidate>,
}

fn assemble(
    input: &Input<'_>,
    Parts { method, model, shape, candidates }: Parts<'_>,
    prepared: Prepared,
    fit: &Fit,
) -> Result<Calibration, Error> {
    let focal = fit.focal_px();
    let n_pictures = prepared.n_pictures();
    // Few pictures cannot contradict each other: their σ would be a guess, and usually far too small.
    let enough = n_pictures >= MIN_PICTURES && focal.sigma <= MAX_FOCAL_SIGMA * focal.value;
    let undetermined = || {
        let known = (n_pictures >= MIN_PICTURES && focal.sigma.is_finite()).then_some(focal);
        auto::underdetermined(&prepared, known)
    };
    let whole = fit.covariance.as_ref().filter(|_| enough).ok_or_else(undetermined)?;
    let names = shape.names();
    let n = fit.free.len() + fit.knots_m.len();
    let covariance =
        (0..names.len()).flat_map(|i| whole[i * n..i * n + names.len()].iter().copied()).collect();
    let form = fit.form(&shape);
    let camera = shape.camera(input.factory, input.tables, &fit.free);
    let plane = prepared.sheet.plane_pose(shape.surface, &form);
    let mut views = Vec::with_capacity(prepared.views.len());
    let (mut squares, mut n_corners) = (0.0, 0);
    for (view, pose) in prepared.views.iter().zip(&fit.poses) {
        let numbers = (form.shared.as_slice(), form.knots_m.as_slice());
        let points: Vec<Point<Board>> = view
            .corners
            .iter()
            .zip(&view.points)
            .map(|(corner, point)| {
                prepared.sheet.lifted(shape.surface, (corner.id, point), numbers)
            })
            .collect();
        let mut view = View::at_pose_of(view.frame, &points, &camera, &view.corners, *pose)
            .map_err(|_| undetermined())?;
        // Heights count from the board's own plane, and so must poses.
        view.color_from_board = view.color_from_board * plane;
        squares += view.rms_px * view.rms_px * view.corners.len() as f64;
        n_corners += view.corners.len();
        views.push(view);
    }
    let parameters = names
        .into_iter()
        .enumerate()
        .map(|(i, name)| Parameter { name, estimate: fit.estimate(i) })
        .collect();
    Ok(Calibration {
        method,
        model,
        camera,
        parameters,
        covariance,
        views,
        chosen: prepared.chosen,
        n_pictures,
        rms_px: (squares / n_corners as f64).sqrt(),
        candidates,
        split_half_focal_px: None,
        distortion: None,
        surface: prepared.sheet.surface(shape.surface, &form, whole),
        surfaces: prepared.surfaces,
        left_out: left_out(&prepared.views, &prepared.pictures, &fit.left_out_focal_px),
        rolling_shutter: fit.shutter.as_ref().map(|shutter| RollingShutter {
            turn_sigma_rad: shutter.turn_sigma_rad,
            residual_share: shutter.share,
            focal_shift_px: shutter.shift[0],
            center_shift_px: (shape.center == Center::Free)
                .then(|| [shutter.shift[1], shutter.shift[2]]),
        }),
        motion: fit.motion.clone(),
        outliers: prepared.outliers,
        rejected: prepared.rejected,
    })
}

/// The focal length without each picture, by the first frame of the picture.
fn left_out(
    views: &[Measured],
    pictures: &[usize],
    focal_px: &[Option<f64>],
) -> Vec<LeftOutPicture> {
    let mut found: Vec<LeftOutPicture> = focal_px
        .iter()
        .enumerate()
        .filter_map(|(picture, focal_px)| {
            let of_picture = views.iter().zip(pictures).filter(|(_, p)| **p == picture);
            Some(LeftOutPicture {
                frames: of_picture.map(|(view, _)| view.frame).collect(),
                focal_px: (*focal_px)?,
            })
        })
        .collect();
    found.sort_by(|a, b| a.frames.cmp(&b.frames));
    found
}
