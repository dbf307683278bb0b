use super::bend::bent_limb;
use super::carry::{BentLimb, carried};
use super::clear::cleared;
use super::fill::closed_part;
use super::planes::refined_parts;
use super::push::KAPPA;
use super::reeb::coarse_parts;
use super::shapes_for_tests::{ball, line, trousers, tube};
use super::skeleton::{CurveSkeleton, curve_skeleton};
use super::*;
use crate::body::{Figure, Pose, Side, Stance, embedded_model};
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use crate::tryon::recognize::{Openings, recognize};
use crate::tryon::rims::rims_of;
use nalgebra::UnitQuaternion;

fn average() -> Figure {
    let model = embedded_model().unwrap();
    Figure::mean(&model)
}

fn openings(mesh: &TriMesh) -> Openings {
    recognize(mesh, &rims_of(mesh), Some(1.0)).unwrap().openings.in_order()
}

fn count(parts: &PerVertex<GarmentPart>, part: GarmentPart) -> usize {
    parts.iter().filter(|p| **p == part).count()
}

#[test]
fn parts_of_trousers_are_as_symmetric_as_they_are_and_cover_them() {
    let mesh = trousers();
    let adjacency = Adjacency::prepare(&mesh);
    assert!(mesh.vertex_normals()[VertexId(0)].z > 0.9, "faces look outward");
    let openings = openings(&mesh);
    assert!(matches!(openings, Openings::Legs { .. }));
    let coarse = coarse_parts(&mesh, &adjacency, &openings);
    assert!(coarse.notes.is_empty(), "{:?}", coarse.notes);
    let [left, right] = Side::BOTH.map(|side| count(&coarse.part_of, GarmentPart::Limb(side)));
    assert!(left.abs_diff(right) < 12 && left > 200, "{left} {right}");
    let lowest = |part| {
        mesh.points()
            .iter()
            .zip(coarse.part_of.iter())
            .filter(|(_, p)| **p == part)
            .map(|(p, _)| p.y)
            .fold(2.0, f64::min)
    };
    assert!(lowest(GarmentPart::Torso) > 0.55 && lowest(GarmentPart::Limb(Side::Left)) < 0.11);
    // A tree: the torso, and a branch per leg.
    assert!(coarse.links.len() >= coarse.nodes.len() - 1);
    let refined = refined_parts(&mesh, &adjacency, &openings, &coarse.part_of, true);
    let total: usize = [GarmentPart::Torso, GarmentPart::Limb(Side::Left), GarmentPart::Limb(Side::Right)]
        .into_iter()
        .map(|part| count(&refined.part_of, part))
        .sum();
    assert_eq!(total, mesh.vertex_count());
    for side in Side::BOTH {
        let limb = GarmentPart::Limb(side);
        assert!(count(&refined.part_of, limb) > count(&coarse.part_of, limb), "refinement moves the boundary up");
        for (v, part) in refined.part_of.enumerate().filter(|(_, part)| **part == limb) {
            assert!(mesh.points()[v].x * side.sign() > -1e-9, "{part:?} {}", mesh.points()[v]);
        }
        // Eq. 4: the hip's side is cut higher than the crotch.
        let top = mesh.points().iter().zip(refined.part_of.iter()).filter(|(_, p)| **p == limb).map(|(p, _)| p.y);
        assert!(top.fold(0.0, f64::max) > 0.88);
    }
    let same = refined_parts(&mesh, &adjacency, &openings, &coarse.part_of, false);
    assert_eq!(same.part_of, coarse.part_of);
    assert!(same.planes.is_empty());
}

#[test]
fn filled_parts_are_closed_and_keep_their_side_out() {
    let mesh = trousers();
    let adjacency = Adjacency::prepare(&mesh);
    let openings = openings(&mesh);
    let parts = coarse_parts(&mesh, &adjacency, &openings).part_of;
    for (part, rings) in
        [(GarmentPart::Torso, 3), (GarmentPart::Limb(Side::Left), 2), (GarmentPart::Limb(Side::Right), 2)]
    {
        let closed = closed_part(&mesh, &parts, part).unwrap();
        // Where a boundary touches itself in a vertex, a ring falls into two.
        assert!(closed.rings.len() >= rings);
        assert!(Adjacency::prepare(&closed.mesh).boundary_edges().is_empty());
        assert!(closed.mesh.signed_volume() > 0.0);
    }
}

fn sleeve(length: f64) -> (TriMesh, CurveSkeleton) {
    let mesh = tube(&line(Point::new(0.1, 1.3, 0.02), Point::new(0.1 + length, 1.3, 0.02), 30), 0.06, 24);
    let parts = PerVertex::filled(GarmentPart::Limb(Side::Left), mesh.vertex_count());
    let closed = closed_part(&mesh, &parts, GarmentPart::Limb(Side::Left)).unwrap();
    let x = |ring: &[VertexId]| closed.mesh.points()[ring[0]].x;
    let mut rings = closed.rings.clone();
    rings.sort_by(|a, b| x(a).total_cmp(&x(b)));
    let skeleton = curve_skeleton(&closed, &rings[0], &rings[1]).unwrap();
    (mesh, skeleton)
}

#[test]
fn the_skeleton_of_a_cylinder_is_its_axis() {
    let (mesh, skeleton) = sleeve(0.5);
    assert!(skeleton.nodes.len() >= 8, "{}", skeleton.nodes.len());
    for node in &skeleton.nodes {
        assert!((node.y - 1.3).hypot(node.z - 0.02) < 0.003, "{node}");
    }
    assert!(skeleton.nodes.windows(2).all(|pair| pair[1].x > pair[0].x), "in order");
    let length = skeleton.arc_lengths().last().copied().unwrap();
    assert!((length - 0.5).abs() < 0.002, "{length}");
    // Eq. 12, and nobody is left out.
    let mut all: Vec<VertexId> = skeleton.vertices.iter().flatten().copied().collect();
    all.sort_unstable();
    assert_eq!(all, mesh.vertex_ids().collect::<Vec<_>>());
}

#[test]
fn a_tube_bent_by_90_degrees_keeps_its_lengths() {
    let (mesh, skeleton) = sleeve(0.5);
    // An arm that hangs, with its lower half to the front.
    let bones = [Point::new(3.0, 1.0, 0.0), Point::new(3.0, 0.72, 0.0), Point::new(3.0, 0.72, 0.3)];
    let bent = bent_limb(&skeleton, bones, (skeleton.nodes[0], UnitQuaternion::identity())).unwrap();
    assert!((bent.bones[0] - skeleton.nodes[0]).norm() < 1e-12, "Eq. 9");
    for (pair, arcs) in bent.to.windows(2).zip(bent.arcs.windows(2)) {
        let (now, before) = ((pair[1] - pair[0]).norm(), arcs[1] - arcs[0]);
        assert!((now / before - 1.0).abs() < 0.06, "{now} {before}");
    }
    assert!((bent.turns.last().unwrap() * Vec3::x() - Vec3::z()).norm() < 0.02);
    assert!((bent.turns[0] * Vec3::x() + Vec3::y()).norm() < 0.02);
    let parts = PerVertex::filled(GarmentPart::Limb(Side::Left), mesh.vertex_count());
    let adjacency = Adjacency::prepare(&mesh);
    let limb = BentLimb { side: Side::Left, skeleton: &skeleton, bent: &bent };
    let moved = carried(&mesh, &adjacency, &parts, None, &[limb]).unwrap();
    let ratio = |[a, b]: [VertexId; 2]| {
        (moved.points()[a] - moved.points()[b]).norm() / (mesh.points()[a] - mesh.points()[b]).norm()
    };
    let mut ratios: Vec<f64> = adjacency.edges().iter().map(|(edge, _)| ratio(*edge)).collect();
    ratios.sort_by(f64::total_cmp);
    // Outside of the elbow cloth is stretched by the radius over the arc's radius, inside it is pressed; never turned over.
    assert!(ratios[0] > 0.15 && ratios[ratios.len() - 1] < 1.9, "{} {}", ratios[0], ratios[ratios.len() - 1]);
    assert!((ratios[ratios.len() / 2] - 1.0).abs() < 0.02);
}

#[test]
fn a_sleeve_shorter_than_the_first_bone_stays_on_it() {
    let (_, skeleton) = sleeve(0.15);
    let bones = [Point::origin(), Point::new(0.0, -0.3, 0.0), Point::new(0.2, -0.3, 0.0)];
    let bent = bent_limb(&skeleton, bones, (skeleton.nodes[0], UnitQuaternion::identity())).unwrap();
    for node in &bent.to {
        let off = node - bent.bones[0];
        assert!(off.x.hypot(off.z) < 1e-9 && off.y <= 1e-9);
    }
    // Straight on in the direction that it has: nothing turns.
    let along = [Point::origin(), Point::new(0.3, 0.0, 0.0), Point::new(0.6, 0.0, 0.0)];
    let still = bent_limb(&skeleton, along, (skeleton.nodes[0], UnitQuaternion::identity())).unwrap();
    assert!(still.turns.iter().all(|turn| turn.angle() < 0.05));
}

#[test]
fn a_ball_inside_a_garment_is_cleared() {
    let body = SurfaceIndex::prepare(&ball(Point::origin(), 0.1, 40, 60));
    // A tube through which the ball sticks out on one side.
    let garment = tube(&line(Point::new(0.03, -0.2, 0.0), Point::new(0.03, 0.2, 0.0), 30), 0.095, 36);
    let done = cleared(&garment, &Adjacency::prepare(&garment), &body, &|_, _| false);
    assert!(done.inside[0] > 20 && done.inside[1] == 0, "{:?}", done.inside);
    let distances: Vec<f64> = done.mesh.points().iter().map(|p| body.signed_distance(p)).collect();
    assert!(distances.iter().all(|d| *d >= 0.0));
    let pushed = garment.points().iter().zip(&distances).filter(|(p, _)| body.signed_distance(p) < 0.0);
    assert!(pushed.clone().all(|(_, d)| *d < 4.0 * KAPPA), "close to the skin");
    let mut after: Vec<f64> = pushed.map(|(_, d)| *d).collect();
    after.sort_by(f64::total_cmp);
    assert!(after[after.len() / 2] > 0.4 * KAPPA, "{}", after[after.len() / 2]);
    // A garment that is clear is not touched.
    let wide = tube(&line(Point::new(0.0, -0.2, 0.0), Point::new(0.0, 0.2, 0.0), 30), 0.2, 36);
    assert_eq!(cleared(&wide, &Adjacency::prepare(&wide), &body, &|_, _| false).mesh, wide);
}

#[test]
fn trousers_are_put_on_a_person_who_walks_with_one_thread_or_more() {
    let (mesh, figure) = (trousers(), average());
    let pose = Stance::Stride.pose(&figure.skeleton);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| by_paper(&mesh, &figure, &pose, Switches::default()).unwrap())
    };
    let (one, four) = (run(1), run(4));
    assert_eq!(one.cleared, four.cleared);
    let cleared = one.cleared.unwrap();
    assert_eq!(cleared.mesh.faces(), mesh.faces());
    assert!(cleared.inside[1] * 200 <= mesh.vertex_count(), "{:?}", cleared.inside);
    let bent = one.bent.unwrap();
    for (limb, bones) in bent.limbs.iter().flatten().zip(&Person::of(&figure, &pose, &one.openings).unwrap().limbs) {
        let (first, leg) = ((limb.to[1] - limb.to[0]).normalize(), (bones[1] - bones[0]).normalize());
        assert!(first.dot(&leg) > 0.999);
    }
}

#[test]
fn a_run_ends_where_it_is_told_to() {
    let (mesh, figure) = (trousers(), average());
    let pose = Pose::bind(figure.skeleton.len());
    for (rank, (name, stop)) in Stop::ALL.into_iter().enumerate() {
        assert_eq!((Stop::from_name(name), stop.name()), (Some(stop), name));
        let steps = by_paper(&mesh, &figure, &pose, Switches { stop, ..Switches::default() }).unwrap();
        let has = [
            steps.parts.is_some(),
            steps.skeletons.is_some(),
            steps.oriented.is_some(),
            steps.bent.is_some(),
            steps.moved.is_some(),
            steps.cleared.is_some(),
        ];
        assert_eq!(has, std::array::from_fn(|k| rank > k), "{name}");
    }
    assert_eq!(Stop::from_name("sew"), None);
}

#[test]
fn the_heading_of_a_person_turns_the_garment_and_nothing_else() {
    let (mesh, figure) = (trousers(), average());
    let bind = Pose::bind(figure.skeleton.len());
    let mut turned = bind.clone();
    turned.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), 1.2);
    let moved = |pose: &Pose| by_paper(&mesh, &figure, pose, Switches { stop: Stop::Move, ..Switches::default() });
    let (plain, heading) = (moved(&bind).unwrap().moved.unwrap().mesh, moved(&turned).unwrap().moved.unwrap().mesh);
    let root = figure.skeleton.world_from_bind(&turned)[0];
    for (p, q) in plain.points().iter().zip(heading.points().iter()) {
        assert!((root * p - q).norm() < 2e-3, "{p} {q}");
    }
}
