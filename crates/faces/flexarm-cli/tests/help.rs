//! Help texts, flags and the settings that messages name.

use flexarm::recordings::RecordingFormat;
use flexarm::settings::Setting;
use flexarm_cli::internals::{HELP, about_convert, command, flag, help_from, help_input, help_page, help_report};

#[test]
fn the_help_has_a_line_of_at_most_80_columns_for_every_command() {
    for command in command().get_subcommands() {
        let line = format!("\n  {:<13}", command.get_name());
        assert_eq!(HELP.matches(&line).count(), 1, "{}", command.get_name());
    }
    assert!(HELP.lines().all(|line| line.len() <= 80));
}

#[test]
fn every_setting_that_a_message_names_is_a_flag_of_some_command() {
    let mut program = command();
    program.build();
    let arguments = || program.get_subcommands().flat_map(|command| command.get_arguments());
    for &setting in Setting::ALL {
        let flag = flag(setting);
        let known = match flag.strip_prefix("--") {
            Some(long) => arguments().any(|a| a.get_long() == Some(long)),
            None => arguments().any(|a| a.get_short().is_some_and(|short| flag == format!("-{short}"))),
        };
        assert!(known, "{setting:?} is called {flag:?}, which no command takes");
    }
}

/// Truth: the sentences in the help texts.
#[test]
fn help_texts_name_every_format_once() {
    let (all, read) = (RecordingFormat::ALL.to_vec(), RecordingFormat::read_back());
    let written = [about_convert(), help_page()].map(|text| (text, &all));
    for (text, formats) in written.into_iter().chain([help_input(), help_from(), help_report()].map(|t| (t, &read))) {
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
    let mut command = command();
    command.build();
    let compare = command.find_subcommand("compare").expect("a command");
    let flags: Vec<&str> = compare.get_arguments().map(|argument| argument.get_id().as_str()).collect();
    for format in RecordingFormat::ALL {
        assert!(format.info().by_default || flags.contains(&format.extension()), "{format}");
    }
}
