//! Numbers and quoted text of files, for all readers.
//!
//! Not here: lines and words of matrix files ([`crate::exchange`]) and of decks ([`crate::mesh`]).

/// Parses a real number, also with the exponent letter D or without one, as in `1.5-3` of Fortran.
///
/// NaN and infinity are returned; the caller rejects them.
pub fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    // The sign of an exponent without a letter is the last sign after a digit or a point.
    let bytes = text.as_bytes();
    let digit = |i: usize| bytes[i].is_ascii_digit() || bytes[i] == b'.';
    let exponent = (1..bytes.len()).rev().find(|&i| matches!(bytes[i], b'+' | b'-') && digit(i - 1));
    let letters = |c| if matches!(c, 'd' | 'D') { 'e' } else { c };
    let with_letter: String = match exponent {
        Some(i) => format!("{}e{}", &text[..i], &text[i..]),
        None => text.chars().map(letters).collect(),
    };
    with_letter.parse().ok()
}

/// Parses an unsigned integer: digits with an optional `+`.
pub(crate) fn unsigned(token: &[u8]) -> Option<u64> {
    let token = token.strip_prefix(b"+").unwrap_or(token);
    token.iter().all(u8::is_ascii_digit).then(|| std::str::from_utf8(token).ok()?.parse().ok()).flatten()
}

/// Quotes a piece of a file for messages: on one line, shortened, readable for any bytes.
pub(crate) fn shown(text: impl AsRef<[u8]>) -> String {
    const MAX_SHOWN: usize = 40;
    let bytes = text.as_ref().trim_ascii();
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * MAX_SHOWN + 4)]);
    if text.is_empty() {
        return "nothing".into();
    }
    match text.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{:?}...", &text[..end]),
        None => format!("{text:?}"),
    }
}
