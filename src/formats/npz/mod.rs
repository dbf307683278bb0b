//! NumPy's `.npy` and `.npz`.

mod arrays;
mod io;

pub use arrays::{NpyArray, NpyData, Npz};
pub use io::{NpzCompression, read_npy, read_npz, write_npy, write_npz};
