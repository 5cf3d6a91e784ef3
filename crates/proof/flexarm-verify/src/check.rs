//! Comparison of a stored page with the page that the command prints.
//!
//! Words and whole numbers must be equal. Numbers with decimals may differ by one unit of their
//! last digit. Relative errors (per cent, or with an exponent) may differ by 3 %, and small ones by
//! 5e-9, since rounding differs between processors. Pictures must have the same words and curves,
//! with coordinates within three units of about two thousand.

use std::path::{Path, PathBuf};

use crate::page::FLOOR;

/// Maximum absolute difference of relative errors that counts as rounding.
const ROUNDING: f64 = 5e-9;
/// Maximum relative difference of relative errors that count as equal.
const RELATIVE: f64 = 0.03;
/// Maximum difference of coordinates in a picture.
const COORDINATE: f64 = 3.0;

/// A line in which two pages differ, or a picture.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Difference {
    /// Stored file.
    pub page: PathBuf,
    /// Line number in the stored page, from 1; 0 for a picture.
    pub line: usize,
    /// Stored text.
    pub stored: String,
    /// Text found now.
    pub found: String,
}

/// Returns the lines in which two pages differ.
///
/// * `page`: the stored file.
pub(crate) fn differences(page: &Path, stored: &str, found: &str) -> Vec<Difference> {
    let (stored, found): (Vec<&str>, Vec<&str>) = (stored.lines().collect(), found.lines().collect());
    (0..stored.len().max(found.len()))
        .filter_map(|k| {
            let (a, b) = (stored.get(k).copied(), found.get(k).copied());
            let same = matches!((a, b), (Some(a), Some(b)) if a == b || same_line(a, b));
            let shown = |line: Option<&str>| line.unwrap_or("(nothing)").to_owned();
            (!same).then(|| Difference { page: page.to_owned(), line: k + 1, stored: shown(a), found: shown(b) })
        })
        .collect()
}

fn same_line(a: &str, b: &str) -> bool {
    let (a, b) = (pieces(a), pieces(b));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.same(b))
}

/// Returns whether two pictures agree within the tolerances.
pub(crate) fn same_picture(a: &str, b: &str) -> bool {
    let close = |(a, b): (&Piece, &Piece)| match (a, b) {
        (Piece::Number { value: a, .. }, Piece::Number { value: b, .. }) => (a - b).abs() <= COORDINATE,
        (a, b) => a == b,
    };
    let (a, b) = (pieces(a), pieces(b));
    a.len() == b.len() && a.iter().zip(&b).all(close)
}

#[derive(Debug, PartialEq)]
enum Piece {
    Words(String),
    Number { value: f64, last_digit: f64, kind: Kind },
}

/// Kind of a number, judged by its format.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// Count, year or version.
    Whole,
    /// Number with decimals.
    Decimal,
    /// Relative error: in per cent, or with an exponent.
    Error,
}

impl Piece {
    fn same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Words(a), Self::Words(b)) => a == b,
            (Self::Number { value: a, last_digit: d, kind }, Self::Number { value: b, last_digit: e, kind: other }) => {
                let apart = (a - b).abs();
                // A margin of a thousandth, since decimals are not exact in binary.
                let by_digit = apart <= 1.001 * d.max(*e);
                match (kind, other) {
                    (Kind::Whole, Kind::Whole) => a == b,
                    (Kind::Error, Kind::Error) => {
                        by_digit || apart <= RELATIVE * a.abs().max(b.abs()) || apart <= ROUNDING
                    }
                    // A number with decimals may round to a whole number.
                    _ => by_digit,
                }
            }
            _ => false,
        }
    }
}

/// Splits a line into alternating words and numbers.
fn pieces(line: &str) -> Vec<Piece> {
    let line = line.replace(&format!("< {FLOOR:.0e}"), "+1e-9");
    let bytes = line.as_bytes();
    let (mut pieces, mut words, mut k) = (Vec::new(), String::new(), 0);
    while k < bytes.len() {
        let at_word = k > 0 && (bytes[k - 1].is_ascii_alphanumeric() || bytes[k - 1] == b'_');
        // A digit within a word (x2y) is a part of the word.
        match number(&bytes[k..]).filter(|_| !at_word) {
            Some(length) => {
                pieces.push(Piece::Words(std::mem::take(&mut words)));
                let text = &line[k..k + length];
                k += length;
                let percent = line[k..].starts_with(" %");
                let unit = if percent { 0.01 } else { 1.0 };
                k += if percent { 2 } else { 0 };
                let kind = match text {
                    _ if percent || text.contains('e') => Kind::Error,
                    _ if text.contains('.') => Kind::Decimal,
                    _ => Kind::Whole,
                };
                let value = unit * text.parse().unwrap_or(f64::NAN);
                pieces.push(Piece::Number { value, last_digit: unit * last_digit(text), kind });
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

/// Length of the number at the start of the text: sign, digits, point, digits, exponent.
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
        let place = Path::new("page.md");
        let page =
            "| 2 parts | +1.234 % | < 1e-9 | 4.6e-7 | 22.8571 | 9.9e-4 |\nnothing x2y, 0.8 m, 2.20 of 2026-11-21";
        for (same, old, new) in [
            (true, "", ""),
            (true, "1.234", "1.235"),
            (true, "1.234", "1.21"),
            (true, "< 1e-9", "-3.1e-9"),
            (true, "4.6e-7", "4.7e-7"),
            (true, "9.9e-4", "0.10 %"),
            (true, "22.8571", "22.8572"),
            (false, "22.8571", "22.8573"),
            (false, "1.234", "1.300"),
            (false, "+1.234", "-1.234"),
            (false, "< 1e-9", "2e-8"),
            (false, "2 parts", "3 parts"),
            (false, "2.20", "2.22"),
            (false, "2026", "2025"),
            (false, "-21", "-22"),
            (false, "0.8 m", "1.0 m"),
            (false, "x2y", "x3y"),
            (false, "nothing", "something"),
            (false, "21", "21\nmore"),
            (false, "\nnothing", " nothing"),
        ] {
            let other = page.replace(old, new);
            assert_eq!(differences(place, page, &other).is_empty(), same, "{old} {new}");
        }
        assert_eq!(differences(place, page, &page.replace("nothing", "something"))[0].line, 2);
    }

    /// Truth by hand: sign, digits, point, exponent; a point or an `e` without digits after it
    /// belongs to the following word.
    #[test]
    fn a_number_ends_where_its_digits_end() {
        for (text, length, unit) in [
            ("12", 2, 1.0),
            ("-0.50 mm", 5, 0.01),
            ("4.6e-7,", 6, 1e-8),
            ("+1e9", 4, 1e9),
            ("3. Then", 1, 1.0),
            ("2em", 1, 1.0),
            ("1e-", 1, 1.0),
        ] {
            assert_eq!(number(text.as_bytes()), Some(length), "{text}");
            assert!((last_digit(&text[..length]) / unit - 1.0).abs() < 1e-12, "{text}");
        }
        assert_eq!([number(b"x"), number(b"-"), number(b".5"), number(b"")], [None; 4]);
    }

    #[test]
    fn pictures_may_move_by_a_unit_and_not_by_ten() {
        let picture = "<polyline stroke=\"#000\" points=\"10,20 30,40\"/><text>w [mm]</text>";
        assert!(same_picture(picture, &picture.replace("30,40", "31,38")));
        assert!(!same_picture(picture, &picture.replace("30,40", "40,40")));
        assert!(!same_picture(picture, &picture.replace(" 30,40", "")));
        assert!(!same_picture(picture, &picture.replace("mm", "um")));
    }
}
