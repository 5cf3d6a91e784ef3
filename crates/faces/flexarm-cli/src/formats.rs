//! Formats of recordings as command-line words, all taken from the table of the library.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use flexarm::Outputs;
use flexarm::recordings::RecordingFormat;

use crate::args::RunArgs;
use crate::failure::{Failure, build_with};

/// Joins words as `a, b or c`.
fn listed(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

fn endings(formats: &[RecordingFormat]) -> Vec<String> {
    formats.iter().map(|format| format!(".{}", format.extension())).collect()
}

/// Description of `convert`.
pub fn about_convert() -> String {
    let names = RecordingFormat::ALL.map(|format| format.to_string());
    format!("Write a recording as {}", listed(&names))
}

/// Input of `convert`.
pub fn help_input() -> String {
    format!("Recording to read: {}", listed(&endings(&RecordingFormat::read_back())))
}

/// Values of `--from`.
pub fn help_from() -> String {
    let words: Vec<&str> = RecordingFormat::read_back().into_iter().map(RecordingFormat::extension).collect();
    let words = words.join(", ");
    format!("Format of IN, whatever its name ends with: {words}")
}

/// Input of `report`.
pub fn help_report() -> String {
    let endings = endings(&RecordingFormat::read_back());
    let (most, others) = endings.split_first().expect("there are formats");
    format!(
        "Recordings ({most} holds most; {}) or folders of runs; several are compared in one page",
        others.join(", ")
    )
}

/// Description of the page about recordings.
pub fn help_page() -> String {
    format!("Recordings: {}", RecordingFormat::ALL.map(|format| format.to_string()).join(", "))
}

/// Parser for `--also`: formats that a run does not write by default.
pub(crate) fn also() -> impl TypedValueParser<Value = RecordingFormat> {
    let formats = RecordingFormat::ALL.map(RecordingFormat::info).into_iter().filter(|info| !info.by_default);
    let words = formats.map(|info| {
        let late = if info.survives_a_kill { "" } else { "; not readable before the run ends" };
        PossibleValue::new(info.extension).help(format!("{} ({}){late}", info.name, info.file_name))
    });
    let parser = PossibleValuesParser::new(words.collect::<Vec<_>>());
    parser.try_map(|word| flexarm::recordings::parse_recording_format(&word))
}

/// Returns the output folder of a run and the requested files.
///
/// # Errors
/// [`Failure::Usage`] for a format that is disabled in this build.
pub(crate) fn outputs(args: &RunArgs, folder: PathBuf) -> Result<Outputs, Failure> {
    let mut outputs = Outputs { overwrite: args.force, figures: args.figures, ..Outputs::everything(folder) };
    let parquet = args.parquet.then(|| (RecordingFormat::Parquet, "--parquet".to_owned()));
    let also = args.also.iter().map(|&format| (format, format!("--also {}", format.extension())));
    for (format, flag) in parquet.into_iter().chain(also) {
        if !format.is_built_in() {
            let built = build_with(format);
            return Err(Failure::Usage(format!(
                "this program was built without {format}: omit {flag}, or use {built}"
            )));
        }
        outputs = outputs.with(format);
    }
    Ok(outputs)
}
