//! Tables of results as Parquet, in builds that support it.

use std::path::Path;

use flexarm_log::{CreateOptions, DataTable};

use flexarm_run::Error;

/// Writes a table.
///
/// # Errors
/// Errors of the operating system; [`flexarm_run::RecordingError::WithoutFormat`] in a build
/// without Parquet.
#[cfg(feature = "parquet")]
pub(super) fn write(path: &Path, table: &DataTable, options: CreateOptions) -> Result<(), Error> {
    Ok(table.write(path, options)?)
}

/// Reads a table.
///
/// # Errors
/// Errors of the operating system; an error if the file is not a table.
#[cfg(feature = "parquet")]
pub(super) fn read(path: &Path) -> Result<DataTable, Error> {
    Ok(DataTable::read(path)?)
}

#[cfg(not(feature = "parquet"))]
const MISSING: flexarm_run::RecordingError =
    flexarm_run::RecordingError::WithoutFormat { format: flexarm_log::RecordingFormat::Parquet };

#[cfg(not(feature = "parquet"))]
pub(super) fn write(_: &Path, _: &DataTable, _: CreateOptions) -> Result<(), Error> {
    Err(MISSING.into())
}

#[cfg(not(feature = "parquet"))]
pub(super) fn read(_: &Path) -> Result<DataTable, Error> {
    Err(MISSING.into())
}

/// Checks that this build can write tables.
///
/// # Errors
/// [`flexarm_run::RecordingError::WithoutFormat`].
pub(super) fn check() -> Result<(), Error> {
    #[cfg(not(feature = "parquet"))]
    return Err(MISSING.into());
    #[cfg(feature = "parquet")]
    Ok(())
}
