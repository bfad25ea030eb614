//! Animated PNG.

use super::{
    Rgb,
    codec::{side, start},
};

/// Frames of one size as an animated PNG that plays for ever, each shown for so many milliseconds. Programs that know
/// no animation show the first. Frames are asked for one by one; `n_frames` says how many there are. Panics where that
/// is not true, where sizes differ, and for images without pixels.
pub fn animated_png(
    n_frames: usize,
    delay_ms: u16,
    frames: impl IntoIterator<Item = Rgb>,
) -> Vec<u8> {
    const TRUE: &str =
        "memory takes all bytes, and the frames are as many and as large as was said";
    let mut frames = frames.into_iter().peekable();
    let first = frames.peek().expect("at least one frame");
    let size = (first.width(), first.height());
    let mut bytes = Vec::new();
    let mut encoder = start(&mut bytes, size, png::ColorType::Rgb, png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_animated(side(n_frames), 0).expect("at least one frame");
    encoder.set_frame_delay(delay_ms, 1000).expect("the animation was set");
    let mut writer = encoder.write_header().expect(TRUE);
    for frame in frames {
        assert_eq!((frame.width(), frame.height()), size, "frames of one size");
        writer.write_image_data(frame.pixels().as_flattened()).expect(TRUE);
    }
    writer.finish().expect(TRUE);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_comes_back() {
        let image = |value: u8| Rgb::new(5, 4, vec![[value; 3]; 20]);
        let bytes = animated_png(3, 250, [1, 2, 3].map(image));
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let animation = reader.info().animation_control.unwrap();
        assert_eq!((animation.num_frames, animation.num_plays), (3, 0));
        for value in 1..=3 {
            let mut pixels = vec![0; 60];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, [value; 60]);
            let frame = reader.info().frame_control.unwrap();
            assert_eq!((frame.delay_num, frame.delay_den), (250, 1000));
        }
        let limits = crate::image::Limits::default();
        assert_eq!(Rgb::from_png(&bytes, &limits).unwrap(), image(1));
    }
}
