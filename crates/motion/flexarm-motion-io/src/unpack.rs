//! Decompression up to a size limit, regardless of sizes stated in headers.

use std::io::{BufReader, Read};
use std::path::Path;

use crate::error::{MotionError, PlacedProblem, Problem};
use crate::mcap;

/// First bytes of zstd data.
pub const ZSTD_MAGIC: &[u8] = &[0x28, 0xB5, 0x2F, 0xFD];
/// Maximum decompressed size of a message or a database (bytes).
pub(crate) const MOST_BYTES: u64 = 1 << 30;

/// Returns the bytes of zstd data before its end or an error, and the reason for the error.
#[cfg(feature = "sqlite")]
pub(crate) fn unpacked(bytes: &[u8]) -> (Vec<u8>, Option<String>) {
    let mut out = Vec::new();
    let result =
        zstd::stream::read::Decoder::new(bytes).and_then(|unpack| unpack.take(MOST_BYTES + 1).read_to_end(&mut out));
    let broken = match result {
        Err(error) => Some(format!("its compressed content is damaged or incomplete ({error})")),
        Ok(_) if out.len() as u64 > MOST_BYTES => Some(format!("it unpacks to more than {MOST_BYTES} bytes")),
        Ok(_) => None,
    };
    (out, broken)
}

/// Opens a compressed file as a stream.
#[cfg(not(target_family = "wasm"))]
fn open_packed(path: &Path) -> std::io::Result<Box<dyn Read>> {
    Ok(Box::new(zstd::stream::read::Decoder::new(std::fs::File::open(path)?)?))
}

/// Fails: WebAssembly is built without zstd, which is C.
#[cfg(target_family = "wasm")]
fn open_packed(_: &Path) -> std::io::Result<Box<dyn Read>> {
    Err(std::io::Error::other("zstd cannot be read here; unpack it with zstd -d"))
}

/// Content of a compressed file, according to its first bytes.
pub(crate) enum Inside {
    /// A bag that can be read as a stream.
    Mcap(Box<dyn Read>),
    /// The bytes of a whole database.
    Database(Vec<u8>),
}

pub(crate) fn look_inside(path: &Path) -> Result<Inside, MotionError> {
    let failed = |source| MotionError::Read { path: path.to_owned(), source };
    let mut stream = BufReader::new(open_packed(path).map_err(failed)?);
    let mut head = [0; 16];
    let mut filled = 0;
    while filled < head.len() {
        match stream.read(&mut head[filled..]).map_err(failed)? {
            0 => break,
            read => filled += read,
        }
    }
    let head = head[..filled].to_vec();
    let whole = std::io::Cursor::new(head.clone()).chain(stream);
    if head.starts_with(mcap::MCAP_MAGIC) {
        return Ok(Inside::Mcap(Box::new(whole)));
    }
    let origin = path.display().to_string();
    if !head.starts_with(crate::SQLITE_MAGIC) {
        let what =
            "its compressed content is neither MCAP nor a rosbag2 database; decompress it to see what it is".to_owned();
        return Err(PlacedProblem::new(Problem::NotRead { what }).of(&origin));
    }
    let mut bytes = Vec::new();
    whole.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MOST_BYTES {
        let problem = Problem::TooLarge { most: MOST_BYTES, mend: "unpack it with zstd -d" };
        return Err(PlacedProblem::new(problem).of(&origin));
    }
    Ok(Inside::Database(bytes))
}
