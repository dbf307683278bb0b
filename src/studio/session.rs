//! A whole invented session: someone scanned naked, then with one garment more each time, and the truth of it all.

use super::camera::Stage;
use super::dressing::{Dressed, dressed};
use super::error::StudioError;
use super::kind::GarmentKind;
use super::scanner::{ScannerParams, scanned};
use super::sewing::{Pattern, sew};
use super::subject::{Stance, Subject};
use super::turntable::{RgbdRecording, TurntableParams, Worn, axis_of, recording, together, turn};
use crate::body::{BodyModel, HumanJoint, SkinWeights, skin, unskin};
use crate::geometry::{Aabb, Adjacency, PerVertex, TriMesh, Vec3};
use crate::measure::{JointPositions, TruthBind, TruthStep};

/// Seeds from here on are for judging: nothing in this program was tuned on them, and nothing shall be. Those below are
/// for tuning and for tests.
pub const JUDGING_SEEDS: std::ops::RangeFrom<u64> = 1000..;

/// What is invented.
#[derive(Clone, Debug)]
pub struct StudioParams {
    /// Who, how they stand, how cloth falls, which noise. See [`JUDGING_SEEDS`].
    pub seed: u64,
    /// What they put on, in this order.
    pub garments: Vec<GarmentKind>,
    /// How they are recorded.
    pub turntable: TurntableParams,
    /// How the recordings are fused.
    pub scanner: ScannerParams,
    /// Metres by which the head wanders within a turn, arms sinking with it; 0 for someone who stands like a post.
    pub sway: f64,
    /// How long cloth settles, seconds: beyond 1.2 folds move by less than a millimetre a frame.
    pub settling_secs: f64,
    /// Joints turned away from how people stand to be scanned: name and rotation vector about the axes of the bind pose, in
    /// radians.
    pub turned: Vec<(&'static str, Vec3)>,
}

impl Default for StudioParams {
    fn default() -> Self {
        Self {
            seed: 1,
            garments: vec![GarmentKind::Tshirt, GarmentKind::Skirt],
            turntable: TurntableParams::default(),
            scanner: ScannerParams::default(),
            sway: 0.0,
            settling_secs: 1.2,
            turned: Vec::new(),
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
        if let Some(&(name, _)) = self.turned.iter().find(|(name, _)| HumanJoint::from_name(name).is_none()) {
            return Err(StudioError::NoSuchJoint { name });
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
        on_step(step, stood(&subject, &patterns[..step], step, params)?);
    }
    let Dressed { body, layers } = dressed(&subject, &subject.at_rest(), &patterns, params.settling_secs)?;
    Ok(TruthBind { body, layers })
}

/// One step alone: someone in all of `params.garments` at once, as they stand in step `step`.
///
/// **Guarantees** where `step` is the number of garments, it is the last step of [`invent`], byte for byte.
///
/// **Errors** see [`StudioParams::check`].
pub fn invent_step(model: &BodyModel, params: &StudioParams, step: usize) -> Result<InventedStep, StudioError> {
    params.check()?;
    let subject = Subject::invent(model, params.seed);
    let patterns: Vec<Pattern> = params.garments.iter().map(|&kind| sew(kind, &subject, params.seed)).collect();
    stood(&subject, &patterns, step, params)
}

/// Someone in these clothes on the turntable, in the stance of step `step`.
fn stood(subject: &Subject, worn: &[Pattern], step: usize, params: &StudioParams) -> Result<InventedStep, StudioError> {
    let mut stance = subject.stance(params.seed, step);
    stance.pose = subject.turned(&stance.pose, &params.turned);
    stand_on_floor(subject, &mut stance);
    let name = worn.last().map_or("body", |p| p.kind.name()).to_owned();
    let dressed = dressed(subject, &stance, worn, params.settling_secs)?;
    let placed = |mesh: &TriMesh| mesh.map_points(|p| stance.placed * p);
    let truth = TruthStep {
        body: placed(&dressed.body),
        layers: dressed.layers.iter().map(placed).collect(),
        joints: joints(subject, &stance),
    };
    let photographed = Photographed { subject, stance: &stance, dressed, worn };
    let (recording, scan, colors) = photographed.taken(&truth, params, params.seed.wrapping_add(step as u64));
    Ok(InventedStep { name, recording, scan, colors, truth })
}

/// What stands before the camera in one step.
struct Photographed<'a> {
    subject: &'a Subject,
    stance: &'a Stance,
    /// Not yet on the turntable.
    dressed: Dressed,
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

    /// Cloth in finer triangles, so that stripes have edges, and as thick as it is, so that hems have too.
    fn stage(&self, body: &TriMesh, layers: &[TriMesh]) -> Stage {
        let cloth: Vec<(TriMesh, PerVertex<[u8; 3]>)> = layers
            .iter()
            .zip(self.worn)
            .map(|(mesh, pattern)| {
                let colors = pattern.painted(&halved(&pattern.finished(&pattern.sewn, false, &[])));
                thickened(&halved(mesh), &colors, pattern.kind.fabric().thickness)
            })
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
        let layers: Vec<TriMesh> = self
            .dressed
            .layers
            .iter()
            .zip(self.worn)
            .map(|(mesh, pattern)| moved(mesh, &pattern.finished_weights()))
            .collect();
        self.stage(&moved(&self.dressed.body, &self.subject.weights), &layers)
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

/// Outside, inside and a rim along every hem. The outside is the truth.
fn thickened(mesh: &TriMesh, colors: &PerVertex<[u8; 3]>, thickness: f64) -> (TriMesh, PerVertex<[u8; 3]>) {
    let count = mesh.vertex_count() as u32;
    let normals = mesh.vertex_normals();
    let inner = mesh.points().iter().zip(normals.iter()).map(|(p, n)| p - n * thickness);
    let points = mesh.points().iter().copied().chain(inner).collect();
    let mut faces: Vec<[u32; 3]> = mesh.faces().iter().map(|f| f.map(|v| v.0)).collect();
    faces.extend(mesh.faces().iter().map(|&[a, b, c]| [a.0 + count, c.0 + count, b.0 + count]));
    for [a, b] in Adjacency::prepare(mesh).boundary_edges().iter().map(|edge| edge.map(|v| v.0)) {
        faces.extend([[b, a, a + count], [b, a + count, b + count]]);
    }
    let colors = colors.iter().chain(colors.iter()).copied().collect();
    (TriMesh::try_from_indices(points, &faces).expect("two copies of a valid mesh and a rim"), colors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::{hem_loops, hidden_body, surface_distance};

    fn coarse_params(garments: Vec<GarmentKind>) -> StudioParams {
        StudioParams {
            seed: 11,
            garments,
            turntable: TurntableParams { views: 8, ..TurntableParams::default() },
            scanner: ScannerParams { voxel: 0.02, faces: 4_000 },
            sway: 0.0,
            settling_secs: 0.25,
            turned: Vec::new(),
        }
    }

    fn coarse(garments: Vec<GarmentKind>) -> InventedSession {
        invent(&crate::body::embedded_model().unwrap(), &coarse_params(garments)).unwrap()
    }

    #[test]
    fn a_step_alone_is_that_of_its_session_and_joints_are_turned_as_asked() {
        let session = coarse(vec![GarmentKind::Skirt]);
        let model = crate::body::embedded_model().unwrap();
        let alone = invent_step(&model, &coarse_params(vec![GarmentKind::Skirt]), 1).unwrap();
        assert_eq!(alone.scan, session.steps[1].scan);
        assert_eq!(alone.truth.joints, session.steps[1].truth.joints);
        let up = vec![("leftUpperArm", Vec3::z() * 30f64.to_radians())];
        let raised = StudioParams { turned: up, ..coarse_params(Vec::new()) };
        let raised = invent_step(&model, &raised, 0).unwrap();
        let forearm = |step: &InventedStep| step.truth.joints["leftHand"] - step.truth.joints["leftUpperArm"];
        let turned = forearm(&raised).angle(&forearm(&session.steps[0])).to_degrees();
        assert!((29.0..31.0).contains(&turned) && forearm(&raised).y > forearm(&session.steps[0]).y, "{turned}");
        let third = StudioParams { turned: vec![("thirdArm", Vec3::z())], ..coarse_params(Vec::new()) };
        assert_eq!(invent_step(&model, &third, 0).unwrap_err(), StudioError::NoSuchJoint { name: "thirdArm" });
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
    fn each_kind_has_its_hems() {
        let model = crate::body::embedded_model().unwrap();
        let subject = Subject::invent(&model, 12);
        use GarmentKind::{Coat, Dress, Hat, Jacket, Pullover, Scarf, Socks, Tanktop, Trousers, Tshirt};
        // What opens in front has one hem from the neck round the bottom.
        let expected = [
            (Tshirt, 4),
            (Pullover, 4),
            (Tanktop, 4),
            (Dress, 4),
            (Trousers, 3),
            (Jacket, 3),
            (Coat, 3),
            (Socks, 2),
            (Scarf, 2),
            (Hat, 1),
        ];
        for (kind, hems) in expected {
            let pattern = sew(kind, &subject, 12);
            let finished = pattern.finished(&pattern.sewn, false, &[]);
            assert_eq!(hem_loops(&finished), hems, "{}", kind.name());
            assert!((300..16_000).contains(&finished.vertex_count()), "{}", kind.name());
            assert_eq!(finished.vertex_count(), pattern.finished_weights().len());
        }
    }
}
