//! Lengths and energies of the balancers at the poses of the tree.

use crate::data::Data;
use crate::model::Model;

/// Computes lengths and joint values at the poses in `data.X_WB`, for [`energy`].
pub(crate) fn measure(model: &Model, data: &mut Data, q: &[f64]) {
    for (x, balancer) in data.balanced.iter_mut().zip(&model.balancers) {
        *x = balancer.length(&data.X_WB, q);
    }
}

/// Energy of all balancers (J) at the last measured lengths.
pub(crate) fn energy(model: &Model, data: &Data) -> f64 {
    model.balancers.iter().zip(&data.balanced).map(|(balancer, x)| balancer.law.energy(*x)).sum()
}
