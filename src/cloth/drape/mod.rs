//! Draping on a body that does not move.

mod separation;
pub(in crate::cloth) mod settle;
#[cfg(test)]
mod tests;
