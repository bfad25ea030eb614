//! The summary for a terminal.

use super::words::{self, Row};
use crate::{audit::Audit, diagnose::Verdict};

/// How a piece of text is meant; the shell chooses the colour. Colour only repeats what the words say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Tone {
    /// As any text.
    Plain,
    /// What to read first.
    Strong,
    /// What may be passed over.
    Faint,
    /// Nothing is wrong.
    Good,
    /// Something is wrong.
    Bad,
    /// It may be wrong, or nobody can tell.
    Unsure,
}

impl Tone {
    /// The tone of a verdict.
    pub const fn of(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Fault => Self::Bad,
            Verdict::Warning | Verdict::Unknown => Self::Unsure,
            Verdict::Info => Self::Plain,
            Verdict::Ok => Self::Good,
        }
    }
}

/// A piece of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// How it is meant.
    pub tone: Tone,
    /// The text, without line breaks or control characters.
    pub text: String,
}

/// A line of text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// From left to right.
    pub spans: Vec<Span>,
}

impl Line {
    /// The text alone.
    pub fn to_plain(&self) -> String {
        self.spans.iter().map(|span| span.text.as_str()).collect()
    }

    /// Adds text; what comes out of a file must not move the cursor of a terminal.
    fn with(mut self, tone: Tone, text: impl Into<String>) -> Self {
        let text = text.into().replace(char::is_control, "\u{fffd}");
        self.spans.push(Span { tone, text });
        self
    }
}

/// Running text is broken before it gets wider than this, characters.
const WIDTH: usize = 88;

/// What a person reads in ten seconds: which camera, how many faults, the numbers in columns, what to do.
pub fn summary(audit: &Audit) -> Vec<Line> {
    let mut lines = vec![
        Line::default().with(Tone::Plain, words::device_line(audit)),
        Line::default().with(Tone::Faint, words::board_line(audit)),
        Line::default(),
    ];
    let (verdict, headline) = words::headline(audit);
    lines.push(Line::default().with(Tone::of(verdict), headline));
    lines.push(Line::default());
    lines.extend(table(&words::rows(audit)));
    let to_do: Vec<_> = words::by_severity(audit)
        .into_iter()
        .filter(|finding| {
            matches!(finding.verdict, Verdict::Fault | Verdict::Warning | Verdict::Unknown)
        })
        .collect();
    for finding in &to_do {
        lines.push(Line::default());
        for (index, words) in wrapped(&finding.summary).into_iter().enumerate() {
            let code = if index == 0 { finding.code.name() } else { "" };
            lines.push(
                Line::default()
                    .with(Tone::Strong, format!("{code:5}"))
                    .with(Tone::Plain, format!("  {words}")),
            );
        }
        for (index, words) in wrapped(&finding.what_to_do).into_iter().enumerate() {
            let arrow = if index == 0 { "→" } else { " " };
            lines.push(Line::default().with(Tone::Plain, format!("     {arrow} {words}")));
        }
    }
    if let Some(first) = to_do.first() {
        lines.push(Line::default());
        lines.push(
            Line::default()
                .with(Tone::Faint, "next: ")
                .with(Tone::Strong, words::explain_command(first))
                .with(Tone::Faint, "   what it means and what to do"),
        );
    }
    lines
}

/// The text in lines of at most [`WIDTH`] characters, broken between words, never between a number and its unit.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words::unbroken(text).split(' ').filter(|word| !word.is_empty()) {
        match lines
            .last_mut()
            .filter(|line| line.chars().count() + 1 + word.chars().count() <= WIDTH)
        {
            Some(line) => {
                line.push(' ');
                line.push_str(word);
            }
            None => lines.push(word.to_owned()),
        }
    }
    lines.into_iter().map(|line| line.replace('\u{a0}', " ")).collect()
}

/// Aligned columns: quantity, factory, measured, difference, code, verdict.
fn table(rows: &[Row]) -> Vec<Line> {
    let header = words::HEADER.map(str::to_owned);
    let cells: Vec<[String; 4]> = rows
        .iter()
        .map(|row| [&row.quantity, &row.factory, &row.measured, &row.difference].map(Clone::clone))
        .collect();
    let width = |column: usize| {
        let all = cells.iter().chain([&header]);
        all.map(|cells| cells[column].chars().count()).max().unwrap_or(0)
    };
    let widths: [usize; 4] = std::array::from_fn(width);
    let line = |cells: &[String; 4]| {
        let mut text = String::from("  ");
        for (column, (cell, width)) in cells.iter().zip(widths).enumerate() {
            let blanks = " ".repeat(width - cell.chars().count());
            // Words to the left, numbers to the right.
            text +=
                &if column == 0 { format!("{cell}{blanks}") } else { format!("   {blanks}{cell}") };
        }
        text
    };
    let mut lines = vec![Line::default().with(Tone::Faint, line(&header))];
    for (row, cells) in rows.iter().zip(&cells) {
        lines.push(match row.verdict {
            Some((code, verdict)) => Line::default()
                .with(Tone::Plain, line(cells))
                .with(Tone::Faint, format!("   {code}  "))
                .with(Tone::of(verdict), words::verdict_word(verdict)),
            None => Line::default().with(Tone::Plain, line(cells).trim_end()),
        });
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    #[test]
    fn ten_seconds() {
        let text: String =
            summary(&sample::audit()).iter().map(|line| line.to_plain() + "\n").collect();
        sample::assert_golden("summary.txt", &text);
    }

    #[test]
    fn verdicts_stand_in_one_column_and_are_words() {
        let lines = summary(&sample::audit());
        let at: Vec<usize> = lines
            .iter()
            .filter(|line| line.spans.len() == 3 && line.spans[1].text.starts_with("   TD"))
            .map(|line| line.spans[0].text.chars().count())
            .collect();
        assert!(at.len() > 2 && at.iter().all(|&column| column == at[0]), "{at:?}");
        let fault =
            lines.iter().flat_map(|l| &l.spans).find(|s| s.text == "FAULT").expect("a fault");
        assert_eq!(fault.tone, Tone::Bad);
    }

    #[test]
    fn a_name_cannot_move_the_cursor() {
        let mut audit = sample::audit();
        audit.name = "\u{1b}[2Jx\n".to_owned();
        let text: String = summary(&audit).iter().map(Line::to_plain).collect();
        assert!(!text.contains(char::is_control) && text.contains("\u{fffd}[2Jx"));
    }
}
