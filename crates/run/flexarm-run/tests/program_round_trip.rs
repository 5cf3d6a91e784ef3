//! Program targets that are read to joints and written again give the same joints, including their
//! branch of the inverse kinematics.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use flexarm_kinematics::{Data, Model, Pose, forward_kinematics};
use flexarm_path::program::{Item, Target};
use flexarm_path::{JointBounds, PathOptions, ProgramArm, target_at, target_joints};
use flexarm_programs::{NewTarget, ProgramText, ReadOptions, read_program_text};
use flexarm_run::Robot;
use flexarm_testkit::Draw;
use nalgebra::{DVector, UnitQuaternion};

/// A KUKA arm whose joints equal the axes of its controller.
fn model() -> std::sync::Arc<Model> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../robots/kr210");
    Robot::load(root).unwrap().rigid_model().unwrap()
}

fn arm_of(model: &Model) -> ProgramArm<'_> {
    ProgramArm {
        model,
        flange: model.frame("tool0").unwrap().clone(),
        X_FT: Pose::identity(),
        X_MW: Pose::identity(),
        axes: (0..6).collect(),
        controller: Vec::new(),
        bounds: vec![JointBounds { velocity: 2.0, acceleration: 5.0, torque: None, jerk: None }; 6],
        rest: DVector::zeros(model.nv()),
        starts_at_rest: false,
    }
}

fn flange(model: &Model, q: &[f64; 6]) -> Pose {
    let mut data = Data::new(model);
    forward_kinematics(model, &mut data, &DVector::from_column_slice(q));
    data.X_WF(model.frame("tool0").unwrap())
}

/// Distance of the wrist centre ahead of axis 1 (m) and angle of axis 3 beyond the stretched arm
/// (rad), with the lengths in the arm's README.
fn sides(q: &[f64; 6]) -> [f64; 2] {
    let (a2, a23) = (q[1], q[1] + q[2]);
    let ahead = 0.33 + 1.15 * a2.cos() + 1.22 * a23.cos() + 0.115 * a23.sin();
    [ahead, q[2] - 0.115_f64.atan2(1.22)]
}

/// Axis values within the limits, away from singular poses.
fn random_axes(draw: &mut Draw, model: &Model) -> [f64; 6] {
    loop {
        let q: [f64; 6] = std::array::from_fn(|k| {
            let limits = &model.coordinates()[k].limits;
            draw.between(limits.lower + 0.01, limits.upper - 0.01)
        });
        let [ahead, bend] = sides(&q);
        if ahead.abs() > 0.15 && bend.abs() > 0.15 && q[4].abs() > 0.15 {
            return q;
        }
    }
}

/// Targets in a language with its full branch information, by closed forms.
fn program(language: &str, model: &Model, all: &[[f64; 6]]) -> String {
    let mut text = match language {
        "src" => "DEF m()\n$TOOL={X 0,Y 0,Z 0,A 0,B 0,C 0}\nPTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0}\n".to_owned(),
        _ => "MODULE m\nPROC main()\n".to_owned(),
    };
    for q in all {
        let X = flange(model, q);
        let p = X.translation.vector * 1e3;
        let [ahead, bend] = sides(q);
        if language == "src" {
            let (c, b, a) = X.rotation.euler_angles();
            let [a, b, c] = [a, b, c].map(f64::to_degrees);
            let status = u8::from(ahead < 0.0) + 2 * u8::from(bend > 0.0) + 4 * u8::from(q[4] < 0.0) + 16;
            let turn = (0..6).map(|k| u8::from(q[k] < 0.0) << k).sum::<u8>();
            let (x, y, z) = (p.x, p.y, p.z);
            writeln!(text, "PTP {{X {x:.9},Y {y:.9},Z {z:.9},A {a:.10},B {b:.10},C {c:.10},S {status},T {turn}}}")
                .unwrap();
        } else {
            let r = UnitQuaternion::from_rotation_matrix(&X.rotation);
            let quarter = |k: usize| (q[k].to_degrees() / 90.0).floor();
            let cfx = 4 * u8::from(ahead < 0.0) + 2 * u8::from(bend < 0.0) + u8::from(q[4] < 0.0);
            let conf = format!("[{},{},{},{cfx}]", quarter(0), quarter(3), quarter(5));
            let place = format!("[{:.9},{:.9},{:.9}],[{:.12},{:.12},{:.12},{:.12}]", p.x, p.y, p.z, r.w, r.i, r.j, r.k);
            writeln!(text, "MoveJ [{place},{conf},[9E9,9E9,9E9,9E9,9E9,9E9]],v500,fine,tool0;").unwrap();
        }
    }
    text + if language == "src" { "END\n" } else { "ENDPROC\nENDMODULE\n" }
}

fn read(language: &str, text: &[u8], arm: &ProgramArm<'_>) -> (ProgramText, Vec<[f64; 6]>) {
    let options = ReadOptions { find_companions: false, ..ReadOptions::default() };
    let read = read_program_text(Path::new(&format!("m.{language}")), text, &options).unwrap();
    let joints = target_joints(&read.program, arm, &PathOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let six = |q: &Option<DVector<f64>>| std::array::from_fn(|k| q.as_ref().unwrap()[k]);
    let poses = read.program.items.len() - usize::from(language == "src");
    let joints = joints[joints.len() - poses..].iter().map(six).collect();
    (read, joints)
}

fn assert_same(found: &[[f64; 6]], meant: &[[f64; 6]], bound: f64) {
    assert_eq!(found.len(), meant.len());
    for (found, meant) in found.iter().zip(meant) {
        let off = found.iter().zip(meant).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < bound, "{off:.1e}: {found:?} instead of {meant:?}");
    }
}

/// Truth: the axis values from which the targets were made, by closed forms of status, turn and
/// confdata.
#[test]
fn joints_of_a_program_come_back_from_its_targets_and_from_those_that_are_written_in_their_place() {
    let model = model();
    let arm = arm_of(&model);
    let mut draw = Draw(7);
    let all: Vec<[f64; 6]> = (0..400).map(|_| random_axes(&mut draw, &model)).collect();
    let moved: Vec<[f64; 6]> = all.iter().map(|q| q.map(|a| a + draw.between(-0.005, 0.005))).collect();
    for language in ["src", "mod"] {
        let (text, found) = read(language, program(language, &model, &all).as_bytes(), &arm);
        assert_same(&found, &all, 1e-8); // measured 1e-9
        // New targets slightly off the old ones, as in compensated programs.
        let first = text.program.items.len() - all.len();
        let targets: Vec<_> = (moved.iter().enumerate())
            .map(|(k, q)| {
                let Item::Move(of) = &text.program.items[first + k] else { panic!() };
                let Target::Pose { X_BT, configuration } = target_at(&arm, of, &DVector::from_column_slice(q)) else {
                    panic!()
                };
                (first + k, NewTarget::Pose { X_BT, configuration }, None)
            })
            .collect();
        let rewritten = text.rewritten(&targets, "moved");
        assert_eq!((rewritten.replaced.len(), rewritten.left.len()), (all.len(), 0));
        let (_, again) = read(language, &rewritten.files[0].1, &arm);
        assert_same(&again, &moved, 1e-5); // four digits of a millimetre; measured 3e-6
        let written = String::from_utf8(rewritten.files[0].1.clone()).unwrap();
        assert!(language == "mod" || written.matches("S 1").count() > 100, "bit 4 of the status is kept");
    }
}

/// Truth: the sign of axis 5 given by the status. Turns are the nearest to the previous move.
#[test]
fn the_status_alone_names_the_side_of_the_wrist() {
    let model = model();
    let arm = arm_of(&model);
    let mut draw = Draw(8);
    let all: Vec<[f64; 6]> = (0..200).map(|_| random_axes(&mut draw, &model)).collect();
    let text = program("src", &model, &all);
    let alone: Vec<String> = text
        .lines()
        .map(|line| line.split(",T ").next().unwrap().to_owned() + if line.contains(",T ") { "}" } else { "" })
        .collect();
    let (_, found) = read("src", (alone.join("\n") + "\n").as_bytes(), &arm);
    for (found, meant) in found.iter().zip(&all) {
        let same = |k: usize| (found[k] - meant[k]).rem_euclid(std::f64::consts::TAU);
        for k in 0..6 {
            assert!(same(k) < 1e-8 || same(k) > std::f64::consts::TAU - 1e-8, "{found:?} instead of {meant:?}");
        }
    }
}
