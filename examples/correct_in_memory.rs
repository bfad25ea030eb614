//! A recording that never touches the disk: simulated with a wrong focal length and stretched depth, audited,
//! corrected, and audited again. `cargo run --release --example correct_in_memory`

use std::{error::Error, sync::Arc};

use truedepth::{
    audit::{Options, audit},
    correct::{Plan, Selection, correct},
    files::{Limits, Memory},
    measure::{Method, Silent},
    recording::{Defect, Recording},
    simulate::{self, Device, Faults},
};

#[allow(clippy::print_stdout, reason = "the result of a program")]
fn main() -> Result<(), Box<dyn Error>> {
    let mut simulated = simulate::Plan::new(Device::named("ipad-12.9-5gen")?, 1);
    simulated.faults =
        Faults::new([Defect::Focal { ratio: 1.066 }, Defect::DepthScale { ratio: 1.015 }])?;
    let files = simulated.write(Memory::new("ipad"), |_| ())?;
    let recording = Recording::from_files(Arc::new(files), &Limits::default())?;

    let options = Options::new(Method::Auto);
    let before = audit(&recording, &options, &Silent)?;
    let plan = Plan::of_audit(&before, Selection::default())?;
    let mut corrected = Memory::new("ipad-corrected");
    correct(&recording, &plan, &mut corrected)?;
    let recording = Recording::from_files(Arc::new(corrected), &Limits::default())?;
    let after = audit(&recording, &options, &Silent)?;

    for (when, audit) in [("before", &before), ("after", &after)] {
        let faults = audit.findings.iter().filter(|f| f.verdict.name() == "fault");
        let faults: Vec<_> = faults.map(|f| f.code.to_string()).collect();
        println!("{when}: {} faults {}", faults.len(), faults.join(" "));
    }
    Ok(())
}
