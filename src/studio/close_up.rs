//! What the dressed subject looks like in detail, and scans with that as their texture.

use super::error::StudioError;
use super::garments::{ClothCloseUp, PreparedClothCloseUp};
use crate::bake::{Place, baked, charts};
use crate::body::UvMap;
use crate::formats::{
    EncodedPicture, RawMaterial, RawMesh, RawTexture, linear_of_byte, linear_of_srgb, write_color_jpeg,
};
use crate::geometry::{FaceId, PerVertex, Point, SurfaceIndex, TriMesh, Vec3};

/// JPEG quality of a texture, of 100.
const QUALITY: u8 = 85;

/// The true surfaces of a dressed subject with their colours, in the frame of the scan's file.
#[derive(Clone, Debug)]
pub struct CloseUp {
    pub(super) skin: TriMesh,
    /// One per vertex of `skin`, sRGB.
    pub(super) skin_colors: PerVertex<[u8; 3]>,
    pub(super) garments: Vec<GarmentCloseUp>,
}

/// A garment as it is worn.
#[derive(Clone, Debug)]
pub(super) struct GarmentCloseUp {
    pub worn: TriMesh,
    /// One per vertex of `worn`: where it was sewn.
    pub sewn: PerVertex<Point>,
    pub cloth: ClothCloseUp,
}

/// A face, and the barycentric coordinates of a point on it.
type OnFace = (FaceId, [f64; 3]);

struct Prepared<'a> {
    close_up: &'a CloseUp,
    skin: SurfaceIndex,
    garments: Vec<(SurfaceIndex, PreparedClothCloseUp<'a>)>,
}

impl CloseUp {
    /// A scan with its texture, besides the colours of its vertices for programs that read no texture: what a photograph shows of the true surface at each texel.
    ///
    /// **Shapes** `colors`: one per vertex of `scan`; the picture has `side × side` pixels and is called `picture`; the result has texture coordinates per
    /// vertex, so that vertices at seams are doubled.
    ///
    /// **Errors** if the scan cannot be cut into charts, or the picture not be encoded.
    pub fn textured(
        &self,
        scan: &TriMesh,
        colors: &PerVertex<[u8; 3]>,
        side: usize,
        picture: &str,
    ) -> Result<RawMesh, StudioError> {
        let failed = |reason: String| StudioError::Picture { reason };
        let uvs = charts(scan, None).map_err(|e| failed(e.to_string()))?;
        let prepared = Prepared {
            close_up: self,
            skin: SurfaceIndex::prepare(&self.skin),
            garments: self.garments.iter().map(|g| (SurfaceIndex::prepare(&g.worn), g.cloth.prepared())).collect(),
        };
        let texture = baked(scan, &uvs, None, side, &|place| prepared.color_at(place));
        let bytes = write_color_jpeg([side, side], &texture.pixels, QUALITY).map_err(|e| failed(e.to_string()))?;
        Ok(by_corners(scan, colors, &uvs, EncodedPicture { name: picture.into(), bytes }))
    }
}

impl Prepared<'_> {
    fn color_at(&self, place: &Place) -> Option<[f32; 3]> {
        let all = 0..=self.garments.len();
        let outermost = all.clone().filter_map(|k| self.seen(k, place)).min_by(|a, b| a.2.total_cmp(&b.2));
        let closest = || {
            let points = all.map(|k| (k, self.surface(k).closest(&place.point)));
            let (k, at) = points.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
            Some((k, (at.face, at.barycentric), at.distance))
        };
        let (shown, (face, weights), _) = outermost.or_else(closest)?;
        let corners = self.surface(shown).mesh().faces()[face];
        let Some(k) = shown.checked_sub(1) else {
            let of_corners = corners.map(|v| self.close_up.skin_colors[v].map(linear_of_byte));
            return Some(std::array::from_fn(|c| (0..3).map(|i| of_corners[i][c] * weights[i]).sum::<f64>() as f32));
        };
        let sewn: Vec3 = (0..3).map(|i| self.close_up.garments[k].sewn[corners[i]].coords * weights[i]).sum();
        Some(self.garments[k].1.at(&Point::from(sewn)).map(|c| linear_of_srgb(c / 255.0) as f32))
    }

    /// The skin, then the garments from the inside.
    fn surface(&self, rank: usize) -> &SurfaceIndex {
        rank.checked_sub(1).map_or(&self.skin, |k| &self.garments[k].0)
    }

    /// Where a look at the place from outside meets the surface, and how far from where it began.
    fn seen(&self, rank: usize, place: &Place) -> Option<(usize, OnFace, f64)> {
        /// A scan is no farther from the true surface, metres; less than half the way between two limbs.
        const REACH: f64 = 0.008;
        let (surface, eye) = (self.surface(rank), place.point + place.normal * REACH);
        let hit = surface.cast_ray(&eye, &-place.normal, 2.0 * REACH)?;
        let is_outside = surface.mesh().face_normal(hit.face).dot(&place.normal) > 0.0;
        is_outside.then_some((rank, (hit.face, hit.barycentric), hit.distance))
    }
}

/// A mesh with one vertex per place on the page.
fn by_corners(scan: &TriMesh, colors: &PerVertex<[u8; 3]>, uvs: &UvMap, picture: EncodedPicture) -> RawMesh {
    let mut points = vec![[0.0; 3]; uvs.coords.len()];
    let mut colors_of_places = vec![[0; 3]; uvs.coords.len()];
    for (face, places) in scan.faces().iter().zip(uvs.corners.iter()) {
        for (v, &place) in face.iter().zip(places) {
            points[place as usize] = scan.points()[*v].into();
            colors_of_places[place as usize] = colors[*v];
        }
    }
    RawMesh {
        points,
        faces: uvs.corners.0.clone(),
        colors: Some(colors_of_places),
        uvs: Some(uvs.coords.clone()),
        texture: Some(RawTexture {
            coords: uvs.coords.iter().map(|uv| uv.map(|c| c as f32)).collect(),
            corners: None,
            face_materials: vec![0; uvs.corners.len()],
            materials: vec![RawMaterial { name: "scan".into(), picture: Some(0), ..RawMaterial::default() }],
            pictures: vec![picture],
        }),
        ..RawMesh::default()
    }
}
