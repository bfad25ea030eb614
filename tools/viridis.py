#!/usr/bin/env python3
"""Writes src/report/drawing/viridis.rs: the colour map viridis from OpenCV's copy of it.

  pip install opencv-python && tools/viridis.py > src/report/drawing/viridis.rs

viridis is by Stéfan van der Walt and Nathaniel Smith (2015), released under CC0.
"""
import cv2
import numpy as np

table = cv2.applyColorMap(np.arange(256, dtype=np.uint8)[None], cv2.COLORMAP_VIRIDIS)[0, :, ::-1]
print("//! The colour map viridis: equal steps of the value look equally large, also in grey and to the colour-blind.")
print("//!")
print("//! By Stéfan van der Walt and Nathaniel Smith (2015), CC0. Written by `tools/viridis.py`.")
print()
print("/// sRGB from dark violet to yellow, 0xRRGGBB.")
print("#[rustfmt::skip]")
print("const VIRIDIS: [u32; 256] = [")
for row in table.reshape(32, 8, 3):
    print("    " + " ".join("0x%02x%02x%02x," % tuple(c) for c in row))
print("];")
print()
print("""/// The colour of a value between 0 and 1; what lies outside has the colour of the end.
pub(in crate::report) fn viridis(value: f64) -> [u8; 3] {
    // NaN becomes 0; callers tell what has no value themselves.
    let index = (value.clamp(0.0, 1.0) * 255.0).round() as usize;
    let [_, r, g, b] = VIRIDIS[index].to_be_bytes();
    [r, g, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What makes it fit to carry numbers: lightness only ever grows, and evenly.
    #[test]
    fn lightness_grows_evenly() {
        let lightness = |[r, g, b]: [u8; 3]| {
            let linear = |c: u8| {
                let c = f64::from(c) / 255.0;
                if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
            };
            let y = 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
            116.0 * y.cbrt() - 16.0
        };
        let all: Vec<f64> = (0..=16).map(|i| lightness(viridis(f64::from(i) / 16.0))).collect();
        let mean = (all[16] - all[0]) / 16.0;
        for pair in all.windows(2) {
            let step = pair[1] - pair[0];
            assert!((0.7 * mean..1.3 * mean).contains(&step), "{step} for {mean}");
        }
        assert_eq!([viridis(-1.0), viridis(2.0)], [[0x44, 0x01, 0x54], [0xfd, 0xe7, 0x25]]);
    }
}""")
