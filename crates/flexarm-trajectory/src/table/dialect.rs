//! Lines, separators and numbers of tables: what is between the fields, and whether decimals are behind points or commas.

/// What separates the fields of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Semicolon,
    Tab,
    Comma,
    /// One or more spaces or tabs.
    Spaces,
}

impl Separator {
    /// In the order in which they are tried: a comma may be in a number, so those that may not come first.
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

    /// The fields of a line, without the quotes around them; a quote within quotes is doubled.
    pub(super) fn split(self, line: &str) -> Vec<String> {
        let line = if self == Self::Spaces { line.trim() } else { line };
        let (mut fields, mut field) = (Vec::new(), String::new());
        let (mut quoted, mut was_quoted, mut gap) = (false, false, false);
        let mut letters = line.chars().peekable();
        let close = |field: &mut String, was_quoted: &mut bool| {
            let text = if *was_quoted { field.clone() } else { field.trim().to_owned() };
            field.clear();
            *was_quoted = false;
            text
        };
        while let Some(letter) = letters.next() {
            if quoted {
                match letter {
                    '"' if letters.next_if_eq(&'"').is_some() => field.push('"'),
                    '"' => quoted = false,
                    other => field.push(other),
                }
                continue;
            }
            if self.is(letter) {
                if !(self == Self::Spaces && gap) {
                    fields.push(close(&mut field, &mut was_quoted));
                }
                gap = true;
                continue;
            }
            gap = false;
            match letter {
                '"' if field.trim().is_empty() => (field, quoted, was_quoted) = (String::new(), true, true),
                other => field.push(other),
            }
        }
        fields.push(close(&mut field, &mut was_quoted));
        fields
    }
}

/// What stands before decimals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decimal {
    /// The number is whole.
    None,
    Point,
    Comma,
}

/// A number and its decimal sign; `None` for what is no finite number.
pub(super) fn number(field: &str) -> Option<(f64, Decimal)> {
    let (text, decimal) = plain(field)?;
    // Words such as `inf` and `nan` are no numbers here.
    let is_numeric = text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) && !text.contains(['n', 'N']);
    let value: f64 = if is_numeric { text.parse().ok()? } else { return None };
    value.is_finite().then_some((value, decimal))
}

/// The number with a point, a hyphen as its sign.
fn plain(field: &str) -> Option<(String, Decimal)> {
    let text = field.trim().replace('\u{2212}', "-");
    match (text.contains('.'), text.matches(',').count()) {
        (true, 0) => Some((text, Decimal::Point)),
        (false, 0) => Some((text, Decimal::None)),
        (false, 1) => Some((text.replace(',', "."), Decimal::Comma)),
        _ => None,
    }
}

/// A time in units of 1e-12, exact as far as it is written: seconds since 1970 with nanoseconds have more digits than an f64.
pub(super) fn exact(field: &str) -> Option<i128> {
    const DIGITS: usize = 12;
    let (text, _) = plain(field)?;
    let (sign, text) = match text.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, text.strip_prefix('+').unwrap_or(&text)),
    };
    let (whole, rest) = text.split_once('.').unwrap_or((text, ""));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if (whole.is_empty() && rest.is_empty()) || !are_digits(whole) || !are_digits(rest) || whole.len() > 24 {
        return None;
    }
    let kept = &rest[..rest.len().min(DIGITS)];
    let digits = format!("{whole}{kept:0<DIGITS$}");
    Some(sign * digits.parse::<i128>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_split_with_quotes_and_runs_of_spaces_as_one_gap() {
        assert_eq!(Separator::Comma.split("\"a,b\", c ,\"say \"\"x\"\"\","), ["a,b", "c", "say \"x\"", ""]);
        assert_eq!(Separator::Spaces.split("  1.0   2.0\t3 "), ["1.0", "2.0", "3"]);
        assert_eq!(Separator::Semicolon.split("1,5;2"), ["1,5", "2"]);
    }

    #[test]
    fn times_of_nineteen_digits_keep_their_differences() {
        let (a, b) = (exact("1700000000123456789").unwrap(), exact("1700000000143456789").unwrap());
        assert_eq!((b - a) as f64 / 1e12, 20_000_000.0);
        assert_eq!(exact("-0,25"), Some(-250_000_000_000));
        assert_eq!(exact("1e3"), None);
    }
}
