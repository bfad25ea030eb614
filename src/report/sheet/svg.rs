//! The sheet as SVG.

use maud::html;

use super::number;
use crate::board::Sheet;

/// The sheet as an SVG file, one unit to the millimetre.
pub fn sheet_svg(sheet: &Sheet) -> String {
    let [width, height] = sheet.size_mm.map(number);
    let mut path = Vec::new();
    for shape in &sheet.shapes {
        let mut d = String::new();
        for rect in shape {
            let ([x0, x1], [y0, y1]) = (rect.x_mm.map(number), rect.y_mm.map(number));
            d += &format!("M{x0} {y0}H{x1}V{y1}H{x0}Z");
        }
        path.push(d);
    }
    let drawing = html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(format!("{width}mm")) height=(format!("{height}mm"))
            viewBox=(format!("0 0 {width} {height}")) {
            title { (sheet.title) }
            rect width=(width) height=(height) fill="#fff" {}
            g fill="#000" {
                @for d in &path { path d=(d) {} }
            }
            g fill="#000" font-family="Helvetica, Arial, 'Liberation Sans', sans-serif" {
                @for text in &sheet.texts {
                    text x=(number(text.x_mm)) y=(number(text.baseline_mm)) font-size=(number(text.size_mm)) {
                        (text.text)
                    }
                }
            }
        }
    };
    // A line per element keeps the file readable, and diffs short.
    let drawing = drawing
        .into_string()
        .replace("></path>", "/>")
        .replace("></rect>", "/>")
        .replace("><", ">\n<");
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{drawing}\n")
}
