//! Long chains: matrices on a tree and their elimination, compared with dense ones.

use std::sync::Arc;

use flexarm_kinematics::{ElasticAngles, Model};
use flexarm_stepping::*;
use flexarm_testkit::allocations::count_allocations;
use flexarm_testkit::{Draw, chain_arm};
use nalgebra::{DMatrix, DVector};

/// Returns chains with `joints` joints in two links and a branch, with a motion of all joints.
fn plant(joints: usize, branch: usize, angles: ElasticAngles, damping: impl Fn(usize) -> Damping) -> Plant {
    let chains = chain_arm(joints, branch, angles);
    let model = Arc::new(Model::new(&chains.mechanism).unwrap());
    let springs = chains.K.iter().enumerate().map(|(k, K)| (format!("spring {k}"), *K, damping(k))).collect();
    let motion = MotionFn(|t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        for (k, q) in q.iter_mut().enumerate() {
            let (size, w) = (0.2 + 0.3 * k as f64, 3.0 + k as f64);
            // From rest, with an acceleration that begins at zero.
            let (s, c) = (w * t).sin_cos();
            *q = size * (w * t - s);
            v[k] = size * w * (1.0 - c);
            a[k] = size * w * w * s;
        }
    });
    Plant::new::<(String, nalgebra::Matrix6<f64>, Damping)>(model, springs, Arc::new(motion)).unwrap()
}

/// The same system without its tree structure.
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

/// M, C and K of a tree as dense matrices, by their definition.
fn assembled(tree: &TreeMatrices) -> [DMatrix<f64>; 3] {
    let n = 6 * tree.nodes.len();
    let mut to = [DMatrix::zeros(n, n), DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
    let mut moves: Vec<DMatrix<f64>> = Vec::new();
    for (j, node) in tree.nodes.iter().enumerate() {
        let mut E = DMatrix::zeros(6, n);
        if let Some(p) = node.parent {
            let mut X = DMatrix::zeros(6, 6);
            for ((row, column), block) in [(0, 0), (0, 3), (3, 3)].into_iter().zip(&node.carried) {
                X.view_mut((row, column), (3, 3)).copy_from(block);
            }
            E += X * &moves[p];
        }
        E.view_mut((0, 6 * j), (6, 6)).fill_with_identity();
        to[0] += E.transpose() * DMatrix::from_column_slice(6, 6, node.inertia.as_slice()) * &E;
        to[1].view_mut((6 * j, 6 * j), (6, 6)).copy_from(&node.Z);
        to[2].view_mut((6 * j, 6 * j), (6, 6)).copy_from(&node.K);
        moves.push(E);
    }
    to
}

fn far(found: &DMatrix<f64>, truth: &DMatrix<f64>) -> f64 {
    (found - truth).amax() / truth.amax()
}

/// Truth: mass matrix by composite rigid bodies, damping and stiffness as assembled. Deflected by
/// up to 0.5 rad, with a branch, prismatic and revolute joints, both kinds of angles, proportional
/// and other dampers. Measured: 3e-15.
#[test]
fn an_arm_of_chains_has_on_its_tree_the_same_matrices() {
    for (joints, branch, angles) in [
        (2, 1, ElasticAngles::EulerZyx),
        (5, 3, ElasticAngles::RotationVector),
        (16, 0, ElasticAngles::EulerZyx),
        (31, 4, ElasticAngles::RotationVector),
    ] {
        let dampings: [fn(usize) -> Damping; 3] = [
            |k| Damping::StiffnessProportional(1e-3 + 1e-4 * (k % 3) as f64),
            |k| Damping::Dampers([10.0 + k as f64, 11.0, 12.0, 1.0, 2.0, 3.0]),
            |_| Damping::Rayleigh(0.5, 1e-3),
        ];
        for damping in dampings {
            let mut system = ReducedArm::new(plant(joints, branch, angles, damping));
            let n = system.dimension();
            let mut draw = Draw(joints as u64);
            let mut vector = |size: f64| DVector::from_fn(n, |_, _| size * draw.signed());
            let (x, v, a) = (vector(0.5), vector(1.0), vector(10.0));
            let mut r = DVector::zeros(n);
            system.residual(0.3, &x, &v, &a, &mut r);
            let mut tree = TreeMatrices::default();
            assert!(system.along_tree(2e-3, 3e-6, &mut tree));
            let found = assembled(&tree);
            let mut truth = [DMatrix::zeros(n, n), DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
            let [M, C, K] = &mut truth;
            system.mass(M);
            system.damping_and_stiffness(2e-3, 3e-6, C);
            system.stiffness(K);
            let errors = [0, 1, 2].map(|k| far(&found[k], &truth[k]));
            eprintln!("{joints} joints, branch of {branch}: {errors:?}");
            assert!(errors.iter().all(|error| *error < 1e-13), "{errors:?}");
        }
    }
}

/// Runs one integrator on the arm with its tree and on the dense one; returns the maximum distance
/// relative to the peak, and both counts.
fn compared<I: Integrator>(
    plant: &Plant,
    (h, steps): (f64, usize),
    make: impl Fn(&mut dyn Beginning, f64) -> I,
) -> (f64, [Counts; 2]) {
    let (mut tree, mut dense) = (ReducedArm::new(plant.clone()), Dense(ReducedArm::new(plant.clone())));
    let (mut a, mut b) = (make(&mut tree, h), make(&mut dense, h));
    let rest = b.current().x.clone();
    let (mut far, mut peak) = (0.0f64, 0.0f64);
    for _ in 0..steps {
        a.step(&mut tree).unwrap();
        b.step(&mut dense).unwrap();
        far = far.max((&a.current().x - &b.current().x).amax());
        peak = peak.max((&b.current().x - &rest).amax());
    }
    (far / peak, [a.counts(), b.counts()])
}

/// Either system, to start an integrator.
trait Beginning {
    fn alpha(&mut self, h: f64, settings: AlphaSettings, x: DVector<f64>) -> GeneralizedAlpha;
    fn sdirk3(&mut self, h: f64, x: DVector<f64>) -> Sdirk3;
}

impl<S: SecondOrderSystem> Beginning for S {
    fn alpha(&mut self, h: f64, settings: AlphaSettings, x: DVector<f64>) -> GeneralizedAlpha {
        let v = DVector::zeros(x.len());
        GeneralizedAlpha::new(self, 0.0, h, settings, x, v).unwrap().leaving(0.03)
    }
    fn sdirk3(&mut self, h: f64, x: DVector<f64>) -> Sdirk3 {
        let v = DVector::zeros(x.len());
        Sdirk3::new(self, 0.0, h, x, v).unwrap()
    }
}

/// Truth: the dense matrices of the same system. Chains of 2 to 31 joints with a branch, every
/// spectral radius, with and without correction, lightly and strongly damped (oscillating and
/// overdamped modes), proportional damping and other. Measured: 7e-11 at rho 0 and 31 joints, 7e-12
/// elsewhere; the same iterations and factorisations.
#[test]
fn a_run_along_the_tree_is_the_dense_run() {
    let proportional: fn(f64) -> Damping = Damping::StiffnessProportional;
    for (joints, branch, beta, h) in [(2, 2, 1e-3, 1e-3), (3, 0, 1e-5, 1e-3), (8, 2, 1e-3, 2e-3), (31, 3, 1e-4, 1e-3)] {
        let plant = plant(joints, branch, ElasticAngles::RotationVector, |_| proportional(beta));
        let e = static_equilibrium(&plant, 0.0).unwrap();
        let steps = if joints > 20 { 60 } else { 200 };
        for rho in [0.0, 0.5, 0.9, 1.0] {
            for dispersion_correction in [true, false] {
                let settings = AlphaSettings { rho, dispersion_correction };
                let (far, [tree, dense]) = compared(&plant, (h, steps), |s, h| s.alpha(h, settings, e.clone()));
                eprintln!("{joints} joints, rho {rho}, corrected {dispersion_correction}: {far:.1e}, {tree:?}");
                assert!(far < 1e-9, "{far:e}");
                assert_eq!(tree, dense);
            }
        }
        let (far, [tree, dense]) = compared(&plant, (h, steps), |s, h| s.sdirk3(h, e.clone()));
        eprintln!("{joints} joints, sdirk3: {far:.1e}, {tree:?}");
        assert!(far < 1e-9 && tree == dense, "{far:e}");
    }
    // Damping that is not proportional to the stiffness, or with different factors.
    let dampings: [fn(usize) -> Damping; 3] = [
        |k| Damping::Dampers([300.0 + k as f64, 200.0, 200.0, 3.0, 2.0, 2.0]),
        |k| Damping::StiffnessProportional(1e-4 * (1 + k) as f64),
        |_| Damping::Rayleigh(2.0, 5e-4),
    ];
    for damping in dampings {
        let plant = plant(6, 2, ElasticAngles::EulerZyx, damping);
        let e = static_equilibrium(&plant, 0.0).unwrap();
        for dispersion_correction in [true, false] {
            let settings = AlphaSettings { rho: 0.9, dispersion_correction };
            let (far, [tree, dense]) = compared(&plant, (1e-3, 200), |s, h| s.alpha(h, settings, e.clone()));
            eprintln!("{:?}, corrected {dispersion_correction}: {far:.1e}, {tree:?}", damping(0));
            assert!(far < 1e-9 && tree == dense, "{far:e}");
        }
    }
}

/// Including renewals of the matrices.
#[test]
fn steps_of_chains_do_not_allocate() {
    let plant = plant(8, 2, ElasticAngles::RotationVector, |_| Damping::StiffnessProportional(1e-3));
    let kinds = [
        StepperKind::GeneralizedAlpha(AlphaSettings::default()),
        StepperKind::GeneralizedAlpha(AlphaSettings { rho: 0.9, dispersion_correction: false }),
        StepperKind::Sdirk3,
        StepperKind::Spook(SpookSettings::default()),
    ];
    for kind in kinds {
        let mut stepper = new_stepper(kind, plant.clone(), 1e-3, Start::Equilibrium).unwrap();
        stepper.step().unwrap();
        let before = stepper.counts().factorisations;
        let allocations = count_allocations(|| (0..400).for_each(|_| stepper.step().unwrap()));
        assert_eq!(allocations, 0, "{}", kind.name());
        assert!(stepper.counts().factorisations > before, "{}", kind.name());
    }
}
