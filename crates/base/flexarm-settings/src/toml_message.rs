//! Messages of the TOML parser in terms of files instead of Rust types.

/// Returns the message on one line, without type names: `expected struct TcpEntry` means nothing to
/// a user.
#[must_use]
pub fn without_types(message: &str) -> String {
    const TABLE: &str = "expected a table, { key = value, ... }";
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    let message = match message.split_once("expected struct ") {
        Some((before, after)) => {
            let rest = after.trim_start_matches(|letter: char| letter.is_alphanumeric() || letter == '_');
            format!("{before}{TABLE}{rest}")
        }
        None => message,
    };
    message.replace("invalid type: map", "invalid type: table").replace("expected a map", TABLE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_expected_is_said_without_names_of_types() {
        for (found, told) in [
            (
                "invalid type: string \"tip\", expected struct TcpEntry",
                "invalid type: string \"tip\", expected a table, { key = value, ... }",
            ),
            (
                "invalid type: integer `3`, expected struct MoveToml; docs",
                "invalid type: integer `3`, expected a table, { key = value, ... }; docs",
            ),
            ("invalid type: map, expected a string\n", "invalid type: table, expected a string"),
            (
                "invalid type: integer `3`, expected a map",
                "invalid type: integer `3`, expected a table, { key = value, ... }",
            ),
            ("missing field `section`", "missing field `section`"),
        ] {
            assert_eq!(without_types(found), told);
        }
    }
}
