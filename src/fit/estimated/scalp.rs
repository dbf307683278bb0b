//! Where hair may be on the head of a person whose bare scan is not known.

use super::contact::Contact;
use crate::body::{BodyModel, HumanJoint};
use crate::geometry::{PerVertex, VertexId};

/// The gap that hair leaves over the scalp: from shaved to full. Metres.
const HAIR: Contact = Contact { gap: 0.012, deviation: 0.010 };

/// Adds hair over the scalp, which is the head above the brow and behind the ears, where no hat is known.
pub(super) fn with_hair(contact: &mut PerVertex<Option<Contact>>, model: &BodyModel) {
    let (Some(head), Some(bounds)) = (model.skeleton.find(HumanJoint::Head), model.template.bounds()) else { return };
    let base = model.skeleton.joints_in_bind[head.index()];
    let brow = base.y + 0.62 * (bounds.max.y - base.y);
    let is_scalp = |v: VertexId| {
        let p = model.template.points()[v];
        model.weights.rows()[v][0].0 == head && (p.y > brow || (p.y > base.y && p.z < base.z))
    };
    for v in model.template.vertex_ids().filter(|&v| is_scalp(v)) {
        contact[v] = contact[v].or(Some(HAIR));
    }
}
