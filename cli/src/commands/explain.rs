//! `truedepth explain [CODE]`

use truedepth::{diagnose::Code, report::Tone};

use crate::{args::ExplainArgs, failure::Failure, outcome::Outcome, terminal::Terminal};

pub(crate) fn run(args: &ExplainArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let mut text = String::new();
    match &args.code {
        None => {
            for code in Code::ALL {
                let name = terminal.paint(Tone::Strong, code.name());
                text.push_str(&format!("{name}  {}\n", code.title()));
            }
        }
        Some(code) => {
            let code: Code = code.parse()?;
            for line in code.explanation().trim().lines() {
                let is_heading = line.starts_with('#');
                text.push_str(&if is_heading {
                    terminal.paint(Tone::Strong, line)
                } else {
                    line.to_owned()
                });
                text.push('\n');
            }
        }
    }
    terminal.result(&text)?;
    Ok(Outcome::Clean)
}
