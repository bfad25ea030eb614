//! What is to be done.

use super::Error;
use crate::{
    camera::{Camera, Distortion, Intrinsics, TablePair},
    diagnose::{Code, Correction, DistortionState, Finding, Verdict},
    simulate::Fault,
};

/// What rectifies the images.
#[derive(Clone, Debug, PartialEq)]
pub enum Lens {
    /// The recording's own tables: images are as the lens drew them.
    OwnTables,
    /// These tables.
    Tables(Box<TablePair>),
    /// A calibrated camera. Its pinhole becomes the recording's: focal length, centre and polynomials belong together.
    Camera(Box<Camera>),
    /// The recording's own tables, backwards: the images were straight and have been rectified once more.
    OwnTablesTwice,
}

/// What is mirrored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mirrored {
    /// Colour and depth, as ARKit delivers them.
    Both,
    /// The depth map alone.
    Depth,
}

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

/// One correction, its parameters at the size of the recording's images.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Step {
    /// Multiply the intrinsics by these factors (x, y): metadata only.
    ScaleIntrinsics {
        /// For fx and cx, and for fy and cy.
        factor: [f64; 2],
    },
    /// Replace the focal length, keeping fy/fx: metadata only.
    Focal {
        /// Mean of both focal lengths, pixels.
        focal_px: f64,
    },
    /// Replace the principal point: metadata only.
    Center {
        /// Where it is, pixels.
        center_px: [f64; 2],
    },
    /// Resample colour and depth to straight lines.
    Undistort(Lens),
    /// Mirror back, left for right.
    Unmirror(Mirrored),
    /// Resample depth: depth pixel p shows what the colour image has at c + zoom·(p − shift − c).
    DepthZoom {
        /// Horizontally and vertically.
        zoom: [f64; 2],
    },
    /// Resample depth: see [`Step::DepthZoom`].
    DepthShift {
        /// Depth minus colour, pixels.
        shift_px: [f64; 2],
    },
    /// Sensor = scale · truth + bias.
    Depth {
        /// Sensor over truth.
        scale: f64,
        /// Sensor minus truth, metres.
        bias_m: f64,
    },
}

impl Step {
    /// The names of all steps.
    pub const NAMES: [&'static str; 8] =
        ["scale-intrinsics", "focal", "center", "undistort", "mirror", "zoom", "shift", "depth"];

    /// Its name, one of [`NAMES`](Self::NAMES): stable, for machines.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::ScaleIntrinsics { .. } => Self::NAMES[0],
            Self::Focal { .. } => Self::NAMES[1],
            Self::Center { .. } => Self::NAMES[2],
            Self::Undistort(_) => Self::NAMES[3],
            Self::Unmirror(_) => Self::NAMES[4],
            Self::DepthZoom { .. } => Self::NAMES[5],
            Self::DepthShift { .. } => Self::NAMES[6],
            Self::Depth { .. } => Self::NAMES[7],
        }
    }

    /// What rectifies distorted images: the recording's own tables where it has them, else the camera's distortion.
    pub fn undistort(has_tables: bool, camera: Option<&Camera>) -> Result<Self, Error> {
        if has_tables {
            return Ok(Self::Undistort(Lens::OwnTables));
        }
        let lens = camera.filter(|c| c.distortion != Distortion::None).ok_or_else(|| {
            Error::NoWay(
                "the images are distorted, but the recording has no lookup tables, and the model that was calibrated \
                 has no distortion; give a calibration that has one with --with"
                    .to_owned(),
            )
        })?;
        Ok(Self::Undistort(Lens::Camera(Box::new(lens.clone()))))
    }

    fn check(&self) -> Result<(), Error> {
        let require = |valid: bool, value: String, range: &'static str| match valid {
            true => Ok(()),
            false => Err(Error::Parameter { step: self.name(), value, range }),
        };
        let pair = |[x, y]: [f64; 2]| format!("{x}, {y}");
        let within =
            |values: [f64; 2], low: f64, high: f64| values.iter().all(|v| (low..=high).contains(v));
        match self {
            Self::ScaleIntrinsics { factor } => {
                require(within(*factor, 1e-3, 1e3), pair(*factor), "0.001 to 1000")
            }
            Self::Focal { focal_px } => {
                require((1.0..=1e6).contains(focal_px), focal_px.to_string(), "1 to 1000000 px")
            }
            Self::Center { center_px } => {
                require(within(*center_px, -1e5, 1e5), pair(*center_px), "a place near the image")
            }
            Self::DepthZoom { zoom } => require(within(*zoom, 0.5, 2.0), pair(*zoom), "0.5 to 2"),
            Self::DepthShift { shift_px } => {
                require(within(*shift_px, -200.0, 200.0), pair(*shift_px), "at most 200 px")
            }
            Self::Depth { scale, bias_m } => {
                require((0.5..=2.0).contains(scale), scale.to_string(), "a scale of 0.5 to 2")?;
                require(bias_m.abs() <= 0.2, bias_m.to_string(), "a bias of at most 0.2 m")
            }
            Self::Undistort(_) | Self::Unmirror(_) => Ok(()),
        }
    }
}

/// Why a step is taken.
#[derive(Clone, Debug, PartialEq)]
pub enum Because {
    /// A finding of an audit.
    Finding(Code),
    /// A camera known from elsewhere.
    Camera,
    /// The caller says so.
    Told,
    /// The paper's equations, from both APIs' metadata.
    Equations,
}

impl Because {
    /// The code of a finding, `camera`, `told` or `equations`: stable, for machines.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Finding(code) => code.name(),
            Self::Camera => "camera",
            Self::Told => "told",
            Self::Equations => "equations",
        }
    }
}

/// What a finding calls for.
#[derive(Clone, Debug, PartialEq)]
pub struct Called {
    /// The finding.
    pub code: Code,
    /// Its verdict: a fault, or information on what is significant though within the tolerance.
    pub verdict: Verdict,
    /// What corrects it.
    pub steps: Vec<Step>,
}

/// Which findings are corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Which<'a> {
    /// Those that are faults.
    #[default]
    Faults,
    /// All that are significant, within the tolerance or not.
    Significant,
    /// All that are significant, by these steps only ([`Step::NAMES`]).
    Only(&'a [&'a str]),
}

/// What is to be done, each kind of step at most once.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    steps: Vec<(Step, Because)>,
    sampling: Sampling,
}

impl Plan {
    /// These steps, because the caller says so.
    pub fn new(steps: Vec<Step>, sampling: Sampling) -> Result<Self, Error> {
        Self::because(steps.into_iter().map(|step| (step, Because::Told)).collect(), sampling)
    }

    /// These steps for these reasons.
    pub fn because(steps: Vec<(Step, Because)>, sampling: Sampling) -> Result<Self, Error> {
        for (i, (step, _)) in steps.iter().enumerate() {
            step.check()?;
            if steps[..i].iter().any(|(other, _)| other.name() == step.name()) {
                return Err(Error::Twice(step.name()));
            }
        }
        Ok(Self { steps, sampling })
    }

    /// What an audit calls for: the corrections that its findings name, `state` as the audit found it, `camera` the own
    /// camera where there is one (for images that are distorted and bring no tables).
    pub fn from_findings(
        findings: &[Finding],
        state: DistortionState,
        camera: Option<&Camera>,
        which: Which<'_>,
        sampling: Sampling,
    ) -> Result<Self, Error> {
        let mut called = Vec::new();
        for Finding { code, verdict, correction, .. } in findings {
            let Some(correction) = correction else { continue };
            let steps = match correction {
                Correction::Focal { focal_px } => vec![Step::Focal { focal_px: *focal_px }],
                Correction::PrincipalPoint { center_px } => {
                    vec![Step::Center { center_px: *center_px }]
                }
                Correction::ScaleIntrinsics { factor } => {
                    vec![Step::ScaleIntrinsics { factor: *factor }]
                }
                Correction::Unmirror => vec![Step::Unmirror(Mirrored::Both)],
                Correction::UnmirrorDepth => vec![Step::Unmirror(Mirrored::Depth)],
                Correction::Undistort { tables } => {
                    vec![Step::undistort(tables.is_some(), camera)?]
                }
                Correction::Align { zoom, shift_px } => vec![
                    Step::DepthZoom { zoom: [*zoom; 2] },
                    Step::DepthShift { shift_px: *shift_px },
                ],
                Correction::Depth { scale, bias_m } => {
                    vec![Step::Depth { scale: *scale, bias_m: *bias_m }]
                }
            };
            called.push(Called { code: *code, verdict: *verdict, steps });
        }
        Self::called_for(called, state, which, sampling)
    }

    /// As [`from_findings`](Self::from_findings), for findings that have come some other way.
    ///
    /// Scale and bias of depth are one line: where one of them is at fault, the other goes with it if it is
    /// significant.
    pub fn called_for(
        called: Vec<Called>,
        state: DistortionState,
        which: Which<'_>,
        sampling: Sampling,
    ) -> Result<Self, Error> {
        let is_line = |c: &Called| matches!(c.steps[..], [Step::Depth { .. }]);
        let line_at_fault = called.iter().any(|c| is_line(c) && c.verdict == Verdict::Fault);
        let mut steps: Vec<(Step, Because)> = Vec::new();
        for one in called {
            let taken = match which {
                Which::Faults => one.verdict == Verdict::Fault || (line_at_fault && is_line(&one)),
                Which::Significant | Which::Only(_) => true,
            };
            if taken {
                let because = Because::Finding(one.code);
                steps.extend(one.steps.into_iter().map(|step| (step, because.clone())));
            }
        }
        if state == DistortionState::RectifiedTwice {
            let twice = Step::Undistort(Lens::OwnTablesTwice);
            steps.push((twice, Because::Finding(Code::TD204)));
        }
        let Which::Only(names) = which else { return Self::merged(steps, sampling) };
        // Mirroring takes part in the merge, even where it is not asked for: it tells what was not measured. A camera
        // that is not asked for must not hide its focal length.
        let asked = |step: &Step| names.contains(&step.name());
        steps.retain(|(step, _)| asked(step) || matches!(step, Step::Unmirror(_)));
        Ok(Self::merged(steps, sampling)?.only(names))
    }

    /// As [`because`](Self::because), for steps that several findings have contributed to: scales and zooms multiply,
    /// biases and shifts add, what changes nothing goes, and a calibrated camera's own pinhole goes before others.
    /// Where a finding calls for mirroring back, what findings have read across mirrored images is dropped (of depth
    /// alone: all of depth; of both: principal point and shift): audit the result.
    pub fn merged(steps: Vec<(Step, Because)>, sampling: Sampling) -> Result<Self, Error> {
        let mut merged: Vec<(Step, Because)> = Vec::new();
        let brings_pinhole =
            steps.iter().any(|(step, _)| matches!(step, Step::Undistort(Lens::Camera(_))));
        for (step, because) in steps {
            if brings_pinhole && matches!(step, Step::Focal { .. } | Step::Center { .. }) {
                continue;
            }
            let same = merged.iter_mut().find(|(other, _)| other.name() == step.name());
            match (same, &step) {
                (Some((Step::Depth { scale, bias_m }, _)), Step::Depth { scale: s, bias_m: b }) => {
                    *scale *= s;
                    *bias_m += b;
                }
                (Some((Step::DepthZoom { zoom: [x, y] }, _)), Step::DepthZoom { zoom: [u, v] }) => {
                    *x *= u;
                    *y *= v;
                }
                (
                    Some((Step::DepthShift { shift_px: [x, y] }, _)),
                    Step::DepthShift { shift_px: [u, v] },
                ) => {
                    *x += u;
                    *y += v;
                }
                _ => merged.push((step, because)),
            }
        }
        // Read through mirrored images, places across them were not measured: a second audit does that.
        let mirrored = merged.iter().find_map(|(step, because)| match (step, because) {
            (Step::Unmirror(what), Because::Finding(_)) => Some(*what),
            _ => None,
        });
        let unread = |step: &Step| match mirrored {
            Some(Mirrored::Both) => matches!(step, Step::Center { .. } | Step::DepthShift { .. }),
            Some(Mirrored::Depth) => matches!(
                step,
                Step::DepthZoom { .. } | Step::DepthShift { .. } | Step::Depth { .. }
            ),
            None => false,
        };
        merged.retain(|(step, because)| match step {
            _ if matches!(because, Because::Finding(_)) && unread(step) => false,
            Step::DepthZoom { zoom } => *zoom != [1.0; 2],
            Step::DepthShift { shift_px } => *shift_px != [0.0; 2],
            Step::Depth { scale, bias_m } => (*scale, *bias_m) != (1.0, 0.0),
            _ => true,
        });
        Self::because(merged, sampling)
    }

    /// What makes the recording one of this camera: its pinhole in the metadata, its distortion out of the images.
    pub fn from_camera(camera: &Camera, sampling: Sampling) -> Result<Self, Error> {
        let k = &camera.intrinsics;
        let steps = if camera.distortion == Distortion::None {
            vec![Step::Focal { focal_px: k.focal_px() }, Step::Center { center_px: [k.cx, k.cy] }]
        } else {
            vec![Step::Undistort(Lens::Camera(Box::new(camera.clone())))]
        };
        Self::because(steps.into_iter().map(|s| (s, Because::Camera)).collect(), sampling)
    }

    /// What undoes these faults of a recording whose metadata say this pinhole, as if they had been simulated.
    pub fn from_faults(
        faults: impl IntoIterator<Item = Fault>,
        said: &Intrinsics,
        sampling: Sampling,
    ) -> Result<Self, Error> {
        let mut steps: Vec<Step> = Vec::new();
        let mut line: Option<(f64, f64)> = None;
        for fault in faults {
            steps.push(match fault {
                Fault::Focal { excess } => {
                    Step::Focal { focal_px: said.focal_px() / (1.0 + excess) }
                }
                Fault::Center { shift_px: [x, y] } => {
                    Step::Center { center_px: [said.cx - x, said.cy - y] }
                }
                Fault::Distorted => Step::Undistort(Lens::OwnTables),
                Fault::RectifiedTwice => Step::Undistort(Lens::OwnTablesTwice),
                Fault::DepthZoom { zoom } => Step::DepthZoom { zoom: [zoom; 2] },
                Fault::DepthShift { shift_px } => Step::DepthShift { shift_px },
                Fault::Mirrored => Step::Unmirror(Mirrored::Both),
                Fault::DepthMirrored => Step::Unmirror(Mirrored::Depth),
                Fault::DepthScale { excess } => {
                    line = Some((1.0 + excess, line.map_or(0.0, |(_, bias)| bias)));
                    continue;
                }
                Fault::DepthBias { bias_m } => {
                    line = Some((line.map_or(1.0, |(scale, _)| scale), bias_m));
                    continue;
                }
                Fault::Bent { .. } => {
                    return Err(Error::NoWay(
                        "`bent` is a fault of the printed board, not of the recording: nothing to correct".into(),
                    ));
                }
            });
        }
        steps.extend(line.map(|(scale, bias_m)| Step::Depth { scale, bias_m }));
        Self::new(steps, sampling)
    }

    /// Only the steps of these names.
    #[must_use]
    pub fn only(mut self, names: &[&str]) -> Self {
        self.steps.retain(|(step, _)| names.contains(&step.name()));
        self
    }

    /// What is done, and why.
    pub fn steps(&self) -> &[(Step, Because)] {
        &self.steps
    }

    /// How depth is resampled.
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// True where nothing is to be done.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// True where colour images are resampled or mirrored.
    pub fn changes_color(&self) -> bool {
        self.unmirror() == Some(Mirrored::Both) || self.lens().is_some()
    }

    /// True where depth maps change.
    pub fn changes_depth(&self) -> bool {
        self.moves_depth() || self.unmirror().is_some() || self.line() != (1.0, 0.0)
    }

    /// True where depth maps are resampled.
    pub(super) fn moves_depth(&self) -> bool {
        self.lens().is_some() || self.zoom() != [1.0; 2] || self.shift_px() != [0.0; 2]
    }

    pub(super) fn lens(&self) -> Option<&Lens> {
        self.steps.iter().find_map(|(step, _)| match step {
            Step::Undistort(lens) => Some(lens),
            _ => None,
        })
    }

    /// What is mirrored back.
    pub fn unmirror(&self) -> Option<Mirrored> {
        self.steps.iter().find_map(|(step, _)| match step {
            Step::Unmirror(what) => Some(*what),
            _ => None,
        })
    }

    /// Of the depth map: see [`Step::DepthZoom`].
    pub fn zoom(&self) -> [f64; 2] {
        let zoom = |(step, _): &(Step, Because)| match step {
            Step::DepthZoom { zoom } => Some(*zoom),
            _ => None,
        };
        self.steps.iter().find_map(zoom).unwrap_or([1.0; 2])
    }

    /// Of the depth map: see [`Step::DepthShift`].
    pub fn shift_px(&self) -> [f64; 2] {
        let shift = |(step, _): &(Step, Because)| match step {
            Step::DepthShift { shift_px } => Some(*shift_px),
            _ => None,
        };
        self.steps.iter().find_map(shift).unwrap_or([0.0; 2])
    }

    /// Scale and bias of depth, metres: see [`Step::Depth`].
    pub fn line(&self) -> (f64, f64) {
        let line = |(step, _): &(Step, Because)| match step {
            Step::Depth { scale, bias_m } => Some((*scale, *bias_m)),
            _ => None,
        };
        self.steps.iter().find_map(line).unwrap_or((1.0, 0.0))
    }

    /// What a frame's metadata say of its pinhole once all is done, where `said` is what they said and `reference` what
    /// they said for the whole recording: a frame's own deviation from that is kept.
    pub(super) fn intrinsics(&self, said: &Intrinsics, reference: &Intrinsics) -> Intrinsics {
        let mut k = *said;
        let scale = |k: &mut Intrinsics, [x, y]: [f64; 2]| {
            k.fx *= x;
            k.cx *= x;
            k.fy *= y;
            k.cy *= y;
        };
        let mut base = *reference;
        for (step, _) in &self.steps {
            if let Step::ScaleIntrinsics { factor } = step {
                scale(&mut k, *factor);
                scale(&mut base, *factor);
            }
        }
        for (step, _) in &self.steps {
            match step {
                Step::Focal { focal_px } => {
                    let factor = focal_px / base.focal_px();
                    k.fx *= factor;
                    k.fy *= factor;
                }
                Step::Center { center_px: [x, y] } => {
                    k.cx += x - base.cx;
                    k.cy += y - base.cy;
                }
                Step::Undistort(Lens::Camera(camera)) => {
                    let own = &camera.intrinsics;
                    k = Intrinsics { width: k.width, height: k.height, ..*own };
                }
                _ => {}
            }
        }
        k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAID: Intrinsics =
        Intrinsics { fx: 565.0, fy: 566.0, cx: 320.0, cy: 241.0, width: 640, height: 480 };

    #[test]
    fn faults_become_steps_and_metadata() {
        let faults = ["focal=6.6%", "center=4px,-2px", "depth-scale=1.5%", "depth-bias=2mm"]
            .map(|text| text.parse::<Fault>().unwrap());
        let plan = Plan::from_faults(faults, &SAID, Sampling::EdgeAware).unwrap();
        assert_eq!(plan.line(), (1.015, 0.002));
        assert!(plan.changes_depth() && !plan.changes_color() && !plan.moves_depth());
        let k = plan.intrinsics(&SAID, &SAID);
        assert!((k.fx - 565.0 / 1.066).abs() < 1e-9 && (k.fy - 566.0 / 1.066).abs() < 1e-9);
        assert_eq!((k.cx, k.cy), (316.0, 243.0));
        // A frame that deviates keeps its deviation.
        let frame = Intrinsics { fx: 565.0 * 1.01, cx: 321.5, ..SAID };
        let other = plan.intrinsics(&frame, &SAID);
        assert!((other.fx / k.fx - 1.01).abs() < 1e-12 && (other.cx - k.cx - 1.5).abs() < 1e-12);
        let only = plan.only(&["focal"]);
        assert_eq!(only.steps().len(), 1);
        assert!(!only.changes_depth());
        assert!(
            Plan::from_faults(["bent=1mm".parse().unwrap()], &SAID, Sampling::Nearest).is_err()
        );
    }

    #[test]
    fn findings_become_steps() {
        let camera = Camera { intrinsics: SAID, distortion: Distortion::None };
        let finding = |(code, correction)| Finding {
            verdict: Verdict::Fault,
            correction: Some(correction),
            ..Finding::new(code, crate::diagnose::Unit::Count)
        };
        let undistort = finding((Code::TD203, Correction::Undistort { tables: None }));
        let plan = |findings: &[Finding], state, camera: Option<&Camera>| {
            Plan::from_findings(findings, state, camera, Which::Faults, Sampling::EdgeAware)
        };
        let names = |plan: &Plan| -> Vec<&str> {
            plan.steps().iter().map(|(step, _)| step.name()).collect()
        };
        let none =
            plan(std::slice::from_ref(&undistort), DistortionState::Distorted, Some(&camera));
        assert!(matches!(none, Err(Error::NoWay(_))));
        let brown = crate::camera::Brown { k1: 0.07, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };
        let lens = Camera { distortion: Distortion::Brown(brown), ..camera };
        let focal = finding((Code::TD201, Correction::Focal { focal_px: 530.0 }));
        let both = plan(&[focal.clone(), undistort], DistortionState::Distorted, Some(&lens));
        // The calibrated camera brings its own focal length.
        assert_eq!(both.unwrap().steps().len(), 1);
        let mut depth = vec![focal];
        depth.extend(
            [
                (Code::TD301, Correction::Depth { scale: 1.02, bias_m: 0.0 }),
                (Code::TD302, Correction::Depth { scale: 1.0, bias_m: 0.004 }),
                (Code::TD401, Correction::Align { zoom: 0.95, shift_px: [0.0; 2] }),
                (Code::TD402, Correction::Align { zoom: 1.0, shift_px: [3.0, -1.0] }),
            ]
            .map(finding),
        );
        let mut mirrored = depth.clone();
        mirrored.push(finding((Code::TD403, Correction::UnmirrorDepth)));
        let unread = plan(&mirrored, DistortionState::Rectified, None).unwrap();
        assert_eq!(names(&unread), ["focal", "mirror"]);

        // What is significant within the tolerance goes where that is asked for, or with the other half of its line.
        for i in [0, 2, 3] {
            depth[i].verdict = Verdict::Info;
        }
        let by = |depth: &[Finding], which| {
            let state = DistortionState::Rectified;
            Plan::from_findings(depth, state, None, which, Sampling::EdgeAware).unwrap()
        };
        let faults = by(&depth, Which::Faults);
        assert_eq!((names(&faults), faults.line()), (vec!["depth", "shift"], (1.02, 0.004)));
        assert_eq!(names(&by(&depth, Which::Significant)), ["focal", "depth", "zoom", "shift"]);
        assert_eq!(names(&by(&depth, Which::Only(&["focal", "center"]))), ["focal"]);
        depth[1].verdict = Verdict::Info;
        assert_eq!(names(&by(&depth, Which::Faults)), ["shift"]);
        assert_eq!(by(&depth, Which::Only(&["depth"])).line(), (1.02, 0.004));

        let depth: Vec<Finding> =
            depth.into_iter().map(|f| Finding { verdict: Verdict::Fault, ..f }).collect();
        let plan = plan(&depth, DistortionState::RectifiedTwice, None).unwrap();
        assert_eq!(plan.line(), (1.02, 0.004));
        assert_eq!(plan.lens(), Some(&Lens::OwnTablesTwice));
        assert_eq!(names(&plan), ["focal", "depth", "zoom", "shift", "undistort"]);
        assert_eq!((plan.zoom(), plan.shift_px()), ([0.95; 2], [3.0, -1.0]));
    }

    #[test]
    fn what_no_camera_has_is_refused() {
        for step in [
            Step::DepthZoom { zoom: [f64::NAN, 1.0] },
            Step::DepthShift { shift_px: [0.0, 1e3] },
            Step::Focal { focal_px: 0.0 },
            Step::Depth { scale: 1.0, bias_m: f64::INFINITY },
            Step::ScaleIntrinsics { factor: [0.0, 1.0] },
            Step::Center { center_px: [f64::NAN, 0.0] },
        ] {
            let error = Plan::new(vec![step], Sampling::Nearest).unwrap_err();
            assert!(matches!(error, Error::Parameter { .. }), "{error}");
        }
        let twice = vec![Step::Focal { focal_px: 5.0 }, Step::Focal { focal_px: 6.0 }];
        assert_eq!(Plan::new(twice, Sampling::Nearest), Err(Error::Twice("focal")));
    }
}
