//! Which camera made a recording.

use crate::recording::Factory;

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
        Self { sensor, device_type, model: None }
    }
}

/// Whether the stream still carries the lens' distortion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DistortionState {
    /// Straight lines are straight.
    Rectified,
    /// As the lens drew it.
    Distorted,
    /// Bent the other way: the table was applied to a stream that was straight already.
    RectifiedTwice,
    /// The recording does not tell.
    Unknown,
}

impl DistortionState {
    /// `rectified`, `distorted`, `rectified_twice` or `unknown`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rectified => "rectified",
            Self::Distorted => "distorted",
            Self::RectifiedTwice => "rectified_twice",
            Self::Unknown => "unknown",
        }
    }
}
