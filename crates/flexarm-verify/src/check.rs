//! Whether a stored page is what the command prints.
//!
//! Words must be equal. Numbers may differ by 3 % or by one and a half of their last printed digit, and anything below 1e-7
//! equals anything else below 1e-7: errors of that size are rounding, and rounding differs between processors.

use crate::page::FLOOR;

/// Relative errors below this are rounding.
const ROUNDING: f64 = 1e-7;
/// Largest relative difference of numbers that count as equal.
const RELATIVE: f64 = 0.03;

/// A line that differs.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Difference {
    /// Its number in the stored page, from 1.
    pub line: usize,
    /// What is stored.
    pub stored: String,
    /// What was found.
    pub found: String,
}

/// Lines in which two pages differ.
pub fn differences(stored: &str, found: &str) -> Vec<Difference> {
    let (stored, found): (Vec<&str>, Vec<&str>) = (stored.lines().collect(), found.lines().collect());
    (0..stored.len().max(found.len()))
        .filter_map(|k| {
            let (a, b) = (stored.get(k).copied(), found.get(k).copied());
            let same = matches!((a, b), (Some(a), Some(b)) if a == b || same_line(a, b));
            let shown = |line: Option<&str>| line.unwrap_or("(nothing)").to_owned();
            (!same).then(|| Difference { line: k + 1, stored: shown(a), found: shown(b) })
        })
        .collect()
}

fn same_line(a: &str, b: &str) -> bool {
    let (a, b) = (pieces(a), pieces(b));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.same(b))
}

#[derive(Debug, PartialEq)]
enum Piece {
    Words(String),
    Number { value: f64, last_digit: f64 },
}

impl Piece {
    fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Words(a), Self::Words(b)) => a == b,
            (Self::Number { value: a, last_digit: d }, Self::Number { value: b, last_digit: e }) => {
                let apart = (a - b).abs();
                (a.abs() < ROUNDING && b.abs() < ROUNDING)
                    || apart <= RELATIVE * a.abs().max(b.abs())
                    || apart <= 1.5 * d.max(*e)
            }
            _ => false,
        }
    }
}

/// Words and numbers of a line by turns.
fn pieces(line: &str) -> Vec<Piece> {
    let line = line.replace(&format!("< {FLOOR:.0e}"), "+1e-9");
    let bytes = line.as_bytes();
    let (mut pieces, mut words, mut k) = (Vec::new(), String::new(), 0);
    while k < bytes.len() {
        let at_word = k > 0 && bytes[k - 1].is_ascii_alphanumeric();
        match number(&bytes[k..]).filter(|_| !at_word) {
            Some(length) => {
                pieces.push(Piece::Words(std::mem::take(&mut words)));
                let text = &line[k..k + length];
                pieces.push(Piece::Number { value: text.parse().unwrap_or(f64::NAN), last_digit: last_digit(text) });
                k += length;
            }
            None => {
                let letter = line[k..].chars().next().unwrap_or(' ');
                words.push(letter);
                k += letter.len_utf8();
            }
        }
    }
    pieces.push(Piece::Words(words));
    pieces
}

/// Length of the number with which the text begins: sign, digits, point, digits, exponent.
fn number(text: &[u8]) -> Option<usize> {
    let digits = |from: usize| text[from..].iter().take_while(|c| c.is_ascii_digit()).count();
    let sign = usize::from(matches!(text.first(), Some(b'+' | b'-')));
    let whole = digits(sign);
    if whole == 0 {
        return None;
    }
    let mut end = sign + whole;
    if text.get(end) == Some(&b'.') && digits(end + 1) > 0 {
        end += 1 + digits(end + 1);
    }
    if text.get(end) == Some(&b'e') {
        let from = end + 1 + usize::from(matches!(text.get(end + 1), Some(b'+' | b'-')));
        if from <= text.len() && digits(from) > 0 {
            end = from + digits(from);
        }
    }
    Some(end)
}

/// Size of one unit of the last printed digit.
fn last_digit(text: &str) -> f64 {
    let (mantissa, exponent) = text.split_once('e').unwrap_or((text, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, after)| after.len() as i32);
    10f64.powi(exponent.parse::<i32>().unwrap_or(0) - decimals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_no_difference_and_news_is() {
        let page = "| a | +1.234 % | < 1e-9 | 4.6e-7 |\nnothing x2y";
        for (same, other) in [
            (true, page.to_owned()),
            (true, page.replace("1.234", "1.235")),
            (true, page.replace("1.234", "1.21")),
            (true, page.replace("< 1e-9", "-3.1e-8")),
            (true, page.replace("4.6e-7", "4.7e-7")),
            (false, page.replace("1.234", "1.300")),
            (false, page.replace("+1.234", "-1.234")),
            (false, page.replace("< 1e-9", "2e-7")),
            (false, page.replace("x2y", "x3y")),
            (false, page.replace("| a |", "| b |")),
            (false, format!("{page}\nmore")),
            (false, page.lines().next().unwrap().to_owned()),
        ] {
            assert_eq!(differences(page, &other).is_empty(), same, "{other}");
        }
        assert_eq!(differences(page, &page.replace("nothing", "something"))[0].line, 2);
    }
}
