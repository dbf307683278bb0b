//! An invented session written to disk: recordings, fused scans and their truth, in the layout that `measure --truth`
//! reads.

use super::error::SessionError;
use crate::body::embedded_model;
use crate::formats::{FormatError, PlyOptions, RawMesh, write_color_jpeg, write_depth_png, write_gray_png, write_ply};
use crate::geometry::{PerVertex, TriMesh};
use crate::measure::TruthNaming;
use crate::session::store::write_whole;
use crate::studio::{
    DepthNoise, GarmentKind, Lens, RgbdFrame, RgbdRecording, StudioError, StudioParams, SyntheticStep,
    generate_each_step,
};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Who is to be invented; what is left out is as the studio has it.
#[derive(Clone, Debug)]
pub struct SubjectParams {
    /// Who, how they stand, how cloth falls, which noise.
    pub seed: u64,
    /// What they put on, from the inside out, separated by commas.
    pub garments: String,
    /// Frames a step.
    pub views: Option<usize>,
    /// Turns of the table a step.
    pub turns: Option<f64>,
    /// Pixels across and down; the field of view stays.
    pub size: Option<[usize; 2]>,
    /// How far the head wanders within a turn, millimetres.
    pub sway_mm: Option<f64>,
    /// Triangles of a fused scan.
    pub faces: Option<usize>,
    /// Whether the camera has faults.
    pub noise: bool,
}

impl SubjectParams {
    fn params(&self) -> Result<StudioParams, StudioError> {
        let mut params =
            StudioParams { seed: self.seed, garments: GarmentKind::list(&self.garments)?, ..StudioParams::default() };
        let turntable = &mut params.turntable;
        turntable.views = self.views.unwrap_or(turntable.views);
        turntable.turns = self.turns.unwrap_or(turntable.turns);
        if let Some([width, height]) = self.size {
            // The longer side of the person's frame keeps its angle.
            let focal = turntable.lens.focal * height as f64 / turntable.lens.height as f64;
            turntable.lens = Lens { width, height, focal };
        }
        if !self.noise {
            turntable.noise = DepthNoise::none();
        }
        params.scanner.faces = self.faces.unwrap_or(params.scanner.faces).clamp(1_000, 2_000_000);
        params.sway = self.sway_mm.map_or(params.sway, |mm| 1e-3 * mm);
        params.check()?;
        Ok(params)
    }
}

/// The garments that can be invented.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InventedGarments {
    /// As asked for.
    pub name: &'static str,
    /// The segmentation template that fits it.
    pub template: &'static str,
    /// In a few words.
    pub about: &'static str,
}

impl InventedGarments {
    /// All of them.
    pub fn all() -> Vec<Self> {
        let kinds = GarmentKind::ALL.into_iter();
        kinds.map(|kind| Self { name: kind.name(), template: kind.template(), about: kind.about() }).collect()
    }
}

/// What is to be invented, and how much of it is written.
#[derive(Clone, Debug)]
pub struct MakeRequest {
    /// Who, what and how.
    pub subject: SubjectParams,
    /// Write the frames of every step (`K-NAME/`), not only the fused scans.
    pub frames: bool,
}

/// What was made of one step.
#[derive(Clone, Debug, Serialize)]
pub struct MadeStep {
    /// `body`, or the garment.
    pub name: String,
    /// The fused scan.
    pub scan: PathBuf,
    /// Its triangles.
    pub faces: usize,
    /// The folder of the recording.
    pub frames: Option<PathBuf>,
}

/// JPEG quality of colour frames, of 100: the noise of the sensor is kept.
const JPEG_QUALITY: u8 = 90;
/// Frames a second.
const RATE: f64 = 30.0;

/// Invents someone who is dressed garment after garment, and writes `DIR/K-NAME.ply`, `DIR/K-NAME/` and `DIR/truth/`.
///
/// **Errors** when the request cannot be invented, the folder has something in it, or cannot be written.
pub fn make_subject(
    dir: &Path,
    request: &MakeRequest,
    on_step: &mut dyn FnMut(&MadeStep),
) -> Result<Vec<MadeStep>, SessionError> {
    let params = request.subject.params().map_err(refused)?;
    if std::fs::read_dir(dir).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(SessionError::FolderNotEmpty { dir: dir.to_owned() });
    }
    let model = embedded_model().map_err(|e| SessionError::bad_source(Path::new("the embedded body model"), e))?;
    let truth = dir.join("truth");
    make_dir(&truth)?;
    let (mut made, mut joints, mut failure) = (Vec::new(), Vec::new(), None);
    let bind = generate_each_step(&model, &params, &mut |k, step| {
        if failure.is_some() {
            return;
        }
        joints.push(json!({ "joints": &step.truth.joints }));
        match write_step(dir, k, &step, request.frames) {
            Ok(one) => {
                on_step(&one);
                made.push(one);
            }
            Err(e) => failure = Some(e),
        }
    })
    .map_err(refused)?;
    failure.map_or(Ok(()), Err)?;
    write_mesh(&truth.join(TruthNaming::bind_body()), &bind.body, None)?;
    for (j, layer) in bind.layers.iter().enumerate() {
        write_mesh(&truth.join(TruthNaming::bind_layer(j + 1)), layer, None)?;
    }
    let names: Vec<&str> = made.iter().map(|m| m.name.as_str()).collect();
    let known =
        json!({ "source": "invented by Overcoat's studio", "seed": params.seed, "names": names, "steps": joints });
    write_whole(&truth.join(TruthNaming::JOINTS), known.to_string().as_bytes())?;
    Ok(made)
}

fn refused(error: StudioError) -> SessionError {
    SessionError::BadRequest { what: error.to_string(), hint: error.hint().unwrap_or_default() }
}

fn write_step(dir: &Path, k: usize, step: &SyntheticStep, frames: bool) -> Result<MadeStep, SessionError> {
    let truth = dir.join("truth");
    let scan = dir.join(format!("{k}-{}.ply", step.name));
    write_mesh(&scan, &step.scan, Some(&step.colors))?;
    write_mesh(&truth.join(TruthNaming::step_body(k)), &step.truth.body, None)?;
    for (j, layer) in step.truth.layers.iter().enumerate() {
        write_mesh(&truth.join(TruthNaming::step_layer(k, j + 1)), layer, None)?;
    }
    let folder = dir.join(format!("{k}-{}", step.name));
    if frames {
        write_recording(&folder, &step.recording)?;
        write_labels(&truth.join(format!("{k}_label")), &step.recording)?;
    }
    Ok(MadeStep { name: step.name.clone(), scan, faces: step.scan.face_count(), frames: frames.then_some(folder) })
}

/// A recording in the layout of the TUM benchmark: `rgb/`, `depth/` (16 bit, millimetres), `associations.txt`,
/// `camera.json`, and the true poses in `groundtruth.txt`.
fn write_recording(dir: &Path, recording: &RgbdRecording) -> Result<(), SessionError> {
    let (rgb, depth) = (dir.join("rgb"), dir.join("depth"));
    make_dir(&rgb)?;
    make_dir(&depth)?;
    let size = [recording.lens.width, recording.lens.height];
    recording.frames.par_iter().enumerate().try_for_each(|(i, frame)| {
        write_image(&rgb.join(format!("{i:04}.jpg")), write_color_jpeg(size, &frame.color, JPEG_QUALITY))?;
        write_image(&depth.join(format!("{i:04}.png")), write_depth_png(size, &frame.depth_mm))
    })?;
    let (mut pairs, mut poses) =
        (String::new(), String::from("# timestamp tx ty tz qx qy qz qw: camera in the person's frame\n"));
    for (i, frame) in recording.frames.iter().enumerate() {
        let at = i as f64 / RATE;
        pairs += &format!("{at:.4} rgb/{i:04}.jpg {at:.4} depth/{i:04}.png\n");
        poses += &pose_line(at, frame);
    }
    write_text(&dir.join("associations.txt"), &pairs)?;
    write_text(&dir.join("groundtruth.txt"), &poses)?;
    let [cx, cy] = recording.lens.center();
    let camera = json!({
        "width": recording.lens.width, "height": recording.lens.height,
        "fx": recording.lens.focal, "fy": recording.lens.focal, "cx": cx, "cy": cy,
        "depth_scale": 1000, "turntable": { "turns": recording.turns },
    });
    write_text(&dir.join("camera.json"), &format!("{camera:#}\n"))
}

fn pose_line(at: f64, frame: &RgbdFrame) -> String {
    let t = frame.person_from_camera.translation.vector;
    let q = frame.person_from_camera.rotation.coords;
    format!("{at:.4} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6}\n", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
}

/// The true label of every pixel.
fn write_labels(dir: &Path, recording: &RgbdRecording) -> Result<(), SessionError> {
    make_dir(dir)?;
    let size = [recording.lens.width, recording.lens.height];
    recording
        .frames
        .par_iter()
        .enumerate()
        .try_for_each(|(i, frame)| write_image(&dir.join(format!("{i:04}.png")), write_gray_png(size, &frame.labels)))
}

fn write_image(path: &Path, encoded: Result<Vec<u8>, FormatError>) -> Result<(), SessionError> {
    write_bytes(path, &encoded.map_err(|e| SessionError::Encoding { reason: e.to_string() })?)
}

fn write_mesh(path: &Path, mesh: &TriMesh, colors: Option<&PerVertex<[u8; 3]>>) -> Result<(), SessionError> {
    let raw = RawMesh {
        points: mesh.points().iter().map(|p| [p.x, p.y, p.z]).collect(),
        faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        colors: colors.map(|c| c.0.clone()),
        ..RawMesh::default()
    };
    let mut bytes = Vec::new();
    write_ply(&raw, &PlyOptions::default(), &mut bytes)
        .map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
    write_bytes(path, &bytes)
}

fn write_text(path: &Path, text: &str) -> Result<(), SessionError> {
    write_bytes(path, text.as_bytes())
}

/// Not synced one by one: there are hundreds of files, and `joints.json`, written last, says that all are there.
fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    std::fs::write(path, bytes).map_err(|e| SessionError::writing(path, e))
}

fn make_dir(dir: &Path) -> Result<(), SessionError> {
    std::fs::create_dir_all(dir).map_err(|e| SessionError::writing(dir, e))
}
