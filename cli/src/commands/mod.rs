//! One file per verb: each parses nothing, computes nothing; it calls the library and shows what came back.

mod audit;
mod board;
mod calibrate;
mod compare;
mod completions;
mod correct;
mod demo;
mod detect;
mod explain;
mod inspect;
mod man;
mod overlay;
mod reproduce;
mod simulate;
mod undistort;

use crate::{
    args::{Args, Command},
    failure::Failure,
    outcome::Outcome,
    terminal::Terminal,
};

/// Runs the verb that was typed.
pub(crate) fn dispatch(args: Args, terminal: &Terminal) -> Result<Outcome, Failure> {
    if let Some(n) = args.global.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(n))
            .build_global()
            .map_err(|e| Failure::from(e).within(format!("cannot start {n} threads")))?;
    }
    match args.command {
        Command::Audit(args) => audit::run(&args, terminal),
        Command::Board(args) => board::run(&args, terminal),
        Command::Inspect(args) => inspect::run(&args, terminal),
        Command::Compare(args) => compare::run(&args, terminal),
        Command::Correct(args) => correct::run(&args, terminal),
        Command::Overlay(args) => overlay::run(&args, terminal),
        Command::Reproduce(args) => reproduce::run(&args, terminal),
        Command::Undistort(args) => undistort::run(&args, terminal),
        Command::Calibrate(args) => calibrate::run(&args, terminal),
        Command::Demo(args) => demo::run(&args, terminal),
        Command::Simulate(args) => simulate::run(&args, terminal),
        Command::Detect(args) => detect::run(&args, terminal),
        Command::Completions(args) => completions::run(&args, terminal),
        Command::Explain(args) => explain::run(&args, terminal),
        Command::Man(args) => man::run(&args, terminal),
    }
}
