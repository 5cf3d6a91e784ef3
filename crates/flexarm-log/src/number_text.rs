//! Numbers as text: the shortest that reads back as the same `f64`, laid out as Rust's debug form has it.
//!
//! The digits come from an algorithm that is several times as fast as the standard library's, the layout is ours.

use std::io::Write;

/// Two shortest texts can be equally near, and then the algorithms choose differently. The number ends one decimal digit
/// later, that is after 18 at most: with `k` binary digits behind the point it has `k` decimal ones there, and `k` is no more
/// than this.
const MOST_BINARY_DIGITS: i32 = 26;
/// Sizes below have an exponent, as in Rust's debug form.
const SMALL: f64 = 1e-4;

/// Adds what `{value:?}` is.
pub(crate) fn push_number(text: &mut Vec<u8>, value: f64) {
    if value == 0.0 {
        // Of a spring that turns about one axis most numbers are.
        text.extend_from_slice(if value.is_sign_negative() { b"-0.0" } else { b"0.0" });
        return;
    }
    let size = value.abs();
    let mut buffer = zmij::Buffer::new();
    if binary_digits(value) <= MOST_BINARY_DIGITS {
        let _ = write!(text, "{value:?}"); // memory does not fail
    } else if size >= SMALL {
        push_text(text, buffer.format_finite(value).as_bytes());
    } else {
        push_with_exponent(text, buffer.format_finite(value).as_bytes());
    }
}

/// Adds a text of up to 24 letters, as all numbers are. Copies of a length that the compiler knows need no call: the first half
/// and the last, which may overlap.
fn push_text(text: &mut Vec<u8>, written: &[u8]) {
    let end = text.len() + written.len();
    match (written.first_chunk::<16>(), written.first_chunk::<8>(), written.last_chunk::<8>()) {
        (Some(first), _, Some(last)) if written.len() <= 24 => {
            text.extend_from_slice(first);
            text.truncate(end - last.len());
            text.extend_from_slice(last);
        }
        (None, Some(first), Some(last)) => {
            text.extend_from_slice(first);
            text.truncate(end - last.len());
            text.extend_from_slice(last);
        }
        _ => text.extend_from_slice(written),
    }
}

/// Binary digits of a number behind the point; less than zero for multiples of powers of two, infinity and what is no number.
fn binary_digits(value: f64) -> i32 {
    let bits = value.to_bits();
    let exponent = ((bits >> 52) & 0x7ff) as i32;
    let digits = (bits & ((1 << 52) - 1)) | if exponent > 0 { 1 << 52 } else { 0 };
    1075 - exponent.max(1) - digits.trailing_zeros() as i32
}

/// A number other than zero, written with or without an exponent: with one.
fn push_with_exponent(text: &mut Vec<u8>, written: &[u8]) {
    let unsigned = written.strip_prefix(b"-").unwrap_or(written);
    // Nearly all numbers: two digits of the exponent, and those next to the ones without an exponent.
    if let [mantissa @ .., b'e', b'-', tens, units] = written {
        push_text(text, mantissa);
        match tens {
            b'0' => text.extend_from_slice(&[b'e', b'-', *units]),
            _ => text.extend_from_slice(&[b'e', b'-', *tens, *units]),
        }
        return;
    }
    if let Some([first @ b'1'..=b'9', others @ ..]) = unsigned.strip_prefix(b"0.0000") {
        text.extend_from_slice(&written[..written.len() - unsigned.len()]);
        text.push(*first);
        if !others.is_empty() {
            text.push(b'.');
            text.extend_from_slice(others);
        }
        text.extend_from_slice(b"e-5");
        return;
    }
    let (mantissa, exponent) = match unsigned.iter().position(|letter| *letter == b'e') {
        Some(at) => (&unsigned[..at], std::str::from_utf8(&unsigned[at + 1..]).ok().and_then(|e| e.parse().ok())),
        None => (unsigned, Some(0_i32)),
    };
    let point = mantissa.iter().position(|letter| *letter == b'.').unwrap_or(mantissa.len());
    text.extend_from_slice(&written[..written.len() - unsigned.len()]);
    // The digits from the first that is not zero on, a point behind it.
    let start = text.len();
    let digits = mantissa.iter().filter(|letter| letter.is_ascii_digit());
    let mut leading = 0;
    for digit in digits {
        match (text.len() == start, *digit) {
            (true, b'0') => leading += 1,
            (true, _) => text.extend_from_slice(&[*digit, b'.']),
            (false, _) => text.push(*digit),
        }
    }
    while text.ends_with(b"0") {
        text.pop();
    }
    if text.ends_with(b".") {
        text.pop();
    }
    let power = exponent.unwrap_or(0) + point as i32 - leading - 1;
    text.push(b'e');
    if power < 0 {
        text.push(b'-');
    }
    let power = power.unsigned_abs();
    for unit in [100, 10, 1] {
        if power >= unit || unit == 1 {
            text.push(b'0' + (power / unit % 10) as u8);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the standard library, on numbers of all sizes, short and long ones, powers of two and ten and their neighbours.
    #[test]
    fn numbers_are_written_as_the_standard_library_has_them() {
        let check = |value: f64| {
            let mut text = Vec::new();
            push_number(&mut text, value);
            assert_eq!(String::from_utf8(text).unwrap(), format!("{value:?}"));
        };
        let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
        let mut random = || {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            seed
        };
        for _ in 0..200_000 {
            let bits = random();
            check(f64::from_bits(bits));
            // As they stand in recordings, and with few digits.
            let size = 10f64.powi((bits % 12) as i32 - 8);
            check((random() as i64) as f64 / i64::MAX as f64 * size);
            check((random() % 2000) as f64 * 1e-3 * size);
            // Quarters, eighths and so on of all sizes.
            check((bits >> 11) as f64 * 2f64.powi(-((random() % 64) as i32)));
        }
        for power in -1074..1024 {
            let two = 2f64.powi(power);
            [two, two.next_up(), two.next_down()].into_iter().for_each(check);
        }
        for power in -323..309 {
            let ten: f64 = format!("1e{power}").parse().unwrap();
            [ten, -ten, ten.next_up(), ten.next_down(), 1.5 * ten].into_iter().for_each(check);
        }
        [0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE]
            .into_iter()
            .for_each(check);
    }
}
