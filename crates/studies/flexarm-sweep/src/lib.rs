//! Studies: many runs of one robot with varied values in its files, on all cores or several
//! machines, and their evaluation.
//!
//! `docs/sweep.md` describes the file of a study. [`Sweep::load`] reads and checks it,
//! [`Sweep::run`] computes the missing runs in a folder or in a shard of it, [`merge`] joins
//! folders of shards. Runs are numbered from 0; the number alone determines a run, on any machine.
//!
//! ```
//! use flexarm_sweep::{Finders, Sweep};
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../.."))?;
//! let root = std::env::current_dir()?;
//! let [robot, motion] = ["robots/kr210/robot.toml", "trajectories/point_to_point.toml"].map(|file| root.join(file));
//! let study = format!(
//!     "format = 1\nrobot = {robot:?}\nmotion = {motion:?}\n\
//!      [[parameter]]\npath = \"payload.mass\"\nvalues = [30.0, 75.5, 150.0]\n"
//! );
//! let path = std::env::temp_dir().join(format!("study_{}.toml", std::process::id()));
//! std::fs::write(&path, study)?;
//! let sweep = Sweep::load(&path, &Finders::default());
//! # std::fs::remove_file(path)?;
//! assert_eq!(sweep?.runs(), 3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here: the mathematics of designs and their evaluation ([`statistics`]); comparison of a few
//! runs by their curves ([`flexarm_run::compare_study`]).
#![allow(non_snake_case, reason = "monogram notation: X_WL, K_S; see docs/references.md")]

mod changes;
mod design;
mod direction;
mod error;
mod evaluate;
mod file;
mod metric;
mod options;
mod page;
mod path;
mod ranking;
mod recent;
mod replay;
mod results;
mod run_caveats;
pub mod statistics;
mod store;
mod table;
mod target;
mod value;
mod workshop;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use flexarm_log::CreateOptions;
use flexarm_run::Stopwatch;

use self::design::{Column, Design};
use self::evaluate::Answer;
use self::file::StudyFile;
use self::metric::{Metric, MetricError, Vocabulary};
use self::store::{Collected, Manifest, RUNS, Store, known_manifest};
use self::workshop::Workshop;
use flexarm_run::summary::DriveFigures;
use flexarm_run::{
    Arm, Error, LinkFigures, LinkStressFigures, PathFigures, Robot, RobotFileError, StrainGaugeFigures,
    StressPlaceFigures, StressPointFigures, Summary, TcpFigures,
};

pub use self::changes::{Change, load_changed};
pub use self::direction::Better;
pub use self::error::SweepError;
pub use self::file::Role as ParameterRole;
pub use self::replay::Replay;
pub use self::results::{
    BestRun, FailureFigures, IndexFigures, MetricFigures, ParameterFigures, ParetoFigures, ParetoRun, SweepSummary,
};
pub use self::run_caveats::CaveatFigures;
pub use self::store::Shard;
pub use self::value::ParameterValue;

/// Default metrics of a study.
const USUAL_METRICS: [&str; 4] = ["tcp.peak_m", "tcp.rms_m", "tcp.end_m", "tcp.static_sag_m"];
/// Name of the sampled points in the list of inputs.
const DRAWN_POINTS: &str = "the drawn points";
/// File name of the page of a study.
const PAGE: &str = "report.html";
/// Maximum number of quick runs that a thread takes at a time.
const WINDOW: usize = 64;
/// Interval between two calls of the progress function, which can stop the runs.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Functions that find robots and motions by name.
#[derive(Clone, Copy, Debug)]
pub struct Finders {
    /// Path of a robot file.
    pub robot: fn(&Path) -> PathBuf,
    /// Path of a motion or a file of loads.
    pub motion: fn(&Path) -> PathBuf,
}

impl Default for Finders {
    /// Takes names as paths.
    fn default() -> Self {
        Self { robot: Path::to_path_buf, motion: Path::to_path_buf }
    }
}

/// Study that has been read and checked.
pub struct Sweep {
    file: StudyFile,
    design: Design,
    workshop: Workshop,
    metrics: Vec<Metric>,
    /// Whether all metrics are available without the full summary of a run.
    quick: bool,
}

/// Arguments of [`Sweep::run`].
#[derive(Clone, Debug)]
pub struct SweepRequest {
    /// Folder of the results; runs that it contains are not repeated.
    pub output: PathBuf,
    /// Whether to replace the results of another study.
    pub overwrite: bool,
    /// Shard of the runs to compute.
    pub shard: Shard,
    /// Number of threads; the number of cores if absent.
    pub threads: Option<usize>,
    /// Function that returns the command for a run of the written files, as shown by the caller's
    /// interface.
    pub command: Option<fn(&Replay) -> String>,
}

/// Progress function, called with the numbers of finished runs and of all runs.
pub type SweepProgress<'a> = dyn FnMut(usize, usize) -> ControlFlow<()> + 'a;

impl Sweep {
    /// Reads and checks a study and all files that it names.
    ///
    /// # Errors
    /// [`Error::RobotFile`] with line and column of an error in the study: invalid paths, unknown
    /// metrics, missing files; errors of the robot.
    pub fn load(path: &Path, finders: &Finders) -> Result<Self, Error> {
        // Files, then the parameters against them, then the metrics against a summary of the robot.
        let file = file::read(path)?;
        let mut workshop = Workshop::new(&file, finders)?;
        let columns = columns(&file, &workshop)?;
        workshop.vary(&columns, &file, finders)?;
        let design = Design::new(columns, &file)?;
        let robot = workshop.base_robot()?;
        let arm = robot.model(&workshop.base_modelling())?;
        let summary = serde_json::to_value(skeleton(&robot, &arm)).unwrap_or_default();
        let parameters = parameter_names(&design);
        let mut metrics: Vec<Metric> = Vec::new();
        let usual = file.metrics.is_empty().then(|| {
            let frequency = (!arm.springs.is_empty()).then_some("f1_hz = frequencies_hz.0");
            let place = file.robot.place.clone();
            USUAL_METRICS
                .into_iter()
                .chain(frequency)
                .map(move |text| (text.to_owned(), place.clone()))
                .collect::<Vec<_>>()
        });
        // A metric may use those before it.
        let asked = file.metrics.iter().map(|metric| (metric.text.clone(), metric.place.clone()));
        for (text, place) in usual.into_iter().flatten().chain(asked) {
            let known = Vocabulary { parameters: &parameters, metrics: &metrics, summary: &summary };
            let fail = |error: MetricError| RobotFileError { message: error.to_string(), ..place };
            let mut metric = Metric::parse(&text, &known).map_err(fail)?;
            let given = file.better.iter().find(|(name, ..)| *name == metric.name);
            metric.better = given.map(|(_, better, _)| *better).or(metric.better);
            metrics.push(metric);
        }
        check_names(&file, &metrics)?;
        table::check()?;
        let quick = metrics.iter().all(Metric::is_quick);
        Ok(Self { file, design, workshop, metrics, quick })
    }

    /// Returns the name of the study, by default the stem of its file name.
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// Returns the number of runs.
    pub fn runs(&self) -> usize {
        self.design.runs()
    }

    /// Names of the parameters.
    pub fn parameters(&self) -> Vec<&str> {
        self.design.columns.iter().map(|column| column.name.as_str()).collect()
    }

    /// Names of the metrics.
    pub fn metrics(&self) -> Vec<&str> {
        self.metrics.iter().map(|metric| metric.name.as_str()).collect()
    }

    /// Values of the parameters in a run, in the order of the parameters.
    pub fn values(&self, run: usize) -> Vec<ParameterValue> {
        self.design.values(run)
    }

    /// Computes the missing runs of a shard. If the shard is the whole study, also writes the table
    /// of all runs.
    ///
    /// A failed run is a row with the reason of the failure.
    ///
    /// # Errors
    /// [`SweepError`] for a folder of another study or another process at the same shard,
    /// [`SweepError::Stopped`] if `progress` breaks; [`Error::Write`]. Finished runs are kept.
    pub fn run(&mut self, request: &SweepRequest, progress: &mut SweepProgress<'_>) -> Result<SweepSummary, Error> {
        let stopwatch = Stopwatch::start();
        let SweepRequest { output, shard, .. } = request;
        let runs = self.runs();
        if shard.number == 0 || shard.number > shard.of || shard.of > runs {
            return Err(SweepError::Shard { number: shard.number, of: shard.of, runs }.into());
        }
        let manifest = self.manifest();
        self.workshop.put_links_into(output);
        let (mut store, mut collected) = Store::open(output, manifest.clone(), *shard, request.overwrite)?;
        let todo: Vec<usize> =
            (0..runs).filter(|run| shard.has(*run) && !collected.answers.contains_key(run)).collect();
        let all = (0..runs).filter(|run| shard.has(*run)).count();
        let before = all - todo.len();
        let threads = request.threads.unwrap_or_else(rayon::current_num_threads).max(1);
        let mut shown = |done: usize| progress(before + done, all);
        let mut new = Vec::new();
        let ended = self.run_all(&todo, threads, &mut shown, &mut |mut answer| {
            collected.share(&mut answer);
            new.push(answer.clone());
            store.keep(answer, self)
        });
        // Finished runs are kept even after an error, if the disk has space.
        let rolled = store.roll(self);
        let is_whole = ended?;
        rolled?;
        for answer in new {
            collected.answers.insert(answer.run, (answer, 0));
        }
        if !is_whole {
            let done = collected.answers.len();
            return Err(SweepError::Stopped { done, runs, folder: output.clone() }.into());
        }
        if *shard != Shard::ALL {
            let (summary, _) = self.summary(&collected);
            let (wall_s, cpu_s) = (stopwatch.wall_s(), stopwatch.cpu_s());
            let shard = Some(format!("{}/{}", shard.number, shard.of));
            return Ok(SweepSummary { shard, wall_s, cpu_s, file: output.display().to_string(), ..summary });
        }
        let path = self.write_all_runs(&collected, &manifest, output)?;
        store.remove_parts();
        self.finish(&collected, &path, output, request.command, stopwatch)
    }

    /// Writes summary, page and the best run of a complete study.
    fn finish(
        &self,
        collected: &Collected,
        table: &Path,
        folder: &Path,
        command: Option<fn(&Replay) -> String>,
        stopwatch: Stopwatch,
    ) -> Result<SweepSummary, Error> {
        let (mut summary, columns) = self.summary(collected);
        if let Some(best) = &mut summary.best {
            let replay = self.write_replay(&self.design.values(best.run), &folder.join("best"))?;
            best.command = command.map(|command| command(&replay));
            best.files = Some(replay);
        }
        summary.file = table.display().to_string();
        let page = folder.join(PAGE);
        summary.page = Some(page.display().to_string());
        (summary.wall_s, summary.cpu_s) = (stopwatch.wall_s(), stopwatch.cpu_s());
        let json = serde_json::to_string_pretty(&summary).expect("plain numbers and strings") + "\n";
        flexarm_files::write_all(&[(page, self.page(&summary, &columns)), (folder.join("sweep.json"), json)])?;
        Ok(summary)
    }

    /// Computes runs on several threads; returns whether all are finished.
    fn run_all(
        &self,
        todo: &[usize],
        threads: usize,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
        keep: &mut dyn FnMut(Answer) -> Result<(), Error>,
    ) -> Result<bool, Error> {
        let (stop, next) = (AtomicBool::new(false), AtomicUsize::new(0));
        let window = if self.quick { (todo.len() / (8 * threads)).clamp(4, WINDOW) } else { 1 };
        let (sender, receiver) = channel();
        let mut done = 0;
        let mut failed = None;
        // Threads take windows of runs; this thread keeps the results and asks whether to go on.
        std::thread::scope(|scope| {
            for _ in 0..threads {
                let (sender, stop, next) = (sender.clone(), &stop, &next);
                scope.spawn(move || {
                    loop {
                        let start = next.fetch_add(window, Ordering::Relaxed);
                        if start >= todo.len() || stop.load(Ordering::Relaxed) {
                            break;
                        }
                        let few = &todo[start..(start + window).min(todo.len())];
                        self.evaluate(few, stop, &mut |answer| {
                            let _ = sender.send(answer); // the receiver is gone if the run was stopped
                        });
                    }
                });
            }
            drop(sender);
            loop {
                match receiver.recv_timeout(POLL_INTERVAL) {
                    Ok(answer) if failed.is_none() => match keep(answer) {
                        Ok(()) => done += 1,
                        Err(error) => {
                            failed = Some(error);
                            stop.store(true, Ordering::Relaxed);
                        }
                    },
                    Ok(_) | Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
                if progress(done).is_break() {
                    stop.store(true, Ordering::Relaxed);
                }
            }
        });
        match failed {
            Some(error) => Err(error),
            None => Ok(done == todo.len()),
        }
    }

    /// Writes the table of all runs.
    fn write_all_runs(&self, collected: &Collected, manifest: &Manifest, folder: &Path) -> Result<PathBuf, Error> {
        if let Some(missing) = collected.missing(self.runs()) {
            return Err(missing.into());
        }
        let answers: Vec<Answer> = collected.answers.values().map(|(answer, _)| answer.clone()).collect();
        let path = folder.join(RUNS);
        table::write(&path, &self.table(&answers, manifest), CreateOptions::default().with_overwrite(true))?;
        Ok(path)
    }

    /// Returns the description that identifies this study and its files.
    fn manifest(&self) -> Manifest {
        let mut inputs = vec![(
            self.file.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            fingerprint(self.file.text.as_bytes()),
        )];
        inputs.extend(self.workshop.inputs());
        let drawn = self.design.drawn_coordinates();
        if !drawn.is_empty() {
            let bytes: Vec<u8> = drawn.iter().flat_map(|coordinate| coordinate.to_le_bytes()).collect();
            inputs.push((DRAWN_POINTS.into(), fingerprint(&bytes)));
        }
        let mut manifest = Manifest {
            format: 1,
            fingerprint: String::new(),
            study: self.file.name.clone(),
            flexarm: env!("CARGO_PKG_VERSION").into(),
            runs: self.runs(),
            parameters: self.parameters().into_iter().map(str::to_owned).collect(),
            metrics: self.metrics().into_iter().map(str::to_owned).collect(),
            inputs,
            file: String::new(),
        };
        manifest.fingerprint = fingerprint(serde_json::to_string(&manifest).unwrap_or_default().as_bytes());
        let file = std::path::absolute(&self.file.path).unwrap_or_else(|_| self.file.path.clone());
        Manifest { file: file.display().to_string(), ..manifest }
    }
}

/// Joins the results of shards: all runs of all folders in one table.
///
/// * `output`: folder of the table.
///
/// # Errors
/// [`SweepError`] for missing runs, repeated runs with different results, folders of other studies.
pub fn merge(
    study: &Sweep,
    folders: &[PathBuf],
    output: &Path,
    overwrite: bool,
    command: Option<fn(&Replay) -> String>,
) -> Result<SweepSummary, Error> {
    let stopwatch = Stopwatch::start();
    let manifest = study.manifest();
    let mut collected = Collected::default();
    // All folders must be of this study; together they must have all runs.
    let mut first: Option<&PathBuf> = None;
    for folder in folders {
        let known = known_manifest(folder)?.ok_or_else(|| SweepError::NoStudy { folder: folder.clone() })?;
        if known.fingerprint != manifest.fingerprint {
            let differs = known.differs(&manifest);
            let first = first.cloned().unwrap_or_else(|| study.file.path.clone());
            return Err(SweepError::ForeignShard { folder: folder.clone(), first, differs }.into());
        }
        first.get_or_insert(folder);
        collected.read(folder, &manifest)?;
    }
    let path = output.join(RUNS);
    if path.exists() && !overwrite && !folders.iter().any(|folder| folder == output) {
        return Err(Error::Taken { path, place: "folder", movable: true });
    }
    std::fs::create_dir_all(output).map_err(|source| Error::Write { path: output.to_owned(), source })?;
    let path = study.write_all_runs(&collected, &manifest, output)?;
    if known_manifest(output)?.is_none() {
        let text = serde_json::to_string_pretty(&manifest).expect("plain numbers and strings") + "\n";
        flexarm_files::write_all(&[(output.join(store::STUDY), text)])?;
    }
    study.finish(&collected, &path, output, command, stopwatch)
}

/// Writes files prepared in memory.
///
/// # Errors
/// [`Error::Taken`], [`Error::Write`].
pub fn write_files(files: &[(PathBuf, String)], overwrite: bool) -> Result<(), Error> {
    let paths: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
    flexarm_files::check_free(&paths, overwrite)?;
    Ok(flexarm_files::write_all(files)?)
}

/// Checks that `best`, `better` and `pareto` name metrics.
fn check_names(file: &StudyFile, metrics: &[Metric]) -> Result<(), RobotFileError> {
    let best = file.best.iter().map(|best| (&best.text, &best.place));
    let pareto = file.pareto.iter().flat_map(|(pair, place)| pair.iter().map(move |name| (name, place)));
    let better = file.better.iter().map(|(name, _, place)| (name, place));
    for (name, place) in best.chain(pareto).chain(better) {
        if !metrics.iter().any(|metric| metric.name == *name) {
            let known: Vec<&str> = metrics.iter().map(|metric| metric.name.as_str()).collect();
            let message = format!("{name:?} is not a metric of the study; its metrics are {}", known.join(", "));
            return Err(RobotFileError { message, ..place.clone() });
        }
    }
    Ok(())
}

/// Returns the columns of the parameters; one per matched entry for parameters with `each`.
fn columns(file: &StudyFile, workshop: &Workshop) -> Result<Vec<Column>, RobotFileError> {
    let mut columns = Vec::new();
    for entry in &file.parameters {
        if !entry.each {
            let name = entry.name.clone().unwrap_or_else(|| entry.paths[0].clone());
            columns.push(Column::of(entry, name, entry.paths.clone()));
            continue;
        }
        for path in &entry.paths {
            let fail =
                |message: String| RobotFileError { message: format!("parameter {message}"), ..entry.place.clone() };
            let places = workshop.expanded(path).map_err(|error| fail(error.to_string()))?;
            if places.is_empty() {
                return Err(fail(format!("{path:?} matches no entry")));
            }
            columns.extend(places.into_iter().map(|place| Column::of(entry, place.clone(), vec![place])));
        }
    }
    Ok(columns)
}

/// Returns the names of the numeric parameters; `None` for others.
fn parameter_names(design: &Design) -> Vec<Option<String>> {
    design.columns.iter().map(|column| column.is_numeric().then(|| column.name.clone())).collect()
}

/// Returns an example of a summary with all names that a run of the robot can have.
fn skeleton(robot: &Robot, arm: &Arm) -> Summary {
    let links = arm.spans.iter().map(|span| LinkFigures { name: span.link.clone(), ..LinkFigures::default() });
    // Links, and stresses where the robot file asks for them, all with example numbers.
    let stressed = robot.flexible_links.iter().filter(|link| link.stress.is_some());
    let place = StressPlaceFigures { of_yield: Some(0.0), damage: Some(0.0), ..StressPlaceFigures::default() };
    let stress = stressed.map(|link| {
        let own = || robot.gauges.iter().filter(|gauge| gauge.link == link.flexible.link);
        let points = own().filter(|gauge| gauge.grid.is_none());
        let strain = own().filter(|gauge| gauge.grid.is_some());
        LinkStressFigures {
            name: link.flexible.link.clone(),
            of_yield: Some(0.0),
            damage: Some(0.0),
            most_damaged: Some(place.clone()),
            points: points.map(|p| StressPointFigures { name: p.name.clone(), place: place.clone() }).collect(),
            gauges: strain
                .map(|gauge| StrainGaugeFigures { name: gauge.name.clone(), ..StrainGaugeFigures::default() })
                .collect(),
            ..LinkStressFigures::default()
        }
    });
    let elastic = robot.drives.iter().filter(|drive| drive.gearbox.is_some());
    let elastic = elastic.map(|drive| DriveFigures { joint: drive.joint.clone(), ..DriveFigures::default() });
    let drives: BTreeMap<String, f64> =
        arm.model.coordinates().iter().map(|coordinate| (coordinate.joint.clone(), 0.0)).collect();
    Summary {
        tcp: Some(TcpFigures::default()),
        path: Some(PathFigures::default()),
        links: links.collect(),
        stress: stress.collect(),
        elastic_drives: elastic.collect(),
        frequencies_hz: vec![0.0; arm.model.nv() - arm.model.n_actuated()],
        drives,
        ..Summary::default()
    }
}

/// Returns a hash of a text that is the same on any machine (FNV-1a, 64 bits, twice with different
/// initial values).
fn fingerprint(bytes: &[u8]) -> String {
    let hash = |start: u64| bytes.iter().fold(start, |h, byte| (h ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    format!("{:016x}{:016x}", hash(0xcbf2_9ce4_8422_2325), hash(0x9e37_79b9_7f4a_7c15))
}

/// Kernels, for the tests of this crate.
#[doc(hidden)]
pub mod internals {
    pub use crate::changes::change_text;
    pub use crate::evaluate::Answer;
    pub use crate::metric::{Facts, Metric, MetricError, Quick, SummaryFacts, Vocabulary};
    pub use crate::page::Axes;
    pub use crate::replay::faster_waypoints;
    pub use crate::run_caveats::{figures, stored_caveats, warnings};
    pub use crate::statistics::chance::threshold;
}
