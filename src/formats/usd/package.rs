//! Layers packed with their pictures, `.usdz`.

use crate::formats::error::{Format, FormatError};
use std::io::{Cursor, Write};

/// A layer and the files that it names as one file: a ZIP archive without compression.
///
/// The layer comes first; the contents of each file begin at a multiple of 64 bytes, so that programs can map them.
pub fn write_usd_package<'a>(files: impl IntoIterator<Item = (&'a str, &'a [u8])>) -> Result<Vec<u8>, FormatError> {
    const ALIGNMENT: u16 = 64;
    let container = |e: zip::result::ZipError| FormatError::Container { format: Format::Usd, reason: e.to_string() };
    let options = zip::write::SimpleFileOptions::default()
        .last_modified_time(zip::DateTime::default())
        .compression_method(zip::CompressionMethod::Stored)
        .with_alignment(ALIGNMENT);
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive.start_file(name, options).map_err(container)?;
        archive.write_all(bytes).map_err(|source| FormatError::Io { format: Format::Usd, source })?;
    }
    Ok(archive.finish().map_err(container)?.into_inner())
}
