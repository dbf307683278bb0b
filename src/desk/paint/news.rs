//! What all pages are told about the layers.

use serde::Serialize;

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

    pub fn say(&mut self, note: String) {
        let number = self.note.as_ref().map_or(1, |(number, _)| number + 1);
        self.note = Some((number, note));
    }
}
