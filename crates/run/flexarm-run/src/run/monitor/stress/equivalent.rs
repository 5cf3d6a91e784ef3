//! Equivalent and principal stresses of six components `xx yy zz xy yz zx`.

use flexarm_fem::stress::von_mises;
use nalgebra::Matrix3;

/// Returns the largest and the smallest principal stress (Pa).
pub(super) fn principal(&[xx, yy, zz, xy, yz, zx]: &[f64; 6]) -> [f64; 2] {
    let principal = Matrix3::new(xx, xy, zx, xy, yy, yz, zx, yz, zz).symmetric_eigenvalues();
    [principal.max(), principal.min()]
}

/// Returns the von Mises stress (Pa) with the sign of the principal stress of the largest magnitude.
pub fn signed_von_mises(stress: [f64; 6]) -> f64 {
    let von_mises = von_mises(stress);
    // The sum of the largest and the smallest principal stress is 2p - s, with the mean stress p and
    // the middle deviator s, |s| <= von Mises/3, the root of f(x) = x^3 - J2 x - J3 where f falls.
    let p = (stress[0] + stress[1] + stress[2]) / 3.0;
    if (2.0 * p).abs() > von_mises / 3.0 {
        return von_mises.copysign(p);
    }
    let [xx, yy, zz, xy, yz, zx] = stress;
    let (a, b, c) = (xx - p, yy - p, zz - p);
    let J3 = a * b * c + 2.0 * xy * yz * zx - a * yz * yz - b * zx * zx - c * xy * xy;
    let f = 2.0 * p * (4.0 * p * p - von_mises * von_mises / 3.0) - J3;
    if f > 0.0 { -von_mises } else { von_mises }
}

/// Square of the von Mises stress.
pub(super) fn von_mises_squared([xx, yy, zz, xy, yz, zx]: &[f32; 6]) -> f32 {
    let (a, b, c) = (xx - yy, yy - zz, zz - xx);
    0.5 * (a * a + b * b + c * c) + 3.0 * (xy * xy + yz * yz + zx * zx)
}
