//! Minimum of a quadratic function above lower bounds.

use nalgebra::{DMatrix, DVector};

/// Rounds in which all unknowns that violate a condition are exchanged although their number does
/// not fall.
const PATIENCE: usize = 5;

/// Returns the `d >= lower` that minimises `½ dᵀ H d + gᵀ d` for a positive definite H: block
/// principal pivoting (Júdice and Pires 1994), which exchanges one unknown at a time where blocks
/// of them cycle. `None` if H is not positive definite.
pub fn bounded_minimum(H: &DMatrix<f64>, g: &DVector<f64>, lower: &DVector<f64>) -> Option<DVector<f64>> {
    let n = g.len();
    // Scaled to a unit diagonal, so that units do not matter.
    let scale = H.diagonal().map(|h| 1.0 / h.sqrt());
    let A = DMatrix::from_fn(n, n, |i, j| scale[i] * H[(i, j)] * scale[j]);
    let (b, low) = (g.component_mul(&scale), lower.component_div(&scale));
    let small = 1e-12 * (1.0 + b.amax());
    let mut at_bound = vec![false; n];
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    for _ in 0..10 * (n + 10) {
        let free: Vec<usize> = (0..n).filter(|k| !at_bound[*k]).collect();
        let mut d = DVector::from_fn(n, |k, _| if at_bound[k] { low[k] } else { 0.0 });
        if !free.is_empty() {
            let right = -(&A * &d + &b).select_rows(&free);
            let factor = A.select_rows(&free).select_columns(&free).cholesky()?;
            free.iter().zip(factor.solve(&right).iter()).for_each(|(k, x)| d[*k] = *x);
        }
        let gradient = &A * &d + &b;
        let violated = |k: &usize| if at_bound[*k] { gradient[*k] < -small } else { d[*k] < low[*k] - small };
        let exchanged: Vec<usize> = (0..n).filter(violated).collect();
        let Some(last) = exchanged.last() else { return Some(d.component_mul(&scale)) };
        if exchanged.len() < fewest {
            (fewest, patience) = (exchanged.len(), PATIENCE);
        }
        match patience {
            0 => at_bound[*last] ^= true,
            _ => exchanged.iter().for_each(|k| at_bound[*k] ^= true),
        }
        patience = patience.saturating_sub(usize::from(exchanged.len() >= fewest));
    }
    None
}
