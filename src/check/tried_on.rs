//! A garment from a file, on the figure.

use super::doubts::Doubt;
use super::size::SizeVerdict;
use crate::geometry::TriMesh;
use crate::segment::Fabric;
use crate::tryon::{EaseGirth, edge_length_p95};
use serde::Serialize;

/// How a garment from a file sits on the figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TriedOn {
    /// 95th percentile of the lengths of edges relative to the garment's own; `None` if its vertices are others.
    pub stretch: Option<f64>,
    /// Whether it is too tight.
    pub size: SizeVerdict,
    /// Whether all faces are those of the file.
    pub is_whole: bool,
}

impl TriedOn {
    /// Compares a worn garment, whose rings are `girths`, with itself as it came.
    pub fn of(own: &TriMesh, worn: &TriMesh, girths: &[EaseGirth], fabric: &Fabric) -> Self {
        let is_same = worn.vertex_count() == own.vertex_count();
        let stretch = is_same.then(|| edge_length_p95(own, worn));
        // How far it fell is known before it is stacked: see [`doubts_of_putting_on`].
        let size = SizeVerdict::of(girths, stretch, None, fabric);
        Self { stretch, size, is_whole: worn.faces() == own.faces() }
    }

    /// What is in doubt, the gravest first.
    pub fn doubts(&self) -> Vec<Doubt> {
        let replaced = (!self.is_whole).then(|| Doubt {
            what: "sheets of the garment that lay on each other crossed, and were replaced by one".into(),
            remedy: "look at it (`view --sheet sheet.png`); a garment of single sheets stays whole".into(),
        });
        self.size.doubt().into_iter().chain(replaced).collect()
    }
}

/// What is in doubt of how a garment was put on: `thickness` is the share of itself as which the figure stood free in it, `slid` how
/// far the garment fell, in metres, if it did not stay where it is worn.
pub fn doubts_of_putting_on(thickness: Option<f64>, slid: Option<f64>) -> Vec<Doubt> {
    let slides = SizeVerdict::of_slide(slid).doubt();
    let crosses = thickness.is_none().then(|| Doubt {
        what: "the garment's limbs are not where the figure's can go, so they may cross".into(),
        remedy: "look at it (`view --sheet sheet.png`); give --template if its kind was not recognised".into(),
    });
    slides.into_iter().chain(crosses).collect()
}

/// What is in doubt of how the steps of the paper laid a garment on: `is_clear` says whether nothing crossed then, `slid` is as in
/// [`doubts_of_putting_on`].
pub fn doubts_of_laying_on(is_clear: bool, slid: Option<f64>) -> Vec<Doubt> {
    let crosses = (!is_clear).then(|| Doubt {
        what: "the steps of the paper left the garment across skin or layers".into(),
        remedy: "look at it (`view --sheet sheet.png`); leave --method out, and nothing crosses on the way".into(),
    });
    SizeVerdict::of_slide(slid).doubt().into_iter().chain(crosses).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn a_stretched_garment_and_a_replaced_one_are_doubtful() {
        let square = |size: f64| {
            let points =
                [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Point::new(x * size, y * size, 0.0));
            TriMesh::try_from_indices(points.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap()
        };
        let (own, wide) = (square(1.0), square(1.3));
        let of = |own: &TriMesh, worn: &TriMesh| TriedOn::of(own, worn, &[], Fabric::named("denim").unwrap());
        assert_eq!(of(&own, &own).doubts(), []);
        let tight = of(&own, &wide).doubts();
        assert!(tight.len() == 1 && tight[0].what.contains("30 %"), "{tight:?}");
        assert_eq!(doubts_of_putting_on(Some(0.6), None), []);
        assert!(doubts_of_putting_on(Some(1.0), Some(0.3))[0].what.contains("30 cm"));
        assert!(doubts_of_putting_on(None, None)[0].what.contains("limbs"));
        assert_eq!(doubts_of_laying_on(true, None), []);
        assert!(doubts_of_laying_on(false, None)[0].remedy.contains("--method"));
        let other = own.with_faces(vec![own.faces().as_slice()[0]]);
        assert!(of(&own, &other).doubts()[0].what.contains("replaced"));
    }
}
