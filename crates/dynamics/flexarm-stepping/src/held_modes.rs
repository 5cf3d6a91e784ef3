//! Modal coordinates that an iteration matrix eliminates before the others.

use nalgebra::{DMatrix, DMatrixView};

use crate::arm::{ElasticElement, FlexibleArm};

/// Partition of the free coordinates into modes, which are eliminated first, and others.
#[derive(Clone, Debug)]
pub(crate) struct HeldModes {
    pub(crate) others: Vec<usize>,
    pub(crate) modes: Vec<usize>,
    /// Workspace for `c_D D + c_K K`, and for K, over all free coordinates.
    pub(crate) dense: DMatrix<f64>,
    pub(crate) K: DMatrix<f64>,
}

/// Minimum number of modes for elimination: with 16 a step takes the same time with a dense
/// inverse, with 40 12 instead of 19 us, with 80 25 instead of 74 (`examples/modal.rs`).
const FEWEST_MODES: usize = 16;

impl HeldModes {
    /// Returns the partition if steps are faster with the modes eliminated.
    pub(crate) fn that_pay(arm: &FlexibleArm) -> Option<Self> {
        let shift = |k: usize| k - arm.model.n_actuated() + arm.torque_driven.len();
        let modes: Vec<usize> = arm.model.held_modes().into_iter().map(shift).collect();
        if modes.len() < FEWEST_MODES || !arm.damps_by_element() {
            return None;
        }
        let driven = arm.torque_driven.len();
        let alone = |element: &ElasticElement| {
            let first = arm.offset(element);
            let D = arm.D.view((first, first), (element.size, element.size));
            (0..element.size)
                .filter(|k| modes.contains(&(driven + first + k)))
                .all(|k| element.curve.is_none() && is_alone(&element.K.as_view(), k) && is_alone(&D, k))
        };
        if !arm.elements.iter().all(alone) {
            return None;
        }
        let n = arm.n_free();
        let others = (0..n).filter(|k| !modes.contains(k)).collect();
        Some(Self { others, modes, dense: DMatrix::zeros(n, n), K: DMatrix::zeros(n, n) })
    }
}

/// Returns whether a coordinate is uncoupled in a matrix, up to round-off.
fn is_alone(A: &DMatrixView<'_, f64>, k: usize) -> bool {
    const ROUNDING: f64 = 1e-11;
    (0..A.nrows()).all(|j| j == k || A[(k, j)].abs() <= ROUNDING * (A[(k, k)] * A[(j, j)]).abs().sqrt())
}
