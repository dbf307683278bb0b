//! Progress of the training.

/// Progress of the training.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrainingProgress {
    /// What is being done.
    pub doing: &'static str,
    /// How many of `total` are done.
    pub done: usize,
    /// The total.
    pub total: usize,
}
