//! Makes a checked flexible link from matrices of another FE program.
//!
//! ```text
//! full K, M (.sti/.mas, DMIG) --Guyan or Craig-Bampton--> superelement --+
//! reduced K, M (DMIG, .mtx, OP4, ...) -------------------> superelement --+--gate--> ReducedLink
//! ```
//! Start at [`link_from_superelement`]; a full model goes through [`reduce_matrices`] first.
//!
//! Matrices do not describe the distribution of mass along the link. The two rigid parts are either
//! given or are the halves of the uniform bar with the same mass, centre of mass and inertia
//! ([`halves_of_bar`]); the latter gives a warning. Link axes, SI.
//!
//! Not here: formats of matrices (`flexarm-fe-io`), meshes ([`crate::mesh_link`]).

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::chain::Chain;
use crate::error::FemError;
use crate::frames::LinkFrames;
use crate::gate::GateLimits;
use crate::mesh_link::{MeshLinkError, SplitAt, condensed_body, split_point};
use crate::model::FeModel;
use crate::reduced::{LinkDetails, Provenance, ReducedLink};
use crate::reduction::{
    Boundary, Condensation, CondensationOptions, InterfaceFrame, ReductionError, Superelement, TieError, stiffness12,
};
use crate::rigid_part::RigidPart;
use crate::sparse::{ModesWanted, SparseSymmetric};
use flexarm_settings::Finding;

/// Source of the masses of the two parts.
#[derive(Debug, Clone, PartialEq)]
pub enum PartMasses {
    /// Given parts: proximal and distal, link axes.
    Given([RigidPart; 2]),
    /// One given body, halved as a uniform bar.
    Whole(RigidPart),
    /// Body of the mass matrix, halved as a uniform bar.
    FromMatrix,
}

/// Options for making a link from a superelement.
#[derive(Debug, Clone, PartialEq)]
pub struct MatrixPlan {
    /// Name of the link.
    pub name: String,
    /// Masses of the parts.
    pub masses: PartMasses,
    /// Position of the elastic joint.
    pub split: SplitAt,
    /// Limits of the gate.
    pub limits: GateLimits,
    /// Provenance of the numbers.
    pub provenance: Provenance,
}

/// Link made from matrices, with checks.
#[derive(Debug, Clone, PartialEq)]
pub struct MatrixReduction {
    /// The link, with its superelement if the matrices had a mass.
    pub link: ReducedLink,
    /// Mass properties according to the matrices or the plan.
    pub whole: RigidPart,
    /// Frequencies with A clamped and everything else free, Hz; empty without mass.
    pub held_frequencies_hz: Vec<f64>,
    /// Frequencies of the two rigid parts with their joint, A clamped, Hz.
    pub lumped_frequencies_hz: Vec<f64>,
    /// Warnings about accepted but suspicious input.
    pub caveats: Vec<Finding>,
}

/// Reduces a full model to some of its own DoF, six per interface, in order.
///
/// * `K`, `M`: SI, with the same rows.
/// * `boundary`: retained rows, interface by interface, `ux uy uz rx ry rz`.
/// * `frames`: interfaces of these rows.
/// * `modes`: fixed-interface modes to keep.
///
/// Returns six coordinates per interface, then the modes; axes and points of the retained rows.
///
/// # Errors
/// [`MeshLinkError::Reduction`], [`MeshLinkError::Modes`].
pub fn reduce_matrices(
    K: SparseSymmetric,
    M: SparseSymmetric,
    boundary: &[u32],
    frames: Vec<InterfaceFrame>,
    modes: ModesWanted,
    options: CondensationOptions,
) -> Result<Superelement, MeshLinkError> {
    if boundary.len() < 12 {
        return Err(ReductionError::from(TieError::TooFew { found: boundary.len() / 6 }).into());
    }
    let model = FeModel::from_matrices(K, M);
    let boundary = Boundary::retained(model.size(), boundary);
    let condensation = Condensation::with_boundary(&model, boundary, options)?;
    let modes = condensation.fixed_modes(modes)?;
    Ok(condensation.superelement(frames, &modes))
}

/// Rotates the matrices of a superelement from their own axes M to link axes.
///
/// ```text
/// K_L = Q K_M Qᵀ,   Q = blkdiag(R_LM, ..., R_LM, 1)
/// ```
/// * `element`: matrices in M axes, interfaces in L.
/// * `R_LM`: rotation from the axes of the matrices to link axes.
///
/// Returns the superelement with the same points and interfaces; modes have no axes.
pub fn turned(element: Superelement, R_LM: &Matrix3<f64>) -> Superelement {
    let n = element.K.nrows();
    let mut Q = DMatrix::identity(n, n);
    for corner in (0..element.boundary()).step_by(3) {
        Q.view_mut((corner, corner), (3, 3)).copy_from(R_LM);
    }
    let turn = |A: &DMatrix<f64>| &Q * A * Q.transpose();
    Superelement { K: turn(&element.K), M: turn(&element.M), interfaces: element.interfaces }
}

/// Makes a link of a superelement.
///
/// * `element`: two or more interfaces, proximal first; link axes, SI.
/// * `has_mass`: whether its mass matrix is meaningful.
///
/// Returns the link with frequencies and the mass properties of the whole, link axes.
///
/// # Errors
/// [`MeshLinkError::Gate`] if the stiffness fails the gate, or if the mass is missing or
/// impossible.
pub fn link_from_superelement(
    element: Superelement,
    has_mass: bool,
    plan: &MatrixPlan,
) -> Result<MatrixReduction, MeshLinkError> {
    // Stiffness of A and B, and the split frame.
    let loose = FemError::Missing { what: "stiffness of an interface or a mode", help: "it holds nothing" };
    let K12 = stiffness12(&element).ok_or(loose)?;
    let frames = LinkFrames::new(element.interfaces[0].X_LI, element.interfaces[1].X_LI);
    let mut caveats = Vec::new();
    let (p_LS, said) = split_point(&frames, &K12, plan.split, &|_| true);
    caveats.extend(said.map(|said| Finding::warning("split", "", said, "")));
    let frames = frames.with_split(Pose::translation(p_LS.x, p_LS.y, p_LS.z));

    // The whole body, then its two parts.
    let whole = match &plan.masses {
        PartMasses::Given([proximal, distal]) => proximal.merged(distal),
        PartMasses::Whole(whole) => whole.clone(),
        PartMasses::FromMatrix if has_mass => condensed_body(&element),
        PartMasses::FromMatrix => {
            let help = "give the mass matrix, or mass, centre of mass and inertia of the link or of its two parts";
            return Err(FemError::Missing { what: "mass", help }.into());
        }
    };
    whole.check("the link")?;
    let parts = match &plan.masses {
        PartMasses::Given(parts) => parts.clone(),
        _ => {
            caveats.push(Finding::warning(
                "halves",
                "",
                "the masses of the two parts are the halves of a uniform bar with the mass, centre of mass and \
                 inertia of the link: a matrix does not say where the mass sits; give the parts if they are known",
                "",
            ));
            halves_of_bar(&whole, &frames.p_AB())
        }
    };
    // The link, which passes the gate here; then frequencies and masses are compared with the
    // matrices.
    let mut link = ReducedLink::from_matrix12(&plan.name, frames, &K12, parts, plan.provenance.clone(), &plan.limits)?;
    let held_frequencies_hz = if has_mass { element.frequencies_hz(&[0]) } else { Vec::new() };
    if has_mass && held_frequencies_hz.is_empty() {
        let said = "the mass matrix is not positive definite: no frequencies, the modal link cannot be used";
        caveats.push(Finding::warning("mass", "", said, ""));
    }
    if has_mass && let PartMasses::Given(_) | PartMasses::Whole(_) = plan.masses {
        let found = condensed_body(&element).mass;
        if (found / whole.mass - 1.0).abs() > 0.01 {
            let said = format!("the mass matrix says {found:.6} kg, the given masses sum to {:.6} kg", whole.mass);
            caveats.push(Finding::warning("mass", "", said, "").measured(found, whole.mass));
        }
    }
    let lumped = Chain { joints: vec![link.split.clone()], parts: vec![link.proximal.clone(), link.distal.clone()] };
    let lumped_frequencies_hz = lumped.held_frequencies_hz();
    if has_mass {
        link.details = Some(Box::new(LinkDetails { superelement: Some(element), ..LinkDetails::default() }));
    }
    caveats.extend(link.warnings(&plan.limits).into_iter().map(|said| Finding::warning("gate", "", said, "")));
    Ok(MatrixReduction { link, whole, held_frequencies_hz, lumped_frequencies_hz, caveats })
}

/// Splits a body into two halves along an axis with the same total mass, centre of mass and
/// inertia.
///
/// The centre of each half of a uniform bar of length l is l/4 from the middle; `l²/12` is the
/// second moment of the bar along its axis over its mass. A bowed body may have no such halves.
/// Then the halves of its ellipsoid of inertia, cut across the axis, are used: their centres are
/// along `S a` (S: second moments, a: axis), and they always exist.
///
/// * `whole`: any frame; `along`: axis from the first half to the second, same axes, any length.
///
/// Returns both halves in the frame of `whole`, each with half its mass.
pub fn halves_of_bar(whole: &RigidPart, along: &Vector3<f64>) -> [RigidPart; 2] {
    let axis = along.normalize();
    // Second moment along the axis: half the trace minus the moment about the axis.
    let spread = (whole.inertia.trace() / 2.0 - axis.dot(&(whole.inertia * axis))).max(0.0) / whole.mass;
    let at = |offset: Vector3<f64>| {
        let c = offset.cross_matrix();
        // Parallel axis theorem with both half masses at +-offset.
        let inertia = (whole.inertia + c * c * whole.mass) * 0.5;
        let half = |com| RigidPart { mass: whole.mass / 2.0, com, inertia };
        [half(whole.com - offset), half(whole.com + offset)]
    };
    let halves = at(axis * (0.75 * spread).sqrt());
    if halves[0].check("a half").is_ok() || spread == 0.0 {
        return halves;
    }
    let S = Matrix3::identity() * (0.5 * whole.inertia.trace()) - whole.inertia;
    at(S * axis * (0.75 / spread).sqrt() / whole.mass)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beam::{Beam, BeamTheory};
    use crate::material::Material;
    use crate::section::Section;

    /// Truth: closed-form halves of a uniform beam.
    #[test]
    fn the_halves_of_a_uniform_bar_are_its_halves() {
        let bar = Section::Rectangle { width: 0.04, height: 0.06 }.bar(&Material::STEEL).unwrap();
        let beam = Beam::new(bar, BeamTheory::EulerBernoulli, 0.9).unwrap();
        let halves = halves_of_bar(&beam.piece(0.0, 1.0).unwrap(), &Vector3::x());
        for (half, truth) in halves.iter().zip([beam.piece(0.0, 0.5).unwrap(), beam.piece(0.5, 1.0).unwrap()]) {
            assert!((half.mass / truth.mass - 1.0).abs() < 1e-12);
            assert!((half.com - truth.com).norm() < 1e-12);
            assert!((half.inertia - truth.inertia).amax() < 1e-12 * truth.inertia.amax().max(1.0));
        }
    }

    /// Truth: the merged parts equal the whole.
    #[test]
    fn two_halves_make_the_body_again() {
        let whole = RigidPart {
            mass: 30.0,
            com: Vector3::new(0.1, -0.2, 0.5),
            inertia: Matrix3::new(2.0, 0.1, -0.2, 0.1, 2.2, 0.05, -0.2, 0.05, 0.6),
        };
        let [a, b] = halves_of_bar(&whole, &Vector3::new(0.1, 0.05, 1.0));
        let again = a.merged(&b);
        assert!((again.inertia - whole.inertia).amax() < 1e-13 && (again.com - whole.com).norm() < 1e-14);
        a.check("a half").unwrap();
    }

    /// Truth: points on a bow; halves of a straight bar along its chord would need an impossible
    /// inertia.
    #[test]
    fn a_bowed_body_has_halves_too() {
        let points: Vec<Vector3<f64>> =
            (0..50).map(|k| k as f64 / 49.0).map(|x| Vector3::new(x, 0.3 * x * x, 0.01 * (41.0 * x).sin())).collect();
        let com = points.iter().sum::<Vector3<f64>>() / 50.0;
        let S: Matrix3<f64> = points.iter().map(|p| (p - com) * (p - com).transpose() / 5.0).sum();
        let whole = RigidPart { mass: 10.0, com, inertia: Matrix3::identity() * S.trace() - S };
        whole.check("the bow").unwrap();
        let [a, b] = halves_of_bar(&whole, &Vector3::x());
        a.check("a half").unwrap();
        let again = a.merged(&b);
        assert!((again.inertia - whole.inertia).amax() < 1e-13 && (again.com - whole.com).norm() < 1e-14);
        let truth = points[25..].iter().sum::<Vector3<f64>>() / 25.0;
        assert!((b.com - truth).norm() < 0.03, "{} instead of {truth}", b.com); // not an ellipsoid
    }

    /// Second algorithm: 12x12 and mass of a beam, through the route of imported matrices.
    #[test]
    fn a_beam_as_matrices_gives_the_beam_as_a_link() {
        let bar = Section::Rectangle { width: 0.04, height: 0.06 }.bar(&Material::STEEL).unwrap();
        let beam = Beam::new(bar, BeamTheory::Timoshenko, 0.9).unwrap();
        let frame =
            |name: &str, x| InterfaceFrame { name: name.into(), X_LI: Pose::translation(x, 0.0, 0.0), tie: None };
        let element = Superelement {
            interfaces: vec![frame("A", 0.0), frame("B", 0.9)],
            K: DMatrix::from_column_slice(12, 12, beam.stiffness12().as_slice()),
            M: DMatrix::from_column_slice(12, 12, beam.mass12().as_slice()),
        };
        let plan = MatrixPlan {
            name: "beam".into(),
            masses: PartMasses::FromMatrix,
            split: SplitAt::ElasticCentre,
            limits: GateLimits::default(),
            provenance: Provenance::default(),
        };
        let result = link_from_superelement(element.clone(), true, &plan).unwrap();
        assert!((result.link.K_BB - beam.tip_stiffness()).amax() < 1e-9 * beam.tip_stiffness().amax());
        assert!((result.link.split.X_LS.translation.vector - Vector3::new(0.45, 0.0, 0.0)).norm() < 1e-9);
        let error = result.whole.mass / beam.piece(0.0, 1.0).unwrap().mass - 1.0;
        assert!(error.abs() < 1e-12, "{error:.1e}");

        let without = link_from_superelement(element, false, &plan).unwrap_err().to_string();
        assert!(without.contains("mass is missing"), "{without}");
    }
}
