//! Reads text into a [`ReducedLink`]: structure first, then units, then the checks of the link.
//!
//! Start at [`read_flex`]. Every error names file, line, column and element.
//!
//! Not here: values with their places (`document`), optional tables (`details`).

use std::path::Path;

use flexarm_spatial::{Matrix12, turn6, twice};
use nalgebra::{Matrix3, Matrix6};
use toml::de::DeTable;

use super::details::read_details;
use super::document::{Document, Node, Table};
use super::error::{FlexErrorKind, FlexFileError};
use super::frames::read_frames;
use super::rigid_part::read_inertial;
use super::units::Units;
use super::{FORMAT, ORDER, VERSION};
use crate::frames::LinkFrames;
use crate::gate::GateLimits;
use crate::input::read_file;
use crate::reduced::{Provenance, ReducedLink};
use crate::rigid_part::RigidPart;

const PARTS: [&str; 2] = ["proximal", "distal"];
/// Maximum size of a file, bytes; a link with 100 modes and load-dependent stiffness takes 10 MB.
const LARGEST: u64 = 256 << 20;

/// Reads a reduced-link file.
///
/// Returns the checked link: SI, `K_BB` at Bo in link axes.
///
/// # Errors
/// [`FlexFileError`] with file, line, column, element, value found and value expected.
pub fn read_flex(path: impl AsRef<Path>) -> Result<ReducedLink, FlexFileError> {
    let path = path.as_ref();
    let origin = path.display().to_string();
    match read_file(path, LARGEST) {
        Ok(bytes) => parse_flex_bytes(&bytes, &origin),
        Err(error) => Err(unreadable(&Document { text: "", origin: &origin }, 0, error.to_string())),
    }
}

/// Parses the bytes of a reduced-link file; `origin` names them in messages. Never panics.
///
/// # Errors
/// As [`read_flex`].
pub fn parse_flex_bytes(bytes: &[u8], origin: &str) -> Result<ReducedLink, FlexFileError> {
    match std::str::from_utf8(bytes) {
        Ok(text) => parse_flex(text, origin),
        Err(error) => {
            let good = error.valid_up_to();
            let text = String::from_utf8_lossy(&bytes[..good]);
            let found = format!("the byte 0x{:02x}, which is not UTF-8", bytes[good]);
            Err(unreadable(&Document { text: &text, origin }, good, found))
        }
    }
}

/// Parses the text of a reduced-link file; `origin` names it in messages. Never panics.
///
/// # Errors
/// As [`read_flex`].
pub fn parse_flex(text: &str, origin: &str) -> Result<ReducedLink, FlexFileError> {
    parse_flex_with(text, origin, &GateLimits::default())
}

/// As [`parse_flex`], with other limits of the gate, for matrices printed with few digits.
///
/// # Errors
/// As [`read_flex`].
pub fn parse_flex_with(text: &str, origin: &str, limits: &GateLimits) -> Result<ReducedLink, FlexFileError> {
    let document = Document { text, origin };
    let parsed = DeTable::parse(text).map_err(|error| {
        // A truncated file fails at its end, where the parser reports no position.
        let at = error.span().unwrap_or(text.len()..text.len());
        let (found, expected) = (error.message().trim(), "a TOML document");
        document.fail(at, "text", FlexErrorKind::Syntax, found, expected, "is the file cut off?")
    })?;
    let root = document.root(&parsed);

    check_format(&root)?;
    root.only(&[
        "format",
        "version",
        "link",
        "units",
        "interface",
        "split",
        "stiffness",
        "provenance",
        "checks",
        "superelement",
        "chain",
        "attached",
        "modal",
        "gate",
        "part",
    ])?;
    let name = root.require("link", "give the name of the link")?.text()?;
    let units = Units::read(&root.require("units", "declare length, force and mass")?.table()?)?;
    let frames = read_frames(&root, &units)?;
    let provenance = read_provenance(&root, &units)?;
    let parts = read_parts(&root, &units)?;
    let mut link = read_stiffness(&root, &units, name, frames, provenance, parts, limits)?;
    read_checks(&root, &mut link)?;
    read_details(&root, &units, text, &mut link, limits)?;
    Ok(link)
}

fn unreadable(document: &Document<'_>, at: usize, found: String) -> FlexFileError {
    let expected = "a readable text file";
    document.fail(at..at, "file", FlexErrorKind::Unreadable, found, expected, "")
}

/// Checks `format` and `version` first: another format would fail at an arbitrary place.
fn check_format(root: &Table<'_, '_>) -> Result<(), FlexFileError> {
    let help = "is this a reduced-link file at all?";
    let format = root.require("format", help)?;
    let found = format.text()?;
    if found != FORMAT {
        let expected = format!("{FORMAT:?}");
        return Err(format.fail(FlexErrorKind::Format, format!("{found:?}"), expected, help));
    }
    let version = root.require("version", "this program writes 1")?;
    let found = version.integer()?;
    if found != VERSION {
        let help = if found > VERSION { "a newer flexarm wrote it" } else { "there is none before 1" };
        let (found, expected) = (found.to_string(), VERSION.to_string());
        return Err(version.fail(FlexErrorKind::Format, found, expected, help));
    }
    Ok(())
}

/// Reads `[provenance]`; the units are those of the file unless it names the original ones.
fn read_provenance(root: &Table<'_, '_>, units: &Units) -> Result<Provenance, FlexFileError> {
    let mut provenance = Provenance { units: units.names.clone(), ..Provenance::default() };
    let Some(node) = root.get("provenance") else { return Ok(provenance) };
    let table = node.table()?;
    table.only(&["source", "method", "tie", "units", "date", "note"])?;
    for (key, slot) in [
        ("source", &mut provenance.source),
        ("method", &mut provenance.method),
        ("tie", &mut provenance.tie),
        ("units", &mut provenance.units),
        ("date", &mut provenance.date),
        ("note", &mut provenance.note),
    ] {
        if let Some(value) = table.get(key) {
            value.text()?.clone_into(slot);
        }
    }
    Ok(provenance)
}

/// Reads the two parts, in any order.
fn read_parts(root: &Table<'_, '_>, units: &Units) -> Result<[RigidPart; 2], FlexFileError> {
    let node = root.require("part", "give two [[part]] tables, \"proximal\" and \"distal\"")?;
    let mut found: [Option<RigidPart>; 2] = [None, None];
    for item in node.list()? {
        let table = item.table()?;
        table.only(&["name", "mass", "com", "inertia"])?;
        let name = table.require("name", "proximal or distal")?;
        let which = usize::from(name.word(&PARTS, "a link is cut into two parts")? == PARTS[1]);
        if found[which].is_some() {
            let expected = "each part once";
            return Err(name.fail(FlexErrorKind::Part, "a second one", expected, "remove one"));
        }
        found[which] = Some(read_inertial(&item, &table, &format!("the {} part", PARTS[which]), units)?);
    }
    let [Some(proximal), Some(distal)] = found else {
        let missing = if found[0].is_none() { PARTS[0] } else { PARTS[1] };
        let (found, expected) = (format!("no {missing} part"), "one proximal and one distal part");
        return Err(node.fail(FlexErrorKind::Part, found, expected, "is the file cut off?"));
    };
    Ok([proximal, distal])
}

/// Reads `[stiffness]` and makes the link, with the matrix in SI and link axes.
///
/// # Errors
/// [`FlexFileError`] for an entry that is wrong or missing, and for a matrix that fails the gate.
fn read_stiffness(
    root: &Table<'_, '_>,
    units: &Units,
    name: &str,
    frames: LinkFrames,
    provenance: Provenance,
    parts: [RigidPart; 2],
    limits: &GateLimits,
) -> Result<ReducedLink, FlexFileError> {
    let table = root.require("stiffness", "give kind, axes, order and matrix")?.table()?;
    table.only(&["kind", "axes", "order", "matrix"])?;
    let kind = table
        .require("kind", "\"12x12\" or \"6x6\"")?
        .word(&["12x12", "6x6"], "12x12: A then B; 6x6: at B with A held")?;
    let axes = table
        .require("axes", "axes are never guessed")?
        .word(&["link", "interface_A", "interface_B"], "axes of all rows and columns")?;
    table
        .require("order", "the order of rows and columns is never guessed")?
        .word(&[ORDER], "reorder rows and columns: linear first, then angular")?;

    // R_LF: axes F of the matrix in the link.
    let R = match axes {
        "interface_A" => *frames.X_LA.rotation.matrix(),
        "interface_B" => *frames.X_LB.rotation.matrix(),
        _ => Matrix3::identity(),
    };
    // The identity rotation is skipped, so that the stiffness is kept bit for bit.
    let turn = |K: Matrix6<f64>| {
        if axes == "link" { K } else { turn6(&R) * K * turn6(&R).transpose() }
    };

    // K_BB of a 6×6; all four blocks of a 12×12, each in its units.
    let node = table.require("matrix", "one array per row")?;
    let link = if kind == "6x6" {
        let K_BB = turn(units.stiffness(&Matrix6::from_fn({
            let rows = read_square::<6>(&node)?;
            move |i, j| rows[i][j]
        })));
        ReducedLink::from_matrix6(name, frames, &K_BB, parts, provenance, limits)
    } else {
        let rows = read_square::<12>(&node)?;
        let mut K = Matrix12::zeros();
        for (r, c) in [(0, 0), (0, 6), (6, 0), (6, 6)] {
            let block = units.stiffness(&Matrix6::from_fn(|i, j| rows[r + i][c + j]));
            K.fixed_view_mut::<6, 6>(r, c).copy_from(&block);
        }
        if axes != "link" {
            let Q = twice(&turn6(&R));
            K = Q * K * Q.transpose();
        }
        ReducedLink::from_matrix12(name, frames, &K, parts, provenance, limits)
    };
    link.map_err(|cause| node.refused(cause, "a symmetric, positive definite stiffness of a free link"))
}

/// Reads an N×N matrix by rows, in the units of the file.
fn read_square<const N: usize>(node: &Node<'_, '_>) -> Result<[[f64; N]; N], FlexFileError> {
    let mut rows = [[0.0; N]; N];
    let items = node.items(N, "rows, one per component")?;
    for (row, item) in rows.iter_mut().zip(items) {
        *row = item.numbers("numbers in each row")?;
    }
    Ok(rows)
}

/// Reads the measures of the original 12×12 that a 6×6 file records.
fn read_checks(root: &Table<'_, '_>, link: &mut ReducedLink) -> Result<(), FlexFileError> {
    let Some(node) = root.get("checks") else { return Ok(()) };
    let table = node.table()?;
    table.only(&["asymmetry", "rigid_body_residual", "block_identity"])?;
    if link.checks.rigid_body_residual.is_some() {
        let kind = FlexErrorKind::UnknownKey;
        let (found, expected) = ("[checks] beside a 12x12", "no [checks]");
        return Err(node.fail(kind, found, expected, "remove it: they are measured on reading"));
    }
    let read = |key| table.get(key).map(|value| value.number()).transpose();
    if let Some(asymmetry) = read("asymmetry")? {
        link.checks.asymmetry = link.checks.asymmetry.max(asymmetry);
    }
    link.checks.rigid_body_residual = read("rigid_body_residual")?;
    link.checks.block_identity = read("block_identity")?;
    Ok(())
}
