//! The materials that an OBJ names, found in the files beside it.

use super::lines::LineStream;
use super::mtl::{MtlMaterial, read_mtl};
use crate::formats::error::{Format, FormatError};
use crate::formats::texture::{EncodedPicture, Fetched, RawMaterial, Siblings, UnreadPart, Wrap};
use std::collections::HashMap;
use std::io::Read;

/// The names in an OBJ.
#[derive(Default)]
pub(super) struct NamedMaterials {
    /// The rest of each `mtllib` line: one file, or several separated by spaces.
    pub libraries: Vec<String>,
    /// The materials of faces, in the order of their first use.
    pub used: Vec<String>,
    places: HashMap<String, u16>,
}

/// The materials of an OBJ that were found.
#[derive(Default)]
pub(super) struct FoundMaterials {
    /// In the order of [`NamedMaterials::used`]; white where a material was not found. Without `usemtl`, the only material of
    /// the file.
    pub materials: Vec<RawMaterial>,
    pub pictures: Vec<EncodedPicture>,
    pub unread: Vec<UnreadPart>,
    /// The names of all files that were found.
    pub files: Vec<String>,
    /// The places of pictures by the folder and the name that a material gives.
    seen: HashMap<(String, String), usize>,
}

impl NamedMaterials {
    /// Follows a line that is not about numbers; the material that faces have from then on, where it says so.
    pub fn follow(&mut self, line: &[u8]) -> Option<u16> {
        let rest = |word: &str| -> Option<String> {
            let rest = line.strip_prefix(word.as_bytes())?;
            rest.first().is_some_and(u8::is_ascii_whitespace).then(|| String::from_utf8_lossy(rest.trim_ascii()).into())
        };
        if let Some(library) = rest("mtllib") {
            if !self.libraries.contains(&library) {
                self.libraries.push(library);
            }
            return None;
        }
        let name = rest("usemtl")?;
        if let Some(&place) = self.places.get(&name) {
            return Some(place);
        }
        // More materials than numbers for them: the surplus ones have no colour.
        let place = u16::try_from(self.used.len()).unwrap_or(u16::MAX);
        self.places.insert(name.clone(), place);
        self.used.push(name);
        Some(place)
    }

    /// Looks for the materials beside the OBJ.
    pub fn find(&self, siblings: &mut Siblings) -> FoundMaterials {
        let mut found = FoundMaterials::default();
        let mut known: Vec<(MtlMaterial, String)> = Vec::new();
        for library in &self.libraries {
            let mut files: Vec<Fetched> = Fetched::find(library, "", siblings).into_iter().collect();
            if files.is_empty() {
                files = library.split_ascii_whitespace().filter_map(|name| Fetched::find(name, "", siblings)).collect();
            }
            if files.is_empty() {
                found.unread.push(UnreadPart {
                    what: format!("the material file '{library}' is not beside the scan"),
                    remedy: "put it there and scan again, or the scan has no colours".into(),
                });
            }
            for file in files {
                known.extend(read_mtl(&file.bytes).into_iter().map(|m| (m, file.folder().to_string())));
                found.files.push(file.name);
            }
        }
        let some_known = !known.is_empty();
        let only =
            self.used.is_empty().then(|| known.iter().map(|(m, _)| m.name.clone()).take(1)).into_iter().flatten();
        let used: Vec<String> = self.used.iter().cloned().chain(only.filter(|_| known.len() == 1)).collect();
        for name in used {
            let material = match known.iter().find(|(material, _)| material.name == name) {
                Some((material, folder)) => found.material(material, folder, siblings),
                None if some_known => {
                    found.unread.push(UnreadPart {
                        what: format!("the material '{name}' is not in '{}'", self.libraries.join("', '")),
                        remedy: "export the scan again together with its materials".into(),
                    });
                    RawMaterial::default()
                }
                None => RawMaterial::default(),
            };
            found.materials.push(RawMaterial { name, ..material });
        }
        found
    }
}

impl FoundMaterials {
    fn material(&mut self, material: &MtlMaterial, folder: &str, siblings: &mut Siblings) -> RawMaterial {
        let plain = RawMaterial { color: material.color.unwrap_or([1.0; 3]), ..RawMaterial::default() };
        let Some(picture) = &material.picture else {
            if let Some(line) = &material.other {
                let what =
                    format!("of the material '{}', only a picture that is no colour is named: '{line}'", material.name);
                let remedy = "name the picture of its colour with map_Kd".into();
                self.unread.push(UnreadPart { what, remedy });
            }
            return plain;
        };
        let key = (folder.to_string(), picture.file.clone());
        let at = self.seen.get(&key).copied().or_else(|| {
            let Fetched { name, bytes } = Fetched::find(&picture.file, folder, siblings)?;
            self.files.push(name.clone());
            self.pictures.push(EncodedPicture { name, bytes });
            let at = self.pictures.len() - 1;
            self.seen.insert(key, at);
            Some(at)
        });
        if at.is_none() {
            self.unread.push(UnreadPart::missing_picture(&picture.file, &material.name));
            return plain;
        }
        let wrap = if picture.clamp { Wrap::Clamp } else { Wrap::Repeat };
        // Programs write any `Kd` beside a picture, even black, and show the picture unchanged.
        RawMaterial { picture: at, scale: picture.scale, offset: picture.offset, wrap: [wrap; 2], ..Default::default() }
    }

    /// Whether the materials tell faces apart, or show pictures.
    pub fn have_colors(&self) -> bool {
        !self.pictures.is_empty() || self.materials.windows(2).any(|pair| pair[0].color != pair[1].color)
    }
}

/// The files that an OBJ names and that exist: materials and their pictures, relative to its folder.
pub(in crate::formats) fn obj_siblings(input: impl Read, siblings: &mut Siblings) -> Result<Vec<String>, FormatError> {
    let mut named = NamedMaterials::default();
    let mut lines = LineStream::new(input);
    while let Some((_, line)) = lines.next(Format::Obj)? {
        if matches!(line.first(), Some(b'm' | b'u')) {
            named.follow(line);
        }
    }
    Ok(if named.libraries.is_empty() { Vec::new() } else { named.find(siblings).files })
}
