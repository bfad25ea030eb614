//! The files themselves: short, and written by hand.

use super::{Residual, lens::Numbers};
use crate::camera::Intrinsics;

/// What goes into a file.
pub(super) struct File<'a> {
    pub(super) intrinsics: &'a Intrinsics,
    pub(super) lens: Numbers,
    pub(super) residual: Option<Residual>,
    pub(super) name: String,
}

/// A number that every reader takes for a real one: with a point, without an exponent, to the last bit.
fn real(value: f64) -> String {
    let text = format!("{value}");
    if text.contains('.') { text } else { format!("{text}.0") }
}

fn list(values: &[f64]) -> String {
    values.iter().map(|v| real(*v)).collect::<Vec<_>>().join(", ")
}

impl File<'_> {
    fn matrix(&self) -> [f64; 9] {
        let Intrinsics { fx, fy, cx, cy, .. } = *self.intrinsics;
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    }

    /// k1 k2 p1 p2 k3, and k4 k5 k6 where there is a denominator.
    fn lens(&self) -> &[f64] {
        let has_denominator = self.lens[5..].iter().any(|k| *k != 0.0);
        &self.lens[..if has_denominator { 8 } else { 5 }]
    }

    /// What cannot be read off the numbers, as a comment.
    fn comment(&self, sign: &str) -> String {
        match self.residual {
            Some(Residual { rms_px, max_px }) => format!(
                "{sign} The lens written differs by {rms_px:.3} px (RMS; at most {max_px:.3} px) over the image from \
                 the one calibrated: this format does not hold it.\n"
            ),
            None => String::new(),
        }
    }

    /// <https://docs.opencv.org/4.x/da/d56/classcv_1_1FileStorage.html>, names as in OpenCV's calibration sample.
    pub(super) fn opencv(&self) -> String {
        let Intrinsics { width, height, .. } = self.intrinsics;
        let matrix = |rows: usize, cols: usize, data: &[f64]| {
            format!(
                "!!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {} ]\n",
                list(data)
            )
        };
        format!(
            "%YAML:1.0\n---\n{}image_width: {width}\nimage_height: {height}\ncamera_name: {}\ncamera_matrix: {}\
             distortion_coefficients: {}",
            self.comment("#"),
            self.name,
            matrix(3, 3, &self.matrix()),
            matrix(self.lens().len(), 1, self.lens()),
        )
    }

    /// <https://github.com/ethz-asl/kalibr/wiki/yaml-formats>
    pub(super) fn kalibr(&self) -> String {
        let Intrinsics { fx, fy, cx, cy, width, height } = *self.intrinsics;
        format!(
            "{}cam0:\n  camera_model: pinhole\n  intrinsics: [{}]\n  distortion_model: radtan\n  \
             distortion_coeffs: [{}]\n  resolution: [{width}, {height}]\n  rostopic: /{}/image_raw\n",
            self.comment("#"),
            list(&[fx, fy, cx, cy]),
            list(&self.lens[..4]),
            self.name,
        )
    }

    /// <https://mrcal.secretsauce.net/cameramodels.html>: a Python dictionary.
    pub(super) fn mrcal(&self) -> String {
        let Intrinsics { fx, fy, cx, cy, width, height } = *self.intrinsics;
        let mut numbers = vec![fx, fy, cx, cy];
        numbers.extend(self.lens());
        let n_lens = self.lens().len();
        format!(
            "{}{{\n    'lensmodel':  'LENSMODEL_OPENCV{n_lens}',\n\n    # fx, fy, cx, cy, k1, k2, p1, p2, k3 ...\n    \
             'intrinsics': [ {}, ],\n\n    'extrinsics': [ 0, 0, 0, 0, 0, 0, ],\n\n    'imagersize': [ {width}, \
             {height}, ],\n}}\n",
            self.comment("#"),
            list(&numbers),
        )
    }

    /// <https://colmap.github.io/format.html>; the centre of the first pixel is (0.5, 0.5) there.
    pub(super) fn colmap(&self) -> String {
        let Intrinsics { fx, fy, cx, cy, width, height } = *self.intrinsics;
        let mut numbers = vec![fx, fy, cx + 0.5, cy + 0.5];
        let model = if self.lens == [0.0; 8] {
            "PINHOLE"
        } else {
            numbers.extend(self.lens);
            "FULL_OPENCV"
        };
        let numbers: Vec<String> = numbers.into_iter().map(real).collect();
        format!(
            "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n{}\
             # Number of cameras: 1\n1 {model} {width} {height} {}\n",
            self.comment("#"),
            numbers.join(" "),
        )
    }

    /// <https://wiki.ros.org/camera_calibration_parsers>
    pub(super) fn ros(&self) -> String {
        let Intrinsics { width, height, .. } = self.intrinsics;
        let k = self.matrix();
        let projection = [k[0], 0.0, k[2], 0.0, 0.0, k[4], k[5], 0.0, 0.0, 0.0, 1.0, 0.0];
        let model = if self.lens().len() > 5 { "rational_polynomial" } else { "plumb_bob" };
        let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let matrix = |name: &str, rows: usize, cols: usize, data: &[f64]| {
            format!("{name}:\n  rows: {rows}\n  cols: {cols}\n  data: [{}]\n", list(data))
        };
        format!(
            "{}image_width: {width}\nimage_height: {height}\ncamera_name: {}\n{}distortion_model: {model}\n{}{}{}",
            self.comment("#"),
            self.name,
            matrix("camera_matrix", 3, 3, &k),
            matrix("distortion_coefficients", 1, self.lens().len(), self.lens()),
            matrix("rectification_matrix", 3, 3, &identity),
            matrix("projection_matrix", 3, 4, &projection),
        )
    }

    /// What `o3d.io.read_pinhole_camera_intrinsic` reads: the matrix by columns. JSON has no comments.
    pub(super) fn open3d(&self) -> String {
        let Intrinsics { fx, fy, cx, cy, width, height } = *self.intrinsics;
        format!(
            "{{\n  \"width\": {width},\n  \"height\": {height},\n  \"intrinsic_matrix\": [{}]\n}}\n",
            list(&[fx, 0.0, 0.0, 0.0, fy, 0.0, cx, cy, 1.0]),
        )
    }
}
