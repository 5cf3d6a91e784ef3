//! Arguments of a command that are added to the parser only when the command is used.
//!
//! Building the flags of all commands takes a thousand allocations before anything is parsed; those
//! of one command take few.

use std::ops::Deref;

use clap::builder::Resettable;
use clap::{ArgMatches, Args, Command, Error, FromArgMatches};

/// Arguments of a subcommand that has no subcommands of its own (completions of `help` would miss
/// them). Help, errors and completions are the same as with `T` itself.
#[derive(Debug)]
pub(crate) struct Later<T>(pub(crate) Box<T>);

impl<T> Deref for Later<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Args> Args for Later<T> {
    fn augment_args(command: Command) -> Command {
        command.defer(with_arguments_of::<T>)
    }

    fn augment_args_for_update(command: Command) -> Command {
        T::augment_args_for_update(command)
    }
}

impl<T: FromArgMatches> FromArgMatches for Later<T> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        T::from_arg_matches(matches).map(|own| Self(Box::new(own)))
    }

    fn from_arg_matches_mut(matches: &mut ArgMatches) -> Result<Self, Error> {
        T::from_arg_matches_mut(matches).map(|own| Self(Box::new(own)))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        self.0.update_from_arg_matches(matches)
    }
}

/// Returns the command with the arguments of `T` placed before those shared by all commands; the
/// description of the command is kept.
fn with_arguments_of<T: Args>(command: Command) -> Command {
    let (about, long_about) = (command.get_about().cloned(), command.get_long_about().cloned());
    let shared: Vec<_> = command.get_arguments().map(|argument| argument.get_id().clone()).collect();
    let command = T::augment_args(command).about(Resettable::from(about)).long_about(Resettable::from(long_about));
    // An argument that is changed moves to the end.
    shared.into_iter().fold(command, |command, id| command.mut_arg(id, |argument| argument))
}
