//! ChArUco boards.

use std::{fmt, str::FromStr};

use super::{Dictionary, Error, length_m, length_text};
use crate::geom::{Board, Point};

/// Which squares are white. OpenCV changed it in 4.6; the two differ only for boards with an even number of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Before OpenCV 4.6: the last row starts black, so with an even number of rows the first square is white.
    Legacy,
    /// From OpenCV 4.6 on: the first square is black.
    New,
}

impl Layout {
    /// `legacy` or `new`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Legacy => "legacy",
            Self::New => "new",
        }
    }
}

/// A white square and the marker in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MarkerCell {
    /// The marker's id in the dictionary.
    pub id: usize,
    /// Column of the square, 0-based from the first.
    pub column: usize,
    /// Row of the square, 0-based from the first.
    pub row: usize,
}

/// A chessboard with a marker in every white square.
#[derive(Clone, Debug, PartialEq)]
pub struct CharucoBoard {
    /// Squares along a row.
    pub squares_x: usize,
    /// Squares along a column.
    pub squares_y: usize,
    /// Side of a square, metres.
    pub square_m: f64,
    /// Side of a marker with its black border, metres.
    pub marker_m: f64,
    /// The markers.
    pub dictionary: Dictionary,
    /// Which squares are white, where it is known; the detector finds out otherwise.
    pub layout: Option<Layout>,
}

impl CharucoBoard {
    /// A board with these counts and lengths (metres); its layout is left to the detector.
    ///
    /// Refused: fewer than 2 or more than 100 squares on a side, a marker not smaller than its square, a square
    /// not within 0.1 mm to 10 m, a dictionary with fewer markers than white squares.
    pub fn new(
        (squares_x, squares_y): (usize, usize),
        square_m: f64,
        marker_m: f64,
        dictionary: Dictionary,
    ) -> Result<Self, Error> {
        let fail = |why: String| Err(Error::Geometry(why));
        if !(2..=100).contains(&squares_x) || !(2..=100).contains(&squares_y) {
            return fail(format!("{squares_x}x{squares_y} squares; each side takes 2 to 100"));
        }
        if squares_x * squares_y < 6 {
            return fail(format!(
                "{squares_x}x{squares_y} squares have a single inner corner; take at least 3x2"
            ));
        }
        if !(1e-4..=10.0).contains(&square_m) {
            return fail(format!("a square of {square_m} m; it must lie between 0.1 mm and 10 m"));
        }
        if !(marker_m > 0.0 && marker_m < square_m) {
            return fail(format!(
                "a marker of {marker_m} m does not fit into a square of {square_m} m"
            ));
        }
        let board = Self { squares_x, squares_y, square_m, marker_m, dictionary, layout: None };
        let n_markers = [Layout::Legacy, Layout::New]
            .map(|l| board.markers(l).len())
            .into_iter()
            .max()
            .unwrap_or(0);
        if board.dictionary.len() < n_markers {
            return fail(format!(
                "{} has {} markers, {squares_x}x{squares_y} squares need {n_markers}",
                board.dictionary.name(),
                board.dictionary.len()
            ));
        }
        Ok(board)
    }

    /// The board of the paper (arXiv:2201.10865, section 5.1): 10x8 squares of this side (metres), markers half as
    /// large, `ARUCO_ORIGINAL`.
    pub fn paper(square_m: f64) -> Result<Self, Error> {
        Self::new((10, 8), square_m, square_m / 2.0, Dictionary::predefined("ARUCO_ORIGINAL")?)
    }

    /// How many inner corners there are: (squares_x − 1)·(squares_y − 1).
    pub fn n_corners(&self) -> usize {
        (self.squares_x - 1) * (self.squares_y - 1)
    }

    /// The inner corner with this id on a flat board: ids run along the rows from the first square.
    pub fn corner(&self, id: usize) -> Point<Board> {
        let (column, row) = self.corner_cell(id);
        Point::new((column + 1) as f64 * self.square_m, (row + 1) as f64 * self.square_m, 0.0)
    }

    /// Column and row, 0-based, of the inner corner with this id.
    pub fn corner_cell(&self, id: usize) -> (usize, usize) {
        (id % (self.squares_x - 1), id / (self.squares_x - 1))
    }

    /// True where the square at (`column`, `row`) is white, that is, carries a marker.
    pub fn is_white(&self, layout: Layout, column: usize, row: usize) -> bool {
        let even = (column + row).is_multiple_of(2);
        match layout {
            Layout::Legacy if self.squares_y.is_multiple_of(2) => even,
            _ => !even,
        }
    }

    /// The white squares with their markers, row by row; ids count up from 0.
    pub fn markers(&self, layout: Layout) -> Vec<MarkerCell> {
        let mut markers = Vec::new();
        for row in 0..self.squares_y {
            for column in 0..self.squares_x {
                if self.is_white(layout, column, row) {
                    markers.push(MarkerCell { id: markers.len(), column, row });
                }
            }
        }
        markers
    }

    /// The marker of the white square at (`column`, `row`): how many white squares come before it.
    fn marker_id(&self, layout: Layout, column: usize, row: usize) -> usize {
        // In a row that starts white, ⌈c/2⌉ of the first c squares are white; in one that starts black, ⌊c/2⌋.
        let whites =
            |row: usize, columns: usize| (columns + usize::from(self.is_white(layout, 0, row))) / 2;
        let pairs = row / 2 * self.squares_x; // Two neighbouring rows have squares_x white squares together.
        pairs + if row % 2 == 1 { whites(row - 1, self.squares_x) } else { 0 } + whites(row, column)
    }

    /// True where the printed board is white at this point (metres in its plane); `None` outside it.
    pub fn is_white_at(&self, layout: Layout, x_m: f64, y_m: f64) -> Option<bool> {
        let (u, v) = (x_m / self.square_m, y_m / self.square_m);
        if !(u >= 0.0 && v >= 0.0 && u < self.squares_x as f64 && v < self.squares_y as f64) {
            return None;
        }
        let (column, row) = (u as usize, v as usize);
        if !self.is_white(layout, column, row) {
            return Some(false);
        }
        let id = self.marker_id(layout, column, row);
        let side = self.marker_m / self.square_m;
        let margin = (1.0 - side) / 2.0;
        let cells = (self.dictionary.bits() + 2) as f64;
        let (mu, mv) =
            ((u - column as f64 - margin) / side * cells, (v - row as f64 - margin) / side * cells);
        if !(mu >= 0.0 && mv >= 0.0 && mu < cells && mv < cells) {
            return Some(true);
        }
        Some(self.dictionary.is_white(id, mv as usize, mu as usize))
    }
}

impl CharucoBoard {
    /// Reads the short form, `SQUARES_XxSQUARES_Y:SQUARE:MARKER:DICTIONARY[:legacy|:new]`; `dictionary` answers the
    /// name that stands in it, which may be that of a file ([`Dictionary::is_file`]).
    pub fn from_short_form<E: From<Error>>(
        text: &str,
        dictionary: impl FnOnce(&str) -> Result<Dictionary, E>,
    ) -> Result<Self, E> {
        let form = || Error::Form(text.to_owned());
        // Paths may have colons of their own, on Windows they do.
        let mut parts = text.splitn(4, ':');
        let mut part = || parts.next().ok_or_else(form);
        let (squares, square, marker, rest) = (part()?, part()?, part()?, part()?);
        let (name, layout) = match rest.rsplit_once(':') {
            Some((name, "legacy")) => (name, Some(Layout::Legacy)),
            Some((name, "new")) => (name, Some(Layout::New)),
            Some(_) if !Dictionary::is_file(rest) => return Err(form().into()),
            _ => (rest, None),
        };
        let (x, y) = squares.split_once(['x', 'X']).ok_or_else(form)?;
        let count = |text: &str| text.trim().parse::<usize>().map_err(|_| form());
        let squares = (count(x)?, count(y)?);
        let (square_m, marker_m) = (length_m(square)?, length_m(marker)?);
        let mut board = Self::new(squares, square_m, marker_m, dictionary(name.trim())?)?;
        board.layout = layout;
        Ok(board)
    }
}

impl FromStr for CharucoBoard {
    type Err = Error;

    /// Reads the short form with a predefined dictionary, e.g. `10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL`. Lengths
    /// carry their unit.
    fn from_str(text: &str) -> Result<Self, Error> {
        Self::from_short_form(text, Dictionary::predefined)
    }
}

impl fmt::Display for CharucoBoard {
    /// The short form; [`from_short_form`](CharucoBoard::from_short_form) reads the same board back.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (square, marker) = (length_text(self.square_m), length_text(self.marker_m));
        let (x, y, dictionary) = (self.squares_x, self.squares_y, self.dictionary.name());
        write!(f, "{x}x{y}:{square}:{marker}:{dictionary}")?;
        self.layout.map_or(Ok(()), |layout| write!(f, ":{}", layout.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_and_layouts() {
        let board = CharucoBoard::paper(0.020875).unwrap();
        // Eight rows: the old layout starts with a marker, the new one with a black square.
        let legacy = board.markers(Layout::Legacy);
        assert_eq!(legacy[0], MarkerCell { id: 0, column: 0, row: 0 });
        assert_eq!(board.markers(Layout::New)[0], MarkerCell { id: 0, column: 1, row: 0 });
        let odd: CharucoBoard = "5x7:40mm:20mm:6X6_250".parse().unwrap();
        assert_eq!(odd.markers(Layout::Legacy), odd.markers(Layout::New));
        for text in ["10x8", "5x7", "7x5", "6x6", "4x9"] {
            let board: CharucoBoard = format!("{text}:40mm:20mm:6X6_250").parse().unwrap();
            for layout in [Layout::Legacy, Layout::New] {
                for m in board.markers(layout) {
                    assert_eq!(board.marker_id(layout, m.column, m.row), m.id, "{text} {layout:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_printed_where() {
        let board: CharucoBoard = "10x8:20mm:10mm:ARUCO_ORIGINAL".parse().unwrap();
        let at = |x_mm: f64, y_mm: f64| board.is_white_at(Layout::Legacy, x_mm * 1e-3, y_mm * 1e-3);
        assert_eq!(at(1.0, 1.0), Some(true)); // The white rim round marker 0.
        assert_eq!(at(5.5, 5.5), Some(false)); // Its black border.
        assert_eq!(at(25.0, 5.0), Some(false)); // The black square beside it.
        assert_eq!(at(-0.1, 5.0), None);
        assert_eq!(at(200.1, 5.0), None);
        // Marker 0 of ARUCO_ORIGINAL is five times 10000: a white first column.
        assert_eq!(at(5.0 + 10.0 / 7.0 * 1.5, 10.0), Some(true));
        assert_eq!(at(5.0 + 10.0 / 7.0 * 2.5, 10.0), Some(false));
    }

    #[test]
    fn boards_that_cannot_be() {
        for text in [
            "10x8:20.875:10.4375:ARUCO_ORIGINAL",
            "10x8:20mm:20mm:ARUCO_ORIGINAL",
            "10x8:20mm:30mm:ARUCO_ORIGINAL",
            "1x8:20mm:10mm:ARUCO_ORIGINAL",
            "10x8:20mm:10mm:8X8_50",
            "20x20:20mm:10mm:4X4_50",
            "10x8:20mm:10mm",
            "10x8:20mm:10mm:4X4_50:middle",
            "10x-8:20mm:10mm:4X4_50",
            "99999999999999999999x8:20mm:10mm:4X4_50",
            "",
        ] {
            assert!(text.parse::<CharucoBoard>().is_err(), "{text}");
        }
    }

    #[test]
    fn the_short_form_reads_back() {
        for text in [
            "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL",
            "10x7:24mm:18mm:5X5_100:new",
            "5x7:0.033333333333333333m:1in:APRILTAG_36h11:legacy",
        ] {
            let board: CharucoBoard = text.parse().unwrap();
            assert_eq!(board.to_string().parse(), Ok(board), "{text}");
        }
        let text = "10x7:24mm:18mm:5X5_100:new";
        assert_eq!(text.parse::<CharucoBoard>().unwrap().to_string(), text);

        // The name of a file may have colons; a layout may follow it.
        for (rest, name, layout) in [
            ("mine.yml", "mine.yml", None),
            ("C:\\mine.yml:new", "C:\\mine.yml", Some(Layout::New)),
            ("C:\\mine.YAML", "C:\\mine.YAML", None),
        ] {
            let board = CharucoBoard::from_short_form(&format!("3x3:2cm:1cm:{rest}"), |asked| {
                assert_eq!(asked, name);
                Dictionary::predefined("4X4_50")
            });
            assert_eq!(board.unwrap().layout, layout, "{rest}");
        }
        let error = "10x8:20mm:10mm:4X4_50:middle".parse::<CharucoBoard>().unwrap_err();
        assert!(matches!(error, Error::Form(_)), "{error}");
    }
}
