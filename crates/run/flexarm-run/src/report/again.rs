//! Report of a recorded run.
//!
//! Start at [`report`]. Not here: reading recordings (`convert::read_run`), the page (`html`), its
//! figures (`figure_groups`).

use std::path::{Path, PathBuf};

use flexarm_analysis::{ErrorSample, LongRecord, MetricSettings};
use flexarm_files::{check_apart, check_free, write_all};
use flexarm_log::{EventKind, RecordingFormat, RunHeader, Trace};
use flexarm_settings::Setting;
use serde::Serialize;

use super::{ReportRun, figures, html};
use crate::error::{Error, RecordingError};
use crate::report::convert::{no_sample, read_run};
use crate::run::magnification::fit_color_scale;
use crate::run::stepper_settings::StepperSettings;
use crate::run::study::folder_name;
use crate::run::summary::{CURVE_PIECES, StepperFigures, Summary, TcpFigures};

/// Options of a report.
#[derive(Clone, Debug, Default)]
pub struct ReportOptions {
    /// Path of the page; by default `report.html` next to the first recording.
    pub output: Option<PathBuf>,
    /// Whether to write a folder with figures for papers next to the page.
    pub figures: bool,
    /// Whether existing files are overwritten.
    pub overwrite: bool,
}

/// Written files.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReportFiles {
    /// Recordings that were read.
    pub inputs: Vec<String>,
    /// Path of the page.
    pub report: String,
    /// Folder with figures.
    pub figures: Option<String>,
    /// Warnings, as sentences.
    pub warnings: Vec<String>,
}

/// Trajectory name that table readers use if the recording has none.
const UNKNOWN: &str = "unknown";

/// Recording to be read.
struct Input {
    path: PathBuf,
    /// Summary from the study, if known; the one in the recording lacks what the study adds.
    of_study: Option<Summary>,
}

/// Makes the report of one recording, or one page that compares several. The folder of a study
/// gives the page of the study.
///
/// The figures are those stored in the recording. If there are none (a table, a killed run), the
/// TCP figures are computed from the curves, and the others are left out.
///
/// # Errors
/// As [`read_run`]; [`Error::File`] for a folder without a recording; [`Error::Taken`];
/// [`Error::File`] if the page would replace one of its own recordings.
pub fn report(recordings: &[PathBuf], options: &ReportOptions) -> Result<ReportFiles, Error> {
    let mut warnings = Vec::new();

    // The recordings; the folder of a study stands for all of its runs.
    let mut inputs = Vec::new();
    for path in recordings {
        inputs.push(Input { path: recording(path)?, of_study: None });
        let study = path.is_dir().then(|| study(path)).flatten();
        match study {
            Some(study) if recordings.len() == 1 => inputs = runs_of(path, study, inputs, &mut warnings),
            Some(study) => warnings.push(format!(
                "{}: holds a study, of which only the first run is shown; give the folders of its other {} too",
                path.display(),
                study.with.len()
            )),
            None => {}
        }
    }
    let Some(first) = inputs.first() else {
        return Err(RecordingError::NothingToReport.into());
    };
    let page = options.output.clone().unwrap_or_else(|| first.path.with_file_name("report.html"));
    let folder = page.with_file_name(crate::run::record::FIGURES_FOLDER);
    check_places(&inputs, &page, &folder, options)?;

    // One colour scale, so that the runs can be compared by eye.
    let mut runs = read_all(&inputs, &mut warnings)?;
    fit_color_scale(runs.iter_mut().map(|(.., trace)| trace));
    let reports: Vec<ReportRun<'_>> =
        runs.iter().map(|(label, summary, trace)| ReportRun { label, summary, trace }).collect();
    write_all(&[(page.clone(), html(&reports))])?;
    if let (true, Some((_, summary, trace))) = (options.figures, runs.first()) {
        figures::write(&folder, summary, trace)?;
    }
    Ok(ReportFiles {
        inputs: inputs.iter().map(|input| input.path.display().to_string()).collect(),
        report: page.display().to_string(),
        figures: options.figures.then(|| folder.display().to_string()),
        warnings,
    })
}

/// Reads label, figures and curves of each recording.
fn read_all(inputs: &[Input], warnings: &mut Vec<String>) -> Result<Vec<(String, Summary, Trace)>, Error> {
    let mut runs: Vec<(String, Summary, Trace)> = Vec::new();
    for Input { path, of_study } in inputs {
        let (json, trace, warned) = read_run(path)?;
        if trace.rows.is_empty() {
            return Err(no_sample(path, warned.last()));
        }
        let name = format!("{}: ", path.display());
        // Some messages already name the file.
        let named = |sentence: String| if sentence.starts_with(&name) { sentence } else { name.clone() + &sentence };
        warnings.extend(warned.into_iter().map(named));
        let stored = of_study.clone().or_else(|| json.and_then(|json| serde_json::from_value::<Summary>(json).ok()));
        let mut summary = stored.unwrap_or_else(|| {
            warnings.push(format!(
                "{}: the recording holds no result (a table, or a run that was stopped): the figures of the tool are computed \
                 from its curves, others are missing",
                path.display()
            ));
            computed(&trace)
        });
        // Results of older versions lack the settling band; the header of their recordings has it.
        if let Some(tcp) = summary.tcp.as_mut().filter(|tcp| tcp.settling_band_m.is_none()) {
            tcp.settling_band_m = settling_band_m(&trace.header);
        }
        if summary.difference.is_none() {
            summary.difference =
                runs.first().and_then(|(_, _, first)| crate::run::comparison::difference(first, &trace));
        }
        let label = match (inputs.len(), &summary.label) {
            (1, _) => super::title(&summary),
            (_, Some(label)) if of_study.is_some() => label.clone(),
            _ => path.display().to_string(),
        };
        runs.push((label, summary, trace));
    }
    Ok(runs)
}

/// Checks that the output paths are free, before anything is read in full or written.
fn check_places(inputs: &[Input], page: &Path, folder: &Path, options: &ReportOptions) -> Result<(), Error> {
    let read: Vec<&Path> = inputs.iter().map(|input| &*input.path).collect();
    check_apart(&[page.to_owned()], &read)?;
    check_free(&[page.to_owned()], options.overwrite)?;
    if !options.figures || !folder.exists() {
        Ok(())
    } else if !folder.is_dir() {
        let what = "is a file, a folder with figures is to be written there: choose another place with";
        Err(Error::File { path: folder.to_owned(), what: format!("{what} {}", Setting::Output) })
    } else if !options.overwrite {
        Err(Error::Taken { path: folder.to_owned(), place: "place", movable: true })
    } else {
        Ok(())
    }
}

/// Returns the recording to read: the file itself, or the one in the folder of a run.
fn recording(path: &Path) -> Result<PathBuf, Error> {
    let fail = |what: String| Err(Error::File { path: path.to_owned(), what });
    if !path.exists() {
        return fail("there is no such file or folder: give a recording, or the folder of a run".into());
    }
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    match in_folder(path) {
        Some(path) => Ok(path),
        None => {
            let names: Vec<_> = RecordingFormat::read_back().iter().map(|format| format.info().file_name).collect();
            fail(format!("the folder has no recording: expected one of {}", names.join(", ")))
        }
    }
}

/// Returns the most complete recording in the folder of a run.
fn in_folder(folder: &Path) -> Option<PathBuf> {
    let there: Vec<(RecordingFormat, PathBuf)> = RecordingFormat::read_back()
        .into_iter()
        .map(|format| (format, folder.join(format.info().file_name)))
        .filter(|(_, path)| path.is_file())
        .collect();
    // An unreadable format must not cause a failure if a readable recording exists.
    let readable = there.iter().find(|(format, _)| format.is_built_in());
    readable.or(there.first()).map(|(_, path)| path.clone())
}

/// Returns the summary in a folder if it is that of a study.
fn study(folder: &Path) -> Option<Summary> {
    let bytes = std::fs::read(folder.join("summary.json")).ok()?;
    let summary: Summary = serde_json::from_slice(&bytes).ok()?;
    (!summary.with.is_empty()).then_some(summary)
}

/// Returns the first run of a study and the others; runs without a recording are left out with a
/// warning.
fn runs_of(folder: &Path, mut study: Summary, first: Vec<Input>, warnings: &mut Vec<String>) -> Vec<Input> {
    let others = std::mem::take(&mut study.with);
    let mut runs: Vec<Input> =
        first.into_iter().map(|input| Input { of_study: Some(study.clone()), ..input }).collect();
    for other in others {
        let label = other.label.clone().unwrap_or_default();
        let own = folder.join(folder_name(&label));
        match in_folder(&own).filter(|_| !label.is_empty()) {
            Some(path) => runs.push(Input { path, of_study: Some(other) }),
            None => warnings
                .push(format!("{}: no recording of the run {label:?} of the study, which is left out", own.display())),
        }
    }
    runs
}

/// Returns a value of the metadata.
pub(super) fn metadata_value<'a>(header: &'a RunHeader, group: &str, key: &str) -> Option<&'a str> {
    let (_, rows) = header.metadata.iter().find(|(name, _)| name == group)?;
    let (_, value) = rows.iter().find(|(name, _)| name == key)?;
    Some(value.as_str()).filter(|value| !value.is_empty())
}

/// Half width of the settling band (m), from the text in a recording.
fn settling_band_m(header: &RunHeader) -> Option<f64> {
    metadata_value(header, "flexarm.run", "settling_band_m")?.parse().ok()
}

/// Computes the figures that follow from curves only.
fn computed(trace: &Trace) -> Summary {
    let header = &trace.header;
    let of_kind = |kind: EventKind| trace.events().iter().filter(move |e| e.kind == kind).map(|e| e.time_s);
    let moves: Vec<(f64, f64)> = of_kind(EventKind::MoveStart).zip(of_kind(EventKind::MoveEnd)).collect();
    let usual = MetricSettings::default();
    let settling_band_m = settling_band_m(header).unwrap_or(usual.settling_band_m);

    // The figures of the TCP as in a run.
    let mut record = LongRecord::new(moves.clone(), false, MetricSettings { settling_band_m, ..usual });
    for row in trace.rows.iter().filter(|row| row.error_world.iter().all(|x| x.is_finite())) {
        record.push(&ErrorSample {
            time_s: row.time_s,
            error: row.error_world,
            path_error: [0, 1, 2].map(|c| row.error_path[c]),
            rigid_position: row.rigid_m,
            static_m: row.static_m,
        });
    }
    let metrics = record.metrics().ok().filter(|_| header.has_rigid);
    let mut tcp = metrics.as_ref().map(|metrics| TcpFigures::from(metrics).with_band(settling_band_m));
    if let (true, Ok(parts)) = (header.has_static, record.parts()) {
        tcp = tcp.map(|tcp| tcp.with_parts(&parts));
    }
    if let Some(tcp) = tcp.as_mut().filter(|_| moves.is_empty()) {
        // Without known moves, vibration cannot be separated from the motion, so there is no
        // frequency.
        (tcp.dominant_hz, tcp.settling_s) = (None, None);
    }

    // Names and settings, from the metadata if the recording has them.
    let named = |name: &str, otherwise: &str| if name.is_empty() { otherwise.to_owned() } else { name.to_owned() };
    let run = |key: &str| metadata_value(header, "flexarm.run", key);
    let flexible = if header.elements.is_empty() { "" } else { "flexible" };
    let robot = run("robot").unwrap_or(&header.robot);
    let trajectory = run("trajectory").unwrap_or(&header.trajectory);
    Summary {
        robot: named(robot, "recorded run"),
        trajectory: if trajectory == UNKNOWN { String::new() } else { trajectory.to_owned() },
        links_model: metadata_value(header, "flexarm.model", "links").unwrap_or(flexible).to_owned(),
        stepper: StepperFigures {
            name: run("stepper").unwrap_or_default().to_owned(),
            h_s: run("step_s").and_then(|h| h.parse().ok()).unwrap_or(header.step_s),
            settings: StepperSettings::from_texts(run),
            ..StepperFigures::default()
        },
        duration_s: trace.rows.last().map_or(0.0, |row| row.time_s),
        tcp,
        error_curve: record.largest_errors(CURVE_PIECES),
        moves_s: moves.iter().map(|&(start, end)| [start, end]).collect(),
        computed: true,
        ..Summary::default()
    }
}
