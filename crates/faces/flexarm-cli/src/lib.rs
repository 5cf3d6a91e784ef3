//! The `flexarm` command line: arguments, progress, tables, exit codes. The crate `flexarm` does
//! the work.
//!
//! Start at [`run`], which the program `flexarm` and the command of the Python package call.
//! [`shipped_robot`] and [`shipped_motion`] find shipped files by name.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is what this face is for")]

mod args;
mod commands;
mod compensate;
mod convert;
mod exchange;
mod exchange_args;
mod failure;
mod flags;
mod fmu;
mod formats;
mod identify;
mod inspect;
mod later;
mod layout;
mod lobes;
mod map;
mod motion;
mod new;
mod posed;
mod posed_args;
mod print;
mod reduce;
mod reduce_args;
mod report;
mod sensitivity;
#[cfg(not(target_family = "wasm"))]
mod serve;
mod shipped;
mod signals;
mod simulate;
mod study;
mod summary_table;
mod sweep;
mod terminal;
mod values;
mod view;

use std::error::Error as _;
use std::ffi::OsString;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::builder::{PossibleValue, Resettable, StyledStr};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, CommandFactory, Parser};
use commands::Cli;
use flexarm::settings::written::message;
use rayon::ThreadPoolBuildError;

/// Runs a command line, program name first, and returns the exit code of the process: 0 success, 1
/// failed run, 2 bad input.
///
/// This function assumes that it owns the process: messages name settings by its flags, and signals
/// stop the current command.
pub fn run(line: Vec<OsString>) -> u8 {
    if let Err(error) = start_threads() {
        // Nothing can be done about a closed stream.
        let _ = writeln!(
            anstream::stderr(),
            "error: the threads of the program cannot be started: {error}; set {THREADS} to 1, or raise the limits of \
             memory and processes (ulimit -v, -u)"
        );
        return 1;
    }
    signals::turn_into_errors();
    flexarm::settings::name_settings(flags::NAMES);
    #[cfg(feature = "rerun")]
    flexarm_rerun::install();
    let code = match Cli::try_parse_from(&line) {
        Ok(cli) => commands::run(&cli, &line).unwrap_or_else(|failure| {
            failure.print();
            failure.exit_code()
        }),
        Err(help) if help.kind() == ErrorKind::DisplayHelp && !line.iter().any(|word| word == "-h") => {
            let _ = write!(anstream::stdout(), "{}", whole_help(&line).ansi()); // a closed pipe
            return 0;
        }
        Err(usage) => {
            let usage = with_visible_words(with_number_tip(usage));
            let _ = usage.print(); // a closed pipe
            return usage.exit_code().try_into().unwrap_or(2);
        }
    };
    [0, 1].into_iter().find(|number| ExitCode::from(*number) == code).unwrap_or(2)
}

/// Returns the help of the command that the line names, with all its options and with the meaning
/// of all words that they take.
pub fn whole_help(line: &[OsString]) -> StyledStr {
    let mut program = Cli::command();
    program.build();
    let mut command = &program;
    for word in line.iter().skip(1).filter(|word| *word != "help") {
        command = command.find_subcommand(word).unwrap_or(command);
    }
    let shown = |argument: Arg| {
        let words = argument.get_possible_values();
        let means = |word: &PossibleValue| Some(format!("\n- {}: {}", word.get_name(), word.get_help()?));
        let words: Option<String> = words.iter().map(means).collect();
        let argument = argument.hide_short_help(false);
        if argument.get_id() == "help" {
            return argument.help("Print help; -h for a summary");
        }
        match (words.filter(|words| !words.is_empty()), argument.get_help()) {
            (Some(words), Some(help)) => {
                // The default has a line of its own.
                let end = if argument.get_default_values().is_empty() { "" } else { "\n" };
                let help = format!("{help}{words}{end}");
                argument.help(help).hide_possible_values(true)
            }
            _ => argument,
        }
    };
    let examples = command.get_after_long_help().or(command.get_after_help()).cloned();
    let about = command.get_long_about().or(command.get_about()).cloned();
    let command = command.clone().mut_args(shown).about(Resettable::from(about));
    command.after_help(Resettable::from(examples)).render_help()
}

/// Starts the threads that share the work of a command: as many as there are processors, or fewer
/// if the environment says so. Without this, a system that starts none, as under a limit of memory,
/// would end the program in the middle of a command.
///
/// # Errors
/// If the system does not start them.
fn start_threads() -> Result<(), ThreadPoolBuildError> {
    if cfg!(target_family = "wasm") {
        return Ok(()); // there are none
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(fewer_threads().unwrap_or(0)).build_global();
    // Without a source the error is that there is a pool already, which then stays as it is.
    pool.or_else(|error| if error.source().is_some() { Err(error) } else { Ok(()) })
}

/// Variable of the environment with the number of threads.
pub const THREADS: &str = "RAYON_NUM_THREADS";

/// Returns the number of processors if the environment asks for more threads than that
/// ([`THREADS`]), which cost time and memory and compute nothing sooner.
pub fn fewer_threads() -> Option<usize> {
    let processors = std::thread::available_parallelism().ok()?.get();
    // The second name is an older one of the same number.
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<usize>().ok());
    let asked = [THREADS, "RAYON_RS_NUM_CPUS"].into_iter().find_map(number)?;
    (asked > processors).then_some(processors)
}

/// Escapes control characters in the quoted user input, which a terminal would execute.
fn with_visible_words(mut usage: clap::Error) -> clap::Error {
    let shown = |value: &ContextValue| match value {
        ContextValue::String(text) => Some(ContextValue::String(message(text))),
        ContextValue::Strings(texts) => Some(ContextValue::Strings(texts.iter().map(|text| message(text)).collect())),
        _ => None,
    };
    let typed: Vec<_> = usage.context().filter_map(|(kind, value)| Some((kind, shown(value)?))).collect();
    for (kind, value) in typed {
        usage.insert(kind, value);
    }
    usage
}

/// Adds a hint on the number format if a word was given instead of a number.
fn with_number_tip(mut usage: clap::Error) -> clap::Error {
    let tip = match std::error::Error::source(&usage) {
        Some(cause) if cause.is::<std::num::ParseFloatError>() => {
            "numbers have a decimal point and no unit, such as 500, 0.002 or 2e-3"
        }
        Some(cause) if cause.is::<std::num::ParseIntError>() => "a whole number is expected, such as 8",
        _ => return usage,
    };
    usage.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    usage
}

/// Adds a folder with `robots/` and `trajectories/` to the places that are searched. Only the first
/// call has an effect.
pub fn ship_from(folder: PathBuf) {
    shipped::ship_from(folder);
}

/// Returns the path of a robot, given by path or by the name of a shipped robot.
///
/// # Errors
/// [`flexarm::Error::File`] for an unknown name; the message lists the known names.
pub fn shipped_robot(given: &Path) -> Result<PathBuf, flexarm::Error> {
    shipped::robot(Some(given))
}

/// Returns the path of a motion, given by path or by shipped name; the path itself if neither
/// exists.
pub fn shipped_motion(given: &Path) -> PathBuf {
    shipped::trajectory_file(given)
}

/// Returns the path of a robot file, given by path or by shipped name; the path itself if neither
/// exists.
pub fn shipped_robot_file(given: &Path) -> PathBuf {
    shipped::robot_file(given)
}

/// Returns the path of a cutting tool file, given by path or by shipped name; the path itself if
/// neither exists.
pub fn shipped_tool(given: &Path) -> PathBuf {
    shipped::find(given, &["robots/tools"], &["", ".toml"])
}

/// Parts that the tests of this crate reach; not part of the interface.
#[doc(hidden)]
pub mod internals {
    pub use crate::commands::HELP;
    pub use crate::flags::flag;
    pub use crate::formats::{about_convert, help_from, help_input, help_page, help_report};
    pub use crate::layout::{columns, filled, table};
    pub use crate::print::plain_zeros;
    #[cfg(not(target_family = "wasm"))]
    pub use crate::serve::requested;
    pub use crate::summary_table::{ALERT, HEADLINE, summary};
    pub use crate::sweep::plan::quoted;
    pub use crate::view::is_version;
    pub use crate::whole_help;

    /// Returns the command line with all its commands.
    pub fn command() -> clap::Command {
        <crate::commands::Cli as clap::CommandFactory>::command()
    }
}
