//! The figure with all garments so far as one articulated surface, with what the next scan should show at each vertex.

use super::cover::Cover;
use crate::body::{Figure, Layer, SkinWeights};
use crate::fit::correspondence::of_legs;
use crate::fit::error::FitError;
use crate::fit::solver::Articulated;
use crate::geometry::{
    Adjacency, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId, WindingField, geodesic_distances,
    thinned,
};
use rayon::prelude::*;

/// A template's limit is uncertain within this distance along the body, in metres: collars and cuffs differ by as much
/// between shirts.
pub(crate) const UNCERTAIN_LIMIT: f64 = 0.04;

/// Close cloth may extend past a template's limit by this much along the body, in metres, and wide cloth by twice that: some
/// hems of dresses are 10 cm below the knee.
pub(crate) const GREATEST_EXTENSION: f64 = 0.06;

/// All layers of a figure in one mesh, the body's vertices first; garments downsampled. **Shapes** every array has one entry per
/// vertex of the mesh, except where it says per vertex of the body.
pub(crate) struct FigureSurface {
    pub(crate) mesh_in_bind: TriMesh,
    pub(crate) weights: SkinWeights,
    /// What the new garment does at the vertex.
    pub(crate) cover: PerVertex<Cover>,
    /// Inlier weight of the vertex as data for the pose, 0 to 1: 1 for skin and close cloth, less the wider cloth hangs.
    pub(crate) inlier_weight: PerVertex<f64>,
    /// Whether an outer layer of the figure already hides the vertex.
    pub(crate) hidden: PerVertex<bool>,
    /// Per vertex of the body, if it must stay inside: distance along the body to the nearest vertex that need not, in metres,
    /// at most [`UNCERTAIN_LIMIT`].
    pub(crate) depth_under_cover: PerVertex<f64>,
    /// Distance along the body from where the new garment covers it, in metres, at most [`GREATEST_EXTENSION`].
    pub(crate) distance_from_cover: PerVertex<f64>,
    /// Per vertex of the body: number of garments over it, the new one included.
    pub(crate) layers_over: PerVertex<f64>,
    pub(crate) body_count: usize,
}

impl FigureSurface {
    pub(crate) fn prepare(figure: &Figure, body_cover: &PerVertex<Cover>) -> Result<Self, FitError> {
        let mut points: Vec<Point> = Vec::new();
        let mut faces: Vec<[VertexId; 3]> = Vec::new();
        let mut cover: Vec<Cover> = Vec::new();
        let mut hidden: Vec<bool> = Vec::new();
        let mut inlier_weight: Vec<f64> = Vec::new();
        let on_body = SurfaceIndex::prepare(&figure.body().mesh);
        let outer: Vec<SurfaceIndex> = figure.garments().par_iter().map(|l| SurfaceIndex::prepare(&l.mesh)).collect();
        let light: Vec<(TriMesh, SkinWeights)> = figure.garments().par_iter().map(downsampled_layer).collect();
        let body = (figure.body().mesh.clone(), figure.body().weights.clone());
        let layers: Vec<(TriMesh, SkinWeights)> = std::iter::once(body).chain(light).collect();
        let mut on_body_of_garments = Vec::new();
        for (k, (mesh, _)) in layers.iter().enumerate() {
            let first = points.len() as u32;
            points.extend(mesh.points().iter());
            faces.extend(mesh.faces().iter().map(|f| f.map(|v| VertexId(v.0 + first))));
            if k == 0 {
                cover.extend(body_cover.iter());
                inlier_weight = outside_weights(mesh, figure.garments());
            } else {
                let below: Vec<SurfacePoint> = mesh.points().0.par_iter().map(|p| on_body.closest(p)).collect();
                for at in below {
                    let corner = at.nearest_corner(on_body.mesh());
                    cover.push(body_cover[corner]);
                    inlier_weight.push(standoff_weight(at.distance));
                    on_body_of_garments.push(corner);
                }
            }
            hidden.extend(hidden_by(mesh, &outer[k.min(outer.len())..]));
        }
        let body_count = figure.body().mesh.vertex_count();
        let mesh_in_bind = TriMesh::try_new(points, faces)
            .map_err(|e| FitError::Internal { what: "joining the layers of the figure", reason: e.to_string() })?;
        let weights = SkinWeights::joined(layers.iter().map(|layer| &layer.1));
        let counts = layer_counts(&figure.body().mesh, &outer);
        let layers_over = body_cover
            .iter()
            .zip(counts)
            .map(|(cover, count)| count + if *cover == Cover::Bare { 0.0 } else { 1.0 })
            .collect();
        let mut figure_surface = Self {
            mesh_in_bind,
            layers_over,
            weights,
            cover: cover.into(),
            inlier_weight: inlier_weight.into(),
            hidden: hidden.into(),
            depth_under_cover: PerVertex::default(),
            distance_from_cover: PerVertex::default(),
            body_count,
        };
        figure_surface.depth_under_cover = figure_surface.geodesic_depth_under_cover(&figure.body().mesh);
        let distances = distance_from_cover(figure, body_cover);
        let nearest = on_body_of_garments.into_iter().map(|v| distances[v]);
        figure_surface.distance_from_cover = distances.iter().copied().chain(nearest).collect();
        Ok(figure_surface)
    }

    fn geodesic_depth_under_cover(&self, body: &TriMesh) -> PerVertex<f64> {
        let open: Vec<(VertexId, f64)> =
            body.vertex_ids().filter(|&v| !self.must_stay_inside(v)).map(|v| (v, 0.0)).collect();
        let distances = geodesic_distances(body, &Adjacency::prepare(body), &open, UNCERTAIN_LIMIT);
        distances.iter().map(|d| d.min(UNCERTAIN_LIMIT)).collect()
    }

    pub(crate) fn articulated<'a>(&'a self, figure: &Figure) -> Articulated<'a> {
        Articulated::of_points(&figure.skeleton, self.mesh_in_bind.points().clone(), &self.weights)
    }

    /// For each joint: of the skin with its greatest weight on that joint, the area share below wide cloth.
    pub(crate) fn loose_shares(&self, body: &TriMesh, joints: usize) -> Vec<f64> {
        let mut of_joint = vec![(0.0, 0.0); joints];
        for (v, area) in body.vertex_areas().enumerate() {
            let (all, loose) = &mut of_joint[self.weights.rows()[v][0].0.index()];
            *all += area;
            *loose += if self.cover[v] == Cover::Loose { *area } else { 0.0 };
        }
        of_joint.into_iter().map(|(all, loose)| if all > 0.0 { loose / all } else { 0.0 }).collect()
    }

    /// Whether the scan should show this vertex.
    pub(crate) fn is_visible(&self, v: VertexId) -> bool {
        !self.hidden[v] && self.cover[v] == Cover::Bare
    }

    /// Visible skin that is further from the cloth's limit than the cloth may extend.
    pub(crate) fn is_certainly_skin(&self, v: VertexId) -> bool {
        /// Distances along the body are truncated at the extension.
        const FAR: f64 = GREATEST_EXTENSION - 1e-6;
        self.is_visible(v) && self.distance_from_cover[v] >= FAR
    }

    /// Body vertices that cloth may cover although the template does not.
    pub(crate) fn may_be_covered(&self, v: VertexId) -> bool {
        v.index() < self.body_count && !self.must_stay_inside(v) && self.distance_from_cover[v] < GREATEST_EXTENSION
    }

    /// Body vertices that must stay inside: under the new garment, or under an earlier one.
    pub(crate) fn must_stay_inside(&self, v: VertexId) -> bool {
        v.index() < self.body_count && (self.hidden[v] || self.cover[v] != Cover::Bare)
    }
}

/// A garment with only as many vertices as a fit needs: one per 6 mm determines the pose no better than one per 13 mm.
fn downsampled_layer(garment: &Layer) -> (TriMesh, SkinWeights) {
    /// Least distance between vertices, in metres: a fit's sample points are 15 mm apart, the body's vertices 18.
    const SPACING: f64 = 0.01;
    let (mesh, kept) = thinned(&garment.mesh, SPACING);
    let weights = garment.weights.of_vertices(&kept);
    (mesh, weights)
}

/// Distance of each vertex along the body from where the new garment covers it. Below wide cloth it counts half on legs, because
/// hems hang freely there, while a sleeve ends at the hand. **Shapes** one distance per vertex of the body.
fn distance_from_cover(figure: &Figure, cover: &PerVertex<Cover>) -> PerVertex<f64> {
    let (body, is_leg) = (&figure.body().mesh, of_legs(&figure.skeleton));
    let adjacency = Adjacency::prepare(body);
    let distances = |kind: Cover, reach: f64| {
        let of_kind = body.vertex_ids().filter(|&v| cover[v] == kind);
        geodesic_distances(body, &adjacency, &of_kind.map(|v| (v, 0.0)).collect::<Vec<_>>(), reach)
    };
    let (close, wide) =
        (distances(Cover::Tight, GREATEST_EXTENSION), distances(Cover::Loose, 2.0 * GREATEST_EXTENSION));
    let of_vertex = |v: VertexId| {
        let hangs = is_leg(figure.body().weights.rows()[v][0].0);
        close[v].min(if hangs { 0.5 * wide[v] } else { wide[v] }).min(GREATEST_EXTENSION)
    };
    body.vertex_ids().map(of_vertex).collect()
}

/// Inlier weight of cloth with a stand-off of `gap` metres. A flared skirt does not follow the legs: with full weight it turned
/// a thigh by 28 mm about its axis after the person had moved their feet.
fn standoff_weight(gap: f64) -> f64 {
    /// Ease of fitted clothes: 10 cm of girth.
    const CLOSE: f64 = 0.016;
    /// The additional stand-off that reduces the weight to a quarter.
    const WIDE: f64 = 0.015;
    1.0 / (1.0 + ((gap - CLOSE).max(0.0) / WIDE).powi(2)).powi(2)
}

/// Inlier weight of body vertices: 1 outside all garments, 0 inside one, even if its cloth is far away, as between the thighs in a
/// flared skirt. **Shapes** one weight per vertex of the body.
fn outside_weights(body: &TriMesh, garments: &[Layer]) -> Vec<f64> {
    /// Least winding number inside a garment: in the middle of a hem's opening it is a half.
    const WITHIN: f64 = 0.6;
    let around: Vec<WindingField> = garments.iter().map(|layer| WindingField::prepare(&layer.mesh)).collect();
    let may_be_seen = |p: &Point| around.iter().all(|field| field.winding(p) < WITHIN);
    body.points().0.par_iter().map(|p| f64::from(u8::from(may_be_seen(p)))).collect()
}

/// Number of layers over each vertex. **Shapes** one count per vertex.
fn layer_counts(mesh: &TriMesh, layers: &[SurfaceIndex]) -> Vec<f64> {
    let mut count = vec![0.0; mesh.vertex_count()];
    for layer in layers {
        for (sum, hidden) in count.iter_mut().zip(hidden_by(mesh, std::slice::from_ref(layer))) {
            *sum += f64::from(u8::from(hidden));
        }
    }
    count
}

fn hidden_by(mesh: &TriMesh, outer: &[SurfaceIndex]) -> Vec<bool> {
    /// Cloth further off than this does not hide a vertex, in metres: a skirt's hem stands off by less.
    const REACH: f64 = 0.12;
    /// Rays start this far below the surface, because layers may touch. Metres.
    const BELOW: f64 = 0.004;
    let normals = mesh.vertex_normals();
    (0..mesh.vertex_count())
        .into_par_iter()
        .map(|i| {
            let n: Vec3 = normals.0[i];
            let origin = mesh.points().0[i] - n * BELOW;
            outer.iter().any(|index| {
                index.cast_ray(&origin, &n, REACH).is_some_and(|hit| index.mesh().face_normal(hit.face).dot(&n) > 0.0)
            })
        })
        .collect()
}
