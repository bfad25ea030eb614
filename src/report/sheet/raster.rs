//! The sheet as pixels.

use super::letters;
use crate::{
    board::{Rect, Sheet},
    image::Gray,
};

/// The sheet as an image of `dpi` pixels per inch: how much of a pixel is black makes its grey. A point at x mm lies
/// at pixel x · dpi / 25.4 − ½ (pixel centres are integers). Panics for 0 or more than 1200 pixels per inch.
pub fn sheet_image(sheet: &Sheet, dpi: u32) -> Gray {
    assert!((1..=1200).contains(&dpi), "{dpi} dpi; 1 to 1200 are possible");
    let per_mm = f64::from(dpi) / 25.4;
    let [width, height] = sheet.size_mm.map(|mm| ((mm * per_mm).round() as usize).max(1));
    let mut pixels = vec![255; width * height];
    let letters = sheet.texts.iter().flat_map(letters::rects);
    for rect in sheet.shapes.iter().flatten().copied().chain(letters) {
        fill(&mut pixels, (width, height), rect, per_mm);
    }
    Gray::new(width, height, pixels)
}

/// [`sheet_image`] as PNG, which tells its scale, so that programs print it true to size.
pub fn sheet_png(sheet: &Sheet, dpi: u32) -> Vec<u8> {
    sheet_image(sheet, dpi).to_png_at(f64::from(dpi))
}

/// Takes the part of each pixel that lies in the rectangle from its white.
fn fill(pixels: &mut [u8], (width, height): (usize, usize), rect: Rect, per_mm: f64) {
    let x = covered(rect.x_mm.map(|mm| mm * per_mm), width);
    let y = covered(rect.y_mm.map(|mm| mm * per_mm), height);
    for (row, part_y) in y {
        let line = &mut pixels[row * width..][..width];
        for &(column, part_x) in &x {
            let black = (255.0 * part_x * part_y).round() as u8;
            line[column] = line[column].saturating_sub(black);
        }
    }
}

/// The pixels that an interval touches, and how much of each.
fn covered([low, high]: [f64; 2], n: usize) -> Vec<(usize, f64)> {
    let (low, high) = (low.clamp(0.0, n as f64), high.clamp(0.0, n as f64));
    (low as usize..(high.ceil() as usize).min(n))
        .map(|i| (i, high.min(i as f64 + 1.0) - low.max(i as f64)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_covered_in_part() {
        assert_eq!(covered([0.25, 2.5], 4), [(0, 0.75), (1, 1.0), (2, 0.5)]);
        assert_eq!(covered([1.25, 1.5], 4), [(1, 0.25)]);
        assert_eq!(covered([3.0, 9.0], 4), [(3, 1.0)]);
        assert_eq!(covered([1.0, 2.0], 4), [(1, 1.0)]);
    }

    /// Rectangles that share an edge leave no light line between them.
    #[test]
    fn no_seams() {
        let rect = |x_mm| Rect { x_mm, y_mm: [0.0, 1.0] };
        let shapes = vec![vec![rect([0.0, 1.55]), rect([1.55, 4.0])]];
        let (title, texts) = (String::new(), Vec::new());
        let sheet = Sheet { title, size_mm: [5.0, 1.0], board_mm: [0.0; 2], shapes, texts };
        let image = sheet_image(&sheet, 254);
        assert!(
            image.pixels()[..40].iter().all(|&g| g <= 1) && image.pixels()[40..50] == [255; 10]
        );
    }
}
