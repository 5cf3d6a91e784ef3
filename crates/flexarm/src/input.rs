//! Text files into memory: files only, and none larger than a person or a program writes for this purpose.

use std::io::Read;
use std::path::Path;

use crate::error::Error;

/// A file larger than this is refused (bytes).
const LARGEST: u64 = 256 << 20;

/// The text of a file.
///
/// # Errors
/// [`Error::File`].
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    let fail = |what: String| Error::File { path: path.to_owned(), what };
    let unreadable = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::InvalidData => {
            fail("cannot be read: it is not text in UTF-8; save it as that, or is it another file?".into())
        }
        _ => fail(format!("cannot be read: {error}")),
    };
    // A device might never end, a pipe never begin.
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(fail("cannot be read: this is not a file".into()));
    }
    let mut text = String::new();
    let size = std::fs::File::open(path).and_then(|file| file.take(LARGEST + 1).read_to_string(&mut text));
    if size.map_err(unreadable)? as u64 > LARGEST {
        return Err(fail(format!("has more than {LARGEST} bytes, which is more than is read")));
    }
    Ok(text)
}
