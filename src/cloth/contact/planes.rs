//! Contact of a vertex with the body and with the other layers.

use super::collider::Collider;
use crate::cloth::fabric::Fabric;
use crate::geometry::{Point, Vec3, VertexId};
use rayon::prelude::*;

/// Cloth farther away than this meets nothing within a frame, metres.
const CONTACT_REACH: f64 = 0.03;
/// An outer layer is detected from farther, metres: a shirt to be tucked in starts outside of the trousers.
const OUTER_REACH: f64 = 0.05;
/// Beyond a hem cloth is free: there is no contact where the cosine between the direction to the surface and its normal
/// is less than this.
const LEAST_COSINE: f64 = 0.5;
/// Share of the way apart that a layer is pushed per step by another layer, the heavier the less: see [`yields`].
const LAYER_PUSH: f64 = 0.6;
/// Metres between skin and cloth beside the thickness.
const SKIN_GAP: f64 = 1.5e-3;
/// Metres between cloth and cloth beside the thickness.
const LAYER_GAP: f64 = 0.8e-3;
/// Share of sliding that contact takes away per step.
const FRICTION: f64 = 0.4;

/// A plane that a vertex stays on the outer side of.
#[derive(Clone, Copy)]
pub(in crate::cloth) struct ContactPlane {
    point: Point,
    pub(in crate::cloth) normal: Vec3,
    gap: f64,
    /// Share of the depth that is corrected per step.
    push: f64,
}

impl ContactPlane {
    /// How far `p` is below the plane plus the gap; negative above.
    pub(in crate::cloth) fn depth(&self, p: &Point) -> f64 {
        self.gap - (p - self.point).dot(&self.normal)
    }
}

/// Pushes a vertex to the outer side of the contact plane; `before` is where it was before the step.
pub(in crate::cloth) fn push_out(p: &mut Point, before: &Point, contact: &ContactPlane) {
    let depth = contact.depth(p);
    if depth <= 0.0 {
        return;
    }
    *p += contact.normal * (depth * contact.push);
    let slid = *p - before;
    *p -= (slid - contact.normal * slid.dot(&contact.normal)) * FRICTION;
}

/// The contacts of each vertex of layer `k` with the body, which does not yield, the inner layers and the outer layers.
///
/// **Shapes** `at` V × 3, the vertices of layer `k`; `layers` and `fabrics` one per layer, `layers` empty for a single
/// layer; the result V lists.
pub(in crate::cloth) fn contacts_of(
    at: &[Point],
    k: usize,
    body: &Collider,
    layers: &[Collider],
    fabrics: &[Fabric],
) -> Vec<Vec<ContactPlane>> {
    at.par_iter()
        .enumerate()
        .map(|(v, p)| {
            let mut contacts = Vec::new();
            for (j, layer) in layers.iter().enumerate().filter(|(j, _)| *j != k) {
                let outer = j > k;
                let gap = LAYER_GAP + fabrics[j.max(k)].thickness;
                let reach = if outer { OUTER_REACH } else { CONTACT_REACH };
                let push = LAYER_PUSH * yields(&fabrics[k], &fabrics[j]);
                let found = contact(p, layer, reach, outer, gap, push);
                // What is under another cloth faces the way that it does; the sleeve beside a vest does not.
                let own = layers[k].normal(VertexId(v as u32));
                contacts.extend(found.filter(|c| !outer || own.dot(&c.normal) < 0.0));
            }
            // The body comes last: no layer pushes cloth into it.
            contacts.extend(contact(p, body, CONTACT_REACH, false, SKIN_GAP + fabrics[k].thickness, 1.0));
            contacts
        })
        .collect()
}

/// How much a layer yields to another: 1 when both have equal density, less for the heavier.
fn yields(own: &Fabric, other: &Fabric) -> f64 {
    (2.0 * other.density / (own.density + other.density)).min(1.0)
}

fn contact(p: &Point, surface: &Collider, reach: f64, inside: bool, gap: f64, push: f64) -> Option<ContactPlane> {
    let (near, outward) = surface.closest(p, reach)?;
    let way = p - near.point;
    // Through an armhole the way is along the normal of its boundary, and yet the sleeve is not under the vest.
    let beside = way.dot(&outward).abs() < LEAST_COSINE * near.distance || surface.is_on_boundary(&near);
    if near.distance > 2.0 * gap && beside {
        return None;
    }
    let normal = if inside { -outward } else { outward };
    Some(ContactPlane { point: near.point, normal, gap, push })
}

/// `p` moved to the outer side of a layer below it, if it is within `reach` metres of that layer.
pub(in crate::cloth) fn outside_layer(p: &Point, layer: &Collider, reach: f64, thickness: f64) -> Point {
    moved_out(p, contact(p, layer, reach, false, LAYER_GAP + thickness, 1.0))
}

/// `p` moved to the outer side of the inner layers, in their order, and then of the body.
pub(in crate::cloth) fn outside_all(p: &Point, inner: &[Collider], body: &Collider, thickness: f64) -> Point {
    let q = inner.iter().fold(*p, |q, layer| outside_layer(&q, layer, CONTACT_REACH, thickness));
    outside_skin(&q, body, thickness)
}

fn outside_skin(p: &Point, body: &Collider, thickness: f64) -> Point {
    moved_out(p, contact(p, body, CONTACT_REACH, false, SKIN_GAP + thickness, 1.0))
}

fn moved_out(p: &Point, contact: Option<ContactPlane>) -> Point {
    match contact {
        Some(c) => p + c.normal * c.depth(p).max(0.0),
        None => *p,
    }
}

/// A point of cloth moved clear of the surfaces below it, as far from each as from skin.
///
/// **Frame and units** `thickness` of the cloth in metres; all in one frame.
pub fn clear_of(p: &Point, below: &[&Collider], thickness: f64) -> Point {
    below.iter().fold(*p, |q, surface| outside_skin(&q, surface, thickness))
}
