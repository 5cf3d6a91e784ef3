//! Analytic inverse kinematics against forward kinematics, a multi-start search, and manufacturers'
//! data.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::arms::*;
use flexarm_kinematics::*;
use flexarm_testkit::Draw;
use flexarm_testkit::allocations::count_allocations;
use nalgebra::{DVector, Rotation3, Vector3};

fn apart(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| ((a - b) - TAU * ((a - b) / TAU).round()).abs()).fold(0.0, f64::max)
}

fn random_q(draw: &mut Draw) -> [f64; 6] {
    std::array::from_fn(|_| PI * draw.signed())
}

fn forward(model: &Model, data: &mut Data, frame: &Frame, q: &[f64; 6]) -> Pose {
    forward_kinematics(model, data, &DVector::from_column_slice(q));
    data.X_WF(frame)
}

/// Distance (m) and angle (rad) between two poses.
fn between(A: &Pose, B: &Pose) -> (f64, f64) {
    let R = A.rotation * B.rotation.inverse();
    ((A.translation.vector - B.translation.vector).norm(), rotation_vector(R.matrix()).norm())
}

/// Ratio of smallest to largest singular value of the Jacobian (lengths relative to the reach).
fn dexterity(arm: &Named, data: &Data, reach: f64) -> f64 {
    let mut J = nalgebra::Matrix6xX::zeros(6);
    frame_jacobian(&arm.model, data, &arm.tool(), &mut J);
    J.fixed_rows_mut::<3>(0).scale_mut(1.0 / reach);
    let values = J.singular_values();
    values.min() / values.max()
}

fn all_arms() -> Vec<Named> {
    let mut arms = known_arms();
    arms.extend((1..=4).flat_map(random_arms));
    arms
}

#[test]
fn the_class_of_an_arm_is_found_from_its_axes_alone() {
    for arm in all_arms() {
        let analytic = AnalyticArm::new(&arm.model, &arm.tool()).unwrap_or_else(|e| panic!("{}: {e}", arm.name));
        assert_eq!(analytic.class(), arm.class, "{}", arm.name);
        assert!(analytic.deviation() < 1e-10, "{}: {:.1e}", arm.name, analytic.deviation());
    }
}

/// Truth: the model's own forward kinematics.
#[test]
fn joint_values_are_found_again_from_their_pose_and_every_solution_meets_it() {
    let mut draw = Draw(11);
    let (mut worst_q, mut worst_m, mut worst_rad) = (0.0_f64, 0.0_f64, 0.0_f64);
    for arm in all_arms() {
        let (frame, mut data) = (arm.tool(), Data::new(&arm.model));
        let analytic = AnalyticArm::new(&arm.model, &frame).unwrap();
        let mut solutions = Solutions::default();
        for _ in 0..1500 {
            let q = random_q(&mut draw);
            let X_WT = forward(&arm.model, &mut data, &frame, &q);
            let sharp = dexterity(&arm, &data, analytic.reach());
            analytic.solve(&X_WT, &mut solutions);
            let error = solutions.iter().map(|s| apart(&s.q, &q)).fold(f64::INFINITY, f64::min);
            // Rounding of the pose changes joint values by about 1e-14 over the dexterity.
            assert!(error < 1e-9_f64.max(3e-13 / sharp), "{}: {q:?} is missed by {error:.1e}, {sharp:.1e}", arm.name);
            worst_q = worst_q.max(error * sharp.min(1.0));
            assert!(solutions.len() <= analytic.class().most_solutions(), "{}", arm.name);
            for s in solutions.iter() {
                assert!(s.q.iter().all(|x| *x > -PI && *x <= PI));
                let (m, rad) = between(&forward(&arm.model, &mut data, &frame, &s.q), &X_WT);
                (worst_m, worst_rad) = (worst_m.max(m), worst_rad.max(rad));
                assert!(m <= 2e-12 * analytic.reach().max(1.0) && rad <= 2e-12, "{}: {m:.1e} m, {rad:.1e}", arm.name);
                assert!(!s.free, "{}: {q:?}", arm.name);
            }
        }
    }
    // measured 5.5e-15, 1.3e-13 m, 2.0e-14 rad
    assert!(worst_q < 3e-13 && worst_m < 1e-12 && worst_rad < 2e-13, "{worst_q:.1e} {worst_m:.1e} {worst_rad:.1e}");
}

/// Truth: another algorithm without knowledge of the geometry. It finds no solution that is missing
/// here, but may miss some itself.
#[test]
fn a_search_from_many_starts_finds_the_same_solutions() {
    let mut draw = Draw(5);
    let (mut analytic_total, mut searched_total, mut poses) = (0, 0, 0);
    let mut arms = known_arms();
    arms.extend((1..=2).flat_map(random_arms));
    let options = IkOptions { max_iterations: 60, ..IkOptions::default() };
    for arm in arms {
        let (frame, mut data) = (arm.tool(), Data::new(&arm.model));
        let analytic = AnalyticArm::new(&arm.model, &frame).unwrap();
        let mut solutions = Solutions::default();
        for _ in 0..4 {
            let q = random_q(&mut draw);
            let X_WT = forward(&arm.model, &mut data, &frame, &q);
            analytic.solve(&X_WT, &mut solutions);
            let start = DVector::zeros(6);
            let starts = 250;
            let found =
                inverse_kinematics_from_many_starts(&arm.model, &mut data, &frame, &X_WT, &start, &options, starts);
            for one in found.iter().flatten() {
                let q = std::array::from_fn(|k| one.q[k]);
                let error = solutions.iter().map(|s| apart(&s.q, &q)).fold(f64::INFINITY, f64::min);
                assert!(error < 1e-5, "{}: the search found {q:?}, {error:.1e} from {solutions:?}", arm.name);
            }
            poses += 1;
            analytic_total += solutions.len();
            searched_total += found.map_or(0, |f| f.len());
        }
    }
    // measured: 176 poses, 906 solutions, 904 of them by search
    let counts = (poses, analytic_total, searched_total);
    assert!(searched_total <= analytic_total && searched_total as f64 > 0.97 * analytic_total as f64, "{counts:?}");
}

#[test]
fn labels_tell_the_solutions_of_a_pose_apart() {
    let mut draw = Draw(7);
    for arm in all_arms() {
        let several = matches!(
            arm.class,
            ArmClass::SphericalWrist(PositionForm::General)
                | ArmClass::SphericalShoulder(PositionForm::General)
                | ArmClass::ThreeParallel { meeting: false, .. }
        );
        if several {
            continue;
        }
        let analytic = AnalyticArm::new(&arm.model, &arm.tool()).unwrap();
        let mut solutions = Solutions::default();
        for _ in 0..300 {
            analytic.solve(&analytic.pose(&random_q(&mut draw)), &mut solutions);
            let mut labels: Vec<_> = solutions.iter().map(|s| s.branch.index()).collect();
            labels.sort_unstable();
            labels.dedup();
            assert_eq!(labels.len(), solutions.len(), "{}: {solutions:?}", arm.name);
            for s in solutions.iter() {
                let chosen =
                    analytic.choose(&solutions, &Selection::Branch(s.branch), &ControllerAxes::SAME, &s.q).unwrap();
                assert!(apart(&chosen, &s.q) < 1e-14);
            }
        }
    }
}

/// Boundary of the workspace: one elbow configuration for a stretched arm, none beyond it, where
/// the miss is reported.
#[test]
fn a_stretched_arm_has_one_elbow_and_a_pose_beyond_it_is_told_by_its_distance() {
    let model = Model::new(&irb120()).unwrap();
    let frame = model.frame("tool").unwrap().clone();
    let arm = AnalyticArm::new(&model, &frame).unwrap();
    let mut solutions = Solutions::default();
    // Upper arm 0.27 m, forearm hypot(0.302, 0.07) m; stretched at joint 3 = -(90° - atan2(70,
    // 302)).
    let stretched = -FRAC_PI_2 + 0.07_f64.atan2(0.302);
    let q = [0.4, 0.7, stretched, 0.3, 0.8, -0.2];
    let X = arm.pose(&q);
    arm.solve(&X, &mut solutions);
    assert!(solutions.iter().any(|s| apart(&s.q, &q) < 1e-7)); // measured 3.5e-8: the square root of rounding
    let shoulder = Vector3::new(0.0, 0.0, 0.29);
    let wrist = X * nalgebra::Point3::new(0.0, 0.0, -0.072);
    let outward = (wrist.coords - shoulder).normalize();
    for beyond in [1e-9, 1e-6, 1e-3, 0.1, 3.0] {
        let far = Pose::from_parts((X.translation.vector + outward * beyond).into(), X.rotation);
        arm.solve(&far, &mut solutions);
        assert!(solutions.is_empty(), "{beyond}: {solutions:?}");
        let miss = solutions.miss().unwrap();
        assert!((miss.position_m / beyond - 1.0).abs() < 1e-12 + 1e-15 / beyond, "{miss:?}"); // measured 3.3e-8 at 1e-9 m
        assert!(miss.rotation_rad < 1e-6, "{miss:?}");
        // At the same distance inside: all eight solutions (as the other shoulder reaches too).
        let near = Pose::from_parts((X.translation.vector - outward * beyond.min(0.01)).into(), X.rotation);
        arm.solve(&near, &mut solutions);
        assert_eq!(solutions.len(), 8, "{beyond}");
        assert_eq!(solutions.miss(), None);
    }
}

/// Straight or nearly straight joint 5, for spherical wrists and for Universal Robots arms.
#[test]
fn a_straight_wrist_has_a_representative_that_keeps_its_free_joint_where_it_was() {
    let mut kept = 0;
    for arm in known_arms() {
        let (frame, mut data) = (arm.tool(), Data::new(&arm.model));
        let analytic = AnalyticArm::new(&arm.model, &frame).unwrap();
        let mut draw = Draw(3);
        let mut solutions = Solutions::default();
        for _ in 0..100 {
            let mut q = random_q(&mut draw);
            q[4] = 1.0;
            forward(&arm.model, &mut data, &frame, &q);
            if dexterity(&arm, &data, analytic.reach()) < 0.02 {
                continue; // the arm itself is next to a singular position
            }
            for bend in [0.0, 1e-11, 1e-9, 1e-7, 1e-4] {
                q[4] = bend;
                analytic.solve_near(&analytic.pose(&q), &q, &mut solutions);
                // With a bent wrist, joints 4 and 6 are accurate to rounding over the bend angle,
                // and their sum to rounding.
                let nearest = solutions.nearest(&q).unwrap();
                let tolerance = if bend == 0.0 { 1e-9 } else { 1e-9 + 3e-13 / bend };
                assert!(apart(&nearest.q, &q) < tolerance, "{} {bend}: {q:?} {nearest:?}", arm.name);
                assert_eq!(nearest.free, bend == 0.0, "{} {bend}: {q:?} {nearest:?}", arm.name);
            }
            kept += 1;
            // Without the position as hint: also free, with the free joint at the hint.
            q[4] = 0.0;
            analytic.solve(&analytic.pose(&q), &mut solutions);
            assert!(solutions.iter().any(|s| s.free && s.q[4].abs() < 1e-9), "{}: {solutions:?}", arm.name);
            // Universal Robots arms may not reach with joint 6 there; then it is a multiple of an
            // eighth of a turn away.
            for s in solutions.iter().filter(|s| s.free) {
                let away = match arm.class {
                    ArmClass::SphericalWrist(_) => s.q[3],
                    _ => s.q[5] - PI / 4.0 * (s.q[5] / (PI / 4.0)).round(),
                };
                assert!(away.abs() < 1e-12, "{}: {s:?}", arm.name);
            }
        }
    }
    assert!(kept > 500, "{kept}");
}

#[test]
fn a_wrist_centre_on_axis_1_leaves_joint_1_free_and_keeps_it() {
    let model = Model::new(&irb120()).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let mut solutions = Solutions::default();
    // Wrist centre above axis 2: the triangle of upper arm and forearm, rotated back by its angle
    // at the shoulder.
    let (a, b) = (0.27_f64, 0.302_f64.hypot(0.07));
    for q3 in [-0.6_f64, 0.2, 0.9] {
        // Angle of the forearm to the upper arm; the arm is stretched at -(90° - atan2(70, 302)).
        let bend = q3 + FRAC_PI_2 - 0.07_f64.atan2(0.302);
        let back = (b * bend.sin()).atan2(a + b * bend.cos());
        let q = [1.1, -back, q3, 0.4, -0.7, 0.3];
        arm.solve_near(&arm.pose(&q), &q, &mut solutions);
        let nearest = solutions.nearest(&q).unwrap();
        assert!(nearest.free && apart(&nearest.q, &q) < 1e-9, "{nearest:?}"); // measured 3.3e-16
    }
}

/// Truth: closed form of the wrist centre in the plane of the arm, from the lengths of the data
/// sheet; for bit 2, data recorded by controllers (see the next test).
#[test]
fn kuka_status_and_turn_are_those_of_the_controller() {
    let mut tree = kr300();
    let limits = [185.0, 185.0, -140.0, -5.0, -120.0, 168.0, 350.0, 350.0, 125.0, 125.0, 350.0, 350.0];
    for (k, joint) in tree.joints[..6].iter_mut().enumerate() {
        let (low, high): (f64, f64) =
            if k == 1 || k == 2 { (limits[2 * k], limits[2 * k + 1]) } else { (-limits[2 * k], limits[2 * k]) };
        joint.limits = Limits { lower: low.to_radians(), upper: high.to_radians(), ..Limits::NONE };
    }
    let model = Model::new(&tree).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let axes = ControllerAxes::SAME;
    let degrees = |q: [f64; 6]| q.map(f64::to_radians);
    // Home position of KUKA robots: S 'B010', T 'B000010'.
    let home = degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    assert_eq!((arm.kuka_status(&home, &axes), kuka_turn(&home, &axes)), (Some(2), 2));
    // The arm is stretched at axis 3 = -atan2(41 mm, 1000 mm) = -2.35°.
    assert_eq!(arm.kuka_status(&degrees([10.0, -60.0, -2.3, 5.0, -20.0, 0.0]), &axes), Some(6));
    assert_eq!(arm.kuka_status(&degrees([10.0, -60.0, -2.4, 5.0, 20.0, 0.0]), &axes), Some(0));

    let mut draw = Draw(17);
    let mut solutions = Solutions::default();
    let (mut behind, mut solved) = (0, 0);
    for _ in 0..2000 {
        let q: [f64; 6] = std::array::from_fn(|k| {
            draw.between(model.coordinates()[k].limits.lower, model.coordinates()[k].limits.upper)
        });
        let (a2, a23) = (q[1], q[1] + q[2]);
        let x = 0.35 + 1.15 * a2.cos() + 1.0 * a23.cos() - 0.041 * a23.sin();
        let stretched = -(0.041_f64.atan2(1.0));
        let status = u8::from(x < 0.0) + 2 * u8::from(q[2] > stretched) + 4 * u8::from(q[4] < 0.0);
        assert_eq!(arm.kuka_status(&q, &axes), Some(status), "{q:?}");
        behind += u32::from(x < 0.0);
        // Round trip: the pose with its S and T gives the joint values back, independent of the
        // reference.
        arm.solve(&arm.pose(&q), &mut solutions);
        let meant = Selection::Kuka { status: Some(status), turn: Some(kuka_turn(&q, &axes)) };
        let chosen = arm.choose(&solutions, &meant, &axes, &[0.0; 6]).unwrap();
        let error = chosen.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-8, "{q:?} {chosen:?}"); // measured 7.0e-12
        solved += 1;
    }
    assert!(behind > 200 && solved == 2000);
}

/// Status and turn of points recorded by KUKA controllers: data lists and positions in public
/// programs of welding, milling, printing and handling cells. Bits 3 and 4 of the status do not
/// concern the branch.
const RECORDED_BY_KUKA: [(u8, &[u8]); 5] = [
    (0, &[14]),
    (2, &[2, 3, 10, 11, 34, 35]),
    (6, &[18, 19, 26, 27, 50, 58, 59]),
    (18, &[2, 10, 34]),
    (22, &[18, 26, 27, 50]),
];

/// Truth: status and turn of the same point in [`RECORDED_BY_KUKA`]; the turn gives the signs of
/// the axes.
#[test]
fn the_status_of_axes_with_recorded_signs_is_the_one_that_was_recorded_with_them() {
    let model = Model::new(&kr300()).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let mut draw = Draw(31);
    let mut solutions = Solutions::default();
    for (status, turn) in RECORDED_BY_KUKA.iter().flat_map(|(s, turns)| turns.iter().map(move |t| (*s, *t))) {
        for _ in 0..50 {
            // Axis 3 away from the stretched arm at -2.35°, wrist centre in front of axis 1.
            let largest = [1.5, 1.5, 1.6, 3.0, 2.0, 3.0];
            let q: [f64; 6] = std::array::from_fn(|k| {
                let size = draw.between(0.1, largest[k]);
                if turn >> k & 1 == 1 { -size } else { size }
            });
            let (a2, a23) = (q[1], q[1] + q[2]);
            if 0.35 + 1.15 * a2.cos() + a23.cos() - 0.041 * a23.sin() < 0.05 {
                continue;
            }
            assert_eq!(kuka_turn(&q, &ControllerAxes::SAME), turn);
            assert_eq!(arm.kuka_status(&q, &ControllerAxes::SAME), Some(status & 7), "T {turn}: {q:?}");
            arm.solve(&arm.pose(&q), &mut solutions);
            for turn in [Some(turn), None] {
                let meant = Selection::Kuka { status: Some(status), turn };
                let chosen = arm.choose(&solutions, &meant, &ControllerAxes::SAME, &[0.0; 6]).unwrap();
                assert!(apart(&chosen, &q) < 1e-8, "{meant:?}: {chosen:?} {q:?}");
            }
        }
    }
}

/// Truth: positions that a controller recorded both as axis values (degrees) and as a target with
/// confdata: IRB 4600-40/2.55 arms on gantries, from the public backup of a research cell.
#[test]
fn the_confdata_of_recorded_axes_are_those_that_the_controller_recorded_with_them() {
    let recorded = [
        ([-129.552, -20.8879, 34.2834, 126.408, 88.3995, -56.5566], [-2, 1, -1, 0]),
        ([180.0, 90.0, 1.01189e-28, 0.0, 5.25048e-29, -1.2737e-28], [2, 0, -1, 0]),
        ([-62.5085, -53.3891, 33.5052, 180.037, 70.2409, -27.766], [-1, 2, -1, 0]),
        ([-62.5085, -53.389, 33.5055, 180.037, 70.2406, -27.7658], [-1, 2, -1, 0]),
        ([0.000460403, 89.9923, -0.000577472, -0.000631446, 15.0005, -0.00429965], [0, -1, -1, 0]),
    ];
    let model = Model::new(&irb4600()).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    for (degrees, [a, b, c, cfx]) in recorded {
        let q = degrees.map(f64::to_radians);
        assert_eq!(arm.abb_configuration(&q, &ControllerAxes::SAME), Some(([a, b, c], cfx)), "{degrees:?}");
    }
}

/// Truth: table of the manual, from the wrist centre in the plane of the arm.
#[test]
fn abb_confdata_are_those_of_the_manual() {
    let mut tree = irb120();
    let limits = [(-165.0, 165.0), (-110.0, 110.0), (-110.0, 70.0), (-160.0, 160.0), (-120.0, 120.0), (-400.0, 400.0)];
    for (joint, (low, high)) in tree.joints[..6].iter_mut().zip(limits) {
        joint.limits = Limits { lower: f64::to_radians(low), upper: f64::to_radians(high), ..Limits::NONE };
    }
    let model = Model::new(&tree).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let axes = ControllerAxes::SAME;
    assert_eq!(arm.abb_configuration(&[0.0, 0.0, 0.0, 0.0, 0.5, 0.0], &axes), Some(([0, 0, 0], 0)));
    let mut draw = Draw(19);
    let mut solutions = Solutions::default();
    let mut seen = [0; 8];
    for _ in 0..3000 {
        let q: [f64; 6] = std::array::from_fn(|k| draw.between(arm.limits()[k].0, arm.limits()[k].1));
        // Wrist centre in the plane of the arm, x forward and z up, relative to axis 2; a positive
        // axis 2 leans the upper arm forward.
        let (lean, turned) = (q[1], q[1] + q[2]);
        let forearm = [0.302 * turned.cos() + 0.07 * turned.sin(), -0.302 * turned.sin() + 0.07 * turned.cos()];
        let x = 0.27 * lean.sin() + forearm[0];
        // In front of the lower arm: on the front side of the line along it, with the lower arm
        // upright.
        let ahead = forearm[0] * lean.cos() - forearm[1] * lean.sin();
        let cfx = 4 * i32::from(x < 0.0) + 2 * i32::from(ahead < 0.0) + i32::from(q[4] < 0.0);
        let quadrant = |a: f64| (a.to_degrees() / 90.0).floor() as i32;
        let expected = ([quadrant(q[0]), quadrant(q[3]), quadrant(q[5])], cfx);
        assert_eq!(arm.abb_configuration(&q, &axes), Some(expected), "{q:?}");
        seen[cfx as usize] += 1;
        arm.solve(&arm.pose(&q), &mut solutions);
        let meant = Selection::Abb { quadrants: expected.0, cfx };
        let chosen = arm.choose(&solutions, &meant, &axes, &[0.0; 6]).unwrap();
        assert!(chosen.iter().zip(&q).all(|(a, b)| (a - b).abs() < 1e-8), "{q:?} {chosen:?}");
    }
    assert!(seen.iter().all(|n| *n > 50), "{seen:?}");
}

#[test]
fn words_choose_the_elbow_above_the_line_from_shoulder_to_wrist() {
    let model = Model::new(&kr300()).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let axes = ControllerAxes::SAME;
    let mut draw = Draw(23);
    let mut solutions = Solutions::default();
    let mut compared = 0;
    for _ in 0..500 {
        let q = random_q(&mut draw);
        arm.solve(&arm.pose(&q), &mut solutions);
        for s in solutions.iter() {
            // In the plane of the arm, x forward and z up (positive KUKA axis 2 turns downward).
            let (a2, a23) = (s.q[1], s.q[1] + s.q[2]);
            let elbow = [1.15 * a2.cos(), -1.15 * a2.sin()];
            let wrist = [elbow[0] + a23.cos() - 0.041 * a23.sin(), elbow[1] - a23.sin() - 0.041 * a23.cos()];
            let (front, beyond_shoulder) = (wrist[0] + 0.35 > 0.0, wrist[0] > 0.0);
            if front != beyond_shoulder {
                continue;
            }
            let above = elbow[1] > wrist[1] * elbow[0] / wrist[0];
            assert_eq!(arm.elbow_up(&s.q), Some(above), "{:?}", s.q);
            let meant =
                Selection::Words { front: Some(front), elbow_up: Some(above), wrist_flipped: Some(s.q[4] < 0.0) };
            let chosen = arm.choose(&solutions, &meant, &axes, &[0.0; 6]).unwrap();
            assert!(apart(&chosen, &s.q) < 1e-12);
            compared += 1;
        }
    }
    assert!(compared > 1000, "{compared}");
}

#[test]
fn whole_turns_within_limits_are_all_shown_and_the_nearest_is_chosen() {
    let mut tree = ur5();
    for joint in &mut tree.joints[..6] {
        joint.limits = Limits { lower: -TAU, upper: TAU, ..Limits::NONE };
    }
    tree.joints[2].limits = Limits { lower: -PI, upper: PI, ..Limits::NONE };
    let model = Model::new(&tree).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let q = [0.5, -1.0, 1.5, -2.0, 2.5, 3.0];
    let mut copies: Vec<[f64; 6]> = Vec::new();
    arm.copies_within_limits(&q, |copy| copies.push(*copy));
    assert_eq!(copies.len(), 32);
    assert!(copies.iter().all(|c| apart(c, &q) < 1e-14 && c.iter().all(|x| x.abs() <= TAU)));
    for near in [[6.0; 6], [-6.0; 6], [1.0, -6.0, 0.0, 5.0, -3.0, 3.0]] {
        let chosen = arm.nearest_within_limits(&q, &near).unwrap();
        let distance = |c: &[f64; 6]| c.iter().zip(&near).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let best = copies.iter().map(distance).fold(f64::INFINITY, f64::min);
        assert!((distance(&chosen) - best).abs() < 1e-12);
    }
    assert_eq!(arm.nearest_within_limits(&[0.0, 0.0, 3.5, 0.0, 0.0, 0.0], &[0.0; 6]).map(|c| c[2]), Some(3.5 - TAU));
}

#[test]
fn a_query_does_not_allocate() {
    for arm in all_arms() {
        let analytic = AnalyticArm::new(&arm.model, &arm.tool()).unwrap();
        let mut draw = Draw(2);
        let mut solutions = Solutions::default();
        let X = analytic.pose(&random_q(&mut draw));
        assert_eq!(count_allocations(|| analytic.solve(&X, &mut solutions)), 0, "{}", arm.name);
        assert!(!solutions.is_empty());
    }
}

/// Files with five digits: π/2 as 1.5708 and lengths to 10 µm.
#[test]
fn an_arm_of_rounded_numbers_is_solved_as_it_is() {
    let mut tree = kr300();
    let mut draw = Draw(29);
    for joint in &mut tree.joints {
        let (roll, pitch, yaw) = joint.X_PJ.rotation.euler_angles();
        let cut = |x: f64| (x * 1e4).round() * 1e-4;
        joint.X_PJ.rotation = Rotation3::from_euler_angles(cut(roll), cut(pitch), cut(yaw));
        joint.X_PJ.translation.vector += draw.vector(5e-6);
    }
    let model = Model::new(&tree).unwrap();
    let (frame, mut data) = (model.frame("tool").unwrap().clone(), Data::new(&model));
    let arm = AnalyticArm::new(&model, &frame).unwrap();
    assert_eq!(arm.class(), ArmClass::SphericalWrist(PositionForm::Parallel23));
    assert!(arm.deviation() > 1e-7 && arm.deviation() < AXIS_TOLERANCE, "{:.1e}", arm.deviation());
    let mut solutions = Solutions::default();
    let mut found = 0;
    for _ in 0..1000 {
        let q = random_q(&mut draw);
        let X_WT = forward(&model, &mut data, &frame, &q);
        arm.solve(&X_WT, &mut solutions);
        found += usize::from(solutions.iter().any(|s| apart(&s.q, &q) < 1e-9));
        for s in solutions.iter() {
            let (m, rad) = between(&forward(&model, &mut data, &frame, &s.q), &X_WT);
            assert!(m < 3e-12 && rad < 2e-12, "{m:.1e} {rad:.1e}");
        }
    }
    assert!(found >= 995, "{found}"); // measured 999: the other is within the tolerance of a boundary
}

#[test]
fn arms_without_a_closed_form_are_refused_with_what_they_lack() {
    let refuse = |tree: &Mechanism| {
        let model = Model::new(tree).unwrap();
        AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap_err()
    };
    let mut draw = Draw(31);
    let axes = std::array::from_fn(|_| (draw.vector(1.0), draw.vector(0.7)));
    let error = refuse(&from_axes("skew", &axes, &mut draw));
    assert!(matches!(error, NoAnalyticIk::NoClass { wrist_m, .. } if wrist_m > 1e-3), "{error}");

    let mut five = kr300();
    five.joints[3].kind = JointKind::Fixed;
    assert!(
        refuse(&five)
            .to_string()
            .contains("found 5: [\"joint_1\", \"joint_2\", \"joint_3\", \"joint_5\", \"joint_6\"]")
    );
    let mut slides = kr300();
    slides.joints[2].kind = JointKind::Prismatic(Vector3::z_axis());
    assert_eq!(refuse(&slides), NoAnalyticIk::Joint { joint: "joint_3".into(), what: "is not revolute" });
    let mut flat = kr300();
    // Axis 6 along axis 5: five directions only.
    flat.joints[5].X_PJ.rotation = Rotation3::identity();
    assert!(matches!(refuse(&flat), NoAnalyticIk::Deficient { smallest, .. } if smallest < 1e-9));
    // A wrist with axis 6 offset by 1 mm is not spherical.
    let mut off = kr300();
    off.joints[5].X_PJ.translation.vector.x += 1e-3;
    assert!(matches!(refuse(&off), NoAnalyticIk::NoClass { wrist_m, .. } if (1e-4..1e-3).contains(&wrist_m)));
}

#[test]
fn a_pose_of_numbers_that_are_none_has_no_solution() {
    let model = Model::new(&kr300()).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let mut solutions = Solutions::default();
    arm.solve(&Pose::translation(f64::NAN, 0.0, 1.0), &mut solutions);
    assert!(solutions.is_empty() && solutions.miss().is_none());
}

/// A held seventh axis: the same solutions with the held values as part of the geometry.
#[test]
fn joints_that_are_held_are_part_of_the_geometry() {
    let mut draw = Draw(37);
    let model = Model::new(&iiwa()).unwrap();
    let (frame, mut data) = (model.frame("tool").unwrap().clone(), Data::new(&model));
    let mut solutions = Solutions::default();
    for _ in 0..200 {
        let q = DVector::from_fn(7, |_, _| 2.0 * draw.signed());
        forward_kinematics(&model, &mut data, &q);
        let X_WT = data.X_WF(&frame);
        let arm = AnalyticArm::with_joints(&model, &frame, &[0, 1, 3, 4, 5, 6], &q).unwrap();
        arm.solve(&X_WT, &mut solutions);
        let six = [q[0], q[1], q[3], q[4], q[5], q[6]];
        let error = solutions.iter().map(|s| apart(&s.q, &six)).fold(f64::INFINITY, f64::min);
        assert!(error < 1e-9, "{q} {error:.1e}"); // measured 3.3e-13
    }
    let error = AnalyticArm::new(&model, &frame).unwrap_err();
    assert!(matches!(error, NoAnalyticIk::JointCount { ref joints, .. } if joints.len() == 7), "{error}");
}

/// KUKA LBR iiwa 7 R800, from its data sheet.
fn iiwa() -> Mechanism {
    let (z, y) = (Vector3::z_axis(), Vector3::y_axis());
    let at = |height: f64| Pose::translation(0.0, 0.0, height);
    let rows = [
        (0.15, z, 170.0),
        (0.19, y, 120.0),
        (0.21, z, 170.0),
        (0.19, -y, 120.0),
        (0.21, z, 170.0),
        (0.19, y, 120.0),
        (0.081, z, 175.0),
    ];
    let joints: Vec<_> = rows.iter().map(|(h, axis, _)| (at(*h), JointKind::Revolute(*axis))).collect();
    let mut arm = chain("iiwa 7", &joints, at(0.045));
    for (joint, (_, _, limit)) in arm.joints.iter_mut().zip(rows) {
        joint.limits = Limits { lower: -f64::to_radians(limit), upper: f64::to_radians(limit), ..Limits::NONE };
    }
    arm
}

/// Truth: the whole family of solutions, from the closed form at every value of joint 3.
#[test]
fn seven_joints_settle_at_a_minimum_of_the_rule_over_the_family_of_solutions() {
    let model = Model::new(&iiwa()).unwrap();
    let (frame, mut data) = (model.frame("tool").unwrap().clone(), Data::new(&model));
    let mut draw = Draw(41);
    let options = IkOptions::default();
    for case in 0..12 {
        let q = DVector::from_fn(7, |_, _| 0.9 * draw.signed());
        forward_kinematics(&model, &mut data, &q);
        let X_WT = data.X_WF(&frame);
        let rest = &q + DVector::from_fn(7, |_, _| 0.3 * draw.signed());
        let (rule, middle, weight): (_, _, Vec<f64>) = if case % 2 == 0 {
            (NullSpaceRule::NearestTo(rest.clone()), rest, vec![1.0; 7])
        } else {
            let weight = model.coordinates().iter().map(|c| c.limits.upper.powi(-2)).collect();
            (NullSpaceRule::AwayFromLimits, DVector::zeros(7), weight)
        };
        let found = inverse_kinematics_with_rule(&model, &mut data, &frame, &X_WT, &q, &options, &rule).unwrap();
        assert!(found.settled, "{found:?}");
        forward_kinematics(&model, &mut data, &found.q);
        let (m, rad) = between(&data.X_WF(&frame), &X_WT);
        assert!(m < 2e-10 && rad < 2e-10);
        let measure = |q: &DVector<f64>| (0..7).map(|k| 0.5 * weight[k] * (q[k] - middle[k]).powi(2)).sum::<f64>();
        assert!((measure(&found.q) - found.measure).abs() < 1e-12 && found.measure <= measure(&q));
        // Family near the result: no member of it has a smaller measure.
        let mut solutions = Solutions::default();
        let mut least = f64::INFINITY;
        for k in -400..=400 {
            let mut held = found.q.clone();
            held[2] += 2e-4 * f64::from(k);
            let six = [0, 1, 3, 4, 5, 6];
            let arm = AnalyticArm::with_joints(&model, &frame, &six, &held).unwrap();
            arm.solve(&X_WT, &mut solutions);
            let near = six.map(|j| found.q[j]);
            let Some(s) = solutions.nearest(&near) else { continue };
            if apart(&s.q, &near) < 0.3 {
                for (j, x) in six.into_iter().zip(s.q) {
                    held[j] = x;
                }
                least = least.min(measure(&held));
            }
        }
        // measured 3.8e-10: the tolerance of the pose times what the rule gains by it
        assert!(least.is_finite() && found.measure <= least + 5e-9, "{case}: {} above {least}", found.measure);
    }
}

/// A joint at its limit stays there, and the other joints satisfy the rule.
#[test]
fn the_rule_holds_joints_at_their_limits() {
    let model = Model::new(&iiwa()).unwrap();
    let (frame, mut data) = (model.frame("tool").unwrap().clone(), Data::new(&model));
    let q = DVector::from_vec(vec![0.3, 0.6, 0.2, -1.2, 0.4, 0.7, 0.1]);
    forward_kinematics(&model, &mut data, &q);
    let X_WT = data.X_WF(&frame);
    let mut rest = q.clone();
    rest[6] = 9.0; // beyond its limit of 175°
    let rule = NullSpaceRule::NearestTo(rest);
    let found =
        inverse_kinematics_with_rule(&model, &mut data, &frame, &X_WT, &q, &IkOptions::default(), &rule).unwrap();
    forward_kinematics(&model, &mut data, &found.q);
    assert!(between(&data.X_WF(&frame), &X_WT).0 < 2e-10);
    for (k, c) in model.coordinates().iter().enumerate() {
        assert!(found.q[k] >= c.limits.lower && found.q[k] <= c.limits.upper);
    }
    assert!(found.q[6] > q[6] + 0.2, "{found:?}");
}

/// An arm of no class: the search recovers the joint values, is deterministic, and returns only
/// solutions.
#[test]
fn a_search_from_many_starts_solves_arms_without_a_closed_form() {
    let mut draw = Draw(43);
    let axes = std::array::from_fn(|_| (draw.vector(1.0), draw.vector(0.7)));
    let mut tree = from_axes("skew", &axes, &mut draw);
    // A finger joint, which does not move the frame.
    tree.links.push(Link { name: "finger".into(), inertia: None });
    let slide = JointKind::Prismatic(Vector3::x_axis());
    tree.joints.push(Joint::new("finger", slide, "tool", "finger", Pose::identity()));
    let model = Model::new(&tree).unwrap();
    let (frame, mut data) = (model.frame("tool").unwrap().clone(), Data::new(&model));
    let finger = model.coordinates().iter().position(|c| c.joint == "finger").unwrap();
    let mut start = DVector::zeros(7);
    start[finger] = 0.02;
    let options = IkOptions { max_iterations: 60, ..IkOptions::default() };
    let mut again = 0;
    for _ in 0..10 {
        let mut q = DVector::from_fn(7, |_, _| PI * draw.signed());
        q[finger] = 0.02;
        forward_kinematics(&model, &mut data, &q);
        let X_WT = data.X_WF(&frame);
        let mut search =
            || inverse_kinematics_from_many_starts(&model, &mut data, &frame, &X_WT, &start, &options, 300);
        let found = search().unwrap();
        assert_eq!(search().unwrap(), found);
        again +=
            usize::from(found.iter().any(|f| {
                f.q.iter().zip(q.iter()).all(|(a, b)| ((a - b) - TAU * ((a - b) / TAU).round()).abs() < 1e-6)
            }));
        for f in &found {
            assert!(f.hits > 0 && f.q[finger] == 0.02);
            forward_kinematics(&model, &mut data, &f.q);
            let (m, rad) = between(&data.X_WF(&frame), &X_WT);
            assert!(m <= 1.1e-10 && rad <= 1.1e-10, "{m:.1e} {rad:.1e}");
        }
    }
    assert_eq!(again, 10);
    let far = Pose::translation(50.0, 0.0, 0.0);
    let error = inverse_kinematics_from_many_starts(&model, &mut data, &frame, &far, &start, &options, 20)
        .expect_err("too far");
    // No start comes closer than the stretched arm.
    assert!(error.position_m > 40.0 && error.position_m < 50.0, "{error}");
}

/// Programs have rounded numbers: a home position with axis 5 at zero and axis 6 slightly negative
/// is still S 2, T 2.
#[test]
fn bits_are_not_turned_by_rounding() {
    let mut tree = kr300();
    for joint in &mut tree.joints[..6] {
        joint.limits = Limits { lower: -6.2, upper: 6.2, ..Limits::NONE };
    }
    let model = Model::new(&tree).unwrap();
    let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
    let axes = ControllerAxes::SAME;
    let mut solutions = Solutions::default();
    let home = [0.0, -FRAC_PI_2, FRAC_PI_2, 0.0, 0.0, 0.0];
    for shift in [0.0, 1e-6, -1e-6] {
        // Pose perturbed in either direction, as by rounding in a program.
        let X = arm.pose(&home)
            * Pose::from_parts(
                Vector3::new(shift, -shift, shift).into(),
                Rotation3::from_scaled_axis(Vector3::new(shift, 0.0, shift)),
            );
        arm.solve_near(&X, &home, &mut solutions);
        let meant = Selection::Kuka { status: Some(2), turn: Some(2) };
        let chosen = arm.choose(&solutions, &meant, &axes, &home).unwrap();
        // Joints 1 to 3 are accurate; joints 4 and 6 depend on the wrist bend of 1e-6, but are not
        // a whole turn off.
        assert!((0..3).all(|k| (chosen[k] - home[k]).abs() < 1e-5), "{shift} {chosen:?}");
        assert!(chosen[4].abs() < 1e-5 && (chosen[3] + chosen[5]).abs() < 1e-5, "{chosen:?}");
    }
}

/// If two lines become coplanar, two of the equations become dependent: axes 6 and 1 (three
/// parallel axes in the middle), or axes 6 and 4 (three at the base). No solution is lost at or
/// near these positions.
#[test]
fn positions_where_two_equations_become_one_lose_no_solution() {
    let mut tried = 0;
    for arm in (1..=4).flat_map(random_arms) {
        let (moved, other) = match arm.class {
            ArmClass::ThreeParallel { first: 2, meeting: false } => (3, 0),
            ArmClass::ThreeParallel { first: 1, meeting: false } => (4, 3),
            _ => continue,
        };
        let (frame, mut data) = (arm.tool(), Data::new(&arm.model));
        let analytic = AnalyticArm::new(&arm.model, &frame).unwrap();
        let bodies: Vec<usize> = arm.model.coordinates().iter().map(|c| c.body).collect();
        // Moment of axis 6 about the other axis: zero if they are coplanar.
        let mut moment = |q: &[f64; 6]| {
            forward_kinematics(&arm.model, &mut data, &DVector::from_column_slice(q));
            let line = |k: usize| {
                let JointMotion::Axis(motion) = arm.model.bodies()[bodies[k]].motion else { panic!("an axis") };
                let X = data.X_WB[bodies[k]];
                (X.rotation * motion.axis(), X.translation.vector)
            };
            let ((h, o), (h6, o6)) = (line(other), line(5));
            h.dot(&h6.cross(&(o6 - o)))
        };
        let mut draw = Draw(53);
        let mut solutions = Solutions::default();
        for _ in 0..60 {
            let mut q = random_q(&mut draw);
            let at = |q: &[f64; 6], x: f64| std::array::from_fn(|k| if k == moved { x } else { q[k] });
            let (mut low, mut high) = (q[moved], q[moved] + 1.0);
            let sign = moment(&at(&q, low)) > 0.0;
            if (moment(&at(&q, high)) > 0.0) == sign {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                *(if (moment(&at(&q, middle)) > 0.0) == sign { &mut low } else { &mut high }) = middle;
            }
            for off in [0.0, 1e-9, 1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 1e-4] {
                q[moved] = low + off;
                analytic.solve(&analytic.pose(&q), &mut solutions);
                let error = solutions.iter().map(|s| apart(&s.q, &q)).fold(f64::INFINITY, f64::min);
                assert!(error < 1e-8, "{} {off:e}: {q:?} is missed by {error:.1e}", arm.name);
                tried += 1;
            }
        }
    }
    assert!(tried > 300, "{tried}");
}

/// Calibrated arms: with axes slightly off those of the data sheet, apart from the wrist, they are
/// solved as arms in general position, however close the axes are to parallel or intersecting.
#[test]
fn arms_just_outside_a_class_are_solved_by_the_general_one() {
    for (tilt, shift) in [(3e-5, 0.0), (1e-3, 0.0), (1e-4, 1e-3), (0.03, 0.01)] {
        for mut tree in [kr300(), irb120(), puma()] {
            tree.joints[1].X_PJ.translation.vector += Vector3::new(shift + 1e-3, shift, 0.0);
            tree.joints[2].X_PJ.rotation *= Rotation3::from_euler_angles(tilt, 0.7 * tilt, 0.0);
            let model = Model::new(&tree).unwrap();
            let arm = AnalyticArm::new(&model, model.frame("tool").unwrap()).unwrap();
            assert_eq!(arm.class(), ArmClass::SphericalWrist(PositionForm::General), "{} {tilt} {shift}", tree.name);
            let mut draw = Draw(59);
            let mut solutions = Solutions::default();
            let mut worst = 0.0_f64;
            for _ in 0..1000 {
                let q = random_q(&mut draw);
                arm.solve(&arm.pose(&q), &mut solutions);
                worst = worst.max(solutions.iter().map(|s| apart(&s.q, &q)).fold(f64::INFINITY, f64::min));
            }
            assert!(worst < 1e-8, "{} {tilt} {shift}: {worst:.1e}", tree.name);
        }
    }
}

/// Truth: the same arm with its rail fixed at the limit.
#[test]
fn a_rail_at_its_limit_leaves_the_rule_to_the_joints_behind_it() {
    let on_rail = |rail: JointKind, at: f64| {
        let mut tree = iiwa();
        tree.links.push(Link { name: "floor".into(), inertia: None });
        let mut joint = Joint::new("rail", rail, "floor", "base", Pose::translation(0.0, at, 0.0));
        joint.limits = Limits { lower: -0.1, upper: 0.2, ..Limits::NONE };
        tree.joints.push(joint);
        Model::new(&tree).unwrap()
    };
    let (model, fixed) = (on_rail(JointKind::Prismatic(Vector3::y_axis()), 0.0), on_rail(JointKind::Fixed, 0.2));
    let q = DVector::from_vec(vec![0.05, 0.3, 0.6, 0.2, -1.2, 0.4, 0.7, 0.1]);
    let mut rest = q.clone().add_scalar(0.05);
    rest[0] = 3.0;
    let (frame, mut data) = (model.frame("tool").unwrap().clone(), Data::new(&model));
    forward_kinematics(&model, &mut data, &q);
    let X_WT = data.X_WF(&frame);
    let rule = NullSpaceRule::NearestTo(rest.clone());
    let options = IkOptions::default();
    let found = inverse_kinematics_with_rule(&model, &mut data, &frame, &X_WT, &q, &options, &rule).unwrap();
    assert!(found.settled && (found.q[0] - 0.2).abs() < 1e-12, "{found:?}");

    let (frame, mut data) = (fixed.frame("tool").unwrap().clone(), Data::new(&fixed));
    let rule = NullSpaceRule::NearestTo(rest.rows(1, 7).into_owned());
    let start = found.q.rows(1, 7).into_owned().add_scalar(0.02);
    let held = inverse_kinematics_with_rule(&fixed, &mut data, &frame, &X_WT, &start, &options, &rule).unwrap();
    assert!((held.q - found.q.rows(1, 7)).amax() < 1e-5); // measured 1.2e-8
}
