//! Sparse factorisation, disjoint sets, eigenvalues, quadratic programs, vector instructions and functions of plain numbers; contains no mesh code.

mod cholesky;
mod disjoint_sets;
mod dynamic_ring;
mod eigen;
mod quadratic_program;
mod random;
mod scalar;
mod simd;

pub use cholesky::SparseCholesky;
pub use disjoint_sets::DisjointSets;
pub use dynamic_ring::dynamic_ring;
pub use eigen::{SymmetricEigen, symmetric_eigen};
pub use quadratic_program::{QpOutcome, QpRow, QpStatus, QuadraticProgram};
pub use random::Rng;
pub use scalar::{quantile, smoothstep, wrapped_angle};
pub use simd::{Kernel, Processor};

/// Why a system cannot be solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NumericsError {
    /// An entry is outside the matrix.
    #[error("entry ({row}, {column}) is outside a matrix with {size} rows")]
    OutOfRange {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// Rows and columns of the matrix.
        size: usize,
    },
    /// Arrays that belong together differ in length.
    #[error("{what}: {given} values, expected {expected}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length it should have.
        expected: usize,
    },
    /// A value is NaN or infinite.
    #[error("{what}: value {index} is not a number")]
    NotFinite {
        /// Which array.
        what: &'static str,
        /// The first such value.
        index: usize,
    },
    /// Not positive definite: nothing determines some unknown.
    #[error("the matrix with {size} rows is not positive definite (pivot {pivot})")]
    NotPositiveDefinite {
        /// Rows and columns of the matrix.
        size: usize,
        /// Pivot at which the factorisation stopped, in its own order.
        pivot: usize,
    },
    /// There is not enough memory for the factors.
    #[error("not enough memory for the factors of a matrix with {size} rows")]
    OutOfMemory {
        /// Rows and columns of the matrix.
        size: usize,
    },
}

impl NumericsError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::NotPositiveDefinite { .. } => {
                Some("part of the mesh may be unconnected: check for vertices without faces".into())
            }
            _ => None,
        }
    }
}
