//! A garment of an outfit that cannot be told from a listed one below it.

use super::doubts::Doubt;
use super::error::CheckError;
use crate::geometry::{PerVertex, VertexId};
use crate::scan::Scan;
use crate::segment::{Lab, color_difference, lab_of};

/// Share of a garment that lies where the other one is, from which it may be part of that one. A jacket shares a third of its area
/// with the trousers of its suit.
const WITHIN_FROM: f64 = 0.8;
/// Colours this near are those of one cloth, in spreads between two views.
const ONE_CLOTH: f64 = 1.0;

/// Whether a garment that was found in an outfit's scan may be a part of another one: it lies where the other garment is expected, and
/// has its colour. Without colours nothing is known.
///
/// **Shapes** `labels`, `of_other` and `expected`: one flag per vertex of the scan; `expected` says where the template of the other
/// garment covers the body below.
///
/// **Errors** if arrays and surfaces differ in size.
pub fn is_lookalike(
    scan: &Scan,
    labels: &PerVertex<bool>,
    of_other: &PerVertex<bool>,
    expected: &PerVertex<bool>,
) -> Result<bool, CheckError> {
    for (what, flags) in [("labels", labels), ("labels of the other garment", of_other), ("its template", expected)] {
        CheckError::require_length(what, flags.len(), scan.mesh.vertex_count())?;
    }
    let areas = scan.mesh.vertex_areas();
    let own = |v: &VertexId| labels[*v];
    let area: f64 = scan.mesh.vertex_ids().filter(own).map(|v| areas[v]).sum();
    let within: f64 = scan.mesh.vertex_ids().filter(own).filter(|&v| expected[v]).map(|v| areas[v]).sum();
    let color = |of: &PerVertex<bool>| median_color(scan, of);
    let is_one_cloth = color(labels).zip(color(of_other)).is_some_and(|(a, b)| color_difference(&a, &b) < ONE_CLOTH);
    Ok(within > WITHIN_FROM * area && is_one_cloth)
}

/// The doubt about a garment that may be part of another one.
pub fn lookalike_doubt(name: &str, other: &str) -> Doubt {
    Doubt {
        what: format!("the scan may show no {name}: what was found lies where the {other} is, and has its colour"),
        remedy: format!(
            "look at it (`view --sheet sheet.png`), and remove its step if the scan does not show it (`step remove {name}`)"
        ),
    }
}

fn median_color(scan: &Scan, of: &PerVertex<bool>) -> Option<Lab> {
    let colors = scan.colors.as_ref()?;
    let own: Vec<Lab> = colors.enumerate().filter(|(v, _)| of[*v]).map(|(_, c)| lab_of(*c)).collect();
    let median = |axis: usize| {
        let mut values: Vec<f64> = own.iter().map(|lab| lab[axis]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Some([median(0)?, median(1)?, median(2)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, TriMesh};

    /// A strip of triangles whose left half is a shirt and whose right half a vest.
    fn strip(vest: [u8; 3]) -> (Scan, PerVertex<bool>, PerVertex<bool>) {
        let points: Vec<Point> = (0..40).map(|i| Point::new(f64::from(i / 2), f64::from(i % 2), 0.0)).collect();
        let faces: Vec<[u32; 3]> =
            (0..38).map(|i| if i % 2 == 0 { [i, i + 2, i + 1] } else { [i, i + 1, i + 2] }).collect();
        let is_vest: PerVertex<bool> = points.iter().map(|p| p.x > 9.5).collect();
        let colors = is_vest.iter().map(|&v| if v { vest } else { [40, 60, 140] }).collect();
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let is_shirt = is_vest.iter().map(|&v| !v).collect();
        (Scan::from_clean_mesh(mesh, Some(colors)), is_vest, is_shirt)
    }

    #[test]
    fn a_vest_in_the_colour_of_the_shirt_is_in_doubt_and_one_elsewhere_or_in_another_colour_is_not() {
        let everywhere = PerVertex::filled(true, 40);
        let (scan, vest, shirt) = strip([42, 61, 138]);
        assert!(is_lookalike(&scan, &vest, &shirt, &everywhere).unwrap());
        assert!(!is_lookalike(&scan, &vest, &shirt, &shirt).unwrap(), "the shirt is not expected there");
        let (red, ..) = strip([170, 30, 40]);
        assert!(!is_lookalike(&red, &vest, &shirt, &everywhere).unwrap());
        let without_colors = Scan { colors: None, ..scan };
        assert!(!is_lookalike(&without_colors, &vest, &shirt, &everywhere).unwrap());
        assert!(is_lookalike(&red, &vest, &shirt, &PerVertex::filled(true, 3)).is_err());
    }
}
