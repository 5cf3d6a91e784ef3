//! Derivatives with respect to parameters against Richardson extrapolation of nonlinear solutions,
//! for a soft arm whose equilibrium depends on the parameters.

use std::sync::Arc;

use flexarm_identify::*;
use flexarm_kinematics::{Model, Pose, SpatialInertia, Wrench, rotation_vector};
use flexarm_stepping::{Damping, OperatingPoint, Spring};
use flexarm_testkit::reference_arm;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Translation3, Vector3};

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

/// Returns the reference arm with a twentieth of its stiffness: its tool sags by 4 cm.
fn nominal() -> NominalArm {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).expect("valid"));
    let spring = |name: &str, k: usize| Spring::from((name.to_owned(), reference.K_S[k] / 20.0, Damping::Modal(0.03)));
    let tool = model.frame("tcp").expect("there").clone();
    NominalArm { model, springs: vec![spring("lower", 0), spring("upper", 1)], tool, coupling: None }
}

fn stiffness(name: &str, spring: usize, coordinate: Option<usize>) -> Parameter {
    let effect = Effect::Stiffness(vec![SpringPart { spring, coordinate }]);
    Parameter { name: name.into(), unit: "1".into(), initial: 1.0, prior: None, effect }
}

fn parameters(nominal: &NominalArm) -> Vec<Parameter> {
    let per_kg = SpatialInertia::from_com(1.0, &Vector3::new(0.1, -0.05, 0.2), &(Matrix3::identity() * 0.02));
    let mass = Effect::Mass(vec![(nominal.tool.body, per_kg)]);
    vec![
        stiffness("lower", 0, None),
        stiffness("upper", 1, None),
        stiffness("lower about x", 0, Some(3)),
        stiffness("upper about y", 1, Some(4)),
        Parameter { name: "payload".into(), unit: "kg".into(), initial: 0.0, prior: None, effect: mass },
    ]
}

/// Parameters for damping, one for each damping model of the springs.
fn with_damping(nominal: &mut NominalArm) -> Vec<Parameter> {
    nominal.springs[1].damping = Damping::Rayleigh(0.4, 3e-4);
    let damping = |name: &str, spring| Parameter {
        name: name.into(),
        unit: "1".into(),
        initial: 1.0,
        prior: None,
        effect: Effect::Damping(vec![spring]),
    };
    let mut all = parameters(nominal);
    all.extend([damping("modal damping of lower", 0), damping("Rayleigh damping of upper", 1)]);
    all
}

/// Returns two points beside the tool on its body, each with a direction.
fn probes(nominal: &NominalArm) -> [Probe; 2] {
    let moved = |x: f64, y: f64, z: f64| {
        let frame = nominal.tool.clone();
        flexarm_kinematics::Frame { X_BF: frame.X_BF * Pose::translation(x, y, z), ..frame }
    };
    [
        Probe { frame: moved(0.1, 0.0, -0.2), direction: Vector3::new(0.6, 0.0, 0.8) },
        Probe { frame: moved(0.0, 0.15, 0.05), direction: Vector3::new(0.0, -1.0, 0.0) },
    ]
}

/// Computes a derivative by sixth-order Richardson extrapolation of central differences.
fn richardson(h: f64, f: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let d = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
    let (ab, bc) = ((&b * 4.0 - &a) / 3.0, (&c * 4.0 - &b) / 3.0);
    (bc * 16.0 - ab) / 15.0
}

fn step_of(parameter: &Parameter) -> f64 {
    if parameter.is_logarithmic() { 0.02 } else { 1.0 }
}

#[test]
fn the_tool_moves_with_each_parameter_as_the_nonlinear_equilibrium_does() {
    let nominal = nominal();
    let parameters = parameters(&nominal);
    for moment in [0.0, 60.0] {
        // With a constant moment the tangent is not symmetric.
        let load = Wrench::new(Vector3::new(90.0, 50.0, -200.0), Vector3::new(moment, -moment, 0.5 * moment));
        let solved = |nominal: &NominalArm| {
            let mut at = OperatingPoint::new(nominal.locked(&POSE).unwrap(), nominal.tool.clone());
            at.solve(&POSE, &load).unwrap();
            at
        };
        let mut at = solved(&nominal);
        let slopes = tool_slopes(&mut at, &parameters);
        let here = at.tcp_pose();
        for (k, parameter) in parameters.iter().enumerate() {
            let place = |x: f64| {
                let X = solved(&nominal.with(std::slice::from_ref(parameter), &[x])).tcp_pose();
                let turned = rotation_vector((X.rotation * here.rotation.inverse()).matrix());
                let p = X.translation.vector;
                DVector::from_vec(vec![p.x, p.y, p.z, turned.x, turned.y, turned.z])
            };
            let truth = richardson(step_of(parameter), place);
            let error = (slopes.column(k) - &truth).amax() / truth.amax();
            eprintln!("{}: {error:.1e} of {:.2e}", parameter.name, truth.amax());
            // Measured: at most 5e-11; the truth is a difference itself.
            assert!(error < 1e-8, "{}: {error:e}", parameter.name);
        }
    }
}

#[test]
fn frequencies_change_with_each_parameter_and_with_the_equilibrium_that_it_moves() {
    let nominal = nominal();
    let parameters = parameters(&nominal);
    let found = frequency_slopes(&nominal, &parameters, &POSE).unwrap();
    for (k, parameter) in parameters.iter().enumerate() {
        let hz = |x: f64| {
            let nominal = nominal.with(std::slice::from_ref(parameter), &[x]);
            DVector::from_vec(frequency_slopes(&nominal, &[], &POSE).unwrap().hz)
        };
        let truth = richardson(step_of(parameter), hz);
        let error = (0..6).map(|i| (found.slopes[(i, k)] - truth[i]).abs() / truth.amax()).fold(0.0, f64::max);
        eprintln!("{}: {error:.1e}, first {:.4} Hz", parameter.name, truth[0]);
        assert!(error < 1e-8, "{}: {error:e}", parameter.name);
    }
}

#[test]
fn every_row_of_every_kind_of_reading_has_the_derivatives_of_its_residual() {
    let nominal = nominal();
    let parameters = parameters(&nominal);
    let carried = SpatialInertia::from_com(12.0, &Vector3::new(0.0, 0.1, 0.2), &(Matrix3::identity() * 0.1));
    let at = Vector3::new(0.1, 0.02, -0.05);
    let pull =
        LoadCase { wrench: Wrench::new(Vector3::new(50.0, 20.0, -300.0), Vector3::zeros()), at, ..LoadCase::none() };
    let heavy = LoadCase { carried, ..LoadCase::none() };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, 0.8)];
    let mut rows: Vec<Row<Component>> =
        axes.iter().map(|d| Row { of: Component::along(*d), value: 1e-3, std: 1e-4 }).collect();
    rows.extend(axes.iter().map(|d| Row { of: Component::about(*d), value: 1e-3, std: 1e-4 }));
    for instrument in [0, 1] {
        let components = axes.iter().flat_map(|d| [Component::along(*d), Component::about(*d)]);
        let in_axes = components.map(|of| Component { instrument: Some(instrument), ..of });
        rows.extend(in_axes.map(|of| Row { of, value: 1e-3, std: 1e-4 }));
    }
    let point = Vector3::new(-0.1, 0.2, 0.3);
    let moved = |before: &LoadCase, after: &LoadCase| ReadingKind::Displacement {
        before: before.clone(),
        after: after.clone(),
        point,
        rows: rows.clone(),
    };
    let place = |target| ReadingKind::Place {
        load: heavy.clone(),
        target,
        instrument: 0,
        rows: (0..3).map(|of| Row { of, value: [0.3, 0.1, 2.0][of], std: 1e-4 }).collect(),
    };
    let X = Pose::from_parts(Translation3::new(3.0, 1.0, -0.5), Rotation3::from_euler_angles(0.4, -0.2, 2.2));
    let near =
        X * Pose::from_parts(Translation3::new(0.01, 0.0, -0.02), Rotation3::from_euler_angles(0.02, 0.1, -0.03));
    let stands = |instrument, std| ReadingKind::InstrumentAt { instrument, value: near, std, std_rotation: 1e-3 };
    let hz = vec![Row { of: 0, value: 2.0, std: 0.1 }, Row { of: 2, value: 5.0, std: 0.1 }];
    let kinds = [
        moved(&LoadCase::none(), &pull),
        moved(&heavy, &pull),
        place(0),
        place(1),
        ReadingKind::Frequencies { load: heavy.clone(), rows: hz },
        ReadingKind::TargetAt { target: 1, value: Vector3::new(0.0, 0.1, 0.2), std: 1e-3 },
        stands(0, Some(1e-3)),
        stands(1, None),
    ];
    let readings = kinds.map(|kind| Reading { name: "a".into(), q: POSE.to_vec(), kind }).to_vec();
    let measurements = Measurements {
        readings,
        targets: vec![Target::Known(point), Target::Unknown(Vector3::new(0.0, 0.1, 0.1))],
        instruments: vec![Instrument::Unknown(X), Instrument::Axes(X.rotation.inverse())],
        ..Measurements::default()
    };
    let arm = MeasuredArm { nominal: &nominal, parameters: &parameters, measurements: &measurements };
    let mut at = DVector::zeros(parameters.len() + measurements.own_unknowns());
    assert_eq!(at.len(), 5 + 6 + 3 + 3);
    for (k, x) in at.iter_mut().enumerate() {
        *x = 0.05 * (k as f64 + 1.0).sin();
    }
    let mut J = DMatrix::zeros(0, 0);
    arm.evaluate(&at, Some(&mut J)).unwrap();
    for k in 0..at.len() {
        let size = parameters.get(k).map_or(0.02, step_of);
        let residuals = |x: f64| {
            let mut moved = at.clone();
            moved[k] += x;
            arm.evaluate(&moved, None).unwrap()
        };
        let truth = richardson(size, residuals);
        let error = (J.column(k) - &truth).amax() / truth.amax();
        eprintln!("unknown {k}: {error:.1e}");
        assert!(error < 1e-8, "unknown {k}: {error:e}");
    }
}

/// Truth: the linear system of the arm from its own matrices, as in `flexarm response`.
#[test]
fn a_response_is_that_of_the_linearised_arm() {
    let mut nominal = nominal();
    with_damping(&mut nominal);
    let probes = probes(&nominal);
    let arm = nominal.locked(&POSE).unwrap();
    let at = |probe: &Probe| flexarm_stepping::linearise(&arm, &probe.frame, &Wrench::zeros(), 0.0).unwrap();
    let (watched, hit) = (at(&probes[0]), at(&probes[1]));
    let row = |J: &nalgebra::Matrix6xX<f64>, d: &Vector3<f64>| {
        DVector::from_fn(J.ncols(), |j, _| nalgebra::Complex::new((0..3).map(|c| d[c] * J[(c, j)]).sum(), 0.0))
    };
    let omega = [3.0, 9.0, 25.0, 60.0];
    let found =
        structure_slopes(&nominal, &[], &POSE, &probes).unwrap().response(0, 1, Answer::Accelerance, &omega).unwrap();
    for (w, value) in omega.iter().zip(&found.values) {
        let n = watched.K.nrows();
        let Z = DMatrix::from_fn(n, n, |i, j| {
            nalgebra::Complex::new(watched.K[(i, j)] - w * w * watched.M[(i, j)], w * watched.D[(i, j)])
        });
        let u = Z.lu().solve(&row(&hit.J, &probes[1].direction)).unwrap();
        let truth = row(&watched.J, &probes[0].direction).dot(&u) * (-w * w);
        assert!((value - truth).norm() < 1e-9 * truth.norm(), "{value} {truth}");
    }
}

#[test]
fn responses_and_shapes_change_with_each_parameter_as_differences_say() {
    let mut nominal = nominal();
    let parameters = with_damping(&mut nominal);
    let probes = probes(&nominal);
    let f =
        structure_slopes(&nominal, &[], &POSE, &probes).unwrap().omega2.iter().map(|w2| w2.sqrt()).collect::<Vec<_>>();
    // Below, at and between resonances.
    let omega = [0.5 * f[0], f[0], 1.02 * f[1], 0.5 * (f[1] + f[2]), f[2], 1.3 * f[3]];
    let found = structure_slopes(&nominal, &parameters, &POSE, &probes).unwrap();
    let response = found.response(0, 1, Answer::Mobility, &omega).unwrap();
    for (k, parameter) in parameters.iter().enumerate() {
        let step = if parameter.is_logarithmic() { 0.002 } else { 0.1 };
        let values = |x: f64| {
            let nominal = nominal.with(std::slice::from_ref(parameter), &[x]);
            let again = structure_slopes(&nominal, &[], &POSE, &probes).unwrap();
            let H = again.response(0, 1, Answer::Mobility, &omega).unwrap().values;
            DVector::from_iterator(2 * H.len(), H.iter().flat_map(|h| [h.re, h.im]))
        };
        let truth = richardson(step, values);
        let own = DVector::from_iterator(
            2 * omega.len(),
            (0..omega.len()).flat_map(|i| [response.slopes[(i, k)].re, response.slopes[(i, k)].im]),
        );
        let error = (&own - &truth).amax() / truth.amax();
        eprintln!("{}: response {error:.1e} of {:.1e}", parameter.name, truth.amax());
        assert!(error < 1e-8, "{}: {error:e}", parameter.name);
        let shape = |x: f64| {
            let nominal = nominal.with(std::slice::from_ref(parameter), &[x]);
            let shape = structure_slopes(&nominal, &[], &POSE, &[]).unwrap().shapes.column(1).into_owned();
            let sign = shape.dot(&found.shapes.column(1)).signum();
            shape * sign
        };
        let truth = richardson(step, shape);
        let own = &found.shape_slopes(1)[k];
        let error = (own - &truth).amax() / truth.amax().max(1e-3 * found.shapes.column(1).amax());
        eprintln!("{}: shape {error:.1e} of {:.1e}", parameter.name, truth.amax());
        assert!(error < 1e-8, "{}: {error:e}", parameter.name);
    }
}

#[test]
fn a_response_changes_with_one_damper_of_six_as_differences_say() {
    let mut nominal = nominal();
    nominal.springs[0].damping = Damping::Dampers([900.0, 700.0, 800.0, 60.0, 90.0, 40.0]);
    let effect = Effect::Damper { spring: 0, coordinate: 4 };
    let parameter = Parameter { name: "about y".into(), unit: "N m s/rad".into(), initial: 90.0, prior: None, effect };
    let probes = probes(&nominal);
    let omega = [3.0, 9.0, 25.0, 60.0];
    let response = |nominal: &NominalArm, parameters: &[Parameter]| {
        structure_slopes(nominal, parameters, &POSE, &probes).unwrap().response(0, 1, Answer::Mobility, &omega).unwrap()
    };
    let split = |H: &[nalgebra::Complex<f64>]| DVector::from_iterator(2 * H.len(), H.iter().flat_map(|h| [h.re, h.im]));
    let own = response(&nominal, std::slice::from_ref(&parameter)).slopes.column(0).into_owned();
    let changed = |x: f64| split(&response(&nominal.with(std::slice::from_ref(&parameter), &[x]), &[]).values);
    let truth = richardson(0.02, changed);
    let error = (split(own.as_slice()) - &truth).amax() / truth.amax();
    eprintln!("{error:.1e} of {:.1e}", truth.amax());
    assert!(error < 1e-8, "{error:e}");
}

#[test]
fn the_compliance_changes_with_each_parameter_as_differences_say() {
    let nominal = nominal();
    let parameters = parameters(&nominal);
    for moment in [0.0, 60.0] {
        let load = Wrench::new(Vector3::new(90.0, 50.0, -200.0), Vector3::new(moment, -moment, 0.5 * moment));
        let solved = |nominal: &NominalArm| {
            let mut at = OperatingPoint::new(nominal.locked(&POSE).unwrap(), nominal.tool.clone());
            at.solve(&POSE, &load).unwrap();
            at
        };
        let slopes = compliance_slopes(&mut solved(&nominal), &load, &parameters).unwrap();
        for (k, parameter) in parameters.iter().enumerate() {
            let C = |x: f64| {
                let C = solved(&nominal.with(std::slice::from_ref(parameter), &[x])).compliance();
                DVector::from_column_slice(C.as_slice())
            };
            let truth = richardson(step_of(parameter), C);
            let error = (DVector::from_column_slice(slopes[k].as_slice()) - &truth).amax() / truth.amax();
            eprintln!("{}: compliance {error:.1e} of {:.1e}", parameter.name, truth.amax());
            assert!(error < 1e-8, "{}: {error:e}", parameter.name);
        }
    }
}

#[test]
fn rows_of_responses_and_shapes_have_the_derivatives_of_their_residuals() {
    let mut nominal = nominal();
    let parameters = with_damping(&mut nominal);
    let carried = SpatialInertia::from_com(12.0, &Vector3::new(0.0, 0.1, 0.2), &(Matrix3::identity() * 0.1));
    let heavy = LoadCase { carried, ..LoadCase::none() };
    let [watched, hit] = probes(&nominal);
    let response = |form| {
        let value = |k: usize| nalgebra::Complex::from_polar(1e-3 * (k as f64 + 1.0), k as f64 - 1.0);
        ReadingKind::Response(MeasuredResponse {
            load: heavy.clone(),
            watched: watched.clone(),
            hit: hit.clone(),
            answer: Answer::Accelerance,
            form,
            points: [4.0, 11.0, 19.0].iter().enumerate().map(|(k, w)| (*w, value(k), [0.05, 0.03])).collect(),
        })
    };
    let shape = ReadingKind::Shape(MeasuredShape {
        load: heavy.clone(),
        probes: vec![watched.clone(), hit.clone(), Probe { direction: Vector3::x(), ..hit.clone() }],
        amplitudes: DVector::from_vec(vec![1.0, -2.0, 0.5]),
        std: 0.05,
    });
    let kinds = [response(Form::Logarithmic), response(Form::Complex), shape];
    let readings = kinds.map(|kind| Reading { name: "a".into(), q: POSE.to_vec(), kind }).to_vec();
    let measurements = Measurements { readings, ..Measurements::default() };
    let arm = MeasuredArm { nominal: &nominal, parameters: &parameters, measurements: &measurements };
    let at = DVector::from_fn(parameters.len(), |k, _| 0.05 * (k as f64 + 1.0).sin());
    let mut J = DMatrix::zeros(0, 0);
    arm.evaluate(&at, Some(&mut J)).unwrap();
    for (k, parameter) in parameters.iter().enumerate() {
        let residuals = |x: f64| {
            let mut moved = at.clone();
            moved[k] += x;
            arm.evaluate(&moved, None).unwrap()
        };
        let truth = richardson(if parameter.is_logarithmic() { 0.004 } else { 0.2 }, residuals);
        let error = (J.column(k) - &truth).amax() / truth.amax();
        eprintln!("{}: {error:.1e}", parameter.name);
        assert!(error < 1e-8, "{}: {error:e}", parameter.name);
    }
}
