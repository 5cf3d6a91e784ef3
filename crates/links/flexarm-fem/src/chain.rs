//! A link as n rigid parts in series with n - 1 elastic joints, exact for every end wrench.
//!
//! With A clamped and B loaded, the energy of the link is `½ F_Bᵀ C_BB F_B`. On the mesh this
//! energy is a sum of 6×6 matrices over the elements:
//!
//! ```text
//! C_BB = Σ_e U_eᵀ K_e U_e,       U: displacements under the six unit wrenches at B
//! E_k  = share of the elements between two planes,   Σ_k E_k = C_BB
//! C_k  = Ad_{SB} E_k Ad_{SB}ᵀ,   K_k = C_k⁻¹         joint k, at S_k
//! ```
//! so the joints add up to the whole link for any planes and any mesh; for a uniform beam `C_k` is
//! the closed form of its slice. No cross section is made rigid. Reducing each segment as its own
//! superelement with rigidly tied sections does not add up: it is wrong by several per cent
//! (`segments_as_superelements_of_their_own_do_not_add_up_to_the_link` in the tests of the
//! reduction).
//!
//! The energy of an element that a plane cuts is shared between both sides by volume. The parts are
//! cut at the joints, so each joint is in the middle of the material that it replaces.
//!
//! Source: Castigliano's theorem for `C_BB`; sharing by energy is our own.
//!
//! Start at `ChainSource::chain`. Link axes; compliances in m/N to rad/(N·m). Not here: chains of
//! a beam in closed form (`beam_chain`), the volume of cut elements ([`cut`](crate::cut())).

use flexarm_spatial::{Pose, adjoint, skew, symmetric_part};
use nalgebra::{DMatrix, Matrix3, Matrix6, SMatrix, Vector3, Vector6};

use crate::cut::{CutError, CutPlane, cut, volume_fractions};
use crate::element::{ElementWorkspace, Quadrature};
use crate::material::Material;
use crate::mesh::Mesh;
use crate::model::FeModel;
use crate::reduced::ElasticSplit;
use crate::reduction::generalised_frequencies;
use crate::rigid_part::RigidPart;

/// 6×6 matrix with one row and one column per unit wrench at B.
type Loads = SMatrix<f64, 6, 6>;

/// Chain of n rigid parts and n - 1 elastic joints, from A to B.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Joints, proximal first; poses in the link frame, stiffness in the axes of the joint.
    pub joints: Vec<ElasticSplit>,
    /// Parts, proximal first; one more than there are joints.
    pub parts: Vec<RigidPart>,
}

/// Errors of building a chain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChainError {
    /// Fewer than two parts were requested.
    #[error("a chain needs at least two parts, not {parts}")]
    TooFewParts {
        /// Requested number of parts.
        parts: usize,
    },
    /// A slice does not contain enough material for an elastic joint.
    #[error(
        "between {from:.4} and {to:.4} of the way from A to B there is too little material for an \
         elastic joint (its compliance is singular); ask for fewer parts, {parts} are too many"
    )]
    EmptySlice {
        /// Start of the slice, as a fraction of AB.
        from: f64,
        /// End of the slice, as a fraction of AB.
        to: f64,
        /// Requested number of parts.
        parts: usize,
    },
    /// The parts could not be cut.
    #[error(transparent)]
    Cut(#[from] CutError),
}

/// Distributes the elastic energy of the unit loads at B over the slices of the link.
///
/// * `U`: displacements of all DoF under the six unit wrenches at B, A clamped.
/// * `planes`: n - 1 planes between the n slices, from A to B.
///
/// Returns one 6×6 compliance per slice (m/N, m/(N·m); rad/N, rad/(N·m)), at Bo, link axes; their
/// sum is `C_BB`. Invalid elements, which the assembly rejects, are left out.
///
/// # Panics
/// If `U` has fewer than six columns, or fewer rows than the model has DoF.
pub fn energy_by_slice(
    mesh: &Mesh,
    model: &FeModel,
    materials: &[Material],
    quadrature: Quadrature,
    U: &DMatrix<f64>,
    planes: &[CutPlane],
) -> Vec<Loads> {
    let mut slices = vec![Loads::zeros(); planes.len() + 1];
    let mut workspace = ElementWorkspace::new();
    for block in &mesh.blocks {
        let per_node = if block.kind.is_beam() { 6 } else { 3 };
        for nodes in block.elements() {
            let x: Vec<_> = nodes.iter().map(|node| mesh.nodes[*node as usize]).collect();
            let size = per_node * nodes.len();
            // u_e: displacements of the element's nodes under each unit load.
            let u_e = DMatrix::from_fn(size, 6, |i, j| {
                U[(model.dofs.of(nodes[i / per_node] as usize).start + i % per_node, j)]
            });
            let material = &materials[block.region];
            let K_e = if block.kind.is_beam() {
                crate::model::beam_stiffness(mesh, block.region, nodes, material)
            } else {
                workspace
                    .stiffness_and_mass(block.kind, &x, material, quadrature)
                    .ok()
                    .map(|()| DMatrix::from_column_slice(size, size, workspace.stiffness()))
            };
            let Some(K_e) = K_e else { continue };
            // Energy of pairs of unit loads, u_eᵀ K_e u_e, shared among the slices by volume.
            let energy = u_e.transpose() * K_e * &u_e;
            let energy = Loads::from_fn(|i, j| energy[(i, j)]);
            // Inverted elements were rejected when the model was assembled.
            let Ok(shares) = volume_fractions(block.kind, &x, planes) else { continue };
            for (slice, share) in slices.iter_mut().zip(shares) {
                *slice += energy * share;
            }
        }
    }
    slices.iter().map(symmetric_part).collect()
}

/// Centre of compliance S: the point where the coupling block is symmetric, so that coupling is
/// minimal. For a straight uniform beam this is its middle.
///
/// ```text
/// C_tr(S) = C_tr(B) - [p_BS]x C_rr,   skew part of C_tr(S) = 0:   three equations for S
/// ```
/// * `C_BB`: 6×6 compliance at Bo (m/N, m/(N·m); rad/N, rad/(N·m)), link axes.
/// * `p_LB`: position of Bo, link axes, m.
///
/// Returns `p_LS`, link axes, m; `None` if the rotational block is singular.
///
/// Source: [Lončarić 1987].
pub(crate) fn centre_of_compliance(C_BB: &Matrix6<f64>, p_LB: &Vector3<f64>) -> Option<Vector3<f64>> {
    let C_tr = C_BB.fixed_view::<3, 3>(0, 3).into_owned();
    let C_rr = C_BB.fixed_view::<3, 3>(3, 3).into_owned();
    // u_S = u_B + θ × p_BS = u_B - [p]x θ, so C_tr(S) = C_tr - [p]x C_rr. Twice the axial vector of
    // [p]x C_rr is (tr(C_rr) 1 - C_rr) p.
    let axial = |A: &Matrix3<f64>| Vector3::new(A[(2, 1)] - A[(1, 2)], A[(0, 2)] - A[(2, 0)], A[(1, 0)] - A[(0, 1)]);
    let matrix = Matrix3::identity() * C_rr.trace() - C_rr;
    matrix.try_inverse().map(|inverse| p_LB + inverse * axial(&C_tr))
}

/// Inputs for cutting a mesh into a chain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChainSource<'a> {
    /// Mesh, link axes.
    pub mesh: &'a Mesh,
    /// FE model of the mesh.
    pub model: &'a FeModel,
    /// Material of each region.
    pub materials: &'a [Material],
    /// Quadrature used for the model.
    pub quadrature: Quadrature,
    /// Displacements under the six unit wrenches at B, A clamped.
    pub U: &'a DMatrix<f64>,
    /// Origin of A, link axes, m.
    pub p_LA: Vector3<f64>,
    /// Origin of B, link axes, m.
    pub p_LB: Vector3<f64>,
}

impl ChainSource<'_> {
    /// Plane across AB at a fraction of the way from A to B.
    fn plane(&self, fraction: f64) -> CutPlane {
        let normal = self.p_LB - self.p_LA;
        CutPlane { point: self.p_LA + normal * fraction, normal }
    }

    /// Position of a point along AB, as a fraction.
    fn fraction(&self, p_L: &Vector3<f64>) -> f64 {
        let p_AB = self.p_LB - self.p_LA;
        (p_L - self.p_LA).dot(&p_AB) / p_AB.norm_squared()
    }

    /// Splits the mesh into a chain.
    ///
    /// * `parts`: number of rigid parts, 2 or more.
    ///
    /// Returns `parts - 1` joints, one per slice of AB of equal length, and the parts between cuts
    /// through the joints.
    ///
    /// # Errors
    /// [`ChainError`].
    pub(crate) fn chain(&self, parts: usize) -> Result<Chain, ChainError> {
        if parts < 2 {
            return Err(ChainError::TooFewParts { parts });
        }
        // E: share of C_BB of each slice, at Bo.
        let slices = parts - 1;
        let bound = |k: usize| k as f64 / slices as f64;
        let between: Vec<CutPlane> = (1..slices).map(|k| self.plane(bound(k))).collect();
        let energies = energy_by_slice(self.mesh, self.model, self.materials, self.quadrature, self.U, &between);

        let (mut joints, mut cuts) = (Vec::new(), Vec::new());
        for (k, E) in energies.iter().enumerate() {
            let (from, to) = (bound(k), bound(k + 1));
            let empty = || ChainError::EmptySlice { from, to, parts };
            // Centre of compliance of the slice, or its middle if a bent link puts the centre
            // outside.
            let middle = self.plane((from + to) / 2.0).point;
            let centre = centre_of_compliance(E, &self.p_LB).filter(|p| {
                let t = self.fraction(p);
                t > from && t < to
            });
            let p_LS = centre.unwrap_or(middle);
            let X_LS = Pose::translation(p_LS.x, p_LS.y, p_LS.z);
            // C_S = Ad_SB E Ad_SBᵀ, S in link axes; then K_S = C_S⁻¹ on a unit diagonal.
            let p_SB = self.p_LB - p_LS;
            let Ad_SB = adjoint(&Pose::translation(p_SB.x, p_SB.y, p_SB.z));
            let C_S = symmetric_part(&(Ad_SB * E * Ad_SB.transpose()));
            let scale = C_S.diagonal().map(|c| 1.0 / c.sqrt());
            let scaled = C_S.component_mul(&(scale * scale.transpose()));
            let inverse = scaled.cholesky().filter(|f| f.l().diagonal().min() > 1e-6).ok_or_else(empty)?.inverse();
            let K_S = symmetric_part(&inverse.component_mul(&(scale * scale.transpose())));
            joints.push(ElasticSplit { X_LS, K_S });
            cuts.push(self.plane(self.fraction(&p_LS)));
        }
        let densities: Vec<f64> = self.materials.iter().map(|m| m.rho).collect();
        Ok(Chain { joints, parts: cut(self.mesh, &densities, &cuts)? })
    }
}

impl Chain {
    /// Maps from joint displacements `d_k` at `S_k` to displacement twists at Lo, link axes: part i
    /// moves by `Σ_{k<i} Ad_{LS_k} d_k`. Returns one `Ad_LS` per joint.
    fn carries(&self) -> Vec<Matrix6<f64>> {
        self.joints.iter().map(|joint| adjoint(&joint.X_LS)).collect()
    }

    /// Compliance at B with A clamped: the sum over the joints.
    ///
    /// ```text
    /// C_BB = Σ_k Ad_BS K_S⁻¹ Ad_BSᵀ
    /// ```
    /// * `p_LB`: position of Bo, link axes, m.
    ///
    /// Returns `C_BB`, 6×6 (m/N, m/(N·m); rad/N, rad/(N·m)), at Bo, link axes; `None` if a `K_S` is
    /// not positive definite.
    pub fn tip_compliance(&self, p_LB: &Vector3<f64>) -> Option<Matrix6<f64>> {
        let mut C_BB = Matrix6::zeros();
        for joint in &self.joints {
            let X_BS = Pose::translation(-p_LB.x, -p_LB.y, -p_LB.z) * joint.X_LS;
            let Ad_BS = adjoint(&X_BS);
            let K_S = DMatrix::from_column_slice(6, 6, joint.K_S.as_slice());
            let C_S = crate::reduction::spd_inverse(&K_S)?;
            C_BB += Ad_BS * Matrix6::from_column_slice(C_S.as_slice()) * Ad_BS.transpose();
        }
        Some(C_BB)
    }

    /// Stiffness and mass over the joint displacements, six per joint in its axes, A clamped.
    ///
    /// ```text
    /// K = blkdiag(K_S),   M_kl = Ad_LS_kᵀ (Σ M_iLo_L of the parts beyond both joints) Ad_LS_l
    /// ```
    pub(crate) fn held_matrices(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let (n, carries) = (6 * self.joints.len(), self.carries());
        let (mut K, mut M) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        for (k, joint) in self.joints.iter().enumerate() {
            K.view_mut((6 * k, 6 * k), (6, 6)).copy_from(&joint.K_S);
        }
        for (k, Ad_LSk) in carries.iter().enumerate() {
            for (l, Ad_LSl) in carries.iter().enumerate() {
                // The parts beyond the farther joint are moved by both joints.
                let beyond = self.parts.iter().skip(k.max(l) + 1);
                let M_Lo: Matrix6<f64> = beyond.map(RigidPart::spatial_inertia).sum();
                M.view_mut((6 * k, 6 * l), (6, 6)).copy_from(&(Ad_LSk.transpose() * M_Lo * Ad_LSl));
            }
        }
        (K, M)
    }

    /// Natural frequencies with A clamped, Hz, ascending, six per joint.
    ///
    /// Empty if the mass of the parts is not positive definite.
    pub fn held_frequencies_hz(&self) -> Vec<f64> {
        let (K, M) = self.held_matrices();
        generalised_frequencies(&K, &M)
    }

    /// Static deflection of B under the weight of the link, A clamped.
    ///
    /// ```text
    /// u_B = Σ_k Ad_BS K_S⁻¹ Ad_LSᵀ F_Lo      F_Lo: weight of the parts beyond joint k
    /// ```
    /// * `p_LB`: position of Bo, link axes, m.
    /// * `gravity`: m/s², link axes.
    ///
    /// Returns displacement and rotation of B (m, rad) at Bo, link axes; `None` if a `K_S` is not
    /// positive definite.
    pub fn sag(&self, p_LB: &Vector3<f64>, gravity: &Vector3<f64>) -> Option<Vector6<f64>> {
        let mut u_B = Vector6::zeros();
        for (k, joint) in self.joints.iter().enumerate() {
            let Ad_LS = adjoint(&joint.X_LS);
            let mut F_Lo = Vector6::zeros();
            for part in self.parts.iter().skip(k + 1) {
                let f = gravity * part.mass;
                let t = skew(&part.com) * f;
                F_Lo += Vector6::new(f.x, f.y, f.z, t.x, t.y, t.z);
            }
            let K_S = DMatrix::from_column_slice(6, 6, joint.K_S.as_slice());
            let C_S = Matrix6::from_column_slice(crate::reduction::spd_inverse(&K_S)?.as_slice());
            // Displacement of the joint, then of B by the joint.
            let d_S = C_S * (Ad_LS.transpose() * F_Lo);
            u_B += adjoint(&(Pose::translation(-p_LB.x, -p_LB.y, -p_LB.z) * joint.X_LS)) * d_S;
        }
        Some(u_B)
    }
}
