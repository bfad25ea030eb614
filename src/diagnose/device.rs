//! Which camera made a recording.

use super::{Registry, Sheet};
use crate::{
    calibrate::Estimate,
    measure::SAME_CAMERA,
    recording::{Factory, StreamState},
};

/// The kind of depth sensor. People often do not know which one they have, so every report says it first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sensor {
    /// The structured-light camera on the front.
    TrueDepth,
    /// The time-of-flight camera on the back.
    Lidar,
    /// The metadata do not say, or something else.
    Unknown,
}

impl Sensor {
    /// `TrueDepth`, `LiDAR` or `unknown`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::TrueDepth => "TrueDepth",
            Self::Lidar => "LiDAR",
            Self::Unknown => "unknown",
        }
    }
}

/// Which camera made a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    /// The kind of depth sensor.
    pub sensor: Sensor,
    /// `AVCaptureDeviceTypeBuiltInTrueDepthCamera` and the like, as in the files.
    pub device_type: Option<String>,
    /// Devices known to have this camera (reference dimensions and focal length as in the tables of
    /// arXiv:2201.10865), for people; `None` where no known device matches.
    pub model: Option<&'static str>,
}

impl Device {
    /// From what the factory says; unknown where it says nothing.
    pub fn from_factory(factory: Option<&Factory>) -> Self {
        let device_type = factory.and_then(|f| f.device_type.clone());
        let sensor = match device_type.as_deref() {
            Some(name) if name.contains("TrueDepth") => Sensor::TrueDepth,
            Some(name) if name.contains("LiDAR") => Sensor::Lidar,
            _ => Sensor::Unknown,
        };
        Self { sensor, device_type, model: factory.and_then(model) }
    }
}

/// The reference dimensions of a row of the registry whose focal length is near, and whose camera this is.
const CAMERAS: [(&str, &str); 5] = [
    (
        "ipad-12.9-5gen/ios15/av",
        "iPad Pro 11-inch 3rd or 12.9-inch 5th generation (12 MP ultra wide)",
    ),
    (
        "ipad-12.9-5gen/ios15/ar",
        "iPad Pro 11-inch 3rd or 12.9-inch 5th generation (12 MP ultra wide), by ARKit",
    ),
    ("ipad-12.9-4gen/v2/av", "iPad Pro 11-inch 2nd or 12.9-inch 4th generation (7 MP)"),
    ("ipad-12.9-4gen/v2/ar", "iPad Pro 11-inch 2nd or 12.9-inch 4th generation (7 MP), by ARKit"),
    ("iphone-11-pro/ios15/av", "iPhone 11 Pro or a later one with its front camera (12 MP)"),
];

/// Whose front camera has these numbers; `None` for any other camera.
fn model(factory: &Factory) -> Option<&'static str> {
    let sheet = Sheet::from_factory(factory)?;
    let registry = Registry::published();
    CAMERAS
        .iter()
        .find(|(row, _)| {
            registry.get(row).is_some_and(|known| {
                known.sheet.reference == sheet.reference
                    && (sheet.focal_px / known.sheet.focal_px - 1.0).abs() < SAME_CAMERA
            })
        })
        .map(|(_, name)| *name)
}

/// The depth map's state where `color` is the colour image's, by the share of the other state that depth has
/// ([`Registration::lens_share`](crate::depth::Registration::lens_share)): known where the share is on one side of
/// one half by 2 sigma, each with 97.7 % confidence.
pub fn depth_state(color: StreamState, lens_share: Option<Estimate>) -> StreamState {
    use StreamState::{Distorted, Rectified, Unknown};
    let Some(Estimate { value, sigma }) = lens_share else { return Unknown };
    let is_same = value.abs() + 2.0 * sigma < 0.5;
    // As for colour, what lies beyond the whole of the table is distorted all the more.
    let is_other = value - 2.0 * sigma > 0.5;
    match color {
        Rectified | Distorted if is_same => color,
        Rectified if is_other => Distorted,
        Distorted if is_other => Rectified,
        _ => Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;

    #[test]
    fn depth_is_as_colour_is_or_the_other_way() {
        use StreamState::{Distorted, Rectified, RectifiedTwice, Unknown};
        for (color, value, sigma, expected) in [
            (Rectified, 0.1, 0.1, Rectified),
            (Rectified, 0.9, 0.15, Distorted),
            (Distorted, -0.1, 0.15, Distorted),
            (Distorted, 1.3, 0.3, Rectified),
            (Distorted, -0.8, 0.1, Unknown),
            (Distorted, 0.5, 0.01, Unknown),
            (Rectified, 0.0, 0.3, Unknown),
            (Rectified, f64::NAN, 0.1, Unknown),
            (RectifiedTwice, 0.0, 0.1, Unknown),
            (Unknown, 0.0, 0.1, Unknown),
        ] {
            let share = Estimate { value, sigma };
            assert_eq!(depth_state(color, Some(share)), expected, "{color:?} {share:?}");
        }
        assert_eq!(depth_state(Rectified, None), Unknown);
    }

    #[test]
    fn known_cameras() {
        for (reference, focal_px, device_type, sensor, model) in [
            (
                [3088.0, 2316.0],
                595.34,
                "AVCaptureDeviceTypeBuiltInTrueDepthCamera",
                Sensor::TrueDepth,
                Some("4th"),
            ),
            (
                [2016.0, 1512.0],
                565.12,
                "AVCaptureDeviceTypeBuiltInTrueDepthCamera",
                Sensor::TrueDepth,
                Some("5th"),
            ),
            (
                [4032.0, 3024.0],
                436.50,
                "AVCaptureDeviceTypeBuiltInTrueDepthCamera",
                Sensor::TrueDepth,
                Some("11 Pro"),
            ),
            (
                [4032.0, 3024.0],
                500.00,
                "AVCaptureDeviceTypeBuiltInLiDARDepthCamera",
                Sensor::Lidar,
                None,
            ),
            (
                [1920.0, 1440.0],
                436.50,
                "AVCaptureDeviceTypeBuiltInDualCamera",
                Sensor::Unknown,
                None,
            ),
        ] {
            let intrinsics = Intrinsics {
                fx: focal_px,
                fy: focal_px,
                cx: 320.0,
                cy: 240.0,
                width: 640,
                height: 480,
            };
            let mut factory = Factory::pinhole(intrinsics);
            factory.reference_dimensions = Some(reference);
            factory.device_type = Some(device_type.to_owned());
            let device = Device::from_factory(Some(&factory));
            assert_eq!(device.sensor, sensor);
            assert_eq!(device.model.is_some(), model.is_some(), "{device:?}");
            assert!(
                device.model.unwrap_or_default().contains(model.unwrap_or_default()),
                "{device:?}"
            );
        }
        assert_eq!(Device::from_factory(None).sensor, Sensor::Unknown);
    }
}
