//! Conversion of recordings between formats, and reading them into memory.
//!
//! Start at [`convert()`] and [`read_run`]. Not here: the formats (`flexarm-log`), the report
//! (`again`).

use std::io::ErrorKind;
use std::ops::ControlFlow;
use std::path::Path;

use flexarm_files::Partial;
use flexarm_log::{CreateOptions, LogError, RecordingFormat, RunSource, Sample, Trace, open_recording};
use flexarm_settings::Setting;
use serde::Serialize;

use crate::error::{Error, RecordingError};

/// Number of samples between two calls of the callback.
const POLL_EVERY: u64 = 1000;

/// Options of a conversion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConvertOptions {
    /// Format of the input, regardless of its extension.
    pub from: Option<RecordingFormat>,
    /// Format of the output, regardless of its extension.
    pub to: Option<RecordingFormat>,
    /// Whether to overwrite an existing output.
    pub overwrite: bool,
}

/// Summary of a conversion.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ConvertSummary {
    /// Path of the input.
    pub input: String,
    /// Path of the output.
    pub output: String,
    /// Extension of the input's format, such as mcap or csv.
    pub from: &'static str,
    /// Extension of the output's format.
    pub to: &'static str,
    /// Number of samples.
    pub samples: u64,
    /// Time from the first to the last sample (s).
    pub duration_s: f64,
    /// Content that was lost, as sentences.
    pub lost: Vec<String>,
    /// Warnings, such as a truncated end, as sentences.
    pub warnings: Vec<String>,
}

/// Writes the run of a recording as a recording of another format.
///
/// The output is written under a provisional name and renamed at the end: it is either complete or
/// absent, and an existing file stays until then.
///
/// # Errors
/// [`Error::Recording`] if a format is not known; [`Error::File`] if the input does not exist or is
/// the output too, or the output exists and may not be overwritten;
/// [`Error::Log`] for errors in the files.
pub fn convert(input: &Path, output: &Path, options: &ConvertOptions) -> Result<ConvertSummary, Error> {
    convert_until(input, output, options, &mut |_| ControlFlow::Continue(()))
}

/// As [`convert()`], until the callback breaks; its argument is the recording time reached so far
/// (s).
///
/// # Errors
/// As [`convert()`]; [`Error::Interrupted`] if the callback breaks, in which case no output is
/// left.
pub fn convert_until(
    input: &Path,
    output: &Path,
    options: &ConvertOptions,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<ConvertSummary, Error> {
    let from = format(input, options.from, Some(Setting::ReadFormat))?;
    let to = format(output, options.to, Some(Setting::WrittenFormat))?;
    let mut source = open(input, from)?;
    flexarm_files::check_apart(&[output.to_owned()], &[input])?;
    flexarm_files::check_free(&[output.to_owned()], options.overwrite)?;

    // The last moment to stop without having created a file.
    if progress(0.0).is_break() {
        return Err(Error::Interrupted { t: 0.0, partial: false });
    }
    let failed = |source| Error::Write { path: output.to_owned(), source };
    let (_, partial) = Partial::create(output).map_err(failed)?;
    let mut recorder = crate::run::record::recorder(to, partial.path(), CreateOptions::default().with_overwrite(true))?;
    // Messages name the requested file.
    let hidden = partial.path().to_owned();
    let named = |error: LogError| error.with_path_for(&hidden, output);
    recorder.begin(source.header()).map_err(named)?;
    let (mut samples, mut span, mut stopped) = (0, None, None);
    let result = source.replay(&mut |sample: &Sample| -> Result<(), LogError> {
        if samples % POLL_EVERY == 0 && progress(sample.time_s).is_break() {
            stopped = Some(sample.time_s);
            let source = ErrorKind::Interrupted.into();
            return Err(LogError::Io { path: output.to_owned(), action: "write", source });
        }
        samples += 1;
        let (first, _) = span.unwrap_or((sample.time_s, 0.0));
        span = Some((first, sample.time_s));
        recorder.record(sample).map_err(named)
    });
    if let Some(t) = stopped {
        return Err(Error::Interrupted { t, partial: false });
    }
    let result = result?;
    let Some((first, last)) = span else {
        return Err(no_sample(input, source.warnings().last()));
    };
    recorder.finish(&result).map_err(named)?;
    drop(recorder);
    partial.finish().map_err(failed)?;

    let mut lost = from.lost_on_the_way_to(to, source.header());
    lost.extend(source.missing());
    Ok(ConvertSummary {
        input: input.display().to_string(),
        output: output.display().to_string(),
        from: from.extension(),
        to: to.extension(),
        samples,
        duration_s: last - first,
        lost,
        warnings: source.warnings(),
    })
}

/// Error for a recording without samples; `why` is the reader's explanation.
pub(crate) fn no_sample(path: &Path, why: Option<&String>) -> Error {
    let mend = why.cloned().unwrap_or_else(|| "the run that should write it recorded nothing".into());
    let (path, found, expected) = (path.to_owned(), "no sample".into(), "at least one".into());
    LogError::NotARecording { path, line: None, found, expected, mend }.into()
}

/// Reads a recording into memory: its summary, if it contains one (MCAP and tables with texts), its
/// curves, and messages about missing parts.
///
/// Quantities that the format does not contain are NaN or empty
/// ([`flexarm_log::RunSource::missing`]); a truncated end is not an error but gives a message.
///
/// # Errors
/// As [`convert()`].
pub fn read_run(path: &Path) -> Result<(Option<serde_json::Value>, Trace, Vec<String>), Error> {
    let mut source = open(path, format(path, None, None)?)?;
    let mut trace = Trace::new(source.header().clone());
    let result = source.replay(&mut |sample: &Sample| {
        trace.push(sample);
        Ok(())
    })?;
    let summary = result.attachments.iter().find(|file| file.name == "summary.json");
    let summary = summary.and_then(|file| serde_json::from_slice(&file.bytes).ok());
    trace.finish(result);
    let mut warnings = [source.missing(), source.warnings()].concat();
    if trace.stride() > 1 {
        warnings.push(format!(
            "of its {} samples one of every {} is kept for figures that the recording does not hold",
            trace.samples(),
            trace.stride()
        ));
    }
    Ok((summary, trace, warnings))
}

/// Returns the recording format with this name.
///
/// # Errors
/// [`RecordingError::UnknownFormat`] with the valid names.
pub fn parse_recording_format(word: &str) -> Result<RecordingFormat, RecordingError> {
    RecordingFormat::from_word(word).ok_or(RecordingError::UnknownFormat)
}

/// Returns the format of a file, by its extension unless it is given.
fn format(path: &Path, given: Option<RecordingFormat>, setting: Option<Setting>) -> Result<RecordingFormat, Error> {
    if path.is_dir() {
        let what = "is a folder, a recording is a file: give one in it, such as run.mcap".into();
        return Err(Error::File { path: path.to_owned(), what });
    }
    let unknown = || RecordingError::UnknownEnding { path: path.to_owned(), setting };
    let format = given.or_else(|| RecordingFormat::from_path(path)).ok_or_else(unknown)?;
    let only_read = setting != Some(Setting::WrittenFormat);
    // A format that is never read back is refused where it is opened.
    if !format.is_built_in() && (!only_read || format.is_read_back()) {
        return Err(RecordingError::NotBuiltIn { path: path.to_owned(), format }.into());
    }
    Ok(format)
}

/// Opens a recording for reading.
fn open(path: &Path, format: RecordingFormat) -> Result<Box<dyn RunSource>, Error> {
    if !path.exists() {
        let what = "there is no such file: give a recording that flexarm compare or run wrote".into();
        return Err(Error::File { path: path.to_owned(), what });
    }
    Ok(open_recording(path, format)?)
}
