//! Nothing is lost: kills at any moment, full disks, read-only folders, two writers, damaged files.

use crate::common::{built_quick_session, fingerprint, overcoat, overcoat_ok, quick_session, session_with_two_scans};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A session as a person might go through it, each command with what makes it quick.
const SCRIPT: [&str; 20] = [
    "new",
    "scan body SCANS/0-body.ply --faces 4000",
    "fit body --samples 300 --iterations 4 --register-iterations 1",
    "scan tshirt SCANS/1-tshirt.ply --template tshirt --faces 4000",
    "fit tshirt --samples 300 --iterations 4",
    "build",
    "mask tshirt DIR/dab.jsonl",
    "build",
    "undo",
    "redo",
    "branch other",
    "stack tshirt --clearance 0.003",
    "branch main",
    "build --force tshirt/stack",
    "templates add singlet DIR/singlet.ply --like tshirt",
    "step set tshirt template=singlet",
    "undo",
    "step rename tshirt shirt",
    "animate walk --mode lbs --frames 60..70",
    // Ends in peace: the next writer completes what a killed one had decided, and sweeps away what it left.
    "build",
];

/// Recipe and state, as the journal names them.
type Point = (String, String);

fn points(session: &Path) -> Vec<Point> {
    let text = std::fs::read_to_string(session.join("journal.jsonl")).unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let of = |line: &str| {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        (line["recipe"].to_string(), line["state"].to_string())
    };
    whole.lines().map(of).collect()
}

/// One command of the script on the session in `dir`.
fn command(dir: &Path, session: &Path, line: &str) -> Command {
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
    let line = line.replace("SCANS", scans.to_str().unwrap()).replace("DIR", dir.to_str().unwrap());
    let mut command = Command::new(env!("CARGO_BIN_EXE_overcoat"));
    command.arg("-C").arg(session).args(line.split(' ')).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// A session that was never killed: for each command how long it took, and where it led.
struct Reference {
    took: Vec<Duration>,
    led_to: Vec<Vec<Point>>,
    files: BTreeMap<PathBuf, blake3::Hash>,
}

/// What a session comes to: recipe, state, and all that the stages made.
fn results(session: &Path) -> BTreeMap<PathBuf, blake3::Hash> {
    let state: serde_json::Value =
        serde_json::from_slice(&std::fs::read(session.join("session.json")).unwrap()).unwrap();
    let mut names: BTreeSet<PathBuf> = ["recipe.toml", "session.json"].map(PathBuf::from).into();
    for step in state["steps"].as_array().unwrap() {
        let outputs = step["stages"].as_object().unwrap().values().map(|record| record["output"].as_str().unwrap());
        names.extend(outputs.map(|name| Path::new("artefacts").join(name)));
    }
    fingerprint(session).into_iter().filter(|(file, _)| names.contains(file)).collect()
}

fn reference(dir: &Path) -> Reference {
    let session = dir.join("whole");
    let dab = r#"{"layer":"tshirt","op":"erase","radius":0.03,"points":[[-0.22,1.262,-0.008]]}"#;
    std::fs::write(dir.join("dab.jsonl"), dab).unwrap();
    overcoat_ok(dir, &["templates", "paint", "tshirt", "singlet.ply"]);
    let (mut took, mut led_to) = (Vec::new(), Vec::new());
    for line in SCRIPT {
        let (before, began) = (points(&session).len(), Instant::now());
        assert!(command(dir, &session, line).status().unwrap().success(), "{line}");
        took.push(began.elapsed());
        led_to.push(points(&session)[before..].to_vec());
    }
    let files = results(&session);
    assert!(files.len() > 2 + 10, "recipe, state, and what each stage made");
    Reference { took, led_to, files }
}

/// A small generator with a seed (Marsaglia's xorshift).
struct Chance(u64);

impl Chance {
    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Goes through the script and kills every command at random moments, up to three times, before it may end. Gives the
/// number of kills.
fn killed_session(dir: &Path, name: &str, whole: &Reference, chance: &mut Chance) -> usize {
    let session = dir.join(name);
    let mut kills = 0;
    for (i, line) in SCRIPT.iter().enumerate() {
        let before = points(&session);
        let mut allowed: Vec<&Point> = whole.led_to[i].iter().collect();
        allowed.extend(before.last());
        let (is_move, idempotent) =
            (line.starts_with("branch"), ["build", "fit", "stack"].iter().any(|c| line.starts_with(c)));
        let is_done = |now: &[Point]| match (is_move, whole.led_to[i].last()) {
            (true, _) | (_, None) => now.len() > before.len(),
            (false, Some(last)) => now.len() > before.len() && now.last() == Some(last),
        };
        for _ in 0..3 {
            let mut child = command(dir, &session, line).spawn().unwrap();
            std::thread::sleep(whole.took[i].mul_f64(chance.share() * 1.1));
            // SIGKILL: nothing in the program can answer it.
            child.kill().unwrap();
            let ended = child.wait().unwrap();
            kills += usize::from(!ended.success());
            let now = points(&session);
            assert!(now.last().is_none_or(|p| allowed.contains(&p)), "{line}: neither before nor after the step");
            if session.join("journal.jsonl").exists() {
                let status = overcoat(&session, &["status", "--json"]);
                assert_eq!(status.code, 0, "{line}: {status:?}");
            }
            if is_done(&now) {
                break;
            }
        }
        if !is_done(&points(&session)) || idempotent {
            let ended = command(dir, &session, line).stderr(Stdio::piped()).output().unwrap();
            assert!(ended.status.success(), "{line}, after a kill: {}", String::from_utf8_lossy(&ended.stderr));
        }
    }
    assert!(results(&session) == whole.files, "the bytes of a session never killed");
    let fsck = overcoat_ok(&session, &["fsck", "--check", "--json"]).json();
    assert_eq!(fsck["damages"], serde_json::json!([]), "{fsck}");
    let left = fingerprint(&session).into_keys().filter(|f| f.to_string_lossy().contains(".unfinished-")).count();
    assert_eq!(left, 0, "what a killed writer left is swept away by the next");
    kills
}

fn kill(times: usize, seed: u64) {
    let dir = tempfile::tempdir().unwrap();
    let whole = reference(dir.path());
    let mut chance = Chance(seed);
    let (mut kills, mut sessions) = (0, 0);
    while kills < times {
        sessions += 1;
        kills += killed_session(dir.path(), &format!("killed{sessions}"), &whole, &mut chance);
    }
    println!(
        "{kills} kills in {sessions} sessions: each opened, held the state before or after, and ended with the same bytes"
    );
}

#[test]
fn a_session_killed_at_random_moments_ends_with_the_bytes_of_one_never_killed() {
    kill(10, 0x0dd5);
}

#[test]
fn what_killed_writers_left_is_swept_away_in_every_folder() {
    let dir = tempfile::tempdir().unwrap();
    let session = dir.path().join("session");
    assert!(command(dir.path(), &session, "new").status().unwrap().success());
    let left = ["", "artefacts", "derived", "templates"].map(|folder| session.join(folder).join(".unfinished-x"));
    for file in &left {
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, "half").unwrap();
    }
    overcoat_ok(&session, &["branch", "other"]);
    assert!(left.iter().all(|file| !file.exists()), "{:?}", fingerprint(&session).keys());
}

#[test]
#[ignore = "takes minutes: `just kills`"]
fn a_thousand_kills() {
    kill(1000, 0xc0a7);
}

#[test]
fn of_two_writers_one_waits_and_a_killed_one_holds_no_lock() {
    let dir = tempfile::tempdir().unwrap();
    let session = quick_session(dir.path(), "alice");
    let mut first = command(dir.path(), &session, "build").spawn().unwrap();
    // Until it has the lock, which is as soon as it is named there.
    let holder = loop {
        let text = std::fs::read_to_string(session.join("lock")).unwrap_or_default();
        if text.contains("build") {
            break text;
        }
        assert!(first.try_wait().unwrap().is_none(), "it ended before it was seen to hold the lock");
    };
    assert!(holder.starts_with(&format!("process {}, overcoat", first.id())), "{holder}");
    let mut second = command(dir.path(), &session, "build").spawn().unwrap();
    assert_eq!(overcoat(&session, &["status"]).code, 0, "readers need no lock");
    first.kill().unwrap();
    first.wait().unwrap();
    assert!(second.wait().unwrap().success());
    overcoat_ok(&session, &["build"]);
    assert_eq!(std::fs::read_to_string(session.join("lock")).unwrap(), "");
}

#[test]
fn a_journal_cut_anywhere_leaves_the_state_of_its_last_whole_line() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    overcoat_ok(&session, &["undo"]);
    let journal = session.join("journal.jsonl");
    let whole = std::fs::read(&journal).unwrap();
    let lines = points(&session);
    for cut in 0..whole.len() {
        std::fs::write(&journal, &whole[..cut]).unwrap();
        let session = overcoat::session::Session::open(&session).unwrap();
        let ends = whole[..cut].iter().filter(|&&b| b == b'\n').count();
        let is_clean = cut == 0 || whole[cut - 1] == b'\n';
        assert_eq!(session.notices().is_empty(), is_clean, "cut at byte {cut}");
        if ends > 0 {
            let steps = session.recipe().steps.len();
            let expected = if lines[ends - 1] == lines[1] { 1 } else { ends - 1 };
            assert_eq!(steps, expected, "cut at byte {cut}");
        }
    }
}

#[test]
fn every_damaged_artefact_is_named_and_rebuilt() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    overcoat_ok(&session, &["stack", "tshirt", "--clearance", "0.003"]);
    overcoat_ok(&session, &["build"]);
    let before = fingerprint(&session);
    let now = results(&session);
    let named: Vec<&PathBuf> = before.keys().filter(|f| f.starts_with("artefacts")).collect();
    for (i, file) in named.iter().enumerate() {
        let path = session.join(file);
        if i % 2 == 0 {
            std::fs::remove_file(path).unwrap();
        } else {
            std::fs::write(path, b"rust").unwrap();
        }
    }
    let check = overcoat(&session, &["fsck", "--check", "--json"]);
    assert_eq!(check.code, 1);
    let reported: BTreeSet<PathBuf> =
        check.json()["damages"].as_array().unwrap().iter().map(|d| d["file"].as_str().unwrap().into()).collect();
    // Of what only lost texts of the past named, a missing file leaves no trace.
    let must = now.keys().chain(named.iter().copied().filter(|f| session.join(f).exists()));
    let unreported: Vec<&PathBuf> = must.filter(|f| f.starts_with("artefacts") && !reported.contains(*f)).collect();
    assert!(unreported.is_empty(), "{unreported:?}");
    let report = overcoat(&session, &["fsck", "--json"]);
    let report_json = report.json();
    // What can be made again: the scans' copies, the texts of now, and every result of now.
    let damages = report_json["damages"].as_array().unwrap();
    let not: Vec<&str> =
        damages.iter().filter(|d| d["outcome"] != "mended").map(|d| d["what"].as_str().unwrap()).collect();
    assert!(not.iter().all(|what| what.contains(" after change ")), "only texts of the past are lost: {not:#?}");
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!(status["up_to_date"], true, "{status}");
    assert!(results(&session) == now, "the very bytes");
    let again = overcoat(&session, &["fsck", "--check", "--json"]).json();
    assert!(again["damages"].as_array().unwrap().len() <= not.len(), "{again}");
    overcoat_ok(&session, &["export", "layers/"]);
}

#[test]
fn an_old_result_is_rebuilt_by_the_state_in_which_it_was_current() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let first = results(&session);
    // The figure is stale after the stack alone ran: that state still names the old one.
    overcoat_ok(&session, &["stack", "tshirt", "--clearance", "0.003"]);
    overcoat_ok(&session, &["build"]);
    let now = results(&session);
    let gone: Vec<&PathBuf> = first.keys().filter(|f| !now.contains_key(*f)).collect();
    assert!(gone.len() >= 2, "{gone:?}");
    gone.iter().for_each(|file| std::fs::write(session.join(file), b"rust").unwrap());
    let report = overcoat_ok(&session, &["fsck", "--json"]).json();
    assert_eq!((report["sound"].as_bool(), report["damages"].as_array().unwrap().len()), (Some(true), gone.len()));
    overcoat_ok(&session, &["undo"]);
    assert!(results(&session) == first);
}

#[test]
fn results_of_the_past_and_of_other_branches_are_rebuilt_too() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    overcoat_ok(&session, &["branch", "other"]);
    overcoat_ok(&session, &["stack", "tshirt", "--clearance", "0.003"]);
    overcoat_ok(&session, &["build"]);
    let there = results(&session);
    overcoat_ok(&session, &["branch", "main"]);
    let here = results(&session);
    let gone: Vec<&PathBuf> = there.keys().filter(|f| !here.contains_key(*f)).collect();
    assert!(gone.len() >= 2, "the branch has results of its own");
    gone.iter().for_each(|file| std::fs::remove_file(session.join(file)).unwrap());
    let report = overcoat_ok(&session, &["fsck", "--json"]).json();
    assert_eq!((report["sound"].as_bool(), report["damages"].as_array().unwrap().len()), (Some(true), gone.len()));
    assert!(report["damages"][0]["what"].as_str().unwrap().starts_with("the result of tshirt, "), "{report}");
    overcoat_ok(&session, &["branch", "other"]);
    assert!(results(&session) == there);
}

#[test]
fn a_journal_broken_in_the_middle_is_refused_with_its_line_and_repaired_by_fsck() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let journal = session.join("journal.jsonl");
    let whole = std::fs::read_to_string(&journal).unwrap();
    let broken: Vec<String> =
        whole.lines().enumerate().map(|(i, line)| if i == 1 { line.replace(':', ";") } else { line.into() }).collect();
    std::fs::write(&journal, broken.join("\n") + "\n").unwrap();
    let before = fingerprint(&session);
    for args in [vec!["build"], vec!["status"], vec!["undo"], vec!["fsck", "--check"]] {
        let answer = overcoat(&session, &args);
        assert!(answer.code == 1 && answer.stderr.contains("journal"), "{args:?}: {answer:?}");
        assert!(answer.stderr.contains("line 2"), "{args:?}: {answer:?}");
    }
    assert!(fingerprint(&session) == before);
    overcoat_ok(&session, &["fsck"]);
    // The line alone is lost, and kept aside: those after it say all that they lead to.
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!(status["steps"].as_array().unwrap().len(), 2);
    assert_eq!(std::fs::read_to_string(session.join("journal.broken.jsonl")).unwrap(), broken[1].clone() + "\n");
    overcoat_ok(&session, &["undo"]);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::process::CommandExt;

    fn allow(path: &Path, mode: u32) {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    }

    fn is_root() -> bool {
        let id = Command::new("id").arg("-u").output().unwrap();
        String::from_utf8_lossy(&id.stdout).trim() == "0"
    }

    /// Runs the program as someone whom permissions hold back: root as nobody.
    fn held_back(dir: &Path, session: &Path, args: &[&str]) -> crate::common::Answer {
        let program = dir.join("overcoat");
        if !program.exists() {
            // Where the program was built, nobody may not look.
            std::fs::copy(env!("CARGO_BIN_EXE_overcoat"), &program).unwrap();
        }
        let mut command = Command::new(&program);
        command.args(args).current_dir(session);
        if is_root() {
            command.uid(65534).gid(65534);
        }
        let output = command.output().unwrap();
        crate::common::Answer {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    #[test]
    fn a_read_only_folder_is_read_and_reported() {
        let dir = tempfile::tempdir().unwrap();
        allow(dir.path(), 0o755);
        let session = session_with_two_scans(dir.path());
        allow(&session, 0o555);
        allow(&session.join("artefacts"), 0o555);
        allow(&session.join("lock"), 0o444);
        let before = fingerprint(&session);
        for args in [vec!["undo"], vec!["build"], vec!["fsck"], vec!["scan", "hat", "../body.ply", "--template", "hat"]]
        {
            let answer = held_back(dir.path(), &session, &args);
            assert_eq!(answer.code, 1, "{args:?}: {answer:?}");
            assert!(answer.stderr.contains("cannot be written: Permission denied"), "{args:?}: {answer:?}");
            assert!(!answer.stderr.contains(".unfinished"), "{args:?}: {answer:?}");
        }
        for args in [vec!["status"], vec!["log"], vec!["branch"], vec!["fsck", "--check"]] {
            assert_eq!(held_back(dir.path(), &session, &args).code, 0, "{args:?}");
        }
        assert!(fingerprint(&session) == before);
        allow(&session, 0o755);
        allow(&session.join("artefacts"), 0o755);
    }

    /// A small disk of its own, gone when dropped.
    struct SmallDisk(PathBuf);

    impl SmallDisk {
        fn mount(at: &Path, kib: usize) -> Self {
            std::fs::create_dir_all(at).unwrap();
            let size = format!("size={kib}k");
            let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", &size, "tmpfs"]).arg(at).status().unwrap();
            assert!(mounted.success(), "only root can mount");
            Self(at.to_path_buf())
        }

        fn resize(&self, kib: usize) {
            let size = format!("remount,size={kib}k");
            assert!(Command::new("mount").args(["-o", &size]).arg(&self.0).status().unwrap().success());
        }
    }

    impl Drop for SmallDisk {
        fn drop(&mut self) {
            let _ = Command::new("umount").arg("-l").arg(&self.0).status();
        }
    }

    #[test]
    #[ignore = "mounts a small disk, which only root can: `just disk-full`"]
    fn a_full_disk_is_reported_and_nothing_is_lost() {
        let dir = tempfile::tempdir().unwrap();
        let whole = built_quick_session(dir.path(), "whole");
        let disk = SmallDisk::mount(&dir.path().join("disk"), 64);
        let session = disk.0.join("alice");
        std::fs::create_dir(&session).unwrap();
        std::fs::copy(whole.join("recipe.toml"), session.join("recipe.toml")).unwrap();
        let (mut refused, mut kib) = (0, 64);
        // A little more room each time: the disk is full at another moment of the work.
        loop {
            let steps = overcoat(&session, &["status", "--json"]);
            assert_eq!(steps.code, 0, "{steps:?}");
            let answer = overcoat(&session, &["build", "-q"]);
            if answer.code == 0 {
                break;
            }
            assert_eq!(answer.code, 1, "{answer:?}");
            assert!(answer.stderr.contains("cannot be written: No space left"), "{answer:?}");
            assert_eq!(answer.stderr.lines().count(), 2, "{answer:?}");
            refused += 1;
            kib += 96;
            disk.resize(kib);
        }
        println!("refused {refused} times, at {kib} KiB there was room");
        assert!(refused > 20);
        assert!(results(&session) == results(&whole));
        let fsck = overcoat_ok(&session, &["fsck", "--check", "--json"]).json();
        assert_eq!(fsck["damages"], serde_json::json!([]), "{fsck}");
    }
}
