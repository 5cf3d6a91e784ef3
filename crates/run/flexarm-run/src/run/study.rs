//! Comparison of several runs: robots, link models, steppers or trajectories side by side, in one
//! recording and one report.
//!
//! Start at [`compare_study`]. Not here: differences between finished runs (`comparison`), the
//! report (`report`).

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use flexarm_log::{Recorder, RecordingFormat, StudyRecorder, Trace};

use crate::arm::Arm;
use crate::arm::options::{Outputs, RunOptions};
use crate::error::Error;
use crate::motions::scenario::Scenario;
use crate::run::comparison::difference;
use crate::run::magnification::{Expected, fit_color_scale};
use crate::run::record::{files_of_a_run, refuse_to_overwrite};
use crate::run::summary::Summary;
use crate::run::{Keep, Progress, Run, RunRequest};
use flexarm_settings::Setting;

/// One run of a study.
#[derive(Debug)]
pub struct Variant {
    /// Label in tables, plots and folder names.
    pub label: String,
    /// Arm of the run.
    pub arm: Arc<Arm>,
    /// Scenario of the run.
    pub scenario: Scenario,
    /// Options of the run.
    pub options: RunOptions,
}

impl Variant {
    /// Adds the label to an error.
    fn named(&self, error: Error) -> Error {
        Error::InStudy { label: self.label.clone(), source: Box::new(error) }
    }
}

/// Runs all variants and compares them with the first.
///
/// The first run's files are those of [`Arm::simulate_with`](crate::Arm::simulate_with); each other
/// run has its own subfolder. `study.rrd` and the report contain all runs. Returns the first run's
/// summary, with the others in [`Summary::with`], and the traces.
///
/// # Errors
/// As [`Arm::simulate_with`](crate::Arm::simulate_with), with the label of the run that failed;
/// [`Error::Value`] for labels that are not distinct.
pub fn compare_study(
    variants: &[Variant],
    outputs: Option<&Outputs>,
    progress: &mut Progress<'_>,
) -> Result<(Summary, Vec<(String, Trace)>), Error> {
    let Some(main) = variants.first() else {
        return Err(Error::Value("a study needs at least one run".into()));
    };
    let folders = folders(variants)?;
    let mut options = main.options.clone();
    let total: f64 = variants.iter().map(|v| v.scenario.duration_s()).sum();
    let mut before = 0.0;

    let own_outputs = |number: usize| {
        outputs.map(|outputs| match number {
            0 => outputs.clone(),
            // The viewer gets all runs in one recording.
            _ => Outputs { folder: outputs.folder.join(&folders[number]), ..outputs.clone() }
                .without(RecordingFormat::Rrd),
        })
    };
    let expected = expected_deflections(variants, own_outputs)?;
    let recording = StudyRecording::new(variants, outputs);
    let mut summaries = Vec::new();
    let mut traces: Vec<(String, Trace)> = Vec::new();
    for (number, variant) in variants.iter().enumerate() {
        let own = own_outputs(number);
        if number > 0 {
            options = RunOptions { magnification: main.options.magnification, ..variant.options.clone() };
        }
        // All arms have the same magnification and colour scale, so that they can be compared by
        // eye.
        let request = RunRequest {
            outputs: own.as_ref(),
            progress: Some(&mut |t: f64, _: f64| progress(before + t, total)),
            recorders: recording.recorder(number).into_iter().collect(),
            expected: Some(expected),
            ..RunRequest::keeping(Keep::Curves)
        };
        let run = variant.arm.simulate_with(&variant.scenario, &options, request);
        let Run { mut summary, trace, .. } = run.map_err(|error| variant.named(error))?;
        before += variant.scenario.duration_s();
        summary.label = Some(variant.label.clone());
        summary.difference = traces.first().and_then(|(_, first)| difference(first, &trace));
        summaries.push(summary);
        traces.push((variant.label.clone(), trace));
    }
    let with = summaries.split_off(1);
    let mut summary = Summary { with, ..summaries.remove(0) };
    if let Some(path) = recording.finish(&summary)? {
        summary.files.study = Some(path.display().to_string());
    }
    fit_color_scale(traces.iter_mut().map(|(_, trace)| trace));
    if let Some(outputs) = outputs {
        crate::report::write_study(outputs, &summary, &traces)?;
    }
    Ok((summary, traces))
}

/// Returns the largest expected deflections of the variants.
///
/// These are all checks that need no simulation: errors appear before minutes of running.
fn expected_deflections(
    variants: &[Variant],
    own_outputs: impl Fn(usize) -> Option<Outputs>,
) -> Result<Expected, Error> {
    let mut expected = Expected::default();
    for (number, variant) in variants.iter().enumerate() {
        let Variant { arm, scenario, options, .. } = variant;
        expected = expected.or(arm.expected(scenario, options).map_err(|error| variant.named(error))?);
        own_outputs(number).map_or(Ok(()), |outputs| refuse_to_overwrite(&outputs, &[]))?;
    }
    Ok(expected)
}

/// Maximum length of a run's folder name.
const LONGEST_NAME: usize = 100;

/// Returns the name of a run's folder: its label, restricted to characters that every file system
/// accepts.
pub(crate) fn folder_name(label: &str) -> String {
    label.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.=".contains(c) { c } else { '_' }).collect()
}

/// Returns the names of the runs' folders, which must be distinct, usable and no files of the
/// study.
fn folders(variants: &[Variant]) -> Result<Vec<String>, Error> {
    let mut taken = BTreeSet::new();
    let mut names = Vec::new();
    for variant in variants {
        let name = folder_name(&variant.label);
        // Empty, hidden, or taken on a file system that ignores case.
        if name.is_empty() || name.starts_with('.') || !taken.insert(name.to_lowercase()) {
            let message = format!(
                "the label {label:?} names two runs of the study, or none: give each {} a name=... of its own",
                Setting::Variant,
                label = variant.label
            );
            return Err(Error::Value(message));
        }
        // Taken by a file of the study.
        if files_of_a_run().any(|file| file == name.to_lowercase()) {
            let message = format!(
                "the label {label:?} is the name of a file of the study: give its {} another name=...",
                Setting::Variant,
                label = variant.label
            );
            return Err(Error::Value(message));
        }
        // Too long for a file system.
        if name.len() > LONGEST_NAME {
            let message = format!(
                "the label {label:?} has {letters} letters, at most {LONGEST_NAME} make a folder: give its {} a \
                 short name=...",
                Setting::Variant,
                label = variant.label,
                letters = name.len()
            );
            return Err(Error::Value(message));
        }
        names.push(name);
    }
    Ok(names)
}

/// Returns the table of the runs as a Markdown page.
fn study_markdown(summary: &Summary) -> String {
    let robot = flexarm_settings::written::markdown(&summary.robot);
    format!("# Study of {robot}\n\n") + &crate::run::comparison::table(summary)
}

/// Recording of all runs, if this process can write one and the outputs include it.
struct StudyRecording {
    study: Option<(PathBuf, Box<dyn StudyRecorder>)>,
}

impl StudyRecording {
    fn new(variants: &[Variant], outputs: Option<&Outputs>) -> Self {
        let Some(outputs) =
            outputs.filter(|outputs| outputs.recordings.contains(&RecordingFormat::Rrd) && variants.len() > 1)
        else {
            return Self { study: None };
        };
        let path = outputs.folder.join(crate::run::record::STUDY_FILE);
        let options = flexarm_log::CreateOptions::default().with_overwrite(outputs.overwrite);
        let labels = variants.iter().map(|v| v.label.clone()).collect();
        let study = flexarm_log::study_recorder(&path, options, labels);
        Self { study: study.map(|study| (path, study)) }
    }

    fn recorder(&self, number: usize) -> Option<Box<dyn Recorder>> {
        self.study.as_ref().map(|(_, study)| study.recorder(number))
    }

    fn finish(self, summary: &Summary) -> Result<Option<PathBuf>, Error> {
        let Some((path, study)) = self.study else { return Ok(None) };
        study.finish(&study_markdown(summary))?;
        Ok(Some(path))
    }
}
