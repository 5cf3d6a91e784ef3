//! Reads a trajectory from a path; the file extension selects the reader.
//!
//! Texts may be in UTF-8, UTF-16 or Windows-1252. Not here: recognition of formats by their
//! content, which `flexarm-run` does for all formats of motions.

use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

use flexarm_settings::Place;

use crate::error::TrajectoryError;
use crate::findings::{at, not_utf8};
use crate::limits::JointLimits;
use crate::trajectory::Trajectory;

/// Maximum file size (bytes); an hour of six joints at 1 kHz takes a third of it.
const LARGEST: u64 = 1 << 30;

impl Trajectory {
    /// Reads a trajectory file: `.csv` holds samples ([`Trajectory::parse_csv`]), `.toml` waypoints
    /// ([`Trajectory::parse_toml`]).
    ///
    /// * `limits`: known limits of the robot's joints, by name; used by waypoints without a
    ///   duration. Joints may be missing and need not occur in the file.
    ///
    /// # Errors
    /// [`TrajectoryError::Read`], [`TrajectoryError::UnknownExtension`], or
    /// [`TrajectoryError::File`] with line and column of the problem.
    pub fn from_path(path: &Path, limits: &[(&str, JointLimits)]) -> Result<Self, TrajectoryError> {
        let extension = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        if extension != "csv" && extension != "toml" {
            return Err(TrajectoryError::UnknownExtension { path: path.to_owned(), found: extension });
        }

        let origin = path.display().to_string();
        let bytes = read(path).map_err(|source| TrajectoryError::Read { path: path.to_owned(), source })?;
        let text = text_of(bytes, &origin)?;
        match extension.as_str() {
            "csv" => Self::parse_csv(&text, &origin),
            _ => Self::parse_toml(&text, &origin, limits),
        }
    }
}

/// Reads a regular file; refuses devices and pipes, from which a read may never end or never begin.
fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(Error::other("this is not a file; give the path of a regular one"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        let what = format!("more than {LARGEST} bytes, the limit; leave out rows or digits");
        return Err(Error::new(ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

/// Returns the bytes of a motion file.
///
/// # Errors
/// [`TrajectoryError::Read`], also if the path is not a regular file or the file exceeds 1 GiB.
pub fn bytes_of_file(path: &Path) -> Result<Vec<u8>, TrajectoryError> {
    read(path).map_err(|source| TrajectoryError::Read { path: path.to_owned(), source })
}

/// Returns the text of a motion file.
///
/// # Errors
/// As [`bytes_of_file`] and [`text_of_bytes`].
pub fn text_of_file(path: &Path) -> Result<String, TrajectoryError> {
    text_of_bytes(bytes_of_file(path)?, &path.display().to_string())
}

/// Decodes the text of a file: UTF-8, UTF-16 with a byte order mark (as spreadsheets write it), or
/// Windows-1252.
///
/// * `origin`: file name for messages.
///
/// # Errors
/// [`TrajectoryError::File`] with the line that cannot be decoded.
pub fn text_of_bytes(bytes: Vec<u8>, origin: &str) -> Result<String, TrajectoryError> {
    let word: fn([u8; 2]) -> u16 = match bytes.get(..2) {
        Some([0xFF, 0xFE]) => u16::from_le_bytes,
        Some([0xFE, 0xFF]) => u16::from_be_bytes,
        _ => {
            return match windows_1252(&bytes) {
                Some(text) => Ok(text),
                None => text_of(bytes, origin),
            };
        }
    };
    let words = bytes[2..].chunks_exact(2).map(|pair| word([pair[0], pair[1]]));
    let text: Result<String, _> = char::decode_utf16(words).collect();
    text.map_err(|_| at(&Place::of_file(origin), not_utf8()).into())
}

/// Decodes Windows-1252 text without control characters; `None` if the bytes are UTF-8, have
/// non-ASCII letters before the first invalid byte, or are not text.
fn windows_1252(bytes: &[u8]) -> Option<String> {
    /// Letters of the bytes 0x80 to 0x9f; NUL where undefined.
    const SPECIAL: &str = "€\0‚ƒ„…†‡ˆ‰Š‹Œ\0Ž\0\0‘’“”•–—˜™š›œ\0žŸ";
    let error = std::str::from_utf8(bytes).err()?;
    let letter = |byte: &u8| match *byte {
        byte @ 0x80..=0x9f => SPECIAL.chars().nth(usize::from(byte - 0x80)).filter(|letter| *letter != '\0'),
        // 0xff (ÿ) is more frequent in binary data than in text.
        0xff => None,
        byte => Some(char::from(byte)).filter(|letter| !letter.is_control() || letter.is_ascii_whitespace()),
    };
    if bytes[..error.valid_up_to()].is_ascii() { bytes.iter().map(letter).collect() } else { None }
}

fn text_of(bytes: Vec<u8>, origin: &str) -> Result<String, TrajectoryError> {
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count();
        at(&Place::of_file(origin).line(line), not_utf8()).into()
    })
}
