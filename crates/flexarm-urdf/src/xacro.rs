//! Expands `.xacro` files with the installed program; there is no xacro interpreter here.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::error::XacroError;

pub(crate) fn is_xacro(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xacro"))
}

/// The bytes that `program path arguments...` writes to its standard output.
pub(crate) fn expand(path: &Path, program: &Path, arguments: &[String]) -> Result<Vec<u8>, XacroError> {
    // An absolute path: a file name that starts with a dash is not an option.
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let output = Command::new(program).arg(absolute).args(arguments).output();
    let (path, program): (PathBuf, PathBuf) = (path.to_owned(), program.to_owned());
    match output {
        Ok(output) if output.status.success() => Ok(output.stdout),
        Ok(output) => Err(XacroError::Failed {
            path,
            status: output.status.to_string(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(XacroError::NotInstalled { path, program }),
        Err(source) => Err(XacroError::NotStarted { path, program, source }),
    }
}
