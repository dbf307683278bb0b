//! The formats of one file that holds the figure.

mod glb;
mod obj;
mod usd;
mod usd_material;
mod vrm;

use crate::export::format::Format;
pub use glb::write_glb;
use glb::{Glb, Gltf};
use obj::Obj;
use usd::Usd;
use vrm::Vrm;

/// Every format.
pub const FORMATS: &[&dyn Format] = &[&Glb, &Gltf, &Usd::Text, &Usd::Binary, &Usd::Package, &Vrm, &Obj];

/// The format of files with that extension, in any case.
pub fn format_of(extension: &str) -> Option<&'static dyn Format> {
    FORMATS.iter().copied().find(|format| format.extension().eq_ignore_ascii_case(extension))
}

/// The extensions of all formats, as a person lists them: `.glb, .usdz or .vrm`.
pub fn extensions() -> String {
    let all: Vec<String> = FORMATS.iter().map(|format| format!(".{}", format.extension())).collect();
    match all.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => all.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_is_found_by_its_extension_and_no_two_share_one() {
        assert!(format_of("GLB").is_some() && format_of("abc").is_none());
        for format in FORMATS {
            let same = FORMATS.iter().filter(|other| other.extension() == format.extension()).count();
            assert_eq!(same, 1, "{}", format.extension());
        }
    }
}
