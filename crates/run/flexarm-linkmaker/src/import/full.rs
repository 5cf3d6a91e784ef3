//! Full models: locates rows or nodes of the interfaces and condenses all other rows.
//!
//! Start at [`reduce`]. M is the frame of the matrices, L the link: matrices stay in M until they are
//! condensed, frames of interfaces are in L; SI after [`to_si`]. Not here: the condensation
//! (`flexarm_fem::reduction`), matrices that are reduced already (`import/mod.rs`).

use std::collections::HashMap;

use flexarm_fe_io::exchange::{Entries, ImportedMatrices, InterfaceMap, LabelledMatrix, RowPick};
use flexarm_fem::UnitSystem;
use flexarm_fem::matrix_link::reduce_matrices;
use flexarm_fem::model::FeModel;
use flexarm_fem::reduction::{Condensation, CondensationOptions, Interface, InterfaceFrame, Superelement, Tie};
use flexarm_fem::sparse::{ModesWanted, SparseSymmetric};
use flexarm_settings::Setting;
use nalgebra::{Matrix3, Vector3};

use super::words::{ImportMap, NodePlane};
use crate::LinkError;

/// Whether the matrices have more than the interface coordinates, so that they must be condensed.
pub(super) fn is_full(imported: &ImportedMatrices, map: Option<&InterfaceMap>) -> bool {
    let rows = &imported.stiffness.rows;
    let physical = rows.iter().filter(|label| label.dof > 0 && label.node.is_some_and(|node| node >= 0)).count();
    let mapped = map.map_or(0, |map| 6 * map.interfaces.len());
    let limit = if mapped > 0 { mapped } else { 24 };
    matches!(imported.stiffness.entries, Entries::Sparse(_)) || physical > limit
}

/// Proposes a map, as a text to type, for a full model without one.
pub(super) fn propose(imported: &ImportedMatrices) -> String {
    let setting = Setting::Map;
    if is_solid(imported) && !imported.positions.is_empty() {
        let (low, high) = box_of(imported);
        return format!(
            "select the nodes of each interface, which are tied rigidly, by planes such as {setting} \
             \"A=plane({},0,0;1,0,0),B=plane({},0,0;1,0,0)\"; the nodes extend from {:?} to {:?}",
            low.x,
            high.x,
            <[f64; 3]>::from(low),
            <[f64; 3]>::from(high)
        );
    }
    // Reference nodes usually are the last ones of the model.
    let mut nodes: Vec<i64> = imported.stiffness.rows.iter().filter_map(|label| label.node).collect();
    nodes.sort_unstable();
    nodes.dedup();
    match nodes[..] {
        [.., a, b, c, d] => format!(
            "set {setting} to the reference nodes: CalculiX defines them with *RIGID BODY, REF NODE= \
             (translations) and ROT NODE= (rotations); if they are the last nodes of the model: {setting} \
             A={a}:1-3+{b}:1-3,B={c}:1-3+{d}:1-3; with six degrees of freedom per node: {setting} A={c},B={d}"
        ),
        _ => format!(
            "the rows have no node numbers; also give the list of rows (.dof, .mapping), or {setting} A=#1-6,B=#7-12"
        ),
    }
}

fn is_solid(imported: &ImportedMatrices) -> bool {
    imported.stiffness.rows.iter().enumerate().all(|(i, label)| label.dof as usize == i % 3 + 1)
}

fn box_of(imported: &ImportedMatrices) -> (Vector3<f64>, Vector3<f64>) {
    let mut points = imported.positions.values();
    let first = points.next().copied().unwrap_or_default();
    points.fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)))
}

/// Interface frames and options for the reduction.
pub(super) struct Target<'a> {
    pub(super) units: UnitSystem,
    pub(super) frames: Vec<InterfaceFrame>,
    /// Rotation from matrix axes to link axes.
    pub(super) R_LM: &'a Matrix3<f64>,
    pub(super) modes: usize,
}

/// Reduces a model to its interfaces. The result is in matrix axes; its frames are those of the
/// link.
///
/// # Errors
/// [`LinkError::Files`] for a map that does not match the model, [`LinkError::Import`] from the
/// reduction.
pub(super) fn reduce(
    imported: &ImportedMatrices,
    map: &ImportMap,
    target: Target<'_>,
) -> Result<Superelement, LinkError> {
    let refuse = |what: String| LinkError::content(&imported.origin, what);
    let Some(mass) = &imported.mass else {
        let what = "reducing a full model requires its mass matrix: give this file too";
        return Err(refuse(format!("{what} (.mas, {})", Setting::MassFile)));
    };
    let failed = |source| LinkError::Import { path: imported.origin.clone().into(), source: Box::new(source) };
    let modes = ModesWanted::Count(target.modes);
    let options = CondensationOptions::default();
    let rows = &imported.stiffness.rows;
    match map {
        // Six rows per interface: angles where the map has them, regardless of their labels.
        ImportMap::Rows(map) => {
            let boundary = boundary_rows(imported, map)?;
            let mut is_turn: Vec<bool> = rows.iter().map(|label| label.dof > 3).collect();
            for (k, row) in boundary.iter().enumerate() {
                is_turn[*row as usize] = k % 6 >= 3;
            }
            let K = to_si(&imported.stiffness, target.units, &is_turn, false);
            let M = to_si(mass, target.units, &is_turn, true);
            reduce_matrices(K, M, &boundary, target.frames, modes, options).map_err(failed)
        }
        // Nodes of solids, tied rigidly to the interfaces by their positions.
        ImportMap::Nodes(list) => {
            if !is_solid(imported) || imported.positions.is_empty() {
                let what = "planes require node positions and three degrees of freedom per node, as DMIG with GRID \
                            entries may have them; select rows by node:";
                return Err(refuse(format!("{what} {} A=947:1-3+948:1-3,B=949:1-3+950:1-3", Setting::Map)));
            }
            let nodes: Vec<i64> = rows.iter().step_by(3).filter_map(|label| label.node).collect();
            let position = |node: &i64| imported.positions.get(node).map(|p| p * target.units.length);
            let Some(points) = nodes.iter().map(position).collect::<Option<Vec<_>>>() else {
                return Err(refuse("not every node has a position".into()));
            };
            let interfaces = tied(imported, list, &nodes, &target)?;
            let is_turn = vec![false; rows.len()];
            let K = to_si(&imported.stiffness, target.units, &is_turn, false);
            let M = to_si(mass, target.units, &is_turn, true);
            let model = FeModel::from_nodal_matrices(points, K, M);
            let condensation = Condensation::new(&model, &interfaces, options).map_err(|e| failed(e.into()))?;
            let modes = condensation.fixed_modes(modes).map_err(|e| failed(e.into()))?;
            let frames = target.frames.into_iter().map(|f| InterfaceFrame { tie: Some(Tie::Rigid), ..f }).collect();
            Ok(condensation.superelement(frames, &modes))
        }
    }
}

/// Returns the interfaces, in matrix axes, that are tied rigidly to the chosen ones of all nodes.
fn tied(
    imported: &ImportedMatrices,
    list: &[(String, NodePlane)],
    all: &[i64],
    target: &Target<'_>,
) -> Result<Vec<Interface>, LinkError> {
    let index: HashMap<i64, u32> = all.iter().enumerate().map(|(i, node)| (*node, i as u32)).collect();
    let interface = |((name, plane), frame): (&(String, NodePlane), &InterfaceFrame)| {
        let chosen = nodes_on(imported, plane)
            .map_err(|what| LinkError::content(&imported.origin, format!("interface {name}: {what}")))?;
        let mut nodes: Vec<u32> = chosen.iter().filter_map(|node| index.get(node).copied()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let p = target.R_LM.transpose() * frame.X_LI.translation.vector;
        let X_LI = flexarm_spatial::Pose::translation(p.x, p.y, p.z);
        Ok(Interface { name: name.clone(), X_LI, nodes, tie: Tie::Rigid })
    };
    list.iter().zip(&target.frames).map(interface).collect()
}

/// Returns the rows of the interfaces, six each.
fn boundary_rows(imported: &ImportedMatrices, map: &InterfaceMap) -> Result<Vec<u32>, LinkError> {
    let rows = &imported.stiffness.rows;
    let index: HashMap<(i64, u8), u32> =
        rows.iter().enumerate().filter_map(|(i, label)| Some(((label.node?, label.dof), i as u32))).collect();
    let mut boundary: Vec<u32> = Vec::new();
    for interface in &map.interfaces {
        // Rows picked by their place in the matrix, or by node and degree of freedom.
        let refuse = |what: String| {
            LinkError::content(&imported.origin, format!("interface {}: {what}; {}", interface.name, propose(imported)))
        };
        let before = boundary.len();
        for pick in &interface.picks {
            match *pick {
                RowPick::Rows { first, last } if first >= 1 && last <= rows.len() => {
                    boundary.extend(first as u32 - 1..last as u32);
                }
                RowPick::Rows { .. } => {
                    return Err(refuse(format!("rows {pick} do not exist; the matrix has {} rows", rows.len())));
                }
                RowPick::Node { node, first, last } => {
                    for dof in first..=last {
                        let row =
                            index.get(&(node, dof)).ok_or_else(|| refuse(format!("there is no row {node}:{dof}")))?;
                        boundary.push(*row);
                    }
                }
            }
        }
        if boundary.len() - before != 6 {
            let found = boundary.len() - before;
            return Err(refuse(format!("{found} rows are selected, six are required (ux uy uz rx ry rz)")));
        }
    }
    // A row can belong to one interface only.
    let mut sorted = boundary.clone();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.len() != boundary.len() {
        return Err(LinkError::content(&imported.origin, format!("the map {map} selects a row twice")));
    }
    Ok(boundary)
}

/// Converts the lower triangle to SI: displacements are lengths, or angles where `is_turn`.
fn to_si(matrix: &LabelledMatrix, units: UnitSystem, is_turn: &[bool], is_mass: bool) -> SparseSymmetric {
    let energy = units.force() * units.length;
    let unit = if is_mass { energy * units.time * units.time } else { energy };
    // K_SI = D⁻¹ K D⁻¹ energy with u_SI = D u_file; M likewise, times the unit of time squared.
    let d: Vec<f64> = is_turn.iter().map(|turn| if *turn { 1.0 } else { units.length }).collect();
    let entries: Vec<(u32, u32, f64)> = matrix
        .to_sparse()
        .triplets()
        .map(|(row, column, value)| (row as u32, column as u32, value * (unit / (d[row] * d[column]))))
        .collect();
    SparseSymmetric::from_triplets(matrix.size(), &entries)
}

/// A plane of a map without nodes.
#[derive(Debug, thiserror::Error)]
#[error("no node is on {plane}; the nodes extend from {low:?} to {high:?}")]
pub(super) struct NoNodes {
    plane: NodePlane,
    low: [f64; 3],
    high: [f64; 3],
}

/// Returns the nodes on a plane.
pub(super) fn nodes_on(imported: &ImportedMatrices, plane: &NodePlane) -> Result<Vec<i64>, NoNodes> {
    let (low, high) = box_of(imported);
    let tolerance = 1e-6 * (high - low).norm();
    let n = plane.normal.normalize();
    let near = |p: &Vector3<f64>| (p - plane.point).dot(&n).abs() <= tolerance;
    let nodes: Vec<i64> = imported.positions.iter().filter(|(_, p)| near(p)).map(|(node, _)| *node).collect();
    if nodes.is_empty() {
        return Err(NoNodes { plane: plane.clone(), low: low.into(), high: high.into() });
    }
    Ok(nodes)
}
