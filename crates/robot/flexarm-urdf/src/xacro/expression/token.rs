//! Splits the text of an expression into tokens: names, numbers, strings, signs.
//!
//! Start at [`tokens`]. Not here: their order and nesting ([`super::parse`]).

use super::ExpressionError;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    Name(String),
    Int(i128),
    Float(f64),
    Text(String),
    /// An operator or bracket.
    Sign(&'static str),
}

/// Signs, longest first, so that `**` is not read as two `*`.
const SIGNS: [&str; 31] = [
    "**", "//", "<<", ">>", "<=", ">=", "==", "!=", "+", "-", "*", "/", "%", "(", ")", "[", "]", "{", "}", ",", ":",
    ".", "<", ">", "=", "&", "|", "^", "~", "!", ";",
];

pub(super) fn tokens(text: &str) -> Result<Vec<Token>, ExpressionError> {
    let mut found = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        // The first character decides the kind of the token.
        let (token, length) = if first.is_ascii_digit() || (first == '.' && digit_at(rest, 1)) {
            number(rest)?
        } else if first.is_alphabetic() || first == '_' {
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            match (&rest[..end], rest[end..].chars().next()) {
                ("r" | "R", Some('"' | '\'')) => string(rest, end, true)?,
                ("u" | "U", Some('"' | '\'')) => string(rest, end, false)?,
                ("f" | "F" | "b" | "B" | "rb" | "br" | "fr" | "rf", Some('"' | '\'')) => {
                    return Err(ExpressionError::new(format!(
                        "strings with the prefix {:?} are not read",
                        &rest[..end]
                    ))
                    .help("write the text with + and str()"));
                }
                (name, _) => (Token::Name(name.to_owned()), end),
            }
        } else if first == '"' || first == '\'' {
            string(rest, 0, false)?
        } else if let Some(sign) = SIGNS.iter().find(|sign| rest.starts_with(**sign)) {
            (Token::Sign(sign), sign.len())
        } else {
            return Err(ExpressionError::new(format!("the character {first:?} has no meaning in an expression")));
        };
        found.push(token);
        rest = rest[length..].trim_start();
    }
    Ok(found)
}

fn digit_at(text: &str, at: usize) -> bool {
    text.as_bytes().get(at).is_some_and(u8::is_ascii_digit)
}

fn number(text: &str) -> Result<(Token, usize), ExpressionError> {
    let bad = |end: usize| ExpressionError::new(format!("{:?} is not a number that can be used", &text[..end]));
    let radix = match text.get(..2).map(str::to_ascii_lowercase).as_deref() {
        Some("0x") => Some(16),
        Some("0o") => Some(8),
        Some("0b") => Some(2),
        _ => None,
    };
    if let Some(radix) = radix {
        let end = text[2..].find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).map_or(text.len(), |i| i + 2);
        let value = i128::from_str_radix(&text[2..end].replace('_', ""), radix).map_err(|_| bad(end))?;
        return Ok((Token::Int(value), end));
    }
    // Decimal: digits, point and digits, exponent; `_` may separate digits.
    let bytes = text.as_bytes();
    let run = |mut at: usize| {
        while bytes.get(at).is_some_and(|b| b.is_ascii_digit() || *b == b'_') {
            at += 1;
        }
        at
    };
    let mut end = run(0);
    let mut whole = true;
    if bytes.get(end) == Some(&b'.') {
        (end, whole) = (run(end + 1), false);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let signed = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        if digit_at(text, signed) {
            (end, whole) = (run(signed), false);
        }
    }
    if text[end..].starts_with(|c: char| c.is_alphanumeric() || c == '_') {
        let end = text[end..].find(|c: char| !(c.is_alphanumeric() || c == '_')).map_or(text.len(), |i| i + end);
        return Err(bad(end));
    }
    let digits = text[..end].replace('_', "");
    if whole {
        // Python rejects 012, which could be meant as an octal number.
        if digits.len() > 1 && digits.starts_with('0') && digits.bytes().any(|b| b != b'0') {
            return Err(
                ExpressionError::new(format!("the number {digits} starts with 0")).help("remove the leading zeros")
            );
        }
        return Ok((Token::Int(digits.parse().map_err(|_| bad(end))?), end));
    }
    Ok((Token::Float(digits.parse().map_err(|_| bad(end))?), end))
}

/// Reads a string that starts after `prefix` bytes, with escapes resolved unless it is raw.
fn string(text: &str, prefix: usize, raw: bool) -> Result<(Token, usize), ExpressionError> {
    let body = &text[prefix..];
    let quote = if body.starts_with("'''") || body.starts_with("\"\"\"") { &body[..3] } else { &body[..1] };
    let mut out = String::new();
    let mut at = quote.len();
    while at < body.len() {
        if body[at..].starts_with(quote) {
            return Ok((Token::Text(out), prefix + at + quote.len()));
        }
        let Some(c) = body[at..].chars().next() else { break };
        at += c.len_utf8();
        if c != '\\' {
            out.push(c);
            continue;
        }
        let Some(escaped) = body[at..].chars().next() else { break };
        at += escaped.len_utf8();
        // Unknown escapes stay as written, as in Python.
        match escaped {
            _ if raw => out.extend(['\\', escaped]),
            'n' => out.push('\n'),
            't' => out.push('\t'),
            'r' => out.push('\r'),
            '\\' | '\'' | '"' => out.push(escaped),
            other => out.extend(['\\', other]),
        }
    }
    Err(ExpressionError::new("a string has no closing quote").help(format!("close it with {quote}")))
}
