//! Map from rows of an imported matrix to interfaces: text such as `A=1001,B=1002`.
//!
//! ```text
//! A=1001,B=1002                                  components 1 to 6 of these nodes
//! A=947:1-3+948:1-3,B=949:1-3+950:1-3            CalculiX: rotations are 1 to 3 of a second node
//! A=#1-6,B=#7-12                                 rows of the file, from 1
//! A=1001,B=1002,modal=#13-22                     other rows that are modal coordinates
//! ```
//! Every interface needs six rows, in the order ux uy uz rx ry rz. Start at [`InterfaceMap`], and
//! at [`propose_map`] for a file without one. Not here: values and units ([`super::assemble`]).

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::str::FromStr;

use super::matrix::{DofLabel, LARGEST_DENSE, LabelledMatrix, index_of};
use super::position::ErrorPosition;
use crate::FeFileError;

/// Name of a map in messages.
const ORIGIN: &str = "map of interfaces";
/// Maximum number of rows in a map.
const MAX_ROWS: i64 = 100_000;

/// Selection of rows of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowPick {
    /// Components `first` to `last` of a node.
    Node {
        /// Number of the node.
        node: i64,
        /// First component.
        first: u8,
        /// Last component.
        last: u8,
    },
    /// Rows `first` to `last` of the file, from 1.
    Rows {
        /// First row.
        first: usize,
        /// Last row.
        last: usize,
    },
}

/// Interface and its six rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Interface {
    /// Name, such as "A".
    pub name: String,
    /// Rows in the order ux uy uz rx ry rz.
    pub picks: Vec<RowPick>,
}

/// All interfaces in the requested order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct InterfaceMap {
    /// Interfaces.
    pub interfaces: Vec<Interface>,
    /// Rows that are modal coordinates; if empty, those without a node or with component 0.
    pub modal: Vec<RowPick>,
}

fn wrong(element: impl Into<Box<str>>, found: impl Into<Box<str>>, expected: &str, help: &str) -> FeFileError {
    ErrorPosition::file(ORIGIN).fail(element, found, expected, help)
}

impl Interface {
    /// Parses the rows of one interface, such as `947:1-3+948:1-3`.
    ///
    /// # Errors
    /// If the text is not a list of rows.
    pub fn parse(name: &str, rows: &str) -> Result<Self, FeFileError> {
        let picks = rows.split('+').map(|text| parse_pick(name, text)).collect::<Result<_, _>>()?;
        Ok(Self { name: name.to_owned(), picks })
    }

    /// Writes the rows as text.
    pub fn rows_text(&self) -> String {
        self.picks.iter().map(RowPick::to_string).collect::<Vec<_>>().join("+")
    }
}

/// Parses one term of an interface: a node, some of its components, or rows by number.
fn parse_pick(name: &str, text: &str) -> Result<RowPick, FeFileError> {
    let text = text.trim();
    let help = "write A=1001 or A=1001:1-6 or A=#1-6; join several with +";
    let refuse =
        || wrong(format!("interface {name}"), format!("{text:?}"), "node, node:first-last or #first-last", help);
    let range = |text: &str| -> Option<(i64, i64)> {
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        let (first, last) = (first.trim().parse().ok()?, last.trim().parse().ok()?);
        (0 <= first && first <= last && last - first < MAX_ROWS).then_some((first, last))
    };
    if let Some(rows) = text.strip_prefix('#') {
        let (first, last) = range(rows).filter(|(first, _)| *first > 0).ok_or_else(refuse)?;
        return Ok(RowPick::Rows { first: first as usize, last: last as usize });
    }
    let (node, dofs) = text.split_once(':').unwrap_or((text, "1-6"));
    let node = node.trim().parse().map_err(|_| refuse())?;
    let (first, last) = range(dofs).filter(|(_, last)| *last <= 6).ok_or_else(refuse)?;
    Ok(RowPick::Node { node, first: first as u8, last: last as u8 })
}

impl fmt::Display for RowPick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Node { node, first: 1, last: 6 } => write!(f, "{node}"),
            Self::Node { node, first, last } if first == last => write!(f, "{node}:{first}"),
            Self::Node { node, first, last } => write!(f, "{node}:{first}-{last}"),
            Self::Rows { first, last } => write!(f, "#{first}-{last}"),
        }
    }
}

impl fmt::Display for InterfaceMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts: Vec<String> =
            self.interfaces.iter().map(|interface| format!("{}={}", interface.name, interface.rows_text())).collect();
        if !self.modal.is_empty() {
            let modal = Interface { name: String::new(), picks: self.modal.clone() };
            parts.push(format!("modal={}", modal.rows_text()));
        }
        f.write_str(&parts.join(","))
    }
}

impl FromStr for InterfaceMap {
    type Err = FeFileError;

    fn from_str(text: &str) -> Result<Self, FeFileError> {
        let mut map = Self::default();
        for part in text.split(',') {
            let Some((name, rows)) = part.split_once('=') else {
                return Err(wrong("map", format!("{:?}", part.trim()), "name=rows", "such as A=1001,B=1002"));
            };
            let interface = Interface::parse(name.trim(), rows)?;
            if interface.name.is_empty() || map.interfaces.iter().any(|known| known.name == interface.name) {
                return Err(wrong("map", format!("the name {:?}", interface.name), "a name used once", ""));
            }
            if interface.name == "modal" {
                map.modal.extend(interface.picks);
            } else {
                map.interfaces.push(interface);
            }
        }
        Ok(map)
    }
}

/// Rows of a map in a matrix, from 0.
#[derive(Debug)]
#[doc(hidden)]
pub struct ResolvedMap {
    pub interfaces: Vec<[usize; 6]>,
    pub modal: Vec<usize>,
}

impl InterfaceMap {
    /// Finds the rows; all remaining rows must be modal coordinates.
    #[doc(hidden)]
    pub fn resolve(&self, rows: &[DofLabel], origin: &str) -> Result<ResolvedMap, FeFileError> {
        let index = index_of(rows);
        let mut owner: HashMap<usize, &str> = HashMap::new();
        let mut find = |name, picks: &[RowPick]| -> Result<Vec<usize>, FeFileError> {
            let mut found = Vec::new();
            for pick in picks {
                found.extend(find_rows(*pick, name, rows.len(), &index, origin)?);
            }
            for row in &found {
                if let Some(other) = owner.insert(*row, name) {
                    let twice = format!("row {} also in {other}", row + 1);
                    return Err(wrong(format!("interface {name}"), twice, "every row once", ""));
                }
            }
            Ok(found)
        };
        // Six rows of each interface.
        let mut interfaces = Vec::new();
        for interface in &self.interfaces {
            let found = find(interface.name.as_str(), &interface.picks)?;
            let six = found.as_slice().try_into().map_err(|_| {
                let help = "ux uy uz rx ry rz; CalculiX has the rotations on a second node: A=947:1-3+948:1-3";
                wrong(format!("interface {}", interface.name), format!("{} rows", found.len()), "six rows", help)
            })?;
            interfaces.push(six);
        }
        // Modal coordinates: those of the map, otherwise all remaining rows, if they are scalar.
        let mut modal = find("modal", &self.modal)?;
        for (row, label) in rows.iter().enumerate().filter(|(row, _)| !owner.contains_key(row)) {
            let is_scalar = label.dof == 0 || label.node.is_none_or(|node| node < 0);
            if !is_scalar || !self.modal.is_empty() {
                let left = rows.len() - owner.len();
                let found = format!("row {} ({label}), one of {left} in no interface", row + 1);
                let help = "a full model must first be reduced to its interfaces; if these rows are modal \
                            coordinates, add modal=... to the map";
                let expected = "interfaces and modal coordinates only";
                return Err(ErrorPosition::file(origin).fail("rows", found, expected, help));
            }
            modal.push(row);
        }
        Ok(ResolvedMap { interfaces, modal })
    }
}

/// Returns the indices of the rows that a term picks.
fn find_rows(
    pick: RowPick,
    name: &str,
    size: usize,
    index: &HashMap<DofLabel, usize>,
    origin: &str,
) -> Result<Vec<usize>, FeFileError> {
    match pick {
        RowPick::Rows { first, last } if last <= size => Ok((first - 1..last).collect()),
        RowPick::Rows { .. } => {
            let found = format!("{pick} in a matrix of {size} rows");
            Err(wrong(format!("interface {name}"), found, "rows that exist", ""))
        }
        RowPick::Node { node, first, last } => (first..=last)
            .map(|dof| {
                index.get(&DofLabel::new(node, dof)).copied().ok_or_else(|| {
                    let found = format!("no row {node}:{dof} in {origin}");
                    let help = nodes_in(index);
                    wrong(format!("interface {name}"), found, "rows that exist", &help)
                })
            })
            .collect(),
    }
}

fn nodes_in(index: &HashMap<DofLabel, usize>) -> String {
    let mut nodes: Vec<i64> = index.keys().filter_map(|label| label.node).collect();
    nodes.sort_unstable();
    nodes.dedup();
    match nodes.len() {
        0 => "the file names no nodes: pick rows, such as A=#1-6,B=#7-12".into(),
        1..=12 => format!("its nodes are {nodes:?}"),
        n => format!("it has {n} nodes from {} to {}", nodes[0], nodes[n - 1]),
    }
}

/// As [`propose_map`], for a matrix: uncoupled rows at its end are modes.
pub fn propose_map_of(matrix: &LabelledMatrix) -> Option<InterfaceMap> {
    let n = matrix.size();
    let unlabelled = matrix.rows.iter().all(|label| *label == DofLabel::UNKNOWN);
    if !unlabelled || n > LARGEST_DENSE {
        return propose_map(&matrix.rows);
    }
    let mut is_coupled = vec![false; n];
    for (row, column, value) in matrix.to_sparse().triplets().filter(|(row, column, _)| row != column) {
        is_coupled[row] |= value != 0.0;
        is_coupled[column] |= value != 0.0;
    }
    let interfaces = n - is_coupled.iter().rev().take_while(|coupled| !**coupled).count();
    if interfaces == n || interfaces < 12 || !interfaces.is_multiple_of(6) {
        return propose_map(&matrix.rows);
    }
    let map = propose_map(&matrix.rows[..interfaces])?;
    Some(InterfaceMap { modal: vec![RowPick::Rows { first: interfaces + 1, last: n }], ..map })
}

/// Number of nodes or groups of six rows above which no map is proposed: a full model, or modes.
const MAX_PROPOSED: usize = 4;

/// Proposes a map, if the rows suggest one; the user must confirm it.
///
/// Uses nodes with six components, pairs of nodes with three (CalculiX), or groups of six rows
/// without nodes; for another number of rows without nodes, the first twelve.
pub fn propose_map(rows: &[DofLabel]) -> Option<InterfaceMap> {
    let named = |picks: Vec<Vec<RowPick>>| {
        let interfaces = ('A'..='Z').zip(picks).map(|(name, picks)| Interface { name: name.into(), picks });
        Some(InterfaceMap { interfaces: interfaces.collect(), modal: Vec::new() })
    };
    // Components of each node, nodes in the order of the rows.
    let mut order: Vec<i64> = Vec::new();
    let mut components: BTreeMap<i64, Vec<u8>> = BTreeMap::new();
    for label in rows.iter().filter(|label| label.dof > 0) {
        let node = label.node.filter(|node| *node >= 0)?;
        let list = components.entry(node).or_default();
        if list.is_empty() {
            order.push(node);
        }
        list.push(label.dof);
    }
    // Does every node have exactly the components 1 to `last`?
    let all = |last: u8| components.values().all(|dofs| dofs.iter().copied().eq(1..=last));
    let node = |i: usize, last: u8| RowPick::Node { node: order[i], first: 1, last };
    match order.len() {
        n @ 2..=MAX_PROPOSED if all(6) => named((0..n).map(|k| vec![node(k, 6)]).collect()),
        n @ 4..=MAX_PROPOSED if all(3) && n.is_multiple_of(2) => {
            named((0..n / 2).map(|k| vec![node(2 * k, 3), node(2 * k + 1, 3)]).collect())
        }
        0 if rows.len() >= 12 && rows.len() <= LARGEST_DENSE => {
            let n = rows.len() / 6;
            let n = if rows.len().is_multiple_of(6) && n <= MAX_PROPOSED { n } else { 2 };
            named((0..n).map(|k| vec![RowPick::Rows { first: 6 * k + 1, last: 6 * k + 6 }]).collect())
        }
        _ => None,
    }
}
