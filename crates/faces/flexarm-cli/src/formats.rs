//! Formats of recordings as command-line words, all taken from the table of the library.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use flexarm::{Outputs, RecordingFormat};

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
pub(crate) fn about_convert() -> String {
    let names = RecordingFormat::ALL.map(|format| format.to_string());
    format!("Write a recording as {}", listed(&names))
}

/// Input of `convert`.
pub(crate) fn help_input() -> String {
    format!("Recording to read: {}", listed(&endings(&RecordingFormat::read_back())))
}

/// Values of `--from`.
pub(crate) fn help_from() -> String {
    let words: Vec<&str> = RecordingFormat::read_back().into_iter().map(RecordingFormat::extension).collect();
    let words = words.join(", ");
    format!("Format of IN, whatever its name ends with: {words}")
}

/// Input of `report`.
pub(crate) fn help_report() -> String {
    let endings = endings(&RecordingFormat::read_back());
    let (most, others) = endings.split_first().expect("there are formats");
    format!(
        "Recordings ({most} holds most; {}) or folders of runs; several are compared in one page",
        others.join(", ")
    )
}

/// Description of the page about recordings.
pub(crate) fn help_page() -> String {
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
    parser.try_map(|word| flexarm::parse_recording_format(&word))
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

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::commands::Cli;

    /// Truth: the sentences in the help texts.
    #[test]
    fn help_texts_name_every_format_once() {
        let (all, read) = (RecordingFormat::ALL.to_vec(), RecordingFormat::read_back());
        let written = [about_convert(), help_page()].map(|text| (text, &all));
        for (text, formats) in written.into_iter().chain([help_input(), help_from(), help_report()].map(|t| (t, &read)))
        {
            for format in formats {
                let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).collect();
                let (name, word) = (format.to_string(), format.extension());
                let count = words.iter().filter(|found| **found == name || **found == word).count();
                assert_eq!(count, 1, "{format} in {text:?}");
            }
        }
        assert!(about_convert().starts_with("Write a recording as MCAP, Rerun, CSV"));
        assert!(help_report().starts_with("Recordings (.mcap holds most; .parquet, "));
    }

    /// A format is written by default, or an option requests it.
    #[test]
    fn every_format_can_be_asked_for() {
        let mut command = Cli::command();
        command.build();
        let compare = command.find_subcommand("compare").expect("a command");
        let flag = compare.get_arguments().find(|argument| argument.get_id() == "also").expect("a flag");
        let words: Vec<String> = flag.get_possible_values().iter().map(|word| word.get_name().to_owned()).collect();
        for format in RecordingFormat::ALL {
            assert_eq!(words.contains(&format.extension().to_owned()), !format.info().by_default, "{format}");
        }
    }
}
