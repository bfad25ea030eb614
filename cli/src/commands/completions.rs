//! `truedepth completions SHELL`

use clap::CommandFactory;

use crate::{
    args::{Args, CompletionsArgs},
    failure::Failure,
    outcome::Outcome,
    terminal::Terminal,
};

pub(crate) fn run(args: &CompletionsArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    // clap_complete panics on a closed pipe; a buffer does not.
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "truedepth", &mut script);
    terminal.result(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Clean)
}
