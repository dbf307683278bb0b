//! Depth and colour images: PNG, JPEG, WebP.

use super::error::{Format, FormatError, beginning};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageFormat, ImageReader};
use std::io::Cursor;

/// A depth image as the file states it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DepthPicture {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Height × width, row by row, in the camera's depth unit; 0 where the camera measured nothing.
    pub depth: Vec<u16>,
}

/// A colour image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColorPicture {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Height × width × 3, sRGB, row by row.
    pub pixels: Vec<[u8; 3]>,
}

/// An image that claims more pixels than this has a damaged header: 64 megapixels, twice a large camera's.
const MAX_PIXELS: u64 = 1 << 26;
/// Largest picture of a mesh, in pixels: 16 k × 16 k, the largest that photogrammetry programs write; 800 MB in memory.
const MAX_TEXTURE_PIXELS: u64 = 1 << 28;

/// Reads a depth image: PNG, one channel of 16 bits.
///
/// **Errors** if it is not a PNG, does not decode, or has another kind of pixel.
pub fn read_depth_png(bytes: &[u8]) -> Result<DepthPicture, FormatError> {
    if !bytes.starts_with(b"\x89PNG") {
        return Err(not_this(Format::Png, bytes));
    }
    match decoded(Format::Png, bytes, MAX_PIXELS)? {
        DynamicImage::ImageLuma16(picture) => Ok(DepthPicture {
            width: picture.width() as usize,
            height: picture.height() as usize,
            depth: picture.into_raw(),
        }),
        other => {
            let color = other.color();
            Err(FormatError::DepthKind {
                bits: 8 * u16::from(color.bytes_per_pixel()) / u16::from(color.channel_count()),
                channels: color.channel_count(),
            })
        }
    }
}

/// Reads a colour image: PNG, JPEG or WebP, whatever its kind of pixel.
///
/// **Errors** if it is none of them, or does not decode.
pub fn read_color_picture(bytes: &[u8]) -> Result<ColorPicture, FormatError> {
    color_picture(bytes, MAX_PIXELS)
}

/// Reads the picture of a mesh's material, like [`read_color_picture`]; it may be larger.
pub fn read_texture_picture(bytes: &[u8]) -> Result<ColorPicture, FormatError> {
    color_picture(bytes, MAX_TEXTURE_PIXELS)
}

fn color_picture(bytes: &[u8], most_pixels: u64) -> Result<ColorPicture, FormatError> {
    let format = match bytes {
        [0xff, 0xd8, ..] => Format::Jpeg,
        [0x89, b'P', b'N', b'G', ..] => Format::Png,
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Format::WebP,
        _ => return Err(not_this(Format::Jpeg, bytes)),
    };
    let picture = decoded(format, bytes, most_pixels)?.into_rgb8();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    // Without a copy where the allocation allows it: a large picture is most of the memory of reading a scan.
    let pixels = bytemuck::allocation::try_cast_vec(picture.into_raw())
        .unwrap_or_else(|(_, samples)| samples.as_chunks::<3>().0.to_vec());
    Ok(ColorPicture { width, height, pixels })
}

/// Whether the end of image follows the first scan. Segments before it are skipped by their lengths, as they may hold a preview
/// with an end of its own; in a scan, 0xFF is followed by 0 unless it begins a marker (ITU-T T.81, B.1.1).
fn is_whole_jpeg(bytes: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    const END_OF_IMAGE: u8 = 0xd9;
    let mut at = 2;
    while let [0xff, marker, high, low, ..] = bytes[at.min(bytes.len())..] {
        // Any number of 0xFF may stand before a marker.
        at += if marker == 0xff { 1 } else { 2 + usize::from(u16::from_be_bytes([high, low])) };
        if marker == START_OF_SCAN {
            return bytes[at.min(bytes.len())..].windows(2).any(|pair| pair == [0xff, END_OF_IMAGE]);
        }
    }
    // What is no sequence of segments is for the decoder to refuse.
    true
}

fn not_this(format: Format, bytes: &[u8]) -> FormatError {
    let found = if bytes.is_empty() { "nothing".into() } else { beginning(bytes) };
    FormatError::NotThisFormat { format, found }
}

fn decoded(format: Format, bytes: &[u8], most_pixels: u64) -> Result<DynamicImage, FormatError> {
    let damaged = |e: image::ImageError| FormatError::Container { format, reason: e.to_string() };
    let kind = match format {
        Format::Jpeg => ImageFormat::Jpeg,
        Format::WebP => ImageFormat::WebP,
        _ => ImageFormat::Png,
    };
    // The decoder fills what is missing with grey, and says nothing.
    if format == Format::Jpeg && !is_whole_jpeg(bytes) {
        return Err(FormatError::Container { format, reason: "it is cut off".into() });
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), kind);
    // The number of pixels is the limit.
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > most_pixels {
        return Err(FormatError::Container { format, reason: format!("it claims {width} × {height} pixels") });
    }
    DynamicImage::from_decoder(decoder).map_err(damaged)
}

/// Encodes a depth image as PNG of 16 bits.
///
/// **Shapes** `size` is width and height, `depth` height × width, row by row.
///
/// **Errors** [`FormatError::ArrayShape`] if the two disagree.
pub fn write_depth_png(size: [usize; 2], depth: &[u16]) -> Result<Vec<u8>, FormatError> {
    // The encoder takes the samples in the machine's byte order.
    write_png(size, bytemuck::cast_slice(depth), ExtendedColorType::L16)
}

/// Encodes a grey image (labels, for example) as PNG of 8 bits.
///
/// **Shapes** `size` is width and height, `values` height × width, row by row.
///
/// **Errors** [`FormatError::ArrayShape`] if the two disagree.
pub fn write_gray_png(size: [usize; 2], values: &[u8]) -> Result<Vec<u8>, FormatError> {
    write_png(size, values, ExtendedColorType::L8)
}

/// Encodes a colour image as PNG.
///
/// **Shapes** `size` is width and height, `pixels` height × width × 3, sRGB, row by row.
///
/// **Errors** [`FormatError::ArrayShape`] if the two disagree.
pub fn write_color_png(size: [usize; 2], pixels: &[[u8; 3]]) -> Result<Vec<u8>, FormatError> {
    write_png(size, pixels.as_flattened(), ExtendedColorType::Rgb8)
}

/// Encodes a colour image as JPEG of a quality from 1 to 100.
///
/// **Shapes** `size` is width and height, `pixels` height × width × 3, sRGB, row by row.
///
/// **Errors** [`FormatError::ArrayShape`] if the two disagree.
pub fn write_color_jpeg(size: [usize; 2], pixels: &[[u8; 3]], quality: u8) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, quality);
    encode(Format::Jpeg, encoder, size, pixels.as_flattened(), ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

pub(super) fn write_png(size: [usize; 2], samples: &[u8], kind: ExtendedColorType) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    encode(Format::Png, PngEncoder::new(&mut bytes), size, samples, kind)?;
    Ok(bytes)
}

fn encode(
    format: Format,
    encoder: impl ImageEncoder,
    [width, height]: [usize; 2],
    samples: &[u8],
    kind: ExtendedColorType,
) -> Result<(), FormatError> {
    let bytes_per_pixel = usize::from(kind.bits_per_pixel() / 8);
    let (Ok(columns), Ok(rows)) = (u32::try_from(width), u32::try_from(height)) else {
        return Err(FormatError::Unsupported { format, what: format!("an image of {width} × {height} pixels") });
    };
    if width.checked_mul(height).and_then(|n| n.checked_mul(bytes_per_pixel)) != Some(samples.len()) {
        return Err(FormatError::ArrayShape {
            name: "pixels".into(),
            expected: format!("{width} × {height} pixels"),
            found: vec![samples.len() / bytes_per_pixel],
        });
    }
    encoder
        .write_image(samples, columns, rows, kind)
        .map_err(|e| FormatError::Container { format, reason: e.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_read_back_and_other_kinds_are_refused() {
        let depth = DepthPicture { width: 3, height: 2, depth: vec![0, 1, 1000, 65_535, 7, 8] };
        let bytes = write_depth_png([3, 2], &depth.depth).unwrap();
        assert_eq!(read_depth_png(&bytes).unwrap(), depth);
        let color = ColorPicture { width: 16, height: 8, pixels: vec![[200, 100, 50]; 128] };
        let jpeg = write_color_jpeg([16, 8], &color.pixels, 90).unwrap();
        let back = read_color_picture(&jpeg).unwrap();
        let cut = read_color_picture(&jpeg[..jpeg.len() - 20]).unwrap_err().to_string();
        assert!(cut.contains("cut off"), "{cut}");
        let followed = [jpeg.as_slice(), b"a film"].concat();
        assert_eq!(read_color_picture(&followed).unwrap().pixels, back.pixels);
        assert!(back.pixels[60].iter().zip([200, 100, 50]).all(|(&a, b): (&u8, u8)| a.abs_diff(b) < 6));
        assert!(matches!(read_depth_png(&jpeg), Err(FormatError::NotThisFormat { format: Format::Png, .. })));
        assert!(matches!(read_depth_png(&bytes[..bytes.len() / 2]), Err(FormatError::Container { .. })));
        assert!(matches!(read_color_picture(b""), Err(FormatError::NotThisFormat { .. })));
        assert_eq!(read_color_picture(&write_color_png([16, 8], &color.pixels).unwrap()).unwrap(), color);
        let gray = write_gray_png([4, 4], &[9; 16]).unwrap();
        let message = read_depth_png(&gray).unwrap_err().to_string();
        assert_eq!(message, "the depth image has 1 channel of 8 bits; depth needs 1 channel of 16 bits");
    }

    #[test]
    fn pixels_that_do_not_fill_the_size_are_refused() {
        let short = [
            write_depth_png([3, 2], &[0; 5]).unwrap_err(),
            write_gray_png([3, 2], &[0; 5]).unwrap_err(),
            write_color_png([3, 2], &[[0; 3]; 5]).unwrap_err(),
            write_color_jpeg([3, 2], &[[0; 3]; 5], 90).unwrap_err(),
        ];
        for err in short {
            assert_eq!(err.to_string(), "array 'pixels' has shape [5], expected 3 × 2 pixels");
        }
    }
}
