//! A synthetic session: a subject scanned naked, then with one more garment in each step, and the truth of each step.

use super::camera::RgbdRecording;
use super::close_up::CloseUp;
use super::error::StudioError;
use super::garments::{
    DressedSubject, GarmentFile, GarmentForm, GarmentKind, GarmentSize, SewnGarment, dress, garment_file, sew,
};
use super::params::StudioParams;
use super::subject::{ScanStance, Subject};
use super::turntable_subject::TurntableSubject;
use crate::body::BodyModel;
use crate::geometry::{PerVertex, TriMesh};
use crate::measure::{JointPositions, TruthBind, TruthStep};

/// One step of a synthetic session, in the frame of the scan's file.
///
/// **Shapes** `colors` has one entry per vertex of `scan`.
#[derive(Clone, Debug)]
pub struct SyntheticStep {
    /// `body`, the garment kind, or `outfit` for several garments.
    pub name: String,
    /// The frames, with true poses and labels.
    pub recording: RgbdRecording,
    /// The fused scan.
    pub scan: TriMesh,
    /// Its colours, sRGB.
    pub colors: PerVertex<[u8; 3]>,
    /// What photographs show of the subject.
    pub close_up: CloseUp,
    /// The true body, garments and joints.
    pub truth: TruthStep,
}

/// The name of a step that shows several garments for the first time.
const OUTFIT: &str = "outfit";

/// A synthetic session with its truth.
#[derive(Clone, Debug)]
pub struct SyntheticSession {
    /// The naked step first.
    pub steps: Vec<SyntheticStep>,
    /// The body and all garments in the bind pose of the model.
    pub bind: TruthBind,
}

/// Generates a session: a subject scanned naked, then with one more garment in each step, or once with all of them.
///
/// **Frame and units** each step in its own scan's frame: metres, Y up, feet near y = 0, facing about +Z.
///
/// **Errors** see [`StudioParams::check`].
///
/// **Guarantees** the parameters determine every byte, with any number of threads.
pub fn generate_session(model: &BodyModel, params: &StudioParams) -> Result<SyntheticSession, StudioError> {
    let mut steps = Vec::new();
    let bind = generate_each_step(model, params, &mut |_, step| steps.push(step))?;
    Ok(SyntheticSession { steps, bind })
}

/// Sews a garment in one size for the subject of a seed, who wears M.
///
/// **Errors** [`StudioError::MissingJoint`].
pub fn generate_garment(
    model: &BodyModel,
    seed: u64,
    kind: GarmentKind,
    size: GarmentSize,
    form: GarmentForm,
) -> Result<GarmentFile, StudioError> {
    Ok(garment_file(kind, &Subject::generate(model, seed)?, seed, size, form))
}

/// Generates a session step by step, so that only one recording is in memory; see [`generate_session`].
pub fn generate_each_step(
    model: &BodyModel,
    params: &StudioParams,
    on_step: &mut dyn FnMut(usize, SyntheticStep),
) -> Result<TruthBind, StudioError> {
    params.check()?;
    let subject = Subject::generate(model, params.seed)?;
    let garments = sewn(params, &subject);
    match params.one_scan {
        true => {
            on_step(0, scan_of(&subject, &[], 0, params)?);
            if !garments.is_empty() {
                on_step(1, SyntheticStep { name: OUTFIT.into(), ..scan_of(&subject, &garments, 1, params)? });
            }
        }
        false => {
            for step in 0..=garments.len() {
                on_step(step, scan_of(&subject, &garments[..step], step, params)?);
            }
        }
    }
    let DressedSubject { body, layers } = dress(&subject, &subject.at_rest(), &garments, params.settling_secs)?;
    Ok(TruthBind { body, layers })
}

/// Generates one step alone: the subject in all of `params.garments`, in the stance of step `step`.
///
/// **Guarantees** where `step` is the number of garments, the result is the last step of [`generate_session`], byte for byte.
///
/// **Errors** see [`StudioParams::check`].
pub fn generate_step(model: &BodyModel, params: &StudioParams, step: usize) -> Result<SyntheticStep, StudioError> {
    params.check()?;
    let subject = Subject::generate(model, params.seed)?;
    let garments = sewn(params, &subject);
    scan_of(&subject, &garments, step, params)
}

/// The subject's garments, in their colours.
fn sewn(params: &StudioParams, subject: &Subject) -> Vec<SewnGarment> {
    let mut garments: Vec<SewnGarment> = params.garments.iter().map(|&kind| sew(kind, subject, params.seed)).collect();
    if let (true, [first, others @ ..]) = (params.alike, &mut garments[..]) {
        others.iter_mut().for_each(|garment| garment.dye_like(first));
    }
    garments
}

/// The subject in these garments on the turntable, in the stance of step `step`.
fn scan_of(
    subject: &Subject,
    garments: &[SewnGarment],
    step: usize,
    params: &StudioParams,
) -> Result<SyntheticStep, StudioError> {
    let mut stance = subject.stance(params.seed, step);
    stance.pose = subject.turned(&stance.pose, &params.turned);
    subject.apply_grasp(&params.hands, &mut stance.pose);
    stand_on_floor(subject, &mut stance);
    let name = garments.last().map_or("body", |g| g.kind.name()).to_owned();
    let dressed = dress(subject, &stance, garments, params.settling_secs)?;
    let placed = |mesh: &TriMesh| mesh.map_points(|p| stance.file_from_world * p);
    let truth = TruthStep {
        body: placed(&dressed.body),
        layers: dressed.layers.iter().map(placed).collect(),
        joints: joints(subject, &stance),
    };
    let on_table = TurntableSubject { subject, stance: &stance, dressed, garments };
    let (recording, scan, colors) = on_table.scanned(&truth, params, params.seed.wrapping_add(step as u64))?;
    let close_up = on_table.close_up(&truth);
    Ok(SyntheticStep { name, recording, scan, colors, close_up, truth })
}

/// Moves the stance so that the soles are on y = 0.
fn stand_on_floor(subject: &Subject, stance: &mut ScanStance) {
    if let Some(bounds) = subject.posed(stance).bounds() {
        stance.file_from_world.translation.y -= bounds.min.y;
    }
}

fn joints(subject: &Subject, stance: &ScanStance) -> JointPositions {
    let at = subject.skeleton.joints_in_world(&stance.pose);
    let placed = subject.skeleton.ids().zip(at.into_iter().map(|p| stance.file_from_world * p));
    placed.filter_map(|(joint, p)| Some((subject.skeleton.human_joint(joint)?, p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Grasp, HumanJoint, Side};
    use crate::geometry::{SurfaceIndex, Vec3};
    use crate::measure::{hem_loops, hidden_body, surface_distance};
    use crate::studio::camera::{ScannerParams, TurntableParams};
    use crate::studio::garments::GarmentKind;

    fn coarse_params(garments: Vec<GarmentKind>) -> StudioParams {
        StudioParams {
            seed: 11,
            garments,
            one_scan: false,
            alike: false,
            turntable: TurntableParams { views: 8, ..TurntableParams::default() },
            scanner: ScannerParams { voxel: 0.02, faces: 4_000 },
            sway: 0.0,
            settling_secs: 0.25,
            turned: Vec::new(),
            hands: Grasp::RELAXED,
        }
    }

    fn coarse(garments: Vec<GarmentKind>) -> SyntheticSession {
        generate_session(&crate::body::embedded_model().unwrap(), &coarse_params(garments)).unwrap()
    }

    #[test]
    fn a_step_alone_is_that_of_its_session_and_joints_turn_as_requested() {
        let session = coarse(vec![GarmentKind::Skirt]);
        let model = crate::body::embedded_model().unwrap();
        let alone = generate_step(&model, &coarse_params(vec![GarmentKind::Skirt]), 1).unwrap();
        assert_eq!(alone.scan, session.steps[1].scan);
        assert_eq!(alone.truth.joints, session.steps[1].truth.joints);
        let up = vec![(HumanJoint::UpperArm(Side::Left), Vec3::z() * 30f64.to_radians())];
        let raised = StudioParams { turned: up, ..coarse_params(Vec::new()) };
        let raised = generate_step(&model, &raised, 0).unwrap();
        let forearm = |step: &SyntheticStep| {
            step.truth.joints[&HumanJoint::Hand(Side::Left)] - step.truth.joints[&HumanJoint::UpperArm(Side::Left)]
        };
        let turned = forearm(&raised).angle(&forearm(&session.steps[0])).to_degrees();
        assert!((29.0..31.0).contains(&turned) && forearm(&raised).y > forearm(&session.steps[0]).y, "{turned}");
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
        assert!((2.0..80.0).contains(&moved), "the stances differ: {moved}");
        let lowest = naked.truth.body.bounds().unwrap().min.y;
        assert!(lowest.abs() < 1e-9, "soles on the floor: {lowest}");
        assert!(session.bind.layers[0].points().iter().all(|p| p.coords.norm() < 2.0));
    }

    #[test]
    fn an_outfit_in_one_scan_has_two_steps_and_all_layers() {
        let garments = vec![GarmentKind::Trousers, GarmentKind::Shirt];
        let params = StudioParams { one_scan: true, ..coarse_params(garments) };
        let session = generate_session(&crate::body::embedded_model().unwrap(), &params).unwrap();
        assert_eq!(session.steps.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["body", "outfit"]);
        assert_eq!(session.steps.iter().map(|s| s.truth.layers.len()).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(session.bind.layers.len(), 2);
    }

    #[test]
    fn each_kind_has_its_hems() {
        let model = crate::body::embedded_model().unwrap();
        let subject = Subject::generate(&model, 12).unwrap();
        use GarmentKind::{Coat, Dress, Hat, Jacket, Pullover, Scarf, Socks, Tanktop, Trousers, Tshirt};
        // A garment that is open in front has one hem from the neck around the bottom.
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
            let garment = sew(kind, &subject, 12);
            let finished = garment.finished(&garment.sewn, false, &[]);
            assert_eq!(hem_loops(&finished), hems, "{}", kind.name());
            assert!((300..16_000).contains(&finished.vertex_count()), "{}", kind.name());
            assert_eq!(finished.vertex_count(), garment.finished_weights().len());
        }
    }

    #[test]
    fn garments_that_are_alike_have_the_colours_of_the_first() {
        let subject = Subject::generate(&crate::body::embedded_model().unwrap(), 11).unwrap();
        let painted = |alike: bool| {
            let params = StudioParams { alike, ..coarse_params(vec![GarmentKind::Coat, GarmentKind::Scarf]) };
            let garments = sewn(&params, &subject);
            [0, 1].map(|k: usize| garments[k].painted(&garments[1].sewn))
        };
        let ([coat, scarf], [unlike, other]) = (painted(true), painted(false));
        assert!(coat == scarf && coat == unlike && unlike != other);
    }

    #[test]
    fn a_texture_shows_what_the_colours_of_vertices_show() {
        let mut session = coarse(vec![GarmentKind::Tshirt]);
        let SyntheticStep { scan, colors, close_up, .. } = session.steps.remove(1);
        let mut textured = close_up.textured(&scan, &colors, 512, "scan.jpg").unwrap();
        assert!(textured.faces.len() == scan.face_count() && textured.texture.is_some());
        crate::scan::color_from_texture(&mut textured, &mut |_| ()).unwrap();
        let seen = SurfaceIndex::prepare(&scan);
        let mut pairs: Vec<[f64; 2]> = Vec::new();
        for (&p, color) in textured.points.iter().zip(textured.colors.as_ref().unwrap()) {
            let v = seen.closest(&p.into()).nearest_corner(&scan);
            pairs.extend((0..3).map(|c| [f64::from(color[c]), f64::from(colors[v][c])]));
        }
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
        let means = [mean(&|p| p[0]), mean(&|p| p[1])];
        let product = |i: usize, j: usize| mean(&|p| (p[i] - means[i]) * (p[j] - means[j]));
        // The camera's pictures are shaded, so that the texture is lighter.
        let correlation = product(0, 1) / (product(0, 0) * product(1, 1)).sqrt();
        assert!(correlation > 0.9, "{correlation}");
    }
}
