//! Substructure files that are wrong although they are well formed, with the reason.

use nalgebra::DMatrix;

use super::error::{ExchangeError, ExchangeErrorKind, Place};
use super::matrix::ImportedMatrices;
use super::recognise::MatrixFormat;

/// A relative force under translation of the whole above this is no rounding: the matrix is not free.
const OF_ORDER_ONE: f64 = 1e-2;

/// Refuses a matrix whose interfaces know nothing of each other, or which is held by the ground.
///
/// Debian's CalculiX 2.20 writes substructures without condensing them: the block between the
/// interfaces is then exactly zero, and a translation of both meets a force of full size. The gate
/// ([`crate::gate::check_matrix12`]) refuses such a matrix too, but cannot know why.
///
/// * `K`: rows of the interfaces first, six each; any units.
///
/// # Errors
/// [`ExchangeErrorKind::Defective`].
pub fn diagnose_substructure(
    imported: &ImportedMatrices,
    K: &DMatrix<f64>,
    interfaces: usize,
) -> Result<(), ExchangeError> {
    if interfaces < 2 || K.nrows() < 6 * interfaces {
        return Ok(());
    }
    let uncoupled = (1..interfaces).find(|&i| K.view((0, 6 * i), (6, 6)).iter().all(|k| *k == 0.0));
    let residual = translation_residual(K, interfaces);
    let found = match uncoupled {
        Some(i) => format!(
            "a block between interfaces 1 and {} that is exactly zero (relative force under translation {residual:.1e})",
            i + 1
        ),
        None if residual > OF_ORDER_ONE => {
            format!("a relative force of {residual:.1e} when all interfaces move alike")
        }
        None => return Ok(()),
    };
    let help = match imported.format {
        MatrixFormat::UserElement | MatrixFormat::LabelledText => {
            "CalculiX 2.20 as built by Debian writes substructures without condensing them; instead write the full \
             matrices with *FREQUENCY, SOLVER=MATRIXSTORAGE and import .sti, .mas and .dof, or reduce the mesh itself \
             with `flexarm reduce`"
        }
        _ => "is a support left in the model, do the rows belong to other interfaces, or was it not condensed?",
    };
    let expected = "a free structure whose interfaces feel each other";
    Err(Place::file(&imported.origin).fail(ExchangeErrorKind::Defective, "stiffness", found, expected, help))
}

/// Largest force under a translation of all interfaces, over the size of the terms that should cancel.
fn translation_residual(K: &DMatrix<f64>, interfaces: usize) -> f64 {
    let mut worst = 0.0_f64;
    for axis in 0..3 {
        let moving = || (0..interfaces).map(|i| 6 * i + axis);
        for row in moving() {
            let force: f64 = moving().map(|column| K[(row, column)]).sum();
            let size: f64 = moving().map(|column| K[(row, column)].abs()).sum();
            if size > 0.0 {
                worst = worst.max(force.abs() / size);
            }
        }
    }
    worst
}
