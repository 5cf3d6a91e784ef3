//! The program `flexarm`. All of it is in the library beside it, which other programs can carry
//! inside themselves.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(flexarm_cli::run(std::env::args_os().collect()))
}
