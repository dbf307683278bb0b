//! Shows a body model: its shape space and its poses.

use super::error::BodiesError;
use super::shape::check_shape;
use crate::body::{BodyModel, Pose, Shape, Stance};
use crate::export::write_layer_ply;
use crate::geometry::{PerVertex, TriMesh, Vec3};
use crate::session::{Content, Outputs, read_body_model};
use crate::view::{Cell, Facing, Part, Sheet, SheetRow, contact_sheet, layer_color};
use nalgebra::UnitQuaternion;
use std::path::{Path, PathBuf};

/// The request to show a body of a model.
#[derive(Clone, Debug, Default)]
pub struct ShowBody {
    /// The model's file; `None` for the embedded one.
    pub model: Option<PathBuf>,
    /// Coordinates in the shape space; empty for the mean.
    pub shape: Vec<f64>,
    /// Names of stances, or `joint=x,y,z` in degrees, applied in this order.
    pub pose: Vec<String>,
}

/// A model and the requested body.
pub struct ShownBody {
    model: BodyModel,
    shape: Shape,
    pose: Pose,
    name: String,
    /// Whether the request names one body instead of the whole shape space.
    one: bool,
}

/// Components shown at both ends.
const COMPONENTS_SHOWN: usize = 6;
/// Coordinate at which they are shown, in standard deviations.
const DEVIATIONS: f64 = 2.0;
/// Stances of the sheet: three in a row.
const STANCES_SHOWN: [Stance; 6] =
    [Stance::TPose, Stance::ArmsUp, Stance::ArmsForward, Stance::Squat, Stance::HeadTurned, Stance::Stride];

/// Reads a model and computes the requested body.
///
/// **Errors** a file that is not a model, more coordinates than components, an unknown stance or joint.
pub fn show_body(request: &ShowBody) -> Result<ShownBody, BodiesError> {
    let model = read_body_model(request.model.as_deref())?;
    check_shape(&request.shape, &model)?;
    let mut shape = model.mean_shape();
    shape.0[..request.shape.len()].copy_from_slice(&request.shape);
    let skeleton = model.shaped(&shape).1;
    let mut pose = Pose::bind(skeleton.len());
    for word in &request.pose {
        apply(word, &model, &mut pose)?;
    }
    let name = request
        .model
        .as_ref()
        .and_then(|p| p.file_name())
        .map_or("the embedded body".into(), |n| n.to_string_lossy().into_owned());
    Ok(ShownBody { model, shape, pose, name, one: !request.shape.is_empty() || !request.pose.is_empty() })
}

fn apply(word: &str, model: &BodyModel, pose: &mut Pose) -> Result<(), BodiesError> {
    if let Some((joint, angles)) = word.split_once('=') {
        let degrees: Option<Vec<f64>> =
            angles.split(',').map(|a| a.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
        let Some(j) = model.skeleton.find_name(joint) else {
            return Err(BodiesError::BadRequest {
                what: format!("the model has no joint '{joint}'"),
                hint: format!("its joints are {}", model.skeleton.names.join(", ")),
            });
        };
        let Some(&[x, y, z]) = degrees.as_deref() else {
            return Err(BodiesError::BadRequest {
                what: format!("'{angles}' is no turn of {joint}"),
                hint: "give three numbers, a rotation vector in degrees: leftUpperArm=0,0,45".into(),
            });
        };
        pose.rotations[j.index()] = UnitQuaternion::from_scaled_axis(Vec3::new(x, y, z) * 1f64.to_radians());
        return Ok(());
    }
    let Some(stance) = Stance::ALL.into_iter().find(|s| s.name() == word) else {
        return Err(BodiesError::BadRequest {
            what: format!("there is no stance '{word}'"),
            hint: format!(
                "the stances are {}; or turn a joint: leftUpperArm=0,0,45",
                Stance::ALL.map(Stance::name).join(", ")
            ),
        });
    };
    *pose = stance.pose(&model.skeleton);
    Ok(())
}

impl ShownBody {
    /// The requested body, in its pose.
    pub fn mesh(&self) -> TriMesh {
        posed(&self.model, &self.shape, &self.pose)
    }

    /// Vertices, faces, joints and components of the model.
    pub fn counts(&self) -> [usize; 4] {
        let m = &self.model;
        [m.template.vertex_count(), m.template.face_count(), m.skeleton.len(), m.component_count()]
    }

    /// Writes the requested body as a mesh.
    pub fn write_mesh(&self, path: &Path, outputs: &mut Outputs) -> Result<(), BodiesError> {
        Ok(outputs.write(path, Content::Mesh, |out| write_layer_ply(&self.mesh(), None, &[], out))?)
    }

    /// Draws the requested body from four sides; without a request, the mean, both ends of the first components, and
    /// the mean in several stances.
    pub fn write_sheet(&self, path: &Path, outputs: &mut Outputs) -> Result<(), BodiesError> {
        let rows = if self.one { self.one_body() } else { self.span() };
        let drawn: Vec<SheetRow> = rows.iter().map(MeshRow::drawn).collect();
        let [v, f, j, k] = self.counts();
        let mut sheet =
            Sheet::new(self.name.clone(), format!("{v} vertices, {f} faces, {j} joints, {k} components"), drawn);
        sheet.cell = [230, 340];
        Ok(outputs.write(path, Content::Picture, |out| contact_sheet(&sheet).write_png(out))?)
    }

    fn one_body(&self) -> Vec<MeshRow> {
        let mesh = self.mesh();
        vec![MeshRow::around("body", vec![], mesh)]
    }

    fn span(&self) -> Vec<MeshRow> {
        let model = &self.model;
        let bind = Pose::bind(model.skeleton.len());
        let mut rows = vec![MeshRow::around("mean", vec![], posed(model, &model.mean_shape(), &bind))];
        let shown = model.component_count().min(COMPONENTS_SHOWN);
        for first in (0..shown).step_by(3) {
            let mut row = MeshRow::new(format!("components {}\u{2013}{}", first + 1, shown.min(first + 3)));
            for k in first..shown.min(first + 3) {
                for sign in [-1.0, 1.0] {
                    let mut shape = model.mean_shape();
                    shape.0[k] = sign * DEVIATIONS;
                    let caption = format!("{} {:+.0} sd", k + 1, shape.0[k]);
                    row.cells.push((caption, posed(model, &shape, &bind), Facing::ThreeQuarter));
                }
            }
            rows.push(row);
        }
        for stances in STANCES_SHOWN.chunks(3) {
            let mut row = MeshRow::new("stances".into());
            for stance in stances {
                let mesh = standing(posed(model, &model.mean_shape(), &stance.pose(&model.skeleton)));
                row.cells.push((stance.name().into(), mesh.clone(), Facing::ThreeQuarter));
                row.cells.push((format!("{}, back", stance.name()), mesh, Facing::Back));
            }
            rows.push(row);
        }
        rows
    }

    /// Records the shape space and the stances for the viewer, one frame per body.
    #[cfg(feature = "rerun")]
    pub fn write_recording(&self, path: &Path, outputs: &mut Outputs) -> Result<(), BodiesError> {
        use crate::view::Recording;
        let failed = |e| BodiesError::bad_source(path, e);
        let recording = Recording::try_new(&self.name).map_err(failed)?;
        let bind = Pose::bind(self.model.skeleton.len());
        let mut bodies = vec![("asked for".to_string(), self.shape.clone(), self.pose.clone())];
        for k in 0..self.model.component_count() {
            for sign in [-1.0, 1.0] {
                let mut shape = self.model.mean_shape();
                shape.0[k] = sign * DEVIATIONS;
                bodies.push((format!("component {} at {:+.0} sd", k + 1, shape.0[k]), shape, bind.clone()));
            }
        }
        for stance in Stance::ALL {
            bodies.push((stance.name().into(), self.model.mean_shape(), stance.pose(&self.model.skeleton)));
        }
        for (frame, (name, shape, pose)) in bodies.iter().enumerate() {
            recording.set_frame(frame);
            let mesh = posed(&self.model, shape, pose);
            recording.log_body(&Part::solid(&mesh, layer_color(0))).map_err(failed)?;
            let skeleton = self.model.shaped(shape).1;
            let parents: Vec<Option<usize>> = skeleton.parents.iter().map(|p| p.map(|p| p.index())).collect();
            recording.log_skeleton(&skeleton.joints_in_world(pose), &skeleton.names, &parents).map_err(failed)?;
            recording.log_notes(name).map_err(failed)?;
        }
        Ok(outputs.write(path, Content::Recording, |out| recording.finish(out))?)
    }

    /// **Errors** always: this program was built without the viewer.
    #[cfg(not(feature = "rerun"))]
    pub fn write_recording(&self, _path: &Path, _outputs: &mut Outputs) -> Result<(), BodiesError> {
        Err(BodiesError::BadRequest {
            what: "this build has no viewer, so it cannot write a recording".into(),
            hint: "build with the feature `rerun`, which is on by default; or draw with --sheet".into(),
        })
    }
}

fn posed(model: &BodyModel, shape: &Shape, pose: &Pose) -> TriMesh {
    let (mesh, skeleton) = model.shaped(shape);
    let points: PerVertex<_> = model.posed(mesh.points(), &skeleton, pose);
    mesh.with_points(points)
}

/// Moves the mesh so that its lowest point is on the floor.
fn standing(mesh: TriMesh) -> TriMesh {
    let low = mesh.bounds().map_or(0.0, |b| b.min.y);
    mesh.map_points(|p| p - Vec3::y() * low)
}

/// A row of the sheet with the meshes that it shows.
struct MeshRow {
    title: String,
    cells: Vec<(String, TriMesh, Facing)>,
}

impl MeshRow {
    fn new(title: String) -> Self {
        Self { title, cells: Vec::new() }
    }

    fn around(title: &str, mut cells: Vec<(String, TriMesh, Facing)>, mesh: TriMesh) -> Self {
        let sides = [
            ("front", Facing::Front),
            ("side", Facing::Side),
            ("back", Facing::Back),
            ("three-quarter", Facing::ThreeQuarter),
        ];
        cells.extend(sides.map(|(name, facing)| (name.to_string(), mesh.clone(), facing)));
        Self { title: title.into(), cells }
    }

    fn drawn(&self) -> SheetRow<'_> {
        let cells = self
            .cells
            .iter()
            .map(|(caption, mesh, facing)| Cell::new(caption, &[Part::solid(mesh, layer_color(0))], *facing));
        SheetRow {
            title: self.title.clone(),
            notes: Vec::new(),
            cells: cells.collect(),
            ramp: None,
            legend: Vec::new(),
        }
    }
}
