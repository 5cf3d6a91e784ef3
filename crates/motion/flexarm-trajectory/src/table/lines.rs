//! Header, separator and lines of a table, and the units that its comments state.
//!
//! Start at [`Table::find`]: it looks for the separator with which the lines below the header have
//! as many fields as the header. Lines are counted from 1. Not here: which column is which joint
//! (`layout`), numbers (`dialect`).

use flexarm_settings::{Finding, Place, Setting};

use super::dialect::{Separator, clock_time, number};
use super::header::{Measure, Unit, name_and_unit, unit};
use super::request::TableRequest;
use crate::findings::{self, bad_value, fault, unknown_unit};

/// The lines of a table.
pub(super) struct Table<'t> {
    pub(super) text: &'t str,
    pub(super) file: Place,
    pub(super) separator: Separator,
    pub(super) header_line: usize,
    pub(super) names: Vec<String>,
    /// Units from a second header line that holds only units.
    pub(super) units: Vec<Option<Unit>>,
    /// Number and text of each line of numbers.
    pub(super) lines: Vec<(usize, &'t str)>,
    /// Whether comments state that angles are in degrees, with the line.
    pub(super) degrees: Option<(usize, bool)>,
    /// Prismatic joints named by comments, with the line.
    pub(super) metres: Vec<(usize, String)>,
    /// Cut-off of a smoothing that a comment states (Hz), with the line.
    pub(super) cutoff: Option<(usize, f64)>,
    /// Whether the last line is terminated.
    pub(super) ends_whole: bool,
    /// First and last line of the text above the header.
    pub(super) preamble: Option<(usize, usize)>,
}

fn is_comment(line: &str) -> bool {
    let line = line.trim_start();
    // rostopic names its first column `%time`.
    line.starts_with('#') || line.starts_with("//") || (line.starts_with('%') && !line.starts_with("%time"))
}

fn are_numbers(fields: &[String]) -> bool {
    fields.iter().all(|field| number(field).is_some())
}

/// Returns line and names of the header of a file that begins with numbers: those of the last comment
/// before them, as numpy writes it, or empty names if the request counts columns.
///
/// * `first`: the first line of numbers, `comment`: that comment, each with its line.
fn header_of_numbers(
    separator: Separator,
    first: (usize, &str),
    comment: Option<(usize, &str)>,
    request: &TableRequest<'_>,
) -> Result<(usize, Vec<String>), Box<Finding>> {
    let width = separator.split(first.1).len();
    let named = comment
        .map(|(line, text)| (line, separator.split(text.trim_start().trim_start_matches(['#', '%', '/']).trim())));
    let named = named
        .filter(|(_, names)| names.len() == width && !are_numbers(names) && names.iter().all(|name| !name.is_empty()));
    let by_number = request.columns.is_some_and(|map| map.time.as_ref().is_some_and(|t| t.starts_with('#')));
    match named {
        Some(header) => Ok(header),
        None if by_number => Ok((first.0, vec![String::new(); width])),
        None => {
            let message = format!(
                "the table has {width} columns of numbers and no header; put one above (`time,<joint>,...`), \
                 or tell the columns by number: {} t=#1[s],<joint>=#2[rad]",
                Setting::Columns
            );
            Err(fault("no-header", message))
        }
    }
}

impl<'t> Table<'t> {
    /// Finds header and separator.
    ///
    /// * `file`: place for messages.
    pub(super) fn find(text: &'t str, file: Place, request: &TableRequest<'_>) -> Result<Self, Box<Finding>> {
        let ends_whole = text.ends_with(['\n', '\r']);
        let lines = || text.split(['\n']).map(|line| line.trim_end_matches('\r')).enumerate().map(|(i, l)| (i + 1, l));
        let mut content = lines().filter(|(_, line)| !line.trim().is_empty() && !is_comment(line));
        let Some((first_line, first)) = content.next() else {
            let message = "the file is empty; expected a header `time,<joint>,...` and at least two rows";
            return Err(findings::at(&file, fault("empty", message)));
        };
        let second = content.next();
        // A file of numbers alone, or a header with or without text above it.
        let numeric = Separator::ALL.into_iter().find(|separator| {
            let fields = separator.split(first);
            fields.len() > 1 && are_numbers(&fields)
        });
        let (separator, header_line, names, from) = if let Some(separator) = numeric {
            let comment =
                lines().take_while(|(line, _)| *line < first_line).filter(|(_, line)| is_comment(line)).last();
            let (line, names) = header_of_numbers(separator, (first_line, first), comment, request)
                .map_err(|fault| findings::at(&file.line(first_line), fault))?;
            (separator, line, names, first_line)
        } else {
            match below_preamble(
                &lines().filter(|(_, l)| !l.trim().is_empty() && !is_comment(l)).take(200).collect::<Vec<_>>(),
            ) {
                Some((separator, line, names)) => (separator, line, names, line + 1),
                None => {
                    let separator = separator_of(first, second.map(|(_, line)| line));
                    (separator, first_line, separator.split(first), first_line + 1)
                }
            }
        };
        // Below the header: a line of units, if there is one, then the lines of numbers.
        let preamble = if header_line > first_line { Some((first_line, header_line - 1)) } else { None };
        let mut lines: Vec<(usize, &str)> =
            lines().filter(|(n, line)| *n >= from && !line.trim().is_empty() && !is_comment(line)).collect();
        let mut units = vec![None; names.len()];
        if let Some(found) = lines.first().and_then(|(_, line)| units_alone(&separator.split(line), names.len())) {
            units = found;
            lines.remove(0);
        }
        let mut table = Self {
            text,
            file,
            separator,
            header_line,
            names,
            units,
            lines,
            degrees: None,
            metres: Vec::new(),
            cutoff: None,
            ends_whole,
            preamble,
        };
        table.read_comments()?;
        Ok(table)
    }

    /// Adds the place of a line to an error.
    pub(super) fn at(&self, line: usize, fault: Box<Finding>) -> Box<Finding> {
        findings::at(&self.file.line(line), fault)
    }

    /// Adds the place of a field, from 0, in a line to an error.
    pub(super) fn at_field(&self, line: usize, field: usize, fault: Box<Finding>) -> Box<Finding> {
        findings::at(&self.place(line, field), fault)
    }

    /// Adds the place of a column, from 0, in the header to an error.
    pub(super) fn at_column(&self, column: usize, fault: Box<Finding>) -> Box<Finding> {
        self.at_field(self.header_line, column, fault)
    }

    /// Place of a field, from 0, in a line.
    pub(super) fn place(&self, line: usize, field: usize) -> Place {
        let column = self.text.lines().nth(line - 1).and_then(|text| self.separator.column(text, field));
        Place { column, ..self.file.line(line) }
    }

    /// Reads the units that comments state.
    fn read_comments(&mut self) -> Result<(), Box<Finding>> {
        for (i, line) in self.text.lines().enumerate().filter(|(_, line)| line.starts_with('#')) {
            let Some((key, value)) = line[1..].split_once(':') else { continue };
            // Comments with other keys, or other units of time, are ignored here.
            let (line, value) = (i + 1, value.trim());
            match (key.trim(), value) {
                ("unit", "rad" | "deg") => {
                    let degrees = value == "deg";
                    if self.degrees.is_some_and(|(_, before)| before != degrees) {
                        let first = if degrees { "rad" } else { "deg" };
                        return Err(self.at(line, findings::contradicting_units(first, value)));
                    }
                    self.degrees = Some((line, degrees));
                }
                ("unit", found) => {
                    return Err(self.at(line, unknown_unit("unit", found, "rad, deg")));
                }
                ("metres", names) => {
                    self.metres.extend(names.split(',').map(|name| (line, name.trim().to_owned())));
                }
                ("cutoff", found) => {
                    let hz = found.strip_suffix("Hz").and_then(|number| number.trim().parse().ok());
                    let wrong = || self.at(line, bad_value("cutoff", found, "Hz, such as 20 Hz"));
                    self.cutoff = Some((line, hz.ok_or_else(wrong)?));
                }
                ("time", found) if found != "s" && unit(found).is_none_or(|unit| unit.measure == Measure::Time) => {
                    return Err(self.at(line, unknown_unit("time", found, "s")));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Whether the header is that of samples: a column `time`, and no units, which are s and rad
    /// unless a comment states another one.
    pub(super) fn is_own(&self, request: &TableRequest<'_>) -> bool {
        let is_known = |name: &str| request.joints.is_some_and(|joints| joints.iter().any(|joint| joint.name == name));
        let is_plain = |name: &String| is_known(name) || matches!(name_and_unit(name), (_, None, None));
        request.columns.is_none()
            && self.names.iter().any(|name| name == "time")
            && self.units.iter().all(Option::is_none)
            && !self.is_run()
            && self.names.iter().all(is_plain)
    }

    /// Whether the table is that of a run.
    pub(super) fn is_run(&self) -> bool {
        let has = |name: &str| self.names.iter().any(|own| own == name);
        has("time")
            && has("flexible_x_m")
            && has("kinetic_energy_j")
            && self.names.iter().any(|n| run_joint(n).is_some())
    }
}

/// The joint of a column of `run.csv`, and whether it is prismatic.
pub(super) fn run_joint(name: &str) -> Option<(&str, bool)> {
    let joint = name.strip_suffix("_position_rad").map(|joint| (joint, false));
    joint.or_else(|| name.strip_suffix("_position_m").map(|joint| (joint, true)))
}

/// Separator of a header: preferably one with which the line below has the same number of fields.
fn separator_of(header: &str, below: Option<&str>) -> Separator {
    let width = |separator: &Separator| separator.split(header).len();
    let fits = |separator: &&Separator| {
        below.is_some_and(|line| {
            let fields = separator.split(line);
            fields.len() == width(separator) && fields.iter().filter(|field| number(field).is_some()).count() > 1
        })
    };
    let several = |separator: &&Separator| width(separator) > 1;
    let candidates: Vec<Separator> = Separator::ALL.iter().filter(several).copied().collect();
    candidates.iter().find(fits).or_else(|| candidates.first()).copied().unwrap_or(Separator::Comma)
}

/// Separator, line and names of a header below a preamble: the line directly above the first line
/// of numbers, with the same number of fields. `None` if the first line could be the header.
fn below_preamble(lines: &[(usize, &str)]) -> Option<(Separator, usize, Vec<String>)> {
    let are_numbers = |separator: &Separator, line: &str| {
        let fields = separator.split(line);
        let numbers = fields.iter().filter(|field| number(field).is_some() || clock_time(field).is_some()).count();
        fields.len() > 1 && 2 * numbers > fields.len()
    };
    let find = |(i, (_, line)): (usize, &(usize, &str))| {
        Separator::ALL.into_iter().find(|separator| are_numbers(separator, line)).map(|separator| (i, separator))
    };
    let (row, separator) = lines.iter().enumerate().find_map(find)?;
    let width = separator.split(lines[row].1).len();
    let fits = |i: usize| separator.split(lines[i].1).len() == width;
    let above = row.checked_sub(1).filter(|above| fits(*above))?;
    let is_units = units_alone(&separator.split(lines[above].1), width).is_some();
    let header = above.checked_sub(usize::from(is_units)).filter(|header| fits(*header))?;
    (header > 0 && !fits(0)).then(|| (separator, lines[header].0, separator.split(lines[header].1)))
}

/// Units of a line that holds nothing else.
fn units_alone(fields: &[String], width: usize) -> Option<Vec<Option<Unit>>> {
    let units: Vec<Option<Unit>> = fields.iter().map(|field| unit(field)).collect();
    let is_unit = |(field, unit): (&String, &Option<Unit>)| unit.is_some() || field.is_empty() || field == "-";
    let all = fields.len() == width && fields.iter().zip(&units).all(is_unit);
    (all && units.iter().any(Option::is_some)).then_some(units)
}
