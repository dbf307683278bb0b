//! NumPy arrays with type and shape, and sets of them by name.

use crate::formats::error::{Format, FormatError};
use std::collections::BTreeMap;

/// The values of an array, in C order (last index fastest).
#[derive(Clone, Debug, PartialEq)]
pub enum NpyData {
    /// `f4`.
    F32(Vec<f32>),
    /// `f8`.
    F64(Vec<f64>),
    /// `i4`, and narrower integers as read.
    I32(Vec<i32>),
    /// `u4`.
    U32(Vec<u32>),
    /// `i8`, and `u8` as read.
    I64(Vec<i64>),
    /// `U…` or `S…`.
    Text(Vec<String>),
    /// A type that we do not read; an error only when the values are requested.
    Opaque {
        /// The type as the file states it.
        dtype: String,
        /// Whether only Python's pickle can open it.
        pickled: bool,
    },
}

/// An array with its shape.
#[derive(Clone, Debug, PartialEq)]
pub struct NpyArray {
    pub(super) shape: Vec<usize>,
    pub(super) data: NpyData,
}

macro_rules! from_vec {
    ($($type:ty => $variant:ident),*) => {$(
        impl From<Vec<$type>> for NpyData {
            fn from(values: Vec<$type>) -> Self {
                Self::$variant(values)
            }
        }
    )*};
}
from_vec!(f32 => F32, f64 => F64, i32 => I32, u32 => U32, i64 => I64, String => Text);

impl NpyData {
    fn len(&self) -> Option<usize> {
        match self {
            Self::F32(v) => Some(v.len()),
            Self::F64(v) => Some(v.len()),
            Self::I32(v) => Some(v.len()),
            Self::U32(v) => Some(v.len()),
            Self::I64(v) => Some(v.len()),
            Self::Text(v) => Some(v.len()),
            Self::Opaque { .. } => None,
        }
    }

    fn type_name(&self) -> &str {
        match self {
            Self::F32(_) => "f4",
            Self::F64(_) => "f8",
            Self::I32(_) => "i4",
            Self::U32(_) => "u4",
            Self::I64(_) => "i8",
            Self::Text(_) => "text",
            Self::Opaque { dtype, .. } => dtype,
        }
    }
}

impl NpyArray {
    /// An array of `shape`, last index fastest.
    ///
    /// **Shapes** the product of `shape` is the number of values.
    ///
    /// **Errors** when `shape` has another number of values.
    pub fn try_new(shape: &[usize], data: impl Into<NpyData>) -> Result<Self, FormatError> {
        let data = data.into();
        match data.len() {
            Some(len) if len == shape.iter().product::<usize>() => Ok(Self { shape: shape.to_vec(), data }),
            len => Err(FormatError::ArrayShape {
                name: "(new)".into(),
                expected: format!("a product of {}", len.unwrap_or(0)),
                found: shape.to_vec(),
            }),
        }
    }

    /// A one-dimensional array.
    pub fn vector(data: impl Into<NpyData>) -> Self {
        let data = data.into();
        Self { shape: vec![data.len().unwrap_or(0)], data }
    }

    /// An `N`-column matrix.
    ///
    /// **Shapes** `R × N`.
    pub fn rows<const N: usize, T: Copy>(rows: &[[T; N]]) -> Self
    where
        NpyData: From<Vec<T>>,
    {
        Self { shape: vec![rows.len(), N], data: rows.as_flattened().to_vec().into() }
    }

    /// Extents, outermost first; empty for a single number.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The values as they are stored.
    pub fn data(&self) -> &NpyData {
        &self.data
    }

    fn wrong_type(&self, name: &str, expected: &str) -> FormatError {
        match &self.data {
            NpyData::Opaque { dtype, pickled: true } => {
                FormatError::Pickled { name: name.into(), dtype: dtype.clone() }
            }
            other => {
                FormatError::ArrayType { name: name.into(), expected: expected.into(), found: other.type_name().into() }
            }
        }
    }

    /// The numbers as `f64`; `name` is for the message.
    ///
    /// **Shapes** all values in C order.
    pub fn to_f64(&self, name: &str) -> Result<Vec<f64>, FormatError> {
        match &self.data {
            NpyData::F64(v) => Ok(v.clone()),
            NpyData::F32(v) => Ok(v.iter().map(|&x| f64::from(x)).collect()),
            NpyData::I32(v) => Ok(v.iter().map(|&x| f64::from(x)).collect()),
            NpyData::U32(v) => Ok(v.iter().map(|&x| f64::from(x)).collect()),
            NpyData::I64(v) => Ok(v.iter().map(|&x| x as f64).collect()),
            NpyData::Text(_) | NpyData::Opaque { .. } => Err(self.wrong_type(name, "numbers")),
        }
    }

    /// The integers as `i64`. Floats are accepted when all are whole: MATLAB and some SMPL files store integers so.
    ///
    /// **Shapes** all values in C order.
    pub fn to_i64(&self, name: &str) -> Result<Vec<i64>, FormatError> {
        let whole = |x: f64| (x.fract() == 0.0 && x.abs() < 9.0e15).then_some(x as i64);
        let from_floats = |values: Option<Vec<i64>>| values.ok_or_else(|| self.wrong_type(name, "whole numbers"));
        match &self.data {
            NpyData::I32(v) => Ok(v.iter().map(|&x| i64::from(x)).collect()),
            NpyData::U32(v) => Ok(v.iter().map(|&x| i64::from(x)).collect()),
            NpyData::I64(v) => Ok(v.clone()),
            NpyData::F32(v) => from_floats(v.iter().map(|&x| whole(f64::from(x))).collect()),
            NpyData::F64(v) => from_floats(v.iter().map(|&x| whole(x)).collect()),
            NpyData::Text(_) | NpyData::Opaque { .. } => Err(self.wrong_type(name, "whole numbers")),
        }
    }

    /// The integers as `u32`.
    ///
    /// **Shapes** all values in C order.
    ///
    /// **Errors** also when one is negative or too large; the message names the first.
    pub fn to_u32(&self, name: &str) -> Result<Vec<u32>, FormatError> {
        let narrow = |(index, x): (usize, i64)| {
            u32::try_from(x).map_err(|_| FormatError::Element {
                format: Format::Npz,
                element: format!("array '{name}', value"),
                index,
                expected: "a number from 0 to 4294967295".into(),
                found: x.to_string(),
            })
        };
        self.to_i64(name)?.into_iter().enumerate().map(narrow).collect()
    }

    /// The strings.
    pub fn to_text(&self, name: &str) -> Result<Vec<String>, FormatError> {
        match &self.data {
            NpyData::Text(v) => Ok(v.clone()),
            _ => Err(self.wrong_type(name, "strings")),
        }
    }
}

/// The arrays of an `.npz`, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Npz {
    arrays: BTreeMap<String, NpyArray>,
}

impl Npz {
    /// No array.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds or replaces an array.
    pub fn insert(&mut self, name: &str, array: NpyArray) {
        self.arrays.insert(name.to_string(), array);
    }

    /// The names, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.arrays.keys().map(String::as_str)
    }

    /// Whether the array exists, readable or not.
    pub fn contains(&self, name: &str) -> bool {
        self.arrays.contains_key(name)
    }

    /// An array.
    ///
    /// **Errors** [`FormatError::NoArray`], with the names of the arrays that exist.
    pub fn get(&self, name: &str) -> Result<&NpyArray, FormatError> {
        self.arrays.get(name).ok_or_else(|| FormatError::NoArray {
            format: Format::Npz,
            name: name.into(),
            present: self.arrays.keys().cloned().collect(),
        })
    }

    /// Extents of an array.
    pub fn shape(&self, name: &str) -> Result<&[usize], FormatError> {
        self.get(name).map(NpyArray::shape)
    }

    /// Extents of an array that must have `N` of them.
    pub fn shape_of<const N: usize>(&self, name: &str) -> Result<[usize; N], FormatError> {
        let shape = self.shape(name)?;
        shape.try_into().map_err(|_| FormatError::ArrayShape {
            name: name.into(),
            expected: format!("{N} dimensions"),
            found: shape.to_vec(),
        })
    }

    /// The numbers of an array.
    ///
    /// **Shapes** all values in C order.
    pub fn f64(&self, name: &str) -> Result<Vec<f64>, FormatError> {
        self.get(name)?.to_f64(name)
    }

    /// The numbers of an array as rows of `N`.
    ///
    /// **Shapes** `R × N`.
    pub fn f64_rows<const N: usize>(&self, name: &str) -> Result<Vec<[f64; N]>, FormatError> {
        self.check_columns::<N>(name)?;
        Ok(self.f64(name)?.as_chunks::<N>().0.to_vec())
    }

    /// The integers of an array.
    ///
    /// **Shapes** all values in C order.
    pub fn i64(&self, name: &str) -> Result<Vec<i64>, FormatError> {
        self.get(name)?.to_i64(name)
    }

    /// The integers of an array, none negative.
    ///
    /// **Shapes** all values in C order.
    pub fn u32(&self, name: &str) -> Result<Vec<u32>, FormatError> {
        self.get(name)?.to_u32(name)
    }

    /// The integers of an array as rows of `N`, none negative.
    ///
    /// **Shapes** `R × N`.
    pub fn u32_rows<const N: usize>(&self, name: &str) -> Result<Vec<[u32; N]>, FormatError> {
        self.check_columns::<N>(name)?;
        Ok(self.u32(name)?.as_chunks::<N>().0.to_vec())
    }

    /// The strings of an array.
    pub fn text(&self, name: &str) -> Result<Vec<String>, FormatError> {
        self.get(name)?.to_text(name)
    }

    fn check_columns<const N: usize>(&self, name: &str) -> Result<(), FormatError> {
        match self.shape(name)? {
            [_, columns] if *columns == N => Ok(()),
            found => Err(FormatError::ArrayShape {
                name: name.into(),
                expected: format!("(any, {N})"),
                found: found.to_vec(),
            }),
        }
    }
}
