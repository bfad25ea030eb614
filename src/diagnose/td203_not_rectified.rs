#![doc = include_str!("td203_not_rectified.md")]

use super::{
    Case, Code, Correction, DistortionState, Evidence, Finding, Unit, Verdict,
    joint::{Freedom, Joint, joint},
};
use crate::{
    calibrate::{Estimate, Model},
    camera::{Camera, Distortion, Intrinsics, TablePair},
    geom::Pixel,
    solve::quantile,
};

/// Where the shape of the distortion that is looked for comes from.
#[derive(Clone, Copy, Debug)]
enum Shape<'a> {
    /// Apple's tables: all of it or nothing.
    Table(&'a TablePair),
    /// The own camera's polynomials.
    Own(&'a Camera),
    /// One cubic term about the centre: the first that any lens has. The displacement is 1 px at this radius.
    Cubic {
        /// Where it vanishes.
        center: Pixel,
        /// Where it is 1 px.
        radius_px: f64,
    },
}

impl Shape<'_> {
    /// What the lens does to a rectilinear pixel.
    fn displacement(&self, pixel: Pixel) -> Option<[f64; 2]> {
        match self {
            Self::Table(tables) => Some(tables.distort(pixel)? - pixel),
            Self::Own(camera) => {
                Some(camera.project_ray(camera.intrinsics.ray_from_pixel(pixel))? - pixel)
            }
            Self::Cubic { center, radius_px } => {
                let [x, y] = pixel - *center;
                let factor = (x * x + y * y) / radius_px.powi(3);
                Some([x * factor, y * factor])
            }
        }
    }
}

/// What was measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<'a> {
    shape: Shape<'a>,
    /// With the centre free, as the sigmas ask for.
    joint: Joint,
    /// How far the shape displaces at the reference radius, pixels.
    reference_px: f64,
    /// Where that is, pixels from the centre.
    radius_px: f64,
}

impl Measured<'_> {
    /// Displacement at the reference radius, pixels: positive as the lens does it.
    fn displacement_px(&self) -> Estimate {
        let Estimate { value, sigma } = self.joint.amount;
        Estimate { value: value * self.reference_px, sigma: sigma * self.reference_px }
    }

    /// The focal length once this distortion is taken out, for an own camera that knows of none.
    pub(super) fn focal_px(&self, case: &Case<'_>, pinhole: &Intrinsics) -> Option<Estimate> {
        let shape = |pixel| self.shape.displacement(pixel);
        joint(case.board, case.surface(), case.own_views, pinhole, &shape, Freedom::Distortion)
            .map(|j| j.focal_px)
    }
}

/// `None` where the views do not tell.
pub(super) fn measure<'a>(case: &Case<'a>) -> Option<Measured<'a>> {
    let camera = case.camera?;
    let pinhole = &camera.intrinsics;
    let center = Pixel::new(pinhole.cx, pinhole.cy);
    // Without a table the size beyond the corners that were seen would be a guess, and at the very last of them nearly
    // one: nine of ten corners lie within this radius.
    let radii: Vec<f64> = case
        .own_views
        .iter()
        .flat_map(|view| &view.corners)
        .map(|corner| corner.pixel.distance(center))
        .collect();
    let seen_px = quantile(&radii, 0.9);
    let tables = case.factory.and_then(|f| f.tables.as_ref());
    let (shape, reference_px, radius_px) = match (tables, &camera.distortion) {
        (Some(tables), _) => {
            let (corner, radius_px) = farthest_corner(tables.inverse.center, pinhole);
            (Shape::Table(tables), tables.undistort(corner)?.distance(corner), radius_px)
        }
        (None, Distortion::Brown(_)) => {
            let shape = Shape::Own(camera);
            let at = |angle: f64| {
                let (sin, cos) = angle.sin_cos();
                let pixel = Pixel::new(center.x + seen_px * cos, center.y + seen_px * sin);
                shape.displacement(pixel).map_or(0.0, |[x, y]| x.hypot(y))
            };
            let mean =
                (0..16).map(|i| at(f64::from(i) * std::f64::consts::TAU / 16.0)).sum::<f64>()
                    / 16.0;
            (shape, mean, seen_px)
        }
        (None, _) => (Shape::Cubic { center, radius_px: seen_px }, 1.0, seen_px),
    };
    let displacement = |pixel| shape.displacement(pixel);
    let joint = joint(
        case.board,
        case.surface(),
        case.own_views,
        pinhole,
        &displacement,
        Freedom::CentreAndDistortion,
    )?;
    Some(Measured { shape, joint, reference_px, radius_px })
}

/// The image corner farthest from a point, and its distance.
fn farthest_corner(from: Pixel, size: &Intrinsics) -> (Pixel, f64) {
    let (right, bottom) = (size.width as f64 - 1.0, size.height as f64 - 1.0);
    [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
        .map(|(x, y)| Pixel::new(x, y))
        .map(|corner| (corner, corner.distance(from)))
        .into_iter()
        .fold((from, 0.0), |best, each| if each.1 > best.1 { each } else { best })
}

pub(super) fn check(
    case: &Case<'_>,
    measured: Option<&Measured<'_>>,
) -> (Finding, DistortionState) {
    let mut finding = Finding::new(Code::TD203, Unit::Px);
    finding.tolerance = Some(case.tolerances.distortion_px);
    let flag = case.factory.and_then(|f| f.geometric_distortion_correction);
    let claim = match flag {
        Some(true) => " The file says that Apple's correction was on.",
        Some(false) => " The file says that Apple's correction was off.",
        None => "",
    };
    let record = "Record at least 10 frames with the board tilted by 20 to 40 degrees in different directions and \
                  reaching into the corners of the image.";
    let Some(measured) = measured else {
        finding.summary = format!(
            "Cannot tell whether the stream is rectified: {}.{claim}",
            case.why_no_camera()
        );
        finding.what_to_do = record.to_owned();
        return (finding, DistortionState::Unknown);
    };
    let displacement = measured.displacement_px();
    finding.verdict = Verdict::of(displacement, case.tolerances.distortion_px);
    finding.value = Some(displacement.value);
    finding.sigma = Some(displacement.sigma);
    let joint = &measured.joint;
    let radius_px = measured.radius_px;
    // Where both cameras were calibrated in full, their residuals are the better witnesses.
    let fitted = (fitted_rms(case, Model::Focal), fitted_rms(case, Model::FocalTable));
    let (rms_rectified_px, rms_distorted_px) = match fitted {
        (Some(rectified), Some(distorted)) => (rectified, distorted),
        _ => (joint.rms_without_px, joint.rms_with_px),
    };
    finding.evidence = vec![
        Evidence::number("reference_radius_px", radius_px),
        Evidence::number("rms_as_rectified_px", rms_rectified_px),
        Evidence::number("rms_as_distorted_px", rms_distorted_px),
        Evidence::number("n_views", joint.n_views as f64),
        Evidence::number("n_corners", joint.n_corners as f64),
    ];
    let Estimate { value, sigma } = displacement;
    let numbers = match measured.shape {
        Shape::Table(_) => {
            let amount = joint.amount;
            finding.evidence.push(Evidence::estimate("table_amount", amount));
            finding.evidence.push(Evidence::number("table_at_corner_px", measured.reference_px));
            format!(
                "{:.0} % +- {:.0} % of the distortion in Apple's table is in the images, {value:+.2} +- {sigma:.2} px \
                 at the image's corner; residuals are {:.2} px taken as rectified and {:.2} px with the table applied",
                (100.0 * amount.value).round() + 0.0, // no "-0"
                100.0 * amount.sigma,
                rms_rectified_px,
                rms_distorted_px,
            )
        }
        Shape::Own(_) => format!(
            "the corners ask for a lens distortion of {value:.2} +- {sigma:.2} px at {radius_px:.0} px from the \
             centre, within \
             which nine of ten corners lie; residuals are {:.2} px without and {:.2} px with it. The recording has no \
             table to compare with",
            joint.rms_without_px, joint.rms_with_px,
        ),
        Shape::Cubic { .. } => format!(
            "a cubic lens distortion comes out as {value:+.2} +- {sigma:.2} px at {radius_px:.0} px from the centre, \
             within \
             which nine of ten corners lie; residuals are {:.2} px without and {:.2} px with it. The recording has no \
             table to compare with",
            joint.rms_without_px, joint.rms_px,
        ),
    };
    // A table is in the stream or is not: once half of it can be excluded on both sides the stream is rectified, even
    // where a table of 70 px leaves room for a pixel.
    let table_excluded = matches!(measured.shape, Shape::Table(_))
        && joint.amount.value.abs() + 3.0 * joint.amount.sigma < 0.5;
    let mut remainder = "";
    if table_excluded && finding.verdict == Verdict::Unknown {
        finding.verdict = Verdict::Info;
        remainder = ". A remainder of more than the tolerance is not excluded";
    } else if table_excluded && finding.verdict == Verdict::Fault {
        // Not the table's doing, and perhaps the board's: a fact, but no state of the stream that could be undone.
        finding.verdict = Verdict::Warning;
        remainder = ". What remains is more than the tolerance";
    }
    let (state, verdict_words) = match finding.verdict {
        Verdict::Fault if value < 0.0 && matches!(measured.shape, Shape::Table(_)) => {
            (DistortionState::RectifiedTwice, "The stream was rectified twice")
        }
        Verdict::Fault => (DistortionState::Distorted, "The stream is not rectified"),
        Verdict::Ok | Verdict::Info | Verdict::Warning => {
            (DistortionState::Rectified, "The stream is rectified")
        }
        Verdict::Unknown => {
            (DistortionState::Unknown, "Cannot tell whether the stream is rectified")
        }
    };
    finding.summary = format!("{verdict_words}: {numbers}{remainder}.{claim}");
    match state {
        DistortionState::Distorted => {
            let tables = case.factory.and_then(|f| f.tables.clone()).map(Box::new);
            finding.what_to_do = if tables.is_some() {
                "Take corners and pixels through the inverse table before a pinhole is assumed, or resample colour and \
                 depth with the forward table. Depth is distorted just as colour is: every point off the axis lies \
                 sideways of where the pinhole puts it."
            } else {
                "Use the distortion of the own calibration, or record with an app that saves Apple's lookup tables. \
                 Depth is distorted just as colour is."
            }
            .to_owned();
            finding.correction = Some(Correction::Undistort { tables });
        }
        DistortionState::RectifiedTwice => {
            finding.what_to_do = "Do not apply the lookup table to this stream: it was straight already. Go back to \
                                  the images as recorded."
                .to_owned();
        }
        DistortionState::Rectified if value.abs() > 3.0 * sigma => {
            finding.what_to_do =
                "Nothing; do not apply the lookup tables to this stream.".to_owned();
        }
        DistortionState::Rectified => {}
        DistortionState::Unknown => finding.what_to_do = record.to_owned(),
    }
    (finding, state)
}

/// Residuals of a model that was fitted in full.
fn fitted_rms(case: &Case<'_>, model: Model) -> Option<f64> {
    case.calibration?.candidates.iter().find(|c| c.model == model).map(|c| c.rms_px)
}
