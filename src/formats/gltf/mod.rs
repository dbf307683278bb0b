//! glTF 2.0: reads `.gltf` and `.glb`, writes `.glb`.

mod accessor;
mod read;
mod srgb;
#[cfg(test)]
mod tests;
mod write;

pub use read::read_gltf;
pub use write::{
    AccessorId, GlbAttribute, GlbMaterial, GlbMesh, GlbNode, GlbScene, GlbWriter, MaterialId, MeshId, NodeId, SkinId,
    TextureId,
};
