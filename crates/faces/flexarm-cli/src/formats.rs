//! Formats of recordings as command-line words, all taken from the table of the library.
//!
//! Help texts and choices follow the formats that this build has. Not here: readers and writers
//! (`flexarm-log`).

use std::path::PathBuf;

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

/// Returns the output folder of a run and the requested files.
///
/// # Errors
/// [`Failure::Usage`] for a format that is disabled in this build.
pub(crate) fn outputs(args: &RunArgs, folder: PathBuf) -> Result<Outputs, Failure> {
    let mut outputs = Outputs { overwrite: args.force, figures: args.figures, ..Outputs::everything(folder) };
    if args.parquet {
        let format = RecordingFormat::Parquet;
        if !format.is_built_in() {
            let built = build_with(format);
            return Err(Failure::Usage(format!(
                "this program was built without {format}: omit --parquet, or use {built}"
            )));
        }
        outputs = outputs.with(format);
    }
    Ok(outputs)
}
