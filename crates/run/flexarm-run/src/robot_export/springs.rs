//! Stiffness and damping as springs and dampers over one or several joints, and the step size that
//! an explicit program needs for them.

use flexarm_stepping::Plant;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Entries smaller than this part of the largest one are rounding.
const ROUNDING: f64 = 1e-12;

/// A spring with a damper on a sum of elastic coordinates.
pub(super) struct JointSpring {
    /// Index of each coordinate, and its factor in the sum.
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) stiffness: f64,
    pub(super) damping: f64,
}

/// All springs of an arm; together they have the matrices `K` and `D`.
pub(super) struct Springs {
    pub(super) K: DMatrix<f64>,
    pub(super) D: DMatrix<f64>,
    pub(super) springs: Vec<JointSpring>,
}

impl Springs {
    pub(super) fn of(plant: &Plant) -> Self {
        let (K, D) = (plant.stiffness(), plant.D.clone());
        let mut springs = Vec::new();
        for group in groups(&K) {
            let k = K.select_rows(&group).select_columns(&group);
            // K = Σ k_i l_i l_iᵀ with the columns l_i of a unit lower triangle.
            let Some(factor) = k.cholesky().map(|c| c.unpack()) else { continue };
            let stiffness = factor.diagonal().map(|x| x * x);
            let L = DMatrix::from_fn(group.len(), group.len(), |i, j| factor[(i, j)] / factor[(j, j)]);
            springs.extend((0..group.len()).map(|j| JointSpring {
                terms: terms(&group, &L.column(j).into_owned()),
                stiffness: stiffness[j],
                damping: 0.0,
            }));
        }
        let mut all = Self { K, D, springs };
        all.add_damping();
        all
    }

    /// Damps the springs of a group in proportion to their stiffness where that gives its rows of
    /// `D`; the rest becomes dampers of their own.
    fn add_damping(&mut self) {
        let (K, D) = (&self.K, &self.D);
        // Translations and rotations differ by orders of magnitude: entries are compared with the diagonal.
        let size = D.diagonal().map(f64::sqrt);
        let is_small = |x: f64, i: usize, j: usize| x.abs() <= ROUNDING.sqrt() * size[i] * size[j];
        let mut rest = D.clone();
        for group in groups(K) {
            let [k, d] = [K, D].map(|M| M.select_rows(&group).select_columns(&group));
            let beta = d.dot(&k) / k.norm_squared();
            let expected = |i: usize, j: usize| if group.contains(&j) { beta * K[(i, j)] } else { 0.0 };
            let all = 0..D.nrows();
            if group.iter().any(|&i| all.clone().any(|j| !is_small(D[(i, j)] - expected(i, j), i, j))) {
                continue;
            }
            let own = |spring: &&mut JointSpring| spring.terms.iter().all(|(k, _)| group.contains(k));
            self.springs.iter_mut().filter(own).for_each(|spring| spring.damping = beta * spring.stiffness);
            for &i in &group {
                rest.row_mut(i).fill(0.0);
                rest.column_mut(i).fill(0.0);
            }
        }
        for group in groups(&rest) {
            let size = size.select_rows(&group);
            let scaled = rest.select_rows(&group).select_columns(&group).component_div(&(&size * size.transpose()));
            let SymmetricEigen { eigenvalues, eigenvectors } = scaled.symmetric_eigen();
            for (k, &damping) in eigenvalues.iter().enumerate().filter(|&(_, &d)| d > ROUNDING) {
                let terms = terms(&group, &eigenvectors.column(k).component_mul(&size));
                self.springs.push(JointSpring { terms, stiffness: 0.0, damping });
            }
        }
    }
}

fn terms(group: &[usize], factors: &DVector<f64>) -> Vec<(usize, f64)> {
    group.iter().copied().zip(factors.iter().copied()).filter(|(_, x)| *x != 0.0).collect()
}

/// Returns the coordinates that a matrix couples, group by group, without those of zero rows.
fn groups(M: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..M.nrows()).filter(|&i| M.row(i).amax() > 0.0).collect();
    let mut groups = Vec::new();
    while let Some(first) = left.first().copied() {
        let mut group = vec![first];
        let mut at = 0;
        left.retain(|&k| k != first);
        while at < group.len() {
            let (coupled, other): (Vec<_>, Vec<_>) = left.iter().partition(|&&k| M[(group[at], k)] != 0.0);
            (left, at) = (other, at + 1);
            group.extend(coupled);
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// Steps per period of the first mode for an error of 0.5 % with a first-order method.
const STEPS_PER_PERIOD: f64 = 200.0;
/// Part of the largest stable step.
const SAFETY: f64 = 0.5;

/// Returns the step size for semi-implicit Euler with implicit damping.
///
/// A mode of frequency `w` and damping `c` is stable for `h² w² < 4 + 2 h c`.
pub(super) fn step(plant: &Plant) -> f64 {
    let modes = &plant.modes;
    let stable = modes.omega.iter().enumerate().map(|(k, w)| {
        let shape = modes.shapes.column(k);
        let c = shape.dot(&(&plant.D * shape));
        (c + (c * c + 4.0 * w * w).sqrt()) / (w * w)
    });
    let stable = stable.fold(f64::INFINITY, f64::min);
    let first = modes.omega.first().map_or(f64::INFINITY, |w| std::f64::consts::TAU / w);
    let most = (SAFETY * stable).min(first / STEPS_PER_PERIOD).min(1e-3);
    // Rounded down to 1, 2 or 5 times a power of ten.
    let scale = 10f64.powf(most.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * scale).find(|h| *h <= most).unwrap_or(scale)
}
