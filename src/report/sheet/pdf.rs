//! The sheet as PDF (ISO 32000-1): shapes and one font that every reader has, no compression.

use super::number;
use crate::board::Sheet;

const POINTS_PER_MM: f64 = 72.0 / 25.4;

/// The sheet as a PDF file of one page. It asks the reader not to scale it for printing; not every reader obeys.
pub fn sheet_pdf(sheet: &Sheet) -> Vec<u8> {
    let content = content(sheet);
    let [width, height] = sheet.size_mm.map(|mm| number(mm * POINTS_PER_MM));
    let objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>".to_owned(),
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>".to_owned(),
        format!(
            "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width} {height}] /Contents 4 0 R \
             /Resources << /Font << /F1 5 0 R >> >> >>"
        ),
        format!("<< /Length {} >>\nstream\n{content}endstream", content.len()),
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>"
            .to_owned(),
        format!("<< /Title {} /Producer (truedepth) >>", string(&sheet.title)),
    ];
    // PrintScaling came with 1.6; all else is 1.1. The bytes above 127 tell transfer programs that the file is binary.
    let mut file = b"%PDF-1.6\n%\xe2\xe3\xcf\xd3\n".to_vec();
    let mut offsets = Vec::new();
    for (i, object) in objects.iter().enumerate() {
        offsets.push(file.len());
        file.extend(format!("{} 0 obj\n{object}\nendobj\n", i + 1).bytes());
    }
    let table = file.len();
    let n = objects.len() + 1;
    // Every line of the table has 20 bytes, its end included.
    file.extend(format!("xref\n0 {n}\n0000000000 65535 f \n").bytes());
    for offset in offsets {
        file.extend(format!("{offset:010} 00000 n \n").bytes());
    }
    file.extend(
        format!("trailer\n<< /Size {n} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{table}\n%%EOF\n")
            .bytes(),
    );
    file
}

/// What is drawn: points from the lower left, y up.
fn content(sheet: &Sheet) -> String {
    let x = |mm: f64| number(mm * POINTS_PER_MM);
    let y = |mm: f64| number((sheet.size_mm[1] - mm) * POINTS_PER_MM);
    let mut text = String::from("0 g\n");
    for shape in &sheet.shapes {
        for rect in shape {
            let ([x0, x1], [y0, y1]) = (rect.x_mm.map(x), rect.y_mm.map(y));
            // Corners and not `re`, which takes a width: edges that are shared must be the same number.
            text += &format!("{x0} {y0} m {x1} {y0} l {x1} {y1} l {x0} {y1} l h\n");
        }
        text += "f\n";
    }
    text += "BT\n";
    for line in &sheet.texts {
        let size = number(line.size_mm * POINTS_PER_MM);
        let (x, y, words) = (x(line.x_mm), y(line.baseline_mm), string(&line.text));
        text += &format!("/F1 {size} Tf 1 0 0 1 {x} {y} Tm {words} Tj\n");
    }
    text += "ET\n";
    text
}

/// A string of ASCII; other letters become question marks, because the encoding has not all of them.
fn string(text: &str) -> String {
    let mut quoted = String::from("(");
    for c in text.chars() {
        match c {
            '(' | ')' | '\\' => quoted.extend(['\\', c]),
            ' '..='~' => quoted.push(c),
            _ => quoted.push('?'),
        }
    }
    quoted.push(')');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Layout, Paper};

    #[test]
    fn offsets_lead_to_objects() {
        let board = "5x4:30mm:15mm:4X4_50".parse().unwrap();
        let file = sheet_pdf(&Sheet::new(&board, Layout::New, Paper::A4, None).unwrap());
        let find = |what: &[u8]| file.windows(what.len()).rposition(|w| w == what).unwrap();
        let number = |at: usize| -> usize {
            let digits: Vec<u8> =
                file[at..].iter().copied().take_while(u8::is_ascii_digit).collect();
            String::from_utf8(digits).unwrap().parse().unwrap()
        };
        let table = number(find(b"startxref\n") + 10);
        assert!(file[table..].starts_with(b"xref\n0 7\n0000000000 65535 f \n"));
        for object in 1..7 {
            let line = table + 9 + 20 * object;
            assert!(file[line + 10..].starts_with(b" 00000 n \n"), "object {object}");
            let start = format!("{object} 0 obj\n");
            assert!(file[number(line)..].starts_with(start.as_bytes()), "object {object}");
        }
        let stream = find(b"stream\n0 g") + 7;
        let length = number(find(b"/Length ") + 8);
        assert!(file[stream + length..].starts_with(b"endstream\nendobj"));
        // A4 landscape or portrait, whichever fits best: 210 mm are 595.27559 points.
        assert_eq!(number(find(b"/MediaBox [0 0 ") + 15), 841);
        find(b" 595.27559]");
    }

    #[test]
    fn strings_are_quoted() {
        assert_eq!(string("a (b) \\ ü"), "(a \\(b\\) \\\\ ?)");
    }
}
