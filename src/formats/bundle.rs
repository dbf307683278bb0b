//! A mesh and the files beside it that it names, in one zip: a `.zip` of an OBJ with its pictures, for example.

use super::error::{Format, FormatError};
use super::raw_mesh::RawMesh;
use super::read_mesh::{MeshKind, read_mesh_with};
use std::io::{Read, Seek, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// A zip entry of this many bytes needs the format's large numbers.
const LARGE: u64 = u32::MAX as u64;

/// Packs a mesh and the files beside it into one zip, uncompressed: each a name, a length and the content. The mesh comes
/// first. Nothing is held in memory.
///
/// **Guarantees** equal files give equal bytes.
pub fn write_mesh_bundle<R: Read>(
    files: impl IntoIterator<Item = std::io::Result<(String, u64, R)>>,
    out: impl Write,
) -> std::io::Result<()> {
    let mut zip = ZipWriter::new_stream(out);
    for file in files {
        let (name, length, mut content) = file?;
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(length >= LARGE);
        zip.start_file(name, options)?;
        std::io::copy(&mut content, &mut zip)?;
    }
    zip.finish()?.flush()
}

/// An open zip of a mesh and the files that it names.
pub struct MeshBundle<R> {
    zip: ZipArchive<R>,
    kind: MeshKind,
    mesh: String,
    /// The folder of the mesh in the zip, with its final `/`, or nothing.
    folder: String,
}

impl<R: Read + Seek + Clone> MeshBundle<R> {
    /// Opens a zip; `None` if it contains no mesh, or `camera.json` as RGB-D frames do.
    ///
    /// **Errors** if it is no zip, is damaged, or contains several meshes.
    pub fn open(input: R) -> Result<Option<Self>, FormatError> {
        let zip = ZipArchive::new(input).map_err(damaged)?;
        let is_camera = |name: &str| name == "camera.json" || name.ends_with("/camera.json");
        if zip.file_names().any(is_camera) {
            return Ok(None);
        }
        // Programs of one maker add files that begin with a dot, or lie in such a folder.
        let is_hidden = |name: &str| name.split('/').any(|part| part.starts_with('.') || part == "__MACOSX");
        let kind_of = |name: &str| MeshKind::from_extension(name.rsplit_once('.')?.1).ok();
        let meshes: Vec<(String, MeshKind)> = (zip.file_names().filter(|name| !is_hidden(name)))
            .filter_map(|name| Some((name.to_string(), kind_of(name)?)))
            .collect();
        match meshes.as_slice() {
            [] => Ok(None),
            [(mesh, kind)] => {
                let folder = mesh.rfind('/').map_or("", |at| &mesh[..=at]).to_string();
                Ok(Some(Self { zip, kind: *kind, mesh: mesh.clone(), folder }))
            }
            [(one, _), (other, _), ..] => {
                let reason = format!("it contains several meshes, '{one}' and '{other}'");
                Err(FormatError::Container { format: Format::Zip, reason })
            }
        }
    }

    /// Reads the mesh with its materials and pictures.
    ///
    /// **Requires** copies of the input may share one place of reading, as `&File` does: the mesh is read to its end before
    /// a file beside it is.
    pub fn read(mut self) -> Result<RawMesh, FormatError> {
        let mut zip = self.zip.clone();
        let mesh = self.zip.by_name(&self.mesh).map_err(damaged)?;
        read_mesh_with(self.kind, mesh, &mut |name| {
            let mut bytes = Vec::new();
            zip.by_name(&format!("{}{name}", self.folder)).ok()?.read_to_end(&mut bytes).ok()?;
            Some(bytes)
        })
    }
}

fn damaged(error: zip::result::ZipError) -> FormatError {
    FormatError::Container { format: Format::Zip, reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    const OBJ: &str = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";

    fn packed(files: &[(&str, &str)]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let files = files.iter().map(|(name, text)| Ok((name.to_string(), text.len() as u64, text.as_bytes())));
        write_mesh_bundle(files, &mut bytes).unwrap();
        bytes
    }

    fn open(bytes: &[u8]) -> Result<Option<MeshBundle<Cursor<&[u8]>>>, FormatError> {
        MeshBundle::open(Cursor::new(bytes))
    }

    #[test]
    fn a_mesh_finds_its_files_in_the_zip_again() {
        for folder in ["", "scan/"] {
            let at = |name: &str| format!("{folder}{name}");
            let files = [
                (at("my.obj"), OBJ),
                (at("a.mtl"), "newmtl a\nmap_Kd tex/a.png\n"),
                (at("tex/a.png"), "picture"),
                (at("notes.txt"), ""),
                (at("._my.obj"), "not a mesh"),
            ];
            let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), *text)).collect();
            let bytes = packed(&files);
            assert_eq!(bytes, packed(&files));
            let mesh = open(&bytes).unwrap().unwrap().read().unwrap();
            assert_eq!(mesh.texture.unwrap().pictures[0].bytes, b"picture");
        }
    }

    #[test]
    fn other_zips_are_told_apart() {
        assert!(open(&packed(&[("camera.json", "{}"), ("a.obj", OBJ)])).unwrap().is_none());
        assert!(open(&packed(&[("notes.txt", "")])).unwrap().is_none());
        let two = open(&packed(&[("a.obj", OBJ), ("b.ply", "")])).err().unwrap().to_string();
        assert_eq!(two, "the zip container is damaged: it contains several meshes, 'a.obj' and 'b.ply'");
        let whole = packed(&[("a.obj", OBJ)]);
        assert!(open(&whole[..whole.len() / 2]).is_err());
    }
}
