//! Tables of joint values from other programs: any separator, decimal points or commas, units in
//! the column names, columns that are not part of the motion; and `run.csv`, the table of a run of
//! this library.
//!
//! What the table leaves open is either given by the user ([`crate::ColumnMap`]) or assumed, with a
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
mod layout;
mod lines;
mod located;
pub(crate) mod request;
mod rows;

use self::layout::Layout;
use self::lines::Table;
use self::located::{Located, at, at_field};
use self::rows::{Rows, joints};
use crate::error::{FileError, TrajectoryError};
use crate::problem::{Problem, SampleError};
use crate::spline::{Samples, not_increasing};
use crate::trajectory::Trajectory;
use crate::warning::Warning;

pub use self::request::{KnownJoint, TableRequest};

/// A joint position above this (two turns) in a table without a unit is taken to be in degrees, and
/// the unit must be given.
const SUSPICIOUS_ANGLE: f64 = 4.0 * std::f64::consts::PI;

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
}

impl Table<'_> {
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
