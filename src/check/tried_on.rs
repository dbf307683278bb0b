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

    /// What is in doubt, the gravest first.
    pub fn doubts(&self) -> Vec<Doubt> {
        let tight = self.stretch.filter(|stretch| *stretch > TOO_TIGHT).map(|stretch| Doubt {
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
        let other = own.with_faces(vec![own.faces().as_slice()[0]]);
        assert!(TriedOn::of(&own, &other).doubts()[0].what.contains("replaced"));
    }
}
