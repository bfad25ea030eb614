//! Which device a sheet is of, and how sure that is.

use crate::math;

use super::{Entry, KnownIssue, Registry, Sheet};

/// How sure it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Certainty {
    /// Nothing in the registry has these reference dimensions.
    Unknown,
    /// The reference dimensions are those of a known camera, the focal length is not: another device with the same
    /// sensor, or one whose calibration is unlike all known.
    SensorOnly,
    /// Reference dimensions and focal length are those of a known camera; several devices may carry it.
    Camera,
    /// Principal point and focal length are those of one published unit: this very device.
    Unit,
}

impl Certainty {
    /// `unknown`, `sensor_only`, `camera` or `unit`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::SensorOnly => "sensor_only",
            Self::Camera => "camera",
            Self::Unit => "unit",
        }
    }
}

/// Which device it is.
#[derive(Clone, Debug)]
pub struct Identity<'a> {
    /// How sure.
    pub certainty: Certainty,
    /// The rows that match, the nearest focal length first.
    pub matches: Vec<&'a Entry>,
    /// Relative difference of the focal length to the nearest row's.
    pub focal_difference: Option<f64>,
    /// Issues that all matching rows are known to have.
    pub issues: Vec<KnownIssue>,
}

/// Devices of one kind scatter: the focal lengths of the four units with the ultra-wide camera lie within 0.6 %, of
/// the four with 7 megapixels within 0.5 %. An unseen unit may lie as far outside again.
const SAME_CAMERA: f64 = 0.01;
/// An update of the system moved focal lengths by 0.09 % and left the principal point; another unit of the same device
/// moved it by 2 px and more.
const SAME_UNIT_FOCAL: f64 = 0.002;
/// Principal points are printed to 0.01 px, the app's single precision adds as much at the reference dimensions.
const SAME_UNIT_PX: f64 = 0.05;

impl Registry {
    /// Which device these numbers are of.
    pub fn identify(&self, sheet: &Sheet) -> Identity<'_> {
        let difference = |entry: &Entry| (sheet.focal_px / entry.sheet.focal_px - 1.0).abs();
        let mut rows: Vec<&Entry> =
            self.entries().iter().filter(|e| e.sheet.reference == sheet.reference).collect();
        rows.sort_by(|a, b| difference(a).total_cmp(&difference(b)));
        let focal_difference =
            rows.first().map(|nearest| sheet.focal_px / nearest.sheet.focal_px - 1.0);
        let same_unit = |entry: &&Entry| {
            let [x, y] = entry.sheet.center;
            let apart = math::hypot(x - sheet.center[0], y - sheet.center[1]);
            apart < SAME_UNIT_PX && difference(entry) < SAME_UNIT_FOCAL
        };
        let units: Vec<&Entry> = rows.iter().copied().filter(same_unit).collect();
        let cameras: Vec<&Entry> =
            rows.iter().copied().filter(|entry| difference(entry) < SAME_CAMERA).collect();
        let (certainty, matches) = if !units.is_empty() {
            (Certainty::Unit, units)
        } else if !cameras.is_empty() {
            (Certainty::Camera, cameras)
        } else if rows.is_empty() {
            (Certainty::Unknown, rows)
        } else {
            (Certainty::SensorOnly, rows)
        };
        let issues = KnownIssue::ALL
            .into_iter()
            .filter(|issue| {
                certainty >= Certainty::Camera && matches.iter().all(|e| e.issues.contains(issue))
            })
            .collect();
        Identity { certainty, matches, focal_difference, issues }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Api;

    #[test]
    fn units_cameras_and_strangers() {
        let registry = Registry::published();
        // Each row is itself; the rows of two systems of one unit are the same unit.
        for entry in registry.entries() {
            let identity = registry.identify(&entry.sheet);
            assert_eq!(identity.certainty, Certainty::Unit, "{}", entry.name());
            assert!(identity.matches.iter().all(|e| e.device == entry.device), "{identity:?}");
            assert_eq!(identity.issues, entry.issues);
        }
        let mut sheet = registry.get("ipad-12.9-5gen/ios15/av").unwrap().sheet;
        sheet.center[0] += 3.0;
        sheet.focal_px *= 1.004;
        let identity = registry.identify(&sheet);
        assert_eq!(identity.certainty, Certainty::Camera);
        assert_eq!(identity.issues, [KnownIssue::FocalLength]);
        let devices: Vec<&str> = identity.matches.iter().map(|e| e.device.as_str()).collect();
        assert!(devices.contains(&"ipad-11-3gen") && devices.contains(&"ipad-12.9-5gen"));
        assert!(identity.matches.iter().all(|e| e.api == Api::AvFoundation));
        sheet.focal_px *= 1.1;
        let identity = registry.identify(&sheet);
        assert_eq!((identity.certainty, identity.issues.len()), (Certainty::SensorOnly, 0));
        sheet.reference = [1.0, 2.0];
        assert_eq!(registry.identify(&sheet).certainty, Certainty::Unknown);
    }
}
