//! Merging of many similar messages into one.
//!
//! Start at [`gathered`]. Not here: the messages themselves (`Finding`).

/// Minimum number of similar messages that are merged.
const MANY: usize = 3;
/// Maximum number of names listed.
const NAMED: usize = 3;

/// Merges messages that differ only in names and numbers: the first one is kept, with the count and
/// the first few names of the others. Duplicates count once.
pub fn gathered(texts: &[String]) -> Vec<String> {
    let mut groups: Vec<(String, Vec<&String>)> = Vec::new();
    for text in texts {
        let kind = kind(text);
        match groups.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, group)) if group.contains(&text) => {}
            Some((_, group)) => group.push(text),
            None => groups.push((kind, vec![text])),
        }
    }
    let merged = |(_, group): (String, Vec<&String>)| match group.as_slice() {
        [first, others @ ..] if group.len() >= MANY => {
            let named: Vec<&str> = others.iter().take(NAMED).filter_map(|other| difference(first, other)).collect();
            let more = if others.len() > named.len() && !named.is_empty() { ", ..." } else { "" };
            let colon = if named.is_empty() { "" } else { ": " };
            vec![format!("{first} (and {} more of this kind{colon}{}{more})", others.len(), named.join(", "))]
        }
        few => few.iter().map(|text| (*text).clone()).collect(),
    };
    groups.into_iter().flat_map(merged).collect()
}

/// Message without its quoted names and numbers.
fn kind(text: &str) -> String {
    let mut kind = String::with_capacity(text.len());
    for (k, part) in text.split('"').enumerate() {
        if k % 2 == 1 {
            kind.push('"');
            continue;
        }
        // Digits, and other characters of a number: point, exponent, sign.
        let mut in_number = false;
        let mut letters = part.chars().peekable();
        while let Some(c) = letters.next() {
            let goes_on =
                in_number && (matches!(c, '.' | 'e' | '-' | '+')) && letters.peek().is_some_and(char::is_ascii_digit)
                    || in_number && c == 'e' && letters.peek() == Some(&'-');
            if c.is_ascii_digit() || goes_on {
                if !in_number {
                    kind.push('#');
                }
                in_number = true;
            } else {
                in_number = false;
                kind.push(c);
            }
        }
    }
    kind
}

/// First quoted name in `other` that differs from `first`, or the first differing word.
fn difference<'a>(first: &str, other: &'a str) -> Option<&'a str> {
    let quoted = |text: &'a str| text.split('"').skip(1).step_by(2);
    let mut names = first.split('"').skip(1).step_by(2).zip(quoted(other));
    let name = names.find(|(a, b)| a != b).map(|(_, name)| name);
    name.or_else(|| {
        let mut words = first.split_whitespace().zip(other.split_whitespace());
        words.find(|(a, b)| a != b).map(|(_, word)| word.trim_end_matches([':', ',']))
    })
}
