//! Files that a mesh file names: only those in its own folder or below it are ever asked for.

/// Returns the content of a file by its name relative to the mesh's folder, with `/` between parts; `None` if there is none.
/// The name never leaves that folder.
pub type Siblings<'a> = dyn FnMut(&str) -> Option<Vec<u8>> + 'a;

/// For files that stand alone.
pub(in crate::formats) fn no_siblings(_: &str) -> Option<Vec<u8>> {
    None
}

/// A file that another file names, and its content.
pub(in crate::formats) struct Fetched {
    /// Relative to the mesh's folder.
    pub name: String,
    pub bytes: Vec<u8>,
}

impl Fetched {
    /// The file that is called `named` by a file in the folder `beside`, which is relative to the mesh's own.
    ///
    /// A path that leaves the mesh's folder is a path of the machine on which the file was written: only its last part
    /// is looked for, beside the file that names it and beside the mesh.
    pub fn find(named: &str, beside: &str, siblings: &mut Siblings) -> Option<Self> {
        places(named, beside).into_iter().find_map(|name| siblings(&name).map(|bytes| Self { name, bytes }))
    }

    /// The folder of the file, relative to the mesh's own.
    pub fn folder(&self) -> &str {
        self.name.rsplit_once('/').map_or("", |(folder, _)| folder)
    }
}

/// Where a file may be, relative to the mesh's folder, the likeliest first.
fn places(named: &str, beside: &str) -> Vec<String> {
    let named = named.trim().trim_matches('"').replace('\\', "/");
    let is_absolute = named.starts_with('/') || named.split('/').next().is_some_and(|part| part.contains(':'));
    let last = named.rsplit('/').next().unwrap_or_default();
    let as_named = if is_absolute { None } else { inside(beside, &named) };
    let mut places: Vec<String> = Vec::new();
    for place in [as_named, inside(beside, last), inside("", last)].into_iter().flatten() {
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places
}

/// The two paths joined without `.` and `..`; `None` if that leaves the folder, or names none of its files.
fn inside(folder: &str, path: &str) -> Option<String> {
    let mut parts: Vec<&str> = Vec::new();
    for part in folder.split('/').chain(path.split('/')) {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            _ if part.contains(['\0', ':']) => return None,
            _ => parts.push(part),
        }
    }
    let names_a_file = !path.is_empty() && !path.ends_with('/') && !path.ends_with("..") && !parts.is_empty();
    names_a_file.then(|| parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_looked_for_in_the_folder_of_the_mesh_only() {
        for (named, beside, expected) in [
            ("skin.png", "", vec!["skin.png"]),
            ("./tex/my skin.png", "", vec!["tex/my skin.png", "my skin.png"]),
            ("tex\\skin.png", "mats", vec!["mats/tex/skin.png", "mats/skin.png", "skin.png"]),
            ("../skin.png", "mats", vec!["skin.png", "mats/skin.png"]),
            ("../../etc/passwd", "mats", vec!["mats/passwd", "passwd"]),
            ("/etc/passwd", "", vec!["passwd"]),
            ("C:\\Users\\Ann\\skin.png", "", vec!["skin.png"]),
            ("\"skin.png\"", "", vec!["skin.png"]),
            ("..", "", vec![]),
            ("a/..", "", vec![]),
            ("", "mats", vec![]),
            ("tex/", "", vec![]),
            ("a\0b", "", vec![]),
        ] {
            assert_eq!(places(named, beside), expected, "{named} beside {beside}");
        }
    }

    #[test]
    fn the_first_place_that_exists_is_used() {
        let mut asked = Vec::new();
        let found = Fetched::find("../tex/a.png", "mats", &mut |name| {
            asked.push(name.to_string());
            (name == "a.png").then(|| vec![7])
        });
        assert_eq!(found.map(|f| (f.name, f.bytes)), Some(("a.png".into(), vec![7])));
        assert_eq!(asked, ["tex/a.png", "mats/a.png", "a.png"]);
    }
}
