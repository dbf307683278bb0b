//! One shape from all scans of a person, beside that of the naked scan alone: of a whole naked scan, and of one that lacks
//! an arm or has a side torn open.

use crate::bad::{below, kept, moved_by};
use crate::fits::{Judge, cleaned, joints, refused};
use crate::subjects::Subject;
use crate::table::{Group, Metric, Row, State, Table, Way};
use anyhow::Result;
use overcoat::body::Figure;
use overcoat::body::HumanJoint::{self, Hand, LowerLeg, UpperArm};
use overcoat::body::Side::{Left, Right};
use overcoat::fit::{
    Cover, FillInView, FitError, InsideParams, NakedParams, OtherScan, RegisterHints, RegisterParams, RegisteredBody,
    fit_inside, fit_naked, fit_together, register_with_hints,
};
use overcoat::geometry::{PerVertex, Point};
use overcoat::measure::{TruthStep, joint_mean_mm, surface_distance};
use overcoat::scan::Scan;
use overcoat::segment::{Extent, GarmentTemplate};

/// Half the length of the hole, metres: a scanner's blind spot beside the trunk.
const HOLE: f64 = 0.12;

/// A scan, its truth and what is worn in it.
struct Worn {
    subject: Subject,
    scan: Scan,
    truth: TruthStep,
}

impl Judge<'_> {
    /// Judges both ways on a whole naked scan and on damaged ones, `others` being scans of the same person in clothes.
    pub fn shapes(&self, naked: &Subject, others: Vec<Subject>, table: &mut Table) -> Result<()> {
        let mut worn = Vec::new();
        for subject in others {
            let (scan, truth) = cleaned(&subject)?;
            worn.push(Worn { subject, scan, truth });
        }
        let joint = |joint: HumanJoint| naked.truth.joints[&joint];
        let by = moved_by(self.model, naked);
        let is_arm = |j: HumanJoint| below(&self.model.skeleton, j, UpperArm(Right));
        let (shin, hand) = (joint(LowerLeg(Left)), joint(Hand(Left)));
        let near = |p: &Point, c: &Point| (p - c).norm() < HOLE;
        let cut = |keep: &dyn Fn(HumanJoint, &Point) -> bool| {
            let mut cut = naked.clone();
            cut.scan = kept(&naked.scan, &by, |j, p| keep(j, p));
            cut
        };
        self.both_ways(Group::Whole, naked, &worn, table)?;
        self.both_ways(Group::Armless, &cut(&|j, _| !is_arm(j)), &worn, table)?;
        self.both_ways(Group::Holes, &cut(&|_, p| !near(p, &shin) && !near(p, &hand)), &worn, table)
    }

    fn both_ways(&self, group: Group, naked: &Subject, worn: &[Worn], table: &mut Table) -> Result<()> {
        let (scan, truth) = cleaned(naked)?;
        for way in [Way::Robust, Way::Together] {
            let row = match self.made(way, &scan, worn) {
                Ok((by_model, found, report)) => {
                    let figure = Figure::bare(found.skeleton, found.surface, self.model.weights.clone());
                    let body = figure.body().posed(&figure.skeleton, &found.pose);
                    let registered = surface_distance(&body, &truth.body).surface_mean_mm;
                    let mut measured = vec![
                        (Metric::Model, Some(surface_distance(&by_model, &truth.body).surface_mean_mm)),
                        (Metric::JointsNaked, joint_mean_mm(&joints(&figure.skeleton, &found.pose), &truth.joints)),
                    ];
                    if group == Group::Whole {
                        measured.push((Metric::Registered, Some(registered)));
                    }
                    for (k, metric) in [Metric::First, Metric::Second].into_iter().enumerate() {
                        measured.push((metric, worn.get(k).and_then(|w| self.in_next(&figure, &found.pose, w))));
                    }
                    let state = if report.converged { State::Converged } else { State::Running };
                    if way == Way::Together {
                        report.log.iter().filter(|l| l.contains("shape")).for_each(|l| println!("    {l}"));
                    }
                    Row {
                        group,
                        way,
                        name: naked.name.clone(),
                        measured,
                        state,
                        confidence: report.confidence,
                        secs: 0.0,
                    }
                }
                Err(error) => refused(group, way, naked, &error),
            };
            table.add(row);
        }
        Ok(())
    }

    /// The body by model alone as it stands in the naked scan, the registered one, and the fit's report.
    fn made(
        &self,
        way: Way,
        scan: &Scan,
        worn: &[Worn],
    ) -> Result<(overcoat::geometry::TriMesh, RegisteredBody, overcoat::fit::NakedReport), FitError> {
        let (model, params) = (self.model, NakedParams::default());
        let mut fitted = fit_naked(scan, model, &params, &mut |_| {})?;
        let covers: Vec<PerVertex<Cover>> = worn.iter().map(|w| cover_of(&fitted.figure(model), &w.subject)).collect();
        let mut fill_in = Vec::new();
        if way == Way::Together {
            let others: Vec<OtherScan> = (worn.iter().zip(&covers))
                .map(|(w, cover)| OtherScan {
                    name: &w.subject.name,
                    scan: &w.scan,
                    cover: cover.clone(),
                    params: InsideParams::default(),
                })
                .collect();
            fitted = fit_together(scan, &fitted, &others, model, &params, &mut |_| {})?;
            fill_in = (others.into_iter().zip(&fitted.poses_in_others))
                .filter_map(|(o, pose)| Some(FillInView { scan: o.scan, pose: pose.as_ref()?, cover: o.cover }))
                .collect();
        }
        let by_model = fitted.surface.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
        let hints = RegisterHints { fill_in: &fill_in, ..RegisterHints::default() };
        let found = register_with_hints(scan, model, &fitted, &hints, &RegisterParams::default(), &mut |_| {})?;
        Ok((by_model, found, fitted.report))
    }

    /// Mean distance of the whole body, laid into a dressed scan, from the true one, in millimetres.
    fn in_next(&self, figure: &Figure, pose: &overcoat::body::Pose, worn: &Worn) -> Option<f64> {
        let cover = cover_of(figure, &worn.subject);
        let (limits, params) = (&self.model.limits, InsideParams::default());
        let found = fit_inside(&worn.scan, figure, pose, &cover, limits, &params, &mut |_| {}).ok()?;
        let posed = figure.body().posed(&figure.skeleton, &found.pose);
        Some(surface_distance(&posed, &worn.truth.body).surface_mean_mm)
    }
}

fn cover_of(figure: &Figure, subject: &Subject) -> PerVertex<Cover> {
    let template = subject.kind.and_then(|kind| GarmentTemplate::built_in(kind.template()).ok());
    let of = |t: GarmentTemplate| t.cover(figure.body(), &figure.skeleton, &Extent::default()).unwrap();
    template.map_or_else(|| PerVertex::filled(Cover::Bare, figure.body().mesh.vertex_count()), of)
}
