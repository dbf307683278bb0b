//! Another scan that takes part in the shape.

use crate::fit::inside::{Cover, InsideParams};
use crate::geometry::PerVertex;
use crate::scan::Scan;

/// Another scan of the same person.
#[derive(Clone, Debug)]
pub struct OtherScan<'a> {
    /// Its name in the report.
    pub name: &'a str,
    /// The scan.
    pub scan: &'a Scan,
    /// What the clothes in it do over the body. **Shapes** one entry per vertex of the body.
    pub cover: PerVertex<Cover>,
    /// How the body is first posed in it.
    pub params: InsideParams,
}
