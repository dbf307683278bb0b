//! `overcoat body photo`: a body from the keypoints of one photo.

use super::bodies::{PhotoFile, body_of_photo};
use super::console::{Context, Done, secs};
use crate::session::{Content, Outputs};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct PhotoArgs {
    /// The keypoints that a tracker found in the photo: JSON of OpenPose (BODY_25, COCO-18), COCO annotations (COCO-17), or
    /// MediaPipe's 33 pose_landmarks
    keypoints: PathBuf,
    /// The person, counted from 1, if the file has several
    #[arg(long, value_name = "N")]
    person: Option<usize>,
    /// The camera: {"width", "height", "fx", "fy", "cx", "cy"} in pixels; with "camera_from_world" (floor at y = 0) the
    /// stature follows from it
    #[arg(long, value_name = "C.json")]
    camera: Option<PathBuf>,
    /// The person's stature in metres
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    height: Option<f64>,
    /// A model of your own: .npz in the SMPL layout, instead of the embedded one
    #[arg(long, value_name = "FILE.npz")]
    model: Option<PathBuf>,
    /// Write the body as a mesh, in the pose of the photo
    #[arg(long, value_name = "OUT.ply")]
    mesh: Option<PathBuf>,
    /// Draw keypoints, skeleton and silhouette
    #[arg(long, value_name = "OUT.png")]
    picture: Option<PathBuf>,
    /// The photo to draw them over: png or jpg
    #[arg(long, value_name = "PHOTO")]
    image: Option<PathBuf>,
    /// Put a garment (.obj, .ply, .glb …) on the body in the pose of the photo, and draw it beside the photo
    #[arg(long, value_name = "GARMENT", requires = "picture")]
    wear: Option<PathBuf>,
    /// The garment's fabric [default: its kind's]
    #[arg(long, requires = "wear")]
    fabric: Option<String>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: PhotoArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut outputs = Outputs::without_session(&context.session, args.force);
    let inputs =
        [Some(&args.keypoints), args.camera.as_ref(), args.image.as_ref(), args.model.as_ref(), args.wear.as_ref()];
    for input in inputs.into_iter().flatten() {
        outputs.protect(input, "is an input of this command");
    }
    for (path, content) in [(&args.mesh, Content::Mesh), (&args.picture, Content::Picture)] {
        path.iter().try_for_each(|path| outputs.claim(path, content))?;
    }
    let photo = body_of_photo(&PhotoFile {
        keypoints: args.keypoints.clone(),
        person: args.person,
        camera: args.camera,
        height: args.height,
        image: args.image,
        model: args.model,
    })?;
    let mut written = Vec::new();
    if let Some(path) = &args.mesh {
        photo.write_mesh(path, &mut outputs)?;
        written.push(format!("wrote {}", path.display()));
    }
    let dressed = args.wear.as_ref().map(|garment| photo.dressed(garment, args.fabric.as_deref())).transpose()?;
    if let Some(path) = &args.picture {
        photo.write_picture(path, dressed.as_ref(), &mut outputs)?;
        written.push(format!("drew {}", path.display()));
    }
    let in_cm = |metres: f64| (1000.0 * metres).round() / 10.0;
    let named = |number: fn(&crate::photo::UncertainMeasure) -> f64| -> Map<String, Value> {
        photo.measures.iter().map(|m| (m.measure.name.clone(), json!(in_cm(number(m))))).collect()
    };
    let (layout, used) = photo.keypoints();
    let [translation, rotations] = pose_of(&photo.body.pose);
    let json = json!({
        "keypoints": { "layout": layout, "used": used, "far": photo.body.outliers },
        "reprojection_px": photo.body.distance,
        "measures_cm": named(|m| m.measure.metres),
        "deviations_cm": named(|m| m.deviation),
        "shape": photo.body.shape.0,
        "pose": { "translation": translation, "rotations": rotations },
        "limits": photo.limits,
        "mesh": args.mesh,
        "picture": args.picture,
        "garment": dressed.as_ref().map(|dressed| json!({
            "kind": dressed.kind, "fabric": dressed.fabric, "crossing_pairs": dressed.crossing_pairs,
            "gave_way_mm": 1e3 * dressed.gave_way,
        })),
        "secs": began.elapsed().as_secs_f64(),
    });
    let measures = photo
        .measures
        .iter()
        .map(|m| format!("{:<20} {:>6.1} ± {:.1} cm", m.measure.name, in_cm(m.measure.metres), in_cm(m.deviation)));
    let last = format!(
        "{used} keypoints of {}, {:.1} px from the body on average",
        args.keypoints.display(),
        photo.body.distance
    );
    written.insert(0, last);
    Ok(Done::new("body photo", json)
        .lines(measures)
        .lines(photo.limits.iter().map(|limit| format!("limit: {limit}")))
        .lines(dressed.iter().flat_map(|dressed| &dressed.notes).cloned())
        .lines(dressed.iter().map(|dressed| {
            format!(
                "wears {} ({}): {} crossing pairs of triangles; skin gives way by {:.1} mm",
                dressed.kind,
                dressed.fabric,
                dressed.crossing_pairs,
                1e3 * dressed.gave_way
            )
        }))
        .line(format!("{}, in {}", written.join("; "), secs(began.elapsed()))))
}

/// The translation in metres, and a rotation vector per joint in radians, relative to the bind pose.
fn pose_of(pose: &crate::body::Pose) -> [Value; 2] {
    let rotations: Vec<[f64; 3]> = pose.rotations.iter().map(|r| r.scaled_axis().into()).collect();
    let translation: [f64; 3] = pose.translation.into();
    [json!(translation), json!(rotations)]
}
