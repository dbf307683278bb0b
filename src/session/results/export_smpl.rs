//! Exports shape and poses of a body of the SMPL family.

use super::export_request::{ExportRequest, Exported, Faces, Textures};
use super::outputs::{Content, Outputs};
use crate::body::Pose;
use crate::export::{Bones, FileAxes};
use crate::formats::SmplMotion;
use crate::geometry::{Point, Vec3};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::standing;
use nalgebra::UnitQuaternion;

impl Session {
    /// Writes an `.npz` in the layout of AMASS: the shape of the fit, and the last animation; without one, or with a step, one
    /// pose.
    ///
    /// **Errors** if the body model is not of the family.
    pub(super) fn export_smpl(&self, request: &ExportRequest, outputs: &mut Outputs) -> Result<Exported, SessionError> {
        check_smpl_request(request)?;
        let steps = self.posed_steps(request.at.as_deref())?;
        let fitted = steps.first().and_then(|body| body.fitted.as_ref());
        let (Some(last), Some(fitted)) = (steps.last(), fitted) else { return Ok(Exported::default()) };
        let model = self.body_model()?;
        if !model.skeleton.is_of_smpl_family() {
            return Err(SessionError::BadRequest {
                what: "an .npz holds parameters of the SMPL family, and this session has another body model".into(),
                hint: "export a .glb or .usdc, or begin with `overcoat new DIR --body MODEL.npz`".into(),
            });
        }
        outputs.claim(&request.target, Content::SmplMotion)?;
        let (skeleton, poses, fps) = if request.at.is_some() {
            (last.figure.skeleton.clone(), vec![last.pose.clone()], None)
        } else {
            let skeleton = standing(last.figure.clone(), &last.step.name)?.skeleton;
            match self.recipe.animations.last() {
                None => (skeleton.clone(), vec![Pose::bind(skeleton.len())], None),
                Some(_) => {
                    let track = self.moved_figure(None)?.track;
                    (skeleton, track.clip_poses().to_vec(), Some(track.fps))
                }
            }
        };
        let root = model.skeleton_of(&fitted.shape).joints_in_bind[0];
        let (translations, rotations) = poses.iter().map(|pose| z_up(pose, &skeleton.joints_in_bind[0], &root)).unzip();
        let motion = SmplMotion { betas: fitted.shape.0.clone(), translations, rotations, fps };
        let bytes = motion.write().map_err(|e| SessionError::bad_source(&request.target, e))?;
        let (frames, name) = (poses.len(), self.recipe.animations.last().filter(|_| request.at.is_none()));
        outputs.notice(match name {
            Some(animation) => {
                format!("shape of the fit, {frames} frames of '{}'; garments are not in an .npz", animation.name)
            }
            None => "shape of the fit, one pose; garments are not in an .npz".into(),
        });
        outputs.write_bytes(&request.target, Content::SmplMotion, bytes)?;
        Ok(Exported { files: vec![request.target.clone()], ..Exported::default() })
    }
}

/// The translation and the rotation vectors of a pose with Z up. `hips` is the figure's first joint in the bind pose, `root`
/// where the shape puts it.
fn z_up(pose: &Pose, hips: &Point, root: &Point) -> ([f64; 3], Vec<[f64; 3]>) {
    let turn = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2);
    let place = turn * (hips + pose.translation);
    let of_joint = |(j, rotation): (usize, &UnitQuaternion<f64>)| {
        (if j == 0 { turn * rotation } else { *rotation }).scaled_axis().into()
    };
    ((place - root).into(), pose.rotations.iter().enumerate().map(of_joint).collect())
}

/// **Errors** for an option that concerns layers.
fn check_smpl_request(request: &ExportRequest) -> Result<(), SessionError> {
    let of_layers = [
        ("--scan", request.scan.is_some()),
        ("--stage", request.before_registration),
        ("--layers", !request.layers.is_empty()),
        ("--hide-covered", request.hide_covered),
        ("--influences", request.eight_influences),
        ("--for", request.engine.is_some()),
        ("--author", !request.authors.is_empty()),
        ("--bake-cloth", request.bake_cloth.is_some()),
        ("--bones", request.bones != Bones::default()),
        ("--rest", request.rest.is_some()),
        ("--up", request.axes.up != FileAxes::default().up),
        ("--unit", request.axes.unit != FileAxes::default().unit),
        ("--name", request.name.is_some()),
        ("--normal-map", request.normal_map),
        ("--texture", request.textures != Textures::AsUsual),
        ("--faces", matches!(request.faces, Faces::Fewer(_))),
        ("--quads", matches!(request.faces, Faces::Quads(_))),
        ("--lint", request.lint),
    ];
    match of_layers.into_iter().find(|(_, is_requested)| *is_requested) {
        Some((option, _)) => Err(SessionError::BadRequest {
            what: format!("an .npz holds shape and poses of the body, so {option} changes nothing"),
            hint: format!("leave {option} out, or export a .glb"),
        }),
        None => Ok(()),
    }
}
