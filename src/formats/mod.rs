//! Converts bytes to plain arrays and back. Contains no person or garment code, opens no path, and assumes no frame or
//! unit; the caller supplies them.

mod bundle;
#[cfg(test)]
mod damage_tests;
mod error;
mod gif;
mod gltf;
mod motion;
mod npz;
#[cfg(test)]
mod other_programs_tests;
mod pc2;
mod picture;
mod plain_text;
mod ply;
mod raw_mesh;
mod read_mesh;
mod recording;
mod rgba_png;
mod srgb;
mod text;
mod texture;
mod usd;

pub use self::gltf::{
    AccessorId, GlbAttribute, GlbChannel, GlbMaterial, GlbMesh, GlbMorph, GlbNode, GlbScene, GlbWriter, GltfFiles,
    MaterialId, MeshId, NodeId, SkinId, TextureId, read_gltf, read_gltf_motion, write_textured_glb,
};
pub use bundle::{MeshBundle, write_mesh_bundle};
pub use error::{Format, FormatError};
pub use gif::write_gif;
pub use motion::{PoseLineWriter, RawJoint, RawMotion, RawTransform, SmplMotion, read_bvh, read_pose_lines, write_bvh};
pub use npz::{NpyArray, NpyData, Npz, NpzCompression, read_npy, read_npz, write_npy, write_npz};
pub use pc2::write_pc2;
pub use picture::{
    ColorPicture, DepthPicture, read_color_picture, read_depth_png, read_texture_picture, write_color_jpeg,
    write_color_png, write_depth_png, write_gray_png,
};
pub use plain_text::plain_text;
pub use ply::{PlyEncoding, PlyOptions, read_ply, write_ply};
pub use raw_mesh::RawMesh;
pub use read_mesh::{MeshKind, mesh_siblings, read_mesh, read_mesh_with};
pub use recording::{
    CameraJson, EncodedRecording, Intrinsics, RecordedFrame, is_zip, read_camera_json, read_photo_camera_json,
    read_recording, recording_files, write_recording,
};
pub use rgba_png::{RgbaPicture, read_rgba_png};
pub use srgb::{byte_of_linear, linear_of_byte, linear_of_srgb};
pub use text::{read_obj, read_off, read_stl, write_obj, write_textured_obj};
pub use texture::{EncodedPicture, RawMaterial, RawTexture, Siblings, UnreadPart, Wrap};
pub use usd::{UsdInterpolation, UsdLayer, UsdPrim, UsdValue, usd_names, write_usd_package};
