//! Help, versions, usage errors and streams.

use std::{
    io::Read,
    process::{Command, Stdio},
};

use crate::truedepth;

fn verbs() -> Vec<String> {
    let help = truedepth(["--help"]).code(0).stdout;
    let commands = help.split("Commands:\n").nth(1).expect("a list of verbs");
    commands
        .lines()
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|verb| *verb != "help")
        .map(str::to_owned)
        .collect()
}

#[test]
fn help_is_a_result_and_usage_an_error() {
    let run = truedepth(["--help"]).code(0);
    assert!(run.stdout.contains("Exit codes:") && run.stderr.is_empty(), "{run:#?}");
    assert!(truedepth(["--version"]).code(0).stdout.starts_with("truedepth 0."));
    let none: [&str; 0] = [];
    truedepth(none).code(2).says(&["Usage:"]);
    truedepth(["frobnicate"]).code(2).says(&["frobnicate"]);
    truedepth(["completions", "bash", "--threads", "0"]).code(2).says(&["--threads"]);
    truedepth(["completions", "bash", "-q", "-v"]).code(2).says(&["--quiet"]);
}

#[test]
fn every_verb_teaches() {
    let verbs = verbs();
    assert!(verbs.contains(&"completions".to_owned()), "{verbs:?}");
    for verb in verbs {
        let help = truedepth([&verb, "--help"]).code(0).stdout;
        assert!(
            help.contains("Examples:\n") && help.contains(&format!("truedepth {verb}")),
            "{help}"
        );
        let page = truedepth(["man", &verb]).code(0).stdout;
        assert!(
            page.contains(".SH SYNOPSIS") && page.contains(&format!("truedepth\\-{verb}")),
            "{page}"
        );
    }
    truedepth(["man", "frobnicate"]).code(1).says(&["frobnicate", "hint: "]);
}

#[test]
fn completions_know_the_verbs() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = truedepth(["completions", shell]).code(0).stdout;
        for verb in verbs() {
            assert!(script.contains(&verb), "{shell} {verb}");
        }
    }
}

/// `truedepth completions bash | head -c 1` must end quietly.
#[test]
fn a_closed_pipe_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_truedepth"))
        .args(["completions", "bash"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary was built");
    drop(child.stdout.take());
    let mut stderr = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut stderr).expect("UTF-8");
    assert_eq!(child.wait().expect("it ends").code(), Some(0), "{stderr}");
    assert_eq!(stderr, "");
}
