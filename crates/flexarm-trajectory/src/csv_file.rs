//! Sampled trajectories in CSV files.
//!
//! ```csv
//! # unit: deg
//! # time: s
//! time,joint_1,joint_2,joint_1.vel,joint_2.vel
//! 0.00,0.0,0.0,0.0,0.0
//! 0.01,0.1,-0.2,10.0,-20.0
//! ```
//!
//! * The first line that is neither blank nor a comment names the columns: `time` in s, one column per joint, and
//!   optionally `<joint>.vel` and `<joint>.acc`. Columns are separated by commas and may come in any order.
//! * Lines that start with `#` are comments. Three of them mean something: `# unit: rad` (the default) or
//!   `# unit: deg` for all joint columns, with `deg/s` and `deg/s²` for velocities and accelerations;
//!   `# metres: joint_x, joint_y` names prismatic joints, whose columns are in m whatever the unit; `# time: s`.
//! * Times must increase; the first one becomes `t = 0`. Steps may vary.
//! * Between the rows the joints follow quintic splines; [`crate::Samples::interpolate`] tells how, by what is given.
//!
//! Not here: the splines. Start at [`Trajectory::parse_csv`].

use crate::error::{FileError, Problem, SampleError, TrajectoryError};
use crate::spline::{JointSamples, Samples};
use crate::trajectory::Trajectory;
use crate::warning::Warning;

/// A joint of a file without a unit that reaches this is likely to be in degrees: two turns.
const SUSPICIOUS_ANGLE: f64 = 4.0 * std::f64::consts::PI;

impl Trajectory {
    /// Reads sampled joint values; the page of the module [`crate::csv_file`] describes the format.
    ///
    /// * `origin`: file name for messages.
    ///
    /// # Errors
    /// [`TrajectoryError::File`] with the line, the number of the column where it matters, what was found and how to
    /// mend it.
    pub fn parse_csv(text: &str, origin: &str) -> Result<Self, TrajectoryError> {
        let fail = |line, column, problem| FileError { origin: origin.to_owned(), line, column, problem };
        parse(text.trim_start_matches('\u{feff}')).map_err(|error| fail(error.line, error.column, error.problem).into())
    }
}

/// A problem and its place.
struct Located {
    line: Option<usize>,
    column: Option<usize>,
    problem: Problem,
}

fn located(line: usize, column: Option<usize>, problem: Problem) -> Located {
    Located { line: Some(line), column, problem }
}

/// What a column holds.
#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Time,
    Position,
    Velocity,
    Acceleration,
}

fn parse(text: &str) -> Result<Trajectory, Located> {
    let units = Units::from_comments(text)?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut header: Option<(usize, Vec<String>)> = None;
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    for record in reader.records() {
        // The text is UTF-8 and rows may differ in length, so the reader has nothing left to complain about.
        let record = record.map_err(|_| Located { line: None, column: None, problem: Problem::NotUtf8 })?;
        let line = record.position().map_or(0, |position| position.line() as usize);
        if record.iter().all(str::is_empty) && record.len() <= 1 {
            continue;
        }
        match &header {
            None => header = Some((line, record.iter().map(str::to_owned).collect())),
            Some((_, columns)) => rows.push((line, numbers(&record, line, columns)?)),
        }
    }
    let Some((header_line, columns)) = header else {
        return Err(Located { line: None, column: None, problem: Problem::Empty });
    };

    let (samples, place) = assemble(header_line, &columns, &rows, &units)?;
    build(&samples, header_line, &rows, &columns, &place, &units)
}

/// The fields of a row as finite numbers.
fn numbers(record: &csv::StringRecord, line: usize, columns: &[String]) -> Result<Vec<f64>, Located> {
    if record.len() != columns.len() {
        return Err(located(line, None, Problem::Ragged { found: record.len(), expected: columns.len() }));
    }
    let mut values = Vec::with_capacity(columns.len());
    for (i, (field, column)) in record.iter().zip(columns).enumerate() {
        match field.parse::<f64>() {
            Ok(value) if value.is_finite() => values.push(value),
            _ => {
                let problem = Problem::NotANumber { column: column.clone(), found: field.to_owned() };
                return Err(located(line, Some(i + 1), problem));
            }
        }
    }
    Ok(values)
}

/// Sorts the columns by joint and converts them to SI; also returns the joint and quantity of each column.
fn assemble(
    line: usize,
    columns: &[String],
    rows: &[(usize, Vec<f64>)],
    units: &Units,
) -> Result<(Samples, Vec<(String, Quantity)>), Located> {
    let place = columns_of(line, columns)?;
    let names: Vec<String> =
        place.iter().filter(|(_, quantity)| *quantity == Quantity::Position).map(|(name, _)| name.clone()).collect();
    for (comment_line, joint) in &units.metres {
        if !names.contains(joint) {
            let problem = Problem::UnknownJoint { key: "metres", name: joint.clone(), joints: names };
            return Err(located(*comment_line, None, problem));
        }
    }

    let column = |joint: &str, quantity: Quantity| {
        let i = place.iter().position(|(name, kind)| name == joint && *kind == quantity)?;
        let scale = if quantity == Quantity::Time { 1.0 } else { units.scale(joint) };
        Some(rows.iter().map(|(_, values)| values[i] * scale).collect::<Vec<f64>>())
    };
    let joint = |name: &String| JointSamples {
        name: name.clone(),
        position: column(name, Quantity::Position).unwrap_or_default(),
        velocity: column(name, Quantity::Velocity),
        acceleration: column(name, Quantity::Acceleration),
    };
    let joints = names.iter().map(joint).collect();
    let times = column("time", Quantity::Time).unwrap_or_default();
    Ok((Samples { times, joints }, place))
}

/// Joint and quantity of each column of the header.
fn columns_of(line: usize, columns: &[String]) -> Result<Vec<(String, Quantity)>, Located> {
    let found = || columns.to_vec();
    if let (Some(separator), [only]) = ([';', '\t'].into_iter().find(|&s| columns[0].contains(s)), columns) {
        if only.starts_with("time") {
            return Err(located(line, None, Problem::WrongSeparator { separator }));
        }
    }
    if !columns.iter().any(|column| column == "time") {
        return Err(located(line, None, Problem::NoTimeColumn { found: found() }));
    }
    let mut place = Vec::with_capacity(columns.len());
    for (i, name) in columns.iter().enumerate() {
        if name.is_empty() {
            return Err(located(line, Some(i + 1), Problem::UnnamedColumn));
        }
        if columns[..i].contains(name) {
            return Err(located(line, Some(i + 1), Problem::RepeatedColumn { name: name.clone() }));
        }
        let (joint, quantity) = match (name.strip_suffix(".vel"), name.strip_suffix(".acc")) {
            _ if name == "time" => ("time", Quantity::Time),
            (Some(joint), _) => (joint, Quantity::Velocity),
            (_, Some(joint)) => (joint, Quantity::Acceleration),
            _ => (name.as_str(), Quantity::Position),
        };
        let is_rate = matches!(quantity, Quantity::Velocity | Quantity::Acceleration);
        if is_rate && (joint == "time" || !columns.iter().any(|column| column == joint)) {
            let problem = Problem::NoPositionColumn { column: name.clone(), joint: joint.to_owned(), found: found() };
            return Err(located(line, Some(i + 1), problem));
        }
        place.push((joint.to_owned(), quantity));
    }
    Ok(place)
}

/// Interpolates, and gives what is wrong with the samples its line in the file.
fn build(
    samples: &Samples,
    header_line: usize,
    rows: &[(usize, Vec<f64>)],
    columns: &[String],
    place: &[(String, Quantity)],
    units: &Units,
) -> Result<Trajectory, Located> {
    let trajectory = samples.interpolate().map_err(|error| match error {
        TrajectoryError::Samples(error) => {
            let line = match &error {
                SampleError::TimeNotIncreasing { row, .. } | SampleError::NotFinite { row, .. } => rows[*row].0,
                _ => header_line,
            };
            let column = match &error {
                SampleError::TimeNotIncreasing { .. } => place.iter().position(|(_, q)| *q == Quantity::Time),
                SampleError::NotFinite { what, .. } => columns.iter().position(|column| column == what),
                SampleError::AccelerationWithoutVelocity { joint } => {
                    place.iter().position(|(name, q)| name == joint && *q == Quantity::Acceleration)
                }
                _ => None,
            };
            located(line, column.map(|i| i + 1), Problem::Samples(error))
        }
        TrajectoryError::OutOfRange { joint, time_s } => {
            let row = samples.times.iter().position(|t| t - samples.times[0] >= time_s).unwrap_or(0);
            located(rows[row].0, None, Problem::OutOfRange { joint })
        }
        // `interpolate` knows no other error; should it learn one, its text is still passed on.
        other => located(header_line, None, Problem::Toml { message: other.to_string() }),
    })?;

    if units.degrees.is_some() {
        return Ok(trajectory);
    }
    let largest = |joint: &JointSamples| joint.position.iter().fold(0.0, |peak: f64, q| peak.max(q.abs()));
    let suspicious = samples
        .joints
        .iter()
        .filter(|joint| largest(joint) > SUSPICIOUS_ANGLE && !units.metres.iter().any(|(_, name)| *name == joint.name));
    Ok(suspicious.fold(trajectory, |trajectory, joint| {
        trajectory.with_note(Warning::LooksLikeDegrees { joint: joint.name.clone(), largest: largest(joint) })
    }))
}

/// What the comments say about units.
#[derive(Default)]
struct Units {
    /// Is the angle unit degrees? `None` when the file does not say.
    degrees: Option<bool>,
    /// Prismatic joints, with the line that names them.
    metres: Vec<(usize, String)>,
}

impl Units {
    fn from_comments(text: &str) -> Result<Self, Located> {
        let mut units = Self::default();
        for (i, line) in text.lines().enumerate() {
            let Some((key, value)) = line.strip_prefix('#').and_then(|comment| comment.split_once(':')) else {
                continue;
            };
            let (line, value) = (i + 1, value.trim());
            match key.trim() {
                "unit" => units.set_degrees(line, value)?,
                "metres" => units.metres.extend(value.split(',').map(|name| (line, name.trim().to_owned()))),
                "time" if value != "s" => {
                    let problem = Problem::UnknownUnit { key: "time", found: value.to_owned(), accepted: "s" };
                    return Err(located(line, None, problem));
                }
                _ => {}
            }
        }
        Ok(units)
    }

    fn set_degrees(&mut self, line: usize, value: &str) -> Result<(), Located> {
        let degrees = match value {
            "rad" => false,
            "deg" => true,
            _ => {
                let problem = Problem::UnknownUnit { key: "unit", found: value.to_owned(), accepted: "rad, deg" };
                return Err(located(line, None, problem));
            }
        };
        if let Some(before) = self.degrees.filter(|&before| before != degrees) {
            let first = if before { "deg" } else { "rad" }.to_owned();
            let problem = Problem::ContradictingUnits { key: "unit", first, second: value.to_owned() };
            return Err(located(line, None, problem));
        }
        self.degrees = Some(degrees);
        Ok(())
    }

    /// Factor from the unit of a joint's columns to SI.
    fn scale(&self, joint: &str) -> f64 {
        let is_angle = !self.metres.iter().any(|(_, name)| name == joint);
        if is_angle && self.degrees == Some(true) { std::f64::consts::PI / 180.0 } else { 1.0 }
    }
}
