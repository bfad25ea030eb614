//! Results to stdout; words, warnings and progress to stderr.

use std::{
    env,
    io::{self, ErrorKind, IsTerminal, Write},
};

use anstyle::{AnsiColor, Style};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use truedepth::{
    measure::{Observer, Progress},
    report::{Line, Tone},
};

use crate::{
    args::{ColorChoice, GlobalArgs},
    failure::Failure,
};

/// The two streams, and how much may be said on them.
pub(crate) struct Terminal {
    verbosity: Verbosity,
    color_stdout: bool,
    color_stderr: bool,
}

/// How much is said on stderr.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Verbosity {
    Quiet,
    Normal,
    Verbose,
}

fn style(tone: Tone) -> Style {
    match tone {
        Tone::Plain => Style::new(),
        Tone::Strong => Style::new().bold(),
        Tone::Faint => Style::new().dimmed(),
        Tone::Good => AnsiColor::Green.on_default().bold(),
        Tone::Bad => AnsiColor::Red.on_default().bold(),
        Tone::Unsure => AnsiColor::Yellow.on_default().bold(),
    }
}

impl Terminal {
    pub(crate) fn new(args: &GlobalArgs) -> Self {
        let verbosity = match (args.quiet, args.verbose) {
            (true, _) => Verbosity::Quiet,
            (_, true) => Verbosity::Verbose,
            _ => Verbosity::Normal,
        };
        let color = |is_terminal: bool| match args.color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            // https://no-color.org: present and not empty.
            ColorChoice::Auto => {
                is_terminal
                    && env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
                    && env::var_os("TERM").is_none_or(|v| v != "dumb")
            }
        };
        Self {
            verbosity,
            color_stdout: color(io::stdout().is_terminal()),
            color_stderr: color(io::stderr().is_terminal()),
        }
    }

    /// A result, on stdout. A reader who has seen enough and closed the pipe is no error.
    pub(crate) fn result(&self, text: &str) -> Result<(), Failure> {
        let mut stdout = io::stdout().lock();
        match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
            Err(e) if e.kind() != ErrorKind::BrokenPipe => {
                Err(Failure::from(e).within("cannot write to stdout"))
            }
            _ => Ok(()),
        }
    }

    /// The summary of an audit, on stdout.
    pub(crate) fn lines(&self, lines: &[Line]) -> Result<(), Failure> {
        let mut text = String::new();
        for line in lines {
            for span in &line.spans {
                text.push_str(&self.paint(span.tone, &span.text));
            }
            text.push('\n');
        }
        self.result(&text)
    }

    /// Characters in a line of stdout; where it is no terminal, tables may be as wide as they are.
    pub(crate) fn width(&self) -> usize {
        const NO_BOUND: usize = 1000;
        console::Term::stdout().size_checked().map_or(NO_BOUND, |(_, columns)| usize::from(columns))
    }

    /// A word in a result, coloured where stdout takes colour.
    pub(crate) fn paint(&self, tone: Tone, word: &str) -> String {
        paint(self.color_stdout, tone, word)
    }

    /// A line for people, on stderr; silent with `-q`.
    pub(crate) fn say(&self, text: &str) {
        if self.verbosity > Verbosity::Quiet {
            self.stderr(text);
        }
    }

    /// A line for the curious, on stderr, with `-v` only.
    pub(crate) fn detail(&self, text: &str) {
        if self.verbosity == Verbosity::Verbose {
            self.stderr(&self.paint_stderr(Tone::Faint, text));
        }
    }

    /// What should not be overlooked, on stderr, also with `-q`.
    pub(crate) fn warn(&self, text: &str) {
        self.stderr(&format!("{}: {text}", self.paint_stderr(Tone::Unsure, "warning")));
    }

    /// Why the run failed, on stderr, also with `-q`.
    pub(crate) fn failure(&self, failure: &Failure) {
        self.stderr(&format!("{}: {}", self.paint_stderr(Tone::Bad, "error"), failure.message));
        for cause in &failure.causes {
            self.stderr(&format!("  because: {cause}"));
        }
        if let Some(hint) = &failure.hint {
            self.stderr(&format!("{}: {hint}", self.paint_stderr(Tone::Strong, "hint")));
        }
    }

    /// A progress bar of `n` steps; invisible unless stderr is a terminal, and with `-q`.
    pub(crate) fn progress(&self, what: &str, n: usize) -> ProgressBar {
        let bar = ProgressBar::with_draw_target(Some(n as u64), self.draw_target());
        let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}")
            .expect("the template is a constant");
        bar.with_style(style).with_message(what.to_owned())
    }

    fn draw_target(&self) -> ProgressDrawTarget {
        if self.verbosity == Verbosity::Quiet || !io::stderr().is_terminal() {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        }
    }

    fn paint_stderr(&self, tone: Tone, word: &str) -> String {
        paint(self.color_stderr, tone, word)
    }

    fn stderr(&self, line: &str) {
        // Nobody listening on stderr leaves nobody to tell.
        let _ = writeln!(io::stderr().lock(), "{line}");
    }
}

fn paint(color: bool, tone: Tone, word: &str) -> String {
    let style = style(tone);
    if color && tone != Tone::Plain { format!("{style}{word}{style:#}") } else { word.to_owned() }
}

/// Moves a progress bar, one step a frame.
pub(crate) struct Bar<'a>(pub(crate) &'a ProgressBar);

impl Observer for Bar<'_> {
    fn progress(&self, Progress { done, total, .. }: Progress) {
        self.0.set_length(total as u64);
        self.0.set_position(done as u64);
    }
}
