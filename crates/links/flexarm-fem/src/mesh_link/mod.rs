//! Turns a mesh with named interfaces into a checked flexible link, in one call.
//!
//! ```text
//! mesh --assemble--> K, M --tie, factorise--> K_g, M_g, modes
//!   K_g, M_g, modes --> ReducedLink: K_BB, two parts, chains, modal link
//!                   --> MeshGate: checks, with numbers
//! ```
//! Start at [`reduce_mesh`]. Everything is in link axes and SI; a mesh in another frame is
//! transformed first ([`Mesh::transformed`]).
//!
//! Not here: files, clocks, pictures.

mod checks;
mod coherence;
mod error;
mod split;

use nalgebra::DMatrix;

use crate::chain::{Chain, ChainSource};
use crate::cut::mass_properties;
use crate::error::FemError;
use crate::frames::LinkFrames;
use crate::gate::GateLimits;
use crate::material::Material;
use crate::mesh::{Mesh, bodies};
use crate::mesh_gate::ElementQuality;
use crate::modal::ModalSource;
use crate::model::{AssemblyOptions, FeModel, materials};
use crate::order_check::check_order;
use crate::reduced::{LinkDetails, Provenance, ReducedLink};
use crate::reduction::{
    Condensation, CondensationOptions, Interface, InterfaceFrame, SolverFigures, Superelement, stiffness12,
};
use crate::rigid_part::RigidPart;
use crate::sparse::{Modes, ModesWanted};
use crate::stress::{INERTIA_LOADS, StressFields};
use checks::{gate, implausible};
use coherence::{check_connected, check_fit, suspicious, with_cause};
use flexarm_settings::Finding;
use split::{attach, split};

pub use checks::condensed_body;
pub use error::MeshLinkError;
pub use split::SplitAt;

pub(crate) use checks::rigid_motions_about;
pub(crate) use split::split_point;

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
    /// Whether to compute the stress at the nodes of the surface; 12 more solves and a pass over
    /// all elements.
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
    pub caveats: Vec<Finding>,
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

/// Reduces a mesh to a link.
///
/// * `mesh`: link axes, m.
/// * `plan`: interfaces, materials, modes and split; link axes, SI.
/// * `step`: called at the start of each step.
///
/// Returns the link with its superelement, chains, modal link and checks, link axes. Cost: one
/// sparse factorisation of the free DoF, and one solve per static shape, Lanczos vector and inertia
/// load.
///
/// # Errors
/// [`MeshLinkError`].
pub fn reduce_mesh(
    mesh: &Mesh,
    plan: &LinkPlan,
    step: &mut dyn FnMut(ReductionStep),
) -> Result<MeshReduction, MeshLinkError> {
    check_input(mesh, plan)?;
    let bodies = bodies(mesh);
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
    let mut caveats = suspicious(mesh, &bodies);
    let mut link = two_part_link(mesh, plan, &densities, &superelement, &mut caveats)?;

    // Chains and checks against the mesh; then the attached bodies.
    let bare_chains = bare_chains(mesh, plan, &model, &materials, &unit_loads)?;
    let mut gate = gate(&condensation, &superelement, &link, &whole, &fixed_modes, &held_modes, quality);
    gate.order = check_order(mesh, &plan.assembly, &plan.interfaces, &condensation, &unit_loads)?;
    let mut chains = bare_chains.clone();
    attach(&plan.attached, &mut link, &mut chains)?;
    caveats.extend(gate.findings());
    caveats.extend(implausible(mesh, &whole, &held_modes));
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
    caveats.extend(link.warnings(&plan.limits).into_iter().map(|said| Finding::warning("gate", "", said, "")));
    let inertia_solves = [plan.geometric, plan.stress].into_iter().filter(|wanted| *wanted).count() * INERTIA_LOADS;
    let solves = fixed_modes.solves + held_modes.solves + condensation.figures().static_solves + inertia_solves;
    let solver = condensation.figures();
    Ok(MeshReduction { link, whole, solver, unit_loads, fixed_modes, held_modes, bare_chains, solves, stress, caveats })
}

/// Checks the mesh and, before the expensive work, whether frames are in wrong units.
fn check_input(mesh: &Mesh, plan: &LinkPlan) -> Result<(), MeshLinkError> {
    check_connected(mesh)?;
    check_fit(mesh)?;
    if let [a, b, ..] = plan.interfaces.as_slice() {
        LinkFrames::new(a.X_LI, b.X_LI).check()?;
    }
    Ok(())
}

/// Returns the two-part link from the 12×12 stiffness of A and B.
fn two_part_link(
    mesh: &Mesh,
    plan: &LinkPlan,
    densities: &[f64],
    superelement: &Superelement,
    caveats: &mut Vec<Finding>,
) -> Result<ReducedLink, MeshLinkError> {
    let loose = FemError::Missing { what: "stiffness of the third interface", help: "it holds nothing" };
    let K12 = stiffness12(superelement).ok_or(loose)?;
    let frames = LinkFrames::new(plan.interfaces[0].X_LI, plan.interfaces[1].X_LI);
    let (frames, parts) = split(mesh, densities, frames, &K12, plan.split, caveats)?;
    Ok(ReducedLink::from_matrix12(&plan.name, frames, &K12, parts, plan.provenance.clone(), &plan.limits)?)
}

/// Returns the chains of the mesh without attached bodies.
///
/// * `U`: displacements under six unit wrenches at B.
fn bare_chains(
    mesh: &Mesh,
    plan: &LinkPlan,
    model: &FeModel,
    materials: &[Material],
    U: &DMatrix<f64>,
) -> Result<Vec<Chain>, MeshLinkError> {
    let [p_LA, p_LB] = [0, 1].map(|k| plan.interfaces[k].X_LI.translation.vector);
    let source = ChainSource { mesh, model, materials, quadrature: plan.assembly.quadrature, U, p_LA, p_LB };
    Ok(plan.chains.iter().map(|parts| source.chain(*parts)).collect::<Result<_, _>>()?)
}
