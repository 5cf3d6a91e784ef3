//! The command line inside the module.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Once;

use pyo3::prelude::*;

/// From the first call of the library on, messages name keyword arguments; a process that is a command line names flags before.
pub(crate) fn name_keywords() {
    static NAMED: Once = Once::new();
    NAMED.call_once(|| {
        flexarm::name_settings(crate::names::NAMES);
    });
}

/// Where robots and trajectories are besides.
#[pyfunction]
pub(crate) fn ship_from(folder: PathBuf) {
    flexarm_cli::ship_from(folder);
}

/// Runs a command line, the name of the program first, and says what the process should end with.
///
/// It takes the process for its own: signals end what it does, messages name flags.
#[pyfunction]
pub(crate) fn run_command(py: Python<'_>, line: Vec<OsString>) -> u8 {
    py.detach(|| flexarm_cli::run(line))
}
