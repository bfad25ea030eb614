//! `truedepth man [VERB]`

use clap::CommandFactory;
use clap_mangen::Man;

use crate::{
    args::{Args, ManArgs},
    failure::Failure,
    outcome::Outcome,
    terminal::Terminal,
};

pub(crate) fn run(args: &ManArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let mut command = Args::command();
    command.build(); // Global options reach the verbs here.
    let page = match &args.verb {
        None => command,
        Some(verb) => command
            .get_subcommands()
            .find(|c| c.get_name() == verb && verb != "help")
            .cloned()
            .ok_or_else(|| {
                Failure::new(format!("there is no verb `{verb}`"))
                    .hint("`truedepth --help` lists them")
            })?,
    };
    let mut roff = Vec::new();
    Man::new(page).render(&mut roff)?;
    terminal.result(&String::from_utf8_lossy(&roff))?;
    Ok(Outcome::Clean)
}
