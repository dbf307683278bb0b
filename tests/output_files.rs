//! Result files: never over an input or a file of a session, over a user's file only with `--force`, whole or not at all.

use crate::common::{QUICK_RECIPE, copy_folder, fingerprint, overcoat, overcoat_ok, session_with_two_scans};
use crate::rgbd::turntable::Turntable;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// `body.ply` and `tshirt.ply`, the scans of the built session `alice` beside them; a copy of its own.
fn people() -> tempfile::TempDir {
    static BUILT: OnceLock<tempfile::TempDir> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
        std::fs::copy(demo.join("0-body.ply"), dir.path().join("body.ply")).unwrap();
        std::fs::copy(demo.join("1-tshirt.ply"), dir.path().join("tshirt.ply")).unwrap();
        std::fs::create_dir(dir.path().join("alice")).unwrap();
        let recipe =
            QUICK_RECIPE.replace("SCANS/0-body.ply", "../body.ply").replace("SCANS/1-tshirt.ply", "../tshirt.ply");
        std::fs::write(dir.path().join("alice/recipe.toml"), recipe).unwrap();
        overcoat_ok(dir.path(), &["-C", "alice", "build", "-q"]);
        dir
    });
    let dir = tempfile::tempdir().unwrap();
    copy_folder(built.path(), dir.path());
    dir
}

/// Runs a command in `dir`, which must refuse it and leave everything below as it is.
fn refused(dir: &Path, command: &str, code: i32, says: &str) {
    let before = fingerprint(dir);
    let answer = overcoat(dir, &command.split(' ').collect::<Vec<_>>());
    assert_eq!(answer.code, code, "{command}: {answer:?}");
    assert!(answer.stderr.contains(says), "{command} does not say '{says}': {answer:?}");
    assert_eq!(answer.stderr.lines().count(), 2, "one sentence, one hint for {command}: {answer:?}");
    assert!(fingerprint(dir) == before, "{command} changed something");
}

fn ok(dir: &Path, command: &str) -> String {
    overcoat_ok(dir, &command.split(' ').collect::<Vec<_>>()).stdout
}

#[test]
fn an_export_over_the_raw_scans_is_refused_even_with_force() {
    let dir = people();
    let here = dir.path();
    for target in [".", "alice/..", "./"] {
        refused(here, &format!("-C alice export {target}"), 2, "is the scan of 'body'");
        refused(here, &format!("-C alice export {target} --force"), 2, "is the scan of 'body'");
    }
    refused(here, "body show --mesh tshirt.ply --force", 2, "is the scan of 'tshirt'");
    refused(here, "-C alice body show --mesh body.ply --force", 2, "is the scan of 'body'");
}

#[cfg(unix)]
#[test]
fn an_export_through_links_reaches_no_scan() {
    let dir = people();
    let here = dir.path();
    let elsewhere = tempfile::tempdir().unwrap();
    let link = elsewhere.path().join("link");
    std::os::unix::fs::symlink(here, &link).unwrap();
    refused(here, &format!("-C alice export {} --force", link.display()), 2, "is the scan of 'body'");
    std::fs::create_dir(here.join("layers")).unwrap();
    std::os::unix::fs::symlink("../tshirt.ply", here.join("layers/tshirt.ply")).unwrap();
    refused(here, "-C alice export layers --force", 2, "is the scan of 'tshirt'");
    std::fs::remove_file(here.join("layers/tshirt.ply")).unwrap();
    std::fs::hard_link(here.join("tshirt.ply"), here.join("layers/tshirt.ply")).unwrap();
    refused(here, "-C alice export layers --force", 2, "is the scan of 'tshirt'");
    std::fs::remove_file(here.join("layers/tshirt.ply")).unwrap();
    std::fs::hard_link(here.join("alice/session.json"), here.join("layers/joints.json")).unwrap();
    refused(here, "-C alice export layers --force", 2, "is a file of the session");
}

#[test]
fn a_sheet_over_the_recipe_and_files_among_a_session_s_own_are_refused() {
    let dir = people();
    let here = dir.path();
    refused(here, "-C alice view --sheet alice/recipe.toml --force", 2, "does not end in .png");
    refused(here, "-C alice view --sheet alice/artefacts/x.png --force", 2, "is a file of the session");
    refused(here, "-C alice view --weights alice/recipe.toml --force", 2, "does not end in .png");
    refused(here, "-C alice view --weights alice/artefacts/x.png --force", 2, "is a file of the session");
    refused(here, "-C alice export alice/masks --force", 2, "is a file of the session");
    refused(here, "-C alice export alice/lock/ --force", 2, "is a file of the session");
    refused(here, "-C alice export alice/failures.json/ --force", 2, "is a file of the session");
    // No other command's session either.
    ok(here, "new bob");
    refused(here, "body show --mesh alice/artefacts/x.ply --force", 2, "is a file of the session");
    refused(here, "-C bob body show --sheet alice/artefacts/x.png", 2, "is a file of the session");
    refused(here, "studio make --seed 1 --garments socks --no-frames --out alice/masks", 2, "is a file of the session");
    // Anything else in a session's folder is free.
    ok(here, "-C alice view --sheet alice/sheet.png");
    ok(here, "-C alice export alice/out/");
}

#[test]
fn frames_of_a_recording_are_protected_with_everything_beside_them() {
    let dir = tempfile::tempdir().unwrap();
    Turntable { frames: 36, turn_deg: 360.0, ..Turntable::default() }.write(&dir.path().join("frames"));
    ok(dir.path(), "new alice");
    ok(dir.path(), "-C alice scan body frames");
    refused(dir.path(), "-C alice export frames --scan body", 2, "is the scan of 'body', or a part of it");
    refused(dir.path(), "-C alice export frames/new --scan body --force", 2, "is the scan of 'body', or a part of it");
}

#[test]
fn a_user_s_file_is_replaced_only_with_force_and_our_own_without() {
    let dir = people();
    let here = dir.path();
    let write = |name: &str, text: &str| std::fs::write(here.join(name), text).unwrap();
    write("sheet.png", "mine");
    refused(here, "-C alice view --sheet sheet.png", 2, "there is already a file 'sheet.png'");
    ok(here, "-C alice view --sheet sheet.png --force");
    let drawn = std::fs::read(here.join("sheet.png")).unwrap();
    assert!(drawn.starts_with(b"\x89PNG"));
    // The manifest shows that it is ours.
    ok(here, "-C alice view --sheet sheet.png");
    write("sheet.png", "painted over");
    refused(here, "-C alice view --sheet sheet.png", 2, "it is not as Overcoat wrote it");
    // A copy of our file is not listed, and neither is a file of another session.
    std::fs::write(here.join("copy.png"), &drawn).unwrap();
    refused(here, "-C alice view --sheet copy.png", 2, "there is already a file");
    ok(here, "-C alice view --sheet kept.png");
    copy_folder(&here.join("alice"), &here.join("bob"));
    std::fs::remove_file(here.join("bob/outputs.json")).unwrap();
    refused(here, "-C bob view --sheet kept.png", 2, "there is already a file");
    // Commands without a session have no manifest.
    ok(here, "body show --mesh body2.ply");
    refused(here, "body show --mesh body2.ply", 2, "there is already a file 'body2.ply'");
    ok(here, "body show --mesh body2.ply --force");
    // The manifest is no part of the session's state.
    assert_eq!(overcoat_ok(here, &["-C", "alice", "build", "--json"]).json()["ran"], 0);
}

#[test]
fn a_damaged_manifest_is_reported_and_counts_as_empty() {
    let dir = people();
    let here = dir.path();
    ok(here, "-C alice export alice.glb");
    std::fs::write(here.join("alice/outputs.json"), "{").unwrap();
    refused(here, "-C alice export alice.glb", 2, "there is already a file 'alice.glb'");
    let answer = overcoat_ok(here, &["-C", "alice", "export", "other.glb"]);
    assert!(answer.stderr.contains("note: ") && answer.stderr.contains("outputs.json"), "{answer:?}");
    std::fs::write(here.join("alice/outputs.json"), "{").unwrap();
    let checked = overcoat(here, &["-C", "alice", "fsck", "--check"]);
    assert!(checked.code == 1 && format!("{checked:?}").contains("outputs.json"), "{checked:?}");
    // A check tries no repair, and does not say that one failed.
    assert!(checked.stdout.contains("found 1 damaged file among"), "{checked:?}");
    assert!(checked.stdout.contains("nothing was changed") && !checked.stdout.contains("repaired"), "{checked:?}");
    let repaired = ok(here, "-C alice fsck");
    assert!(repaired.contains("outputs.json") && repaired.contains("repaired 1 damaged file among"), "{repaired}");
    ok(here, "-C alice fsck --check");
}

#[test]
fn a_folder_is_written_whole_or_not_at_all() {
    let dir = people();
    let here = dir.path();
    std::fs::create_dir(here.join("layers")).unwrap();
    std::fs::write(here.join("layers/joints.json"), "mine").unwrap();
    refused(here, "-C alice export layers", 2, "there is already a file 'layers/joints.json'");
    refused(here, "-C alice view --sheet a.png --poster layers/joints.json", 2, "does not end in .png");
    refused(here, "-C alice view --sheet a.png --poster ./a.png", 2, "'./a.png' is given for two results");
    refused(here, "-C alice view --sheet a.png --weights ./a.png", 2, "'./a.png' is given for two results");
    ok(here, "-C alice export layers --force");
    ok(here, "-C alice export layers");
    assert!(here.join("layers/tshirt.ply").is_file());
}

#[test]
fn a_demo_or_a_synthetic_session_goes_into_a_new_folder_and_the_refusal_says_how() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    std::fs::create_dir(here.join("my demo")).unwrap();
    std::fs::write(here.join("my demo/notes.txt"), "mine").unwrap();
    let before = fingerprint(here);
    for args in [
        &["demo", "--keep", "my demo"][..],
        &["studio", "make", "--seed", "1", "--garments", "socks", "--no-frames", "--out", "my demo"],
    ] {
        let answer = overcoat(here, args);
        assert!(
            answer.code == 2 && answer.stderr.starts_with("error: the folder 'my demo' is not empty"),
            "{answer:?}"
        );
        assert!(
            answer.stderr.contains("name a new folder") && answer.stderr.contains("`rm -r 'my demo'`"),
            "{answer:?}"
        );
    }
    assert!(fingerprint(here) == before);
}

#[test]
fn the_extension_must_match_the_content() {
    let dir = people();
    for (command, right) in [
        ("-C alice view --sheet x.jpg", "x.png"),
        ("-C alice view --poster x.rrd", "x.png"),
        ("-C alice view --weights x.jpg", "x.png"),
        ("-C alice view --save x.png", "x.rrd"),
        ("-C alice view --sheet x", "x.png"),
        ("-C alice export x.fbx", ".glb"),
        ("-C alice mask tshirt --template x.txt", ".ply"),
        ("body show --mesh x.obj", "x.ply"),
        ("body show --sheet x.jpg", "x.png"),
        ("body show --save x.ply", "x.rrd"),
        ("body build nowhere --out x.ply", "x.npz"),
        ("body import nowhere --out x.pkl", "x.npz"),
    ] {
        refused(dir.path(), command, 2, right);
    }
    ok(dir.path(), "-C alice view --sheet x.PNG");
}

#[test]
fn a_missing_parent_folder_is_an_error_that_names_the_command() {
    let dir = people();
    let here = dir.path();
    refused(here, "-C alice view --sheet a/b/x.png", 1, "hint: make it first: `mkdir -p a/b`");
    refused(here, "-C alice export a/x.glb", 1, "there is no folder 'a'");
    refused(here, "-C alice export a/layers/", 1, "`mkdir -p a`");
    refused(here, "-C alice mask tshirt --template a/x.ply", 1, "`mkdir -p a`");
    refused(here, "body show --mesh a/x.ply", 1, "`mkdir -p a`");
    refused(here, "studio make --seed 1 --garments socks --no-frames --out a/b", 1, "`mkdir -p a`");
    refused(here, "demo --keep a/b", 1, "`mkdir -p a`");
    refused(here, "new a/b/bob", 1, "hint: make it first: `mkdir -p a/b`");
    refused(here, "-C a/bob new", 1, "there is no folder 'a'");
    refused(here, "replay alice --into a/bob", 1, "`mkdir -p a`");
    std::fs::write(here.join("people.csv"), "subject\nanna\n").unwrap();
    refused(here, "replay alice --into a/all --subjects people.csv", 1, "`mkdir -p a`");
    let spaced = overcoat(here, &["body", "show", "--mesh", "my files/x.ply"]);
    assert!(spaced.code == 1 && spaced.stderr.contains("`mkdir -p 'my files'`"), "{spaced:?}");
    ok(here, "-C alice export new/");
}

/// A FIFO stands for all devices: should the check fail one day, a test run by root must not replace `/dev/full`.
#[cfg(unix)]
#[test]
fn devices_and_fifos_are_no_files_to_write() {
    let dir = people();
    let here = dir.path();
    let elsewhere = tempfile::tempdir().unwrap();
    let fifo = |name: &str| {
        let path = elsewhere.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        path.display().to_string()
    };
    let (picture, plain) = (fifo("pipe.png"), fifo("pipe"));
    refused(here, &format!("-C alice view --sheet {picture} --force"), 1, "it is a FIFO");
    refused(here, &format!("-C alice view --sheet {plain}"), 1, "it is a FIFO");
    refused(here, &format!("-C alice export {plain}"), 1, "it is a FIFO");
    std::os::unix::fs::symlink(&picture, here.join("link.png")).unwrap();
    let answer = overcoat(here, &["-C", "alice", "view", "--sheet", "link.png", "--force"]);
    assert!(answer.code == 1 && answer.stderr.contains("it is a FIFO"), "{answer:?}");
    std::fs::remove_file(here.join("link.png")).unwrap();
    refused(here, "-C alice view --sheet alice", 1, "it is a folder");
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_stdout_does_not_take_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for args in [&["templates", "--json"][..], &["templates"]] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_overcoat"));
        let output = command.args(args).current_dir(dir.path()).stdout(full).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("its output cannot be written"), "{said}");
    }
    let closed = format!("{} templates --json", env!("CARGO_BIN_EXE_overcoat"));
    let script = format!("{{ sleep 1; {closed}; echo $? >&2; }} | true");
    let output = std::process::Command::new("sh").args(["-c", &script]).output().unwrap();
    assert!(String::from_utf8_lossy(&output.stderr).ends_with("1\n"), "{output:?}");
}

#[test]
fn a_painted_template_is_not_replaced_and_a_mask_never() {
    let dir = people();
    let here = dir.path();
    ok(here, "-C alice mask tshirt --template labels.npy");
    // Unpainted, it is as we wrote it.
    ok(here, "-C alice mask tshirt --template labels.npy");
    let written = std::fs::read(here.join("labels.npy")).unwrap();
    let mut painted = written.clone();
    // The last label.
    let at = painted.len() - 4;
    painted[at] ^= 1;
    std::fs::write(here.join("labels.npy"), &painted).unwrap();
    refused(here, "-C alice mask tshirt --template labels.npy", 2, "there is already a file 'labels.npy'");
    ok(here, "-C alice mask tshirt labels.npy");
    refused(here, "-C alice mask tshirt --template labels.npy --force", 2, "is a mask of 'tshirt'");
    refused(here, "-C alice export labels.npy --force", 2, "labels.npy");
}

#[test]
fn a_summary_of_another_program_is_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    session_with_two_scans(dir.path());
    let here: PathBuf = dir.path().into();
    std::fs::write(here.join("people.csv"), "subject\nanna\n").unwrap();
    std::fs::create_dir(here.join("all")).unwrap();
    std::fs::write(here.join("all/summary.csv"), "mine").unwrap();
    refused(&here, "replay session --into all --subjects people.csv", 2, "there is already a file 'all/summary.csv'");
}
