//! glTF 2.0: reads `.gltf` and `.glb`, writes `.glb`.

mod accessor;
mod animation;
#[cfg(test)]
mod motion_tests;
mod read;
mod read_motion;
mod samplers;
mod srgb;
#[cfg(test)]
mod tests;
mod write;

pub use animation::GlbChannel;
pub use read::read_gltf;
pub use read_motion::read_gltf_motion;
pub use write::{
    AccessorId, GlbAttribute, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, MaterialId, MeshId, NodeId, SkinId,
    TextureId,
};
