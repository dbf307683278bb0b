//! What all pages are told about the layers.

use super::loaded::{Loaded, hems};
use crate::cut::Garment;
use crate::geometry::PerVertex;
use serde::Serialize;
use serde_json::{Value, json};
use std::time::Duration;

/// A layer, as far as it changes while it is painted.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct LayerNews {
    pub name: String,
    /// Greater after each change of its labels.
    pub version: u64,
    /// The scan to which the labels belong.
    pub scan: String,
    /// See [`Loaded::bits`](super::loaded::Loaded::bits).
    #[serde(skip)]
    pub labels: String,
    /// Closed lines, flat x, y, z in millimetres.
    #[serde(skip)]
    pub hem_lines: Vec<Vec<i32>>,
    pub is_loaded: bool,
    pub hems: usize,
    /// How many hems its kind has, in words.
    pub expected: String,
    pub hems_are_right: bool,
    pub vertices: usize,
    /// What the cut dropped, filled or did not expect.
    pub findings: Vec<String>,
    /// The strokes of its brush file.
    pub strokes: usize,
    /// The last of them, which undo takes back.
    pub last: Option<String>,
    /// The stroke that redo paints again.
    pub redo: Option<String>,
    /// The verdict, and its class; `None` while it is out of date.
    pub verdict: Option<(String, &'static str)>,
    /// Why its labels cannot be shown.
    pub problem: Option<String>,
}

/// The news of a session.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct News {
    pub session: String,
    pub layers: Vec<LayerNews>,
    /// What happened to the session besides the strokes; the page says it once for each number.
    pub note: Option<(u64, String)>,
}

impl News {
    pub fn layer(&mut self, name: &str) -> Option<&mut LayerNews> {
        self.layers.iter_mut().find(|layer| layer.name == name)
    }

    /// For a page, with the labels of one layer if they have another version than the page has.
    pub fn value(&mut self, layer: Option<&str>, version: Option<u64>) -> Value {
        let mut value = json!(*self);
        let shown =
            layer.and_then(|name| self.layer(name)).filter(|layer| layer.is_loaded && Some(layer.version) != version);
        if let Some(layer) = shown {
            value["labels"] = json!(layer.labels);
            value["hem_lines"] = json!(layer.hem_lines);
        }
        value
    }

    pub fn say(&mut self, note: String) {
        let number = self.note.as_ref().map_or(1, |(number, _)| number + 1);
        self.note = Some((number, note));
    }
}

impl LayerNews {
    /// Takes new labels, and the garment that they cut.
    pub fn take(&mut self, loaded: &Loaded, labels: &PerVertex<bool>, garment: &Garment) {
        let (bits, lines) = (loaded.bits(labels), hems(garment));
        if self.labels != bits || self.scan != loaded.scan_name || self.hem_lines != lines {
            self.version += 1;
        }
        (self.labels, self.hem_lines, self.is_loaded, self.problem) = (bits, lines, true, None);
        self.scan.clone_from(&loaded.scan_name);
        (self.hems, self.vertices) = (garment.hem_loops.len(), garment.mesh.vertex_count());
        self.expected = match (loaded.expected_hems.start(), loaded.expected_hems.end()) {
            (_, &usize::MAX) => "any number".into(),
            (least, most) if least == most => least.to_string(),
            (least, most) => format!("{least} to {most}"),
        };
        self.hems_are_right = loaded.expected_hems.contains(&self.hems);
        self.findings.clone_from(&garment.findings);
    }

    /// Adds the layer, its labels and hems to what a page is sent.
    pub fn put_into(&self, mut value: Value) -> Value {
        value["news"] = json!(self);
        value["labels"] = json!(self.labels);
        value["hem_lines"] = json!(self.hem_lines);
        value
    }

    /// What a page is told of its request: whether it was done before, and how long it took now.
    pub fn answer(&self, was_there: bool, took: Duration) -> Value {
        self.put_into(json!({ "was_there": was_there, "ms": 1e3 * took.as_secs_f64() }))
    }
}

/// A sentence without the commands that it names: the page offers what they do. Sentences of `check` have them in parentheses
/// after what they do; another clause with a command is left out.
pub(super) fn without_commands(sentence: &str) -> String {
    let (mut kept, mut rest) = (String::new(), sentence);
    while let Some((before, command)) = rest.split_once(" (`")
        && let Some((_, after)) = command.split_once("`)")
    {
        kept += before;
        rest = after;
    }
    kept += rest;
    let clauses: Vec<&str> = kept.split("; ").filter(|clause| !clause.contains('`')).collect();
    if clauses.is_empty() { kept } else { clauses.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::{StageFindings, verdict_on};
    use crate::segment::GarmentTemplate;
    use std::collections::BTreeMap;

    #[test]
    fn a_verdict_on_the_page_says_what_to_do_without_a_command() {
        let measured = |name: &str, value: f64| BTreeMap::from([(name.to_string(), value)]);
        let (hems, pairs) = (measured("hem_loops", 55.0), measured("intersecting_pairs", 2.0));
        let found = |stage, measures| StageFindings { stage, measures, warnings: Vec::new() };
        let template = GarmentTemplate::built_in("tshirt").unwrap();
        let all = verdict_on("shirt", Some(&template), true, &[found("cut", &hems), found("stack", &pairs)]).warnings;
        assert_eq!(all.iter().filter(|text| text.contains('`')).count(), 2, "{all:?}");
        let on_page: Vec<String> = all.iter().map(|text| without_commands(text)).collect();
        assert_eq!(
            on_page[0],
            "2 triangle pairs intersect after the shirt was put on; look at the places, and take cloth away there"
        );
        assert!(on_page[1].ends_with("look at the edges of the shirt, and correct them"), "{}", on_page[1]);
        assert_eq!(without_commands("it cannot be cut; try `overcoat x (y)`"), "it cannot be cut");
        assert_eq!(without_commands("an open (`x"), "an open (`x");
    }
}
