//! Unpacks compressed files into memory with a size limit: a few kilobytes of gzip can expand to
//! gigabytes.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::MultiGzDecoder;

use crate::error::{FeFileError, FilePosition};

/// Unpacked size that is always allowed, bytes.
const ALWAYS_UNPACKED: u64 = 64 << 20;
/// Maximum ratio of unpacked to packed size above that; text meshes and matrices compress 3 to 30
/// times.
const LARGEST_RATIO: u64 = 50;

/// Whether the bytes are compressed with gzip.
pub(crate) fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// Maximum allowed unpacked size of packed bytes, at most `largest`.
pub fn allowed_unpacked(packed: usize, largest: u64) -> u64 {
    ALWAYS_UNPACKED.max(LARGEST_RATIO.saturating_mul(packed as u64)).min(largest)
}

/// Error of unpacking gzip.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{found}, expected {expected}: {help}")]
pub struct UnpackError {
    /// Description of the bytes.
    pub found: String,
    /// Description of valid bytes.
    pub expected: String,
    /// Hint for a correction.
    pub help: &'static str,
}

/// Unpacks gzip, up to `largest` bytes and the size that is plausible for the packed size.
pub fn unpacked(packed: &[u8], largest: u64) -> Result<Vec<u8>, UnpackError> {
    let allowed = allowed_unpacked(packed.len(), largest);
    let mut bytes = Vec::new();
    let result = MultiGzDecoder::new(packed).take(allowed + 1).read_to_end(&mut bytes);
    if let Err(error) = result {
        return Err(UnpackError {
            found: format!("{error} after {} bytes", bytes.len()),
            expected: "a whole gzip file".into(),
            help: "is the file cut off? unpack it with gunzip to see",
        });
    }
    if bytes.len() as u64 > allowed {
        return Err(UnpackError {
            found: format!("{} bytes that unpack to more than {allowed} bytes", packed.len()),
            expected: format!("at most {LARGEST_RATIO} times the packed size, or {ALWAYS_UNPACKED} bytes"),
            help: "if the file is sound, unpack it with gunzip and give the unpacked file",
        });
    }
    Ok(bytes)
}

/// Returns the bytes of a file, unpacked if they are compressed with gzip; `origin` names the file.
///
/// # Errors
/// [`FeFileError`] as [`unpack_gzip`], also above `largest` bytes.
pub(crate) fn plain<'b>(bytes: &'b [u8], origin: &str, largest: u64) -> Result<Cow<'b, [u8]>, FeFileError> {
    if !is_gzip(bytes) {
        return Ok(Cow::Borrowed(bytes));
    }
    unpacked(bytes, largest).map(Cow::Owned).map_err(|error| {
        FeFileError::new(origin, FilePosition::File, "gzip data", error.found, error.expected).help(error.help)
    })
}

/// Unpacks gzip bytes, up to the size that is plausible for the packed size.
///
/// # Errors
/// [`UnpackError`] if the bytes are not gzip, truncated, or expand to far more than real files.
pub fn unpack_gzip(packed: &[u8]) -> Result<Vec<u8>, UnpackError> {
    unpacked(packed, u64::MAX)
}
