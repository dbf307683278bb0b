//! A whole invented session: someone scanned naked, then with one garment more each time, and the truth of it all.

use super::camera::Stage;
use super::drape::{Obstacle, drape};
use super::error::StudioError;
use super::metrics::{JointPositions, TruthBind, TruthStep};
use super::pattern::{GarmentKind, Pattern, sew, sewing_pose};
use super::scanner::{ScannerParams, scanned};
use super::solid::Solid;
use super::subject::{Stance, Subject};
use super::turntable::{RgbdRecording, TurntableParams, Worn, axis_of, recording, together, turn};
use crate::body::{BodyModel, SkinWeights, skin, unskin};
use crate::geometry::{Aabb, PerVertex, TriMesh};

/// What is invented.
#[derive(Clone, Debug)]
pub struct StudioParams {
    /// Who, how they stand, how cloth falls, which noise.
    pub seed: u64,
    /// What they put on, in this order.
    pub garments: Vec<GarmentKind>,
    /// How they are recorded.
    pub turntable: TurntableParams,
    /// How the recordings are fused.
    pub scanner: ScannerParams,
    /// Metres by which the head wanders within a turn, arms sinking with it; 0 for someone who stands like a post.
    pub sway: f64,
    /// How long cloth settles, seconds: beyond 1.5 folds move by less than a millimetre.
    pub settling_secs: f64,
}

impl Default for StudioParams {
    fn default() -> Self {
        Self {
            seed: 1,
            garments: vec![GarmentKind::Tshirt, GarmentKind::Skirt],
            turntable: TurntableParams::default(),
            scanner: ScannerParams::default(),
            sway: 0.0,
            settling_secs: 1.5,
        }
    }
}

impl StudioParams {
    /// Whether this can be invented at all.
    ///
    /// **Errors** the first thing that cannot be.
    pub fn check(&self) -> Result<(), StudioError> {
        /// Fewer views than this leave a body in stripes.
        const LEAST_VIEWS: usize = 8;
        GarmentKind::check_order(&self.garments)?;
        let (width, height) = (self.turntable.lens.width, self.turntable.lens.height);
        if self.turntable.views < LEAST_VIEWS {
            return Err(StudioError::TooFewViews { views: self.turntable.views });
        }
        if width.min(height) < 64 || width.max(height) > 4096 {
            return Err(StudioError::BadSize { width, height });
        }
        if !(0.0..=0.05).contains(&self.sway) {
            return Err(StudioError::BadSway { sway_mm: 1e3 * self.sway });
        }
        Ok(())
    }
}

/// One step of an invented session, in the frame of the scan's file.
#[derive(Clone, Debug)]
pub struct InventedStep {
    /// `body`, or the garment kind.
    pub name: String,
    /// What the camera recorded.
    pub recording: RgbdRecording,
    /// What the scanner hands out.
    pub scan: TriMesh,
    /// Its colours.
    pub colors: PerVertex<[u8; 3]>,
    /// What was really there.
    pub truth: TruthStep,
}

/// A session with its truth.
#[derive(Clone, Debug)]
pub struct InventedSession {
    /// Naked first.
    pub steps: Vec<InventedStep>,
    /// Everything worn, in the model's own bind pose.
    pub bind: TruthBind,
}

/// Metres between skin and the innermost cloth; includes the cloth's own millimetre.
const SKIN_GAP: f64 = 2.5e-3;
/// Metres from cloth to cloth.
const CLOTH_GAP: f64 = 1.5e-3;

/// Invents a session.
///
/// **Frame and units** each step in its own scan's frame: metres, Y up, feet near y = 0, facing about +Z.
///
/// **Errors** see [`StudioParams::check`].
///
/// **Guarantees** the same parameters give the same bytes with any number of threads.
pub fn invent(model: &BodyModel, params: &StudioParams) -> Result<InventedSession, StudioError> {
    let mut steps = Vec::new();
    let bind = invent_each(model, params, &mut |_, step| steps.push(step))?;
    Ok(InventedSession { steps, bind })
}

/// The same, step by step, so that no more than one recording need be kept.
pub fn invent_each(
    model: &BodyModel,
    params: &StudioParams,
    on_step: &mut dyn FnMut(usize, InventedStep),
) -> Result<TruthBind, StudioError> {
    params.check()?;
    let subject = Subject::invent(model, params.seed);
    let patterns: Vec<Pattern> = params.garments.iter().map(|&kind| sew(kind, &subject, params.seed)).collect();
    for step in 0..=patterns.len() {
        let mut stance = subject.stance(params.seed, step);
        stand_on_floor(&subject, &mut stance);
        let worn = &patterns[..step];
        let name = worn.last().map_or("body", |p| p.kind.name()).to_owned();
        let dressed = dressed(&subject, &stance, worn, params.settling_secs);
        let placed = |mesh: &TriMesh| mesh.map_points(|p| stance.placed * p);
        let truth = TruthStep {
            body: placed(&dressed.0),
            layers: dressed.1.iter().map(placed).collect(),
            joints: joints(&subject, &stance),
        };
        let photographed = Photographed { subject: &subject, stance: &stance, dressed, worn };
        let (recording, scan, colors) = photographed.taken(&truth, params, params.seed.wrapping_add(step as u64));
        on_step(step, InventedStep { name, recording, scan, colors, truth });
    }
    let (body, layers) = dressed(&subject, &subject.at_rest(), &patterns, params.settling_secs);
    Ok(TruthBind { body, layers })
}

/// What stands before the camera in one step.
struct Photographed<'a> {
    subject: &'a Subject,
    stance: &'a Stance,
    /// Body and layers, not yet on the turntable.
    dressed: (TriMesh, Vec<TriMesh>),
    worn: &'a [Pattern],
}

impl Photographed<'_> {
    fn taken(
        &self,
        truth: &TruthStep,
        params: &StudioParams,
        seed: u64,
    ) -> (RgbdRecording, TriMesh, PerVertex<[u8; 3]>) {
        let still = self.stage(&truth.body, &truth.layers);
        let everything = std::iter::once(&truth.body).chain(&truth.layers).flat_map(|m| m.points().iter());
        let Some(bounds) = Aabb::around(everything) else { unreachable!("a body has vertices") };
        let axis = axis_of(&params.turntable, &bounds.center(), 0.0);
        let views = params.turntable.views;
        let scene = |frame: usize| match params.sway {
            0.0 => still.clone(),
            sway => self.swayed(sway, (frame as f64 + 0.5) / views as f64 - 0.5, seed),
        };
        let images = turn(&params.turntable, &axis, seed, &scene);
        let recording = recording(&params.turntable, &images);
        let (scan, colors) = scanned(images, &bounds, &params.scanner);
        (recording, scan, colors)
    }

    /// Cloth in finer triangles, so that stripes have edges.
    fn stage(&self, body: &TriMesh, layers: &[TriMesh]) -> Stage {
        let cloth: Vec<(TriMesh, PerVertex<[u8; 3]>)> = layers
            .iter()
            .zip(self.worn)
            .map(|(mesh, pattern)| (halved(mesh), pattern.painted(&halved(&pattern.sewn))))
            .collect();
        let mut surfaces = vec![Worn { mesh: body, colors: &self.subject.colors, label: 1 }];
        surfaces.extend(cloth.iter().enumerate().map(|(k, (mesh, colors))| Worn { mesh, colors, label: k as u8 + 2 }));
        together(&surfaces)
    }

    /// The scene at `time`, −½ to ½ within the turn; the truth is the middle of the sway.
    fn swayed(&self, sway: f64, time: f64, seed: u64) -> Stage {
        let pose = self.subject.sunk(&self.stance.pose, sway, time);
        let lean = self.subject.lean(sway, time, seed);
        let moved = |mesh: &TriMesh, weights: &SkinWeights| {
            let in_bind = unskin(mesh.points(), weights, &self.subject.skeleton, &self.stance.pose);
            let there = mesh.with_points(skin(&in_bind, weights, &self.subject.skeleton, &pose));
            there.map_points(|p| {
                let on_table = self.stance.placed * p;
                on_table + lean * on_table.y
            })
        };
        let layers: Vec<TriMesh> =
            self.dressed.1.iter().zip(self.worn).map(|(mesh, pattern)| moved(mesh, &pattern.weights)).collect();
        self.stage(&moved(&self.dressed.0, &self.subject.weights), &layers)
    }
}

/// Every triangle in four, by the middles of its edges.
fn halved(mesh: &TriMesh) -> TriMesh {
    let mut points = mesh.points().0.clone();
    let mut middle = std::collections::BTreeMap::new();
    let mut faces = Vec::with_capacity(4 * mesh.face_count());
    for [a, b, c] in mesh.faces().iter().map(|f| f.map(|v| v.0)) {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            *middle.entry((p.min(q), p.max(q))).or_insert_with(|| {
                points.push(nalgebra::center(&points[p as usize], &points[q as usize]));
                (points.len() - 1) as u32
            })
        });
        faces.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    TriMesh::try_from_indices(points, &faces).expect("middles of finite points")
}

/// Soles on y = 0.
fn stand_on_floor(subject: &Subject, stance: &mut Stance) {
    if let Some(bounds) = subject.posed(stance).bounds() {
        stance.placed.translation.y -= bounds.min.y;
    }
}

fn joints(subject: &Subject, stance: &Stance) -> JointPositions {
    let at = subject.skeleton.joints_in_world(&stance.pose);
    subject.skeleton.names.iter().cloned().zip(at.into_iter().map(|p| stance.placed * p)).collect()
}

/// The body and what it wears, before it is placed on the turntable. What is held at the waist goes over what hung
/// there, and presses it.
fn dressed(subject: &Subject, stance: &Stance, worn: &[Pattern], secs: f64) -> (TriMesh, Vec<TriMesh>) {
    let body = subject.posed(stance);
    let body_solid = Solid::prepare(&body);
    let sewing = sewing_pose(subject);
    let start = |pattern: &Pattern| {
        let in_bind = unskin(pattern.sewn.points(), &pattern.weights, &subject.skeleton, &sewing);
        skin(&in_bind, &pattern.weights, &subject.skeleton, &stance.pose)
    };
    let mut layers: Vec<TriMesh> = Vec::new();
    for (j, pattern) in worn.iter().enumerate() {
        let inner: Vec<Solid> = layers.iter().map(Solid::prepare).collect();
        let room = SKIN_GAP + CLOTH_GAP * j as f64;
        let mut obstacles = vec![Obstacle { surface: &body_solid, gap: room, inside: false }];
        if !pattern.kind.holds_the_waist() {
            obstacles.extend(inner.iter().map(|surface| Obstacle { surface, gap: CLOTH_GAP, inside: false }));
        }
        layers.push(drape(&pattern.cloth, &start(pattern), &obstacles, secs));
        if pattern.kind.holds_the_waist() {
            press(&body_solid, &mut layers, worn, secs / 4.0);
        }
    }
    (body, layers)
}

/// The newest layer presses the others to the body, and then rests on what does not give.
fn press(body: &Solid, layers: &mut [TriMesh], worn: &[Pattern], secs: f64) {
    let Some((outer, inner)) = layers.split_last_mut() else { return };
    for _ in 0..2 {
        let pressing = Solid::prepare(outer);
        for (layer, pattern) in inner.iter_mut().zip(worn) {
            let obstacles = [
                Obstacle { surface: &pressing, gap: 2.0 * CLOTH_GAP, inside: true },
                Obstacle { surface: body, gap: SKIN_GAP, inside: false },
            ];
            *layer = drape(&pattern.cloth, &layer.points().clone(), &obstacles, secs);
        }
        let below: Vec<Solid> = inner.iter().map(Solid::prepare).collect();
        let mut obstacles =
            vec![Obstacle { surface: body, gap: SKIN_GAP + CLOTH_GAP * inner.len() as f64, inside: false }];
        obstacles.extend(below.iter().map(|surface| Obstacle { surface, gap: CLOTH_GAP, inside: false }));
        *outer = drape(&worn[inner.len()].cloth, &outer.points().clone(), &obstacles, secs / 2.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studio::{hem_loops, hidden_body, surface_distance};

    fn coarse(garments: Vec<GarmentKind>) -> InventedSession {
        let params = StudioParams {
            seed: 11,
            garments,
            turntable: TurntableParams { views: 8, ..TurntableParams::default() },
            scanner: ScannerParams { voxel: 0.02, faces: 4_000 },
            sway: 0.0,
            settling_secs: 0.25,
        };
        invent(&crate::body::embedded_model().unwrap(), &params).unwrap()
    }

    #[test]
    fn a_session_has_its_truth_hems_where_they_belong_and_skin_under_cloth() {
        let session = coarse(vec![GarmentKind::Skirt]);
        assert_eq!(session.steps.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["body", "skirt"]);
        let [naked, dressed] = &session.steps[..] else { panic!("two steps") };
        assert!(naked.truth.layers.is_empty());
        assert_eq!(hem_loops(&dressed.truth.layers[0]), 2);
        assert_eq!(naked.truth.joints.len(), 22);
        let worn = hidden_body(&dressed.truth.body, &dressed.truth.body, &dressed.truth.layers);
        assert!(worn.hidden_percent > 10.0 && worn.outside_truth_percent == 0.0, "{worn:?}");
        let moved = surface_distance(&naked.truth.body, &dressed.truth.body).surface_mean_mm;
        assert!((2.0..80.0).contains(&moved), "nobody stands twice the same: {moved}");
        let lowest = naked.truth.body.bounds().unwrap().min.y;
        assert!(lowest.abs() < 1e-9, "soles on the floor: {lowest}");
        assert!(session.bind.layers[0].points().iter().all(|p| p.coords.norm() < 2.0));
    }

    #[test]
    fn tops_have_four_hems_and_trousers_three() {
        let model = crate::body::embedded_model().unwrap();
        let subject = Subject::invent(&model, 12);
        for (kind, hems) in [(GarmentKind::Tshirt, 4), (GarmentKind::Pullover, 4), (GarmentKind::Trousers, 3)] {
            let pattern = sew(kind, &subject, 12);
            assert_eq!(hem_loops(&pattern.sewn), hems, "{}", kind.name());
            assert!((1_500..9_000).contains(&pattern.sewn.vertex_count()));
        }
    }
}
