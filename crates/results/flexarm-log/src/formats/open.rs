//! Opens a recording: checks that the file is in the expected format and picks its reader.
//!
//! Start at [`open_recording`]. Not here: the table of formats (`mod.rs`), the readers (`read`).

use std::io::Read;
use std::path::Path;

use flexarm_settings::Setting;

use super::RecordingFormat;
use crate::{LogError, RunSource};

/// Opens a recording of flexarm and reads its header.
///
/// # Errors
/// [`LogError::Io`] if the file cannot be read, [`LogError::NotARecording`] if it is something
/// else, of a write-only format, or of a format that this build has no feature for.
pub fn open_recording(path: &Path, format: RecordingFormat) -> Result<Box<dyn RunSource>, LogError> {
    check_kind(path, format)?;
    match format.info().code.and_then(|code| code.reader) {
        Some(reader) => reader(path),
        None if !format.is_read_back() => Err(LogError::NotARecording {
            path: path.to_owned(),
            line: None,
            found: format!("a file in the format {format}, which is for viewing"),
            expected: "a recording in a format that is read back: MCAP, Parquet or CSV".into(),
            mend: "give run.mcap of the same run".into(),
        }),
        None => Err(LogError::NotARecording {
            path: path.to_owned(),
            line: None,
            found: format!("a file in the format {format}"),
            expected: "a format that this build can read".into(),
            mend: format!("use a build with {format}, or convert the file there"),
        }),
    }
}

/// Checks the first bytes, so that a wrongly named file is reported as what it is.
fn check_kind(path: &Path, expected: RecordingFormat) -> Result<(), LogError> {
    let refuse = |found: &str, mend: String| {
        let (found, expected) = (found.to_owned(), format!("a recording of flexarm in the format {expected}"));
        Err(LogError::NotARecording { path: path.to_owned(), line: None, found, expected, mend })
    };
    if path.is_dir() {
        let inside = path.join(expected.info().file_name);
        return refuse("a folder", format!("give a file in it, such as {}", inside.display()));
    }
    // Reading a device may never end, opening a pipe may block.
    if path.exists() && !path.is_file() {
        return refuse("what is not a file", "write it to a file first".into());
    }
    // Magic bytes of a format, or text.
    let mut start = Vec::new();
    let file = std::fs::File::open(path).map_err(LogError::io(path, "open the recording"))?;
    file.take(64).read_to_end(&mut start).map_err(LogError::io(path, "read the recording"))?;
    if start.is_empty() {
        return refuse("an empty file", "the run that should write it did not begin".into());
    }
    let begins = |format: &RecordingFormat| {
        let magic = format.info().magic;
        !magic.is_empty() && start.starts_with(magic)
    };
    let found = RecordingFormat::ALL.into_iter().find(begins);
    // A character may be cut at the end of the bytes that were read.
    let is_utf8 = std::str::from_utf8(&start).map_or_else(|error| error.error_len().is_none(), |_| true);
    let text = !start.contains(&0) && is_utf8;
    match found {
        Some(found) if found == expected => Ok(()),
        Some(found) => {
            let mend = format!("name the file *.{0}, or say {1} {0}", found.extension(), Setting::ReadFormat);
            refuse(&format!("a file in the format {found}"), mend)
        }
        None if expected.info().magic.is_empty() && text => Ok(()),
        None if text => {
            let line: String =
                String::from_utf8_lossy(&start).chars().take_while(|c| !c.is_control()).take(30).collect();
            let mend = match line.starts_with("time,") {
                true => format!("it looks like a table: name the file *.csv, or say {} csv", Setting::ReadFormat),
                false => "give a file that flexarm compare or run wrote".into(),
            };
            refuse(&format!("text, beginning {line:?}"), mend)
        }
        None => refuse("something else", "give a file that flexarm compare or run wrote".into()),
    }
}
