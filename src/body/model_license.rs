//! What the licence of a body model says of files that are made with it.

use super::BodyError;
use crate::formats::{NpyArray, Npz, read_npz};
use std::io::{Read, Seek};

/// The licence of a body model, as its file states it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelLicense {
    /// Its name or text.
    pub name: Option<String>,
    /// Extensions of files that must not be exported with it, or [`ModelLicense::ALL`].
    pub forbids: Vec<String>,
}

impl ModelLicense {
    /// Forbids every export.
    pub const ALL: &str = "all";

    /// That of the embedded model, which this program made.
    pub fn of_embedded_model() -> Self {
        Self { name: Some("MIT OR Apache-2.0".into()), forbids: Vec::new() }
    }

    /// That of a model's file.
    ///
    /// **Shapes** `license (1)` and `license_forbids (N)`, both text and optional.
    pub fn read(input: impl Read + Seek) -> Result<Self, BodyError> {
        let npz = read_npz(input)?;
        let texts = |name: &str| -> Result<Vec<String>, BodyError> {
            Ok(if npz.contains(name) { npz.text(name)? } else { Vec::new() })
        };
        Ok(Self { name: texts("license")?.into_iter().next(), forbids: texts("license_forbids")? })
    }

    /// Adds it to a model's arrays.
    pub fn insert(&self, npz: &mut Npz) {
        if let Some(name) = &self.name {
            npz.insert("license", NpyArray::vector(vec![name.clone()]));
        }
        if !self.forbids.is_empty() {
            npz.insert("license_forbids", NpyArray::vector(self.forbids.clone()));
        }
    }

    /// Whether files with that extension may be exported.
    pub fn allows(&self, extension: &str) -> bool {
        !self.forbids.iter().any(|f| f == Self::ALL || f.trim_start_matches('.').eq_ignore_ascii_case(extension))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{NpzCompression, write_npz};
    use std::io::Cursor;

    #[test]
    fn what_is_stated_is_read_again_and_nothing_is_forbidden_by_silence() {
        let stated = ModelLicense { name: Some("für Forschung".into()), forbids: vec![".vrm".into(), "glb".into()] };
        for license in [stated.clone(), ModelLicense::default()] {
            let mut npz = Npz::new();
            npz.insert("f", NpyArray::vector(vec![1.0_f32]));
            license.insert(&mut npz);
            let mut file = Cursor::new(Vec::new());
            write_npz(&npz, NpzCompression::Deflated, &mut file).unwrap();
            assert_eq!(ModelLicense::read(Cursor::new(file.into_inner())).unwrap(), license);
        }
        assert!(!stated.allows("vrm") && !stated.allows("GLB") && stated.allows("obj"));
        assert!(ModelLicense::default().allows("vrm"));
        assert!(!ModelLicense { name: None, forbids: vec!["all".into()] }.allows("obj"));
    }
}
