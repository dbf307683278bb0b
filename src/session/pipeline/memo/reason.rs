//! Why a stage is out of date: compares the inputs of its result with the current ones.

use crate::session::recipe::as_text;
use crate::session::store::StageRecord;
use serde::Serialize;
use serde_json::{Map, Value};
use std::collections::BTreeSet;
use std::fmt;

/// The kind of change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// It has no result yet.
    NeverRan,
    /// The user asked for it.
    Forced,
    /// Its result is not among the artefacts.
    ResultMissing,
    /// The code of the stage.
    Code,
    /// A parameter.
    Parameter,
    /// The scan's file.
    File,
    /// The clip's file.
    Clip,
    /// Labels given by hand.
    Masks,
    /// The garment's kind, or how far it reaches.
    Kind,
    /// The body model.
    BodyModel,
    /// The result of another stage.
    Upstream,
    /// An input that older records do not contain.
    Unknown,
}

impl Cause {
    /// Whether a change of that input of a stage has a meaning in words.
    pub fn of_input(name: &str) -> bool {
        FIELDS.iter().any(|(field, _)| *field == name)
    }
}

/// One change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reason {
    /// Its kind.
    pub cause: Cause,
    /// The name of the input, if there are several of the kind.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its old value.
    #[serde(skip_serializing_if = "Value::is_null")]
    pub old: Value,
    /// Its new value.
    #[serde(skip_serializing_if = "Value::is_null")]
    pub new: Value,
}

impl Reason {
    pub(in crate::session) fn of(cause: Cause) -> Self {
        Self { cause, name: None, old: Value::Null, new: Value::Null }
    }

    fn upstream(name: &str) -> Self {
        Self { name: Some(name.into()), ..Self::of(Cause::Upstream) }
    }

    fn named(cause: Cause, name: &str, old: &Value, new: &Value) -> Self {
        Self { cause, name: Some(name.into()), old: old.clone(), new: new.clone() }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name.as_deref().unwrap_or_default();
        let text = |value: &Value| if value.is_null() { "none".into() } else { as_text(value) };
        match self.cause {
            Cause::NeverRan => f.write_str("never ran"),
            Cause::Forced => f.write_str("forced"),
            Cause::ResultMissing => f.write_str("its result is missing"),
            Cause::Code => write!(f, "the stage's code: version {} → {}", text(&self.old), text(&self.new)),
            Cause::Parameter | Cause::Kind => write!(f, "{name} {} → {}", text(&self.old), text(&self.new)),
            Cause::File => f.write_str("the scan's file"),
            Cause::Clip => f.write_str("the clip"),
            Cause::Masks => f.write_str("the masks"),
            Cause::BodyModel => f.write_str("the body model"),
            Cause::Upstream => write!(f, "the result of {name}"),
            Cause::Unknown => f.write_str("what it was made from"),
        }
    }
}

/// What a change of an input means to a person.
#[derive(Clone, Copy, PartialEq)]
enum Meaning {
    /// The thing itself has changed.
    Is(Cause),
    /// One parameter.
    Parameter(&'static str),
    /// Several parameters, by name.
    Parameters,
    /// The kind of the garment: its template, and how far it reaches.
    Kind,
    /// The kinds of the garments of a scan.
    Kinds,
    /// Something that was made, in these words.
    Made(&'static str),
}

/// Every field of the inputs of every stage; a test compares them with the records of built sessions.
const FIELDS: [(&str, Meaning); 42] = [
    ("file", Meaning::Is(Cause::File)),
    ("masks", Meaning::Is(Cause::Masks)),
    ("model", Meaning::Is(Cause::BodyModel)),
    ("clip", Meaning::Is(Cause::Clip)),
    ("params", Meaning::Parameters),
    ("fusion", Meaning::Parameters),
    ("fabrics", Meaning::Parameters),
    ("name", Meaning::Parameter("name")),
    ("fabric", Meaning::Parameter("fabric")),
    ("unit", Meaning::Parameter("unit")),
    ("height", Meaning::Parameter("height")),
    ("fps", Meaning::Parameter("fps")),
    ("clip_name", Meaning::Parameter("clip_name")),
    ("frames", Meaning::Parameter("frames")),
    ("skinning", Meaning::Parameter("skinning")),
    ("mode", Meaning::Parameter("mode")),
    ("solver", Meaning::Parameter("solver")),
    ("kind", Meaning::Kind),
    ("kinds", Meaning::Kinds),
    ("is_outfit", Meaning::Made("the garments of the outfit")),
    ("place", Meaning::Made("the garments of the outfit")),
    ("beside", Meaning::Made("what else the scan shows")),
    ("if_nothing", Meaning::Made("the garments of the outfit")),
    ("is_hair", Meaning::Made("the hair")),
    ("hair", Meaning::Made("fit")),
    ("same_as", Meaning::Made("the step with the same file")),
    ("others", Meaning::Made("the other scans")),
    ("estimate", Meaning::Made("what is known of the person")),
    ("is_estimated", Meaning::Made("whether a scan shows the bare body")),
    ("figure", Meaning::Made("the step before")),
    ("dressed", Meaning::Made("figure")),
    ("start", Meaning::Made("the pose of the step before")),
    ("scan", Meaning::Made("scan")),
    ("fitted", Meaning::Made("fit")),
    ("registered", Meaning::Made("register")),
    ("inside", Meaning::Made("pose")),
    ("evidence", Meaning::Made("evidence")),
    ("labels", Meaning::Made("segment")),
    ("garment", Meaning::Made("cut")),
    ("rigged", Meaning::Made("rig")),
    ("stacked", Meaning::Made("stack")),
    ("track", Meaning::Made("animate")),
];

/// The differences between the record and the current `version` of the code and `inputs`. Empty if there are none.
pub(in crate::session::pipeline) fn reasons(record: &StageRecord, version: u32, inputs: &Value) -> Vec<Reason> {
    let mut found = Vec::new();
    if record.code != 0 && record.code != version {
        found.push(Reason { old: record.code.into(), new: version.into(), ..Reason::of(Cause::Code) });
    }
    for (key, old, new) in differing(&record.from, inputs) {
        // A parameter switches the other scans on and off; the parameter is reported.
        if key == "others" && (old.is_null() || new.is_null()) {
            continue;
        }
        match FIELDS.iter().find(|(name, _)| *name == key).map(|(_, meaning)| *meaning) {
            Some(Meaning::Is(cause)) => found.push(Reason::of(cause)),
            Some(Meaning::Parameter(name)) => found.push(Reason::named(Cause::Parameter, name, old, new)),
            Some(Meaning::Parameters) => found.extend(inner(Cause::Parameter, old, new)),
            Some(Meaning::Kind) => found.extend(kind(old, new)),
            Some(Meaning::Kinds) => found.extend(kinds(old, new)),
            Some(Meaning::Made(name)) => found.push(Reason::upstream(name)),
            None => found.push(Reason::upstream(&key)),
        }
    }
    found.dedup();
    found
}

/// The fields of two objects that differ, by name in order. What is no object has no fields.
fn differing<'a>(old: &'a Value, new: &'a Value) -> Vec<(String, &'a Value, &'a Value)> {
    let names = [old, new].into_iter().filter_map(Value::as_object).flat_map(Map::keys);
    let names: BTreeSet<&String> = names.collect();
    let pair = |name: &String| (name.clone(), &old[name], &new[name]);
    names.into_iter().map(pair).filter(|(_, old, new)| old != new).collect()
}

fn inner(cause: Cause, old: &Value, new: &Value) -> Vec<Reason> {
    differing(old, new).into_iter().map(|(name, old, new)| Reason::named(cause, &name, old, new)).collect()
}

fn kind(old: &Value, new: &Value) -> Vec<Reason> {
    let mut found = inner(Cause::Kind, &old["extent"], &new["extent"]);
    match old["template"] == new["template"] {
        false => found.insert(0, Reason::named(Cause::Kind, "template", &old["template"], &new["template"])),
        true if found.is_empty() => found.push(Reason::upstream("the template")),
        true => {}
    }
    found
}

fn kinds(old: &Value, new: &Value) -> Vec<Reason> {
    match (old.as_array().map(Vec::as_slice), new.as_array().map(Vec::as_slice)) {
        (Some([old]), Some([new])) => kind(old, new),
        _ => vec![Reason::upstream("the garments of the outfit")],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::store::ContentHash;
    use crate::session::store::Measures;
    use serde_json::json;

    #[test]
    fn each_kind_of_change_is_named_with_what_was_and_what_is() {
        let old = json!({
            "scan": "a", "labels": "b", "params": { "color": 1.0, "rounds": 3 }, "masks": [],
            "kind": { "template": "shirt", "read": "x", "extent": { "until": "Hip", "sleeve": null } },
        });
        let new = json!({
            "scan": "a", "labels": "c", "params": { "color": 0.5, "rounds": 3 }, "masks": ["m"],
            "kind": { "template": "shirt", "read": "x", "extent": { "until": "Knee", "sleeve": null } },
        });
        let hash = ContentHash::of(b"");
        let record = StageRecord {
            inputs: hash,
            code: 0,
            from: old.clone(),
            output: hash,
            measures: Measures::new(),
            findings: vec![],
            warnings: vec![],
        };
        let reported: Vec<String> = reasons(&record, 2, &new).iter().map(Reason::to_string).collect();
        assert_eq!(reported, ["until Hip → Knee", "the result of segment", "the masks", "color 1.0 → 0.5"]);
        assert_eq!(reasons(&record, 2, &old), []);
        let older = StageRecord { code: 9, ..record };
        assert_eq!(reasons(&older, 2, &old)[0].to_string(), "the stage's code: version 9 → 2");
    }
}
