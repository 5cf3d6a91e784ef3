//! Moves against closed forms, continuity of all plans, limits, holds, time scaling.

use approx::assert_relative_eq;
use flexarm_trajectory::{
    JointLimits, LimitKind, MotionLimits, Plan, PlanError, PlannedMove, Profile, Trajectory, TrajectoryError,
};
use proptest::prelude::*;

fn names(n: usize) -> Vec<String> {
    (1..=n).map(|i| format!("joint_{i}")).collect()
}

fn plan(start: &[f64], moves: Vec<PlannedMove>) -> Trajectory {
    Plan { joints: names(start.len()), start: start.to_vec(), moves }.build().unwrap()
}

fn sample(trajectory: &Trajectory, t: f64) -> [Vec<f64>; 3] {
    let n = trajectory.joints().len();
    let mut state = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let [q, qdot, qddot] = &mut state;
    trajectory.sample(t, q, qdot, qddot);
    state
}

/// Truth: D u³ (10 - 15 u + 6 u²), peaks 15/8 D/T and 10/sqrt(3) D/T², 60 D/T³.
#[test]
fn quintic_move_is_the_closed_form() {
    let (from, way, duration) = (0.3, -1.7, 1.2);
    let trajectory = plan(&[from], vec![PlannedMove::quintic(vec![from + way], duration)]);
    for k in 0..=100 {
        let u = f64::from(k) / 100.0;
        let [q, qdot, qddot] = sample(&trajectory, u * duration);
        // measured 7.1e-15, 1.5e-14, 3.2e-14: rounding of coefficients up to 60
        assert!((q[0] - (from + way * u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u))).abs() < 1e-13);
        assert!((qdot[0] - 30.0 * way / duration * (u * (1.0 - u)).powi(2)).abs() < 1e-13);
        assert!((qddot[0] - 60.0 * way / duration.powi(2) * u * (1.0 - u) * (1.0 - 2.0 * u)).abs() < 1e-13);
    }
    let peak = &trajectory.peak()[0];
    assert_relative_eq!(peak.velocity.value, 15.0 / 8.0 * way / duration, max_relative = 1e-13); // measured 1.0e-15
    assert_relative_eq!(peak.velocity.time_s, duration / 2.0, max_relative = 1e-7); // measured 1.1e-15
    let acceleration = 10.0 / 3.0_f64.sqrt() * way.abs() / duration.powi(2);
    assert_relative_eq!(peak.acceleration.value.abs(), acceleration, max_relative = 1e-13); // measured 3.9e-16
    assert_relative_eq!(peak.jerk.value.abs(), 60.0 * way.abs() / duration.powi(3), max_relative = 1e-13);
    assert_eq!(trajectory.warnings(), []);
}

/// Truth: velocities of samples.
#[test]
fn nothing_moves_until_the_motion_says_so() {
    let rest = PlannedMove { hold: 0.7, ..PlannedMove::quintic(vec![0.2, 0.0], 0.5) };
    let trajectory = plan(&[0.2, 0.0], vec![rest, PlannedMove::quintic(vec![0.2, 0.4], 0.8)]);
    let trajectory = trajectory.with_held_joints(&[("held", 1.0)]).unwrap();
    // The first move ends where it starts.
    for (t, until) in [(0.0, 1.2), (0.6, 1.2), (1.2, 1.2), (1.5, 1.5), (2.1, f64::INFINITY)] {
        assert_eq!(trajectory.still_until(t), until, "{t}");
    }
    for k in 0..=1000 {
        let t = 2.0 * f64::from(k) / 1000.0;
        let [_, qdot, _] = sample(&trajectory, t);
        assert!(trajectory.still_until(t) <= t || qdot.iter().all(|v| *v == 0.0), "{t}");
    }
}

/// Truth: the velocity of a trapezoid of 2 s with ramps of 0.5 s is D / 1.5 s, its acceleration
/// that divided by 0.5 s.
#[test]
fn plain_trapezoid_of_given_duration_ramps_for_a_quarter() {
    let profile = Profile::Trapezoid { rounding: 0.0 };
    let trajectory = plan(&[0.0], vec![PlannedMove { profile, ..PlannedMove::quintic(vec![3.0], 2.0) }]);
    let [q, qdot, qddot] = sample(&trajectory, 0.25);
    assert_relative_eq!(q[0], 0.5 * 4.0 * 0.25 * 0.25, max_relative = 1e-14);
    assert_relative_eq!(qdot[0], 1.0, max_relative = 1e-14);
    assert_relative_eq!(qddot[0], 4.0, max_relative = 1e-14);
    assert_eq!(trajectory.kinks(), [0.0, 0.5, 1.5, 2.0]);
    let jumps = trajectory.warnings();
    assert!(jumps.len() == 1 && jumps[0].message.contains("jumps at 4 times"), "{jumps:?}");
}

#[test]
fn rounding_makes_the_acceleration_of_a_trapezoid_continuous() {
    let profile = Profile::Trapezoid { rounding: 0.1 };
    let trajectory = plan(&[0.0], vec![PlannedMove { profile, ..PlannedMove::quintic(vec![3.0], 2.0) }]);
    assert!(trajectory.peak()[0].acceleration_jump.value.abs() < 1e-12); // measured 0
    assert_eq!(trajectory.kinks().len(), 8);
    assert_eq!(trajectory.warnings(), []);
}

/// Two joints with limits 1 and 2 rad/s move by 1 and 4 rad: the second one determines the
/// duration.
#[test]
fn synchronised_joints_stop_together_and_others_as_early_as_they_can() {
    let limit = |velocity| MotionLimits { velocity, ..MotionLimits::UNLIMITED };
    let base = PlannedMove {
        duration: None,
        limits: vec![limit(1.0), limit(2.0)],
        ..PlannedMove::quintic(vec![1.0, 4.0], 1.0)
    };
    let together = plan(&[0.0, 0.0], vec![base.clone()]);
    let apart = plan(&[0.0, 0.0], vec![PlannedMove { synchronised: false, ..base }]);

    assert_relative_eq!(together.duration(), 15.0 / 8.0 * 2.0, max_relative = 1e-14);
    assert_relative_eq!(apart.duration(), together.duration(), max_relative = 1e-14);
    assert_relative_eq!(together.peak()[0].velocity.value, 0.5, max_relative = 1e-13);
    assert_relative_eq!(apart.peak()[0].velocity.value, 1.0, max_relative = 1e-13);
    // At half the duration the joint of the shorter unsynchronised move has just arrived.
    assert_relative_eq!(sample(&apart, apart.duration() / 2.0)[0][0], 1.0, max_relative = 1e-14);
    assert_eq!(sample(&apart, 0.6 * apart.duration())[1][0], 0.0);
}

#[test]
fn nothing_moves_before_the_start_in_a_hold_and_after_the_end() {
    let moves = vec![
        PlannedMove { hold: 0.5, ..PlannedMove::quintic(vec![1.0, 0.0], 1.0) },
        PlannedMove { hold: 0.0, ..PlannedMove::quintic(vec![1.0, 2.0], 1.0) },
        PlannedMove { hold: 0.3, ..PlannedMove::quintic(vec![0.0, 2.0], 1.0) },
    ];
    let trajectory = plan(&[0.0, 0.0], moves);
    for (t, truth) in [(-1.0, [0.0, 0.0]), (1.2, [1.0, 0.0]), (3.7, [0.0, 2.0]), (99.0, [0.0, 2.0])] {
        let [q, qdot, qddot] = sample(&trajectory, t);
        assert_eq!((&q[..], &qdot[..], &qddot[..]), (&truth[..], &[0.0; 2][..], &[0.0; 2][..]), "t = {t}");
    }
    // The second and third moves have no hold between them and count as one.
    let moves: Vec<_> = trajectory.moves().iter().map(|span| (span.start, span.end)).collect();
    assert_eq!(moves, [(0.0, 1.0), (1.5, 3.5)]);
    assert_eq!(trajectory.initial_speed(), 0.0);
}

#[test]
fn twice_the_time_halves_speed_and_quarters_acceleration() {
    let moves = vec![PlannedMove { via: vec![vec![1.0]], ..PlannedMove::quintic(vec![0.5], 1.0) }];
    let fast = plan(&[0.0], moves);
    let slow = fast.scaled(2.0).unwrap();
    for k in 0..=40 {
        let t = f64::from(k) / 40.0;
        let ([q, qdot, qddot], [q2, qdot2, qddot2]) = (sample(&fast, t), sample(&slow, 2.0 * t));
        assert!((q[0] - q2[0]).abs() < 1e-14); // measured 0: the factor is a power of two
        assert!((qdot[0] - 2.0 * qdot2[0]).abs() < 1e-13);
        assert!((qddot[0] - 4.0 * qddot2[0]).abs() < 1e-12);
    }
    for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(fast.scaled(factor), Err(TrajectoryError::Value(_))));
    }
}

#[test]
fn every_passed_limit_is_listed_with_time_and_value() {
    let moves = vec![PlannedMove::quintic(vec![1.0, -1.0, 0.1], 1.0), PlannedMove::quintic(vec![0.0, 0.0, 0.0], 2.0)];
    let trajectory = plan(&[0.0, 0.0, 0.0], moves);
    let limits = [
        JointLimits { lower: -0.5, upper: 0.5, velocity: 15.0 / 8.0, acceleration: 5.0, ..JointLimits::UNLIMITED },
        JointLimits { lower: -0.9, upper: 0.5, velocity: 1.0, ..JointLimits::UNLIMITED },
        JointLimits { lower: f64::NAN, upper: f64::INFINITY, velocity: f64::NAN, ..JointLimits::UNLIMITED },
    ];
    let violations = trajectory.check_limits(&limits);
    let found: Vec<_> = violations.iter().map(|v| (v.joint.as_str(), v.kind)).collect();
    let truth = [
        ("joint_1", LimitKind::Upper),
        ("joint_1", LimitKind::Acceleration),
        ("joint_2", LimitKind::Lower),
        ("joint_2", LimitKind::Velocity),
    ];
    assert_eq!(found, truth); // the speed of joint_1 is at its limit, not beyond

    let upper = &violations[0];
    assert!((upper.value - 1.0).abs() < 1e-14 && (upper.time_s - 1.0).abs() < 1e-6);
    assert!((upper.since_s - 0.5).abs() < 1e-9); // half-way, measured 2.7e-10 (the slack)
    let speed = &violations[3];
    assert_relative_eq!(speed.value, -15.0 / 8.0, max_relative = 1e-13);
    assert_eq!(speed.limit, -1.0);
    // 30 x² = 1 with x = u (1 - u)
    let x = (1.0_f64 / 30.0).sqrt();
    assert!((speed.since_s - 0.5 * (1.0 - (1.0 - 4.0 * x).sqrt())).abs() < 1e-8);
    assert!(
        violations[0].warning().message.contains("\"joint_1\": position rises above its upper limit 0.5000: 1.0000")
    );
}

#[test]
fn joints_can_be_reordered_and_a_mismatch_names_them_all() {
    let trajectory = plan(&[0.1, 0.2, 0.3], vec![PlannedMove::quintic(vec![1.0, 2.0, 3.0], 1.0)]);
    let swapped = trajectory.with_joint_order(&["joint_3", "joint_1", "joint_2"]).unwrap();
    assert_eq!(sample(&swapped, 0.0)[0], [0.3, 0.1, 0.2]);
    assert_eq!(swapped.joints(), ["joint_3", "joint_1", "joint_2"]);

    let message = trajectory.with_joint_order(&["joint_1", "a", "b"]).unwrap_err().to_string();
    for part in
        ["missing \"a\", \"b\"", "unknown \"joint_2\", \"joint_3\"", "it has \"joint_1\", \"joint_2\", \"joint_3\""]
    {
        assert!(message.contains(part), "{message}");
    }
    assert!(trajectory.with_joint_order(&["joint_1", "joint_2", "joint_3", "joint_3"]).is_err());
}

#[test]
fn a_missing_limit_is_named_with_its_move() {
    let base = PlannedMove { duration: None, ..PlannedMove::quintic(vec![0.0, 1.0], 1.0) };
    let plan = Plan { joints: names(2), start: vec![0.0, 0.0], moves: vec![base] };
    let Err(TrajectoryError::Plan(error)) = plan.build() else { panic!("a limit is missing") };
    assert_eq!(error, PlanError::MissingLimit { number: 1, joint: "joint_2".to_owned(), quantity: "velocity" });
}

#[test]
fn a_duration_too_short_for_the_acceleration_limit_is_reported() {
    let limits = vec![MotionLimits { acceleration: 2.0, ..MotionLimits::UNLIMITED }];
    let profile = Profile::Trapezoid { rounding: 0.1 };
    let trajectory = plan(&[0.0], vec![PlannedMove { limits, profile, ..PlannedMove::quintic(vec![1.0], 1.0) }]);
    let warnings = trajectory.warnings();
    let truth = "move 1: the given duration takes the acceleration";
    assert!(warnings.len() == 1 && warnings[0].message.starts_with(truth), "{warnings:?}");
    assert_eq!(trajectory.scaled(3.0).unwrap().warnings(), []);
}

/// Any valid move: profile, durations and limits, holds, via points.
fn any_move() -> impl Strategy<Value = PlannedMove> {
    let profile = prop_oneof![
        Just(Profile::Quintic),
        (0.01..1.0_f64).prop_map(|rounding| Profile::Trapezoid { rounding }),
        Just(Profile::SCurve),
    ];
    let limits = (0.1..5.0_f64, 0.1..20.0_f64, 0.5..200.0_f64)
        .prop_map(|(velocity, acceleration, jerk)| MotionLimits { velocity, acceleration, jerk });
    let point = || prop::collection::vec(-3.0..3.0_f64, 3);
    (
        point(),
        prop::collection::vec(point(), 0..3),
        prop::option::of(0.05..4.0_f64),
        prop_oneof![Just(0.0), 0.0..1.0_f64],
        profile,
        any::<bool>(),
        prop::collection::vec(limits, 3),
    )
        .prop_map(|(to, via, duration, hold, profile, synchronised, limits)| {
            let via = if profile == Profile::Quintic { via } else { Vec::new() };
            PlannedMove { to, via, duration, hold, profile, synchronised, limits }
        })
}

proptest! {
    /// Continuity at every knot, rest at both ends, every goal reached, limits kept if no duration
    /// is given.
    #[test]
    fn every_plan_is_smooth_reaches_its_goals_and_keeps_its_limits(
        moves in prop::collection::vec(any_move(), 1..4),
    ) {
        let is_free = moves.iter().all(|planned| planned.duration.is_none());
        let goal = moves[moves.len() - 1].to.clone();
        let shared = moves[0].limits.clone();
        let moves: Vec<_> =
            moves.into_iter().map(|planned| PlannedMove { limits: shared.clone(), ..planned }).collect();
        let trajectory = Plan { joints: names(3), start: vec![0.0; 3], moves }.build()?;

        for peak in trajectory.peak() {
            let scale = peak.acceleration.value.abs();
            prop_assert!(peak.acceleration_jump.value.abs() <= 1e-9 * scale); // measured 1e-13
        }
        for t in trajectory.kinks() {
            let dt = 1e-7;
            let (before, after) = (sample(&trajectory, t - dt), sample(&trajectory, t + dt));
            for (joint, peak) in trajectory.peak().iter().enumerate() {
                let moved = (after[0][joint] - before[0][joint]).abs();
                prop_assert!(moved <= 2.0 * dt * peak.velocity.value.abs() + 1e-12);
                let sped_up = (after[1][joint] - before[1][joint]).abs();
                prop_assert!(sped_up <= 2.0 * dt * peak.acceleration.value.abs() + 1e-9);
            }
        }
        let [q, qdot, qddot] = sample(&trajectory, trajectory.duration());
        for joint in 0..3 {
            let peak = &trajectory.peak()[joint];
            prop_assert!((q[joint] - goal[joint]).abs() <= 1e-12); // measured 1.6e-14
            prop_assert!(qdot[joint].abs() <= 1e-11 * (1.0 + peak.velocity.value.abs()));
            prop_assert!(qddot[joint].abs() <= 1e-10 * (1.0 + peak.acceleration.value.abs()));
        }
        if is_free {
            let limits: Vec<_> = shared
                .iter()
                .map(|l| JointLimits { velocity: l.velocity, acceleration: l.acceleration, ..JointLimits::UNLIMITED })
                .collect();
            prop_assert_eq!(trajectory.check_limits(&limits), []);
        }
    }
}

/// Truth: the trajectory itself, bit for bit.
#[test]
fn a_trajectory_of_its_pieces_is_the_same() {
    let moves = vec![PlannedMove::quintic(vec![0.4, -1.0], 0.7), PlannedMove::quintic(vec![0.1, 0.2], 1.3)];
    let trajectory = plan(&[0.0, 0.3], moves).scaled(1.1).unwrap();
    let curve = |k: usize| {
        let (knots, pieces) = trajectory.pieces(k).unwrap();
        (trajectory.joints()[k].clone(), knots.to_vec(), pieces)
    };
    let again = Trajectory::of_pieces(vec![curve(0), curve(1)], trajectory.duration()).unwrap();
    assert_eq!(again, trajectory);
    assert!(trajectory.pieces(2).is_none());
    // Numbers that do not form a curve are rejected.
    let (name, knots, pieces) = curve(0);
    let spoilt = [
        (knots[..1].to_vec(), pieces.clone()),
        (knots.iter().map(|t| t + 0.5).collect(), pieces.clone()),
        (knots.clone(), pieces.iter().map(|piece| piece.map(|_| f64::NAN)).collect()),
        (Vec::new(), Vec::new()),
    ];
    for (knots, pieces) in spoilt {
        let made = Trajectory::of_pieces(vec![(name.clone(), knots, pieces)], trajectory.duration());
        assert!(matches!(made, Err(TrajectoryError::OutOfRange { .. })));
    }
}

const LIMITS: MotionLimits = MotionLimits { velocity: 0.8, acceleration: 2.0, jerk: 15.0 };

/// A move by 1 rad, as fast as the limits allow or in a given duration.
fn unit_move(profile: Profile, duration: Option<f64>, limits: MotionLimits) -> Trajectory {
    plan(&[0.0], vec![PlannedMove { profile, duration, limits: vec![limits], ..PlannedMove::quintic(vec![1.0], 1.0) }])
}

fn peak(trajectory: &Trajectory, order: usize) -> f64 {
    let peak = &trajectory.peak()[0];
    [peak.velocity, peak.acceleration, peak.jerk][order - 1].value.abs()
}

/// Truth: 15/8, 10/sqrt(3) and 60 over the powers of the duration.
#[test]
fn quintic_peaks_are_those_of_the_closed_form() {
    let quintic = unit_move(Profile::Quintic, Some(2.0), MotionLimits::UNLIMITED);
    let [v, a, j] = [15.0 / 8.0, 10.0 / 3.0_f64.sqrt(), 60.0];
    assert_relative_eq!(peak(&quintic, 1), v / 2.0, max_relative = 1e-14); // measured 0
    assert_relative_eq!(peak(&quintic, 2), a / 4.0, max_relative = 1e-14); // measured 1.5e-16
    assert_relative_eq!(peak(&quintic, 3), j / 8.0, max_relative = 1e-14); // measured 0
}

/// Truth: T = 1/v + v/a for a travel of 1, and 2/sqrt(a) for one too short to cruise.
#[test]
fn fastest_plain_trapezoid_is_bang_coast_bang() {
    let duration = |limits| unit_move(Profile::Trapezoid { rounding: 0.0 }, None, limits).duration();
    assert_relative_eq!(duration(LIMITS), 1.0 / 0.8 + 0.8 / 2.0, max_relative = 1e-15); // measured 0
    let fast = MotionLimits { velocity: 100.0, ..LIMITS };
    assert_relative_eq!(duration(fast), 2.0 / 2.0_f64.sqrt(), max_relative = 1e-15);
}

/// Truth: T = 1/v + v/a + a/j for a travel of 1 that reaches all three limits.
#[test]
fn fastest_s_curve_reaches_its_limits_and_no_more() {
    let s_curve = |limits| unit_move(Profile::SCurve, None, limits);
    assert_relative_eq!(s_curve(LIMITS).duration(), 1.0 / 0.8 + 0.8 / 2.0 + 2.0 / 15.0, max_relative = 1e-15);
    let cases = [
        (LIMITS, [0.8, 2.0, 15.0]),
        // No cruise; acceleration limit not reached either.
        (MotionLimits { velocity: 9.0, ..LIMITS }, [f64::NAN, 2.0, 15.0]),
        (MotionLimits { velocity: 9.0, acceleration: 90.0, ..LIMITS }, [f64::NAN, f64::NAN, 15.0]),
        (MotionLimits { acceleration: 90.0, ..LIMITS }, [0.8, f64::NAN, 15.0]),
    ];
    for (limits, reached) in cases {
        let motion = s_curve(limits);
        let allowed = [limits.velocity, limits.acceleration, limits.jerk];
        for order in 0..3 {
            let value = peak(&motion, order + 1);
            assert!(value <= allowed[order] * (1.0 + 1e-12)); // measured 2.4e-16 over
            if reached[order].is_finite() {
                assert_relative_eq!(value, reached[order], max_relative = 1e-12); // measured 2.4e-16
            }
        }
    }
}

#[test]
fn shapes_of_given_duration_use_the_acceleration_they_are_allowed() {
    let lasting = |profile, duration| unit_move(profile, Some(duration), LIMITS);
    let trapezoid = Profile::Trapezoid { rounding: 0.1 };
    assert_relative_eq!(peak(&lasting(trapezoid, 2.0), 2), 2.0, max_relative = 1e-12); // measured 0
    let s_curve = lasting(Profile::SCurve, 2.0);
    assert_relative_eq!(peak(&s_curve, 2), 2.0, max_relative = 1e-12); // measured 2.2e-16
    assert_relative_eq!(peak(&s_curve, 3), 15.0, max_relative = 1e-12); // measured 2.4e-16
    // Too short for the limits.
    for profile in [trapezoid, Profile::SCurve] {
        assert!(peak(&lasting(profile, 1.0), 2) > 2.0);
    }
}

#[test]
fn every_shape_ends_at_one_and_at_rest() {
    let trapezoid = |rounding| Profile::Trapezoid { rounding };
    for motion in [
        unit_move(Profile::Quintic, Some(1.3), MotionLimits::UNLIMITED),
        unit_move(trapezoid(0.0), None, LIMITS),
        unit_move(trapezoid(1.0), None, LIMITS),
        unit_move(trapezoid(0.1), Some(1.3), MotionLimits::UNLIMITED),
        unit_move(Profile::SCurve, None, LIMITS),
        unit_move(Profile::SCurve, Some(1.3), MotionLimits::UNLIMITED),
    ] {
        let [s, speed, _] = sample(&motion, motion.duration().next_down());
        assert!((s[0] - 1.0).abs() < 1e-13); // measured 1.2e-15
        assert!(speed[0].abs() < 1e-13); // measured 6.0e-15
    }
}
