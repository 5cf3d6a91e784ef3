//! Statically determinate support of a free body by six DoF.
//!
//! If every interface is distributing, the mesh is unsupported and `K_ii` has the six rigid motions
//! as null space. Fixing six well-chosen DoF makes it positive definite. Loads in equilibrium cause
//! no reaction there, so the result does not depend on the choice.

use nalgebra::DMatrix;

use crate::model::FeModel;

/// Selects six DoF of up to three distant nodes by pivoted QR of their rigid motions; returns
/// positions in `free`.
pub(super) fn statically_determinate(model: &FeModel, free: &[u32], rigid_modes: &DMatrix<f64>) -> Option<Vec<usize>> {
    let used: Vec<usize> = (0..model.nodes.len()).filter(|node| !model.dofs.of(*node).is_empty()).collect();
    let centre = used.iter().map(|n| model.nodes[*n]).sum::<nalgebra::Vector3<f64>>() / used.len() as f64;
    let farthest =
        |distance: &dyn Fn(usize) -> f64| used.iter().copied().max_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    let first = farthest(&|n| (model.nodes[n] - centre).norm())?;
    let second = farthest(&|n| (model.nodes[n] - model.nodes[first]).norm())?;
    let line = model.nodes[second] - model.nodes[first];
    let third = farthest(&|n| (model.nodes[n] - model.nodes[first]).cross(&line).norm())?;

    let mut nodes = vec![first, second, third];
    nodes.dedup();
    let candidates: Vec<usize> = nodes.into_iter().flat_map(|node| model.dofs.of(node)).collect();
    let size = line.norm().max(f64::MIN_POSITIVE);
    let mut rows =
        DMatrix::from_fn(6, candidates.len(), |i, k| rigid_modes[(candidates[k], i)] / if i < 3 { 1.0 } else { size });
    // Greedy: take the largest remaining column, remove its direction from the others.
    let mut chosen = Vec::new();
    for _ in 0..6 {
        let (k, norm) = rows.column_iter().map(|c| c.norm()).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        if !(norm > 1e-8) {
            return None;
        }
        let direction = rows.column(k) / norm;
        for mut column in rows.column_iter_mut() {
            let along = direction.dot(&column);
            column.axpy(-along, &direction, 1.0);
        }
        chosen.push(free.binary_search(&(candidates[k] as u32)).ok()?);
    }
    chosen.sort_unstable();
    Some(chosen)
}
