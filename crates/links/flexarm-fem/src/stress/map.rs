//! Stress of a link in the coordinates of its model.
//!
//! ```text
//! σ = S_w w + S_m η_m + Σ a_j (S_a,j - S_w w_j - S_m η_j),     [w; η_m] = A q
//! ```
//! w is the wrench at the interfaces that the deflection q of the model stands for, `w_j`, `η_j`
//! the model's own static response to the inertia load j. So the stress is that of the mesh under
//! every static load, whatever the model of the link, and the deflection adds its dynamics.

use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};

use super::error::{REDUCE_AGAIN, StressError};
use super::fields::{INERTIA_LOADS, StressFields};
use crate::modal::{Field, ModalLink, axial};
use crate::reduced::ElasticSplit;
use crate::rigid_part::RigidPart;

/// Maximum relative difference between the compliance of a link and that of its fields.
const SAME_LINK: f64 = 1e-3;

/// Linear map from the coordinates of a link's model to stress.
#[derive(Debug, Clone)]
pub struct StressMap {
    /// Amplitudes by coordinates of the model.
    A: DMatrix<f64>,
    /// Stress by amplitudes and inertia loads, Pa; six rows per site.
    stress: DMatrix<f32>,
    /// Section forces by amplitudes and inertia loads; six rows per plane, none for a mesh.
    section_forces: DMatrix<f32>,
}

/// Returns the inertia loads of a link, in the order of [`INERTIA_LOADS`].
///
/// * `a`: acceleration of Lo minus gravity (m/s²); `alpha`, `omega`: angular acceleration and
///   velocity (rad/s², rad/s) of the link frame in the world; all in link axes.
pub fn inertia_loads(a: &Vector3<f64>, alpha: &Vector3<f64>, omega: &Vector3<f64>) -> [f64; INERTIA_LOADS] {
    let w = omega;
    [a.x, a.y, a.z, alpha.x, alpha.y, alpha.z, w.x * w.x, w.y * w.y, w.z * w.z, w.x * w.y, w.x * w.z, w.y * w.z]
}

impl StressMap {
    /// Number of amplitudes and inertia loads.
    pub fn columns(&self) -> usize {
        self.stress.ncols()
    }

    /// Stress by amplitudes and inertia loads, Pa; six rows per site.
    pub fn stress(&self) -> &DMatrix<f32> {
        &self.stress
    }

    /// Section forces by amplitudes and inertia loads, N and N m; six rows per plane of
    /// [`StressFields::section_forces`], none for a mesh.
    pub fn section_forces(&self) -> &DMatrix<f32> {
        &self.section_forces
    }

    /// Appends the factors of the columns of [`Self::stress`] at one state: amplitudes `A q`, then
    /// the inertia loads.
    ///
    /// * `q`: coordinates of the model of the link (m, rad, or modal).
    /// * `loads`: result of [`inertia_loads`].
    pub fn append(&self, q: &[f64], loads: &[f64; INERTIA_LOADS], to: &mut Vec<f32>) {
        for row in self.A.row_iter() {
            to.push(row.iter().zip(q).map(|(a, q)| a * q).sum::<f64>() as f32);
        }
        to.extend(loads.iter().map(|load| *load as f32));
    }
}

impl StressFields {
    /// Returns the map for a modal link in coordinates of Craig and Bampton.
    ///
    /// * `factor`: factor on its stiffness.
    ///
    /// Returns the map from the link's coordinates to stress in link axes, Pa.
    ///
    /// # Errors
    /// [`StressError`] if the link is another one, or has other coordinates.
    pub fn modal_map(&self, link: &ModalLink, factor: f64) -> Result<StressMap, StressError> {
        let wrenches = self.compliance.nrows();
        let modes = link.coordinates().saturating_sub(wrenches);
        if !link.is_craig_bampton() || 6 * link.interfaces.len() != wrenches || modes > self.frequencies_hz.len() {
            let (interfaces, modes) = (wrenches / 6, self.frequencies_hz.len());
            return Err(StressError(format!(
                "stress is stored for {interfaces} interfaces and {modes} fixed-interface modes, which are not the \
                 coordinates of the modal link: leave out eigenmodes, or {REDUCE_AGAIN}"
            )));
        }
        // Wrenches on the interfaces are stiffness times displacement; modes are themselves.
        let n = link.coordinates();
        let K_cc = link.K.view((0, 0), (wrenches, wrenches)).into_owned();
        self.check(&K_cc)?;
        let mut A = DMatrix::identity(n, n);
        A.view_mut((0, 0), (wrenches, wrenches)).copy_from(&(K_cc * factor));
        // w_j, η_j: static response of the model to each inertia load.
        let K = (&link.K * factor)
            .cholesky()
            .ok_or_else(|| StressError("the stiffness of the modal link is not positive definite".into()))?;
        let own: Vec<DVector<f64>> = (0..INERTIA_LOADS).map(|j| &A * K.solve(&modal_force(link, j))).collect();
        let columns: Vec<usize> = (0..wrenches).chain((0..modes).map(|k| wrenches + INERTIA_LOADS + k)).collect();
        // A mode stresses a link that is stiffer by a factor more by this factor.
        let factors: Vec<f64> = (0..n).map(|k| if k < wrenches { 1.0 } else { factor }).collect();
        Ok(self.map(A, &columns, &factors, &own))
    }

    /// Returns the map for a chain of rigid parts and elastic joints.
    ///
    /// * `joints`, `parts`: proximal first, one more part than joints, without attached bodies.
    /// * `springs`: stiffness `K_S` of the joints in use, S axes; may differ from that of the
    ///   source.
    ///
    /// Returns the map from the displacements of the joints, six per joint in its axes, to stress
    /// in link axes, Pa.
    ///
    /// # Errors
    /// [`StressError`] if the link is another one.
    pub fn chain_map(
        &self,
        joints: &[ElasticSplit],
        parts: &[RigidPart],
        springs: &[Matrix6<f64>],
    ) -> Result<StressMap, StressError> {
        let p_LB = self.poses[1].translation.vector;
        // Ad_BS: displacement of B, link axes, per displacement of each joint, S axes.
        let carry = |joint: &ElasticSplit| {
            let (R_LS, p_SB) = (joint.X_LS.rotation.matrix(), p_LB - joint.X_LS.translation.vector);
            let mut Ad_BS = Matrix6::zeros();
            Ad_BS.fixed_view_mut::<3, 3>(0, 0).copy_from(R_LS);
            Ad_BS.fixed_view_mut::<3, 3>(3, 3).copy_from(R_LS);
            Ad_BS.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-p_SB.cross_matrix() * R_LS));
            Ad_BS
        };
        let Ad: Vec<Matrix6<f64>> = joints.iter().map(carry).collect();
        let singular = || StressError("the stiffness of a joint is singular".into());
        let inverse = |K: &Matrix6<f64>| K.try_inverse().ok_or_else(singular);
        // Compliances C_S, and K_BB = (Σ Ad_BS C_S Ad_BSᵀ)⁻¹.
        let at_B = |springs: &mut dyn Iterator<Item = &Matrix6<f64>>| {
            let C: Vec<Matrix6<f64>> = springs.map(inverse).collect::<Result<_, _>>()?;
            let C_BB: Matrix6<f64> = Ad.iter().zip(&C).map(|(Ad_BS, C_S)| Ad_BS * C_S * Ad_BS.transpose()).sum();
            Ok::<_, StressError>((C, inverse(&C_BB)?))
        };
        let (_, nominal) = at_B(&mut joints.iter().map(|joint| &joint.K_S))?;
        self.check(&DMatrix::from_column_slice(6, 6, nominal.as_slice()))?;
        // w = K_BB Σ Ad_BS d_S: the wrench at B that gives B the displacement of the joints.
        let (C, K_BB) = at_B(&mut springs.iter())?;
        let mut A = DMatrix::zeros(6, 6 * joints.len());
        for (k, Ad_BS) in Ad.iter().enumerate() {
            A.fixed_view_mut::<6, 6>(0, 6 * k).copy_from(&(K_BB * Ad_BS));
        }
        // w_j: the same of the joints' static response C_S F_S to each inertia load on the parts
        // beyond.
        let own = (0..INERTIA_LOADS).map(|j| {
            let mut q = DVector::zeros(6 * joints.len());
            for (k, joint) in joints.iter().enumerate() {
                let p_LS = joint.X_LS.translation.vector;
                let F_L: Vector6<f64> = parts[k + 1..].iter().map(|part| part_load(part, j, &p_LS)).sum();
                let R_SL = joint.X_LS.rotation.matrix().transpose();
                let mut F_S = Vector6::zeros();
                F_S.fixed_rows_mut::<3>(0).copy_from(&(R_SL * F_L.fixed_rows::<3>(0)));
                F_S.fixed_rows_mut::<3>(3).copy_from(&(R_SL * F_L.fixed_rows::<3>(3)));
                q.fixed_rows_mut::<6>(6 * k).copy_from(&(C[k] * F_S));
            }
            &A * q
        });
        let own: Vec<DVector<f64>> = own.collect();
        Ok(self.map(A, &[0, 1, 2, 3, 4, 5], &[1.0; 6], &own))
    }

    /// Maps the stored fields to amplitudes and residual inertia loads; see the module.
    ///
    /// * `columns`: field of each amplitude, with its factor; `own`: amplitudes of the model under
    ///   each inertia load.
    fn map(&self, A: DMatrix<f64>, columns: &[usize], factors: &[f64], own: &[DVector<f64>]) -> StressMap {
        let wrenches = self.compliance.nrows();
        let by_amplitudes = |fields: &DMatrix<f32>| {
            let (rows, n) = (fields.nrows(), columns.len());
            let mut mapped = DMatrix::zeros(rows, n + INERTIA_LOADS);
            for (k, (column, factor)) in columns.iter().zip(factors).enumerate() {
                mapped.set_column(k, &(fields.column(*column) * *factor as f32));
            }
            // S_a,j - Σ_k own_k S_k, in f64: the difference of two large fields.
            let mut residual = vec![0.0_f64; rows];
            for (j, own) in own.iter().enumerate() {
                let of_mesh = fields.column(wrenches + j);
                residual.iter_mut().zip(of_mesh.iter()).for_each(|(residual, field)| *residual = f64::from(*field));
                for (k, own) in own.iter().enumerate() {
                    let kept = mapped.column(k);
                    let pairs = residual.iter_mut().zip(kept.iter());
                    pairs.for_each(|(residual, kept)| *residual -= own * f64::from(*kept));
                }
                let pairs = mapped.column_mut(n + j).into_iter().zip(&residual);
                pairs.for_each(|(mapped, residual)| *mapped = *residual as f32);
            }
            mapped
        };
        let sections = self.section_forces.as_ref().map(|sections| by_amplitudes(&sections.forces));
        StressMap {
            A,
            stress: by_amplitudes(&self.stress),
            section_forces: sections.unwrap_or_else(|| DMatrix::zeros(0, 0)),
        }
    }

    /// Checks that the stiffness K of the interfaces, A clamped, is the inverse of the stored
    /// compliance.
    fn check(&self, K: &DMatrix<f64>) -> Result<(), StressError> {
        let n = K.nrows();
        let product = self.compliance.view((0, 0), (n, n)) * K;
        let scale = |i: usize, j: usize| (self.compliance[(j, j)] / self.compliance[(i, i)]).sqrt();
        let off = (0..n * n).map(|at| (at / n, at % n)).map(|(i, j)| {
            let unit = if i == j { 1.0 } else { 0.0 };
            ((product[(i, j)] - unit) * scale(i, j)).abs()
        });
        let off = off.fold(0.0, f64::max);
        if off <= SAME_LINK {
            return Ok(());
        }
        Err(StressError::file(format!(
            "the stress file belongs to another link: stiffness times its compliance differs from 1 by {off:.1e}"
        )))
    }
}

/// Generalised forces `-∫ φ_k·(A s + b) dm` of inertia load j on the coordinates of a modal link.
fn modal_force(link: &ModalLink, j: usize) -> DVector<f64> {
    let field = Field::unit(j);
    DVector::from_iterator(
        link.coordinates(),
        (0..link.coordinates()).map(|k| {
            // P_k[a, b] = ∫ s_a φ_b dm, so ∫ φ·A s dm = tr(A P_k).
            -(link.C_t.column(k).dot(&field.b) + (field.A * link.P[k]).trace())
        }),
    )
}

/// Wrench of inertia load j on a rigid part.
///
/// ```text
/// f = -m (A c + b),   t = (c - p) × f - ∫ r × (A r) dm      r from the centre of mass c
/// ```
/// * `p_L`: point about which the moment is, link axes, m.
///
/// Returns `[f; t]` per unit load, link axes.
pub(super) fn part_load(part: &RigidPart, j: usize, p_L: &Vector3<f64>) -> Vector6<f64> {
    let field = Field::unit(j);
    let D = nalgebra::Matrix3::identity() * (0.5 * part.inertia.trace()) - part.inertia;
    let force = -(field.A * part.com + field.b) * part.mass;
    let torque = (part.com - p_L).cross(&force) - axial(&(D * field.A.transpose()));
    Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}
