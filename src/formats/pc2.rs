//! Writes point caches (PC2): the positions of a mesh's vertices over time, as Blender's Mesh Cache and 3ds Max read them.

use super::error::{Format, FormatError};
use std::io::Write;

/// Writes a point cache: little-endian, one sample per frame, the first at frame `first_frame`. Only one frame is in memory.
///
/// **Shapes** `size` the number of frames F and of points V; `frame` gives V × 3 for each frame.
///
/// **Errors** for frames of other lengths, and for numbers that are not finite.
pub fn write_pc2(
    size: [usize; 2],
    first_frame: f32,
    mut frame: impl FnMut(usize) -> Vec<[f32; 3]>,
    mut out: impl Write,
) -> Result<(), FormatError> {
    let bad = |index: usize, expected: String, found: String| FormatError::Element {
        format: Format::Pc2,
        element: "frame".into(),
        index,
        expected,
        found,
    };
    let counted = |n: usize| {
        let what = format!("a cache of {n} points or frames");
        i32::try_from(n).map_err(|_| FormatError::Unsupported { format: Format::Pc2, what })
    };
    let [frame_count, point_count] = size;
    let (samples, points) = (counted(frame_count)?, counted(point_count)?);
    let mut header = b"POINTCACHE2\0".to_vec();
    header.extend(1i32.to_le_bytes());
    header.extend(points.to_le_bytes());
    header.extend(first_frame.to_le_bytes());
    // One sample per frame.
    header.extend(1f32.to_le_bytes());
    header.extend(samples.to_le_bytes());
    let io = |source| FormatError::Io { format: Format::Pc2, source };
    out.write_all(&header).map_err(io)?;
    for index in 0..frame_count {
        let rows = frame(index);
        if rows.len() != point_count {
            return Err(bad(index, format!("{point_count} points"), rows.len().to_string()));
        }
        if let Some(point) = rows.iter().find(|point| point.iter().any(|x| !x.is_finite())) {
            return Err(bad(index, "finite numbers".into(), format!("{point:?}")));
        }
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        out.write_all(&bytes).map_err(io)?;
    }
    out.flush().map_err(io)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_says_what_follows() {
        let frame = |_| vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        let mut bytes = Vec::new();
        write_pc2([3, 2], 0.0, frame, &mut bytes).unwrap();
        assert_eq!(bytes.len(), 32 + 3 * 2 * 12);
        let int = |at: usize| i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((&bytes[..12], int(12), int(16), int(28)), (&b"POINTCACHE2\0"[..], 1, 2, 3));
        assert_eq!((float(20), float(24), float(32), float(52)), (0.0, 1.0, 1.0, 6.0));
    }

    #[test]
    fn frames_that_do_not_fit_are_refused() {
        let mut out = Vec::new();
        let uneven = write_pc2([2, 2], 0.0, |k| vec![[0.0; 3]; 2 + k], &mut out).unwrap_err();
        assert_eq!(uneven.to_string(), "PC2, frame 1: expected 2 points, found 3");
        assert!(write_pc2([1, 1], 0.0, |_| vec![[f32::NAN; 3]], &mut out).is_err());
        assert!(write_pc2([1, 1 << 32], 0.0, |_| Vec::new(), &mut out).is_err());
    }
}
