//! Content of a verification: cases with text, tables, figures and claims; as Markdown and as JSON.
//!
//! Numbers keep their full value until they are printed. Relative errors below `FLOOR` are
//! printed as such: they are rounding and differ between machines.

use flexarm_draw::{Panel, PlotError};
use serde::Serialize;

/// Relative errors below this are printed as "< 1e-9".
pub(crate) const FLOOR: f64 = 1e-9;

/// One case study.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Case {
    /// Name on the command line.
    pub name: String,
    /// Heading.
    pub title: String,
    /// Subject and truths, in a line.
    pub summary: String,
    /// Content, in order.
    pub blocks: Vec<Block>,
}

/// A piece of a case.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// A heading within the case.
    Heading(String),
    /// A paragraph, Markdown.
    Text(String),
    /// Numbers.
    Table(Table),
    /// Curves.
    Figure(Figure),
    /// A measured number and its bound.
    Claim(Claim),
}

/// A table, with the truth that its numbers are compared with.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    /// Description, with truth and units unless the column heads state them.
    pub caption: String,
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// Cells, one vector per row.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// A word.
    Text(String),
    /// A number and how it is printed.
    Number {
        /// In the unit of the column; relative errors as fractions.
        value: f64,
        /// Print format.
        #[serde(skip)]
        format: NumberFormat,
    },
}

/// Print format of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberFormat {
    /// With this number of decimals.
    Decimals(usize),
    /// With this number of significant digits.
    Digits(usize),
    /// Relative error without sign.
    Error,
    /// Relative difference with sign.
    Signed,
}

/// Curves over a common axis.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Figure {
    /// Stem of the file name.
    pub name: String,
    /// Description.
    pub caption: String,
    /// Label of the horizontal axis.
    pub x_label: String,
    /// Whether the horizontal axis is logarithmic.
    pub logarithmic_x: bool,
    /// Curves.
    #[serde(skip)]
    pub panels: Vec<Panel>,
}

/// A measured number with the bound that it must satisfy.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// Statement.
    pub text: String,
    /// Truth that the number is compared with.
    pub truth: String,
    /// Measured number.
    pub measured: f64,
    /// Bound.
    pub bound: Bound,
    /// Whether the number comes from stored figures, so that it does not change with the program.
    pub stored: bool,
    /// Whether the claim holds.
    pub holds: bool,
}

/// A bound.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// Upper bound.
    AtMost(f64),
    /// Lower bound, for an effect that must be visible.
    AtLeast(f64),
}

impl Bound {
    fn is_met(self, x: f64) -> bool {
        match self {
            Self::AtMost(bound) => x <= bound,
            Self::AtLeast(bound) => x >= bound,
        }
    }

    fn text(self) -> String {
        match self {
            Self::AtMost(bound) => format!("≤ {}", bare_error(bound)),
            Self::AtLeast(bound) => format!("≥ {}", bare_error(bound)),
        }
    }
}

impl Claim {
    /// Returns the measured number as printed.
    pub fn found(&self) -> String {
        if self.measured.is_finite() { bare_error(self.measured) } else { "-".into() }
    }

    /// Returns the bound as printed.
    pub fn limit(&self) -> String {
        self.bound.text()
    }
}

impl Case {
    /// Creates a case without content.
    pub(crate) fn new(name: &str, title: &str, summary: &str) -> Self {
        Self { name: name.into(), title: title.into(), summary: summary.into(), blocks: Vec::new() }
    }

    /// Adds a heading.
    pub(crate) fn heading(&mut self, text: &str) {
        self.blocks.push(Block::Heading(text.into()));
    }

    /// Adds a paragraph.
    pub(crate) fn text(&mut self, text: impl Into<String>) {
        self.blocks.push(Block::Text(text.into()));
    }

    /// Adds a table.
    pub(crate) fn table(&mut self, table: Table) {
        self.blocks.push(Block::Table(table));
    }

    /// Adds a figure.
    pub(crate) fn figure(&mut self, figure: Figure) {
        self.blocks.push(Block::Figure(figure));
    }

    /// Adds a claim; a number that is not finite violates it.
    pub(crate) fn claim(&mut self, text: impl Into<String>, truth: impl Into<String>, measured: f64, bound: Bound) {
        self.add_claim(text.into(), truth.into(), measured, bound, false);
    }

    /// Adds a claim about stored figures, which no run of today changes.
    pub(crate) fn stored_claim(
        &mut self,
        text: impl Into<String>,
        truth: impl Into<String>,
        measured: f64,
        bound: Bound,
    ) {
        self.add_claim(text.into(), truth.into(), measured, bound, true);
    }

    fn add_claim(&mut self, text: String, truth: String, measured: f64, bound: Bound, stored: bool) {
        let holds = bound.is_met(measured);
        self.blocks.push(Block::Claim(Claim { text, truth, measured, bound, stored, holds }));
    }

    /// Returns the claims, in order.
    pub fn claims(&self) -> impl Iterator<Item = &Claim> {
        self.blocks.iter().filter_map(|block| match block {
            Block::Claim(claim) => Some(claim),
            _ => None,
        })
    }

    /// Returns the figures, in order.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.blocks.iter().filter_map(|block| match block {
            Block::Figure(figure) => Some(figure),
            _ => None,
        })
    }
}

impl Table {
    /// Creates a table with these column heads.
    pub(crate) fn new(caption: impl Into<String>, columns: &[&str]) -> Self {
        Self { caption: caption.into(), columns: columns.iter().map(|&c| c.into()).collect(), rows: Vec::new() }
    }
}

impl Figure {
    /// Returns the picture as SVG.
    ///
    /// # Errors
    /// If there is nothing to draw.
    pub(crate) fn svg(&self) -> Result<String, PlotError> {
        flexarm_draw::page_plot(&self.x_label, self.logarithmic_x, &self.panels)
    }
}

/// A word as a cell.
pub(crate) fn word(text: impl Into<String>) -> Cell {
    Cell::Text(text.into())
}

/// A number with the given number of decimals.
pub(crate) fn fixed(value: f64, decimals: usize) -> Cell {
    Cell::Number { value, format: NumberFormat::Decimals(decimals) }
}

/// A number with the given number of significant digits.
pub(crate) fn digits(value: f64, digits: usize) -> Cell {
    Cell::Number { value, format: NumberFormat::Digits(digits) }
}

/// A relative error.
pub(crate) fn error(value: f64) -> Cell {
    Cell::Number { value: value.abs(), format: NumberFormat::Error }
}

/// A relative difference with its sign.
pub(crate) fn signed(value: f64) -> Cell {
    Cell::Number { value, format: NumberFormat::Signed }
}

impl Cell {
    /// Returns the cell as printed.
    pub(crate) fn print(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number { value, .. } if !value.is_finite() => "-".into(),
            Self::Number { value, format: NumberFormat::Decimals(n) } => {
                let text = format!("{value:.n$}");
                // Print zero without a sign.
                let is_zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
                if is_zero { text.trim_start_matches('-').into() } else { text }
            }
            Self::Number { value, format: NumberFormat::Digits(n) } => significant(*value, *n),
            Self::Number { value, format: NumberFormat::Error } => bare_error(*value),
            Self::Number { value, format: NumberFormat::Signed } => {
                let size = bare_error(value.abs());
                let sign = if *value < 0.0 { "-" } else { "+" };
                if value.abs() < FLOOR { size } else { format!("{sign}{size}") }
            }
        }
    }
}

/// Formats an error in per cent where that is readable, otherwise with an exponent.
pub(crate) fn bare_error(x: f64) -> String {
    match x {
        _ if x < FLOOR => "< 1e-9".into(),
        _ if x < 1e-3 => format!("{x:.1e}"),
        _ => format!("{} %", significant(100.0 * x, 2)),
    }
}

/// Formats a number within a sentence: six significant digits, without trailing zeros.
pub(crate) fn plain(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    if rounded != 0.0 && !(1e-4..1e6).contains(&rounded.abs()) { format!("{rounded:e}") } else { rounded.to_string() }
}

/// Formats a percentage within a sentence with the given number of decimals, with its sign.
pub(crate) fn percent(x: f64, decimals: usize) -> String {
    format!("{:.decimals$}", 100.0 * x)
}

/// Joins names with commas and "and" before the last: `3, 4 and 8`.
pub(crate) fn listed(names: &[impl ToString]) -> String {
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => names.concat(),
    }
}

/// Formats `n` significant digits, without an exponent between 1e-4 and 1e6.
fn significant(x: f64, n: usize) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let scientific = format!("{:.*e}", n - 1, x);
    let exponent: i32 = scientific.split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return scientific;
    }
    format!("{:.*}", (n as i32 - 1 - exponent).max(0) as usize, x)
}

/// Returns the page of a case, Markdown; its pictures are in the same folder.
pub(crate) fn markdown(case: &Case) -> String {
    let mut text = format!("# {}\n", case.title);
    for block in &case.blocks {
        match block {
            Block::Heading(heading) => text += &format!("\n## {heading}\n"),
            Block::Text(paragraph) => text += &format!("\n{paragraph}\n"),
            Block::Table(table) => text += &format!("\n{}", table_text(table)),
            Block::Figure(Figure { name, caption, .. }) => {
                text += &format!("\n![{caption}]({name}.svg)\n\n*{caption}*\n");
            }
            Block::Claim(_) => {}
        }
    }
    text + "\n## Claims\n" + &table_text(&claims_table(case))
}

pub(crate) fn table_text(table: &Table) -> String {
    let row = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let heads = row(table.columns.clone()) + &row(vec!["---".into(); table.columns.len()]);
    let rows: String = table.rows.iter().map(|cells| row(cells.iter().map(Cell::print).collect())).collect();
    let caption = if table.caption.is_empty() { String::new() } else { format!("{}\n", table.caption) };
    format!("{caption}\n{heads}{rows}")
}

/// Lists the claims of a case.
pub(crate) fn claims_table(case: &Case) -> Table {
    let mut table = Table::new("", &["claim", "truth", "measured", "bound", ""]);
    for claim in case.claims() {
        let holds = if claim.holds { "holds" } else { "**does not hold**" };
        let holds = if claim.stored { format!("{holds}, stored") } else { holds.to_owned() };
        let cells = [claim.text.clone(), claim.truth.clone(), claim.found(), claim.limit(), holds];
        table.rows.push(cells.into_iter().map(word).collect());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_printed_as_a_person_reads_them() {
        let cases = [
            (error(3.21e-12), "< 1e-9"),
            (error(-4.56e-7), "4.6e-7"),
            (error(0.00655), "0.66 %"),
            (error(0.166), "17 %"),
            (error(1.5), "150 %"),
            (signed(-0.041), "-4.1 %"),
            (signed(2e-10), "< 1e-9"),
            (fixed(-0.00001, 3), "0.000"),
            (digits(17.42284, 6), "17.4228"),
            (digits(2.675693401e-7, 4), "2.676e-7"),
            (digits(0.0, 4), "0"),
            (fixed(f64::NAN, 2), "-"),
        ];
        for (cell, text) in cases {
            assert_eq!(cell.print(), text);
        }
    }

    #[test]
    fn numbers_in_sentences_have_no_more_digits_than_they_need() {
        let found = [1e6 * 1e-5, 1e3 * 1e-4, 0.8, 1.0, 1e-9, 1e-4, 1e3 * 0.3, 2e7, -0.5].map(plain);
        assert_eq!(found, ["10", "0.1", "0.8", "1", "1e-9", "0.0001", "300", "2e7", "-0.5"]);
        assert_eq!([percent(0.0394, 0), percent(-0.3, 0), percent(0.00617, 1)], ["4", "-30", "0.6"]);
        assert_eq!([listed(&[3, 4, 8]), listed(&[2, 3]), listed(&[7])], ["3, 4 and 8", "2 and 3", "7"]);
    }

    /// Truth: Markdown by hand.
    #[test]
    fn a_table_is_caption_heads_line_and_rows() {
        let mut table = Table::new("What it shows.", &["model", "error"]);
        table.rows.push(vec![word("2 parts"), signed(-0.166)]);
        assert_eq!(table_text(&table), "What it shows.\n\n| model | error |\n| --- | --- |\n| 2 parts | -17 % |\n");
        table.caption.clear();
        assert!(table_text(&table).starts_with("\n| model |"));
    }

    /// A claim that reaches its bound exactly holds; one that exceeds it fails, is counted, and is
    /// printed in bold.
    #[test]
    fn a_claim_fails_when_its_bound_is_passed() {
        let bounds = [(Bound::AtMost(0.01), [true, true, false]), (Bound::AtLeast(0.01), [false, true, true])];
        for (bound, expected) in bounds {
            let mut case = Case::new("a", "A", "");
            for measured in [0.0099, 0.01, 0.0101] {
                case.claim("x", "y", measured, bound);
            }
            assert_eq!(case.claims().map(|claim| claim.holds).collect::<Vec<_>>(), expected, "{bound:?}");
            let printed = table_text(&claims_table(&case));
            assert_eq!(printed.matches("**does not hold**").count(), expected.iter().filter(|holds| !**holds).count());
        }
        let mut case = Case::new("a", "A", "");
        case.claim("sag", "by hand", 2e-3, Bound::AtMost(1e-3));
        let row = "| sag | by hand | 0.20 % | ≤ 0.10 % | **does not hold** |\n";
        assert!(table_text(&claims_table(&case)).ends_with(row));
    }

    #[test]
    fn what_is_no_number_holds_no_bound() {
        let mut case = Case::new("a", "A", "");
        case.claim("x", "y", f64::NAN, Bound::AtMost(1.0));
        case.claim("x", "y", f64::NAN, Bound::AtLeast(1.0));
        case.claim("x", "y", 0.5, Bound::AtMost(1.0));
        assert_eq!(case.claims().map(|c| c.holds).collect::<Vec<_>>(), [false, false, true]);
    }
}
