//! A calibration as other programs read it.
//!
//! [`calibration`] writes a camera in one of several [`Format`]s. What a format's lens model cannot hold is fitted to
//! the nearest that it can, and how far off that is over the image comes with the text ([`Exported::residual`]):
//!
//! | format | lens | pixel centres |
//! |---|---|---|
//! | OpenCV `FileStorage` YAML | k1 k2 p1 p2 k3, for tables also k4 k5 k6 | integers |
//! | Kalibr `camchain.yaml` | radtan: k1 k2 p1 p2 | integers |
//! | mrcal `.cameramodel` | `LENSMODEL_OPENCV5`, for tables `OPENCV8` | integers |
//! | COLMAP `cameras.txt` | `FULL_OPENCV` | half integers: centres are written +0.5 |
//! | ROS `camera_info` YAML | `plumb_bob`, for tables `rational_polynomial` | integers |
//! | Open3D pinhole JSON | none: for images that have been straightened | integers |
//!
//! ```
//! use truedepth::camera::{Brown, Camera, Distortion, Intrinsics};
//! use truedepth::wire::export::{Format, calibration};
//!
//! let intrinsics = Intrinsics { fx: 530.0, fy: 530.0, cx: 320.5, cy: 241.25, width: 640, height: 480 };
//! let camera = Camera { intrinsics, distortion: Distortion::Brown(Brown { k1: 0.07, ..Brown::ZERO }) };
//! let colmap = calibration(&camera, "ipad", Format::Colmap);
//! assert!(colmap.text.contains("1 FULL_OPENCV 640 480 530.0 530.0 321.0 241.75 0.07 "));
//! assert!(colmap.residual.is_none());
//! assert!(calibration(&camera, "ipad", Format::Open3d).residual.unwrap().max_px > 1.0);
//! ```
//!
//! Not here: point clouds and images; files (the caller writes the text); this project's own JSON
//! ([`wire`](crate::wire)).

mod lens;
mod text;

pub use lens::Residual;

use crate::camera::Camera;

/// What to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Format {
    /// YAML of OpenCV's `FileStorage`: `camera_matrix`, `distortion_coefficients`.
    OpenCv,
    /// Kalibr's `camchain.yaml`.
    Kalibr,
    /// mrcal's `.cameramodel`.
    Mrcal,
    /// COLMAP's `cameras.txt`.
    Colmap,
    /// YAML of ROS' `camera_calibration_parsers`, read by `camera_info_manager`.
    Ros,
    /// Open3D's `PinholeCameraIntrinsic`.
    Open3d,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::OpenCv, Self::Kalibr, Self::Mrcal, Self::Colmap, Self::Ros, Self::Open3d];

    /// `opencv`, `kalibr`, `mrcal`, `colmap`, `ros` or `open3d`: what is typed.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OpenCv => "opencv",
            Self::Kalibr => "kalibr",
            Self::Mrcal => "mrcal",
            Self::Colmap => "colmap",
            Self::Ros => "ros",
            Self::Open3d => "open3d",
        }
    }

    /// The numbers of OpenCV's lens that it holds, of k1 k2 p1 p2 k3 k4 k5 k6 the first so many.
    const fn n_lens(self) -> usize {
        match self {
            Self::OpenCv | Self::Mrcal | Self::Colmap | Self::Ros => 8,
            Self::Kalibr => 4,
            Self::Open3d => 0,
        }
    }
}

/// A calibration in words of another program.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The whole file.
    pub text: String,
    /// How far the lens written is from the one calibrated; `None` where the format holds it exactly.
    pub residual: Option<Residual>,
}

/// A camera in this format, under this name where the format has one.
///
/// The pinhole is never changed: a lens that the format does not hold is replaced by the nearest one it does, by least
/// squares of the pixels over the image.
pub fn calibration(camera: &Camera, name: &str, format: Format) -> Exported {
    let (lens, residual) = lens::nearest(camera, format.n_lens());
    let file = text::File { intrinsics: &camera.intrinsics, lens, residual, name: plain(name) };
    let text = match format {
        Format::OpenCv => file.opencv(),
        Format::Kalibr => file.kalibr(),
        Format::Mrcal => file.mrcal(),
        Format::Colmap => file.colmap(),
        Format::Ros => file.ros(),
        Format::Open3d => file.open3d(),
    };
    Exported { text, residual }
}

/// A name that needs no quotes anywhere.
fn plain(name: &str) -> String {
    let plain: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' })
        .collect();
    if plain.is_empty() { "camera".to_owned() } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        camera::{Brown, Distortion, Intrinsics, RadialTable, TablePair},
        geom::Pixel,
    };

    /// What `tests/golden/export/verify.py` reads back with the programs themselves.
    const GOLDEN: [(Format, &str); 6] = [
        (Format::OpenCv, "opencv.yml"),
        (Format::Kalibr, "camchain.yaml"),
        (Format::Mrcal, "mrcal.cameramodel"),
        (Format::Colmap, "cameras.txt"),
        (Format::Ros, "ros.yaml"),
        (Format::Open3d, "open3d.json"),
    ];

    fn camera(distortion: Distortion) -> Camera {
        let intrinsics = Intrinsics {
            fx: 595.25,
            fy: 596.5,
            cx: 318.375,
            cy: 239.9375,
            width: 640,
            height: 480,
        };
        Camera { intrinsics, distortion }
    }

    #[test]
    fn as_the_files_that_were_read_back() {
        let lens = Brown { k1: 0.07, k2: -0.0825, p1: 0.00025, p2: -0.00125, k3: 0.0000125 };
        let camera = camera(Distortion::Brown(lens));
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/export");
        for (format, file) in GOLDEN {
            let exported = calibration(&camera, "iPad Pro 12.9\"", format);
            if std::env::var_os("UPDATE_GOLDEN").is_some() {
                std::fs::write(folder.join(file), &exported.text).unwrap();
            }
            let golden = std::fs::read_to_string(folder.join(file)).unwrap();
            assert_eq!(
                exported.text, golden,
                "{file}: if that is meant, run with UPDATE_GOLDEN=1 and verify.py"
            );
            assert_eq!(exported.residual.is_some(), format.n_lens() < 8, "{}", format.name());
        }
    }

    #[test]
    fn a_table_is_fitted_and_the_residual_said() {
        let center = Pixel::new(317.5, 240.5);
        let magnification = (0..42)
            .map(|i| {
                let s = (f64::from(i) / 41.0).powi(2);
                -0.011 * s * (1.0 - 0.1 * s)
            })
            .collect();
        let radius = RadialTable::farthest_corner_px(center, 640, 480);
        let table = RadialTable::new(center, radius, magnification).unwrap();
        let camera = camera(Distortion::Table(TablePair::from_inverse(table)));
        let (lens, residual) = lens::nearest(&camera, 8);
        let [fewer, residual] = [lens::nearest(&camera, 5).1.unwrap(), residual.unwrap()];
        assert!(fewer.max_px < 0.05 && fewer.rms_px < 0.02, "{fewer:?}");
        assert!(residual.rms_px <= fewer.rms_px, "{residual:?} {fewer:?}");
        // As it says: both cameras beside each other.
        let mut worst: f64 = 0.0;
        for (x, y) in (0..=31).flat_map(|i| (0..=23).map(move |j| (i * 20, j * 20))) {
            let pixel = Pixel::new(f64::from(x), f64::from(y));
            let again = lens::drawn(&lens, camera.unproject(pixel).unwrap());
            worst = worst.max(camera.intrinsics.pixel_from_ray(again).distance(pixel));
        }
        assert!(worst < 1.1 * residual.max_px && worst > 0.3 * residual.max_px, "{worst}");
        let pinhole = lens::nearest(&camera, 0).1.unwrap();
        assert!((pinhole.max_px - 0.0099 * radius).abs() < 0.1, "{pinhole:?}");
        assert!(calibration(&camera, "", Format::Kalibr).text.contains("differs by"));
    }

    #[test]
    fn a_straight_image_needs_no_lens() {
        for format in Format::ALL {
            let exported = calibration(&camera(Distortion::None), "x", format);
            assert!(exported.residual.is_none(), "{}", format.name());
            assert!(!exported.text.contains("differs"));
        }
    }
}
