//! Shading: a soft key light with shadows, a cooler fill light from the other side, light from sky and floor, on a matt
//! surface.

use super::raster::{Grid, NOTHING, Visibility};
use super::surface::{RenderSurface, Triple};

/// Direction to the key light in the frame of the picture: upper left, in front of the subject. It moves with the
/// camera, so that front, side and back have equal lighting and can be compared.
const KEY: [f32; 3] = [-0.58, 0.62, 0.53];
/// Direction to the fill light in the frame of the picture.
const FILL: [f32; 3] = [0.80, 0.10, 0.59];
/// Colour of the key light, slightly warm. With all lights, a white surface that faces the camera reflects 0.85.
const KEY_LIGHT: [f32; 3] = [1.02, 0.98, 0.92];
/// Colour of the fill light, slightly cool.
const FILL_LIGHT: [f32; 3] = [0.13, 0.15, 0.18];
/// Colour of the light from above.
const SKY_LIGHT: [f32; 3] = [0.36, 0.37, 0.39];
/// Colour of the light from below.
const FLOOR_LIGHT: [f32; 3] = [0.19, 0.18, 0.17];
/// How far the key and fill lights reach past the terminator (wrapped diffuse), as those of a large lamp do.
const WRAP: f32 = 0.12;
/// Light lost at grazing angles: it separates an arm from a chest of the same colour behind it.
const EDGE_LOSS: f32 = 0.34;
/// Strength and exponent of the highlight; cloth and skin have hardly any.
const SHEEN: [f32; 2] = [0.045, 18.0];

/// The back of a surface keeps this fraction of its colour,
const BACK_KEEPS: f32 = 0.22;
/// and adds this tint, so that a hole or an inverted surface is not mistaken for a shadow.
const BACK_TINT: [f32; 3] = [0.05, 0.03, 0.085];

/// A back emits this fraction of its tint: without it the inside of a collar was black.
const BACK_GLOW: f32 = 0.5;

/// Samples along each side of the key light's shadow map: 2 mm on a person.
const MAP_SIZE: usize = 1024;
/// Width in metres over which the edge of a shadow fades.
const PENUMBRA: f32 = 0.016;
/// Distance in metres between occluder and surface at which the shadow is weakest: at full strength, the shadow of a hand
/// on the thigh looked like a hole.
const FADED: f32 = 0.35;
/// Strength of the shadow at that distance.
const FAR_SHADOW: f32 = 0.15;
/// Distance in metres that a point is moved off its surface before the lookup, so that scan noise casts no shadow.
const LIFT: f32 = 0.007;

/// Lights, shadow map and its sample offsets, prepared for one scene and one camera.
pub(super) struct Lighting {
    key: Triple,
    fill: Triple,
    /// The world's up in the frame of the picture.
    up: Triple,
    /// From the picture's frame to the lamp's; the rows are right, up, toward the lamp.
    lamp_from_view: [Triple; 3],
    lamp_middle: Triple,
    map: Visibility,
    /// Offsets into the shadow map in metres, one list per sample of a pixel.
    taps: Vec<Vec<[f32; 2]>>,
}

impl Lighting {
    /// Draws the shadow map of `surface`; `up` is the world's, in the frame of the picture.
    pub(super) fn prepare(surface: &RenderSurface, up: Triple, samples: usize, taps_each: usize) -> Self {
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

    /// Fraction of the key light that reaches a point, 1 where nothing occludes it.
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

    /// Light reflected to the camera. `normal` points to the visible side; `is_back` says whether that is the inside.
    pub(super) fn reflected(&self, albedo: &Triple, normal: &Triple, is_back: bool, key_visible: f32) -> Triple {
        let albedo = if is_back { albedo * BACK_KEEPS + Triple::from(BACK_TINT) } else { *albedo };
        let wrapped = |light: &Triple| ((normal.dot(light) + WRAP) / (1.0 + WRAP)).max(0.0);
        let sky = 0.5 + 0.5 * normal.dot(&self.up);
        let around = Triple::from(SKY_LIGHT) * sky + Triple::from(FLOOR_LIGHT) * (1.0 - sky);
        let key = wrapped(&self.key) * key_visible;
        let light = around + Triple::from(KEY_LIGHT) * key + Triple::from(FILL_LIGHT) * wrapped(&self.fill);
        let halfway = (self.key + Triple::z()).normalize();
        let sheen = SHEEN[0] * normal.dot(&halfway).max(0.0).powf(SHEEN[1]) * key_visible;
        let edge = 1.0 - EDGE_LOSS * (1.0 - normal.z.clamp(0.0, 1.0)).powi(3);
        let own = if is_back { Triple::from(BACK_TINT) * BACK_GLOW } else { Triple::repeat(sheen) };
        (albedo.component_mul(&light) + own) * edge
    }
}

/// The van der Corput sequence in base 2: 0, 1/2, 1/4, 3/4, 1/8 …
fn radical_inverse(i: u32) -> f32 {
    i.reverse_bits() as f32 / 4_294_967_296.0
}
