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
//! warning ([`Trajectory::warnings`]). A table with a column `time` and no units in its header is
//! in s and rad.
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
pub(crate) mod request;
mod rows;

use flexarm_settings::{Finding, Place, Setting};

use self::dialect::Separator;
use self::header::{Measure, Unit};
use self::layout::Layout;
use self::lines::Table;
use self::rows::{Rows, joints};
use crate::error::{SampleError, TrajectoryError};
use crate::findings::{self, fault};
use crate::spline::{Samples, not_increasing};
use crate::trajectory::Trajectory;

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
        Ok(Table::find(text, Place::of_file(origin), request)?.read(request)?)
    }

    /// As [`Trajectory::parse_table`], for a table whose header names time and joints.
    ///
    /// # Errors
    /// As [`Trajectory::parse_table`].
    pub fn parse_csv(text: &str, origin: &str) -> Result<Self, TrajectoryError> {
        Self::parse_table(text, origin, &TableRequest::default()).map(|(trajectory, _)| trajectory)
    }
}

/// Maximum number of further places that an error names.
const MAX_PLACES: usize = 3;

impl Table<'_> {
    /// Adds the places of further wrong lines to an error; the first few are named.
    fn with_further(&self, mut first: Box<Finding>, lines: &[usize]) -> Box<Finding> {
        let named: Vec<String> = lines.iter().take(MAX_PLACES).map(|l| self.file.line(*l).to_string()).collect();
        first.message += &match lines.len() {
            0 => String::new(),
            1 => format!(" ({} is wrong, too)", named[0]),
            count => {
                let rest = if count > named.len() { ", ..." } else { "" };
                format!(" ({count} more lines are wrong: {}{rest})", named.join(", "))
            }
        };
        first
    }

    fn read(&self, request: &TableRequest<'_>) -> Result<(Trajectory, TableInfo), Box<Finding>> {
        let mut layout = match (request.columns, self.is_run()) {
            (Some(map), _) => self.mapped(map, request)?,
            (None, true) => self.of_run()?,
            (None, false) => self.guessed(request)?,
        };
        // Values of the columns in use; times in s from the first row.
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
                SampleError::Cutoff { .. } => self.at(line, TrajectoryError::from(error).into()),
                _ => self.placed(error.into(), &layout, &rows),
            })?;
        }
        // The curves, with what was assumed and left out.
        let trajectory = samples.interpolate().map_err(|error| self.placed(error, &layout, &rows))?;
        self.check_angles(&layout, &rows)?;
        layout.notes.extend(self.warnings(&layout, &rows, is_own));
        let decimals = if rows.comma { ", decimal commas" } else { "" };
        let kind = if self.is_run() && request.columns.is_none() { "table of a run" } else { "table" };
        let format = match is_own && self.separator == Separator::Comma {
            true => "CSV samples".to_owned(),
            false => format!("{kind}, {}{decimals}", self.separator.in_words()),
        };
        let trajectory = layout.notes.into_iter().fold(trajectory, Trajectory::with_note);
        let trajectory = trajectory.with_stated_units(layout.stated).with_dropped_columns(layout.dropped);
        Ok((trajectory, TableInfo { format, rows: rows.times.len() }))
    }
}

impl Table<'_> {
    /// Warnings about assumptions and about lines that are left out.
    fn warnings(&self, layout: &Layout, rows: &Rows, is_own: bool) -> Vec<Finding> {
        let mut warnings = Vec::new();
        let mut warn = |code: &str, line: usize, message: String| {
            warnings.push(Finding::warning(code, self.file.line(line).to_string(), message, ""));
        };
        if !is_own && !layout.assumed.is_empty() {
            let joints = findings::first_names(&layout.assumed);
            let message = format!(
                "the table does not state the unit of {joints}: taken as rad; name it in the header, as in joint_1[deg]"
            );
            warn("table-unit", self.header_line, message);
        }
        if let Some((first, last)) = self.preamble {
            let count = last + 1 - first;
            let lines = if count == 1 { "line is" } else { "lines are" };
            warn("table-preamble", first, format!("{count} {lines} above the header and not used"));
        }
        if let Some(first) = rows.repeated.first() {
            let count = rows.repeated.len();
            let rows = if count == 1 { "row repeats" } else { "rows repeat" };
            let message = format!("{count} {rows} the one before, with its time; left out, the first of them here");
            warn("table-repeated-rows", *first, message);
        }
        if let Some((line, _)) = self.lines.last().filter(|_| rows.cut) {
            let message = "the last row is not whole and is left out: the file was cut off; export it again";
            warn("motion-cut", *line, message.to_owned());
        }
        warnings
    }

    /// Rejects names of prismatic joints that the table does not have.
    fn check_metres(&self, layout: &Layout) -> Result<(), Box<Finding>> {
        let is_used = |name: &str| layout.used.iter().any(|used| used.joint == name);
        let is_column = |name: &str| self.names.iter().any(|column| column == name);
        let Some((line, name)) = self.metres.iter().find(|(_, name)| !is_used(name) && !is_column(name)) else {
            return Ok(());
        };
        let joints: Vec<String> =
            layout.used.iter().filter(|used| used.order == 0).map(|used| used.joint.clone()).collect();
        Err(self.at(*line, findings::unknown_joint("metres", name, &joints)))
    }

    /// Rejects angles too large for radians in a table that does not state its unit.
    fn check_angles(&self, layout: &Layout, rows: &Rows) -> Result<(), Box<Finding>> {
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
                return Err(self.at_column(used.place, fault("unit-needed", message)));
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
        let column = self.shown(layout.time);
        let message = format!(
            "the table does not state the unit of its column {column:?}: taken as {unit}; name it in the header, as in \
             Time[ms]"
        );
        let place = self.place(self.header_line, layout.time).to_string();
        layout.notes.push(Finding::warning("table-time-unit", place, message, ""));
        scale
    }

    /// Adds the place in the file to an error in the samples.
    fn placed(&self, error: TrajectoryError, layout: &Layout, rows: &Rows) -> Box<Finding> {
        let first = rows.times.first().copied().unwrap_or_default();
        let times = || rows.times.iter().map(|time| time.since(first));
        match &error {
            TrajectoryError::Samples(SampleError::TimeNotIncreasing { row, .. }) => {
                let times: Vec<f64> = times().collect();
                let more: Vec<usize> = not_increasing(&times).filter(|k| k != row).map(|row| rows.lines[row]).collect();
                self.with_further(self.at_field(rows.lines[*row], layout.time, error.into()), &more)
            }
            TrajectoryError::Samples(SampleError::AccelerationWithoutVelocity { joint }) => {
                match layout.find(joint, 2) {
                    Some(used) => self.at_column(used.place, error.into()),
                    None => self.at(self.header_line, error.into()),
                }
            }
            TrajectoryError::OutOfRange { time_s, .. } => {
                let row = times().position(|t| t >= *time_s).unwrap_or(0);
                self.at(rows.lines.get(row).copied().unwrap_or(self.header_line), error.into())
            }
            _ => self.at(self.header_line, error.into()),
        }
    }
}
