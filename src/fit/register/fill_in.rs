//! Multi-view fill-in: skin that the naked scan does not show but another scan of the same person does.

use super::colors::color_at;
use super::targets::{TargetPoint, target_on};
use crate::body::{BodyModel, Figure, Pose, skin, unskin};
use crate::fit::correspondence::ScanSurface;
use crate::fit::error::{FitError, require_length};
use crate::fit::inside::{Cover, FigureSurface};
use crate::fit::naked::FittedBody;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId};
use crate::scan::Scan;

/// Another scan of the same person in which the body's pose is known.
#[derive(Clone, Debug)]
pub struct FillInView<'a> {
    /// The scan.
    pub scan: &'a Scan,
    /// The body's pose in the frame of that scan.
    pub pose: &'a Pose,
    /// What the clothes in that scan do over the body. **Shapes** one entry per vertex of the body.
    pub cover: PerVertex<Cover>,
}

/// A view prepared for queries.
pub(crate) struct PreparedView<'a> {
    surface: ScanSurface,
    seen: &'a FillInView<'a>,
    /// Vertices of the model that the view shows as bare skin.
    visible: PerVertex<bool>,
}

impl<'a> PreparedView<'a> {
    /// **Errors** [`FitError::WrongLength`] for a pose or cover of another body.
    pub(crate) fn prepare(seen: &'a FillInView<'a>, bare: &Figure) -> Result<Self, FitError> {
        require_length(
            "rotations of the pose in another scan, per joint",
            seen.pose.rotations.len(),
            bare.skeleton.len(),
        )?;
        require_length(
            "cover in another scan, per vertex of the body",
            seen.cover.len(),
            bare.body().mesh.vertex_count(),
        )?;
        let figure_surface = FigureSurface::prepare(bare, &seen.cover)?;
        let visible = bare.body().mesh.vertex_ids().map(|v| figure_surface.is_certainly_skin(v)).collect();
        Ok(Self { surface: ScanSurface::prepare(seen.scan), seen, visible })
    }

    pub(crate) fn posed(
        &self,
        body: &TriMesh,
        bind: &PerVertex<Point>,
        model: &BodyModel,
        fitted: &FittedBody,
    ) -> TriMesh {
        body.with_points(skin(bind, &model.weights, &fitted.skeleton, self.seen.pose))
    }
}

/// Gives targets to vertices of `body`, a surface in the naked scan, that have none: the mean of their targets in the other
/// scans, transformed back through the bind pose.
pub(crate) fn fill_targets(
    targets: &mut [TargetPoint],
    others: &[PreparedView<'_>],
    body: &TriMesh,
    model: &BodyModel,
    fitted: &FittedBody,
    reach: f64,
) {
    if others.is_empty() {
        return;
    }
    let (weights, skeleton) = (&model.weights, &fitted.skeleton);
    let bind = unskin(body.points(), weights, skeleton, &fitted.pose);
    let mut moves = vec![Vec3::zeros(); bind.len()];
    let mut total = vec![0.0; bind.len()];
    for other in others {
        let posed = other.posed(body, &bind, model, fitted);
        let normals = posed.vertex_normals();
        let found: PerVertex<TargetPoint> = posed
            .points()
            .enumerate()
            .map(|(v, p)| {
                let is_wanted = targets[v.index()].is_none() && other.visible[v];
                if is_wanted { target_on(&other.surface, p, &normals[v], reach) } else { None }
            })
            .collect();
        let there: PerVertex<Point> =
            posed.points().iter().zip(found.iter()).map(|(p, t)| t.map_or(*p, |(place, _)| place)).collect();
        let back = unskin(&there, weights, skeleton, other.seen.pose);
        for (i, (_, pull)) in found.iter().enumerate().filter_map(|(i, t)| Some((i, (*t)?))) {
            moves[i] += (back.0[i] - bind.0[i]) * pull;
            total[i] += pull;
        }
    }
    let moved: PerVertex<Point> = bind
        .iter()
        .zip(moves.iter().zip(&total))
        .map(|(p, (sum, total))| if *total > 0.0 { p + sum / *total } else { *p })
        .collect();
    let moved = skin(&moved, weights, skeleton, &fitted.pose);
    for (i, target) in targets.iter_mut().enumerate().filter(|(i, _)| total[*i] > 0.0) {
        *target = Some((moved.0[i], f64::min(total[i], 1.0)));
    }
}

/// Gives colours to vertices that have none, from the first of the other scans that shows them.
pub(crate) fn fill_colors(
    colors: &mut [Option<Vec3>],
    others: &[PreparedView<'_>],
    body: &TriMesh,
    model: &BodyModel,
    fitted: &FittedBody,
) {
    let bind = unskin(body.points(), &model.weights, &fitted.skeleton, &fitted.pose);
    for other in others {
        let Some(of_scan) = &other.seen.scan.colors else { continue };
        let posed = other.posed(body, &bind, model, fitted);
        let normals = posed.vertex_normals();
        for (i, color) in colors.iter_mut().enumerate().filter(|(_, color)| color.is_none()) {
            let v = VertexId::from_index(i);
            if other.visible[v] {
                *color = color_at(&other.surface, of_scan, &posed.points()[v], &normals[v]);
            }
        }
    }
}
