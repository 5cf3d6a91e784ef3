//! Reader of the MCAP file of a run, record by record: the memory in use does not depend on the
//! length of the run, and a truncated file is read up to its last whole chunk.
//!
//! Start at [`McapRun`]. [`walk`] iterates over the records, [`found`] keeps data stored once,
//! [`assembly`] assembles samples from messages, and [`frames`] computes poses in the world from
//! transforms between neighbours. Not here: other formats ([`crate::read`]).

mod assembly;
mod found;
mod frames;
mod walk;

use std::path::{Path, PathBuf};

use mcap::records::Record;

use self::assembly::{Assembly, Topic, UnreadableMessage};
use self::found::FileContents;
use self::walk::{Flow, walk};
use super::{broken_end, not_a_recording};
use crate::{LogError, RunHeader, RunResult, RunSource, Sample, run_json};

/// A run read from an MCAP file.
pub(crate) struct McapRun {
    path: PathBuf,
    header: RunHeader,
    epoch_ns: u64,
    /// Topics of every sample, taken from the first one.
    topics: Vec<Topic>,
    /// Number of attached files that belong to the header.
    files_of_header: usize,
    missing: Vec<String>,
    warnings: Vec<String>,
}

impl McapRun {
    pub(crate) fn open(path: &Path) -> Result<Self, LogError> {
        // Names and set-up, up to the second sample.
        let mut found = FileContents::default();
        let broken = walk(path, &mut |record| {
            found.take(record);
            Ok(if found.samples > 1 { Flow::Stop } else { Flow::On })
        })?;
        let (mut header, files_of_header, mut missing) = found.header(path, broken.as_deref())?;

        // Read the first sample again, now with known topic names: every sample has its topics.
        let epoch_ns = found.recording("epoch_ns").and_then(|text| text.parse().ok()).unwrap_or(0);
        header.start_ns = Some(epoch_ns).filter(|start| *start != crate::START_NS);
        let mut assembly = Assembly::new(&header, epoch_ns);
        let mut topics = Vec::new();
        walk(path, &mut |record| {
            let done = assembly.take(&record).map_err(|error| not_of_flexarm(path, &error))?;
            if done {
                topics.clone_from(&assembly.done_topics);
            }
            Ok(if done { Flow::Stop } else { Flow::On })
        })?;
        if topics.is_empty() {
            assembly.close();
            topics.clone_from(&assembly.done_topics); // the only sample, or none
        }
        // The header must not promise what the samples lack.
        if !header.contributors.is_empty() && !topics.is_empty() && !topics.contains(&Topic::Contributions) {
            header.contributors.clear();
            missing.push("the file has no shares of the tool error (/tcp/contributions)".into());
        }
        if !header.gauges.is_empty() && !topics.is_empty() && !topics.contains(&Topic::Gauges) {
            header.gauges.clear();
            missing.push("the file has no strain gauges and stress points (/gauges)".into());
        }
        if header.has_static && !topics.is_empty() && !topics.contains(&Topic::StaticError) {
            header.has_static = false;
            missing.push("the file has no static part of the tool error (/tcp/static_error)".into());
        }
        if !header.bends.is_empty() && !topics.is_empty() && !assembly.frames.has_stations {
            header.bends.clear();
            missing.push("the file has no frames of stations along bent links".into());
        }
        let path = path.to_owned();
        Ok(Self { path, header, epoch_ns, topics, files_of_header, missing, warnings: Vec::new() })
    }
}

fn not_of_flexarm(path: &Path, error: &UnreadableMessage) -> LogError {
    not_a_recording(path, error.to_string(), "messages of flexarm")
}

impl RunSource for McapRun {
    fn header(&self) -> &RunHeader {
        &self.header
    }

    fn missing(&self) -> Vec<String> {
        self.missing.clone()
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn replay(&mut self, take: &mut dyn FnMut(&Sample) -> Result<(), LogError>) -> Result<RunResult, LogError> {
        self.warnings.clear();
        let path = &self.path;
        let mut assembly = Assembly::new(&self.header, self.epoch_ns);
        let mut found = FileContents::default();
        let (mut count, mut last_s) = (0_u64, 0.0);
        let topics = &self.topics;
        let mut give = |assembly: &Assembly| -> Result<(), LogError> {
            // Skip an incomplete sample at a truncated end.
            if assembly.done_topics == *topics && !topics.is_empty() {
                take(&assembly.done)?;
                (count, last_s) = (count + 1, assembly.done.time_s);
            }
            Ok(())
        };
        let broken = walk(path, &mut |record| {
            let done = assembly.take(&record).map_err(|error| not_of_flexarm(path, &error))?;
            if done {
                give(&assembly)?;
            }
            if !matches!(record, Record::Message { .. }) {
                found.take(record);
            }
            Ok(Flow::On)
        })?;
        if assembly.close() {
            give(&assembly)?;
        }
        let figures = found.metadata.iter().find(|(name, _)| name == "flexarm.result").map(|(_, pairs)| pairs);
        match (&broken, figures) {
            (Some(cause), _) => self.warnings.push(broken_end(path, cause, count, last_s)),
            (None, None) => self.warnings.push(format!(
                "{}: the run was not finished; {count} samples, up to t = {last_s} s, were read",
                path.display()
            )),
            _ if !found.whole => self.warnings.push(broken_end(path, "its index is missing", count, last_s)),
            _ => {}
        }
        // Event topic and result metadata are for other programs; the attached result also has the
        // kinds and the order.
        let mut result = match &found.result {
            Some(text) => run_json::read_result(&String::from_utf8_lossy(text)),
            None => RunResult {
                figures: figures.map(|pairs| pairs.clone().into_iter().collect()).unwrap_or_default(),
                events: std::mem::take(&mut assembly.events),
                ..RunResult::default()
            },
        };
        result.attachments.extend(found.files.into_iter().skip(self.files_of_header));
        Ok(result)
    }
}
