//! Letters as strokes, for pictures that are pixels: drawn for this project, so that no font has to come along.
//!
//! A glyph is written as strokes between blanks, each a row of points of two hexadecimal digits (x to the right, y
//! down; 0 is the top of the capitals, 3 that of the small letters, 8 the baseline). A stroke is straight from point to
//! point; with `~` before it the points control a smooth curve that begins and ends in the outer ones; with `@` the
//! curve closes.

use crate::geom::Pixel;

/// Height of a capital in the units of [`GLYPHS`].
const CAPITAL: f64 = 8.0;
/// From glyph to glyph.
const GAP: f64 = 2.0;
/// Width of a blank.
const BLANK: f64 = 3.0;

/// Letter, width, strokes.
#[rustfmt::skip]
const GLYPHS: [(char, u8, &str); 92] = [
    ('0', 5, "@00505808"), ('1', 5, "123038"), ('2', 5, "~0200505308 0858"), ('3', 5, "~0100505424 ~2454580807"),
    ('4', 5, "400656 4048"), ('5', 5, "500003 ~0352580807"), ('6', 5, "~400105 @03535808"), ('7', 5, "005028"),
    ('8', 5, "@00505404 @04545808"), ('9', 5, "@00505505 ~535718"), ('A', 6, "083068 1555"),
    ('B', 6, "0008 ~00505404 ~04646808"), ('C', 6, "~626000086866"), ('D', 6, "0008 ~00606808"),
    ('E', 5, "50000858 0444"), ('F', 5, "500008 0444"), ('G', 6, "~626000086865 4565"), ('H', 6, "0008 6068 0464"),
    ('I', 0, "0008"), ('J', 4, "4045 ~45480806"), ('K', 5, "0008 5005 2358"), ('L', 5, "000858"),
    ('M', 8, "0800458088"), ('N', 6, "08006860"), ('O', 6, "@00606808"), ('P', 6, "0008 ~00606404"),
    ('Q', 6, "@00606808 4668"), ('R', 6, "0008 ~00606404 3468"), ('S', 6, "~6260000464680806"),
    ('T', 6, "0060 3038"), ('U', 6, "0005 6065 ~05086865"), ('V', 6, "003860"), ('W', 8, "0028426880"),
    ('X', 6, "0068 6008"), ('Y', 6, "0034 6034 3438"), ('Z', 6, "00600868"), ('a', 5, "@03535808 5358"),
    ('b', 5, "@03535808 0008"), ('c', 5, "~545303085857"), ('d', 5, "@03535808 5058"),
    ('e', 5, "0555 ~555303085857"), ('f', 4, "~401013 1318 0343"), ('g', 5, "@03535808 5358 ~585b0b0a"),
    ('h', 5, "0008 ~05035355 5558"), ('i', 0, "0308 0101"), ('j', 1, "1318 ~181b0b 1111"),
    ('k', 4, "0008 4306 1548"), ('l', 0, "0008"), ('m', 8, "0308 ~05034345 4548 ~45438385 8588"),
    ('n', 5, "0308 ~05035355 5558"), ('o', 5, "@03535808"), ('p', 5, "@03535808 030b"), ('q', 5, "@03535808 535b"),
    ('r', 3, "0308 ~050333"), ('s', 5, "~5453030556580807"), ('t', 4, "1116 ~161848 0333"),
    ('u', 5, "0306 ~06085856 5358"), ('v', 4, "032843"), ('w', 8, "0328446883"), ('x', 4, "0348 4308"),
    ('y', 4, "0328 431b"), ('z', 4, "03430848"), ('.', 0, "0807"), (',', 1, "180a"), (':', 0, "0304 0807"),
    (';', 1, "1414 180a"), ('-', 4, "0545"), ('−', 5, "0555"), ('+', 6, "0565 3238"), ('±', 6, "0464 3137 0868"),
    ('=', 6, "0464 0767"), ('/', 4, "0940"), ('(', 2, "~20020729"), (')', 2, "~00222709"), ('[', 2, "20000929"),
    (']', 2, "00202909"), ('%', 8, "@00303404 @55858959 6018"), ('·', 1, "0515"), ('×', 4, "0448 4408"),
    ('°', 2, "@00202202"), ('→', 6, "0565 436547"), ('<', 5, "535558"), ('>', 5, "035508"), ('_', 6, "0969"),
    ('\'', 0, "0002"), ('"', 2, "0002 2022"), ('?', 5, "~0200505434 3435 3838"), ('!', 0, "0005 0808"),
    ('σ', 6, "@03535808 2363"), ('#', 6, "0363 0666 2109 5139"), ('|', 0, "0009"), ('…', 8, "0808 4848 8888"),
];

/// A line of text as strokes of points, the baseline's left end at the origin, capitals `size` high. Letters that are
/// not known become question marks.
pub(super) fn strokes(text: &str, size: f64) -> Vec<Vec<Pixel>> {
    let unit = size / CAPITAL;
    let mut strokes = Vec::new();
    let mut left = 0.0;
    for letter in text.chars() {
        let Some((width, glyph)) = glyph(letter) else {
            left += (BLANK + GAP) * unit;
            continue;
        };
        for stroke in glyph.split(' ') {
            let place = |[x, y]: [f64; 2]| Pixel::new(left + x * unit, (y - CAPITAL) * unit);
            strokes.push(points(stroke).into_iter().map(place).collect());
        }
        left += (width + GAP) * unit;
    }
    strokes
}

/// How wide a line of text is.
#[cfg(test)]
fn width(text: &str, size: f64) -> f64 {
    let units: f64 = text.chars().map(|c| glyph(c).map_or(BLANK, |(width, _)| width) + GAP).sum();
    (units - GAP).max(0.0) * size / CAPITAL
}

/// Width and strokes; `None` for a blank.
fn glyph(letter: char) -> Option<(f64, &'static str)> {
    let of = |c| GLYPHS.iter().find(|(known, ..)| *known == c);
    let (_, width, strokes) = match letter {
        ' ' => return None,
        _ => of(letter).or_else(|| of('?')).expect("the question mark is there"),
    };
    Some((f64::from(*width), strokes))
}

/// The points of a stroke, curves as short straight pieces.
fn points(stroke: &str) -> Vec<[f64; 2]> {
    let (kind, digits) = match stroke.as_bytes() {
        [kind @ (b'~' | b'@'), rest @ ..] => (*kind, rest),
        all => (b' ', all),
    };
    let digit = |c: u8| f64::from(char::from(c).to_digit(16).expect("glyphs are hexadecimal"));
    let control: Vec<[f64; 2]> =
        digits.as_chunks::<2>().0.iter().map(|&[x, y]| [digit(x), digit(y)]).collect();
    if kind == b' ' {
        return control;
    }
    // A quadratic B-spline: each inner point bends the curve between the middles of its two sides.
    let n = control.len();
    let middle = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|i| f64::midpoint(a[i], b[i]));
    let mut curve = Vec::new();
    let pieces: Vec<[[f64; 2]; 3]> = if kind == b'@' {
        (0..n)
            .map(|i| {
                let (before, at, after) =
                    (control[(i + n - 1) % n], control[i], control[(i + 1) % n]);
                [middle(before, at), at, middle(at, after)]
            })
            .collect()
    } else {
        (1..n - 1)
            .map(|i| {
                let (before, at, after) = (control[i - 1], control[i], control[i + 1]);
                let from = if i == 1 { before } else { middle(before, at) };
                let to = if i == n - 2 { after } else { middle(at, after) };
                [from, at, to]
            })
            .collect()
    };
    const STEPS: u32 = 8;
    for [from, at, to] in pieces {
        for step in 0..=STEPS {
            let t = f64::from(step) / f64::from(STEPS);
            curve.push([0, 1].map(|i| {
                (1.0 - t) * (1.0 - t) * from[i] + 2.0 * t * (1.0 - t) * at[i] + t * t * to[i]
            }));
        }
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_glyph_stays_in_its_box() {
        for (letter, width, glyph) in GLYPHS {
            for stroke in glyph.split(' ') {
                for [x, y] in points(stroke) {
                    assert!((0.0..=f64::from(width)).contains(&x), "{letter}: x {x}");
                    assert!((0.0..=11.0).contains(&y), "{letter}: y {y}");
                }
            }
        }
    }

    #[test]
    fn a_line_is_as_wide_as_its_letters() {
        assert_eq!(width("", 8.0), 0.0);
        assert_eq!(width("l l", 8.0), 7.0);
        assert_eq!(width("€", 8.0), width("?", 8.0));
        let right = strokes("mm", 16.0).concat().iter().map(|p| p.x).fold(0.0, f64::max);
        assert_eq!(right, width("mm", 16.0));
    }
}
