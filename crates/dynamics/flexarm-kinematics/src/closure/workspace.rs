//! Workspace of the loops in [`crate::Data`]: coordinates of the tree, solved positions, rates.
//!
//! Vectors over the tree have nv independent entries followed by the dependent ones, two per loop.

use std::f64::consts::FRAC_PI_2;

use flexarm_spatial::Pose;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};

use crate::closure::cholesky::CholeskyWorkspace;
use crate::model::Model;

/// Closed loops at the last coordinates, with the workspace of the tree.
#[derive(Clone, Debug)]
pub(crate) struct LoopData {
    /// Tree coordinates: independent, then dependent.
    pub(super) q: Vec<f64>,
    pub(super) qdot: Vec<f64>,
    pub(super) qddot: Vec<f64>,
    pub(super) tau: DVector<f64>,
    pub(super) M: DMatrix<f64>,
    pub(super) solved: Solved,
    pub(super) rates: LoopRates,
    pub(super) free: CholeskyWorkspace,
}

/// Positions of the dependent joints and (2).
#[derive(Clone, Debug)]
pub(super) struct Solved {
    /// Rows of (2), one per dependent coordinate, nv long.
    pub(super) T: Vec<f64>,
    pub(super) nv: usize,
    /// `∂c/∂q` of each loop, two rows per coordinate of the tree.
    pub(super) J: Vec<Vec<Vector2<f64>>>,
    /// `J_d^-1` of each loop.
    pub(super) inverse: Vec<Matrix2<f64>>,
    /// Transmission angle of each loop (rad).
    pub(super) angle: Vec<f64>,
    /// First loop that cannot be closed.
    pub(super) open: Option<usize>,
    /// Poses in the common body of the last loop.
    pub(super) X_C: Vec<Pose>,
}

/// (3) and the time derivative of T in (2) at tree velocities.
#[derive(Clone, Debug)]
pub(super) struct LoopRates {
    /// Poses, and velocities and angular velocities of the origins, of the bodies of the last loop.
    pub(super) X_C: Vec<Pose>,
    pub(super) v: Vec<Vector3<f64>>,
    pub(super) w: Vec<Vector3<f64>>,
    pub(super) Jdot: Vec<Vector2<f64>>,
    pub(super) gamma: Vec<f64>,
    /// Laid out as `T`.
    pub(super) Tdot: Vec<f64>,
}

impl LoopRates {
    pub(super) fn new(model: &Model) -> Self {
        let (n, nd) = (model.bodies.len(), model.dependent().len());
        Self {
            X_C: vec![Pose::identity(); n],
            v: vec![Vector3::zeros(); n],
            w: vec![Vector3::zeros(); n],
            Jdot: vec![Vector2::zeros(); model.nv() + nd],
            gamma: vec![0.0; nd],
            Tdot: vec![0.0; nd * model.nv()],
        }
    }
}

impl LoopData {
    pub(crate) fn new(model: &Model) -> Self {
        let (nv, nd, loops) = (model.nv(), model.dependent().len(), model.loops.len());
        let n = nv + nd;
        Self {
            q: vec![0.0; n],
            qdot: vec![0.0; n],
            qddot: vec![0.0; n],
            tau: DVector::zeros(n),
            M: DMatrix::zeros(n, n),
            solved: Solved {
                T: vec![0.0; nd * nv],
                nv,
                J: vec![vec![Vector2::zeros(); n]; loops],
                inverse: vec![Matrix2::zeros(); loops],
                angle: vec![FRAC_PI_2; loops],
                open: None,
                X_C: vec![Pose::identity(); model.bodies.len()],
            },
            rates: LoopRates::new(model),
            free: CholeskyWorkspace::default(),
        }
    }

    /// Calls `add` with each independent coordinate that moves the dependent coordinate k, and the
    /// entry of T.
    #[inline]
    pub(crate) fn each_leader(&self, k: usize, add: &mut impl FnMut(usize, f64)) {
        self.solved.row(k).iter().enumerate().filter(|(_, t)| **t != 0.0).for_each(|(j, t)| add(j, *t));
    }

    /// As [`Self::each_leader`], for all independent coordinates and with the entry of Ṫ.
    pub(crate) fn each_leader_rate(&self, k: usize, mut add: impl FnMut(usize, f64, f64)) {
        let first = (k - self.solved.nv) * self.solved.nv;
        let rates = &self.rates.Tdot[first..first + self.solved.nv];
        self.solved.row(k).iter().zip(rates).enumerate().for_each(|(j, (t, rate))| add(j, *t, *rate));
    }
}

impl Solved {
    pub(super) fn row(&self, k: usize) -> &[f64] {
        let first = (k - self.nv) * self.nv;
        &self.T[first..first + self.nv]
    }

    /// `x_d = T x`.
    pub(super) fn carry_over(&self, x: &mut [f64]) {
        let (x, x_d) = x.split_at_mut(self.nv);
        for (x_d, row) in x_d.iter_mut().zip(self.T.chunks_exact(self.nv.max(1))) {
            *x_d = row.iter().zip(&*x).map(|(t, x)| t * x).sum();
        }
    }
}
