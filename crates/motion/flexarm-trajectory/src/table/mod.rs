//! Tables of joint values: samples in CSV files, tables of other programs with any separator,
//! decimal points or commas and units in the column names, and `run.csv`, the table of a run of
//! this library.
//!
//! ```csv
//! # unit: deg
//! # time: s
//! time,joint_1,joint_2,joint_1.vel,joint_2.vel
//! 0.00,0.0,0.0,0.0,0.0
//! 0.01,0.1,-0.2,10.0,-20.0
//! ```
//!
//! What the table leaves open is either given by the user ([`crate::ColumnMap`]) or assumed, with a
//! [`Warning`]. A table with a column `time` and no units in its header is in s and rad.
//!
//! * Three comments have a meaning: `# unit: rad` or `# unit: deg` for all joints, with `deg/s` and
//!   `deg/s²` for rates; `# metres: joint_x, joint_y` names prismatic joints, whose columns are in m
//!   whatever the unit; `# time: s`.
//! * `# cutoff: 20 Hz` smooths the positions; see [`crate::Samples::smoothed`].
//! * Times must increase; the first one becomes `t = 0`. Steps may vary. Between the rows the
//!   joints follow quintic splines; see [`crate::Samples::interpolate`].
//! * The header is the first line that is neither blank nor a comment (`#`, `%`, `//`), or the last
//!   comment before numbers begin. A second line may hold only units.
//! * A name may end with its unit: `A1[deg]`, `q1 (rad)`, `q1_deg`, `t / ms`. Names that end with
//!   `vel`, `velocity`, `acc` are rates; in `/joint_states/joint_1/position` the last part is the
//!   quantity.
//! * If the joints of the robot are known, columns with other names are dropped, with a warning; a
//!   name close to a joint without a column is an error.
//!
//! Start at [`Trajectory::parse_table`].

mod dialect;
mod header;
mod layout;
mod lines;
mod located;
pub(crate) mod request;
mod rows;

use flexarm_settings::Setting;

use self::dialect::Separator;
use self::header::{Measure, Unit};
use self::layout::Layout;
use self::lines::Table;
use self::located::{Located, at, at_field};
use self::rows::{Rows, joints};
use crate::error::TrajectoryError;
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
        let failed = |Located { line, field, mut problem, more_lines }: Located, separator: Separator| {
            let place = |(line, field): (usize, usize)| separator.column(text.lines().nth(line - 1)?, field);
            problem.message += &further(&more_lines);
            problem.at(origin, line, line.zip(field).and_then(place))
        };
        let table = Table::find(text, request).map_err(|error| failed(error, Separator::Comma))?;
        table.read(request).map_err(|error| failed(error, table.separator))
    }

    /// As [`Trajectory::parse_table`], for a table whose header names time and joints.
    ///
    /// # Errors
    /// As [`Trajectory::parse_table`].
    pub fn parse_csv(text: &str, origin: &str) -> Result<Self, TrajectoryError> {
        Self::parse_table(text, origin, &TableRequest::default()).map(|(trajectory, _)| trajectory)
    }
}

/// Text about further lines that are wrong; the first ten are named.
fn further(lines: &[usize]) -> String {
    let named: Vec<String> = lines.iter().take(10).map(usize::to_string).collect();
    match lines.len() {
        0 => String::new(),
        1 => format!(" (line {} is wrong, too)", named[0]),
        count => {
            let rest = if count > named.len() { ", ..." } else { "" };
            format!(" ({count} more lines are wrong: {}{rest})", named.join(", "))
        }
    }
}

impl Table<'_> {
    fn read(&self, request: &TableRequest<'_>) -> Result<(Trajectory, TableInfo), Located> {
        let mut layout = match (request.columns, self.is_run()) {
            (Some(map), _) => self.mapped(map, request)?,
            (None, true) => self.of_run()?,
            (None, false) => self.guessed(request)?,
        };
        self.check_metres(&layout)?;
        let (rows, is_own) = (self.rows(&layout)?, self.is_own(request));
        if is_own {
            let seconds = Unit { measure: Measure::Time, per_s: 0, scale: 1.0 };
            layout.time_unit = layout.time_unit.or(Some(seconds));
        }
        let scale = self.time_scale(&mut layout, &rows);
        let origin = rows.times.first().copied().unwrap_or_default();
        let times: Vec<f64> = rows.times.iter().map(|t| t.since(origin) * scale).collect();
        let mut samples = Samples { times, joints: joints(&layout, &rows) };
        if let Some((line, hz)) = self.cutoff {
            samples = samples.smoothed(hz).map_err(|error| match error {
                SampleError::Cutoff { .. } => at(line, error.into()),
                _ => self.placed(error.into(), &layout, &rows),
            })?;
        }
        let trajectory = samples.interpolate().map_err(|error| self.placed(error, &layout, &rows))?;
        self.check_angles(&layout, &rows)?;
        if !is_own && !layout.assumed.is_empty() {
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
        let format = match is_own && self.separator == Separator::Comma {
            true => "CSV samples".to_owned(),
            false => format!("{kind}, {}{decimals}", self.separator.in_words()),
        };
        let trajectory = layout.notes.into_iter().fold(trajectory, Trajectory::with_note);
        let trajectory = trajectory.with_stated_units(layout.stated);
        Ok((trajectory, TableInfo { format, rows: rows.times.len() }))
    }
}

impl Table<'_> {
    /// Rejects names of prismatic joints that the table does not have.
    fn check_metres(&self, layout: &Layout) -> Result<(), Located> {
        let is_used = |name: &str| layout.used.iter().any(|used| used.joint == name);
        let is_column = |name: &str| self.names.iter().any(|column| column == name);
        let Some((line, name)) = self.metres.iter().find(|(_, name)| !is_used(name) && !is_column(name)) else {
            return Ok(());
        };
        let joints: Vec<String> =
            layout.used.iter().filter(|used| used.order == 0).map(|used| used.joint.clone()).collect();
        Err(at(*line, Problem::unknown_joint("metres", name, &joints)))
    }

    /// Rejects angles too large for radians in a table that does not state its unit.
    fn check_angles(&self, layout: &Layout, rows: &Rows) -> Result<(), Located> {
        for (used, values) in layout.used.iter().zip(&rows.values) {
            let largest = values.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
            if used.order == 0 && largest > SUSPICIOUS_ANGLE && layout.assumed.contains(&used.joint) {
                let (joint, column) = (used.joint.clone(), self.shown(used.place));
                let message = format!(
                    "joint {joint:?} reaches {largest:.4} in a table that does not state its unit, too much for \
                     radians to be assumed; name the unit in the header (`{column}[deg]`), in a line `# unit: deg` \
                     above it, or with {} {joint}={column}[deg]",
                    Setting::Columns
                );
                return Err(at_field(self.header_line, used.place, Problem::new("unit-needed", message)));
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
                    Located { more_lines, ..at_field(rows.lines[*row], layout.time, error.into()) }
                }
                SampleError::AccelerationWithoutVelocity { joint } => match layout.find(joint, 2) {
                    Some(used) => at_field(self.header_line, used.place, error.into()),
                    None => at(self.header_line, error.into()),
                },
                _ => at(self.header_line, error.into()),
            },
            TrajectoryError::OutOfRange { joint, time_s } => {
                let first = rows.times.first().copied().unwrap_or_default();
                let row = rows.times.iter().position(|t| t.since(first) >= time_s).unwrap_or(0);
                at(rows.lines.get(row).copied().unwrap_or(self.header_line), Problem::out_of_range(&joint))
            }
            other => at(self.header_line, Problem::new("toml", other.to_string())),
        }
    }
}
