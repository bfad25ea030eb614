//! What is to be done.

use serde::{Serialize, Serializer};

use super::Error;
use crate::{
    audit::Audit,
    camera::{Camera, Distortion, Intrinsics},
    diagnose::{Code, Finding, Verdict},
    recording::{Defect, Factory},
};

/// How depth is resampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sampling {
    /// Bilinear where all four neighbours are measured and lie on one surface, else the nearest of them.
    #[default]
    EdgeAware,
    /// The nearest neighbour.
    Nearest,
}

impl Sampling {
    /// `edge-aware` or `nearest`: stable, for machines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::EdgeAware => "edge-aware",
            Self::Nearest => "nearest",
        }
    }
}

/// Why a defect is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A finding of an audit.
    Finding(Code),
    /// A camera known from elsewhere.
    Camera,
    /// The caller names it.
    Given,
    /// The paper's equations, from both APIs' metadata.
    Equations,
}

impl Reason {
    /// The code of a finding, `camera`, `given` or `equations`: stable, for machines.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Finding(code) => code.name(),
            Self::Camera => "camera",
            Self::Given => "given",
            Self::Equations => "equations",
        }
    }
}

impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A defect to remove, and why.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Step {
    /// What is wrong.
    pub defect: Defect,
    /// Who says so.
    pub reason: Reason,
}

/// Which findings are corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Selection<'a> {
    /// Those that are faults.
    #[default]
    Faults,
    /// All that are significant, within the tolerance or not.
    Significant,
    /// All that are significant, by these steps only ([`Defect::STEPS`]).
    Only(&'a [&'a str]),
}

/// What rectifies the images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lens<'a> {
    /// The recording's own tables: images are as the lens drew them.
    OwnTables,
    /// The recording's own tables, backwards: the images were straight and have been rectified once more.
    OwnTablesTwice,
    /// A calibrated camera. Its pinhole becomes the recording's: focal length, centre and polynomials belong together.
    Camera(&'a Camera),
}

/// What is to be done, each kind of defect at most once.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    steps: Vec<Step>,
    camera: Option<Camera>,
    sampling: Sampling,
}

impl Plan {
    /// Removes these defects. Distorted images are rectified by `camera`, whose pinhole then becomes the recording's;
    /// without one by the recording's own tables.
    pub fn new(steps: Vec<Step>, camera: Option<&Camera>) -> Result<Self, Error> {
        Defect::check(steps.iter().map(|step| &step.defect))?;
        let camera =
            camera.filter(|_| steps.iter().any(|s| s.defect == Defect::Distorted)).cloned();
        if camera.as_ref().is_some_and(|camera| camera.distortion == Distortion::None) {
            return Err(Error::NoWay(
                "the images are distorted, but the recording has no lookup tables, and the model that was calibrated \
                 has no distortion; give a calibration that has one with --with"
                    .to_owned(),
            ));
        }
        Ok(Self { steps, camera, sampling: Sampling::default() })
    }

    /// Removes these defects, because the caller names them.
    pub fn given(defects: &[Defect]) -> Result<Self, Error> {
        let step = |&defect| Step { defect, reason: Reason::Given };
        Self::new(defects.iter().map(step).collect(), None)
    }

    /// What makes a recording whose metadata say the pinhole `said` one of this camera: the camera's pinhole into the
    /// metadata, its distortion out of the images.
    pub fn of_camera(camera: &Camera, said: &Intrinsics) -> Result<Self, Error> {
        let k = &camera.intrinsics;
        let defects = match camera.distortion {
            Distortion::None => vec![
                Defect::Focal { ratio: said.focal_px() / k.focal_px() },
                Defect::Center { shift_px: [said.cx - k.cx, said.cy - k.cy] },
            ],
            _ => vec![Defect::Distorted],
        };
        let step = |defect| Step { defect, reason: Reason::Camera };
        Self::new(defects.into_iter().map(step).collect(), Some(camera))
    }

    /// Removes what an audit has found.
    pub fn of_audit(audit: &Audit, selection: Selection<'_>) -> Result<Self, Error> {
        let has_tables = audit.factory.as_ref().is_some_and(|factory| factory.tables.is_some());
        Self::of_findings(&audit.findings, audit.camera.as_ref().filter(|_| !has_tables), selection)
    }

    /// Removes what findings of an audit name; `camera` is the own camera of a recording without lookup tables.
    ///
    /// Scale and bias of depth are one line: where one of them is a fault, the other goes with it if it is
    /// significant. Scales that several findings contribute to multiply. A calibrated camera's own pinhole goes before
    /// others. Where a finding says that images are mirrored, what findings have read across mirrored images is
    /// dropped (of depth alone: all of depth; of both: principal point and shift): audit the result.
    pub fn of_findings(
        findings: &[Finding],
        camera: Option<&Camera>,
        selection: Selection<'_>,
    ) -> Result<Self, Error> {
        let found = || findings.iter().filter_map(|f| Some((f.code, f.verdict, f.defect?)));
        let is_line = |defect: &Defect| defect.step() == "depth";
        let line_at_fault = found().any(|(_, v, defect)| is_line(&defect) && v == Verdict::Fault);
        let mut steps: Vec<Step> = Vec::new();
        for (code, verdict, defect) in found() {
            let is_taken = match selection {
                Selection::Faults => {
                    verdict == Verdict::Fault || (line_at_fault && is_line(&defect))
                }
                Selection::Significant => true,
                // Mirroring tells what was not measured, even where it is not asked for.
                Selection::Only(names) => {
                    names.contains(&defect.step()) || defect.step() == "mirror"
                }
            };
            if !is_taken {
                continue;
            }
            let ratio_so_far = steps.iter_mut().find_map(|step| match &mut step.defect {
                Defect::DepthScale { ratio } => Some(ratio),
                _ => None,
            });
            match (ratio_so_far, defect) {
                (Some(so_far), Defect::DepthScale { ratio }) => *so_far *= ratio,
                _ => steps.push(Step { defect, reason: Reason::Finding(code) }),
            }
        }
        let has = |defect| steps.iter().any(|step| step.defect == defect);
        let brings_pinhole = camera.is_some() && has(Defect::Distorted);
        // Read through mirrored images, places across them were not measured: a second audit does that.
        let unread: &[&str] = if has(Defect::Mirrored) {
            &["center", "shift"]
        } else if has(Defect::DepthMirrored) {
            &["zoom", "shift", "depth"]
        } else {
            &[]
        };
        steps.retain(|Step { defect, .. }| {
            let hidden = brings_pinhole && ["focal", "center"].contains(&defect.step());
            !hidden && !unread.contains(&defect.step())
        });
        let plan = Self::new(steps, camera)?;
        Ok(match selection {
            Selection::Only(names) => plan.only(names),
            _ => plan,
        })
    }

    /// Only the steps of these names ([`Defect::STEPS`]).
    #[must_use]
    pub fn only(mut self, names: &[&str]) -> Self {
        self.steps.retain(|step| names.contains(&step.defect.step()));
        self
    }

    /// Resamples depth like this.
    #[must_use]
    pub fn sampled(self, sampling: Sampling) -> Self {
        Self { sampling, ..self }
    }

    /// What is done, and why.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// How depth is resampled.
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// The camera that rectifies the images and whose pinhole the recording gets, where it is not the own tables.
    pub fn camera(&self) -> Option<&Camera> {
        match self.lens() {
            Some(Lens::Camera(camera)) => Some(camera),
            _ => None,
        }
    }

    /// True where nothing is to be done.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    fn has(&self, defect: Defect) -> bool {
        self.steps.iter().any(|step| step.defect == defect)
    }

    /// True where colour images are resampled or mirrored.
    pub fn changes_color(&self) -> bool {
        self.mirrors_color() || self.lens().is_some()
    }

    /// True where depth maps change.
    pub fn changes_depth(&self) -> bool {
        self.resamples_depth() || self.mirrors_depth() || self.depth_scale_and_bias() != (1.0, 0.0)
    }

    /// True where depth maps are resampled.
    pub(super) fn resamples_depth(&self) -> bool {
        self.lens().is_some() || self.zoom() != [1.0; 2] || self.shift_px() != [0.0; 2]
    }

    pub(super) fn lens(&self) -> Option<Lens<'_>> {
        if self.has(Defect::RectifiedTwice) {
            Some(Lens::OwnTablesTwice)
        } else if self.has(Defect::Distorted) {
            Some(self.camera.as_ref().map_or(Lens::OwnTables, Lens::Camera))
        } else {
            None
        }
    }

    /// True where colour images are mirrored back.
    pub fn mirrors_color(&self) -> bool {
        self.has(Defect::Mirrored)
    }

    /// True where depth maps are mirrored back: with colour or alone.
    pub fn mirrors_depth(&self) -> bool {
        self.has(Defect::Mirrored) != self.has(Defect::DepthMirrored)
    }

    fn find<T>(&self, of: impl Fn(&Defect) -> Option<T>) -> Option<T> {
        self.steps.iter().find_map(|step| of(&step.defect))
    }

    /// Of the depth map: see [`Defect::DepthZoom`].
    pub fn zoom(&self) -> [f64; 2] {
        let zoom = |defect: &Defect| match defect {
            Defect::DepthZoom { zoom } => Some(*zoom),
            _ => None,
        };
        self.find(zoom).unwrap_or([1.0; 2])
    }

    /// Of the depth map: see [`Defect::DepthShift`].
    pub fn shift_px(&self) -> [f64; 2] {
        let shift = |defect: &Defect| match defect {
            Defect::DepthShift { shift_px } => Some(*shift_px),
            _ => None,
        };
        self.find(shift).unwrap_or([0.0; 2])
    }

    /// Scale and bias of depth, metres: sensor = scale · truth + bias.
    pub fn depth_scale_and_bias(&self) -> (f64, f64) {
        let scale = |defect: &Defect| match defect {
            Defect::DepthScale { ratio } => Some(*ratio),
            _ => None,
        };
        let bias_m = |defect: &Defect| match defect {
            Defect::DepthBias { bias_m } => Some(*bias_m),
            _ => None,
        };
        (self.find(scale).unwrap_or(1.0), self.find(bias_m).unwrap_or(0.0))
    }

    /// The first defect of the metadata, where there is one.
    pub(super) fn in_metadata(&self) -> Option<Defect> {
        self.find(|defect| (!defect.is_in_data()).then_some(*defect))
    }

    /// What the metadata of a corrected frame say.
    pub(super) fn factory(&self, before: &Factory) -> Factory {
        let mut after = before.clone();
        after.intrinsics = self.intrinsics(&before.intrinsics);
        if self.lens().is_some() {
            (after.tables, after.geometric_distortion_correction) = (None, Some(true));
        }
        after
    }

    /// What a frame's metadata say of its pinhole once all is done, where `said` is what they said.
    pub(super) fn intrinsics(&self, said: &Intrinsics) -> Intrinsics {
        if let Some(camera) = self.camera() {
            return Intrinsics { width: said.width, height: said.height, ..camera.intrinsics };
        }
        let scale = |defect: &Defect| match defect {
            Defect::IntrinsicsScale { factor } => Some(*factor),
            _ => None,
        };
        let ([x, y], mut k) = (self.find(scale).unwrap_or([1.0; 2]), *said);
        (k.fx, k.cx, k.fy, k.cy) = (k.fx * x, k.cx * x, k.fy * y, k.cy * y);
        for step in &self.steps {
            match step.defect {
                Defect::Focal { ratio } => (k.fx, k.fy) = (k.fx / ratio, k.fy / ratio),
                Defect::Center { shift_px: [x, y] } => (k.cx, k.cy) = (k.cx - x, k.cy - y),
                _ => {}
            }
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Tolerances;

    const SAID: Intrinsics =
        Intrinsics { fx: 565.0, fy: 566.0, cx: 320.0, cy: 241.0, width: 640, height: 480 };

    #[test]
    fn given_defects_become_metadata() {
        let defects = ["focal=6.6%", "center=4px,-2px", "depth-scale=1.5%", "depth-bias=2mm"]
            .map(|text| text.parse::<Defect>().unwrap());
        let plan = Plan::given(&defects).unwrap();
        assert_eq!(plan.depth_scale_and_bias(), (1.015, 0.002));
        assert!(plan.changes_depth() && !plan.changes_color() && !plan.resamples_depth());
        let k = plan.intrinsics(&SAID);
        assert!((k.fx - 565.0 / 1.066).abs() < 1e-9 && (k.fy - 566.0 / 1.066).abs() < 1e-9);
        assert_eq!((k.cx, k.cy), (316.0, 243.0));
        // A frame that deviates keeps its deviation.
        let frame = Intrinsics { fx: 565.0 * 1.01, cx: 321.5, ..SAID };
        let other = plan.intrinsics(&frame);
        assert!((other.fx / k.fx - 1.01).abs() < 1e-12 && (other.cx - k.cx - 1.5).abs() < 1e-12);
        let only = plan.only(&["focal"]);
        assert_eq!(only.steps().len(), 1);
        assert!(!only.changes_depth());
        let twice = [Defect::Focal { ratio: 1.1 }, Defect::Focal { ratio: 1.2 }];
        assert!(matches!(Plan::given(&twice), Err(Error::Defect(_))));
        assert!(matches!(Plan::given(&[Defect::Focal { ratio: 0.0 }]), Err(Error::Defect(_))));
        let turned = Plan::given(&[Defect::Mirrored, Defect::DepthMirrored]).unwrap();
        assert!(turned.mirrors_color() && !turned.mirrors_depth());
        let scale = Defect::IntrinsicsScale { factor: [0.5, 0.25] };
        let k = Plan::given(&[defects[0], scale]).unwrap().intrinsics(&SAID);
        assert!((k.fx - 282.5 / 1.066).abs() < 1e-9 && (k.cx, k.cy) == (160.0, 60.25));
    }

    #[test]
    fn a_camera_becomes_metadata() {
        let own = Intrinsics { fx: 530.0, fy: 530.0, cx: 322.0, cy: 239.0, ..SAID };
        let pinhole = Camera { intrinsics: own, distortion: Distortion::None };
        let k = Plan::of_camera(&pinhole, &SAID).unwrap().intrinsics(&SAID);
        assert!((k.focal_px() - 530.0).abs() < 1e-9 && (k.cx - 322.0).abs() < 1e-9);
        let brown = crate::camera::Brown { k1: 0.07, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };
        let lens = Camera { distortion: Distortion::Brown(brown), ..pinhole };
        assert_eq!(Plan::of_camera(&lens, &SAID).unwrap().intrinsics(&SAID), own);
    }

    #[test]
    fn findings_become_steps() {
        let camera = Camera { intrinsics: SAID, distortion: Distortion::None };
        let by = |found: &[(Code, Verdict, Defect)], camera: Option<&Camera>, selection| {
            let finding = |&(code, verdict, defect): &(Code, Verdict, Defect)| Finding {
                verdict,
                defect: Some(defect),
                ..Finding::new(code, &Tolerances::default())
            };
            let findings: Vec<Finding> = found.iter().map(finding).collect();
            Plan::of_findings(&findings, camera, selection)
        };
        let names = |plan: &Plan| -> Vec<&str> {
            plan.steps().iter().map(|step| step.defect.name()).collect()
        };
        let distorted = (Code::TD203, Verdict::Fault, Defect::Distorted);
        let none = by(&[distorted], Some(&camera), Selection::Faults);
        assert!(matches!(none, Err(Error::NoWay(_))));
        let brown = crate::camera::Brown { k1: 0.07, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };
        let lens = Camera { distortion: Distortion::Brown(brown), ..camera };
        let focal = (Code::TD201, Verdict::Fault, Defect::Focal { ratio: 1.066 });
        // The calibrated camera brings its own focal length, where it is asked for.
        let both = by(&[focal, distorted], Some(&lens), Selection::Faults).unwrap();
        assert_eq!((names(&both), both.camera()), (vec!["distorted"], Some(&lens)));
        let only = by(&[focal, distorted], Some(&lens), Selection::Only(&["focal"])).unwrap();
        assert_eq!((names(&only), only.camera()), (vec!["focal"], None));
        let mut found = [
            focal,
            (Code::TD301, Verdict::Fault, Defect::DepthScale { ratio: 1.02 }),
            (Code::TD302, Verdict::Fault, Defect::DepthBias { bias_m: 0.004 }),
            (Code::TD401, Verdict::Fault, Defect::DepthZoom { zoom: [0.95; 2] }),
            (Code::TD402, Verdict::Fault, Defect::DepthShift { shift_px: [3.0, -1.0] }),
            (Code::TD403, Verdict::Fault, Defect::DepthMirrored),
        ];
        let unread = by(&found, None, Selection::Faults).unwrap();
        assert_eq!(names(&unread), ["focal", "depth-mirrored"]);

        found[5] = (Code::TD204, Verdict::Fault, Defect::RectifiedTwice);
        let plan = by(&found, None, Selection::Faults).unwrap();
        assert_eq!(plan.depth_scale_and_bias(), (1.02, 0.004));
        assert_eq!(plan.lens(), Some(Lens::OwnTablesTwice));
        assert_eq!((plan.zoom(), plan.shift_px()), ([0.95; 2], [3.0, -1.0]));

        // What is significant within the tolerance goes where that is asked for, or with the other half of its line.
        let mut found = found[..5].to_vec();
        for i in [0, 2, 3] {
            found[i].1 = Verdict::Info;
        }
        let of = |found: &[(Code, Verdict, Defect)], selection| by(found, None, selection).unwrap();
        let faults = of(&found, Selection::Faults);
        assert_eq!(names(&faults), ["depth-scale", "depth-bias", "depth-shift"]);
        assert_eq!(of(&found, Selection::Significant).steps().len(), 5);
        assert_eq!(names(&of(&found, Selection::Only(&["focal", "center"]))), ["focal"]);
        found[1].1 = Verdict::Info;
        assert_eq!(names(&of(&found, Selection::Faults)), ["depth-shift"]);
        let depth = of(&found, Selection::Only(&["depth"]));
        assert_eq!(depth.depth_scale_and_bias(), (1.02, 0.004));
    }
}
