//! The summary for a terminal.

use super::{
    next::{NextStep, Typed, known_of_this_camera, next_steps},
    words::{self, Row},
};
use crate::{
    audit::Audit,
    diagnose::{Code, Finding, Verdict},
};

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

/// Running text is broken before it gets wider than this where there is room for more, characters.
const MAX_WIDTH: usize = 96;
/// Nothing is broken to be narrower than this.
const MIN_WIDTH: usize = 54;
/// Blanks between columns.
const GAP: usize = 2;
/// Before running text: the code of its finding.
const INDENT: usize = 7;

/// What a person reads in ten seconds: which camera, how many faults, the numbers in columns, what to do, what to type
/// next. Lines fit into `width` characters (of a terminal; 100 is a good width without one), but for commands, which
/// are never broken, so that they can be copied.
pub fn summary(audit: &Audit, typed: &Typed, width: usize) -> Vec<Line> {
    let width = width.max(MIN_WIDTH);
    let prose = width.min(MAX_WIDTH);
    let mut lines = Vec::new();
    let mut say = |tone, text: &str, prose: usize| {
        lines.extend(wrapped(text, prose).into_iter().map(|text| Line::default().with(tone, text)));
    };
    // Words of the device are read once: as wide as the terminal has room.
    say(Tone::Plain, &words::device_line(audit), width);
    say(Tone::Faint, &words::board_line(audit), width);
    if let Some(known) = known_of_this_camera(audit) {
        say(Tone::Plain, &known, width);
    }
    say(Tone::Plain, "", prose);
    let (verdict, headline) = words::headline(audit);
    say(Tone::of(verdict), &headline, prose);
    lines.push(Line::default());
    lines.extend(table(&words::rows(audit), width));
    lines.extend(passed(audit, prose));
    let loud = |f: &&Finding| matches!(f.verdict, Verdict::Fault | Verdict::Warning);
    for finding in words::by_severity(audit).into_iter().filter(loud) {
        lines.push(Line::default());
        lines.extend(paragraph(finding.code.name(), &finding.summary(), prose));
        lines.extend(to_do(&finding.what_to_do, prose));
    }
    for group in words::cannot_tell(audit) {
        lines.push(Line::default());
        lines.extend(open_question(&group, prose));
        lines.extend(to_do(group.what_to_do, prose));
    }
    lines.extend(next(&next_steps(audit, typed)));
    lines
}

/// The checks that have no row, in a sentence each for what is OK and what is worth knowing.
fn passed(audit: &Audit, prose: usize) -> Vec<Line> {
    let mut lines = Vec::new();
    for (findings, words) in
        words::without_a_row(audit).into_iter().zip(["worth knowing: ", "OK, too: "])
    {
        let names: Vec<String> = findings
            .iter()
            .map(|f| format!("{}\u{a0}{}", f.title().to_lowercase().replace(' ', "\u{a0}"), f.code))
            .collect();
        if !names.is_empty() {
            let text = format!("{words}{}", names.join(", "));
            lines.extend(
                wrapped(&text, prose - 2)
                    .into_iter()
                    .map(|words| Line::default().with(Tone::Faint, format!("  {words}"))),
            );
        }
    }
    lines
}

/// Checks that cannot tell: which, and why.
fn open_question(group: &words::CannotTell<'_>, prose: usize) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    match &group.why {
        Some(why) => {
            let names: Vec<String> = group
                .findings
                .iter()
                .map(|f| {
                    format!("{}\u{a0}({})", f.title().to_lowercase().replace(' ', "\u{a0}"), f.code)
                })
                .collect();
            let text = format!("{why} So these cannot tell: {}.", names.join(", "));
            lines.extend(paragraph("?", &text, prose));
        }
        None => {
            for finding in &group.findings {
                lines.extend(paragraph(finding.code.name(), &finding.summary(), prose));
            }
        }
    }
    lines
}

/// Text beside a code.
fn paragraph(code: &str, text: &str, prose: usize) -> Vec<Line> {
    wrapped(text, prose - INDENT)
        .into_iter()
        .enumerate()
        .map(|(index, words)| {
            let code = if index == 0 { code } else { "" };
            Line::default()
                .with(Tone::Strong, format!("{code:5}"))
                .with(Tone::Plain, format!("  {words}"))
        })
        .collect()
}

/// What to do, behind an arrow.
fn to_do(text: &str, prose: usize) -> Vec<Line> {
    wrapped(text, prose - INDENT)
        .into_iter()
        .filter(|words| !words.is_empty())
        .enumerate()
        .map(|(index, words)| {
            let arrow = if index == 0 { "→" } else { " " };
            Line::default().with(Tone::Plain, format!("     {arrow} {words}"))
        })
        .collect()
}

/// What to type: each command on a line of its own below what it is good for, as in a script, so that even all of it
/// can be copied.
fn next(steps: &[NextStep]) -> Vec<Line> {
    let mut lines = Vec::new();
    for (index, NextStep { to, command }) in steps.iter().enumerate() {
        if index == 0 {
            lines.push(Line::default());
            lines.push(Line::default().with(Tone::Plain, "What to type next"));
        }
        lines.push(Line::default().with(Tone::Faint, format!("  # to {to}")));
        lines.push(Line::default().with(Tone::Strong, format!("  {command}")));
    }
    lines
}

/// The text in lines of at most `width` characters, broken between words, never between a number and its unit; one
/// empty line of nothing.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words::unbroken(text).split(' ').filter(|word| !word.is_empty()) {
        match lines
            .last_mut()
            .filter(|line| line.chars().count() + 1 + word.chars().count() <= width)
        {
            Some(line) => {
                line.push(' ');
                line.push_str(word);
            }
            None => lines.push(word.to_owned()),
        }
    }
    if lines.is_empty() {
        lines.push(String::new());
    }
    lines.into_iter().map(|line| line.replace('\u{a0}', " ")).collect()
}

/// Aligned columns: code, verdict, quantity, factory, measured, difference; where they do not fit, without the
/// factory's, and where these do not fit either, a quantity's numbers stand below it.
fn table(rows: &[Row], width: usize) -> Vec<Line> {
    let header = words::HEADER.map(str::to_owned);
    let all: Vec<[String; 4]> = rows
        .iter()
        .map(|row| [&row.quantity, &row.factory, &row.measured, &row.difference].map(Clone::clone))
        .collect();
    // Without the column of the factory, its depth error goes where nothing else stands.
    let without_factory: Vec<[String; 4]> = rows
        .iter()
        .zip(&all)
        .map(|(row, [quantity, factory, measured, difference])| {
            let moved = format!("factory {factory}");
            let last = if row.verdict.is_none() { moved } else { difference.clone() };
            [quantity.clone(), String::new(), measured.clone(), last]
        })
        .collect();
    let verdict_width = rows
        .iter()
        .filter_map(|row| Some(words::verdict_word(row.verdict?.1).chars().count()))
        .max()
        .unwrap_or(0);
    let head = |row: &Row| head(row, verdict_width);
    let widths_of = |cells: &[[String; 4]]| -> [usize; 4] {
        std::array::from_fn(|column| {
            let all = cells.iter().chain([&header]);
            all.map(|cells| cells[column].chars().count()).max().unwrap_or(0)
        })
    };
    let fits = |(cells, columns): &(&[[String; 4]], &[usize])| {
        let widths = widths_of(cells);
        let needed: usize = columns.iter().map(|&c| widths[c] + GAP).sum();
        INDENT + 2 + verdict_width + needed <= width
    };
    let layouts: [(&[[String; 4]], &[usize]); 2] =
        [(&all, &[0, 1, 2, 3]), (&without_factory, &[0, 2, 3])];
    let Some((cells, columns)) = layouts.into_iter().find(fits) else {
        return stacked(rows, &all);
    };
    let widths = widths_of(cells);
    let line = |cells: &[String; 4]| {
        let mut text = String::new();
        for &column in columns {
            let (cell, width) = (&cells[column], widths[column]);
            let blanks =
                " ".repeat(width - cell.chars().count() + if column == 0 { 0 } else { GAP });
            // Words to the left, numbers to the right.
            text += &match column {
                0 => format!("{:GAP$}{cell}{blanks}", ""),
                _ => format!("{blanks}{cell}"),
            };
        }
        text.trim_end().to_owned()
    };
    let indent = " ".repeat(INDENT + 2 + verdict_width);
    let mut lines = vec![Line::default().with(Tone::Faint, format!("{indent}{}", line(&header)))];
    for (row, cells) in rows.iter().zip(cells) {
        lines.push(head(row).with(Tone::Plain, line(cells)));
    }
    lines
}

/// Code and verdict of a row.
fn head(row: &Row, verdict_width: usize) -> Line {
    let (code, tone, word) = row.verdict.map_or(("", Tone::Plain, ""), |(code, verdict)| {
        (code.name(), Tone::of(verdict), words::verdict_word(verdict))
    });
    let line = Line::default().with(Tone::Plain, "  ").with(Tone::Faint, format!("{code:5}  "));
    line.with(tone, format!("{word:verdict_width$}"))
}

/// The table on a narrow terminal: a quantity, and its numbers below, each with its name.
fn stacked(rows: &[Row], cells: &[[String; 4]]) -> Vec<Line> {
    let mut lines = Vec::new();
    for (row, [quantity, numbers @ ..]) in rows.iter().zip(cells) {
        let gap = if row.verdict.is_some() { "  " } else { "" };
        lines.push(head(row, 0).with(Tone::Plain, format!("{gap}{quantity}")));
        for (name, number) in words::HEADER[1..].iter().zip(numbers) {
            if !number.is_empty() && number != "—" {
                let indent = " ".repeat(INDENT + 2);
                lines.push(
                    Line::default().with(Tone::Plain, format!("{indent}{name:10}  {number}")),
                );
            }
        }
    }
    lines
}

/// One line for each recording of several: its name, how many faults, and what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    name: String,
    /// Where it is, for where two have one name.
    place: String,
    verdict: Verdict,
    /// Focal length against the factory's, depth error with the factory's and with the own camera.
    numbers: [String; 3],
    headline: String,
}

impl Overview {
    /// Of an audit; small, so that it can be kept when the audit is gone.
    pub fn of(audit: &Audit, typed: &Typed) -> Self {
        let (verdict, headline) = words::headline(audit);
        let of = |code| {
            words::rows(audit).into_iter().find(|row| row.verdict.is_some_and(|v| v.0 == code))
        };
        let depth = words::rows(audit).into_iter().find(|row| row.verdict.is_none());
        let focal = of(Code::TD201).map_or(String::new(), |row| row.difference);
        let [factory, own] = depth.map_or_else(Default::default, |row| [row.factory, row.measured]);
        let (name, place) = (audit.name.clone(), typed.recording.clone());
        Self { name, place, verdict, numbers: [focal, factory, own], headline }
    }
}

/// Several recordings beside each other, in aligned columns; with fewer than two, nothing.
pub fn overview(recordings: &[Overview], width: usize) -> Vec<Line> {
    const HEADER: [&str; 3] = ["focal length", "depth error, factory", "own"];
    if recordings.len() < 2 {
        return Vec::new();
    }
    let longest = |texts: &mut dyn Iterator<Item = &str>| {
        texts.map(|text| text.chars().count()).max().unwrap_or(0)
    };
    let name_of = |recording: &Overview| {
        let is_taken = recordings.iter().filter(|other| other.name == recording.name).count() > 1;
        if is_taken { recording.place.clone() } else { recording.name.clone() }
    };
    let names: Vec<String> = recordings.iter().map(name_of).collect();
    let name_width = longest(&mut names.iter().map(String::as_str));
    let widths: [usize; 3] = std::array::from_fn(|i| {
        longest(&mut recordings.iter().map(|r| r.numbers[i].as_str()).chain([HEADER[i]]))
    });
    let padded =
        |text: &str, width: usize| format!("{}{text}", " ".repeat(width - text.chars().count()));
    let mut lines = vec![
        Line::default().with(Tone::Strong, words::count(recordings.len(), "recording")),
        Line::default(),
    ];
    let is_wide = 2 + name_width + widths.iter().map(|w| w + 3).sum::<usize>() <= width;
    if is_wide {
        let header: String = HEADER
            .iter()
            .zip(widths)
            .map(|(title, width)| format!("   {}", padded(title, width)))
            .collect();
        let header = format!("{}{header}", " ".repeat(2 + name_width));
        lines.push(Line::default().with(Tone::Faint, header));
    }
    for (recording, name) in recordings.iter().zip(&names) {
        let blanks = " ".repeat(name_width - name.chars().count());
        let mut line = Line::default().with(Tone::Strong, format!("  {name}{blanks}"));
        if is_wide {
            for (number, width) in recording.numbers.iter().zip(widths) {
                line = line.with(Tone::Plain, format!("   {}", padded(number, width)));
            }
        }
        lines.push(line);
        for words in wrapped(&recording.headline, width.clamp(MIN_WIDTH, MAX_WIDTH) - 4) {
            lines.push(Line::default().with(Tone::of(recording.verdict), format!("    {words}")));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::sample;

    fn plain(audit: &Audit, width: usize) -> String {
        let lines = summary(audit, &Typed::of(audit), width);
        lines.iter().map(|line| line.to_plain() + "\n").collect()
    }

    #[test]
    fn ten_seconds() {
        let audit = sample::audit();
        sample::assert_golden("report/golden/summary.txt", &plain(&audit, 100));
        sample::assert_golden("report/golden/summary-narrow.txt", &plain(&audit, 60));
    }

    #[test]
    fn nothing_but_a_command_is_wider_than_the_terminal() {
        for width in [54, 60, 80, 120] {
            for line in plain(&sample::audit(), width).lines() {
                let is_command = line.starts_with("  truedepth ");
                assert!(is_command || line.chars().count() <= width, "{width}: {line}");
            }
        }
    }

    #[test]
    fn verdicts_stand_in_one_column_and_are_words() {
        let audit = sample::audit();
        let lines = summary(&audit, &Typed::of(&audit), 120);
        let of_findings: Vec<&Line> = lines
            .iter()
            .filter(|line| line.spans.len() == 4 && line.spans[1].text.starts_with("TD"))
            .collect();
        assert!(of_findings.len() > 1, "{lines:?}");
        for line in &of_findings {
            assert_eq!(line.spans[1].text.chars().count(), 7, "{line:?}");
            assert_eq!(line.spans[2].text.chars().count(), "CANNOT TELL".len(), "{line:?}");
        }
        let fault =
            of_findings.iter().find(|l| l.spans[2].text.starts_with("FAULT")).expect("a fault");
        assert_eq!(fault.spans[2].tone, Tone::Bad);
    }

    #[test]
    fn what_waits_for_the_camera_is_said_once() {
        let mut audit = sample::audit();
        audit.measured.no_calibration =
            Some("the 5 views do not determine a focal length".to_owned());
        audit.measured.calibration = None;
        audit.measured.camera = None;
        for code in [Code::TD201, Code::TD301] {
            let finding =
                audit.findings.iter_mut().find(|f| f.code == code).expect("the sample has it");
            finding.verdict = Verdict::Unknown;
            finding.value = None;
            finding.what_to_do = "Record 20 frames.".to_owned();
        }
        let text = plain(&audit, 100);
        assert_eq!(text.matches("The 5 views do not determine").count(), 1, "{text}");
        assert_eq!(text.matches("Record 20 frames.").count(), 1, "{text}");
        assert!(text.contains("cannot tell: focal length (TD201),"), "{text}");
    }

    #[test]
    fn recordings_beside_each_other() {
        let audit = sample::audit();
        assert_eq!(overview(&[Overview::of(&audit, &Typed::of(&audit))], 100), []);
        let mut other = sample::audit();
        other.measured.name = "short".to_owned();
        other.findings.retain(|f| f.verdict == Verdict::Ok);
        let both =
            [Overview::of(&audit, &Typed::of(&audit)), Overview::of(&other, &Typed::of(&other))];
        let text: Vec<String> = overview(&both, 100).iter().map(Line::to_plain).collect();
        assert!(
            text.iter().any(|line| line.contains("This recording has 1 fault: focal length.")),
            "{text:?}"
        );
        assert!(
            text.iter().any(|line| line.contains("This recording shows no fault.")),
            "{text:?}"
        );
        assert!(overview(&both, 30).iter().all(|line| !line.to_plain().contains("mm")));
    }

    #[test]
    fn a_name_cannot_move_the_cursor() {
        let mut audit = sample::audit();
        audit.measured.name = "\u{1b}[2Jx\n".to_owned();
        let text: String =
            summary(&audit, &Typed::of(&audit), 100).iter().map(Line::to_plain).collect();
        assert!(!text.contains(char::is_control) && text.contains("\u{fffd}[2Jx"));
    }
}
