//! The frame of all HTML pages: head, style, colours for light, dark and paper, list of warnings.
//! A page is one file; nothing is loaded from elsewhere.

use std::fmt::Write as _;

use flexarm_draw::palette::{self, Ground, Rgb, hex};
use flexarm_settings::gathered;
use flexarm_settings::written::markup;

const STYLE: &str = include_str!("../../assets/page.css");

/// End of a page that begins with [`opening`].
pub const ENDING: &str = "</main>\n</body></html>\n";

/// Returns the beginning of the page of a study, up to its heading.
///
/// * `title`: plain text.
pub fn opening(title: &str) -> String {
    let name = markup(title);
    head(title, "") + &format!("<header><h1>{name}</h1></header>\n<main>\n")
}

/// Returns the beginning of any page, up to the start of its body.
///
/// * `title`: plain text.
/// * `style`: additional style of the page.
pub(crate) fn head(title: &str, style: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"generator\" content=\"flexarm {}\">\n<title>{}</title>\n\
         <style>\n{}{STYLE}{style}</style>\n</head>\n<body>\n",
        env!("CARGO_PKG_VERSION"),
        markup(title),
        colors()
    )
}

/// Returns a list of warnings, those of one kind merged; nothing if there are none.
///
/// * `who`: what they are about, in front of their number; HTML.
pub fn warnings(who: &str, texts: &[String]) -> String {
    let items: String = gathered(texts).iter().map(|text| format!("<li>{}</li>", markup(text))).collect();
    let count = match texts.len() {
        0 => return String::new(),
        1 => "1 warning".to_owned(),
        n => format!("{n} warnings"),
    };
    format!("<details class=\"warnings\" open><summary>{who}{count}</summary><ul>{items}</ul></details>\n")
}

/// Colours of the curves as CSS variables: `--c0` and so on, `--x`, `--y`, `--z`, `--rigid`, with a
/// dark variant for dark colour schemes, in which the plots of the page change theirs too; and as
/// `--paper-...` for print.
fn colors() -> String {
    let named = |ground: Ground| -> Vec<(String, Rgb)> {
        let series = (0..palette::SERIES_LENGTH).map(|k| (format!("c{k}"), palette::series(k, ground)));
        let axes = ["x", "y", "z"].into_iter().enumerate().map(|(k, name)| (name.to_owned(), palette::axis(k, ground)));
        series.chain(axes).chain([("rigid".to_owned(), palette::rigid(ground))]).collect()
    };
    let list = |prefix: &str, ground: Ground| -> String {
        named(ground).into_iter().map(|(name, color)| format!(" --{prefix}{name}: {};", hex(color))).collect()
    };
    // Plots have the colours of paper in their attributes, which a style overrides.
    let mut dark = String::new();
    for (name, color) in named(Ground::Paper) {
        let paper = hex(color).to_uppercase();
        let _ = writeln!(
            dark,
            "svg [stroke=\"{paper}\"] {{ stroke: var(--{name}); }} svg [fill=\"{paper}\"] {{ fill: var(--{name}); }}"
        );
    }
    format!(
        ":root {{{}{} }}\n@media screen and (prefers-color-scheme: dark) {{ :root {{{} }}\n{dark}}}\n",
        list("", Ground::Paper),
        list("paper-", Ground::Paper),
        list("", Ground::Dark)
    )
}
