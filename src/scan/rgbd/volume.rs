//! Where the surface is, as a truncated signed distance in sparse blocks of voxels.

use nalgebra::{Point3, Vector3};

/// Voxels along a block's side.
pub(super) const SIDE: usize = 8;
/// Voxels in a block.
pub(super) const VOXELS: usize = SIDE * SIDE * SIDE;
/// What a distance of one truncation is in a voxel's 16 bits: steps of 0.6 µm at 20 mm.
pub(super) const FULL: f32 = 32_000.0;
/// Weights are kept in 1/64: a view at a graze counts, and 1 000 views fit in 16 bits.
pub(super) const WEIGHT_UNIT: f32 = 64.0;

/// 8³ voxels; x runs fastest.
pub(super) struct Block {
    /// Position in blocks.
    pub(super) at: [i32; 3],
    /// Signed distance, positive outside, in 1/[`FULL`] of the truncation.
    pub(super) distance: [i16; VOXELS],
    /// Evidence, in 1/[`WEIGHT_UNIT`] of a view; 0 where nothing is known.
    pub(super) weight: [u16; VOXELS],
    /// Mean colour in 1/256 of a grey level, red, green, blue.
    pub(super) color: [[u16; VOXELS]; 3],
    /// Evidence for the colour, like `weight`.
    pub(super) color_weight: [u16; VOXELS],
    /// The last integration that touched it.
    pub(super) stamp: u32,
}

/// Sparse blocks of voxels, found by their position.
///
/// **Frame and units** the model's frame, metres. Voxel (i, j, k) is the point (i, j, k) · `voxel`.
///
/// **Guarantees** blocks stand in the order in which they were first touched; nothing depends on the hash's order.
pub(super) struct Volume {
    /// Metres between voxels.
    pub(super) voxel: f32,
    /// Truncation in metres.
    pub(super) truncation: f32,
    pub(super) blocks: Vec<Block>,
    table: Table,
    pub(super) stamp: u32,
}

/// No block.
pub(super) const NONE: u32 = u32::MAX;

/// Open addressing: keys are positions in 21 bits an axis.
struct Table {
    slots: Vec<(u64, u32)>,
    used: usize,
}

fn key_of(at: [i32; 3]) -> u64 {
    at.iter().fold(0, |key, &c| key << 21 | u64::from((c + (1 << 20)) as u32 & 0x1f_ffff))
}

impl Table {
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
    pub(super) fn new(voxel: f64, truncation: f64) -> Self {
        Self {
            voxel: voxel as f32,
            truncation: truncation as f32,
            blocks: Vec::new(),
            table: Table::with_room_for(16_384),
            stamp: 0,
        }
    }

    /// Metres along a block's side.
    pub(super) fn block_size(&self) -> f32 {
        self.voxel * SIDE as f32
    }

    /// Index of the block at a position, or [`NONE`].
    pub(super) fn block_at(&self, at: [i32; 3]) -> u32 {
        self.table.get(key_of(at))
    }

    /// Index of the block at a position; made if it is not there.
    pub(super) fn block_or_new(&mut self, at: [i32; 3]) -> u32 {
        let key = key_of(at);
        let found = self.table.get(key);
        if found != NONE {
            return found;
        }
        let index = self.blocks.len() as u32;
        self.table.insert(key, index);
        self.blocks.push(Block {
            at,
            distance: [0; VOXELS],
            weight: [0; VOXELS],
            color: [[0; VOXELS]; 3],
            color_weight: [0; VOXELS],
            stamp: 0,
        });
        index
    }
}

/// Reads voxels; remembers the last block, for neighbours mostly lie in the same one.
pub(super) struct Reader<'a> {
    volume: &'a Volume,
    at: [i32; 3],
    block: u32,
}

impl<'a> Reader<'a> {
    pub(super) fn new(volume: &'a Volume) -> Self {
        Self { volume, at: [i32::MAX; 3], block: NONE }
    }

    /// The block that holds a voxel, and the voxel's index in it.
    pub(super) fn find(&mut self, voxel: [i32; 3]) -> Option<(&'a Block, usize)> {
        let at = voxel.map(|c| c >> 3);
        if at != self.at {
            (self.at, self.block) = (at, self.volume.block_at(at));
        }
        if self.block == NONE {
            return None;
        }
        let [x, y, z] = voxel.map(|c| (c & 7) as usize);
        Some((&self.volume.blocks[self.block as usize], x + SIDE * (y + SIDE * z)))
    }

    /// Signed distance at a voxel in truncations (−1 to 1), where it is known.
    pub(super) fn at(&mut self, voxel: [i32; 3]) -> Option<f32> {
        let (block, i) = self.find(voxel)?;
        (block.weight[i] > 0).then(|| f32::from(block.distance[i]) / FULL)
    }

    /// Trilinear distance, in truncations, at a point in voxels; `None` where one of the eight is unknown.
    pub(super) fn sample(&mut self, p: &Point3<f32>) -> Option<f32> {
        let low = p.coords.map(f32::floor);
        let [x, y, z] = [low.x as i32, low.y as i32, low.z as i32];
        let f = p.coords - low;
        let mut sum = 0.0;
        for k in 0..8 {
            let [dx, dy, dz] = [k & 1, k >> 1 & 1, k >> 2];
            let pick = |d: i32, f: f32| if d == 1 { f } else { 1.0 - f };
            sum += self.at([x + dx, y + dy, z + dz])? * pick(dx, f.x) * pick(dy, f.y) * pick(dz, f.z);
        }
        Some(sum)
    }

    /// Outward unit normal at a point of the surface, in voxels: differences over one voxel to either side, or to one side
    /// where the other is unknown.
    pub(super) fn normal(&mut self, p: &Point3<f32>) -> Option<Vector3<f32>> {
        let here = self.sample(p)?;
        let mut gradient = Vector3::zeros();
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = 1.0;
            gradient[axis] = match (self.sample(&(p + step)), self.sample(&(p - step))) {
                (Some(ahead), Some(behind)) => ahead - behind,
                (Some(ahead), None) => 2.0 * (ahead - here),
                (None, Some(behind)) => 2.0 * (here - behind),
                (None, None) => return None,
            };
        }
        gradient.try_normalize(1e-9)
    }
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
                block.distance[i] = (at * 0.01 * FULL) as i16;
                block.weight[i] = 64;
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
