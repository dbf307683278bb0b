//! Names that become file names.

/// Bytes that a file name may have on every system in use, with room for an ending.
const LONGEST_NAME: usize = 64;

/// Whether files can have the name on every system in use: letters, digits and the `others`, first a letter, a digit or `_`.
pub(in crate::session) fn is_file_name(name: &str, others: &[char]) -> bool {
    let plain = |c: char| c.is_alphanumeric() || others.contains(&c);
    let begins = name.chars().next().is_some_and(|c| c.is_alphanumeric() || c == '_');
    begins && name.len() <= LONGEST_NAME && name.chars().all(plain) && !is_device(name)
}

/// Whether Windows means a device by the name, whatever its extension: CON, PRN, AUX, NUL, COM0 … COM9, LPT0 … LPT9.
fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().to_lowercase();
    let numbered = ["com", "lpt"].iter().filter_map(|port| stem.strip_prefix(port));
    ["con", "prn", "aux", "nul"].contains(&stem.as_str())
        || numbered.into_iter().any(|rest| matches!(rest.as_bytes(), [b'0'..=b'9']))
}

/// Whether two names are one where upper and lower case are not told apart.
pub(in crate::session) fn is_same_file_name(one: &str, other: &str) -> bool {
    one.to_lowercase() == other.to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_long_names_and_signs_are_no_file_names() {
        for good in ["tshirt", "T-Shirt_2", "console", "com", "com10", "nuller", "jäckchen", "_"] {
            assert!(is_file_name(good, &['-', '_']), "{good}");
        }
        let long = "a".repeat(65);
        for bad in ["", "-C", "a/b", "a.b", "CON", "nul", "Com1", "lpt9", "prn", "aux", long.as_str()] {
            assert!(!is_file_name(bad, &['-', '_']), "{bad}");
        }
        assert!(is_file_name("anna.2", &['.']) && !is_file_name("nul.txt", &['.']) && !is_file_name(".x", &['.']));
        assert!(is_same_file_name("tshirt", "TShirt") && !is_same_file_name("tshirt", "tshirts"));
    }
}
