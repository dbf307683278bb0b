//! The compression of a crate file's tables: integers as differences of varying width, and LZ4.

use std::collections::BTreeMap;

/// Integers as OpenUSD packs them: the commonest difference, a width of two bits for each difference (that commonest, 1, 2 or
/// 4 bytes), then the differences of these widths.
pub(super) fn packed_integers(values: &[i32]) -> Vec<u8> {
    if values.is_empty() {
        return Vec::new();
    }
    let mut before = 0i32;
    let differences: Vec<i32> =
        values.iter().map(|&value| value.wrapping_sub(std::mem::replace(&mut before, value))).collect();
    let mut counts: BTreeMap<i32, usize> = BTreeMap::new();
    differences.iter().for_each(|&difference| *counts.entry(difference).or_default() += 1);
    let common = counts.iter().max_by_key(|(_, count)| **count).map_or(0, |(difference, _)| *difference);
    let mut codes = vec![0u8; differences.len().div_ceil(4)];
    let mut widths = Vec::new();
    for (k, &difference) in differences.iter().enumerate() {
        let code = match difference {
            _ if difference == common => 0,
            -128..=127 => 1,
            -32_768..=32_767 => 2,
            _ => 3,
        };
        codes[k / 4] |= code << (2 * (k % 4));
        let bytes = difference.to_le_bytes();
        widths.extend_from_slice(&bytes[..[0, 1, 2, 4][usize::from(code)]]);
    }
    [common.to_le_bytes().to_vec(), codes, widths].concat()
}

/// A block of LZ4 behind a zero, which says that it is the only one.
///
/// **Requires** at most 2 GB.
pub(super) fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut out = vec![0];
    out.extend_from_slice(&lz4_flex::block::compress(bytes));
    out
}
