//! The studio: a soft key light with its shadow, a cooler fill from the other side, light from the sky and the
//! floor, and what a matt surface makes of them.

use super::occlusion::radical_inverse;
use super::raster::{Grid, NOTHING, Visibility};
use super::surface::{Surface, Triple};

/// Where the key light stands, as seen by the camera: upper left, before the subject. It goes with the camera, so
/// that front, side and back are lit alike and can be compared.
const KEY: [f32; 3] = [-0.58, 0.62, 0.53];
/// Where the fill light stands.
const FILL: [f32; 3] = [0.80, 0.10, 0.59];
/// Light of the key: a little warm. With the others a white surface that faces the camera comes to 0.85.
const KEY_LIGHT: [f32; 3] = [1.02, 0.98, 0.92];
/// Light of the fill: a little cool.
const FILL_LIGHT: [f32; 3] = [0.13, 0.15, 0.18];
/// Light from above and from the floor.
const SKY_LIGHT: [f32; 3] = [0.36, 0.37, 0.39];
/// See [`SKY_LIGHT`].
const FLOOR_LIGHT: [f32; 3] = [0.19, 0.18, 0.17];
/// How far light reaches round the terminator, as a share of the half sphere: a big lamp, not a spark.
const WRAP: f32 = 0.12;
/// Light lost at grazing angles: it draws the outline of an arm before a chest of the same colour.
const EDGE_LOSS: f32 = 0.34;
/// Strength and exponent of the highlight: cloth and skin, hardly any.
const SHEEN: [f32; 2] = [0.045, 18.0];

/// The back of a surface keeps this share of its colour,
const BACK_KEEPS: f32 = 0.22;
/// and takes on this one: a hole or a cloth turned inside out is told at once from a shadow.
const BACK_TINT: [f32; 3] = [0.05, 0.03, 0.085];

/// A back shows this share of its tint even where no light comes: inside a collar it was black.
const BACK_GLOW: f32 = 0.5;

/// Samples across the map of the key light's shadow: 2 mm on a person.
const MAP_SIZE: usize = 1024;
/// Metres over which the edge of a shadow fades.
const PENUMBRA: f32 = 0.016;
/// Metres between a surface and what shades it at which the shadow is at its weakest, and what is left of it there:
/// the shadow of a hand on the thigh looked like a hole.
const FADED: f32 = 0.35;
/// See [`FADED`].
const FAR_SHADOW: f32 = 0.15;
/// Metres by which a point is lifted off its surface before it is looked up: noise of a scan casts no shadow.
const LIFT: f32 = 0.007;

/// Key light, shadow map and taps, prepared for one scene and one camera.
pub(super) struct Lighting {
    key: Triple,
    fill: Triple,
    /// World's up as the camera sees it.
    up: Triple,
    /// Picture's frame to the lamp's: its rows are right, up, toward the lamp.
    lamp_from_view: [Triple; 3],
    lamp_middle: Triple,
    map: Visibility,
    /// Where to look into the map, in metres, for each sample of a pixel.
    taps: Vec<Vec<[f32; 2]>>,
}

impl Lighting {
    /// Draws the shadow map of `surface`; `up` is the world's, in the frame of the picture.
    pub(super) fn prepare(surface: &Surface, up: Triple, samples: usize, taps_each: usize) -> Self {
        let key = Triple::from(KEY).normalize();
        let right = Triple::y().cross(&key).normalize();
        let lamp_from_view = [right, key.cross(&right), key];
        let (low, high) = surface
            .positions
            .iter()
            .fold((Triple::repeat(f32::MAX), Triple::repeat(f32::MIN)), |(low, high), p| (low.inf(p), high.sup(p)));
        let lamp_middle = if surface.positions.is_empty() { Triple::zeros() } else { (low + high) * 0.5 };
        let seen_by_lamp: Vec<Triple> = surface
            .positions
            .iter()
            .map(|p| Triple::from(lamp_from_view.map(|axis| axis.dot(&(p - lamp_middle)))))
            .collect();
        let reach = seen_by_lamp.iter().fold(1e-6_f32, |reach, p| reach.max(p.x.abs()).max(p.y.abs()));
        let grid = Grid { columns: MAP_SIZE, rows: MAP_SIZE, step: 2.05 * reach / MAP_SIZE as f32 };
        let count = samples * taps_each;
        let mut taps = vec![Vec::with_capacity(taps_each); samples];
        for i in 0..count {
            let (radius, turn) = (PENUMBRA * radical_inverse(i as u32).sqrt(), i as f32 * 2.399_963);
            taps[i % samples].push([radius * turn.cos(), radius * turn.sin()]);
        }
        Self {
            key,
            fill: Triple::from(FILL).normalize(),
            up,
            lamp_from_view,
            lamp_middle,
            map: Visibility::draw(&seen_by_lamp, &surface.faces, grid),
            taps,
        }
    }

    /// Share of the key light that reaches a point, 1 in the open.
    pub(super) fn key_visible(&self, point: &Triple, normal: &Triple, sample: usize) -> f32 {
        let lifted = point + (normal + self.key) * (0.5 * LIFT) - self.lamp_middle;
        let [x, y, z] = self.lamp_from_view.map(|axis| axis.dot(&lifted));
        let taps = &self.taps[sample];
        let taken = taps.iter().map(|[dx, dy]| match self.map.under(x + dx, y + dy) {
            Some(hit) if hit.face != NOTHING && hit.nearness > z + 0.5 * LIFT => {
                1.0 - (1.0 - FAR_SHADOW) * ((hit.nearness - z) / FADED).min(1.0)
            }
            _ => 0.0,
        });
        1.0 - taken.sum::<f32>() / taps.len() as f32
    }

    /// Light sent to the camera. `normal` looks to the seen side, `is_back` says whether that is the inside.
    pub(super) fn reflected(
        &self,
        albedo: &Triple,
        normal: &Triple,
        is_back: bool,
        openness: f32,
        key_visible: f32,
    ) -> Triple {
        let albedo = if is_back { albedo * BACK_KEEPS + Triple::from(BACK_TINT) } else { *albedo };
        let wrapped = |light: &Triple| ((normal.dot(light) + WRAP) / (1.0 + WRAP)).max(0.0);
        let sky = 0.5 + 0.5 * normal.dot(&self.up);
        let around = Triple::from(SKY_LIGHT) * sky + Triple::from(FLOOR_LIGHT) * (1.0 - sky);
        let key = wrapped(&self.key) * key_visible;
        let light = around * openness
            + Triple::from(KEY_LIGHT) * (key * (0.6 + 0.4 * openness))
            + Triple::from(FILL_LIGHT) * (wrapped(&self.fill) * openness);
        let halfway = (self.key + Triple::z()).normalize();
        let sheen = SHEEN[0] * normal.dot(&halfway).max(0.0).powf(SHEEN[1]) * key_visible;
        let edge = 1.0 - EDGE_LOSS * (1.0 - normal.z.clamp(0.0, 1.0)).powi(3);
        let own = if is_back { Triple::from(BACK_TINT) * BACK_GLOW } else { Triple::repeat(sheen) };
        (albedo.component_mul(&light) + own) * edge
    }
}
