//! Synthetic recordings with ground truth and chosen faults.
//!
//! A [`Scene`] is a printed board on a wall before a camera; [`render`] takes its picture and says where the corners
//! truly are. Every pixel is the mean over its area in closed form, so that the truth is good to a thousandth of a
//! pixel: what a detector gets wrong on such an image is the detector's.
//!
//! ```
//! use truedepth::{
//!     camera::{Camera, Distortion, Intrinsics},
//!     geom::{Pose, Rotation, Vector3},
//!     simulate::{Scene, render},
//! };
//!
//! let board = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL:legacy".parse()?;
//! let intrinsics = Intrinsics { fx: 565.1, fy: 565.1, cx: 320.6, cy: 241.2, width: 640, height: 480 };
//! let camera = Camera { intrinsics, distortion: Distortion::None };
//! let color_from_board = Pose::new(Rotation::identity(), Vector3::new(-0.104, -0.084, 0.3));
//! let mut scene = Scene::ideal(board, camera, color_from_board);
//! scene.blur_sigma_px = 0.6;
//! let rendered = render(&scene, 1);
//! assert_eq!(rendered.corners.len(), 63);
//! let pixel = rendered.corners[0].pixel;
//! assert!((pixel.x - (320.6 - 565.1 * (0.104 - 0.020875) / 0.3)).abs() < 1e-9);
//! # Ok::<(), truedepth::board::Error>(())
//! ```
//!
//! A [`Plan`] makes a whole recording: a [`Device`] with chosen [`Faults`] is led along a [`Trajectory`], and
//! [`Plan::write`] puts images, depth maps, metadata, `board.toml` and `truth.json` ([`Truth`]) into a
//! [`Output`](crate::files::Output).
//!
//! ```
//! use truedepth::simulate::{Device, Faults, Plan};
//!
//! let mut plan = Plan::new(Device::named("ipad-12.9-5gen")?, 1);
//! plan.faults = Faults::parse(["focal=6.6%", "depth-scale=1.5%"])?;
//! let (factory, truth) = (plan.factory().intrinsics, plan.true_camera().intrinsics);
//! assert!((factory.fx / truth.fx - 1.066).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Everything is decided by the seed: the same scene and seed give the same bytes, whatever the number of threads.
//!
//! Not here: folders, and any judgement of what is found in a recording.

mod plan;

mod device;
mod fault;
mod glimpse;
mod trajectory;

mod scene;
mod surface;
mod wall;

mod print;
mod render;
mod sensor;

mod random;
mod truth;

pub use device::{Device, UnknownDevice};
pub use fault::Faults;
pub use glimpse::Glimpse;
pub use plan::{Plan, SimulatedFrame};
pub use render::{Rendered, render};
pub use scene::{Handedness, Light, Motion, Noise, Polarity, Print, Scene, Tone, TrueCorner};
pub use sensor::{DepthSensor, measure_depth};
pub use surface::Surface;
pub use trajectory::Trajectory;
pub use truth::{Corner, SCHEMA, TrueCamera, TrueDepth, TrueFrame, TrueTable, Truth};
pub use wall::{Office, Wall};
