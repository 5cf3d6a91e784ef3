//! Parses text into a [`Sid`]: nested blocks `name ... end name` of lines `key = value`.
//!
//! Start at [`parse_sid`]. The sizes of blocks are checked, and bounded by the size of the file.
//! Not here: the meaning of the matrices ([`super::conventions`], [`super::modal`]).

use std::iter::Peekable;
use std::path::Path;

use super::{BODY_BLOCKS, NODE_BLOCKS, Sid, SidMatrix, SidNode, sizes_of};
use crate::FeFileError;
use crate::exchange::position::ErrorPosition;
use crate::exchange::text::{LARGEST_UNPACKED, Text, words};
use crate::number::shown;
use crate::unpack::plain;

/// Maximum number of shape coordinates; larger sizes are errors.
const MAX_MODES: usize = 10_000;
/// Maximum number of rows or columns: `Ge` has three columns per shape coordinate.
const MAX_ROWS: usize = 3 * MAX_MODES;
/// Maximum number of entries of a dense matrix, including zeros: constant part, and part per byte
/// of the file.
const MAX_ENTRIES: (usize, usize) = (1 << 20, 16);

/// Reads a `.SID_FEM` file, optionally compressed with gzip.
///
/// # Errors
/// [`FeFileError`] with file, line, element, value found and value expected.
pub fn read_sid(path: impl AsRef<Path>) -> Result<Sid, FeFileError> {
    let file = crate::exchange::InputFile::open(path)?;
    let bytes = plain(&file.bytes, &file.origin, LARGEST_UNPACKED)?;
    parse_sid(&String::from_utf8_lossy(&bytes), &file.origin)
}

/// One line: a keyword, or `key = value`.
type Line<'a> = (ErrorPosition<'a>, &'a str, Option<&'a str>);

/// Cursor over the remaining lines.
struct Cursor<'a, I: Iterator<Item = Line<'a>>> {
    lines: Peekable<I>,
    origin: &'a str,
    /// Maximum number of entries of one matrix.
    most_entries: usize,
}

/// Parses the text of a `.SID_FEM` file; `origin` names it in messages. Never panics.
///
/// # Errors
/// As [`read_sid`].
pub fn parse_sid(text: &str, origin: &str) -> Result<Sid, FeFileError> {
    let text = Text::new(text, origin);
    let mut lines = text.lines();
    // First line: numbers of nodes and modes, and a comment.
    let (place, first) = lines.next().unwrap_or((text.file(), ""));
    let (numbers, comment) = first.split_once(':').unwrap_or((first, ""));
    let mut numbers = words(numbers);
    let nodes = place.integer("number of nodes", numbers.next().unwrap_or(""))?;
    let modes = place.integer("number of modes", numbers.next().unwrap_or(""))?;

    // Further lines are `key = value`, or only a key.
    let lines = lines.map(|(place, line)| match line.split_once('=') {
        Some((key, value)) => (place, key.trim(), Some(value.trim())),
        None => (place, line.trim(), None),
    });
    let lines = lines.filter(|(_, key, value)| !key.is_empty() || value.is_some());
    let most_entries = MAX_ENTRIES.0.saturating_add(text.text.len().saturating_mul(MAX_ENTRIES.1));
    let mut cursor = Cursor { lines: lines.peekable(), origin, most_entries };
    cursor.expect("part")?;
    cursor.expect("new modal")?;
    // Parts in their fixed order; their sizes must agree with the first line.
    let mut sid = Sid { comment: comment.to_owned(), ..Sid::default() };
    cursor.refmod(&mut sid)?;
    cursor.frame(&mut sid)?;
    cursor.body(&mut sid)?;
    cursor.expect("end part")?;
    if nodes != sid.nodes.len() as i64 || modes != sid.nq() as i64 {
        let found = format!("{} nodes, {} modes", sid.nodes.len(), sid.nq());
        let expected = format!("{nodes} and {modes}, as in its first line");
        return Err(place.fail("file", found, expected, ""));
    }
    Ok(sid)
}

impl<'a, I: Iterator<Item = Line<'a>>> Cursor<'a, I> {
    fn next(&mut self, expected: &str) -> Result<Line<'a>, FeFileError> {
        self.lines.next().ok_or_else(|| {
            let help = "is the file cut off?";
            ErrorPosition::file(self.origin).fail("file", "its end", expected, help)
        })
    }

    fn expect(&mut self, word: &str) -> Result<(), FeFileError> {
        let (place, key, _) = self.next(word)?;
        if same(key, word) { Ok(()) } else { Err(unexpected(&place, key, word)) }
    }

    /// Consumes the next line if it is this keyword.
    fn take(&mut self, word: &str) -> bool {
        self.lines.next_if(|(_, key, value)| value.is_none() && same(key, word)).is_some()
    }

    /// Reads `refmod`: mass, number of shape coordinates, and a description of each.
    fn refmod(&mut self, sid: &mut Sid) -> Result<(), FeFileError> {
        self.expect("refmod")?;
        let mut promised = 0;
        while !self.take("end refmod") {
            let (place, key, value) = self.next("end refmod")?;
            let value = value.unwrap_or("");
            match key {
                "mass" => sid.mass = place.number("mass", value)?,
                "nelastq" => promised = count(&place, "nelastq", value, MAX_MODES)?,
                _ if key.starts_with("ielastq") => sid.modes.push(value.to_owned()),
                _ => return Err(unexpected(&place, key, "mass, nelastq, ielastq (k) or end refmod")),
            }
        }
        if sid.modes.is_empty() {
            sid.modes = vec![String::new(); promised];
        }
        if sid.modes.len() != promised {
            let found = format!("{} lines ielastq", sid.modes.len());
            let expected = format!("{promised}, as nelastq says");
            return Err(ErrorPosition::file(self.origin).fail("refmod", found, expected, ""));
        }
        Ok(())
    }

    /// Reads `frame`: the nodes.
    fn frame(&mut self, sid: &mut Sid) -> Result<(), FeFileError> {
        self.expect("frame")?;
        while !self.take("end frame") {
            let (place, key, value) = self.next("end frame")?;
            if !same(key, "new node") {
                return Err(unexpected(&place, key, "new node or end frame"));
            }
            let id = place.integer("number of the node", value.unwrap_or(""))?;
            let node = self.node(place, id, sid.nq())?;
            sid.nodes.push(node);
        }
        Ok(())
    }

    /// Parses a node up to `end node`; nq modes.
    fn node(&mut self, place: ErrorPosition<'a>, id: i64, nq: usize) -> Result<SidNode, FeFileError> {
        let mut rframe = String::new();
        let mut found: [Option<SidMatrix>; 5] = Default::default();
        while !self.take("end node") {
            let (place, key, value) = self.next("end node")?;
            if same(key, "rframe") {
                rframe = value.unwrap_or("").to_owned();
                continue;
            }
            let Some(i) = NODE_BLOCKS.iter().position(|name| same(name, key)) else {
                return Err(unexpected(&place, key, "rframe, origin, phi, psi, AP, sigma or end node"));
            };
            found[i] = Some(self.matrix(place, NODE_BLOCKS[i], nq)?);
        }
        let [Some(origin), Some(phi), Some(psi), Some(AP), sigma] = found else {
            let found = found.iter().zip(NODE_BLOCKS).filter_map(|(block, name)| block.as_ref().and(Some(name)));
            let found: Vec<_> = found.collect();
            return Err(place.fail(format!("node {id}"), found.join(", "), "origin, phi, psi, AP", ""));
        };
        Ok(SidNode { id, rframe, origin, phi, psi, AP, sigma })
    }

    /// Reads the matrices of the body up to `end modal`.
    fn body(&mut self, sid: &mut Sid) -> Result<(), FeFileError> {
        // Blocks in any order; unknown ones are kept.
        let nq = sid.nq();
        let mut found: [Option<SidMatrix>; 11] = Default::default();
        while !self.take("end modal") {
            let (place, key, _) = self.next("end modal")?;
            let known = BODY_BLOCKS.iter().position(|name| same(name, key));
            let matrix = self.matrix(place, known.map_or(key, |i| BODY_BLOCKS[i]), nq)?;
            match known {
                Some(i) => found[i] = Some(matrix),
                None => sid.others.push((key.to_owned(), matrix)),
            }
        }
        // Initial stress and damping may be absent, which means zero.
        let shape = |ncol| SidMatrix { nrow: nq, ncol, nq, ..SidMatrix::default() };
        let mut missing = Vec::new();
        let mut take = |i: usize| {
            found[i].take().unwrap_or_else(|| match BODY_BLOCKS[i] {
                "ksigma" => shape(1),
                "De" => shape(nq),
                name => {
                    missing.push(name);
                    SidMatrix::default()
                }
            })
        };
        [sid.mdCM, sid.J, sid.Ct, sid.Cr, sid.Me, sid.Gr, sid.Ge, sid.Oe, sid.ksigma, sid.Ke, sid.De] =
            std::array::from_fn(&mut take);
        if missing.is_empty() {
            return Ok(());
        }
        let found = format!("no {}", missing.join(", "));
        Err(ErrorPosition::file(self.origin).fail("modal", found, "all matrices of the body", "is the file cut off?"))
    }

    /// Reads a matrix up to `end <name>`.
    fn matrix(&mut self, head: ErrorPosition<'a>, name: &str, nq: usize) -> Result<SidMatrix, FeFileError> {
        let mut matrix = SidMatrix::default();
        let end = format!("end {name}");
        let mut last = head;
        while !self.take(&end) {
            let (place, key, value) = self.next(&end)?;
            last = place;
            let value = value.unwrap_or("");
            let is_head = matches!(key, "order" | "nrow" | "ncol" | "nq" | "nqn" | "structure");
            // Entries are checked against the sizes, so these must not change after the first
            // entry.
            if is_head && !(matrix.entries0.is_empty() && matrix.entries1.is_empty()) {
                let (element, expected) = (format!("{name}, {key}"), "all sizes before the first entry");
                return Err(place.fail(element, shown(value), expected, ""));
            }
            match key {
                "order" => matrix.order = count(&place, "order", value, 255)? as u8,
                "nrow" => matrix.nrow = count(&place, "nrow", value, MAX_ROWS)?,
                "ncol" => matrix.ncol = count(&place, "ncol", value, MAX_ROWS)?,
                "nq" => matrix.nq = count(&place, "nq", value, MAX_MODES)?,
                "nqn" => matrix.nqn = count(&place, "nqn", value, MAX_MODES)?,
                "structure" => matrix.structure = count(&place, "structure", value, 255)? as u8,
                _ => entry(&mut matrix, &place, name, key, value)?,
            }
        }
        check_sizes(&matrix, &last, name, nq, self.most_entries)?;
        Ok(matrix)
    }
}

/// Checks the sizes of a matrix, most of which its kind determines.
fn check_sizes(
    matrix: &SidMatrix,
    end: &ErrorPosition<'_>,
    name: &str,
    nq: usize,
    most_entries: usize,
) -> Result<(), FeFileError> {
    let shape = (matrix.nrow, matrix.ncol);
    let expected = sizes_of(name, nq);
    let fail = |found: String, expected: String| Err(end.fail(name, found, expected, ""));
    if matrix.order > 1
        || matrix.structure > 4
        || matrix.nq > nq
        || (!expected.is_empty() && !expected.contains(&shape))
    {
        let found = format!(
            "{} x {}, order {}, structure {}, nq {}",
            matrix.nrow, matrix.ncol, matrix.order, matrix.structure, matrix.nq
        );
        let sizes: Vec<_> = expected.iter().map(|(rows, columns)| format!("{rows} x {columns}")).collect();
        return fail(found, format!("{}, order 0 or 1, structure 0 to 4, nq {nq}", sizes.join(" or ")));
    }
    let found = format!("{} x {}, structure {}", shape.0, shape.1, matrix.structure);
    if matches!(matrix.structure, 1 | 2 | 4) && shape.0 != shape.1 {
        let expected = "a square matrix for structure 1 (diagonal), 2 (symmetric) and 4 (unit matrix)";
        return fail(found, expected.into());
    }
    // Limits blocks of variable size, and many shape coordinates in a file of a few lines.
    if shape.0 * shape.1 > most_entries {
        return fail(found, format!("at most {most_entries} entries, by the size of the file"));
    }
    Ok(())
}

/// Reads an entry `m0( i, j) = v` or `m1( i, k, j) = v`.
fn entry(
    matrix: &mut SidMatrix,
    place: &ErrorPosition<'_>,
    name: &str,
    key: &str,
    value: &str,
) -> Result<(), FeFileError> {
    let expected = format!("m0( i, j), m1( i, k, j) or end {name}");
    let Some((kind, indices)) = key.strip_suffix(')').and_then(|key| key.split_once('(')) else {
        return Err(unexpected(place, key, &expected));
    };
    // Indices from 0, and the value.
    let element = format!("{name}, {}", key.split_whitespace().collect::<String>());
    let indices = words(indices).map(|index| place.index(&element, index)).collect::<Result<Vec<_>, _>>()?;
    let value = place.number(&element, value)?;
    let is_inside = |row, column| row < matrix.nrow && column < matrix.ncol;
    let previous = match (kind.trim(), &indices[..]) {
        ("m0", &[row, column]) if is_inside(row, column) => matrix.entries0.insert((row, column), value),
        ("m1", &[row, mode, column]) if is_inside(row, column) && mode < matrix.nq && matrix.order == 1 => {
            matrix.entries1.insert((row, mode, column), value)
        }
        _ => {
            let size = format!("{} x {}, nq {}, order {}", matrix.nrow, matrix.ncol, matrix.nq, matrix.order);
            return Err(place.fail(element, shown(key), format!("{expected} in {size}"), ""));
        }
    };
    // An entry may be repeated with the same value.
    match previous.filter(|previous| *previous != value) {
        None => Ok(()),
        Some(previous) => Err(place.fail(element, format!("{previous:e} and {value:e}"), "one value", "")),
    }
}

/// Parses a count with an upper limit.
fn count(place: &ErrorPosition<'_>, what: &str, text: &str, most: usize) -> Result<usize, FeFileError> {
    match usize::try_from(place.integer(what, text)?) {
        Ok(count) if count <= most => Ok(count),
        _ => Err(place.fail(what, shown(text), format!("0 to {most}"), "")),
    }
}

/// Compares keywords, ignoring case and repeated blanks.
fn same(key: &str, word: &str) -> bool {
    key.split_whitespace().map(str::to_ascii_lowercase).eq(word.split_whitespace().map(str::to_ascii_lowercase))
}

fn unexpected(place: &ErrorPosition<'_>, key: &str, expected: &str) -> FeFileError {
    place.fail("line", shown(key), expected, "")
}
