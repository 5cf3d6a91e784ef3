//! The scalars of a run as one table: SI units, one row per sample, units in the column names.

use std::fs::File;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use crate::create::FlushClock;
use crate::shape::Shape;
use crate::{CreateOptions, LogError, Recorder, RunHeader, RunResult, Sample};

const DISPLACEMENT: [&str; 6] = ["x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"];
const WRENCH: [&str; 6] = ["fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm"];

/// Writes a run as comma-separated values with a header line.
///
/// Columns: `time`; TCP positions `rigid_x_m` ..., `flexible_x_m` ...; TCP error, flexible minus rigid, in world
/// axes `error_x_m` ... `error_rz_rad` (rotation vector) and along the path `error_tangential_m`,
/// `error_normal_m`, `error_binormal_m`; for every joint `<joint>_position_rad`, `<joint>_effort` and
/// `rigid_<joint>_effort`; for every elastic element its deflection and load, `<element>_x_m` ...
/// `<element>_tz_nm`; `kinetic_energy_j`, `potential_energy_j`, `elastic_energy_j`. A run without a rigid twin
/// has no `rigid_` and no `error_` columns.
///
/// Numbers are the shortest that read back as the same `f64`. Result figures of `finish` are not written:
/// a table has no place for them.
#[derive(Debug)]
pub struct CsvRecorder {
    path: PathBuf,
    options: CreateOptions,
    state: State,
}

#[derive(Debug)]
enum State {
    New,
    Open(Box<Open>),
    Finished,
}

#[derive(Debug)]
struct Open {
    writer: csv::Writer<File>,
    shape: Shape,
    flush: FlushClock,
}

impl CsvRecorder {
    /// A recorder that will write `path`; the file is created by `begin`.
    pub fn create(path: impl Into<PathBuf>, options: CreateOptions) -> Self {
        Self { path: path.into(), options, state: State::New }
    }
}

impl Recorder for CsvRecorder {
    fn check(&self) -> Result<(), LogError> {
        self.options.check(&self.path)
    }

    fn begin(&mut self, header: &RunHeader) -> Result<(), LogError> {
        if !matches!(self.state, State::New) {
            return Err(LogError::begun_twice(&self.path));
        }
        let mut writer = csv::Writer::from_writer(self.options.create(&self.path)?);
        writer.write_record(columns(header)).map_err(csv_error(&self.path, "write the column names"))?;
        writer.flush().map_err(LogError::io(&self.path, "write the column names"))?;
        let open = Open { writer, shape: Shape::of(header), flush: self.options.flush_clock() };
        self.state = State::Open(Box::new(open));
        Ok(())
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "record")) };
        open.shape.check(&self.path, sample)?;
        let mut row = Row { writer: &mut open.writer, outcome: Ok(()) };
        row.sample(sample, open.shape.has_rigid);
        row.finish().map_err(csv_error(&self.path, "write a sample"))?;
        if open.flush.due() {
            open.writer.flush().map_err(LogError::io(&self.path, "write samples"))?;
        }
        Ok(())
    }

    fn finish(&mut self, _result: &RunResult) -> Result<(), LogError> {
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "finish")) };
        open.writer.flush().map_err(LogError::io(&self.path, "write the last samples"))?;
        self.state = State::Finished;
        Ok(())
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

/// Names of all columns, in the order of [`Row::sample`].
fn columns(header: &RunHeader) -> Vec<String> {
    let position = |who: &str| ["x_m", "y_m", "z_m"].map(|axis| format!("{who}_{axis}"));
    let mut names = vec!["time".to_owned()];
    if header.has_rigid {
        names.extend(position("rigid"));
    }
    names.extend(position("flexible"));
    if header.has_rigid {
        names.extend(DISPLACEMENT.map(|part| format!("error_{part}")));
        names.extend(["tangential", "normal", "binormal"].map(|axis| format!("error_{axis}_m")));
    }
    for (k, joint) in header.joints.iter().enumerate() {
        let unit = if header.prismatic.get(k).copied().unwrap_or(false) { "m" } else { "rad" };
        names.push(format!("{joint}_position_{unit}"));
        names.push(format!("{joint}_effort"));
        if header.has_rigid {
            names.push(format!("rigid_{joint}_effort"));
        }
    }
    for element in &header.elements {
        names.extend(DISPLACEMENT.iter().chain(&WRENCH).map(|part| format!("{element}_{part}")));
    }
    names.extend(["kinetic", "potential", "elastic"].map(|kind| format!("{kind}_energy_j")));
    names
}

/// One line of the table in the making; the first error is kept.
struct Row<'w> {
    writer: &'w mut csv::Writer<File>,
    outcome: csv::Result<()>,
}

impl Row<'_> {
    fn sample(&mut self, sample: &Sample, has_rigid: bool) {
        self.number(sample.time_s);
        if has_rigid {
            self.position(&sample.rigid.X_WT.translation.vector);
        }
        self.position(&sample.flexible.X_WT.translation.vector);
        if has_rigid {
            self.numbers(&sample.error_world);
            self.numbers(&sample.error_path[..3]);
        }
        for (joint, q) in sample.flexible.q.iter().enumerate() {
            self.number(*q);
            self.number(sample.flexible.effort[joint]);
            if has_rigid {
                self.number(sample.rigid.effort[joint]);
            }
        }
        for element in &sample.elastic {
            self.numbers(&element.deflection);
            self.numbers(&element.load);
        }
        self.numbers(&[sample.energy.kinetic, sample.energy.potential, sample.energy.elastic]);
    }

    fn position(&mut self, p: &Vector3<f64>) {
        self.numbers(p.as_slice());
    }

    fn numbers(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.number(*value));
    }

    /// Rust's debug form of a float is the shortest that reads back, with an exponent where that is shorter.
    fn number(&mut self, value: f64) {
        if self.outcome.is_ok() {
            self.outcome = self.writer.write_field(format!("{value:?}"));
        }
    }

    fn finish(self) -> csv::Result<()> {
        self.outcome?;
        self.writer.write_record(None::<&[u8]>)
    }
}

fn csv_error(path: &Path, action: &'static str) -> impl FnOnce(csv::Error) -> LogError {
    move |error| {
        let cause = error.to_string();
        match error.into_kind() {
            csv::ErrorKind::Io(source) => LogError::io(path, action)(source),
            _ => LogError::Format { path: path.to_owned(), action, cause },
        }
    }
}
