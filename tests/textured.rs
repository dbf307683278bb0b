//! Textured scans: OBJ with materials and pictures, glTF, zips of them. The colours are those of the same scan with coloured
//! vertices, the pictures are kept, and what is missing is said.

use crate::common::{Answer, fingerprint, mean_body, overcoat, overcoat_ok, write_mesh};
use overcoat::formats::{RawMesh, read_ply, write_textured_glb, write_textured_obj};
use overcoat::session::Session;
use overcoat::studio::with_picture;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

/// Pixels along the side of the picture: charts of the body's triangles with legs of 11 pixels.
const SIDE: usize = 2048;

/// The mean body, its colours changing by less than a level per millimetre: coordinates as `f32` keeps them, in every format.
fn colored_body() -> RawMesh {
    let body = mean_body(|p| p.map(|c| f64::from(c as f32)));
    let color = |p: &[f64; 3]| {
        [128.0 + 100.0 * (3.0 * p[0]).sin(), 40.0 + 100.0 * p[1], 128.0 + 100.0 * (5.0 * p[2]).cos()]
            .map(|c| c.round() as u8)
    };
    RawMesh { colors: Some(body.points.iter().map(color).collect()), ..body }
}

fn textured_body() -> RawMesh {
    with_picture(&colored_body(), 1, SIDE).unwrap()
}

/// Writes `scan.obj`, `scan.mtl` and `scan.png` into a folder.
fn write_obj(folder: &Path, mesh: &RawMesh) {
    std::fs::create_dir_all(folder).unwrap();
    let create = |name: &str| File::create(folder.join(name)).unwrap();
    write_textured_obj(mesh, "scan.mtl", create("scan.obj"), create("scan.mtl")).unwrap();
    std::fs::write(folder.join("scan.png"), &mesh.texture.as_ref().unwrap().pictures[0].bytes).unwrap();
}

fn write_glb(path: &Path, mesh: &RawMesh) {
    write_textured_glb(mesh, "test", File::create(path).unwrap()).unwrap();
}

/// Scans a file as the body of a new session.
fn scan(dir: &Path, session: &str, file: &str) -> Answer {
    overcoat_ok(dir, &["new", session]);
    overcoat_ok(dir, &["-C", session, "scan", "body", file])
}

/// The colours of a session's cleaned scan by place, in nanometres.
fn colors_by_place(dir: &Path, session: &str) -> BTreeMap<[i64; 3], [u8; 3]> {
    let out = format!("{session}-out");
    overcoat_ok(dir, &["-C", session, "export", &format!("{out}/"), "--scan", "body"]);
    let folder = dir.join(&out);
    let file = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path());
    let file = file.into_iter().find(|p| p.to_string_lossy().contains("scan")).unwrap_or_else(|| panic!("{folder:?}"));
    let mesh = read_ply(std::fs::read(file).unwrap().as_slice()).unwrap();
    let place = |p: &[f64; 3]| p.map(|c| (c * 1e6).round() as i64);
    mesh.points.iter().map(place).zip(mesh.colors.unwrap()).collect()
}

#[test]
fn every_format_gives_the_colours_of_a_scan_with_coloured_vertices() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    write_mesh(dir.join("plain.ply"), &colored_body());
    let textured = textured_body();
    write_obj(&dir.join("photo"), &textured);
    write_glb(&dir.join("photo.glb"), &textured);
    scan(dir, "plain", "plain.ply");
    let expected = colors_by_place(dir, "plain");
    for (session, file) in [("obj", "photo/scan.obj"), ("glb", "photo.glb")] {
        let said = scan(dir, session, file).stdout;
        assert!(said.contains("texture 2048 × 2048, 1 material\n"), "{said}");
        let found = colors_by_place(dir, session);
        assert!(found.keys().eq(expected.keys()), "{session}: the same surface");
        let far: Vec<_> = found
            .iter()
            .filter(|(at, color)| (0..3).any(|k| color[k].abs_diff(expected[*at][k]) > 3))
            .map(|(at, color)| (at, color, expected[at]))
            .collect();
        assert!(far.is_empty(), "{session}: {} of {}: {:?}", far.len(), found.len(), &far[..far.len().min(3)]);
    }
}

#[test]
fn the_pictures_and_the_full_mesh_are_kept_without_the_files() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let textured = textured_body();
    let texture = textured.texture.as_ref().unwrap();
    write_obj(&dir.join("photo"), &textured);
    write_glb(&dir.join("photo.glb"), &textured);
    for (session, file) in [("obj", "photo/scan.obj"), ("glb", "photo.glb")] {
        scan(dir, session, file);
        std::fs::remove_file(dir.join(file)).unwrap();
    }
    std::fs::remove_dir_all(dir.join("photo")).unwrap();
    for session in ["obj", "glb"] {
        let kept = Session::open(&dir.join(session)).unwrap().full_scan("body").unwrap().unwrap();
        let found = kept.texture.as_ref().unwrap();
        assert_eq!(found.pictures[0].bytes, texture.pictures[0].bytes, "as it was");
        assert_eq!(kept.faces.len(), textured.faces.len());
        for f in 0..kept.faces.len() {
            let places = |mesh: &RawMesh| mesh.faces[f].map(|v| mesh.points[v as usize]);
            assert_eq!(places(&kept), places(&textured));
            assert_eq!(found.coords_of(f, kept.faces[f]), texture.coords_of(f, textured.faces[f]));
        }
        let fsck = overcoat_ok(dir, &["-C", session, "fsck"]).stdout;
        assert!(!fsck.contains("damaged") || fsck.contains("nothing"), "{fsck}");
    }
}

#[test]
fn a_changed_picture_is_a_changed_scan() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let textured = textured_body();
    write_obj(&dir.join("photo"), &textured);
    scan(dir, "alice", "photo/scan.obj");
    let changed = || overcoat_ok(dir, &["-C", "alice", "status", "--json"]).json()["steps"][0]["scan_changed"] == true;
    assert!(!changed());
    let other = RawMesh { colors: Some(vec![[200, 10, 10]; textured.points.len()]), ..colored_body() };
    let other = with_picture(&other, 1, SIDE).unwrap().texture.unwrap().pictures[0].bytes.clone();
    std::fs::write(dir.join("photo/scan.png"), other).unwrap();
    assert!(changed());
    let before = colors_by_place(dir, "alice");
    let replaced = overcoat_ok(dir, &["-C", "alice", "scan", "body", "photo/scan.obj", "--replace", "--json"]).json();
    assert_eq!(replaced["warnings"].as_array().unwrap().len(), 0);
    assert!(!changed());
    std::fs::remove_dir_all(dir.join("alice-out")).unwrap();
    let after = colors_by_place(dir, "alice");
    assert!(before != after && after.values().all(|c| *c == [200, 10, 10]));
    overcoat_ok(dir, &["-C", "alice", "undo"]);
    std::fs::remove_dir_all(dir.join("alice-out")).unwrap();
    assert_eq!(colors_by_place(dir, "alice"), before, "the first picture is still kept");
}

#[test]
fn replay_takes_the_pictures_along() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    write_obj(&dir.join("photo"), &textured_body());
    scan(dir, "alice", "photo/scan.obj");
    std::fs::remove_dir_all(dir.join("photo")).unwrap();
    // The body alone, in few iterations.
    let recipe = std::fs::read_to_string(dir.join("alice/recipe.toml")).unwrap();
    let quick = "faces = 4000\n\n[step.fit]\nsamples = 300\niterations = 2\n\n[step.register]\niterations = 1\n";
    std::fs::write(dir.join("alice/recipe.toml"), format!("{}\n{quick}", recipe.trim_end())).unwrap();
    overcoat_ok(dir, &["replay", "alice", "--into", "bob"]);
    let bob = Session::open(&dir.join("bob")).unwrap().full_scan("body").unwrap().unwrap();
    assert_eq!(bob.texture.unwrap().pictures.len(), 1);
}

#[test]
fn a_zip_of_a_scan_with_its_pictures_is_a_scan() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    write_obj(&dir.join("photo"), &textured_body());
    let files = ["scan.obj", "scan.mtl", "scan.png"].map(|name| {
        let path = dir.join("photo").join(name);
        Ok((format!("photo/{name}"), std::fs::metadata(&path)?.len(), File::open(path)?))
    });
    overcoat::formats::write_mesh_bundle(files, File::create(dir.join("photo.zip")).unwrap()).unwrap();
    let said = scan(dir, "zip", "photo.zip").stdout;
    assert!(said.contains("texture 2048 × 2048"), "{said}");
    scan(dir, "obj", "photo/scan.obj");
    assert_eq!(colors_by_place(dir, "zip"), colors_by_place(dir, "obj"));
}

#[test]
fn what_is_wrong_with_a_texture_is_said_and_the_scan_is_still_read() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let textured = textured_body();
    type Damage<'a> = &'a dyn Fn(&Path);
    let cases: [(&str, Damage, &str); 6] = [
        (
            "no_mtl",
            &|at| std::fs::remove_file(at.join("scan.mtl")).unwrap(),
            "the material file 'scan.mtl' is not beside",
        ),
        (
            "no_picture",
            &|at| std::fs::remove_file(at.join("scan.png")).unwrap(),
            "the picture 'scan.png' of the material 'scan' is missing; put it beside the scan and scan again",
        ),
        (
            "cut",
            &|at| {
                let whole = std::fs::read(at.join("scan.png")).unwrap();
                std::fs::write(at.join("scan.png"), &whole[..whole.len() / 2]).unwrap();
            },
            "the picture 'scan.png' cannot be read: ",
        ),
        (
            "tiff",
            &|at| std::fs::write(at.join("scan.png"), b"II*\0 and so on").unwrap(),
            "the picture 'scan.png' is neither PNG, JPEG nor WebP",
        ),
        (
            "preview",
            &|at| {
                let pixels = vec![[90; 3]; 32 * 32];
                let small = overcoat::formats::write_color_png([32, 32], &pixels).unwrap();
                std::fs::write(at.join("scan.png"), small).unwrap();
            },
            "a pixel of the texture covers ",
        ),
        (
            "no_coordinates",
            &|at| {
                let text = std::fs::read_to_string(at.join("scan.obj")).unwrap();
                let lines = text.lines().map(|line| match line.strip_prefix("vt ") {
                    Some(_) => "vt nan nan".into(),
                    None => line.to_string(),
                });
                std::fs::write(at.join("scan.obj"), lines.collect::<Vec<_>>().join("\n")).unwrap();
            },
            "100 % of the surface has no valid texture coordinates",
        ),
    ];
    for (name, damage, says) in cases {
        let folder = dir.join(format!("{name}-files"));
        write_obj(&folder, &textured);
        damage(&folder);
        let said = scan(dir, name, &format!("{name}-files/scan.obj")).stdout;
        let doubts: Vec<&str> = said.lines().filter(|line| line.contains("check it: ")).collect();
        assert!(doubts.len() == 1 && doubts[0].contains(says), "{name}: {said}\nshould say: {says}");
        assert!(said.contains("scanned body from"), "{said}");
    }
    // Nothing was in doubt: the file that Windows wrote has another case.
    let folder = dir.join("windows");
    write_obj(&folder, &textured);
    std::fs::rename(folder.join("scan.png"), folder.join("SCAN.PNG")).unwrap();
    let mtl = std::fs::read_to_string(folder.join("scan.mtl")).unwrap();
    std::fs::write(folder.join("scan.mtl"), mtl.replace("map_Kd scan.png", "map_Kd C:\\Users\\Ann\\scan.png")).unwrap();
    let said = scan(dir, "case", "windows/scan.obj").stdout;
    assert!(said.contains("texture 2048 × 2048") && !said.contains("check it"), "{said}");
}

#[test]
fn a_path_in_a_scan_never_leaves_its_folder() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let textured = textured_body();
    write_obj(&dir.join("photo"), &textured);
    // The picture exists, but above the folder of the scan.
    std::fs::rename(dir.join("photo/scan.png"), dir.join("secret.png")).unwrap();
    let mtl = std::fs::read_to_string(dir.join("photo/scan.mtl")).unwrap();
    let absolute = dir.join("secret.png").display().to_string();
    for named in ["../secret.png", &absolute, "tex/../../secret.png"] {
        std::fs::write(dir.join("photo/scan.mtl"), mtl.replace("map_Kd scan.png", &format!("map_Kd {named}"))).unwrap();
        let _ = std::fs::remove_dir_all(dir.join("alice"));
        let said = scan(dir, "alice", "photo/scan.obj").stdout;
        assert!(said.contains(&format!("the picture '{named}' of the material 'scan' is missing")), "{said}");
    }
}

#[test]
fn numbers_in_a_file_that_is_not_there_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    overcoat_ok(dir, &["new", "alice"]);
    let text = r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":36,"uri":"scan.bin"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]}"#;
    std::fs::write(dir.join("scan.gltf"), text).unwrap();
    let before = fingerprint(&dir.join("alice"));
    let answer = overcoat(dir, &["-C", "alice", "scan", "body", "scan.gltf"]);
    assert_eq!((answer.code, fingerprint(&dir.join("alice"))), (1, before));
    assert!(
        answer.stderr.contains("the file 'scan.bin', which holds the mesh's numbers, is not beside it"),
        "{answer:?}"
    );
    assert!(answer.stderr.contains("hint: copy it into the mesh's folder"), "{answer:?}");
}
