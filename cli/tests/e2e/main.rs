//! The command from outside: what is typed, what comes out of which stream, and the exit code.

mod audit;
mod bad_input;
mod board;
mod calibrate;
mod correct;
mod detect;
mod pictures;
mod reproduce;
mod scratch;
mod usage;

use std::{
    path::Path,
    process::{Command, Output},
};

/// Runs `truedepth` with these arguments, without colour and without a terminal.
fn truedepth<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Run {
    Run::of(Command::new(env!("CARGO_BIN_EXE_truedepth")).args(args))
}

/// As [`truedepth`], in this folder.
fn truedepth_in<'a>(folder: &Path, args: impl IntoIterator<Item = &'a str>) -> Run {
    Run::of(Command::new(env!("CARGO_BIN_EXE_truedepth")).args(args).current_dir(folder))
}

/// How a run ended.
#[derive(Debug)]
struct Run {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Run {
    fn of(command: &mut Command) -> Self {
        let Output { status, stdout, stderr } = command.output().expect("the binary was built");
        let text = |bytes| String::from_utf8(bytes).expect("output is UTF-8");
        let run = Self { code: status.code(), stdout: text(stdout), stderr: text(stderr) };
        assert!(!run.stderr.contains("panicked"), "{run:#?}");
        run
    }

    #[track_caller]
    fn code(self, expected: i32) -> Self {
        assert_eq!(self.code, Some(expected), "{self:#?}");
        self
    }

    /// Words that must stand on stderr.
    #[track_caller]
    fn says(self, words: &[&str]) -> Self {
        for word in words {
            assert!(self.stderr.contains(word), "`{word}` is missing: {self:#?}");
        }
        self
    }
}
