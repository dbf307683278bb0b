//! Sessions that are slow to build: each is built once per run and shared. No test changes them; a test that changes
//! something works on a copy.

use super::{copy_folder, on_demo_scans, overcoat_ok, quick_session};
use overcoat::formats::{RawMesh, read_ply};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A built session and what the program reported about it.
pub struct Built {
    /// Holds the session and what else was made.
    pub dir: tempfile::TempDir,
    /// The session's folder.
    pub session: PathBuf,
    /// The demo's report, or that of `measure`.
    pub report: Value,
}

/// `overcoat demo`, with `kept` for its folder.
pub fn demo() -> &'static Built {
    static DEMO: OnceLock<Built> = OnceLock::new();
    DEMO.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let kept = dir.path().join("kept");
        let report = overcoat_ok(root, &["demo", "--keep", kept.to_str().unwrap(), "--json"]).json();
        Built { session: kept.join("session"), dir, report }
    })
}

/// A synthetic woman in T-shirt, jeans and jacket, from mesh scans.
pub fn outfit_a() -> &'static Built {
    static OUTFIT: OnceLock<Built> = OnceLock::new();
    OUTFIT.get_or_init(|| synthetic_outfit(21, &["tshirt", "jeans", "jacket"]))
}

/// Makes the scans of a synthetic person, builds their session and compares it with the truth.
fn synthetic_outfit(seed: u64, garments: &[&str]) -> Built {
    let dir = tempfile::tempdir().unwrap();
    let seed = seed.to_string();
    let names = garments.join(",");
    let make = ["studio", "make", "--seed", &seed, "--garments", &names, "--no-frames", "--views", "36"];
    overcoat_ok(dir.path(), &[&make[..], &["--faces", "40000", "--out", "scans"]].concat());
    overcoat_ok(dir.path(), &["new", "session"]);
    let session = dir.path().join("session");
    overcoat_ok(&session, &["scan", "body", "../scans/0-body.ply"]);
    for (k, name) in (1..).zip(garments) {
        overcoat_ok(&session, &["scan", name, &format!("../scans/{k}-{name}.ply"), "--template", kind_of(name)]);
    }
    overcoat_ok(&session, &["build", "-q"]);
    let report = overcoat_ok(&session, &["measure", "--truth", "../scans/truth", "--invented", "--json"]).json();
    Built { dir, session, report }
}

/// The kind of garment that the studio's garment is scanned as.
fn kind_of(garment: &str) -> &str {
    if garment == "jeans" { "trousers" } else { garment }
}

/// A built copy of the coarse session [`quick_session`], in `dir/name`.
pub fn built_quick_session(dir: &Path, name: &str) -> PathBuf {
    static QUICK: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, built) = QUICK.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let session = quick_session(dir.path(), "quick");
        overcoat_ok(&session, &["build"]);
        (dir, session)
    });
    copy_folder(built, &dir.join(name));
    dir.join(name)
}

/// A session with the demo's bare body, coarse, and its woman in T-shirt and skirt as one scan. Not built.
pub fn outfit_scanned(dir: &Path, name: &str, templates: &str) -> PathBuf {
    let session = dir.join(name);
    let scan = |name: &str| demo_scan(name).display().to_string();
    overcoat_ok(dir, &["new", name]);
    overcoat_ok(&session, &["scan", "body", &scan("0-body.ply"), "--faces", "4000"]);
    overcoat_ok(&session, &["step", "set", "body", "fit.samples=300", "fit.iterations=4", "register.iterations=1"]);
    overcoat_ok(&session, &["scan", "outfit", &scan("2-skirt.ply"), "--template", templates, "--faces", "4000"]);
    overcoat_ok(&session, &["step", "set", "skirt", "pose.samples=300", "pose.iterations=4"]);
    session
}

/// A built copy of that session.
pub fn built_outfit(dir: &Path, name: &str) -> PathBuf {
    static BUILT: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, built) = BUILT.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let session = outfit_scanned(dir.path(), "alice", "tshirt,skirt");
        overcoat_ok(&session, &["build"]);
        (dir, session)
    });
    copy_folder(built, &dir.join(name));
    dir.join(name)
}

/// A scan of the demo with a colour per vertex and no texture, whose seams are joined.
pub fn demo_mesh(name: &str) -> RawMesh {
    let read = read_ply(std::fs::File::open(demo_scan(name)).unwrap()).unwrap();
    let (mut first, mut kept, mut place) = (HashMap::new(), Vec::new(), Vec::new());
    for (v, p) in read.points.iter().enumerate() {
        place.push(*first.entry(p.map(f64::to_bits)).or_insert_with(|| {
            kept.push(v);
            kept.len() as u32 - 1
        }));
    }
    let colors = read.colors.unwrap();
    RawMesh {
        points: kept.iter().map(|&v| read.points[v]).collect(),
        faces: read.faces.iter().map(|face| face.map(|v| place[v as usize])).collect(),
        colors: Some(kept.iter().map(|&v| colors[v]).collect()),
        ..RawMesh::default()
    }
}

/// The scan of the demo's T-shirt with a trunk into which no body fits.
pub fn demo_tshirt_as_thin_as_a_pole() -> RawMesh {
    let mut scan = demo_mesh("1-tshirt.ply");
    for p in scan.points.iter_mut().filter(|p| (0.8..1.3).contains(&p[1]) && p[0].abs() < 0.25) {
        (p[0], p[2]) = (0.2 * p[0], 0.2 * p[2]);
    }
    scan
}

/// A scan of the demo.
pub fn demo_scan(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo").join(name)
}

/// A coarse session in `dir/name` with these steps, each of a name and a scan; garments are of the kind of their name.
pub fn coarse_session(dir: &Path, name: &str, steps: &[(&str, PathBuf)]) -> PathBuf {
    let mut recipe = "version = 1\n".to_string();
    for (step, scan) in steps {
        let kind = if *step == "body" { String::new() } else { format!("template = \"{step}\"\n") };
        let (fit, iterations) = if *step == "body" { ("fit", 8) } else { ("pose", 4) };
        recipe += &format!("\n[[step]]\nname = \"{step}\"\nscan = {scan:?}\n{kind}faces = 4000\n");
        recipe += &format!("\n[step.{fit}]\nsamples = 300\niterations = {iterations}\n");
    }
    let session = dir.join(name);
    std::fs::create_dir(&session).unwrap();
    std::fs::write(session.join("recipe.toml"), recipe).unwrap();
    session
}

/// The built body of the demo, on which garments can be tried.
pub fn body_of_demo(dir: &Path) -> PathBuf {
    let session = dir.join("alice");
    copy_folder(&demo().session, &session);
    let recipe = "version = 1\n\n[[step]]\nname = \"body\"\nscan = \"SCANS/0-body.ply\"\n";
    std::fs::write(session.join("recipe.toml"), on_demo_scans(recipe)).unwrap();
    session
}
