//! Why surfaces cannot be re-meshed.

/// Why a surface cannot be re-meshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QuadError {
    /// Faces that share a side of an edge.
    #[error("{edges} of its edges belong to more than two faces, or to two that face opposite ways")]
    NotManifold {
        /// How many such edges there are.
        edges: usize,
    },
    /// Nothing but points and lines.
    #[error("none of its {faces} faces has an area")]
    NoArea {
        /// How many faces there are.
        faces: usize,
    },
    /// The edges are so short that the quads would not fit into memory.
    #[error("edges of {} mm are too short for its {area:.2} m²", edge_length * 1000.0)]
    TooFine {
        /// The requested length, in metres.
        edge_length: f64,
        /// The area of the surface.
        area: f64,
    },
}
