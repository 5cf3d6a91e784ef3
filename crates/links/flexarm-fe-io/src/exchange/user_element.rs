//! Substructures of CalculiX and Abaqus: `*USER ELEMENT`, `*MATRIX,TYPE=STIFFNESS` or `MASS`.
//!
//! Node numbers are only in comments (CalculiX, `** ELEMENT NODES`) or in an `*ELEMENT` line.
//! Matrices are lower triangles row by row; line breaks have no meaning.
//!
//! Not here: the choice of the matrices that make a link (`read.rs`).

use nalgebra::DMatrix;

use super::fortran::fortran;
use super::matrix::{DofLabel, LabelledMatrix, MatrixRole, Storage, Triplets};
use super::position::ErrorPosition;
use super::text::{Text, words};
use crate::FeFileError;
use crate::number::shown;

/// Section of the file that the current lines belong to.
enum Block {
    Other,
    Nodes,
    Components,
    Element,
    Matrix,
}

/// Raw contents of the file.
#[derive(Default)]
struct Raw<'a> {
    nodes_promised: Option<usize>,
    unsymmetric: bool,
    nodes: Vec<i64>,
    /// First node position (from 0) and the active components from there on.
    components: Vec<(usize, Vec<u8>)>,
    matrices: Vec<RawMatrix<'a>>,
}

struct RawMatrix<'a> {
    role: MatrixRole,
    place: ErrorPosition<'a>,
    values: Vec<(ErrorPosition<'a>, f64)>,
}

/// Reads the stiffness, the mass, or both.
pub(super) fn parse(text: Text<'_>) -> Result<Vec<(MatrixRole, LabelledMatrix)>, FeFileError> {
    let raw = scan(text)?;
    if raw.matrices.is_empty() {
        let help = "CalculiX and Abaqus write it with *SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES";
        return Err(text.file().fail("file", "no *MATRIX", "*MATRIX,TYPE=STIFFNESS", help));
    }
    let rows = labels(&raw, text)?;
    raw.matrices.iter().map(|matrix| Ok((matrix.role, assemble(matrix, &raw, &rows, text)?))).collect()
}

/// Collects the lines of the elements and matrices, without interpreting them.
fn scan(text: Text<'_>) -> Result<Raw<'_>, FeFileError> {
    let mut raw = Raw::default();
    let mut block = Block::Other;
    for (place, line) in text.lines() {
        if let Some(comment) = line.strip_prefix("**") {
            if comment.trim().eq_ignore_ascii_case("ELEMENT NODES") {
                block = Block::Nodes;
            } else if matches!(block, Block::Nodes) {
                for word in words(comment) {
                    raw.nodes.push(place.integer("node number in the comment", word)?);
                }
            }
            continue;
        }
        if line.trim_start().starts_with('*') {
            block = scan_keyword(&mut raw, &place, line)?;
            continue;
        }
        if matches!(block, Block::Nodes) {
            block = Block::Components;
        }
        match block {
            Block::Components => scan_components(&mut raw, &place, line)?,
            Block::Matrix => {
                let Some(matrix) = raw.matrices.last_mut() else { continue };
                for word in words(line) {
                    matrix.values.push((place, place.number("entry", word)?));
                }
            }
            // `*ELEMENT`: its number, then its nodes, which take precedence over comments.
            Block::Element => {
                raw.nodes = words(line).skip(1).map(|word| place.integer("node", word)).collect::<Result<_, _>>()?;
                block = Block::Other;
            }
            Block::Other | Block::Nodes => {}
        }
    }
    Ok(raw)
}

/// Reads a line with a keyword; returns what the data lines below it contain.
fn scan_keyword<'a>(raw: &mut Raw<'a>, place: &ErrorPosition<'a>, line: &str) -> Result<Block, FeFileError> {
    let upper: String = line.to_ascii_uppercase().replace(' ', "");
    let mut parts = upper.trim().split(',');
    let keyword = parts.next().unwrap_or_default();
    let parameters: Vec<&str> = parts.collect();
    let value = |key: &str| parameters.iter().find_map(|part| part.strip_prefix(key)?.strip_prefix('='));
    match keyword {
        "*USERELEMENT" => {
            let promised = value("NODES").map(|text| place.index("NODES", text)).transpose()?;
            raw.nodes_promised = promised.map(|n| n + 1);
            raw.unsymmetric = parameters.contains(&"UNSYMM");
            Ok(Block::Components)
        }
        "*MATRIX" => {
            let role = match value("TYPE") {
                Some("STIFFNESS") => MatrixRole::Stiffness,
                Some("MASS") => MatrixRole::Mass,
                found => {
                    let found = shown(found.unwrap_or_default());
                    return Err(place.fail("*MATRIX, TYPE", found, "STIFFNESS or MASS", ""));
                }
            };
            raw.matrices.push(RawMatrix { role, place: *place, values: Vec::new() });
            Ok(Block::Matrix)
        }
        "*ELEMENT" => Ok(Block::Element),
        _ => Ok(Block::Other),
    }
}

/// `dof, dof, ...` of the first node, then `position, dof, dof, ...`; each is valid for the nodes
/// that follow.
fn scan_components(raw: &mut Raw<'_>, place: &ErrorPosition<'_>, line: &str) -> Result<(), FeFileError> {
    let mut numbers = Vec::new();
    for word in words(line) {
        numbers.push(place.integer("degree of freedom", word)?);
    }
    let (position, dofs) = match (raw.components.last(), &numbers[..]) {
        (_, []) => return Ok(()),
        (None, dofs) => (1, dofs),
        (Some(_), [position, dofs @ ..]) => (*position, dofs),
    };
    let last = raw.components.last().map_or(0, |(last, _)| *last as i64 + 1);
    if position <= last || position > i64::from(u32::MAX) {
        let found = format!("position {position}");
        let expected = format!("a number above {last}");
        return Err(place.fail("position of a node", found, expected, ""));
    }
    let dof = |dof: &i64| {
        let wrong = |_| place.fail("degree of freedom", dof.to_string(), "1 to 6", "");
        u8::try_from(*dof).map_err(wrong)
    };
    raw.components.push((position as usize - 1, dofs.iter().map(dof).collect::<Result<_, _>>()?));
    Ok(())
}

/// Labels of all rows; the size of the matrices is checked against them.
fn labels(raw: &Raw<'_>, text: Text<'_>) -> Result<Vec<DofLabel>, FeFileError> {
    let place = text.file();
    let count = if raw.nodes.is_empty() { raw.nodes_promised.unwrap_or(0) } else { raw.nodes.len() };
    if raw.nodes_promised.is_some_and(|promised| promised != count) {
        let found = format!("{count} node numbers");
        let expected = format!("NODES={}", raw.nodes_promised.unwrap_or(0));
        return Err(place.fail("** ELEMENT NODES", found, expected, ""));
    }
    // A header that declares more nodes than there are entries is rejected.
    let most = raw.matrices.iter().map(|matrix| matrix.values.len()).max().unwrap_or(0);
    let mut rows = Vec::new();
    let mut current = raw.components.iter().peekable();
    let mut dofs: &[u8] = &[];
    for position in 0..count {
        while let Some((_, list)) = current.next_if(|(first, _)| *first <= position) {
            dofs = list;
        }
        let node = raw.nodes.get(position).copied();
        rows.extend(dofs.iter().map(|dof| DofLabel { node, dof: *dof }));
        if rows.len() > most || position > most {
            let found = format!("{most} entries for more than {most} rows");
            let help = "is the file cut off?";
            return Err(place.fail("*MATRIX", found, "a lower triangle", help));
        }
    }
    if rows.is_empty() {
        let expected = "a line of degrees of freedom for each node";
        return Err(place.fail("*USER ELEMENT", "no degrees of freedom", expected, ""));
    }
    Ok(rows)
}

/// Assembles a matrix from its values, row by row: the lower triangle, or the whole matrix if it
/// may be unsymmetric.
fn assemble(
    raw_matrix: &RawMatrix<'_>,
    raw: &Raw<'_>,
    rows: &[DofLabel],
    text: Text<'_>,
) -> Result<LabelledMatrix, FeFileError> {
    let n = rows.len();
    let (triangle, square) = (n * (n + 1) / 2, n * n);
    let values = &raw_matrix.values;
    let is_square = raw.unsymmetric && values.len() == square && n > 1;
    if values.len() != triangle && !is_square {
        let found = format!("{} entries", values.len());
        let expected = format!("{triangle}, the lower triangle of {n} rows");
        return Err(raw_matrix.place.fail("*MATRIX", found, expected, "is the file cut off?"));
    }
    let mut triplets = Triplets::default();
    let (mut row, mut column) = (0, 0);
    for (place, value) in values {
        triplets.push(row, column, *value, place);
        column += 1;
        if column == n || (!is_square && column > row) {
            (row, column) = (row + 1, 0);
        }
    }
    let name = raw_matrix.role.name();
    triplets.symmetric(name, text.origin, rows.to_vec(), Storage::BySize)
}

/// Writes a stiffness, and optionally a mass, as a user element of CalculiX and Abaqus.
///
/// `rows` gives the node and component of each row; nodes are repeated per component, as in
/// CalculiX. Fourteen digits (`e20.13`, as CalculiX reads): values read back with a relative error
/// of 5e-14.
///
/// # Panics
/// If a matrix does not have one row and one column per entry of `rows`.
pub fn write_user_element(K: &DMatrix<f64>, M: Option<&DMatrix<f64>>, rows: &[DofLabel]) -> String {
    let n = rows.len();
    let mut text = format!("** written by flexarm\n*USER ELEMENT,NODES={n:11},LINEAR\n** ELEMENT NODES\n");
    for line in rows.chunks(10) {
        let nodes = line.iter().map(|label| format!("{:10},", label.node.unwrap_or(0)));
        text += &format!("**{}\n", nodes.collect::<String>());
    }
    for (i, label) in rows.iter().enumerate() {
        text += &if i == 0 { format!("{:10}\n", label.dof) } else { format!("{:10},{:10}\n", i + 1, label.dof) };
    }
    for (name, matrix) in [("STIFFNESS", Some(K)), ("MASS", M)] {
        let Some(matrix) = matrix else { continue };
        assert_eq!(matrix.shape(), (n, n), "a label for every row of the {name}");
        text += &format!("*MATRIX,TYPE={name}\n");
        for row in 0..n {
            let values: Vec<_> = (0..=row).map(|column| fortran(matrix[(row, column)], 13, 20) + ",").collect();
            text.extend(values.chunks(4).map(|line| line.concat() + "\n"));
        }
    }
    text
}
