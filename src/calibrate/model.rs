//! Which parameters are free.

use super::surface::Surface;
use crate::camera::{Brown, Camera, Distortion, Intrinsics, RadialTable, TablePair};

/// Which parameters are free. In order of preference: where two predict equally well, the first is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Model {
    /// One focal length; principal point as the factory says, no distortion.
    Focal,
    /// As `Focal`, corners first taken through Apple's inverse table.
    FocalTable,
    /// One focal length and the principal point.
    FocalCentre,
    /// As `FocalCentre`, corners first taken through Apple's inverse table.
    FocalTableCentre,
    /// One focal length, principal point, k1 k2 p1 p2 k3.
    Brown,
    /// As `Brown`, with fy/fx free: for cameras whose factory says nothing.
    BrownAspect,
}

impl serde::Serialize for Model {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl Model {
    /// All of them, simplest first.
    pub const ALL: [Self; 6] = [
        Self::Focal,
        Self::FocalTable,
        Self::FocalCentre,
        Self::FocalTableCentre,
        Self::Brown,
        Self::BrownAspect,
    ];

    /// Those that [`Method::Auto`](super::Method::Auto) chooses from: Apple's pixels are square.
    pub const SQUARE: [Self; 5] =
        [Self::Focal, Self::FocalTable, Self::FocalCentre, Self::FocalTableCentre, Self::Brown];

    /// Those that ask nothing of the factory.
    pub const UNAIDED: [Self; 3] = [Self::FocalCentre, Self::Brown, Self::BrownAspect];

    /// `focal`, `focal+table`, `focal+centre`, `focal+table+centre`, `brown`, `brown+aspect`: stable, for people and
    /// machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Focal => "focal",
            Self::FocalTable => "focal+table",
            Self::FocalCentre => "focal+centre",
            Self::FocalTableCentre => "focal+table+centre",
            Self::Brown => "brown",
            Self::BrownAspect => "brown+aspect",
        }
    }

    /// True where it applies Apple's inverse table.
    pub const fn uses_table(self) -> bool {
        matches!(self, Self::FocalTable | Self::FocalTableCentre)
    }

    /// Its shape; `None` where it needs a table and there is none.
    pub(super) fn shape(self, tables: Option<&TablePair>, surface: Surface) -> Option<Shape<'_>> {
        let (center, warp) = match self {
            Self::Focal => (Center::Fixed, Warp::None),
            Self::FocalCentre => (Center::Free, Warp::None),
            Self::FocalTable => (Center::Fixed, Warp::Table(&tables?.inverse)),
            Self::FocalTableCentre => (Center::Free, Warp::Table(&tables?.inverse)),
            Self::Brown | Self::BrownAspect => (Center::Free, Warp::FreeBrown),
        };
        let aspect = if self == Self::BrownAspect { Aspect::Free } else { Aspect::Fixed };
        Some(Shape { center, warp, aspect, surface })
    }
}

/// Is the principal point free?
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Center {
    Fixed,
    Free,
}

/// Is fy/fx free?
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Aspect {
    Fixed,
    Free,
}

/// What lies between the stream and a pinhole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Warp<'a> {
    None,
    /// This table takes the stream to a pinhole's image.
    Table(&'a RadialTable),
    /// A free share of it does.
    FreeTable(&'a RadialTable),
    /// k1
    FreeRadial1,
    /// k1 k2
    FreeRadial2,
    /// k1 k2 p1 p2 k3
    FreeBrown,
}

/// A camera with some of its numbers free. The free ones are, in order: focal length along x; principal point x, y
/// (where free); those of the warp; fy/fx (where free); those of the board's surface that are not heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape<'a> {
    pub(super) center: Center,
    pub(super) warp: Warp<'a>,
    pub(super) aspect: Aspect,
    pub(super) surface: Surface,
}

const BROWN: [&str; 5] = ["k1", "k2", "p1", "p2", "k3"];

/// What the free numbers of the [`Model`]s are called.
pub(super) const NAMES: [&str; 9] =
    ["focal_px", "center_x_px", "center_y_px", "aspect", "k1", "k2", "p1", "p2", "k3"];

impl Shape<'_> {
    /// Names of the free numbers of the camera.
    pub(super) fn names(&self) -> Vec<&'static str> {
        let mut names = vec!["focal_px"];
        if self.center == Center::Free {
            names.extend(["center_x_px", "center_y_px"]);
        }
        names.extend(match self.warp {
            Warp::None | Warp::Table(_) => &[][..],
            Warp::FreeTable(_) => &["table_amplitude"],
            Warp::FreeRadial1 => &BROWN[..1],
            Warp::FreeRadial2 => &BROWN[..2],
            Warp::FreeBrown => &BROWN,
        });
        if self.aspect == Aspect::Free {
            names.push("aspect");
        }
        names
    }

    /// The free numbers of an undistorted camera with these intrinsics.
    pub(super) fn start(&self, intrinsics: &Intrinsics) -> Vec<f64> {
        let mut start = vec![intrinsics.fx];
        if self.center == Center::Free {
            start.extend([intrinsics.cx, intrinsics.cy]);
        }
        start.resize(self.names().len() + self.surface.n_shared(), 0.0);
        if self.aspect == Aspect::Free {
            let at = self.n_camera(&start) - 1;
            start[at] = intrinsics.fy / intrinsics.fx;
        }
        start
    }

    /// The intrinsics with these numbers; what is not free is the factory's.
    pub(super) fn intrinsics(&self, factory: &Intrinsics, free: &[f64]) -> Intrinsics {
        let [cx, cy] = match self.center {
            Center::Fixed => [factory.cx, factory.cy],
            Center::Free => [free[1], free[2]],
        };
        Intrinsics {
            fx: free[0],
            fy: free[0] * self.aspect_ratio(factory, free),
            cx,
            cy,
            ..*factory
        }
    }

    /// fy/fx
    pub(super) fn aspect_ratio(&self, factory: &Intrinsics, free: &[f64]) -> f64 {
        match self.aspect {
            Aspect::Fixed => factory.fy / factory.fx,
            Aspect::Free => free[self.n_camera(free) - 1],
        }
    }

    /// How many of the free numbers are the camera's.
    pub(super) fn n_camera(&self, free: &[f64]) -> usize {
        free.len() - self.surface.n_shared()
    }

    /// The free numbers of the warp.
    pub(super) fn warp_numbers<'f>(&self, free: &'f [f64]) -> &'f [f64] {
        let first = match self.center {
            Center::Fixed => 1,
            Center::Free => 3,
        };
        let last = self.n_camera(free) - usize::from(self.aspect == Aspect::Free);
        &free[first..last]
    }

    /// The free numbers of the board's surface but for its heights.
    pub(super) fn surface_numbers<'f>(&self, free: &'f [f64]) -> &'f [f64] {
        &free[self.n_camera(free)..]
    }

    /// The camera with these numbers.
    pub(super) fn camera(
        &self,
        factory: &Intrinsics,
        tables: Option<&TablePair>,
        free: &[f64],
    ) -> Camera {
        let numbers = self.warp_numbers(free);
        let distortion = match (self.warp, tables) {
            (Warp::None, _) => Distortion::None,
            (Warp::Table(table), Some(tables)) if *table == tables.inverse => {
                Distortion::Table(tables.clone())
            }
            (Warp::Table(table), _) => Distortion::Table(TablePair::from_inverse(table.clone())),
            (Warp::FreeTable(table), _) => {
                Distortion::Table(TablePair::from_inverse(table.scaled(numbers[0])))
            }
            (Warp::FreeRadial1 | Warp::FreeRadial2 | Warp::FreeBrown, _) => {
                Distortion::Brown(brown(numbers))
            }
        };
        Camera { intrinsics: self.intrinsics(factory, free), distortion }
    }
}

/// The first so many of k1 k2 p1 p2 k3, the others zero.
pub(super) fn brown(numbers: &[f64]) -> Brown {
    Brown::from_parameters(std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(0.0)))
}

/// The camera with a free number of its calibration changed. Numbers it does not know change nothing.
pub(crate) fn moved(camera: &Camera, name: &str, step: f64) -> Camera {
    let mut camera = camera.clone();
    let pinhole = &mut camera.intrinsics;
    match name {
        "focal_px" => {
            let aspect = pinhole.fy / pinhole.fx;
            pinhole.fx += step;
            pinhole.fy = pinhole.fx * aspect;
        }
        "center_x_px" => pinhole.cx += step,
        "center_y_px" => pinhole.cy += step,
        "aspect" => pinhole.fy += step * pinhole.fx,
        _ => {}
    }
    let brown_number = BROWN.iter().position(|k| *k == name);
    if let (Some(k), Distortion::Brown(lens)) = (brown_number, &mut camera.distortion) {
        let mut numbers = lens.parameters();
        numbers[k] += step;
        *lens = Brown::from_parameters(numbers);
    }
    camera
}
