//! The truncated signed distance to the surface in sparse blocks of voxels.

use nalgebra::{Point3, Vector3};

/// Voxels along a block's side.
pub(super) const SIDE: usize = 8;
/// Voxels in a block.
pub(super) const VOXELS: usize = SIDE * SIDE * SIDE;
/// The integer that stands for a distance of one truncation in a voxel's 16 bits: steps of 0.6 µm at 20 mm.
pub(super) const FULL: f32 = 32_000.0;
/// Weights are stored in units of 1/64: a grazing view counts, and 1 000 views fit in 16 bits.
pub(super) const WEIGHT_UNIT: f32 = 64.0;

/// The value of one voxel, packed into four bytes: a march along a ray touches little memory, and eight voxels are read
/// and written at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Voxel(pub(super) u32);

impl Voxel {
    #[cfg(test)]
    pub(super) fn new(distance: i16, weight: u16) -> Self {
        Self(u32::from(weight) << 16 | u32::from(distance as u16))
    }

    /// Signed distance, positive outside, in 1/[`FULL`] of the truncation: the low half.
    pub(super) fn distance(self) -> i16 {
        self.0 as i16
    }

    /// Evidence, in 1/[`WEIGHT_UNIT`] of a view; 0 if unknown: the high half.
    pub(super) fn weight(self) -> u16 {
        (self.0 >> 16) as u16
    }
}

/// 8³ voxels; x runs fastest.
pub(super) struct Block {
    /// Position in blocks.
    pub(super) at: [i32; 3],
    pub(super) voxels: [Voxel; VOXELS],
}

/// The colours of a block, by rows of eight voxels: the means in 1/256 of a grey level, red, green and blue apart, and
/// their evidence in the units of a voxel's.
pub(super) type Tint = [[[u16; SIDE]; 4]; VOXELS / SIDE];

/// Sparse blocks of voxels, found by their position.
///
/// **Frame and units** the model's frame, metres. Voxel (i, j, k) is the point (i, j, k) · `voxel`.
///
/// **Guarantees** blocks are in the order in which they were first touched; nothing depends on the order of the hash
/// table.
pub(super) struct Volume {
    /// Metres between voxels.
    pub(super) voxel: f32,
    /// Truncation in metres.
    pub(super) truncation: f32,
    pub(super) blocks: Vec<Block>,
    /// One per block, or none: the model for tracking needs no colours.
    pub(super) tints: Vec<Tint>,
    /// Per block the last integration that touched it.
    pub(super) stamps: Vec<u32>,
    is_colored: bool,
    table: BlockTable,
    /// The current integration.
    pub(super) stamp: u32,
}

/// No block.
pub(super) const NONE: u32 = u32::MAX;

/// A hash table with open addressing; keys are positions in 21 bits per axis.
struct BlockTable {
    slots: Vec<(u64, u32)>,
    used: usize,
}

fn key_of(at: [i32; 3]) -> u64 {
    at.iter().fold(0, |key, &c| key << 21 | u64::from((c + (1 << 20)) as u32 & 0x1f_ffff))
}

impl BlockTable {
    fn with_room_for(count: usize) -> Self {
        Self { slots: vec![(u64::MAX, NONE); (2 * count).next_power_of_two().max(1024)], used: 0 }
    }

    fn slot(&self, key: u64) -> usize {
        let mask = self.slots.len() - 1;
        // Fibonacci hashing; the high bits are the mixed ones.
        let mut at = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & mask;
        while self.slots[at].0 != key && self.slots[at].1 != NONE {
            at = (at + 1) & mask;
        }
        at
    }

    fn get(&self, key: u64) -> u32 {
        self.slots[self.slot(key)].1
    }

    fn insert(&mut self, key: u64, index: u32) {
        if 2 * (self.used + 1) > self.slots.len() {
            let mut larger = Self::with_room_for(2 * self.slots.len());
            for &(key, index) in self.slots.iter().filter(|s| s.1 != NONE) {
                larger.insert(key, index);
            }
            *self = larger;
        }
        let slot = self.slot(key);
        self.slots[slot] = (key, index);
        self.used += 1;
    }
}

impl Volume {
    /// Without colours.
    pub(super) fn new(voxel: f64, truncation: f64) -> Self {
        Self {
            voxel: voxel as f32,
            truncation: truncation as f32,
            blocks: Vec::new(),
            tints: Vec::new(),
            stamps: Vec::new(),
            is_colored: false,
            table: BlockTable::with_room_for(4_096),
            stamp: 0,
        }
    }

    pub(super) fn colored(voxel: f64, truncation: f64) -> Self {
        Self { is_colored: true, ..Self::new(voxel, truncation) }
    }

    /// Metres along a block's side.
    pub(super) fn block_size(&self) -> f32 {
        self.voxel * SIDE as f32
    }

    /// Index of the block at a position, or [`NONE`].
    pub(super) fn block_at(&self, at: [i32; 3]) -> u32 {
        self.table.get(key_of(at))
    }

    /// Index of the block at a position, which is allocated if missing.
    pub(super) fn block_or_new(&mut self, at: [i32; 3]) -> u32 {
        let key = key_of(at);
        let found = self.table.get(key);
        if found != NONE {
            return found;
        }
        let index = self.blocks.len() as u32;
        self.table.insert(key, index);
        self.blocks.push(Block { at, voxels: [Voxel::default(); VOXELS] });
        self.stamps.push(0);
        if self.is_colored {
            self.tints.push([[[0; SIDE]; 4]; VOXELS / SIDE]);
        }
        index
    }
}

/// Reads voxels and caches the last blocks, because neighbours mostly lie in the same few.
pub(super) struct Reader<'a> {
    volume: &'a Volume,
    /// Indexed by the parity of the position along x, y, z, so that the eight blocks around a corner have different
    /// entries.
    recent: [([i32; 3], u32); 8],
}

/// The largest integer at or below a number; exact for all that fit in 32 bits. (`f32::floor` is a function call on the
/// baseline instruction set.)
pub(super) fn floor(c: f32) -> i32 {
    let cut = c as i32;
    cut - i32::from((cut as f32) > c)
}

/// The nearest integer to a number of less than 22 bits; others become large or negative. (Adding a constant that
/// leaves no bits for the fraction is one instruction and vectorises; `f32::round` is a function call on the baseline
/// instruction set, and `as` saturates.)
#[inline(always)]
pub(super) fn whole(value: f32) -> i32 {
    const NO_FRACTIONS: f32 = 12_582_912.0;
    (value + NO_FRACTIONS).to_bits().wrapping_sub(NO_FRACTIONS.to_bits()) as i32
}

impl<'a> Reader<'a> {
    pub(super) fn new(volume: &'a Volume) -> Self {
        Self { volume, recent: [([i32::MAX; 3], NONE); 8] }
    }

    #[inline(always)]
    fn block(&mut self, at: [i32; 3]) -> Option<&'a Block> {
        let slot = &mut self.recent[(at[0] & 1 | (at[1] & 1) << 1 | (at[2] & 1) << 2) as usize];
        if (slot.0[0] ^ at[0]) | (slot.0[1] ^ at[1]) | (slot.0[2] ^ at[2]) != 0 {
            *slot = (at, self.volume.block_at(at));
        }
        self.volume.blocks.get(slot.1 as usize)
    }

    /// The value of a voxel; `None` without a block.
    pub(super) fn find(&mut self, voxel: [i32; 3]) -> Option<Voxel> {
        let block = self.block(voxel.map(|c| c >> 3))?;
        Some(block.voxels[index_of(voxel)])
    }

    /// Trilinear distance, in truncations, at a point in voxels; `None` if one of the eight voxels is unknown.
    pub(super) fn sample(&mut self, p: &Point3<f32>) -> Option<f32> {
        let low = [floor(p.x), floor(p.y), floor(p.z)];
        // The axes along which the eight voxels reach into the next block, as bits of x, y, z like those of the
        // corners.
        let across = (0..3).fold(0, |bits, axis| bits | usize::from(low[axis] & 7 == 7) << axis);
        let first = low.map(|c| c >> 3);
        let eight: [Voxel; 8] = if across == 0 {
            let (block, at) = (self.block(first)?, index_of(low));
            std::array::from_fn(|k| {
                block.voxels[(at + (k & 1) + (k >> 1 & 1) * SIDE + (k >> 2) * SIDE * SIDE) % VOXELS]
            })
        } else {
            let mut blocks: [Option<&Block>; 8] = [None; 8];
            for (k, block) in blocks.iter_mut().enumerate().filter(|(k, _)| k & !across == 0) {
                let [x, y, z] = [0, 1, 2].map(|axis| (k >> axis & 1) as i32);
                *block = Some(self.block([first[0] + x, first[1] + y, first[2] + z])?);
            }
            let at = |k: usize| index_of([0, 1, 2].map(|axis| low[axis] + (k >> axis & 1) as i32));
            std::array::from_fn(|k| blocks[k & across].map_or(Voxel::default(), |block| block.voxels[at(k)]))
        };
        if eight.iter().any(|v| v.weight() == 0) {
            return None;
        }
        let corners = eight.map(|v| f32::from(v.distance()));
        let [x, y, z] = [0, 1, 2].map(|k| p[k] - low[k] as f32);
        let along = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let [a, b, c, d] = [0, 2, 4, 6].map(|k| along(corners[k], corners[k + 1], x));
        Some(along(along(a, b, y), along(c, d, y), z) / FULL)
    }

    /// Outward unit normal at a surface point given in voxels: central differences over one voxel, one-sided where the
    /// other side is unknown.
    pub(super) fn normal(&mut self, p: &Point3<f32>) -> Option<Vector3<f32>> {
        let mut gradient = Vector3::zeros();
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = 1.0;
            gradient[axis] = match (self.sample(&(p + step)), self.sample(&(p - step))) {
                (Some(ahead), Some(behind)) => ahead - behind,
                (Some(ahead), None) => 2.0 * (ahead - self.sample(p)?),
                (None, Some(behind)) => 2.0 * (self.sample(p)? - behind),
                (None, None) => return None,
            };
        }
        gradient.try_normalize(1e-9)
    }
}

/// The index of a voxel in its block.
fn index_of(voxel: [i32; 3]) -> usize {
    let [x, y, z] = voxel.map(|c| (c & 7) as usize);
    x + SIDE * (y + SIDE * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_where_they_were_made_and_nowhere_else() {
        let mut volume = Volume::new(0.004, 0.02);
        let places: Vec<[i32; 3]> = (0..40_000).map(|i: i32| [i % 37 - 18, i / 37 % 41 - 20, i / 1517 - 13]).collect();
        for (i, &at) in places.iter().enumerate() {
            assert_eq!(volume.block_or_new(at), i as u32);
        }
        assert!(places.iter().enumerate().all(|(i, &at)| volume.block_at(at) == i as u32));
        assert_eq!(volume.block_at([19, 0, 0]), NONE);
    }

    #[test]
    fn between_voxels_the_distance_is_linear_across_blocks_too() {
        let mut volume = Volume::new(0.01, 0.1);
        for x in -1..=1 {
            let b = volume.block_or_new([x, 0, 0]) as usize;
            let block = &mut volume.blocks[b];
            for i in 0..VOXELS {
                let at = (x * 8 + (i % 8) as i32) as f32;
                block.voxels[i] = Voxel::new((at * 0.01 * FULL) as i16, 64);
            }
        }
        let mut reader = Reader::new(&volume);
        for x in [-7.6f32, -0.25, 0.0, 7.5, 7.99, 12.25] {
            let value = reader.sample(&Point3::new(x, 3.5, 3.5)).unwrap();
            assert!((value - 0.01 * x).abs() < 1e-3, "{x}: {value}");
        }
        assert!(reader.sample(&Point3::new(-8.5, 3.0, 3.0)).is_none());
        let normal = reader.normal(&Point3::new(2.0, 3.5, 3.5)).unwrap();
        assert!((normal - Vector3::x()).norm() < 1e-3);
    }
}
