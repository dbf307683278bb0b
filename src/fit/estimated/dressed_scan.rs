//! A scan of the dressed person, with what is known of the clothes.

use super::contact::Contact;
use crate::geometry::PerVertex;
use crate::scan::Scan;

/// A scan of the dressed person.
#[derive(Clone, Debug)]
pub struct DressedScan<'a> {
    /// The scan.
    pub scan: &'a Scan,
    /// What its clothes leave between them and each vertex of the body; `None` where skin is visible.
    /// **Shapes** one entry per vertex of the model.
    pub contact: PerVertex<Option<Contact>>,
}
