//! Plants against the arm that is commanded directly, and their FMUs.

use std::path::{Path, PathBuf};

use crate::helpers::{changed_kr210, of_joints, robot, root, settings, targets, values};
use flexarm::links::reduce::{ReduceJob, ReduceOptions, ReduceOutputs, reduce};
use flexarm::live::{Command, LiveOptions, Servos};
use flexarm::{DriveModel, LinkModel, Modelling, Motion, PayloadChange, Robot, RunOptions, Scenario, Wrench};
use flexarm_fmu::{
    About, Causality, Fmi, FmuError, FmuJob, FmuModel, FmuSettings, Kind, description, export_fmu, open_resources,
};

const TCP: [&str; 3] = ["tcp.position.x", "tcp.position.y", "tcp.position.z"];
const ERROR: [&str; 3] = ["tcp_error.position.x", "tcp_error.position.y", "tcp_error.position.z"];

#[test]
fn a_plant_has_the_bits_of_the_arm_that_is_commanded_directly() {
    let cases = [
        ("kr210", LinkModel::AsFiled, DriveModel::AsFiled),
        ("kr300", LinkModel::Modal, DriveModel::Servo),
        ("test/reference_arm", LinkModel::Lumped, DriveModel::Servo),
        ("palletiser", LinkModel::AsFiled, DriveModel::AsFiled),
        ("manutec_r3", LinkModel::AsFiled, DriveModel::Elastic),
    ];
    for (name, links, drives) in cases {
        let settings = settings(links, drives);
        let mut model = FmuModel::new(&robot(name), &settings).unwrap();
        let arm = Robot::load(robot(name)).unwrap().model(&settings.modelling).unwrap();
        let from = vec![0.1; arm.joints().count()];
        let options = RunOptions::default();
        let mut live = arm.live(Some(&from), 1e-3, &options).unwrap();
        let (q_in, v_in) = (of_joints(&model, "target_position"), of_joints(&model, "target_velocity"));
        q_in.iter().for_each(|&k| model.set(k, 0.1).unwrap());
        model.set_flag(model.find("use_target_velocity").unwrap(), true).unwrap();
        let push = model.find("tcp.force.z").unwrap();
        model.start(0.0).unwrap();
        for k in 0..500 {
            let t = 2e-3 * f64::from(k + 1);
            let (q, qdot) = targets(&from, t);
            let force = if k > 200 { -50.0 } else { 0.0 };
            for (k, reference) in q_in.iter().enumerate() {
                model.set(*reference, q[k]).unwrap();
                model.set(v_in[k], qdot[k]).unwrap();
            }
            model.set(push, force).unwrap();
            model.step(model.time_s(), 2e-3).unwrap();
            let mut wrench = Wrench::zeros();
            wrench.force.z = force;
            live.advance(2e-3, &Command { q: &q, qdot: Some(&qdot), torque: None, wrench }).unwrap();
        }
        let tcp = live.tcp_pose().translation.vector;
        assert_eq!(values(&model, &TCP), tcp.as_slice(), "{name}");
        let error = tcp - live.target_pose().translation.vector;
        assert_eq!(values(&model, &ERROR), error.as_slice(), "{name}");
        let motors: Vec<f64> =
            of_joints(&model, "motor_position").iter().map(|&reference| model.get(reference).unwrap()).collect();
        assert_eq!(motors, live.position(), "{name}");
        let efforts: Vec<f64> = of_joints(&model, "effort").iter().map(|&k| model.get(k).unwrap()).collect();
        assert_eq!(efforts, live.effort(), "{name}");
    }
}

#[test]
fn velocity_and_acceleration_of_the_tcp_are_slopes_of_its_position_and_velocity() {
    // Elastic drives ring at 100 Hz, which differences over 2 ms do not follow in the acceleration.
    let cases = [(DriveModel::Elastic, 2e-4, f64::INFINITY), (DriveModel::Rigid, 2e-4, 1e-2)];
    for (drives, velocity, acceleration) in cases {
        let links = if drives == DriveModel::Rigid { LinkModel::Rigid } else { LinkModel::Lumped };
        let mut model = FmuModel::new(&robot("kr300"), &settings(links, drives)).unwrap();
        let q_in = of_joints(&model, "target_position");
        let of = |what: &str| ["x", "y", "z"].map(|axis| format!("tcp.{what}.{axis}"));
        let names = [of("position"), of("velocity"), of("acceleration")];
        model.start(0.0).unwrap();
        let (h, mut history) = (1e-3, Vec::new());
        for k in 0..400 {
            let (q, _) = targets(&vec![0.0; q_in.len()], h * f64::from(k + 1));
            q_in.iter().zip(q).for_each(|(&reference, q)| model.set(reference, q).unwrap());
            model.step(model.time_s(), h).unwrap();
            history.push(names.each_ref().map(|names| values(&model, &names.each_ref().map(String::as_str))));
        }
        for (order, bound) in [(1, velocity), (2, acceleration)] {
            let largest = history.iter().flat_map(|row| &row[order]).fold(0.0_f64, |m, v| m.max(v.abs()));
            let off = history[2..].windows(3).flat_map(|w| {
                let slope = |c: usize| (w[2][order - 1][c] - w[0][order - 1][c]) / (2.0 * h);
                (0..3).map(|c| (slope(c) - w[1][order][c]).abs()).collect::<Vec<_>>()
            });
            let off = off.fold(0.0, f64::max) / largest;
            println!("{drives:?}, derivative {order} off by {off:.1e} of the largest");
            assert!(off < bound, "{drives:?} {order}: {off:e}");
        }
    }
}

#[test]
fn links_lag_behind_motors_by_torque_over_stiffness() {
    // joint_2 of the arm bears the weight: the deflection is torque over stiffness.
    let mut model = FmuModel::new(&robot("abb_three_mass"), &FmuSettings::default()).unwrap();
    let torque = model.find("tcp.torque.z").unwrap();
    model.set(torque, 0.5).unwrap();
    model.start(0.0).unwrap();
    for k in 0..40_000 {
        model.step(1e-3 * f64::from(k), 1e-3).unwrap();
    }
    let [motor, link] = ["joint.joint_1.motor_position", "joint.joint_1.link_position"];
    let e = values(&model, &[link])[0] - values(&model, &[motor])[0];
    let truth = 0.5 / 20.592_698_274_307_99;
    println!("deflection {e:.9} rad, torque over stiffness {truth:.9} rad");
    assert!((e / truth - 1.0).abs() < 1e-6, "{e} {truth}");
}

#[test]
fn a_payload_twice_as_heavy_sags_as_the_robot_file_with_it() {
    let text = std::fs::read_to_string(robot("kr210")).unwrap();
    let mut model = FmuModel::new(&robot("kr210"), &FmuSettings::default()).unwrap();
    let reference = model.find("payload.mass").unwrap();
    let mass = model.get(reference).unwrap();
    let filed = values(&model, &ERROR);
    model.set(reference, 2.0 * mass).unwrap();
    model.start(0.0).unwrap();
    let heavier = values(&model, &ERROR);
    assert_ne!(filed, heavier);
    let mut document: toml_edit::DocumentMut = text.parse().unwrap();
    document["payload"]["mass"] = toml_edit::value(2.0 * mass);
    let live = changed_kr210(&document).live(Some(&[0.0; 6]), 1e-3, &RunOptions::default()).unwrap();
    let tcp = live.tcp_pose().translation.vector;
    assert_eq!(values(&model, &TCP), tcp.as_slice(), "the static sag does not depend on the payload's inertia");
}

/// Truth: the robot file without the payload, and a run whose payload is put down by its scenario.
#[test]
fn a_payload_that_is_put_down_leaves_the_arm_of_the_robot_file_without_it() {
    let text = std::fs::read_to_string(robot("kr210")).unwrap();
    let mut document: toml_edit::DocumentMut = text.parse().unwrap();
    document.remove("payload").unwrap();
    let empty = changed_kr210(&document);
    let pose = [0.0, -1.0, 1.0, 0.0, 0.0, 0.0];
    let sag = empty.live(Some(&pose), 1e-3, &RunOptions::default()).unwrap().tcp_pose().translation.vector;
    let settings = FmuSettings { pose: Some(pose.to_vec()), ..FmuSettings::default() };
    let mut model = FmuModel::new(&robot("kr210"), &settings).unwrap();
    let attached = model.find("payload.attached").unwrap();
    let loaded = values(&model, &TCP);
    let off = |model: &FmuModel, truth: &[f64]| {
        values(model, &TCP).iter().zip(truth).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
    };
    model.set_flag(attached, false).unwrap();
    model.start(0.0).unwrap();
    let (without, moved) = (off(&model, sag.as_slice()), off(&model, &loaded));
    println!("sag without payload off by {without:.1e} m, with it by {moved:.1e} m");
    assert!(without < 1e-12 && moved > 1e-4, "{without:e} {moved:e}");

    // Put down on the way: the steps of the arm whose scenario does so.
    model.reset();
    model.start(0.0).unwrap();
    let arm = Robot::load(robot("kr210")).unwrap().model(&Modelling::default()).unwrap();
    let still = Motion::from_samples(&[0.0, 0.3], &[pose, pose].concat(), arm.robot()).unwrap();
    let scenario = Scenario::from(&still).with_payload(PayloadChange::release(0.1));
    let run = arm.simulate(&scenario, &RunOptions::default()).unwrap();
    let mut errors = run.error_world_m().chunks_exact(3).skip(1);
    let mut largest = 0.0_f64;
    for k in 0..300 {
        model.set_flag(attached, k < 100).unwrap();
        model.step(model.time_s(), 1e-3).unwrap();
        // The run is sampled at 500 Hz.
        if k % 2 == 0 {
            continue;
        }
        let own = values(&model, &ERROR);
        let apart = own.iter().zip(errors.next().unwrap()).map(|(a, b)| (a - b).abs());
        largest = apart.fold(largest, f64::max);
    }
    assert!(errors.next().is_none());
    println!("run with a payload put down off by {largest:.1e} m");
    assert!(largest < 1e-12, "{largest:e}");

    // At rest again without it, and with it once more.
    for (flag, truth, steps) in [(false, sag.as_slice().to_vec(), 4000), (true, loaded, 12_000)] {
        model.set_flag(attached, flag).unwrap();
        for _ in 0..steps {
            model.step(model.time_s(), 1e-3).unwrap();
        }
        let still_rings = off(&model, &truth);
        println!("{steps} ms later off by {still_rings:.1e} m");
        assert!(still_rings < 5e-6, "{flag}: {still_rings:e}");
    }
    let fixed = FmuModel::new(&robot("test/one_beam"), &FmuSettings::default()).unwrap();
    assert!(fixed.find("payload.attached").is_none());
}

#[test]
fn states_resets_and_open_servos_do_what_they_say() {
    let settings = settings(LinkModel::Modal, DriveModel::Servo);
    let mut model = FmuModel::new(&robot("test/reference_arm"), &settings).unwrap();
    let first = values(&model, &TCP);
    let swing = |model: &mut FmuModel, steps: std::ops::Range<u32>| {
        let q_in = of_joints(model, "target_position");
        for k in steps {
            let (q, _) = targets(&vec![0.0; q_in.len()], 1e-3 * f64::from(k + 1));
            q_in.iter().zip(q).for_each(|(&reference, q)| model.set(reference, q).unwrap());
            model.step(model.time_s(), 1e-3).unwrap();
        }
        values(model, &TCP)
    };
    model.start(0.0).unwrap();
    swing(&mut model, 0..100);
    let state = model.state().unwrap();
    let end = swing(&mut model, 100..200);
    model.restore(&state).unwrap();
    assert_eq!(end, swing(&mut model, 100..200));
    model.reset();
    model.start(0.0).unwrap();
    assert_eq!(first, values(&model, &TCP));
    assert_eq!(end, swing(&mut model, 0..200));

    // Under open servos the torques alone move the arm, as the library does it.
    model.reset();
    model.set_flag(model.find("open_servos").unwrap(), true).unwrap();
    model.start(0.0).unwrap();
    let torques = of_joints(&model, "torque");
    let arm = Robot::load(robot("test/reference_arm")).unwrap().model(&settings.modelling).unwrap();
    let own = LiveOptions { servos: Servos::Open, ..LiveOptions::default() };
    let mut live = arm.live_with(None, 1e-3, &RunOptions::default(), &own).unwrap();
    let given = [30.0, -20.0, 10.0, 1.0, -1.0, 0.5];
    torques.iter().zip(given).for_each(|(&reference, torque)| model.set(reference, torque).unwrap());
    for _ in 0..100 {
        model.step(model.time_s(), 1e-3).unwrap();
        live.step(&Command { q: &[0.0; 6], torque: Some(&given), ..Command::default() }).unwrap();
    }
    assert_eq!(values(&model, &TCP), live.tcp_pose().translation.vector.as_slice());
    assert_ne!(values(&model, &TCP), first);
}

#[test]
fn shorter_communication_steps_converge() {
    let tip = |length: f64| {
        let mut model = FmuModel::new(&robot("kr210"), &FmuSettings::default()).unwrap();
        let q_in = of_joints(&model, "target_position");
        model.start(0.0).unwrap();
        let steps = (0.4 / length).round() as u32;
        for k in 0..steps {
            let (q, _) = targets(&vec![0.0; q_in.len()], length * f64::from(k + 1));
            q_in.iter().zip(q).for_each(|(&reference, q)| model.set(reference, q).unwrap());
            model.step(model.time_s(), length).unwrap();
        }
        values(&model, &TCP)
    };
    // 0.1 ms is shorter than the solver step, 2.5 ms is no multiple of it.
    let best = tip(1e-4);
    let apart = |length: f64| tip(length).iter().zip(&best).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let [coarse, middle, fine] = [1e-2, 2.5e-3, 5e-4].map(apart);
    println!("{coarse:.1e}, {middle:.1e}, {fine:.1e} m from 0.1 ms");
    assert!(fine < 0.5 * middle && middle < 0.5 * coarse && fine < 2e-5, "{coarse:e} {middle:e} {fine:e}");
}

/// Writes an arm of five joints whose hand has as much inertia as its upper arm; returns its robot
/// file.
fn broad_hand(folder: &Path) -> PathBuf {
    // Link, joint: origin, angles, axis; mass, centre, moments of inertia; stiffness of the gearbox.
    let joints = [
        ("pan", "0 0 0.089", "0 0 0", "0 0 1", 3.7, 0.0, [0.010, 0.0067], 25900.0),
        ("upper", "0 0.136 0", "0 1.5708 0", "0 1 0", 8.39, 0.28, [0.227, 0.0151], 25900.0),
        ("fore", "0 -0.12 0.425", "0 0 0", "0 1 0", 2.27, 0.25, [0.0494, 0.0041], 25900.0),
        ("wrist", "0 0 0.392", "0 1.5708 0", "0 1 0", 1.22, 0.0, [0.111, 0.219], 6250.0),
        ("hand", "0 0.093 0", "0 0 0", "0 0 1", 1.22, 0.0, [0.111, 0.219], 6250.0),
    ];
    let mut urdf = "<robot name=\"arm\"><link name=\"base\"/>".to_owned();
    let mut text = "format = 1\nname = \"arm\"\nurdf = \"arm.urdf\"\n".to_owned();
    text += "tcp = { link = \"hand\", xyz = [0.0, 0.0, 0.0], rpy = [0.0, 0.0, 0.0] }\n";
    let mut parent = "base";
    for (name, xyz, rpy, axis, mass, z, [across, along], stiffness) in joints {
        urdf += &format!(
            r#"<joint name="{name}_joint" type="continuous"><parent link="{parent}"/><child link="{name}"/>
            <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/></joint>
            <link name="{name}"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>
            <inertia ixx="{across}" iyy="{across}" izz="{along}" ixy="0" ixz="0" iyz="0"/></inertial></link>"#
        );
        text += &format!("[[drive]]\njoint = \"{name}_joint\"\nkind = \"gearbox\"\n");
        text += &format!("gearbox = {{ stiffness = {stiffness:.1} }}\n");
        parent = name;
    }
    for (link, distal, diameter, wall) in [("upper", "fore", 0.111, 0.02), ("fore", "wrist", 0.081, 0.0075)] {
        text += &format!("[[flexible_link]]\nlink = \"{link}\"\ndistal = \"{distal}_joint\"\n");
        text += &format!("damping = {{ modal = 0.03 }}\nbeam = {{ section = \"tube\", outer_diameter = {diameter}, ");
        text +=
            &format!("wall = {wall}, material = \"aluminium\", y_axis = [1.0, 0.0, 0.0], parts = \"from-link\" }}\n");
    }
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("arm.urdf"), urdf + "</robot>").unwrap();
    std::fs::write(folder.join("robot.toml"), text).unwrap();
    folder.join("robot.toml")
}

/// Targets every two steps of the solver change the accelerations in the rhythm of a mode that
/// changes sign in every step. Truth: targets in every step.
#[test]
fn communication_steps_of_two_solver_steps_excite_no_mode() {
    let folder = std::env::temp_dir().join(format!("flexarm broad hand {}", std::process::id()));
    let path = broad_hand(&folder);
    let errors = |period_ms: usize| -> Vec<Vec<f64>> {
        let mut model = FmuModel::new(&path, &FmuSettings::default()).unwrap();
        let q_in = of_joints(&model, "target_position");
        model.start(0.0).unwrap();
        let h = 1e-3 * period_ms as f64;
        let step = |k: usize| {
            let (q, _) = targets(&vec![0.0; q_in.len()], h * k as f64);
            q_in.iter().zip(q).for_each(|(&reference, q)| model.set(reference, q).unwrap());
            model.step(model.time_s(), h).unwrap();
            values(&model, &ERROR)
        };
        (1..=1500 / period_ms).map(step).collect()
    };
    let every = errors(1);
    let peak = every.iter().flatten().fold(0.0_f64, |most, e| most.max(e.abs()));
    for period_ms in [2, 3, 4] {
        let own = errors(period_ms);
        let truth = every.iter().skip(period_ms - 1).step_by(period_ms);
        let apart = own.iter().zip(truth).flat_map(|(own, truth)| own.iter().zip(truth).map(|(a, b)| (a - b).abs()));
        let apart = apart.fold(0.0, f64::max) / peak;
        println!("targets every {period_ms} ms: {apart:.1e} of the peak from targets every 1 ms");
        assert!(apart < 1e-2, "{period_ms} ms: {apart:e}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_makes_no_sense_is_refused_with_its_name_and_changes_nothing() {
    let mut model = FmuModel::new(&robot("test/one_beam"), &FmuSettings::default()).unwrap();
    let (target, error) = (of_joints(&model, "target_position")[0], model.find("tcp_error.length").unwrap());
    assert!(matches!(model.step(0.0, 1e-3), Err(FmuError::NotStarted)));
    assert!(matches!(model.set(target, f64::NAN), Err(FmuError::Value { .. })));
    assert!(
        matches!(model.set(error, 1.0), Err(FmuError::Variable(what)) if what.starts_with("tcp_error.length is computed"))
    );
    assert!(matches!(model.get(100_000), Err(FmuError::Variable(what)) if what.ends_with("reference 100000")));
    assert!(matches!(model.get_flag(target), Err(FmuError::Variable(what)) if what.ends_with("is a number")));
    model.start(2.0).unwrap();
    assert!(matches!(model.start(2.0), Err(FmuError::Variable(_))));
    let step = model.find("step").unwrap();
    assert!(
        matches!(model.set(step, 1e-3), Err(FmuError::Variable(what)) if what.starts_with("step: the arm has started"))
    );
    assert!(matches!(model.step(0.0, 1e-3), Err(FmuError::Step(_))));
    assert!(matches!(model.step(2.0, -1e-3), Err(FmuError::Step(_))));
    model.step(2.0, 1e-3).unwrap();
    assert!(matches!(model.step(2.001, 1.5e-3), Err(FmuError::Robot(_))));
    model.step(2.001, 1e-3).unwrap();
    assert!((model.time_s() - 2.002).abs() < 1e-12);
    let missing = FmuModel::new(Path::new("no_such_robot.toml"), &FmuSettings::default());
    assert!(matches!(missing, Err(FmuError::Robot(_))));
}

#[test]
fn descriptions_name_every_variable_once_with_unit_and_start() {
    let model = FmuModel::new(&robot("kr300"), &settings(LinkModel::AsFiled, DriveModel::Servo)).unwrap();
    let mut names: Vec<&str> = model.variables().iter().map(|variable| variable.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), model.variables().len());
    for variable in model.variables() {
        assert_eq!(variable.unit.is_empty(), variable.kind == Kind::Boolean, "{}", variable.name);
        let settable = matches!(variable.causality, Causality::Parameter | Causality::Input);
        assert_eq!(variable.start.is_some(), settable, "{}", variable.name);
    }
    let about = About { name: "a <robot> & \"more\"", token: "{0}", step_s: 1e-3 };
    for (fmi, element) in [(Fmi::V2, "<ScalarVariable "), (Fmi::V3, "<Float64 ")] {
        let text = String::from_utf8(description(fmi, &about, model.variables()).unwrap()).unwrap();
        assert!(text.contains("a &lt;robot&gt; &amp; &quot;more&quot;"), "{text}");
        let numbers = model.variables().iter().filter(|v| v.kind == Kind::Real || fmi == Fmi::V2).count();
        assert_eq!(text.matches(element).count(), numbers);
    }
}

/// Unpacks a zip file.
fn unpacked(file: &Path, into: &Path) {
    let mut zip = zip::ZipArchive::new(std::fs::File::open(file).unwrap()).unwrap();
    zip.extract(into).unwrap();
}

fn token_of(folder: &Path) -> String {
    let text = std::fs::read_to_string(folder.join("modelDescription.xml")).unwrap();
    let (_, rest) = text.split_once("instantiationToken=\"").unwrap();
    rest.split_once('"').unwrap().0.to_owned()
}

/// Returns the lower arm with a stress point at its worst place, in a folder.
fn gauged(folder: &Path) -> PathBuf {
    let shipped = root().join("robots/test/lower_arm");
    std::fs::create_dir_all(folder).unwrap();
    for file in ["lower_arm.urdf", "lower_arm.stl", "robot.toml"] {
        std::fs::copy(shipped.join(file), folder.join(file)).unwrap();
    }
    let job = ReduceJob::load(&shipped.join("lower_arm.reduce.toml")).unwrap();
    let outputs = ReduceOutputs { flex: Some(folder.join("lower_arm.flex")), ..ReduceOutputs::default() };
    reduce(&ReduceJob { stress: Some(true), ..job }, &ReduceOptions::default(), Some(&outputs), &mut |_| {}).unwrap();
    let path = folder.join("robot.toml");
    let text = std::fs::read_to_string(&path).unwrap().replace("default_trajectory", "#");
    std::fs::write(&path, &text).unwrap();
    let held = Robot::load(&path).unwrap().model(&Modelling::default()).unwrap().statics(None, [0.0; 6]).unwrap();
    let worst = held.stress[0].worst[0].position_m;
    let entry = format!("\n[[stress_point]]\nname = \"worst\"\nlink = \"lower_arm\"\nat = {worst:?}\n");
    std::fs::write(&path, text + &entry).unwrap();
    path
}

#[test]
fn the_resources_of_an_fmu_are_the_arm_wherever_they_are() {
    let folder = std::env::temp_dir().join(format!("flexarm fmu {}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let library = folder.join("library");
    std::fs::write(&library, "in place of a library").unwrap();
    let urdf = root().join("tests/golden/ur10_like.urdf");
    for (path, drives) in [
        (robot("kr210"), DriveModel::AsFiled),
        (robot("test/lower_arm"), DriveModel::AsFiled),
        (robot("test/reference_arm"), DriveModel::Servo),
        (robot("palletiser"), DriveModel::AsFiled),
        (urdf, DriveModel::AsFiled),
        (gauged(&folder.join("gauged")), DriveModel::AsFiled),
    ] {
        let settings = settings(LinkModel::AsFiled, drives);
        let model = FmuModel::new(&path, &settings).unwrap();
        let output = folder.join("arm.fmu");
        let job = FmuJob { robot: path, settings, fmi: Fmi::V3, library: library.clone(), output, overwrite: true };
        let summary = export_fmu(&job).unwrap();
        assert_eq!(summary.meshes, 0, "{}", summary.robot);
        let own = folder.join("unpacked");
        unpacked(&job.output, &own);
        let token = token_of(&own);
        let mut again = open_resources(&own.join("resources"), &token).unwrap();
        assert_eq!(model.variables(), again.variables());
        assert_eq!(values(&model, &TCP), values(&again, &TCP));
        let stress = "gauge.worst_von_mises_pa";
        if model.find(stress).is_some() {
            let read = values(&model, &[stress]);
            assert!(read[0].abs() > 1e4 && read == values(&again, &[stress]), "{read:?}");
        }
        assert_eq!(model.find(stress).is_some(), job.robot.starts_with(&folder));
        again.start(0.0).unwrap();
        again.step(0.0, 0.01).unwrap();
        let text = std::fs::read_to_string(own.join("resources/robot.toml")).unwrap();
        let document: toml_edit::DocumentMut = text.parse().unwrap();
        let values = document.iter().map(|(_, item)| item.to_string()).collect::<Vec<_>>();
        let is_outside = |value: &String| value.lines().any(|line| line.split('#').next().unwrap().contains(".."));
        assert!(!values.iter().any(is_outside), "{text}");
        assert!(matches!(open_resources(&own.join("resources"), "{other}"), Err(FmuError::File { .. })));
        std::fs::remove_file(own.join("resources/robot.urdf")).unwrap();
        assert!(matches!(open_resources(&own.join("resources"), &token), Err(FmuError::Robot(_))));
        std::fs::write(own.join("resources/plant.json"), "{").unwrap();
        assert!(matches!(open_resources(&own.join("resources"), &token), Err(FmuError::File { .. })));
        std::fs::remove_dir_all(&own).unwrap();
        let kept = FmuJob { overwrite: false, ..job };
        assert!(matches!(export_fmu(&kept), Err(FmuError::Written(_))));
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
