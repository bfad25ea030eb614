//! `truedepth simulate -o REC`

use truedepth::{
    files::NewFolder,
    simulate::{Device, Faults, Plan},
};

use crate::{
    args::{self, SimulateArgs},
    failure::Failure,
    input,
    outcome::Outcome,
    terminal::Terminal,
};

pub(crate) fn run(args: &SimulateArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let device: Device = Device::named(&args.device)?;
    let mut plan = Plan::new(device, args.seed);
    plan.faults = Faults::parse(args.faults.iter().map(String::as_str))?;
    plan.trajectory = match args.trajectory {
        args::Trajectory::HandHeld => truedepth::simulate::Trajectory::HandHeld,
        args::Trajectory::FrontoParallel => truedepth::simulate::Trajectory::FrontoParallel,
    };
    plan.n_frames = args.frames.map_or(plan.trajectory.usual_frames(), usize::from);
    if let Some(board) = input::board(&args.board)? {
        plan.board = board;
    }
    let sink = NewFolder::create(&args.output)?;
    let bar = terminal.progress("rendering", plan.n_frames);
    plan.write(sink, |done| bar.set_position(done as u64))?;
    bar.finish_and_clear();

    let folder = args.output.display();
    terminal.say(&format!(
        "{} frames in {folder}; what is true of them is in {folder}/truth.json",
        plan.n_frames
    ));
    terminal.say(&format!("next: truedepth audit {folder}"));
    Ok(Outcome::Clean)
}
