//! `--with`: additional runs, each with some options changed.
//!
//! `--with "key=value ..."` repeats the command line with some flags changed, so that a variant
//! takes every flag that a run takes. Start at [`parts`]. Not here: the runs (`simulate.rs`).

use std::borrow::Cow;
use std::ffi::OsString;

use clap::{CommandFactory, FromArgMatches};
use flexarm::{Finding, Summary};

use crate::args::RunArgs;
use crate::commands::{Cli, Command};
use crate::failure::Failure;

/// A run of a study: its label, and the arguments it would have on its own command line.
pub(crate) struct Part<'a> {
    pub(crate) label: String,
    pub(crate) args: Cow<'a, RunArgs>,
}

/// Maximum number of additional runs.
const MAX_OTHERS: usize = 50;

/// Options that apply to the study as a whole.
const SHARED: [&str; 9] = ["with", "output", "force", "no-files", "magnify", "json", "quiet", "figures", "parquet"];

/// Returns the caveats of all runs without duplicates; those of additional runs carry their labels.
pub(crate) fn caveats(summary: &Summary) -> Vec<Finding> {
    let mut all = summary.caveats.clone();
    for other in &summary.with {
        let is_new = |caveat: &&Finding| !all.iter().any(|known| known.message.ends_with(&caveat.message));
        let new: Vec<Finding> = other.caveats.iter().filter(is_new).cloned().collect();
        let label = other.label.as_deref().unwrap_or_default();
        all.extend(new.into_iter().map(|c| Finding { message: format!("{label}: {}", c.message), ..c }));
    }
    all
}

/// Returns the runs of a study, the main one first. `line` is the command line as given.
pub(crate) fn parts<'a>(main: &'a RunArgs, line: &[OsString]) -> Result<Vec<Part<'a>>, Failure> {
    if main.with.len() > MAX_OTHERS {
        let found = main.with.len();
        return Err(Failure::Usage(format!(
            "--with is given {found} times: at most {MAX_OTHERS}, for their curves are drawn over each other; more need runs of their own, \
             with --no-files --json for instance"
        )));
    }
    // Each --with becomes the command line with its words changed.
    let line = without_with(line);
    let mut varied: Vec<String> = Vec::new();
    let mut others = Vec::new();
    for text in &main.with {
        let usage = |what: String| Failure::Usage(format!("--with {text:?}: {what}"));
        let (mut label, mut words) = (None, Vec::new());
        for pair in text.split(',').map(str::trim) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            let (key, value) = (key.trim(), value.trim());
            if key.is_empty() {
                let example = "for instance links=modal or stepper=spook,step=5e-4,name=spook";
                return Err(usage(format!(
                    "expected key=value pairs with commas between them, {example}; found {pair:?}"
                )));
            }
            if SHARED.contains(&key) {
                return Err(usage(format!("{key} holds for the whole study and cannot differ between its runs")));
            }
            if ["help", "version"].contains(&key) {
                return Err(usage(format!("{key} is not an option of a run")));
            }
            if key == "name" {
                label = Some(value.to_owned());
                continue;
            }
            words.push((key.to_owned(), value.to_owned(), pair.contains('=')));
            if !varied.iter().any(|known| known == key) {
                varied.push(key.to_owned());
            }
        }
        let label = label.unwrap_or_else(|| text.replace(", ", ","));
        others.push(Part { label, args: Cow::Owned(changed(&line, &words).map_err(usage)?) });
    }
    // If all runs vary one flag, the first run is named by its own value of it.
    let label = match &varied[..] {
        [key] => format!("{key}={}", given(&line, key)),
        _ => "as given".to_owned(),
    };
    let mut parts = vec![Part { label, args: Cow::Borrowed(main) }];
    parts.extend(others);
    Ok(parts)
}

/// The command line without its `--with` options.
fn without_with(line: &[OsString]) -> Vec<OsString> {
    let mut kept = Vec::new();
    let mut words = line.iter();
    while let Some(word) = words.next() {
        match word.to_str() {
            // The following words are file names.
            Some("--") => {
                kept.push(word.clone());
                kept.extend(words.by_ref().cloned());
            }
            Some("--with") => {
                words.next();
            }
            Some(word) if word.starts_with("--with=") => {}
            _ => kept.push(word.clone()),
        }
    }
    kept
}

/// Parses the command line with some of its options replaced.
fn changed(line: &[OsString], words: &[(String, String, bool)]) -> Result<RunArgs, String> {
    // There are no options after `--`.
    let (options, names) = line.split_at(line.iter().position(|word| word == "--").unwrap_or(line.len()));
    let mut line = options.to_vec();
    let (mut robot, mut trajectory) = (None, None);
    for (key, value, has_value) in words {
        match key.as_str() {
            "robot" => robot = Some(value.into()),
            "trajectory" => trajectory = Some(value.into()),
            _ if *has_value => line.push(format!("--{key}={value}").into()),
            _ => line.push(format!("--{key}").into()),
        }
    }
    line.extend_from_slice(names);
    let command = Cli::command().args_override_self(true).mut_subcommand("compare", |c| c.args_override_self(true));
    let matches = command.try_get_matches_from(line).map_err(|error| {
        // Keep the first line of the error; usage and hints refer to the whole program.
        let text = error.to_string();
        let first = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
        format!("{first}; a key is robot, trajectory, name or an option of compare (flexarm compare --help)")
    })?;
    let Cli { command: Command::Compare(mut args), .. } = Cli::from_arg_matches(&matches).map_err(|e| e.to_string())?
    else {
        return Err("only compare has several runs".into());
    };
    args.0.robot = robot.or(args.0.robot);
    args.0.trajectory = trajectory.or(args.0.trajectory);
    Ok(*args.0)
}

/// Returns the value of an option on the command line, as a word for a label.
fn given(line: &[OsString], key: &str) -> String {
    let Ok(matches) = Cli::command().try_get_matches_from(line) else { return "as given".into() };
    let Some((_, matches)) = matches.subcommand() else { return "as given".into() };
    let id = key.replace('-', "_");
    let values = matches.try_get_raw(&id).ok().flatten();
    let words: Vec<String> = values.into_iter().flatten().map(|word| word.to_string_lossy().into_owned()).collect();
    if words.is_empty() { "as filed".into() } else { words.join("/") }
}
