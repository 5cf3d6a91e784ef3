//! Model exchange: the arm as a differential equation, against its stepper and its linear model.

use crate::helpers::{changed_kr210, of_joints, robot, settings, targets, values};
use flexarm::{DriveModel, LinkModel, Robot};
use flexarm_fmu::{FmuError, FmuModel, FmuSettings};
use nalgebra::DMatrix;

const TCP: [&str; 3] = ["tcp.position.x", "tcp.position.y", "tcp.position.z"];

/// References of positions, velocities and accelerations of the targets.
fn motion_inputs(model: &FmuModel) -> [Vec<usize>; 3] {
    ["target_position", "target_velocity", "target_acceleration"].map(|what| of_joints(model, what))
}

/// Sets the swing of [`targets`] at a time, with its acceleration.
fn swing(model: &mut FmuModel, inputs: &[Vec<usize>; 3], t: f64) {
    let still = vec![0.0; inputs[0].len()];
    let ((q, qdot), h) = (targets(&still, t), 1e-4);
    let (before, after) = (targets(&still, t - h).1, targets(&still, t + h).1);
    for k in 0..still.len() {
        let values = [q[k], qdot[k], (after[k] - before[k]) / (2.0 * h)];
        inputs.iter().zip(values).for_each(|(inputs, value)| model.set(inputs[k], value).unwrap());
    }
}

/// Integrates with the classical Runge-Kutta method, as an importer would.
fn integrate(model: &mut FmuModel, mut inputs: impl FnMut(&mut FmuModel, f64), steps: u32, h: f64) {
    for step in 0..steps {
        let (t, x) = (h * f64::from(step), model.states());
        let mut sum = vec![0.0; x.len()];
        let mut slope = sum.clone();
        for (fraction, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            let stage: Vec<f64> = x.iter().zip(&slope).map(|(x, slope)| x + fraction * h * slope).collect();
            model.set_time(t + fraction * h).unwrap();
            inputs(model, t + fraction * h);
            model.set_states(&stage).unwrap();
            slope = model.derivatives().unwrap();
            sum.iter_mut().zip(&slope).for_each(|(sum, slope)| *sum += weight / 6.0 * slope);
        }
        let end: Vec<f64> = x.iter().zip(&sum).map(|(x, sum)| x + h * sum).collect();
        model.set_time(t + h).unwrap();
        inputs(model, t + h);
        model.set_states(&end).unwrap();
    }
    model.evaluate().unwrap();
}

/// Truth: the stepper of the arm with a fine step.
#[test]
fn a_solver_outside_moves_the_arm_as_its_own_stepper_does() {
    for (name, links, h) in [
        ("kr210", LinkModel::AsFiled, 2.5e-5),
        ("test/reference_arm", LinkModel::Modal, 5e-6),
        ("palletiser", LinkModel::AsFiled, 2.5e-5),
    ] {
        let settings = FmuSettings { step_s: Some(1e-4), ..settings(links, DriveModel::AsFiled) };
        let mut model = FmuModel::new(&robot(name), &settings).unwrap();
        let inputs = motion_inputs(&model);
        model.set_flag(model.find("use_target_velocity").unwrap(), true).unwrap();
        model.start(0.0).unwrap();
        let first = values(&model, &TCP);
        for k in 1..=1000 {
            swing(&mut model, &inputs, 1e-4 * f64::from(k));
            model.step(model.time_s(), 1e-4).unwrap();
        }
        let truth = values(&model, &TCP);
        model.reset();
        model.start_equations(0.0).unwrap();
        assert_eq!(first, values(&model, &TCP));
        integrate(&mut model, |model, t| swing(model, &inputs, t), (0.1_f64 / h).round() as u32, h);
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let (moved, off) = (apart(&first, &truth), apart(&values(&model, &TCP), &truth));
        println!("{name}: {off:.1e} m apart after {moved:.3} m");
        assert!(off < 1e-6 && moved > 1e-2, "{name}: {off:e} {moved:e}");
        assert!((model.time_s() - 0.1).abs() < 1e-12);
    }
}

/// Truth: mass, damping and stiffness of the linear model, in closed form.
#[test]
fn directional_derivatives_at_rest_are_those_of_the_linear_model() {
    for (name, links, drives) in [
        ("kr210", LinkModel::AsFiled, DriveModel::AsFiled),
        ("test/reference_arm", LinkModel::Modal, DriveModel::Servo),
        ("kr300", LinkModel::AsFiled, DriveModel::Servo),
    ] {
        let settings = settings(links, drives);
        let mut model = FmuModel::new(&robot(name), &settings).unwrap();
        let arm = Robot::load(robot(name)).unwrap().model(&settings.modelling).unwrap();
        let pose = vec![0.2; arm.joints().count()];
        let motion = motion_inputs(&model);
        motion[0].iter().for_each(|&k| model.set(k, 0.2).unwrap());
        model.start_equations(0.0).unwrap();
        // The torques that hold the pose.
        let linear = arm.linearise(Some(&pose), [0.0; 6]).unwrap();
        let (n, driven) = (linear.M.nrows(), linear.driven);
        let torques = of_joints(&model, "torque");
        assert_eq!(torques.len(), driven);
        let efforts = of_joints(&model, "effort");
        let holding: Vec<f64> = efforts.iter().map(|&k| model.get(k).unwrap()).collect();
        for (k, &reference) in torques.iter().enumerate() {
            model.set(reference, holding[k]).unwrap();
        }
        let rest = model.derivatives().unwrap();
        let largest = rest.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
        println!("{name}: accelerations at rest {largest:.1e}");
        assert!(largest < 1e-3, "{largest}");

        let states: Vec<usize> = model.state_references().to_vec();
        let unknowns: Vec<usize> = model.derivative_references()[n..].to_vec();
        let columns = |model: &mut FmuModel, knowns: &[usize]| {
            let columns =
                knowns.iter().map(|&known| model.directional_derivative(&unknowns, &[known], &[1.0]).unwrap());
            DMatrix::from_column_slice(n, knowns.len(), &columns.collect::<Vec<_>>().concat())
        };
        let inverse = linear.M.clone().try_inverse().unwrap();
        let elastic = |A: &DMatrix<f64>| A.columns(driven, n - driven).into_owned();
        let check = |what: &str, found: &DMatrix<f64>, truth: &DMatrix<f64>| {
            let off = (found - truth).amax() / truth.amax();
            println!("{name}: slopes by {what} off by {off:.1e}");
            assert!(off < 1e-7, "{name} {what}: {off:e}");
        };
        // Motors are under servos in the linear model, so that their columns differ.
        check("deflections", &elastic(&columns(&mut model, &states[..n])), &elastic(&(-&inverse * &linear.K)));
        check("velocities", &elastic(&columns(&mut model, &states[n..])), &elastic(&(-&inverse * &linear.D)));
        if driven > 0 {
            check("torques", &columns(&mut model, &torques), &inverse.columns(0, driven).into_owned());
        } else {
            check("targets", &columns(&mut model, &motion[0]), &(-&inverse * &linear.K_a));
            check("accelerations", &columns(&mut model, &motion[2]), &(-&inverse * &linear.M_a));
        }
        let wrench: Vec<usize> = model
            .variables()
            .iter()
            .enumerate()
            .filter(|(_, v)| v.name.starts_with("tcp.force.") || v.name.starts_with("tcp.torque."))
            .map(|(k, _)| k)
            .collect();
        let J = DMatrix::from_fn(n, 6, |i, k| linear.J[(k, i)]);
        check("wrench", &columns(&mut model, &wrench), &(&inverse * J));
        assert_eq!(model.derivatives().unwrap(), rest, "the state is as before");
    }
}

#[test]
fn states_of_model_exchange_are_saved_and_restored() {
    let mut model = FmuModel::new(&robot("kr210"), &FmuSettings::default()).unwrap();
    let inputs = motion_inputs(&model);
    model.start_equations(0.0).unwrap();
    integrate(&mut model, |model, t| swing(model, &inputs, t), 100, 2.5e-5);
    let (state, tcp, slopes) = (model.state().unwrap(), values(&model, &TCP), model.derivatives().unwrap());
    integrate(&mut model, |model, t| swing(model, &inputs, t), 100, 2.5e-5);
    assert_ne!(tcp, values(&model, &TCP));
    model.restore(&state).unwrap();
    assert_eq!(slopes, model.derivatives().unwrap());
    assert_eq!(tcp, values(&model, &TCP));
    assert!((model.time_s() - 2.5e-3).abs() < 1e-15);
}

#[test]
fn arms_without_equations_and_wrong_states_are_refused() {
    let rigid = FmuModel::new(&robot("kr210"), &settings(LinkModel::Rigid, DriveModel::Rigid)).unwrap();
    assert!(!rigid.has_equations() && rigid.find("joint.joint_1.target_acceleration").is_none());
    let text = std::fs::read_to_string(robot("kr210")).unwrap();
    let mut document: toml_edit::DocumentMut = text.parse().unwrap();
    let mut hysteresis = toml_edit::InlineTable::new();
    hysteresis.insert("loss_arcmin", 0.2.into());
    hysteresis.insert("rated_torque", 1000.0.into());
    document["drive"].as_array_of_tables_mut().unwrap().get_mut(0).unwrap()["gearbox"]["hysteresis"] =
        toml_edit::value(hysteresis);
    let refused = changed_kr210(&document).equations(None, &Default::default());
    assert!(refused.err().unwrap().to_string().contains("hysteresis"));

    let mut model = FmuModel::new(&robot("kr210"), &FmuSettings::default()).unwrap();
    assert!(matches!(model.set_states(&model.states()), Err(FmuError::NotStarted)));
    model.start_equations(0.0).unwrap();
    assert!(matches!(model.step(0.0, 1e-3), Err(FmuError::Order { .. })));
    let kept = model.states();
    assert!(matches!(model.set_states(&vec![f64::NAN; kept.len()]), Err(FmuError::Value { .. })));
    assert!(matches!(model.set_time(f64::INFINITY), Err(FmuError::Value { .. })));
    let short = model.set_states(&kept[1..]).unwrap_err().to_string();
    assert!(short.contains(&format!("{} value(s) given, expected {}", kept.len() - 1, kept.len())), "{short}");
    let [output, state] = [model.find("tcp.position.x").unwrap(), model.state_references()[0]];
    let wrong = model.directional_derivative(&[output], &[output], &[1.0]);
    assert!(matches!(wrong, Err(FmuError::Variable(_))));
    let seedless = model.directional_derivative(&[output], &[state], &[]);
    assert!(matches!(seedless, Err(FmuError::Length { found: 0, expected: 1, .. })));
    assert!(model.directional_derivative(&[output], &[state], &[1.0]).unwrap()[0].is_finite());
    assert_eq!(model.states(), kept);
}
