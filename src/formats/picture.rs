//! Depth and colour images: PNG and JPEG.

use super::error::{Format, FormatError};
use image::{DynamicImage, ImageDecoder, ImageReader};
use std::io::Cursor;

/// A depth image as the file states it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DepthPicture {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// In the camera's depth unit; 0 where nothing came back. Row by row.
    pub depth: Vec<u16>,
}

/// A colour image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColorPicture {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// sRGB. Row by row.
    pub pixels: Vec<[u8; 3]>,
}

/// More pixels than this in one image are no camera's but a damaged header: 64 megapixels.
const MOST_PIXELS: u64 = 1 << 26;

/// Reads a depth image: PNG, one channel of 16 bits.
///
/// **Errors** what is no PNG, does not decode, or has another kind of pixel.
pub fn read_depth_png(bytes: &[u8]) -> Result<DepthPicture, FormatError> {
    if !bytes.starts_with(b"\x89PNG") {
        return Err(not_this(Format::Png, bytes));
    }
    match decoded(Format::Png, bytes)? {
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

/// Reads a colour image: PNG or JPEG, whatever its kind of pixel.
///
/// **Errors** what is neither, or does not decode.
pub fn read_color_picture(bytes: &[u8]) -> Result<ColorPicture, FormatError> {
    let format = match bytes {
        [0xff, 0xd8, ..] => Format::Jpeg,
        [0x89, b'P', b'N', b'G', ..] => Format::Png,
        _ => return Err(not_this(Format::Jpeg, bytes)),
    };
    let picture = decoded(format, bytes)?.into_rgb8();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let pixels = picture.into_raw().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    Ok(ColorPicture { width, height, pixels })
}

fn not_this(format: Format, bytes: &[u8]) -> FormatError {
    let found = match bytes {
        [] => "nothing".into(),
        _ => format!("'{}'", super::error::quoted(&String::from_utf8_lossy(&bytes[..bytes.len().min(8)]))),
    };
    FormatError::NotThisFormat { format, found }
}

fn decoded(format: Format, bytes: &[u8]) -> Result<DynamicImage, FormatError> {
    let damaged = |e: image::ImageError| FormatError::Container { format, reason: e.to_string() };
    let kind = if format == Format::Jpeg { image::ImageFormat::Jpeg } else { image::ImageFormat::Png };
    let decoder = ImageReader::with_format(Cursor::new(bytes), kind).into_decoder().map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(FormatError::Container { format, reason: format!("it claims {width} × {height} pixels") });
    }
    DynamicImage::from_decoder(decoder).map_err(damaged)
}

/// Writes a depth image as PNG of 16 bits.
///
/// # Panics
/// If `depth` is not `width × height`.
pub fn write_depth_png(picture: &DepthPicture) -> Result<Vec<u8>, FormatError> {
    let (width, height) = (picture.width as u32, picture.height as u32);
    let buffer = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(width, height, picture.depth.clone());
    let mut bytes = Vec::new();
    DynamicImage::ImageLuma16(buffer.expect("the size is that of the pixels"))
        .write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png)
        .map_err(|e| FormatError::Container { format: Format::Png, reason: e.to_string() })?;
    Ok(bytes)
}

/// Writes a colour image as JPEG of a quality from 1 to 100.
///
/// # Panics
/// If `pixels` are not `width × height`.
pub fn write_color_jpeg(picture: &ColorPicture, quality: u8) -> Result<Vec<u8>, FormatError> {
    let raw: Vec<u8> = picture.pixels.iter().flatten().copied().collect();
    let buffer = image::RgbImage::from_raw(picture.width as u32, picture.height as u32, raw);
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode_image(&buffer.expect("the size is that of the pixels"))
        .map_err(|e| FormatError::Container { format: Format::Jpeg, reason: e.to_string() })?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_come_back_and_other_kinds_are_told() {
        let depth = DepthPicture { width: 3, height: 2, depth: vec![0, 1, 1000, 65_535, 7, 8] };
        let bytes = write_depth_png(&depth).unwrap();
        assert_eq!(read_depth_png(&bytes).unwrap(), depth);
        let color = ColorPicture { width: 16, height: 8, pixels: vec![[200, 100, 50]; 128] };
        let jpeg = write_color_jpeg(&color, 90).unwrap();
        let back = read_color_picture(&jpeg).unwrap();
        assert!(back.pixels[60].iter().zip([200, 100, 50]).all(|(&a, b): (&u8, u8)| a.abs_diff(b) < 6));
        assert!(matches!(read_depth_png(&jpeg), Err(FormatError::NotThisFormat { format: Format::Png, .. })));
        assert!(matches!(read_depth_png(&bytes[..bytes.len() / 2]), Err(FormatError::Container { .. })));
        assert!(matches!(read_color_picture(b""), Err(FormatError::NotThisFormat { .. })));
        let mut grey = Vec::new();
        DynamicImage::new_luma8(4, 4).write_to(&mut Cursor::new(&mut grey), image::ImageFormat::Png).unwrap();
        let told = read_depth_png(&grey).unwrap_err().to_string();
        assert_eq!(told, "the depth image has 1 channel of 8 bits; depth needs 1 channel of 16 bits");
    }
}
