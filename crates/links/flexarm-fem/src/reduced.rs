//! The reduced link: complete static description of a link with two interfaces, by a 6×6 stiffness
//! and two rigid parts.
//!
//! ```text
//! F_B = K_BB u_B        wrench and displacement at Bo, link axes, A held
//! K_AA = Adᵀ K_BB Ad,   K_AB = -Adᵀ K_BB,   Ad = Ad_BA
//! K_S = Ad_BSᵀ K_BB Ad_BS
//! ```
//! A 12×12 of an FE program therefore holds no more information than its `K_BB`. The elastic joint
//! at the split frame S gives B exactly the displacement of the FE model under any wrench at B, for
//! any position of S. The two parts are rigid, so sag under distributed weight and frequencies are
//! approximate.
//!
//! Start at [`ReducedLink::from_matrix12`] and [`ReducedLink::from_matrix6`]; beams come from
//! [`BeamLink`](crate::BeamLink), files from [`read_flex`](crate::read_flex).
//!
//! More than two interfaces, modes and chains of parts are in [`LinkDetails`]. Not here: the
//! reduction of meshes ([`crate::mesh_link`]).

use flexarm_spatial::{Matrix12, Pose, adjoint, symmetric_part};
use nalgebra::{Matrix6, Vector3};

use crate::chain::Chain;
use crate::error::FemError;
use crate::frames::LinkFrames;
use crate::gate::{GateLimits, GateReport, check_matrix6, check_matrix12, lever};
use crate::mesh_gate::MeshGate;
use crate::modal::ModalLink;
use crate::reduction::Superelement;
use crate::rigid_part::RigidPart;

/// Elastic joint between the two parts of a link.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticSplit {
    /// Split frame in the link frame.
    pub X_LS: Pose,
    /// Stiffness of the joint at So, in S axes, (N/m, N/rad; N·m/m, N·m/rad).
    pub K_S: Matrix6<f64>,
}

/// Provenance of the numbers of a link; free text except for `method`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Provenance {
    /// Program, drawing or data set.
    pub source: String,
    /// Method for the stiffness: "guyan", "beam timoshenko", ...
    pub method: String,
    /// Tie of the interfaces: "rigid", "distributing", ...
    pub tie: String,
    /// Units of the source before conversion.
    pub units: String,
    /// Date of the calculation, ISO 8601.
    pub date: String,
    /// Other remarks.
    pub note: String,
}

/// Data beyond the static 6×6, from the reduction of a mesh or a matrix with mass.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinkDetails {
    /// Stiffness and mass over all interfaces and modes, link axes.
    pub superelement: Option<Superelement>,
    /// Chains of rigid parts with different numbers of parts.
    pub chains: Vec<Chain>,
    /// Bodies attached to the link (motors, gears): included in the two parts and in the chains,
    /// but not in the superelement, whose mass is that of the mesh.
    pub attached: Vec<RigidPart>,
    /// Shapes and mass integrals of the mesh in the frame at A, without attached bodies.
    pub modal: Option<ModalLink>,
    /// Checks against the mesh.
    pub gate: Option<MeshGate>,
}

/// Reduced link with two interfaces, the common result of all sources. SI units.
///
/// The constructors check the data; afterwards it is plain data.
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedLink {
    /// Name of the link.
    pub name: String,
    /// Proximal interface A in the link frame.
    pub X_LA: Pose,
    /// Distal interface B in the link frame.
    pub X_LB: Pose,
    /// Stiffness at Bo with A clamped, link axes, exactly symmetric.
    pub K_BB: Matrix6<f64>,
    /// The same stiffness as an elastic joint at the split frame.
    pub split: ElasticSplit,
    /// Rigid part on the side of A.
    pub proximal: RigidPart,
    /// Rigid part on the side of B.
    pub distal: RigidPart,
    /// Provenance of the numbers.
    pub provenance: Provenance,
    /// Measures of the gate on the source matrix.
    pub checks: GateReport,
    /// Superelement, chains and checks of a mesh, if the source has them.
    pub details: Option<Box<LinkDetails>>,
}

impl ReducedLink {
    /// Creates a link from the 12×12 stiffness of its two interfaces, A then B, both in *link
    /// axes*.
    ///
    /// * `K`: `F = K [u_A; u_B]`, (N/m, N/rad; N·m/m, N·m/rad), at Ao and Bo.
    /// * `parts`: proximal and distal rigid part.
    ///
    /// # Errors
    /// Errors of [`check_matrix12`] (not symmetric, resists rigid motion, singular, ...),
    /// [`FemError::OutOfRange`] for frames, and errors of [`RigidPart::check`].
    pub fn from_matrix12(
        name: impl Into<String>,
        frames: LinkFrames,
        K: &Matrix12,
        parts: [RigidPart; 2],
        provenance: Provenance,
        limits: &GateLimits,
    ) -> Result<Self, FemError> {
        frames.check()?;
        let (K_BB, checks) = check_matrix12(K, &frames.p_AB(), limits)?;
        Self::assemble(name.into(), frames, K_BB, checks, parts, provenance)
    }

    /// Creates a link from the 6×6 stiffness at Bo with A clamped, in *link axes*.
    ///
    /// Fewer checks are possible than for a 12×12: symmetry and positive definiteness.
    ///
    /// # Errors
    /// As [`Self::from_matrix12`].
    pub fn from_matrix6(
        name: impl Into<String>,
        frames: LinkFrames,
        K_BB: &Matrix6<f64>,
        parts: [RigidPart; 2],
        provenance: Provenance,
        limits: &GateLimits,
    ) -> Result<Self, FemError> {
        frames.check()?;
        let (K_BB, checks) = check_matrix6("K_BB", K_BB, limits)?;
        Self::assemble(name.into(), frames, K_BB, checks, parts, provenance)
    }

    /// Checks the parts and places the elastic joint.
    fn assemble(
        name: String,
        frames: LinkFrames,
        K_BB: Matrix6<f64>,
        checks: GateReport,
        [proximal, distal]: [RigidPart; 2],
        provenance: Provenance,
    ) -> Result<Self, FemError> {
        proximal.check("the proximal part")?;
        distal.check("the distal part")?;
        let (proximal, distal) = (proximal.symmetrised(), distal.symmetrised());
        let split = elastic_split(&frames, &K_BB)?;
        let LinkFrames { X_LA, X_LB, .. } = frames;
        Ok(Self { name, X_LA, X_LB, K_BB, split, proximal, distal, provenance, checks, details: None })
    }

    /// Frames of the link.
    pub fn frames(&self) -> LinkFrames {
        LinkFrames { X_LA: self.X_LA, X_LB: self.X_LB, X_LS: self.split.X_LS }
    }

    /// Total mass of both parts, kg.
    pub fn mass(&self) -> f64 {
        self.proximal.mass + self.distal.mass
    }

    /// Both parts merged into one rigid body, link axes, for the rigid reference model.
    pub fn rigid(&self) -> RigidPart {
        self.proximal.merged(&self.distal)
    }

    /// Vector `p_AoBo_L` from A to B, link axes, m.
    pub fn p_AB(&self) -> Vector3<f64> {
        self.frames().p_AB()
    }

    /// Compliance of the distal interface with A clamped, `u_B = C_BB F_B`.
    ///
    /// Returns `C_BB = K_BB⁻¹`, 6×6 (m/N, m/(N·m); rad/N, rad/(N·m)), at Bo, link axes, exactly
    /// symmetric.
    ///
    /// # Errors
    /// [`FemError::NotPositiveDefinite`] if the caller has changed `K_BB` into a singular matrix.
    pub fn tip_compliance(&self) -> Result<Matrix6<f64>, FemError> {
        let (K_BB, _) = check_matrix6("K_BB", &self.K_BB, &GateLimits::default())?;
        let scale = K_BB.diagonal().map(|k| 1.0 / k.sqrt());
        let scaled = K_BB.component_mul(&(scale * scale.transpose()));
        let inverse = scaled.cholesky().map(|factor| factor.inverse());
        inverse.map(|C| symmetric_part(&C.component_mul(&(scale * scale.transpose())))).ok_or_else(|| {
            FemError::NotPositiveDefinite {
                what: "K_BB",
                min_eigenvalue: 0.0,
                allowed: GateLimits::default().min_eigenvalue,
                direction: crate::Direction(vec![0.0; 6]),
            }
        })
    }

    /// Stiffness of both interfaces, for export to FE programs.
    ///
    /// ```text
    /// K = [ Adᵀ K_BB Ad   -Adᵀ K_BB ]      F = K [u_A; u_B],   Ad = Ad_BA
    ///     [  -K_BB Ad        K_BB   ]
    /// ```
    /// Returns K, 12×12 (N/m, N/rad; N·m/m, N·m/rad), at Ao and Bo, link axes, exactly symmetric.
    /// Its null space is the six rigid motions.
    pub fn matrix12(&self) -> Matrix12 {
        let Ad_BA = lever(&self.p_AB());
        let K_AB = -Ad_BA.transpose() * self.K_BB;
        let mut K = Matrix12::zeros();
        K.fixed_view_mut::<6, 6>(0, 0).copy_from(&symmetric_part(&(-K_AB * Ad_BA)));
        K.fixed_view_mut::<6, 6>(0, 6).copy_from(&K_AB);
        K.fixed_view_mut::<6, 6>(6, 0).copy_from(&K_AB.transpose());
        K.fixed_view_mut::<6, 6>(6, 6).copy_from(&self.K_BB);
        K
    }

    /// Returns warnings about accepted but suspicious input.
    ///
    /// In addition to those of the gate: `K_S` is stiffer in rotation than any lever arm of the
    /// link explains, with `sqrt(tr K_rr / tr K_tt)` above ten times the distance of its frames.
    /// This is the effect of reading forces per millimetre as forces per metre, and the only trace
    /// of wrong units in a 6×6.
    pub fn warnings(&self, limits: &GateLimits) -> Vec<String> {
        let mut warnings = self.checks.warnings(limits);
        let K_S = self.split.K_S.diagonal();
        let lever = (K_S.fixed_rows::<3>(3).sum() / K_S.fixed_rows::<3>(0).sum()).sqrt();
        let p_LS = self.split.X_LS.translation.vector;
        let size = [self.X_LA, self.X_LB]
            .iter()
            .map(|X| (X.translation.vector - p_LS).norm())
            .fold(self.p_AB().norm(), f64::max);
        if size > 0.0 && lever > 10.0 * size {
            warnings.push(format!(
                "the rotational stiffness is that of a lever of {lever:.3} m in a link of {size:.3} m: \
                 is the stiffness in other units than declared?"
            ));
        }
        warnings
    }

    /// Moves the elastic joint to another frame. The cut between the parts is unchanged.
    ///
    /// * `X_LS`: pose of the new split frame in the link frame, m.
    ///
    /// # Errors
    /// Errors of [`stiffness_at_split`]; [`FemError::OutOfRange`] for a frame more than 100 m from
    /// the link origin.
    pub fn with_split(&self, X_LS: Pose) -> Result<Self, FemError> {
        let frames = self.frames().with_split(X_LS);
        frames.check()?;
        let split = elastic_split(&frames, &self.K_BB)?;
        Ok(Self { split, ..self.clone() })
    }

    /// Reduces `K_S` to its diagonal, as a plain spring model does.
    ///
    /// Only to show the resulting error; `K_BB = Ad_SBᵀ diag(K_S) Ad_SB`, so that the link stays
    /// consistent. The parts are unchanged.
    pub fn without_coupling(&self) -> Self {
        let K_S = drop_coupling(&self.split.K_S);
        let Ad_SB = adjoint(&self.frames().X_BS().inverse());
        let K_BB = symmetric_part(&(Ad_SB.transpose() * K_S * Ad_SB));
        let split = ElasticSplit { X_LS: self.split.X_LS, K_S };
        Self { K_BB, split, ..self.clone() }
    }
}

/// Elastic joint at S of the stiffness at Bo, link axes.
fn elastic_split(frames: &LinkFrames, K_BB: &Matrix6<f64>) -> Result<ElasticSplit, FemError> {
    let K_S = stiffness_at_split(K_BB, &frames.X_BS())?;
    Ok(ElasticSplit { X_LS: frames.X_LS, K_S })
}

/// Stiffness `K_S` of the elastic joint at S that gives the distal end the stiffness `K_BB`.
///
/// ```text
/// u_B = Ad_BS d_S,    K_S = Ad_BSᵀ K_BB Ad_BS
/// ```
/// Exact to first order for every wrench at B and any position of S. `K_S` couples force and
/// rotation even if the beam is straight; see [`drop_coupling`] for the effect of ignoring this.
///
/// * `K_BB`: (N/m, N/rad; N·m/m, N·m/rad), at Bo, with A clamped.
/// * `X_BS`: pose of S in the frame at Bo in whose axes `K_BB` is given, translation in m.
///
/// Returns `K_S`, same units, at So, in S axes, exactly symmetric.
///
/// # Errors
/// [`FemError::NotFinite`], [`FemError::NotSymmetric`], [`FemError::NotPositiveDefinite`].
///
/// # Source
/// Change of reference point and axes of a quadratic form; Fjellstedt (2019), section 4.3.
pub fn stiffness_at_split(K_BB: &Matrix6<f64>, X_BS: &Pose) -> Result<Matrix6<f64>, FemError> {
    let (K_BB, _) = check_matrix6("K_BB", K_BB, &GateLimits::default())?;
    let Ad_BS = adjoint(X_BS);
    let K_S = symmetric_part(&(Ad_BS.transpose() * K_BB * Ad_BS));
    // Long lever arms can make it overflow, or lose the translations in rounding.
    check_matrix6("K_S", &K_S, &GateLimits::default()).map(|_| K_S)
}

/// Diagonal of `K_S`: six separate springs, as in plain spring models.
///
/// Wrong by tens of per cent where `K_S` is coupled; only for demonstrating that error.
///
/// * `K_S`: 6×6 (N/m, N/rad; N·m/m, N·m/rad), at So, in S axes.
///
/// Returns a diagonal 6×6 matrix at the same point, in the same axes.
pub fn drop_coupling(K_S: &Matrix6<f64>) -> Matrix6<f64> {
    Matrix6::from_diagonal(&K_S.diagonal())
}
