//! The curves of an animation: keys and how to interpolate between them.

use super::accessor::rows;
use crate::formats::error::{Format, FormatError};
use gltf::animation::{Interpolation, Sampler};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Values at increasing times.
///
/// **Shapes** `times` K, `values` K; `tangents` K pairs (in, out) for a cubic spline, else none.
pub(super) struct Curve<const N: usize> {
    times: Vec<f64>,
    values: Vec<[f64; N]>,
    tangents: Vec<[[f64; N]; 2]>,
    is_stepped: bool,
}

impl<const N: usize> Curve<N> {
    /// **Errors** for numbers that are not finite, times that decrease, and another number of values than of times.
    pub fn read(sampler: &Sampler, buffers: &[Vec<u8>], what: &str) -> Result<Self, FormatError> {
        let bad = |expected: String, found: String| FormatError::Element {
            format: Format::Gltf,
            element: "animation sampler".into(),
            index: sampler.index(),
            expected,
            found,
        };
        let times: Vec<f64> = rows::<1>(&sampler.input(), buffers, "times")?.into_iter().map(|[t]| t).collect();
        let values = rows::<N>(&sampler.output(), buffers, what)?;
        let rises = |pair: &[f64]| pair[0].is_finite() && pair[0] <= pair[1];
        if let Some(k) = times.windows(2).position(|pair| !rises(pair)).or(times.iter().position(|t| !t.is_finite())) {
            return Err(bad("times that increase".into(), format!("another order at key {k}")));
        }
        if let Some(k) = values.iter().position(|value| !value.iter().all(|x| x.is_finite())) {
            return Err(bad(format!("finite {what}"), format!("{:?} at row {k}", values[k])));
        }
        let is_cubic = sampler.interpolation() == Interpolation::CubicSpline;
        let expected = times.len() * if is_cubic { 3 } else { 1 };
        if times.is_empty() || values.len() != expected {
            return Err(bad(format!("{} {what} for {} times", expected.max(1), times.len()), values.len().to_string()));
        }
        let is_stepped = sampler.interpolation() == Interpolation::Step;
        if !is_cubic {
            return Ok(Self { times, values, tangents: Vec::new(), is_stepped });
        }
        let triples = values.as_chunks::<3>().0;
        let tangents = triples.iter().map(|&[before, _, after]| [before, after]).collect();
        Ok(Self { times, values: triples.iter().map(|&[_, value, _]| value).collect(), tangents, is_stepped })
    }

    pub fn times(&self) -> &[f64] {
        &self.times
    }

    pub fn is_constant(&self) -> bool {
        let first = self.values[0];
        self.values.iter().all(|value| value.iter().zip(first).all(|(a, b)| (a - b).abs() < 1e-6))
    }

    /// The key before a time, the share of the way to the next key, and the time between the two.
    fn place(&self, time: f64) -> (usize, f64, f64) {
        let after = self.times.partition_point(|&t| t <= time);
        let Some(key) = after.checked_sub(1) else { return (0, 0.0, 0.0) };
        match self.times.get(after) {
            Some(next) => {
                let gap = next - self.times[key];
                (key, if self.is_stepped { 0.0 } else { (time - self.times[key]) / gap }, gap)
            }
            None => (key, 0.0, 0.0),
        }
    }

    /// The cubic spline, not normalised; `None` for another interpolation.
    fn spline(&self, key: usize, share: f64, gap: f64) -> Option<[f64; N]> {
        let [_, out] = self.tangents.get(key)?;
        let (t, t2, t3) = (share, share * share, share * share * share);
        let next = (key + 1).min(self.values.len() - 1);
        let [arrive, _] = self.tangents[next];
        Some(std::array::from_fn(|i| {
            (2.0 * t3 - 3.0 * t2 + 1.0) * self.values[key][i]
                + gap * (t3 - 2.0 * t2 + t) * out[i]
                + (3.0 * t2 - 2.0 * t3) * self.values[next][i]
                + gap * (t3 - t2) * arrive[i]
        }))
    }
}

/// Evaluates a curve.
pub(super) trait Interpolated<const N: usize> {
    /// The value at a time; before the first key and after the last it is theirs.
    fn at(&self, time: f64) -> [f64; N];
}

impl Interpolated<3> for Curve<3> {
    fn at(&self, time: f64) -> [f64; 3] {
        let (key, share, gap) = self.place(time);
        self.spline(key, share, gap).unwrap_or_else(|| match self.values.get(key + 1) {
            Some(next) if share > 0.0 => Vector3::from(self.values[key]).lerp(&Vector3::from(*next), share).into(),
            _ => self.values[key],
        })
    }
}

impl Interpolated<4> for Curve<4> {
    /// A quaternion of unit length.
    fn at(&self, time: f64) -> [f64; 4] {
        let (key, share, gap) = self.place(time);
        // A quaternion of zeros is no rotation.
        let unit = |q: [f64; 4]| UnitQuaternion::try_new(Quaternion::from(q), 1e-9).unwrap_or_default();
        let here = unit(self.values[key]);
        let rotation = match (self.spline(key, share, gap), self.values.get(key + 1)) {
            (Some(value), _) => unit(value),
            (None, Some(next)) if share > 0.0 => here.try_slerp(&unit(*next), share, 1e-9).unwrap_or(here),
            _ => here,
        };
        rotation.into_inner().coords.into()
    }
}
