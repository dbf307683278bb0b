//! Mesh formats in lines of text: OBJ, OFF, and STL, which may also be binary.

mod lines;
mod obj;
mod off;
mod stl;

pub use obj::{read_obj, write_obj};
pub use off::read_off;
pub use stl::read_stl;
