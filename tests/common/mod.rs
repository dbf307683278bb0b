//! Running the built program, and scans small enough to run it on.
#![allow(dead_code, reason = "each test binary uses its own part")]

use overcoat::body::embedded_model;
use overcoat::formats::{PlyOptions, RawMesh, write_ply};
use overcoat::geometry::Point;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the program answered.
#[derive(Debug)]
pub struct Answer {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Answer {
    /// The one JSON object that stdout must be.
    pub fn json(&self) -> serde_json::Value {
        let mut lines = self.stdout.lines();
        let object = serde_json::from_str(lines.next().unwrap_or_default())
            .unwrap_or_else(|e| panic!("no JSON ({e}) on stdout: {self:?}"));
        assert_eq!(lines.next(), None, "one object, nothing else");
        object
    }
}

/// Runs the program in `dir`.
pub fn overcoat(dir: &Path, args: &[&str]) -> Answer {
    let output = Command::new(env!("CARGO_BIN_EXE_overcoat")).args(args).current_dir(dir).output().unwrap();
    Answer {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// Runs the program and insists that it succeeds.
pub fn overcoat_ok(dir: &Path, args: &[&str]) -> Answer {
    let answer = overcoat(dir, args);
    assert_eq!(answer.code, 0, "{args:?}: {answer:?}");
    answer
}

/// The mean body as a file's mesh: metres, Y up, feet on the floor, every point mapped.
pub fn mean_body(map: impl Fn(Point) -> Point) -> RawMesh {
    let template = embedded_model().unwrap().template;
    let floor = template.bounds().unwrap().min.y;
    RawMesh {
        points: template.points().iter().map(|p| map(Point::new(p.x, p.y - floor, p.z)).coords.into()).collect(),
        faces: template.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        ..RawMesh::default()
    }
}

/// Writes a mesh as PLY, and gives its path.
pub fn write_mesh(path: PathBuf, mesh: &RawMesh) -> PathBuf {
    write_ply(mesh, &PlyOptions::default(), std::fs::File::create(&path).unwrap()).unwrap();
    path
}

/// The hash of every file below `dir`, by relative path.
pub fn fingerprint(dir: &Path) -> BTreeMap<PathBuf, blake3::Hash> {
    fn walk(dir: &Path, root: &Path, found: &mut BTreeMap<PathBuf, blake3::Hash>) {
        for entry in std::fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, found);
            } else {
                found.insert(path.strip_prefix(root).unwrap().into(), blake3::hash(&std::fs::read(&path).unwrap()));
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(dir, dir, &mut found);
    found
}

/// A session in `dir/session` with the mean body scanned, and a shirt that is the same scan.
pub fn session_with_two_scans(dir: &Path) -> PathBuf {
    let session = dir.join("session");
    let scan = write_mesh(dir.join("body.ply"), &mean_body(|p| p));
    let scan = scan.to_str().unwrap();
    overcoat_ok(dir, &["new", "session"]);
    overcoat_ok(&session, &["scan", "body", scan]);
    overcoat_ok(&session, &["scan", "shirt", scan, "--template", "tshirt"]);
    session
}
