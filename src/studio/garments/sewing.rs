//! Garments cut and sewn around a dress form, with real hems and with ease by region.

use super::close_up::ClothCloseUp;
use super::collar::Collar;
use super::dress_form::DressForm;
use super::dye::Dye;
use super::flare::{FlaredTube, flare_mesh};
use super::form::{GarmentFile, GarmentForm};
use super::hem::{SPACING, cut_along, largest_components, with_smooth_boundary};
use super::kind::GarmentKind;
use super::pattern::Pattern;
use super::size::{GarmentSize, Grade};
use super::skin_weights::skin_weights;
use crate::body::{HumanJoint, SkinWeights};
use crate::cloth::{ClothLayer, Collider, clear_of};
use crate::geometry::{Aabb, PerVertex, Point, TriMesh, Vec3, VertexId};
use crate::numerics::Rng;
use crate::studio::level_set::LevelSet;
use crate::studio::subject::Subject;

/// A garment ready to be put on.
pub struct SewnGarment {
    pub kind: GarmentKind,
    /// Its rest shape, waistband and fabric.
    pub(super) cloth: ClothLayer,
    /// Its shape around the subject in the [`sewing_pose`](super::dress_form::sewing_pose).
    pub sewn: TriMesh,
    /// Skin weights of `sewn`.
    pub(super) weights: SkinWeights,
    pub(super) collar: Option<Collar>,
    dye: Dye,
}

impl SewnGarment {
    /// The colours of the garment in its sewn shape, one per vertex.
    pub fn painted(&self, sewn: &TriMesh) -> PerVertex<[u8; 3]> {
        let Some(bounds) = sewn.bounds() else { return PerVertex::default() };
        let height = bounds.extent().y.max(1e-6);
        sewn.points().iter().map(|p| self.dye.at(p, (p.y - bounds.min.y) / height)).collect()
    }

    /// Gives the garment the colours of another.
    pub fn dye_like(&mut self, other: &Self) {
        self.dye = other.dye;
    }

    /// The garment as a photograph shows it; `sewn` is its sewn shape with the collar.
    pub fn close_up(&self, sewn: &TriMesh) -> ClothCloseUp {
        ClothCloseUp::of(self.kind, self.dye, sewn)
    }

    /// The draped garment with its collar, clear of `below`; the collar lies flat if it is `pressed` by an outer layer.
    pub fn finished(&self, draped: &TriMesh, pressed: bool, below: &[&Collider]) -> TriMesh {
        let thickness = self.kind.fabric().thickness;
        let clear = |p: &Point| clear_of(p, below, thickness);
        self.collar.as_ref().map_or_else(|| draped.clone(), |collar| collar.sewn_on(draped, pressed, &clear))
    }

    /// The skin weights of [`Self::finished`].
    pub fn finished_weights(&self) -> SkinWeights {
        self.collar.as_ref().map_or_else(|| self.weights.clone(), |collar| collar.weights(&self.weights))
    }
}

/// Cuts and sews a garment of a kind for a subject; the seed determines its length, colours and unevenness.
pub fn sew(kind: GarmentKind, subject: &Subject, seed: u64) -> SewnGarment {
    sew_graded(kind, subject, seed, Grade::default())
}

/// [`sew`] in another size than the subject's own.
fn sew_graded(kind: GarmentKind, subject: &Subject, seed: u64, grade: Grade) -> SewnGarment {
    let form = DressForm::of(subject);
    let mut rng = Rng::new(seed.wrapping_add(kind as u64 * 77));
    let pattern = kind.pattern(&form, &mut rng, grade);
    let whole = match (&pattern.flare, kind) {
        (Some(flare), GarmentKind::Skirt) => flare_mesh(flare, &form),
        _ => around(kind, &pattern, &form, grade),
    };
    let sewn = with_smooth_boundary(&largest_components(&cut_along(&whole, &pattern.hems, &form), pattern.pieces));
    let pinned = held(kind, &sewn, &form);
    // A millimetre of unevenness decides to which side a fold falls. What is held stays as sewn; a waistband gathers the cloth below it.
    let is_even = |v: VertexId| pinned[v] && !kind.has_waistband();
    let uneven = sewn.points().enumerate().map(|(v, p)| {
        let unevenness = Vec3::new(rng.normal(), 0.0, rng.normal()) * 0.001;
        if is_even(v) { *p } else { p + unevenness }
    });
    let uneven: Vec<Point> = uneven.collect();
    let [across, along] = pattern.surplus;
    let rest = sewn.map_points(|p| Point::new(p.x * across, p.y * along, p.z * across));
    let sewn = sewn.with_points(uneven);
    let weights = skin_weights(kind, &sewn, &form);
    let collar = pattern.collar.and_then(|width| Collar::cut(&sewn, &form.joint(HumanJoint::Neck), width));
    let cloth = ClothLayer { rest, pinned, fabric: kind.fabric() };
    SewnGarment { kind, cloth, sewn, weights, collar, dye: Dye::of(kind, seed) }
}

/// A garment alone, as its file is, in the pose in which it was sewn.
///
/// **Guarantees** equal arguments give equal bytes; M of each kind has the girths that [`sew`] gives it.
pub fn garment_file(
    kind: GarmentKind,
    subject: &Subject,
    seed: u64,
    size: GarmentSize,
    form: GarmentForm,
) -> GarmentFile {
    let garment = sew_graded(kind, subject, seed, size.grade());
    let mesh = garment.finished(&garment.cloth.rest, false, &[]);
    let colors = garment.painted(&mesh);
    GarmentFile::of(&mesh, &colors, form)
}

/// A garment that follows the body at a distance: the zero surface of a smoothed distance field, joined with the flare.
fn around(kind: GarmentKind, pattern: &Pattern<'_>, form: &DressForm, grade: Grade) -> TriMesh {
    /// Distances are not evaluated beyond this, metres.
    const FAR: f64 = 0.12;
    let covered = form.body.points().enumerate().filter(|(v, _)| kind.covers(form.part(*v)));
    let Some(mut bounds) = Aabb::around(covered.map(|(_, p)| p)) else { return form.body.clone() };
    if pattern.flare.is_some() {
        // Space for the flare on all sides.
        bounds = Aabb { min: bounds.min - Vec3::new(0.05, 0.0, 0.2), max: bounds.max + Vec3::new(0.05, 0.0, 0.2) };
    }
    let collider = Collider::prepare(&form.body);
    let flared = pattern.flare.as_ref().map(|flare| FlaredTube::around(flare, form));
    let mut field = LevelSet::covering(&bounds, 0.06, SPACING);
    field.fill(|p| {
        let to_body = match collider.closest(p, FAR) {
            None => FAR,
            Some((near, outward)) => {
                let corner = near.nearest_corner(collider.mesh());
                let side = (p - near.point).dot(&outward).signum();
                let part = form.part(corner);
                side * near.distance - kind.gap(part, form.along(corner)) - grade.gap(part)
            }
        };
        let to_tube = flared.as_ref().map_or(f64::INFINITY, |tube| tube.distance(p));
        to_body.min(to_tube) as f32
    });
    // Cloth spans hollows: the small of the back, between breasts and between buttocks. Tight knits do not, and smoothing would take
    // toes out of boots.
    let rounds = if kind.is_tight() || kind == GarmentKind::Boots { 1 } else { 7 };
    for _ in 0..rounds {
        field.smooth();
    }
    field.zero_surface()
}

/// The vertices that stay where they are sewn: the top two rows of a waistband; bib and straps of overalls, whose few threads carry more than
/// one pass over the springs can hold; and the feet of boots, whose soles are stiff.
fn held(kind: GarmentKind, sewn: &TriMesh, form: &DressForm) -> PerVertex<bool> {
    /// Height of the instep, metres.
    const INSTEP: f64 = 0.07;
    let Some(bounds) = sewn.bounds() else { return PerVertex::default() };
    let waist = form.joint(HumanJoint::Spine).y;
    let is_held = |p: &Point| match kind {
        GarmentKind::Boots => p.y < bounds.min.y + INSTEP,
        GarmentKind::Overalls => p.y > waist - SPACING,
        _ => kind.has_waistband() && p.y > bounds.max.y - 1.4 * SPACING,
    };
    sewn.points().iter().map(is_held).collect()
}
