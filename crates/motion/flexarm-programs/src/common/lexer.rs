//! Lexer for the three languages with expressions.
//!
//! Start at [`tokens`]; a [`Spelling`] holds what differs between KRL, RAPID and URScript. Not
//! here: G-code, which has words instead of expressions (`gcode/words.rs`), and the grammar
//! (`expressions`).

use std::rc::Rc;

use super::{Result, Span, fail};

/// Lexical rules of a language.
pub(crate) struct Spelling {
    /// Character that starts a comment up to the end of its line.
    pub(crate) comment: char,
    /// Whether a line end terminates a statement.
    pub(crate) lines: bool,
    /// Whether case is ignored; names are then converted to lower case.
    pub(crate) folds_case: bool,
    /// Symbols; longer ones precede their prefixes.
    pub(crate) symbols: &'static [&'static str],
    /// Whether `'...'` are texts as well (hexadecimal and binary numbers in KRL).
    pub(crate) apostrophes: bool,
    /// Whether a quote within a text is written twice.
    pub(crate) doubled_quotes: bool,
}

/// A token.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Token {
    /// Value, and whether it was written without decimal point and exponent.
    Number(f64, bool),
    Name(Rc<str>),
    Text(Rc<str>),
    /// `'HFF'`, without its apostrophes.
    Quoted(Rc<str>),
    Symbol(&'static str),
    Line,
}

/// A token and its place.
#[derive(Debug, Clone)]
pub(crate) struct Lexeme {
    pub(crate) token: Token,
    pub(crate) span: Span,
}

/// Returns the tokens of a text. An invalid character is an error only where a statement uses it,
/// so it is returned as a name.
pub(crate) fn tokens(text: &str, file: usize, spelling: &Spelling) -> Result<Vec<Lexeme>> {
    let mut found: Vec<Lexeme> = Vec::with_capacity(text.len() / 5);
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        // One token, or what stands between two; `push` returns the number of bytes taken.
        let rest = &text[at..];
        let first = rest.chars().next().unwrap_or(' ');
        let mut push = |token, length: usize| {
            found.push(Lexeme { token, span: Span { file, start: at, end: at + length } });
            length
        };
        at += match first {
            '\n' if spelling.lines => push(Token::Line, 1),
            c if c.is_whitespace() || c == '\u{feff}' || c == '\0' || c == '\u{1a}' => c.len_utf8(),
            c if c == spelling.comment => rest.find('\n').unwrap_or(rest.len()),
            '"' => {
                let length = text_length(rest, '"', spelling.doubled_quotes);
                let Some(length) = length else {
                    let end = at + rest.find('\n').unwrap_or(rest.len());
                    return fail(
                        Span { file, start: at, end },
                        "a text begins here and does not end on its line: close it with \"",
                    );
                };
                push(Token::Text(rest[1..length - 1].into()), length)
            }
            '\'' if spelling.apostrophes => {
                let length = text_length(rest, '\'', false);
                let Some(length) = length else {
                    return fail(
                        Span { file, start: at, end: at + 1 },
                        "a quotation begins here and does not end on its line: close it with '",
                    );
                };
                push(Token::Quoted(rest[1..length - 1].into()), length)
            }
            c if c.is_ascii_digit() || (c == '.' && bytes.get(at + 1).is_some_and(u8::is_ascii_digit)) => {
                let (token, length) = number(rest, file, at)?;
                push(token, length)
            }
            c if is_name(c) => {
                let length = rest.find(|c: char| !is_name(c) && !c.is_ascii_digit()).unwrap_or(rest.len());
                let name = &rest[..length];
                let name: Rc<str> = if spelling.folds_case { name.to_lowercase().into() } else { name.into() };
                push(Token::Name(name), length)
            }
            c => match spelling.symbols.iter().find(|symbol| rest.starts_with(**symbol)) {
                Some(symbol) => push(Token::Symbol(symbol), symbol.len()),
                None => push(Token::Name(c.to_string().into()), c.len_utf8()),
            },
        };
    }
    let end = Span { file, start: text.len(), end: text.len() };
    found.push(Lexeme { token: Token::Line, span: end });
    Ok(found)
}

fn is_name(c: char) -> bool {
    c.is_alphabetic() || c == '_' || c == '$'
}

/// Length in bytes of a quoted text including its quotes; it must end on its line.
fn text_length(rest: &str, quote: char, doubled: bool) -> Option<usize> {
    let mut characters = rest.char_indices().skip(1).peekable();
    while let Some((at, c)) = characters.next() {
        if c == '\n' {
            return None;
        }
        if c == quote {
            if doubled && characters.peek().is_some_and(|(_, next)| *next == quote) {
                characters.next();
                continue;
            }
            return Some(at + 1);
        }
    }
    None
}

/// Returns the number at the beginning of a text, and its length in bytes.
fn number(rest: &str, file: usize, start: usize) -> Result<(Token, usize)> {
    let length = number_length(rest);
    let written = &rest[..length];
    let Ok(value) = written.parse::<f64>() else {
        return fail(Span { file, start, end: start + length }, format!("`{written}` is not a number"));
    };
    Ok((Token::Number(value, written.bytes().all(|b| b.is_ascii_digit())), length))
}

/// Length in bytes of a number without sign.
fn number_length(rest: &str) -> usize {
    let bytes = rest.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let mut at = digits(0);
    if bytes.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
        let end = digits(at + 1 + sign);
        if end > at + 1 + sign {
            at = end;
        }
    }
    at
}
