//! The `truedepth` command: parse what was typed, call the library, show what it found.
//!
//! `main` is the single place that turns an outcome into an exit code.

mod args;
mod commands;
mod failure;
mod files;
mod input;
mod outcome;
mod terminal;

use std::process::ExitCode;

use clap::Parser;

use crate::{args::Args, outcome::Outcome, terminal::Terminal};

fn main() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(e) => {
            // A closed pipe must not turn `--help | head` into an error.
            let _ = e.print();
            return ExitCode::from(if e.use_stderr() { 2 } else { 0 });
        }
    };
    let terminal = Terminal::new(&args.global);
    match commands::dispatch(args, &terminal) {
        Ok(Outcome::Clean) => ExitCode::SUCCESS,
        Ok(Outcome::NotAllRan) => ExitCode::from(1),
        Ok(Outcome::Faults) => ExitCode::from(3),
        Err(failure) => {
            terminal.failure(&failure);
            ExitCode::from(1)
        }
    }
}
