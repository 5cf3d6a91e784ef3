//! Arms with modal links: published spin-ups, conservation laws, steppers against each other,
//! chains.

mod spin_up;

use std::sync::Arc;

use flexarm_fem::{Bar, BeamLink, Material, ModalLink, ModalOptions, Section};
use flexarm_flexlink::{FlexibleLink, GearStiffness, Gearbox, LinkForm, insert_gearboxes, substitute};
use flexarm_kinematics::*;
use flexarm_stepping::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::{follow_reference_motion, reference_arm};
use nalgebra::{DMatrix, Matrix3, Vector3, vector};

const fn alpha(rho: f64, dispersion_correction: bool) -> StepperKind {
    StepperKind::GeneralizedAlpha(AlphaSettings { rho, dispersion_correction })
}

const ALPHA: StepperKind = alpha(0.9, true);

fn reference(rtol: f64) -> StepperKind {
    StepperKind::Reference(ReferenceSettings::new(rtol))
}

fn spring(name: &str, K: DMatrix<f64>, damping: Damping) -> Spring {
    Spring::linear(name, K, damping)
}

pub(crate) fn modal_spring(modal: &ModalLink, damping: Damping) -> Spring {
    Spring { geometric: modal.geometric.clone().map(Arc::new), ..spring(&modal.name, modal.K.clone(), damping) }
}

fn own_inertia(modal: &ModalLink) -> LinkInertia {
    let body = modal.rigid();
    LinkInertia { mass: body.mass, com: body.com, inertia_com: body.inertia }
}

/// Springs in the order of the model, selected by the name of their group.
pub(crate) fn arm_of(mechanism: &Mechanism, springs: &[(String, Spring)], motion: Arc<dyn PrescribedMotion>) -> Plant {
    let model = Arc::new(Model::new(mechanism).expect("a tree"));
    let of = |group: &ElasticGroup| springs.iter().find(|(name, _)| *name == group.name).expect("a spring").1.clone();
    let ordered: Vec<Spring> = model.elastic().iter().map(of).collect();
    Plant::new(model, ordered, motion).expect("valid")
}

fn run(plant: &Plant, kind: StepperKind, h: f64, start: Start, times: &[f64]) -> Vec<Observation> {
    let mut stepper = new_stepper(kind, plant.clone(), h, start).expect("starts");
    let (mut seen, mut done) = (Observation::new(plant), 0);
    let at = |t: &f64| {
        for _ in done..(t / h).round() as u64 {
            stepper.step().expect("steps");
        }
        done = (t / h).round() as u64;
        stepper.observe(&mut seen);
        seen.clone()
    };
    times.iter().map(at).collect()
}

fn bar(EA: f64, kGA: f64, EI: f64, mass: f64, rotary: f64) -> Bar {
    let (kGA_y, kGA_z) = (Some(kGA), Some(kGA));
    Bar { EA, EI_y: EI, EI_z: EI, GJ: EI, kGA_y, kGA_z, mass_per_length: mass, rotary_y: rotary, rotary_z: rotary }
}

// --- Conservation laws of a free body

/// Returns a soft beam with a mass at its tip, flying freely: three prismatic and three revolute
/// joints without torque, without gravity.
fn free_flyer() -> Plant {
    flyer_with_modes_turned_by(0.0)
}

/// Returns the same with its first two modes, which have the same frequency, rotated by this angle.
fn flyer_with_modes_turned_by(angle: f64) -> Plant {
    let beam = BeamLink::new("beam", Section::Given(bar(1e6, 4e5, 60.0, 0.6, 3e-3)), Material::STEEL, 1.5);
    // Five modes: with four, one of two modes with the same frequency would be missing, and which
    // one would be arbitrary.
    let modal = Arc::new(turned(beam.modal(5).expect("a beam"), [6, 7], angle));
    let mut body = Mechanism::new("flyer");
    body.gravity = Vector3::zeros();
    // The gimbals have almost no mass.
    let light = |m: f64| LinkInertia { mass: m, com: Vector3::zeros(), inertia_com: Matrix3::identity() * m };
    let tool = LinkInertia {
        mass: 2.0,
        com: vector![0.1, 0.05, -0.02],
        inertia_com: Matrix3::from_diagonal(&vector![0.01, 0.02, 0.03]),
    };
    let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
    let kinds = [
        JointKind::Prismatic(x),
        JointKind::Prismatic(y),
        JointKind::Prismatic(z),
        JointKind::Continuous(x),
        JointKind::Continuous(y),
        JointKind::Continuous(z),
    ];
    body.links.push(Link { name: "0".into(), inertia: None });
    for (k, kind) in kinds.into_iter().enumerate() {
        let last = k + 1 == kinds.len();
        let name = if last { "beam".to_owned() } else { (k + 1).to_string() };
        body.links.push(Link { name: name.clone(), inertia: (!last).then(|| light(1e-9)) });
        body.joints.push(Joint::new(format!("joint{}", k + 1), kind, k.to_string(), name, Pose::identity()));
    }
    body.links[6].inertia = Some(own_inertia(&modal));
    body.links.push(Link { name: "tool".into(), inertia: Some(tool) });
    body.joints.push(Joint::new("end", JointKind::Fixed, "beam", "tool", Pose::translation(1.5, 0.0, 0.0)));
    let reduced = beam.reduce().expect("a beam");
    let flexible = FlexibleLink { form: LinkForm::Modal(modal.clone()), ..FlexibleLink::new("beam", reduced) };
    let soft = substitute(&body, &[flexible]).expect("fits").mechanism;
    let motion = MotionFn(|_: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        q.copy_from_slice(&[0.0, 0.0, 0.0, 0.2, -0.3, 0.4]);
        v.copy_from_slice(&[0.3, -0.5, 0.2, 2.0, -3.0, 9.0]);
        a.fill(0.0);
    });
    let springs = [("beam".to_owned(), modal_spring(&modal, Damping::StiffnessProportional(0.0)))];
    let idle = |coordinate| ServoAxis {
        coordinate,
        position_gain: 0.0,
        velocity_gain: 0.0,
        integral_gain: 0.0,
        feed_forward: 0.0,
        limit: f64::INFINITY,
    };
    let plant = arm_of(&soft, &springs, Arc::new(motion));
    let rigid = Arc::new(Model::new(&body).expect("a tree"));
    let servo = Servo { sample_s: 1000.0, axes: (0..6).map(idle).collect(), rigid };
    plant.with_servo(servo).expect("a joint that carries a modal link needs no rotor")
}

/// Returns the link with its coordinates k and l rotated into each other: the same deflections in
/// other coordinates.
fn turned(mut link: ModalLink, [k, l]: [usize; 2], angle: f64) -> ModalLink {
    let n = link.M.nrows();
    let (s, c) = angle.sin_cos();
    let mut Q = DMatrix::identity(n, n);
    (Q[(k, k)], Q[(l, k)], Q[(k, l)], Q[(l, l)]) = (c, s, -s, c);
    (link.M, link.K) = (Q.transpose() * &link.M * &Q, Q.transpose() * &link.K * &Q);
    (link.C_t, link.C_r) = (&link.C_t * &Q, &link.C_r * &Q);
    let (P, N) = (link.P.clone(), link.N.clone());
    for i in 0..n {
        link.P[i] = (0..n).map(|a| P[a] * Q[(a, i)]).sum();
        for j in 0..n {
            let terms = (0..n).flat_map(|a| (0..n).map(move |b| (a, b)));
            link.N[i * n + j] = terms.map(|(a, b)| N[a * n + b] * (Q[(a, i)] * Q[(b, j)])).sum();
        }
    }
    link
}

/// Measured 2e-13 of the largest deflection.
#[test]
fn modes_of_one_frequency_may_be_taken_in_any_directions() {
    let bends = |angle: f64| {
        let times: Vec<f64> = (0..=20).map(|k| 0.02 * f64::from(k)).collect();
        let seen = run(&flyer_with_modes_turned_by(angle), StepperKind::Rk4, 4e-5, Start::Undeformed, &times);
        seen.iter().map(|o| o.q.rows(6, 3).into_owned()).collect::<Vec<_>>()
    };
    let truth = bends(0.0);
    let largest = truth.iter().map(|bend| bend.amax()).fold(0.0, f64::max);
    for angle in [0.3, 1.2] {
        let apart = bends(angle).iter().zip(&truth).map(|(found, truth)| (found - truth).amax()).fold(0.0, f64::max);
        assert!(apart < 1e-10 * largest, "{angle}: {:e}", apart / largest);
    }
}

/// Returns momentum and energy of an observation.
fn kept(plant: &Plant, seen: &Observation) -> (Wrench, f64) {
    let (mut data, mut state) = (Data::new(&plant.model), State::zeros(&plant.model));
    state.q.copy_from(&seen.q);
    state.qdot.copy_from(&seen.qdot);
    forward_kinematics_velocity(&plant.model, &mut data, &state);
    (momentum_of(&plant.model, &data), seen.energy.iter().sum())
}

/// Returns the maximum relative change of linear momentum, angular momentum and energy.
fn drift_of_the_flyer(kind: StepperKind, h: f64) -> [f64; 3] {
    let plant = free_flyer();
    let times: Vec<f64> = (0..=20).map(|k| 0.02 * f64::from(k)).collect();
    let seen = run(&plant, kind, h, Start::Undeformed, &times);
    let (p0, E0) = kept(&plant, &seen[0]);
    let bent = seen.iter().map(|o| o.q.rows(6, 3).norm()).fold(0.0, f64::max);
    let mut worst = [0.0f64; 3];
    for o in &seen {
        let (p, E) = kept(&plant, o);
        let found = [
            (p.force - p0.force).norm() / p0.force.norm(),
            (p.torque - p0.torque).norm() / p0.torque.norm(),
            (E / E0 - 1.0).abs(),
        ];
        (0..3).for_each(|k| worst[k] = worst[k].max(found[k]));
    }
    eprintln!(
        "{:<18} h {h:.0e}: momentum {:.1e} {:.1e}, energy {:.1e}; bends by {bent:.3} m",
        kind.name(),
        worst[0],
        worst[1],
        worst[2]
    );
    worst
}

/// Truth: conservation of momentum, angular momentum and energy of a body that tumbles and
/// vibrates; it deflects by 41 mm.
///
/// Measured, largest of the three: RK4 at 0.04 ms 2.0e-9 (due to the gimbals of 1e-9 kg; energy
/// 2.5e-10, with half the step 1.1e-11), reference stepper at 1e-9 2.2e-8, generalised-alpha
/// 8.3e-4, 1.4e-4, 1.6e-5 at 1, 0.5, 0.25 ms.
#[test]
fn free_flying_modal_body_keeps_momentum_and_energy() {
    let largest = |kind, h| drift_of_the_flyer(kind, h).into_iter().fold(0.0, f64::max);
    assert!(largest(reference(1e-9), 1e-3) < 1e-7);
    let energies = [4e-5, 2e-5].map(|h| {
        let [momentum, angular, energy] = drift_of_the_flyer(StepperKind::Rk4, h);
        assert!(momentum < 1e-9 && angular < 5e-9 && energy < 1e-9);
        energy
    });
    assert!(energies[1] < energies[0] / 12.0, "{energies:?}");
    let errors = [1e-3, 5e-4, 2.5e-4].map(|h| largest(ALPHA, h));
    assert!(errors[0] < 1e-3 && errors[2] < errors[0] / 12.0, "{errors:?}");
}

/// Returns the relative energy drift of a heavy horizontal cantilever released undeformed, over
/// `periods` of its first mode.
fn drift_of_the_cantilever(kind: StepperKind, steps_per_period: f64, periods: f64) -> (f64, f64) {
    let beam = BeamLink::new("beam", Section::Rectangle { width: 0.03, height: 0.02 }, Material::STEEL, 1.5);
    let modal = Arc::new(beam.modal(1).expect("a beam"));
    let mut root = Mechanism::new("cantilever");
    for name in ["base", "beam", "tip"] {
        root.links.push(Link { name: name.into(), inertia: None });
    }
    root.joints.push(Joint::new("root", JointKind::Continuous(Vector3::z_axis()), "base", "beam", Pose::identity()));
    root.joints.push(Joint::new("end", JointKind::Fixed, "beam", "tip", Pose::translation(1.5, 0.0, 0.0)));
    let reduced = beam.reduce().expect("a beam");
    let flexible = FlexibleLink { form: LinkForm::Modal(modal.clone()), ..FlexibleLink::new("beam", reduced) };
    let soft = substitute(&root, &[flexible]).expect("fits").mechanism;
    let springs = [("beam".to_owned(), modal_spring(&modal, Damping::StiffnessProportional(0.0)))];
    let plant = arm_of(&soft, &springs, Arc::new(Held(vec![0.0])));
    let period = 1.0 / plant.modes.frequencies_hz()[0];
    let h = period / steps_per_period;
    let mut stepper = new_stepper(kind, plant.clone(), h, Start::Undeformed).expect("starts");
    let mut seen = Observation::new(&plant);
    let mut energies = Vec::new();
    let mut swing = 0.0f64;
    for _ in 0..=(periods * steps_per_period) as usize {
        stepper.observe(&mut seen);
        energies.push(seen.energy.iter().sum::<f64>());
        swing = swing.max(seen.energy[2]);
        stepper.step().expect("steps");
    }
    let size = energies.iter().map(|E| (E - energies[0]).abs()).fold(0.0, f64::max) / swing;
    let tail = energies.len() / 10;
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len() as f64;
    let drift = (mean(&energies[energies.len() - tail..]) - mean(&energies[..tail])) / swing;
    eprintln!(
        "{:<18} {steps_per_period} steps, {periods} periods: energy within {size:.1e}, drifts {drift:.1e} of {swing:.3} J",
        kind.name()
    );
    (size, drift)
}

/// Truth: an undamped cantilever conserves its energy. Its section is no circle, whose first mode is
/// double and would have an arbitrary direction. Relative to the energy of its vibration, 50
/// steps per period, 300 periods:
///
/// | scheme | within | drifts by |
/// | --- | --- | --- |
/// | rho 1 | 1.1e-14 | 9e-15 |
/// | rho 1 with dispersion correction | 7.8e-4 | 9e-8 |
/// | rho 0.9 | | -1.0e-3 |
/// | rho 0.9 with dispersion correction | | -1.1e-3 |
///
/// RK4 loses 1.3e-6 in 100 periods of 1000 steps (required for stability), 4.3e-8 with 2000 steps:
/// fifth order.
#[test]
fn undamped_vibration_keeps_its_energy_over_many_periods() {
    let (size, drift) = drift_of_the_cantilever(alpha(1.0, false), 50.0, 300.0);
    assert!(size < 1e-12 && drift.abs() < 1e-12, "{size:e} {drift:e}");
    let (size, drift) = drift_of_the_cantilever(alpha(1.0, true), 50.0, 300.0);
    assert!(size < 2e-3 && drift.abs() < 1e-6, "{size:e} {drift:e}");
    for correction in [false, true] {
        let (_, drift) = drift_of_the_cantilever(alpha(0.9, correction), 50.0, 300.0);
        assert!((-2e-3..0.0).contains(&drift), "{drift:e}");
    }
    let losses = [1000.0, 2000.0].map(|steps| -drift_of_the_cantilever(StepperKind::Rk4, steps, 100.0).1);
    let order = (losses[0] / losses[1]).log2();
    assert!(losses[0] < 3e-6 && (order - 5.0).abs() < 0.3, "{losses:?} {order}");
}

// --- Steppers against each other

/// Lower and upper arm of the reference arm as beams.
fn arm_beams() -> [BeamLink; 2] {
    let aluminium = Material { E: 70e9, nu: 0.33, rho: 2700.0, ..Material::STEEL };
    let lower = BeamLink::new("link2", Section::Box { width: 0.16, height: 0.12, wall: 0.01 }, aluminium, 1.095);
    let lower = BeamLink { mass: Some(60.0), ..lower };
    let upper = BeamLink::new("link4", Section::Tube { outer_diameter: 0.14, wall: 0.006 }, Material::STEEL, 1.0);
    let upper = BeamLink { mass: Some(40.0), ..upper };
    let (z, x) = (Vector3::z(), Vector3::x());
    [
        lower.along(z, x, 0.0, Vector3::zeros()).expect("a direction"),
        upper.along(x, Vector3::y(), 0.0, Vector3::zeros()).expect("a direction"),
    ]
}

/// Returns the rigid reference arm with the two halves of each arm in one link.
fn whole_links() -> Mechanism {
    let mut plant = reference_arm(false).mechanism;
    for (name, next, length) in [("2b", "3", vector![0.0, 0.0, 1.095]), ("4b", "5", vector![1.0, 0.0, 0.0])] {
        plant.links.retain(|l| l.name != format!("link{name}"));
        plant.joints.retain(|j| j.name != format!("joint{name}"));
        for joint in plant.joints.iter_mut().filter(|j| j.name == format!("joint{next}")) {
            joint.parent = format!("link{}", &name[..1]);
            joint.X_PJ = Pose::translation(length.x, length.y, length.z);
        }
    }
    plant
}

fn reference_arm_motion() -> Arc<dyn PrescribedMotion> {
    Arc::new(MotionFn(follow_reference_motion))
}

/// The reference arm with modal links.
fn modal_arm(options: &ModalOptions, damping: Damping, motion: Arc<dyn PrescribedMotion>) -> Plant {
    let modals = arm_beams().map(|b| Arc::new(b.modal_with(options).expect("a beam")));
    let links: Vec<FlexibleLink> = arm_beams()
        .iter()
        .zip(&modals)
        .map(|(beam, modal)| {
            let reduced = beam.reduce().expect("a beam");
            FlexibleLink { form: LinkForm::Modal(modal.clone()), ..FlexibleLink::new(&beam.name, reduced) }
        })
        .collect();
    let soft = substitute(&whole_links(), &links).expect("fits").mechanism;
    let springs = modals.map(|m| (m.name.clone(), modal_spring(&m, damping)));
    arm_of(&soft, &springs, motion)
}

fn tcp(plant: &Plant, seen: &Observation) -> Vector3<f64> {
    let frame = plant.model.frame("tcp").expect("there");
    (seen.X_WB[frame.body] * frame.X_BF).translation.vector
}

/// Returns the maximum distance between the TCP positions of two runs.
fn distance(plant: &Plant, a: &[Observation], b: &[Observation]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (tcp(plant, a) - tcp(plant, b)).norm()).fold(0.0, f64::max)
}

/// Truth: RK4, which differs from the reference stepper at rtol 1e-10 by 9e-11 m. The TCP deflects
/// by 2.6 mm.
///
/// Measured: generalised-alpha 3.5e-7, 8.7e-8 m at 2, 1 ms, without the dispersion correction
/// 6.4e-6, 1.6e-6: second order.
#[test]
fn steppers_agree_on_the_reference_arm_with_modal_links() {
    let options = ModalOptions { geometric: true, ..ModalOptions::default() };
    let plant = modal_arm(&options, Damping::Modal(0.02), reference_arm_motion());
    let times: Vec<f64> = (0..=60).map(|k| 0.01 * f64::from(k)).collect();
    let of = |kind, h| run(&plant, kind, h, Start::Equilibrium, &times);
    let truth = of(StepperKind::Rk4, 1e-2 / (0.004 * plant.modes.omega.last().expect("modes")).ceil());
    let error = distance(&plant, &truth, &of(reference(1e-10), 1e-2));
    eprintln!("reference stepper and RK4: {error:.1e} m");
    assert!(error < 3e-10, "{error:e}");
    for (correction, bound) in [(true, 1.5e-7), (false, 3e-6)] {
        let errors = [2e-3, 1e-3].map(|h| distance(&plant, &truth, &of(alpha(0.9, correction), h)));
        let order = (errors[0] / errors[1]).log2();
        eprintln!("generalised-alpha, dispersion correction {correction}: {errors:?} m, order {order:.2}");
        assert!(errors[1] < bound && (order - 2.0).abs() < 0.1, "{errors:?}");
    }
    let refusal =
        new_stepper(StepperKind::Spook(SpookSettings::default()), plant.clone(), 1e-3, Start::Equilibrium).err();
    let text = refusal.expect("refused").to_string();
    assert!(text.contains("modal links") && text.contains("generalized-alpha"), "{text}");
}

/// Returns the lumped reference arm with single-axis gearboxes at axes 2 and 3.
fn geared_arm(motion: Arc<dyn PrescribedMotion>) -> Plant {
    let reference = reference_arm(true);
    let mut mechanism = reference.mechanism.clone();
    let gearboxes = [("joint2", 2e6), ("joint3", 1e6)].map(|(joint, k)| Gearbox {
        joint: joint.into(),
        stiffness: GearStiffness::Axis(k),
        seat: None,
    });
    let gears = insert_gearboxes(&mut mechanism, &gearboxes).expect("fits");
    let damping = Damping::StiffnessProportional(reference.beta);
    let mut springs: Vec<(String, Spring)> =
        gears.into_iter().map(|g| (g.joint.clone(), spring(&g.name, g.K, damping))).collect();
    for (joint, K) in ["joint2b", "joint4b"].iter().zip(&reference.K_S) {
        springs.push(((*joint).to_owned(), Spring::from(((*joint).to_owned(), *K, damping))));
    }
    arm_of(&mechanism, &springs, motion)
}

/// Truth: the reference stepper. Measured: 1.44e-5, 4.39e-6, 1.56e-6, 6.4e-7 m at 1, 0.5, 0.25,
/// 0.125 ms, with an order decreasing to 1.28; at rest 1e-10 of the sag of 5.5 mm.
#[test]
fn spook_with_gearboxes_converges_with_first_order_and_rests_exactly() {
    let plant = geared_arm(reference_arm_motion());
    let times: Vec<f64> = (0..=60).map(|k| 0.02 * f64::from(k)).collect();
    let truth = run(&plant, reference(1e-9), 1e-3, Start::Equilibrium, &times);
    let spook = StepperKind::Spook(SpookSettings::default());
    let error = |kind, h| distance(&plant, &truth, &run(&plant, kind, h, Start::Equilibrium, &times));
    let errors = [1e-3, 5e-4, 2.5e-4, 1.25e-4].map(|h| error(spook, h));
    let order = (errors[2] / errors[3]).log2();
    let smooth = error(ALPHA, 1e-3);
    eprintln!("SPOOK {errors:?} m, order {order:.2}; generalised-alpha {smooth:.1e} m");
    assert!(errors[0] < 3e-5 && errors[3] < 1e-6 && order > 0.9, "{errors:?}");
    assert!(smooth < 2e-7, "{smooth}");

    let plant = geared_arm(Arc::new(Held(vec![0.4, 0.5, -0.3, 0.7, 0.6, -1.2])));
    for h in [1e-4, 1e-3, 1e-2] {
        let seen = run(&plant, spook, h, Start::Equilibrium, &[0.0, 0.2]);
        let straight = run(&plant, ALPHA, h, Start::Undeformed, &[0.0]);
        let sag = (tcp(&plant, &seen[0]) - tcp(&plant, &straight[0])).norm();
        let drift = (tcp(&plant, &seen[1]) - tcp(&plant, &seen[0])).norm();
        eprintln!("SPOOK h {h:.0e}: drift {:.1e} of the sag {sag:.4} m", drift / sag);
        assert!(drift < 1e-8 * sag, "{h}: {}", drift / sag);
    }
}

// --- Chains of rigid parts

fn chain_arm(parts: usize, motion: Arc<dyn PrescribedMotion>) -> Plant {
    let links: Vec<FlexibleLink> = arm_beams()
        .iter()
        .map(|beam| {
            let reduced = beam.reduce().expect("a beam");
            let form = LinkForm::Chain(beam.chain(parts).expect("a chain"));
            FlexibleLink { form, ..FlexibleLink::new(&beam.name, reduced) }
        })
        .collect();
    let soft = substitute(&whole_links(), &links).expect("fits");
    let springs: Vec<(String, Spring)> = soft
        .joints()
        .map(|s| (s.joint.clone(), Spring::from((s.joint.clone(), s.K_S, Damping::StiffnessProportional(1e-3)))))
        .collect();
    arm_of(&soft.mechanism, &springs, motion)
}

/// Truth: the modal link with 6 modes and geometric stiffening. Maximum error of the first four
/// frequencies, and error of the sag of the TCP:
///
/// | parts | frequencies | sag | without stiffening |
/// | --- | --- | --- | --- |
/// | 2 | 1.2e-2 | 1.4e-2 | |
/// | 3 | 2.0e-3 | 3.3e-3 | |
/// | 5 | 3.1e-4 | 7.3e-4 | |
/// | 9 | 1.7e-4 | 1.2e-4 | 3.7e-4, 3.6e-4 |
///
/// Second order, down to a remainder: chains shorten as they bend and include this in their mass
/// matrix, first-order shapes do not. The remainder is proportional to the load (1.8e-4, 0.9e-4,
/// 0.45e-4 at one, half, a quarter of gravity), as the deflection is.
#[test]
fn chains_of_rigid_parts_converge_to_the_modal_link() {
    let pose = || Arc::new(Held(vec![0.4, 0.7, -0.3, 0.7, 0.6, -1.2]));
    let sag = |plant: &Plant| {
        let tcp_at = |start| tcp(plant, &run(plant, ALPHA, 1e-3, start, &[0.0])[0]);
        tcp_at(Start::Equilibrium) - tcp_at(Start::Undeformed)
    };
    let errors = |geometric: bool, parts: usize| {
        let options = ModalOptions { geometric, ..ModalOptions::default() };
        let (truth, chain) = (modal_arm(&options, Damping::Modal(0.0), pose()), chain_arm(parts, pose()));
        let (f, found, s) = (truth.modes.frequencies_hz(), chain.modes.frequencies_hz(), sag(&truth));
        let each: Vec<f64> = (0..4).map(|k| found[k] / f[k] - 1.0).collect();
        let sagging = (sag(&chain) - s).norm() / s.norm();
        eprintln!("stiffening {geometric}, {parts} parts: {each:?}, sag {sagging:.2e} of {:.5} m", s.norm());
        (each.iter().fold(0.0f64, |m, e| m.max(e.abs())), sagging)
    };
    let [two, three, five, nine] = [2, 3, 5, 9].map(|parts| errors(true, parts));
    for (coarse, fine) in [(two, three), (three, five)] {
        assert!(fine.0 < coarse.0 / 3.5 && fine.1 < coarse.1 / 3.5, "{coarse:?} {fine:?}");
    }
    assert!(
        two.0 < 2e-2 && two.1 < 2e-2 && nine.0 < 2.5e-4 && nine.1 < 2.5e-4 && five.1 < 1e-3,
        "{two:?} {five:?} {nine:?}"
    );
    let without = errors(false, 9);
    assert!(without.0 > 2.0 * nine.0 && without.1 > 2.0 * nine.1, "{without:?} {nine:?}");
}

// --- Allocations

/// Returns the reference arm with modal links with geometric stiffening, gearboxes with one, three
/// and six stiffnesses, and sampled controllers.
fn everything() -> Plant {
    let options = ModalOptions { geometric: true, modes: 2, ..ModalOptions::default() };
    let modals = arm_beams().map(|b| Arc::new(b.modal_with(&options).expect("a beam")));
    let links: Vec<FlexibleLink> = arm_beams()
        .iter()
        .zip(&modals)
        .map(|(beam, modal)| {
            let reduced = beam.reduce().expect("a beam");
            FlexibleLink { form: LinkForm::Modal(modal.clone()), ..FlexibleLink::new(&beam.name, reduced) }
        })
        .collect();
    let mut soft = substitute(&whole_links(), &links).expect("fits").mechanism;
    for joint in soft.joints.iter_mut().filter(|j| j.kind.name() == "continuous") {
        joint.armature = 5.0;
    }
    let full = nalgebra::Matrix6::from_diagonal(&nalgebra::Vector6::new(1e8, 1e8, 1e8, 1e6, 1e6, 1e6));
    let gearboxes = [
        ("joint1", GearStiffness::Tilting([3e6, 3e6, 1e6])),
        ("joint2", GearStiffness::Axis(2e6)),
        ("joint3", GearStiffness::Axis(1e6)),
        ("joint5", GearStiffness::Full(full)),
    ];
    let gearboxes = gearboxes.map(|(joint, stiffness)| Gearbox { joint: joint.into(), stiffness, seat: None });
    let gears = insert_gearboxes(&mut soft, &gearboxes).expect("fits");
    let mut springs: Vec<(String, Spring)> =
        modals.iter().map(|m| (m.name.clone(), modal_spring(m, Damping::Modal(0.02)))).collect();
    for g in gears {
        let mut of = spring(&g.name, g.K, Damping::Modal(0.02));
        if g.gearbox == "joint3" {
            of.curve = Some(TorqueCurve::backlash(1e6, 1e-5).into());
        }
        springs.push((g.joint, of));
    }
    let axis = |coordinate| ServoAxis {
        coordinate,
        position_gain: 20.0,
        velocity_gain: 400.0,
        integral_gain: 2000.0,
        feed_forward: 1.0,
        limit: 5000.0,
    };
    let mut plant = arm_of(&soft, &springs, reference_arm_motion());
    plant.friction =
        vec![Friction { viscous: 3.0, coulomb: 20.0, stribeck: 5.0, stribeck_velocity: 0.1, regularisation: 0.05 }; 6];
    let rigid = Arc::new(Model::new(&whole_links()).expect("a tree"));
    plant.with_servo(Servo { sample_s: 1e-3, axes: (0..6).map(axis).collect(), rigid }).expect("valid")
}

/// With modal links, gearboxes, backlash, friction and servos, samples included; and the two
/// steppers agree to 1.5e-7 m or rad.
///
/// Regression: every new factor of the corrected matrix allocated.
#[test]
fn steps_do_not_allocate_with_modal_links_and_drives() {
    let ends = [(ALPHA, 2.5e-4), (StepperKind::Rk4, 2e-5)].map(|(kind, h)| {
        let plant = everything();
        let mut stepper = new_stepper(kind, plant.clone(), h, Start::Equilibrium).expect("starts");
        stepper.step().expect("first");
        let allocations = count_allocations(|| {
            for _ in 1..(0.2 / h).round() as usize {
                stepper.step().expect("steps");
            }
        });
        assert_eq!(allocations, 0, "{}", kind.name());
        let mut seen = Observation::new(&plant);
        stepper.observe(&mut seen);
        eprintln!("{}: {:?} after {:?}", kind.name(), seen.q.rows(0, 6).as_slice(), stepper.counts());
        seen.q
    });
    let error = (&ends[0] - &ends[1]).amax();
    eprintln!("generalised-alpha against RK4: {error:.1e}");
    assert!(error < 5e-7, "{error}");
}
