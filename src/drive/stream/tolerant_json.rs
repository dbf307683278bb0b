//! Reads one line of JSON, also with the numbers that JSON does not have.

use serde_json::Value;

/// The value of a line.
///
/// Python writes `NaN` and `Infinity`, which JSON does not know; they, and numbers too large for a float, become `null`.
///
/// **Errors** the parser's, about the line as it is.
pub fn read_json(text: &str) -> Result<Value, serde_json::Error> {
    serde_json::from_str(text).or_else(|error| {
        if error.is_eof() {
            return Err(error);
        }
        serde_json::from_str(&without_infinite_numbers(text)).map_err(|_| error)
    })
}

/// The text with `null` for each number that is not finite, outside of strings.
fn without_infinite_numbers(text: &str) -> String {
    let mut made = String::with_capacity(text.len());
    let mut rest = text;
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.');
    while let Some(c) = rest.chars().next() {
        let length = if c == '"' {
            string_length(rest)
        } else if is_of_word(c) {
            rest.find(|c| !is_of_word(c)).unwrap_or(rest.len())
        } else {
            c.len_utf8()
        };
        let (part, after) = rest.split_at(length);
        let is_infinite = c != '"' && part.parse::<f64>().is_ok_and(|value| !value.is_finite());
        made.push_str(if is_infinite { "null" } else { part });
        rest = after;
    }
    made
}

/// Bytes of the string that the text begins with, quotes included.
fn string_length(text: &str) -> usize {
    let mut is_escaped = false;
    for (at, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' => is_escaped = true,
            b'"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_not_finite_become_null() {
        let read = read_json(r#"{"NaN \"x":[NaN,-Infinity,1e999,-2.5e-3,true],"é":"Infinity"}"#).unwrap();
        assert_eq!(read, serde_json::json!({"NaN \"x": [null, null, null, -2.5e-3, true], "é": "Infinity"}));
    }

    #[test]
    fn errors_are_those_of_the_line() {
        assert!(read_json(r#"{"a":[NaN,"#).unwrap_err().to_string().contains("column"));
        assert!(read_json(r#"{"a":[1,"#).unwrap_err().is_eof());
        assert!(read_json("nein").is_err());
        assert!(read_json(&"[".repeat(100_000)).is_err());
    }
}
