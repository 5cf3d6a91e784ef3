//! A modal body (SID) as a link: the compliance of B with A held, from modes at both nodes.
//!
//! ```text
//! P = Φ_B - Ad_BA Φ_A          elastic displacement of B with A held, per mode (rows: phi, then psi)
//! C_BB = P Ke⁻¹ Pᵀ             the rigid motions of the reference frame are free, so this holds for any frame
//! ```
//! Not here: the mass of the modes; the link has two rigid parts with the mass, centre and inertia of the body.

use flexarm_fem::exchange::{InputFile, InterfaceMap, RowPick, Sid, parse_sid};
use flexarm_fem::matrix_link::{MatrixReduction, PartMasses, link_from_superelement};
use flexarm_fem::reduction::{InterfaceFrame, Superelement};
use flexarm_fem::{Pose, RigidPart, UnitSystem};
use nalgebra::{DMatrix, Matrix6, Rotation3, Translation3, Vector3};

use super::summary::{ImportInterface, Parts};
use super::words::ImportMap;
use super::{ImportJob, plan, rotation};
use crate::error::Error;

pub(super) fn import(job: &ImportJob, file: &InputFile, name: &str) -> Result<(MatrixReduction, Parts), Error> {
    let refuse = |what: String| Error::File { path: file.origin.clone().into(), what };
    let sid = parse_sid(&String::from_utf8_lossy(&file.bytes), &file.origin).map_err(Box::new)?;
    let ids: Vec<i64> = sid.nodes.iter().map(|node| node.id).collect();
    let mut faults = Vec::new();
    if job.units.is_none() {
        faults.push(refuse("the units of the file are not declared: --units m-kg-s is usual for SID".into()));
    }
    let nodes = match &job.map {
        Some(map) => two_nodes(map, &ids),
        None => {
            let (first, last) = (ids.first().copied().unwrap_or(1), ids.last().copied().unwrap_or(2));
            Err(format!("which nodes are A and B is not said; its nodes are {ids:?}: --map \"A={first},B={last}\""))
        }
    };
    let nodes = nodes.map_err(|what| faults.push(refuse(what))).ok();
    let (Some(units), Some(nodes)) = (job.units, nodes) else {
        return Err(if faults.len() == 1 { faults.remove(0) } else { Error::Several(faults) });
    };
    if let Some(at) = job.at.first() {
        let what = format!("--at {}=...: the positions are in the SID file; leave --at out", at.name);
        return Err(Error::Usage(what));
    }

    let R_LM = rotation(&job.axes_rpy);
    let p = |k: usize| -> Vector3<f64> {
        let origin = sid.nodes[nodes[k].1].origin.m0();
        R_LM * Vector3::from_iterator(origin.iter().copied().take(3)) * units.length
    };
    let frame = |k: usize| InterfaceFrame {
        name: nodes[k].0.clone(),
        X_LI: Pose::from_parts(Translation3::from(p(k)), Rotation3::identity()),
        tie: None,
    };
    let C = compliance(&sid, nodes[0].1, nodes[1].1, units, &R_LM, &(p(1) - p(0))).map_err(refuse)?;
    let K_BB = C.try_inverse().ok_or_else(|| refuse("the compliance of B cannot be inverted".into()))?;
    let K_BB = (K_BB + K_BB.transpose()) * 0.5;
    let K = free_stiffness(&K_BB, &(p(1) - p(0)));
    let element = Superelement { interfaces: vec![frame(0), frame(1)], K, M: DMatrix::zeros(12, 12) };
    let mut plan = plan(job, name, units, &file.origin, &format!("static part of {} modes, SID", sid.nq()));
    if plan.masses == PartMasses::FromMatrix {
        plan.masses = PartMasses::Whole(body(&sid, units, &R_LM));
    }
    let failed = |source| Error::Import { path: file.origin.clone().into(), source: Box::new(source) };
    let reduction = link_from_superelement(element, false, &plan).map_err(failed)?;
    let interfaces = (0..2).map(|k| ImportInterface {
        name: nodes[k].0.clone(),
        rows: format!("node {}", ids[nodes[k].1]),
        position_m: p(k).into(),
        rpy_rad: [0.0; 3],
        from: "the position of its node",
    });
    let parts = Parts {
        files: vec![file.origin.clone()],
        format: "SID".into(),
        units: units.name(),
        method: format!("static part of {} modes", sid.nq()),
        rows: sid.nq(),
        interfaces: interfaces.collect(),
        asymmetry: 0.0,
        element: None,
        warnings: vec![
            "of a SID only the stiffness between A and B and the rigid mass are used, not the mass of its modes".into(),
        ],
    };
    Ok((reduction, parts))
}

/// Names and indices of the two nodes.
fn two_nodes(map: &ImportMap, ids: &[i64]) -> Result<[(String, usize); 2], String> {
    let wrong = || format!("a SID needs a map of two nodes such as A=1,B=2; its nodes are {ids:?}");
    let ImportMap::Rows(InterfaceMap { interfaces, modal }) = map else { return Err(wrong()) };
    let [a, b] = &interfaces[..] else { return Err(wrong()) };
    let index = |picks: &[RowPick]| match picks {
        [RowPick::Node { node, first: 1, last: 6 }] => {
            let found = ids.iter().position(|id| id == node);
            found.ok_or_else(|| format!("there is no node {node}; the nodes are {ids:?}"))
        }
        _ => Err(wrong()),
    };
    if !modal.is_empty() {
        return Err(wrong());
    }
    Ok([(a.name.clone(), index(&a.picks)?), (b.name.clone(), index(&b.picks)?)])
}

/// `C_BB`, SI, link axes.
fn compliance(
    sid: &Sid,
    a: usize,
    b: usize,
    units: UnitSystem,
    R_LM: &Rotation3<f64>,
    p_AB: &Vector3<f64>,
) -> Result<Matrix6<f64>, String> {
    let nq = sid.nq();
    if nq < 6 {
        return Err(format!(
            "has {nq} modes; six relative motions of B need at least six, otherwise B is rigid in some direction: export \
             more modes, among them the static ones under loads at the interfaces"
        ));
    }
    let shape = |k: usize| -> Result<DMatrix<f64>, String> {
        let (phi, psi) = (sid.nodes[k].phi.m0(), sid.nodes[k].psi.m0());
        if phi.shape() != (3, nq) || psi.shape() != (3, nq) {
            return Err(format!("node {} has no phi and psi of 3 x {nq}", sid.nodes[k].id));
        }
        let mut Phi = DMatrix::zeros(6, nq);
        Phi.view_mut((0, 0), (3, nq)).copy_from(&(R_LM.matrix() * phi * units.length));
        Phi.view_mut((3, 0), (3, nq)).copy_from(&(R_LM.matrix() * psi));
        Ok(Phi)
    };
    let (Phi_A, Phi_B) = (shape(a)?, shape(b)?);
    let mut Ad_BA = DMatrix::identity(6, 6);
    Ad_BA.view_mut((0, 3), (3, 3)).copy_from(&-p_AB.cross_matrix());
    let P = Phi_B - Ad_BA * Phi_A;
    let Ke = sid.Ke.m0() * (units.force() * units.length);
    let scale = Ke.diagonal().map(|k| 1.0 / k.sqrt());
    let scaled = DMatrix::from_fn(nq, nq, |i, j| Ke[(i, j)] * scale[i] * scale[j]);
    let factor = scaled.cholesky().ok_or("Ke is not positive definite")?;
    let right = DMatrix::from_fn(nq, 6, |i, j| P[(j, i)] * scale[i]);
    let C = right.transpose() * factor.solve(&right);
    // The motions that the modes do not hold show as zero eigenvalues of the scaled compliance.
    let s = C.diagonal().map(|c| 1.0 / c.sqrt());
    let unit = DMatrix::from_fn(6, 6, |i, j| C[(i, j)] * s[i] * s[j]);
    let least = unit.symmetric_eigenvalues().min();
    if least.is_nan() || least <= 1e-10 {
        return Err(format!(
            "its {nq} modes do not move B against A in all six directions (smallest relative compliance {least:.1e}): \
             are these the interfaces, and are the static modes under loads at them in the file?"
        ));
    }
    Ok(Matrix6::from_fn(|i, j| C[(i, j)]))
}

/// The 12×12 of both interfaces.
fn free_stiffness(K_BB: &Matrix6<f64>, p_AB: &Vector3<f64>) -> DMatrix<f64> {
    let mut Ad_BA = Matrix6::identity();
    Ad_BA.fixed_view_mut::<3, 3>(0, 3).copy_from(&-p_AB.cross_matrix());
    let K_AB = -Ad_BA.transpose() * K_BB;
    let mut K = DMatrix::zeros(12, 12);
    K.view_mut((0, 0), (6, 6)).copy_from(&(-K_AB * Ad_BA));
    K.view_mut((0, 6), (6, 6)).copy_from(&K_AB);
    K.view_mut((6, 0), (6, 6)).copy_from(&K_AB.transpose());
    K.view_mut((6, 6), (6, 6)).copy_from(K_BB);
    (&K + K.transpose()) * 0.5
}

/// Mass, centre and inertia of the undeformed body, SI, link axes.
fn body(sid: &Sid, units: UnitSystem, R_LM: &Rotation3<f64>) -> RigidPart {
    let moment = sid.mdCM.m0();
    let com = Vector3::from_iterator(moment.iter().copied().take(3)) / sid.mass;
    let c = com.cross_matrix();
    let about_com = sid.J0() + c * c * sid.mass;
    let R = R_LM.matrix();
    RigidPart {
        mass: sid.mass * units.mass,
        com: R_LM * com * units.length,
        inertia: R * about_com * R.transpose() * (units.mass * units.length * units.length),
    }
}
