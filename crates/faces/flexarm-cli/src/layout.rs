//! Text that fits the terminal: tables and paragraphs, in which no number and no word is cut.
//!
//! Start at [`table`]: a table that is too wide is printed in blocks of columns, each with the
//! first column. Widths are counted in columns of the terminal without ANSI codes.

use flexarm::settings::written::one_line;

/// Minimum width (columns); narrower terminals are treated like this.
pub(crate) const MIN_WIDTH: usize = 40;
/// Columns that the longest name leaves free, for a number beside it.
const BESIDE_A_NAME: usize = 20;
/// Minimum width of a column of text, unless it is narrower by itself.
const MIN_TEXT: usize = 16;
/// Maximum width of a number with its unit.
const LONGEST_NUMBER: usize = 24;
/// Blanks between two columns.
const GAP: &str = "  ";

/// Note that names are shortened.
const SHORTENED: &str = "names that end in … are shortened: --json has them whole\n";

/// A table: a row of names, then rows of numbers and words. Columns of numbers are aligned to the
/// right; the first column has the labels of the rows.
pub struct TextTable {
    rows: Vec<Vec<String>>,
}

/// Returns a table with these names of columns, which may be empty.
pub fn table<C: AsRef<str>>(header: &[C]) -> TextTable {
    TextTable { rows: vec![header.iter().map(|name| one_line(name.as_ref())).collect()] }
}

/// Formats a table for the terminal.
pub(crate) fn lines(table: &TextTable) -> String {
    table.text(crate::terminal::columns())
}

impl TextTable {
    /// Adds a row.
    pub fn add_row<C: ToString>(&mut self, cells: impl IntoIterator<Item = C>) {
        self.rows.push(cells.into_iter().map(|cell| one_line(&cell.to_string())).collect());
    }

    /// Formats the table in lines of at most `width` columns: names of columns and words are
    /// wrapped; columns that still do not fit follow below, with the labels again.
    pub fn text(&self, width: usize) -> String {
        let width = width.max(MIN_WIDTH);
        let longest = width - BESIDE_A_NAME;
        let cell = |cell: &String| cell.split(' ').map(|word| shortened(word, longest)).collect::<Vec<_>>().join(" ");
        let rows: Vec<Vec<String>> = self.rows.iter().map(|row| row.iter().map(cell).collect()).collect();
        let all: Vec<Column> =
            (0..rows.iter().map(Vec::len).max().unwrap_or(0)).map(|k| Column::of(&rows, k)).collect();
        // As few blocks as fit, and then as narrow as that number allows.
        let few = blocks(&all, width);
        let even = (0..width).rev().map(|width| blocks(&all, width)).take_while(|more| more.len() == few.len()).last();
        let parts: Vec<String> = even.unwrap_or(few).iter().map(|shown| block(&rows, &all, shown, width)).collect();
        parts.join("\n") + &if rows == self.rows { String::new() } else { filled(SHORTENED, width) }
    }
}

/// Returns the columns that fit side by side, after the labels.
fn blocks(all: &[Column], width: usize) -> Vec<Vec<usize>> {
    let labels = 1 + all.first().map_or(0, |labels| labels.least);
    let (mut blocks, mut used) = (vec![vec![0]], labels);
    for (k, column) in all.iter().enumerate().skip(1) {
        let own = GAP.len() + column.least;
        if used + own > width && used > labels {
            blocks.push(vec![0]);
            used = labels;
        }
        used += own;
        blocks.last_mut().expect("a block").push(k);
    }
    blocks
}

/// Widths of a column.
struct Column {
    has_numbers: bool,
    /// Width of the widest cell below the name.
    cells: usize,
    /// Width in which no word and no number is cut.
    least: usize,
    /// Width without a wrapped line.
    most: usize,
}

impl Column {
    fn of(rows: &[Vec<String>], k: usize) -> Self {
        let name = rows[0].get(k).map_or("", String::as_str);
        let cells = || rows[1..].iter().filter_map(|row| row.get(k)).map(String::as_str);
        let filled = || cells().filter(|cell| !["", "-"].contains(cell));
        let has_numbers = k > 0 && 2 * filled().filter(|cell| is_number(cell)).count() >= filled().count();
        let word = |text: &str| text.split(' ').map(columns).max().unwrap_or(0);
        let widest = cells().map(columns).max().unwrap_or(0);
        let least = match has_numbers {
            true => widest,
            false => cells().map(word).max().unwrap_or(0).max(widest.min(MIN_TEXT)),
        };
        Self { has_numbers, cells: widest, least: least.max(word(name)), most: widest.max(columns(name)) }
    }
}

/// Whether a cell is a number, with whatever short text follows it, such as a unit.
fn is_number(cell: &str) -> bool {
    if cell.contains(',') || columns(cell) > LONGEST_NUMBER {
        return false;
    }
    let digits = cell.trim_start_matches(['+', '-', '(', '<']);
    digits.starts_with(|c: char| c.is_ascii_digit()) || ["NaN", "inf"].contains(&digits)
}

/// Formats some columns of a table side by side.
fn block(rows: &[Vec<String>], all: &[Column], shown: &[usize], width: usize) -> String {
    let mut widths: Vec<usize> = all.iter().map(|column| column.most).collect();
    let total = |widths: &[usize]| 1 + shown.iter().map(|k| widths[*k] + GAP.len()).sum::<usize>() - GAP.len();
    while !all.is_empty() && total(&widths) > width {
        let widest = |least: fn(&Column) -> usize| {
            shown.iter().copied().filter(|k| widths[*k] > least(&all[*k])).max_by_key(|k| widths[*k])
        };
        // The names of columns are wrapped before the words below them.
        let Some(k) = widest(|column| column.least.max(column.cells)).or_else(|| widest(|column| column.least)) else {
            break;
        };
        widths[k] -= 1;
    }
    let mut out = String::new();
    for (number, row) in rows.iter().enumerate().filter(|(_, row)| row.iter().any(|cell| !cell.is_empty())) {
        let cells: Vec<Vec<String>> =
            shown.iter().map(|k| wrapped(row.get(*k).map_or("", String::as_str), widths[*k])).collect();
        let height = cells.iter().map(Vec::len).max().unwrap_or(0);
        for line in 0..height {
            let part = |(own, k): (&Vec<String>, &usize)| {
                // Names of columns stand directly above them.
                let text = match number {
                    0 => (line + own.len()).checked_sub(height).and_then(|line| own.get(line)),
                    _ => own.get(line),
                };
                let text = text.map_or("", String::as_str);
                let blanks = " ".repeat(widths[*k].saturating_sub(columns(text)));
                if all[*k].has_numbers { blanks + text } else { text.to_owned() + &blanks }
            };
            let parts: Vec<String> = cells.iter().zip(shown).map(part).collect();
            out += &format!(" {}", parts.join(GAP));
            out.truncate(out.trim_end_matches(' ').len());
            out.push('\n');
        }
    }
    out
}

/// Width of a text on the terminal, one column per character, which holds for the letters of robot
/// names.
pub fn columns(text: &str) -> usize {
    text.chars().count()
}

/// Shortens the text to at most `width_left` columns.
fn shortened(text: &str, width_left: usize) -> String {
    if columns(text) <= width_left {
        return text.to_owned();
    }
    text.chars().take(width_left.saturating_sub(1)).chain(['…']).collect()
}

/// Splits text at blanks into lines of at most `width` columns.
pub(crate) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if columns(line) + 1 + columns(word) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Breaks the lines of a text at blanks, best behind a comma, so that they have at most `width`
/// columns. A longer word, such as a path, stays whole.
pub fn filled(text: &str, width: usize) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let indent = " ".repeat(columns(line) - columns(line.trim_start()) + 2);
        let mut rest = line.to_owned();
        while let Some(at) = line_break(&rest, width, indent.len()) {
            out += &format!("{}\n", rest[..at].trim_end());
            rest = indent.clone() + &rest[at..];
        }
        out += &format!("{rest}\n");
    }
    out
}

/// Returns the byte at which a line that is too long continues on the next one.
fn line_break(line: &str, width: usize, indent: usize) -> Option<usize> {
    if columns(line) <= width {
        return None;
    }
    let start = line.len() - line.trim_start().len();
    let breaks = || line.match_indices(' ').map(|(k, _)| k + 1).filter(|k| *k > start && !line[*k..].starts_with(' '));
    let before = |at: usize| columns(line[..at].trim_end());
    let word = |at: usize| columns(line[at..].split(' ').next().unwrap_or_default());
    let fits = |at: &usize| before(*at) <= width && indent + word(*at) <= width;
    let comma = |at: &usize| before(*at) > width / 2 && line[..*at].trim_end().ends_with([',', ';']);
    let fitting = || breaks().filter(fits);
    fitting().rfind(comma).or_else(|| fitting().next_back()).or_else(|| breaks().find(|at| before(*at) > width))
}
