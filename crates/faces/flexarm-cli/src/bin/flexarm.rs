//! The program `flexarm`. All of its code is in the library of this crate, so that other programs
//! can include it.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(flexarm_cli::run(std::env::args_os().collect()))
}
