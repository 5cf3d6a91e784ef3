//! Guesses: gears by their class, payloads, and paths of files.

use flexarm_new::Reducer::{Cycloidal, StrainWave};
use flexarm_new::internals::{PEAK_OVER_RATED, class, guessed_payload, relative};

/// One arc minute in a turn: N m per arc minute to N m/rad.
const ARC_MINUTE: f64 = 60.0 * 180.0 / std::f64::consts::PI;

/// Truth: the rows of the tables; between them, a twist under rated torque of about 1e-3 rad.
#[test]
fn the_stiffness_at_the_rated_torque_of_a_size_is_that_of_the_table_and_rises_between() {
    let exact = class(Cycloidal, 412.0).stiffness / (108.0 * ARC_MINUTE) - 1.0;
    assert!(exact.abs() < 1e-12, "{exact:.1e}");
    let found = class(StrainWave, 87.0);
    assert!((found.low / 3.1e4 - 1.0).abs() < 1e-12 && (found.high / 5.7e4 - 1.0).abs() < 1e-12, "{found:?}");
    for reducer in [Cycloidal, StrainWave] {
        let mut before = 0.0;
        for k in 0..400 {
            let rated = 0.5 * 1.03f64.powi(k);
            let found = class(reducer, rated);
            let turned = rated / found.stiffness;
            assert!(found.stiffness > before, "{rated} {found:?}");
            assert!((6e-4..=2.5e-3).contains(&turned), "{rated} N m: {turned:.2e} rad");
            assert!(found.low < found.stiffness && found.stiffness < found.high);
            before = found.stiffness;
        }
    }
}

/// Truth: the catalogues. At one rated torque a cycloidal reducer is 1.5 to 2.8 times as stiff.
#[test]
fn a_strain_wave_arm_is_softer_than_a_cycloidal_one_of_the_same_torque() {
    for rated in [58.0, 167.0, 412.0, 784.0] {
        let ratio = class(Cycloidal, rated).stiffness / class(StrainWave, rated).stiffness;
        assert!((1.4..3.0).contains(&ratio), "{rated} N m: {ratio}");
    }
}

/// Truth: stiffness identified on arms (see the README of each robot), at the maximum torque
/// divided by 2.5.
#[test]
fn main_axes_of_identified_arms_lie_within_the_range_of_their_class() {
    let arms = [
        ("KR 210", [(7290.0, 2_207_197.5), (8910.0, 3_376_721.9), (6988.8, 2_775_692.4)]),
        ("KR 300", [(12842.9, 4.5778e6), (13371.4, 8.7e6), (12616.7, 4.7e6)]),
        ("KR 500", [(13440.0, 2.3e6), (18360.0, 8.6e6), (11027.0, 2.8e6)]),
    ];
    for (arm, axes) in arms {
        for (axis, (effort, identified)) in axes.into_iter().enumerate() {
            let class = class(Cycloidal, effort / PEAK_OVER_RATED);
            assert!((class.low..=class.high).contains(&identified), "{arm} {axis}: {class:?}");
        }
    }
}

#[test]
fn a_guessed_payload_is_a_share_of_the_mass_that_the_effort_limits_carry() {
    assert_eq!(guessed_payload(1000.0, &[]), 150.0);
    // 0.8 * 1000 - 600 = 200 N m remain, at 20 N m per kg.
    assert_eq!(guessed_payload(1000.0, &[(1000.0, 600.0, 20.0)]), 10.0);
    // A limit below the arm's own gravity torque is ignored.
    assert_eq!(guessed_payload(1000.0, &[(500.0, 600.0, 20.0)]), 150.0);
    assert_eq!(guessed_payload(20.6, &[]), 3.0);
    assert_eq!(guessed_payload(0.0, &[]), 0.0);
}

#[test]
fn relative_paths_lead_up_to_what_both_have_and_down_again() {
    let of = |from: &str, to: &str| relative(from.as_ref(), to.as_ref());
    assert_eq!(of("/a/b", "/a/b/x.urdf").as_deref(), Some("x.urdf"));
    assert_eq!(of("/a/new", "/a/urdf/x.urdf").as_deref(), Some("../urdf/x.urdf"));
    assert_eq!(of("/a/b/new", "/a/x.urdf").as_deref(), Some("../../x.urdf"));
}
