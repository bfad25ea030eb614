//! Devices to choose from.

use crate::{
    camera::{Intrinsics, RadialTable, TablePair},
    geom::Pixel,
    math,
    recording::{Factory, StreamState},
};

/// A device as its own metadata describe it, and its lens.
///
/// Focal lengths, centres and reference dimensions are those of arXiv:2201.10865 (AVFoundation, iOS 15 or "V2" where
/// there are two); of the iPhone 12 and 13 the paper has the focal length only, their other numbers repeat the iPhone
/// 11 Pro's. The lenses are made up, of the size of the real ones: Apple's tables are Apple's.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    /// As it is asked for, like `ipad-12.9-5gen`.
    pub name: &'static str,
    /// As it is sold.
    pub product: &'static str,
    /// `intrinsicMatrixReferenceDimensions`, pixels.
    pub reference: [usize; 2],
    /// Focal length at the reference dimensions, pixels.
    pub focal_px: f64,
    /// Principal point at the reference dimensions, pixels.
    pub center: Pixel,
    /// Distortion centre at the reference dimensions, pixels.
    pub distortion_center: Pixel,
    /// Whether images are delivered rectified (`GeometricDistortionCorrectionEnabled`).
    pub stream: StreamState,
    /// The lens: forward magnification minus one is Σ c_k ρ^(2k), ρ the distance from the distortion centre over that
    /// of the farthest corner.
    pub lens: [f64; 5],
    /// Whether the app wrote the lookup tables. The one of 2021 did not.
    pub tables_in_file: bool,
}

/// A name that no device has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not a known device; known are {known}", known = Device::ALL.map(|d| d.name).join(", "))]
pub struct UnknownDevice {
    /// As given.
    pub name: String,
}

/// Up to 1 % in, as on the older iPads.
const MILD: [f64; 5] = [0.0, 0.0, 0.10, -0.19, 0.10];
/// Up to 1 % half way out, less at the corner.
const PHONE: [f64; 5] = [0.0, 0.035, -0.030, 0.0, 0.0];
/// The ultra-wide lens of the newer iPads: a barrel of 10 % at the corner, before correction.
const ULTRA_WIDE: [f64; 5] = [0.002, -0.085, -0.015, 0.0, 0.0];

const IPHONE_11_PRO: Device = Device {
    name: "iphone-11-pro",
    product: "iPhone 11 Pro",
    reference: [4032, 3024],
    focal_px: 2750.68,
    center: Pixel::new(2026.13, 1508.71),
    distortion_center: Pixel::new(2026.13, 1508.71),
    stream: StreamState::Distorted,
    lens: PHONE,
    tables_in_file: false,
};

impl Device {
    /// All that are known. Their names stay.
    pub const ALL: [Self; 8] = [
        Self {
            name: "ipad-12.9-5gen",
            product: "iPad Pro 12.9-inch (5th generation)",
            reference: [2016, 1512],
            focal_px: 1780.13,
            center: Pixel::new(1009.89, 759.69),
            distortion_center: Pixel::new(1009.73, 759.42),
            stream: StreamState::Rectified,
            lens: ULTRA_WIDE,
            tables_in_file: true,
        },
        Self {
            name: "ipad-12.9-4gen",
            product: "iPad Pro 12.9-inch (4th generation)",
            reference: [3088, 2316],
            focal_px: 2872.52,
            center: Pixel::new(1535.93, 1157.79),
            distortion_center: Pixel::new(1535.93, 1157.79),
            stream: StreamState::Distorted,
            lens: MILD,
            tables_in_file: true,
        },
        Self {
            name: "ipad-11-3gen",
            product: "iPad Pro 11-inch (3rd generation)",
            reference: [2016, 1512],
            focal_px: 1784.44,
            center: Pixel::new(1014.24, 757.43),
            distortion_center: Pixel::new(1013.80, 757.30),
            stream: StreamState::Rectified,
            lens: ULTRA_WIDE,
            tables_in_file: true,
        },
        Self {
            name: "ipad-11-2gen",
            product: "iPad Pro 11-inch (2nd generation)",
            reference: [3088, 2316],
            focal_px: 2882.66,
            center: Pixel::new(1541.02, 1155.53),
            distortion_center: Pixel::new(1541.02, 1155.53),
            stream: StreamState::Distorted,
            lens: MILD,
            tables_in_file: true,
        },
        IPHONE_11_PRO,
        Self {
            name: "iphone-12",
            product: "iPhone 12",
            focal_px: 434.93 * 6.3,
            tables_in_file: true,
            ..IPHONE_11_PRO
        },
        Self {
            name: "iphone-12-pro",
            product: "iPhone 12 Pro",
            focal_px: 434.76 * 6.3,
            tables_in_file: true,
            ..IPHONE_11_PRO
        },
        Self {
            name: "iphone-13",
            product: "iPhone 13",
            focal_px: 433.73 * 6.3,
            tables_in_file: true,
            ..IPHONE_11_PRO
        },
    ];

    /// Columns of colour images and depth maps.
    pub const WIDTH: usize = 640;
    /// Rows of colour images and depth maps.
    pub const HEIGHT: usize = 480;
    /// Samples of a lookup table, as Apple has them.
    const SAMPLES: usize = 42;

    /// The device of this name.
    pub fn named(name: &str) -> Result<Self, UnknownDevice> {
        let found = Self::ALL.into_iter().find(|device| device.name == name.trim());
        found.ok_or_else(|| UnknownDevice { name: name.to_owned() })
    }

    /// The factory's intrinsics at 640x480, scaled as the app does: by the ratio of the sizes, without a half-pixel
    /// shift.
    pub fn factory_intrinsics(&self) -> Intrinsics {
        let [x, y] = self.scale();
        Intrinsics {
            fx: self.focal_px * x,
            fy: self.focal_px * y,
            cx: self.center.x * x,
            cy: self.center.y * y,
            width: Self::WIDTH,
            height: Self::HEIGHT,
        }
    }

    /// Both lookup tables at 640x480: the lens's polynomial, and its inverse solved for at the radii of the samples.
    pub fn tables(&self) -> TablePair {
        let [x, y] = self.scale();
        let center = Pixel::new(self.distortion_center.x * x, self.distortion_center.y * y);
        let radius_px = RadialTable::farthest_corner_px(center, Self::WIDTH, Self::HEIGHT);
        let sample = |i: usize| i as f64 / (Self::SAMPLES - 1) as f64;
        // Apple's numbers are 32 bit.
        let table = |magnification: &dyn Fn(f64) -> f64| RadialTable {
            center,
            max_radius_px: radius_px,
            magnification: (0..Self::SAMPLES)
                .map(|i| f64::from(magnification(sample(i)) as f32))
                .collect(),
        };
        TablePair {
            forward: table(&|rho| self.magnification(rho)),
            inverse: table(&|rho| self.inverse_magnification(rho)),
        }
    }

    /// What the metadata say. `rectified` is what they say of the stream.
    pub(super) fn factory(&self, rectified: bool) -> Factory {
        let intrinsics = self.factory_intrinsics();
        let tables = self.tables();
        let half_angle_rad = math::atan(Self::WIDTH as f64 / 2.0 / intrinsics.fx);
        Factory {
            intrinsics,
            reference_dimensions: Some(self.reference.map(|n| n as f64)),
            distortion_center: Some(tables.inverse.center),
            tables: self.tables_in_file.then_some(tables),
            pixel_size_m: Some(1e-6),
            extrinsics: Some([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]),
            depth_absolute: Some(true),
            depth_filtered: Some(false),
            geometric_distortion_correction: Some(rectified),
            device_type: Some("AVCaptureDeviceTypeBuiltInTrueDepthCamera".to_owned()),
            field_of_view_rad: Some(2.0 * half_angle_rad),
        }
    }

    fn scale(&self) -> [f64; 2] {
        let [width, height] = self.reference;
        [Self::WIDTH as f64 / width as f64, Self::HEIGHT as f64 / height as f64]
    }

    /// The lens: rectilinear → distorted.
    fn magnification(&self, rho: f64) -> f64 {
        let q = rho * rho;
        self.lens.iter().rev().fold(0.0, |sum, c| sum * q + c)
    }

    /// Its inverse: the magnification that takes the distorted radius `rho` back to the rectilinear one.
    fn inverse_magnification(&self, rho: f64) -> f64 {
        if rho == 0.0 {
            return 1.0 / (1.0 + self.lens[0]) - 1.0;
        }
        // All lenses here increase over [0, 1.5 ρ] and move no point by more than a fifth.
        let (mut low, mut high) = (rho * 0.8, rho * 1.25);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            if middle * (1.0 + self.magnification(middle)) < rho {
                low = middle;
            } else {
                high = middle;
            }
        }
        f64::midpoint(low, high) / rho - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factory_numbers_are_the_papers() {
        // Section 5.1 and the published recordings, at 640x480.
        for (name, focal_px) in [
            ("ipad-12.9-5gen", 565.12),
            ("ipad-12.9-4gen", 595.34),
            ("ipad-11-3gen", 566.49),
            ("ipad-11-2gen", 597.44),
            ("iphone-11-pro", 436.61),
            ("iphone-13", 433.73),
        ] {
            let found = Device::named(name).unwrap().factory_intrinsics().fx;
            assert!((found - focal_px).abs() < 0.01, "{name}: {found}");
        }
        let error = Device::named("ipad-5").unwrap_err().to_string();
        assert!(error.contains("ipad-12.9-5gen, ipad-12.9-4gen"), "{error}");
    }

    #[test]
    fn tables_undo_each_other() {
        for device in Device::ALL {
            let tables = device.tables();
            assert!(
                RadialTable::new(
                    tables.inverse.center,
                    tables.inverse.max_radius_px,
                    tables.inverse.magnification.clone()
                )
                .is_ok()
            );
            // As Apple's own pairs: to some hundredths of a pixel, because both are interpolated linearly.
            let mismatch_px = tables.forward_mismatch_px().expect("inside the domain");
            assert!(mismatch_px < 0.1, "{}: {mismatch_px} px", device.name);
            let largest = tables.forward.magnification.iter().map(|m| m.abs()).fold(0.0, f64::max);
            let expected =
                if device.stream == StreamState::Rectified { 0.05..0.12 } else { 0.008..0.012 };
            assert!(expected.contains(&largest), "{}: {largest}", device.name);
        }
    }
}
