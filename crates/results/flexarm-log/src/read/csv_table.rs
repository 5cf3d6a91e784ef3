//! Reader of the CSV file of a run, line by line.
//!
//! Start at [`CsvRun`]. Errors have the line of the file; a last line that was cut off is left out
//! with a warning. Not here: meaning of the columns ([`crate::table`]).

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flexarm_settings::written::csv_text;

use super::{broken_end, not_a_recording, stem};
use crate::table::{self, TableLayout};
use crate::{LogError, RunHeader, RunResult, RunSource, Sample};

/// A run read from a CSV file.
pub(crate) struct CsvRun {
    path: PathBuf,
    layout: TableLayout,
    warnings: Vec<String>,
}

impl CsvRun {
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        let mut reader = rows(path)?;
        let names = reader.headers().map_err(|error| broken(path, &error))?;
        let names: Vec<String> = names.iter().map(|name| csv_text(name.trim()).to_owned()).collect();
        let mut layout = TableLayout::of_names(&names).map_err(|(f, e)| not_a_recording(path, f, e))?;

        layout.header.robot = stem(path);
        layout.header.trajectory = "unknown".into();
        let mut times = reader.records().take(2).map_while(|row| row.ok()?.get(layout.places[0])?.trim().parse().ok());
        if let (Some(first), Some(second)) = (times.next(), times.next()) {
            layout.header.log_rate_hz = table::rate_hz(first, second);
        }
        Ok(Self { path: path.to_owned(), layout, warnings: Vec::new() })
    }
}

impl RunSource for CsvRun {
    fn header(&self) -> &RunHeader {
        &self.layout.header
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError> {
        self.warnings.clear();
        let whole = ends_with_a_line(&self.path)?;
        let mut reader = rows(&self.path)?;
        let mut rows = reader.records().peekable();
        let (mut sample, mut numbers) = (Sample::default(), Vec::new());
        let (mut count, mut last_s) = (0, 0.0);
        while let Some(row) = rows.next() {
            // A last line without a newline may end with a truncated number.
            if !whole && rows.peek().is_none() {
                self.warnings.push(broken_end(&self.path, "its last line is not whole", count, last_s));
                break;
            }
            let row = row.map_err(|error| broken(&self.path, &error))?;
            numbers.clear();
            for &place in &self.layout.places {
                let field = row.get(place).unwrap_or_default().trim();
                numbers.push(field.parse::<f64>().map_err(|_| {
                    let line = row.position().map_or(0, csv::Position::line);
                    let expected = format!("a number in column {}", place + 1);
                    let found = format!("{:?}", field.chars().take(40).collect::<String>());
                    at_line(line, not_a_recording(&self.path, found, expected))
                })?);
            }
            self.layout.sample(&numbers, &mut sample);
            take(&sample)?;
            (count, last_s) = (count + 1, sample.time_s);
        }
        Ok(RunResult::default())
    }
}

fn rows(path: &Path) -> Result<csv::Reader<File>, LogError> {
    let file = File::open(path).map_err(LogError::io(path, "open the recording"))?;
    Ok(csv::ReaderBuilder::new().from_reader(file))
}

fn ends_with_a_line(path: &Path) -> Result<bool, LogError> {
    let last = || {
        let mut file = File::open(path)?;
        let mut byte = [b'\n'];
        if file.seek(SeekFrom::End(0))? > 0 {
            file.seek(SeekFrom::End(-1))?;
            file.read_exact(&mut byte)?;
        }
        Ok(byte == [b'\n'])
    };
    last().map_err(LogError::io(path, "read the recording"))
}

/// Adds the line of an error.
fn at_line(at: u64, mut error: LogError) -> LogError {
    if let LogError::NotARecording { line, .. } = &mut error {
        *line = usize::try_from(at).ok();
    }
    error
}

fn broken(path: &Path, error: &csv::Error) -> LogError {
    let found = match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            let expected = format!("{expected_len} as in the header");
            return at_line(line, not_a_recording(path, format!("{len} fields"), expected));
        }
        _ => error.to_string(),
    };
    not_a_recording(path, found, "a table of numbers")
}
