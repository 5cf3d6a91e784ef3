//! Conversion of Standard Input Data to modal links.
//!
//! ```text
//! mdCM = ∫ s dm + Σ C_t,k η_k          J = inertia + Σ J1_k η_k      J1 = 2 tr(Ps) 1 - 2 Ps,  Ps: symmetric part of P
//! Ct0 = C_tᵀ                           Cr0 = C_rᵀ,  Cr1_kl = ∫ φ_l × φ_k dm                     from N_lk
//! Gr_k = -2 ∫ [s]x [φ_k]x dm = 2 (tr(P_k) 1 - P_kᵀ)                    Ge_kl = 2 ∫ φ_l × φ_k dm
//! Oe0 = ∫ φ_kᵀ [ω]x² s dm,  Oe1 = ∫ φ_kᵀ [ω]x² φ_l dm                  by products ω_i ω_j
//! ```
//! The geometric stiffness is stored as in the standard: as first-order parts of Ct, Cr, Oe and,
//! with opposite sign, of phi and psi of the nodes. It is also stored separately in the blocks
//! `K0t`, `K0r`, `K0omega` and `K0F`, because it cannot be separated from `Oe` again. Column
//! `i n + l` of a block: entry l for load i.
//!
//! Letters: s position in the undeformed link, φ_k shape of coordinate k, dm element of mass, all
//! in link axes about Lo. Not here: index orders of the file ([`super::conventions`]).
//!
//! Source: Wallrapp (1994), *Mech. Struct. & Mach.* 22.

use flexarm_spatial::{Pose, symmetric_part};
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Matrix6xX, Rotation3, Translation3, Vector3};

use flexarm_fem::modal::{GeometricStiffness, ModalInterface, ModalLink, PRODUCTS};

use super::{GyroLayout, OeOrder, Sid, SidMatrix, SidNode, sizes_of};
use crate::FeFileError;
use crate::exchange::position::ErrorPosition;

/// Start of the comment that stores the names of the link and its nodes.
const COMMENT: &str = "modal link";
/// Columns of `Oe` for [`PRODUCTS`], in the written order xx yy zz xy yz xz.
const OE_COLUMNS: [usize; 6] = [0, 1, 2, 3, 5, 4];
/// Maximum `|RᵀR - 1|` of a node frame: files have few digits.
const ROTATION: f64 = 1e-6;

/// Symmetric part of `A = ∫ s φᵀ dm`, from `O = ∫ φᵀ [ω]x² s dm` per product `ω_i ω_j`.
///
/// ```text
/// [ω]x² = ω ωᵀ - |ω|² 1  gives  O_ii = A_ii - tr A,  O_ij = A_ij + A_ji,  tr A = -(O_xx + O_yy + O_zz)/2
/// ```
fn from_centrifugal(O: [f64; 6]) -> Matrix3<f64> {
    let trace = -0.5 * (O[0] + O[1] + O[2]);
    let mut A = Matrix3::zeros();
    for ((a, b), O) in PRODUCTS.into_iter().zip(O) {
        let value = if a == b { O + trace } else { 0.5 * O };
        (A[(a, b)], A[(b, a)]) = (value, value);
    }
    A
}

/// Skew matrix A with `axial(A) = c`.
fn skew_of(c: &Vector3<f64>) -> Matrix3<f64> {
    c.cross_matrix() * -0.5
}

/// Converts Standard Input Data to a modal link.
///
/// A is the first node that no coordinate moves (otherwise see [`modal_link_held_at`]); every other
/// node becomes an interface, in file order. The names of the link and nodes are those of the
/// comment `modal link | NAME | A | B ...`, otherwise `name` and the numbers of the nodes. Damping
/// (`De`) is ignored. In a file without the block `K0omega` the centrifugal stiffening remains in
/// `Oe` and therefore in N.
///
/// * `name`: name of the link, and of the data in messages.
/// * `sid`: data in SI.
///
/// # Errors
/// As [`Sid::conventions`]; without a node A or another one; with initial stress; for a mass or
/// stiffness that is not positive definite, frames that are not orthonormal, and blocks whose size
/// does not match the number of modes.
pub fn modal_link_from_sid(name: &str, sid: &Sid) -> Result<ModalLink, FeFileError> {
    check_sizes(name, sid)?;
    of_node(name, sid, still_node(name, sid)?)
}

/// As [`modal_link_from_sid`], with a given node as A, for any floating frame of the data.
///
/// If the coordinates move that node, its motion is removed from all shapes as a rigid motion; the
/// geometric stiffness belongs to the frame of the data and is then dropped.
///
/// # Errors
/// As [`modal_link_from_sid`]; if the node does not exist.
pub fn modal_link_held_at(name: &str, sid: &Sid, node: i64) -> Result<ModalLink, FeFileError> {
    check_sizes(name, sid)?;
    let ids: Vec<i64> = sid.nodes.iter().map(|node| node.id).collect();
    let Some(A) = ids.iter().position(|id| *id == node) else {
        let (found, expected) = (format!("the nodes {ids:?}"), format!("node {node}"));
        return Err(fail(name, "frame", found, &expected, ""));
    };
    of_node(name, sid, A)
}

/// Converts the data with a given node as A.
///
/// * `A`: index of the clamped node.
fn of_node(name: &str, sid: &Sid, A: usize) -> Result<ModalLink, FeFileError> {
    // Checks of the whole file, before any number of it is used.
    let conventions = sid.conventions(name)?;
    if sid.ksigma.m0().iter().any(|x| *x != 0.0) {
        let help = "a modal link is free of stress where its coordinates are zero";
        return Err(fail(name, "ksigma", "initial stress", "zeros", help));
    }
    // Interfaces: every node except A, with its shapes [phi; psi], linear first.
    let n = sid.nq();
    let names = node_names(sid);
    let interfaces = sid.nodes.iter().zip(&names).enumerate().filter(|(at, _)| *at != A);
    let interfaces = interfaces
        .map(|(_, (node, node_name))| {
            let (phi, psi) = (node.phi.m0(), node.psi.m0());
            let Phi = Matrix6xX::from_fn(n, |r, k| if r < 3 { phi[(r, k)] } else { psi[(r - 3, k)] });
            Ok(ModalInterface { name: node_name.clone(), X_LI: frame(name, node)?, Phi })
        })
        .collect::<Result<Vec<_>, FeFileError>>()?;
    if interfaces.is_empty() {
        let (found, help) = ("one node", "the distal interface must be a node of the file");
        return Err(fail(name, "frame", found, "a node that moves", help));
    }

    // P_k = ∫ s φ_kᵀ dm: the symmetric part from J1 = 2 tr(Ps) 1 - 2 Ps, the skew part from C_r.
    let (Ct, Cr) = (sid.Ct.m0(), sid.Cr.m0());
    let C_r = Matrix3xX::from_fn(n, |a, k| Cr[(k, a)]);
    let P: Vec<Matrix3<f64>> = (0..n)
        .map(|k| {
            let J1 = sid.J1(k);
            (Matrix3::identity() * (0.5 * J1.trace()) - J1) * 0.5 + skew_of(&C_r.column(k).into_owned())
        })
        .collect();
    let geometric = geometric(sid, A);
    let N = second_order(sid, conventions.gyro, conventions.oe);
    let J = sid.J0();
    let link = ModalLink {
        name: link_name(sid).unwrap_or_else(|| name.to_owned()),
        interfaces,
        mass: sid.mass,
        first_moment: Vector3::from_iterator(sid.mdCM.m0().iter().copied()),
        inertia: (J + J.transpose()) * 0.5,
        C_t: Matrix3xX::from_fn(n, |a, k| Ct[(k, a)]),
        C_r,
        P,
        N,
        M: symmetric_part(&sid.Me.m0()),
        K: symmetric_part(&sid.Ke.m0()),
        geometric,
        labels: sid.modes.clone(),
        X_LA: frame(name, &sid.nodes[A])?,
    };
    // A is clamped: motion of its node is removed from all shapes.
    let link = if is_still(&sid.nodes[A]) { link } else { link.without_rigid_motion(&motion_of(&sid.nodes[A], n)) };
    if !(link.mass > 0.0) || !link.is_positive_definite() {
        let expected = "a positive mass, Me and Ke positive definite with A held";
        let help = "are rigid motions among the modes?";
        return Err(fail(name, "Me, Ke", "others", expected, help));
    }
    Ok(link)
}

fn fail(origin: &str, element: &str, found: impl Into<Box<str>>, expected: &str, help: &str) -> FeFileError {
    ErrorPosition::file(origin).fail(element, found, expected, help)
}

/// Checks the sizes: those of a file were checked, but data built by the caller may have any size.
fn check_sizes(origin: &str, sid: &Sid) -> Result<(), FeFileError> {
    let n = sid.nq();
    // Damping is not used.
    let body = sid.blocks().filter(|(name, _)| *name != "De");
    let of_nodes = sid
        .nodes
        .iter()
        .flat_map(|node| [("origin", &node.origin), ("phi", &node.phi), ("psi", &node.psi), ("AP", &node.AP)]);
    for (name, matrix) in body.chain(of_nodes) {
        let sizes = sizes_of(name, n);
        if n == 0 || !(sizes.is_empty() || sizes.contains(&(matrix.nrow, matrix.ncol))) {
            let found = format!("{} x {} with {n} modes", matrix.nrow, matrix.ncol);
            return Err(fail(origin, name, found, "the size of the standard", ""));
        }
    }
    Ok(())
}

/// Matrices of a block by load, if the block is present with the expected size.
fn by_loads<const LOADS: usize>(sid: &Sid, name: &str, from: usize, all: usize) -> Option<[DMatrix<f64>; LOADS]> {
    let n = sid.nq();
    let (_, block) = sid.others.iter().find(|(other, _)| other.eq_ignore_ascii_case(name))?;
    if (block.nrow, block.ncol) != (n, n * all) {
        return None;
    }
    let dense = block.m0();
    Some(std::array::from_fn(|i| symmetric_part(&dense.columns((from + i) * n, n).into_owned())))
}

/// Geometric stiffness from the blocks `K0t` to `K0F`, or from the first-order parts of the
/// standard.
fn geometric(sid: &Sid, A: usize) -> Option<GeometricStiffness> {
    let n = sid.nq();
    let nodes: Vec<&SidNode> = sid.nodes.iter().enumerate().filter(|(at, _)| *at != A).map(|(_, node)| node).collect();
    let own = || -> Option<GeometricStiffness> {
        let interface =
            (0..nodes.len()).map(|i| by_loads(sid, "K0F", 6 * i, 6 * nodes.len())).collect::<Option<_>>()?;
        Some(GeometricStiffness {
            acceleration: by_loads(sid, "K0t", 0, 3)?,
            angular: by_loads(sid, "K0r", 0, 3)?,
            centrifugal: by_loads(sid, "K0omega", 0, 6)?,
            interface,
        })
    };
    if let Some(own) = own() {
        return Some(own);
    }
    let is_stressed = sid.Ct.order == 1 || nodes.iter().any(|node| node.phi.order == 1 || node.psi.order == 1);
    is_stressed.then(|| {
        let first = |matrix: &SidMatrix, axis: usize| {
            let mut G = DMatrix::zeros(n, n);
            for l in 0..n {
                G.set_column(l, &matrix.m1(l).column(axis));
            }
            symmetric_part(&G)
        };
        let of_node = |shapes: &SidMatrix, axis: usize| {
            let mut G = DMatrix::zeros(n, n);
            for l in 0..n {
                G.set_column(l, &-shapes.m1(l).row(axis).transpose());
            }
            symmetric_part(&G)
        };
        let of_nodes = |node: &&SidNode| {
            std::array::from_fn(|i| if i < 3 { of_node(&node.phi, i) } else { of_node(&node.psi, i - 3) })
        };
        GeometricStiffness {
            acceleration: std::array::from_fn(|axis| first(&sid.Ct, axis)),
            // The part of Cr1 from N is skew in the coordinates and drops out of the symmetric
            // part.
            angular: std::array::from_fn(|axis| first(&sid.Cr, axis)),
            centrifugal: std::array::from_fn(|_| DMatrix::zeros(n, n)),
            interface: nodes.iter().map(of_nodes).collect(),
        }
    })
}

/// N: symmetric parts from `Oe1` without its stiffening, skew parts from `Ge`, or from `Cr1` if
/// `Ge` is empty.
fn second_order(sid: &Sid, gyro: GyroLayout, oe: OeOrder) -> Vec<Matrix3<f64>> {
    let n = sid.nq();
    let stiffening: Option<[DMatrix<f64>; 6]> = by_loads(sid, "K0omega", 0, 6);
    let from_Ge = !sid.Ge.entries0.is_empty();
    let Oe_column = match oe {
        OeOrder::XyYzXz => OE_COLUMNS,
        OeOrder::XyXzYz => [0, 1, 2, 3, 4, 5],
    };
    let Ge: Vec<_> = (0..n).map(|l| sid.Ge(gyro, l)).collect();
    let Cr1: Vec<_> = (0..n).map(|l| sid.Cr.m1(l)).collect();
    let Oe1: Vec<_> = (0..n).map(|l| sid.Oe.m1(l)).collect();
    // ∫ φ_l × φ_k dm
    let cross = |k: usize, l: usize| {
        Vector3::from_fn(|axis, _| {
            if from_Ge {
                (Ge[l][(k, axis)] - Ge[k][(l, axis)]) * 0.25
            } else {
                (Cr1[l][(k, axis)] - Cr1[k][(l, axis)]) * 0.5
            }
        })
    };
    let mut N = vec![Matrix3::zeros(); n * n];
    for k in 0..n {
        for l in k..n {
            let product = |i: usize| {
                let sum = Oe1[l][(k, Oe_column[i])] + Oe1[k][(l, Oe_column[i])];
                0.5 * sum - stiffening.as_ref().map_or(0.0, |G| G[i][(k, l)])
            };
            let N_kl = from_centrifugal(std::array::from_fn(product)) + skew_of(&cross(l, k));
            N[k * n + l] = N_kl;
            N[l * n + k] = N_kl.transpose();
        }
    }
    N
}

fn is_still(node: &SidNode) -> bool {
    let still = |shapes: &SidMatrix| shapes.m0().iter().all(|x| *x == 0.0);
    still(&node.phi) && still(&node.psi)
}

/// Rigid motions of the whole link that equal the motion of a node per coordinate: at Lo, then
/// rotation.
fn motion_of(node: &SidNode, n: usize) -> Matrix6xX<f64> {
    let (phi, psi) = (node.phi.m0(), node.psi.m0());
    let p = Vector3::from_iterator(node.origin.m0().iter().copied());
    let column = |A: &DMatrix<f64>, k: usize| Vector3::from_iterator(A.column(k).iter().copied());
    let mut motion = Matrix6xX::zeros(n);
    for k in 0..n {
        let theta = column(&psi, k);
        motion.fixed_view_mut::<3, 1>(0, k).copy_from(&(column(&phi, k) - theta.cross(&p)));
        motion.fixed_view_mut::<3, 1>(3, k).copy_from(&theta);
    }
    motion
}

/// Index of the first node that no coordinate moves.
fn still_node(origin: &str, sid: &Sid) -> Result<usize, FeFileError> {
    sid.nodes.iter().position(is_still).ok_or_else(|| {
        let expected = "a node without displacement: interface A, at which the frame is tangent";
        let help = "say which node is A, or make the file with the proximal interface as its frame";
        fail(origin, "frame", "nodes that all move", expected, help)
    })
}

fn frame(origin: &str, node: &SidNode) -> Result<Pose, FeFileError> {
    let R = Matrix3::from_iterator(node.AP.m0().iter().copied());
    let gap = (R.transpose() * R - Matrix3::identity()).amax();
    if !(gap <= ROTATION && R.determinant() > 0.0) {
        let found = format!("|RᵀR - 1| = {gap:.1e} at node {}", node.id);
        return Err(fail(origin, "AP", found, "a rotation matrix", ""));
    }
    let p = Vector3::from_iterator(node.origin.m0().iter().copied());
    Ok(Pose::from_parts(Translation3::from(p), Rotation3::from_matrix_unchecked(R)))
}

/// Name of the link, if the comment contains it.
fn link_name(sid: &Sid) -> Option<String> {
    let mut parts = sid.comment.split('|').map(str::trim);
    (parts.next() == Some(COMMENT)).then(|| parts.next().unwrap_or("").to_owned())
}

/// Names of the nodes from the comment, otherwise their numbers.
fn node_names(sid: &Sid) -> Vec<String> {
    let names: Vec<String> = sid.comment.split('|').skip(2).map(|name| name.trim().to_owned()).collect();
    if link_name(sid).is_some() && names.len() == sid.nodes.len() {
        return names;
    }
    sid.nodes.iter().map(|node| node.id.to_string()).collect()
}
