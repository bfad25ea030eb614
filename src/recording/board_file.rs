//! The board as files describe it.

use std::fmt;

use serde::{
    Deserialize, Deserializer,
    de::{self, Visitor},
};

use super::Error;
use crate::board::{CharucoBoard, Dictionary, Layout, length_m, length_text};

/// A board from the text of a `board.toml`; `file` is its name for messages, and `beside` reads a file beside it.
///
/// ```toml
/// squares_x = 10                  # squares along a row
/// squares_y = 8                   # squares along a column
/// square = "20.875mm"             # side of a square, with its unit: mm, cm, m, in
/// marker = "10.4375mm"            # side of a marker with its black border
/// dictionary = "ARUCO_ORIGINAL"   # a name of OpenCV's, with or without DICT_, or a file of its form, like "mine.yml"
/// layout = "legacy"               # optional: legacy (OpenCV before 4.6) or new; found from the image otherwise
/// ```
///
/// Other keys are refused, and so is a length without a unit.
pub fn board_from_toml(
    file: &str,
    text: &str,
    beside: impl FnOnce(&str) -> Result<Vec<u8>, Error>,
) -> Result<CharucoBoard, Error> {
    let fail = |why: String| Error::Board { file: file.to_owned(), why };
    let board: BoardFile = toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
        fail(format!("line {line}: {}; {EXAMPLE}", error.message()))
    })?;
    let name = &board.dictionary;
    let dictionary = if Dictionary::is_file(name) {
        if name.contains(['/', '\\']) {
            return Err(fail(format!(
                "dictionary = \"{name}\" leads elsewhere; put that file beside this one"
            )));
        }
        let bytes = beside(name)?;
        Dictionary::from_opencv_yaml(name, &String::from_utf8_lossy(&bytes))
    } else {
        Dictionary::predefined(name)
    };
    let dictionary = dictionary.map_err(|error| fail(error.to_string()))?;
    let squares = (board.squares_x, board.squares_y);
    let mut parsed = CharucoBoard::new(squares, board.square.0, board.marker.0, dictionary)
        .map_err(|error| fail(format!("{error}; {EXAMPLE}")))?;
    parsed.layout = board.layout.map(|layout| match layout {
        LayoutName::Legacy => Layout::Legacy,
        LayoutName::New => Layout::New,
    });
    Ok(parsed)
}

const EXAMPLE: &str = "a board is described by squares_x = 10, squares_y = 8, square = \"20.875mm\", \
                       marker = \"10.4375mm\", dictionary = \"ARUCO_ORIGINAL\" and optionally layout = \"legacy\" \
                       or \"new\"";

/// The same board as text for a `board.toml`. A dictionary of one's own
/// ([`to_opencv_yaml`](Dictionary::to_opencv_yaml)) has to lie beside it, under its name.
pub fn board_to_toml(board: &CharucoBoard) -> String {
    let mut text = format!(
        "squares_x = {}\nsquares_y = {}\nsquare = \"{}\"\nmarker = \"{}\"\ndictionary = \"{}\"\n",
        board.squares_x,
        board.squares_y,
        length_text(board.square_m),
        length_text(board.marker_m),
        board.dictionary.name()
    );
    if let Some(layout) = board.layout {
        text += &format!("layout = \"{}\"\n", layout.name());
    }
    text
}

pub(super) fn from_toml(
    file: &str,
    bytes: &[u8],
    beside: impl FnOnce(&str) -> Result<Vec<u8>, Error>,
) -> Result<CharucoBoard, Error> {
    let text = std::str::from_utf8(bytes).map_err(|error| Error::Board {
        file: file.to_owned(),
        why: format!("not UTF-8 text ({error}); save it as UTF-8"),
    })?;
    board_from_toml(file, text, beside)
}

/// The paper's board from its `checkersize.txt`: the side of a square in centimetres, a bare number.
pub(super) fn from_checker_size(file: &str, bytes: &[u8]) -> Result<CharucoBoard, Error> {
    let fail = |why: String| Error::Board { file: file.to_owned(), why };
    let remedy = "write the side of a square in centimetres, like 2.0875, or describe the board in board.toml";
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(40)]);
    let text: String = text.trim().chars().filter(|c| !c.is_control()).collect();
    let square_cm = text
        .parse::<f64>()
        .ok()
        .filter(|cm| cm.is_finite() && bytes.len() <= 40)
        .ok_or_else(|| fail(format!("`{text}` is not a number; {remedy}")))?;
    CharucoBoard::paper(square_cm / 100.0)
        .map_err(|error| fail(format!("{square_cm} centimetres: {error}; {remedy}")))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoardFile {
    squares_x: usize,
    squares_y: usize,
    square: Length,
    marker: Length,
    dictionary: String,
    layout: Option<LayoutName>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum LayoutName {
    Legacy,
    New,
}

/// Metres from a length with a unit.
struct Length(f64);

impl<'de> Deserialize<'de> for Length {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct LengthVisitor;
        impl Visitor<'_> for LengthVisitor {
            type Value = Length;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a length with its unit, like \"20.875mm\"")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Length, E> {
                length_m(text).map(Length).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(LengthVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: &str = "squares_x = 10\nsquares_y = 8\nsquare = \"20.875mm\"\nmarker = \"10.4375 mm\"\n\
                         dictionary = \"DICT_ARUCO_ORIGINAL\"\n";

    /// With nothing beside it.
    fn read(file: &str, text: &str) -> Result<CharucoBoard, Error> {
        board_from_toml(file, text, |name| panic!("{name} is not asked for"))
    }

    #[test]
    fn a_dictionary_beside_it() {
        let with = |name: &str| PAPER.replace("DICT_ARUCO_ORIGINAL", name);
        let mine = Dictionary::predefined("ARUCO_ORIGINAL").unwrap().to_opencv_yaml();
        let board = board_from_toml("b", &with("mine.yml"), |name| {
            assert_eq!(name, "mine.yml");
            Ok(mine.clone().into_bytes())
        });
        let board = board.unwrap();
        assert_eq!((board.dictionary.name(), board.dictionary.len()), ("mine.yml", 1024));
        let again = board_from_toml("b", &board_to_toml(&board), |_| Ok(mine.into_bytes()));
        assert!(again.unwrap() == board);
        let broken = board_from_toml("b", &with("mine.yml"), |_| Ok(b"nmarkers: 1\nx".to_vec()));
        assert!(broken.unwrap_err().to_string().starts_with("b: mine.yml, line 2: "));
        for name in ["../mine.yml", "/etc/mine.yml", "..\\\\mine.yml"] {
            let message = read("b", &with(name)).unwrap_err().to_string();
            assert!(message.contains("leads elsewhere"), "{name}: {message}");
        }
    }

    #[test]
    fn boards_read_and_write() {
        let board = read("b", PAPER).unwrap();
        assert!((board.square_m - 0.020875).abs() < 1e-15, "{}", board.square_m);
        assert!(board == CharucoBoard::paper(board.square_m).unwrap());
        let mut legacy = board;
        legacy.layout = Some(Layout::Legacy);
        assert!(read("b", &format!("{PAPER}layout = \"legacy\"")).unwrap() == legacy);
        assert!(read("b", &board_to_toml(&legacy)).unwrap() == legacy);
    }

    #[test]
    fn bad_boards_say_what_to_write() {
        for (from, to, expected) in [
            (
                "\"20.875mm\"",
                "20.875",
                "line 3: invalid type: floating point `20.875`, expected a length with its unit",
            ),
            (
                "\"20.875mm\"",
                "20",
                "line 3: invalid type: integer `20`, expected a length with its unit",
            ),
            ("\"20.875mm\"", "\"20.875\"", "line 3: `20.875` is not a length"),
            ("\"20.875mm\"", "\"nanmm\"", "is not a length"),
            ("\"20.875mm\"", "\"1mm\"", "does not fit"),
            ("squares_x = 10", "squares_x = -10", "line 1"),
            ("squares_x = 10", "squares_x = 1000000", "each side takes 2 to 100"),
            ("squares_x = 10", "squares_z = 10", "unknown field `squares_z`"),
            ("squares_x = 10\n", "", "missing field `squares_x`"),
            ("ARUCO_ORIGINAL", "8X8_50", "not a known dictionary"),
            ("dictionary = ", "layout = \"old\"\ndictionary = ", "unknown variant `old`"),
            ("squares_x = 10", "squares_x = [", "line"),
        ] {
            let text = PAPER.replace(from, to);
            let message = read("my/board.toml", &text).unwrap_err().to_string();
            assert!(
                message.starts_with("my/board.toml: ") && message.contains(expected),
                "{to}: {message}"
            );
        }
    }

    #[test]
    fn checker_sizes() {
        let board = from_checker_size("f", b" 2.0875\n").unwrap();
        assert!(board == CharucoBoard::paper(2.0875 / 100.0).unwrap());
        for text in ["", "2.0875cm", "nan", "0", "-2", "1e9", "\u{1b}[2J", &"1".repeat(50)] {
            let message =
                from_checker_size("my/checkersize.txt", text.as_bytes()).unwrap_err().to_string();
            assert!(
                message.starts_with("my/checkersize.txt: ") && message.contains("in centimetres"),
                "{message}"
            );
            assert!(!message.contains('\u{1b}'), "{message}");
        }
        assert!(from_checker_size("f", b"\xff\xfe").is_err());
    }
}
