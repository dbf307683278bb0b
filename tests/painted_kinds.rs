//! Kinds of garment painted on the body: `templates paint` and `templates add`.

use crate::common::{built_quick_session, fingerprint, overcoat, overcoat_ok, ran, write_mesh};
use overcoat::body::embedded_model;
use overcoat::formats::{RawMesh, read_ply};
use overcoat::segment::LABEL_COLORS;
use std::path::Path;

const GREY: [u8; 3] = LABEL_COLORS[0];
const RED: [u8; 3] = LABEL_COLORS[1];

/// The body to paint, with the region of a kind in red.
fn to_paint(session: &Path, kind: &str) -> RawMesh {
    overcoat_ok(session, &["templates", "paint", kind, "../to-paint.ply", "--force"]);
    read_ply(std::fs::File::open(session.join("../to-paint.ply")).unwrap()).unwrap()
}

/// As a paint program writes it that keeps only the colours. The sleeves of the T-shirt are erased.
fn sleeveless(session: &Path) -> RawMesh {
    let mut mesh = to_paint(session, "tshirt");
    mesh.scalars.clear();
    let colors = mesh.colors.as_mut().unwrap();
    let on_arm = |p: &[f64; 3]| p[0].abs() > 0.26;
    mesh.points.iter().zip(colors.iter_mut()).filter(|(p, _)| on_arm(p)).for_each(|(_, color)| *color = GREY);
    mesh
}

#[test]
fn the_body_to_paint_has_the_region_in_colour_and_as_labels() {
    let dir = tempfile::tempdir().unwrap();
    // Without a session it is the embedded body.
    let done = overcoat_ok(dir.path(), &["templates", "paint", "tshirt", "shirt.ply", "--json"]).json();
    let mesh = read_ply(std::fs::File::open(dir.path().join("shirt.ply")).unwrap()).unwrap();
    let model = embedded_model().unwrap().template;
    assert_eq!((mesh.points.len(), mesh.faces.len()), (model.vertex_count(), model.face_count()));
    assert_eq!(done["vertices"], model.vertex_count());
    let (colors, labels) = (mesh.colors.unwrap(), &mesh.scalars["label"]);
    assert_eq!(&mesh.scalars["quality"], labels);
    assert!(colors.iter().zip(labels).all(|(&color, &label)| color == if label == 1.0 { RED } else { GREY }));
    let covered = labels.iter().filter(|&&label| label == 1.0).count();
    assert!(covered > 500 && covered < labels.len() / 2, "{covered}");
    assert_eq!(overcoat(dir.path(), &["templates", "paint", "tshirt", "shirt.obj"]).code, 2);
    assert_eq!(overcoat(dir.path(), &["templates", "paint", "tshrt", "other.ply"]).code, 2);
}

#[test]
fn a_step_follows_the_painted_kind_and_every_change_of_it() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let mut painted = sleeveless(&session);
    write_mesh(dir.path().join("singlet.ply"), &painted);
    let added = overcoat_ok(&session, &["templates", "add", "singlet", "../singlet.ply", "--like", "tshirt", "--json"]);
    let added = added.json();
    assert_eq!((&added["like"], &added["replaced"]), (&"tshirt".into(), &false.into()));
    let red = |mesh: &RawMesh| mesh.colors.iter().flatten().filter(|&&color| color == RED).count();
    assert_eq!(added["covered_vertices"], red(&painted));
    let shown = overcoat_ok(&session, &["templates", "show", "singlet", "--json"]).json();
    assert_eq!((&shown["template"]["painted"], shown["template"]["hems"].as_array().unwrap().len()), (&true.into(), 4));
    assert!(overcoat_ok(&session, &["templates", "list"]).stdout.contains("\nsinglet "));
    assert_eq!(to_paint(&session, "singlet").colors, painted.colors, "what was painted can be painted further");
    let built = |session: &Path| ran(&overcoat_ok(session, &["build", "--json"]).json());
    assert!(built(&session).is_empty(), "no step uses it yet");

    overcoat_ok(&session, &["step", "set", "tshirt", "template=singlet"]);
    let stages = |ran: &[(String, String)]| ran.iter().map(|(stage, _)| stage.clone()).collect::<Vec<_>>();
    let first = stages(&built(&session));
    assert!(first.contains(&"tshirt/pose".to_string()) && !first.contains(&"body/fit".to_string()), "{first:?}");
    let limited = overcoat(&session, &["step", "set", "tshirt", "sleeve=short"]);
    assert!(limited.code == 2 && limited.stderr.contains("its region is painted"), "{limited:?}");
    let unknown = overcoat(&session, &["step", "set", "tshirt", "template=singlt"]);
    assert!(unknown.code == 2 && unknown.stderr.contains("vest, singlet"), "{unknown:?}");

    // Painted again, edited by hand, and undone.
    let file = session.join("templates/singlet.toml");
    let original = std::fs::read(&file).unwrap();
    let neck = painted.points.iter().position(|p| p[1] > 0.0 && p[0].abs() < 0.26).unwrap();
    let color = &mut painted.colors.as_mut().unwrap()[neck];
    *color = if *color == RED { GREY } else { RED };
    write_mesh(dir.path().join("singlet.ply"), &painted);
    let again = overcoat_ok(&session, &["templates", "add", "singlet", "../singlet.ply", "--json"]).json();
    assert_eq!((&again["replaced"], &again["used_by"]), (&true.into(), &serde_json::json!(["tshirt"])));
    assert!(stages(&built(&session)).contains(&"tshirt/pose".to_string()));
    let text = String::from_utf8(std::fs::read(&file).unwrap()).unwrap();
    std::fs::write(&file, format!("# a comment changes no result\n{text}")).unwrap();
    assert!(built(&session).is_empty());
    let rank = text.lines().find(|line| line.starts_with("rank = ")).unwrap();
    std::fs::write(&file, text.replace(rank, "rank = 99")).unwrap();
    assert!(stages(&built(&session)).contains(&"tshirt/pose".to_string()));
    // The rank, the comment, the second painting.
    overcoat_ok(&session, &["undo", "3"]);
    assert_eq!(std::fs::read(&file).unwrap(), original);
    let done = overcoat_ok(&session, &["build", "--json"]).json();
    assert_eq!(done["ran"], 0, "the results of that version are still there: {done}");
    overcoat_ok(&session, &["redo", "2"]);
    assert_ne!(std::fs::read(&file).unwrap(), original);

    std::fs::remove_dir_all(session.join("templates")).unwrap();
    assert_eq!(
        overcoat_ok(&session, &["templates", "show", "singlet", "--json"]).json()["template"]["rank"],
        shown["template"]["rank"]
    );
    overcoat_ok(dir.path(), &["replay", "alice", "--into", "bob", "-q"]);
    assert!(dir.path().join("bob/templates/singlet.toml").is_file());
    let bob = dir.path().join("bob");
    overcoat_ok(&bob, &["fsck", "--check"]);
    overcoat_ok(&bob, &["step", "set", "body", "surface=scan"]);
    let failed = overcoat(&bob, &["build"]);
    assert!(failed.code == 1 && failed.stderr.contains("'singlet' was painted on another body"), "{failed:?}");
}

#[test]
fn a_damaged_file_of_a_kind_is_one_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    write_mesh(dir.path().join("singlet.ply"), &sleeveless(&session));
    overcoat_ok(&session, &["templates", "add", "singlet", "../singlet.ply"]);
    let file = session.join("templates/singlet.toml");
    let text = String::from_utf8(std::fs::read(&file).unwrap()).unwrap();
    for (from, to) in [("rank = ", "rank = x"), ("vertices = ", "vertices = 1"), ("[region]", "[regions]")] {
        std::fs::write(&file, text.replace(from, to)).unwrap();
        let answer = overcoat(&session, &["status"]);
        assert!(answer.code == 1 && answer.stderr.contains("templates/singlet.toml"), "{answer:?}");
        assert_eq!(answer.stderr.lines().count(), 2, "{answer:?}");
    }
    std::fs::remove_file(&file).unwrap();
    overcoat_ok(&session, &["status"]);
}

#[test]
fn what_is_not_a_painted_body_is_refused_and_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let good = sleeveless(&session);
    let write = |name: &str, mesh: &RawMesh| drop(write_mesh(dir.path().join(name), mesh));
    let all = |color: [u8; 3]| RawMesh { colors: Some(vec![color; good.points.len()]), ..good.clone() };
    write("good.ply", &good);
    write("grey.ply", &all(GREY));
    write("red.ply", &all(RED));
    write("blue.ply", &all([20, 40, 220]));
    write("bare.ply", &RawMesh { colors: None, ..good.clone() });
    let turned = good.points.iter().map(|&[x, y, z]| [x, -z, y]).collect();
    write("turned.ply", &RawMesh { points: turned, ..good.clone() });
    std::fs::write(dir.path().join("text.ply"), "no mesh").unwrap();
    std::fs::write(dir.path().join("good.obj"), "v 0 0 0\n").unwrap();
    for (command, code, says) in [
        ("add tshirt ../good.ply", 2, "'tshirt' is a built-in kind of garment"),
        ("add T-Shirt ../good.ply", 2, "'tshirt' is a built-in kind of garment"),
        ("add a/b ../good.ply", 2, "cannot be the name of a kind"),
        ("add singlet ../good.ply --like ponch", 2, "there is no garment template 'ponch'"),
        ("add singlet ../missing.ply", 2, "there is no file"),
        ("add singlet ../good.obj", 2, "a painted body is a .ply file"),
        ("add singlet ../text.ply", 1, "text.ply"),
        ("add singlet ../grey.ply", 1, "nothing is painted"),
        ("add singlet ../red.ply", 1, "everything is painted"),
        ("add singlet ../blue.ply", 2, "neither red (the garment) nor grey"),
        ("add singlet ../bare.ply", 2, "neither a 'label', nor a 'quality', nor colours"),
        ("add singlet ../turned.ply", 1, "it was painted on another body"),
        ("paint singlet ../out.ply", 2, "there is no garment template 'singlet'"),
        ("paint tshirt ../good.ply", 2, "there is already a file"),
        ("paint tshirt templates/mine.ply", 2, "is a file of the session"),
    ] {
        if command.contains("templates/") {
            std::fs::create_dir_all(session.join("templates")).unwrap();
        }
        let before = fingerprint(dir.path());
        let args: Vec<&str> = std::iter::once("templates").chain(command.split(' ')).collect();
        let answer = overcoat(&session, &args);
        assert_eq!(answer.code, code, "{command}: {answer:?}");
        assert!(answer.stderr.contains(says), "{command} does not say '{says}': {answer:?}");
        assert!(answer.stderr.lines().count() <= 2, "one sentence, one hint for {command}: {answer:?}");
        assert!(fingerprint(dir.path()) == before, "{command} changed something");
    }
    overcoat_ok(&session, &["templates", "add", "singlet", "../good.ply"]);
}
