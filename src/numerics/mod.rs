//! Sparse factorisation and quadratic programs. Knows no mesh.

mod cholesky;
mod quadratic_program;
mod random;

pub use cholesky::SparseCholesky;
pub use quadratic_program::{QpOutcome, QpRow, QpStatus, QuadraticProgram};
pub use random::Rng;

/// What cannot be solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NumericsError {
    /// An entry lies outside of the matrix.
    #[error("entry ({row}, {column}) lies outside of a matrix of {size} rows")]
    OutOfRange {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// Rows and columns of the matrix.
        size: usize,
    },
    /// Arrays that belong together differ in length.
    #[error("{what}: {given} values where {expected} are needed")]
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
    /// Not positive definite: some unknown is not held by anything.
    #[error("the matrix of {size} rows is not positive definite (pivot {pivot})")]
    NotPositiveDefinite {
        /// Rows and columns of the matrix.
        size: usize,
        /// Where the factorisation stopped, in its own order.
        pivot: usize,
    },
    /// The machine has no memory for the factors.
    #[error("no memory for the factors of a matrix of {size} rows")]
    OutOfMemory {
        /// Rows and columns of the matrix.
        size: usize,
    },
}

impl NumericsError {
    /// What the caller may do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::NotPositiveDefinite { .. } => {
                Some("a part of the mesh may hang on nothing: check for vertices without faces".into())
            }
            _ => None,
        }
    }
}
