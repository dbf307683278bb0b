//! The files of frozen hashes: reading, comparing, rewriting.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// One result: its name, its hash, and for a stage the hash of what went in, the version of its code included.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub name: String,
    pub hash: String,
    pub inputs: Option<String>,
}

impl Entry {
    pub fn file(name: String, hash: &blake3::Hash) -> Self {
        Self { name, hash: hash.to_hex()[..16].into(), inputs: None }
    }
}

pub fn hash_of(file: &Path) -> blake3::Hash {
    blake3::hash(&std::fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display())))
}

/// Hashes with the platform on which they were computed.
#[derive(Debug, PartialEq)]
struct Record {
    platform: String,
    entries: Vec<Entry>,
}

const PLATFORM: &str = "# computed on: ";
const HEADER: &str =
    "# name, hash of the result, and for a stage the hash of its inputs and version; see tests/frozen.rs\n";

impl Record {
    fn parse(text: &str) -> Self {
        let platform = text.lines().find_map(|line| line.strip_prefix(PLATFORM)).unwrap_or_default().to_string();
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        let entries = lines.map(|line| {
            let mut words = line.split(' ');
            let mut next = || words.next().map(String::from);
            Entry { name: next().unwrap_or_default(), hash: next().unwrap_or_default(), inputs: next() }
        });
        Self { platform, entries: entries.collect() }
    }

    fn to_text(&self) -> String {
        let mut text = format!("{HEADER}{PLATFORM}{}\n", self.platform);
        for Entry { name, hash, inputs } in &self.entries {
            let inputs = inputs.as_ref().map(|inputs| format!(" {inputs}")).unwrap_or_default();
            writeln!(text, "{name} {hash}{inputs}").unwrap();
        }
        text
    }
}

/// What changed, one line per result.
#[derive(Debug, Default, PartialEq)]
struct Differences {
    lines: Vec<String>,
    /// Stages whose output changed although their inputs and version did not.
    same_version: Vec<String>,
}

fn differences(old: &[Entry], new: &[Entry]) -> Differences {
    let by_name = |list: &[Entry]| -> BTreeMap<String, Entry> {
        list.iter().map(|entry| (entry.name.clone(), entry.clone())).collect()
    };
    let (old, new) = (by_name(old), by_name(new));
    let mut found = Differences::default();
    for (name, was) in &old {
        match new.get(name) {
            None => found.lines.push(format!("{name}: no longer made")),
            Some(is) if is.hash != was.hash => {
                found.lines.push(format!("{name}: {} -> {}", was.hash, is.hash));
                if was.inputs.is_some() && was.inputs == is.inputs {
                    found.same_version.push(name.clone());
                }
            }
            Some(_) => {}
        }
    }
    found.lines.extend(new.keys().filter(|name| !old.contains_key(*name)).map(|name| format!("{name}: new")));
    found
}

/// The instruction sets that kernels are chosen by, and a hash of what the C library's functions give.
fn platform() -> String {
    let mut text = format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS);
    #[cfg(target_arch = "x86_64")]
    for (name, has) in [
        ("avx2", std::arch::is_x86_feature_detected!("avx2")),
        ("fma", std::arch::is_x86_feature_detected!("fma")),
        ("avx512f", std::arch::is_x86_feature_detected!("avx512f")),
    ] {
        if has {
            write!(text, " {name}").unwrap();
        }
    }
    let mut hasher = blake3::Hasher::new();
    for k in 1..2000 {
        let x = f64::from(k) * 0.003_7;
        for y in [x.sin(), x.cos(), x.tan(), x.exp(), x.ln(), x.powf(1.3), x.atan2(0.7), (x / 8.0).acos(), x.cbrt()] {
            hasher.update(&y.to_bits().to_le_bytes());
        }
    }
    format!("{text} libm-{}", &hasher.finalize().to_hex()[..8])
}

/// Prints past the test harness, which shows the output of passed tests to nobody.
fn notice(text: &str) {
    std::io::stderr().write_all(format!("{text}\n").as_bytes()).unwrap();
}

/// Compares with `frozen/{case}.txt`; with `OVERCOAT_FREEZE` set, rewrites that file instead.
pub fn must_match(case: &str, entries: &[Entry]) {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests/frozen", &format!("{case}.txt")].iter().collect();
    let found = Record { platform: platform(), entries: entries.to_vec() };
    let known = std::fs::read_to_string(&path).ok().map(|text| Record::parse(&text));
    let comparable = known.as_ref().filter(|known| known.platform == found.platform);
    let changed = comparable.map(|known| differences(&known.entries, &found.entries)).unwrap_or_default();
    assert!(
        changed.same_version.is_empty(),
        "{case}: the output changed, but neither inputs nor version did: increase the version of {}\n{}",
        changed.same_version.join(", "),
        changed.lines.join("\n")
    );
    if std::env::var_os("OVERCOAT_FREEZE").is_some() {
        std::fs::write(&path, found.to_text()).unwrap();
        notice(&format!("froze {case}: {} results", found.entries.len()));
        return;
    }
    let Some(known) = &known else { panic!("{} is missing: run `just freeze`", path.display()) };
    if comparable.is_none() {
        notice(&format!(
            "frozen::{case} is not compared: frozen on '{}', this is '{}'",
            known.platform, found.platform
        ));
        return;
    }
    assert!(
        changed.lines.is_empty(),
        "{case}: results changed; if that is intended, run `just freeze` and say why in the commit:\n{}",
        changed.lines.join("\n")
    );
}

#[test]
fn a_record_is_read_as_it_was_written() {
    let entry = |name: &str, inputs: Option<&str>| Entry {
        name: name.into(),
        hash: "0123456789abcdef".into(),
        inputs: inputs.map(String::from),
    };
    let entries = vec![entry("body/fit", Some("fedcba9876543210")), entry("layers/body.ply", None)];
    let record = Record { platform: platform(), entries };
    assert_eq!(Record::parse(&record.to_text()), record);
}

#[test]
fn each_kind_of_difference_is_found() {
    let entry = |name: &str, hash: &str, inputs: &str| Entry {
        name: name.into(),
        hash: hash.into(),
        inputs: (!inputs.is_empty()).then(|| inputs.into()),
    };
    let old = [entry("a/fit", "1", "x"), entry("a/cut", "1", "x"), entry("a.glb", "1", ""), entry("gone", "1", "")];
    let new = [entry("a/fit", "2", "x"), entry("a/cut", "2", "y"), entry("a.glb", "2", ""), entry("added", "1", "")];
    let found = differences(&old, &new);
    let lines = ["a.glb: 1 -> 2", "a/cut: 1 -> 2", "a/fit: 1 -> 2", "gone: no longer made", "added: new"];
    assert_eq!(found.lines, lines);
    assert_eq!(found.same_version, ["a/fit"]);
    assert_eq!(differences(&old, &old), Differences::default());
}
