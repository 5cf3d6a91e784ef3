//! Number formatting for readers.
//!
//! `number` and `fixed` for text, [`short`] for data of plots, of which a page has many thousands.

/// Formats a number with `digits` significant digits, without trailing zeros.
pub(super) fn number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    let x: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    // Avoids -0.
    let x = if x == 0.0 { 0.0 } else { x };
    let (plain, scientific) = (format!("{x}"), format!("{x:e}"));
    if x == 0.0 || (1e-3..1e7).contains(&x.abs()) { plain } else { scientific }
}

/// Formats a number with trailing zeros, so that a row of tiles looks uniform.
pub(super) fn fixed(x: f64) -> String {
    let digits = match x.abs() {
        a if a >= 100.0 => 1,
        a if a >= 10.0 => 2,
        a if a >= 0.0995 || a == 0.0 => 3,
        _ => 4,
    };
    format!("{x:.digits$}")
}

/// Magnitudes below this are written as zero.
const SMALLEST: f64 = 1e-300;

/// Maximum number of digits for the fast path. With more digits, or where the scaled number is so
/// close to a rounding boundary (in units of the last digit) that round-off could decide, the
/// standard library is used.
const MAX_SCALED: usize = 9;
const NEAR_MIDDLE: f64 = 1e-4;

/// Returns the significant digits of a positive number as an integer, and the power of ten of the
/// first digit.
fn rounded(x: f64, digits: usize) -> (u64, i32) {
    scaled(x, digits).unwrap_or_else(|| {
        let written = format!("{x:.*e}", digits - 1);
        let (mantissa, exponent) = written.split_once('e').unwrap_or((&written, "0"));
        (mantissa.replace('.', "").parse().unwrap_or(0), exponent.parse().unwrap_or(0))
    })
}

/// As [`rounded`], from the number times a power of ten; None where that could be wrong.
fn scaled(x: f64, digits: usize) -> Option<(u64, i32)> {
    let least = 10_u64.pow((digits - 1) as u32);
    // Wrong by at most one, which is corrected below.
    let mut exponent = x.log10().floor() as i32;
    if digits > MAX_SCALED || exponent.abs() > 250 {
        return None;
    }
    let times = |exponent: i32| match digits as i32 - 1 - exponent {
        power @ 0.. => x * 10_f64.powi(power),
        power => x / 10_f64.powi(-power),
    };
    let mut scaled = times(exponent);
    if scaled < least as f64 {
        exponent -= 1;
        scaled = times(exponent);
    } else if scaled >= (10 * least) as f64 {
        exponent += 1;
        scaled = times(exponent);
    }
    let whole = scaled as u64;
    let rest = scaled - whole as f64;
    if (rest - 0.5).abs() < NEAR_MIDDLE {
        return None;
    }
    match whole + u64::from(rest > 0.5) {
        next if next == 10 * least => Some((least, exponent + 1)),
        whole => Some((whole, exponent)),
    }
}

/// Appends the shorter form of a number with `digits` significant digits, at most fifteen; null if
/// it is not finite.
pub(super) fn push_short(text: &mut String, x: f64, digits: usize) {
    if !x.is_finite() {
        text.push_str("null");
        return;
    }
    if x.abs() < SMALLEST {
        text.push('0');
        return;
    }
    let (mut number, exponent) = rounded(x.abs(), digits);
    let mut letters = [b'0'; 20];
    let mut start = letters.len();
    while number > 0 {
        start -= 1;
        letters[start] = b'0' + (number % 10) as u8;
        number /= 10;
    }
    let written = std::str::from_utf8(&letters[start..]).unwrap_or("0").trim_end_matches('0');
    let (first, rest) = written.split_at(1);
    text.push_str(if x < 0.0 { "-" } else { "" });
    // Lengths of `0.000123`, `12300`, `12.3` and of `1.23e-4`.
    let places = exponent.unsigned_abs() as usize;
    let plain = match exponent {
        ..0 => 1 + 1 + (places - 1) + 1 + rest.len(),
        _ if places >= rest.len() => 1 + places,
        _ => 1 + rest.len() + 1,
    };
    let point = usize::from(!rest.is_empty());
    let scientific = 1 + point + rest.len() + 1 + usize::from(exponent < 0) + places.max(1).ilog10() as usize + 1;
    let zeros = |count: usize| &"000000000000000"[..count]; // longer runs use the other form
    if scientific < plain {
        let sign = if exponent < 0 { "e-" } else { "e" };
        [first, &"."[..point], rest, sign].into_iter().for_each(|part| text.push_str(part));
        push_digits(text, places);
    } else if exponent < 0 {
        ["0.", zeros(places - 1), first, rest].into_iter().for_each(|part| text.push_str(part));
    } else if places >= rest.len() {
        [first, rest, zeros(places - rest.len())].into_iter().for_each(|part| text.push_str(part));
    } else {
        [first, &rest[..places], ".", &rest[places..]].into_iter().for_each(|part| text.push_str(part));
    }
}

/// Appends an integer below one thousand.
fn push_digits(text: &mut String, number: usize) {
    let digit = |unit: usize| char::from(b'0' + (number / unit % 10) as u8);
    for unit in [100, 10, 1].into_iter().filter(|unit| number >= *unit || *unit == 1) {
        text.push(digit(unit));
    }
}

/// Returns the shorter form of a number with `digits` significant digits; null if it is not finite.
pub fn short(x: f64, digits: usize) -> String {
    let mut text = String::new();
    push_short(&mut text, x, digits);
    text
}
