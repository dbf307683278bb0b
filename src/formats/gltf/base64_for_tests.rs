//! Base64, as data URIs have it.

pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |chunk: &[u8]| -> Vec<u8> {
        let bits = (0..3).fold(0u32, |bits, k| bits << 8 | u32::from(*chunk.get(k).unwrap_or(&0)));
        (0..=chunk.len()).map(|k| DIGITS[(bits >> (18 - 6 * k) & 63) as usize]).collect()
    };
    String::from_utf8(bytes.chunks(3).flat_map(group).collect()).unwrap()
}
