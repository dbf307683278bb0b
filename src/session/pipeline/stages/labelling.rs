//! What a garment's step takes its labels from: its own proposal, or that of its outfit with the marks of all its garments.

use super::marks::MasksOfScan;
use crate::geometry::{Adjacency, TriMesh};
use crate::scan::Scan;
use crate::segment::{Marks, OutfitLabels, OutfitProposal, Proposal, SegmentError, Segmentation};
use crate::session::error::SessionError;
use crate::session::pipeline::memo::at::RunError;
use crate::session::store::{Kept, Store};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The result of the stage `evidence`.
#[derive(Serialize, Deserialize)]
pub(in crate::session) enum Evidence {
    /// Of a garment with a scan of its own, where no hair is known.
    Garment(Proposal),
    /// Of all garments of an outfit, or of one garment and the hair.
    Outfit(OutfitProposal),
}

/// What a garment's step takes its labels from.
pub(in crate::session) struct Labelling {
    evidence: Arc<Evidence>,
    /// The garment's place in its outfit, and the marks of all its garments.
    place: usize,
    marks: Vec<Marks>,
}

impl Labelling {
    /// That of a step from the result of its stage `evidence`, and the masks of its scan.
    pub fn load(
        store: &Store,
        evidence: Kept<Evidence>,
        masks: &MasksOfScan,
        kept: Kept<Scan>,
        scan: &Scan,
    ) -> Result<Self, SessionError> {
        let evidence = store.load_shared(evidence)?;
        let marks = match *evidence {
            Evidence::Garment(_) => Vec::new(),
            Evidence::Outfit(_) => masks.marks_of_all(store, kept, scan)?,
        };
        Ok(Self { evidence, place: masks.place, marks })
    }

    /// The labels of the step's garment with these marks of its own; the other garments of the outfit keep theirs.
    pub fn corrected(&self, mesh: &TriMesh, around: &Adjacency, own: &Marks) -> Result<Segmentation, SegmentError> {
        match &*self.evidence {
            Evidence::Garment(proposal) => proposal.corrected(mesh, around, own),
            Evidence::Outfit(proposal) => {
                let all: Vec<&Marks> =
                    self.marks.iter().enumerate().map(|(k, m)| if k == self.place { own } else { m }).collect();
                Ok(proposal.corrected(mesh, around, &all)?.of_garment(self.place))
            }
        }
    }
}

/// The labels of all garments of a step's scan and of the hair; `None` for a garment alone, where no hair is known.
pub(in crate::session::pipeline) fn outfit_labels(
    store: &Store,
    evidence: Kept<Evidence>,
    masks: &MasksOfScan,
    kept: Kept<Scan>,
    scan: &Scan,
    around: &Adjacency,
) -> Result<Option<OutfitLabels>, RunError> {
    let Labelling { evidence, marks, .. } = Labelling::load(store, evidence, masks, kept, scan)?;
    let Evidence::Outfit(proposal) = &*evidence else { return Ok(None) };
    let marks: Vec<&Marks> = marks.iter().collect();
    Ok(Some(proposal.corrected(&scan.mesh, around, &marks)?))
}
