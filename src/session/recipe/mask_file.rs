//! A mask's file, read by its extension.

use crate::formats::{Format, RgbaPicture, plain_text, read_npy, read_ply, read_rgba_png};
use crate::segment::{LabelledSurface, Stroke};
use crate::session::error::SessionError;
use crate::session::stage_error::StageError;
use std::path::Path;

/// The content of a mask file.
pub(in crate::session) enum MaskFile {
    /// Strokes, anchored at their points.
    Strokes(Vec<Stroke>),
    /// Labels, anchored at the vertices of their own surface.
    Surface(LabelledSurface),
    /// One number per vertex of the scan, or of its file.
    Numbers(Vec<f64>),
    /// A picture over the texture coordinates of the scan's file.
    Picture(RgbaPicture),
}

const MASK_KINDS: &str = "a mask is a .jsonl file with one brush stroke per line, one label per vertex as .npy or .ply, or a .png over the scan's texture coordinates";

/// What the extension of a mask's file says of its content.
enum Kind {
    Strokes,
    Surface,
    Numbers,
    Picture,
}

impl Kind {
    fn of(path: &Path) -> Result<Self, SessionError> {
        match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("npy") => Ok(Self::Numbers),
            Some("ply") => Ok(Self::Surface),
            Some("png") => Ok(Self::Picture),
            Some("jsonl" | "json") | None => Ok(Self::Strokes),
            Some(other) => Err(no_mask(path, &format!("is no mask: the extension '{other}' is not known"))),
        }
    }
}

fn no_mask(path: &Path, why: &str) -> SessionError {
    SessionError::BadRequest { what: format!("'{}' {why}", path.display()), hint: MASK_KINDS.into() }
}

/// **Errors** if no file of that name can be a mask, whatever it will contain.
pub fn check_mask_name(path: &Path) -> Result<(), SessionError> {
    Kind::of(path).map(drop)
}

impl MaskFile {
    /// Reads the bytes of the file at `path`.
    pub fn read(path: &Path, bytes: &[u8]) -> Result<Self, SessionError> {
        let bad = |e: StageError| SessionError::BadSource { path: path.to_path_buf(), source: Box::new(e) };
        match Kind::of(path)? {
            Kind::Numbers => {
                let array = read_npy(bytes).map_err(|e| bad(e.into()))?;
                Ok(Self::Numbers(array.to_f64("labels").map_err(|e| bad(e.into()))?))
            }
            Kind::Surface => {
                let raw = read_ply(bytes).map_err(|e| bad(e.into()))?;
                Ok(Self::Surface(LabelledSurface::read(&raw).map_err(|e| bad(e.into()))?))
            }
            Kind::Picture => Ok(Self::Picture(read_rgba_png(bytes).map_err(|e| bad(e.into()))?)),
            Kind::Strokes => {
                let text = std::str::from_utf8(plain_text(Format::Strokes, bytes).map_err(|e| bad(e.into()))?)
                    .map_err(|_| no_mask(path, "is not text, so it holds no brush strokes"))?;
                let strokes = Stroke::read_lines(text).map_err(|e| bad(e.into()))?;
                match strokes.is_empty() {
                    true => Err(no_mask(path, "holds no brush stroke")),
                    false => Ok(Self::Strokes(strokes)),
                }
            }
        }
    }

    /// Reads the bytes of a file with labels of several classes: `classes` are the garment's, negative ones unlabelled.
    ///
    /// **Errors** also for a file that holds no numbers, and where no vertex has such a class.
    pub fn read_classes(path: &Path, bytes: &[u8], classes: &[i64]) -> Result<Self, SessionError> {
        let bad = |e: StageError| SessionError::BadSource { path: path.to_path_buf(), source: Box::new(e) };
        let wrong = |what: String, hint: &str| SessionError::BadRequest { what, hint: hint.into() };
        let is_garment = |label: f64| classes.iter().any(|&class| label == class as f64);
        let of_class = |label: f64| if label < 0.0 { -1.0 } else { f64::from(u8::from(is_garment(label))) };
        let (labels, found) = match Kind::of(path)? {
            Kind::Numbers => {
                let array = read_npy(bytes).map_err(|e| bad(e.into()))?;
                let labels = array.to_f64("labels").map_err(|e| bad(e.into()))?;
                (labels.clone(), Self::Numbers(labels.into_iter().map(of_class).collect()))
            }
            Kind::Surface => {
                let mut raw = read_ply(bytes).map_err(|e| bad(e.into()))?;
                let Some(labels) = raw.scalars.get_mut("label") else {
                    return Err(wrong(
                        format!("'{}' has no 'label' per vertex, so it has no classes", path.display()),
                        "leave out --class for a painted file",
                    ));
                };
                let before = labels.iter().map(|&label| f64::from(label)).collect();
                labels.iter_mut().for_each(|label| *label = of_class(f64::from(*label)) as f32);
                (raw.colors, raw.scalars) = (None, [("label".to_string(), std::mem::take(labels))].into());
                (before, Self::Surface(LabelledSurface::read(&raw).map_err(|e| bad(e.into()))?))
            }
            Kind::Picture | Kind::Strokes => {
                return Err(wrong(
                    format!("'{}' cannot hold labels of several classes", path.display()),
                    "give --class with a .npy or .ply file of labels",
                ));
            }
        };
        if !labels.iter().any(|&label| is_garment(label)) {
            let mut there = labels;
            there.sort_by(f64::total_cmp);
            there.dedup();
            let there: Vec<String> = there.iter().take(20).map(f64::to_string).collect();
            let given: Vec<String> = classes.iter().map(i64::to_string).collect();
            return Err(wrong(
                format!("no vertex of '{}' has the class {}", path.display(), given.join(" or ")),
                &format!("its classes are {}", there.join(", ")),
            ));
        }
        Ok(found)
    }

    /// Whether a file of that name holds strokes.
    pub fn holds_strokes(path: &Path) -> bool {
        matches!(Kind::of(path), Ok(Kind::Strokes))
    }

    /// The kind of content, in words.
    pub fn kind(&self) -> String {
        match self {
            Self::Strokes(strokes) if strokes.len() == 1 => "1 stroke".into(),
            Self::Strokes(strokes) => format!("{} strokes", strokes.len()),
            Self::Surface(surface) if surface.is_painted() => "painted labels".into(),
            Self::Surface(_) => "labelled surface".into(),
            Self::Numbers(_) => "labels per vertex".into(),
            Self::Picture(_) => "picture".into(),
        }
    }

    /// Whether its marks are anchored in space, independent of the scan's mesh.
    pub fn is_anchored(&self) -> bool {
        matches!(self, Self::Strokes(_) | Self::Surface(_))
    }

    /// Whether all of it concerns that layer. Strokes may also have the name that the layer had `before` it was renamed.
    pub fn check_layer(&self, layer: &str, before: Option<&str>, path: &Path) -> Result<(), SessionError> {
        let Self::Strokes(strokes) = self else { return Ok(()) };
        match strokes.iter().find(|s| s.layer != layer && Some(s.layer.as_str()) != before) {
            None => Ok(()),
            Some(other) => Err(SessionError::BadFile {
                path: path.to_path_buf(),
                line: Some(other.line),
                reason: format!("the stroke is for the layer '{}', not for '{layer}'", other.layer),
                hint: format!("name that layer in the command, or write \"layer\":\"{layer}\""),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{NpyArray, write_npy};

    #[test]
    fn of_several_classes_one_is_the_garments() {
        let mut bytes = Vec::new();
        write_npy(&NpyArray::vector(vec![0i32, 3, -1, 7, 3]), &mut bytes).unwrap();
        let path = Path::new("labels.npy");
        let read = |classes: &[i64]| MaskFile::read_classes(path, &bytes, classes);
        let Ok(MaskFile::Numbers(labels)) = read(&[3]) else { panic!("no numbers") };
        assert_eq!(labels, [0.0, 1.0, -1.0, 0.0, 1.0]);
        let Ok(MaskFile::Numbers(labels)) = read(&[3, 7]) else { panic!("no numbers") };
        assert_eq!(labels, [0.0, 1.0, -1.0, 1.0, 1.0]);
        let error = read(&[5]).err().unwrap();
        assert_eq!(error.to_string(), "no vertex of 'labels.npy' has the class 5");
        assert_eq!(error.hint().unwrap(), "its classes are -1, 0, 3, 7");
        let error = MaskFile::read_classes(Path::new("a.png"), &bytes, &[1]).err().unwrap().to_string();
        assert_eq!(error, "'a.png' cannot hold labels of several classes");
    }
}
