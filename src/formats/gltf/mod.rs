//! glTF 2.0: reads `.gltf` and `.glb`, writes `.glb`.

mod accessor;
mod animation;
#[cfg(test)]
mod base64_for_tests;
#[cfg(test)]
mod extension_tests;
mod extensions;
mod materials;
mod morphs;
#[cfg(test)]
mod motion_tests;
mod read;
mod read_motion;
mod samplers;
mod siblings;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod texture_tests;
mod textured_glb;
mod write;

pub use animation::GlbChannel;
pub use morphs::GlbMorph;
pub use read::read_gltf;
pub(super) use read::read_gltf_with;
pub use read_motion::read_gltf_motion;
pub(super) use siblings::gltf_siblings;
pub use textured_glb::write_textured_glb;
pub use write::{
    AccessorId, GlbAttribute, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, GltfFiles, MaterialId, MeshId,
    NodeId, SkinId, TextureId,
};
