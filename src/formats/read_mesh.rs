//! One entry point for all mesh readers.

use super::error::FormatError;
use super::gltf::{gltf_siblings, read_gltf_with};
use super::ply::{ply_siblings, read_ply_with};
use super::raw_mesh::RawMesh;
use super::text::{obj_siblings, read_obj_with, read_off, read_stl};
use super::texture::{Siblings, no_siblings};
use std::io::Read;

/// The mesh formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MeshKind {
    /// Stanford polygon file.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Stereolithography.
    Stl,
    /// Geomview's object file format.
    Off,
    /// glTF, `.glb` or `.gltf`.
    Gltf,
}

impl MeshKind {
    /// The format of an extension, given without its dot and in any case.
    ///
    /// **Errors** [`FormatError::UnknownExtension`].
    pub fn from_extension(extension: &str) -> Result<Self, FormatError> {
        match extension.to_ascii_lowercase().as_str() {
            "ply" => Ok(Self::Ply),
            "obj" => Ok(Self::Obj),
            "stl" => Ok(Self::Stl),
            "off" => Ok(Self::Off),
            "glb" | "gltf" => Ok(Self::Gltf),
            _ => Err(FormatError::UnknownExtension { extension: extension.to_string() }),
        }
    }
}

/// Reads a mesh in a given format, from a file that stands alone: materials and pictures beside it are not read.
pub fn read_mesh(kind: MeshKind, input: impl Read) -> Result<RawMesh, FormatError> {
    read_mesh_with(kind, input, &mut no_siblings)
}

/// Reads a mesh in a given format, with the files beside it that it names: materials, pictures, buffers.
///
/// **Errors** also if the numbers of a mesh are in a file that is not there. A picture that is not there is a part in
/// [`RawMesh::unread`].
pub fn read_mesh_with(kind: MeshKind, input: impl Read, siblings: &mut Siblings) -> Result<RawMesh, FormatError> {
    match kind {
        MeshKind::Ply => read_ply_with(input, siblings),
        MeshKind::Obj => read_obj_with(input, siblings),
        MeshKind::Stl => read_stl(input),
        MeshKind::Off => read_off(input),
        MeshKind::Gltf => read_gltf_with(input, siblings),
    }
}

/// The names of all files that [`read_mesh_with`] would use, relative to the mesh's folder and sorted, those that do not
/// exist left out. Quick, for the mesh itself is not built.
pub fn mesh_siblings(kind: MeshKind, input: impl Read, siblings: &mut Siblings) -> Result<Vec<String>, FormatError> {
    let mut names = match kind {
        MeshKind::Obj => obj_siblings(input, siblings)?,
        MeshKind::Gltf => gltf_siblings(input, siblings)?,
        MeshKind::Ply => ply_siblings(input, siblings)?,
        MeshKind::Stl | MeshKind::Off => Vec::new(),
    };
    names.sort();
    names.dedup();
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_known_in_any_case() {
        for extension in ["ply", "obj", "glb", "gltf", "stl", "off"] {
            assert!(MeshKind::from_extension(&extension.to_uppercase()).is_ok());
        }
        let err = MeshKind::from_extension("fbx").unwrap_err();
        assert_eq!(err.hint().unwrap(), "the known extensions are ply, obj, glb, gltf, stl, off");
    }
}
