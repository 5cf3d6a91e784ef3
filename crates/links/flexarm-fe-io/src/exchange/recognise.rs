//! Recognition of file formats by content, because file extensions are ambiguous: three formats use
//! `.mtx`.
//!
//! Start at [`recognise`]. Formats with a mark of their own are tried first, then those without a
//! header by the numbers in their first row. Not here: parsing ([`super::read`]).

use std::fmt;

use super::text::{unpack_head, words};
use crate::number::real;

/// Formats read by [`read_matrices`](super::read_matrices) and [`parse_sid`](super::parse_sid).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum MatrixFormat {
    /// `%%MatrixMarket matrix ...` (NIST): MATLAB, SciPy, Eigen, ANSYS `*EXPORT,...,MMF`.
    MatrixMarket,
    /// `*USER ELEMENT` with `*MATRIX,TYPE=...`: substructures of CalculiX and Abaqus.
    UserElement,
    /// `node,dof,node,dof,value`: Abaqus `MATRIX INPUT` and `LABELS`, newer CalculiX.
    LabelledText,
    /// `row column value`: Abaqus `COORDINATE`, CalculiX `.sti` and `.mas`.
    CoordinateText,
    /// One `node.dof` per line: CalculiX `.dof`, the rows of `.sti` and `.mas`.
    DofList,
    /// `DMIG` entries of Nastran bulk data or punch files.
    Dmig,
    /// Nastran OUTPUT4, text.
    Op4Text,
    /// Nastran OUTPUT4, binary, either byte order.
    Op4Binary,
    /// Harwell-Boeing: ANSYS `HBMAT`.
    HarwellBoeing,
    /// `Matrix Eqn, Node, DOF`: the rows of a Harwell-Boeing matrix of ANSYS.
    EquationMapping,
    /// Matrix as comma-separated values: Simscape.
    Csv,
    /// Interface origins and quaternions as comma-separated values: Simscape.
    CsvFrames,
    /// Standard Input Data of a flexible body (Wallrapp 1994).
    Sid,
    /// Units, frames and rows accompanying Matrix Market files, written by this program.
    Sidecar,
}

impl MatrixFormat {
    /// Name for messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::MatrixMarket => "Matrix Market",
            Self::UserElement => "CalculiX/Abaqus user element",
            Self::LabelledText => "node,dof,node,dof,value text (Abaqus MATRIX INPUT, CalculiX)",
            Self::CoordinateText => "row column value text (Abaqus COORDINATE, CalculiX .sti/.mas)",
            Self::DofList => "CalculiX .dof",
            Self::Dmig => "Nastran DMIG",
            Self::Op4Text => "Nastran OP4 text",
            Self::Op4Binary => "Nastran OP4 binary",
            Self::HarwellBoeing => "Harwell-Boeing",
            Self::EquationMapping => "ANSYS mapping",
            Self::Csv => "comma-separated matrix",
            Self::CsvFrames => "comma-separated frames",
            Self::Sid => "SID",
            Self::Sidecar => "sidecar",
        }
    }
}

impl fmt::Display for MatrixFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Whether a file (unpacking gzip) is HDF5, which is not read.
pub(super) fn is_hdf5(bytes: &[u8]) -> bool {
    const MARK: &[u8] = b"\x89HDF\r\n\x1a\n";
    unpack_head(bytes, MARK.len()) == MARK
}

/// Recognises the format of a file (unpacking gzip); `None` if it is none of these.
pub fn recognise(bytes: &[u8]) -> Option<MatrixFormat> {
    const HEAD: usize = 1 << 20;
    let head = unpack_head(bytes, HEAD);
    // Fortran record of 24 bytes, with its length before and after.
    let lengths = [head.get(..4), head.get(28..32)];
    if [24_u32.to_le_bytes(), 24_u32.to_be_bytes()].iter().any(|length| lengths == [Some(&length[..]); 2]) {
        return Some(MatrixFormat::Op4Binary);
    }
    if head.iter().take(1000).any(|byte| *byte == 0) {
        return None;
    }
    recognise_text(&String::from_utf8_lossy(&head))
}

/// Recognises a text format by its marks, then by the shape of its lines.
fn recognise_text(head: &str) -> Option<MatrixFormat> {
    let lines: Vec<&str> = head.lines().filter(|line| !line.trim().is_empty()).take(20_000).collect();
    let first = lines.first()?.trim_start_matches('\u{feff}');
    // Marks of a format.
    if starts_with(first, "%%MatrixMarket") {
        return Some(MatrixFormat::MatrixMarket);
    }
    if lines.iter().take(50).any(|line| line.starts_with("format") && line.contains(super::sidecar::FORMAT)) {
        return Some(MatrixFormat::Sidecar);
    }
    if lines.iter().take(5).any(|line| line.trim() == "part") {
        return Some(MatrixFormat::Sid);
    }
    if lines.iter().any(|line| starts_with(line, "DMIG")) {
        return Some(MatrixFormat::Dmig);
    }
    let keyword = lines.iter().find(|line| !line.starts_with("**"))?;
    if starts_with(keyword, "*USER ELEMENT") || starts_with(keyword, "*MATRIX") {
        return Some(MatrixFormat::UserElement);
    }
    // Headers of fixed layout.
    if lines.get(2).is_some_and(|line| is_harwell_boeing_type(line)) {
        return Some(MatrixFormat::HarwellBoeing);
    }
    let title: Vec<_> = words(first).collect();
    if title.contains(&"Node") && title.contains(&"DOF") {
        return Some(MatrixFormat::EquationMapping);
    }
    if lines.len() > 1 && is_op4_header(first, lines[1]) {
        return Some(MatrixFormat::Op4Text);
    }
    // Rows of numbers without a header.
    let data = lines.iter().find(|line| !line.starts_with("**") && !line.starts_with('#'))?;
    recognise_row(data)
}

/// Recognises formats without a header by the first row of numbers.
fn recognise_row(data: &str) -> Option<MatrixFormat> {
    let row: Vec<_> = words(data).collect();
    let integers = row.iter().take_while(|word| word.parse::<i64>().is_ok()).count();
    let numbers = row.iter().all(|word| real(word).is_some());
    let dof = |word: &str| word.split_once('.').is_some_and(|(node, dof)| is_digits(node) && is_digits(dof));
    match row.len() {
        1 if dof(row[0]) => Some(MatrixFormat::DofList),
        3 if numbers && integers >= 2 => Some(MatrixFormat::CoordinateText),
        5 if numbers && integers >= 4 => Some(MatrixFormat::LabelledText),
        7 if numbers && data.contains(',') => Some(MatrixFormat::CsvFrames),
        6.. if numbers && data.contains(',') => Some(MatrixFormat::Csv),
        _ => None,
    }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

fn starts_with(line: &str, start: &str) -> bool {
    line.get(..start.len()).is_some_and(|head| head.eq_ignore_ascii_case(start))
}

/// Whether a line has a type (`RSA`, `RUA`, `CSA`, `PUE`, ...) and at least three numbers.
fn is_harwell_boeing_type(line: &str) -> bool {
    let Some(kind) = line.get(..3) else { return false };
    let kind: Vec<u8> = kind.bytes().map(|byte| byte.to_ascii_uppercase()).collect();
    b"RCP".contains(&kind[0])
        && b"SUHZR".contains(&kind[1])
        && b"AE".contains(&kind[2])
        && words(&line[3..]).take(3).filter(|word| is_digits(word)).count() == 3
}

/// Whether the lines are `4I8` with valid FORM and TYPE, then a column header `3I8`.
fn is_op4_header(first: &str, second: &str) -> bool {
    let field = |line: &str, i: usize| line.get(8 * i..8 * i + 8).and_then(|text| text.trim().parse::<i64>().ok());
    let (form, kind) = (field(first, 2), field(first, 3));
    form.is_some_and(|form| (1..=9).contains(&form))
        && kind.is_some_and(|kind| (1..=4).contains(&kind))
        && first.get(32..40).is_some_and(|name| name.trim().starts_with(|c: char| c.is_ascii_alphabetic()))
        && (0..3).all(|i| field(second, i).is_some())
}
