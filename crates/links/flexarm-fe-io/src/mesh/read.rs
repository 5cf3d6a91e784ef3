//! Reads a file into a checked mesh: recognises the format by content and calls its reader.
//!
//! Start at [`read_mesh`]. A format that cannot be read is named, with the way to convert it.
//! Not here: the formats ([`super::gmsh`], [`super::inp`]), checks of the mesh ([`super::draft`]).

use std::collections::BTreeSet;
use std::path::Path;

use flexarm_fem::input::read_file;
use flexarm_fem::mesh::{BeamProperties, Mesh};
use flexarm_fem::units::UnitSystem;

use super::source::Source;
use super::{gmsh, inp};
use crate::FeFileError;
use crate::number::shown;
use crate::unpack::plain;

/// Maximum size of a file, bytes, compressed or not.
const LARGEST: u64 = 8 << 30;

/// Information that a mesh file does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Units of the numbers in the file.
    pub units: UnitSystem,
    /// Groups of line elements that are beams: name of the physical curve or element set, and
    /// section in SI.
    pub beams: Vec<(String, BeamProperties)>,
}

impl Default for ReadOptions {
    /// SI, no beams.
    fn default() -> Self {
        Self { units: UnitSystem::SI, beams: Vec::new() }
    }
}

/// Mesh with the warnings of reading it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    /// Mesh, SI.
    pub mesh: Mesh,
    /// Format, such as `Gmsh MSH 4.1 binary`.
    pub format: &'static str,
    /// Warnings about omitted or assumed data, one sentence each.
    pub warnings: Vec<String>,
    /// Element types as named in the file, such as `C3D8I`; empty for formats that number them.
    pub element_types: BTreeSet<String>,
}

/// Reads a mesh file: Gmsh `.msh` 2.2 or 4.1, CalculiX or Abaqus `.inp`, each optionally compressed
/// with gzip.
///
/// ```no_run
/// use flexarm_fe_io::{ReadOptions, read_mesh};
/// let file = read_mesh("arm.msh", &ReadOptions { units: "mm-t-s".parse()?, ..Default::default() })?;
/// assert!(file.mesh.node_sets.contains_key("interface_A"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`FeFileError`] with file, place, value found and value expected.
pub fn read_mesh(path: impl AsRef<Path>, options: &ReadOptions) -> Result<MeshFile, FeFileError> {
    let path = path.as_ref();
    let origin = path.display().to_string();
    let src = Source { bytes: &[], origin: &origin, binary: false };
    let unreadable = |error: std::io::Error| src.error_in_file("file", error.to_string(), "a file that can be read");
    let bytes = read_file(path, LARGEST).map_err(unreadable)?;
    parse_mesh(&bytes, &origin, options)
}

/// Reads a mesh from the bytes of a file; `origin` names them in messages.
///
/// # Errors
/// As [`read_mesh`].
pub fn parse_mesh(bytes: &[u8], origin: &str, options: &ReadOptions) -> Result<MeshFile, FeFileError> {
    let bytes = plain(bytes, origin, LARGEST)?;
    let src = &Source { bytes: &bytes, origin, binary: false };
    let text = src.bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(src.bytes).trim_ascii_start();
    if let Some((name, help)) = foreign(text) {
        let expected = "Gmsh .msh (2.2, 4.1), or .inp of CalculiX or Abaqus";
        return Err(src.error_in_file("format", name, expected).help(help));
    }
    match text.first() {
        Some(b'$') => gmsh::parse(src, options),
        Some(b'*') => inp::parse(src, options),
        Some(_) => {
            let first_line = text.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or(text);
            let expected = "$MeshFormat (Gmsh .msh) or a line with * (CalculiX or Abaqus .inp)";
            let error = src.error_in_file("format", shown(first_line), expected);
            Err(error.help("geometry such as STEP or STL must be meshed first, for example with Gmsh"))
        }
        None => Err(src.error_in_file("file", "nothing", "a mesh")),
    }
}

/// Advice for formats that Gmsh can convert.
const BY_GMSH: &str = "Gmsh reads it: gmsh INPUT -save -format msh41 -o OUTPUT.msh; node sets may get lost, choose interfaces by \
                       place then, such as plane(0,0,0; 1,0,0)";
/// Advice for formats that Gmsh cannot read.
const BY_EXPORT: &str = "export the mesh as a CalculiX or Abaqus .inp, or as Gmsh .msh, from the program that wrote it";
/// Advice for a geometry file.
const BY_MESHING: &str = "a shape must be meshed first, for example with Gmsh: gmsh INPUT -3 -order 2 -o OUTPUT.msh";

/// Recognises known but unsupported formats by their first lines; returns the name and the advice.
fn foreign(text: &[u8]) -> Option<(&'static str, &'static str)> {
    const STARTS: [(&[u8], &str, &str); 9] = [
        (b"# vtk DataFile", "a VTK file", BY_GMSH),
        (b"<VTKFile", "a VTK file in XML", BY_EXPORT),
        (b"<?xml", "XML", BY_EXPORT),
        (b"MeshVersionFormatted", "a Medit mesh", BY_GMSH),
        (b"\x89HDF", "HDF5, as MED, CGNS or Exodus", BY_GMSH),
        (b"CDF", "NetCDF, as Exodus", BY_EXPORT),
        (b"ISO-10303-21", "a STEP file", BY_MESHING),
        (b"*KEYWORD", "a deck of LS-DYNA", BY_EXPORT),
        (b"/PREP7", "a deck of ANSYS", BY_EXPORT),
    ];
    let starts = |mark: &[u8]| text.len() >= mark.len() && text[..mark.len()].eq_ignore_ascii_case(mark);
    if let Some((_, name, help)) = STARTS.iter().find(|(mark, _, _)| starts(mark)) {
        return Some((name, help));
    }
    // Nastran files may start with $, as Gmsh files do; universal files start with -1.
    let head = &text[..text.len().min(65_536)];
    let mut lines = head.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii).filter(|line| !line.is_empty());
    let first = lines.clone().next()?;
    if first == b"-1" {
        return Some(("a universal file (.unv)", BY_GMSH));
    }
    if first.starts_with(b"$MeshFormat") || first.starts_with(b"*") {
        return None;
    }
    const CARDS: [&[u8]; 11] = [
        b"BEGIN BULK",
        b"GRID",
        b"CTETRA",
        b"CHEXA",
        b"CPENTA",
        b"CQUAD4",
        b"PSOLID",
        b"CEND",
        b"NASTRAN",
        b"ENDDATA",
        b"MAT1",
    ];
    let is_card = |line: &[u8]| {
        CARDS.iter().any(|card| {
            line.len() >= card.len()
                && line[..card.len()].eq_ignore_ascii_case(card)
                && line.get(card.len()).is_none_or(|next| !next.is_ascii_alphanumeric())
        })
    };
    let nastran = lines.any(is_card);
    nastran.then_some(("Nastran bulk data (.bdf, .dat, .nas)", NASTRAN))
}

/// Advice for Nastran bulk data.
const NASTRAN: &str = "Gmsh reads it: gmsh INPUT.bdf -save -format msh41 -o OUTPUT.msh; node sets may get lost, choose interfaces by \
                       place then, such as plane(0,0,0; 1,0,0); matrices that Nastran reduced (DMIG .pch, OP4) are imported as \
                       matrices";
