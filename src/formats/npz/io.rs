//! Reads and writes `.npy` and `.npz`.

use super::arrays::{NpyArray, NpyData, Npz};
use crate::formats::error::{Format, FormatError, beginning};
use crate::formats::raw_mesh::read_all;
use npyz::{AutoSerialize, DType, Deserialize, NpyFile, NpyHeader, Order, Serialize, TypeChar, WriterBuilder};
use std::io::{Cursor, Read, Seek, Write};
use zip::write::SimpleFileOptions;

/// Reads one `.npy` array.
pub fn read_npy(input: impl Read) -> Result<NpyArray, FormatError> {
    let bytes = read_all(Format::Npy, input)?;
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err(FormatError::NotThisFormat { format: Format::Npy, found: beginning(&bytes) });
    }
    array_from_bytes(&bytes, Format::Npy, "(file)")
}

/// Reads all arrays of an `.npz`.
///
/// Arrays of a type that we cannot read (pickled objects, complex numbers, records) are kept as
/// [`NpyData::Opaque`]; asking for their values is the error.
pub fn read_npz(input: impl Read + Seek) -> Result<Npz, FormatError> {
    let container = |e: zip::result::ZipError| FormatError::Container { format: Format::Npz, reason: e.to_string() };
    let mut archive = zip::ZipArchive::new(input).map_err(container)?;
    let mut npz = Npz::new();
    for index in 0..archive.len() {
        let entry = archive.by_index(index).map_err(container)?;
        let Some(name) = npyz::npz::array_name_from_file_name(entry.name()).map(str::to_string) else { continue };
        let bytes = read_all(Format::Npz, entry)?;
        npz.insert(&name, array_from_bytes(&bytes, Format::Npz, &name)?);
    }
    Ok(npz)
}

/// Writes one `.npy` array.
///
/// **Errors** [`FormatError::Unsupported`] for an opaque array.
pub fn write_npy(array: &NpyArray, mut out: impl Write) -> Result<(), FormatError> {
    let io = |source| FormatError::Io { format: Format::Npy, source };
    out.write_all(&bytes_of_array(array, "(file)")?).and_then(|()| out.flush()).map_err(io)
}

/// Whether the arrays of an `.npz` are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum NpzCompression {
    /// Uncompressed, as `numpy.savez`: fastest.
    Stored,
    /// Deflated, as `numpy.savez_compressed`.
    #[default]
    Deflated,
}

/// Writes an `.npz`.
///
/// **Guarantees** equal arrays give equal bytes: sorted by name, dated 1 January 1980.
pub fn write_npz(npz: &Npz, compression: NpzCompression, mut out: impl Write) -> Result<(), FormatError> {
    let io = |source| FormatError::Io { format: Format::Npz, source };
    let container = |e: zip::result::ZipError| FormatError::Container { format: Format::Npz, reason: e.to_string() };
    let options = SimpleFileOptions::default()
        .last_modified_time(zip::DateTime::default())
        .unix_permissions(0o644)
        .compression_method(match compression {
            NpzCompression::Stored => zip::CompressionMethod::Stored,
            NpzCompression::Deflated => zip::CompressionMethod::Deflated,
        });
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for name in npz.names() {
        archive.start_file(npyz::npz::file_name_from_array_name(name), options).map_err(container)?;
        archive.write_all(&bytes_of_array(npz.get(name)?, name)?).map_err(io)?;
    }
    let bytes = archive.finish().map_err(container)?.into_inner();
    out.write_all(&bytes).and_then(|()| out.flush()).map_err(io)
}

fn array_from_bytes(bytes: &[u8], format: Format, name: &str) -> Result<NpyArray, FormatError> {
    let damaged = |reason: String| FormatError::Container { format, reason: format!("array '{name}': {reason}") };
    let mut rest = bytes;
    let header = NpyHeader::from_reader(&mut rest).map_err(|e| damaged(e.to_string()))?;
    let (dtype, order) = (header.dtype(), header.order());
    let shape: Vec<usize> = header.shape().iter().map(|&n| n as usize).collect();
    let opaque = |pickled| NpyData::Opaque { dtype: dtype.descr(), pickled };
    let DType::Plain(kind) = &dtype else {
        return Ok(NpyArray { shape, data: opaque(header.uses_pickled_array()) });
    };
    if header.uses_pickled_array() {
        return Ok(NpyArray { shape, data: opaque(true) });
    }
    // Before anything of the stated size is allocated.
    let count = shape.iter().try_fold(1usize, |product, &n| product.checked_mul(n)).unwrap_or(usize::MAX);
    let item_bytes = kind.num_bytes().unwrap_or(1);
    if item_bytes == 0 && count > 0 {
        // NumPy makes no such type for a text array that has an element.
        return Err(damaged(format!("its type {} has no width", dtype.descr())));
    }
    if rest.len() / item_bytes.max(1) < count {
        let element = format!("value of array '{name}',");
        return Err(FormatError::Truncated { format, element, index: rest.len() / item_bytes.max(1), count });
    }
    let file = NpyFile::with_header(header, rest);
    let data = match (kind.type_char(), kind.num_bytes()) {
        (TypeChar::Float, Some(4)) => file.into_vec().map(NpyData::F32),
        (TypeChar::Float, Some(8)) => file.into_vec().map(NpyData::F64),
        (TypeChar::Bool, _) => widened::<bool>(file),
        (TypeChar::Int, Some(1)) => widened::<i8>(file),
        (TypeChar::Int, Some(2)) => widened::<i16>(file),
        (TypeChar::Int, Some(4)) => widened::<i32>(file),
        (TypeChar::Int, Some(8)) => file.into_vec().map(NpyData::I64),
        (TypeChar::Uint, Some(1)) => widened::<u8>(file),
        (TypeChar::Uint, Some(2)) => widened::<u16>(file),
        (TypeChar::Uint, Some(4)) => file.into_vec().map(NpyData::U32),
        // An array with a number beyond i64 has no indices that we could use.
        (TypeChar::Uint, Some(8)) => file.into_vec::<u64>().map(|values| {
            let integers: Result<Vec<i64>, _> = values.into_iter().map(i64::try_from).collect();
            integers.map_or_else(|_| opaque(false), NpyData::I64)
        }),
        (TypeChar::UnicodeStr | TypeChar::ByteStr, _) => file.into_vec().map(NpyData::Text),
        _ => Ok(opaque(false)),
    }
    .map_err(|e| damaged(e.to_string()))?;
    let data = if order == Order::Fortran { in_c_order(&shape, data) } else { data };
    Ok(NpyArray { shape, data })
}

fn widened<T: Deserialize + Into<i32>>(file: NpyFile<&[u8]>) -> std::io::Result<NpyData> {
    Ok(NpyData::I32(file.into_vec::<T>()?.into_iter().map(Into::into).collect()))
}

/// Values stored with the first index fastest, laid out with the last index fastest.
fn in_c_order(shape: &[usize], data: NpyData) -> NpyData {
    fn permuted<T: Clone>(shape: &[usize], values: Vec<T>) -> Vec<T> {
        let mut index = vec![0usize; shape.len()];
        let mut ordered = Vec::with_capacity(values.len());
        for _ in 0..values.len() {
            let at = index.iter().zip(shape).rev().fold(0, |at, (&i, &n)| at * n + i);
            ordered.push(values[at].clone());
            for axis in (0..shape.len()).rev() {
                index[axis] += 1;
                if index[axis] < shape[axis] {
                    break;
                }
                index[axis] = 0;
            }
        }
        ordered
    }
    match data {
        NpyData::F32(v) => NpyData::F32(permuted(shape, v)),
        NpyData::F64(v) => NpyData::F64(permuted(shape, v)),
        NpyData::I32(v) => NpyData::I32(permuted(shape, v)),
        NpyData::U32(v) => NpyData::U32(permuted(shape, v)),
        NpyData::I64(v) => NpyData::I64(permuted(shape, v)),
        NpyData::Text(v) => NpyData::Text(permuted(shape, v)),
        opaque @ NpyData::Opaque { .. } => opaque,
    }
}

fn bytes_of_array(array: &NpyArray, name: &str) -> Result<Vec<u8>, FormatError> {
    fn numbers<T: Serialize + AutoSerialize>(shape: &[u64], values: &[T]) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut bytes).begin_nd()?;
        for value in values {
            writer.push(value)?;
        }
        writer.finish()?;
        Ok(bytes)
    }
    let shape: Vec<u64> = array.shape().iter().map(|&n| n as u64).collect();
    match array.data() {
        NpyData::F32(v) => numbers(&shape, v),
        NpyData::F64(v) => numbers(&shape, v),
        NpyData::I32(v) => numbers(&shape, v),
        NpyData::U32(v) => numbers(&shape, v),
        NpyData::I64(v) => numbers(&shape, v),
        NpyData::Text(v) => text(&shape, v),
        NpyData::Opaque { dtype, .. } => {
            return Err(FormatError::Unsupported {
                format: Format::Npy,
                what: format!("array '{name}' of type {dtype}"),
            });
        }
    }
    .map_err(|source| FormatError::Io { format: Format::Npy, source })
}

fn text(shape: &[u64], values: &[String]) -> std::io::Result<Vec<u8>> {
    let width = values.iter().map(|v| v.chars().count()).max().unwrap_or(0).max(1);
    let invalid = |e: String| std::io::Error::new(std::io::ErrorKind::InvalidData, e);
    let kind = format!("<U{width}").parse().map_err(|e: npyz::ParseTypeStrError| invalid(e.to_string()))?;
    let mut bytes = Vec::new();
    let mut writer = npyz::WriteOptions::new().dtype(DType::Plain(kind)).shape(shape).writer(&mut bytes).begin_nd()?;
    for value in values {
        writer.push(value.as_str())?;
    }
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every_type() -> Npz {
        let mut npz = Npz::new();
        npz.insert("f4", NpyArray::rows(&[[1.5f32, -0.0], [f32::MIN_POSITIVE, 3.0]]));
        npz.insert("f8", NpyArray::try_new(&[2, 1, 3], vec![0.1, 0.2, 0.3, 1e300, -1e-300, 0.0]).unwrap());
        npz.insert("i4", NpyArray::vector(vec![-1i32, i32::MAX]));
        npz.insert("u4", NpyArray::rows(&[[0u32, 1, u32::MAX]]));
        npz.insert("i8", NpyArray::try_new(&[], vec![i64::MIN]).unwrap());
        npz.insert("names", NpyArray::vector(vec!["hips".to_string(), "Hüfte".into(), String::new()]));
        npz
    }

    fn written(npz: &Npz, compression: NpzCompression) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_npz(npz, compression, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn written_arrays_are_read_back_and_equal_arrays_give_equal_bytes() {
        for compression in [NpzCompression::Stored, NpzCompression::Deflated] {
            let bytes = written(&every_type(), compression);
            assert_eq!(read_npz(Cursor::new(&bytes)).unwrap(), every_type());
            assert_eq!(bytes, written(&every_type(), compression));
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        let whole = written(&every_type(), NpzCompression::Stored);
        for cut in (0..whole.len()).step_by(97).chain([whole.len() - 1]) {
            assert!(read_npz(Cursor::new(&whole[..cut])).is_err(), "cut at {cut}");
        }
        let mut npy = Vec::new();
        write_npy(&NpyArray::vector(vec![1.0f64; 9]), &mut npy).unwrap();
        for cut in 0..npy.len() {
            assert!(read_npy(&npy[..cut]).is_err(), "cut at {cut}");
        }
        let err = read_npy(&npy[..npy.len() - 1]).unwrap_err();
        assert!(matches!(err, FormatError::Truncated { index: 8, count: 9, .. }), "{err}");
    }

    /// An `.npy` of version 1 with `header` as NumPy writes it.
    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let text = format!("{header:<117}\n");
        [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes(), data].concat()
    }

    #[test]
    fn fortran_order_and_big_endian_are_converted() {
        let data: Vec<u8> = [1i16, 4, 2, 5, 3, 6].iter().flat_map(|v| v.to_be_bytes()).collect();
        let array = read_npy(npy("{'descr': '>i2', 'fortran_order': True, 'shape': (2, 3), }", &data).as_slice());
        assert_eq!(array.unwrap(), NpyArray::rows(&[[1, 2, 3], [4, 5, 6]]));
    }

    #[test]
    fn pickles_are_refused_by_name_only_when_asked_for() {
        let array = read_npy(npy("{'descr': '|O', 'fortran_order': False, 'shape': (), }", b"\x80\x04.").as_slice());
        let mut npz = every_type();
        npz.insert("J_regressor", array.unwrap());
        let err = npz.f64("J_regressor").unwrap_err();
        assert!(err.to_string().contains("'J_regressor' is a pickled Python object"), "{err}");
        assert!(err.hint().unwrap().contains("J_regressor"));
        assert!(write_npz(&npz, NpzCompression::Stored, Vec::new()).is_err());
    }

    #[test]
    fn unsigned_integers_beyond_i64_are_not_clamped() {
        let header = "{'descr': '<u8', 'fortran_order': False, 'shape': (2,), }";
        let bytes = |values: [u64; 2]| npy(header, &values.map(u64::to_le_bytes).concat());
        let mut npz = Npz::new();
        npz.insert("small", read_npy(bytes([1, i64::MAX as u64]).as_slice()).unwrap());
        npz.insert("large", read_npy(bytes([1, u64::MAX]).as_slice()).unwrap());
        assert_eq!(npz.i64("small").unwrap(), [1, i64::MAX]);
        assert!(npz.i64("large").unwrap_err().to_string().contains("'large' holds"));
    }

    #[test]
    fn an_endless_shape_is_only_a_truncated_file() {
        let file = npy("{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 1073741824), }", &[0; 16]);
        assert!(read_npy(file.as_slice()).is_err());
    }

    #[test]
    fn wrong_name_type_and_shape_are_named() {
        let npz = every_type();
        assert!(npz.f64("g8").unwrap_err().to_string().contains("no array 'g8' (it has f4, f8, i4"));
        assert!(npz.u32("i4").unwrap_err().to_string().contains("value 0: expected a number from 0"));
        assert!(npz.i64("f8").unwrap_err().to_string().contains("holds f8, expected whole numbers"));
        assert!(npz.f64("names").unwrap_err().to_string().contains("holds text, expected numbers"));
        assert!(npz.f64_rows::<3>("f4").unwrap_err().to_string().contains("shape [2, 2], expected (any, 3)"));
        assert!(npz.shape_of::<2>("f8").is_err());
        assert_eq!(npz.f64_rows::<2>("f4").unwrap()[0], [1.5, -0.0]);
        assert_eq!(npz.u32_rows::<3>("u4").unwrap(), [[0, 1, u32::MAX]]);
        assert!(NpyArray::try_new(&[2, 2], vec![1.0f64]).is_err());
    }
}
