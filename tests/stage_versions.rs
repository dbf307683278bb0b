//! A stage whose output changes needs a new version, or sessions built before keep results that no longer can be made.
//!
//! A small fixed session is built, and the outputs of each stage are compared with the hashes in
//! `src/session/pipeline/output_hashes.txt`. `just stage-hashes` refreshes that file, unless an output changed for equal
//! inputs and the stage's version did not. Only scans that are meshes are built: the fusion of RGB-D frames has tests of
//! its own.
//!
//! The hashes hold for processors with AVX2 and FMA, where fused operations round once. Elsewhere this test is skipped and
//! says so.

use crate::common::{QUICK_RECIPE, SKIRT_AND_CLIPS, on_demo_scans, overcoat_ok};
use overcoat::session::{Forced, Session, Stage, Writer};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

/// Set to write the file instead of comparing with it.
const REFRESH: &str = "OVERCOAT_REFRESH_STAGE_HASHES";

/// What the file says of a stage.
#[derive(Clone, Debug, PartialEq)]
struct Pinned {
    version: u32,
    /// Hash of everything that the outputs depend on but the version.
    inputs: String,
    outputs: String,
}

#[test]
fn an_output_changes_only_with_its_stages_version() {
    if !has_fused_operations() {
        println!("skipped: this processor has no AVX2 and FMA, and the hashes hold only with them");
        return;
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/session/pipeline/output_hashes.txt");
    let (known, found) = (parse(&std::fs::read_to_string(&file).unwrap_or_default()), measured());
    let complaints: Vec<String> =
        found.iter().filter_map(|(stage, now)| unversioned(*stage, known.get(stage)?, now)).collect();
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    if std::env::var_os(REFRESH).is_some() {
        std::fs::write(&file, text(&found)).unwrap();
        return;
    }
    let differing = Stage::all().filter(|stage| known.get(stage) != found.get(stage));
    let names: Vec<String> = differing.map(|stage| stage.to_string()).collect();
    assert!(
        names.is_empty(),
        "the versions, inputs or outputs of {} are not those of {}: run `just stage-hashes`",
        names.join(", "),
        file.display()
    );
}

/// What to do about a stage whose outputs changed although neither its inputs nor its version did.
fn unversioned(stage: Stage, known: &Pinned, now: &Pinned) -> Option<String> {
    let is_changed = known.outputs != now.outputs && (known.version, &known.inputs) == (now.version, &now.inputs);
    is_changed.then(|| {
        format!(
            "the output of the stage {stage} changed: bump its version in src/session/pipeline/stages/{stage}.rs from {} to {}, then run \
             `just stage-hashes`",
            now.version,
            now.version + 1
        )
    })
}

#[test]
fn a_changed_output_is_told_from_changed_inputs_and_from_a_new_version() {
    let pinned =
        |version, inputs: &str, outputs: &str| Pinned { version, inputs: inputs.into(), outputs: outputs.into() };
    let known = pinned(3, "a", "b");
    let complaint = unversioned(Stage::Cut, &known, &pinned(3, "a", "c")).unwrap();
    assert!(complaint.contains("cut.rs from 3 to 4"), "{complaint}");
    let named = complaint.split_whitespace().find(|word| word.starts_with("src/")).unwrap();
    assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(named).is_file(), "{named}");
    for allowed in [pinned(3, "a", "b"), pinned(4, "a", "c"), pinned(3, "x", "c"), pinned(4, "a", "b")] {
        assert_eq!(unversioned(Stage::Cut, &known, &allowed), None, "{allowed:?}");
    }
}

fn has_fused_operations() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// A garment with buttons from a file, in place of the skirt.
const VEST: &str = r#"
[[step]]
name = "vest"
scan = "../sewn/vest-M.obj"
template = "vest"
tryon = true
"#;

/// Builds a session of scans, and one with a garment from a file, and hashes what their stages read and made.
fn measured() -> BTreeMap<Stage, Pinned> {
    let dir = tempfile::tempdir().unwrap();
    overcoat_ok(dir.path(), &["studio", "garment", "--kind", "vest", "--form", "buttoned", "--out", "sewn"]);
    let built = [("scans", SKIRT_AND_CLIPS), ("vest", VEST)].map(|(name, more)| {
        let folder = dir.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        std::fs::write(folder.join("recipe.toml"), on_demo_scans(&format!("{QUICK_RECIPE}{more}"))).unwrap();
        Writer::open(&folder).unwrap().build(&Forced::Nothing, &mut |_| {}).unwrap();
        Session::open(&folder).unwrap()
    });
    let [scans, vest] = built.each_ref().map(|session| session.state().steps.iter());
    let steps: Vec<_> = scans.chain(vest.filter(|step| step.name == "vest")).collect();
    let of_stage = |stage: Stage| {
        let (mut inputs, mut outputs) = (String::new(), String::new());
        let mut version = None;
        for step in &steps {
            let Some(record) = step.stages.get(&stage) else { continue };
            // A garment from a file has code of its own for some stages.
            writeln!(inputs, "{} {} {}", step.name, record.code, record.from).unwrap();
            writeln!(outputs, "{} {}", step.name, record.output).unwrap();
            version = version.or(Some(record.code));
        }
        let version = version.unwrap_or_else(|| panic!("the stage {stage} ran in no step"));
        let short = |text: &str| blake3::hash(text.as_bytes()).to_hex()[..16].to_string();
        Pinned { version, inputs: short(&inputs), outputs: short(&outputs) }
    };
    Stage::all().map(|stage| (stage, of_stage(stage))).collect()
}

fn text(found: &BTreeMap<Stage, Pinned>) -> String {
    let mut text =
        String::from("# Stage, version, hash of its inputs, hash of its outputs. Written by `just stage-hashes`.\n");
    for (stage, Pinned { version, inputs, outputs }) in found {
        writeln!(text, "{stage} {version} {inputs} {outputs}").unwrap();
    }
    text
}

fn parse(text: &str) -> BTreeMap<Stage, Pinned> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let [stage, version, inputs, outputs] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}") };
            let stage = Stage::parse(stage).unwrap_or_else(|| panic!("there is no stage {stage}"));
            let pinned = Pinned { version: version.parse().unwrap(), inputs: inputs.into(), outputs: outputs.into() };
            (stage, pinned)
        })
        .collect()
}
