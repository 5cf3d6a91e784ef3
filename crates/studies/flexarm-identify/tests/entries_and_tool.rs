//! Entries of a spring's matrix and the tool pose as parameters: derivatives against Richardson
//! extrapolation, and recovery of known values.

use std::sync::Arc;

use flexarm_identify::*;
use flexarm_kinematics::{LinkInertia, Model, Pose, SpatialInertia, Wrench};
use flexarm_stepping::{Damping, OperatingPoint, Spring};
use flexarm_testkit::{Draw, reference_arm};
use nalgebra::{Complex, DMatrix, DVector, Matrix3, Rotation3, Translation3, Vector3, Vector6};

const POSE: [f64; 6] = [0.4, 0.5, -0.3, 0.7, 0.6, -1.2];

/// Returns the reference arm with a twentieth of its stiffness.
fn nominal() -> NominalArm {
    let reference = reference_arm(true);
    let model = Arc::new(Model::new(&reference.mechanism).unwrap());
    let spring = |name: &str, k: usize, damping| Spring::from((name.to_owned(), reference.K_S[k] / 20.0, damping));
    let springs = vec![spring("lower", 0, Damping::Rayleigh(0.4, 3e-4)), spring("upper", 1, Damping::Modal(0.03))];
    let tool = model.frame("tcp").unwrap().clone();
    NominalArm { model, springs, tool, coupling: None }
}

fn entry(nominal: &NominalArm, spring: usize, row: usize, column: usize) -> Parameter {
    let K = &nominal.springs[spring].K;
    let size = (K[(row, row)] * K[(column, column)]).sqrt();
    let (name, initial) = (format!("{spring}[{row}][{column}]"), K[(row, column)]);
    let effect = Effect::Entry { spring, row, column, factor: 1.0, size };
    Parameter { name, unit: "N".into(), initial, prior: None, effect }
}

fn tool(axis: usize) -> Parameter {
    let name = format!("tool {axis}");
    Parameter { name, unit: "m".into(), initial: 0.0, prior: None, effect: Effect::Tool(axis) }
}

fn parameters(nominal: &NominalArm) -> Vec<Parameter> {
    let mut all = vec![entry(nominal, 0, 1, 5), entry(nominal, 0, 4, 4), entry(nominal, 1, 0, 4)];
    all.extend((0..6).map(tool));
    // Three displacements of one frame, which follow each other, and the zero of another joint.
    all.extend([0, 5, 4].map(|axis| frame(nominal, "joint2", Vector6::ith(axis, 1.0))));
    all.push(frame(nominal, "joint4", Vector6::ith(5, 1.0)));
    all
}

fn inertial(masses: &[(usize, f64)], axis: Option<usize>) -> Parameter {
    let X_BL = Pose::from_parts(Translation3::new(0.1, 0.0, -0.2), Rotation3::from_euler_angles(0.3, 0.5, -0.7));
    let part = |(body, mass): &(usize, f64)| {
        let inertia_com = Matrix3::from_diagonal(&Vector3::new(0.2, 0.3, 0.25)) * *mass;
        LinkPart {
            body: *body,
            X_BL,
            inertia: LinkInertia { mass: *mass, com: Vector3::new(0.1, 0.2, 0.0), inertia_com },
        }
    };
    let parts: Vec<LinkPart> = masses.iter().map(part).collect();
    let initial = axis.map_or(masses.iter().map(|(_, mass)| mass).sum(), |_| 0.1);
    let effect = Effect::Link { parts, axis, size: 1.0 };
    Parameter { name: format!("link {axis:?}"), unit: "1".into(), initial, prior: None, effect }
}

fn frame(nominal: &NominalArm, joint: &str, twist: Vector6<f64>) -> Parameter {
    let body = nominal.model.bodies().iter().position(|body| body.joint == joint).unwrap();
    let effect = Effect::Frame { body, twist, size: 0.05 };
    Parameter { name: format!("frame of {joint}"), unit: "m".into(), initial: 0.0, prior: None, effect }
}

fn step_of(parameter: &Parameter) -> f64 {
    match parameter.effect {
        Effect::Entry { size, .. } => 0.01 * size,
        Effect::Link { axis: None, .. } => 0.3,
        Effect::Link { .. } => 0.02,
        _ => 0.01,
    }
}

/// Computes a derivative by sixth-order Richardson extrapolation of central differences.
fn richardson(h: f64, f: impl Fn(f64) -> DVector<f64>) -> DVector<f64> {
    let d = |h: f64| (f(h) - f(-h)) / (2.0 * h);
    let (a, b, c) = (d(h), d(0.5 * h), d(0.25 * h));
    let (ab, bc) = ((&b * 4.0 - &a) / 3.0, (&c * 4.0 - &b) / 3.0);
    (bc * 16.0 - ab) / 15.0
}

/// Returns one reading of every kind, with a load that acts beside the tool and a mass attached
/// there.
fn measurements(nominal: &NominalArm) -> Measurements {
    let carried = SpatialInertia::from_com(12.0, &Vector3::new(0.1, 0.2, 0.3), &(Matrix3::identity() * 0.3));
    let at = Vector3::new(0.1, 0.02, -0.05);
    let wrench = Wrench::new(Vector3::new(50.0, 20.0, -300.0), Vector3::new(4.0, -7.0, 3.0));
    let pull = LoadCase { wrench, at, ..LoadCase::none() };
    let heavy = LoadCase { carried, ..LoadCase::none() };
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let mut rows: Vec<Row<Component>> =
        axes.iter().map(|d| Row { of: Component::along(*d), value: 1e-3, std: 1e-4 }).collect();
    rows.extend(axes.iter().map(|d| Row { of: Component::about(*d), value: 1e-3, std: 1e-4 }));
    let probe = |place: [f64; 3], direction| {
        let X = Pose::translation(place[0], place[1], place[2]);
        let frame = nominal.tool.clone();
        Probe { frame: flexarm_kinematics::Frame { X_BF: frame.X_BF * X, ..frame }, direction }
    };
    let value = |k: usize| Complex::from_polar(1e-3 * (k as f64 + 1.0), k as f64 - 1.0);
    let kinds = vec![
        ReadingKind::Displacement {
            before: heavy.clone(),
            after: pull.clone(),
            point: Vector3::new(-0.1, 0.2, 0.3),
            rows,
        },
        ReadingKind::Place {
            load: LoadCase { carried, ..pull },
            target: 0,
            instrument: 0,
            rows: (0..3).map(|of| Row { of, value: [0.3, 0.1, 2.0][of], std: 1e-4 }).collect(),
        },
        ReadingKind::Frequencies {
            load: heavy.clone(),
            rows: vec![Row { of: 0, value: 2.0, std: 0.1 }, Row { of: 2, value: 5.0, std: 0.1 }],
        },
        ReadingKind::Response(MeasuredResponse {
            load: heavy.clone(),
            watched: probe([0.1, 0.0, -0.2], Vector3::new(0.6, 0.0, 0.8)),
            hit: probe([0.0, 0.15, 0.05], -Vector3::y()),
            answer: Answer::Accelerance,
            form: Form::Complex,
            points: [4.0, 11.0, 19.0].iter().enumerate().map(|(k, w)| (*w, value(k), [0.05, 0.03])).collect(),
        }),
        ReadingKind::Shape(MeasuredShape {
            load: heavy,
            probes: vec![probe([0.1, 0.0, 0.0], Vector3::x()), probe([0.0, 0.2, 0.0], Vector3::z())],
            amplitudes: DVector::from_vec(vec![1.0, -2.0]),
            std: 0.05,
        }),
    ];
    let readings = kinds.into_iter().enumerate();
    let readings = readings.map(|(k, kind)| Reading { name: format!("{k}"), q: POSE.to_vec(), kind }).collect();
    let X = Pose::from_parts(Translation3::new(3.0, 1.0, -0.5), Rotation3::from_euler_angles(0.4, -0.2, 2.2));
    let targets = vec![Target::Known(Vector3::new(0.2, -0.1, 0.15))];
    Measurements { readings, targets, instruments: vec![Instrument::Known(X)], ..Measurements::default() }
}

/// Truth: sixth-order differences of the residuals, reading after reading, away from the initial
/// values.
#[test]
fn readings_of_all_kinds_change_with_entries_and_with_the_tool_as_differences_say() {
    changes_as_differences_say(&parameters(&nominal()));
}

/// Parameters: mass and centre of mass of one link, whose effects multiply, and the mass of one in two
/// parts.
#[test]
fn readings_of_all_kinds_change_with_masses_as_differences_say() {
    let tool = nominal().tool.body;
    let mut all = [None, Some(0), Some(2)].map(|axis| inertial(&[(tool, 9.0)], axis)).to_vec();
    all.push(inertial(&[(tool - 2, 20.0), (tool - 1, 10.0)], None));
    changes_as_differences_say(&all);
}

fn changes_as_differences_say(parameters: &[Parameter]) {
    let nominal = nominal();
    let all = measurements(&nominal);
    let x = DVector::from_fn(parameters.len(), |k, _| 5.0 * step_of(&parameters[k]) * (k as f64 + 1.0).sin());
    for k in 0..all.readings.len() {
        let one = all.of_readings(|other| other == k);
        let arm = MeasuredArm { nominal: &nominal, parameters, measurements: &one };
        let mut J = DMatrix::zeros(0, 0);
        arm.evaluate(&x, Some(&mut J)).unwrap();
        // Change of the residuals per step; entries with almost no effect are compared with the
        // largest one.
        let largest = (0..J.ncols()).map(|p| J.column(p).amax() * step_of(&parameters[p])).fold(0.0, f64::max);
        for (p, parameter) in parameters.iter().enumerate() {
            let residuals = |h: f64| {
                let mut moved = x.clone();
                moved[p] += h;
                arm.evaluate(&moved, None).unwrap()
            };
            let h = step_of(parameter) * if k > 2 { 0.2 } else { 1.0 };
            let truth = richardson(h, residuals);
            let size = truth.amax().max(1e-3 * largest / step_of(parameter));
            let error = (J.column(p) - &truth).amax();
            eprintln!("reading {k}, {}: {:.1e} of {:.2e}", parameter.name, error / size, truth.amax());
            // Measured: at most 7e-10; derivatives of vibrations by frames are differences: 2e-7.
            let allowed = if matches!(parameter.effect, Effect::Frame { .. }) && k > 1 { 1e-5 } else { 1e-8 };
            assert!(error < allowed * size, "reading {k}, {}: {:e}", parameter.name, error / size);
        }
    }
}

/// Truth: differences of the compliance with a changed entry.
#[test]
fn the_compliance_changes_with_an_entry_as_differences_say() {
    let nominal = nominal();
    let parameters = &parameters(&nominal)[..3];
    let load = Wrench::new(Vector3::new(90.0, 50.0, -200.0), Vector3::zeros());
    let solved = |nominal: &NominalArm| {
        let mut at = OperatingPoint::new(nominal.locked(&POSE).unwrap(), nominal.tool.clone());
        at.solve(&POSE, &load).unwrap();
        at
    };
    let slopes = compliance_slopes(&mut solved(&nominal), &load, parameters).unwrap();
    for (slope, parameter) in slopes.iter().zip(parameters) {
        let C = |x: f64| {
            let C = solved(&nominal.with(std::slice::from_ref(parameter), &[x])).compliance();
            DVector::from_column_slice(C.as_slice())
        };
        let truth = richardson(step_of(parameter), C);
        let error = (DVector::from_column_slice(slope.as_slice()) - &truth).amax() / truth.amax();
        eprintln!("{}: compliance {error:.1e}", parameter.name);
        assert!(error < 1e-8, "{}: {error:e}", parameter.name);
    }
}

fn pulls(count: usize) -> Measurements {
    let reading = |k: usize| {
        let q: Vec<f64> = (0..6).map(|j| 0.9 * (1.3 * k as f64 + 2.1 * j as f64).sin()).collect();
        let force = [-Vector3::z(), Vector3::x(), Vector3::y()][k % 3] * 150.0;
        let at = Vector3::new(0.2, 0.1, 0.0);
        let after = LoadCase { wrench: Wrench::new(force, Vector3::zeros()), at, ..LoadCase::none() };
        let rows = [Vector3::x(), Vector3::y(), Vector3::z()];
        let of = [Component::along, Component::about];
        let rows = of.iter().flat_map(|of| rows.map(|d| Row { of: of(d), value: 0.0, std: 1e-5 })).collect();
        let kind = ReadingKind::Displacement { before: LoadCase::none(), after, point: at, rows };
        Reading { name: format!("pull {k}"), q, kind }
    };
    Measurements { readings: (0..count).map(reading).collect(), ..Measurements::default() }
}

fn read(of: &Measurements, values: &[f64]) -> Measurements {
    let mut values = values.iter();
    let mut all = of.clone();
    for reading in &mut all.readings {
        if let ReadingKind::Displacement { rows, .. } = &mut reading.kind {
            rows.iter_mut().for_each(|row| row.value = *values.next().unwrap());
        }
    }
    all
}

/// Truth: the measured arm. One bending stiffness is a third of the initial value, with coupling to
/// shear; a full Newton step from the initial values leads to an indefinite matrix.
#[test]
fn entries_far_from_the_guess_are_found_and_the_matrix_stays_definite_on_the_way() {
    let nominal = nominal();
    let parameters = vec![entry(&nominal, 0, 4, 4), entry(&nominal, 0, 0, 4), entry(&nominal, 0, 1, 5)];
    let mut soft = nominal.clone();
    let K = &mut soft.springs[0].K;
    let root = |K: &DMatrix<f64>, i: usize, j: usize| (K[(i, i)] * K[(j, j)]).sqrt();
    K[(4, 4)] *= 0.3;
    for (i, j, part) in [(0, 4, 0.35), (1, 5, -0.2)] {
        let change = part * root(K, i, j);
        K[(i, j)] += change;
        K[(j, i)] += change;
    }
    let truth = [soft.springs[0].K[(4, 4)], soft.springs[0].K[(0, 4)], soft.springs[0].K[(1, 5)]];
    let poses = pulls(12);
    let none = MeasuredArm { nominal: &soft, parameters: &[], measurements: &poses };
    let exact = none.predicted(&DVector::zeros(0)).unwrap();
    let options = IdentifyOptions { folds: 0, ..IdentifyOptions::default() };
    let found = identify(&nominal, &parameters, &read(&poses, &exact), &options, &|_| true).unwrap();
    for (p, truth) in found.parameters.iter().zip(truth) {
        eprintln!("{}: {:.6e} of {truth:.6e}, first {:.6e}", p.name, p.value, p.initial);
        // The prior pulls by a small part of the deviation.
        assert!(p.identifiable && (p.value - truth).abs() < 0.1 * p.std, "{}", p.name);
    }
    // Outside the cone of positive definite matrices the arm has no solution, so the search rejects
    // the step.
    let arm = MeasuredArm { nominal: &nominal, parameters: &parameters, measurements: &poses };
    let beyond = DVector::from_vec(vec![0.0, 1.5 * root(&nominal.springs[0].K, 0, 4), 0.0]);
    assert!(arm.predicted(&beyond).unwrap_err().to_string().contains("stiffness of an elastic joint"));
    // With noise, errors over the reported deviations are standard normal; the RMS of 120 of them
    // is within 0.8 to 1.2 with 99 % probability.
    let mut draw = Draw(7);
    let mut normal = || {
        let (u, v) = (draw.between(1e-12, 1.0), draw.between(0.0, std::f64::consts::TAU));
        (-2.0 * f64::ln(u)).sqrt() * f64::cos(v)
    };
    let mut squares = 0.0;
    for _ in 0..40 {
        let noisy: Vec<f64> = exact.iter().map(|value| value + 1e-5 * normal()).collect();
        let found = identify(&nominal, &parameters, &read(&poses, &noisy), &options, &|_| true).unwrap();
        squares += found.parameters.iter().zip(truth).map(|(p, t)| ((p.value - t) / p.std).powi(2)).sum::<f64>();
    }
    let spread = (squares / 120.0).sqrt();
    eprintln!("errors over deviations {spread:.3}");
    assert!((0.8..1.2).contains(&spread), "{spread}");
}
