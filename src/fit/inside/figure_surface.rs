//! The figure dressed so far as one articulated surface, with what is expected of each of its vertices.

use super::cover::Cover;
use crate::body::{Figure, Layer, SkinWeights};
use crate::fit::correspondence::of_legs;
use crate::fit::solver::Articulated;
use crate::geometry::{
    Adjacency, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId, WindingField, geodesic_distances,
    thinned,
};
use rayon::prelude::*;

/// Distance along the body from where skin may show, in metres, within which a template's limit is not trusted: collars
/// and cuffs differ by as much from shirt to shirt.
pub(crate) const UNSURE: f64 = 0.04;

/// Close cloth reaches beyond a template's limit by up to this along the body, in metres, and wide cloth by twice that:
/// hems of dresses were seen 10 cm below the knee.
pub(crate) const MAY_REACH: f64 = 0.06;

/// All layers of a figure in one mesh, the body's vertices first; garments thinned out.
pub(crate) struct FigureSurface {
    pub(crate) mesh_in_bind: TriMesh,
    pub(crate) weights: SkinWeights,
    /// What the new garment does over the vertex.
    pub(crate) cover: PerVertex<Cover>,
    /// How much a vertex says of the pose, 0 to 1: skin and close cloth all, cloth that hangs the less the wider.
    pub(crate) inlier_weight: PerVertex<f64>,
    /// Whether a layer further out already hides the vertex.
    pub(crate) hidden: PerVertex<bool>,
    /// For body vertices that must stay inside: distance along the body from the nearest that need not, in metres, no
    /// more than [`UNSURE`].
    pub(crate) depth_under_cover: PerVertex<f64>,
    /// For vertices that the new garment need not cover: distance along the body from where it does, in metres, no more
    /// than [`MAY_REACH`].
    pub(crate) distance_from_cover: PerVertex<f64>,
    /// How many garments lie over a body vertex, the new one included.
    pub(crate) layers_over: PerVertex<f64>,
    pub(crate) body_count: usize,
}

impl FigureSurface {
    pub(crate) fn prepare(figure: &Figure, body_cover: &PerVertex<Cover>) -> Self {
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
        let mesh_in_bind = figure.body().mesh.clone();
        let body_count = mesh_in_bind.vertex_count();
        // Indices were checked layer by layer, and an offset keeps them in range.
        let mesh_in_bind = TriMesh::try_new(points, faces).unwrap_or(mesh_in_bind);
        let weights = SkinWeights::joined(layers.iter().map(|layer| &layer.1));
        let worn = layer_counts(&figure.body().mesh, &outer);
        let layers_over = body_cover
            .iter()
            .zip(worn)
            .map(|(cover, worn)| worn + if *cover == Cover::Bare { 0.0 } else { 1.0 })
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
        let beyond = distance_from_cover(figure, body_cover);
        let nearest = on_body_of_garments.into_iter().map(|v| beyond[v]);
        figure_surface.distance_from_cover = beyond.iter().copied().chain(nearest).collect();
        figure_surface
    }

    fn geodesic_depth_under_cover(&self, body: &TriMesh) -> PerVertex<f64> {
        let open: Vec<(VertexId, f64)> =
            body.vertex_ids().filter(|&v| !self.must_stay_inside(v)).map(|v| (v, 0.0)).collect();
        let distances = geodesic_distances(body, &Adjacency::prepare(body), &open, UNSURE);
        distances.iter().map(|d| d.min(UNSURE)).collect()
    }

    pub(crate) fn articulated<'a>(&'a self, figure: &Figure) -> Articulated<'a> {
        Articulated::of_points(&figure.skeleton, self.mesh_in_bind.points().clone(), &self.weights)
    }

    /// Of the skin that each joint moves most, the share that lies below wide cloth.
    pub(crate) fn loose_shares(&self, body: &TriMesh, joints: usize) -> Vec<f64> {
        let mut of_joint = vec![(0.0, 0.0); joints];
        for (v, area) in body.vertex_areas().enumerate() {
            let (all, loose) = &mut of_joint[self.weights.rows()[v][0].0.index()];
            *all += area;
            *loose += if self.cover[v] == Cover::Loose { *area } else { 0.0 };
        }
        of_joint.into_iter().map(|(all, loose)| if all > 0.0 { loose / all } else { 0.0 }).collect()
    }

    /// Whether the scan should show this vertex as it is.
    pub(crate) fn is_visible(&self, v: VertexId) -> bool {
        !self.hidden[v] && self.cover[v] == Cover::Bare
    }

    /// Skin that shows, further from any cloth than a hem may lie from where its template says.
    pub(crate) fn is_certainly_skin(&self, v: VertexId) -> bool {
        /// Distances along the body are cut off at the last.
        const FAR: f64 = MAY_REACH - 1e-6;
        self.is_visible(v) && self.distance_from_cover[v] >= FAR
    }

    /// Body vertices at which there may be cloth, though the template says nothing of it.
    pub(crate) fn may_be_covered(&self, v: VertexId) -> bool {
        v.index() < self.body_count && !self.must_stay_inside(v) && self.distance_from_cover[v] < MAY_REACH
    }

    /// Body vertices that must stay inside: under the new garment, or under one worn before.
    pub(crate) fn must_stay_inside(&self, v: VertexId) -> bool {
        v.index() < self.body_count && (self.hidden[v] || self.cover[v] != Cover::Bare)
    }
}

/// A garment with no more vertices than a fit has use for: one every 6 mm says no more of a pose than one every 13 mm.
fn downsampled_layer(garment: &Layer) -> (TriMesh, SkinWeights) {
    /// Least distance between vertices, in metres: the places that a fit asks for are 15 mm apart, the body's vertices 18.
    const SPACING: f64 = 0.01;
    let (mesh, kept) = thinned(&garment.mesh, SPACING);
    let weights = garment.weights.of_vertices(&kept);
    (mesh, weights)
}

/// Distance of each vertex along the body from where the new garment covers it; half of it counts on legs below wide cloth,
/// whose hems hang freely, while a hand ends what a sleeve may reach.
fn distance_from_cover(figure: &Figure, cover: &PerVertex<Cover>) -> PerVertex<f64> {
    let (body, is_leg) = (&figure.body().mesh, of_legs(&figure.skeleton));
    let adjacency = Adjacency::prepare(body);
    let beyond = |kind: Cover, reach: f64| {
        let of_kind = body.vertex_ids().filter(|&v| cover[v] == kind);
        geodesic_distances(body, &adjacency, &of_kind.map(|v| (v, 0.0)).collect::<Vec<_>>(), reach)
    };
    let (close, wide) = (beyond(Cover::Tight, MAY_REACH), beyond(Cover::Loose, 2.0 * MAY_REACH));
    let of_vertex = |v: VertexId| {
        let hangs = is_leg(figure.body().weights.rows()[v][0].0);
        close[v].min(if hangs { 0.5 * wide[v] } else { wide[v] }).min(MAY_REACH)
    };
    body.vertex_ids().map(of_vertex).collect()
}

/// How much cloth that stands off by `gap` metres says of the pose below it. A flared skirt hangs as it likes: taken for
/// a part of the thighs it turned one of them by 28 mm about its axis when the person had moved their feet.
fn standoff_weight(gap: f64) -> f64 {
    /// Ease of fitted clothes: 10 cm of girth.
    const CLOSE: f64 = 0.016;
    /// Beyond it, the stand-off at which a quarter is left.
    const WIDE: f64 = 0.015;
    1.0 / (1.0 + ((gap - CLOSE).max(0.0) / WIDE).powi(2)).powi(2)
}

/// 1 for each vertex of the body that may be seen, 0 for those within a garment, however far its cloth: in a flared skirt
/// the inner sides of the thighs face each other, and cloth is nowhere near.
fn outside_weights(body: &TriMesh, garments: &[Layer]) -> Vec<f64> {
    /// At the middle of a hem's opening the winding number is a half.
    const WITHIN: f64 = 0.6;
    let around: Vec<WindingField> = garments.iter().map(|layer| WindingField::prepare(&layer.mesh)).collect();
    let may_be_seen = |p: &Point| around.iter().all(|field| field.winding(p) < WITHIN);
    body.points().0.par_iter().map(|p| f64::from(u8::from(may_be_seen(p)))).collect()
}

/// How many of the layers lie over each vertex.
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
    /// Cloth further off than this does not count as worn over the place: a skirt's hem stands off by less.
    const REACH: f64 = 0.12;
    /// A layer pushed clear lies at least this far out; a little below, to allow for touching layers. Metres.
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
