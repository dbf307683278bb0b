//! Which stage each change puts out of date, and why; and that every input of every stage can be named.

use crate::common::{QUICK_RECIPE, SKIRT_AND_CLIPS, coarse_session, demo_scan, on_demo_scans, overcoat_ok, ran};
use overcoat::parameters::{Allowed, Setting};
use overcoat::session::{Cause, Forced, Parameter, Reason, Session, Stage, Writer, parameters_of, stages_of_animation};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The built session; its folder is only read.
fn built() -> &'static Path {
    static BUILT: OnceLock<tempfile::TempDir> = OnceLock::new();
    let dir = BUILT.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let recipe = on_demo_scans(&format!("{QUICK_RECIPE}{SKIRT_AND_CLIPS}"));
        std::fs::write(dir.path().join("recipe.toml"), recipe).unwrap();
        Writer::open(dir.path()).unwrap().build(&Forced::Nothing, &mut |_| {}).unwrap();
        dir
    });
    dir.path()
}

/// A recipe's file as a tree.
type Tree = toml::Table;

/// The session with another recipe, if that is allowed.
struct Changed {
    dir: tempfile::TempDir,
}

impl Changed {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        crate::common::copy_folder(built(), dir.path());
        Self { dir }
    }

    fn recipe(&self) -> PathBuf {
        self.dir.path().join("recipe.toml")
    }

    /// What is out of date after a change of the recipe, as `step/stage: reason; reason`; later stages wait for these. `None` if
    /// the recipe is refused then.
    fn after(&self, change: impl FnOnce(&mut Tree)) -> Option<Vec<String>> {
        let as_built = std::fs::read_to_string(built().join("recipe.toml")).unwrap();
        let mut tree: Tree = as_built.parse().unwrap();
        change(&mut tree);
        std::fs::write(self.recipe(), toml::to_string(&tree).unwrap()).unwrap();
        let session = Session::open(self.dir.path()).ok()?;
        let mut found = Vec::new();
        let said = |why: &[Reason]| why.iter().map(Reason::to_string).collect::<Vec<_>>().join("; ");
        for step in session.status().unwrap() {
            found.extend(step.why.iter().map(|(stage, why)| format!("{}/{stage}: {}", step.name, said(why))));
        }
        let waits = !found.is_empty();
        for animation in session.animations().unwrap().iter().filter(|_| !waits) {
            if !animation.why.is_empty() {
                found.push(format!("{}: {}", animation.name, said(&animation.why)));
            }
        }
        Some(found)
    }
}

fn of<'a>(tree: &'a mut Tree, list: &str, at: usize) -> &'a mut Tree {
    tree[list].as_array_mut().unwrap()[at].as_table_mut().unwrap()
}

/// A table of an item of a list; made if it is not there.
fn section<'a>(tree: &'a mut Tree, list: &str, at: usize, name: &str) -> &'a mut Tree {
    of(tree, list, at).entry(name).or_insert(Tree::new().into()).as_table_mut().unwrap()
}

/// Another allowed value than the default.
fn another(parameter: &Parameter) -> Setting {
    let default = parameter.default();
    let texts: Vec<String> = match parameter.allowed {
        Allowed::Flag => vec!["true".into(), "false".into()],
        Allowed::Word(words) => words.iter().map(|word| word.to_string()).collect(),
        Allowed::Count(..) => {
            let count: u64 = default.parse().unwrap();
            vec![(count + 1).to_string(), count.saturating_sub(1).to_string()]
        }
        Allowed::Real(..) | Allowed::Reals(..) => {
            let first: f64 = default.split(',').next().unwrap().parse().unwrap();
            [first * 1.25, first * 0.75, first + 0.5, first - 0.5].map(|number| number.to_string()).into()
        }
    };
    let allowed = texts.iter().filter(|text| **text != default).find_map(|text| parameter.read(text).ok());
    allowed.unwrap_or_else(|| panic!("{} {} has one value only: {default}", parameter.stage, parameter.name))
}

#[test]
fn each_parameter_puts_its_stage_out_of_date_and_is_the_reason() {
    let changed = Changed::new();
    assert_eq!(changed.after(|_| {}), Some(vec![]), "built");
    let mut count = 0;
    for parameter in Stage::all().flat_map(parameters_of) {
        // Their evidence is what masks correct.
        let stage = if parameter.stage == Stage::Segment { Stage::Evidence } else { parameter.stage };
        let steps: Vec<(usize, &str)> = vec![(0, "body"), (1, "tshirt")];
        let mut of_steps = 0;
        for (at, step) in steps {
            let set = another(parameter);
            let found = changed.after(|tree| {
                let value = toml::Value::try_from(&set).unwrap();
                section(tree, "step", at, parameter.stage.section().unwrap()).insert(parameter.name.into(), value);
            });
            // The other kind of step has no such parameter.
            let Some(found) = found else { continue };
            assert_eq!(found.len(), 1, "{step} {} {}: {found:?}", parameter.stage, parameter.name);
            let expected = format!("{step}/{stage}: {} ", parameter.name);
            assert!(found[0].starts_with(&expected) && !found[0].contains("; "), "{expected}: {found:?}");
            of_steps += 1;
        }
        assert!(of_steps > 0, "no step has {} {}", parameter.stage, parameter.name);
        count += of_steps;
    }
    assert!(count > 60, "{count} parameters");
}

#[test]
fn each_key_puts_out_of_date_what_depends_on_it_and_is_the_reason() {
    let changed = Changed::new();
    let dabs = changed.dir.path().join("dabs.jsonl");
    std::fs::copy(demo_scan("1-tshirt.jsonl"), &dabs).unwrap();
    let skirt = demo_scan("2-skirt.ply");
    let file = |path: &Path| -> toml::Value { path.to_str().unwrap().into() };
    let mask = Tree::from_iter([("file".to_string(), file(&dabs))]);
    let without_hash = |step: &mut Tree, scan: &Path| {
        step.remove("hash");
        step.insert("scan".into(), file(scan));
    };
    let set = |tree: &mut Tree, list: &str, at: usize, key: &str, value: toml::Value| {
        of(tree, list, at).insert(key.into(), value);
    };
    type Change<'a> = &'a dyn Fn(&mut Tree);
    let table: &[(&str, Change, &[&str])] = &[
        ("another scan", &|t| without_hash(of(t, "step", 1), &skirt), &["tshirt/scan: the scan's file"]),
        ("the unit", &|t| set(t, "step", 1, "unit", "m".into()), &["tshirt/scan: unit none → m"]),
        ("the up axis", &|t| set(t, "step", 0, "up", "y".into()), &["body/scan: up none → y"]),
        ("faces", &|t| set(t, "step", 1, "faces", 5000.into()), &["tshirt/scan: faces 4000 → 5000"]),
        ("voxels", &|t| set(t, "step", 1, "voxel_mm", 5.0.into()), &["tshirt/scan: voxel 0.004 → 0.005"]),
        ("the surface", &|t| set(t, "step", 0, "surface", "scan".into()), &["body/figure: the result of scan"]),
        ("a template", &|t| set(t, "step", 1, "template", "shirt".into()), &["tshirt/pose: template tshirt → shirt"]),
        ("where it ends", &|t| set(t, "step", 2, "until", "knee".into()), &["skirt/pose: until none → knee"]),
        ("the name", &|t| set(t, "step", 2, "name", "kilt".into()), &["kilt/scan: never ran"]),
        ("a mask", &|t| set(t, "step", 1, "mask", vec![mask.clone()].into()), &["tshirt/segment: the masks"]),
        (
            "an outfit of one",
            &|t| set(t, "step", 1, "outfit", "o".into()),
            &["tshirt/pose: the result of the garments of the outfit"],
        ),
        (
            "a step less",
            &|t| drop(t["step"].as_array_mut().unwrap().remove(1)),
            &["skirt/pose: the result of the step before; the result of the pose of the step before"],
        ),
        ("a clip", &|t| set(t, "animation", 0, "clip", "squat".into()), &["walk: the clip"]),
        ("frames per second", &|t| set(t, "animation", 0, "fps", 20.0.into()), &["walk: fps none → 20.0"]),
        ("frames", &|t| set(t, "animation", 1, "frames", "30..34".into()), &["swing: frames 30..33 → 30..34"]),
        ("the mode", &|t| set(t, "animation", 1, "mode", "post".into()), &["swing: mode coupled → post"]),
        ("the solver", &|t| set(t, "animation", 1, "solver", "rk4".into()), &["swing: solver xpbd → rk4"]),
        ("skinning", &|t| set(t, "animation", 1, "skinning", "dq".into()), &["swing: skinning lbs → dq"]),
        (
            "a fabric",
            &|t| drop(section(t, "animation", 1, "fabrics").insert("skirt".into(), "denim".into())),
            &["swing: skirt none → denim"],
        ),
        (
            "motion",
            &|t| drop(section(t, "animation", 1, "motion").insert("ease_secs".into(), 0.2.into())),
            &["swing: ease_secs 0.1 → 0.2"],
        ),
        (
            "cloth",
            &|t| drop(section(t, "animation", 1, "cloth").insert("damping".into(), 0.5.into())),
            &["swing: damping"],
        ),
        ("the body's scan", &|t| without_hash(of(t, "step", 0), &skirt), &["body/scan: the scan's file"]),
    ];
    let mut wrong = Vec::new();
    for (what, change, expected) in table {
        let found = changed.after(change).unwrap_or_else(|| vec!["the recipe is refused".into()]);
        if found.len() != expected.len() || !found.iter().zip(*expected).all(|(f, e)| f.starts_with(e)) {
            wrong.push(format!("{what}: {found:?}, not {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn each_step_has_the_stages_that_are_named_and_every_input_has_a_meaning() {
    let session = Session::open(built()).unwrap();
    let of_steps = session.recipe().steps.iter().map(|step| (step.name.clone(), step.kind().stages()));
    let of_animations = session.recipe().animations.iter();
    let of_animations = of_animations.map(|one| (format!("animation {}", one.name), stages_of_animation(one)));
    for (name, stages) in of_steps.chain(of_animations) {
        let record = session.state().steps.iter().find(|record| record.name == name);
        let ran: Vec<Stage> = record.unwrap_or_else(|| panic!("no {name}")).stages.keys().copied().collect();
        assert_eq!(ran, stages, "{name}");
    }
    let inputs: BTreeSet<String> = (session.state().steps.iter().flat_map(|step| step.stages.values()))
        .flat_map(|record| record.from.as_object().unwrap().keys().cloned())
        .collect();
    assert!(inputs.len() > 25, "{inputs:?}");
    let unknown: Vec<&String> = inputs.iter().filter(|input| !Cause::of_input(input)).collect();
    assert!(unknown.is_empty(), "no meaning in reason.rs: {unknown:?}");
}

#[test]
fn status_says_the_new_mode_of_an_animation() {
    let changed = Changed::new();
    changed.after(|tree| drop(of(tree, "animation", 1).insert("mode".into(), "post".into())));
    let status = overcoat_ok(changed.dir.path(), &["status"]).stdout;
    assert!(status.contains("mode coupled → post") && !status.contains("result of mode"), "{status}");
}

#[test]
fn warnings_have_the_names_that_the_steps_have_now() {
    let dir = tempfile::tempdir().unwrap();
    // A jacket that is not there, in the scan of the T-shirt: the check of the jacket names both.
    let shirt = demo_scan("1-tshirt.ply");
    let steps = [("body", demo_scan("0-body.ply")), ("tshirt", shirt.clone()), ("jacket", shirt)];
    let session = coarse_session(dir.path(), "alice", &steps);
    overcoat_ok(&session, &["build", "-q"]);
    let warnings = || overcoat_ok(&session, &["status", "--json"]).json()["steps"][2]["warnings"].to_string();
    let before = warnings();
    assert!(before.contains("of the step 'tshirt'") && before.contains("show no jacket"), "{before}");
    overcoat_ok(&session, &["step", "rename", "tshirt", "blouse"]);
    overcoat_ok(&session, &["step", "rename", "jacket", "blazer"]);
    let ran = ran(&overcoat_ok(&session, &["build", "--json"]).json());
    assert!(ran.iter().all(|(stage, _)| stage != "blouse/check"), "a name is no input of the check: {ran:?}");
    let after = warnings();
    assert!(after.contains("of the step 'blouse'") && after.contains("show no blazer"), "{after}");
    assert!(!after.contains("tshirt") && !after.contains("jacket"), "{after}");
}
