//! `view --weights`: skin and physics weights in one picture.

use crate::common::{built_quick_session, fingerprint, overcoat_ok};
use overcoat::body::JointId;
use overcoat::formats::read_color_picture;
use overcoat::view::joint_color;
use std::path::PathBuf;

#[test]
fn weights_are_drawn_per_layer_and_no_artefact_changes() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let before = fingerprint(&session);
    let done = overcoat_ok(&session, &["view", "--weights", "../weights.png", "--sheet", "../sheet.png", "--json"]);
    assert_eq!(done.json()["weights"], "../weights.png");
    let mut after = fingerprint(&session);
    after.remove(&PathBuf::from("outputs.json"));
    // Textures of the sheet, which are baked again if they are deleted.
    after.retain(|path, _| !path.starts_with("derived"));
    assert_eq!(after, before);
    let read = |name: &str| read_color_picture(&std::fs::read(dir.path().join(name)).unwrap()).unwrap();
    let (weights, sheet) = (read("weights.png"), read("sheet.png"));
    // A row for the body and one for the T-shirt, which has five pictures; the contact sheet has four per row.
    assert_eq!((weights.width - sheet.width, weights.height), (330, 92 + 2 * 480 + 36));
    for joint in 0..22 {
        let color = joint_color(JointId(joint));
        let swatches = weights.pixels.iter().filter(|&&p| p == color).count();
        assert!(swatches >= 100, "the legend does not show joint {joint}");
    }
    let again = overcoat_ok(&session, &["view", "--weights", "../again.png"]);
    assert!(again.stdout.contains("drew ../again.png"), "{again:?}");
    let bytes = |name: &str| std::fs::read(dir.path().join(name)).unwrap();
    assert!(bytes("again.png") == bytes("weights.png"));
}
