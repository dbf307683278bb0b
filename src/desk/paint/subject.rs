//! What a page paints: the garments of a session, or a kind of garment on the body.

use super::refusal::Refusal;
use super::requests::{PaintRequest, StepRequest};
use serde_json::Value;
use std::sync::atomic::AtomicBool;

/// What a page paints. Requests come from several threads.
pub(super) trait Subject: Send + Sync {
    /// A word for what is painted: strokes that a browser keeps belong to it.
    fn id(&self) -> String;

    /// The page's title.
    fn title(&self) -> String;

    /// What the surface is that is painted on: scan or body.
    fn surface(&self) -> &'static str;

    /// How many requests have changed something.
    fn changes(&self) -> usize;

    /// Everything about a layer.
    fn layer(&self, name: &str) -> Result<Value, Refusal>;

    /// The part of the surface that is the garment.
    fn cut(&self, name: &str) -> Result<Value, Refusal>;

    /// Paints strokes that a page has drawn.
    fn paint(&self, request: &PaintRequest) -> Result<Value, Refusal>;

    /// Takes the last stroke back.
    fn undo(&self, request: &StepRequest) -> Result<Value, Refusal>;

    /// Paints again what was taken back last.
    fn redo(&self, request: &StepRequest) -> Result<Value, Refusal>;

    /// The news, with the labels of one layer if they have another version than the page has.
    fn news(&self, layer: Option<&str>, version: Option<u64>) -> Value;

    /// Notices other commands until `ended`.
    fn watch(&self, ended: &AtomicBool);
}
