//! Texts of a Parquet file for everything that has no column.
//!
//! Writing: [`texts_at_start`], [`texts_at_end`], and samples in blocks of columns ([`Block`]).
//! Reading: a [`DescribedTable`] from the column names and texts of a file.

use std::path::Path;

use crate::read::{not_a_recording, stem};
use crate::shape::Shape;
use crate::table::{self, TableLayout};
use crate::{Attachment, LogError, RunHeader, RunResult, Sample, run_json};

/// Key of the run header, the same JSON as `run.json` in MCAP files.
const RUN_KEY: &str = "flexarm.run";
/// Key of the figures, events and attached texts of the result (JSON).
const RESULT_KEY: &str = "flexarm.result";
/// Key prefix of the attached set-up files; the file name follows.
const RUN_FILE: &str = "flexarm.run_file.";

/// Returns the texts known at the start of the run, as pairs of key and value.
pub(crate) fn texts_at_start(header: &RunHeader) -> Vec<(String, String)> {
    let mut pairs = vec![
        ("robot".to_owned(), header.robot.clone()),
        ("trajectory".into(), header.trajectory.clone()),
        ("units".into(), "SI: m, rad, s, N, N m, J; as in the names of the columns".into()),
        ("version".into(), env!("CARGO_PKG_VERSION").into()),
        (RUN_KEY.into(), run_json::write(header, false)),
    ];
    // Attached files that are valid UTF-8; others are left out.
    let text = |file: &Attachment| {
        let text = String::from_utf8(file.bytes.clone()).ok()?;
        Some((format!("{RUN_FILE}{}", file.name), text))
    };
    pairs.extend(header.attachments.iter().filter_map(text));
    pairs
}

/// Returns the texts known at the end of the run.
pub(crate) fn texts_at_end(result: &RunResult) -> Vec<(String, String)> {
    let label = |(label, value): &(String, String)| (format!("figure.{label}"), value.clone());
    let mut pairs: Vec<_> = result.figures.iter().map(label).collect();
    let result = RunResult { scenery: Vec::new(), ..result.clone() };
    pairs.push((RESULT_KEY.into(), run_json::write_result(&result)));
    pairs
}

/// Samples waiting to be written, column by column.
#[derive(Debug)]
pub(crate) struct Block {
    shape: Shape,
    row: Vec<f64>,
    pub(crate) columns: Vec<Vec<f64>>,
}

impl Block {
    /// Number of samples after which a block is written; bounds the memory in use.
    pub(crate) const ROWS: usize = 16_384;

    pub(crate) fn new(header: &RunHeader) -> Self {
        let columns = vec![Vec::new(); table::columns(header).len()];
        Self { shape: Shape::of(header), row: Vec::new(), columns }
    }

    /// Adds a sample.
    pub(crate) fn push(&mut self, path: &Path, sample: &Sample) -> Result<(), LogError> {
        self.shape.check(path, sample)?;
        table::fill_row(sample, &self.shape, &mut self.row);
        for (column, value) in self.columns.iter_mut().zip(&self.row) {
            column.push(*value);
        }
        Ok(())
    }

    /// Number of samples.
    pub(crate) fn rows(&self) -> usize {
        self.columns[0].len()
    }
}

/// Contents of a table as given by its column names and texts.
#[derive(Debug)]
pub(crate) struct DescribedTable {
    pub(crate) layout: TableLayout,
    pub(crate) result: RunResult,
    /// Whether the file has a run header ([`RUN_KEY`]).
    pub(crate) described: bool,
}

impl DescribedTable {
    /// Builds the description from the column names and texts of a file.
    pub(crate) fn of(path: &Path, names: &[String], texts: &[(String, String)]) -> Result<Self, LogError> {
        let value = |key: &str| texts.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str());
        let attached = |(key, text): &(String, String)| {
            let name = key.strip_prefix(RUN_FILE)?.to_owned();
            let media_type = media_type(&name).to_owned();
            Some(Attachment { name, media_type, bytes: text.clone().into_bytes() })
        };
        let mut attachments: Vec<Attachment> = texts.iter().filter_map(attached).collect();
        let refuse = |(found, expected)| not_a_recording(path, found, expected);
        let layout = match value(RUN_KEY).map(|text| run_json::read(text.as_bytes())) {
            Some(Ok((header, order, _))) => {
                // Other writers do not keep the order of the texts.
                attachments.sort_by_key(|file| order.iter().position(|name| *name == file.name));
                TableLayout::of_header(header, names)
            }
            Some(Err(error)) => Err((error.to_string(), "the description of a run".to_owned())),
            None => TableLayout::of_names(names),
        };
        let mut layout = layout.map_err(refuse)?;
        let described = value(RUN_KEY).is_some();
        if !described {
            (layout.header.robot, layout.header.trajectory) = (stem(path), "unknown".into());
        }
        layout.header.attachments = attachments;
        let result = value(RESULT_KEY).map(run_json::read_result).unwrap_or_default();
        Ok(Self { layout, result, described })
    }
}

fn media_type(name: &str) -> &'static str {
    match Path::new(name).extension().and_then(std::ffi::OsStr::to_str) {
        Some("json") => "application/json",
        Some("toml") => "application/toml",
        _ => "text/plain",
    }
}
