//! Cost of links with many modes: the reference arm with two modal beams with a given number of
//! fixed-interface modes; steps without set-up.
//!
//! ```text
//! cargo run --release --workspace --example modal [STEPS] [MODES ...]
//! ```
//! Generalised-alpha with default settings at 1 ms, with the modes eliminated and with dense
//! matrices; CPU time of one thread, in turn, minimum of five.
#![allow(non_snake_case, reason = "monogram notation")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]

use std::sync::Arc;

use cpu_time::ThreadTime;
use flexarm_fem::{BeamLink, Material, ModalOptions, Section};
use flexarm_flexlink::{FlexibleLink, LinkForm, substitute};
use flexarm_kinematics::{Model, Pose};
use flexarm_stepping::*;
use flexarm_testkit::{reference_arm, reference_motion};
use nalgebra::{DMatrix, DVector, Vector3, vector};

fn beams() -> [BeamLink; 2] {
    let aluminium = Material { E: 70e9, nu: 0.33, rho: 2700.0, ..Material::STEEL };
    let lower = BeamLink::new("link2", Section::Box { width: 0.16, height: 0.12, wall: 0.01 }, aluminium, 1.095);
    let lower = BeamLink { mass: Some(60.0), ..lower };
    let upper = BeamLink::new("link4", Section::Tube { outer_diameter: 0.14, wall: 0.006 }, Material::STEEL, 1.0);
    let upper = BeamLink { mass: Some(40.0), ..upper };
    let (z, x) = (Vector3::z(), Vector3::x());
    [lower.along(z, x, 0.0, Vector3::zeros()).unwrap(), upper.along(x, Vector3::y(), 0.0, Vector3::zeros()).unwrap()]
}

/// Returns the arm with `modes` modes in each link.
fn arm(modes: usize) -> FlexibleArm {
    let mut mechanism = reference_arm(false).mechanism;
    for (name, next, length) in [("2b", "3", vector![0.0, 0.0, 1.095]), ("4b", "5", vector![1.0, 0.0, 0.0])] {
        mechanism.links.retain(|l| l.name != format!("link{name}"));
        mechanism.joints.retain(|j| j.name != format!("joint{name}"));
        for joint in mechanism.joints.iter_mut().filter(|j| j.name == format!("joint{next}")) {
            joint.parent = format!("link{}", &name[..1]);
            joint.X_PJ = Pose::translation(length.x, length.y, length.z);
        }
    }
    let options = ModalOptions { modes, ..ModalOptions::default() };
    let modal = beams().map(|beam| Arc::new(beam.modal_with(&options).unwrap()));
    let link = |(beam, modal): (&BeamLink, &Arc<_>)| {
        let reduced = beam.reduce().unwrap();
        FlexibleLink { form: LinkForm::Modal(Arc::clone(modal)), ..FlexibleLink::new(&beam.name, reduced) }
    };
    let links: Vec<FlexibleLink> = beams().iter().zip(&modal).map(link).collect();
    let model = Arc::new(Model::new(&substitute(&mechanism, &links).unwrap().mechanism).unwrap());
    let damping = Damping::StiffnessProportional(1e-3);
    let spring = |name: &str| {
        let modal = modal.iter().find(|modal| modal.name == name).unwrap();
        Spring { name: name.into(), K: modal.K.clone(), damping, curve: None, geometric: None }
    };
    let springs: Vec<Spring> = model.elastic().iter().map(|group| spring(&group.name)).collect();
    let motion = MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        let (x, y, z) = reference_motion(t);
        q.copy_from_slice(&x);
        v.copy_from_slice(&y);
        a.copy_from_slice(&z);
    });
    FlexibleArm::new(model, springs, Arc::new(motion)).unwrap()
}

/// The same system without information about its modes.
struct Dense(ReducedArm);

impl SecondOrderSystem for Dense {
    fn dimension(&self) -> usize {
        self.0.dimension()
    }
    fn residual(&mut self, t: f64, x: &DVector<f64>, v: &DVector<f64>, a: &DVector<f64>, r: &mut DVector<f64>) {
        self.0.residual(t, x, v, a, r);
    }
    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        self.0.acceleration(t, x, v, a)
    }
    fn mass(&mut self, M: &mut DMatrix<f64>) {
        self.0.mass(M);
    }
    fn damping_and_stiffness(&mut self, c_D: f64, c_K: f64, C: &mut DMatrix<f64>) {
        self.0.damping_and_stiffness(c_D, c_K, C);
    }
    fn stiffness(&mut self, K: &mut DMatrix<f64>) {
        self.0.stiffness(K);
    }
}

/// Returns the CPU time of a step (us), and the work.
fn timed(system: &mut impl SecondOrderSystem, e: &DVector<f64>, steps: usize) -> (f64, Counts) {
    let v = DVector::zeros(e.len());
    let mut alpha =
        GeneralizedAlpha::new(system, 0.0, 1e-3, AlphaSettings::default(), e.clone(), v).unwrap().leaving(0.03);
    let start = ThreadTime::now();
    for _ in 0..steps {
        alpha.step(system).unwrap();
    }
    (start.elapsed().as_secs_f64() * 1e6 / steps as f64, alpha.counts())
}

fn main() {
    let mut numbers = std::env::args().skip(1).map(|word| word.parse::<usize>().unwrap());
    let steps = numbers.next().unwrap_or(4000);
    let mut sizes: Vec<usize> = numbers.collect();
    if sizes.is_empty() {
        sizes = vec![0, 1, 2, 3, 6, 20, 40];
    }
    println!(
        "{:>6} {:>12} {:>10} {:>10} {:>10} {:>8}",
        "modes", "coordinates", "us/step", "dense", "eval/step", "factors"
    );
    for modes in sizes {
        let arm = arm(modes);
        let e = static_equilibrium(&arm, 0.0).unwrap();
        let (mut own, mut dense, mut counts) = (f64::INFINITY, f64::INFINITY, Counts::default());
        for _ in 0..5 {
            let (time, work) = timed(&mut ReducedArm::new(arm.clone()), &e, steps);
            (own, counts) = (own.min(time), work);
            dense = dense.min(timed(&mut Dense(ReducedArm::new(arm.clone())), &e, steps).0);
        }
        let evaluations = counts.evaluations as f64 / steps as f64;
        let n = arm.n_elastic_coordinates();
        println!("{modes:>6} {n:>12} {own:>10.2} {dense:>10.2} {evaluations:>10.3} {:>8}", counts.factorisations);
    }
}
