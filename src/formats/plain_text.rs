//! What programs put around plain text: byte-order marks, other encodings, other number formats.

use super::error::{Format, FormatError};

/// The text behind a byte-order mark of UTF-8, which Windows programs write in front of it.
///
/// **Errors** [`FormatError::Utf16`], which every number of the text would hide.
pub fn plain_text(format: Format, bytes: &[u8]) -> Result<&[u8], FormatError> {
    if is_utf16(bytes) { Err(FormatError::Utf16 { format }) } else { Ok(without_mark(bytes)) }
}

/// The bytes behind a byte-order mark of UTF-8.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes)
}

/// Whether a text begins as UTF-16 does: with its byte-order mark, or with two letters that have a zero byte each.
fn is_utf16(bytes: &[u8]) -> bool {
    let is_letter = |b: &u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
    match bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => true,
        [a, 0, b, 0, ..] | [0, a, 0, b, ..] => is_letter(a) && is_letter(b),
        _ => false,
    }
}

/// A number of a text format. C libraries print NaN in many ways: `-nan(ind)`, `nan(snan)`, `1.#QNAN`, `-1.#IND`, `1.#INF`.
pub(super) fn parsed_number(token: &str) -> Option<f64> {
    token.parse().ok().or_else(|| {
        let digits = token.trim_start_matches(['-', '+']);
        let is_nan = digits.get(..4).is_some_and(|head| head.eq_ignore_ascii_case("nan("));
        (is_nan || digits.starts_with("1.#")).then_some(f64::NAN)
    })
}

/// What is expected instead of a word that is no number.
pub(super) fn expected_number(token: &str) -> &'static str {
    let has_comma = token.contains(',') && token.trim_end_matches(',').replacen(',', ".", 1).parse::<f64>().is_ok();
    if has_comma { "a number with a decimal point, not a comma" } else { "a number" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_dropped_and_utf_16_is_named() {
        assert_eq!(plain_text(Format::Obj, b"\xef\xbb\xbfv 0").unwrap(), b"v 0");
        assert_eq!(plain_text(Format::Obj, b"v 0").unwrap(), b"v 0");
        for bytes in [b"\xff\xfev\0".as_slice(), b"\xfe\xff\0v", b"v\0 \0", b"\0v\0 "] {
            let error = plain_text(Format::Obj, bytes).unwrap_err();
            assert_eq!(error.to_string(), "the OBJ file is text in UTF-16, not in UTF-8");
            assert!(error.hint().unwrap().contains("UTF-8"));
        }
        assert!(plain_text(Format::Stl, &[0, 0, 0, 0]).is_ok());
    }

    #[test]
    fn numbers_of_c_libraries_and_decimal_commas() {
        for nan in ["nan", "-nan", "-nan(ind)", "NaN(snan)", "1.#QNAN", "-1.#IND"] {
            assert!(parsed_number(nan).is_some_and(f64::is_nan), "{nan}");
        }
        assert_eq!(parsed_number("-.5"), Some(-0.5));
        assert_eq!(parsed_number("nanny"), None);
        assert_eq!(expected_number("0,5"), "a number with a decimal point, not a comma");
        assert_eq!(expected_number("x"), "a number");
    }
}
