//! The gaps that kinds of garment leave to the skin: `templates/contact.toml`, measured by `examples/measure_estimated`.

use super::error::SegmentError;
use super::extent::Extent;
use super::template::GarmentTemplate;
use crate::body::{BodyModel, Figure};
use crate::fit::{Contact, Cover, zones};
use crate::geometry::PerVertex;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Per kind and zone the median of the gap and its deviation over people, in millimetres.
type ContactTable = BTreeMap<String, BTreeMap<String, [f64; 2]>>;

static TABLE: LazyLock<ContactTable> = LazyLock::new(|| {
    toml::from_str(include_str!("../../templates/contact.toml")).expect("the table of contacts is sound, see its test")
});

/// How much garments of one kind differ in ease, as a share of the gap: shirts are cut with 9 to 20 cm over the chest, T-shirts with
/// 5 to 25 % of it (shop charts, FreeSewing).
const EASE_SPREAD: f64 = 0.4;
/// Thickness of cloth and noise of the scan, in millimetres.
const LEAST_SPREAD_MM: f64 = 2.0;

/// Close cloth, and cloth that may stand off, of a kind or in a zone that was not measured.
const CLOSE: Contact = Contact { gap: 0.006, deviation: 0.006 };
const WIDE: Contact = Contact { gap: 0.025, deviation: 0.025 };

/// Which of the garments, given inside out, is the outermost over each vertex of the model; `None` where none is.
///
/// **Errors** if a template was painted on another body.
pub fn outermost(
    garments: &[(GarmentTemplate, Extent)],
    model: &BodyModel,
) -> Result<PerVertex<Option<usize>>, SegmentError> {
    Ok(covers(garments, model)?.iter().map(|over| over.map(|(k, _)| k)).collect())
}

/// What the garments, given inside out, leave between skin and scan at each vertex of the model; `None` where skin is visible.
///
/// **Errors** if a template was painted on another body.
pub fn contacts(
    garments: &[(GarmentTemplate, Extent)],
    model: &BodyModel,
) -> Result<PerVertex<Option<Contact>>, SegmentError> {
    let zones = zones(model);
    let of = |over: &Option<(usize, Cover)>, zone: &str| {
        over.map(|(k, cover)| {
            let measured = TABLE.get(&garments[k].0.name).and_then(|kind| kind.get(zone));
            match (measured, cover) {
                (Some([gap, deviation]), _) => {
                    let spread = deviation.hypot(EASE_SPREAD * gap).hypot(LEAST_SPREAD_MM);
                    Contact { gap: 1e-3 * gap, deviation: 1e-3 * spread }
                }
                (None, Cover::Tight) => CLOSE,
                (None, _) => WIDE,
            }
        })
    };
    Ok(covers(garments, model)?.iter().zip(zones.iter()).map(|(over, zone)| of(over, zone)).collect())
}

fn covers(
    garments: &[(GarmentTemplate, Extent)],
    model: &BodyModel,
) -> Result<PerVertex<Option<(usize, Cover)>>, SegmentError> {
    let figure = Figure::mean(model);
    let mut over = PerVertex::filled(None, model.template.vertex_count());
    for (k, (template, extent)) in garments.iter().enumerate().filter(|(_, garment)| !garment.0.grows) {
        let cover = template.cover(figure.body(), &figure.skeleton, extent)?;
        for (of_vertex, cover) in over.0.iter_mut().zip(cover.iter()).filter(|(_, cover)| **cover != Cover::Bare) {
            *of_vertex = Some((k, *cover));
        }
    }
    Ok(over)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;

    #[test]
    fn the_table_has_kinds_and_zones_that_exist_and_gaps_that_cloth_leaves() {
        let all = zones(&embedded_model().unwrap());
        for (kind, of_zones) in TABLE.iter() {
            assert!(GarmentTemplate::built_in(kind).is_ok(), "{kind}");
            for (zone, [gap, deviation]) in of_zones {
                assert!(all.iter().any(|z| z == zone), "{kind} {zone}");
                assert!(
                    (-20.0..150.0).contains(gap) && (0.5..150.0).contains(deviation),
                    "{kind} {zone} {gap} {deviation}"
                );
            }
        }
    }

    #[test]
    fn the_outer_garment_counts_and_skin_has_none() {
        let model = embedded_model().unwrap();
        let of = |kinds: &[&str]| {
            let garments: Vec<_> =
                kinds.iter().map(|k| (GarmentTemplate::built_in(k).unwrap(), Extent::default())).collect();
            (outermost(&garments, &model).unwrap(), contacts(&garments, &model).unwrap())
        };
        let (over, contact) = of(&["tshirt", "jacket"]);
        let both = over.iter().filter(|k| k.is_some()).count();
        assert!(over.iter().all(|k| *k != Some(0)), "the jacket covers all of the T-shirt");
        assert_eq!(contact.iter().filter(|c| c.is_some()).count(), both);
        assert!(both > 1000 && both < over.len() - 1000);
    }
}
