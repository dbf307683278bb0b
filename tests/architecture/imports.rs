//! Which file imports which inside a module, and the import cycles among files and folders.
//!
//! A re-export in a `mod.rs` (`pub use child::Item`) is no import: whoever names the item imports the file that defines
//! it. Test modules are left out. A cycle is searched for in every folder, among its files and sub-folders, a sub-folder
//! being one node; so two files of one folder, two folders, and a folder and its `mod.rs` must each import one way.

use super::lexer::Token;
use super::source::{SourceFile, word};
use std::collections::{BTreeMap, BTreeSet};

/// A path as the source names it, and what it is.
#[derive(Debug, PartialEq)]
struct Named {
    segments: Vec<String>,
    /// The name under which the file hands it on, if the import is `pub`.
    exported_as: Option<String>,
}

/// An import cycle among the children of one folder.
#[derive(Debug, PartialEq)]
pub struct ImportCycle {
    /// Relative to `src`.
    pub folder: String,
    /// The files and sub-folders in the cycle; `mod` is the folder's own `mod.rs`.
    pub members: Vec<String>,
    /// The imports of one file from another that hold it together, as `a -> b`.
    pub imports: Vec<String>,
}

/// The import cycles in every folder below `src`.
pub fn import_cycles(files: &[SourceFile]) -> Vec<ImportCycle> {
    let edges = file_imports(files);
    let folders: BTreeSet<&[String]> =
        edges.iter().flat_map(|(from, to)| (1..=shared(from, to)).map(|k| &from[..k])).collect();
    let mut found = Vec::new();
    for folder in folders {
        let child = |path: &[String]| path.get(folder.len()).map_or("mod", String::as_str).to_string();
        let inside: Vec<_> =
            edges.iter().filter(|(from, to)| from.starts_with(folder) && to.starts_with(folder)).collect();
        let between: BTreeSet<_> =
            inside.iter().map(|(from, to)| (child(from), child(to))).filter(|(from, to)| from != to).collect();
        for members in cycles(&between) {
            let holds = |(from, to): &&&(Vec<String>, Vec<String>)| {
                child(from) != child(to) && members.contains(&child(from)) && members.contains(&child(to))
            };
            let imports =
                inside.iter().filter(holds).map(|(from, to)| format!("{} -> {}", from.join("::"), to.join("::")));
            found.push(ImportCycle { folder: folder.join("/"), imports: imports.collect(), members });
        }
    }
    found
}

/// How many leading segments two paths share.
fn shared(a: &[String], b: &[String]) -> usize {
    a.iter().zip(b).take_while(|(a, b)| a == b).count()
}

/// The groups of nodes of which each reaches every other.
pub fn cycles(edges: &BTreeSet<(String, String)>) -> Vec<Vec<String>> {
    let reached_from = |start: &String| {
        let (mut reached, mut open) = (BTreeSet::new(), vec![start]);
        while let Some(node) = open.pop() {
            for (_, next) in edges.iter().filter(|(from, _)| from == node) {
                if reached.insert(next) {
                    open.push(next);
                }
            }
        }
        reached
    };
    let nodes: BTreeSet<&String> = edges.iter().flat_map(|(from, to)| [from, to]).collect();
    let reached: BTreeMap<_, _> = nodes.iter().map(|&node| (node, reached_from(node))).collect();
    let both_ways = |a, b| reached[a].contains(b) && reached[b].contains(a);
    let group = |a| nodes.iter().filter(|b| both_ways(a, **b)).map(|b| b.to_string()).collect::<Vec<_>>();
    let groups: BTreeSet<Vec<String>> = nodes.iter().map(|node| group(*node)).collect();
    groups.into_iter().filter(|group| group.len() > 1).collect()
}

/// The imports among the files of one top-level module, as module paths.
fn file_imports(files: &[SourceFile]) -> BTreeSet<(Vec<String>, Vec<String>)> {
    let paths: BTreeSet<Vec<String>> =
        files.iter().filter(|file| file.module().is_some()).map(SourceFile::module_path).collect();
    let mut is_test: BTreeSet<Vec<String>> = BTreeSet::new();
    for file in files.iter().filter(|file| file.module().is_some()) {
        let path = file.module_path();
        is_test.extend(file.test_modules.iter().map(|name| [path.as_slice(), std::slice::from_ref(name)].concat()));
    }
    let in_test = |path: &[String]| (1..=path.len()).any(|k| is_test.contains(&path[..k]));
    let mut named = BTreeMap::new();
    for file in files.iter().filter(|file| file.module().is_some() && !in_test(&file.module_path())) {
        let path = file.module_path();
        let children: BTreeSet<&str> = paths
            .iter()
            .filter(|p| p.len() == path.len() + 1 && p.starts_with(&path))
            .map(|p| p[path.len()].as_str())
            .collect();
        let absolute = named_paths(&file.code, &children)
            .into_iter()
            .filter_map(|n| Some(Named { segments: absolute(&path, &n.segments, &children)?, ..n }));
        named.insert(path.clone(), absolute.collect::<Vec<_>>());
    }
    let mut edges = BTreeSet::new();
    for (path, list) in &named {
        for one in list {
            let is_own_re_export = one.exported_as.is_some() && one.segments.starts_with(path);
            let target = if is_own_re_export { None } else { defining_file(&one.segments, &paths, &named, 0) };
            if let Some(target) = target.filter(|target| target != path && target[0] == path[0] && !in_test(target)) {
                edges.insert((path.clone(), target));
            }
        }
    }
    edges
}

/// The path from the crate's root; `None` for other crates and local items.
fn absolute(file: &[String], segments: &[String], children: &BTreeSet<&str>) -> Option<Vec<String>> {
    let supers = segments.iter().take_while(|s| *s == "super").count();
    match segments[0].as_str() {
        "crate" => Some(segments[1..].to_vec()),
        "self" => Some([file, &segments[1..]].concat()),
        "super" => Some([file.get(..file.len().checked_sub(supers)?)?, &segments[supers..]].concat()),
        first if children.contains(first) => Some([file, segments].concat()),
        _ => None,
    }
}

/// The file that defines what a path names: the longest prefix that is a file, and through its re-exports from there.
fn defining_file(
    segments: &[String],
    paths: &BTreeSet<Vec<String>>,
    named: &BTreeMap<Vec<String>, Vec<Named>>,
    depth: usize,
) -> Option<Vec<String>> {
    /// No item is handed on more often; a longer chain is a loop of re-exports.
    const DEEPEST: usize = 8;
    let file = (1..=segments.len()).rev().map(|k| &segments[..k]).find(|prefix| paths.contains(*prefix))?.to_vec();
    let re_export = segments.get(file.len()).and_then(|item| {
        let list = named.get(&file)?;
        list.iter().find(|n| n.exported_as.as_ref() == Some(item) && n.segments != segments)
    });
    match re_export {
        Some(re_export) if depth < DEEPEST => {
            let rest = &segments[file.len() + 1..];
            defining_file(&[re_export.segments.as_slice(), rest].concat(), paths, named, depth + 1).or(Some(file))
        }
        _ => Some(file),
    }
}

/// All paths in a file's code: its `use` trees, and the paths in expressions that begin with `crate`, `super`, `self` or
/// a child module.
fn named_paths(code: &[Token], children: &BTreeSet<&str>) -> Vec<Named> {
    let (mut found, mut at) = (Vec::new(), 0);
    while at < code.len() {
        let text = word(code, at);
        let before = if at == 0 { "" } else { word(code, at - 1) };
        let is_path = matches!(text, "crate" | "super" | "self") || children.contains(text);
        if text == "use" && word(code, at + 1) != "<" {
            let is_public = before == "pub" || before == ")";
            at = read_use_tree(code, at + 1, &mut Vec::new(), is_public, &mut found);
        } else if is_path && word(code, at + 1) == "::" && !matches!(before, "::" | "." | "in") {
            let mut segments = vec![text.to_string()];
            while word(code, at + 1) == "::" && is_word(word(code, at + 2)) {
                segments.push(word(code, at + 2).to_string());
                at += 2;
            }
            found.push(Named { segments, exported_as: None });
            at += 1;
        } else {
            at += 1;
        }
    }
    found
}

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Reads one `use` tree below `prefix`; returns the place after it.
fn read_use_tree(
    code: &[Token],
    mut at: usize,
    prefix: &mut Vec<String>,
    is_public: bool,
    found: &mut Vec<Named>,
) -> usize {
    let depth = prefix.len();
    loop {
        match word(code, at) {
            "::" => at += 1,
            "{" => {
                at += 1;
                while !matches!(word(code, at), "}" | "") {
                    at = read_use_tree(code, at, prefix, is_public, found);
                    if word(code, at) == "," {
                        at += 1;
                    }
                }
                prefix.truncate(depth);
                return at + 1;
            }
            "as" => {
                let name = is_public.then(|| word(code, at + 1).to_string());
                found.push(Named { segments: prefix.clone(), exported_as: name });
                prefix.truncate(depth);
                return at + 2;
            }
            text if is_word(text) || text == "*" => {
                if text == "self" && depth > 0 && prefix.len() == depth {
                    // `a::{self, b}` names `a`.
                } else if text != "*" {
                    prefix.push(text.to_string());
                }
                at += 1;
            }
            _ => {
                if !prefix.is_empty() {
                    let name = is_public.then(|| prefix[prefix.len() - 1].clone());
                    found.push(Named { segments: prefix.clone(), exported_as: name });
                }
                prefix.truncate(depth);
                return at;
            }
        }
    }
}

#[test]
fn use_trees_and_paths_are_read() {
    let file = SourceFile::new(
        "fit/mod.rs",
        "pub use naked::{Fit, Report as NakedReport}; use crate::{a::{self, b}, c as d}; fn f(&self) -> impl Fn() + use<> \
         { naked::fit(super::x::Y::new()); other::g(); self.naked }",
    );
    let found = named_paths(&file.code, &["naked"].into());
    let shown: Vec<String> = found
        .iter()
        .map(|n| n.segments.join("::") + &n.exported_as.as_ref().map(|e| format!(" as {e}")).unwrap_or_default())
        .collect();
    let expected = [
        "naked::Fit as Fit",
        "naked::Report as NakedReport",
        "crate::a",
        "crate::a::b",
        "crate::c",
        "naked::fit",
        "super::x::Y::new",
    ];
    assert_eq!(shown, expected);
}
