//! Contributions of elastic elements to the TCP error.

use flexarm_analysis::*;
use nalgebra::{IsometryMatrix3, Matrix6, Rotation3, Translation3, Vector3, Vector6};
use proptest::prelude::*;

/// Map from the deflection of an element at S (in S axes) to the TCP twist at T, in world axes.
fn map(X_WS: &IsometryMatrix3<f64>, p_WT: &Vector3<f64>) -> Matrix6<f64> {
    let R = *X_WS.rotation.matrix();
    let p_ST = p_WT - X_WS.translation.vector;
    let mut J = Matrix6::zeros();
    J.fixed_view_mut::<3, 3>(0, 0).copy_from(&R);
    J.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-p_ST.cross_matrix() * R));
    J.fixed_view_mut::<3, 3>(3, 3).copy_from(&R);
    J
}

proptest! {
    /// Truth: the finite TCP motion through two elastic elements in series.
    #[test]
    fn contributions_sum_to_the_tcp_error_to_first_order(
        angles in prop::array::uniform6(-3.0..3.0_f64),
        lengths in prop::array::uniform3(0.2..1.5_f64),
        deflections in prop::array::uniform12(-1.0..1.0_f64),
    ) {
        let size = 1e-5;
        let link = |i: usize| {
            let rotation = Rotation3::from_euler_angles(angles[i], angles[i + 1], angles[i + 2]);
            IsometryMatrix3::from_parts(Translation3::new(lengths[i % 3], 0.1, -0.2), rotation)
        };
        let elastic = |i: usize| {
            let d = |k: usize| size * deflections[6 * i + k];
            let rotation = Rotation3::new(Vector3::new(d(3), d(4), d(5)));
            (IsometryMatrix3::from_parts(Translation3::new(d(0), d(1), d(2)), rotation), Vector6::from_fn(|k, _| d(k)))
        };
        let ((E_1, d_1), (E_2, d_2)) = (elastic(0), elastic(1));
        let (X_WS1, X_WS2) = (link(0), link(0) * link(1));
        let (rigid, flexible) = (X_WS2 * link(3), link(0) * E_1 * link(1) * E_2 * link(3));

        let p_WT = rigid.translation.vector;
        let sum = map(&X_WS1, &p_WT) * d_1 + map(&X_WS2, &p_WT) * d_2;
        let error = Vector6::from(tcp_error(&rigid, &flexible));
        // Second order: about size² times a length of a few metres; measured 4.2e-10.
        prop_assert!((sum - error).norm() < 2e-9);
    }
}

#[test]
fn the_peak_of_a_contribution_is_the_first_of_equal_ones_and_rotation_has_its_own() {
    let mut peak = ContributionPeak::default();
    for (t, x, turn) in [(0.0, 1e-3, 2e-3), (0.1, -3e-3, 0.0), (0.2, 3e-3, 1e-3)] {
        peak.update(t, &Vector6::new(x, 0.0, 0.0, 0.0, turn, 0.0));
    }
    assert_eq!(peak, ContributionPeak { peak_m: 3e-3, t_peak_s: 0.1, peak_rad: 2e-3 });
}

#[test]
fn strain_is_the_change_over_the_length() {
    assert_eq!(engineering_strain(-1e-3, 0.5), Some(-2e-3));
    assert_eq!(engineering_strain(1e-3, 0.0), None);
}
