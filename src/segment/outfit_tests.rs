//! Tests of the labels of an outfit, on a tube with three garments.

use super::brush::Marks;
use super::evidence::Inner;
use super::outfit::propose_outfit;
use super::outfit_proposal::{OutfitLabels, OutfitProposal};
use super::placement::Placement;
use super::refine::{LabelMethod, RefineParams, propose};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh};
use crate::scan::Scan;

const SKIN: [u8; 3] = [205, 160, 135];
const BLUE: [u8; 3] = [40, 60, 140];
const RED: [u8; 3] = [170, 30, 40];
const BLACK: [u8; 3] = [25, 25, 25];

/// A tube 1 m high around the y axis, with the radius and the colour of each height.
fn tube(radius: impl Fn(f64) -> f64, color: impl Fn(f64) -> [u8; 3]) -> (TriMesh, PerVertex<[u8; 3]>) {
    let (rings, sectors) = (110u32, 64u32);
    let (mut points, mut faces, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..=rings {
        let height = f64::from(i) / f64::from(rings);
        for j in 0..sectors {
            let turn = std::f64::consts::TAU * f64::from(j) / f64::from(sectors);
            points.push(Point::new(radius(height) * turn.cos(), height, -radius(height) * turn.sin()));
            colors.push(color(height));
            if i > 0 {
                let [a, b] = [(i - 1) * sectors + j, (i - 1) * sectors + (j + 1) % sectors];
                faces.extend([[a, b, b + sectors], [a, b + sectors, a + sectors]]);
            }
        }
    }
    (TriMesh::try_from_indices(points, &faces).unwrap(), colors.into())
}

/// A body, and the scan of it in blue trousers up to 50 cm and a red shirt from there to 80 cm.
struct Dressed {
    body: TriMesh,
    skin: PerVertex<[u8; 3]>,
    scan: Scan,
}

fn dressed(color: impl Fn(f64) -> [u8; 3]) -> Dressed {
    let (body, skin) = tube(|_| 0.1, |_| SKIN);
    let (scan, colors) = tube(|y| if y < 0.8 { 0.104 } else { 0.1 }, color);
    Dressed { body, skin, scan: Scan::from_clean_mesh(scan, Some(colors)) }
}

fn worn(y: f64) -> [u8; 3] {
    match y {
        y if y < 0.5 => BLUE,
        y if y < 0.8 => RED,
        _ => SKIN,
    }
}

impl Dressed {
    /// A template that covers the heights from `from` to `to`.
    fn placement(&self, from: f64, to: f64) -> Placement {
        let depth: PerVertex<f64> = self.body.points().iter().map(|p| (p.y - from).min(to - p.y)).collect();
        Placement { prior: depth.iter().map(|&d| d > 0.0).collect(), depth, given: false }
    }

    fn propose(&self, placements: &[Placement]) -> OutfitProposal {
        let inner = [Inner { mesh: &self.body, colors: Some(&self.skin) }];
        propose_outfit(&self.scan, &inner, placements, None, &RefineParams::default()).unwrap()
    }

    fn labels(&self, placements: &[Placement], marks: &[&Marks]) -> OutfitLabels {
        let adjacency = Adjacency::prepare(&self.scan.mesh);
        self.propose(placements).corrected(&self.scan.mesh, &adjacency, marks).unwrap()
    }

    fn unmarked(&self, placements: &[Placement]) -> OutfitLabels {
        let none = Marks::none(self.scan.mesh.vertex_count());
        self.labels(placements, &vec![&none; placements.len()])
    }

    /// The lowest and the highest vertex of a garment.
    fn ends(&self, of: &PerVertex<bool>) -> (f64, f64) {
        let heights = self.scan.mesh.points().enumerate().filter(|(v, _)| of[*v]).map(|(_, p)| p.y);
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)))
    }
}

/// Templates of trousers, to 60 cm, and of a shirt, from 40 to 85 cm: both are wrong by 10 and 5 cm.
fn trousers_and_shirt(of: &Dressed) -> [Placement; 2] {
    [of.placement(-9.0, 0.6), of.placement(0.4, 0.85)]
}

#[test]
fn the_border_of_two_garments_is_where_their_colours_change() {
    let on = dressed(worn);
    let [trousers, shirt] = trousers_and_shirt(&on);
    for placements in [[trousers.clone(), shirt.clone()], [shirt, trousers]] {
        let found = on.unmarked(&placements);
        let mut ends: Vec<(f64, f64)> = (0..2).map(|k| on.ends(&found.of_garment(k).labels.0)).collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Two rings of the tube: colours are smoothed out over the neighbours.
        assert!(ends[0].0 == 0.0 && (ends[0].1 - 0.5).abs() < 0.02, "{ends:?}");
        assert!((ends[1].0 - 0.5).abs() < 0.02 && (ends[1].1 - 0.8).abs() < 0.02, "{ends:?}");
    }
}

#[test]
fn each_vertex_belongs_to_one_garment_at_most_with_and_without_marks() {
    let on = dressed(worn);
    let placements = trousers_and_shirt(&on);
    let count = on.scan.mesh.vertex_count();
    let is = |low: f64, high: f64| -> Marks {
        on.scan.mesh.points().iter().map(|p| ((low..high).contains(&p.y) && p.x > 0.05).then_some(true)).collect()
    };
    let erased: Marks = is(0.6, 0.65).labels.iter().map(|mark| mark.map(|_| false)).collect();
    let none = Marks::none(count);
    for marks in [[&none, &none], [&is(0.55, 0.62), &none], [&is(0.4, 0.6), &is(0.45, 0.7)], [&none, &erased]] {
        let found = on.labels(&placements, &marks);
        let of: Vec<_> = (0..2).map(|k| found.of_garment(k)).collect();
        for v in on.scan.mesh.vertex_ids() {
            let owners = of.iter().filter(|garment| garment.labels.0[v]).count();
            assert!(owners + usize::from(found.unexplained()[v]) <= 1);
            assert_eq!(found.of_others(0)[v], of[1].labels.0[v]);
            // Each mark holds; where both are marked, that of the outer garment.
            for k in 0..2 {
                let is_outermost = k == 1 || marks[1].labels[v] != Some(true);
                assert!(marks[k].labels[v].is_none_or(|mark| !is_outermost || of[k].labels.0[v] == mark));
            }
        }
    }
    let painted = on.labels(&placements, &[&is(0.55, 0.62), &none]);
    assert!(painted.of_garment(1).by_hand.iter().any(|&by_hand| by_hand), "the shirt was taken from by hand, too");
}

#[test]
fn one_garment_alone_gets_the_labels_of_its_own_proposal() {
    let on = dressed(worn);
    let adjacency = Adjacency::prepare(&on.scan.mesh);
    let shirt = on.placement(0.4, 0.85);
    let inner = [Inner { mesh: &on.body, colors: Some(&on.skin) }];
    let stroke: Marks = on.scan.mesh.points().iter().map(|p| (p.y > 0.82 && p.x > 0.0).then_some(true)).collect();
    for method in [LabelMethod::Refine, LabelMethod::Transfer] {
        let params = RefineParams { method, ..RefineParams::default() };
        let alone = propose(&on.scan, &inner, &shirt, &params).unwrap();
        let outfit = propose_outfit(&on.scan, &inner, std::slice::from_ref(&shirt), None, &params).unwrap();
        for marks in [&Marks::none(on.scan.mesh.vertex_count()), &stroke] {
            let expected = alone.corrected(&on.scan.mesh, &adjacency, marks).unwrap();
            let found = outfit.corrected(&on.scan.mesh, &adjacency, &[marks]).unwrap().of_garment(0);
            assert_eq!(found, expected, "{method:?}");
        }
    }
}

#[test]
fn what_no_garment_explains_belongs_to_none() {
    // Black hair falls over the shirt, down to 72 cm.
    let on = dressed(|y| if y > 0.72 { BLACK } else { worn(y) });
    let placements = trousers_and_shirt(&on);
    let found = on.unmarked(&placements);
    let hair = on.ends(&found.unexplained());
    assert!((hair.0 - 0.72).abs() < 0.02 && hair.1 == 1.0, "{hair:?}");
    let shirt = on.ends(&found.of_garment(1).labels.0);
    assert!((shirt.0 - 0.5).abs() < 0.02 && (shirt.1 - 0.72).abs() < 0.02, "{shirt:?}");
}

#[test]
fn known_hair_has_a_label_and_the_garment_continues_below_it() {
    // Black hair falls over the shirt, down to 72 cm; on the bare scan it reached to 70 cm.
    let on = dressed(|y| if y > 0.72 { BLACK } else { worn(y) });
    let (inner, hair) = ([Inner { mesh: &on.body, colors: Some(&on.skin) }], on.placement(0.7, 9.0));
    let adjacency = Adjacency::prepare(&on.scan.mesh);
    let none = Marks::none(on.scan.mesh.vertex_count());
    let labels = |garments: &[Placement]| {
        let found = propose_outfit(&on.scan, &inner, garments, Some(&hair), &RefineParams::default()).unwrap();
        found.corrected(&on.scan.mesh, &adjacency, &vec![&none; garments.len()]).unwrap()
    };
    let [trousers, shirt] = trousers_and_shirt(&on);
    let of_outfit = labels(&[trousers, shirt.clone()]);
    for (found, place) in [(&of_outfit, 1), (&labels(&[shirt]), 0)] {
        let hair = on.ends(&found.hair());
        assert!((hair.0 - 0.72).abs() < 0.02 && hair.1 == 1.0, "{hair:?}");
        let garment = found.of_garment(place);
        assert!((on.ends(&garment.labels.0).1 - 0.72).abs() < 0.02);
        // There the template ends, and the colour of the hair says nothing.
        let below = on.ends(&garment.below_hair.unwrap());
        assert!((below.0 - 0.72).abs() < 0.02 && (below.1 - 0.85).abs() < 0.02, "{below:?}");
        assert!(found.of_others(place).iter().zip(found.hair().iter()).all(|(other, hair)| *other || !hair));
    }
    assert!(!of_outfit.unexplained().iter().any(|&u| u));
    assert!(!of_outfit.of_garment(0).below_hair.unwrap().iter().any(|&below| below));
}

#[test]
fn a_hat_is_over_the_hair() {
    let yellow = [230, 200, 40];
    let on = dressed(|y| {
        if y > 0.9 {
            yellow
        } else if y > 0.72 {
            BLACK
        } else {
            worn(y)
        }
    });
    let [trousers, shirt] = trousers_and_shirt(&on);
    let (garments, hair) = ([trousers, shirt, on.placement(0.88, 9.0)], on.placement(0.7, 9.0));
    let inner = [Inner { mesh: &on.body, colors: Some(&on.skin) }];
    let found = propose_outfit(&on.scan, &inner, &garments, Some(&hair), &RefineParams::default()).unwrap();
    let none = Marks::none(on.scan.mesh.vertex_count());
    let found = found.corrected(&on.scan.mesh, &Adjacency::prepare(&on.scan.mesh), &[&none, &none, &none]).unwrap();
    let (hat, hair) = (on.ends(&found.of_garment(2).labels.0), on.ends(&found.hair()));
    assert!((hat.0 - 0.9).abs() < 0.02 && hat.1 == 1.0, "{hat:?}");
    assert!((hair.0 - 0.72).abs() < 0.02 && (hair.1 - 0.9).abs() < 0.02, "{hair:?}");
    assert!(!found.of_garment(2).below_hair.unwrap().iter().any(|&below| below), "hair hides no hat");
}

#[test]
fn a_boot_shaft_that_no_template_covers_does_not_teach_the_trousers_its_colour() {
    // Red boots up to 18 cm, of which their template covers 8 cm; the trousers' template covers the rest.
    let on = dressed(|y| {
        if y < 0.18 {
            RED
        } else if y < 0.8 {
            BLUE
        } else {
            SKIN
        }
    });
    let placements = [on.placement(0.08, 0.8), on.placement(-9.0, 0.08)];
    let found = on.unmarked(&placements);
    let (trousers, boots) = (on.ends(&found.of_garment(0).labels.0), on.ends(&found.of_garment(1).labels.0));
    assert!((trousers.0 - 0.18).abs() < 0.02 && (boots.1 - 0.18).abs() < 0.02, "{trousers:?} {boots:?}");
}

#[test]
fn a_striped_garment_stays_whole_although_one_stripe_is_beyond_its_template() {
    // Stripes of 4 cm; the template ends at 85 cm, the shirt at 90 cm with a red stripe.
    let stripe = |y: f64| if ((y - 0.5) / 0.04).floor() as i64 % 2 == 0 { BLACK } else { RED };
    let (body, skin) = tube(|_| 0.1, |_| SKIN);
    let color = |y: f64| {
        if y < 0.5 {
            BLACK
        } else if y < 0.9 {
            stripe(y)
        } else {
            SKIN
        }
    };
    let (scan, colors) = tube(|y| if y < 0.9 { 0.104 } else { 0.1 }, color);
    let on = Dressed { body, skin, scan: Scan::from_clean_mesh(scan, Some(colors)) };
    let found = on.unmarked(&trousers_and_shirt(&on));
    assert!(!found.unexplained().iter().any(|&u| u));
    let shirt = found.of_garment(1).labels.0;
    let torn = on.scan.mesh.points().enumerate().filter(|(v, p)| (0.62..0.84).contains(&p.y) && !shirt[*v]).count();
    assert_eq!(torn, 0, "all stripes belong to the shirt, also those in the colour of the trousers");
}

#[test]
fn labels_depend_on_no_thread_and_survive_a_file() {
    let on = dressed(worn);
    let placements = trousers_and_shirt(&on);
    let found = on.propose(&placements);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one_thread.install(|| on.propose(&placements)), found);
    let text = serde_json::to_string(&found).unwrap();
    assert_eq!(serde_json::from_str::<OutfitProposal>(&text).unwrap(), found);
}

#[test]
fn labels_that_do_not_fit_are_refused() {
    let on = dressed(worn);
    let [trousers, shirt] = trousers_and_shirt(&on);
    let inner = [Inner { mesh: &on.body, colors: Some(&on.skin) }];
    let short = Placement { depth: PerVertex::filled(0.0, 3), ..shirt.clone() };
    assert!(propose_outfit(&on.scan, &inner, &[trousers.clone(), short], None, &RefineParams::default()).is_err());
    let adjacency = Adjacency::prepare(&on.scan.mesh);
    let none = Marks::none(on.scan.mesh.vertex_count());
    let proposal = on.propose(&[trousers, shirt]);
    assert!(proposal.corrected(&on.scan.mesh, &adjacency, &[&none]).is_err(), "marks of one garment for two");
    assert!(proposal.corrected(&on.scan.mesh, &adjacency, &[&none, &Marks::none(3)]).is_err());
}
