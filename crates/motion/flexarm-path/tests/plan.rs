//! Programs of moves as motions: the tool follows its path everywhere, and velocities and
//! accelerations keep their limits.

use flexarm_kinematics::{
    AnalyticArm, ControllerAxes, Data, IkOptions, Joint, JointKind, Link, Mechanism, Model, NullSpaceRule,
    forward_kinematics, frame_jacobian, inverse_kinematics_with_rule, kuka_turn,
};
use flexarm_path::program::{Blend, Configuration, Item, Move, MoveKind, Program, Selection, Speed, Target};
use flexarm_path::{
    BLOCKED, ControllerAxis, JointBounds, PathOptions, Planned, ProgramArm, SlowedBy, plan, target_at, target_joints,
};
use flexarm_settings::Place;
use flexarm_spatial::{Pose, rotation_vector};
use flexarm_testkit::reference_arm;
use flexarm_trajectory::JointLimits;
use nalgebra::{DVector, Rotation3, Translation3, Vector3};

const START: [f64; 6] = [0.2, 0.5, 0.7, 0.3, 0.8, -0.4];

struct Cell {
    model: Model,
}

impl Cell {
    fn new() -> Self {
        Self { model: Model::new(&reference_arm(false).mechanism).unwrap() }
    }

    fn arm(&self) -> ProgramArm<'_> {
        let bounds = JointBounds { velocity: 3.0, acceleration: 20.0, torque: None, jerk: None };
        ProgramArm {
            model: &self.model,
            flange: self.model.frame("tcp").unwrap().clone(),
            X_FT: Pose::identity(),
            X_MW: Pose::identity(),
            axes: (0..6).collect(),
            controller: Vec::new(),
            bounds: vec![bounds; 6],
            rest: DVector::from_row_slice(&START),
            starts_at_rest: false,
        }
    }

    fn pose(&self, q: &[f64]) -> Pose {
        let mut data = Data::new(&self.model);
        forward_kinematics(&self.model, &mut data, &DVector::from_row_slice(q));
        data.X_WF(self.model.frame("tcp").unwrap())
    }

    /// Poses at `n + 1` times with joint values and rates.
    fn sampled(&self, planned: &Planned, n: usize) -> Vec<Sampled> {
        let sample = |k: usize| {
            let t = planned.trajectory.duration() * k as f64 / n as f64;
            let (mut q, mut v, mut a) = ([0.0; 6], [0.0; 6], [0.0; 6]);
            planned.trajectory.sample(t, &mut q, &mut v, &mut a);
            Sampled { t, X: self.pose(&q), v, a }
        };
        (0..=n).map(sample).collect()
    }
}

struct Sampled {
    t: f64,
    X: Pose,
    v: [f64; 6],
    a: [f64; 6],
}

fn to(kind: MoveKind, to: Target, speed: Speed, blend: Blend) -> Item {
    let statement = format!("{kind:?}").split_whitespace().next().unwrap().to_owned();
    Item::Move(Move {
        place: Place::of_file("test.toml").line(1),
        statement,
        kind,
        to,
        X_WB: Pose::identity(),
        X_FT: None,
        speed,
        blend,
    })
}

fn joints(q: &[f64]) -> Item {
    to(MoveKind::Joint, Target::Joints(q.to_vec()), Speed::default(), Blend::Stop)
}

fn pose(X: Pose) -> Target {
    Target::Pose { X_BT: X, configuration: Configuration::NEAREST }
}

fn feed(v: f64) -> Speed {
    Speed { linear_m_s: Some(v), linear_m_s2: Some(2.0), ..Speed::default() }
}

fn shifted(X: &Pose, d: [f64; 3]) -> Pose {
    Pose::from_parts(Translation3::from(X.translation.vector + Vector3::from(d)), X.rotation)
}

fn program(items: Vec<Item>) -> Program {
    Program { name: "test".into(), items, ..Program::default() }
}

/// Distance of a point from a polyline.
fn from_polyline(p: &Vector3<f64>, corners: &[Vector3<f64>]) -> f64 {
    let from = |pair: &[Vector3<f64>]| {
        let d = pair[1] - pair[0];
        let part = ((p - pair[0]).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
        (p - pair[0] - d * part).norm()
    };
    corners.windows(2).map(from).fold(f64::INFINITY, f64::min)
}

fn square(X: &Pose, side: f64) -> [Pose; 5] {
    [[0.0; 3], [0.0, side, 0.0], [0.0, side, -side], [0.0, 0.0, -side], [0.0; 3]].map(|d| shifted(X, d))
}

#[test]
fn the_tool_keeps_to_a_square_with_stops_at_every_moment_and_not_at_knots_alone() {
    let cell = Cell::new();
    let corners = square(&cell.pose(&START), 0.2);
    let mut items = vec![joints(&START)];
    items.extend(corners[1..].iter().map(|X| to(MoveKind::Line, pose(*X), feed(0.25), Blend::Stop)));
    let planned = plan(&program(items), &cell.arm(), &PathOptions::default()).unwrap();
    let way: Vec<Vector3<f64>> = corners.iter().map(|X| X.translation.vector).collect();
    let (mut off, mut turned, mut top): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let samples = cell.sampled(&planned, 7919);
    for pair in samples.windows(2) {
        off = off.max(from_polyline(&pair[1].X.translation.vector, &way));
        let R = corners[0].rotation.inverse() * pair[1].X.rotation;
        turned = turned.max(rotation_vector(R.matrix()).norm());
        let step = pair[1].X.translation.vector - pair[0].X.translation.vector;
        top = top.max(step.norm() / (pair[1].t - pair[0].t));
    }
    assert!(off < 1e-9 && turned < 1e-9, "off {off:.1e}, turned {turned:.1e}"); // measured 7.9e-11 m, 4.0e-11 rad
    assert!((top - 0.25).abs() < 2.5e-4, "{top}");
    // Truth: four sides of 0.2 m: v/a + L/v each, and a rise of 0.05 s.
    let truth = 4.0 * (0.25 / 2.0 + 0.2 / 0.25 + 0.05);
    assert!((planned.trajectory.duration() - truth).abs() < 2e-3 * truth, "{} {truth}", planned.trajectory.duration());
    assert_eq!(planned.moves.len(), 4);
    assert!(planned.moves.iter().all(|m| m.slowed.is_none() && (m.top_m_s.unwrap() - 0.25).abs() < 3e-4));
}

#[test]
fn a_blend_leaves_the_corner_within_its_distance_and_the_path_without_a_stop() {
    let cell = Cell::new();
    let corners = square(&cell.pose(&START), 0.2);
    let mut items = vec![joints(&START)];
    let blend = |k: usize| if k == 4 { Blend::Stop } else { Blend::Distance(0.02) };
    items.extend((1..5).map(|k| to(MoveKind::Line, pose(corners[k]), feed(0.25), blend(k))));
    let planned = plan(&program(items), &cell.arm(), &PathOptions::default()).unwrap();
    let way: Vec<Vector3<f64>> = corners.iter().map(|X| X.translation.vector).collect();
    let samples = cell.sampled(&planned, 6007);
    let (mut near_corner, mut off): (f64, f64) = (f64::INFINITY, 0.0);
    for sample in &samples {
        let p = sample.X.translation.vector;
        let distance = from_polyline(&p, &way);
        let corner = way[1..4].iter().map(|c| (p - c).norm()).fold(f64::INFINITY, f64::min);
        near_corner = near_corner.min(corner);
        if corner > 0.02 + 1e-9 {
            off = off.max(distance);
        }
    }
    // By hand: the quintic passes a right angle at 0.265 of its reach.
    assert!(off < 1e-9, "{off:.1e}");
    assert!(near_corner > 0.003 && near_corner < 0.01); // measured 5.3 mm
    let inner = &samples[samples.len() / 10..samples.len() * 9 / 10];
    let slowest =
        inner.windows(2).map(|p| (p[1].X.translation.vector - p[0].X.translation.vector).norm() / (p[1].t - p[0].t));
    assert!(slowest.fold(f64::INFINITY, f64::min) > 0.1);
}

#[test]
fn joint_limits_slow_a_line_and_say_which_joint_it_is() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let mut arm = cell.arm();
    arm.bounds[0].velocity = 0.2;
    let target = shifted(&X, [-0.3, 0.5, 0.0]);
    let items = vec![joints(&START), to(MoveKind::Line, pose(target), feed(1.0), Blend::Stop)];
    let planned = plan(&program(items), &arm, &PathOptions::default()).unwrap();
    let samples = cell.sampled(&planned, 4001);
    let fastest = samples.iter().map(|s| s.v[0].abs()).fold(0.0, f64::max);
    assert!(fastest < 0.2 * (1.0 + 1e-9) && fastest > 0.2 * 0.99, "{fastest}");
    let slowed = planned.moves[0].slowed.as_ref().unwrap();
    assert!(
        matches!(&slowed.by, SlowedBy::JointSpeed(joint) if *joint == cell.model.coordinates()[0].joint),
        "{slowed:?}"
    );
    let hardest = samples.iter().flat_map(|s| s.a).map(f64::abs).fold(0.0, f64::max);
    assert!(hardest < 20.0 * (1.0 + 1e-9), "{hardest}");
}

/// Joint limits for the check.
fn checked(arm: &ProgramArm<'_>) -> Vec<JointLimits> {
    let limits =
        |b: &JointBounds| JointLimits { velocity: b.velocity, acceleration: b.acceleration, ..JointLimits::UNLIMITED };
    arm.bounds.iter().map(limits).collect()
}

/// Truth: the extrema of the polynomials over time.
#[test]
fn a_line_past_a_singular_pose_keeps_the_limits_that_are_checked_with_and_without_jerks() {
    let model = industrial_arm([1.0; 6], [0.0; 6]);
    // The forearm is almost straight halfway.
    let q = [0.0, -1.0, 1.3, 0.0, -0.3, 0.0];
    let pose_at = |q: &[f64]| {
        let mut data = Data::new(&model);
        forward_kinematics(&model, &mut data, &DVector::from_row_slice(q));
        data.X_WF(model.frame("flange").unwrap())
    };
    let beside = shifted(&pose_at(&q), [0.0, 0.02, 0.0]);
    let mut arm = arm_of(&model, Vec::new());
    for (from, end) in [([0.0, 0.0, -0.25], [0.0, 0.0, 0.25]), ([0.0, -0.3, 0.1], [0.0, 0.3, 0.1])] {
        let items = vec![
            joints(&[0.1, -1.0, 1.3, 0.3, 0.5, 0.0]),
            to(MoveKind::Joint, pose(shifted(&beside, from)), Speed::default(), Blend::Stop),
            to(MoveKind::Line, pose(shifted(&beside, end)), feed(0.4), Blend::Stop),
        ];
        arm.bounds = vec![JointBounds { velocity: 100.0, acceleration: 1e4, torque: None, jerk: None }; 6];
        let free = plan(&program(items.clone()), &arm, &PathOptions::default()).unwrap();
        // Each joint is limited to 1/2.6 of the speed that the line requires, and to half of the
        // acceleration.
        for (bounds, peak) in arm.bounds.iter_mut().zip(free.trajectory.peak()) {
            bounds.velocity = peak.velocity.value.abs().max(0.1) / 2.6;
            bounds.acceleration = peak.acceleration.value.abs().max(1.0) / 2.0;
        }
        for jerk in [None, Some(500.0)] {
            arm.bounds.iter_mut().for_each(|bounds| bounds.jerk = jerk);
            let planned = plan(&program(items.clone()), &arm, &PathOptions::default()).unwrap();
            assert_eq!(planned.trajectory.check_limits(&checked(&arm)), [], "{jerk:?}");
            let used = |(peak, bounds): (flexarm_trajectory::JointPeak, &JointBounds)| {
                peak.velocity.value.abs() / bounds.velocity
            };
            let used = planned.trajectory.peak().into_iter().zip(&arm.bounds).map(used).fold(0.0, f64::max);
            assert!(used > 0.9, "{jerk:?} {used}");
        }
    }
}

/// Truth: the speed of the tool from forward kinematics at 40000 times.
#[test]
fn the_tool_does_not_pass_its_speed_in_blends_and_reaches_it() {
    let cell = Cell::new();
    let corners = square(&cell.pose(&START), 0.2);
    for (speed, blend) in [(0.25, 0.02), (0.1, 0.05), (0.05, 0.008)] {
        let mut items = vec![joints(&START)];
        let speeds = Speed { linear_m_s: Some(speed), linear_m_s2: Some(20.0), ..Speed::default() };
        let end = |k: usize| if k == 4 { Blend::Stop } else { Blend::Distance(blend) };
        items.extend((1..5).map(|k| to(MoveKind::Line, pose(corners[k]), speeds, end(k))));
        let planned = plan(&program(items), &cell.arm(), &PathOptions::default()).unwrap();
        let mut data = Data::new(&cell.model);
        let (frame, mut J) = (cell.model.frame("tcp").unwrap(), nalgebra::Matrix6xX::zeros(6));
        let mut top: f64 = 0.0;
        for k in 0..=40_000 {
            let t = planned.trajectory.duration() * f64::from(k) / 40_000.0;
            let (mut q, mut v, mut a) = (DVector::zeros(6), DVector::zeros(6), [0.0; 6]);
            planned.trajectory.sample(t, q.as_mut_slice(), v.as_mut_slice(), &mut a);
            forward_kinematics(&cell.model, &mut data, &q);
            frame_jacobian(&cell.model, &data, frame, &mut J);
            top = top.max((&J * v).fixed_rows::<3>(0).norm());
        }
        // measured 2.7e-7 above
        assert!(top < speed * (1.0 + 1e-6) && top > speed * (1.0 - 1e-3), "{speed} {top}");
    }
}

#[test]
fn a_tool_that_turns_along_an_arc_keeps_both_its_circle_and_its_turn() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let r = 0.1;
    let centre = X.translation.vector - Vector3::y() * r;
    let via = centre + Vector3::z() * r;
    let end = Pose::from_parts(
        Translation3::from(centre - Vector3::y() * r),
        Rotation3::new(Vector3::z() * 0.3) * X.rotation,
    );
    let kind = MoveKind::Arc { via, via_rotation: None, angle: None, turns_with_path: false };
    let items = vec![joints(&START), to(kind, pose(end), feed(0.3), Blend::Stop)];
    let planned = plan(&program(items), &cell.arm(), &PathOptions::default()).unwrap();
    let mut off: f64 = 0.0;
    for sample in cell.sampled(&planned, 2003) {
        let p = sample.X.translation.vector - centre;
        off = off.max((p.norm() - r).abs().max(p.x.abs()));
    }
    assert!(off < 1e-9, "{off:.1e}");
    let length = std::f64::consts::PI * r;
    // Truth: half a circle, an acceleration of 2 m/s² and a rise time of 0.05 s.
    let truth = length / 0.3 + 0.3 / 2.0 + 0.05;
    assert!((planned.trajectory.duration() - truth).abs() < 3e-3 * truth, "{} {truth}", planned.trajectory.duration());
}

#[test]
fn joint_moves_lines_and_splines_blend_into_each_other_with_continuous_accelerations() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let other = [0.5, 0.3, 0.9, 0.1, 0.9, 0.0];
    let spline = |d: [f64; 3], blend| to(MoveKind::Spline, pose(shifted(&X, d)), feed(0.4), blend);
    let items = vec![
        joints(&other),
        to(MoveKind::Joint, Target::Joints(START.to_vec()), Speed::default(), Blend::Distance(0.03)),
        to(MoveKind::Line, pose(shifted(&X, [0.0, 0.15, 0.0])), feed(0.4), Blend::Fraction(0.3)),
        spline([0.05, 0.2, 0.05], Blend::Pass),
        spline([0.0, 0.25, 0.1], Blend::Pass),
        spline([-0.05, 0.2, 0.0], Blend::Stop),
        Item::Dwell { place: Place::of_file("test.toml").line(9), seconds: 0.3 },
        to(
            MoveKind::Joint,
            Target::Joints(other.to_vec()),
            Speed { joint_fraction: Some(0.5), ..Speed::default() },
            Blend::Stop,
        ),
    ];
    let planned = plan(&program(items), &cell.arm(), &PathOptions::default()).unwrap();
    let samples = cell.sampled(&planned, 20011);
    // Two samples 0.2 ms apart differ only by the jerk.
    let jump = samples.windows(2).flat_map(|p| (0..6).map(move |k| (p[1].a[k] - p[0].a[k]).abs())).fold(0.0, f64::max);
    assert!(jump < 1.0, "{jump}"); // measured 0.22 rad/s²
    assert!(planned.trajectory.velocity_jumps().is_empty());
    let speed = samples.iter().rev().take(1000).flat_map(|s| s.v).map(f64::abs).fold(0.0, f64::max);
    assert!(speed <= 1.5 * 1.002);
    // The path passes the knot of the spline.
    let knot = X.translation.vector + Vector3::new(0.0, 0.25, 0.1);
    let near = samples.iter().map(|s| (s.X.translation.vector - knot).norm()).fold(f64::INFINITY, f64::min);
    assert!(near < 1e-4, "{near}");
}

/// Truth: the TCP path of a joint move, by finite differences.
#[test]
fn a_joint_move_with_a_speed_of_the_tool_keeps_it() {
    let cell = Cell::new();
    let other = [0.9, 0.3, 0.9, 0.1, 0.9, 0.0];
    let items = vec![joints(&START), to(MoveKind::Joint, Target::Joints(other.to_vec()), feed(0.3), Blend::Stop)];
    let planned = plan(&program(items), &cell.arm(), &PathOptions::default()).unwrap();
    let samples = cell.sampled(&planned, 4000);
    let speed = |p: &[Sampled]| (p[1].X.translation.vector - p[0].X.translation.vector).norm() / (p[1].t - p[0].t);
    let top = samples.windows(2).map(speed).fold(0.0, f64::max);
    assert!((top - 0.3).abs() < 1e-3, "{top}");
}

#[test]
fn torque_limits_are_kept_by_inverse_dynamics() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let mut arm = cell.arm();
    for bounds in &mut arm.bounds {
        bounds.acceleration = 1e3;
    }
    let line = |arm: &ProgramArm<'_>| {
        let target = shifted(&X, [-0.3, 0.4, 0.1]);
        let free = Speed::default();
        plan(
            &program(vec![joints(&START), to(MoveKind::Line, pose(target), free, Blend::Stop)]),
            arm,
            &PathOptions::default(),
        )
    };
    let torque = |planned: &Planned| {
        let mut data = Data::new(&cell.model);
        let mut most = [0.0f64; 6];
        for k in 0..=3000 {
            let t = planned.trajectory.duration() * f64::from(k) / 3000.0;
            let mut state = flexarm_kinematics::State::zeros(&cell.model);
            let mut a = DVector::zeros(6);
            planned.trajectory.sample(t, state.q.as_mut_slice(), state.qdot.as_mut_slice(), a.as_mut_slice());
            let tau = flexarm_kinematics::inverse_dynamics(&cell.model, &mut data, &state, &a);
            for joint in 0..6 {
                most[joint] = most[joint].max(tau[joint].abs());
            }
        }
        most
    };
    let free = torque(&line(&arm).unwrap());
    // Four fifths of the torque of joint 1 in the unlimited run; gravity does not act on this
    // joint.
    arm.bounds[0].torque = Some(0.8 * free[0]);
    let bound = torque(&line(&arm).unwrap());
    assert!(bound[0] < 0.8 * free[0] * 1.003 && bound[0] > 0.8 * free[0] * 0.95);
}

#[test]
fn a_program_that_begins_with_a_line_or_leaves_the_reach_is_refused_with_its_line() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let line = |d: [f64; 3]| to(MoveKind::Line, pose(shifted(&X, d)), feed(0.2), Blend::Stop);
    let run = |items| plan(&program(items), &cell.arm(), &PathOptions::default()).unwrap_err();
    let bad = Speed { linear_m_s: Some(0.0), ..Speed::default() };
    for (items, place, code, words) in [
        (vec![line([0.0, 0.1, 0.0])], "test.toml:1", "no-start", "where it starts is not known"),
        (vec![joints(&START), line([0.0, 0.0, 9.0])], "test.toml:1", BLOCKED, "out of reach"),
        (vec![joints(&[0.0; 7])], "test.toml:1", "axes", "7 axis values for an arm of 6 axes"),
        (vec![], "test", "no-move", "has no move"),
        (vec![joints(&START), to(MoveKind::Line, pose(X), bad, Blend::Stop)], "test.toml:1", "value", "the speed"),
    ] {
        let error = run(items);
        assert_eq!((&*error.location, &*error.code), (place, code), "{error}");
        assert!(error.message.contains(words), "{error}");
    }
}

#[test]
fn numbers_beyond_any_motion_are_refused_before_work_begins() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let run = |item| plan(&program(vec![joints(&START), item]), &cell.arm(), &PathOptions::default()).unwrap_err();
    let via = X.translation.vector + Vector3::new(0.0, 0.1, 0.1);
    let arc = MoveKind::Arc { via, via_rotation: None, angle: Some(1e9), turns_with_path: false };
    for item in [
        joints(&[1e300, 0.0, 0.0, 0.0, 0.0, 0.0]),
        joints(&[f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0]),
        to(MoveKind::Line, pose(shifted(&X, [0.0, 1e300, 0.0])), feed(0.2), Blend::Stop),
        to(arc, pose(shifted(&X, [0.0, 0.2, 0.0])), feed(0.2), Blend::Stop),
        Item::Dwell { place: Place::of_file("test.toml").line(1), seconds: 1e300 },
    ] {
        let error = run(item);
        assert_eq!((&*error.location, &*error.code), ("test.toml:1", "value"), "{error}");
    }
    // A speed at which the motion exceeds the maximum duration.
    let slow = to(MoveKind::Line, pose(shifted(&X, [0.0, 0.1, 0.0])), feed(1e-12), Blend::Stop);
    assert!(["trajectory", "time-law", "value"].contains(&&*run(slow).code));
}

#[test]
fn a_dwell_before_the_first_target_is_one_at_that_target() {
    let cell = Cell::new();
    let target = shifted(&cell.pose(&START), [0.0, 0.1, 0.0]);
    let items = vec![
        Item::Dwell { place: Place::of_file("test.toml").line(1), seconds: 0.7 },
        joints(&START),
        to(MoveKind::Line, pose(target), feed(0.2), Blend::Stop),
    ];
    let mut arm = cell.arm();
    arm.rest.fill(0.1);
    let planned = plan(&program(items), &arm, &PathOptions::default()).unwrap();
    let samples = cell.sampled(&planned, 4000);
    assert!((planned.moves[0].span_s[0] - 0.7).abs() < 1e-9);
    assert!(planned.trajectory.velocity_jumps().is_empty());
    let at_rest = samples.iter().filter(|s| s.t < 0.69);
    let start = cell.pose(&START).translation.vector;
    assert!(at_rest.map(|s| (s.X.translation.vector - start).norm()).fold(0.0, f64::max) < 1e-12);
}

/// An upright arm with seven joints, alternating roll and pitch.
fn seven_joints() -> Model {
    let mut arm = Mechanism::new("seven");
    arm.links.push(Link { name: "base".into(), inertia: None });
    for k in 0..7 {
        let (parent, child) = (arm.links[k].name.clone(), format!("link_{k}"));
        arm.links.push(Link { name: child.clone(), inertia: None });
        let axis = if k % 2 == 0 { Vector3::z_axis() } else { Vector3::y_axis() };
        let up = Pose::translation(0.0, 0.0, if k % 2 == 0 { 0.2 } else { 0.15 });
        arm.joints.push(Joint::new(format!("joint_{k}"), JointKind::Continuous(axis), parent, child, up));
    }
    Model::new(&arm).unwrap()
}

/// Program arm with seven joints and its last link as the flange.
fn seven_joint_arm(model: &Model) -> ProgramArm<'_> {
    ProgramArm {
        model,
        flange: model.frame("link_6").unwrap().clone(),
        X_FT: Pose::identity(),
        X_MW: Pose::identity(),
        axes: (0..7).collect(),
        controller: Vec::new(),
        bounds: vec![JointBounds { velocity: 3.0, acceleration: 20.0, torque: None, jerk: None }; 7],
        rest: DVector::zeros(7),
        starts_at_rest: false,
    }
}

const REDUNDANT: [f64; 7] = [0.3, 0.5, 0.2, 0.9, -0.3, 0.7, 0.1];

/// Pose of the last link of that arm.
fn seventh_pose(model: &Model, q: &DVector<f64>) -> Pose {
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, q);
    data.X_WF(model.frame("link_6").unwrap())
}

/// Joints of a planned motion at evenly spaced times, with their rates.
fn joints_over_time(planned: &Planned, n: usize) -> Vec<(DVector<f64>, DVector<f64>)> {
    let at = |k: usize| {
        let t = planned.trajectory.duration() * k as f64 / n as f64;
        let (mut q, mut v, mut a) = (DVector::zeros(7), DVector::zeros(7), [0.0; 7]);
        planned.trajectory.sample(t, q.as_mut_slice(), v.as_mut_slice(), &mut a);
        (q, v)
    };
    (0..=n).map(at).collect()
}

#[test]
fn a_redundant_arm_follows_its_line_with_one_joint_at_rest() {
    let model = seven_joints();
    let X0 = seventh_pose(&model, &DVector::from_row_slice(&REDUNDANT));
    let X1 = shifted(&X0, [0.05, -0.1, 0.05]);
    let items = vec![joints(&REDUNDANT), to(MoveKind::Line, pose(X1), feed(0.1), Blend::Stop)];
    let planned = plan(&program(items), &seven_joint_arm(&model), &PathOptions::default()).unwrap();
    assert_eq!(planned.fixed.len(), 1);
    let way = [X0.translation.vector, X1.translation.vector];
    let off = joints_over_time(&planned, 1500)
        .iter()
        .map(|(q, _)| from_polyline(&seventh_pose(&model, q).translation.vector, &way))
        .fold(0.0, f64::max);
    assert!(off < 1e-9, "{off:.1e}");
}

/// Truth: the posture that the rule finds for the pose alone, and the TCP path.
#[test]
fn a_redundant_arm_goes_to_the_posture_of_its_rule_without_leaving_its_path() {
    let model = seven_joints();
    let q0 = DVector::from_row_slice(&REDUNDANT);
    let X0 = seventh_pose(&model, &q0);
    let (X1, X2) = (shifted(&X0, [0.05, -0.1, 0.05]), shifted(&X0, [-0.05, -0.1, 0.1]));
    let target = DVector::from_row_slice(&[0.1, 0.4, 0.6, 1.0, -0.5, 0.6, 0.0]);
    let line = |X: Pose, blend| to(MoveKind::Line, pose(X), feed(0.1), blend);
    let items = vec![joints(&REDUNDANT), line(X1, Blend::Distance(0.03)), line(X2, Blend::Stop)];
    let run = |rule: Option<NullSpaceRule>| {
        let options = PathOptions { rule, ..PathOptions::default() };
        plan(&program(items.clone()), &seven_joint_arm(&model), &options).unwrap()
    };
    let rule = NullSpaceRule::NearestTo(target.clone());
    let (held, guided) = (run(None), run(Some(rule.clone())));
    let samples = joints_over_time(&guided, 4001);

    // Outside the blend the tool is on its lines, with the same orientation as without the rule,
    // because both TCP paths are the same.
    let way = [X0, X1, X2].map(|X| X.translation.vector);
    let far = |p: &Vector3<f64>| (p - way[1]).norm() > 0.031;
    let (mut off, mut turned) = (0.0_f64, 0.0_f64);
    for (q, _) in &samples {
        let X = seventh_pose(&model, q);
        if far(&X.translation.vector) {
            off = off.max(from_polyline(&X.translation.vector, &way));
            turned = turned.max(rotation_vector((X.rotation * X0.rotation.inverse()).matrix()).norm());
        }
    }
    assert!(off < 1e-9 && turned < 1e-9, "off {off:.1e}, turned {turned:.1e}"); // measured 1.7e-11, 4.9e-11

    // The rates are the derivatives of the positions, also over the blend.
    let dt = guided.trajectory.duration() / 4001.0;
    let rate = |k: usize| (&samples[k + 1].0 - &samples[k - 1].0) / (2.0 * dt) - &samples[k].1;
    let wrong = (1..4001).map(|k| rate(k).amax()).fold(0.0, f64::max);
    assert!(wrong < 1e-4, "{wrong:e}"); // measured 5.1e-6
    assert!(guided.trajectory.velocity_jumps().is_empty());

    let (with, without) = (&samples[4001].0, &joints_over_time(&held, 1)[1].0);
    let best = inverse_kinematics_with_rule(
        &model,
        &mut Data::new(&model),
        model.frame("link_6").unwrap(),
        &X2,
        without,
        &IkOptions::default(),
        &rule,
    );
    let (best, away) = (best.unwrap().q, |q: &DVector<f64>| (q - &target).norm());
    // Measured: 0.7253 rad away with a joint held, 0.4738 with the rule.
    assert!(away(&best) < 0.7 * away(without), "the case has something to gain");
    assert!(away(with) < away(&best) + 1e-3, "{} of {}", away(with), away(&best));
    // Redundant joints move slowly enough not to slow the tool.
    assert!(guided.trajectory.duration() < 1.02 * held.trajectory.duration());
}

/// Typical industrial arm: upright, two parallel axes, a spherical wrist. Joint k turns about
/// `senses[k]` times its axis and has the value `zeros[k]` where that of the arm with senses 1 and
/// zeros 0 is zero.
fn industrial_arm(senses: [f64; 6], zeros: [f64; 6]) -> Model {
    let mut arm = Mechanism::new("six");
    arm.links.push(Link { name: "base".into(), inertia: None });
    let (z, y, x) = (Vector3::z(), Vector3::y(), Vector3::x());
    let places = [
        (Vector3::zeros(), -z),
        (Vector3::new(0.3, 0.0, 0.6), y),
        (Vector3::new(1.1, 0.0, 0.0), y),
        (Vector3::new(0.5, 0.0, 0.1), -x),
        (Vector3::new(0.7, 0.0, 0.0), y),
        (Vector3::zeros(), -x),
    ];
    for (k, (offset, axis)) in places.into_iter().enumerate() {
        let (parent, child) = (arm.links[k].name.clone(), format!("link_{k}"));
        arm.links.push(Link { name: child.clone(), inertia: None });
        let axis = nalgebra::Unit::new_normalize(axis * senses[k]);
        // R(s a, z + s q) = R(a, s z) R(a, q)
        let back = Rotation3::from_axis_angle(&axis, -zeros[k]);
        let X = Pose::from_parts(Translation3::from(offset), back);
        arm.joints.push(Joint::new(format!("joint_{k}"), JointKind::Continuous(axis), parent, child, X));
    }
    let flange = Pose::translation(0.2, 0.0, 0.0);
    arm.links.push(Link { name: "flange".into(), inertia: None });
    arm.joints.push(Joint::new("to_flange", JointKind::Fixed, "link_5", "flange", flange));
    Model::new(&arm).unwrap()
}

fn arm_of<'m>(model: &'m Model, controller: Vec<ControllerAxis>) -> ProgramArm<'m> {
    ProgramArm {
        model,
        flange: model.frame("flange").unwrap().clone(),
        X_FT: Pose::identity(),
        X_MW: Pose::identity(),
        axes: (0..6).collect(),
        controller,
        bounds: vec![JointBounds { velocity: 3.0, acceleration: 20.0, torque: None, jerk: None }; 6],
        rest: DVector::zeros(6),
        starts_at_rest: false,
    }
}

/// Truth: the same program on the arm whose joints are the axes. The difference is 3.7e-8 m or rad
/// along the whole motion, due to the tolerance of the time law's iterations; bound 1e-6.
#[test]
fn an_arm_with_other_zeros_and_senses_runs_a_program_as_the_arm_whose_joints_are_the_axes() {
    let (senses, zeros) = ([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0], [0.4, -1.2, 1.5, 0.3, -0.2, 2.0]);
    let own = industrial_arm([1.0; 6], [0.0; 6]);
    let other = industrial_arm(senses, zeros);
    let controller: Vec<ControllerAxis> =
        senses.into_iter().zip(zeros).map(|(sense, zero)| ControllerAxis { sense, zero, relative: None }).collect();
    let arms = [arm_of(&own, Vec::new()), arm_of(&other, controller)];
    let axes = [0.3, -1.3, 1.6, 0.2, 0.6, -0.4];
    let target = [-0.5, -1.0, 1.2, 0.9, -0.7, 2.6];
    let pose_at = |q: &[f64; 6]| {
        let mut data = Data::new(&own);
        forward_kinematics(&own, &mut data, &DVector::from_row_slice(q));
        data.X_WF(own.frame("flange").unwrap())
    };
    let analytic = AnalyticArm::new(&own, own.frame("flange").unwrap()).unwrap();
    let status = analytic.kuka_status(&target, &ControllerAxes::SAME);
    assert!(status.is_some());
    let turn = Some(kuka_turn(&target, &ControllerAxes::SAME));
    let by_words = Target::Pose {
        X_BT: pose_at(&target),
        configuration: Configuration::Selected(Selection::Kuka { status, turn }),
    };
    let beside = shifted(&pose_at(&axes), [0.0, 0.2, -0.1]);
    let near = Target::Pose { X_BT: pose_at(&target), configuration: Configuration::Near(target.to_vec()) };
    let items = vec![
        joints(&axes),
        to(MoveKind::Line, pose(beside), feed(0.2), Blend::Stop),
        to(MoveKind::Joint, by_words, Speed::default(), Blend::Stop),
        joints(&axes),
        to(MoveKind::Joint, near, Speed::default(), Blend::Stop),
    ];
    let planned = arms.each_ref().map(|arm| plan(&program(items.clone()), arm, &PathOptions::default()).unwrap());
    let duration = planned[0].trajectory.duration();
    assert!((planned[1].trajectory.duration() / duration - 1.0).abs() < 1e-9);
    let mut off: f64 = 0.0;
    for step in 0..=400 {
        let t = duration * f64::from(step) / 400.0;
        let X = [0, 1].map(|k| {
            let (mut q, mut v, mut a) = (DVector::zeros(6), [0.0; 6], [0.0; 6]);
            planned[k].trajectory.sample(t, q.as_mut_slice(), &mut v, &mut a);
            let mut data = Data::new(arms[k].model);
            forward_kinematics(arms[k].model, &mut data, &q);
            data.X_WF(&arms[k].flange)
        });
        off = off.max((X[0].translation.vector - X[1].translation.vector).norm());
        off = off.max((X[0].rotation.inverse() * X[1].rotation).scaled_axis().norm());
    }
    assert!(off < 1e-6, "{off:.1e}");
    // The end has the specified turns.
    let mut end = [0.0; 6];
    planned[1].trajectory.sample(duration, &mut end, &mut [0.0; 6], &mut [0.0; 6]);
    for k in 0..6 {
        assert!((end[k] - (zeros[k] + senses[k] * target[k])).abs() < 1e-9, "axis {k}: {end:?}");
    }
}

/// Truth: the direction of the forearm. If axis 3 is measured against the horizontal, axis 2 does
/// not tilt the forearm.
#[test]
fn an_axis_that_is_counted_against_the_horizontal_keeps_the_forearm_level_while_the_one_before_moves() {
    let model = industrial_arm([1.0; 6], [0.0; 6]);
    let mut controller = vec![ControllerAxis::SAME; 6];
    controller[2].relative = Some((1, -1.0));
    let arm = arm_of(&model, controller);
    let forearm = |a2: f64| {
        let mut q = DVector::zeros(6);
        arm.set_axes(&[0.4, a2, 0.3, 0.0, 0.0, 0.0], &mut q);
        let mut data = Data::new(&model);
        forward_kinematics(&model, &mut data, &q);
        data.X_WF(model.frame("link_2").unwrap()).rotation
    };
    let tilted = (forearm(-1.2).inverse() * forearm(-0.3)).scaled_axis().norm();
    assert!(tilted < 1e-12, "{tilted:.1e}");
}

/// Truth: the joints from which the targets were computed, with blends, knots of a spline and
/// coupled controller axes.
#[test]
fn joints_at_targets_are_those_that_the_targets_were_made_of_and_make_them_again() {
    let cell = Cell::new();
    let mut arm = cell.arm();
    let coupled = ControllerAxis { sense: -1.0, zero: 0.3, relative: Some((1, 0.5)) };
    arm.controller = vec![ControllerAxis::SAME; 6];
    arm.controller[2] = coupled;
    let places: Vec<Vec<f64>> = (0..6)
        .map(|k| START.iter().enumerate().map(|(j, q)| q + 0.03 * f64::from(k) * (1.0 + j as f64).sin()).collect())
        .collect();
    let axes = |q: &[f64]| arm.axis_values(&DVector::from_row_slice(q));
    let mut back = DVector::zeros(6);
    arm.set_axes(&axes(&places[3]), &mut back);
    assert!((back - DVector::from_row_slice(&places[3])).amax() < 1e-15);

    let free = Speed::default();
    let spline = |k: usize, blend| to(MoveKind::Spline, pose(cell.pose(&places[k])), feed(0.1), blend);
    let items = vec![
        to(MoveKind::Joint, Target::Joints(axes(&places[0])), free, Blend::Stop),
        to(MoveKind::Line, pose(cell.pose(&places[1])), feed(0.1), Blend::Distance(0.002)),
        spline(2, Blend::Pass),
        Item::Dwell { place: Place::of_file("test.toml").line(1), seconds: 0.1 },
        spline(3, Blend::Pass),
        // The arm is already there.
        spline(3, Blend::Pass),
        spline(4, Blend::Stop),
        to(MoveKind::Joint, pose(cell.pose(&places[5])), free, Blend::Stop),
    ];
    let program = program(items);
    let found = target_joints(&program, &arm, &PathOptions::default()).unwrap();
    assert!(found[3].is_none());
    for (item, place) in [(0, 0), (1, 1), (2, 2), (4, 3), (5, 3), (6, 4), (7, 5)] {
        let q = found[item].as_ref().unwrap();
        let off = (q - DVector::from_row_slice(&places[place])).amax();
        assert!(off < 1e-8, "item {item}: {off:e}");
        let Item::Move(of) = &program.items[item] else { panic!() };
        match (target_at(&arm, of, q), &of.to) {
            (Target::Joints(new), Target::Joints(old)) => {
                assert!(new.iter().zip(old).all(|(a, b)| (a - b).abs() < 1e-14))
            }
            (Target::Pose { X_BT: new, .. }, Target::Pose { X_BT: old, .. }) => {
                assert!((new.translation.vector - old.translation.vector).norm() < 1e-8);
            }
            other => panic!("{other:?}"),
        }
    }
}

/// Maximum jerk and maximum acceleration jump of each joint.
fn hardest(planned: &Planned) -> Vec<[f64; 2]> {
    planned.trajectory.peak().iter().map(|peak| [peak.jerk.value.abs(), peak.acceleration_jump.value.abs()]).collect()
}

/// Truth: the seven-phase S-curve of one joint, v/a + a/j + L/v.
#[test]
fn one_joint_moves_in_the_least_time_of_its_speed_acceleration_and_jerk() {
    let cell = Cell::new();
    let mut arm = cell.arm();
    let [v, a, j] = [3.0, 20.0, 200.0];
    for bounds in &mut arm.bounds {
        (bounds.velocity, bounds.acceleration, bounds.jerk) = (v, a, Some(j));
    }
    let mut end = START;
    end[0] += 2.0;
    let planned = plan(&program(vec![joints(&START), joints(&end)]), &arm, &PathOptions::default()).unwrap();
    let truth = v / a + a / j + 2.0 / v;
    let late = planned.trajectory.duration() / truth - 1.0;
    let peak = &planned.trajectory.peak()[0];
    assert!(late.abs() < 1e-3, "{late:.1e}"); // measured 1.1e-4
    assert!(peak.jerk.value.abs() < j * 1.001 && peak.acceleration.value.abs() < a * 1.001);
    assert!(peak.acceleration_jump.value.abs() < 1e-6);
}

#[test]
fn jerks_of_all_joints_hold_along_lines_blends_arcs_and_splines() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let mut arm = cell.arm();
    for bounds in &mut arm.bounds {
        bounds.jerk = Some(60.0);
    }
    let spline = |d: [f64; 3], blend| to(MoveKind::Spline, pose(shifted(&X, d)), feed(0.4), blend);
    let via = X.translation.vector + Vector3::new(0.0, 0.2, 0.05);
    let arc = MoveKind::Arc { via, via_rotation: None, angle: None, turns_with_path: false };
    let other = [0.5, 0.3, 0.9, 0.1, 0.9, 0.0];
    let items = vec![
        joints(&other),
        to(MoveKind::Joint, Target::Joints(START.to_vec()), Speed::default(), Blend::Distance(0.03)),
        to(MoveKind::Line, pose(shifted(&X, [0.0, 0.15, 0.0])), feed(0.4), Blend::Distance(0.02)),
        to(arc, pose(shifted(&X, [0.0, 0.25, 0.0])), feed(0.4), Blend::Distance(0.02)),
        to(MoveKind::Line, pose(shifted(&X, [0.05, 0.25, 0.1])), feed(0.4), Blend::Distance(0.02)),
        spline([0.05, 0.2, 0.15], Blend::Pass),
        spline([0.0, 0.15, 0.1], Blend::Pass),
        spline([-0.05, 0.1, 0.0], Blend::Stop),
    ];
    let free = plan(&program(items.clone()), &cell.arm(), &PathOptions::default()).unwrap();
    let planned = plan(&program(items), &arm, &PathOptions::default()).unwrap();
    for [jerk, jump] in hardest(&planned) {
        assert!(jerk < 60.0 * 1.001 && jump < 1e-6, "{jerk} {jump}"); // measured 60.0084, 1.2e-11
    }
    // Corners are rounded without a stop, and the tool keeps its speed elsewhere.
    assert!(planned.stops.is_empty() && hardest(&free).iter().all(|[jerk, _]| *jerk > 180.0));
    let (free, bounded) = (free.trajectory.duration(), planned.trajectory.duration());
    assert!(bounded > free && bounded < 1.15 * free, "{free} {bounded}"); // measured 2.644 s and 2.888 s
    assert!(planned.moves[1].top_m_s.unwrap() > 0.399);
    // The sharp corner between arc and line, where the tool is almost at rest.
    let slowed = planned.moves[2].slowed.as_ref().unwrap();
    assert!(slowed.part < 0.2 && (slowed.time_s - planned.moves[2].span_s[1]).abs() < 0.05, "{slowed:?}");
}

#[test]
fn a_corner_that_the_jerk_of_a_joint_slows_is_told_with_that_joint_and_its_place() {
    let cell = Cell::new();
    let corners = square(&cell.pose(&START), 0.2);
    let mut arm = cell.arm();
    arm.bounds[0].jerk = Some(5.0);
    let speed = Speed { linear_m_s: Some(0.25), ..Speed::default() };
    let line = |k: usize, blend| to(MoveKind::Line, pose(corners[k]), speed, blend);
    let items = vec![joints(&START), line(1, Blend::Distance(0.02)), line(2, Blend::Stop)];
    let planned = plan(&program(items), &arm, &PathOptions::default()).unwrap();
    let slowed = planned.moves[0].slowed.as_ref().unwrap();
    assert_eq!(slowed.by, SlowedBy::JointJerk(cell.model.coordinates()[0].joint.clone()));
    assert!((slowed.time_s - planned.moves[0].span_s[1]).abs() < 0.2, "{slowed:?}");
    let samples = cell.sampled(&planned, 20000);
    let at = samples
        .windows(2)
        .min_by(|a, b| (a[0].t - slowed.time_s).abs().total_cmp(&(b[0].t - slowed.time_s).abs()))
        .unwrap();
    let speed = (at[1].X.translation.vector - at[0].X.translation.vector).norm() / (at[1].t - at[0].t);
    assert!((speed / 0.25 - slowed.part).abs() < 0.01, "{speed} {slowed:?}");
}

#[test]
fn an_arc_that_leaves_a_line_along_its_tangent_is_entered_at_rest_or_by_a_blend_where_jerks_are_bounded() {
    let cell = Cell::new();
    let X = cell.pose(&START);
    let mut arm = cell.arm();
    arm.bounds[2].jerk = Some(200.0);
    let (r, corner) = (0.1, shifted(&X, [0.0, 0.15, 0.0]));
    let centre = corner.translation.vector + Vector3::z() * r;
    let (sin, cos) = (0.5f64.sin(), 0.5f64.cos());
    let via = centre + Vector3::new(0.0, r * sin, -r * cos);
    let end = centre + Vector3::new(0.0, r, 0.0) - corner.translation.vector;
    let arc = MoveKind::Arc { via, via_rotation: None, angle: None, turns_with_path: false };
    let run = |arm: &ProgramArm<'_>, blend| {
        let line = to(MoveKind::Line, pose(corner), feed(0.3), blend);
        let arc = to(arc.clone(), pose(shifted(&corner, end.into())), feed(0.3), Blend::Stop);
        plan(&program(vec![joints(&START), line, arc]), arm, &PathOptions::default()).unwrap()
    };
    // Without a jerk bound the joint accelerations jump at the seam.
    let jumps = |planned: &Planned| hardest(planned).iter().map(|[_, jump]| *jump).fold(0.0, f64::max);
    let free = run(&cell.arm(), Blend::Pass);
    assert!(free.stops.is_empty() && jumps(&free) > 0.5, "{}", jumps(&free));
    let stopped = run(&arm, Blend::Pass);
    assert!(stopped.stops.len() == 1 && stopped.stops[0].1.contains("curvature"), "{:?}", stopped.stops);
    assert!(jumps(&stopped) < 1e-8);
    let blended = run(&arm, Blend::Distance(0.01));
    assert!(blended.stops.is_empty() && jumps(&blended) < 1e-8);
    assert!(blended.trajectory.duration() < stopped.trajectory.duration() - 0.05);
    for planned in [&stopped, &blended] {
        assert!(hardest(planned)[2][0] < 200.0 * 1.001, "{:?}", hardest(planned));
    }
}
