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
use serde::Serialize;
use std::sync::Arc;

/// The result of the stage `evidence`.
#[derive(Serialize)]
#[serde(untagged)]
pub(in crate::session) enum Evidence {
    /// Of a garment with a scan of its own.
    Garment(Proposal),
    /// Of all garments of an outfit.
    Outfit(OutfitProposal),
}

/// What a garment's step takes its labels from.
pub(in crate::session) enum Labelling {
    Garment(Arc<Proposal>),
    Outfit { proposal: Arc<OutfitProposal>, place: usize, marks: Vec<Marks> },
}

impl Labelling {
    /// That of a step from the result of its stage `evidence`.
    pub fn load(
        session: &Session,
        step: &StepRecipe,
        evidence: ContentHash,
        scan: &Scan,
    ) -> Result<Self, SessionError> {
        if step.outfit.is_none() {
            return Ok(Self::Garment(session.store.load_shared(Kept::named(evidence))?));
        }
        let proposal = session.store.load_shared(Kept::named(evidence))?;
        let outfit = session.recipe.outfit_of(step);
        let marks = outfit.iter().map(|of| marks::marks_of(session, of, scan)).collect::<Result<_, _>>()?;
        let place = outfit.iter().position(|of| of.name == step.name).unwrap_or_default();
        Ok(Self::Outfit { proposal, place, marks })
    }

    /// The labels of the step's garment with these marks of its own; the other garments of the outfit keep theirs.
    pub fn corrected(&self, mesh: &TriMesh, around: &Adjacency, own: &Marks) -> Result<Segmentation, SegmentError> {
        match self {
            Self::Garment(proposal) => proposal.corrected(mesh, around, own),
            Self::Outfit { proposal, place, marks } => {
                let all: Vec<&Marks> =
                    marks.iter().enumerate().map(|(k, m)| if k == *place { own } else { m }).collect();
                Ok(proposal.corrected(mesh, around, &all)?.of_garment(*place))
            }
        }
    }
}

/// The labels of all garments of a step's outfit, and the step's place in it; `None` for a step with a scan of its own.
pub(super) fn outfit_labels(
    session: &Session,
    step: &StepRecipe,
    evidence: ContentHash,
    scan: &Scan,
    around: &Adjacency,
) -> Result<Option<(OutfitLabels, usize)>, SessionError> {
    match Labelling::load(session, step, evidence, scan)? {
        Labelling::Garment(_) => Ok(None),
        Labelling::Outfit { proposal, place, marks } => {
            let marks: Vec<&Marks> = marks.iter().collect();
            let labels = (proposal.corrected(&scan.mesh, around, &marks))
                .map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?;
            Ok(Some((labels, place)))
        }
    }
}
