//! Numbers and names as text of a reduced-link file.

use std::fmt::Write;

/// `{:?}` prints the shortest text that parses back to the same f64, always with a point or an
/// exponent.
pub(super) fn numbers<'a>(values: impl Iterator<Item = &'a f64>) -> String {
    let printed: Vec<_> = values.map(|x| format!("{x:?}")).collect();
    format!("[{}]", printed.join(", "))
}

/// Quotes a text as a TOML basic string.
pub(super) fn quoted(text: &str) -> String {
    let mut result = String::from('"');
    for c in text.chars() {
        match c {
            '"' => result.push_str("\\\""),
            '\\' => result.push_str("\\\\"),
            c if c.is_control() => {
                // Writing to a String cannot fail.
                let _ = write!(result, "\\u{:04X}", u32::from(c));
            }
            c => result.push(c),
        }
    }
    result.push('"');
    result
}
