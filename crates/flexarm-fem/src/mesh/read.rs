//! From a file to a checked mesh: recognises the format by content and calls its reader.

use std::path::Path;

use super::error::{MeshError, MeshErrorKind as Kind, Place};
use super::source::{Source, shown};
use super::{BeamProperties, Mesh, gmsh, inp};
use crate::input::{is_gzip, read_file, unpacked};
use crate::units::UnitSystem;

/// A file larger than this is refused, packed or not.
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
    let bytes = read_file(path, LARGEST).map_err(unreadable)?;
    parse_mesh(&bytes, &origin, options)
}

/// Reads a mesh from the bytes of a file; `origin` names them in messages.
///
/// # Errors
/// As [`read_mesh`].
pub fn parse_mesh(bytes: &[u8], origin: &str, options: &ReadOptions) -> Result<MeshFile, MeshError> {
    let src = Source { bytes, origin, binary: false };
    if is_gzip(bytes) {
        let unpacked = unpacked(bytes, LARGEST).map_err(|e| {
            let kind = if e.too_large { Kind::TooLarge } else { Kind::Unreadable };
            src.error_in(kind, Place::File, "gzip", e.found, e.expected).help(e.help)
        })?;
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

#[cfg(test)]
mod tests {
    use super::*;

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
