//! Tables of joint values from other programs: any separator, decimal points or commas, units in
//! the column names, columns that are not part of the motion; and `run.csv`, the table of a run of
//! this library.
//!
//! What the table leaves open is either given by the user ([`ColumnMap`]) or assumed, with a
//! [`Warning`]. The library's own format ([`crate::csv_file`]) is read unchanged: a table with
//! commas, a column `time` and no units in its header.
//!
//! * The header is the first line that is neither blank nor a comment (`#`, `%`, `//`), or the last
//!   comment before numbers begin. A second line may hold only units.
//! * A name may end with its unit: `A1[deg]`, `q1 (rad)`, `q1_deg`, `t / ms`. Names that end with
//!   `vel`, `velocity`, `acc` are rates; in `/joint_states/joint_1/position` the last part is the
//!   quantity.
//! * If the joints of the robot are known, columns with other names are dropped, with a warning.
//!
//! Start at [`Trajectory::parse_table`].

mod dialect;
mod header;

use std::collections::BTreeSet;

use self::dialect::{Decimal, Separator, clock_time, exact, number};
use self::header::{Meaning, Measure, Unit, meaning, name_and_unit, unit};
use crate::column_map::ColumnMap;
use crate::error::{FileError, TrajectoryError};
use crate::problem::{Problem, SampleError};
use crate::spline::{JointSamples, Samples, not_increasing};
use crate::trajectory::Trajectory;
use crate::warning::Warning;

/// A joint position above this (two turns) in a table without a unit is taken to be in degrees, and
/// the unit must be given.
const SUSPICIOUS_ANGLE: f64 = 4.0 * std::f64::consts::PI;
/// Maximum number of values kept.
const MOST_NUMBERS: usize = 30_000_000;

/// A joint of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownJoint<'a> {
    /// Joint name.
    pub name: &'a str,
    /// Whether the joint is prismatic (in m).
    pub is_prismatic: bool,
}

/// Information in addition to the table.
#[derive(Clone, Copy, Debug, Default)]
pub struct TableRequest<'a> {
    /// Assignment of columns to the time and the joints.
    pub columns: Option<&'a ColumnMap>,
    /// Joints of the robot; without them every column of numbers may be a joint.
    pub joints: Option<&'a [KnownJoint<'a>]>,
}

/// Summary of a table that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct TableInfo {
    /// Description of the format, such as `table, semicolons, decimal commas`.
    pub format: String,
    /// Number of rows used.
    pub rows: usize,
}

impl Trajectory {
    /// Reads sampled joint values from a table of any kind described on the module page.
    ///
    /// * `origin`: file name for messages.
    ///
    /// # Errors
    /// As [`Trajectory::parse_csv`], and if the table is ambiguous: no or several time columns,
    /// decimal commas between commas, large angles without a unit.
    pub fn parse_table(
        text: &str,
        origin: &str,
        request: &TableRequest<'_>,
    ) -> Result<(Self, TableInfo), TrajectoryError> {
        let text = text.trim_start_matches('\u{feff}');
        // Line ends of old Macintosh files.
        let with_ends = (text.contains('\r') && !text.contains('\n')).then(|| text.replace('\r', "\n"));
        let text = with_ends.as_deref().unwrap_or(text);
        let mut table = Table::find(text, request);
        if request.columns.is_none() && table.as_ref().is_ok_and(|table| table.is_own(request)) {
            let own = Self::parse_csv(text, origin);
            let rows = table.map_or(0, |table| table.lines.len());
            return own.map(|own| (own, TableInfo { format: "CSV samples".to_owned(), rows })).map_err(decimal_commas);
        }
        let read = table.as_mut().map_err(|problem| problem.take());
        read.and_then(|table| table.read(request)).map_err(|Located { line, column, problem, more_lines }| {
            let (origin, problem) = (origin.to_owned(), *problem);
            Box::new(FileError { origin, line, column, problem, more_lines }).into()
        })
    }
}

/// A row of the library's own format with twice the number of fields has decimal commas.
fn decimal_commas(error: TrajectoryError) -> TrajectoryError {
    let TrajectoryError::File(mut file) = error else { return error };
    if let Problem::Ragged { found, expected } = file.problem
        && found == 2 * expected
    {
        file.problem = Problem::DecimalCommas { found, expected };
    }
    TrajectoryError::File(file)
}

/// A problem and its place in the file.
struct Located {
    line: Option<usize>,
    column: Option<usize>,
    problem: Box<Problem>,
    /// Other lines that are wrong.
    more_lines: Vec<usize>,
}

impl Located {
    /// Moves the problem out.
    fn take(&mut self) -> Self {
        let problem = std::mem::replace(&mut self.problem, Box::new(Problem::Empty));
        Self { line: self.line, column: self.column, problem, more_lines: Vec::new() }
    }
}

fn at(line: usize, problem: Problem) -> Located {
    Located { line: Some(line), column: None, problem: Box::new(problem), more_lines: Vec::new() }
}

fn at_field(line: usize, column: usize, problem: Problem) -> Located {
    Located { column: Some(column + 1), ..at(line, problem) }
}

fn nowhere(problem: Problem) -> Located {
    Located { line: None, column: None, problem: Box::new(problem), more_lines: Vec::new() }
}

/// The lines of a table.
struct Table<'t> {
    separator: Separator,
    header_line: usize,
    names: Vec<String>,
    /// Units from a second header line that holds only units.
    units: Vec<Option<Unit>>,
    /// Number and text of each line of numbers.
    lines: Vec<(usize, &'t str)>,
    /// Units stated in the comments: whether angles are in degrees, prismatic joints.
    degrees: Option<bool>,
    metres: Vec<String>,
    /// Whether the last line is terminated.
    ends_whole: bool,
    /// First and last line of the text above the header.
    preamble: Option<(usize, usize)>,
}

fn is_comment(line: &str) -> bool {
    let line = line.trim_start();
    // rostopic names its first column `%time`.
    line.starts_with('#') || line.starts_with("//") || (line.starts_with('%') && !line.starts_with("%time"))
}

impl<'t> Table<'t> {
    /// Finds header and separator.
    fn find(text: &'t str, request: &TableRequest<'_>) -> Result<Self, Located> {
        let ends_whole = text.ends_with(['\n', '\r']);
        let lines = || text.split(['\n']).map(|line| line.trim_end_matches('\r')).enumerate().map(|(i, l)| (i + 1, l));
        let mut content = lines().filter(|(_, line)| !line.trim().is_empty() && !is_comment(line));
        let Some((first_line, first)) = content.next() else { return Err(nowhere(Problem::Empty)) };
        let second = content.next();
        // In a file without a header line the last comment before the numbers may be the header, as
        // numpy writes it.
        let comment = lines().take_while(|(line, _)| *line < first_line).filter(|(_, line)| is_comment(line)).last();
        let comment = comment.map(|(line, text)| (line, text.trim_start().trim_start_matches(['#', '%', '/']).trim()));

        let are_numbers = |fields: &[String]| fields.iter().all(|field| number(field).is_some());
        let numeric = Separator::ALL.into_iter().find(|separator| {
            let fields = separator.split(first);
            fields.len() > 1 && are_numbers(&fields)
        });
        let (separator, header_line, names, from) = if let Some(separator) = numeric {
            let width = separator.split(first).len();
            let named = comment.map(|(line, text)| (line, separator.split(text))).filter(|(_, names)| {
                names.len() == width && !are_numbers(names) && names.iter().all(|name| !name.is_empty())
            });
            let by_number = request.columns.is_some_and(|map| map.time.as_ref().is_some_and(|t| t.starts_with('#')));
            match named {
                Some((line, names)) => (separator, line, names, first_line),
                None if by_number => (separator, first_line, vec![String::new(); width], first_line),
                None => return Err(at(first_line, Problem::NoHeader { fields: width })),
            }
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
        let preamble = if header_line > first_line { Some((first_line, header_line - 1)) } else { None };
        let mut lines: Vec<(usize, &str)> =
            lines().filter(|(n, line)| *n >= from && !line.trim().is_empty() && !is_comment(line)).collect();
        let mut units = vec![None; names.len()];
        if let Some(found) = lines.first().and_then(|(_, line)| units_alone(&separator.split(line), names.len())) {
            units = found;
            lines.remove(0);
        }
        let mut table = Self {
            separator,
            header_line,
            names,
            units,
            lines,
            degrees: None,
            metres: Vec::new(),
            ends_whole,
            preamble,
        };
        table.read_comments(text)?;
        Ok(table)
    }

    /// Reads units from the comments, as in the library's own format.
    fn read_comments(&mut self, text: &str) -> Result<(), Located> {
        for (i, line) in text.lines().enumerate().filter(|(_, line)| line.starts_with('#')) {
            let Some((key, value)) = line[1..].split_once(':') else { continue };
            let value = value.trim();
            match (key.trim(), value) {
                ("unit", "rad" | "deg") => {
                    let degrees = value == "deg";
                    if self.degrees.is_some_and(|before| before != degrees) {
                        let (first, second) = (if degrees { "rad" } else { "deg" }.to_owned(), value.to_owned());
                        return Err(at(i + 1, Problem::ContradictingUnits { key: "unit", first, second }));
                    }
                    self.degrees = Some(degrees);
                }
                ("unit", found) => {
                    let found = found.to_owned();
                    return Err(at(i + 1, Problem::UnknownUnit { key: "unit", found, accepted: "rad, deg" }));
                }
                ("metres", names) => self.metres.extend(names.split(',').map(|name| name.trim().to_owned())),
                _ => {}
            }
        }
        Ok(())
    }

    /// Whether the table has the library's own format.
    fn is_own(&self, request: &TableRequest<'_>) -> bool {
        let is_known = |name: &str| request.joints.is_some_and(|joints| joints.iter().any(|joint| joint.name == name));
        let is_plain = |name: &String| is_known(name) || matches!(name_and_unit(name), (_, None, None));
        self.separator == Separator::Comma
            && self.preamble.is_none()
            && self.names.iter().any(|name| name == "time")
            && self.units.iter().all(Option::is_none)
            && !self.is_run()
            && self.names.iter().all(|name| !name.is_empty() && is_plain(name))
    }

    /// Whether the table is that of a run.
    fn is_run(&self) -> bool {
        let has = |name: &str| self.names.iter().any(|own| own == name);
        has("time")
            && has("flexible_x_m")
            && has("kinetic_energy_j")
            && self.names.iter().any(|n| run_joint(n).is_some())
    }
}

/// The joint of a column of `run.csv`, and whether it is prismatic.
fn run_joint(name: &str) -> Option<(&str, bool)> {
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

/// A column in use.
#[derive(Clone, Debug)]
struct Used {
    joint: String,
    order: usize,
    place: usize,
    scale: f64,
}

/// Assignment of columns to the time and the joints.
struct Layout {
    time: usize,
    time_unit: Option<Unit>,
    used: Vec<Used>,
    notes: Vec<Warning>,
    /// Joints whose unit is not given anywhere.
    assumed: Vec<String>,
}

impl Table<'_> {
    fn read(&self, request: &TableRequest<'_>) -> Result<(Trajectory, TableInfo), Located> {
        let mut layout = match (request.columns, self.is_run()) {
            (Some(map), _) => self.mapped(map, request)?,
            (None, true) => self.of_run()?,
            (None, false) => self.guessed(request)?,
        };
        let rows = self.rows(&layout)?;
        self.check_angles(&layout, &rows)?;
        let scale = self.time_scale(&mut layout, &rows);
        let origin = rows.times.first().copied().unwrap_or_default();
        let times: Vec<f64> = rows.times.iter().map(|t| t.since(origin) * scale).collect();
        let samples = Samples { times, joints: joints(&layout, &rows) };
        let trajectory = samples.interpolate().map_err(|error| self.placed(error, &layout, &rows))?;
        if !layout.assumed.is_empty() {
            layout.notes.push(Warning::AssumedRadians { joints: layout.assumed.clone() });
        }
        if let Some((first, last)) = self.preamble {
            layout.notes.push(Warning::Preamble { first, last });
        }
        if rows.repeated > 0 {
            layout.notes.push(Warning::RepeatedRows { count: rows.repeated });
        }
        if rows.cut {
            layout.notes.push(Warning::CutRow { line: self.lines.last().map_or(0, |(line, _)| *line) });
        }
        let decimals = if rows.comma { ", decimal commas" } else { "" };
        let kind = if self.is_run() && request.columns.is_none() { "table of a run" } else { "table" };
        let format = format!("{kind}, {}{decimals}", self.separator.in_words());
        let trajectory = layout.notes.into_iter().fold(trajectory, Trajectory::with_note);
        Ok((trajectory, TableInfo { format, rows: rows.times.len() }))
    }

    /// Layout of `run.csv`.
    fn of_run(&self) -> Result<Layout, Located> {
        let place = |name: &str| self.names.iter().position(|own| own == name);
        let used = self.names.iter().enumerate().filter_map(|(place, name)| {
            let (joint, _) = run_joint(name)?;
            Some(Used { joint: joint.to_owned(), order: 0, place, scale: 1.0 })
        });
        let time = place("time").ok_or_else(|| self.no_time())?;
        let seconds = Unit { measure: Measure::Time, per_s: 0, scale: 1.0 };
        let notes = vec![Warning::PositionsOfRun];
        Ok(Layout { time, time_unit: Some(seconds), used: used.collect(), notes, assumed: Vec::new() })
    }

    fn no_time(&self) -> Located {
        at(self.header_line, Problem::NoTimeColumnFound { found: self.names.clone() })
    }

    /// Layout given by the user.
    fn mapped(&self, map: &ColumnMap, request: &TableRequest<'_>) -> Result<Layout, Located> {
        let mut layout = Layout { time: 0, time_unit: None, used: Vec::new(), notes: Vec::new(), assumed: Vec::new() };
        let time = match &map.time {
            Some(column) => self.column(column)?,
            None => self.only_time()?,
        };
        (layout.time, layout.time_unit) = time;
        if let Some(wrong) = layout.time_unit.filter(|unit| unit.measure != Measure::Time) {
            let column = self.shown(layout.time);
            return Err(self.bad_unit(column, wrong, "a time"));
        }
        let mut taken = BTreeSet::from([layout.time]);
        for (joint, column) in &map.joints {
            let (place, unit) = self.column(column)?;
            if !taken.insert(place) {
                let problem = Problem::RepeatedColumn { name: self.shown(place), first: place + 1 };
                return Err(at_field(self.header_line, place, problem));
            }
            self.add(&mut layout, request, joint, place, unit)?;
        }
        Ok(layout)
    }

    /// Layout according to the header.
    fn guessed(&self, request: &TableRequest<'_>) -> Result<Layout, Located> {
        let known = |name: &str| request.joints.is_none_or(|joints| joints.iter().any(|joint| joint.name == name));
        let (time, time_unit) = self.only_time()?;
        let mut layout = Layout { time, time_unit, used: Vec::new(), notes: Vec::new(), assumed: Vec::new() };
        let mut dropped = Vec::new();
        for (place, column) in self.names.iter().enumerate().filter(|(place, _)| *place != time) {
            if column.is_empty() {
                // A trailing separator leaves an empty last field; an unnamed column elsewhere may
                // be a row index.
                if place + 1 < self.names.len() {
                    dropped.push(format!("#{}", place + 1));
                }
                continue;
            }
            let (name, order, unit, unknown) = self.read_name(place, request);
            let is_numeric = || self.first_row().get(place).is_some_and(|field| number(field).is_some());
            match name {
                Some(joint) if known(&joint) && (request.joints.is_some() || is_numeric()) => {
                    if let Some(found) = unknown {
                        let accepted = "rad, deg, m, mm, and rates of them";
                        return Err(at_field(
                            self.header_line,
                            place,
                            Problem::UnknownUnit { key: "column", found, accepted },
                        ));
                    }
                    if layout.used.iter().any(|used| used.joint == joint && used.order == order) {
                        let first = layout.used.iter().find(|used| used.joint == joint && used.order == order);
                        let first = first.map_or(0, |used| used.place + 1);
                        return Err(at_field(self.header_line, place, Problem::RepeatedColumn { name: joint, first }));
                    }
                    self.add_order(&mut layout, request, &joint, place, unit, order)?;
                }
                _ => dropped.push(column.clone()),
            }
        }
        // Rates without positions cannot be used.
        let (used, rates): (Vec<Used>, Vec<Used>) = {
            let has = |joint: &str| layout.used.iter().any(|used| used.joint == joint && used.order == 0);
            layout.used.iter().cloned().partition(|used| has(&used.joint))
        };
        dropped.extend(rates.iter().map(|used| self.names[used.place].clone()));
        layout.used = used;
        if layout.used.is_empty() {
            let joints = request.joints.unwrap_or_default().iter().map(|joint| joint.name.to_owned()).collect();
            return Err(at(self.header_line, Problem::NoJointColumn { found: self.names.clone(), joints }));
        }
        if !dropped.is_empty() {
            layout.notes.push(Warning::DroppedColumns { columns: dropped });
        }
        Ok(layout)
    }

    /// Joint, order, unit and unknown unit of a column; the joint is `None` if the column is not
    /// one.
    fn read_name(
        &self,
        place: usize,
        request: &TableRequest<'_>,
    ) -> (Option<String>, usize, Option<Unit>, Option<String>) {
        let column = &self.names[place];
        let is_known = |name: &str| request.joints.is_some_and(|joints| joints.iter().any(|joint| joint.name == name));
        if is_known(column) {
            return (Some(column.clone()), 0, self.units[place], None);
        }
        let (name, unit, unknown) = name_and_unit(column);
        let unit = unit.or(self.units[place]);
        if is_known(&name) {
            return (Some(name), unit.map_or(0, |unit| unit.per_s), unit, None);
        }
        match meaning(&name, unit) {
            Meaning::Joint(joint, order) => (Some(joint), order, unit, unknown),
            _ => (None, 0, unit, None),
        }
    }

    fn first_row(&self) -> Vec<String> {
        self.lines.first().map(|(_, line)| self.separator.split(line)).unwrap_or_default()
    }

    /// The only time column.
    fn only_time(&self) -> Result<(usize, Option<Unit>), Located> {
        let mut found = Vec::new();
        for (place, column) in self.names.iter().enumerate() {
            let (name, unit, _) = name_and_unit(column);
            let unit = unit.or(self.units[place]);
            if meaning(&name, unit) == Meaning::Time {
                found.push((place, unit));
            }
        }
        match found[..] {
            [one] => Ok(one),
            [] => Err(self.no_time()),
            _ => {
                let columns = found.iter().map(|(place, _)| self.names[*place].clone()).collect();
                Err(at(self.header_line, Problem::SeveralTimes { columns }))
            }
        }
    }

    /// The column that a text refers to: by number, full name, name without its unit, or name with
    /// another unit.
    fn column(&self, asked: &str) -> Result<(usize, Option<Unit>), Located> {
        let (bare, told, unknown) = name_and_unit(asked);
        let missing = || {
            let (asked, found) = (asked.to_owned(), self.names.clone());
            at(self.header_line, Problem::NoSuchColumn { asked, found })
        };
        if let Some(digits) = bare.strip_prefix('#') {
            let place: usize = digits.trim().parse().map_err(|_| missing())?;
            let place = place.checked_sub(1).filter(|place| *place < self.names.len()).ok_or_else(missing)?;
            return Ok((place, told.or_else(|| self.unit_of(place))));
        }
        if let Some(place) = self.names.iter().position(|name| name == asked) {
            return Ok((place, self.unit_of(place)));
        }
        if let (Some(found), false) = (unknown, self.names.iter().any(|name| name_and_unit(name).0 == bare)) {
            let accepted = "s, ms, us, ns, min, rad, deg, mrad, m, mm";
            return Err(nowhere(Problem::UnknownUnit { key: "columns", found, accepted }));
        }
        let matching = |name: &String| *name == bare || name_and_unit(name).0 == bare;
        let places: Vec<usize> = (0..self.names.len()).filter(|place| matching(&self.names[*place])).collect();
        match places[..] {
            [place] => Ok((place, told.or_else(|| self.unit_of(place)))),
            [] => Err(missing()),
            _ => {
                let columns = places.iter().map(|place| self.names[*place].clone()).collect();
                Err(at(self.header_line, Problem::AmbiguousColumn { asked: asked.to_owned(), columns }))
            }
        }
    }

    fn unit_of(&self, place: usize) -> Option<Unit> {
        name_and_unit(&self.names[place]).1.or(self.units[place])
    }

    fn shown(&self, place: usize) -> String {
        let name = &self.names[place];
        if name.is_empty() { format!("#{}", place + 1) } else { name.clone() }
    }

    fn bad_unit(&self, column: String, unit: Unit, expected: &'static str) -> Located {
        let found = match unit.measure {
            Measure::Time => "a time",
            Measure::Angle => "an angle",
            Measure::Length => "a length",
        };
        at(self.header_line, Problem::WrongMeasure { column, found, expected })
    }

    fn add(
        &self,
        layout: &mut Layout,
        request: &TableRequest<'_>,
        joint: &str,
        place: usize,
        unit: Option<Unit>,
    ) -> Result<(), Located> {
        // `joint_1.vel=...` refers to a rate.
        let (joint, order) = match meaning(joint, None) {
            Meaning::Joint(base, order) if order > 0 => (base, order),
            _ => (joint.to_owned(), 0),
        };
        self.add_order(layout, request, &joint, place, unit, order)
    }

    fn add_order(
        &self,
        layout: &mut Layout,
        request: &TableRequest<'_>,
        joint: &str,
        place: usize,
        unit: Option<Unit>,
        order: usize,
    ) -> Result<(), Located> {
        let known = request.joints.and_then(|joints| joints.iter().find(|known| known.name == joint));
        let is_metres = self.metres.iter().any(|name| name == joint);
        let is_prismatic = known.map(|known| known.is_prismatic).or(is_metres.then_some(true));
        if let Some(unit) = unit {
            let expected = match (is_prismatic, unit.measure) {
                (Some(true), Measure::Angle) => Some("a length: the joint is prismatic"),
                (Some(false), Measure::Length) => Some("an angle: the joint turns"),
                (_, Measure::Time) => Some("an angle or a length"),
                _ => None,
            };
            if let Some(expected) = expected {
                return Err(self.bad_unit(self.shown(place), unit, expected));
            }
            let stated = self.degrees.filter(|_| unit.measure == Measure::Angle);
            if stated.is_some_and(|degrees| degrees != (unit.scale != 1.0)) {
                let (first, second) = if unit.scale == 1.0 { ("deg", "rad") } else { ("rad", "deg") };
                let (first, second) = (first.to_owned(), second.to_owned());
                return Err(at_field(
                    self.header_line,
                    place,
                    Problem::ContradictingUnits { key: "unit", first, second },
                ));
            }
        }
        let scale = match (unit, is_prismatic, self.degrees) {
            (Some(unit), ..) => unit.scale,
            (None, Some(true), _) | (None, _, Some(false)) => 1.0,
            (None, _, Some(true)) => std::f64::consts::PI / 180.0,
            (None, _, None) => {
                // A rate has the unit of its position, which is looked up once all columns are
                // known.
                let position = layout.used.iter().find(|used| used.joint == joint && used.order == 0);
                let scale = position.filter(|_| order > 0).map_or(1.0, |used| used.scale);
                if order == 0 {
                    layout.assumed.push(joint.to_owned());
                }
                scale
            }
        };
        layout.used.push(Used { joint: joint.to_owned(), order, place, scale });
        Ok(())
    }
}

/// A time as written.
#[derive(Clone, Copy, Debug)]
struct Time {
    exact: Option<i128>,
    value: f64,
}

impl Default for Time {
    fn default() -> Self {
        Self { exact: Some(0), value: 0.0 }
    }
}

impl Time {
    /// Time elapsed since another one, without rounding either of them first.
    fn since(self, other: Self) -> f64 {
        match (self.exact, other.exact) {
            (Some(this), Some(other)) => (this - other) as f64 / 1e12,
            _ => self.value - other.value,
        }
    }
}

/// Values of the columns in use, in the order of the layout.
#[derive(Default)]
struct Rows {
    lines: Vec<usize>,
    times: Vec<Time>,
    values: Vec<Vec<f64>>,
    repeated: usize,
    cut: bool,
    comma: bool,
    /// Whether times are times of day.
    clock: bool,
}

/// First lines with a decimal point and with a decimal comma.
#[derive(Default)]
struct Decimals {
    point: Option<usize>,
    comma: Option<usize>,
}

impl Table<'_> {
    fn rows(&self, layout: &Layout) -> Result<Rows, Located> {
        let mut rows = Rows { values: vec![Vec::new(); layout.used.len()], ..Rows::default() };
        let mut decimals = Decimals::default();
        let mut wrong: Option<Located> = None;
        let last = self.lines.last().map_or(0, |(line, _)| *line);
        let mut row = vec![0.0; layout.used.len()];
        for &(line, text) in &self.lines {
            let fields = self.fields(text);
            if line == last && !self.ends_whole && fields.len() < self.names.len() {
                rows.cut = true;
                break;
            }
            let time = match (self.row(line, &fields, layout, &mut row, &mut decimals), &mut wrong) {
                (Ok((time, clock)), _) => {
                    rows.clock |= clock;
                    time
                }
                (Err(_), Some(first)) => {
                    first.more_lines.push(line);
                    continue;
                }
                (Err(error), None) => {
                    wrong = Some(error);
                    continue;
                }
            };
            let is_same = |(values, value): (&Vec<f64>, &f64)| values.last() == Some(value);
            if rows.times.last().is_some_and(|last| time.since(*last) == 0.0)
                && rows.values.iter().zip(&row).all(is_same)
            {
                rows.repeated += 1;
                continue;
            }
            if rows.times.len() >= MOST_NUMBERS / (layout.used.len() + 1) {
                return Err(at(line, Problem::TooManyNumbers { most: MOST_NUMBERS }));
            }
            rows.lines.push(line);
            rows.times.push(time);
            rows.values.iter_mut().zip(&row).for_each(|(values, value)| values.push(*value));
        }
        if let Some(wrong) = wrong {
            return Err(wrong);
        }
        if let (Some(point), Some(comma)) = (decimals.point, decimals.comma) {
            return Err(at(point.max(comma), Problem::MixedDecimals { point, comma }));
        }
        rows.comma = decimals.comma.is_some();
        Ok(rows)
    }

    /// Splits a line of numbers.
    fn fields(&self, text: &str) -> Vec<String> {
        let mut fields = self.separator.split(text);
        // A trailing separator adds an empty field.
        if fields.len() == self.names.len() + 1 && fields.last().is_some_and(String::is_empty) {
            fields.pop();
        }
        fields
    }

    /// Reads the values of a line in the order of the layout. Returns its time and whether it is a
    /// time of day.
    fn row(
        &self,
        line: usize,
        fields: &[String],
        layout: &Layout,
        row: &mut [f64],
        decimals: &mut Decimals,
    ) -> Result<(Time, bool), Located> {
        let (found, expected) = (fields.len(), self.names.len());
        if found != expected {
            let problem = match self.separator {
                Separator::Comma if found == 2 * expected => Problem::DecimalCommas { found, expected },
                _ => Problem::Ragged { found, expected },
            };
            return Err(at(line, problem));
        }
        let mut value = |place: usize| -> Result<f64, Located> {
            let field = &fields[place];
            let (value, decimal) = number(field).ok_or_else(|| {
                let (column, found) = (self.shown(place), field.chars().take(40).collect());
                at_field(line, place, Problem::NotANumber { column, found })
            })?;
            match decimal {
                Decimal::None => {}
                Decimal::Point => decimals.point = decimals.point.or(Some(line)),
                Decimal::Comma => decimals.comma = decimals.comma.or(Some(line)),
            }
            Ok(value)
        };
        let clock = clock_time(&fields[layout.time]);
        let time = match clock {
            Some(clock) => Time { value: clock as f64 / 1e12, exact: Some(clock) },
            None => Time { value: value(layout.time)?, exact: exact(&fields[layout.time]) },
        };
        for (slot, used) in row.iter_mut().zip(&layout.used) {
            *slot = used.scale * value(used.place)?;
        }
        Ok((time, clock.is_some()))
    }

    /// Rejects angles too large for radians in a table that does not state its unit.
    fn check_angles(&self, layout: &Layout, rows: &Rows) -> Result<(), Located> {
        for (used, values) in layout.used.iter().zip(&rows.values) {
            let largest = values.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
            if used.order == 0 && largest > SUSPICIOUS_ANGLE && layout.assumed.contains(&used.joint) {
                let (joint, column) = (used.joint.clone(), self.shown(used.place));
                return Err(at_field(self.header_line, used.place, Problem::UnitNeeded { joint, column, largest }));
            }
        }
        Ok(())
    }

    /// Factor from the times to s. Times without a unit are seconds, unless only a date since 1970
    /// explains their size.
    fn time_scale(&self, layout: &mut Layout, rows: &Rows) -> f64 {
        if rows.clock {
            return 1.0;
        }
        if let Some(unit) = layout.time_unit {
            return unit.scale;
        }
        let first = rows.times.first().map_or(0.0, |t| t.value);
        let dates = [(1e17, "ns since 1970", 1e-9), (1e14, "us since 1970", 1e-6), (1e11, "ms since 1970", 1e-3)];
        let (unit, scale) =
            dates.iter().find(|(from, ..)| first > *from).map_or(("s", 1.0), |(_, unit, scale)| (*unit, *scale));
        layout.notes.push(Warning::AssumedTime { column: self.shown(layout.time), unit });
        scale
    }

    /// Adds the place in the file to an error in the samples.
    fn placed(&self, error: TrajectoryError, layout: &Layout, rows: &Rows) -> Located {
        match error {
            TrajectoryError::Samples(error) => match &error {
                SampleError::TimeNotIncreasing { row, .. } => {
                    let first = rows.times.first().copied().unwrap_or_default();
                    let times: Vec<f64> = rows.times.iter().map(|time| time.since(first)).collect();
                    let more_lines = not_increasing(&times).filter(|k| k != row).map(|row| rows.lines[row]).collect();
                    Located { more_lines, ..at_field(rows.lines[*row], layout.time, Problem::Samples(error)) }
                }
                _ => at(self.header_line, Problem::Samples(error)),
            },
            TrajectoryError::OutOfRange { joint, time_s } => {
                let first = rows.times.first().copied().unwrap_or_default();
                let row = rows.times.iter().position(|t| t.since(first) >= time_s).unwrap_or(0);
                at(rows.lines.get(row).copied().unwrap_or(self.header_line), Problem::OutOfRange { joint })
            }
            other => at(self.header_line, Problem::Toml { message: other.to_string() }),
        }
    }
}

/// Groups the values by joint.
fn joints(layout: &Layout, rows: &Rows) -> Vec<JointSamples> {
    let find = |joint: &str, order: usize| {
        let place = layout.used.iter().position(|used| used.joint == joint && used.order == order)?;
        Some(rows.values[place].clone())
    };
    let positions = layout.used.iter().filter(|used| used.order == 0);
    let joint = |used: &Used| {
        let velocity = find(&used.joint, 1);
        JointSamples {
            name: used.joint.clone(),
            position: find(&used.joint, 0).unwrap_or_default(),
            acceleration: velocity.is_some().then(|| find(&used.joint, 2)).flatten(),
            velocity,
        }
    };
    positions.map(joint).collect()
}
