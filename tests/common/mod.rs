//! Running the built program, and scans small enough to run it on.

pub mod glb;
mod sessions;

pub use sessions::{
    Built, body_of_demo, built_outfit, built_quick_session, coarse_session, demo, demo_mesh, demo_scan,
    demo_tshirt_as_thin_as_a_pole, outfit_a, outfit_scanned,
};

use overcoat::body::embedded_model;
use overcoat::formats::{PlyOptions, RawMesh, write_ply};
use overcoat::geometry::Point;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The exit code and output of a command.
#[derive(Debug)]
pub struct Answer {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Answer {
    /// The JSON object on stdout, which must contain nothing else.
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

/// Runs the program, which must succeed.
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

/// Writes a mesh as PLY and returns its path.
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

/// Copies a folder with everything below it.
pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap_or_else(|e| panic!("{}: {e}", from.display())) {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy_folder(&path, &target);
        } else {
            std::fs::copy(&path, target).unwrap();
        }
    }
}

/// A session in `dir/session` with the mean body scanned, and the same scan again as a shirt.
pub fn session_with_two_scans(dir: &Path) -> PathBuf {
    let session = dir.join("session");
    let scan = write_mesh(dir.join("body.ply"), &mean_body(|p| p));
    let scan = scan.to_str().unwrap();
    overcoat_ok(dir, &["new", "session"]);
    overcoat_ok(&session, &["scan", "body", scan]);
    overcoat_ok(&session, &["scan", "shirt", scan, "--template", "tshirt"]);
    session
}

/// The first two of the demo's scans, decimated and fitted in few iterations: every stage runs, in a second or two.
pub const QUICK_RECIPE: &str = r#"version = 1

[[step]]
name = "body"
scan = "SCANS/0-body.ply"
faces = 4000

[step.fit]
samples = 300
iterations = 4

[step.register]
iterations = 1

[[step]]
name = "tshirt"
scan = "SCANS/1-tshirt.ply"
template = "tshirt"
faces = 4000

[step.pose]
samples = 300
iterations = 4
"#;

/// A second garment after those of [`QUICK_RECIPE`], so that every stage also runs over a dressed figure; and clips that move it,
/// without and with cloth.
pub const SKIRT_AND_CLIPS: &str = r#"
[[step]]
name = "skirt"
scan = "SCANS/2-skirt.ply"
template = "skirt"
faces = 4000

[step.pose]
samples = 300
iterations = 4

[[animation]]
name = "walk"
clip = "walk"

[[animation]]
name = "swing"
clip = "turn"
frames = "30..33"
mode = "coupled"

[animation.motion]
ease_secs = 0.1
"#;

/// A folder that contains only that recipe.
pub fn quick_session(dir: &Path, name: &str) -> PathBuf {
    let session = dir.join(name);
    std::fs::create_dir_all(&session).unwrap();
    std::fs::write(session.join("recipe.toml"), on_demo_scans(QUICK_RECIPE)).unwrap();
    session
}

/// A recipe on the demo's scans.
pub fn on_demo_scans(recipe: &str) -> String {
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
    recipe.replace("SCANS", scans.to_str().unwrap())
}

/// The stages that a command ran, as `step/stage`, each with the reason.
pub fn ran(done: &serde_json::Value) -> Vec<(String, String)> {
    let stages = done["stages"].as_array().unwrap().iter().filter(|s| s["ran"] == true);
    let said = |r: &serde_json::Value| {
        let text = |key: &str| r.get(key).map(|v| v.to_string().replace('"', "")).unwrap_or_default();
        [text("cause"), text("name"), text("old"), text("new")].join(" ").trim().to_string()
    };
    let why = |s: &serde_json::Value| s["why"].as_array().unwrap().iter().map(said).collect::<Vec<_>>().join("; ");
    stages.map(|s| (format!("{}/{}", s["step"].as_str().unwrap(), s["stage"].as_str().unwrap()), why(s))).collect()
}
