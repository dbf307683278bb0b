//! One entry point for all mesh readers.

use super::error::FormatError;
use super::gltf::read_gltf;
use super::ply::read_ply;
use super::raw_mesh::RawMesh;
use super::text::{read_obj, read_off, read_stl};
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

/// Reads a mesh in a given format.
pub fn read_mesh(kind: MeshKind, input: impl Read) -> Result<RawMesh, FormatError> {
    match kind {
        MeshKind::Ply => read_ply(input),
        MeshKind::Obj => read_obj(input),
        MeshKind::Stl => read_stl(input),
        MeshKind::Off => read_off(input),
        MeshKind::Gltf => read_gltf(input),
    }
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
