//! A font of strokes, drawn for this project: it scales, and needs neither file nor crate.
//!
//! A glyph is a list of polylines on a grid of 4 by 8 units, each point two digits, x then y:
//! descenders reach 0, the base line is 2, small letters reach 6, capitals 8.

/// Height of a capital in units of the grid.
pub(super) const CAPITAL: f64 = 6.0;
/// Height of the base line.
pub(super) const BASE: f64 = 2.0;
/// Empty units behind each glyph.
pub(super) const GAP: f64 = 1.9;
/// Width of a space, gap included.
pub(super) const SPACE: f64 = 3.4;

/// Polylines of a glyph; a box for what the font does not have.
pub(super) fn strokes(glyph: char) -> &'static str {
    match glyph {
        'A' => "0206284642 0444",
        'B' => "02083847463505 3544433202",
        'C' => "4738180703123243",
        'D' => "02083847433202",
        'E' => "48080242 0535",
        'F' => "480802 0535",
        'G' => "47381807031232434525",
        'H' => "0208 4248 0545",
        'I' => "0828 1812 0222",
        'J' => "4843321203",
        'K' => "0208 480542",
        'L' => "080242",
        'M' => "0208254842",
        'N' => "02084248",
        'O' | '0' => "123243473818070312",
        'P' => "02083847463505",
        'Q' => "123243473818070312 2442",
        'R' => "02083847463505 2542",
        'S' => "473818070615354443321203",
        'T' => "0848 2228",
        'U' => "080312324348",
        'V' => "082248",
        'W' => "0812263248",
        'X' => "0248 0842",
        'Y' => "082548 2522",
        'Z' => "08480242",
        'a' => "16364542 441403123243",
        'b' => "0802 0516364543321203",
        'c' => "4536160503123243",
        'd' => "4842 4536160503123243",
        'e' => "04444536160503123243",
        'f' => "38281712 0636",
        'g' => "46413010 4536160503123243",
        'h' => "0802 0516364542",
        'i' => "0602 0808",
        'j' => "161100 1818",
        'k' => "0802 360432",
        'l' => "080312",
        'm' => "0602 05162522 25364542",
        'n' => "0602 0516364542",
        'o' => "123243453616050312",
        'p' => "0600 0516364543321203",
        'q' => "4640 4536160503123243",
        'r' => "0602 042636",
        's' => "4616051434433202",
        't' => "18132232 0636",
        'u' => "0603123243 4642",
        'v' => "062246",
        'w' => "0612253246",
        'x' => "0642 0246",
        'y' => "0622 4610",
        'z' => "06460242",
        '1' => "062822 0242",
        '2' => "07183847460242",
        '3' => "0718384746354443321203 2535",
        '4' => "32380444",
        '5' => "480805354443321203",
        '6' => "473818070312324344351504",
        '7' => "084812",
        '8' => "150607183847463515040312324344 3544",
        '9' => "031232434738180706153546",
        '.' => "0202",
        ',' => "1201",
        ':' => "0202 0505",
        ';' => "1201 1515",
        '-' | '–' => "0434",
        '+' => "0545 2327",
        '=' => "0343 0646",
        '/' => "0248",
        '\\' => "0842",
        '%' => "0248 0708181707 3233434232",
        '(' => "18070312",
        ')' => "08171302",
        '[' | '{' => "18080212",
        ']' | '}' => "08181202",
        '<' => "460442",
        '>' => "064402",
        '_' => "0141",
        '*' => "0644 0446 2327",
        '#' => "1218 3238 0444 0646",
        '\'' | '`' => "0807",
        '"' => "0807 1817",
        '|' => "0801",
        '!' => "0804 0202",
        '?' => "07183847462524 2222",
        '^' => "062846",
        '~' => "04153445",
        '&' => "4206071827260403122244",
        '$' => "473818070615354443321203 2129",
        '@' => "3414163644470848 020848",
        'µ' => "0600 03123243 4642",
        '°' => "0708181707",
        '×' => "0336 0633",
        '·' => "0505",
        '²' => "08182706 0626",
        _ => "0208484202",
    }
}

/// Polylines of a glyph as points `(x, y)` on the grid.
pub(super) fn polylines(glyph: char) -> impl Iterator<Item = Vec<(f64, f64)>> {
    let digit = |byte: u8| f64::from(byte.saturating_sub(b'0'));
    strokes(glyph)
        .split(' ')
        .map(move |line| line.as_bytes().chunks_exact(2).map(|p| (digit(p[0]), digit(p[1]))).collect())
}

/// Distance from the start of a glyph to that of the next, in units of the grid.
pub(super) fn advance(glyph: char) -> f64 {
    if glyph == ' ' {
        return SPACE;
    }
    let right = polylines(glyph).flatten().map(|(x, _)| x).fold(0.0, f64::max);
    right + GAP
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_ascii_character_has_strokes_of_whole_points_on_the_grid() {
        for glyph in (33_u8..127).map(char::from) {
            for line in strokes(glyph).split(' ') {
                assert!(!line.is_empty() && line.len() % 2 == 0, "{glyph:?}: {line:?}");
                assert!(line.bytes().all(|b| b.is_ascii_digit()), "{glyph:?}: {line:?}");
            }
            assert!(advance(glyph) <= 4.0 + GAP, "{glyph:?} is too wide");
        }
    }

    #[test]
    fn no_two_letters_or_digits_look_alike_but_the_letter_o_and_zero() {
        let signs: Vec<char> = ('0'..='9').chain('A'..='Z').chain('a'..='z').collect();
        for (i, a) in signs.iter().enumerate() {
            for b in &signs[..i] {
                assert!(strokes(*a) != strokes(*b) || (*b, *a) == ('0', 'O'), "{b} and {a}");
            }
        }
    }
}
