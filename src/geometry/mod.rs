//! Triangle meshes and queries on them: closest point, inside or outside, intersection. Contains no code specific to
//! people or garments.

mod adjacency;
mod bilaplacian;
mod face_tree;
mod geodesic;
mod intersection;
mod laplacian;
mod least_area;
mod manifold;
mod mean_value;
mod mesh;
mod nearest_vertex;
mod orientation;
mod piercing;
mod quads;
mod rigid_motion;
mod same_place;
#[cfg(test)]
mod shapes_for_tests;
#[cfg(test)]
pub(crate) use shapes_for_tests::{noise, sphere};
mod simplify;
mod slivers;
mod smoothed_normals;
mod surface_index;
mod thin;
mod triangle;
mod winding;

pub use adjacency::Adjacency;
pub use geodesic::geodesic_distances;
pub use intersection::{intersecting_pairs, self_intersecting_pairs, triangles_cross};
pub use laplacian::{Laplacian, cotangent_laplacian, uniform_laplacian};
pub use least_area::least_area_faces;
pub use manifold::manifold_part;
pub use mean_value::mean_value_coordinates;
pub use mesh::{Aabb, FaceId, MeshError, PerFace, PerVertex, Point, TriMesh, Vec3, VertexId};
pub use nearest_vertex::NearestVertex;
pub use orientation::orient_outward;
pub use piercing::Piercing;
pub use quads::{QuadError, QuadFigures, QuadMesh, mirrored_quad_mesh, quad_mesh, quads_of_pairs};
pub use rigid_motion::rigid_motion;
pub use same_place::first_at_same_place;
pub use simplify::{TriangleShapes, simplified, simplified_around, simplified_faces};
pub use slivers::{WithoutSlivers, without_slivers};
pub use smoothed_normals::smoothed_normals;
pub use surface_index::{RayHit, SurfaceIndex, SurfacePoint};
pub use thin::thinned;
pub use triangle::{closest_on_segments, closest_on_triangle};
pub use winding::WindingField;
