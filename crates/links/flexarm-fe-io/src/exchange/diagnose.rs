//! Diagnosis of substructure files that are well formed but wrong, with the cause.
//!
//! Start at [`diagnose_substructure`]; six rows per interface, linear first. Not here: the checks of
//! every stiffness (`flexarm_fem::gate`).

use nalgebra::DMatrix;

use super::position::ErrorPosition;
use super::read::ImportedMatrices;
use super::recognise::MatrixFormat;
use crate::FeFileError;

/// Relative force under translation above which it is of order one: nothing cancels.
const OF_ORDER_ONE: f64 = 0.5;

/// Coupling relative to the diagonal below which it is rounding.
const ROUND_OFF: f64 = 1e-10;

/// Rejects a matrix with an interface that is not coupled to the others but is still supported.
///
/// Debian's CalculiX 2.20 writes substructures without condensing them. The block between the
/// interfaces is then exactly zero (or rounding), and a translation of both causes a force of full
/// size. The gate ([`flexarm_fem::gate::check_matrix12`]) also rejects such a matrix, but cannot
/// give the cause. Other errors, such as rows in another order or a remaining support, are left to
/// the gate.
///
/// * `K`: rows of the interfaces first, six each; any units.
///
/// # Errors
/// If the interfaces are uncoupled.
pub fn diagnose_substructure(
    imported: &ImportedMatrices,
    K: &DMatrix<f64>,
    interfaces: usize,
) -> Result<(), FeFileError> {
    if interfaces < 2 || K.nrows() < 6 * interfaces {
        return Ok(());
    }
    // Formats of CalculiX and Abaqus.
    let is_substructure = matches!(imported.format, MatrixFormat::UserElement | MatrixFormat::LabelledText);
    let largest = |i: usize| largest_coupling(K, i, interfaces);
    let mut couplings = (0..interfaces).map(|i| (i, largest(i)));
    let uncoupled = couplings.rfind(|(_, k)| *k == 0.0 || (is_substructure && *k <= ROUND_OFF));
    let residual = translation_residual(K, interfaces);
    let Some((i, coupling)) = uncoupled.filter(|_| residual > OF_ORDER_ONE) else { return Ok(()) };
    let (i, others) = (i + 1, if interfaces == 2 { "the other" } else { "all others" });
    let how = if coupling == 0.0 { "exactly zero".to_owned() } else { format!("only rounding ({coupling:.1e})") };
    let found = format!(
        "a block between interface {i} and {others} that is {how} (relative force under translation {residual:.1e})"
    );
    let help = if is_substructure {
        "CalculiX 2.20 as built by Debian writes substructures without condensing them; instead write the full \
         matrices with *FREQUENCY, SOLVER=MATRIXSTORAGE and import .sti, .mas and .dof, or reduce the mesh itself \
         with `flexarm reduce`"
    } else {
        "is the matrix not condensed, or are the rows those of other interfaces?"
    };
    let expected = "a free structure whose interfaces feel each other";
    Err(ErrorPosition::file(&imported.origin).fail("stiffness", found, expected, help))
}

/// Maximum `|k_ij| / sqrt(|k_ii k_jj|)` between an interface and the others; 0 only if all are
/// zero.
fn largest_coupling(K: &DMatrix<f64>, interface: usize, interfaces: usize) -> f64 {
    let own = 6 * interface..6 * interface + 6;
    let others = || (0..6 * interfaces).filter(|j| !own.contains(j));
    let entries = own.clone().flat_map(|i| others().map(move |j| (i, j))).filter(|place| K[*place] != 0.0);
    let relative = |(i, j): (usize, usize)| {
        let size = K[(i, i)].abs().sqrt() * K[(j, j)].abs().sqrt();
        (K[(i, j)].abs() / size).max(f64::MIN_POSITIVE)
    };
    entries.map(relative).fold(0.0, f64::max)
}

/// Maximum force under a translation of all interfaces, relative to the size of the terms that
/// should cancel.
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
