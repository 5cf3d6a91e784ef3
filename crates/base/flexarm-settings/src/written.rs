//! Escaping of foreign text, such as joint names and file cells, for each kind of output: one
//! function per kind.
//!
//! JSON and TOML are not here: their writers escape by themselves.
//!
//! ```
//! use flexarm_settings::written;
//!
//! let name = "\u{1b}[31m=<b>|";
//! assert_eq!(written::one_line(name), r"\u{1b}[31m=<b>|");
//! assert_eq!(written::markup(name), r"\u{1b}[31m=&lt;b&gt;|");
//! assert_eq!(written::csv_field("=1+1"), "\"'=1+1\"");
//! ```

/// Maximum length of a quoted text in a message (characters).
const LONGEST_QUOTE: usize = 300;
/// Maximum length of a line of a message (characters).
#[doc(hidden)]
pub const LONGEST_LINE: usize = 8000;

/// Whether a terminal interprets the character instead of showing it, or it is invisible: control
/// characters, bidirectional controls, and invisible line separators.
#[doc(hidden)]
pub fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}')
}

fn shown(text: &str, keeps: &[char], push: impl Fn(&mut String, char)) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match is_hidden(c) && !keeps.contains(&c) {
            true => out += &c.escape_unicode().to_string(),
            false => push(&mut out, c),
        }
    }
    out
}

/// Escapes text for a terminal or a plain file: hidden characters are shown as `\u{1b}`, line
/// breaks and tabs are kept.
pub fn visible(text: &str) -> String {
    shown(text, &['\n', '\t'], String::push)
}

/// As [`visible`], on a single line, for table cells and comments.
pub fn one_line(text: &str) -> String {
    visible(text).replace(['\n', '\t'], " ")
}

/// Escapes a message for a terminal: [`visible`], with quoted texts and lines cut to a readable
/// length.
pub fn message(text: &str) -> String {
    let lines = text.split('\n').map(|line| {
        let line = with_short_quotes(&visible(line));
        shortened(&line, LONGEST_LINE)
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Cuts the text to `most` characters, and appends its full length if it is cut.
pub fn shortened(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((cut, _)) => format!("{}... ({} characters)", &text[..cut], text.chars().count()),
        None => text.to_owned(),
    }
}

/// Shortens quoted texts and words without spaces.
fn with_short_quotes(text: &str) -> String {
    let mut out = String::with_capacity(text.len().min(2 * LONGEST_LINE));
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let quote = (matches!(first, '"' | '`')).then_some(first);
        let end = match quote {
            Some(quote) => end_of_quote(rest, quote),
            None => rest.find([' ', '"', '`']).map_or(rest.len(), |at| at.max(1)),
        };
        let (piece, after) = rest.split_at(end);
        let close = quote.filter(|quote| piece.len() > 1 && piece.ends_with(*quote));
        match piece.char_indices().nth(LONGEST_QUOTE) {
            Some((cut, _)) => {
                out += &piece[..cut];
                out += "...";
                out.extend(close);
                out += &format!(" ({} characters)", piece.chars().count() - 2 * usize::from(close.is_some()));
            }
            None => out += piece,
        }
        rest = after;
    }
    out
}

/// End of a quoted text that begins with `quote`; just after the opening quote if it is not closed.
fn end_of_quote(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' if quote == '"' => escaped = true,
            c if c == quote => return at + 1,
            _ => {}
        }
    }
    1
}

/// Escapes text within an element or attribute of HTML, SVG and XML.
pub fn markup(text: &str) -> String {
    shown(text, &['\n', '\t'], |out, c| match c {
        '&' => out.push_str("&amp;"),
        '<' => out.push_str("&lt;"),
        '>' => out.push_str("&gt;"),
        '"' => out.push_str("&quot;"),
        '\'' => out.push_str("&#39;"),
        c => out.push(c),
    })
}

/// Escapes text within a paragraph, a list or a table of Markdown, on one line: no HTML, links,
/// emphasis or cell separators.
pub fn markdown(text: &str) -> String {
    let text = one_line(text);
    let letters: Vec<char> = text.chars().collect();
    let is_word = |at: Option<usize>| at.and_then(|at| letters.get(at)).is_some_and(|c| c.is_alphanumeric());
    let next_is = |k: usize, of: &str| letters.get(k + 1).is_some_and(|c| of.contains(*c));
    let mut out = String::with_capacity(text.len());
    for (k, &c) in letters.iter().enumerate() {
        match c {
            // Start of tags and entities; a character followed by a space is literal.
            '<' if is_word(Some(k + 1)) || next_is(k, "/!?") => out += "&lt;",
            '&' if is_word(Some(k + 1)) || next_is(k, "#") => out += "&amp;",
            ']' if next_is(k, "([:") => out.extend(['\\', c]),
            '\\' | '`' | '*' | '|' | '~' | '$' => out.extend(['\\', c]),
            // Underscores within words are literal.
            '_' if !(is_word(k.checked_sub(1)) && is_word(Some(k + 1))) => out.extend(['\\', c]),
            // Characters that start a heading, a quotation or a list.
            '#' | '>' if k == 0 => out.extend(['\\', c]),
            '-' | '+' if k == 0 && next_is(k, " ") => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}

/// Row of a Markdown table, with line break.
pub fn markdown_row(cells: &[impl AsRef<str>]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| markdown(cell.as_ref())).collect();
    format!("| {} |\n", cells.join(" | "))
}

/// Formats a name as Markdown code, or as plain text if code cannot contain it.
pub fn markdown_code(name: &str) -> String {
    match name.contains(['`', '|']) || name.trim().is_empty() {
        true => markdown(name),
        false => format!("`{}`", one_line(name)),
    }
}

/// Whether a spreadsheet would evaluate a cell with this text.
fn is_formula(text: &str) -> bool {
    text.trim_start_matches('\'').starts_with(['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'])
}

/// Formats text as a field of a table with commas, semicolons or tabs, quoted if necessary. Text
/// that a spreadsheet would evaluate as a formula gets a leading apostrophe, which [`csv_fields`]
/// removes again.
pub fn csv_field(text: &str) -> String {
    if is_formula(text) {
        return format!("\"'{}\"", text.replace('"', "\"\""));
    }
    let is_plain = !text.contains([',', ';', '\t', '"', '\n', '\r']) && !text.starts_with('#') && text.trim() == text;
    if is_plain { text.to_owned() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}

/// Text of a field written by [`csv_field`], given without its enclosing quotes.
pub fn csv_text(field: &str) -> &str {
    field.strip_prefix('\'').filter(|text| is_formula(text)).unwrap_or(field)
}

/// Splits a line of a table into fields, without their enclosing quotes; a quote within quotes is
/// doubled.
///
/// * `runs`: whether several successive separators count as one.
pub fn csv_fields(line: &str, is_separator: impl Fn(char) -> bool, runs: bool) -> Vec<String> {
    let (mut fields, mut field) = (Vec::new(), String::new());
    let (mut quoted, mut was_quoted, mut gap) = (false, false, false);
    let mut letters = line.chars().peekable();
    // Ends a field: quoted text as it is, other text without blanks around it.
    let close = |field: &mut String, was_quoted: &mut bool| {
        let text = if *was_quoted { csv_text(field) } else { field.trim() }.to_owned();
        field.clear();
        *was_quoted = false;
        text
    };
    while let Some(letter) = letters.next() {
        // Within quotes only a quote has a meaning: doubled it is a letter, alone the end.
        if quoted {
            match letter {
                '"' if letters.next_if_eq(&'"').is_some() => field.push('"'),
                '"' => quoted = false,
                other => field.push(other),
            }
            continue;
        }
        // A separator ends a field, except after another one if several count as one.
        if is_separator(letter) {
            if !(runs && gap) {
                fields.push(close(&mut field, &mut was_quoted));
            }
            gap = true;
            continue;
        }
        gap = false;
        // A quote at the beginning of a field opens it.
        match letter {
            '"' if field.trim().is_empty() => (field, quoted, was_quoted) = (String::new(), true, true),
            other => field.push(other),
        }
    }
    fields.push(close(&mut field, &mut was_quoted));
    fields
}

/// Column of a field of a line in characters, from 1; `None` if the line has fewer fields. The other
/// arguments are those of [`csv_fields`].
pub fn csv_column(line: &str, is_separator: impl Fn(char) -> bool, runs: bool, field: usize) -> Option<usize> {
    let mut quoted = false;
    let ends = line.chars().enumerate().filter_map(|(k, letter)| {
        quoted ^= letter == '"';
        (is_separator(letter) && !quoted).then_some(k + 1)
    });
    let begins = |k: &usize| !runs || line.chars().nth(*k).is_some_and(|letter| !is_separator(letter));
    std::iter::once(0).chain(ends).filter(begins).nth(field).map(|k| k + 1)
}
