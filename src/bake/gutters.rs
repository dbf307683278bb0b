//! Continues charts beyond their rims, so that neither filtering nor mipmaps mix in a background.

use rayon::prelude::*;

/// Pixels by which charts are continued at full detail; beyond, coarser ones suffice.
const SHARP: usize = 4;

/// Fills the pixels whose fourth value is 0.
///
/// **Shapes** `pixels` `side × side`.
pub(super) fn filled(mut pixels: Vec<[u8; 4]>, side: usize) -> Vec<[u8; 3]> {
    for _ in 0..SHARP {
        pixels = grown(&pixels, side);
    }
    from_coarser(&mut pixels, side);
    pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
}

/// Every empty pixel takes the mean of its neighbours that have a colour.
fn grown(pixels: &[[u8; 4]], side: usize) -> Vec<[u8; 4]> {
    (0..pixels.len())
        .into_par_iter()
        .map(|i| {
            if pixels[i][3] > 0 {
                return pixels[i];
            }
            let (x, y) = (i % side, i / side);
            let around = [
                (x > 0).then(|| i - 1),
                (x + 1 < side).then(|| i + 1),
                (y > 0).then(|| i - side),
                (y + 1 < side).then(|| i + side),
            ];
            mean(around.into_iter().flatten().map(|k| pixels[k]))
        })
        .collect()
}

/// The mean of those that have a colour; empty if none has.
fn mean(pixels: impl Iterator<Item = [u8; 4]>) -> [u8; 4] {
    let (mut sum, mut count) = ([0u32; 3], 0);
    for [r, g, b, known] in pixels.filter(|p| p[3] > 0) {
        debug_assert!(known > 0);
        sum.iter_mut().zip([r, g, b]).for_each(|(sum, c)| *sum += u32::from(c));
        count += 1;
    }
    match count {
        0 => [0; 4],
        _ => {
            let [r, g, b] = sum.map(|s| (s / count) as u8);
            [r, g, b, 1]
        }
    }
}

/// Fills the rest from the picture at half the size, whose pixels are the means of four.
fn from_coarser(pixels: &mut [[u8; 4]], side: usize) {
    if side <= 1 || pixels.iter().all(|p| p[3] > 0) {
        return;
    }
    let half = side.div_ceil(2);
    let at = |x: usize, y: usize| if x < side && y < side { pixels[y * side + x] } else { [0; 4] };
    let mut coarse: Vec<[u8; 4]> = (0..half * half)
        .map(|i| {
            let (x, y) = (2 * (i % half), 2 * (i / half));
            mean([at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)].into_iter())
        })
        .collect();
    from_coarser(&mut coarse, half);
    for (i, pixel) in pixels.iter_mut().enumerate().filter(|(_, p)| p[3] == 0) {
        *pixel = coarse[i / side / 2 * half + i % side / 2];
    }
}
