//! A body from the keypoints of a photo.

use super::error::BodiesError;
use crate::body::{BodyModel, Figure};
use crate::export::write_layer_ply;
use crate::formats::{ColorPicture, read_color_picture, read_photo_camera_json};
use crate::geometry::TriMesh;
use crate::photo::{
    Keypoints, PhotoBody, PhotoCamera, PhotoError, PhotoParams, Search, UncertainMeasure, body_from_photo,
    read_keypoints, write_photo_record,
};
use crate::segment::GarmentTemplate;
use crate::session::{Content, Outputs, read_body_model, read_input, read_mesh_file};
use crate::tryon::{Posed, UprightGarment, at_rest, moved_into};
use crate::view::{photo_dressed, photo_overlay};
use std::path::{Path, PathBuf};

/// The request to compute a body from a photo.
#[derive(Clone, Debug, Default)]
pub struct PhotoFile {
    /// The tracker's file.
    pub keypoints: PathBuf,
    /// The person in it, from 1; `None` if there must be only one.
    pub person: Option<usize>,
    /// The camera's file.
    pub camera: Option<PathBuf>,
    /// The person's stature in metres.
    pub height: Option<f64>,
    /// The photo, which is drawn under the body and gives the size of the picture.
    pub image: Option<PathBuf>,
    /// The model's file; `None` for the embedded one.
    pub model: Option<PathBuf>,
}

/// The body of a photo, with what it was computed from.
pub struct PhotographedBody {
    model: BodyModel,
    keypoints: Keypoints,
    image: Option<ColorPicture>,
    /// Shape, pose and camera.
    pub body: PhotoBody,
    /// Stature, girths and lengths.
    pub measures: Vec<UncertainMeasure>,
    /// What limits the result, one sentence each.
    pub limits: Vec<String>,
}

/// The body of a photo in a garment, in the pose of the photo.
pub struct DressedPhoto {
    skin: TriMesh,
    garment: TriMesh,
    /// What the garment is by its openings.
    pub kind: &'static str,
    /// Its fabric.
    pub fabric: String,
    /// Pairs of triangles of cloth and skin, or of cloth, that cross.
    pub crossing_pairs: usize,
    /// How far skin gives way at most, in metres, where the garment is too tight.
    pub gave_way: f64,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
}

/// A photo's files as read.
struct ReadPhoto {
    keypoints: Keypoints,
    camera: PhotoCamera,
    is_camera_known: bool,
    image: Option<ColorPicture>,
}

/// Reads the files and computes the body.
///
/// **Errors** a file that is not in its format, neither camera nor height, and those of [`body_from_photo`].
pub fn body_of_photo(request: &PhotoFile) -> Result<PhotographedBody, BodiesError> {
    let ReadPhoto { keypoints, camera, is_camera_known, image } = read_photo(request)?;
    let model = read_body_model(request.model.as_deref())?;
    let params = PhotoParams { height: request.height, search: Search::Flips };
    let body = body_from_photo(&model, &keypoints, &camera, &params)
        .map_err(|e| BodiesError::bad_source(&request.keypoints, e))?;
    let measures = body.measures(&model);
    let limits = limits(&body, request.height, is_camera_known);
    Ok(PhotographedBody { model, keypoints, image, body, measures, limits })
}

/// The photo's files as one, which a session takes as the scan of the body.
///
/// **Errors** as [`body_of_photo`], but for those of the computation.
pub fn record_of_photo(request: &PhotoFile) -> Result<Vec<u8>, BodiesError> {
    let read = read_photo(request)?;
    Ok(write_photo_record(&read.keypoints, &read.camera, request.height))
}

fn read_photo(request: &PhotoFile) -> Result<ReadPhoto, BodiesError> {
    let file = &request.keypoints;
    let failed = |e: PhotoError| BodiesError::bad_source(file, e);
    if request.camera.is_none() && request.height.is_none() {
        return Err(failed(PhotoError::NoScale));
    }
    let camera = request.camera.as_deref().map(read_camera).transpose()?;
    let image = request.image.as_deref().map(read_image).transpose()?;
    let size = image.as_ref().map(|image| [image.width, image.height]);
    check_size(request, camera.as_ref().map(|camera| camera.size), size)?;
    let size_known = camera.as_ref().map(|camera| camera.size).or(size);
    let keypoints = read_keypoints(&read_input(file)?, request.person, size_known).map_err(failed)?;
    let is_camera_known = camera.is_some();
    let camera = camera.unwrap_or_else(|| PhotoCamera::assumed(size.unwrap_or_else(|| keypoints.size_of_picture())));
    Ok(ReadPhoto { keypoints, camera, is_camera_known, image })
}

fn read_camera(path: &Path) -> Result<PhotoCamera, BodiesError> {
    let (intrinsics, pose) =
        read_photo_camera_json(&read_input(path)?).map_err(|e| BodiesError::bad_source(path, e))?;
    PhotoCamera::try_new(&intrinsics, pose).map_err(|e| BodiesError::bad_source(path, e))
}

fn read_image(path: &Path) -> Result<ColorPicture, BodiesError> {
    read_color_picture(&read_input(path)?).map_err(|e| BodiesError::bad_source(path, e))
}

fn check_size(request: &PhotoFile, camera: Option<[usize; 2]>, image: Option<[usize; 2]>) -> Result<(), BodiesError> {
    match (camera, image, &request.image) {
        (Some(camera), Some(image), Some(path)) if camera != image => Err(BodiesError::BadRequest {
            what: format!(
                "'{}' has {} × {} pixels, but the camera has {} × {}",
                path.display(),
                image[0],
                image[1],
                camera[0],
                camera[1]
            ),
            hint: "give the photo in which the keypoints were found, not scaled or cropped, and its camera".into(),
        }),
        _ => Ok(()),
    }
}

/// What a reader must know about the numbers.
fn limits(body: &PhotoBody, height: Option<f64>, is_camera_known: bool) -> Vec<String> {
    let mut limits = Vec::new();
    if height.is_none() && !body.camera.has_floor {
        limits.push(
            "one view does not show the size: stature is a guess from the proportions of adults; give --height, or the camera's camera_from_world".into(),
        );
    }
    if !is_camera_known {
        limits.push("the camera is unknown: a phone's main lens (28 mm) is assumed; give --camera".into());
    }
    if body.outliers > 0 {
        let (noun, verb) = if body.outliers == 1 { ("keypoint", "is") } else { ("keypoints", "are") };
        limits.push(format!(
            "{} {noun} {verb} far from the body and hardly counted; draw it with --picture",
            body.outliers
        ));
    }
    limits.push("girths are those that go with this stature and these proportions: keypoints show no girth".into());
    limits
}

impl PhotographedBody {
    /// The body in the pose of the photo: on the floor at y = 0 where the camera's pose is unknown.
    pub fn mesh(&self) -> TriMesh {
        let mesh = self.model.template.with_points(self.body.posed(&self.model));
        match (self.body.camera.has_floor, mesh.bounds()) {
            (false, Some(bounds)) => {
                let center = bounds.center();
                mesh.map_points(|p| p - nalgebra::Vector3::new(center.x, bounds.min.y, center.z))
            }
            _ => mesh,
        }
    }

    /// The tracker's layout, and how many of its keypoints were used.
    pub fn keypoints(&self) -> (&'static str, usize) {
        (self.keypoints.layout.name(), self.keypoints.seen.len())
    }

    /// Writes the body as a mesh.
    pub fn write_mesh(&self, path: &Path, outputs: &mut Outputs) -> Result<(), BodiesError> {
        Ok(outputs.write(path, Content::Mesh, |out| write_layer_ply(&self.mesh(), None, &[], out))?)
    }

    /// Puts a garment from a file on the body, at rest in the bind pose, and takes it into the pose of the photo. `fabric` is that of
    /// its kind if `None`.
    pub fn dressed(&self, file: &Path, fabric: Option<&str>) -> Result<DressedPhoto, BodiesError> {
        let average = Figure::mean(&self.model);
        let (mesh, skeleton) = self.model.shaped(&self.body.shape);
        let figure = Figure::bare(skeleton, mesh, self.model.weights.clone());
        let UprightGarment { mesh: own, kind, notes, .. } =
            UprightGarment::read(&read_mesh_file(file)?, None, &average)
                .map_err(|e| BodiesError::bad_source(file, e))?;
        let fabric = match fabric {
            Some(fabric) => fabric.to_string(),
            None => GarmentTemplate::built_in(kind).map_err(|e| BodiesError::bad_source(file, e))?.fabric,
        };
        let put_on = || {
            let worn = at_rest(&own, &figure, &fabric)?;
            moved_into(&self.body.pose, &worn, &own, &figure, &fabric)
        };
        let posed = put_on().map_err(|e| BodiesError::bad_source(file, e))?;
        let crossing_pairs = posed.crossing_pairs();
        let Posed { garment, skin, gave_way } = posed;
        Ok(DressedPhoto { skin, garment, kind, fabric, crossing_pairs, gave_way, notes })
    }

    /// Draws the body over the photo, or over white; beside it the body in a garment, if there is one.
    pub fn write_picture(
        &self,
        path: &Path,
        dressed: Option<&DressedPhoto>,
        outputs: &mut Outputs,
    ) -> Result<(), BodiesError> {
        let image = self.image.as_ref();
        let picture = match dressed {
            None => photo_overlay(image, &self.model, &self.body, &self.keypoints),
            Some(DressedPhoto { skin, garment, .. }) => {
                photo_dressed(image, &self.model, &self.body, &self.keypoints, [skin, garment])
            }
        };
        Ok(outputs.write(path, Content::Picture, |out| picture.write_png(out))?)
    }
}
