//! Writes animated pictures (GIF).

use super::error::{Format, FormatError};
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};

/// How much quality the choice of the 256 colours of a frame gives up for speed, 1 to 30: at 10 the shaded side of a yellow sleeve
/// became red in some frames of the demo's walk; at 3 and 1 it stays yellow, and 3 takes a third of the time.
const SPEED: i32 = 3;

/// Writes an endless film. `frames` gives the pixels of each frame and how long it is shown, in hundredths of a second.
///
/// **Shapes** `size` width and height; the pixels of a frame are height × width, row by row.
///
/// **Errors** for a frame of another size, and for one that `frames` cannot give.
pub fn write_gif<E: From<FormatError>>(
    size: [usize; 2],
    frames: impl Iterator<Item = Result<(Vec<[u8; 3]>, u16), E>>,
) -> Result<Vec<u8>, E> {
    let failed = |reason: String| FormatError::Container { format: Format::Gif, reason };
    let mut bytes = Vec::new();
    let mut encoder = GifEncoder::new_with_speed(&mut bytes, SPEED);
    encoder.set_repeat(Repeat::Infinite).map_err(|e| failed(e.to_string()))?;
    for (index, frame) in frames.enumerate() {
        let (pixels, hundredths) = frame?;
        let rgba: Vec<u8> = pixels.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        let picture = RgbaImage::from_raw(size[0] as u32, size[1] as u32, rgba);
        let Some(picture) = picture.filter(|_| pixels.len() == size[0] * size[1]) else {
            return Err(FormatError::Element {
                format: Format::Gif,
                element: "frame".into(),
                index,
                expected: format!("{} pixels", size[0] * size[1]),
                found: pixels.len().to_string(),
            }
            .into());
        };
        let delay = Delay::from_numer_denom_ms(u32::from(hundredths) * 10, 1);
        encoder.encode_frame(Frame::from_parts(picture, 0, 0, delay)).map_err(|e| failed(e.to_string()))?;
    }
    drop(encoder);
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::AnimationDecoder;
    use image::codecs::gif::GifDecoder;
    use std::io::Cursor;

    #[test]
    fn a_film_has_its_frames_and_times() {
        let colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255]];
        let frames = colors.iter().zip([7, 6, 7]).map(|(&color, time)| Ok::<_, FormatError>((vec![color; 12], time)));
        let bytes = write_gif([4, 3], frames).unwrap();
        let read = GifDecoder::new(Cursor::new(bytes)).unwrap().into_frames().collect_frames().unwrap();
        assert_eq!(read.len(), 3);
        for ((frame, color), time) in read.iter().zip(colors).zip([7, 6, 7]) {
            assert_eq!(frame.delay().numer_denom_ms(), (time * 10, 1));
            assert_eq!(
                (frame.buffer().dimensions(), frame.buffer().get_pixel(2, 1).0[..3].to_vec()),
                ((4, 3), color.to_vec())
            );
        }
        let small = write_gif([4, 4], std::iter::once(Ok::<_, FormatError>((vec![[0; 3]; 12], 7)))).unwrap_err();
        assert_eq!(small.to_string(), "GIF, frame 0: expected 16 pixels, found 12");
    }
}
