//! Import of a modal body (SID) as a link: its modal link in the frame at A, and the compliance of
//! B with A held, from the modes at both nodes.
//!
//! ```text
//! P = Φ_B - Ad_BA Φ_A          elastic displacement of B with A held, per mode (rows: phi, then psi)
//! C_BB = P Ke⁻¹ Pᵀ             independent of the reference frame, whose rigid motions are free
//! ```
//! The two rigid parts have the mass, centre and inertia of the body. Computed in SI.

use flexarm_fe_io::exchange::{InputFile, InterfaceMap, RowPick, Sid, modal_link_held_at, parse_sid};
use flexarm_fem::matrix_link::{MatrixReduction, PartMasses, link_from_superelement};
use flexarm_fem::reduction::{InterfaceFrame, Superelement};
use flexarm_fem::{GeometricStiffness, LinkDetails, ModalInterface, ModalLink, Pose, RigidPart, UnitSystem};
use flexarm_settings::Setting;
use nalgebra::{DMatrix, Matrix6, Rotation3, Translation3, Vector3};

use super::summary::{ImportInterface, Parts};
use super::words::ImportMap;
use super::{ImportJob, SECOND_ORDER_UNKNOWN, plan, rotation};
use crate::LinkError;

pub(super) fn import(job: &ImportJob, file: &InputFile, name: &str) -> Result<(MatrixReduction, Parts), LinkError> {
    // Content of the file; what the job must add to it.
    let sid = parse_sid(&String::from_utf8_lossy(&file.bytes), &file.origin).map_err(Box::new)?;
    let ids: Vec<i64> = sid.nodes.iter().map(|node| node.id).collect();
    let (units, nodes) = layout(job, &file.origin, &ids)?;
    let mut warnings = Vec::new();
    if job.modes.is_some() {
        warnings.push(format!("{} applies only to full models; all modes of a SID are kept", Setting::Modes));
    }

    // Modal link in link axes, and the frames of the nodes, undeformed.
    let sid = sid.in_units(&units, &UnitSystem::SI);
    let R_LM = rotation(&job.axes_rpy);
    let modal = modal_link(&sid, name, &nodes, &R_LM, &mut warnings);
    let place = |k: usize| -> Pose {
        let p = Vector3::from_iterator(sid.nodes[nodes[k].1].origin.m0().iter().copied().take(3));
        let plain = Pose::from_parts(Translation3::from(R_LM * p), Rotation3::identity());
        modal.as_ref().map_or(plain, |modal| if k == 0 { modal.X_LA } else { modal.interfaces[k - 1].X_LI })
    };
    let places: Vec<Pose> = (0..nodes.len()).map(place).collect();

    // Static stiffness of the free body as the superelement of a link with two parts.
    let p = |k: usize| places[k].translation.vector;
    let frame = |k: usize| InterfaceFrame { name: nodes[k].0.clone(), X_LI: places[k], tie: None };
    let K = static_stiffness(&sid, [nodes[0].1, nodes[1].1], &R_LM, &(p(1) - p(0)))
        .map_err(|what| LinkError::content(&file.origin, what))?;
    let element = Superelement { interfaces: vec![frame(0), frame(1)], K, M: DMatrix::zeros(12, 12) };
    let kind = if modal.is_some() { "modal link" } else { "static part" };
    let method = format!("{kind} of {} modes", sid.nq());
    let mut plan = plan(job, name, units, &file.origin, &format!("{method}, SID"));
    if plan.masses == PartMasses::FromMatrix {
        plan.masses = PartMasses::Whole(body(&sid, &R_LM));
    }
    let failed = |source| LinkError::Import { path: file.origin.clone().into(), source: Box::new(source) };
    let mut reduction = link_from_superelement(element, false, &plan).map_err(failed)?;
    if let Some(modal) = modal {
        add_modal(&mut reduction, modal, &mut warnings);
    }
    let interfaces = (0..nodes.len()).map(|k| ImportInterface {
        name: nodes[k].0.clone(),
        rows: format!("node {}", ids[nodes[k].1]),
        position_m: p(k).into(),
        rpy_rad: places[k].rotation.euler_angles().into(),
        from: "the frame of its node",
    });
    let parts = Parts {
        files: vec![file.origin.clone()],
        format: "SID".into(),
        units: units.name(),
        method,
        rows: sid.nq(),
        interfaces: interfaces.collect(),
        asymmetry: 0.0,
        element: None,
        warnings,
    };
    Ok((reduction, parts))
}

/// Returns the units of the file, and names and indices of the nodes, proximal and distal first.
fn layout(job: &ImportJob, origin: &str, ids: &[i64]) -> Result<(UnitSystem, Vec<(String, usize)>), LinkError> {
    let refuse = |what: String| LinkError::content(origin, what);
    let mut faults = Vec::new();
    if job.units.is_none() {
        let units = Setting::Units;
        faults.push(refuse(format!("the units of the file are not declared: {units} m-kg-s is usual for SID")));
    }
    let nodes = match &job.map {
        Some(map) => named_nodes(map, ids),
        None => Err(format!(
            "the nodes of interfaces A and B are not specified; the SID has nodes {ids:?}: {} \"A={},B={}\"",
            Setting::Map,
            ids.first().unwrap_or(&1),
            ids.last().unwrap_or(&2)
        )),
    };
    let nodes = nodes.map_err(|what| faults.push(refuse(what))).ok();
    let (Some(units), Some(nodes)) = (job.units, nodes) else { return Err(LinkError::of_all(faults)) };
    match job.at.first() {
        Some(given) => {
            let (at, name) = (Setting::At, &given.name);
            let what = format!("{at} {name}=...: the positions are in the SID file; leave {at} out");
            Err(LinkError::Job(what))
        }
        None => Ok((units, nodes)),
    }
}

/// Computes the stiffness of the free body over the motions of nodes A and B, in link axes.
fn static_stiffness(
    sid: &Sid,
    nodes: [usize; 2],
    R_LM: &Rotation3<f64>,
    p_AB: &Vector3<f64>,
) -> Result<DMatrix<f64>, String> {
    let K_BB = compliance(sid, nodes, R_LM, p_AB)?.try_inverse().ok_or("the compliance at B is singular")?;
    let K_BB = (K_BB + K_BB.transpose()) * 0.5;
    Ok(free_stiffness(&K_BB, p_AB))
}

/// Adds a modal link to the link of two parts; warns if their masses differ.
fn add_modal(reduction: &mut MatrixReduction, modal: ModalLink, warnings: &mut Vec<String>) {
    let (own, given) = (modal.mass, reduction.whole.mass);
    if (own / given - 1.0).abs() > 0.01 {
        warnings.push(format!(
            "the modal link has the mass of the SID, {own:.6} kg; the given masses of the parts sum to {given:.6} kg"
        ));
    }
    reduction.held_frequencies_hz = modal.held_frequencies_hz();
    reduction.link.details = Some(Box::new(LinkDetails { modal: Some(modal), ..LinkDetails::default() }));
}

/// Returns the modal link with the mapped nodes as its interfaces; `None` with a warning if the
/// data do not define one.
fn modal_link(
    sid: &Sid,
    name: &str,
    nodes: &[(String, usize)],
    R_LM: &Rotation3<f64>,
    warnings: &mut Vec<String>,
) -> Option<ModalLink> {
    let A = nodes[0].1;
    let link = match modal_link_held_at(name, sid, sid.nodes[A].id) {
        Ok(link) => link,
        Err(error) => {
            let used = "only the stiffness between A and B and the rigid-body mass are used";
            warnings.push(format!("the SID does not define a modal link, {used}: {error}"));
            return None;
        }
    };
    // Geometric stiffness belongs to the frame of the data; it is lost with another node held.
    let is_stressed = sid.Ct.order == 1 || sid.others.iter().any(|(block, _)| block.eq_ignore_ascii_case("K0t"));
    if link.geometric.is_none() && is_stressed {
        warnings.push(format!(
            "node {} moves in the reference frame of the SID, in which its geometric stiffness is given: the \
             geometric stiffness is neglected",
            sid.nodes[A].id
        ));
    }
    if !link.has_second_order() {
        warnings.push(SECOND_ORDER_UNKNOWN.into());
    }
    if sid.De.m0().iter().any(|d| *d != 0.0) {
        warnings.push("the damping of the SID (De) is ignored: set the damping in the robot file".into());
    }
    // One interface per node except A, in the order of the file.
    let at: Vec<usize> = nodes[1..].iter().map(|(_, node)| if *node > A { node - 1 } else { *node }).collect();
    let interface = |(k, (name, _)): (&usize, &(String, usize))| {
        let own = link.interfaces.get(*k)?;
        Some(ModalInterface { name: name.clone(), ..own.clone() })
    };
    let interfaces = at.iter().zip(&nodes[1..]).map(interface).collect::<Option<Vec<_>>>()?;
    let geometric = link.geometric.clone().map(|G| GeometricStiffness {
        interface: at.iter().filter_map(|k| G.interface.get(*k).cloned()).collect(),
        ..G
    });
    let link = ModalLink { name: name.to_owned(), interfaces, geometric, ..link };
    Some(if *R_LM == Rotation3::identity() { link } else { link.turned(R_LM) })
}

/// Returns names and indices of the nodes, proximal and distal first.
fn named_nodes(map: &ImportMap, ids: &[i64]) -> Result<Vec<(String, usize)>, String> {
    let wrong = || format!("a SID requires a map of at least two nodes, such as A=1,B=2; its nodes are {ids:?}");
    let ImportMap::Rows(InterfaceMap { interfaces, modal }) = map else { return Err(wrong()) };
    let index = |picks: &[RowPick]| match picks {
        [RowPick::Node { node, first: 1, last: 6 }] => {
            let found = ids.iter().position(|id| id == node);
            found.ok_or_else(|| format!("there is no node {node}; the nodes are {ids:?}"))
        }
        _ => Err(wrong()),
    };
    if !modal.is_empty() || interfaces.len() < 2 {
        return Err(wrong());
    }
    let nodes = interfaces
        .iter()
        .map(|one| Ok((one.name.clone(), index(&one.picks)?)))
        .collect::<Result<Vec<(String, usize)>, String>>()?;
    let twice = nodes.iter().enumerate().find(|(k, (_, node))| nodes[..*k].iter().any(|(_, other)| other == node));
    match twice {
        Some((_, (_, node))) => Err(format!("the map names node {} twice", ids[*node])),
        None => Ok(nodes),
    }
}

/// Computes `C_BB` in link axes.
fn compliance(
    sid: &Sid,
    [a, b]: [usize; 2],
    R_LM: &Rotation3<f64>,
    p_AB: &Vector3<f64>,
) -> Result<Matrix6<f64>, String> {
    let nq = sid.nq();
    if nq < 6 {
        return Err(format!(
            "has {nq} modes; the six relative motions of B require at least six, otherwise B is rigid in some \
             direction: export more modes, including the static modes under loads at the interfaces"
        ));
    }
    let shape = |k: usize| -> Result<DMatrix<f64>, String> {
        let (phi, psi) = (sid.nodes[k].phi.m0(), sid.nodes[k].psi.m0());
        if phi.shape() != (3, nq) || psi.shape() != (3, nq) {
            return Err(format!("node {} has no phi and psi of 3 x {nq}", sid.nodes[k].id));
        }
        let mut Phi = DMatrix::zeros(6, nq);
        Phi.view_mut((0, 0), (3, nq)).copy_from(&(R_LM.matrix() * phi));
        Phi.view_mut((3, 0), (3, nq)).copy_from(&(R_LM.matrix() * psi));
        Ok(Phi)
    };
    // P = Φ_B - Ad_BA Φ_A
    let (Phi_A, Phi_B) = (shape(a)?, shape(b)?);
    let mut Ad_BA = DMatrix::identity(6, 6);
    Ad_BA.view_mut((0, 3), (3, 3)).copy_from(&-p_AB.cross_matrix());
    let P = Phi_B - Ad_BA * Phi_A;
    // C_BB = P Ke⁻¹ Pᵀ, with Ke scaled to a unit diagonal.
    let Ke = sid.Ke.m0();
    let scale = Ke.diagonal().map(|k| 1.0 / k.sqrt());
    let scaled = DMatrix::from_fn(nq, nq, |i, j| Ke[(i, j)] * scale[i] * scale[j]);
    let factor = scaled.cholesky().ok_or("Ke is not positive definite")?;
    let right = DMatrix::from_fn(nq, 6, |i, j| P[(j, i)] * scale[i]);
    let C = right.transpose() * factor.solve(&right);
    // Motions missing in the modes appear as zero eigenvalues of the scaled compliance.
    let s = C.diagonal().map(|c| 1.0 / c.sqrt());
    let unit = DMatrix::from_fn(6, 6, |i, j| C[(i, j)] * s[i] * s[j]);
    let least = unit.symmetric_eigenvalues().min();
    if least.is_nan() || least <= 1e-10 {
        return Err(format!(
            "its {nq} modes do not move B relative to A in all six directions (minimum relative compliance \
             {least:.1e}): are these nodes the interfaces, and does the file include the static modes under loads \
             at them?"
        ));
    }
    Ok(Matrix6::from_fn(|i, j| C[(i, j)]))
}

/// Computes the 12×12 stiffness of both interfaces.
fn free_stiffness(K_BB: &Matrix6<f64>, p_AB: &Vector3<f64>) -> DMatrix<f64> {
    let mut Ad_BA = Matrix6::identity();
    Ad_BA.fixed_view_mut::<3, 3>(0, 3).copy_from(&-p_AB.cross_matrix());
    // K_AB = -Ad_BAᵀ K_BB,  K_AA = Ad_BAᵀ K_BB Ad_BA
    let K_AB = -Ad_BA.transpose() * K_BB;
    let mut K = DMatrix::zeros(12, 12);
    K.view_mut((0, 0), (6, 6)).copy_from(&(-K_AB * Ad_BA));
    K.view_mut((0, 6), (6, 6)).copy_from(&K_AB);
    K.view_mut((6, 0), (6, 6)).copy_from(&K_AB.transpose());
    K.view_mut((6, 6), (6, 6)).copy_from(K_BB);
    (&K + K.transpose()) * 0.5
}

/// Computes mass, centre and inertia of the undeformed body, SI, link axes.
fn body(sid: &Sid, R_LM: &Rotation3<f64>) -> RigidPart {
    let moment = sid.mdCM.m0();
    let com = Vector3::from_iterator(moment.iter().copied().take(3)) / sid.mass;
    let c = com.cross_matrix();
    let about_com = sid.J0() + c * c * sid.mass;
    let R = R_LM.matrix();
    RigidPart { mass: sid.mass, com: R_LM * com, inertia: R * about_com * R.transpose() }
}
