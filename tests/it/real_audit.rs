//! Audits of the published recordings (ZEISS/iPad_TrueDepth_Issue_Eval): what issue 2 asks to be shown.

use truedepth::{
    audit::{Audit, Method, Options, audit},
    recording::{Limits, Recording},
};

use crate::data;

const IPHONE_DEPTH: &str = "zeiss/DepthEvalDataset/iPhone11Pro_iOS14";
const IPAD5_DEPTH: &str = "zeiss/DepthEvalDataset/iPadPro12_5gen_iOS15";

fn run(name: &str, method: Method) -> Option<Audit> {
    let path = data(name)?;
    let recording = Recording::open(path, &Limits::default()).expect("opens");
    Some(audit(&recording, &Options::new(method)).expect("audits"))
}

/// Mean of median errors (board − sensor) with factory intrinsics, as the reference Python has them with OpenCV 4.5.5.
#[test]
fn depth_with_factory_intrinsics() {
    for (name, expected_mm) in [(IPHONE_DEPTH, -0.58), (IPAD5_DEPTH, 13.69)] {
        let Some(audit) = run(name, Method::Auto) else { return };
        let mean = audit.factory_depth.expect("factory").mean_of_medians_m.expect("depth");
        println!("{name}: {:+.3} mm", 1e3 * mean.value);
        assert!((1e3 * mean.value - expected_mm).abs() < 0.15, "{name}: {mean:?}");
    }
}
