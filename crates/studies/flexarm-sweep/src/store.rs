//! Results folder of a study: results so far, in files that survive a crash of the program.
//!
//! ```text
//! study.json              identifies the study: its runs, columns and input files
//! parts/1-of-4.journal    a line for each finished run, written at once
//! parts/1-of-4-0.parquet  the same as a table, once the journal is long or the shard is finished
//! runs.parquet            all runs by number, once none is missing; parts are then removed
//! ```
//! A truncated last line of a journal is ignored. Parts are written under a temporary name. The
//! bytes of `runs.parquet` depend only on its rows, not on the machine, the number of shards or the
//! order of the runs.

use std::collections::{BTreeMap, HashSet};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use flexarm_files::{read_text, write_all};
use flexarm_log::{CreateOptions, DataColumn, DataTable, DataValues, LogError};
use flexarm_settings::Place;
use serde::{Deserialize, Serialize};

use super::design::CAVEATS;
use super::error::SweepError;
use super::evaluate::Answer;
use super::value::ParameterValue;
use super::{Sweep, table};
use flexarm_run::Error;

/// File that identifies the study of a folder.
pub(super) const STUDY: &str = "study.json";
/// Table of all runs.
pub(super) const RUNS: &str = "runs.parquet";
/// Folder of the parts.
const PARTS: &str = "parts";
/// Number of journal entries that are converted to a part.
const ROLL: usize = 20_000;
/// Maximum time between two syncs to disk.
const SYNC: Duration = Duration::from_secs(2);

/// Description that identifies the study of a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub(super) format: u32,
    pub(super) fingerprint: String,
    pub(super) study: String,
    /// Version of the program.
    pub(super) flexarm: String,
    pub(super) runs: usize,
    pub(super) parameters: Vec<String>,
    pub(super) metrics: Vec<String>,
    /// Input files and some sampled points, with a fingerprint of each.
    pub(super) inputs: Vec<(String, String)>,
    /// Path of the study file.
    pub(super) file: String,
}

impl Manifest {
    /// Returns the differences from another study, in words.
    pub(super) fn differs(&self, other: &Self) -> String {
        let mut differences = Vec::new();
        if self.runs != other.runs {
            differences.push(format!("the number of runs ({} and {})", self.runs, other.runs));
        }
        for (name, print) in &self.inputs {
            match other.inputs.iter().find(|(known, _)| known == name) {
                Some((_, known)) if known != print => differences.push(format!("the content of {name}")),
                None => differences.push(format!("{name}, which only one study has")),
                _ => {}
            }
        }
        let is_new = |name: &String| self.inputs.iter().all(|(known, _)| known != name);
        let new = other.inputs.iter().map(|(name, _)| name).filter(|name| is_new(name));
        differences.extend(new.map(|name| format!("{name}, which only one study has")));
        if self.flexarm != other.flexarm {
            differences.push(format!("the version of the program ({} and {})", self.flexarm, other.flexarm));
        }
        if differences.is_empty() {
            differences.push("the names of its files".into());
        }
        differences.join(", ")
    }
}

/// Shard of the runs: those with `run % of == number - 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the shard, from 1.
    pub number: usize,
    /// Number of shards.
    pub of: usize,
}

impl Shard {
    /// All runs as one shard.
    pub const ALL: Self = Self { number: 1, of: 1 };

    /// Whether a run belongs to the shard.
    pub fn has(self, run: usize) -> bool {
        run % self.of == self.number - 1
    }

    fn stem(self) -> String {
        format!("{}-of-{}", self.number, self.of)
    }
}

/// Contents of a results folder.
#[derive(Debug, Default)]
pub(super) struct Collected {
    /// Results by run, with the index of the file that contains them.
    pub(super) answers: BTreeMap<usize, (Answer, usize)>,
    /// Files, for messages.
    files: Vec<PathBuf>,
    /// Number of runs found more than once with the same result.
    pub(super) doubles: usize,
    /// Number of shards.
    pub(super) shards: Option<usize>,
    /// Texts of caveats, each stored once.
    texts: HashSet<Arc<str>>,
}

/// Line of a journal: run, reason of failure, metrics, caveats.
#[derive(Serialize, Deserialize)]
struct Line(usize, Option<String>, Vec<Option<f64>>, #[serde(default)] Option<String>);

impl Collected {
    /// Makes a result share the text of its caveats with equal ones.
    pub(super) fn share(&mut self, answer: &mut Answer) {
        let Some(text) = &answer.stored else { return };
        match self.texts.get(text) {
            Some(known) => answer.stored = Some(known.clone()),
            None => _ = self.texts.insert(text.clone()),
        }
    }

    fn add(&mut self, mut answer: Answer, file: usize) -> Result<(), SweepError> {
        self.share(&mut answer);
        match self.answers.get(&answer.run) {
            None => {
                self.answers.insert(answer.run, (answer, file));
            }
            Some((known, first)) if !same(known, &answer) => {
                let (first, second) = (self.files[*first].clone(), self.files[file].clone());
                return Err(SweepError::Twice { run: answer.run, first, second });
            }
            Some(_) => self.doubles += 1,
        }
        Ok(())
    }

    /// Reads all parts, journals, and the table of all runs in a folder.
    ///
    /// # Errors
    /// [`SweepError::Twice`], [`SweepError::Broken`], errors of the operating system.
    pub(super) fn read(&mut self, folder: &Path, manifest: &Manifest) -> Result<(), Error> {
        let whole = folder.join(RUNS);
        if whole.is_file() {
            self.read_table(&whole, manifest)?;
        }
        let mut names: Vec<PathBuf> = match std::fs::read_dir(folder.join(PARTS)) {
            Ok(entries) => entries.flatten().map(|entry| entry.path()).collect(),
            Err(_) => Vec::new(),
        };
        names.sort();
        for path in names {
            match path.extension().and_then(|ending| ending.to_str()) {
                Some("parquet") => self.read_table(&path, manifest)?,
                Some("journal") => {
                    let (answers, _) = read_journal(&path, manifest)?;
                    self.files.push(path.clone());
                    let file = self.files.len() - 1;
                    let before = self.doubles;
                    answers.into_iter().try_for_each(|answer| self.add(answer, file))?;
                    // A journal converted to a part but not yet emptied repeats the same runs.
                    self.doubles = before;
                }
                _ => continue,
            }
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let of = stem.split('-').nth(2).and_then(|of| of.parse().ok());
            self.shards = of.filter(|of| *of > 1).or(self.shards);
        }
        Ok(())
    }

    fn read_table(&mut self, path: &Path, manifest: &Manifest) -> Result<(), Error> {
        let broken = |what: String| SweepError::Broken { place: Place::of_file(path.display()), what };
        let table = table::read(path).map_err(|error| match error {
            Error::Log(LogError::NotARecording { found, .. }) => {
                broken(format!("found {found}: remove the file to repeat its runs")).into()
            }
            other => other,
        })?;
        // A part of another study, or without a column of this one, is refused.
        let print = table.texts.iter().find(|(key, _)| key == "flexarm.fingerprint").map(|(_, print)| print.as_str());
        if print != Some(&manifest.fingerprint) {
            return Err(broken("belongs to another study; remove it from the folder".into()).into());
        }
        let Some(DataValues::Whole(runs)) = table.column("run") else {
            return Err(broken("has no column \"run\"".into()).into());
        };
        let mut metrics = Vec::new();
        for name in &manifest.metrics {
            match table.column(name) {
                Some(DataValues::Number(values)) => metrics.push(values),
                _ => return Err(broken(format!("has no column {name:?} of numbers")).into()),
            }
        }
        let Some(DataValues::Text(reasons)) = table.column("reason") else {
            return Err(broken("has no column \"reason\"".into()).into());
        };
        let caveats = match table.column(CAVEATS) {
            Some(DataValues::Text(texts)) => texts.as_slice(),
            _ => return Err(broken(format!("has no column {CAVEATS:?}")).into()),
        };
        // Row after row: a reason, or the metrics.
        self.files.push(path.to_owned());
        let file = self.files.len() - 1;
        for (row, run) in runs.iter().enumerate() {
            let result = match &reasons[row] {
                Some(reason) => Err(reason.clone()),
                None => Ok(metrics.iter().map(|values| values[row]).collect()),
            };
            let run = usize::try_from(*run).ok().filter(|run| *run < manifest.runs);
            let run = run.ok_or_else(|| broken(format!("has a run number outside 0 to {}", manifest.runs - 1)))?;
            let stored = caveats[row].as_deref().map(Arc::from);
            self.add(Answer { run, result, stored }, file)?;
        }
        Ok(())
    }

    /// Describes the missing runs; `None` if all are present.
    pub(super) fn missing(&self, runs: usize) -> Option<SweepError> {
        let missing = runs - self.answers.len();
        if missing == 0 {
            return None;
        }
        // By shard where the folder has shards, else by number.
        let mut which = String::new();
        if let Some(of) = self.shards {
            let (mut lacking, mut all) = (vec![0usize; of], vec![0usize; of]);
            for run in 0..runs {
                all[run % of] += 1;
                lacking[run % of] += usize::from(!self.answers.contains_key(&run));
            }
            let text = |k: usize| match lacking[k] == all[k] {
                true => format!("shard {}/{of} (all {})", k + 1, all[k]),
                false => format!("shard {}/{of} ({} of {})", k + 1, lacking[k], all[k]),
            };
            let lacking: Vec<String> = (0..of).filter(|k| lacking[*k] > 0).map(text).collect();
            which = shortened(&lacking);
        }
        if which.is_empty() {
            let first: Vec<String> =
                (0..runs).filter(|run| !self.answers.contains_key(run)).take(6).map(|run| run.to_string()).collect();
            which = format!("run {}", shortened(&first));
        }
        Some(SweepError::Missing { missing, runs, which, shards: self.shards })
    }
}

/// Shortens a list to its first few entries.
fn shortened(list: &[String]) -> String {
    const MAX: usize = 5;
    match list.len() > MAX {
        true => format!("{} and {} more", list[..MAX].join(", "), list.len() - MAX),
        false => list.join(", "),
    }
}

/// Whether two results of one run are bitwise equal.
fn same(a: &Answer, b: &Answer) -> bool {
    match (&a.result, &b.result) {
        (Ok(a), Ok(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
        }
        (Err(a), Err(b)) => a == b,
        _ => false,
    }
}

/// Reads the results in a journal, and the length of its complete lines in bytes.
fn read_journal(path: &Path, manifest: &Manifest) -> Result<(Vec<Answer>, u64), Error> {
    let bytes = std::fs::read(path)
        .map_err(|error| Error::File { path: path.into(), what: format!("cannot be read: {error}") })?;
    let mut answers = Vec::new();
    let mut whole = 0;
    for line in bytes.split_inclusive(|byte| *byte == b'\n') {
        if line.last() != Some(&b'\n') {
            break; // truncated while being written
        }
        let broken = |found: String| SweepError::Broken {
            place: Place::of_file(path.display()).line(answers.len() + 1),
            what: format!(
                "this is not a valid result ({found}); remove the line, or remove the file to repeat its runs"
            ),
        };
        let Line(run, reason, metrics, stored) =
            serde_json::from_slice(line).map_err(|error| broken(error.to_string()))?;
        let (runs, expected) = (manifest.runs, manifest.metrics.len());
        if run >= runs || reason.is_none() && metrics.len() != expected {
            let found = format!("run {run} of {runs} with {} metrics, expected {expected}", metrics.len());
            return Err(broken(found).into());
        }
        let numbers = metrics.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect();
        answers.push(Answer { run, result: reason.map_or(Ok(numbers), Err), stored: stored.map(Arc::from) });
        whole += line.len() as u64;
    }
    Ok((answers, whole))
}

/// Open results folder of a study.
#[derive(Debug)]
pub(super) struct Store {
    pub(super) folder: PathBuf,
    manifest: Manifest,
    shard: Shard,
    journal: File,
    journal_path: PathBuf,
    /// Results in the journal, not yet in a part.
    pending: Vec<Answer>,
    synced: Instant,
}

impl Store {
    /// Opens the folder of a study for a shard, and reads its contents.
    ///
    /// # Errors
    /// [`SweepError::Foreign`], [`SweepError::Running`], [`SweepError::Broken`]; errors of the
    /// operating system.
    pub(super) fn open(
        folder: &Path,
        manifest: Manifest,
        shard: Shard,
        overwrite: bool,
    ) -> Result<(Self, Collected), Error> {
        let write = |path: &Path| {
            let path = path.to_owned();
            move |source: std::io::Error| Error::Write { path, source }
        };
        // Results of another study are replaced only if the caller wants that.
        if let Some(known) = known_manifest(folder)? {
            if known.fingerprint != manifest.fingerprint {
                if !overwrite {
                    let differs = known.differs(&manifest);
                    return Err(SweepError::Foreign { folder: folder.to_owned(), differs }.into());
                }
                clear(folder)?;
            }
        } else if folder.join(RUNS).exists() || folder.join(PARTS).exists() {
            let what = "exists without study.json: choose another folder".into();
            return Err(SweepError::Broken { place: Place::of_file(folder.join(RUNS).display()), what }.into());
        }
        // A new folder gets its manifest, the shard its journal, which one process at a time writes.
        let parts = folder.join(PARTS);
        std::fs::create_dir_all(&parts).map_err(write(&parts))?;
        let text = serde_json::to_string_pretty(&manifest).expect("plain numbers and strings") + "\n";
        if known_manifest(folder)?.is_none() {
            write_all(&[(folder.join(STUDY), text)])?;
        }
        let journal_path = parts.join(format!("{}.journal", shard.stem()));
        let journal = OpenOptions::new().create(true).truncate(false).write(true).open(&journal_path);
        let mut journal = journal.map_err(write(&journal_path))?;
        match journal.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(SweepError::Running { path: journal_path }.into()),
            // On file systems without locks the user must avoid two processes on one shard.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        // A truncated last line is cut off.
        let (pending, whole) = read_journal(&journal_path, &manifest)?;
        journal.set_len(whole).and_then(|()| journal.seek(SeekFrom::End(0))).map_err(write(&journal_path))?;
        let mut collected = Collected::default();
        collected.read(folder, &manifest)?;
        let folder = folder.to_owned();
        Ok((Self { folder, manifest, shard, journal, journal_path, pending, synced: Instant::now() }, collected))
    }

    /// Stores the result of a run, so that it survives the end of the program.
    ///
    /// # Errors
    /// [`Error::Write`], for instance on a full disk; earlier results are kept.
    pub(super) fn keep(&mut self, answer: Answer, sweep: &Sweep) -> Result<(), Error> {
        let (reason, metrics) = match &answer.result {
            Ok(values) => (None, values.iter().map(|x| x.is_finite().then_some(*x)).collect()),
            Err(reason) => (Some(reason.clone()), Vec::new()),
        };
        let line = Line(answer.run, reason, metrics, answer.stored.as_deref().map(str::to_owned));
        let line = serde_json::to_string(&line).expect("plain numbers and strings") + "\n";
        let failed = |source| Error::Write { path: self.journal_path.clone(), source };
        self.journal.write_all(line.as_bytes()).map_err(failed)?;
        if self.synced.elapsed() > SYNC {
            self.journal.sync_data().map_err(failed)?;
            self.synced = Instant::now();
        }
        self.pending.push(answer);
        if self.pending.len() >= ROLL {
            self.roll(sweep)?;
        }
        Ok(())
    }

    /// Converts the journal to a part.
    ///
    /// # Errors
    /// As [`Store::keep`].
    pub(super) fn roll(&mut self, sweep: &Sweep) -> Result<(), Error> {
        let failed = |source| Error::Write { path: self.journal_path.clone(), source };
        if self.pending.is_empty() {
            return Ok(());
        }
        let parts = self.folder.join(PARTS);
        let name = |k: usize| parts.join(format!("{}-{k}.parquet", self.shard.stem()));
        let number = (0..).find(|k| !name(*k).exists()).unwrap_or(0);
        self.pending.sort_by_key(|answer| answer.run);
        self.pending.dedup_by_key(|answer| answer.run);
        table::write(&name(number), &sweep.table(&self.pending, &self.manifest), CreateOptions::default())?;
        // Until now the runs are in both files, so that a crash loses none.
        self.journal.set_len(0).and_then(|()| self.journal.seek(SeekFrom::Start(0))).map_err(failed)?;
        self.journal.sync_data().map_err(failed)?;
        self.pending.clear();
        Ok(())
    }

    /// Removes the parts once the table of all runs exists.
    pub(super) fn remove_parts(self) {
        let parts = self.folder.join(PARTS);
        drop(self.journal);
        // Parts that cannot be removed only repeat the table.
        let _ = std::fs::remove_dir_all(parts);
    }
}

/// Returns the study of a folder.
///
/// # Errors
/// [`SweepError::Broken`].
pub(super) fn known_manifest(folder: &Path) -> Result<Option<Manifest>, Error> {
    let path = folder.join(STUDY);
    if !path.exists() {
        return Ok(None);
    }
    let broken = |what: String| SweepError::Broken { place: Place::of_file(path.display()), what };
    let manifest: Manifest = serde_json::from_str(&read_text(&path)?)
        .map_err(|error| broken(format!("is not a valid study ({error}): remove the folder, or choose another one")))?;
    if manifest.format != 1 {
        return Err(broken(format!("has format {}, this program reads format 1", manifest.format)).into());
    }
    Ok(Some(manifest))
}

/// Removes the results of a study and no other files.
pub(super) fn clear(folder: &Path) -> Result<(), Error> {
    for name in [RUNS, STUDY, "sweep.json", "report.html"] {
        let path = folder.join(name);
        if path.exists() {
            std::fs::remove_file(&path).map_err(|source| Error::Write { path, source })?;
        }
    }
    let parts = folder.join(PARTS);
    if parts.exists() {
        std::fs::remove_dir_all(&parts).map_err(|source| Error::Write { path: parts, source })?;
    }
    Ok(())
}

impl Sweep {
    /// Returns the table of some runs, in the given order.
    pub(super) fn table(&self, answers: &[Answer], manifest: &Manifest) -> DataTable {
        // Run, status, parameters, metrics, reason, caveats.
        let values: Vec<Vec<ParameterValue>> = answers.iter().map(|answer| self.design.values(answer.run)).collect();
        let status = |answer: &Answer| Some(if answer.result.is_ok() { "done" } else { "failed" }.to_owned());
        let mut columns = vec![
            DataColumn::new("run", DataValues::Whole(answers.iter().map(|answer| answer.run as i64).collect())),
            DataColumn::new("status", DataValues::Text(answers.iter().map(status).collect())),
        ];
        for (k, column) in self.design.columns.iter().enumerate() {
            let own = values.iter().map(|values| &values[k]);
            let values = match column.is_numeric() {
                true => DataValues::Number(own.map(|value| value.number().unwrap_or(f64::NAN)).collect()),
                false => DataValues::Text(own.map(|value| Some(value.to_string())).collect()),
            };
            columns.push(DataColumn::new(&column.name, values));
        }
        for (k, metric) in self.metrics.iter().enumerate() {
            let own = answers.iter().map(|answer| answer.result.as_ref().map_or(f64::NAN, |values| values[k]));
            columns.push(DataColumn::new(&metric.name, DataValues::Number(own.collect())));
        }
        let reasons = answers.iter().map(|answer| answer.result.as_ref().err().cloned()).collect();
        columns.push(DataColumn::new("reason", DataValues::Text(reasons)));
        let stored = answers.iter().map(|answer| answer.stored.as_deref().map(str::to_owned)).collect();
        columns.push(DataColumn::new(CAVEATS, DataValues::Text(stored)));
        let metrics: Vec<String> = self.metrics.iter().map(|metric| metric.text.clone()).collect();
        let texts = [
            ("flexarm.study", manifest.study.clone()),
            ("flexarm.fingerprint", manifest.fingerprint.clone()),
            ("flexarm.parameters", serde_json::to_string(&manifest.parameters).unwrap_or_default()),
            ("flexarm.metrics", serde_json::to_string(&metrics).unwrap_or_default()),
        ];
        DataTable { columns, texts: texts.map(|(key, text)| (key.to_owned(), text)).into() }
    }
}
