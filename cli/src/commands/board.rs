//! `truedepth board -o FILE`

use std::path::PathBuf;

use truedepth::{
    board::{CharucoBoard, Dictionary, Layout, Orientation, Paper, Sheet},
    recording::board_to_toml,
    report::{sheet_pdf, sheet_png, sheet_svg},
};

use crate::{
    args::{LayoutChoice, OrientationChoice, PaperSize, PrintArgs, PrintFormat},
    failure::Failure,
    files::{self, Replace},
    input,
    outcome::Outcome,
    terminal::Terminal,
};

const DPI: u32 = 300;

pub(crate) fn run(args: &PrintArgs, terminal: &Terminal) -> Result<Outcome, Failure> {
    let path = &args.output.path;
    if args.dpi.is_some() && args.output.format != PrintFormat::Png {
        let message = format!("--dpi is for PNG; {} has no pixels", path.display());
        return Err(Failure::new(message).hint("leave --dpi away, or name a .png"));
    }
    let board = input::board_of(&args.board)?;
    let layout = layout(&board, args.layout)?;
    let board = CharucoBoard { layout: Some(layout), ..board };
    let paper = match args.paper {
        PaperSize::A4 => Paper::A4,
        PaperSize::A3 => Paper::A3,
        PaperSize::Letter => Paper::Letter,
    };
    let orientation = match args.orientation {
        OrientationChoice::Auto => None,
        OrientationChoice::Portrait => Some(Orientation::Portrait),
        OrientationChoice::Landscape => Some(Orientation::Landscape),
    };
    let sheet = Sheet::new(&board, layout, paper, orientation)?;

    let printed = match args.output.format {
        PrintFormat::Pdf => sheet_pdf(&sheet),
        PrintFormat::Svg => sheet_svg(&sheet).into_bytes(),
        PrintFormat::Png => sheet_png(&sheet, args.dpi.unwrap_or(DPI)),
    };
    let toml = path.with_file_name("board.toml");
    let mut written =
        vec![(path.clone(), printed), (toml.clone(), board_to_toml(&board).into_bytes())];
    written.extend(dictionary_file(args, &board));
    let replace = if args.force { Replace::WhatIsThere } else { Replace::Nothing };
    files::write_together(&written, replace)?;

    let toml = toml.display();
    terminal.say(&format!("{}: {board}, on {}", path.display(), paper.name()));
    terminal.say(
        "print it at 100 % (actual size, not fit to page), then lay a ruler on the printed one",
    );
    terminal.say(&format!(
        "{toml} belongs into every recording of it; correct it where the printer has scaled"
    ));
    Ok(Outcome::Clean)
}

/// What the board says, or else what was typed, or else that of today's OpenCV.
fn layout(board: &CharucoBoard, typed: Option<LayoutChoice>) -> Result<Layout, Failure> {
    let typed = typed.map(|typed| match typed {
        LayoutChoice::New => Layout::New,
        LayoutChoice::Legacy => Layout::Legacy,
    });
    match (board.layout, typed) {
        (Some(said), Some(typed)) if said != typed => {
            let message =
                format!("the board is of {} layout, --layout says {}", said.name(), typed.name());
            Err(Failure::new(message).hint("leave --layout away, or correct --board"))
        }
        (said, typed) => Ok(said.or(typed).unwrap_or(Layout::New)),
    }
}

/// A dictionary of one's own, to lie beside the board.toml that names it.
fn dictionary_file(args: &PrintArgs, board: &CharucoBoard) -> Option<(PathBuf, Vec<u8>)> {
    let name = board.dictionary.name();
    if !Dictionary::is_file(name) {
        return None;
    }
    let path = args.output.path.with_file_name(name);
    if let Ok(there) = std::fs::read_to_string(&path)
        && Dictionary::from_opencv_yaml(name, &there).is_ok_and(|there| there == board.dictionary)
    {
        return None; // The very file that was given, or as good.
    }
    Some((path, board.dictionary.to_opencv_yaml().into_bytes()))
}
