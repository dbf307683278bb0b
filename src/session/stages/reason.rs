//! Why a stage is out of date: compares the inputs of its result with the current ones.

use crate::session::recipe::as_text;
use crate::session::stage::Stage;
use crate::session::store::StageRecord;
use serde::Serialize;
use serde_json::Value;
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

/// The differences between the record and the current `version` of the code and `inputs`. Empty if there are none.
pub(super) fn reasons(record: &StageRecord, stage: Stage, version: u32, inputs: &Value) -> Vec<Reason> {
    let mut found = Vec::new();
    if record.code != 0 && record.code != version {
        found.push(Reason { old: record.code.into(), new: version.into(), ..Reason::of(Cause::Code) });
    }
    for (key, old, new) in differing(&record.from, inputs) {
        match key.as_str() {
            "params" | "fusion" => found.extend(inner(Cause::Parameter, old, new)),
            "kind" if new.is_object() => found.extend(kind(old, new)),
            "kind" | "file" | "pictures" => found.push(Reason::of(Cause::File)),
            "masks" => found.push(Reason::of(Cause::Masks)),
            "model" => found.push(Reason::of(Cause::BodyModel)),
            // A parameter switches these inputs on and off; report the parameter.
            "others" if old.is_null() || new.is_null() => {}
            "clip" => found.push(Reason::of(Cause::Clip)),
            "fps" | "frames" => found.push(Reason::named(Cause::Parameter, &key, old, new)),
            "name" => found.push(Reason::named(Cause::Parameter, "name", old, new)),
            "loops" => found.push(Reason::named(Cause::Kind, "hems", old, new)),
            key => found.push(Reason::named(Cause::Upstream, upstream(key, stage), &Value::Null, &Value::Null)),
        }
    }
    found.dedup();
    found
}

/// The fields of two objects that differ, by name in order.
fn differing<'a>(old: &'a Value, new: &'a Value) -> Vec<(String, &'a Value, &'a Value)> {
    const NONE: &Value = &Value::Null;
    let (Value::Object(old), Value::Object(new)) = (old, new) else { return Vec::new() };
    let mut names: Vec<&String> = old.keys().chain(new.keys()).collect();
    names.sort();
    names.dedup();
    let pair = |name: &String| (name.clone(), old.get(name).unwrap_or(NONE), new.get(name).unwrap_or(NONE));
    names.into_iter().map(pair).filter(|(_, old, new)| old != new).collect()
}

fn inner(cause: Cause, old: &Value, new: &Value) -> Vec<Reason> {
    differing(old, new).into_iter().map(|(name, old, new)| Reason::named(cause, &name, old, new)).collect()
}

fn kind(old: &Value, new: &Value) -> Vec<Reason> {
    let mut found = inner(Cause::Kind, &old["extent"], &new["extent"]);
    match old["template"] == new["template"] {
        false => found.insert(0, Reason::named(Cause::Kind, "template", &old["template"], &new["template"])),
        true if found.is_empty() => {
            found.push(Reason::named(Cause::Upstream, "the template", &Value::Null, &Value::Null))
        }
        true => {}
    }
    found
}

/// The kind of the input with that name.
fn upstream(key: &str, stage: Stage) -> &str {
    match key {
        "kinds" | "place" => "the garments of the outfit",
        "figure" if stage == Stage::Press => "figure",
        "fitted" => "fit",
        "registered" => "register",
        "others" => "the other scans",
        "figure" => "the step before",
        "start" => "the pose of the step before",
        "inside" => "pose",
        "labels" => "segment",
        "garment" => "cut",
        "rigged" => "rig",
        "stacked" => "stack",
        other => other,
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
        let reported: Vec<String> = reasons(&record, Stage::Segment, 2, &new).iter().map(Reason::to_string).collect();
        assert_eq!(reported, ["until Hip → Knee", "the result of segment", "the masks", "color 1.0 → 0.5"]);
        assert_eq!(reasons(&record, Stage::Segment, 2, &old), []);
        let older = StageRecord { code: 9, ..record };
        assert_eq!(reasons(&older, Stage::Segment, 2, &old)[0].to_string(), "the stage's code: version 9 → 2");
    }
}
