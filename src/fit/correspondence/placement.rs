//! Where a surface stands.

use super::scan_surface::ScanSurface;
use crate::geometry::{Point, Vec3};

/// The move that puts points, each with its area, where the scan stands: centroid above centroid, lowest point on lowest point.
pub(crate) fn shift_onto<'p>(
    surface: &ScanSurface,
    places: impl Iterator<Item = (&'p Point, &'p f64)> + Clone,
) -> Vec3 {
    let scan = surface.mesh().points();
    let mut shift = area_centroid(scan.iter().zip(surface.areas.iter())) - area_centroid(places.clone());
    shift.y = lowest(scan.iter()) - lowest(places.map(|place| place.0));
    shift
}

/// The mean place of points, each weighed by its area.
pub(crate) fn area_centroid<'p>(places: impl Iterator<Item = (&'p Point, &'p f64)>) -> Vec3 {
    let (sum, total) = places.fold((Vec3::zeros(), 0.0), |(sum, total), (p, a)| (sum + p.coords * *a, total + a));
    sum / f64::max(total, 1e-12)
}

/// The least height.
pub(crate) fn lowest<'p>(points: impl Iterator<Item = &'p Point>) -> f64 {
    points.map(|p| p.y).fold(f64::INFINITY, f64::min)
}
