//! Splits every polygon of the coarse mesh into quads, through its centre and the middles of its sides.

use super::borders::{Borders, OnBorder};
use super::contraction::Contraction;
use crate::geometry::Point;
use std::collections::HashMap;

/// Quads, with what their vertices know.
#[derive(Clone)]
pub(super) struct Quads {
    pub points: Vec<Point>,
    pub quads: Vec<[u32; 4]>,
    pub on_border: Vec<Option<OnBorder>>,
    /// A face of the surface near each vertex.
    pub on_face: Vec<u32>,
}

/// Each polygon with n corners becomes n quads.
pub(super) fn subdivided(coarse: &Contraction, borders: &Borders, quads: &[[u32; 4]], triangles: &[[u32; 3]]) -> Quads {
    let polygons: Vec<&[u32]> = quads.iter().map(|q| &q[..]).chain(triangles.iter().map(|t| &t[..])).collect();
    let mut is_used = vec![false; coarse.points.len()];
    polygons.iter().copied().flatten().for_each(|&v| is_used[v as usize] = true);
    let mut fine = Quads { points: Vec::new(), quads: Vec::new(), on_border: Vec::new(), on_face: Vec::new() };
    let mut fine_of = vec![u32::MAX; is_used.len()];
    for v in (0..is_used.len()).filter(|&v| is_used[v]) {
        fine_of[v] = fine.add(coarse.points[v], coarse.on_border[v], coarse.on_face[v]);
    }
    // Borders are walked by one polygon only.
    let mut walks: HashMap<[u32; 2], u32> = HashMap::new();
    for polygon in &polygons {
        for k in 0..polygon.len() {
            let [a, b] = [polygon[k], polygon[(k + 1) % polygon.len()]];
            *walks.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
        }
    }
    let mut middles: HashMap<[u32; 2], u32> = HashMap::with_capacity(walks.len());
    for polygon in &polygons {
        let n = polygon.len();
        let at = |v: u32| coarse.points[v as usize].coords;
        let middle = polygon.iter().map(|&v| at(v)).sum::<nalgebra::Vector3<f64>>() / n as f64;
        let center = fine.add(Point::from(middle), None, coarse.on_face[polygon[0] as usize]);
        let around: Vec<u32> = (0..n)
            .map(|k| {
                let [a, b] = [polygon[k], polygon[(k + 1) % n]];
                let key = [a.min(b), a.max(b)];
                *middles.entry(key).or_insert_with(|| {
                    let mut place = None;
                    let mut point = Point::from(0.5 * (at(a) + at(b)));
                    let ends = (&coarse.on_border[a as usize], &coarse.on_border[b as usize]);
                    if let (1, (Some(p), Some(q))) = (walks[&key], ends) {
                        // Faces walk along the border as its curve does.
                        let on_curve = borders.moved(p, 0.5 * borders.way_forwards(p, q));
                        point = borders.point(&on_curve);
                        place = Some(on_curve);
                    }
                    fine.add(point, place, coarse.on_face[a as usize])
                })
            })
            .collect();
        for k in 0..n {
            fine.quads.push([fine_of[polygon[k] as usize], around[k], center, around[(k + n - 1) % n]]);
        }
    }
    fine
}

impl Quads {
    pub fn add(&mut self, point: Point, place: Option<OnBorder>, on_face: u32) -> u32 {
        self.points.push(point);
        self.on_border.push(place);
        self.on_face.push(on_face);
        self.points.len() as u32 - 1
    }
}
