//! Converts bytes to plain arrays and back. Contains no person or garment code, opens no path, and assumes no frame or
//! unit; the caller supplies them.

mod camera_json;
mod error;
mod glb;
mod gltf_accessor;
mod gltf_read;
mod npz;
mod npz_io;
mod obj;
mod off;
mod picture;
mod ply_header;
mod ply_read;
mod ply_rows;
mod ply_write;
mod raw_mesh;
mod read_mesh;
mod recording;
mod rgba_png;
mod srgb;
mod stl;
mod text_lines;

#[cfg(test)]
mod damage_tests;
#[cfg(test)]
mod gltf_tests;
#[cfg(test)]
mod ply_tests;

pub use camera_json::{CameraJson, Intrinsics, read_camera_json};
pub use error::{Format, FormatError};
pub use glb::{
    AccessorId, GlbAttribute, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, MaterialId, MeshId, NodeId, SkinId,
    TextureId,
};
pub use gltf_read::read_gltf;
pub use npz::{NpyArray, NpyData, Npz};
pub use npz_io::{NpzCompression, read_npy, read_npz, write_npy, write_npz};
pub use obj::{read_obj, write_obj};
pub use off::read_off;
pub use picture::{
    ColorPicture, DepthPicture, read_color_picture, read_depth_png, write_color_jpeg, write_color_png, write_depth_png,
    write_gray_png,
};
pub use ply_read::read_ply;
pub use ply_write::{PlyEncoding, PlyOptions, write_ply};
pub use raw_mesh::RawMesh;
pub use read_mesh::{MeshKind, read_mesh};
pub use recording::{EncodedRecording, RecordedFrame, is_zip, read_recording, recording_files, write_recording};
pub use rgba_png::{RgbaPicture, read_rgba_png};
pub use stl::read_stl;
