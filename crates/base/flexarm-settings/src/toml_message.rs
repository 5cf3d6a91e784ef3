//! Messages of the TOML parser in terms of files instead of Rust types.

use crate::spelling::closest;

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
    let message = message.replace("invalid type: map", "invalid type: table").replace("expected a map", TABLE);
    let message = ["f64", "f32"].iter().fold(message, |text, kind| expected_type(&text, kind, "a number"));
    let whole = ["i64", "i32", "u64", "u32", "u16", "u8", "usize"];
    suggested(&whole.iter().fold(message, |text, kind| expected_type(&text, kind, "a whole number")))
}

/// The message with a type of numbers that is expected in words.
fn expected_type(message: &str, kind: &str, words: &str) -> String {
    let expected = format!("expected {kind}");
    match message.split_once(&expected) {
        Some((before, after)) if !after.starts_with(char::is_alphanumeric) => {
            format!("{before}expected {words}{after}")
        }
        _ => message.to_owned(),
    }
}

/// The message about an unknown key or value with the known one that is meant, if one is close.
fn suggested(message: &str) -> String {
    let known = message.split_once(", expected ").filter(|(found, _)| found.starts_with("unknown "));
    let quoted = |text: &str| text.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let meant = known.and_then(|(found, expected)| {
        closest(quoted(found).first()?, quoted(expected).iter().map(String::as_str))
            .map(|meant| (found, meant, expected))
    });
    match meant {
        Some((found, meant, expected)) => format!("{found}, did you mean `{meant}`? expected {expected}"),
        None => message.to_owned(),
    }
}
