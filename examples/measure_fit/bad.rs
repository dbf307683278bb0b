//! Unusable scans: solved as far as they show the body, or refused; never a wrong result that claims to be right.

use crate::fits::{cleaned, joints};
use crate::subjects::{Cache, Posture, Subject, Wanted};
use anyhow::Result;
use overcoat::body::HumanJoint::{self, Hips, LowerArm, LowerLeg, Neck, Spine, UpperArm, UpperChest, UpperLeg};
use overcoat::body::Side::{Left, Right};
use overcoat::body::{BodyModel, Figure, Pose, Skeleton};
use overcoat::fit::{
    InsideParams, InsideReport, NakedParams, NakedReport, RegisterParams, fit_inside, fit_naked, register,
};
use overcoat::formats::RawMesh;
use overcoat::geometry::{NearestVertex, Point, Vec3, VertexId};
use overcoat::measure::{JointPositions, STRICT_JOINTS};
use overcoat::segment::{Extent, GarmentTemplate};
use overcoat::studio::GarmentKind;
use std::fmt;

/// A joint further off than this is wrong, in metres. The worst joint of a good scan is 15 mm off.
const WRONG: f64 = 0.03;
/// Size of a four-year-old child relative to an adult.
const CHILD: f64 = 0.58;

const HANDS_ON_HIPS: Posture = (
    "hands on hips",
    &[
        (UpperArm(Left), [0.0, 10.0, 0.0]),
        (UpperArm(Right), [0.0, -10.0, 0.0]),
        (LowerArm(Left), [0.0, -30.0, -95.0]),
        (LowerArm(Right), [0.0, 30.0, 95.0]),
    ],
);
const ARMS_CROSSED: Posture = (
    "arms crossed",
    &[
        (UpperArm(Left), [-25.0, -25.0, -28.0]),
        (UpperArm(Right), [-25.0, 25.0, 28.0]),
        (LowerArm(Left), [-30.0, -100.0, 0.0]),
        (LowerArm(Right), [-10.0, 105.0, 0.0]),
    ],
);
const SEATED: Posture = (
    "seated",
    &[
        (UpperLeg(Left), [-88.0, 0.0, 0.0]),
        (UpperLeg(Right), [-88.0, 0.0, 0.0]),
        (LowerLeg(Left), [88.0, 0.0, 0.0]),
        (LowerLeg(Right), [88.0, 0.0, 0.0]),
    ],
);

/// Further poses of a naked person: what people do with their arms without instructions.
const OTHER_POSTURES: [Posture; 6] = [
    (
        "hands behind",
        &[
            (UpperArm(Left), [25.0, 25.0, -30.0]),
            (UpperArm(Right), [25.0, -25.0, 30.0]),
            (LowerArm(Left), [20.0, 60.0, -20.0]),
            (LowerArm(Right), [20.0, -60.0, 20.0]),
        ],
    ),
    (
        "hands clasped",
        &[
            (UpperArm(Left), [-15.0, -20.0, -28.0]),
            (UpperArm(Right), [-15.0, 20.0, 28.0]),
            (LowerArm(Left), [-20.0, -45.0, -25.0]),
            (LowerArm(Right), [-20.0, 45.0, 25.0]),
        ],
    ),
    ("one hand on hip", &[(UpperArm(Left), [0.0, 15.0, -5.0]), (LowerArm(Left), [0.0, -25.0, -90.0])]),
    (
        "hands at head",
        &[
            (UpperArm(Left), [0.0, 0.0, 55.0]),
            (UpperArm(Right), [0.0, 0.0, -55.0]),
            (LowerArm(Left), [0.0, -20.0, 115.0]),
            (LowerArm(Right), [0.0, 20.0, -115.0]),
        ],
    ),
    ("arms forward", &[(UpperArm(Left), [0.0, -85.0, 30.0]), (UpperArm(Right), [0.0, 85.0, -30.0])]),
    ("one arm across", &[(UpperArm(Left), [-20.0, -30.0, -28.0]), (LowerArm(Left), [-25.0, -95.0, 0.0])]),
];

/// The outcome of one case.
struct Outcome {
    subject: String,
    case: String,
    verdict: Verdict,
}

enum Verdict {
    Solved(Summary),
    /// Refused, with the reason.
    Refused(String),
    /// The worst joint in metres and its name, though the report is confident.
    Wrong(f64, String, Summary),
    /// A wrong joint, and a report that is not confident.
    Doubted(f64, String, Summary),
    /// Right where the scan shows it, but the report does not name what is missing.
    Unreported(Summary),
}

/// What the report of either fit says of itself.
struct Summary {
    line: String,
    is_confident: bool,
    log: Vec<String>,
}

impl Summary {
    fn of_naked(report: &NakedReport) -> Self {
        let line = line(report.confidence, report.converged, report.residual_mean);
        Self { line, is_confident: report.is_confident(), log: report.log.clone() }
    }

    fn of_inside(report: &InsideReport) -> Self {
        let fit = line(report.confidence, report.converged, report.residual_mean);
        let (percent, depth_mm) = (100.0 * report.outside_share, 1e3 * report.outside_depth);
        let line = format!("{fit}, outside {percent:.1} % by {depth_mm:.0} mm");
        Self { line, is_confident: report.is_confident(), log: report.log.clone() }
    }
}

fn line(confidence: f64, converged: bool, residual_mean: f64) -> String {
    let state = if converged { "converged" } else { "not converged" };
    format!("confidence {confidence:.2}, {state}, residual {:.1} mm", 1e3 * residual_mean)
}

/// All outcomes.
#[derive(Default)]
pub struct Outcomes(Vec<Outcome>);

/// A scan with its joints, as far as it shows them.
struct Case {
    name: String,
    subject: Subject,
    /// The missing part that the log must name.
    missing: Option<&'static str>,
}

/// Runs all cases on one subject.
pub fn try_all(cache: &Cache<'_>, model: &BodyModel, seed: u64, outcomes: &mut Outcomes) -> Result<()> {
    let naked = cache.subject(&Wanted::naked(seed))?;
    let other = cache.subject(&Wanted::naked(seed + 1))?;
    let mut cases = damaged(model, &naked);
    for posture in [HANDS_ON_HIPS, ARMS_CROSSED, SEATED] {
        cases.push(Case::whole(posture.0, cache.subject(&Wanted::naked(seed).standing(posture))?));
    }
    let mut both = naked.clone();
    both.scan = together(&naked.scan, &moved(&other.scan, Vec3::new(0.55, 0.0, 0.1)));
    cases.push(Case::whole("two people", both));
    cases.push(Case::whole("holds a box", holding_a_box(&naked)));
    for case in &cases {
        let verdict = naked_verdict(model, case)?;
        outcomes.add(&naked.name, case, verdict);
    }

    let figure = registered(model, &naked)?;
    let kind = if seed.is_multiple_of(2) { GarmentKind::Tshirt } else { GarmentKind::Coat };
    let dressed = Wanted::wearing(seed, kind, 1);
    let dressed = cache.subject(&dressed)?;
    let mut cases = damaged(model, &dressed);
    for posture in [HANDS_ON_HIPS, ARMS_CROSSED, SEATED] {
        cases.push(Case::whole(posture.0, cache.subject(&Wanted::wearing(seed, kind, 1).standing(posture))?));
    }
    cases.push(Case::whole("holds a box", holding_a_box(&dressed)));
    cases.push(Case::whole("another person", Subject { kind: Some(kind), ..other }));
    for case in &cases {
        let verdict = dressed_verdict(model, &figure, kind, case)?;
        outcomes.add(&dressed.name, case, verdict);
    }
    Ok(())
}

/// Naked people in unexpected poses.
pub fn try_postures(cache: &Cache<'_>, model: &BodyModel, seed: u64, outcomes: &mut Outcomes) -> Result<()> {
    for posture in [HANDS_ON_HIPS, ARMS_CROSSED, SEATED].into_iter().chain(OTHER_POSTURES) {
        let subject = cache.subject(&Wanted::naked(seed).standing(posture))?;
        let case = Case::whole(posture.0, subject);
        let verdict = naked_verdict(model, &case)?;
        outcomes.add(&case.subject.name, &case, verdict);
    }
    Ok(())
}

impl Case {
    fn whole(name: &str, subject: Subject) -> Self {
        Self { name: name.into(), subject, missing: None }
    }
}

/// Parts cut away, and a child.
fn damaged(model: &BodyModel, subject: &Subject) -> Vec<Case> {
    let joint = |joint: HumanJoint| subject.truth.joints[&joint];
    let waist = joint(Spine).y + 0.05;
    let middle = joint(Hips);
    let gone = [
        ("without right arm", UpperArm(Right), Some("right arm")),
        ("without left leg", UpperLeg(Left), Some("left leg")),
        ("without head", Neck, Some("head")),
    ];
    let mut cases: Vec<Case> = gone
        .into_iter()
        .map(|(name, from, missing)| {
            let is_gone = |j: HumanJoint| below(&model.skeleton, j, from);
            let mut cut = subject.clone();
            cut.scan = kept(&subject.scan, &moved_by(model, subject), |j, _| !is_gone(j));
            cut.truth.joints.retain(|j, _| !is_gone(*j));
            Case { name: name.into(), subject: cut, missing }
        })
        .collect();
    type Half = (&'static str, fn(&Point, &Point, f64) -> bool);
    let halves: [Half; 4] = [
        ("left half", |p, middle, _| p.x > middle.x),
        ("front half", |p, middle, _| p.z > middle.z),
        ("upper half", |p, _, waist| p.y > waist),
        ("legs alone", |p, _, waist| p.y < waist),
    ];
    for (name, is_kept) in halves {
        let mut cut = subject.clone();
        cut.scan = kept(&subject.scan, &moved_by(model, subject), |_, p| is_kept(p, &middle, waist));
        // What is seen from the front shows all joints.
        cut.truth.joints.retain(|_, p| name == "front half" || is_kept(p, &middle, waist));
        cases.push(Case::whole(name, cut));
    }
    let mut child = subject.clone();
    child.scan.points.iter_mut().for_each(|p| *p = p.map(|c| c * CHILD));
    child.truth.joints.values_mut().for_each(|p| *p = Point::from(p.coords * CHILD));
    cases.push(Case::whole("child", child));
    cases
}

pub fn below(skeleton: &Skeleton, joint: HumanJoint, ancestor: HumanJoint) -> bool {
    skeleton.find(joint).is_some_and(|j| skeleton.is_part_of(j, ancestor))
}

/// For each point of the scan the joint that moves the skin next to it most.
pub fn moved_by(model: &BodyModel, subject: &Subject) -> Vec<HumanJoint> {
    let skin = NearestVertex::prepare(subject.truth.body.points().as_slice());
    let strongest = |p: &[f64; 3]| {
        let nearest = skin.nearest(&Point::from(*p)).map_or(VertexId(0), |found| found.0);
        model.skeleton.human_joint(model.weights.rows()[nearest][0].0).unwrap_or(Hips)
    };
    subject.scan.points.iter().map(strongest).collect()
}

pub fn kept(scan: &RawMesh, moved_by: &[HumanJoint], keep: impl Fn(HumanJoint, &Point) -> bool) -> RawMesh {
    let stays: Vec<bool> = scan.points.iter().zip(moved_by).map(|(p, j)| keep(*j, &Point::from(*p))).collect();
    let faces = scan.faces.iter().copied().filter(|f| f.iter().all(|&v| stays[v as usize])).collect();
    RawMesh { points: scan.points.clone(), faces, ..RawMesh::default() }
}

fn moved(scan: &RawMesh, by: Vec3) -> RawMesh {
    let points = scan.points.iter().map(|p| (Point::from(*p) + by).into()).collect();
    RawMesh { points, faces: scan.faces.clone(), ..RawMesh::default() }
}

fn together(a: &RawMesh, b: &RawMesh) -> RawMesh {
    let first = a.points.len() as u32;
    let points = a.points.iter().chain(&b.points).copied().collect();
    let faces = a.faces.iter().copied().chain(b.faces.iter().map(|f| f.map(|v| v + first))).collect();
    RawMesh { points, faces, ..RawMesh::default() }
}

/// A carton before the chest that takes the forearms in.
fn holding_a_box(subject: &Subject) -> Subject {
    const EDGE: usize = 14;
    let at = subject.truth.joints[&UpperChest];
    let corner = |s: [f64; 3]| at + Vec3::new(-0.25 + 0.5 * s[0], -0.3 + 0.3 * s[1], 0.08 + 0.35 * s[2]);
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for (axis, side) in (0..3).flat_map(|axis| [(axis, 0.0), (axis, 1.0)]) {
        let first = points.len() as u32;
        for (i, j) in (0..=EDGE).flat_map(|i| (0..=EDGE).map(move |j| (i, j))) {
            let mut s = [0.0; 3];
            s[axis] = side;
            s[(axis + 1) % 3] = i as f64 / EDGE as f64;
            s[(axis + 2) % 3] = j as f64 / EDGE as f64;
            points.push(corner(s).into());
        }
        let row = EDGE as u32 + 1;
        for (i, j) in (0..EDGE as u32).flat_map(|i| (0..EDGE as u32).map(move |j| (i, j))) {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| first + i * row + j);
            faces.extend(if side > 0.5 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
        }
    }
    let carton = RawMesh { points, faces, ..RawMesh::default() };
    Subject { scan: together(&subject.scan, &carton), ..subject.clone() }
}

fn registered(model: &BodyModel, naked: &Subject) -> Result<(Figure, Pose)> {
    let (scan, _) = cleaned(naked)?;
    let fitted = fit_naked(&scan, model, &NakedParams::default(), &mut |_| {})?;
    let found = register(&scan, model, &fitted, &RegisterParams::default(), &mut |_| {})?;
    Ok((Figure::bare(found.skeleton, found.surface, model.weights.clone()), found.pose))
}

fn naked_verdict(model: &BodyModel, case: &Case) -> Result<Verdict> {
    let Ok((scan, truth)) = cleaned(&case.subject) else { return Ok(Verdict::Refused("no surface".into())) };
    Ok(match fit_naked(&scan, model, &NakedParams::default(), &mut |_| {}) {
        Err(e) => Verdict::Refused(e.to_string()),
        Ok(found) => verdict(&found.skeleton, &found.pose, Summary::of_naked(&found.report), &truth.joints, case),
    })
}

fn dressed_verdict(model: &BodyModel, body: &(Figure, Pose), kind: GarmentKind, case: &Case) -> Result<Verdict> {
    let Ok((scan, truth)) = cleaned(&case.subject) else { return Ok(Verdict::Refused("no surface".into())) };
    let (figure, pose) = body;
    let template = GarmentTemplate::built_in(kind.template())?;
    let cover = template.cover(figure.body(), &figure.skeleton, &Extent::default()).unwrap();
    let params = InsideParams::default();
    Ok(match fit_inside(&scan, figure, pose, &cover, &model.limits, &params, &mut |_| {}) {
        Err(e) => Verdict::Refused(e.to_string()),
        Ok(found) => verdict(&figure.skeleton, &found.pose, Summary::of_inside(&found.report), &truth.joints, case),
    })
}

fn verdict(skeleton: &Skeleton, pose: &Pose, report: Summary, truth: &JointPositions, case: &Case) -> Verdict {
    let found = joints(skeleton, pose);
    let off = STRICT_JOINTS.iter().filter_map(|j| Some(((found.get(j)? - truth.get(j)?).norm(), j.name())));
    let Some((most, joint)) = off.max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return Verdict::Solved(report);
    };
    if most > WRONG {
        let wrong = if report.is_confident { Verdict::Wrong } else { Verdict::Doubted };
        return wrong(most, joint.into(), report);
    }
    match case.missing {
        Some(part) if !report.log.iter().any(|l| l.contains("does not show") && l.contains(part)) => {
            Verdict::Unreported(report)
        }
        _ => Verdict::Solved(report),
    }
}

impl Outcomes {
    fn add(&mut self, subject: &str, case: &Case, verdict: Verdict) {
        let outcome = Outcome { subject: subject.into(), case: case.name.clone(), verdict };
        println!("{outcome}");
        self.0.push(outcome);
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:16} {:18} ", self.subject, self.case)?;
        match &self.verdict {
            Verdict::Solved(report) => write!(f, "solved, {}", report.line),
            Verdict::Refused(why) => write!(f, "refused: {why}"),
            Verdict::Unreported(report) => write!(f, "solved, but the missing part is not reported, {}", report.line),
            Verdict::Wrong(off, joint, report) => {
                write!(f, "WRONG: {joint} {:.0} mm off, {}", 1e3 * off, report.line)
            }
            Verdict::Doubted(off, joint, report) => {
                write!(f, "{joint} {:.0} mm off, and doubted: {}", 1e3 * off, report.line)
            }
        }
    }
}

impl fmt::Display for Outcomes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return Ok(());
        }
        let count = |of: fn(&Verdict) -> bool| self.0.iter().filter(|o| of(&o.verdict)).count();
        writeln!(
            f,
            "### Bad input: {} scans, {} solved, {} refused, {} solved without a report of what is missing, {} off and doubted, {} wrong\n",
            self.0.len(),
            count(|v| matches!(v, Verdict::Solved(_))),
            count(|v| matches!(v, Verdict::Refused(_))),
            count(|v| matches!(v, Verdict::Unreported(_))),
            count(|v| matches!(v, Verdict::Doubted(..))),
            count(|v| matches!(v, Verdict::Wrong(..)))
        )?;
        self.0
            .iter()
            .filter(|o| matches!(o.verdict, Verdict::Wrong(..) | Verdict::Doubted(..)))
            .try_for_each(|o| writeln!(f, "{o}"))
    }
}
