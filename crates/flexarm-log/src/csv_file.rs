//! The scalars of a run as one table: SI units, one row per sample, units in the column names.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::create::FlushClock;
use crate::shape::Shape;
use crate::table;
use crate::{CreateOptions, LogError, Recorder, RunHeader, RunResult, Sample};

/// Writes a run as comma-separated values with a header line.
///
/// Columns: `time`; TCP positions `rigid_x_m` ..., `flexible_x_m` ...; TCP error, flexible minus rigid, in world
/// axes `error_x_m` ... `error_rz_rad` (rotation vector) and along the path `error_tangential_m`,
/// `error_normal_m`, `error_binormal_m`; for every flexible link and elastic drive the TCP displacement that it alone causes,
/// `<name>_contribution_x_m` ...; for every joint `<joint>_position_rad`, `<joint>_effort` and
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
    /// Numbers of one line; used again for the next one.
    row: Vec<f64>,
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
        writer.write_record(table::columns(header)).map_err(csv_error(&self.path, "write the column names"))?;
        writer.flush().map_err(LogError::io(&self.path, "write the column names"))?;
        let open = Open { writer, shape: Shape::of(header), flush: self.options.flush_clock(), row: Vec::new() };
        self.state = State::Open(Box::new(open));
        Ok(())
    }

    fn record(&mut self, sample: &Sample) -> Result<(), LogError> {
        let State::Open(open) = &mut self.state else { return Err(LogError::not_open(&self.path, "record")) };
        open.shape.check(&self.path, sample)?;
        table::fill_row(sample, &open.shape, &mut open.row);
        // Rust's debug form of a float is the shortest that reads back, with an exponent where that is shorter.
        let fields = open.row.iter().map(|value| format!("{value:?}"));
        open.writer.write_record(fields).map_err(csv_error(&self.path, "write a sample"))?;
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

fn csv_error(path: &Path, action: &'static str) -> impl FnOnce(csv::Error) -> LogError {
    move |error| {
        let cause = error.to_string();
        match error.into_kind() {
            csv::ErrorKind::Io(source) => LogError::io(path, action)(source),
            _ => LogError::Format { path: path.to_owned(), action, cause },
        }
    }
}
