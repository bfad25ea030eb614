//! What stands before the camera.

use super::{surface::Surface, wall::Wall};
use crate::{
    board::{CharucoBoard, Layout},
    camera::Camera,
    geom::{Board, Color, Pixel, Point, Pose, Vector3},
    math,
};

/// A printed board on a wall, the camera that looks at it, and the light.
///
/// [`Scene::ideal`] makes one without blemish; every field may then be changed.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The board as designed.
    pub board: CharucoBoard,
    /// How it was printed.
    pub print: Print,
    /// How far the print is from flat.
    pub surface: Surface,
    /// What is round the sheet.
    pub wall: Wall,
    /// The camera as it truly is.
    pub camera: Camera,
    /// Where the board truly stands in the middle of the exposure.
    pub color_from_board: Pose<Color, Board>,
    /// How the board moves during the exposure.
    pub motion: Motion,
    /// Standard deviation of the lens's point spread (a Gaussian), pixels; 0 for a perfect lens. The area of a pixel
    /// blurs on top of it.
    pub blur_sigma_px: f64,
    /// How bright it is where.
    pub light: Light,
    /// From light to grey levels.
    pub tone: Tone,
    /// Noise of the image sensor.
    pub noise: Noise,
}

/// How a board was printed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Print {
    /// Which squares are white.
    pub layout: Layout,
    /// Which colour is which.
    pub polarity: Polarity,
    /// Whether it can be read.
    pub handedness: Handedness,
    /// White paper beyond the board on each side, metres.
    pub margin_m: f64,
    /// Reflectance of the ink, 0 to 1.
    pub ink: f64,
    /// Reflectance of the paper, 0 to 1.
    pub paper: f64,
}

/// Which colour of the print is which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polarity {
    /// As designed.
    BlackOnWhite,
    /// Black and white exchanged on the board; the paper round it stays white.
    WhiteOnBlack,
}

/// Whether a print can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handedness {
    /// As designed.
    AsDesigned,
    /// Left and right exchanged: what the design has at x is printed at width − x.
    Mirrored,
}

/// The board's movement relative to the camera in the course of the exposure, in the camera's frame. Half of it
/// happens before the pose of the scene, half after.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Rotation about the camera's centre, radians (a small rotation vector).
    pub rotation_rad: Vector3<f64>,
    /// Translation, metres.
    pub translation_m: Vector3<f64>,
}

impl Motion {
    /// Everything stands still.
    pub const NONE: Self = Self {
        rotation_rad: Vector3::new(0.0, 0.0, 0.0),
        translation_m: Vector3::new(0.0, 0.0, 0.0),
    };

    /// How a point moves during the exposure, metres.
    pub(super) fn of(&self, point: Point<Color>) -> Vector3<f64> {
        self.rotation_rad.cross(&point.coords) + self.translation_m
    }
}

/// Light on the scene. What the sensor receives is `exposure · reflectance · shading · tint + flare`, 1 being white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Light received from a perfectly white surface in the middle of the image.
    pub exposure: f64,
    /// Relative change of brightness from the image's left to its right side and from top to bottom.
    pub gradient: [f64; 2],
    /// Light lost at the farthest corner of the image, as a part of 1, growing with the square of the distance.
    pub vignetting: f64,
    /// Relative brightness of red, green and blue.
    pub tint: [f64; 3],
    /// Light scattered over the whole image, per colour: why black is not 0.
    pub flare: [f64; 3],
}

impl Light {
    /// White, the same everywhere.
    pub const EVEN: Self = Self {
        exposure: 1.0,
        gradient: [0.0; 2],
        vignetting: 0.0,
        tint: [1.0; 3],
        flare: [0.0; 3],
    };
}

/// From light (0 to 1) to grey levels (0 to 255).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Grey levels are proportional to light: a pixel's value is the mean over its area.
    Linear,
    /// The curve of sRGB (IEC 61966-2-1), as cameras deliver.
    Srgb,
}

/// Noise of the image sensor, the same for all three colours of a pixel: cameras smooth colour noise away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// None but the rounding to whole grey levels.
    None,
    /// The same everywhere.
    Gray {
        /// Standard deviation, grey levels.
        sigma: f64,
    },
    /// Photons and electronics: a variance of `signal + read²` electrons, before the tone curve.
    Sensor {
        /// Electrons of a white pixel.
        full_well_e: f64,
        /// Read noise, electrons.
        read_e: f64,
    },
}

/// A corner of the board and where it truly is in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueCorner {
    /// Id as [`CharucoBoard::corner`] counts.
    pub id: usize,
    /// Its position in the middle of the exposure.
    pub pixel: Pixel,
}

impl Scene {
    /// A flat, fully legible print (grey levels 40 and 215) on a plain wall in even light, seen by this camera without
    /// blur, motion, tone curve and noise. The new layout where the board does not state its own.
    pub fn ideal(
        board: CharucoBoard,
        camera: Camera,
        color_from_board: Pose<Color, Board>,
    ) -> Self {
        let print = Print {
            layout: board.layout.unwrap_or(Layout::New),
            polarity: Polarity::BlackOnWhite,
            handedness: Handedness::AsDesigned,
            margin_m: board.square_m,
            ink: 40.0 / 255.0,
            paper: 215.0 / 255.0,
        };
        Self {
            board,
            print,
            surface: Surface::FLAT,
            wall: Wall::Plain { reflectance: 190.0 / 255.0 },
            camera,
            color_from_board,
            motion: Motion::NONE,
            blur_sigma_px: 0.0,
            light: Light::EVEN,
            tone: Tone::Linear,
            noise: Noise::None,
        }
    }

    /// The inner corner with this id on the print as it is: mirrored and bent as the scene says.
    pub fn printed_corner(&self, id: usize) -> Point<Board> {
        let flat = self.board.corner(id);
        let width_m = self.board.squares_x as f64 * self.board.square_m;
        let x = match self.print.handedness {
            Handedness::AsDesigned => flat.x(),
            Handedness::Mirrored => width_m - flat.x(),
        };
        Point::new(x, flat.y(), self.surface.height_m(&self.board, x, flat.y()))
    }

    /// Where the corners truly are, by ascending id: those within the image's area (from −0.5 to width − 0.5), where
    /// the camera sees the printed side.
    pub fn corners(&self) -> Vec<TrueCorner> {
        let (width, height) = (self.camera.intrinsics.width, self.camera.intrinsics.height);
        let inside = |p: Pixel| {
            (-0.5..=width as f64 - 0.5).contains(&p.x)
                && (-0.5..=height as f64 - 0.5).contains(&p.y)
        };
        let camera_in_board = self.color_from_board.inverse().translation;
        if !(camera_in_board.z < 0.0) {
            return Vec::new(); // Seen from behind.
        }
        (0..self.board.n_corners())
            .filter_map(|id| {
                let pixel = self.camera.project(self.color_from_board * self.printed_corner(id))?;
                inside(pixel).then_some(TrueCorner { id, pixel })
            })
            .collect()
    }
}

/// Where rays meet the board.
pub(super) struct Sight<'a> {
    scene: &'a Scene,
    /// The camera's centre in the board's frame, metres.
    center: Vector3<f64>,
    board_from_color: nalgebra::Matrix3<f64>,
}

/// Where a ray meets the board.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Position in the plane of the board, squares.
    pub(super) square: [f64; 2],
    /// Depth (z in the camera's frame), metres.
    pub(super) depth_m: f64,
}

/// What a depth sensor sees along one ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Depth (z in the camera's frame), metres.
    pub(super) depth_m: f64,
    /// Cosine of the angle between the ray and the normal of what it meets.
    pub(super) cos_incidence: f64,
    /// Distance to the next step in depth, pixels.
    pub(super) edge_px: f64,
    /// Position in the plane of the board, squares.
    pub(super) square: [f64; 2],
}

impl<'a> Sight<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let inverse = scene.color_from_board.inverse();
        Self { scene, center: inverse.translation, board_from_color: *inverse.rotation.matrix() }
    }

    /// Where the ray through this pixel meets the printed surface or its continuation; `None` where it passes the
    /// board's plane, where the board is seen from behind, and outside the lens's domain.
    pub(super) fn hit(&self, pixel: Pixel) -> Option<Hit> {
        self.hit_ray(self.scene.camera.unproject(pixel)?)
    }

    fn hit_ray(&self, [u, v]: [f64; 2]) -> Option<Hit> {
        let surface = &self.scene.surface;
        let mut hit = self.plane(u, v, 0.0)?;
        if !surface.is_flat() {
            // The slope of the sheet is a few per cent: each round is wrong by that factor less.
            for _ in 0..5 {
                let [x, y] = hit.square.map(|s| s * self.scene.board.square_m);
                hit = self.plane(u, v, surface.height_m(&self.scene.board, x, y))?;
            }
        }
        Some(hit)
    }

    /// Where the ray of this pixel meets the plane of the board.
    pub(super) fn hit_plane(&self, pixel: Pixel) -> Option<Hit> {
        let [u, v] = self.scene.camera.unproject(pixel)?;
        self.plane(u, v, 0.0)
    }

    /// What a depth sensor sees along the ray of this pixel: the sheet, the wall or what stands out from it.
    pub(super) fn seen(&self, pixel: Pixel) -> Option<Seen> {
        let Scene { board, print, wall, camera, .. } = self.scene;
        let [u, v] = camera.unproject(pixel)?;
        let mut hit = self.hit_ray([u, v])?;
        let at = hit.square.map(|s| s * board.square_m);
        let on_sheet = |u_m: f64, squares: usize| {
            let size_m = squares as f64 * board.square_m;
            (-print.margin_m..=size_m + print.margin_m).contains(&u_m)
        };
        let mut edge_px = f64::INFINITY;
        if !(on_sheet(at[0], board.squares_x) && on_sheet(at[1], board.squares_y)) {
            hit = self.plane(u, v, wall.depth_behind_m(at))?;
            let pixel_m = hit.depth_m / camera.intrinsics.focal_px();
            edge_px = wall.edge_distance_m(at) / pixel_m;
        }
        let m = &self.board_from_color;
        let towards = m[(2, 0)] * u + m[(2, 1)] * v + m[(2, 2)];
        let cos_incidence = towards / (u * u + v * v + 1.0).sqrt();
        Some(Seen { depth_m: hit.depth_m, cos_incidence, edge_px, square: hit.square })
    }

    fn plane(&self, u: f64, v: f64, height_m: f64) -> Option<Hit> {
        let m = &self.board_from_color;
        let direction = |row: usize| m[(row, 0)] * u + m[(row, 1)] * v + m[(row, 2)];
        let (towards, way) = (direction(2), height_m - self.center.z);
        if !(towards > 0.0 && way > 0.0) {
            return None;
        }
        let depth_m = way / towards;
        let per_square = 1.0 / self.scene.board.square_m;
        Some(Hit {
            square: [
                (self.center.x + depth_m * direction(0)) * per_square,
                (self.center.y + depth_m * direction(1)) * per_square,
            ],
            depth_m,
        })
    }

    /// How much the density of board per pixel changes from one side of a pixel to the other, at most, where the board
    /// is in the image. It is what remains between the mean over a pixel's trace on the board and the mean over the
    /// pixel.
    pub(super) fn density_change(&self) -> f64 {
        // The density goes as the cube of the distance to the plane's vanishing line, a linear function of the ray.
        let [a, b, c] = [0, 1, 2].map(|column| self.board_from_color[(2, column)]);
        let focal_px = self.scene.camera.intrinsics.focal_px();
        self.scene
            .corners()
            .iter()
            .filter_map(|corner| self.scene.camera.unproject(corner.pixel))
            .map(|[u, v]| 3.0 * math::hypot(a, b) / ((a * u + b * v + c).abs() * focal_px))
            .fold(0.0, f64::max)
    }
}
