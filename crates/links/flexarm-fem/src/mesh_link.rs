//! Turns a mesh with named interfaces into a checked flexible link, in one call.
//!
//! ```text
//! mesh --assemble--> K, M --tie, factorise--> K_g, M_g, modes --+--> ReducedLink (K_BB, two parts, chains)
//!                                                               +--> MeshGate: checks, with numbers
//! ```
//! Start at [`reduce_mesh`]. Everything is in link axes and SI; a mesh in another frame is
//! transformed first ([`Mesh::transformed`]).
//!
//! Not here: files, clocks, pictures.

use flexarm_spatial::{Matrix12, Pose, symmetric_part};
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3};

use crate::chain::{Chain, ChainError, ChainSource, centre_of_compliance};
use crate::cut::{CutError, CutPlane, cut, mass_properties};
use crate::doubt::Doubt;
use crate::error::{Direction, FemError};
use crate::frames::LinkFrames;
use crate::gate::GateLimits;
use crate::mesh::{Bodies, Mesh, bodies, coincident};
use crate::mesh_gate::{ElementQuality, MeshGate, ModeCheck};
use crate::modal::ModalSource;
use crate::model::{AssemblyError, AssemblyOptions, FeModel, materials};
use crate::order_check::check_order;
use crate::reduced::{LinkDetails, Provenance, ReducedLink};
use crate::reduction::{
    Condensation, CondensationOptions, Interface, InterfaceFrame, ReductionError, SolverFigures, Superelement,
    spd_inverse, stiffness12, worst,
};
use crate::rigid_part::RigidPart;
use crate::sparse::{Modes, ModesError, ModesWanted};
use crate::stress::{INERTIA_LOADS, StressFields};

/// Position of the elastic joint of the two-part link.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SplitAt {
    /// At the centre of compliance of the link if a cut there has material on both sides, otherwise
    /// midway.
    #[default]
    ElasticCentre,
    /// Midway between A and B.
    MidLength,
    /// At a fraction of the distance from A to B.
    Fraction(f64),
    /// At a point, link axes, m.
    Point(Vector3<f64>),
}

/// Options for making a link from a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkPlan {
    /// Name of the link.
    pub name: String,
    /// Interfaces, proximal first, then distal, then any others.
    pub interfaces: Vec<Interface>,
    /// Materials and quadrature.
    pub assembly: AssemblyOptions,
    /// Order of elimination.
    pub condensation: CondensationOptions,
    /// Number of fixed-interface modes to keep; zero gives Guyan reduction.
    pub modes: ModesWanted,
    /// Position of the elastic joint.
    pub split: SplitAt,
    /// Numbers of parts of the chains to make.
    pub chains: Vec<usize>,
    /// Bodies attached to the link that are not in its mesh (motors, gears, cables), link axes.
    /// Each is rigidly attached to the interface on whose side of the split its centre of mass is;
    /// in a chain it is merged into the first or last part.
    pub attached: Vec<RigidPart>,
    /// Whether to compute the geometric stiffness of the modal link; 12 more solves and a pass over
    /// all elements.
    pub geometric: bool,
    /// Whether to compute the stress at the nodes of the surface; 12 more solves and a pass over all
    /// elements.
    pub stress: bool,
    /// Number of modes with A clamped against which the reduced models are checked.
    pub judged_modes: usize,
    /// Limits of the gate.
    pub limits: GateLimits,
    /// Provenance of the numbers.
    pub provenance: Provenance,
}

/// Link made from a mesh, with checks.
#[derive(Debug, Clone)]
pub struct MeshReduction {
    /// The link, with its superelement, modal link, chains and gate in [`ReducedLink::details`].
    pub link: ReducedLink,
    /// Mass properties of the whole mesh, link axes.
    pub whole: RigidPart,
    /// Figures of the linear algebra.
    pub solver: SolverFigures,
    /// Displacements of all DoF under six unit wrenches at B, A clamped; for pictures.
    pub unit_loads: DMatrix<f64>,
    /// Fixed-interface modes over all DoF; for pictures.
    pub fixed_modes: Modes,
    /// Modes with A clamped, over all DoF; for pictures.
    pub held_modes: Modes,
    /// Chains of the mesh without attached bodies; the chains of the link include them.
    pub bare_chains: Vec<Chain>,
    /// Total number of right-hand sides solved.
    pub solves: usize,
    /// Stress at the nodes of the surface, if requested.
    pub stress: Option<StressFields>,
    /// Warnings about accepted but suspicious input.
    pub doubts: Vec<Doubt>,
}

/// Errors of turning a mesh into a link.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshLinkError {
    /// Elements, materials or sections are invalid.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
    /// Ties or factorisation failed.
    #[error(transparent)]
    Reduction(#[from] ReductionError),
    /// The modes could not be computed.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// The parts could not be cut.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// A chain could not be made.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The gate rejected the result.
    #[error(transparent)]
    Gate(Box<FemError>),
    /// An interface is not supported by the mesh.
    #[error("interface {interface:?} can move without force while {first:?} is held ({direction}): {cause}")]
    FreeInterface {
        /// Name of the interface.
        interface: String,
        /// Name of the proximal interface.
        first: String,
        /// Free motion, link axes.
        direction: Direction,
        /// Probable cause, as far as the mesh shows it.
        cause: String,
    },
    /// Bodies of the mesh can rotate against each other.
    #[error("{source}; {cause}")]
    Hinge {
        /// Error of the reduction.
        source: ReductionError,
        /// Places where the bodies touch.
        cause: String,
    },
    /// Elements of different kinds do not fit at their common faces.
    #[error(
        "{count} pair(s) of elements meet without fitting: {list}; the faces gape or overlap; use one order of \
         elements, and wedges or one kind where tetrahedra meet bricks"
    )]
    Misfit {
        /// Number of pairs.
        count: usize,
        /// First pairs.
        list: String,
    },
    /// A split leaves no material on one side.
    #[error("the cut through the elastic joint at ({:.6}, {:.6}, {:.6}) m: {source}; choose another place for the split", p[0], p[1], p[2])]
    Split {
        /// Split point, link axes, m.
        p: [f64; 3],
        /// Cause.
        source: CutError,
    },
    /// Parts of the mesh are connected to no interface.
    #[error(
        "the mesh falls into {parts} parts that share no node: {list}; only one may remain; {}",
        if *coincident > 0 {
            format!("{coincident} pair(s) of nodes lie in one place: merge them (Coherence in Gmsh, or merge in the reduction)")
        } else {
            "no two of their nodes lie in one place: is a part there that does not belong to the link?".to_owned()
        }
    )]
    Unconnected {
        /// Number of parts.
        parts: usize,
        /// Sizes of the parts, with one node each.
        list: String,
        /// Number of pairs of coincident nodes.
        coincident: usize,
    },
}

impl From<FemError> for MeshLinkError {
    fn from(error: FemError) -> Self {
        Self::Gate(Box::new(error))
    }
}

/// Steps of a reduction, for progress displays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReductionStep {
    /// Computing and assembling element matrices.
    Assembly,
    /// Sparse Cholesky factorisation and static shapes.
    Factorisation,
    /// Fixed-interface modes, and modes with A clamped for the check.
    Modes,
    /// Parts, chains and checks.
    Parts,
}

impl ReductionStep {
    /// All steps, in order.
    pub const ALL: [Self; 4] = [Self::Assembly, Self::Factorisation, Self::Modes, Self::Parts];

    /// Name of the step.
    pub fn name(self) -> &'static str {
        match self {
            Self::Assembly => "assembly",
            Self::Factorisation => "factorisation and static shapes",
            Self::Modes => "modes, interfaces fixed and A held",
            Self::Parts => "parts and checks",
        }
    }
}

/// Reduces `mesh`, given in link axes, to a link.
///
/// * `step`: called at the start of each step.
///
/// # Errors
/// [`MeshLinkError`].
pub fn reduce_mesh(
    mesh: &Mesh,
    plan: &LinkPlan,
    step: &mut dyn FnMut(ReductionStep),
) -> Result<MeshReduction, MeshLinkError> {
    check_connected(mesh)?;
    check_fit(mesh)?;
    let bodies = bodies(mesh);
    // Frames in wrong units are rejected before the expensive work.
    if let [a, b, ..] = plan.interfaces.as_slice() {
        LinkFrames::new(a.X_LI, b.X_LI).check()?;
    }
    step(ReductionStep::Assembly);
    let quality = ElementQuality::of(mesh);
    let materials = materials(mesh, &plan.assembly)?;
    let model = FeModel::assemble(mesh, &plan.assembly)?;

    step(ReductionStep::Factorisation);
    let condensation = Condensation::new(&model, &plan.interfaces, plan.condensation)
        .map_err(|error| with_cause(error, plan, &bodies))?;
    let unit_loads = condensation.unit_load_shapes().columns(0, 6).into_owned();

    step(ReductionStep::Modes);
    let (fixed_modes, held_modes) = condensation.fixed_and_held_modes(plan.modes, plan.judged_modes)?;
    let frame = |i: &Interface| InterfaceFrame { name: i.name.clone(), X_LI: i.X_LI, tie: Some(i.tie) };
    let superelement = condensation.superelement(plan.interfaces.iter().map(frame).collect(), &fixed_modes);

    step(ReductionStep::Parts);
    let densities: Vec<f64> = materials.iter().map(|m| m.rho).collect();
    let whole = mass_properties(mesh, &densities)?;
    let (X_LA, X_LB) = (plan.interfaces[0].X_LI, plan.interfaces[1].X_LI);
    let mut doubts = suspicious(mesh, &bodies);
    let loose = FemError::Missing { what: "stiffness of the third interface", help: "it holds nothing" };
    // Two-part link from the 12×12 of A and B.
    let K12 = stiffness12(&superelement).ok_or(loose)?;
    let frames = LinkFrames::new(X_LA, X_LB);
    let (frames, parts) = split(mesh, &densities, frames, &K12, plan.split, &mut doubts)?;
    let mut link = ReducedLink::from_matrix12(&plan.name, frames, &K12, parts, plan.provenance.clone(), &plan.limits)?;

    // Chains and checks against the mesh; then the attached bodies.
    let source = ChainSource {
        mesh,
        model: &model,
        materials: &materials,
        quadrature: plan.assembly.quadrature,
        U: &unit_loads,
        p_LA: X_LA.translation.vector,
        p_LB: X_LB.translation.vector,
    };
    let chains = plan.chains.iter().map(|parts| source.chain(*parts)).collect::<Result<Vec<_>, _>>()?;
    let mut gate = gate(&condensation, &superelement, &link, &whole, &fixed_modes, &held_modes, quality);
    gate.order = check_order(mesh, &plan.assembly, &plan.interfaces, &condensation, &unit_loads)?;
    let bare_chains = chains.clone();
    let mut chains = chains;
    attach(&plan.attached, &mut link, &mut chains)?;
    doubts.extend(gate.doubts());
    doubts.extend(implausible(mesh, &whole, &held_modes));
    let modal = ModalSource {
        mesh,
        materials: &materials,
        quadrature: plan.assembly.quadrature,
        condensation: &condensation,
        interfaces: &plan.interfaces,
        fixed_modes: &fixed_modes,
        superelement: &superelement,
    };
    let stress = plan.stress.then(|| modal.stress_fields(&plan.name));
    let modal = modal.modal_link(&plan.name, plan.geometric);
    link.details = Some(Box::new(LinkDetails {
        superelement: Some(superelement),
        chains,
        attached: plan.attached.clone(),
        modal: Some(modal),
        gate: Some(gate),
    }));
    doubts.extend(link.warnings(&plan.limits).into_iter().map(|said| Doubt::from_message("gate", said)));
    let inertia_solves = [plan.geometric, plan.stress].into_iter().filter(|wanted| *wanted).count() * INERTIA_LOADS;
    let solves = fixed_modes.solves + held_modes.solves + condensation.figures().static_solves + inertia_solves;
    let solver = condensation.figures();
    Ok(MeshReduction { link, whole, solver, unit_loads, fixed_modes, held_modes, bare_chains, solves, stress, doubts })
}

/// Hint for removing a hinge.
const JOIN: &str = "connect bodies by whole faces (fragment or Coherence in Gmsh, a tie or merge elsewhere)";

/// Replaces a mechanism error by one with the interface name and the hinge that causes it.
fn with_cause(error: ReductionError, plan: &LinkPlan, bodies: &Bodies) -> MeshLinkError {
    let hinges = |with: Option<[usize; 2]>| -> Vec<String> {
        let between = |bodies: [usize; 2]| with.is_none_or(|with| bodies == with);
        bodies.hinges.iter().filter(|hinge| between(hinge.bodies)).take(4).map(ToString::to_string).collect()
    };
    match error {
        ReductionError::FreeInterface { interface, direction } if interface < plan.interfaces.len() => {
            let [first, free] = [0, interface].map(|k| body_of(&plan.interfaces[k], bodies));
            let direct = hinges(Some([first.min(free), first.max(free)]));
            let list = if direct.is_empty() { hinges(None) } else { direct };
            let cause = match list.is_empty() {
                true => {
                    "its nodes are connected to nothing that resists; are they on the part that is meant?".to_owned()
                }
                false => format!("{}; this is a hinge, which carries no moment: {JOIN}", list.join("; ")),
            };
            let name = |k: usize| plan.interfaces[k].name.clone();
            MeshLinkError::FreeInterface { interface: name(interface), first: name(0), direction, cause }
        }
        ReductionError::Loose { .. } if !bodies.hinges.is_empty() => {
            MeshLinkError::Hinge { source: error, cause: format!("{}: {JOIN}", hinges(None).join("; ")) }
        }
        other => other.into(),
    }
}

/// Body with the most nodes of an interface.
fn body_of(interface: &Interface, bodies: &Bodies) -> usize {
    let mut count = vec![0_usize; bodies.elements.len()];
    for node in &interface.nodes {
        if let Some(count) = count.get_mut(bodies.of_node[*node as usize]) {
            *count += 1;
        }
    }
    (0..count.len()).rev().max_by_key(|body| count[*body]).unwrap_or(0)
}

/// Warnings about cracks and hinges in a mesh that is connected.
fn suspicious(mesh: &Mesh, bodies: &Bodies) -> Vec<Doubt> {
    let mut doubts: Vec<Doubt> = bodies
        .hinges
        .iter()
        .take(3)
        .map(|hinge| format!("{hinge}: they turn against each other there; {JOIN} if they are one part"))
        .map(|said| Doubt::from_message("hinge", said))
        .collect();
    let found = coincident(mesh, mesh.coincidence());
    if let Some([first, _]) = found.pairs.first() {
        let p = mesh.nodes[*first as usize];
        let faces = if found.faces > 0 { format!(", {} faces lie on each other", found.faces) } else { String::new() };
        let said = format!(
            "{} pair(s) of nodes lie in one place without being one node{faces} (first: node {} at {:.6}, {:.6}, {:.6} m): a crack, which transmits no force; merge coincident nodes (Coherence in Gmsh, or merge in the reduction) if \
             the body is whole",
            found.pairs.len(),
            mesh.node_ids[*first as usize],
            p.x,
            p.y,
            p.z
        );
        doubts.push(Doubt::found("coincident-nodes", found.pairs.len() as f64, 0.0, said));
    }
    doubts
}

fn check_fit(mesh: &Mesh) -> Result<(), MeshLinkError> {
    let misfits = crate::mesh::misfits(mesh);
    if misfits.is_empty() {
        return Ok(());
    }
    let one = |m: &crate::mesh::Misfit| format!("{} and {} ({})", m.first, m.second, m.why);
    let mut list: Vec<String> = misfits.iter().take(5).map(one).collect();
    if misfits.len() > 5 {
        list.push("...".into());
    }
    Err(MeshLinkError::Misfit { count: misfits.len(), list: list.join(", ") })
}

fn check_connected(mesh: &Mesh) -> Result<(), MeshLinkError> {
    let parts = crate::mesh::connected_parts(mesh);
    if parts.len() < 2 {
        return Ok(());
    }
    let one = |part: &crate::mesh::Part| {
        let id = mesh.node_ids[part.node as usize];
        format!("{} elements with node {id}", part.elements)
    };
    let mut list: Vec<String> = parts.iter().take(6).map(one).collect();
    if parts.len() > 6 {
        list.push("...".into());
    }
    let coincident = coincident(mesh, mesh.coincidence()).pairs.len();
    Err(MeshLinkError::Unconnected { parts: parts.len(), list: list.join(", "), coincident })
}

/// Split frame and the two parts. The cut is through S, perpendicular to AB.
fn split(
    mesh: &Mesh,
    densities: &[f64],
    frames: LinkFrames,
    K12: &Matrix12,
    at: SplitAt,
    doubts: &mut Vec<Doubt>,
) -> Result<(LinkFrames, [RigidPart; 2]), MeshLinkError> {
    let normal = frames.p_AB();
    let parts = |point: Vector3<f64>| -> Result<[RigidPart; 2], CutError> {
        let mut parts = cut(mesh, densities, &[CutPlane { point, normal }])?.into_iter();
        match (parts.next(), parts.next()) {
            (Some(proximal), Some(distal)) => Ok([proximal, distal]),
            _ => Err(CutError::NoElements),
        }
    };
    let (p_LS, said) = split_point(&frames, K12, at, &|p| parts(p).is_ok());
    doubts.extend(said.map(|said| Doubt::from_message("split", said)));
    let parts = parts(p_LS).map_err(|source| MeshLinkError::Split { p: p_LS.into(), source })?;
    Ok((frames.with_split(Pose::translation(p_LS.x, p_LS.y, p_LS.z)), parts))
}

/// Merges attached bodies into the part of the interface on whose side of the split they are, so
/// that the two-part link, chains and modal links carry them alike.
fn attach(attached: &[RigidPart], link: &mut ReducedLink, chains: &mut [Chain]) -> Result<(), FemError> {
    let (along, p_LS) = (link.p_AB(), link.split.X_LS.translation.vector);
    for body in attached {
        body.check("an attached body")?;
        let is_beyond = (body.com - p_LS).dot(&along) > 0.0;
        let part = if is_beyond { &mut link.distal } else { &mut link.proximal };
        *part = part.merged(body);
        for chain in chains.iter_mut() {
            let end = if is_beyond { chain.parts.last_mut() } else { chain.parts.first_mut() };
            if let Some(end) = end {
                *end = end.merged(body);
            }
        }
    }
    Ok(())
}

/// Returns the split point, link axes, and a message if it is not the requested one.
///
/// * `possible`: whether a cut at a point leaves two parts.
pub(crate) fn split_point(
    frames: &LinkFrames,
    K12: &Matrix12,
    at: SplitAt,
    possible: &dyn Fn(Vector3<f64>) -> bool,
) -> (Vector3<f64>, Option<String>) {
    let (p_LA, p_LB, along) = (frames.X_LA.translation.vector, frames.X_LB.translation.vector, frames.p_AB());
    let middle = p_LA + along * 0.5;
    match at {
        SplitAt::MidLength => (middle, None),
        SplitAt::Fraction(fraction) => (p_LA + along * fraction, None),
        SplitAt::Point(point) => (point, None),
        SplitAt::ElasticCentre => {
            let K_BB = DMatrix::from_fn(6, 6, |i, j| K12[(6 + i, 6 + j)]);
            let C = spd_inverse(&K_BB).map(|C| symmetric_part(&Matrix6::from_column_slice(C.as_slice())));
            let centre = C.and_then(|C| centre_of_compliance(&C, &p_LB));
            let fraction = |p: &Vector3<f64>| (p - p_LA).dot(&along) / along.norm_squared();
            match centre.filter(|p| (0.1..=0.9).contains(&fraction(p)) && possible(*p)) {
                Some(centre) => (centre, None),
                None => {
                    let said = "the elastic centre lies outside the middle of the link; split at mid length";
                    (middle, Some(said.into()))
                }
            }
        }
    }
}

/// Computes the checks of a finished reduction.
fn gate(
    condensation: &Condensation<'_>,
    element: &Superelement,
    link: &ReducedLink,
    whole: &RigidPart,
    fixed: &Modes,
    held: &Modes,
    quality: ElementQuality,
) -> MeshGate {
    let from_matrix = condensed_body(element);
    let size = link.p_AB().norm().max(f64::MIN_POSITIVE);
    let inertia = |part: &RigidPart| part.spatial_inertia().fixed_view::<3, 3>(3, 3).into_owned();
    let scale = inertia(whole).diagonal().amax();

    let full = held.frequencies_hz();
    let reduced = element.frequencies_hz(&[0]);
    let guyan = element.guyan().frequencies_hz(&[0]);
    let lumped = Chain { joints: vec![link.split.clone()], parts: vec![link.proximal.clone(), link.distal.clone()] };
    let lumped = lumped.held_frequencies_hz();
    let rows = full.iter().enumerate().map(|(k, hz)| ModeCheck {
        mesh_hz: *hz,
        reduced_hz: reduced.get(k).copied(),
        guyan_hz: guyan.get(k).copied(),
        lumped_hz: lumped.get(k).copied(),
    });
    let free = element.frequencies_hz(&[]);
    let first_elastic = free.get(6).copied().unwrap_or(0.0);
    MeshGate {
        dofs: condensation.figures().dofs,
        asymmetry: condensation.asymmetry(),
        rigid_body_residual: worst([link.checks.rigid_body_residual.unwrap_or(0.0), rigid_residual(element)]),
        block_identity: link.checks.block_identity.unwrap_or(0.0),
        zero_modes: free.iter().take_while(|hz| **hz < 1e-3 * first_elastic).count(),
        mass_error: (from_matrix.mass / whole.mass - 1.0).abs(),
        com_error_m: (from_matrix.com - whole.com).norm(),
        inertia_error: (inertia(&from_matrix) - inertia(whole)).amax() / scale.max(whole.mass * size * size * 1e-6),
        condition: condensation.condition_estimate(),
        mode_residual: worst(condensation.mode_residuals(fixed).into_iter().chain(condensation.mode_residuals(held))),
        fixed_frequencies_hz: fixed.frequencies_hz(),
        modes: rows.collect(),
        quality,
        order: None,
    }
}

/// Maximum relative force under the six rigid motions of all interfaces.
fn rigid_residual(element: &Superelement) -> f64 {
    let n = element.boundary();
    let R = rigid_motions(element);
    let s = element.K.diagonal().map(|k| k.max(0.0).sqrt());
    let mut largest = 0.0_f64;
    for m in 0..6 {
        let size: f64 = (0..n).map(|k| s[k] * R[(k, m)].abs()).sum();
        for i in 0..n {
            let force: f64 = (0..n).map(|k| element.K[(i, k)] * R[(k, m)]).sum();
            largest = worst([largest, force.abs() / (s[i] * size)]);
        }
    }
    largest
}

/// Rigid motions of the interfaces about the midpoint of the first two.
fn rigid_motions(element: &Superelement) -> DMatrix<f64> {
    let p = |k: usize| element.interfaces[k].X_LI.translation.vector;
    rigid_motions_about(element, &((p(0) + p(1)) / 2.0))
}

pub(crate) fn rigid_motions_about(element: &Superelement, point: &Vector3<f64>) -> DMatrix<f64> {
    let mut R = DMatrix::zeros(element.boundary(), 6);
    for (k, interface) in element.interfaces.iter().enumerate() {
        let turn = -(interface.X_LI.translation.vector - point).cross_matrix();
        R.view_mut((6 * k, 0), (3, 3)).copy_from(&Matrix3::identity());
        R.view_mut((6 * k, 3), (3, 3)).copy_from(&turn);
        R.view_mut((6 * k + 3, 3), (3, 3)).copy_from(&Matrix3::identity());
    }
    R
}

/// Mass, centre of mass and inertia of the reduced mass matrix: `Rᵀ M R` about the link origin.
pub fn condensed_body(element: &Superelement) -> RigidPart {
    let n = element.boundary();
    let R = rigid_motions_about(element, &Vector3::zeros());
    let M = R.transpose() * element.M.view((0, 0), (n, n)) * &R;
    let mass = (M[(0, 0)] + M[(1, 1)] + M[(2, 2)]) / 3.0;
    // The coupling block is -m[c]x.
    let com = Vector3::new(M[(1, 5)] - M[(2, 4)], M[(2, 3)] - M[(0, 5)], M[(0, 4)] - M[(1, 3)]) / (2.0 * mass);
    let c = com.cross_matrix();
    let inertia = M.fixed_view::<3, 3>(3, 3) + c * c * mass;
    RigidPart { mass, com, inertia: (inertia + inertia.transpose()) * 0.5 }
}

/// Warnings about a size, mass or frequency that is implausible for a robot link, usually wrong
/// units.
fn implausible(mesh: &Mesh, whole: &RigidPart, held: &Modes) -> Vec<Doubt> {
    let size = mesh.bounding_box().map_or(0.0, |(low, high)| (high - low).amax());
    let first = held.frequencies_hz().first().copied();
    let mut doubts = Vec::new();
    let mut see = |what: &str, value: f64, unit: &str, low: f64, high: f64, slip: &str| {
        if !(low..=high).contains(&value) {
            let said = format!(
                "{what} is {value:.3e} {unit}; links of robots lie between {low:.0e} and {high:.0e}: are the units those declared?{slip}"
            );
            doubts.push(Doubt::found("size", value, if value < low { low } else { high }, said));
        }
    };
    let of_length = if (1e-2..=2e1).contains(&(size * 1e-3)) {
        " With mm for m it would be a thousandth."
    } else if (1e-2..=2e1).contains(&(size * 1e3)) {
        " With m for mm it would be a thousand times as large."
    } else {
        ""
    };
    see("the largest dimension", size, "m", 1e-2, 2e1, of_length);
    see("the mass", whole.mass, "kg", 1e-3, 1e4, "");
    let volume_density = whole.mass / size.powi(3).max(f64::MIN_POSITIVE);
    see("the mass over the cube of the largest dimension", volume_density, "kg/m3", 1e-1, 2.5e4, "");
    if let Some(first) = first {
        see("the first frequency with A held", first, "Hz", 1e0, 5e4, "");
    }
    doubts
}
