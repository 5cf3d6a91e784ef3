//! Sag of the forearm under its own weight, part by part: chain compared with mesh.
//!
//! Under a unit force at B the mesh moves by `U`, and by reciprocity the sag of B is the sum of
//! weight times `U`; the parts of a chain move rigidly. The difference is summed over the nodes of
//! each part.

use flexarm::Robot;
use flexarm_fem::chain::Chain;
use flexarm_fem::element::Quadrature;
use flexarm_fem::reduction::Tie;
use flexarm_fem::{Material, UnitSystem};
use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

use crate::Error;
use crate::bench::Bench;
use crate::meshed::Meshed;

const DUCTILE_IRON: Material = Material { E: 169e9, nu: 0.275, rho: 7100.0, G: None };
const MESH: &str = "robots/kr210/fe/link_3.msh.gz";
const LINK: &str = "link_3";
/// Number of parts of the chain that is analysed part by part.
pub(super) const PARTS: usize = 8;

/// Sag along an axis under gravity along it; relative differences of chains from the mesh.
pub(super) struct AxisSag {
    /// One per chain.
    pub(super) chains: Vec<f64>,
    /// Contribution of each part of the chain of [`PARTS`] parts, from A to B.
    pub(super) by_part: Vec<f64>,
}

/// Findings on the forearm.
pub(super) struct Forearm {
    /// Numbers of parts of the chains.
    pub(super) counts: Vec<usize>,
    /// Along x, y, z.
    pub(super) axes: [AxisSag; 3],
}

impl Forearm {
    /// Returns `None` if the robot has no such link.
    pub(super) fn new(bench: &Bench, robot: &Robot) -> Result<Option<Self>, Error> {
        let fe = Meshed::read_with(bench, MESH, UnitSystem::SI, DUCTILE_IRON, Quadrature::Exact)?;
        let Some(link) = robot.flexible_links.iter().map(|l| &l.flexible.reduced).find(|r| r.name == LINK) else {
            return Ok(None);
        };
        let (A, B) = (link.X_LA.translation.vector, link.X_LB.translation.vector);
        let condensation = fe.condense(&[fe.interface("A", A, Tie::Rigid)?, fe.interface("B", B, Tie::Rigid)?])?;
        let U = condensation.unit_load_shapes();
        let weights = fe.model.M.product(&fe.model.rigid_modes(&Vector3::zeros()).columns(0, 3).into_owned());
        let casting = Casting { fe: &fe, U: &U, weights: &weights, B, line: (B - A).normalize() };
        let chains = link.details.as_ref().map_or(&[][..], |details| &details.chains);
        let counts = chains.iter().map(|chain| chain.parts.len()).collect();
        Ok(Some(Self { counts, axes: [0, 1, 2].map(|axis| casting.sag(chains, axis)) }))
    }
}

/// The mesh with A held.
struct Casting<'a> {
    fe: &'a Meshed,
    /// Displacements under unit loads at B.
    U: &'a DMatrix<f64>,
    /// Mass of each degree of freedom along x, y, z (kg).
    weights: &'a DMatrix<f64>,
    B: Vector3<f64>,
    /// Direction from A to B.
    line: Vector3<f64>,
}

impl Casting<'_> {
    fn sag(&self, chains: &[Chain], axis: usize) -> AxisSag {
        let mut found = AxisSag { chains: Vec::new(), by_part: Vec::new() };
        for chain in chains {
            let (total, by_part) = self.chain_sag(chain, axis);
            found.chains.push(total);
            if chain.parts.len() == PARTS {
                found.by_part = by_part;
            }
        }
        found
    }

    /// Relative error of the sag of a chain, and the contribution of each part.
    fn chain_sag(&self, chain: &Chain, axis: usize) -> (f64, Vec<f64>) {
        let joints = Joint::under_force(chain, &self.B, &Vector3::ith(axis, 1.0));
        let mut lost = vec![0.0; chain.parts.len()];
        let (mut of_mesh, mut of_chain) = (0.0, 0.0);
        for (node, p) in self.fe.mesh.nodes.iter().enumerate() {
            let part = joints.iter().filter(|joint| (p - joint.p).dot(&self.line) > 0.0).count();
            let moved: Vector3<f64> = joints[..part].iter().map(|joint| joint.moves(p)).sum();
            for (k, dof) in self.fe.model.dofs.of(node).enumerate() {
                let (weight, U) = (self.weights[(dof, axis)], self.U[(dof, axis)]);
                of_mesh += weight * U;
                of_chain += weight * moved[k];
                lost[part] += weight * (moved[k] - U);
            }
        }
        (of_chain / of_mesh - 1.0, lost.iter().map(|l| l / of_mesh).collect())
    }
}

/// An elastic joint of a chain, deflected.
struct Joint {
    /// Position (m).
    p: Vector3<f64>,
    /// Deflection (m, rad).
    yields: Vector6<f64>,
}

impl Joint {
    /// Deflections of the joints of a chain under a force at B.
    fn under_force(chain: &Chain, B: &Vector3<f64>, force: &Vector3<f64>) -> Vec<Self> {
        let springs = chain.joints.iter().filter_map(|joint| {
            let C: Matrix6<f64> = joint.K_S.try_inverse()?;
            Some((joint.X_LS.translation.vector, C))
        });
        let yields = springs.map(|(p, C)| {
            let moment = (B - p).cross(force);
            Self { p, yields: C * Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z) }
        });
        yields.collect()
    }

    /// Displacement of a point beyond the joint (m).
    fn moves(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.yields.fixed_rows::<3>(0) + self.yields.fixed_rows::<3>(3).into_owned().cross(&(p - self.p))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth by hand: a joint at x = 1 that translates by 2 along y and rotates by 0.1 about z
    /// moves the point at x = 4 by 2.3 along y.
    #[test]
    fn a_joint_moves_what_lies_beyond_it_by_shift_and_lever() {
        let joint = Joint { p: Vector3::x(), yields: Vector6::new(0.0, 2.0, 0.0, 0.0, 0.0, 0.1) };
        let moved = joint.moves(&Vector3::new(4.0, 0.0, 0.0));
        assert!((moved - Vector3::new(0.0, 2.3, 0.0)).norm() < 1e-15, "{moved}");
    }
}
