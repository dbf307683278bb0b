//! Connected components of a depth image.

use super::camera::RgbdCamera;
use super::view::JUMP;

/// The connected component of each pixel.
///
/// **Shapes** one entry per pixel, row by row.
pub(super) struct PixelComponents {
    /// `u32::MAX` for none.
    pub(super) of_pixel: Vec<u32>,
    pub(super) count: usize,
}

/// Finds the connected components: neighbouring pixels whose depths differ by less than [`JUMP`].
///
/// **Guarantees** components are numbered in the order of their first pixels.
pub(super) fn pixel_components(camera: &RgbdCamera, depth: &[f32]) -> PixelComponents {
    let (w, h) = (camera.width, camera.height);
    let mut of_pixel = vec![u32::MAX; depth.len()];
    let mut count = 0;
    let mut stack = Vec::new();
    for seed in 0..depth.len() {
        if depth[seed] <= 0.0 || of_pixel[seed] != u32::MAX {
            continue;
        }
        of_pixel[seed] = count;
        stack.push(seed);
        while let Some(i) = stack.pop() {
            let (x, y) = (i % w, i / w);
            let around = [
                (x > 0).then(|| i - 1),
                (x + 1 < w).then(|| i + 1),
                (y > 0).then(|| i - w),
                (y + 1 < h).then(|| i + w),
            ];
            for j in around.into_iter().flatten() {
                if of_pixel[j] == u32::MAX && depth[j] > 0.0 && (depth[j] - depth[i]).abs() < JUMP {
                    of_pixel[j] = count;
                    stack.push(j);
                }
            }
        }
        count += 1;
    }
    PixelComponents { of_pixel, count: count as usize }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_in_depth_parts_what_touches() {
        let camera = RgbdCamera { width: 4, height: 2, fx: 1.0, fy: 1.0, cx: 2.0, cy: 1.0, distortion: [0.0; 5] };
        let found = pixel_components(&camera, &[1.0, 1.01, 1.2, 0.0, 1.0, 1.02, 1.21, 3.0]);
        assert_eq!(found.of_pixel, [0, 0, 1, u32::MAX, 0, 0, 1, 2]);
        assert_eq!(found.count, 3);
    }
}
