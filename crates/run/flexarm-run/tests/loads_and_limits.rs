//! Loads and limits as values: interpolation of samples, violations of effort limits.

use flexarm_kinematics::Wrench;
use flexarm_run::motion_report::of_effort;
use flexarm_run::{AppliedLoad, MotionViolation};
use flexarm_trajectory::Extreme;

/// Truth: the straight lines between the samples.
#[test]
fn a_sampled_load_is_linear_between_its_samples_and_zero_outside() {
    let force = |x: f64| Wrench::new([x, 0.0, -2.0 * x].into(), [0.0, 0.5 * x, 0.0].into());
    let load = AppliedLoad::sampled("tcp", &[1.0, 2.0, 4.0], &[force(1.0), force(3.0), force(-1.0)]).unwrap();
    assert_eq!((load.start_s, load.wrench.jumps.as_slice()), (Some(1.0), &[1.0, 2.0, 4.0][..]));
    for (t, x) in [(1.0, 1.0), (1.25, 1.5), (2.0, 3.0), (3.5, 0.0), (4.0, -1.0), (0.999, 0.0), (4.001, 0.0)] {
        let found = (load.wrench.value)(t);
        assert!((found - force(x)).to_vector().amax() < 1e-15, "{t} s: {found:?}"); // measured 0
    }
    assert!(AppliedLoad::sampled("tcp", &[1.0], &[force(1.0)]).is_err(), "one sample is no curve");
}

#[test]
fn an_effort_beyond_its_limit_is_a_violation_with_the_sentence_of_all_limits() {
    let worst = Extreme { time_s: 0.5, value: -12.0 };
    let violation = of_effort("joint_1", &worst, 0.4, 10.0).unwrap();
    let reported = MotionViolation::from(&violation);
    assert_eq!((reported.kind, reported.value, reported.since_s, reported.limit), ("effort", -12.0, 0.4, 10.0));
    assert_eq!(reported.message, violation.warning().message);
    assert!(reported.message.contains("effort exceeds its limit 10.0000: -12.0000 at t = 0.5000 s"));
    for limit in [12.0, f64::INFINITY, f64::NAN] {
        assert_eq!(of_effort("joint_1", &worst, 0.4, limit), None, "{limit}");
    }
}
