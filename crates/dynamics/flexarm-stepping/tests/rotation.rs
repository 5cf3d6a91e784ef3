//! Modes of arms that turn at constant speed: Coriolis forces, spin softening, stiffening by
//! centrifugal loads.

use std::sync::Arc;

use flexarm_fem::{BeamLink, Material, ModalOptions, Section};
use flexarm_flexlink::{FlexibleLink, LinkForm, substitute};
use flexarm_kinematics::*;
use flexarm_stepping::*;
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3, Vector6};

use crate::modal_links::{arm_of, modal_spring};

/// Returns the circular frequencies of `M ẍ + D ẋ + K x = 0` (rad/s), ascending.
fn frequencies(linear: &Linear) -> Vec<f64> {
    let n = linear.M.nrows();
    let inverse = linear.M.clone().try_inverse().unwrap();
    let mut A = DMatrix::zeros(2 * n, 2 * n);
    A.view_mut((0, n), (n, n)).fill_with_identity();
    A.view_mut((n, 0), (n, n)).copy_from(&(-&inverse * &linear.K));
    A.view_mut((n, n), (n, n)).copy_from(&(-&inverse * &linear.D));
    let mut omega: Vec<f64> = A.complex_eigenvalues().iter().map(|lambda| lambda.im).filter(|im| *im > 0.0).collect();
    omega.sort_by(f64::total_cmp);
    omega
}

/// Truth: a point mass on springs on a turntable, whose equations are linear. Radius R, speed w:
/// `(wx² - w² - s²) (wy² - w² - s²) = 4 w² s²`, stretch `m w² R / (kx - m w²)`.
#[test]
fn a_mass_on_a_turntable_has_the_frequencies_of_its_closed_form() {
    let (m, radius, k) = (2.0, 0.7, [4e3, 9e3, 6e3]);
    let mut table = Mechanism::new("turntable");
    for name in ["base", "disc"] {
        table.links.push(Link { name: name.into(), inertia: None });
    }
    let inertia = LinkInertia { mass: m, com: Vector3::zeros(), inertia_com: Matrix3::identity() * 1e-3 };
    table.links.push(Link { name: "mass".into(), inertia: Some(inertia) });
    table.joints.push(Joint::new("turn", JointKind::Continuous(Vector3::z_axis()), "base", "disc", Pose::identity()));
    let elastic = JointKind::Elastic(ElasticAngles::RotationVector);
    table.joints.push(Joint::new("spring", elastic, "disc", "mass", Pose::translation(radius, 0.0, 0.0)));
    let K = Matrix6::from_diagonal(&Vector6::new(k[0], k[1], k[2], 1e4, 1e4, 1e4));
    let springs = vec![("spring".to_owned(), K, Damping::StiffnessProportional(0.0))];
    let plant = Plant::new(Arc::new(Model::new(&table).unwrap()), springs, Arc::new(Held(vec![0.3]))).unwrap();
    let tool = plant.model.frame("mass").unwrap().clone();
    for w in [10.0, 30.0] {
        let found = linearise_rotation(&plant, &tool, &[0.3], &[w]).unwrap();
        let stretch = m * w * w * radius / (k[0] - m * w * w);
        assert!((found.linear.equilibrium[0] / stretch - 1.0).abs() < 1e-10, "{}", found.linear.equilibrium[0]);
        assert!(found.change < 1e-12, "{}", found.change);
        // s⁴ - (wx² + wy² + 2 w²) s² + (wx² - w²) (wy² - w²) = 0
        let [x, y, z] = k.map(|k| k / m);
        let (b, c) = (x + y + 2.0 * w * w, (x - w * w) * (y - w * w));
        let root = (b * b / 4.0 - c).sqrt();
        let omega = frequencies(&found.linear);
        for truth in [b / 2.0 - root, b / 2.0 + root, z].map(f64::sqrt) {
            let off = omega.iter().map(|own| (own / truth - 1.0).abs()).fold(f64::INFINITY, f64::min);
            eprintln!("w = {w}: {truth:.4} rad/s off by {off:.1e}");
            assert!(off < 1e-8, "{truth}: {omega:?}"); // measured 3e-11
        }
    }
}

/// Returns a beam of square section that turns about z.
fn rotor(beam: &BeamLink, form: LinkForm) -> Plant {
    let mut root = Mechanism::new("rotor");
    root.gravity = Vector3::zeros();
    for name in ["base", "beam", "tip"] {
        root.links.push(Link { name: name.into(), inertia: None });
    }
    let z = JointKind::Continuous(Vector3::z_axis());
    root.joints.push(Joint::new("root", z, "base", "beam", Pose::identity()));
    root.joints.push(Joint::new("end", JointKind::Fixed, "beam", "tip", Pose::translation(beam.length, 0.0, 0.0)));
    let undamped = Damping::StiffnessProportional(0.0);
    let modal = match &form {
        LinkForm::Modal(modal) => vec![("beam".to_owned(), modal_spring(modal, undamped))],
        _ => Vec::new(),
    };
    let flexible = FlexibleLink { form, ..FlexibleLink::new("beam", beam.reduce().unwrap()) };
    let soft = substitute(&root, &[flexible]).unwrap();
    let chain = soft.joints().map(|s| (s.joint.clone(), Spring::from((s.joint.clone(), s.K_S, undamped))));
    let springs: Vec<(String, Spring)> = modal.into_iter().chain(chain).collect();
    arm_of(&soft.mechanism, &springs, Arc::new(Held(vec![0.0])))
}

/// Truth: Wright, Smith, Thresher & Wang (1982), *J. Appl. Mech.* 49, hub radius zero: first
/// flapwise frequency over speed, both in units of sqrt(EI/(μ l⁴)); in the plane of rotation the
/// square is smaller by that of the speed.
#[test]
fn a_turning_beam_stiffens_as_in_the_literature_whatever_its_model() {
    let (length, side, steel) = (2.0, 0.02_f64, Material::STEEL);
    let beam = BeamLink::new("beam", Section::Rectangle { width: side, height: side }, steel, length);
    // EI/(μ l⁴) of a square: E h² / (12 ρ l⁴)
    let unit = (steel.E / (12.0 * steel.rho)).sqrt() * side / (length * length);
    let modal = beam.modal_with(&ModalOptions { modes: 12, geometric: true, elements: 24 }).unwrap();
    let forms = [
        ("modal", LinkForm::Modal(Arc::new(modal)), 1e-3), // measured 3.6e-4
        ("16 parts", LinkForm::Chain(beam.chain(16).unwrap()), 3e-3), // measured 1.5e-3
    ];
    for (name, form, bound) in forms {
        let plant = rotor(&beam, form);
        let tool = plant.model.frame("tip").unwrap().clone();
        for (speed, truth) in [(1.0, 3.6816_f64), (2.0, 4.1373), (4.0, 5.5850), (10.0, 11.2023)] {
            let found = linearise_rotation(&plant, &tool, &[0.0], &[speed * unit]).unwrap();
            let omega = frequencies(&found.linear);
            let off =
                |truth: f64| omega.iter().map(|own| (own / (truth * unit) - 1.0).abs()).fold(f64::INFINITY, f64::min);
            // The difference of squares magnifies errors of the truth.
            let square = truth * truth - speed * speed;
            let (flap, lag) = (off(truth), off(square.sqrt()) * square / (truth * truth));
            eprintln!("{name}, speed {speed}: flap off by {flap:.1e}, lag by {lag:.1e}");
            assert!(flap < bound && lag < bound, "{name}, {speed}: {flap:e} {lag:e}");
        }
    }
}
