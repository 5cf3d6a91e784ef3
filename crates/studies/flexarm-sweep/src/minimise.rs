//! Minimisation of a metric within the bounds of the parameters and under constraints.
//!
//! The search requests one generation of runs at a time ([`LeastSearch`]). A journal stores each
//! result with the values of its parameters. A search that is resumed requests the same points
//! again and finds their results there.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};

use crate::statistics::{LeastSearch, SearchResult};
use flexarm_log::CreateOptions;
use flexarm_run::Stopwatch;
use serde::{Deserialize, Serialize};

use super::direction::Better;
use super::error::SweepError;
use super::evaluate::{Answer, MetricValues};
use super::file::{Role, Values};
use super::metric::{Constraint, Vocabulary};
use super::results::SweepSummary;
use super::run_caveats::CaveatText;
use super::store::{Manifest, RUNS, STUDY, known_manifest};
use super::value::ParameterValue;
use super::{PAGE, POLL_INTERVAL, Sweep, SweepProgress, SweepRequest, fingerprint, table};
use flexarm_run::Error;
use flexarm_run::RobotFileError;

/// Default number of runs.
const USUAL_RUNS: usize = 400;
/// File name of the journal.
const JOURNAL: &str = "minimise.journal";
/// Maximum number of runs that a thread takes at a time.
const FEW: usize = 4;

/// Objective, constraints and length of a search, in place of those of the study.
#[derive(Clone, Debug, Default)]
pub struct MinimiseRequest {
    /// Metric to minimise, one of the study's.
    pub metric: Option<String>,
    /// Constraints in addition to those of the study, such as `peak_mm <= 6`.
    pub constraints: Vec<String>,
    /// Maximum number of runs.
    pub runs: Option<usize>,
}

/// Progress and result of a search.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MinimiseFigures {
    /// Metric to minimise.
    pub metric: String,
    /// Constraints.
    pub constraints: Vec<String>,
    /// Whether the best run satisfies all constraints.
    pub kept: bool,
    /// Whether the search converged, that is, its points hardly differ.
    pub settled: bool,
    /// Number of generations.
    pub generations: usize,
    /// Value at the start of the search; null if that run failed.
    pub start: Option<f64>,
    /// Whether the run at the start satisfies the constraints.
    pub start_kept: bool,
    /// Minimum so far of the runs that satisfy the constraints, after each generation; null before
    /// there is one.
    pub progress: Vec<Option<f64>>,
}

/// Line of the journal: values of the search variables, reason of a failure, metrics, violations,
/// caveats.
#[derive(Serialize, Deserialize)]
struct Line(Vec<f64>, Option<String>, Vec<Option<f64>>, Vec<Option<f64>>, #[serde(default)] Option<String>);

/// Result of a run.
#[derive(Clone)]
struct Outcome {
    /// Metrics and violations, or the reason why there are none.
    result: Result<MetricValues, String>,
    stored: CaveatText,
}

/// Variable of the search.
struct SearchVariable {
    column: usize,
    low: f64,
    high: f64,
}

/// Points tried, in order, with their results.
#[derive(Default)]
struct TriedPoints {
    values: Vec<Vec<ParameterValue>>,
    outcomes: Vec<Outcome>,
}

fn judged(outcome: &Outcome, goal: usize) -> SearchResult {
    match &outcome.result {
        Ok((metrics, passed)) => SearchResult { value: metrics[goal], violation: passed.iter().sum() },
        Err(_) => SearchResult { value: f64::NAN, violation: f64::NAN },
    }
}

impl TriedPoints {
    /// Returns the index of the best point.
    fn best(&self, goal: usize) -> Option<usize> {
        (0..self.outcomes.len()).reduce(|best, k| {
            if judged(&self.outcomes[k], goal).beats(&judged(&self.outcomes[best], goal)) { k } else { best }
        })
    }
}

/// Results so far, on disk and by parameter values.
struct Journal {
    path: PathBuf,
    file: File,
    known: HashMap<Vec<u64>, Outcome>,
}

impl Journal {
    fn open(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(JOURNAL);
        let failed = |source| Error::Write { path: path.clone(), source };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let text = std::fs::read(&path).unwrap_or_default();
        let mut known = HashMap::new();
        let mut whole = 0;
        for line in text.split_inclusive(|byte| *byte == b'\n').filter(|line| line.ends_with(b"\n")) {
            let Ok(Line(values, reason, metrics, passed, stored)) = serde_json::from_slice(line) else { break };
            let number = |list: Vec<Option<f64>>| list.into_iter().map(|x| x.unwrap_or(f64::NAN)).collect::<Vec<f64>>();
            let result = reason.map_or_else(|| Ok((number(metrics), number(passed))), Err);
            known.insert(key(&values), Outcome { result, stored: stored.map(Arc::from) });
            whole += line.len() as u64;
        }
        let file = OpenOptions::new().create(true).truncate(false).write(true).open(&path).map_err(failed)?;
        file.set_len(whole).map_err(failed)?;
        let file = OpenOptions::new().append(true).open(&path).map_err(failed)?;
        Ok(Self { path, file, known })
    }

    fn keep(&mut self, values: &[f64], outcome: &Outcome) -> Result<(), Error> {
        let list = |list: &[f64]| list.iter().map(|x| x.is_finite().then_some(*x)).collect();
        let stored = outcome.stored.as_deref().map(str::to_owned);
        let line = match &outcome.result {
            Ok((metrics, passed)) => Line(values.to_vec(), None, list(metrics), list(passed), stored),
            Err(reason) => Line(values.to_vec(), Some(reason.clone()), Vec::new(), Vec::new(), stored),
        };
        let text = serde_json::to_string(&line).expect("plain numbers and strings") + "\n";
        self.file.write_all(text.as_bytes()).map_err(|source| Error::Write { path: self.path.clone(), source })?;
        self.known.insert(key(values), outcome.clone());
        Ok(())
    }
}

fn key(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

impl Sweep {
    /// Minimises a metric over the parameters within their bounds; [`MinimiseRequest`] and the
    /// study give metric and constraints. The runs are written like those of a study.
    ///
    /// # Errors
    /// [`SweepError::Minimise`] without a metric to minimise or without parameters to vary; an
    /// error with the place in the study for parameters without bounds; otherwise as
    /// [`Sweep::run`].
    pub fn minimise(
        &mut self,
        request: &SweepRequest,
        search: &MinimiseRequest,
        progress: &mut SweepProgress<'_>,
    ) -> Result<SweepSummary, Error> {
        let stopwatch = Stopwatch::start();
        let goal = self.aim(search)?;
        let varied = self.varied()?;
        let entry = self.file.minimise.as_ref();
        let most = search.runs.or(entry.and_then(|entry| entry.runs)).unwrap_or(USUAL_RUNS);
        let seed = entry.map_or(0, |entry| entry.seed);
        let manifest = self.search_manifest(goal);
        self.claim(request, &manifest)?;
        self.workshop.put_links_into(&request.output);
        let mut journal = Journal::open(&request.output)?;

        let start: Vec<f64> = varied.iter().map(|v| self.start(v)).collect();
        let mut least = LeastSearch::new(&start, seed);
        let (mut tried, mut figures) = (TriedPoints::default(), MinimiseFigures::default());
        while tried.values.len() < most && !least.is_settled() {
            let points: Vec<Vec<ParameterValue>> = least.ask().iter().map(|p| self.point(&varied, p)).collect();
            let done = tried.values.len();
            let mut shown = |new: usize| progress((done + new).min(most), most);
            let outcomes = self.generation(&points, &varied, request, &mut journal, &mut shown)?;
            let Some(outcomes) = outcomes else {
                let folder = request.output.clone();
                return Err(SweepError::Stopped { done: journal.known.len(), runs: most, folder }.into());
            };
            least.tell(&outcomes.iter().map(|outcome| judged(outcome, goal)).collect::<Vec<_>>());
            tried.values.extend(points);
            tried.outcomes.extend(outcomes);
            let best = tried.best(goal).map(|k| judged(&tried.outcomes[k], goal));
            figures.progress.push(best.filter(SearchResult::keeps).map(|best| best.value));
        }
        figures.generations = figures.progress.len();
        figures.settled = least.is_settled();
        self.search_summary(&tried, goal, figures, &manifest, request, stopwatch)
    }

    /// Adds the constraints of the request; returns the index of the metric to minimise.
    fn aim(&mut self, search: &MinimiseRequest) -> Result<usize, Error> {
        let fail = |what: String| Error::from(SweepError::Minimise { what });
        let name = (self.parameter_names(), self.metrics.clone());
        let known = Vocabulary { parameters: &name.0, metrics: &name.1, summary: &self.vocabulary };
        for text in &search.constraints {
            self.constraints.push(Constraint::parse(text, &known).map_err(|error| fail(error.to_string()))?);
        }
        self.quick = self.quick && self.constraints.iter().all(Constraint::is_quick);
        let place = |name: &str| self.metrics.iter().position(|metric| metric.name == name);
        let names = || self.metrics().join(", ");
        match (&search.metric, &self.file.minimise) {
            (Some(name), _) => place(name)
                .ok_or_else(|| fail(format!("{name:?} is not a metric of the study; its metrics are {}", names()))),
            (None, Some(entry)) => place(&entry.metric.text).ok_or_else(|| {
                let message =
                    format!("{:?} is not a metric of the study; its metrics are {}", entry.metric.text, names());
                RobotFileError { message, ..entry.metric.place.clone() }.into()
            }),
            (None, None) => {
                Err(fail("the study has no metric to minimise: add [minimise] with metric = \"...\"".into()))
            }
        }
    }

    /// Returns the variables of the search.
    fn varied(&self) -> Result<Vec<SearchVariable>, Error> {
        let mut found = Vec::new();
        for (column, own) in self.design.columns.iter().enumerate() {
            match (&own.values, own.bounds) {
                (Values::Derived(_), _) => {}
                (_, Some((low, high))) if low < high => found.push(SearchVariable { column, low, high }),
                _ => {
                    let message = format!(
                        "parameter {:?} has no bounds: a search needs from and to, or a distribution with low and high",
                        own.name
                    );
                    return Err(RobotFileError { message, ..own.place.clone() }.into());
                }
            }
        }
        match found.is_empty() {
            true => Err(SweepError::Minimise { what: "the study has no parameter to optimise".into() }.into()),
            false => Ok(found),
        }
    }

    /// Returns the start of a variable as a fraction of its range: the present value in the files
    /// if it is in the range, otherwise the middle.
    fn start(&self, varied: &SearchVariable) -> f64 {
        let own = &self.design.columns[varied.column];
        let now = self.workshop.current(varied.column).filter(|_| own.role != Role::Offset || varied.low <= 0.0);
        now.map(|x| (x - varied.low) / (varied.high - varied.low))
            .filter(|part| (0.0..=1.0).contains(part))
            .unwrap_or(0.5)
    }

    /// Returns the values of all parameters at a point of the search.
    fn point(&self, varied: &[SearchVariable], parts: &[f64]) -> Vec<ParameterValue> {
        let mut values = vec![ParameterValue::Whole(0); self.design.columns.len()];
        for (own, part) in varied.iter().zip(parts) {
            values[own.column] = ParameterValue::Number(own.low + (own.high - own.low) * part);
        }
        self.design.derive(&mut values);
        values
    }

    /// Returns the results of a generation; `None` if the user stopped it.
    fn generation(
        &self,
        points: &[Vec<ParameterValue>],
        varied: &[SearchVariable],
        request: &SweepRequest,
        journal: &mut Journal,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Option<Vec<Outcome>>, Error> {
        let numbers = |values: &[ParameterValue]| -> Vec<f64> {
            varied.iter().map(|own| values[own.column].number().unwrap_or(f64::NAN)).collect()
        };
        let mut outcomes: Vec<Option<Outcome>> =
            points.iter().map(|values| journal.known.get(&key(&numbers(values))).cloned()).collect();
        let todo: Vec<(usize, Vec<ParameterValue>)> = points
            .iter()
            .enumerate()
            .filter(|(k, _)| outcomes[*k].is_none())
            .map(|(k, values)| (k, values.clone()))
            .collect();
        let threads = request.threads.unwrap_or_else(rayon::current_num_threads).max(1);
        let (stop, next) = (AtomicBool::new(false), AtomicUsize::new(0));
        let (sender, receiver) = channel();
        let mut failed = None;
        std::thread::scope(|scope| {
            for _ in 0..threads {
                let (sender, todo, stop, next) = (sender.clone(), &todo, &stop, &next);
                scope.spawn(move || self.work_off(todo, todo.len().div_ceil(threads), next, stop, &sender));
            }
            drop(sender);
            loop {
                match receiver.recv_timeout(POLL_INTERVAL) {
                    Ok((k, outcome)) => {
                        if let Err(error) = journal.keep(&numbers(&points[k]), &outcome) {
                            failed.get_or_insert(error);
                            stop.store(true, Ordering::Relaxed);
                        }
                        outcomes[k] = Some(outcome);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
                if progress(outcomes.iter().flatten().count()).is_break() {
                    stop.store(true, Ordering::Relaxed);
                }
            }
        });
        match failed {
            Some(error) => Err(error),
            None => Ok(outcomes.into_iter().collect()),
        }
    }

    /// Evaluates the next points, a few at a time, until none is left or `stop` is set.
    fn work_off(
        &self,
        todo: &[(usize, Vec<ParameterValue>)],
        few: usize,
        next: &AtomicUsize,
        stop: &AtomicBool,
        sender: &Sender<(usize, Outcome)>,
    ) {
        let few = few.clamp(1, FEW);
        loop {
            let start = next.fetch_add(few, Ordering::Relaxed);
            if start >= todo.len() || stop.load(Ordering::Relaxed) {
                break;
            }
            let some = &todo[start..(start + few).min(todo.len())];
            self.evaluate_points(some, stop, &mut |place, result, stored| {
                let result = result.map_err(|error| self.workshop.reason(&error));
                let _ = sender.send((some[place].0, Outcome { result, stored }));
            });
        }
    }

    /// Returns the description that identifies the search of a folder.
    fn search_manifest(&self, goal: usize) -> Manifest {
        let mut manifest = self.manifest();
        let constraints: Vec<&str> = self.constraints.iter().map(|c| c.text.as_str()).collect();
        let text = format!("{} minimise {} {}", manifest.fingerprint, self.metrics[goal].text, constraints.join("; "));
        manifest.fingerprint = fingerprint(text.as_bytes());
        manifest.inputs.push(("objective and constraints".into(), fingerprint(text.as_bytes())));
        manifest
    }

    /// Prepares a folder for this search.
    fn claim(&self, request: &SweepRequest, manifest: &Manifest) -> Result<(), Error> {
        let folder = &request.output;
        if let Some(known) = known_manifest(folder)?
            && known.fingerprint != manifest.fingerprint
        {
            if !request.overwrite {
                let differs = known.differs(manifest);
                return Err(SweepError::Foreign { folder: folder.clone(), differs }.into());
            }
            super::store::clear(folder)?;
            let _ = std::fs::remove_file(folder.join(JOURNAL));
        }
        let text = serde_json::to_string_pretty(manifest).expect("plain numbers and strings") + "\n";
        Ok(flexarm_files::write_all(&[(folder.join(STUDY), text)])?)
    }

    /// Writes table, page and figures of the points tried.
    fn search_summary(
        &self,
        tried: &TriedPoints,
        goal: usize,
        figures: MinimiseFigures,
        manifest: &Manifest,
        request: &SweepRequest,
        stopwatch: Stopwatch,
    ) -> Result<SweepSummary, Error> {
        let folder = &request.output;
        let answer = |(run, outcome): (usize, &Outcome)| Answer {
            run,
            result: outcome.result.as_ref().map(|(metrics, _)| metrics.clone()).map_err(Clone::clone),
            stored: outcome.stored.clone(),
        };
        let answers: Vec<Answer> = tried.outcomes.iter().enumerate().map(answer).collect();
        let path = folder.join(RUNS);
        let all = self.table_of(&answers, &tried.values, manifest);
        table::write(&path, &all, CreateOptions::default().with_overwrite(true))?;
        let pairs: Vec<(&Answer, Vec<ParameterValue>)> = answers.iter().zip(tried.values.iter().cloned()).collect();
        let (mut summary, columns) = self.summary_of(&pairs, false);
        summary.runs = answers.len();
        let best = tried.best(goal);
        summary.best = best.map(|k| self.best_of(&answers[k], &tried.values[k], goal, Better::Lower));
        if let (Some(best), Some(k)) = (&mut summary.best, best) {
            let replay = self.write_replay(&tried.values[k], &folder.join("best"))?;
            best.command = request.command.map(|command| command(&replay));
            best.files = Some(replay);
        }
        let first = tried.outcomes.first().map(|outcome| judged(outcome, goal));
        summary.minimise = Some(MinimiseFigures {
            metric: self.metrics[goal].name.clone(),
            constraints: self.constraints.iter().map(|c| c.text.clone()).collect(),
            kept: best.is_some_and(|k| judged(&tried.outcomes[k], goal).keeps()),
            start: first.map(|first| first.value).filter(|value| value.is_finite()),
            start_kept: first.is_some_and(|first| first.keeps()),
            ..figures
        });
        summary.file = path.display().to_string();
        let page = folder.join(PAGE);
        summary.page = Some(page.display().to_string());
        (summary.wall_s, summary.cpu_s) = (stopwatch.wall_s(), stopwatch.cpu_s());
        let json = serde_json::to_string_pretty(&summary).expect("plain numbers and strings") + "\n";
        flexarm_files::write_all(&[(page, self.page(&summary, &columns)), (folder.join("sweep.json"), json)])?;
        Ok(summary)
    }
}
