//! What a garment's step takes its labels from: its own proposal, or that of its outfit with the marks of all its garments.

use super::marks;
use crate::geometry::{Adjacency, TriMesh};
use crate::scan::Scan;
use crate::segment::{Marks, OutfitLabels, OutfitProposal, Proposal, SegmentError, Segmentation};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::StepRecipe;
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Kept};
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
    /// That of a step from the result of its stage `evidence`.
    pub fn load(
        session: &Session,
        step: &StepRecipe,
        evidence: ContentHash,
        scan: &Scan,
    ) -> Result<Self, SessionError> {
        let evidence: Arc<Evidence> = session.store.load_shared(Kept::named(evidence))?;
        let outfit = session.recipe.outfit_of(step);
        let marks = match *evidence {
            Evidence::Garment(_) => Vec::new(),
            Evidence::Outfit(_) => {
                outfit.iter().map(|of| marks::marks_of(session, of, scan)).collect::<Result<_, _>>()?
            }
        };
        let place = outfit.iter().position(|of| of.name == step.name).unwrap_or_default();
        Ok(Self { evidence, place, marks })
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

/// The labels of all garments of a step's scan and of the hair, and the step's place among them; `None` for a garment alone, where
/// no hair is known.
pub(super) fn outfit_labels(
    session: &Session,
    step: &StepRecipe,
    evidence: ContentHash,
    scan: &Scan,
    around: &Adjacency,
) -> Result<Option<(OutfitLabels, usize)>, SessionError> {
    let Labelling { evidence, place, marks } = Labelling::load(session, step, evidence, scan)?;
    let Evidence::Outfit(proposal) = &*evidence else { return Ok(None) };
    let marks: Vec<&Marks> = marks.iter().collect();
    let labels = (proposal.corrected(&scan.mesh, around, &marks))
        .map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?;
    Ok(Some((labels, place)))
}
