//! Numbers as people read them.

/// A number with so many significant digits, without needless zeros.
pub(super) fn number(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return "–".into();
    }
    let x: f64 = format!("{x:.*e}", digits - 1).parse().unwrap_or(x);
    // Nothing is gained by -0.
    let x = if x == 0.0 { 0.0 } else { x };
    let (plain, scientific) = (format!("{x}"), format!("{x:e}"));
    if x == 0.0 || (1e-3..1e7).contains(&x.abs()) { plain } else { scientific }
}

/// A number that keeps its digits, so that a row of tiles looks even.
pub(super) fn fixed(x: f64) -> String {
    let digits = match x.abs() {
        a if a >= 100.0 => 1,
        a if a >= 10.0 => 2,
        a if a >= 0.0995 || a == 0.0 => 3,
        _ => 4,
    };
    format!("{x:.digits$}")
}

/// Sizes below are nothing.
const SMALLEST: f64 = 1e-300;

/// Adds the shorter form of a number with so many significant digits, at most fifteen; null if it is none.
pub(super) fn push_short(text: &mut String, x: f64, digits: usize) {
    use std::fmt::Write as _;
    if !x.is_finite() {
        text.push_str("null");
        return;
    }
    // So many digits are those of the number that they mean: `-1.2300e-5`.
    let start = text.len();
    let _ = write!(text, "{x:.*e}", digits - 1);
    let written = text.split_off(start);
    let (mantissa, exponent) = written.split_once('e').unwrap_or((&written, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let (sign, mantissa) = mantissa.strip_prefix('-').map_or(("", mantissa), |rest| ("-", rest));
    let (first, rest) = mantissa.split_at(1);
    let rest = rest.trim_start_matches('.').trim_end_matches('0');
    if first == "0" || x.abs() < SMALLEST {
        text.push('0');
        return;
    }
    text.push_str(sign);
    // Letters of `0.000123`, `12300`, `12.3` and of `1.23e-4`.
    let places = exponent.unsigned_abs() as usize;
    let plain = match exponent {
        ..0 => 1 + 1 + (places - 1) + 1 + rest.len(),
        _ if places >= rest.len() => 1 + places,
        _ => 1 + rest.len() + 1,
    };
    let point = usize::from(!rest.is_empty());
    let scientific = 1 + point + rest.len() + 1 + usize::from(exponent < 0) + places.max(1).ilog10() as usize + 1;
    if scientific < plain {
        let _ = write!(text, "{first}{}{rest}e{exponent}", &"."[..point]);
    } else if exponent < 0 {
        text.push_str("0.");
        text.extend(std::iter::repeat_n('0', places - 1));
        text.extend([first, rest]);
    } else if places >= rest.len() {
        text.extend([first, rest]);
        text.extend(std::iter::repeat_n('0', places - rest.len()));
    } else {
        text.extend([first, &rest[..places], ".", &rest[places..]]);
    }
}

/// The shorter form of a number with so many significant digits; null if it is none.
pub(super) fn short(x: f64, digits: usize) -> String {
    let mut text = String::new();
    push_short(&mut text, x, digits);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the number that the digits mean, written in both ways by the standard library.
    #[test]
    fn a_number_is_written_in_the_shorter_of_both_forms() {
        let check = |x: f64, digits: usize| {
            let x = if x.abs() < SMALLEST { 0.0 } else { x };
            let rounded: f64 = format!("{x:.*e}", digits - 1).parse().unwrap();
            let rounded = if rounded == 0.0 { 0.0 } else { rounded };
            let (plain, scientific) = (format!("{rounded}"), format!("{rounded:e}"));
            let truth = if scientific.len() < plain.len() { scientific } else { plain };
            assert_eq!(short(x, digits), truth, "{x:?} with {digits} digits");
        };
        let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
        let mut random = || {
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            seed
        };
        for _ in 0..50_000 {
            let (mantissa, power) = (random() as i64 as f64 / i64::MAX as f64, (random() % 30) as i32 - 15);
            [1, 3, 5, 7].into_iter().for_each(|digits| check(mantissa * 10f64.powi(power), digits));
            let any = f64::from_bits(random());
            check(if any.is_finite() { any } else { 0.5 }, 5);
            check((random() % 3000) as f64 * 10f64.powi(power / 3), 5);
        }
        for x in [0.0, -0.0, 1.0, -1.0, 10.0, 99999.6, 1e15, 1.1e-300, 1.5e300, -120.0, 0.001, 0.01, 1000.0] {
            check(x, 5);
        }
        assert_eq!([f64::NAN, f64::INFINITY, 1e-310].map(|x| short(x, 5)), ["null", "null", "0"]);
    }
}
