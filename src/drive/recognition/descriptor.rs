//! The pose descriptor: angles between segments that join landmarks.
//!
//! **Source** Lifkooee 2019, §3.2. Angles do not change when the person moves, turns or is of another size. The paper counts
//! P(16,16)/2 candidates; a pair of segments at a marker gives 16 · 15 · 14 / 2 = 1680.

use crate::drive::landmark::{DESCRIBED, Landmark, Places};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Segments shorter than this have no direction, in metres: landmarks are accurate to millimetres.
const SHORTEST: f64 = 1e-6;

/// The angle at a landmark between the segments to two others.
///
/// `from` comes before `to` in [`Landmark::ALL`], so that equal angles are equal values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Angle {
    /// Where the segments meet.
    pub marker: Landmark,
    /// The end of one segment.
    pub from: Landmark,
    /// The end of the other.
    pub to: Landmark,
}

impl Angle {
    /// The angle at `marker`, with the ends in order.
    pub fn new(marker: Landmark, from: Landmark, to: Landmark) -> Self {
        let (from, to) = if to.index() < from.index() { (to, from) } else { (from, to) };
        Self { marker, from, to }
    }

    /// All angles of the first [`DESCRIBED`] landmarks: 1680, ordered by marker, then by ends.
    pub fn all() -> Vec<Self> {
        let described = &Landmark::ALL[..DESCRIBED];
        let mut angles = Vec::with_capacity(DESCRIBED * (DESCRIBED - 1) * (DESCRIBED - 2) / 2);
        for &marker in described {
            for (k, &from) in described.iter().enumerate() {
                let ends = described[k + 1..].iter().filter(|&&to| from != marker && to != marker);
                angles.extend(ends.map(|&to| Self { marker, from, to }));
            }
        }
        angles
    }

    /// The angle in radians, from 0 to π; `None` if a landmark is lost or two of them are at the same place.
    pub fn of(&self, places: &Places) -> Option<f64> {
        let at = |landmark: Landmark| places[landmark.index()];
        let marker = at(self.marker)?;
        let (a, b) = (at(self.from)? - marker, at(self.to)? - marker);
        let lengths = [a.norm(), b.norm()];
        let are_defined = lengths.iter().all(|length| length.is_finite() && *length > SHORTEST);
        are_defined.then(|| (a.dot(&b) / (lengths[0] * lengths[1])).clamp(-1.0, 1.0).acos())
    }

    /// The angle of the other side; itself if it is symmetric.
    pub fn mirrored(&self) -> Self {
        Self::new(self.marker.mirrored(), self.from.mirrored(), self.to.mirrored())
    }
}

/// The angles of a frame.
///
/// **Shapes** one per angle, in radians; `None` where landmarks are lost.
pub fn descriptor(angles: &[Angle], places: &Places) -> Vec<Option<f64>> {
    angles.iter().map(|angle| angle.of(places)).collect()
}

/// The angles of a frame, all of which must be defined; otherwise the position of the first that is not.
///
/// **Shapes** one per angle, in radians.
pub fn complete_descriptor(angles: &[Angle], places: &Places) -> Result<Vec<f64>, usize> {
    angles.iter().enumerate().map(|(k, angle)| angle.of(places).ok_or(k)).collect()
}

/// The mirror image of a frame: reflected in the plane x = 0, with the sides exchanged.
///
/// **Guarantees** an angle of the mirror image is the mirrored angle of the frame.
pub fn mirrored(places: &Places) -> Places {
    let mut image = *places;
    for (landmark, place) in Landmark::ALL.into_iter().zip(places) {
        image[landmark.mirrored().index()] = place.map(|mut at| {
            at.x = -at.x;
            at
        });
    }
    image
}

/// Descriptors on the plane of their two greatest principal components, to draw how classes lie.
///
/// **Shapes** one per descriptor, in the units of the descriptors, relative to their mean.
///
/// **Requires** descriptors of equal length.
///
/// **Guarantees** of each component the entry of greatest size is positive, so that pictures do not flip.
///
/// **Source** Lifkooee 2019, Fig. 12.
pub fn principal_plane(descriptors: &[Vec<f64>]) -> Vec<[f64; 2]> {
    let Some(size) = descriptors.first().map(Vec::len).filter(|&size| size > 0) else {
        return vec![[0.0; 2]; descriptors.len()];
    };
    let count = descriptors.len() as f64;
    let rows = DMatrix::from_fn(descriptors.len(), size, |i, j| descriptors[i][j]);
    let mean = DVector::from_fn(size, |j, _| rows.column(j).sum() / count);
    let centered = DMatrix::from_fn(descriptors.len(), size, |i, j| rows[(i, j)] - mean[j]);
    let eigen = SymmetricEigen::new(centered.transpose() * &centered / count);
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]).then(a.cmp(&b)));
    let coordinate = |&k: &usize| {
        let axis = eigen.eigenvectors.column(k);
        let sign = if axis[axis.iamax()] < 0.0 { -1.0 } else { 1.0 };
        &centered * (axis * sign)
    };
    let axes: Vec<DVector<f64>> = order.iter().take(2).map(coordinate).collect();
    (0..descriptors.len()).map(|i| [axes[0][i], axes.get(1).map_or(0.0, |axis| axis[i])]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::recognition::synthetic::{frames, moved};

    #[test]
    fn there_are_1680_angles_and_mirroring_permutes_them() {
        let all = Angle::all();
        assert_eq!(all.len(), 1680);
        let distinct: std::collections::BTreeSet<_> = all.iter().collect();
        assert_eq!(distinct.len(), 1680);
        let images: std::collections::BTreeSet<_> = all.iter().map(Angle::mirrored).collect();
        assert!(images.iter().eq(distinct.iter().copied()));
        assert!(all.iter().all(|angle| angle.mirrored().mirrored() == *angle));
        assert!(all.iter().any(|angle| angle.mirrored() == *angle));
    }
    #[test]
    fn motion_and_size_leave_the_descriptor_unchanged() {
        let all = Angle::all();
        for (seed, places) in frames(4, 3, 0.3, 1).0.iter().enumerate() {
            let (a, b) = (complete_descriptor(&all, places).unwrap(), moved(places, seed as u64));
            let b = complete_descriptor(&all, &b).unwrap();
            // acos is ill-conditioned at 0 and π.
            assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6));
        }
    }
    #[test]
    fn an_angle_of_the_mirror_image_is_the_mirrored_angle() {
        let places = frames(1, 1, 0.3, 2).0[0];
        let image = mirrored(&places);
        assert_eq!(mirrored(&image), places);
        for angle in Angle::all() {
            let difference = angle.of(&image).unwrap() - angle.mirrored().of(&places).unwrap();
            assert!(difference.abs() < 1e-6);
        }
    }
    #[test]
    fn a_lost_landmark_loses_its_angles_only() {
        let mut places = frames(1, 1, 0.3, 3).0[0];
        places[Landmark::Head.index()] = None;
        let all = Angle::all();
        for (angle, value) in all.iter().zip(descriptor(&all, &places)) {
            let involved = [angle.marker, angle.from, angle.to].contains(&Landmark::Head);
            assert_eq!(value.is_none(), involved);
        }
        assert!(complete_descriptor(&all, &places).is_err());
        places[Landmark::Neck.index()] = places[Landmark::Chest.index()];
        assert!(Angle::new(Landmark::Neck, Landmark::Chest, Landmark::Pelvis).of(&places).is_none());
    }
    #[test]
    fn the_principal_plane_keeps_distances_of_flat_data() {
        let flat: Vec<Vec<f64>> = (0..20)
            .map(|k| {
                let (u, v) = ((k * 7 % 20) as f64, (k * 3 % 11) as f64 * 0.3);
                vec![0.6 * u - 0.8 * v + 1.0, 0.8 * u + 0.6 * v, 2.0]
            })
            .collect();
        let plane = principal_plane(&flat);
        assert_eq!(plane, principal_plane(&flat));
        for (a, p) in flat.iter().zip(&plane) {
            for (b, q) in flat.iter().zip(&plane) {
                let given = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                assert!((given - (p[0] - q[0]).hypot(p[1] - q[1])).abs() < 1e-9);
            }
        }
        assert!(principal_plane(&[]).is_empty());
        assert_eq!(principal_plane(&[vec![1.0], vec![3.0]])[1][1], 0.0);
    }
}
