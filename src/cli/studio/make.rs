//! Writes a synthetic session to disk: recordings, fused scans and their ground truth, in the layout that
//! `measure --truth` reads.

use super::error::MakeError;
use crate::formats::{
    Format, FormatError, PlyOptions, RawMesh, write_color_jpeg, write_depth_png, write_gray_png, write_ply,
};
use crate::geometry::{PerVertex, TriMesh};
use crate::measure::{TruthNaming, joints_by_name};
use crate::session::{NewFolder, read_body_model};
use crate::studio::{
    GarmentForm, GarmentKind, GarmentSize, RgbdFrame, RgbdRecording, SubjectParams, SyntheticStep, generate_each_step,
    generate_garment,
};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// The request for a synthetic session.
#[derive(Clone, Debug)]
pub struct MakeRequest {
    /// The subject, the garments and the camera.
    pub subject: SubjectParams,
    /// Whether to write the frames of every step (`K-NAME/`), not only the fused scans.
    pub frames: bool,
    /// Pixels along the side of the texture of each fused scan, which has a colour per vertex without one.
    pub texture: Option<usize>,
}

/// The files of one step.
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
/// Frames per second.
const RATE: f64 = 30.0;

/// Generates a subject who is dressed garment after garment, and writes `DIR/K-NAME.ply`, `DIR/K-NAME/` and `DIR/truth/`.
///
/// **Errors** if the request cannot be generated, or the folder is not empty or cannot be written.
pub fn make_subject(
    dir: &Path,
    request: &MakeRequest,
    on_step: &mut dyn FnMut(&MadeStep),
) -> Result<Vec<MadeStep>, MakeError> {
    let params = request.subject.params()?;
    let folder = NewFolder::create(dir)?;
    let model = read_body_model(None)?;
    let truth = Path::new("truth");
    folder.make_folder(truth)?;
    let (mut made, mut joints, mut failure) = (Vec::new(), Vec::new(), None);
    let bind = generate_each_step(&model, &params, &mut |k, step| {
        if failure.is_some() {
            return;
        }
        joints.push(json!({ "joints": joints_by_name(&step.truth.joints) }));
        match write_step(&folder, k, &step, request) {
            Ok(one) => {
                on_step(&one);
                made.push(one);
            }
            Err(e) => failure = Some(e),
        }
    })?;
    failure.map_or(Ok(()), Err)?;
    write_mesh(&folder, &truth.join(TruthNaming::bind_body()), &bind.body, None)?;
    for (j, layer) in bind.layers.iter().enumerate() {
        write_mesh(&folder, &truth.join(TruthNaming::bind_layer(j + 1)), layer, None)?;
    }
    // A scan shows several garments if all are put on at once.
    let names: Vec<&str> = std::iter::once("body").chain(params.garments.iter().map(|kind| kind.name())).collect();
    let known =
        json!({ "source": "invented by Overcoat's studio", "seed": params.seed, "names": names, "steps": joints });
    folder.write_last(&truth.join(TruthNaming::JOINTS), known.to_string().as_bytes())?;
    Ok(made)
}

/// A garment in one size.
#[derive(Clone, Debug, Serialize)]
pub struct MadeGarment {
    /// Its letters.
    pub size: &'static str,
    /// The mesh.
    pub file: PathBuf,
}

/// Sews a garment in each of the sizes and writes `DIR/KIND-SIZE.obj`.
///
/// **Errors** for an unknown kind or size, or if the folder is not empty or cannot be written.
pub fn make_garments(
    dir: &Path,
    kind: &str,
    seed: u64,
    sizes: &str,
    form: GarmentForm,
) -> Result<Vec<MadeGarment>, MakeError> {
    let (kind, sizes) = (GarmentKind::from_name(kind)?, GarmentSize::list(sizes)?);
    let folder = NewFolder::create(dir)?;
    let model = read_body_model(None)?;
    sizes
        .into_iter()
        .map(|size| {
            let garment = generate_garment(&model, seed, kind, size, form)?;
            let name = PathBuf::from(format!("{}-{}.obj", kind.name(), size.name()));
            let mut bytes = Vec::new();
            garment.write_obj(&mut bytes).map_err(|source| FormatError::Io { format: Format::Obj, source })?;
            folder.write(&name, &bytes)?;
            Ok(MadeGarment { size: size.name(), file: dir.join(name) })
        })
        .collect()
}

fn write_step(out: &NewFolder, k: usize, step: &SyntheticStep, request: &MakeRequest) -> Result<MadeStep, MakeError> {
    let truth = Path::new("truth");
    let scan = PathBuf::from(format!("{k}-{}.ply", step.name));
    match request.texture {
        None => write_mesh(out, &scan, &step.scan, Some(&step.colors))?,
        Some(side) => write_textured(out, &scan, step, side)?,
    }
    write_mesh(out, &truth.join(TruthNaming::step_body(k)), &step.truth.body, None)?;
    for (j, layer) in step.truth.layers.iter().enumerate() {
        write_mesh(out, &truth.join(TruthNaming::step_layer(k, j + 1)), layer, None)?;
    }
    let folder = PathBuf::from(format!("{k}-{}", step.name));
    if request.frames {
        write_recording(out, &folder, &step.recording)?;
        write_labels(out, &truth.join(format!("{k}_label")), &step.recording)?;
    }
    Ok(MadeStep {
        name: step.name.clone(),
        scan: out.path().join(scan),
        faces: step.scan.face_count(),
        frames: request.frames.then(|| out.path().join(folder)),
    })
}

/// A recording in the layout of the TUM benchmark: `rgb/`, `depth/` (16 bit, millimetres), `associations.txt`,
/// `camera.json`, and the true poses in `groundtruth.txt`.
fn write_recording(out: &NewFolder, dir: &Path, recording: &RgbdRecording) -> Result<(), MakeError> {
    let (rgb, depth) = (dir.join("rgb"), dir.join("depth"));
    out.make_folder(&rgb)?;
    out.make_folder(&depth)?;
    let size = [recording.lens.width, recording.lens.height];
    recording.frames.par_iter().enumerate().try_for_each(|(i, frame)| {
        write_image(out, &rgb.join(format!("{i:04}.jpg")), write_color_jpeg(size, &frame.color, JPEG_QUALITY))?;
        write_image(out, &depth.join(format!("{i:04}.png")), write_depth_png(size, &frame.depth_mm))
    })?;
    let (mut pairs, mut poses) =
        (String::new(), String::from("# timestamp tx ty tz qx qy qz qw: camera in the person's frame\n"));
    for (i, frame) in recording.frames.iter().enumerate() {
        let at = i as f64 / RATE;
        pairs += &format!("{at:.4} rgb/{i:04}.jpg {at:.4} depth/{i:04}.png\n");
        poses += &pose_line(at, frame);
    }
    write_text(out, &dir.join("associations.txt"), &pairs)?;
    write_text(out, &dir.join("groundtruth.txt"), &poses)?;
    let [cx, cy] = recording.lens.center();
    let camera = json!({
        "width": recording.lens.width, "height": recording.lens.height,
        "fx": recording.lens.focal, "fy": recording.lens.focal, "cx": cx, "cy": cy,
        "depth_scale": 1000, "turntable": { "turns": recording.turns },
    });
    write_text(out, &dir.join("camera.json"), &format!("{camera:#}\n"))
}

fn pose_line(at: f64, frame: &RgbdFrame) -> String {
    let t = frame.person_from_camera.translation.vector;
    let q = frame.person_from_camera.rotation.coords;
    format!("{at:.4} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6} {:.6}\n", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
}

/// The true label of every pixel.
fn write_labels(out: &NewFolder, dir: &Path, recording: &RgbdRecording) -> Result<(), MakeError> {
    out.make_folder(dir)?;
    let size = [recording.lens.width, recording.lens.height];
    recording.frames.par_iter().enumerate().try_for_each(|(i, frame)| {
        write_image(out, &dir.join(format!("{i:04}.png")), write_gray_png(size, &frame.labels))
    })
}

fn write_image(out: &NewFolder, name: &Path, encoded: Result<Vec<u8>, FormatError>) -> Result<(), MakeError> {
    Ok(out.write(name, &encoded?)?)
}

/// A scan with its texture in a file beside it.
fn write_textured(out: &NewFolder, name: &Path, step: &SyntheticStep, side: usize) -> Result<(), MakeError> {
    let picture = name.with_extension("jpg");
    let mesh = step.close_up.textured(&step.scan, &step.colors, side, &picture.to_string_lossy())?;
    let comments = vec![format!("TextureFile {}", picture.display())];
    let mut bytes = Vec::new();
    write_ply(&mesh, &PlyOptions { comments, ..PlyOptions::default() }, &mut bytes)?;
    for encoded in mesh.texture.iter().flat_map(|texture| &texture.pictures) {
        out.write(&picture, &encoded.bytes)?;
    }
    Ok(out.write(name, &bytes)?)
}

fn write_mesh(
    out: &NewFolder,
    name: &Path,
    mesh: &TriMesh,
    colors: Option<&PerVertex<[u8; 3]>>,
) -> Result<(), MakeError> {
    let raw = RawMesh {
        points: mesh.points().iter().map(|p| [p.x, p.y, p.z]).collect(),
        faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        colors: colors.map(|c| c.0.clone()),
        ..RawMesh::default()
    };
    let mut bytes = Vec::new();
    write_ply(&raw, &PlyOptions::default(), &mut bytes)?;
    Ok(out.write(name, &bytes)?)
}

fn write_text(out: &NewFolder, name: &Path, text: &str) -> Result<(), MakeError> {
    Ok(out.write(name, text.as_bytes())?)
}
