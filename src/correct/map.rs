//! Where each pixel of the corrected image comes from.

use super::{Error, Plan, plan::Lens};
use crate::{camera::Intrinsics, geom::Pixel, recording::Factory};

/// The source pixel of every pixel of an image; NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelMap {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Source, row by row, pixels.
    pub source: Vec<[f32; 2]>,
}

impl PixelMap {
    /// The map of a function from pixels of the result to pixels of the source.
    pub fn new(width: usize, height: usize, source: impl Fn(Pixel) -> Option<Pixel>) -> Self {
        let mut map = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let at = source(Pixel::new(x as f64, y as f64));
                map.push(at.map_or([f32::NAN; 2], |p| [p.x as f32, p.y as f32]));
            }
        }
        Self { width, height, source: map }
    }
}

/// How one frame's pixels move under a plan: colour after mirroring back, depth after mirroring back.
pub(super) struct Geometry<'a> {
    plan: &'a Plan,
    factory: Option<&'a Factory>,
    /// The pinhole of the corrected frame.
    after: Option<Intrinsics>,
}

impl<'a> Geometry<'a> {
    /// Of a frame with this metadata; `place` names the recording in errors.
    pub(super) fn new(
        plan: &'a Plan,
        factory: Option<&'a Factory>,
        after: Option<Intrinsics>,
        place: &str,
    ) -> Result<Self, Error> {
        let missing = |step, what, remedy| {
            Err(Error::Missing { recording: place.to_owned(), step, what, remedy })
        };
        match plan.lens() {
            Some(Lens::OwnTables | Lens::OwnTablesTwice)
                if factory.is_none_or(|f| f.tables.is_none()) =>
            {
                return missing(
                    "undistort",
                    "Apple's lookup tables",
                    "give a calibration with distortion with --with",
                );
            }
            Some(Lens::Camera(camera)) => {
                if let Some(f) = factory {
                    camera.check_size([f.intrinsics.width, f.intrinsics.height], place)?;
                }
            }
            _ => {}
        }
        if plan.zoom() != [1.0; 2] && after.is_none() {
            return missing(
                "zoom",
                "a principal point",
                "record with an app that saves intrinsics",
            );
        }
        Ok(Self { plan, factory, after })
    }

    /// Where the corrected colour image's pixel comes from in the colour image (mirrored back).
    pub(super) fn color_source(&self, at: Pixel) -> Option<Pixel> {
        match self.plan.lens() {
            None => Some(at),
            Some(Lens::OwnTables) => self.factory?.tables.as_ref()?.distort(at),
            // Rectified once more, each pixel went where the inverse table says.
            Some(Lens::OwnTablesTwice) => self.factory?.tables.as_ref()?.forward.invert(at),
            Some(Lens::Camera(camera)) => camera.project_ray(self.after?.ray_from_pixel(at)),
        }
    }

    /// Where the corrected depth map's pixel comes from in the depth map (mirrored back).
    pub(super) fn depth_source(&self, at: Pixel) -> Option<Pixel> {
        let color = self.color_source(at)?;
        let ([zx, zy], [sx, sy]) = (self.plan.zoom(), self.plan.shift_px());
        let (cx, cy) = self.after.map_or((0.0, 0.0), |k| (k.cx, k.cy));
        Some(Pixel::new(cx + (color.x - cx) / zx + sx, cy + (color.y - cy) / zy + sy))
    }
}
