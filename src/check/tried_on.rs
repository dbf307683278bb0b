//! A garment from a file, on the figure.

use super::doubts::Doubt;
use crate::geometry::TriMesh;
use crate::tryon::edge_length_p95;
use serde::Serialize;

/// Relative length of edges, 95th percentile, above which a garment is too small. Of five garments on a man and a woman, those that
/// fit have 1.06 to 1.12; a T-shirt of a smaller man has 1.32.
const TOO_TIGHT: f64 = 1.15;

/// How a garment from a file sits on the figure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TriedOn {
    /// 95th percentile of the lengths of edges relative to the garment's own; `None` if its vertices are others.
    pub stretch: Option<f64>,
    /// Whether all faces are those of the file.
    pub is_whole: bool,
}

impl TriedOn {
    /// Compares a worn garment with itself as it came.
    pub fn of(own: &TriMesh, worn: &TriMesh) -> Self {
        let is_same = worn.vertex_count() == own.vertex_count();
        Self { stretch: is_same.then(|| edge_length_p95(own, worn)), is_whole: worn.faces() == own.faces() }
    }

    /// Whether its cloth is stretched all over.
    pub fn is_too_tight(&self) -> bool {
        self.stretch.is_some_and(|stretch| stretch > TOO_TIGHT)
    }

    /// What is in doubt, the gravest first.
    pub fn doubts(&self) -> Vec<Doubt> {
        let tight = self.stretch.filter(|_| self.is_too_tight()).map(|stretch| Doubt {
            what: format!(
                "the garment is too small for this person: its cloth is stretched by {:.0} %",
                100.0 * (stretch - 1.0)
            ),
            remedy: "try on a larger size".into(),
        });
        let replaced = (!self.is_whole).then(|| Doubt {
            what: "sheets of the garment that lay on each other crossed, and were replaced by one".into(),
            remedy: "look at it in `view --sheet sheet.png`; a garment of single sheets stays whole".into(),
        });
        tight.into_iter().chain(replaced).collect()
    }
}

/// A garment that falls by more, on average of its vertices, in metres, does not stay where it is worn.
pub(super) const SLIDES: f64 = 0.12;

/// What is in doubt of how a garment was put on: `thickness` is the share of itself as which the figure stood free in it, `fell` how
/// far the garment fell until it was at rest, in metres.
pub fn doubts_of_putting_on(thickness: Option<f64>, fell: f64) -> Vec<Doubt> {
    let slides = (fell > SLIDES).then(|| Doubt {
        what: format!("the garment is too large for this person: it slides down by {:.0} cm", 100.0 * fell),
        remedy: "try on a smaller size".into(),
    });
    let crosses = thickness.is_none().then(|| Doubt {
        what: "the garment's limbs are not where the figure's can go, so they may cross".into(),
        remedy: "look at it in `view --sheet sheet.png`; give --template if its kind was not recognised".into(),
    });
    slides.into_iter().chain(crosses).collect()
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
        assert_eq!(TriedOn::of(&own, &own).doubts(), []);
        let tight = TriedOn::of(&own, &wide).doubts();
        assert!(tight.len() == 1 && tight[0].what.contains("30 %"), "{tight:?}");
        assert_eq!(doubts_of_putting_on(Some(0.6), 0.02), []);
        assert!(doubts_of_putting_on(Some(1.0), 0.3)[0].what.contains("30 cm"));
        assert!(doubts_of_putting_on(None, 0.0)[0].what.contains("limbs"));
        let other = own.with_faces(vec![own.faces().as_slice()[0]]);
        assert!(TriedOn::of(&own, &other).doubts()[0].what.contains("replaced"));
    }
}
