//! Optional tables of a reduced-link file: `[superelement]`, `[[chain]]`, `[modal]` and `[gate]`.
//!
//! Start at [`read_details`] and [`write_details`]. SI only, link axes. Each table is checked
//! against the 6×6 stiffness and the mass of its link.
//!
//! Not here: the tables of every link file (`read`, `write`), the rows of `[modal]` (`modal`).

use nalgebra::{DMatrix, Matrix6};
use serde::Deserialize;

use super::document::{Node, Table};
use super::error::{FlexErrorKind, FlexFileError};
use super::frames::{pose_lines, read_pose};
use super::rigid_part::{inertial, read_inertial};
use super::text::{numbers, quoted};
use super::units::Units;
use crate::chain::Chain;
use crate::error::FemError;
use crate::gate::{GateLimits, check_matrix6, check_matrix12};
use crate::mesh_gate::MeshGate;
use crate::reduced::{ElasticSplit, LinkDetails, ReducedLink};
use crate::reduction::{InterfaceFrame, Superelement, Tie, stiffness12, worst};

/// Allowed relative difference between `K_BB` and the superelement.
const AGREEMENT: f64 = 1e-6;

/// Maximum number of rows of a matrix: far above any use, and small enough for the memory.
const MAX_ROWS: usize = 6000;

/// Writes the tables as text; empty if the link has no details.
pub(super) fn write_details(link: &ReducedLink) -> String {
    let Some(details) = &link.details else { return String::new() };
    let mut text = String::new();
    if let Some(element) = &details.superelement {
        text +=
            "\n[superelement]                # rows: six per interface, then the modes; link axes\ninterfaces = [\n";
        for interface in &element.interfaces {
            let tie = interface.tie.map_or(String::new(), |tie| format!(", tie = \"{}\"", tie.name()));
            let pose = pose_lines(&interface.X_LI).trim_end().replace('\n', ", ");
            text += &format!("  {{ name = {}{tie}, {pose} }},\n", quoted(&interface.name));
        }
        text += "]\n";
        text += &matrix("stiffness", &element.K);
        text += &matrix("mass", &element.M);
    }
    for chain in &details.chains {
        text += &format!("\n[[chain]]                     # {} rigid parts in series\n", chain.parts.len());
        for joint in &chain.joints {
            text += &format!("\n[[chain.joint]]\n{}", pose_lines(&joint.X_LS));
            text += &matrix("stiffness", &DMatrix::from_column_slice(6, 6, joint.K_S.as_slice()));
        }
        for part in &chain.parts {
            text += &format!("\n[[chain.part]]\n{}", inertial(part));
        }
    }
    for body in &details.attached {
        text +=
            "\n[[attached]]                  # rides on the link: in the parts and chains, not in the superelement\n";
        text += &inertial(body);
    }
    if let Some(modal) = &details.modal {
        text += &super::modal::write_modal(modal);
    }
    if let Some(gate) = details.gate.as_ref().and_then(|gate| toml::to_string(gate).ok()) {
        // The sub-tables of the report become tables of [gate].
        let body = gate.replace("\n[[", "\n[[gate.").replace("\n[quality]", "\n[gate.quality]");
        let body = body.replace("\n[order]", "\n[gate.order]");
        text += &format!("\n[gate]                        # what was checked against the mesh\n{body}");
    }
    text
}

fn matrix(key: &str, A: &DMatrix<f64>) -> String {
    let rows: String = A.row_iter().map(|row| format!("  {},\n", numbers(row.iter()))).collect();
    format!("{key} = [\n{rows}]\n")
}

/// Reads the optional tables into `link`.
pub(super) fn read_details(
    root: &Table<'_, '_>,
    units: &Units,
    text: &str,
    link: &mut ReducedLink,
    limits: &GateLimits,
) -> Result<(), FlexFileError> {
    // Units other than SI are refused: these matrices have rows of several units.
    let mut details = LinkDetails::default();
    for key in ["superelement", "chain", "attached", "modal"] {
        let found = root.get(key);
        if let Some(node) = found.filter(|_| !units.is_si()) {
            let (found, help) = (units.names.clone(), format!("convert the numbers, or leave [{key}] out"));
            return Err(node.fail(FlexErrorKind::Unit, found, "m, N, kg: these tables are in SI only", help));
        }
    }
    // Each table is read, then checked against the link.
    if let Some(node) = root.get("superelement") {
        details.superelement = Some(read_superelement(&node, units, link, limits)?);
    }
    if let Some(node) = root.get("chain") {
        for item in node.list()? {
            details.chains.push(read_chain(&item, units, link)?);
        }
    }
    if let Some(node) = root.get("attached") {
        for item in node.list()? {
            let body = item.table()?;
            body.only(&["mass", "com", "inertia"])?;
            details.attached.push(read_inertial(&item, &body, "an attached body", units)?);
        }
    }
    if let Some(node) = root.get("modal") {
        details.modal = Some(super::modal::read_modal(&node, units, link, AGREEMENT)?);
    }
    // The gate is a report; nothing is computed from it.
    if let Some(node) = root.get("gate") {
        #[derive(Deserialize)]
        struct OnlyGate {
            gate: MeshGate,
        }
        let parsed: Result<OnlyGate, _> = toml::from_str(text);
        let gate = parsed.map_err(|error| {
            let found = error.message().to_owned();
            node.fail(FlexErrorKind::WrongType, found, "the table that `flexarm reduce` writes", "remove it")
        })?;
        details.gate = Some(gate.gate);
    }
    if details != LinkDetails::default() {
        link.details = Some(Box::new(details));
    }
    Ok(())
}

/// Reads `[superelement]` and checks sizes, symmetry and agreement with the link.
///
/// # Errors
/// [`FlexFileError`] at the entry that is wrong.
fn read_superelement(
    node: &Node<'_, '_>,
    units: &Units,
    link: &ReducedLink,
    limits: &GateLimits,
) -> Result<Superelement, FlexFileError> {
    let table = node.table()?;
    table.only(&["interfaces", "stiffness", "mass"])?;
    // Interfaces, A and B first, with their frames and ties.
    let mut interfaces = Vec::new();
    let list = table.require("interfaces", "the interfaces, proximal first")?;
    for item in list.list()? {
        let entry = item.table()?;
        let name = entry.require("name", "the name of the interface")?.text()?.to_owned();
        let tie = match entry.get("tie") {
            None => None,
            Some(word) => Some(match word.word(&["rigid", "distributing"], "how it is tied")? {
                "rigid" => Tie::Rigid,
                _ => Tie::Distributing,
            }),
        };
        interfaces.push(InterfaceFrame { name, X_LI: read_pose(&entry, units, &["name", "tie"])?, tie });
    }
    if interfaces.len() < 2 {
        let found = format!("{} interface(s)", interfaces.len());
        return Err(list.fail(FlexErrorKind::WrongSize, found, "two or more", "A and B first"));
    }
    // Stiffness and mass of equal size, 6 rows per interface and one per mode.
    let K = read_dense(&table, "stiffness", 6 * interfaces.len())?;
    let M = read_dense(&table, "mass", 6 * interfaces.len())?;
    if K.nrows() != M.nrows() {
        let found = format!("{} rows of stiffness, {} of mass", K.nrows(), M.nrows());
        return Err(node.fail(FlexErrorKind::WrongSize, found, "as many of both", "is the file cut off?"));
    }
    // Diagonal entries are not negative; a_ij = a_ji relative to sqrt(a_ii a_jj).
    for (key, A) in [("stiffness", &K), ("mass", &M)] {
        if let Some(found) = A.diagonal().iter().find(|a| !(**a >= 0.0)) {
            let expected = format!("a {key} without negative diagonal entries");
            return Err(node.fail(FlexErrorKind::Link, found.to_string(), expected, ""));
        }
        let scale = |i: usize, j: usize| (A[(i, i)] * A[(j, j)]).sqrt().max(f64::MIN_POSITIVE);
        let place = |(i, j): (usize, usize)| (A[(i, j)] - A[(j, i)]).abs() / scale(i, j);
        let gap = worst((0..A.nrows()).flat_map(|i| (0..i).map(move |j| (i, j))).map(place));
        if !(gap <= limits.asymmetry) {
            let found = format!("an asymmetry of {gap:.1e}");
            return Err(node.fail(FlexErrorKind::Link, found, format!("a symmetric {key}"), ""));
        }
    }
    let element = Superelement { interfaces, K, M };
    check_superelement(node, &element, link)?;
    Ok(element)
}

/// Checks that the superelement agrees with the frames and the 6×6 of its link.
fn check_superelement(node: &Node<'_, '_>, element: &Superelement, link: &ReducedLink) -> Result<(), FlexFileError> {
    let fail = |found: String| {
        node.fail(FlexErrorKind::Link, found, "the same K_BB as in [stiffness]", "was one of them edited?")
    };
    for (k, X) in [(0, &link.X_LA), (1, &link.X_LB)] {
        let gap = (element.interfaces[k].X_LI.translation.vector - X.translation.vector).norm();
        if !(gap <= 1e-9) {
            let name = &element.interfaces[k].name;
            return Err(fail(format!("interface {name:?} is {gap:.1e} m from the one of the link")));
        }
    }
    let K = stiffness12(element).ok_or_else(|| fail("a singular stiffness".into()))?;
    check_matrix12(&K, &link.p_AB(), &GateLimits::default()).map_err(|error| fail(error.to_string()))?;
    let s = link.K_BB.diagonal().map(f64::sqrt);
    let gap = Matrix6::from_fn(|i, j| (K[(6 + i, 6 + j)] - link.K_BB[(i, j)]).abs() / (s[i] * s[j])).amax();
    if gap <= AGREEMENT { Ok(()) } else { Err(fail(format!("a K_BB that differs by {gap:.1e}"))) }
}

/// Reads a square matrix of at least `smallest` rows.
fn read_dense(table: &Table<'_, '_>, key: &str, smallest: usize) -> Result<DMatrix<f64>, FlexFileError> {
    let node = table.require(key, "one array per row")?;
    let rows = node.list()?;
    let n = rows.len();
    if n < smallest || n > MAX_ROWS {
        let expected = format!("{smallest} to {MAX_ROWS} rows: six per interface, then the modes");
        return Err(node.fail(FlexErrorKind::WrongSize, format!("{n} rows"), expected, "is the file cut off?"));
    }
    let mut A = DMatrix::zeros(n, n);
    for (i, row) in rows.iter().enumerate() {
        for (j, entry) in row.items(n, "numbers in each row")?.iter().enumerate() {
            A[(i, j)] = entry.number()?;
        }
    }
    Ok(A)
}

/// Reads one `[[chain]]`: joints, then parts, and checks that they add up to the link.
fn read_chain(node: &Node<'_, '_>, units: &Units, link: &ReducedLink) -> Result<Chain, FlexFileError> {
    let table = node.table()?;
    table.only(&["joint", "part"])?;
    let (mut joints, mut parts) = (Vec::new(), Vec::new());
    // Joints: frame and stiffness at S.
    for item in table.require("joint", "one [[chain.joint]] between two parts")?.list()? {
        let joint = item.table()?;
        let X_LS = read_pose(&joint, units, &["stiffness"])?;
        let K = read_dense(&joint, "stiffness", 6)?;
        if K.nrows() != 6 {
            let found = format!("{} rows", K.nrows());
            return Err(item.fail(FlexErrorKind::WrongSize, found, "6 rows", "a joint has six components"));
        }
        let K = Matrix6::from_column_slice(K.as_slice());
        let expected = "a symmetric, positive definite stiffness";
        let (K_S, _) =
            check_matrix6("K_S", &K, &GateLimits::default()).map_err(|cause| item.refused(cause, expected))?;
        joints.push(ElasticSplit { X_LS, K_S });
    }
    // Rigid parts, one more than joints.
    for item in table.require("part", "one [[chain.part]] per rigid part")?.list()? {
        let part = item.table()?;
        part.only(&["mass", "com", "inertia"])?;
        parts.push(read_inertial(&item, &part, "a part of the chain", units)?);
    }
    if parts.len() != joints.len() + 1 {
        let found = format!("{} parts and {} joints", parts.len(), joints.len());
        let cause = FemError::Missing { what: "a part or a joint", help: "n parts are joined by n - 1 joints" };
        let error = node.fail(FlexErrorKind::WrongSize, found, "one part more than joints", "is the file cut off?");
        return Err(FlexFileError { source: Some(Box::new(cause)), ..error });
    }
    let chain = Chain { joints, parts };
    check_chain(node, &chain, link)?;
    Ok(chain)
}

/// Checks that the joints of a chain add up to the 6×6 of its link, and its parts to the link's
/// mass.
fn check_chain(node: &Node<'_, '_>, chain: &Chain, link: &ReducedLink) -> Result<(), FlexFileError> {
    let fail = |found: String| {
        let expected = "the compliance and the mass of the link";
        Err(node.fail(FlexErrorKind::Link, found, expected, "was one of them edited?"))
    };
    let p_LB = link.X_LB.translation.vector;
    let (Some(sum), Ok(C)) = (chain.tip_compliance(&p_LB), link.tip_compliance()) else {
        return fail("a joint without compliance".into());
    };
    let s = C.diagonal().map(f64::sqrt);
    let gap = Matrix6::from_fn(|i, j| (sum[(i, j)] - C[(i, j)]).abs() / (s[i] * s[j])).amax();
    if !(gap <= AGREEMENT) {
        return fail(format!("joints whose compliance differs from that of the link by {gap:.1e}"));
    }
    let mass: f64 = chain.parts.iter().map(|part| part.mass).sum();
    if !((mass / link.mass() - 1.0).abs() <= AGREEMENT) {
        return fail(format!("parts of {mass} kg in a link of {} kg", link.mass()));
    }
    Ok(())
}
