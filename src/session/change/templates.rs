//! Kinds of garment painted on the body (Hu 2017, Fig. 6): written for painting, and added to a session.

use crate::body::{BodyModel, Layer};
use crate::cut::Garment;
use crate::formats::{PlyOptions, read_ply, write_ply};
use crate::geometry::{PerVertex, Point, Vec3};
use crate::scan::Scan;
use crate::segment::{GarmentTemplate, LabelledSurface, PaintedRegion, SegmentError};
use crate::session::error::SessionError;
use crate::session::open::{Session, Writer, read_body_model, source, templates};
use crate::session::recipe::PaintedKind;
use crate::session::results::{Content, Outputs, ToPaint};
use crate::session::store::ContentHash;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// A painted kind that was added.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TemplateReport {
    /// Its name.
    pub name: String,
    /// The kind from which it has everything but its region.
    pub like: String,
    /// Covered vertices of the body model.
    pub covered_vertices: usize,
    /// Vertices of the body model.
    pub vertices: usize,
    /// Whether a kind of that name was replaced.
    pub replaced: bool,
    /// The steps of that kind, which are out of date now.
    pub used_by: Vec<String>,
}

/// The first lines of a painted kind's file.
const HEADER: &str = "# A kind of garment painted on the body model. Its region has a hexadecimal digit for every four vertices.\n\
                      # [trunk] and [arms], where they are, only say where cloth is tight. You may edit everything else.\n\n";

const HOW_TO_PAINT: &str = "paint the file that `overcoat templates paint KIND OUT.ply` writes: red where the garment covers the body, grey elsewhere";

/// Writes the body model in its bind pose as PLY, with the region of a kind in red, as `quality` and as `label`. Returns the
/// number of vertices. Without a session the body is the embedded model.
pub fn write_template_to_paint(
    session: Option<&Session>,
    kind: &str,
    target: &Path,
    outputs: &mut Outputs,
) -> Result<usize, SessionError> {
    let (template, model) = match session {
        Some(session) => (session.recipe.template(kind), session.body_model()?),
        None => (GarmentTemplate::built_in(kind), read_body_model(None)?),
    };
    let template = template.map_err(|e| wrong(&e))?;
    let body = bind_pose(&model);
    let covered = template.prior(&body, &model.skeleton, &Default::default()).map_err(|e| wrong(&e))?;
    let mesh = LabelledSurface::of_region(&body.mesh, &covered).map_err(|e| wrong(&e))?.to_template();
    outputs.write(target, Content::Mesh, |out| write_ply(&mesh, &PlyOptions::default(), out))?;
    Ok(mesh.points.len())
}

impl Session {
    /// A kind as a page shows it to be painted: the body in its bind pose instead of a scan, the covered vertices instead of
    /// labels, the covered part instead of a garment.
    ///
    /// **Frame** the body model's: metres, Y up, facing +Z.
    ///
    /// **Errors** if there is no such kind, or if it is one that nobody paints.
    pub fn kind_to_paint(&self, kind: &str) -> Result<ToPaint, SessionError> {
        let template = self.recipe.template(kind).map_err(|e| wrong(&e))?;
        if template.grows {
            return Err(SessionError::BadRequest {
                what: format!("'{}' grows on the body, so its region is found, not painted", template.name),
                hint: "paint a kind that is worn, such as hat".into(),
            });
        }
        let model = self.body_model()?;
        let body = bind_pose(&model);
        let covered = template.prior(&body, &model.skeleton, &Default::default()).map_err(|e| wrong(&e))?;
        Ok(ToPaint {
            // Painted regions belong to a body model.
            scan_name: self
                .recipe
                .body
                .as_ref()
                .and_then(|file| file.hash)
                .map_or("embedded".into(), |hash| hash.short()),
            garment: Garment::on_skin(&body.mesh, &covered),
            labels: covered,
            others: Vec::new(),
            expected_hems: template.expected_loops(),
            inside: Vec::new(),
            middle: Point::origin(),
            facing: Vec3::z(),
            scan: Arc::new(Scan::from_clean_mesh(body.mesh, None)),
        })
    }

    /// The hash of a painted kind's file; `None` if there is no painted kind of that name.
    pub fn kind_hash(&self, name: &str) -> Option<ContentHash> {
        self.recipe.templates.iter().find(|kind| kind.name == name)?.hash
    }

    /// The steps that are of that kind.
    pub fn steps_of_kind(&self, name: &str) -> Vec<String> {
        let steps = self.recipe.steps.iter().filter(|step| step.template.as_deref() == Some(name));
        steps.map(|step| step.name.clone()).collect()
    }

    /// Checks that a kind of that name can be painted: it is not built in, and it can be the name of a file.
    pub fn check_kind_name(&self, name: &str) -> Result<(), SessionError> {
        self.recipe.check_kind_name(name)
    }
}

impl Writer {
    /// Makes the covered vertices of the body model the region of a painted kind, which is added, or replaced. Everything else
    /// is taken from the kind `like`, which may be the painted kind itself.
    ///
    /// **Shapes** `covered`: one entry per vertex of the body model.
    ///
    /// **Errors** for a built-in name, nothing covered, everything covered. On an error the session is unchanged.
    pub fn paint_template(
        &mut self,
        name: &str,
        like: &str,
        covered: &PerVertex<bool>,
    ) -> Result<TemplateReport, SessionError> {
        self.session.check_kind_name(name)?;
        let like = self.session.recipe.template(like).map_err(|e| wrong(&e))?;
        let body = self.session.body_model()?.template;
        let region = PaintedRegion::try_new(covered.clone(), &body).map_err(|e| wrong(&e))?;
        self.keep_kind(name, &like, region, &format!("template {name} painted"))
    }

    /// Adds a kind of garment whose region is red on a painted body, or replaces the painted kind of that name. Everything
    /// else is taken from the kind `like`; by default from the kind that is replaced, or from the built-in kind whose region
    /// overlaps most.
    ///
    /// **Errors** for a built-in name, a file that is no painted PLY, another body, nothing painted, everything painted. On
    /// an error the session is unchanged.
    pub fn add_template(
        &mut self,
        name: &str,
        file: &Path,
        like: Option<&str>,
    ) -> Result<TemplateReport, SessionError> {
        let recipe = &self.session.recipe;
        recipe.check_kind_name(name)?;
        let replaced = recipe.painted(name).is_some();
        let like = match like.or(replaced.then_some(name)) {
            Some(like) => Some(recipe.template(like).map_err(|e| wrong(&e))?),
            None => None,
        };
        let painted = read_painted(file)?;
        let model = self.session.body_model()?;
        let body = bind_pose(&model);
        let bad = |e: SegmentError| SessionError::bad_source(file, e);
        let region = PaintedRegion::painted_on(&painted, &body.mesh).map_err(bad)?;
        let like = match like {
            Some(like) => like,
            None => GarmentTemplate::most_similar(&region, &body, &model.skeleton).map_err(bad)?,
        };
        let file = file.file_name().unwrap_or_default().to_string_lossy();
        self.keep_kind(name, &like, region, &format!("template {name} {file}"))
    }

    /// Saves a painted kind, as one change of the session.
    fn keep_kind(
        &mut self,
        name: &str,
        like: &GarmentTemplate,
        region: PaintedRegion,
        change: &str,
    ) -> Result<TemplateReport, SessionError> {
        let replaced = self.session.recipe.painted(name).is_some();
        let (covered_vertices, vertices) = (region.covered_count(), region.vertex_count());
        let text = GarmentTemplate::painted(name, like, region).to_text().map_err(|e| wrong(&e))?;
        let bytes = format!("{HEADER}{text}").into_bytes();
        let template = templates::loaded(name, &bytes).map_err(|reason| SessionError::Encoding { reason })?;
        let kind = PaintedKind { name: name.into(), hash: Some(self.session.store.keep_bytes(&bytes)?), template };
        // A file whose line in the journal is missing counts as edited by hand, or not at all.
        templates::place(&kind, self.session.dir(), &bytes)?;
        let recipe = &mut self.session.recipe;
        match recipe.templates.iter_mut().find(|there| there.name == name) {
            Some(there) => *there = kind,
            None => recipe.templates.push(kind),
        }
        recipe.link_templates();
        let used_by = self.session.steps_of_kind(name);
        self.save(change)?;
        Ok(TemplateReport { name: name.into(), like: like.name.clone(), covered_vertices, vertices, replaced, used_by })
    }
}

/// The mean body of a model in the bind pose.
fn bind_pose(model: &BodyModel) -> Layer {
    Layer::plain("body", model.template.clone(), model.weights.clone())
}

fn read_painted(file: &Path) -> Result<LabelledSurface, SessionError> {
    let refuse = |why: String| SessionError::BadRequest {
        what: format!("'{}': {why}", file.display()),
        hint: HOW_TO_PAINT.into(),
    };
    if !file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
        return Err(refuse("a painted body is a .ply file".into()));
    }
    let raw = read_ply(source::read(file)?.as_slice()).map_err(|e| SessionError::bad_source(file, e))?;
    LabelledSurface::read(&raw).map_err(|e| refuse(e.to_string()))
}

fn wrong(error: &SegmentError) -> SessionError {
    SessionError::BadRequest { what: error.to_string(), hint: error.hint().unwrap_or_default() }
}
