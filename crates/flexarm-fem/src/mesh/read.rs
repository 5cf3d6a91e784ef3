//! From a file to a checked mesh: recognises the format by content and calls its reader.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::error::{MeshError, MeshErrorKind as Kind, Place};
use super::source::{Source, shown};
use super::{BeamProperties, Mesh, gmsh, inp};
use crate::units::UnitSystem;

/// A decompressed file larger than this is refused.
const LARGEST: u64 = 8 << 30;

/// What a mesh file does not say itself.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Units of the numbers in the file.
    pub units: UnitSystem,
    /// Groups of line elements that are beams: name of the physical curve or element set, section in SI.
    pub beams: Vec<(String, BeamProperties)>,
}

impl Default for ReadOptions {
    /// SI, no beams.
    fn default() -> Self {
        Self { units: UnitSystem::SI, beams: Vec::new() }
    }
}

/// A mesh, and what was noticed on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    /// The mesh, SI.
    pub mesh: Mesh,
    /// The format, such as `Gmsh MSH 4.1 binary`.
    pub format: &'static str,
    /// What was left out or assumed, one sentence each.
    pub warnings: Vec<String>,
}

/// Reads a mesh file: Gmsh `.msh` 2.2 or 4.1, CalculiX or Abaqus `.inp`, each also compressed by gzip.
///
/// ```no_run
/// use flexarm_fem::mesh::{ReadOptions, read_mesh};
/// let file = read_mesh("arm.msh", &ReadOptions { units: "mm-t-s".parse()?, ..Default::default() })?;
/// assert!(file.mesh.node_sets.contains_key("interface_A"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`MeshError`] with file, place, what was found and what was expected.
pub fn read_mesh(path: impl AsRef<Path>, options: &ReadOptions) -> Result<MeshFile, MeshError> {
    let path = path.as_ref();
    let origin = path.display().to_string();
    let src = Source { bytes: &[], origin: &origin, binary: false };
    let unreadable = |error: std::io::Error| {
        src.error_in(Kind::Unreadable, Place::File, "file", error.to_string(), "a file that can be read")
    };
    let mut bytes = Vec::new();
    // One more than allowed, so that a larger file is noticed.
    File::open(path).and_then(|file| file.take(LARGEST + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST {
        return Err(too_large(&src, LARGEST));
    }
    parse_mesh(&bytes, &origin, options)
}

/// Reads a mesh from the bytes of a file; `origin` names them in messages.
///
/// # Errors
/// As [`read_mesh`].
pub fn parse_mesh(bytes: &[u8], origin: &str, options: &ReadOptions) -> Result<MeshFile, MeshError> {
    let src = Source { bytes, origin, binary: false };
    if bytes.starts_with(&[0x1f, 0x8b]) {
        let unpacked = decompress(&src, LARGEST)?;
        return parse_plain(&Source { bytes: &unpacked, ..src }, options);
    }
    parse_plain(&src, options)
}

fn parse_plain(src: &Source, options: &ReadOptions) -> Result<MeshFile, MeshError> {
    let text = src.bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(src.bytes).trim_ascii_start();
    match text.first() {
        Some(b'$') => gmsh::parse(src, options),
        Some(b'*') => inp::parse(src, options),
        Some(_) => {
            let first_line = text.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or(text);
            let expected = "$MeshFormat (Gmsh .msh) or a line with * (CalculiX or Abaqus .inp)";
            let error = src.error_in(Kind::Format, Place::File, "format", shown(first_line), expected);
            Err(error.help("geometry such as STEP or STL must be meshed first, for example with Gmsh"))
        }
        None => Err(src.error_in(Kind::Truncated, Place::File, "file", "nothing", "a mesh")),
    }
}

/// Unpacks gzip, up to a size.
fn decompress(src: &Source, largest: u64) -> Result<Vec<u8>, MeshError> {
    let mut unpacked = Vec::new();
    let result = MultiGzDecoder::new(src.bytes).take(largest + 1).read_to_end(&mut unpacked);
    if let Err(error) = result {
        let found = format!("{error} after {} bytes", unpacked.len());
        return Err(src.error_in(Kind::Unreadable, Place::File, "gzip", found, "a whole compressed file"));
    }
    if unpacked.len() as u64 > largest {
        return Err(too_large(src, largest));
    }
    Ok(unpacked)
}

fn too_large(src: &Source, largest: u64) -> MeshError {
    let found = format!("more than {largest} bytes");
    src.error_in(Kind::TooLarge, Place::File, "file", found, format!("at most {largest} bytes when decompressed"))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_compressed_file_that_grows_without_end_is_refused_early() {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(&vec![b'*'; 100_000]).unwrap();
        let packed = encoder.finish().unwrap();
        let src = Source { bytes: &packed, origin: "bomb.inp.gz", binary: false };
        assert_eq!(decompress(&src, 1000).unwrap_err().kind, Kind::TooLarge);
        assert_eq!(decompress(&src, 100_000).unwrap().len(), 100_000);
    }

    #[test]
    fn an_unknown_format_is_answered_with_the_known_ones() {
        let options = ReadOptions::default();
        for (bytes, word) in [(&b"solid cube\n"[..], "solid cube"), (b"", "nothing"), (b"\x1f\x8bxx", "gzip")] {
            let message = parse_mesh(bytes, "x", &options).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        assert_eq!(read_mesh("no/such/file.msh", &options).unwrap_err().kind, Kind::Unreadable);
    }
}
