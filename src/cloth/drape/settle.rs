//! Draping: all layers settle at once, each pressing on the others.

use super::separation::{final_outside, initial_outside};
use crate::cloth::contact::collider::Collider;
use crate::cloth::contact::planes::{ContactPlane, contacts_of, push_out};
use crate::cloth::error::ClothError;
use crate::cloth::fabric::Fabric;
use crate::cloth::layer::ClothLayer;
use crate::cloth::springs::{Spring, springs_of};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use rayon::prelude::*;

/// Seconds per frame: contacts are searched once in each; what falls freely for a second moves 30 cm in it, what settles
/// a millimetre.
const FRAME_SECS: f64 = 1.0 / 30.0;
/// Steps per frame; small steps converge better than many iterations (Macklin 2019).
const SUBSTEPS: usize = 20;
/// Share of velocity lost per step: only the rest position matters, not the swing.
const DAMPING: f64 = 0.02;
/// Gravity, m/s².
const GRAVITY: f64 = 9.81;

/// One layer in motion.
struct ClothState<'a> {
    layer: &'a ClothLayer,
    springs: Vec<Spring>,
    /// 1/kg; 0 where it is pinned.
    inverse_mass: Vec<f64>,
    at: Vec<Point>,
    velocity: Vec<Vec3>,
}

/// The layers after `secs` of settling from their initial positions, on a body that does not move.
///
/// The outer layers press on the inner ones and rest on them.
///
/// **Shapes** `layers` and `initial` have one entry per layer, the innermost first; `initial[k]` one point per vertex of
/// `layers[k].rest`, and so has the result.
///
/// **Frame and units** metres, Y up.
///
/// **Errors** arrays that do not belong together, a fabric or duration that does not exist; see [`ClothError`].
///
/// **Guarantees** the result does not depend on the number of threads; no layer is left inside the body or an inner
/// layer.
///
/// **Source** compliant distance constraints, one iteration per small step (XPBD; Macklin 2016, 2019).
pub fn drape(
    layers: &[&ClothLayer],
    initial: &[PerVertex<Point>],
    body: &Collider,
    secs: f64,
) -> Result<Vec<TriMesh>, ClothError> {
    check(layers, initial, secs)?;
    let initial = initial_outside(layers, initial);
    let mut sheets: Vec<ClothState<'_>> =
        layers.iter().zip(&initial).map(|(layer, start)| ClothState::new(layer, start)).collect();
    let collider = |sheet: &ClothState<'_>| Collider::prepare(&sheet.mesh());
    let mut colliders: Vec<Collider> =
        if sheets.len() > 1 { sheets.par_iter().map(collider).collect() } else { Vec::new() };
    let fabrics: Vec<Fabric> = layers.iter().map(|layer| layer.fabric).collect();
    for _ in 0..(secs / FRAME_SECS).round() as usize {
        sheets.par_iter_mut().enumerate().for_each(|(k, sheet)| {
            let contacts = contacts_of(&sheet.at, k, body, &colliders, &fabrics);
            sheet.step(&contacts);
        });
        colliders = colliders.par_iter().zip(&sheets).map(|(collider, sheet)| collider.moved(&sheet.at)).collect();
    }
    Ok(final_outside(sheets.into_iter().map(|s| (s.layer, s.at)).collect(), body))
}

fn check(layers: &[&ClothLayer], initial: &[PerVertex<Point>], secs: f64) -> Result<(), ClothError> {
    let same = |what, found, expected| {
        if found == expected { Ok(()) } else { Err(ClothError::CountMismatch { what, found, expected }) }
    };
    same("initial positions of layers", initial.len(), layers.len())?;
    for (k, (layer, start)) in layers.iter().zip(initial).enumerate() {
        let vertices = layer.rest.vertex_count();
        same("initial vertex positions", start.len(), vertices)?;
        same("pinned flags", layer.pinned.len(), vertices)?;
        if !layer.fabric.is_valid() {
            return Err(ClothError::BadFabric { layer: k, fabric: layer.fabric });
        }
    }
    if !secs.is_finite() || secs < 0.0 {
        return Err(ClothError::BadDuration { secs });
    }
    Ok(())
}

impl<'a> ClothState<'a> {
    fn new(layer: &'a ClothLayer, start: &PerVertex<Point>) -> Self {
        let areas = layer.rest.vertex_areas();
        let mass = |v: usize| (areas.0[v] * layer.fabric.density).max(1e-6);
        let inverse_mass = (0..start.len()).map(|v| if layer.pinned.0[v] { 0.0 } else { 1.0 / mass(v) }).collect();
        Self {
            layer,
            springs: springs_of(layer, FRAME_SECS / SUBSTEPS as f64),
            inverse_mass,
            at: start.0.clone(),
            velocity: vec![Vec3::zeros(); start.len()],
        }
    }

    fn mesh(&self) -> TriMesh {
        self.layer.rest.with_points(self.at.clone())
    }

    /// One frame.
    fn step(&mut self, contacts: &[Vec<ContactPlane>]) {
        let h = FRAME_SECS / SUBSTEPS as f64;
        for _ in 0..SUBSTEPS {
            let before = self.at.clone();
            for (v, p) in self.at.iter_mut().enumerate() {
                if self.inverse_mass[v] > 0.0 {
                    self.velocity[v].y -= GRAVITY * h;
                    *p += self.velocity[v] * h;
                }
            }
            for spring in &self.springs {
                spring.satisfy(&mut self.at, &self.inverse_mass);
            }
            for (v, p) in self.at.iter_mut().enumerate() {
                if self.inverse_mass[v] > 0.0 {
                    contacts[v].iter().for_each(|c| push_out(p, &before[v], c));
                }
            }
            for (v, p) in self.at.iter().enumerate() {
                self.velocity[v] = (p - before[v]) / h * (1.0 - DAMPING);
            }
        }
    }
}
