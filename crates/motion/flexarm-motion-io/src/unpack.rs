//! Decompression up to a size limit, regardless of sizes stated in headers.
//!
//! Start at [`unpacked`] for bytes and [`inside_of`] for files. Not here: the containers (`mcap.rs`,
//! `sqlite.rs`) and their messages.

use std::io::{BufReader, Read};
use std::path::Path;

use crate::error::{MotionError, PlacedProblem};
use crate::mcap;

/// First bytes of zstd data.
pub const ZSTD_MAGIC: &[u8] = &[0x28, 0xB5, 0x2F, 0xFD];
/// Maximum decompressed size of a message or a database (bytes).
pub(crate) const MAX_BYTES: u64 = 1 << 30;

/// Returns the bytes of zstd data before its end or an error, and the reason for the error.
///
/// * `most`: maximum size of the content, bytes.
#[cfg(feature = "sqlite")]
pub(crate) fn unpacked(bytes: &[u8], most: u64) -> (Vec<u8>, Option<String>) {
    let mut out = Vec::new();
    let result = zstd::stream::read::Decoder::new(bytes).and_then(|unpack| unpack.take(most + 1).read_to_end(&mut out));
    let broken = match result {
        Err(error) => Some(format!("its compressed content is damaged or incomplete ({error})")),
        Ok(_) if out.len() as u64 > most => {
            Some(format!("a message unpacks to more than {most} bytes, the limit for it"))
        }
        Ok(_) => None,
    };
    (out, broken)
}

/// Opens a compressed file as a stream.
#[cfg(not(target_family = "wasm"))]
fn open_packed(path: &Path, most: u64) -> std::io::Result<Box<dyn Read>> {
    let file = std::fs::File::open(path)?;
    Ok(Box::new(Bounded { stream: zstd::stream::read::Decoder::new(file)?, most, left: most }))
}

/// Stream that fails after `most` bytes.
#[cfg(not(target_family = "wasm"))]
struct Bounded<R> {
    stream: R,
    most: u64,
    left: u64,
}

#[cfg(not(target_family = "wasm"))]
impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let read = self.stream.read(into)?;
        let too_large = || {
            let what =
                format!("it unpacks to more than {} bytes, the limit for its size; unpack it with zstd -d", self.most);
            std::io::Error::other(what)
        };
        self.left = self.left.checked_sub(read as u64).ok_or_else(too_large)?;
        Ok(read)
    }
}

/// Fails: WebAssembly is built without zstd, which is C.
#[cfg(target_family = "wasm")]
fn open_packed(_: &Path, _: u64) -> std::io::Result<Box<dyn Read>> {
    Err(std::io::Error::other("zstd cannot be read here; unpack it with zstd -d"))
}

/// Content of a compressed file, according to its first bytes.
pub(crate) enum Inside {
    /// A bag that can be read as a stream.
    Mcap(Box<dyn Read>),
    /// The bytes of a whole database.
    Database(Vec<u8>),
}

/// Unpacks a compressed recording, and recognises its format.
///
/// * `most`: maximum size of the content, bytes.
pub(crate) fn inside_of(path: &Path, most: u64) -> Result<Inside, MotionError> {
    let failed = |source| MotionError::Read { path: path.to_owned(), source };
    let mut stream = BufReader::new(open_packed(path, most).map_err(failed)?);
    // The first bytes give the format; they are put back in front of the stream.
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
        return Err(PlacedProblem::new(what).of(&origin));
    }
    let mut bytes = Vec::new();
    whole.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_BYTES {
        let problem = format!("more than {MAX_BYTES} bytes, the limit for such a file; unpack it with zstd -d");
        return Err(PlacedProblem::new(problem).of(&origin));
    }
    Ok(Inside::Database(bytes))
}
