//! The poster: the whole session in one picture.

use super::sheet::SeenStep;
use crate::body::HumanJoint::{self, Chest, Foot, Head, LowerArm, LowerLeg, Neck, Spine, UpperArm, UpperLeg};
use crate::body::Side::{Left, Right};
use crate::body::{Pose, Skeleton};
use crate::geometry::{TriMesh, Vec3};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, Outputs};
use crate::view::{Paint, Part, Poster, layer_color, poster};
use nalgebra::UnitQuaternion;
use std::path::Path;

/// A step forward with a raised hand: degrees about x (leg forward is negative), y and z, as seen in the bind pose.
const POSE: [(HumanJoint, [f64; 3]); 14] = [
    (Spine, [1.0, 4.0, 0.0]),
    (Chest, [0.0, 5.0, 1.0]),
    (Neck, [0.0, 6.0, 0.0]),
    (Head, [-2.0, 10.0, -3.0]),
    (UpperArm(Left), [0.0, 0.0, 18.0]),
    (LowerArm(Left), [-12.0, 0.0, 34.0]),
    (UpperArm(Right), [6.0, 0.0, 22.0]),
    (LowerArm(Right), [-14.0, -12.0, 0.0]),
    (UpperLeg(Left), [-5.0, 0.0, -2.0]),
    (LowerLeg(Left), [5.0, 0.0, 0.0]),
    (Foot(Left), [0.0, 0.0, 0.0]),
    (UpperLeg(Right), [4.0, 0.0, 2.0]),
    (LowerLeg(Right), [2.0, 0.0, 0.0]),
    (Foot(Right), [-6.0, 0.0, 0.0]),
];

impl Session {
    /// Draws the scans, the separated layers and the figure in a new pose, and writes a PNG.
    pub fn write_poster(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let steps = self.posed_steps_so_far()?;
        let Some(last) = steps.last() else {
            return self.posed_steps(None).map(drop);
        };
        let seen: Vec<SeenStep> = steps.iter().map(SeenStep::of).collect();
        let mut scans = Vec::new();
        for (k, (posed, seen)) in steps.iter().zip(&seen).enumerate() {
            let plus = if k == 0 { "" } else { "+ " };
            scans.push((format!("{plus}{}", posed.step.name), seen.scan()?));
        }
        let figure = &last.figure;
        let painted = |mesh, k: usize| match &figure.layers[k].colors {
            Some(colors) => {
                Part::try_new(mesh, Paint::PerVertex(colors)).map_err(|e| SessionError::bad_source(path, e))
            }
            None => Ok(Part::solid(mesh, layer_color(k))),
        };
        let layers = figure.layers.iter().enumerate();
        let layers = layers.map(|(k, layer)| Ok((layer.name.clone(), painted(&layer.mesh, k)?)));
        let layers = layers.collect::<Result<Vec<_>, SessionError>>()?;
        let posed: Vec<TriMesh> = figure.posed(&striding(&figure.skeleton));
        let posed_parts = posed.iter().enumerate().map(|(k, mesh)| painted(mesh, k));
        let posed_parts = posed_parts.collect::<Result<Vec<_>, SessionError>>()?;
        let drawn = poster(&Poster {
            title: format!("{}: scans, layers, posed figure", self.name()),
            subtitle: format!(
                "{}, one more garment each; {} on one skeleton; {}{}",
                counted(steps.len(), "scan"),
                counted(figure.layers.len(), "layer"),
                self.counted_crossings()?,
                match self.recipe.steps.len() - steps.len() {
                    0 => String::new(),
                    missing => format!("; {missing} of {} steps are not built", self.recipe.steps.len()),
                }
            ),
            scans,
            layers,
            figure: posed_parts,
            figure_caption: "all layers, posed by their weights".into(),
        });
        outputs.write(path, Content::Picture, |out| drawn.write_png(out))
    }
}

impl Session {
    /// What stacking counted in the bind pose, over all layers.
    fn counted_crossings(&self) -> Result<String, SessionError> {
        let reports = self.status()?.into_iter().flat_map(|step| step.up_to_date);
        let pairs: f64 = reports.filter_map(|report| report.measures.get("intersecting_pairs").copied()).sum();
        Ok(match pairs as usize {
            1 => "1 crossing between layers in the bind pose".into(),
            n => format!("{n} crossings between layers in the bind pose"),
        })
    }
}

/// `1 scan`, `2 scans`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn striding(skeleton: &Skeleton) -> Pose {
    let mut pose = Pose::bind(skeleton.len());
    for (joint, degrees) in POSE {
        if let Some(joint) = skeleton.find(joint) {
            let [x, y, z] = degrees.map(f64::to_radians);
            let about = |axis: nalgebra::Unit<Vec3>, angle| UnitQuaternion::from_axis_angle(&axis, angle);
            pose.rotations[joint.index()] =
                about(Vec3::y_axis(), y) * about(Vec3::x_axis(), x) * about(Vec3::z_axis(), z);
        }
    }
    pose
}
