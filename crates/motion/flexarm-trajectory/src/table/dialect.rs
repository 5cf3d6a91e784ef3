//! Dialects of tables: field separators, numbers with decimal points or commas, and clock times.
//!
//! Times are read twice: as f64, and exactly in units of 1e-12 s, since seconds since 1970 with
//! nanoseconds have more digits than an f64. Not here: names and units of columns (`header`).

use std::borrow::Cow;

use flexarm_settings::written::{csv_column, csv_fields};

/// Field separator of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Semicolon,
    Tab,
    Comma,
    /// One or more spaces or tabs.
    Spaces,
}

impl Separator {
    /// Separators in the order in which they are tried; the comma comes after those that cannot
    /// occur in a number.
    pub(super) const ALL: [Self; 4] = [Self::Semicolon, Self::Tab, Self::Comma, Self::Spaces];

    pub(super) fn in_words(self) -> &'static str {
        match self {
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
            Self::Comma => "commas",
            Self::Spaces => "spaces",
        }
    }

    fn is(self, letter: char) -> bool {
        match self {
            Self::Semicolon => letter == ';',
            Self::Tab => letter == '\t',
            Self::Comma => letter == ',',
            Self::Spaces => letter == ' ' || letter == '\t',
        }
    }

    /// Column of a field in a line, in characters from 1.
    pub(super) fn column(self, line: &str, field: usize) -> Option<usize> {
        csv_column(line, |letter| self.is(letter), self == Self::Spaces, field)
    }

    /// Splits a line into fields without the surrounding quotes; a quote within quotes is doubled.
    pub(super) fn split(self, line: &str) -> Vec<String> {
        let line = if self == Self::Spaces { line.trim() } else { line };
        csv_fields(line, |letter| self.is(letter), self == Self::Spaces)
    }
}

/// Decimal separator of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decimal {
    /// The number has no decimals.
    None,
    Point,
    Comma,
}

/// A number and its decimal separator; `None` if the field is not a finite number.
pub(super) fn number(field: &str) -> Option<(f64, Decimal)> {
    let (text, decimal) = plain(field)?;
    // Words such as `inf` and `nan` are not accepted as numbers.
    let is_numeric = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) && !text.contains(['n', 'N']);
    let value: f64 = if is_numeric { text.parse().ok()? } else { return None };
    value.is_finite().then_some((value, decimal))
}

/// The number with a decimal point and an ASCII minus sign.
fn plain(field: &str) -> Option<(Cow<'_, str>, Decimal)> {
    let field = field.trim();
    let text = match field.is_ascii() {
        true => Cow::Borrowed(field),
        false => Cow::Owned(field.replace('\u{2212}', "-")),
    };
    match (text.contains('.'), text.matches(',').count()) {
        (true, 0) => Some((text, Decimal::Point)),
        (false, 0) => Some((text, Decimal::None)),
        (false, 1) => Some((text.replace(',', ".").into(), Decimal::Comma)),
        _ => None,
    }
}

/// A time in units of 1e-12, exact as written: seconds since 1970 with nanoseconds have more digits
/// than an f64. `None` for more than twelve decimals.
pub(super) fn exact(field: &str) -> Option<i128> {
    const DIGITS: usize = 12;
    let (text, _) = plain(field)?;
    let (sign, text) = match text.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, text.strip_prefix('+').unwrap_or(&text)),
    };
    let (whole, rest) = text.split_once('.').unwrap_or((text, ""));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if (whole.is_empty() && rest.is_empty())
        || !are_digits(whole)
        || !are_digits(rest)
        || whole.len() > 24
        || rest.len() > DIGITS
    {
        return None;
    }
    let digits = format!("{whole}{rest:0<DIGITS$}");
    Some(sign * digits.parse::<i128>().ok()?)
}

/// A time of day, with or without a date (`2024-03-01T12:00:00.004Z`, `12:00:00.004`), in units of
/// 1e-12 s since 1970 or since midnight. Time zones are ignored: they are the same in all rows of a
/// table.
pub(super) fn clock_time(field: &str) -> Option<i128> {
    let field = field.trim().trim_end_matches('Z');
    let (date, clock) = match field.split_once(['T', ' ']) {
        Some((date, clock)) => (Some(date), clock.trim()),
        None => (None, field),
    };
    // A zone such as +01:00 follows the time.
    let clock = clock.split_once('+').map_or(clock, |(clock, _)| clock);
    let mut parts = clock.split(':');
    let mut whole = |below: i128| parts.next()?.parse::<u8>().ok().map(i128::from).filter(|n| *n < below);
    let (hours, minutes) = (whole(24)?, whole(60)?);
    let seconds = exact(parts.next()?).filter(|s| (0..61_000_000_000_000).contains(s))?;
    if parts.next().is_some() {
        return None;
    }
    let days = date.map_or(Some(0), days_since_1970)?;
    Some(((days * 24 + hours) * 60 + minutes) * 60_000_000_000_000 + seconds)
}

/// Days of the Gregorian calendar since 1970, from `2024-03-01` or `2024/03/01`.
fn days_since_1970(date: &str) -> Option<i128> {
    let mut parts = date.trim().split(['-', '/']);
    let mut part = |digits: usize| parts.next().filter(|p| p.len() == digits)?.parse::<u16>().ok().map(i128::from);
    let (year, month, day) = (part(4)?, part(2)?, part(2)?);
    if parts.next().is_some() || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Years start in March, so that a leap day is the last day of its year.
    let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    Some(365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day - 719_469)
}
