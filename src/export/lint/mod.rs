//! Checks a file as importers read it, before it is written: what they refuse, or take without a word for something else.

use super::axes::FileAxes;

mod gltf_file;
mod maps;
mod size;
mod springs;
#[cfg(test)]
mod tests;
mod usd_scene;

pub(super) use gltf_file::{lint_glb, lint_gltf};
pub(super) use size::size;
pub(super) use usd_scene::lint_usd;

/// What [`size`] checks.
const SIZE: &str = "size: metres, +Y up, facing +Z, soles on the floor";

/// What [`size`] checks in a file with the axes of another program.
pub(super) fn size_in(axes: FileAxes) -> &'static str {
    if axes == FileAxes::default() {
        SIZE
    } else {
        "size: a person in the unit and the up axis of the file, soles on the floor"
    }
}

/// Names that are missing, or equal but for case.
pub(super) fn names<'a>(kind: &str, names: impl IntoIterator<Item = Option<&'a str>>) -> Vec<String> {
    let mut taken = std::collections::BTreeSet::new();
    let mut faults = Vec::new();
    for (index, name) in names.into_iter().enumerate() {
        match name.map(str::trim) {
            None | Some("") => faults.push(format!("{kind} {index} has no name")),
            Some(name) if !taken.insert(name.to_lowercase()) => {
                faults.push(format!("two names of kind {kind} are equal but for case: '{name}'"));
            }
            Some(_) => {}
        }
    }
    faults
}

/// The first place where something is wrong, and how often it is.
fn first_of(what: &str, places: impl IntoIterator<Item = usize>) -> Option<String> {
    let mut places = places.into_iter();
    let first = places.next()?;
    let others = places.count();
    Some(match others {
        0 => format!("{what}: vertex {first}"),
        _ => format!("{what}: vertex {first} and {others} more"),
    })
}
