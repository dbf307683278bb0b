//! A template made of a painted region and of a kind of garment that is similar.

use super::error::SegmentError;
use super::extent::Extent;
use super::region::PaintedRegion;
use super::template::GarmentTemplate;
use crate::body::{Layer, Skeleton};

impl GarmentTemplate {
    /// A kind of garment with a painted region; everything else is as in `like`, which may be an earlier version of it.
    pub fn painted(name: &str, like: &Self, region: PaintedRegion) -> Self {
        let about = match like.name == name {
            true => like.about.clone(),
            false => format!("painted, otherwise like {}", like.name),
        };
        Self { name: name.into(), about, region: Some(region), ..like.clone() }
    }

    /// The built-in kind whose region overlaps most with a painted one, relative to the vertices in either.
    ///
    /// **Frame** `body` and `skeleton` in the bind pose, upright.
    ///
    /// **Errors** if the region belongs to another body.
    pub fn most_similar(region: &PaintedRegion, body: &Layer, skeleton: &Skeleton) -> Result<Self, SegmentError> {
        let covered = region.on_body("painted", &body.mesh)?;
        let mut best: Option<(f64, Self)> = None;
        for name in Self::names() {
            let template = Self::built_in(name)?;
            let own = template.prior(body, skeleton, &Extent::default())?;
            let pairs = || covered.iter().zip(own.iter());
            let common = pairs().filter(|(a, b)| **a && **b).count();
            let either = pairs().filter(|(a, b)| **a || **b).count();
            let overlap = common as f64 / either.max(1) as f64;
            if best.as_ref().is_none_or(|(most, _)| overlap > *most) {
                best = Some((overlap, template));
            }
        }
        best.map(|(_, template)| template).ok_or(SegmentError::NothingPainted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;

    #[test]
    fn a_region_between_two_kinds_is_most_similar_to_the_nearer() {
        let model = embedded_model().unwrap();
        let body = Layer::plain("body", model.template.clone(), model.weights.clone());
        let similar = |covered| {
            let region = PaintedRegion::try_new(covered, &body.mesh).unwrap();
            GarmentTemplate::most_similar(&region, &body, &model.skeleton).unwrap()
        };
        let prior = |kind: &GarmentTemplate| kind.prior(&body, &model.skeleton, &Extent::default()).unwrap();
        for kind in ["coat", "gloves", "hat", "socks", "trousers", "tshirt"] {
            let mut covered = prior(&GarmentTemplate::built_in(kind).unwrap());
            // Two kinds may cover the same vertices.
            assert!(prior(&similar(covered.clone())) == covered, "{kind}");
            let first = covered.iter().position(|&c| c).unwrap();
            covered.0[first] = false;
            assert!(prior(&similar(covered)) == prior(&GarmentTemplate::built_in(kind).unwrap()), "{kind}");
        }
    }

    #[test]
    fn a_kind_that_is_painted_again_keeps_its_description() {
        let model = embedded_model().unwrap();
        let covered = model.template.points().iter().map(|p| p.x > 0.0).collect();
        let region = PaintedRegion::try_new(covered, &model.template).unwrap();
        let coat = GarmentTemplate::built_in("coat").unwrap();
        let first = GarmentTemplate::painted("cape", &coat, region.clone());
        assert_eq!(first.about, "painted, otherwise like coat");
        assert_eq!(GarmentTemplate::painted("cape", &first, region), first);
    }
}
