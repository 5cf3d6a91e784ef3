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
//! * The first line that is neither blank nor a comment names the columns: `time` in s, one column
//!   per joint, and optionally `<joint>.vel` and `<joint>.acc`. Columns are separated by commas and
//!   may come in any order.
//! * Lines that start with `#` are comments. Three comments have a meaning: `# unit: rad` (the
//!   default) or `# unit: deg` for all joint columns, with `deg/s` and `deg/s²` for velocities and
//!   accelerations; `# metres: joint_x, joint_y` names prismatic joints, whose columns are in m
//!   regardless of the unit; `# time: s`.
//! * Times must increase; the first one becomes `t = 0`. Steps may vary.
//! * Between the rows the joints follow quintic splines; see [`crate::Samples::interpolate`].
//!
//! Not here: the splines. Start at [`Trajectory::parse_csv`].

use crate::error::{FileError, TrajectoryError};
use crate::problem::{Problem, SampleError};
use crate::spline::{JointSamples, Samples, not_increasing};
use crate::trajectory::{StatedUnit, Trajectory};
use crate::warning::Warning;

/// A joint position above this (two turns) in a file without a unit is probably in degrees.
const SUSPICIOUS_ANGLE: f64 = 4.0 * std::f64::consts::PI;

/// Maximum number of values in a file.
const MOST_NUMBERS: usize = 30_000_000;

impl Trajectory {
    /// Reads sampled joint values; the module page [`crate::csv_file`] describes the format.
    ///
    /// * `origin`: file name for messages.
    ///
    /// # Errors
    /// [`TrajectoryError::File`] with the line and, where it applies, the column of the problem.
    pub fn parse_csv(text: &str, origin: &str) -> Result<Self, TrajectoryError> {
        parse(text.trim_start_matches('\u{feff}')).map_err(|Located { line, column, problem, more_lines }| {
            let (origin, problem) = (origin.to_owned(), *problem);
            Box::new(FileError { origin, line, column, problem, more_lines }).into()
        })
    }
}

/// A problem and its place in the file.
struct Located {
    line: Option<usize>,
    column: Option<usize>,
    problem: Box<Problem>,
    /// Other lines that are wrong.
    more_lines: Vec<usize>,
}

fn located(line: usize, column: Option<usize>, problem: Problem) -> Located {
    Located { line: Some(line), column, problem: Box::new(problem), more_lines: Vec::new() }
}

fn nowhere(problem: Problem) -> Located {
    Located { line: None, column: None, problem: Box::new(problem), more_lines: Vec::new() }
}

/// Quantity that a column holds.
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
    let mut header: Option<Header> = None;
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    let (mut repeated, mut wrong): (usize, Option<Located>) = (0, None);
    for record in reader.records() {
        // The text is UTF-8 and rows of different lengths are accepted, so the reader cannot fail
        // otherwise.
        let record = record.map_err(|_| nowhere(Problem::NotUtf8))?;
        let line = record.position().map_or(0, |position| line_of(text, position));
        if record.iter().all(str::is_empty) && record.len() <= 1 {
            continue;
        }
        match &header {
            None => header = Some(Header::new(line, record.iter().map(str::to_owned).collect())?),
            Some(header) if rows.len() >= MOST_NUMBERS / header.columns.len() => {
                return Err(located(line, None, Problem::TooManyNumbers { most: MOST_NUMBERS }));
            }
            Some(header) => match (numbers(&record, line, &header.columns), &mut wrong) {
                (Ok(row), _) if rows.last().is_some_and(|(_, last)| *last == row) => repeated += 1,
                (Ok(row), _) => rows.push((line, row)),
                (Err(_), Some(first)) => first.more_lines.push(line),
                (Err(error), None) => wrong = Some(error),
            },
        }
    }
    if let Some(wrong) = wrong {
        return Err(wrong);
    }
    let Some(header) = header else {
        return Err(nowhere(Problem::Empty));
    };

    let samples = assemble(&header, &rows, &units)?;
    let trajectory = samples.interpolate().map_err(|error| placed(error, &samples, &header, &rows))?;
    let told = samples.joints.iter().filter_map(|joint| units.stated_unit(&joint.name)).collect();
    let trajectory = with_doubts(trajectory, &samples, &units).with_told_units(told);
    Ok(if repeated > 0 { trajectory.with_note(Warning::RepeatedRows { count: repeated }) } else { trajectory })
}

/// Line of a record, from 1. The reader's position is before the blank and comment lines that it
/// skipped to reach the record.
fn line_of(text: &str, position: &csv::Position) -> usize {
    let rest = text.get(position.byte() as usize..).unwrap_or_default();
    let skipped = rest.lines().take_while(|line| line.is_empty() || line.starts_with('#')).count();
    position.line() as usize + skipped
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

/// The header line that names the columns.
struct Header {
    line: usize,
    columns: Vec<String>,
    /// Joint (or `time`) and quantity of each column.
    meaning: Vec<(String, Quantity)>,
}

impl Header {
    fn new(line: usize, columns: Vec<String>) -> Result<Self, Located> {
        let separator = [';', '\t'].into_iter().find(|&separator| columns[0].contains(separator));
        if let (Some(separator), true) = (separator, columns[0].starts_with("time")) {
            return Err(located(line, None, Problem::WrongSeparator { separator }));
        }
        if !columns.iter().any(|column| column == "time") {
            return Err(located(line, None, Problem::NoTimeColumn { found: columns }));
        }
        let mut meaning = Vec::with_capacity(columns.len());
        for (i, name) in columns.iter().enumerate() {
            if name.is_empty() {
                return Err(located(line, Some(i + 1), Problem::UnnamedColumn));
            }
            if let Some(first) = columns[..i].iter().position(|other| other == name) {
                let problem = Problem::RepeatedColumn { name: name.clone(), first: first + 1 };
                return Err(located(line, Some(i + 1), problem));
            }
            let (joint, quantity) = match (name.strip_suffix(".vel"), name.strip_suffix(".acc")) {
                _ if name == "time" => ("time", Quantity::Time),
                (Some(joint), _) => (joint, Quantity::Velocity),
                (_, Some(joint)) => (joint, Quantity::Acceleration),
                _ => (name.as_str(), Quantity::Position),
            };
            let is_rate = matches!(quantity, Quantity::Velocity | Quantity::Acceleration);
            if is_rate && (joint == "time" || !columns.iter().any(|column| column == joint)) {
                let (column, joint, found) = (name.clone(), joint.to_owned(), columns.clone());
                return Err(located(line, Some(i + 1), Problem::NoPositionColumn { column, joint, found }));
            }
            meaning.push((joint.to_owned(), quantity));
        }
        Ok(Self { line, columns, meaning })
    }

    /// Index of the column that holds a quantity of a joint.
    fn find(&self, joint: &str, quantity: Quantity) -> Option<usize> {
        self.meaning.iter().position(|(name, kind)| name == joint && *kind == quantity)
    }
}

/// Groups the columns by joint and converts them to SI.
fn assemble(header: &Header, rows: &[(usize, Vec<f64>)], units: &Units) -> Result<Samples, Located> {
    let positions = header.meaning.iter().filter(|(_, quantity)| *quantity == Quantity::Position);
    let names: Vec<String> = positions.map(|(name, _)| name.clone()).collect();
    if let Some((line, name)) = units.metres.iter().find(|(_, name)| !names.contains(name)) {
        let problem = Problem::UnknownJoint { key: "metres", name: name.clone(), joints: names };
        return Err(located(*line, None, problem));
    }

    let column = |joint: &str, quantity: Quantity| {
        let i = header.find(joint, quantity)?;
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
    Ok(Samples { times: column("time", Quantity::Time).unwrap_or_default(), joints })
}

/// Adds the place in the file to an error in the samples.
fn placed(error: TrajectoryError, samples: &Samples, header: &Header, rows: &[(usize, Vec<f64>)]) -> Located {
    match error {
        TrajectoryError::Samples(error) => {
            let mut more_lines = Vec::new();
            let (line, column) = match &error {
                SampleError::TimeNotIncreasing { row, .. } => {
                    more_lines.extend(not_increasing(&samples.times).filter(|k| k != row).map(|row| rows[row].0));
                    (rows[*row].0, header.find("time", Quantity::Time))
                }
                SampleError::AccelerationWithoutVelocity { joint } => {
                    (header.line, header.find(joint, Quantity::Acceleration))
                }
                _ => (header.line, None),
            };
            Located { more_lines, ..located(line, column.map(|i| i + 1), Problem::Samples(error)) }
        }
        TrajectoryError::OutOfRange { joint, time_s } => {
            let row = samples.times.iter().position(|t| t - samples.times[0] >= time_s).unwrap_or(0);
            located(rows[row].0, None, Problem::OutOfRange { joint })
        }
        // `interpolate` has no other error today; the text of a future one is passed on.
        other => located(header.line, None, Problem::Toml { message: other.to_string() }),
    }
}

/// Adds a note for each joint whose values look like degrees in a file that does not state its
/// unit.
fn with_doubts(trajectory: Trajectory, samples: &Samples, units: &Units) -> Trajectory {
    if units.degrees.is_some() {
        return trajectory;
    }
    let largest = |joint: &JointSamples| joint.position.iter().fold(0.0, |peak: f64, q| peak.max(q.abs()));
    let is_angle = |joint: &JointSamples| !units.metres.iter().any(|(_, name)| *name == joint.name);
    let doubtful = samples.joints.iter().filter(|joint| largest(joint) > SUSPICIOUS_ANGLE && is_angle(joint));
    doubtful.fold(trajectory, |trajectory, joint| {
        trajectory.with_note(Warning::LooksLikeDegrees { joint: joint.name.clone(), largest: largest(joint) })
    })
}

/// Units stated in the comments.
#[derive(Default)]
struct Units {
    /// Whether angles are in degrees; `None` if the file does not say.
    degrees: Option<bool>,
    /// Line that states the unit.
    line: usize,
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
        (self.degrees, self.line) = (Some(degrees), line);
        Ok(())
    }

    /// Unit stated for a joint.
    fn stated_unit(&self, joint: &str) -> Option<StatedUnit> {
        let unit = |is_length: bool, line: usize| StatedUnit { joint: joint.to_owned(), is_length, line };
        match self.metres.iter().find(|(_, name)| name == joint) {
            Some((line, _)) => Some(unit(true, *line)),
            None => (self.degrees == Some(true)).then(|| unit(false, self.line)),
        }
    }

    /// Factor from the unit of a joint's columns to SI.
    fn scale(&self, joint: &str) -> f64 {
        let is_angle = !self.metres.iter().any(|(_, name)| name == joint);
        if is_angle && self.degrees == Some(true) { std::f64::consts::PI / 180.0 } else { 1.0 }
    }
}
