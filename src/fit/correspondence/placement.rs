//! Moving a surface to where the scan is.

use super::scan_surface::ScanSurface;
use crate::geometry::{Point, Vec3};

/// The translation that moves points, each with its area, to the scan: centroid above centroid, lowest point level with lowest
/// point.
pub(crate) fn shift_onto<'p>(
    surface: &ScanSurface,
    places: impl Iterator<Item = (&'p Point, &'p f64)> + Clone,
) -> Vec3 {
    let scan = surface.mesh().points();
    let mut shift = area_centroid(scan.iter().zip(surface.areas.iter())) - area_centroid(places.clone());
    shift.y = lowest(scan.iter()) - lowest(places.map(|place| place.0));
    shift
}

/// The mean of points, weighted by area.
pub(crate) fn area_centroid<'p>(places: impl Iterator<Item = (&'p Point, &'p f64)>) -> Vec3 {
    let (sum, total) = places.fold((Vec3::zeros(), 0.0), |(sum, total), (p, a)| (sum + p.coords * *a, total + a));
    sum / f64::max(total, 1e-12)
}

/// The least height of points.
pub(crate) fn lowest<'p>(points: impl Iterator<Item = &'p Point>) -> f64 {
    points.map(|p| p.y).fold(f64::INFINITY, f64::min)
}
