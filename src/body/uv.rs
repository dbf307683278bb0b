//! Texture coordinates with seams.

use crate::formats::{FormatError, read_color_picture, write_color_png};
use crate::geometry::{PerFace, PerVertex, TriMesh};
use serde::{Deserialize, Serialize, Serializer, ser};

/// A texture coordinate for each corner of each face; neighbours share one, but across a seam.
///
/// **Shapes** `coords` `T × 2`, from the lower left of the picture, 0–1; `corners` `F × 3`, into `coords`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UvMap {
    /// The places on the picture.
    pub coords: Vec<[f64; 2]>,
    /// For each face the places of its corners.
    pub corners: PerFace<[u32; 3]>,
    /// The picture, where there is one.
    pub texture: Option<Texture>,
}

/// A picture to be wrapped around a surface; a PNG where it is kept, a third of its size.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "KeptTexture")]
pub struct Texture {
    /// Pixels along a side.
    pub side: usize,
    /// sRGB, `height × width`, row by row from the top.
    pub pixels: Vec<[u8; 3]>,
}

#[derive(Serialize, Deserialize)]
struct KeptTexture {
    png: Vec<u8>,
}

impl Serialize for Texture {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        KeptTexture { png: self.to_png().map_err(ser::Error::custom)? }.serialize(serializer)
    }
}

impl TryFrom<KeptTexture> for Texture {
    type Error = FormatError;

    fn try_from(kept: KeptTexture) -> Result<Self, FormatError> {
        let picture = read_color_picture(&kept.png)?;
        Ok(Self { side: picture.width, pixels: picture.pixels })
    }
}

impl Texture {
    /// The picture as a PNG file.
    ///
    /// **Errors** if the pixels are not `side × side`.
    pub fn to_png(&self) -> Result<Vec<u8>, FormatError> {
        write_color_png([self.side; 2], &self.pixels)
    }
}

impl UvMap {
    /// One place a vertex: no seam.
    ///
    /// **Shapes** `coords` `V × 2`.
    pub fn per_vertex(mesh: &TriMesh, coords: PerVertex<[f64; 2]>) -> Self {
        Self { coords: coords.0, corners: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(), texture: None }
    }

    /// Whether it belongs to a mesh of so many faces and every corner has a place.
    pub fn fits(&self, mesh: &TriMesh) -> bool {
        self.corners.len() == mesh.face_count()
            && self.corners.iter().flatten().all(|&c| (c as usize) < self.coords.len())
    }

    /// The faces marked in `keep`, with only the places that they use. The picture stays whole.
    ///
    /// **Shapes** `keep` F.
    pub fn part(&self, keep: &PerFace<bool>) -> Self {
        let kept: Vec<[u32; 3]> =
            self.corners.iter().zip(keep.iter()).filter(|(_, keep)| **keep).map(|(corners, _)| *corners).collect();
        let mut used: Vec<u32> = kept.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let mut part_from_whole = vec![0; self.coords.len()];
        for (place, &c) in (0..).zip(&used) {
            part_from_whole[c as usize] = place;
        }
        Self {
            coords: used.iter().map(|&c| self.coords[c as usize]).collect(),
            corners: kept.iter().map(|corners| corners.map(|c| part_from_whole[c as usize])).collect(),
            texture: self.texture.clone(),
        }
    }

    /// The corners of a face on the picture.
    pub fn triangle(&self, face: usize) -> [[f64; 2]; 3] {
        self.corners.0[face].map(|c| self.coords[c as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_keeps_the_places_of_its_corners_and_no_others() {
        let whole = UvMap {
            coords: (0..6).map(|i| [f64::from(i) / 10.0, 0.5]).collect(),
            corners: vec![[0, 1, 2], [2, 1, 3], [5, 3, 4]].into(),
            texture: None,
        };
        let part = whole.part(&vec![false, true, true].into());
        assert_eq!(part.coords.len(), 5, "place 0 is used by no face");
        assert_eq!([part.triangle(0), part.triangle(1)], [whole.triangle(1), whole.triangle(2)]);
    }

    #[test]
    fn a_kept_texture_comes_back_pixel_for_pixel_and_is_smaller() {
        let side = 256;
        let pixel = |i: usize| [(i % side) as u8, (i / side) as u8, 120];
        let texture = Texture { side, pixels: (0..side * side).map(pixel).collect() };
        let kept = postcard::to_stdvec(&texture).unwrap();
        assert!(kept.len() < side * side, "{} bytes", kept.len());
        assert_eq!(postcard::from_bytes::<Texture>(&kept).unwrap(), texture);
        assert!(postcard::from_bytes::<Texture>(&kept[..200]).is_err());
        assert!(Texture { side: 3, pixels: vec![[0; 3]; 4] }.to_png().is_err());
    }
}
