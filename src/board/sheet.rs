//! A board on paper.

use super::{CharucoBoard, Error, Layout};

/// Most printers leave a rim of 3 to 6 mm white.
const RIM_MM: f64 = 10.0;

/// White between the board and what stands below it, so that nothing there is taken for a part of the board.
const GAP_MM: f64 = 5.0;

const RULER_MM: f64 = 100.0;
const TEXT_MM: f64 = 3.0;
const LINE_MM: f64 = 4.0;
const TICK_MM: f64 = 3.0;

/// Gap, ruler with its numbers, and the lines of text.
const FOOT_MM: f64 = GAP_MM + TICK_MM + 3.0 * LINE_MM;

/// Width of a letter on average, in units of the size of the letters: Helvetica takes 0.5 to 0.55 for such lines, the
/// letters of the raster 0.6.
const LETTER_WIDTH: f64 = 0.6;

/// A size of paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Paper {
    /// 210 × 297 mm.
    A4,
    /// 297 × 420 mm.
    A3,
    /// 8.5 × 11 in.
    Letter,
}

impl Paper {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::A4, Self::A3, Self::Letter];

    /// As people call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::A4 => "A4",
            Self::A3 => "A3",
            Self::Letter => "Letter",
        }
    }

    /// Width and height, held in this way, millimetres.
    pub const fn size_mm(self, orientation: Orientation) -> [f64; 2] {
        let [short, long] = match self {
            Self::A4 => [210.0, 297.0],
            Self::A3 => [297.0, 420.0],
            Self::Letter => [215.9, 279.4],
        };
        match orientation {
            Orientation::Portrait => [short, long],
            Orientation::Landscape => [long, short],
        }
    }
}

/// How the paper is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Orientation {
    /// The long side upright.
    Portrait,
    /// The long side across.
    Landscape,
}

impl Orientation {
    /// `portrait` or `landscape`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Portrait => "portrait",
            Self::Landscape => "landscape",
        }
    }
}

/// A rectangle along the edges of the paper, millimetres from its top left, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect {
    /// Left and right edge.
    pub x_mm: [f64; 2],
    /// Upper and lower edge.
    pub y_mm: [f64; 2],
}

/// A line of text, black.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// Where the line begins.
    pub x_mm: f64,
    /// The line the letters stand on.
    pub baseline_mm: f64,
    /// Size of the letters, as of a font: capitals are 0.7 of it high.
    pub size_mm: f64,
    /// The line.
    pub text: String,
}

/// A board on paper with a ruler and words below it, true to scale: millimetres from the top left, y down.
///
/// ```
/// use truedepth::board::{CharucoBoard, Layout, Paper, Sheet};
///
/// let board: CharucoBoard = "10x7:24mm:18mm:5X5_100".parse()?;
/// let sheet = Sheet::new(&board, Layout::New, Paper::A4, None)?;
/// assert_eq!(sheet.size_mm, [297.0, 210.0]);
/// assert!(Sheet::new(&board, Layout::New, Paper::A4, Some(truedepth::board::Orientation::Portrait)).is_err());
/// # Ok::<(), truedepth::board::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// What the sheet is, in a few words.
    pub title: String,
    /// Width and height of the paper.
    pub size_mm: [f64; 2],
    /// The board's outer corner at which its first row and column begin.
    pub board_mm: [f64; 2],
    /// What is black. The rectangles of one shape touch or overlap: fill them in one go, else a thin light line may be
    /// seen between them. Shapes meet at points at most.
    pub shapes: Vec<Vec<Rect>>,
    /// The words.
    pub texts: Vec<Text>,
}

impl Sheet {
    /// The board on this paper, held as said or, with `None`, as the board fits best.
    ///
    /// The board stands in the middle above the words, at least 10 mm from the edges of the paper. One that is larger
    /// than that leaves room for is refused, with the largest square that fits.
    pub fn new(
        board: &CharucoBoard,
        layout: Layout,
        paper: Paper,
        orientation: Option<Orientation>,
    ) -> Result<Self, Error> {
        let orientation = fitting(board, paper, orientation)?;
        let size_mm = paper.size_mm(orientation);
        let [width, height] = board_size_mm(board);
        let [free_x, free_y] = room_mm(paper, orientation);
        let board_mm = [RIM_MM + (free_x - width) / 2.0, RIM_MM + (free_y - height) / 2.0];
        let mut sheet = Self {
            title: format!("ChArUco board {board}"),
            size_mm,
            board_mm,
            shapes: Vec::new(),
            texts: Vec::new(),
        };
        sheet.draw_squares(board, layout);
        sheet.draw_foot(&CharucoBoard { layout: Some(layout), ..board.clone() });
        Ok(sheet)
    }

    fn draw_squares(&mut self, board: &CharucoBoard, layout: Layout) {
        let [left, top] = self.board_mm;
        let square = 1e3 * board.square_m;
        for row in 0..board.squares_y {
            for column in 0..board.squares_x {
                if !board.is_white(layout, column, row) {
                    // Every edge is one number for both squares that share it.
                    let edges =
                        |start: f64, i: usize| [i, i + 1].map(|i| start + i as f64 * square);
                    self.shapes
                        .push(vec![Rect { x_mm: edges(left, column), y_mm: edges(top, row) }]);
                }
            }
        }
        let n = board.dictionary.bits() + 2;
        let marker = 1e3 * board.marker_m;
        let margin = (square - marker) / 2.0;
        for cell in board.markers(layout) {
            let x = |i: usize| {
                left + cell.column as f64 * square + margin + marker * i as f64 / n as f64
            };
            let y =
                |i: usize| top + cell.row as f64 * square + margin + marker * i as f64 / n as f64;
            let mut shape = Vec::new();
            for i in 0..n {
                let mut j = 0;
                while j < n {
                    let end =
                        (j..n).find(|&j| board.dictionary.is_white(cell.id, i, j)).unwrap_or(n);
                    if end > j {
                        shape.push(Rect { x_mm: [x(j), x(end)], y_mm: [y(i), y(i + 1)] });
                    }
                    j = end + 1; // The cell at `end` is white.
                }
            }
            self.shapes.push(shape);
        }
    }

    /// The ruler and the words, at the lower left of the room for printing.
    fn draw_foot(&mut self, board: &CharucoBoard) {
        let [_, height] = self.size_mm;
        let top = height - RIM_MM - FOOT_MM + GAP_MM;
        let mut ruler = vec![Rect { x_mm: [RIM_MM, RIM_MM + RULER_MM], y_mm: [top, top + 0.3] }];
        for i in 0..=100 {
            let length = match i {
                _ if i % 10 == 0 => TICK_MM,
                _ if i % 5 == 0 => 2.0,
                _ => 1.2,
            };
            // The outer ticks end where the line ends.
            let x = (RIM_MM + f64::from(i)).clamp(RIM_MM + 0.1, RIM_MM + RULER_MM - 0.1);
            ruler.push(Rect { x_mm: [x - 0.1, x + 0.1], y_mm: [top, top + length] });
        }
        self.shapes.push(ruler);
        self.write(
            RIM_MM + RULER_MM + 4.0,
            top + TICK_MM,
            TEXT_MM,
            "this line is 100 mm: check it with a ruler".into(),
        );
        for (at, text) in [(0.0, "0"), (50.0, "50"), (RULER_MM, "100 mm")] {
            self.write(RIM_MM + at, top + TICK_MM + 2.8, 2.4, text.into());
        }

        let CharucoBoard { squares_x, squares_y, square_m, marker_m, dictionary, layout } = board;
        let [width, depth] = board_size_mm(board).map(millimetres);
        let (square, marker) = (millimetres(1e3 * square_m), millimetres(1e3 * marker_m));
        let since = match layout {
            Some(Layout::Legacy) => "legacy layout (OpenCV before 4.6)",
            _ => "new layout (OpenCV 4.6 and newer)",
        };
        let words = format!(
            "{squares_x}x{squares_y} squares of {square} mm, {width} x {depth} mm in all; \
             markers of {marker} mm, {}; {since}",
            dictionary.name()
        );
        let baseline = top + TICK_MM + 2.0 * LINE_MM;
        self.write(RIM_MM, baseline, TEXT_MM, words);
        self.write(RIM_MM, baseline + LINE_MM, TEXT_MM, format!("--board {board}"));
    }

    /// Adds a line, in smaller letters where it would not fit on the paper.
    fn write(&mut self, x_mm: f64, baseline_mm: f64, size_mm: f64, text: String) {
        let room_mm = self.size_mm[0] - RIM_MM - x_mm;
        let longest = LETTER_WIDTH * text.chars().count() as f64;
        let size_mm = if text.len() > 6 { size_mm.min(room_mm / longest) } else { size_mm };
        self.texts.push(Text { x_mm, baseline_mm, size_mm, text });
    }
}

/// Width and height of the board.
fn board_size_mm(board: &CharucoBoard) -> [f64; 2] {
    [board.squares_x, board.squares_y].map(|n| n as f64 * 1e3 * board.square_m)
}

/// Room for the board on the paper.
fn room_mm(paper: Paper, orientation: Orientation) -> [f64; 2] {
    let [width, height] = paper.size_mm(orientation);
    [width - 2.0 * RIM_MM, height - 2.0 * RIM_MM - FOOT_MM]
}

/// The side of the largest squares with which the board fits.
fn largest_square_mm(board: &CharucoBoard, paper: Paper, orientation: Orientation) -> f64 {
    let [x, y] = room_mm(paper, orientation);
    (x / board.squares_x as f64).min(y / board.squares_y as f64)
}

/// How the paper has to be held.
fn fitting(
    board: &CharucoBoard,
    paper: Paper,
    asked: Option<Orientation>,
) -> Result<Orientation, Error> {
    const BOTH: [Orientation; 2] = [Orientation::Portrait, Orientation::Landscape];
    let best = |paper: Paper, ways: &[Orientation]| -> (Orientation, f64) {
        let mut best = (Orientation::Portrait, 0.0);
        for &way in ways {
            let square = largest_square_mm(board, paper, way);
            if square > best.1 {
                best = (way, square);
            }
        }
        best
    };
    let fits = |square_mm: f64| 1e3 * board.square_m <= square_mm + 1e-9;
    let (orientation, largest) =
        best(paper, asked.as_ref().map_or(&BOTH[..], std::slice::from_ref));
    if fits(largest) {
        return Ok(orientation);
    }
    let others: Vec<String> = Paper::ALL
        .into_iter()
        .filter_map(|paper| {
            let (way, largest) = best(paper, &BOTH);
            fits(largest).then(|| format!("{} {}", paper.name(), way.name()))
        })
        .collect();
    let [x, y] = room_mm(paper, orientation).map(millimetres);
    let [width, height] = board_size_mm(board).map(millimetres);
    // Rounded down: what is named must fit.
    let largest = millimetres((largest * 100.0).floor() / 100.0);
    let elsewhere = match others.is_empty() {
        true => "; no paper known here is large enough".to_owned(),
        false => format!(", or {}", others.join(", or ")),
    };
    Err(Error::Paper {
        board: format!("{width} x {height} mm"),
        paper: format!("{} {}, which has room for {x} x {y} mm", paper.name(), orientation.name()),
        remedy: format!("take squares of {largest} mm or less{elsewhere}"),
    })
}

/// Millimetres to the nanometre, without trailing zeros.
fn millimetres(value: f64) -> String {
    format!("{}", (value * 1e6).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(text: &str) -> CharucoBoard {
        text.parse().unwrap()
    }

    /// True where some rectangle lies.
    fn is_black(sheet: &Sheet, x: f64, y: f64) -> bool {
        let within = |[low, high]: [f64; 2], v: f64| low <= v && v < high;
        sheet.shapes.iter().flatten().any(|r| within(r.x_mm, x) && within(r.y_mm, y))
    }

    #[test]
    fn the_sheet_is_the_board() {
        for text in [
            "5x4:30mm:15mm:4X4_50",
            "3x5:30mm:22.5mm:APRILTAG_36h11",
            "4x4:30mm:29mm:ARUCO_ORIGINAL",
        ] {
            let board = board(text);
            for layout in [Layout::Legacy, Layout::New] {
                let sheet = Sheet::new(&board, layout, Paper::A4, None).unwrap();
                let [left, top] = sheet.board_mm;
                let [width, height] = board_size_mm(&board);
                let (mut n, mut n_white) = (0, 0);
                // 0.618 is no multiple of a cell's side: no point falls on an edge.
                for i in 0..(width / 0.618) as usize {
                    for j in 0..(height / 0.618) as usize {
                        let [x, y] = [i, j].map(|i| 0.3 + 0.618 * i as f64);
                        let white = board.is_white_at(layout, x / 1e3, y / 1e3).unwrap();
                        assert_eq!(is_black(&sheet, left + x, top + y), !white, "{text} {x} {y}");
                        n += 1;
                        n_white += usize::from(white);
                    }
                }
                assert!(n > 10_000 && n_white > n / 20 && n_white < n / 2, "{n_white} of {n}");
            }
        }
    }

    #[test]
    fn nothing_leaves_the_room_for_printing_and_the_board_keeps_its_rim() {
        for text in ["10x7:24mm:18mm:5X5_100", "7x9:20mm:15mm:4X4_50", "3x2:10mm:5mm:4X4_50"] {
            let board = board(text);
            for paper in Paper::ALL {
                let sheet = Sheet::new(&board, Layout::New, paper, None).unwrap();
                let [width, height] = sheet.size_mm;
                for r in sheet.shapes.iter().flatten() {
                    assert!(r.x_mm[0] >= 9.99 && r.x_mm[1] <= width - 9.99, "{r:?}");
                    assert!(r.y_mm[0] >= 9.99 && r.y_mm[1] <= height - 9.99, "{r:?}");
                    assert!(r.x_mm[0] < r.x_mm[1] && r.y_mm[0] < r.y_mm[1], "{r:?}");
                }
                let ruler = sheet.shapes.last().unwrap();
                let board_end = sheet.board_mm[1] + board_size_mm(&board)[1];
                assert!(ruler.iter().all(|r| r.y_mm[0] >= board_end + 4.99));
                let ends = |f: fn(&Rect) -> f64| ruler.iter().map(f);
                let left = ends(|r| r.x_mm[0]).fold(f64::MAX, f64::min);
                let right = ends(|r| r.x_mm[1]).fold(f64::MIN, f64::max);
                assert!((right - left - 100.0).abs() < 1e-9, "a ruler of {} mm", right - left);
                for text in &sheet.texts {
                    assert!(text.baseline_mm + 0.25 * text.size_mm <= height - 9.0, "{text:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_said_describes_the_board() {
        let sheet = Sheet::new(
            &board("10x8:20.5mm:10.25mm:ARUCO_ORIGINAL"),
            Layout::Legacy,
            Paper::A4,
            None,
        );
        let words: Vec<String> = sheet.unwrap().texts.into_iter().map(|t| t.text).collect();
        for expected in [
            "this line is 100 mm: check it with a ruler",
            "10x8 squares of 20.5 mm, 205 x 164 mm in all; markers of 10.25 mm, ARUCO_ORIGINAL; \
             legacy layout (OpenCV before 4.6)",
            "--board 10x8:20.5mm:10.25mm:ARUCO_ORIGINAL:legacy",
        ] {
            assert!(words.iter().any(|w| w == expected), "{words:?}");
        }
    }

    #[test]
    fn too_large_for_the_paper() {
        let big = board("10x7:30mm:20mm:5X5_100");
        let error = Sheet::new(&big, Layout::New, Paper::A4, None).unwrap_err().to_string();
        assert!(error.contains("300 x 210 mm") && error.contains("A3 landscape"), "{error}");
        // The largest square named must fit, and a hair more must not.
        assert!(error.contains("squares of 24.28 mm"), "{error}");
        let fits = |text: &str| Sheet::new(&board(text), Layout::New, Paper::A4, None).is_ok();
        assert!(fits("10x7:24.28mm:20mm:5X5_100") && !fits("10x7:24.29mm:20mm:5X5_100"));
        let held = Sheet::new(
            &board("10x7:24mm:18mm:5X5_100"),
            Layout::New,
            Paper::A4,
            Some(Orientation::Portrait),
        );
        let error = held.unwrap_err().to_string();
        assert!(
            error.contains("A4 portrait, which") && error.contains("or A4 landscape"),
            "{error}"
        );
        let huge = Sheet::new(&board("10x7:1m:0.5m:5X5_100"), Layout::New, Paper::A4, None);
        assert!(huge.unwrap_err().to_string().contains("no paper known here"));
    }
}
