//! Cloth around a body that grows inside it and then moves: how a garment is put on without anything that crosses.

use super::constraint_solver::{ConstraintSolver, Forces};
use super::crossing_free::surfaces::Surfaces;
use super::error::ClothError;
use super::layer::ClothLayer;
use super::skin_step::{GRAVITY, SkinStep};
use super::springs::springs_of;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId};

/// Iterations of the constraints per step: nothing but them holds the cloth against its weight.
const ITERATIONS: usize = 24;
/// Coefficient of friction of cloth that cannot slide.
const STICKY: f64 = 2.0;

/// A step of the body, and what it does to the cloth.
pub struct BodyStep {
    /// Where the vertices of all solids go. **Shapes** one entry per vertex, solid after solid.
    pub solids: Vec<Point>,
    /// How the cloth would move along, where it does. **Shapes** one entry per vertex.
    pub along: Option<Vec<Vec3>>,
    /// Share of gravity that acts on the cloth.
    pub gravity: f64,
    /// Its duration in seconds.
    pub secs: f64,
    /// Share of its velocity that cloth loses per second.
    pub damping: f64,
    /// Whether cloth cannot slide on what pushes it; otherwise its fabric's friction holds it.
    pub is_sticky: bool,
    /// The mean height at which the band is held, before it is moved along; `None` lets go of it.
    pub band_at: Option<f64>,
}

/// Share of a band's way to where it is held that it would go in a step if nothing resisted, and the longest way that counts,
/// metres.
const PULL: f64 = 0.2;
const FARTHEST_PULL: f64 = 0.02;
/// A band that is held is as heavy as this many such rings: it bears the garment, which has a few hundred.
const HEAVIER: f64 = 20.0;

/// Cloth after the body moved in it.
#[derive(Clone, Debug, PartialEq)]
pub struct PutOn {
    /// **Shapes** V × 3.
    pub cloth: PerVertex<Point>,
    /// Where the vertices of all solids are, given way to the cloth. **Shapes** one entry per vertex, solid after solid.
    pub solids: Vec<Point>,
    /// How far the solids had to give way at most, in metres: cloth that is too tight for them.
    pub gave_way: f64,
    /// Steps in which nothing moved, because no move was safe.
    pub stopped_steps: usize,
}

/// Takes cloth through the steps of a body.
///
/// **Shapes** `solids`: the body, and what it wears, at the start; `steps` give their places from then on; `band`: the vertices of
/// the cloth that steps may hold.
///
/// **Errors** a fabric that cannot be.
///
/// **Guarantees** if no face of the cloth crosses another face at the start, none does at the end. Solids may pass through each
/// other. Equal arguments give equal bytes, whatever the number of threads.
pub fn put_on(
    cloth: &ClothLayer,
    start: &PerVertex<Point>,
    band: &[VertexId],
    solids: &[TriMesh],
    steps: impl Iterator<Item = BodyStep>,
) -> Result<PutOn, ClothError> {
    if !cloth.fabric.is_valid() {
        return Err(ClothError::BadFabric { layer: 0, fabric: cloth.fabric });
    }
    let own = cloth.rest.with_points(start.0.clone());
    let meshes: Vec<&TriMesh> = solids.iter().chain([&own]).collect();
    let surfaces = Surfaces::around_solids(&meshes, solids.len());
    let (body, count) = (surfaces.body_vertices(), surfaces.rest.len());
    let mut inverse_mass = vec![0.0; count];
    for (v, area) in cloth.rest.vertex_areas().iter().enumerate() {
        inverse_mass[body + v] = 1.0 / (area * cloth.fabric.density).max(1e-6);
    }
    let mut solver = ConstraintSolver::new(
        surfaces,
        Forces::Springs(vec![springs_of(cloth, 1.0)]),
        inverse_mass,
        vec![0.0; count],
        (cloth.fabric.friction, ITERATIONS),
    );
    let mean_height =
        |of: &dyn Fn(usize) -> f64| band.iter().map(|v| of(v.index())).sum::<f64>() / band.len().max(1) as f64;
    let (began_at, mut moved_along) = (mean_height(&|v| start.0[v].y), 0.0);
    let own_inverse_mass: Vec<f64> = band.iter().map(|v| solver.inverse_mass[body + v.index()]).collect();
    let mut before = solver.at.clone();
    let mut carried = vec![Vec3::zeros(); count];
    let mut along_before: Option<Vec<Vec3>> = None;
    for BodyStep { solids, along, gravity, secs, damping, is_sticky, band_at } in steps {
        solver.damping = damping;
        solver.friction = if is_sticky { STICKY } else { cloth.fabric.friction };
        solver.set_step(secs);
        carried.fill(Vec3::new(0.0, -GRAVITY * (1.0 - gravity), 0.0));
        let mut places = before.clone();
        places[..body].copy_from_slice(&solids);
        // Cloth takes no momentum from what it is moved along with: in a step of a hundredth of the way to another pose it moves at
        // a metre per second, and would fly on.
        for (v, velocity) in solver.velocity[body..].iter_mut().enumerate() {
            let by = |along: &Option<Vec<Vec3>>| along.as_ref().map_or(Vec3::zeros(), |along| along[v]);
            *velocity += (by(&along) - by(&along_before)) / secs;
        }
        for (place, by) in places[body..].iter_mut().zip(along.iter().flatten()) {
            *place += by;
        }
        moved_along += along.as_ref().map_or(0.0, |along| mean_height(&|v| along[v].y));
        for (&v, own) in band.iter().zip(&own_inverse_mass) {
            let at = body + v.index();
            solver.inverse_mass[at] = if band_at.is_some() { own / HEAVIER } else { *own };
            if let Some(height) = band_at {
                let way = start[v].y + height + moved_along - began_at - solver.at[at].y;
                carried[at].y = -GRAVITY - PULL * way.clamp(-FARTHEST_PULL, FARTHEST_PULL) / (secs * secs);
            }
        }
        solver.step(&SkinStep { before: &before, places: &places, carried: &carried, secs })?;
        before = places;
        along_before = along;
    }
    let gave_way = solver.at[..body].iter().zip(&before).map(|(at, place)| (at - place).norm()).fold(0.0, f64::max);
    let cloth = solver.at.split_off(body).into();
    let stopped_steps = solver.stopped_steps();
    Ok(PutOn { cloth, solids: solver.at, gave_way, stopped_steps })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::fabric_named;
    use crate::geometry::{intersecting_pairs, sphere};

    /// A band of cloth around the y axis, and a ball that grows in it.
    #[test]
    fn a_body_that_grows_stretches_the_cloth_and_never_crosses_it() {
        let (around, rings, radius) = (40_u32, 8_u32, 0.1);
        let mut points = Vec::new();
        let mut faces = Vec::new();
        for ring in 0..rings {
            for k in 0..around {
                let (s, c) = (std::f64::consts::TAU * f64::from(k) / f64::from(around)).sin_cos();
                points.push(Point::new(radius * s, 0.015 * (f64::from(ring) - 3.5), radius * c));
                if ring + 1 < rings {
                    let [a, b] = [ring * around + k, ring * around + (k + 1) % around];
                    faces.extend([[a, b, b + around], [a, b + around, a + around]]);
                }
            }
        }
        let band = TriMesh::try_from_indices(points, &faces).unwrap();
        let ball = sphere(16, 24);
        let scaled = |r: f64| ball.map_points(|p| Point::from(p.coords * r));
        let cloth = ClothLayer {
            pinned: PerVertex::filled(false, band.vertex_count()),
            rest: band.clone(),
            fabric: fabric_named("jersey").unwrap(),
        };
        let steps = (1..=40).map(|k| BodyStep {
            solids: scaled(0.03 + 0.09 * f64::from(k) / 40.0).points().0.clone(),
            along: None,
            gravity: 0.0,
            secs: 1.0 / 90.0,
            damping: 20.0,
            is_sticky: true,
            band_at: None,
        });
        let worn = put_on(&cloth, band.points(), &[], &[scaled(0.03)], steps).unwrap();
        let at = band.with_points(worn.cloth.0.clone());
        assert!(intersecting_pairs(&at, &scaled(0.12 - worn.gave_way)).is_empty());
        let radii: Vec<f64> = at.points().iter().map(|p| p.x.hypot(p.z)).collect();
        let middle = radii[3 * around as usize..5 * around as usize].iter().copied().fold(f64::MAX, f64::min);
        assert!(middle > 0.115 - worn.gave_way && worn.gave_way < 0.01, "{middle} {}", worn.gave_way);
    }
}
