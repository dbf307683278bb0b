//! A session as a Rerun recording: the scan and the results of each step, in 3D.
//!
//! Entities: `world/camera/{path,now}` (of a fusion), `world/scan`, `world/fitted` (while it is), `world/body`,
//! `world/garments/NAME`, `world/skeleton/{joints,bones}`, `world/landmarks/{points,lines}` (of
//! a tracked stream), `measures/NAME`, `notes`. Timelines: `step` (which scan),
//! `iteration` (of fits), `frame` (of a clip) and `change` (of a watched session). An entity is visible until it is logged
//! again.

use super::Error;
use super::scene::{Paint, Part};
use crate::body::Split;
use crate::geometry::{Point, TriMesh, Vec3};
use nalgebra::Isometry3;
use rerun::blueprint::{
    Blueprint, ContainerLike, Horizontal, Spatial3DView, TextDocumentView, TimeSeriesView, Vertical,
};
use rerun::sink::BinaryStreamStorage;
use rerun::{
    EntityPath, EntityPathPart, Image, LineStrips3D, Mesh3D, Points3D, RecordingStream, RecordingStreamBuilder,
    RecordingStreamError, Scalars, SpawnOptions, TextDocument, ViewCoordinates,
};
use std::cell::RefCell;
use std::collections::HashMap;
use std::io::Write;
use std::net::IpAddr;
use std::time::Duration;

/// Radius of a joint in metres; bones are half as thick.
const JOINT_RADIUS: f32 = 0.009;
const JOINT_COLOR: [u8; 3] = [235, 110, 60];
/// Radius of the camera's path in metres.
const PATH_RADIUS: f32 = 0.003;
/// Length of the camera's viewing direction in metres.
const GAZE: f64 = 0.2;

/// How long a viewer may take to answer: a new one has to open its window first.
const PATIENCE: Duration = Duration::from_secs(10);

/// Where a recording goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sink<'a> {
    /// Memory; [`Recording::finish`] writes it.
    Memory,
    /// The live viewer at a URL, `rerun+http://HOST:PORT/proxy`.
    ViewerAt(&'a str),
    /// The live viewer on this machine, or else a new one, which listens on this interface only.
    NewViewer(IpAddr),
}

/// A recording in progress: kept in memory until [`Recording::finish`], or sent to a viewer live.
pub struct Recording {
    stream: RecordingStream,
    storage: Option<BinaryStreamStorage>,
    /// The vertices of the meshes shown so far: doubled along the seams of a texture.
    split: RefCell<HashMap<EntityPath, Split>>,
}

impl Recording {
    /// Begins a recording of the session `name`.
    ///
    /// **Errors** when the viewer's library cannot start its threads.
    pub fn try_new(name: &str) -> Result<Self, Error> {
        Self::begin(builder(name, layout()), Sink::Memory)
    }

    /// Begins a recording of the session `name` that a viewer shows live.
    ///
    /// **Errors** when the URL is not valid, and when no viewer can be started.
    pub fn in_viewer(name: &str, sink: Sink) -> Result<Self, Error> {
        Self::begin(builder(name, layout()), sink)
    }

    /// Begins a recording of how the frames of `name` are fused.
    ///
    /// **Errors** as [`Recording::try_new`] and [`Recording::in_viewer`].
    pub fn of_fusion(name: &str, sink: Sink) -> Result<Self, Error> {
        Self::begin(builder(name, layout_of_fusion()), sink)
    }

    /// Begins a recording of how bodies and figures are fitted to the scans of the session `name`.
    ///
    /// **Errors** as [`Recording::try_new`] and [`Recording::in_viewer`].
    pub fn of_fits(name: &str, sink: Sink) -> Result<Self, Error> {
        Self::begin(builder(name, layout_of_fits()), sink)
    }

    /// Begins a recording of an animation of the session `name`.
    ///
    /// **Errors** as [`Recording::try_new`] and [`Recording::in_viewer`].
    pub fn of_animation(name: &str, sink: Sink) -> Result<Self, Error> {
        Self::begin(builder(name, layout_of_animation()), sink)
    }

    fn begin(builder: RecordingStreamBuilder, sink: Sink) -> Result<Self, Error> {
        let stream = match sink {
            Sink::Memory => {
                let stream = builder.buffered().map_err(failed)?;
                let storage = Some(stream.binary_stream());
                return Self { stream, storage, split: RefCell::default() }.begun();
            }
            Sink::ViewerAt(url) => builder.connect_grpc_opts(url),
            Sink::NewViewer(bind) => builder.spawn_opts(&options_of_new_viewer(bind)),
        };
        let stream = stream.map_err(|why| match why {
            RecordingStreamError::SpawnViewer(_) => Error::NoViewer("none runs, and none could be started".into()),
            why => Error::NoViewer(why.to_string()),
        })?;
        Self { stream, storage: None, split: RefCell::default() }.begun()
    }

    fn begun(self) -> Result<Self, Error> {
        // Wall-clock time has no meaning in a session and would be one more timeline.
        self.stream.set_log_time_enabled(false);
        self.stream.log_static("world", &ViewCoordinates::RIGHT_HAND_Y_UP()).map_err(failed)?;
        Ok(self)
    }

    /// Waits until the viewer has received everything.
    ///
    /// **Errors** when it does not answer.
    pub fn sent(&self) -> Result<(), Error> {
        self.stream.flush_with_timeout(PATIENCE).map_err(|why| Error::NoViewer(why.to_string()))
    }

    /// Sets the number of changes of the watched session for all that is logged next.
    pub fn set_change(&self, change: usize) {
        self.stream.set_time_sequence("change", change as i64);
    }

    /// Sets the step, counted as in the session, for all that is logged next.
    pub fn set_step(&self, step: usize) {
        self.stream.set_time_sequence("step", step as i64);
    }

    /// Sets the number of iterations, counted over all fits, for all that is logged next.
    pub fn set_iteration(&self, iteration: usize) {
        self.stream.set_time_sequence("iteration", iteration as i64);
    }

    /// Sets the frame of a clip for all that is logged next.
    pub fn set_frame(&self, frame: usize) {
        self.stream.set_time_sequence("frame", frame as i64);
    }

    /// The scan of this step.
    pub fn log_scan(&self, part: &Part<'_>) -> Result<(), Error> {
        self.log_mesh(path_of(&["world", "scan"]), part)
    }

    /// The surface that is being fitted to the scan.
    pub fn log_fitted(&self, part: &Part<'_>) -> Result<(), Error> {
        self.log_mesh(path_of(&["world", "fitted"]), part)
    }

    /// Moves the fitted surface, which was shown before: its faces and colours stay.
    pub fn log_fitted_moved(&self, mesh: &TriMesh) -> Result<(), Error> {
        self.log_moved(path_of(&["world", "fitted"]), mesh)
    }

    /// The body as fitted or posed.
    pub fn log_body(&self, part: &Part<'_>) -> Result<(), Error> {
        self.log_mesh(path_of(&["world", "body"]), part)
    }

    /// A garment, under its name in the session.
    pub fn log_garment(&self, name: &str, part: &Part<'_>) -> Result<(), Error> {
        self.log_mesh(path_of(&["world", "garments", name]), part)
    }

    /// Moves a garment, which was shown before: its faces and colours stay.
    pub fn log_garment_moved(&self, name: &str, mesh: &TriMesh) -> Result<(), Error> {
        self.log_moved(path_of(&["world", "garments", name]), mesh)
    }

    /// Joints with their names, and a bone from each to its parent.
    ///
    /// **Shapes** J joints, names and parents; a joint without a parent has no bone.
    pub fn log_skeleton(&self, joints: &[Point], names: &[String], parents: &[Option<usize>]) -> Result<(), Error> {
        let at = |p: &Point| [p.x as f32, p.y as f32, p.z as f32];
        let points = Points3D::new(joints.iter().map(at))
            .with_labels(names.iter().map(String::as_str))
            .with_show_labels(false)
            .with_radii([JOINT_RADIUS])
            .with_colors([JOINT_COLOR]);
        self.stream.log(path_of(&["world", "skeleton", "joints"]), &points).map_err(failed)?;
        let bones =
            joints.iter().zip(parents).filter_map(|(joint, &parent)| Some([at(joints.get(parent?)?), at(joint)]));
        let bones = LineStrips3D::new(bones).with_radii([0.5 * JOINT_RADIUS]).with_colors([JOINT_COLOR]);
        self.stream.log(path_of(&["world", "skeleton", "bones"]), &bones).map_err(failed)
    }

    /// Tracked landmarks beside the figure, with lines between neighbours.
    pub fn log_landmarks(&self, landmarks: &[Point], lines: &[[Point; 2]]) -> Result<(), Error> {
        let at = |p: &Point| [p.x as f32, p.y as f32, p.z as f32];
        let points =
            Points3D::new(landmarks.iter().map(at)).with_radii([2.0 * JOINT_RADIUS]).with_colors([JOINT_COLOR]);
        self.stream.log(path_of(&["world", "landmarks", "points"]), &points).map_err(failed)?;
        let lines = LineStrips3D::new(lines.iter().map(|line| line.map(|p| at(&p))))
            .with_radii([0.5 * JOINT_RADIUS])
            .with_colors([JOINT_COLOR]);
        self.stream.log(path_of(&["world", "landmarks", "lines"]), &lines).map_err(failed)
    }

    /// The camera's path so far, relative to the person, and its current viewing direction. Poses map the camera's frame
    /// (x right, y down, z forward) to the world.
    pub fn log_cameras(&self, world_from_camera: &[Isometry3<f64>]) -> Result<(), Error> {
        let at = |p: Point| [p.x as f32, p.y as f32, p.z as f32];
        let path = LineStrips3D::new([world_from_camera.iter().map(|pose| at(pose * Point::origin()))])
            .with_radii([PATH_RADIUS])
            .with_colors([JOINT_COLOR]);
        self.stream.log(path_of(&["world", "camera", "path"]), &path).map_err(failed)?;
        let Some(last) = world_from_camera.last() else { return Ok(()) };
        let gaze = [Point::origin(), Point::new(0.0, 0.0, GAZE)].map(|p| at(last * p));
        let now = LineStrips3D::new([gaze]).with_radii([2.0 * PATH_RADIUS]).with_colors([JOINT_COLOR]);
        self.stream.log(path_of(&["world", "camera", "now"]), &now).map_err(failed)
    }

    /// A measurement of this step, drawn as a curve over the steps.
    pub fn log_measure(&self, name: &str, value: f64) -> Result<(), Error> {
        self.stream.log(path_of(&["measures", name]), &Scalars::single(value)).map_err(failed)
    }

    /// Notes on this step, in Markdown.
    pub fn log_notes(&self, markdown: &str) -> Result<(), Error> {
        self.stream.log(path_of(&["notes"]), &TextDocument::from_markdown(markdown)).map_err(failed)
    }

    /// Ends the recording and writes it as `.rrd`.
    ///
    /// **Errors** when `to` cannot be written, or when nothing was recorded.
    pub fn finish(self, mut to: impl Write) -> Result<(), Error> {
        self.stream.flush_blocking().map_err(|why| Error::Recording(why.to_string()))?;
        let bytes =
            self.storage.and_then(|s| s.read()).ok_or_else(|| Error::Recording("nothing was recorded".into()))?;
        to.write_all(&bytes)?;
        to.flush()?;
        Ok(())
    }

    fn log_moved(&self, path: EntityPath, mesh: &TriMesh) -> Result<(), Error> {
        let splits = self.split.borrow();
        let Some(split) = splits.get(&path) else { return Ok(()) };
        let moved = Mesh3D::update_fields()
            .with_vertex_positions(split.spread(mesh.points()).map(|p| triple(&p.coords)))
            .with_vertex_normals(split.spread(&mesh.vertex_normals()).map(triple));
        self.stream.log(path, &moved).map_err(failed)
    }

    fn log_mesh(&self, path: EntityPath, part: &Part<'_>) -> Result<(), Error> {
        let alpha = (255.0 * part.opacity).round() as u8;
        let (uvs, texture) = match part.paint {
            Paint::Textured { uvs, texture } => (Some(uvs), Some(texture)),
            _ => (None, None),
        };
        let split = Split::along_seams(part.mesh, uvs);
        let mesh = Mesh3D::new(split.spread(part.mesh.points()).map(|p| triple(&p.coords)))
            .with_triangle_indices(&split.faces)
            .with_vertex_normals(split.spread(&part.mesh.vertex_normals()).map(triple))
            .with_albedo_factor([255, 255, 255, alpha]);
        let mesh = match texture {
            Some(texture) => {
                let picture = Image::from_rgb24(texture.pixels.as_flattened().to_vec(), [texture.side as u32; 2]);
                mesh.with_vertex_texcoords(&split.uvs).with_albedo_texture_image(picture)
            }
            None => mesh.with_vertex_colors(part.colors()),
        };
        self.stream.log(path.clone(), &mesh).map_err(failed)?;
        self.split.borrow_mut().insert(path, split);
        Ok(())
    }
}

/// Left to itself, a new viewer listens on all interfaces of the machine.
fn options_of_new_viewer(bind: IpAddr) -> SpawnOptions {
    SpawnOptions {
        wait_for_bind: true,
        hide_welcome_screen: true,
        extra_args: vec![format!("--bind={bind}")],
        ..SpawnOptions::default()
    }
}

fn builder(name: &str, layout: Blueprint) -> RecordingStreamBuilder {
    RecordingStreamBuilder::new("overcoat").recording_name(name).enabled(true).with_default_blueprint(layout)
}

/// Scan and result side by side, measurements and notes below.
fn layout() -> Blueprint {
    let scan = Spatial3DView::new("Scan").with_origin("world").with_contents(["world/scan"]);
    let result = Spatial3DView::new("Result").with_origin("world").with_contents(["world/**", "- world/scan"]);
    let above = Horizontal::new([ContainerLike::from(scan), ContainerLike::from(result)]);
    above_measures(above.into(), "Measures")
}

/// The surface and the camera around it, residuals and notes below.
fn layout_of_fusion() -> Blueprint {
    let scan = Spatial3DView::new("Scan").with_origin("world").with_contents(["world/**"]);
    above_measures(scan.into(), "Residual")
}

/// The fitted surface alone and inside the scan, side by side; the residual below.
fn layout_of_fits() -> Blueprint {
    let fitted = Spatial3DView::new("Fitted").with_origin("world").with_contents(["world/fitted"]);
    let both = Spatial3DView::new("In the scan").with_origin("world").with_contents(["world/**"]);
    let above = Horizontal::new([ContainerLike::from(fitted), ContainerLike::from(both)]);
    above_measures(above.into(), "Residual")
}

/// The moving figure alone.
fn layout_of_animation() -> Blueprint {
    let figure = Spatial3DView::new("Animation").with_origin("world").with_contents(["world/**"]);
    Blueprint::new(Vertical::new([ContainerLike::from(figure)]))
}

/// A 3D view above the curves of the measurements, under the given name, and the notes.
fn above_measures(space: ContainerLike, measures: &str) -> Blueprint {
    let measures = TimeSeriesView::new(measures).with_origin("measures");
    let notes = TextDocumentView::new("Notes").with_origin("notes");
    let below = Horizontal::new([ContainerLike::from(measures), ContainerLike::from(notes)]);
    Blueprint::new(Vertical::new([space, ContainerLike::from(below)]).with_row_shares(vec![3.0, 1.0]))
}

fn triple(v: &Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// Each part as it is, whatever signs a garment's name has.
fn path_of(parts: &[&str]) -> EntityPath {
    parts.iter().map(|part| EntityPathPart::from(*part)).collect()
}

fn failed(why: RecordingStreamError) -> Error {
    Error::Recording(why.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Texture, UvMap};

    #[test]
    fn a_textured_mesh_moves_with_its_doubled_vertices() {
        let points =
            vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(1.0, 1.0, 0.0), Point::new(0.0, 1.0, 0.0)];
        let plate = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let corners = vec![[0, 1, 2], [3, 4, 5]].into();
        let uvs = UvMap { coords: vec![[0.1, 0.2]; 6], corners, texture: None };
        let texture = Texture { side: 2, pixels: vec![[200, 100, 50]; 4] };
        let recording = Recording::try_new("alice").unwrap();
        let textured = Part::try_new(&plate, Paint::Textured { uvs: &uvs, texture: &texture }).unwrap();
        let doubled = || recording.split.borrow().values().next().map(|split| split.vertices.len());
        recording.log_garment("vest", &textured).unwrap();
        recording.log_garment_moved("vest", &plate.map_points(|p| p * 2.0)).unwrap();
        assert_eq!(doubled(), Some(6), "four, and two on the seam");
        let mut bytes = Vec::new();
        recording.finish(&mut bytes).unwrap();
        assert!(!bytes.is_empty());
    }

    #[test]
    fn a_viewer_that_does_not_answer_and_an_invalid_url_are_errors() {
        // Nobody listens on a port that was free a moment ago.
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let recording = Recording::in_viewer("alice", Sink::ViewerAt(&format!("rerun+http://{free}/proxy"))).unwrap();
        assert!(matches!(recording.sent(), Err(Error::NoViewer(_))));
        for nonsense in ["", "alice", "http://127.0.0.1:9876/nothing"] {
            assert!(
                matches!(Recording::in_viewer("alice", Sink::ViewerAt(nonsense)), Err(Error::NoViewer(_))),
                "{nonsense}"
            );
        }
    }

    #[test]
    fn a_new_viewer_listens_on_the_interface_that_is_asked_for() {
        let options = options_of_new_viewer(IpAddr::from([127, 0, 0, 1]));
        assert_eq!(options.extra_args, ["--bind=127.0.0.1"]);
    }

    #[test]
    fn a_recording_has_its_head_its_foot_and_its_entities() {
        let corners = vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(0.0, 1.0, 0.0)];
        let mesh = TriMesh::try_from_indices(corners.clone(), &[[0, 1, 2]]).unwrap();
        let recording = Recording::try_new("alice").unwrap();
        for step in 0..3 {
            recording.set_step(step);
            recording.log_scan(&Part::solid(&mesh, [200, 180, 160])).unwrap();
            recording.log_body(&Part::solid(&mesh, [200, 180, 160])).unwrap();
            recording.log_garment("summer coat/2", &Part::solid(&mesh, [90, 90, 180])).unwrap();
            recording.log_measure("scan to body, mm", 1.5).unwrap();
        }
        recording.log_skeleton(&corners, &["a".into(), "b".into(), "c".into()], &[None, Some(0), Some(9)]).unwrap();
        recording.log_cameras(&[]).unwrap();
        recording.log_cameras(&[Isometry3::identity(), Isometry3::translation(0.0, 0.0, 1.0)]).unwrap();
        recording.log_notes("# Coat").unwrap();
        let mut bytes = Vec::new();
        recording.finish(&mut bytes).unwrap();
        let holds = |text: &str| bytes.windows(text.len()).any(|w| w == text.as_bytes());
        // Mark, kind and number of entries close the file.
        assert!(bytes.starts_with(b"RRF2") && bytes[..bytes.len() - 4].ends_with(b"RRF2FOOT"));
        assert!(bytes.len() > 2000 && holds("overcoat"));
    }
}
