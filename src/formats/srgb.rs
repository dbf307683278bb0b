//! Converts between sRGB, the colours of scans, and linear light, the colours of glTF (IEC 61966-2-1).

/// The linear value, 0–1, of an sRGB byte.
pub fn linear_of_byte(byte: u8) -> f64 {
    linear_of_srgb(f64::from(byte) / 255.0)
}

/// The linear value of an sRGB value, both 0–1.
pub fn linear_of_srgb(c: f64) -> f64 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB byte nearest to a linear value.
pub fn byte_of_linear(linear: f64) -> u8 {
    let c = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    // `as u8` saturates, and makes 0 of NaN.
    (c * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_comes_back_even_through_16_bits() {
        for byte in 0..=255 {
            let stored = (linear_of_byte(byte) * 65535.0).round() / 65535.0;
            assert_eq!(byte_of_linear(stored), byte);
        }
        assert!((linear_of_byte(188) - 0.5028).abs() < 1e-3);
    }
}
