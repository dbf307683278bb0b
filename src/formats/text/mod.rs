//! Mesh formats in lines of text: OBJ, OFF, and STL, which may also be binary.

mod lines;
mod mtl;
mod obj;
mod obj_corners;
mod obj_materials;
#[cfg(test)]
mod obj_texture_tests;
mod off;
mod stl;
mod textured_obj;

pub(super) use obj::read_obj_with;
pub use obj::{read_obj, write_obj};
pub(super) use obj_materials::obj_siblings;
pub use off::read_off;
pub use stl::read_stl;
pub use textured_obj::write_textured_obj;
