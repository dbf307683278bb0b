//! Another scan that takes part in the shape.

use crate::fit::inside::{Cover, InsideParams};
use crate::geometry::PerVertex;
use crate::scan::Scan;

/// Another scan of the same person.
#[derive(Clone, Debug)]
pub struct OtherScan<'a> {
    /// What the report calls it.
    pub name: &'a str,
    /// The scan.
    pub scan: &'a Scan,
    /// What all that is worn in it does over the body.
    pub cover: PerVertex<Cover>,
    /// How the body is laid into it at first.
    pub params: InsideParams,
}
