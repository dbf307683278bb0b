//! Triangle meshes and the questions asked of them: closest point, inside or outside, crossing or not. Knows no
//! person and no garment.

mod adjacency;
mod mesh;

pub use adjacency::Adjacency;
pub use mesh::{Aabb, FaceId, MeshError, PerFace, PerVertex, Point, TriMesh, Vec3, VertexId};
