//! Recognition of the language from the content of a file; its extension decides ambiguous cases.
//!
//! Start at [`recognise`]: each language counts the lines that look like its own; the extension of
//! the file decides between counts that are close. Not here: motion files that are not programs
//! (`flexarm-run`).

use crate::{Language, decode};

/// Returns the language of a program, or `None` if it is not supported.
///
/// * `bytes`: content of the file.
/// * `name`: file name; only its extension is used, and only if the content is ambiguous.
pub fn recognise(bytes: &[u8], name: &str) -> Option<Language> {
    let text = decode(&bytes[..bytes.len().min(LOOKED_AT)]);
    if text.contains('\0') {
        return None;
    }
    let lines: Vec<String> =
        text.lines().map(|line| line.trim().to_lowercase()).filter(|line| !line.is_empty()).collect();
    let share = |is: fn(&str) -> bool| lines.iter().filter(|line| is(line)).count();
    let scores = [
        (Language::Krl, share(is_krl)),
        (Language::Rapid, share(is_rapid)),
        (Language::UrScript, share(is_urscript)),
        (Language::GCode, gcode_score(&lines)),
    ];
    let best = scores.iter().map(|(_, score)| *score).max().unwrap_or(0);
    let named = language_of_ending(name);
    if best == 0 {
        return None;
    }
    let mut winners = scores.iter().filter(|(_, score)| *score == best).map(|(language, _)| *language);
    match named {
        Some(named) if scores.iter().any(|(language, score)| *language == named && 2 * score >= best) => Some(named),
        _ => winners.next(),
    }
}

/// Number of leading bytes examined.
const LOOKED_AT: usize = 1 << 18;

fn language_of_ending(name: &str) -> Option<Language> {
    let ending = name.rsplit_once('.')?.1.to_lowercase();
    match ending.as_str() {
        "src" | "dat" | "sub" => Some(Language::Krl),
        "mod" | "modx" | "prg" | "sys" | "sysx" => Some(Language::Rapid),
        "script" | "urscript" => Some(Language::UrScript),
        "nc" | "ngc" | "gcode" | "tap" | "cnc" | "gc" => Some(Language::GCode),
        _ => None,
    }
}

/// Whether the line begins with one of the words, separated by bars, as a whole word.
fn begins(line: &str, words: &str) -> bool {
    words.split('|').any(|word| {
        line.strip_prefix(word).is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    })
}

fn is_krl(line: &str) -> bool {
    const WORDS: &str = "\
        &access|&rel|&param|defdat|deffct|enddat|ptp|lin|circ|sptp|slin|scirc|ptp_rel|lin_rel|decl|\
        bas|$vel|$vel_axis|$base|$tool|$apo|$acc";
    begins(line, WORDS) || (begins(line, "def|global def") && !line.ends_with(':'))
}

fn is_rapid(line: &str) -> bool {
    const WORDS: &str = "\
        module|endmodule|proc|endproc|local proc|pers|const|var|task pers|local const|movej|movel|\
        movec|moveabsj";
    begins(line, WORDS) && !line.contains("movej(") && !line.contains("movel(") && !line.contains("movec(")
}

fn is_urscript(line: &str) -> bool {
    let calls = ["movej(", "movel(", "movec(", "movep(", "set_tcp(", "textmsg(", "set_digital_out(", "set_payload("];
    calls.iter().any(|call| line.starts_with(call))
        || (begins(line, "def|thread|while|if") && line.ends_with(':'))
        || line.contains("=p[")
        || line.contains("= p[")
}

/// Number of lines that consist of words of a letter and a number; 0 if they are less than a third
/// of the lines or none has a G or M.
fn gcode_score(lines: &[String]) -> usize {
    let blocks = lines.iter().filter(|line| is_gcode(line)).count();
    let codes = lines.iter().filter(|line| is_gcode(line) && line.contains(['g', 'm'])).count();
    if codes == 0 || 3 * blocks < lines.len() { 0 } else { blocks }
}

fn is_gcode(line: &str) -> bool {
    let mut outside = String::new();
    let mut in_comment = false;
    for c in line.chars() {
        match c {
            '(' => in_comment = true,
            ')' => in_comment = false,
            ';' => break,
            _ if in_comment || c.is_whitespace() => {}
            _ => outside.push(c),
        }
    }
    let words = outside.trim_start_matches('/').as_bytes();
    let mut at = 0;
    while at < words.len() {
        if !words[at].is_ascii_lowercase() {
            return false;
        }
        let number = words[at + 1..].iter().take_while(|b| b.is_ascii_digit() || b"+-.#[]*/".contains(b)).count();
        if number == 0 {
            return false;
        }
        at += 1 + number;
    }
    !words.is_empty()
}
