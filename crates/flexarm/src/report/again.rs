//! The report of a run that has been recorded.

use std::path::{Path, PathBuf};

use flexarm_analysis::{ErrorRecord, MetricSettings, tcp_metrics};
use flexarm_log::{EventKind, Trace};
use serde::Serialize;

use super::{ReportRun, figures, html};
use crate::convert::read_run;
use crate::error::Error;
use crate::result_files::{check_free, write_all};
use crate::summary::Summary;

/// Choices of a report.
#[derive(Clone, Debug, Default)]
pub struct ReportOptions {
    /// Where the page goes; beside the (first) recording, under the name `report.html`, without it.
    pub output: Option<PathBuf>,
    /// Write a folder with figures for papers beside the page.
    pub figures: bool,
    /// Overwrite what is there.
    pub overwrite: bool,
}

/// What was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReportFiles {
    /// Recordings that were read.
    pub inputs: Vec<String>,
    /// The page.
    pub report: String,
    /// Folder with figures.
    pub figures: Option<String>,
    /// Things worth telling: sentences.
    pub warnings: Vec<String>,
}

/// Recordings in the folder of a run, the one that holds most first.
const IN_FOLDER: [&str; 4] = ["run.mcap", "run.parquet", "run.csv", "run.rrd"];

/// Makes the report of one recording, or one page in which several are compared.
///
/// Figures are those that the recording holds. If it holds none (a table, a killed run), those of the tool are computed from
/// its curves.
///
/// # Errors
/// As [`read_run`]; [`Error::File`] for a folder without a recording and for places that are taken.
pub fn report(recordings: &[PathBuf], options: &ReportOptions) -> Result<ReportFiles, Error> {
    let inputs = recordings.iter().map(|path| recording(path)).collect::<Result<Vec<PathBuf>, Error>>()?;
    let Some(first) = inputs.first() else {
        return Err(Error::Usage("give at least one recording, or the folder of a run".into()));
    };
    let beside = |name: &str| first.with_file_name(name);
    let page = options.output.clone().unwrap_or_else(|| beside("report.html"));
    let folder = page.with_file_name(crate::record::FIGURES_FOLDER);
    check_free(std::slice::from_ref(&page), options.overwrite)?;
    if options.figures && folder.exists() && !options.overwrite {
        let what = "exists already and is not overwritten: choose another place with -o or give --force";
        return Err(Error::File { path: folder, what: what.into() });
    }

    let mut warnings = Vec::new();
    let mut runs: Vec<(String, Summary, Trace)> = Vec::new();
    for path in &inputs {
        let (json, trace) = read_run(path)?;
        let stored = json.and_then(|json| serde_json::from_value::<Summary>(json).ok());
        let summary = stored.unwrap_or_else(|| {
            warnings.push(format!(
                "{}: the recording holds no result (a table, or a run that was stopped): the figures of the tool are computed \
                 from its curves, others are missing",
                path.display()
            ));
            computed(&trace)
        });
        let label = match inputs.len() {
            1 => format!("{} on {}", summary.robot, summary.trajectory),
            _ => path.display().to_string(),
        };
        runs.push((label, summary, trace));
    }
    let reports: Vec<ReportRun<'_>> =
        runs.iter().map(|(label, summary, trace)| ReportRun { label, summary, trace }).collect();
    write_all(&[(page.clone(), html(&reports))])?;
    if let (true, Some((_, summary, trace))) = (options.figures, runs.first()) {
        figures::write(&folder, summary, trace)?;
    }
    Ok(ReportFiles {
        inputs: inputs.iter().map(|path| path.display().to_string()).collect(),
        report: page.display().to_string(),
        figures: options.figures.then(|| folder.display().to_string()),
        warnings,
    })
}

fn recording(path: &Path) -> Result<PathBuf, Error> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    IN_FOLDER.iter().map(|name| path.join(name)).find(|path| path.is_file()).ok_or_else(|| Error::File {
        path: path.to_owned(),
        what: format!("the folder has no recording: expected one of {}", IN_FOLDER.join(", ")),
    })
}

/// The figures that curves alone give.
fn computed(trace: &Trace) -> Summary {
    let rows: Vec<_> = trace.rows.iter().filter(|row| row.error_world.iter().all(|x| x.is_finite())).collect();
    let times: Vec<f64> = rows.iter().map(|row| row.time_s).collect();
    let errors: Vec<[f64; 6]> = rows.iter().map(|row| row.error_world).collect();
    let rigid_positions: Vec<[f64; 3]> = rows.iter().map(|row| row.rigid_m).collect();
    let of_kind = |kind: EventKind| trace.events().iter().filter(move |e| e.kind == kind).map(|e| e.time_s);
    let moves: Vec<(f64, f64)> = of_kind(EventKind::MoveStart).zip(of_kind(EventKind::MoveEnd)).collect();
    let record = ErrorRecord {
        times: &times,
        errors: &errors,
        rigid_positions: &rigid_positions,
        quasi_static: None,
        moves: &moves,
    };
    let metrics = tcp_metrics(&record, &MetricSettings::default()).ok();
    let named = |name: &str, otherwise: &str| if name.is_empty() { otherwise.to_owned() } else { name.to_owned() };
    Summary {
        robot: named(&trace.header.robot, "robot"),
        trajectory: named(&trace.header.trajectory, "motion"),
        links_model: if trace.header.elements.is_empty() { "rigid" } else { "flexible" }.into(),
        end: "not known: the recording holds no result".into(),
        duration_s: trace.rows.last().map_or(0.0, |row| row.time_s),
        tcp: metrics.as_ref().filter(|_| trace.header.has_rigid).map(Into::into),
        error_curve: crate::summary::thinned(&times, &errors),
        moves_s: moves.iter().map(|&(start, end)| [start, end]).collect(),
        ..Summary::default()
    }
}
