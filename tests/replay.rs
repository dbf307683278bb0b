//! Replaying a recipe: the same bytes in another folder, with one thread, and for a table of people; other values where set.

use crate::common::{built_quick_session, fingerprint, overcoat, overcoat_ok, quick_session, ran};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a session's results are: its state, and what the stages made. Texts of recipes name folders, so they may differ.
fn results(session: &Path) -> BTreeMap<String, blake3::Hash> {
    let state = std::fs::read_to_string(session.join("session.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&state).unwrap();
    let mut found = BTreeMap::from([("session.json".to_string(), blake3::hash(state.as_bytes()))]);
    for step in json["steps"].as_array().unwrap() {
        for (stage, record) in step["stages"].as_object().unwrap() {
            let name = record["output"].as_str().unwrap();
            let bytes = std::fs::read(session.join("artefacts").join(name)).unwrap();
            found.insert(format!("{}/{stage}", step["name"].as_str().unwrap()), blake3::hash(&bytes));
        }
    }
    found
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_recipe_gives_the_same_bytes_on_another_path_with_another_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let alice = built_quick_session(dir.path(), "alice");
    let first = results(&alice);
    assert!(first.len() > 1 + 10, "the state, and what each stage made");
    std::fs::create_dir_all(dir.path().join("deep/er")).unwrap();
    for (into, threads) in [("deep/er/bob", "1"), ("carol", "3")] {
        let output = Command::new(env!("CARGO_BIN_EXE_overcoat"))
            .args(["replay", "alice/recipe.toml", "--into", into, "--json"])
            .env("RAYON_NUM_THREADS", threads)
            .current_dir(dir.path())
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        assert!(results(&dir.path().join(into)) == first, "{into}");
        overcoat_ok(&dir.path().join(into), &["export", "character.glb"]);
    }
    overcoat_ok(&alice, &["export", "character.glb"]);
    let glb = |of: &str| std::fs::read(dir.path().join(of).join("character.glb")).unwrap();
    assert!(glb("alice") == glb("carol"), "an export does not tell where it was made");
    // The scans may be gone: the session has copies.
    let recipe = std::fs::read_to_string(alice.join("recipe.toml")).unwrap();
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
    std::fs::write(alice.join("recipe.toml"), recipe.replace(text(&scans), "/gone")).unwrap();
    overcoat_ok(dir.path(), &["replay", "alice", "--into", "dave"]);
    assert!(results(&dir.path().join("dave")) == first);
    // Replayed into the same place again, nothing remains to be done.
    assert_eq!(overcoat_ok(dir.path(), &["replay", "alice", "--into", "dave", "--json"]).json()["ran"], 0);
}

#[test]
fn settings_replace_those_of_the_recipe_and_masks_of_another_scan_are_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let alice = built_quick_session(dir.path(), "alice");
    let dab = r#"{"layer":"tshirt","op":"erase","radius":0.02,"points":[[-0.22,1.262,-0.008]]}"#;
    std::fs::write(dir.path().join("dab.jsonl"), dab).unwrap();
    overcoat_ok(&alice, &["mask", "tshirt", "../dab.jsonl"]);
    let other = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/2-skirt.ply");
    std::fs::copy(&other, dir.path().join("other.ply")).unwrap();
    let args =
        ["replay", "alice", "--into", "bob", "--set", "tshirt=other.ply", "--set", "tshirt.stack.clearance=0.003"];
    let done = overcoat_ok(dir.path(), &[&args[..], &["--json"]].concat()).json();
    assert_eq!(done["left_out"][0], "1 mask of 'tshirt': painted on another scan");
    let recipe = std::fs::read_to_string(dir.path().join("bob/recipe.toml")).unwrap();
    assert!(recipe.contains("scan = \"../other.ply\"") && recipe.contains("clearance = 0.003"), "{recipe}");
    assert!(!recipe.contains("dab"), "{recipe}");
    assert!(ran(&done).len() > 10);
}

#[test]
fn a_mask_is_set_for_another_person_and_belongs_to_the_recipe_from_then_on() {
    let dir = tempfile::tempdir().unwrap();
    let alice = built_quick_session(dir.path(), "alice");
    let stroke = |layer: &str, z: f64| {
        format!("{{\"layer\":\"{layer}\",\"op\":\"erase\",\"radius\":0.03,\"points\":[[-0.22,1.262,{z}]]}}\n")
    };
    let write = |name: &str, text: String| std::fs::write(dir.path().join(name), text).unwrap();
    write("dab.jsonl", stroke("tshirt", -0.008));
    write("air.jsonl", stroke("tshirt", 5.0));
    write("coat.jsonl", stroke("coat", -0.008));
    let into = |name: &str, set: &[&str]| {
        let set: Vec<&str> = set.iter().flat_map(|s| ["--set", s]).collect();
        overcoat(dir.path(), &[&["replay", "alice", "--into", name, "--json"], &set[..]].concat())
    };
    let measures = |of: &str| {
        let status = overcoat_ok(&dir.path().join(of), &["status", "--json"]).json();
        let stages = status["steps"][1]["up_to_date"].as_array().unwrap().clone();
        stages.iter().find(|s| s["stage"] == "segment").unwrap()["measures"].clone()
    };
    let recipe = |of: &str| std::fs::read_to_string(dir.path().join(of).join("recipe.toml")).unwrap();

    let bob = into("bob", &["tshirt.mask=dab.jsonl"]);
    assert_eq!(bob.code, 0, "{bob:?}");
    assert!(recipe("bob").contains("file = \"../dab.jsonl\"") && !recipe("alice").contains("dab"), "{}", recipe("bob"));
    let (plain, erased) = (measures("alice"), measures("bob"));
    assert!(erased["by_hand_vertices"].as_f64().unwrap() > 5.0, "{erased}");
    assert!(erased["garment_vertices"].as_f64() < plain["garment_vertices"].as_f64(), "{plain} {erased}");
    // With its own, identical scan: the mask belongs to it.
    let scan = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/1-tshirt.ply");
    let carol = into("carol", &[&format!("tshirt={}", text(&scan)), "tshirt.mask=dab.jsonl"]);
    assert_eq!((carol.code, carol.json()["left_out"].as_array().map(Vec::len)), (0, Some(0)), "{carol:?}");
    assert_eq!(measures("carol"), erased);
    // And from there a mask is taken off by saying nothing.
    let args = ["replay", "bob", "--into", "dave", "--set", "tshirt.mask="];
    overcoat_ok(dir.path(), &args);
    assert!(results(&dir.path().join("dave")) == results(&alice));

    for (set, code, says) in [
        ("tshirt.mask=nowhere.jsonl", 2, "there is no file 'nowhere.jsonl'"),
        ("tshirt.mask=coat.jsonl", 1, "coat.jsonl, line 1: the stroke is for the layer 'coat'"),
        ("body.mask=dab.jsonl", 2, "garment"),
    ] {
        let answer = into("erin", &[set]);
        assert!(answer.code == code && answer.stdout.contains(says), "{set}: {answer:?}");
    }
    // From the wrong ones nothing stays that keeps the right one out.
    assert!(!dir.path().join("erin").exists());
    assert_eq!(into("erin", &["tshirt.mask=dab.jsonl"]).code, 0);
    assert!(results(&dir.path().join("erin")) == results(&dir.path().join("bob")));
    // Only on the cleaned scan it shows that a stroke touches nothing.
    let air = into("frank", &["tshirt.mask=air.jsonl"]);
    assert!(
        air.code == 1 && air.stdout.contains("air.jsonl': line 1 of the brush mask: it touches nothing"),
        "{air:?}"
    );
}

#[test]
fn a_table_of_people_gives_each_a_session_and_one_summary() {
    let dir = tempfile::tempdir().unwrap();
    let alice = built_quick_session(dir.path(), "alice");
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
    for file in ["0-body.ply", "0-body.jpg", "1-tshirt.ply", "1-tshirt.jpg"] {
        std::fs::copy(scans.join(file), dir.path().join(file)).unwrap();
    }
    let table = "subject, body,      tshirt,       tshirt.stack.clearance\n\
                 bob,     0-body.ply, 1-tshirt.ply, \n\
                 carol,   0-body.ply, 1-tshirt.ply, 0.003\n\
                 dave,    nobody.ply, 1-tshirt.ply, 0.003\n";
    std::fs::write(dir.path().join("people.csv"), table).unwrap();
    let args = ["replay", "alice/recipe.toml", "--subjects", "people.csv"];
    let both = |into: &str, jobs: &str| overcoat(dir.path(), &[&args[..], &["--into", into, "--jobs", jobs]].concat());
    let (one, two) = (both("one", "1"), both("two", "2"));
    for answer in [&one, &two] {
        assert_eq!(answer.code, 1, "{answer:?}");
        let failed = "error: 1 of 3 people could not be dressed; the first: dave: there is no file";
        assert!(answer.stderr.contains(failed) && answer.stderr.contains("nobody.ply"), "{answer:?}");
        let rows: Vec<&str> = answer.stdout.lines().take(4).map(|l| l.split_whitespace().next().unwrap()).collect();
        assert_eq!(rows, ["subject", "bob", "carol", "dave"], "{answer:?}");
    }
    assert!(results(&dir.path().join("one/bob")) == results(&alice), "bob has alice's scans and recipe");
    for person in ["bob", "carol"] {
        let of = |into: &str| results(&dir.path().join(into).join(person));
        assert!(of("one") == of("two"), "{person}");
    }
    let summary = |into: &str| std::fs::read_to_string(dir.path().join(into).join("summary.csv")).unwrap();
    assert_eq!(summary("one").replace("one/", ""), summary("two").replace("two/", ""));
    assert!(summary("one").starts_with("subject,result,body.verdict,tshirt.verdict,body.check."), "{}", summary("one"));
    assert!(!dir.path().join("one/dave").exists());
    let people = std::fs::read_to_string(dir.path().join("one/people.html")).unwrap();
    let place = |of: &str| people.find(of).unwrap_or_else(|| panic!("{of}: {people}"));
    assert!(place(">dave<") < place("bob/report.html"), "the worst comes first");
    assert!(dir.path().join("one/bob/report.html").exists() && !people.contains("dave/report.html"));

    // Repaired and run again, it continues with what is missing.
    std::fs::write(dir.path().join("people.csv"), table.replace("nobody", "0-body")).unwrap();
    let json = overcoat_ok(dir.path(), &[&args[..], &["--into", "two", "--jobs", "2", "--json"]].concat()).json();
    let ran: Vec<u64> = json["subjects"].as_array().unwrap().iter().map(|s| s["ran"].as_u64().unwrap()).collect();
    assert!(ran[..2] == [0, 0] && ran[2] > 10, "{ran:?}");
}

#[test]
fn what_cannot_be_replayed_is_reported_and_creates_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let alice = quick_session(dir.path(), "alice");
    overcoat_ok(&alice, &["fit", "body"]);
    let write = |name: &str, text: &str| -> PathBuf {
        std::fs::write(dir.path().join(name), text).unwrap();
        dir.path().join(name)
    };
    let recipe = std::fs::read_to_string(alice.join("recipe.toml")).unwrap();
    write("unknown.toml", &recipe.replacen("template =", "tamplate =", 1));
    write("newer.toml", &recipe.replacen("version = 1", "version = 2", 1));
    write("loose.toml", &recipe.replacen("iterations = 1", "iterations = 0", 1));
    write("ragged.csv", "subject,body\nbob,a.ply,b.ply\n");
    write("twice.csv", "subject\nbob\nbob\n");
    write("key.csv", "subject,torso\nbob,a.ply\n");
    write("slash.csv", "subject\n../bob\n");
    write("none.csv", "subject,body\n");
    let line = |of: &str, key: &str| {
        let text = std::fs::read_to_string(dir.path().join(of)).unwrap();
        format!("{of}, line {}", 1 + text.lines().position(|l| l.starts_with(key)).unwrap())
    };
    let before = fingerprint(dir.path());
    for (args, code, says) in [
        ("alice --into bob --set torso=a.ply", 2, "'torso' is not a key of this recipe".to_string()),
        ("alice --into bob --set body=nowhere.ply", 2, "there is no file 'nowhere.ply'".into()),
        ("alice --into bob --set tshirt.until=nose", 2, "'nose'".into()),
        ("alice --into bob --set tshirt.stack.clearance=-1", 2, "clearance of the stage stack cannot be '-1'".into()),
        ("alice --into bob --set tshirt.stack.speed=1", 2, "the stage stack has no parameter 'speed'".into()),
        ("alice --into bob --set body", 2, "'body' has no key or no =".into()),
        ("nowhere.toml --into bob", 2, "there is no file 'nowhere.toml'".into()),
        ("unknown.toml --into bob", 1, format!("{}: unknown field `tamplate`", line("unknown.toml", "tamplate"))),
        ("newer.toml --into bob", 1, format!("{}: layout 2", line("newer.toml", "version"))),
        ("loose.toml --into bob", 1, format!("{}: iterations", line("loose.toml", "iterations = 0"))),
        ("alice --into alice/artefacts", 2, "is not empty".into()),
        ("alice --into bob --subjects ragged.csv", 1, "ragged.csv, line 2: the line has 3 cells".into()),
        ("alice --into bob --subjects twice.csv", 1, "twice.csv, line 3: there is already a subject 'bob'".into()),
        ("alice --into bob --subjects key.csv", 1, "key.csv, line 2: 'torso' is not a key of this recipe".into()),
        ("alice --into bob --subjects slash.csv", 1, "slash.csv, line 2: '../bob' cannot be".into()),
        ("alice --into bob --subjects none.csv", 1, "none.csv, line 1: there is no subject in it".into()),
        ("alice --into bob --jobs 2", 2, "--subjects".into()),
    ] {
        let answer = overcoat(dir.path(), &[&["replay"], args.split(' ').collect::<Vec<_>>().as_slice()].concat());
        assert!(answer.code == code && answer.stderr.contains(&says), "{args}: wanted '{says}' of {answer:?}");
        assert!(answer.stderr.lines().count() <= 2, "one sentence, one hint: {answer:?}");
        assert!(fingerprint(dir.path()) == before, "{args} changed something");
    }
    overcoat_ok(dir.path(), &["new", "carol"]);
    let scan = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/0-body.ply");
    overcoat_ok(dir.path(), &["-C", "carol", "scan", "body", text(&scan)]);
    let other = overcoat(dir.path(), &["replay", "alice", "--into", "carol"]);
    assert!(other.code == 2 && other.stderr.contains("a session of another recipe in 'carol'"), "{other:?}");
}
