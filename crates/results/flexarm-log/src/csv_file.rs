//! Scalars of a run as one table: SI units, one row per sample, units in the column names.
//!
//! Start at [`CsvRecorder`]. The file always ends with a whole line, even on a full disk.
//! Not here: choice and order of the columns ([`crate::table`]), reading ([`crate::read`]).

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

use flexarm_settings::written::csv_field;

use crate::create::FlushClock;
use crate::file_recorder::{FileRecorder, OpenFile};
use crate::shape::Shape;
use crate::written_behind::WrittenBehind;
use crate::{CreateOptions, LogError, RunHeader, RunResult, Sample, table};

/// Writes a run as comma-separated values with a header line.
///
/// Columns: `time`; TCP positions `rigid_x_m` ..., `flexible_x_m` ...; TCP error, flexible minus
/// rigid, in world axes `error_x_m` ... `error_rz_rad` (rotation vector) and along the path
/// `error_tangential_m`, `error_normal_m`, `error_binormal_m`; for every flexible link and elastic
/// drive its contribution to the TCP displacement, `<name>_contribution_x_m` ...; for every joint
/// `<joint>_position_rad`, `<joint>_effort` and `rigid_<joint>_effort`; for every elastic element
/// its deflection and load, `<element>_x_m` ... `<element>_tz_nm`; `kinetic_energy_j`,
/// `potential_energy_j`, `elastic_energy_j`. A run without a rigid twin has no `rigid_` and no
/// `error_` columns.
///
/// Numbers are written as the shortest text that reads back as the same `f64`. The result figures
/// passed to `finish` are not written.
pub type CsvRecorder = FileRecorder<CsvFile>;

/// A CSV file that is being written.
#[derive(Debug)]
pub struct CsvFile {
    /// None after a failed write: further lines would follow a gap.
    lines: Option<Lines>,
    shape: Shape,
    flush: FlushClock,
    /// Numbers of one line; buffer reused for every line.
    row: Vec<f64>,
}

/// Buffered writer of whole lines.
#[derive(Debug)]
struct Lines {
    file: File,
    /// Number of bytes of whole lines in the file.
    written: u64,
    waiting: Vec<u8>,
    behind: WrittenBehind,
}

/// Buffer size above which lines are written to the file (bytes).
const MAX_WAITING: usize = 128 << 10;

impl Lines {
    fn new(file: File) -> Self {
        Self { file, written: 0, waiting: Vec::new(), behind: WrittenBehind::default() }
    }

    fn add_names(&mut self, names: &[String]) {
        let fields: Vec<String> = names.iter().map(|name| csv_field(name)).collect();
        self.waiting.extend_from_slice(fields.join(",").as_bytes());
        self.waiting.push(b'\n');
    }

    /// Adds a line of numbers, each as the shortest text that reads back as the same number.
    fn add_numbers(&mut self, row: &[f64]) {
        for (k, value) in row.iter().enumerate() {
            if k > 0 {
                self.waiting.push(b',');
            }
            self.waiting.extend_from_slice(zmij::Buffer::new().format(*value).as_bytes());
        }
        self.waiting.push(b'\n');
    }

    fn is_full(&self) -> bool {
        self.waiting.len() > MAX_WAITING
    }

    /// Writes the buffered lines. On failure they are dropped, and the file is cut back to its last
    /// whole line.
    fn flush(&mut self) -> io::Result<()> {
        let length = self.waiting.len() as u64;
        let result = self.file.write_all(&self.waiting);
        self.waiting.clear();
        if let Err(error) = result {
            // If truncating fails too, the partial line stays; the first error is the one reported.
            let _ = self.file.set_len(self.written).and_then(|()| self.file.seek(SeekFrom::Start(self.written)));
            return Err(error);
        }
        self.written += length;
        self.behind.advance(&self.file, self.written);
        Ok(())
    }
}

impl Drop for Lines {
    /// Writes the last lines of an abandoned run; errors cannot be reported here.
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

impl OpenFile for CsvFile {
    fn begin(path: &Path, options: CreateOptions, header: &RunHeader) -> Result<Self, LogError> {
        let mut lines = Lines::new(options.create(path)?);
        lines.add_names(&table::columns(header));
        lines.flush().map_err(LogError::io(path, "write the column names"))?;
        let flush = options.flush_clock(path);
        Ok(Self { lines: Some(lines), shape: Shape::of(header), flush, row: Vec::new() })
    }

    fn record(&mut self, path: &Path, sample: &Sample) -> Result<(), LogError> {
        let Some(lines) = &mut self.lines else { return Err(LogError::not_open(path, "record")) };
        self.shape.check(path, sample)?;
        table::fill_row(sample, &self.shape, &mut self.row);
        lines.add_numbers(&self.row);
        if self.flush.due() || lines.is_full() {
            self.flush(path, "write samples")?;
        }
        Ok(())
    }

    fn finish(&mut self, path: &Path, _result: &RunResult) -> Result<(), LogError> {
        match self.lines {
            Some(_) => self.flush(path, "write the last samples"),
            None => Err(LogError::not_open(path, "finish")),
        }
    }
}

impl CsvFile {
    /// Writes the buffered lines. After a failed write the table is closed.
    fn flush(&mut self, path: &Path, action: &'static str) -> Result<(), LogError> {
        let Some(lines) = &mut self.lines else { return Ok(()) };
        let written = lines.flush().map_err(LogError::io(path, action));
        if written.is_err() {
            self.lines = None;
        }
        written
    }
}
