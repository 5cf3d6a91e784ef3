//! The modal link of a uniform beam against closed forms, and invariance under changes of
//! coordinates.

use std::f64::consts::TAU;

use crate::common::{lower_arm, turned};
use flexarm_fem::{Bar, BeamLink, BeamTheory, FemError, Material, ModalOptions, Section};
use nalgebra::{DMatrix, Matrix6, Vector6};

/// Slender uniform beam of unit length and mass with bending stiffness 1 and 1.7, stiff in stretch
/// and torsion.
fn slender() -> BeamLink {
    let r2 = 1e-7;
    let bar = Bar {
        EA: 1e7,
        EI_y: 1.0,
        EI_z: 1.7,
        GJ: 2.0,
        kGA_y: None,
        kGA_z: None,
        mass_per_length: 1.0,
        rotary_y: r2,
        rotary_z: r2,
    };
    BeamLink {
        theory: BeamTheory::EulerBernoulli,
        ..BeamLink::new("slender", Section::Given(bar), Material::STEEL, 1.0)
    }
}

fn relative(A: &Matrix6<f64>, B: &Matrix6<f64>) -> f64 {
    let s = B.diagonal().map(f64::sqrt);
    Matrix6::from_fn(|i, j| (A[(i, j)] - B[(i, j)]).abs() / (s[i] * s[j])).amax()
}

/// Identity: without fixed-interface modes the coordinates are the displacement of B, and K is its
/// stiffness.
#[test]
fn a_modal_link_without_modes_yields_as_the_reduced_link() {
    for beam in [lower_arm(), turned(), slender()] {
        let reduced = beam.reduce().unwrap();
        for modes in [0, 7] {
            let link = beam.modal(modes).unwrap();
            assert_eq!(link.coordinates(), 6 + modes);
            let K = Matrix6::from_fn(|i, j| link.K[(i, j)]);
            let error = relative(&K, &reduced.K_BB);
            assert!(error < 1e-9, "{error:.1e}"); // measured 0
            let C = link.compliance(0).unwrap();
            for load in 0..6 {
                let F = Vector6::ith(load, 100.0);
                let truth = reduced.K_BB.cholesky().unwrap().solve(&F);
                let scale = reduced.K_BB.diagonal().map(f64::sqrt);
                let gap = (C * F - truth).component_mul(&scale).amax() / truth.component_mul(&scale).amax();
                assert!(gap < 1e-9, "{load} {gap:.1e}"); // measured 3e-15
            }
            // The mass properties are those of the two parts.
            let (body, truth) = (link.rigid(), reduced.rigid());
            let inertia = (body.inertia - truth.inertia).amax() / truth.inertia.amax();
            let com = (body.com - truth.com).norm();
            // measured 1e-15
            assert!((body.mass / truth.mass - 1.0).abs() < 1e-12 && com < 1e-12 && inertia < 1e-12);
        }
    }
}

/// Roots `β l` of a frequency equation of the uniform beam, by bisection between sign changes.
fn roots(f: impl Fn(f64) -> f64, count: usize) -> Vec<f64> {
    let mut found = Vec::new();
    let mut x = 0.1;
    while found.len() < count {
        let (mut low, mut high) = (x, x + 0.05);
        if f(low) * f(high) < 0.0 {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if f(low) * f(middle) <= 0.0 { high = middle } else { low = middle }
            }
            found.push(low);
        }
        x += 0.05;
    }
    found
}

/// Frequencies of both planes, rad/s, ascending: `(β l)² sqrt(EI)`.
fn both_planes(y: &[f64], z: &[f64]) -> Vec<f64> {
    let of = |roots: &[f64], EI: f64| roots.iter().map(|b| b * b * EI.sqrt()).collect::<Vec<_>>();
    // Deflection along y depends on EI_z.
    let mut all = [of(y, 1.7), of(z, 1.0)].concat();
    all.sort_by(f64::total_cmp);
    all
}

/// Frequencies of a dense pencil, rad/s, by the Cholesky factor of the mass.
fn frequencies(K: &DMatrix<f64>, M: &DMatrix<f64>) -> Vec<f64> {
    let inverse = M.clone().cholesky().unwrap().l().try_inverse().unwrap();
    let A = &inverse * K * inverse.transpose();
    let mut all: Vec<f64> =
        ((&A + A.transpose()) * 0.5).symmetric_eigenvalues().iter().map(|e| e.max(0.0).sqrt()).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Truth: Euler-Bernoulli, cos cosh = -1 (clamped), cos cosh = 1 (free), tan = tanh (pinned about z
/// at A, clamped across); checked for the lower half of the retained modes.
#[test]
fn frequencies_of_a_beam_are_the_closed_forms_however_its_frame_is_held() {
    let kept = 24;
    let link = slender().modal(kept).unwrap();
    let clamped = roots(|b| b.cos() * b.cosh() + 1.0, kept);
    let free = roots(|b| b.cos() - 1.0 / b.cosh(), kept);
    let pinned = roots(|b| b.sin() - b.tanh() * b.cos(), kept);
    let n = link.coordinates();
    let pick = |rows: &[usize]| {
        let rows: Vec<usize> = rows.iter().copied().chain(6..6 + n).collect();
        let M = link.mass_matrix().select_rows(&rows).select_columns(&rows);
        let mut K = DMatrix::zeros(6 + n, 6 + n);
        K.view_mut((6, 6), (n, n)).copy_from(&link.K);
        frequencies(&K.select_rows(&rows).select_columns(&rows), &M)
    };
    let cases = [
        ("clamped", pick(&[]), both_planes(&clamped, &clamped)),
        ("free", pick(&[0, 1, 2, 3, 4, 5]).split_off(6), both_planes(&free, &free)),
        ("pinned about z", pick(&[5]).split_off(1), both_planes(&pinned, &clamped)),
    ];
    for (what, found, truth) in cases {
        for k in 0..kept / 2 {
            let error = found[k] / truth[k] - 1.0;
            eprintln!("{what} {k}: {error:.1e}");
            // measured 8.6e-4 (the highest, free)
            assert!(error.abs() < 1e-3, "{what} {k}: {error:.1e}");
        }
    }
    let hz = |all: Vec<f64>| all.into_iter().map(|hz| hz * TAU).collect::<Vec<_>>();
    let (held, free) = (hz(link.held_frequencies_hz()), hz(link.free_frequencies_hz()));
    assert!((held[0] / (1.875_104_069_f64.powi(2)) - 1.0).abs() < 1e-5);
    assert!(free[5] < 1e-3 * free[6] && (free[6] / 4.730_040_745_f64.powi(2) - 1.0).abs() < 1e-4);
}

/// Second algorithm: all modes of the elements, which are the FE model itself.
#[test]
fn few_modes_give_the_low_frequencies_of_all_elements() {
    for beam in [lower_arm(), turned()] {
        let options = ModalOptions { modes: 138, ..ModalOptions::default() };
        let all = beam.modal_with(&options).unwrap();
        let few = beam.modal_with(&ModalOptions { modes: 30, ..options }).unwrap();
        for (what, few, all) in [
            ("held", few.held_frequencies_hz(), all.held_frequencies_hz()),
            ("free", few.free_frequencies_hz().split_off(6), all.free_frequencies_hz().split_off(6)),
        ] {
            for k in 0..5 {
                let error = few[k] / all[k] - 1.0;
                eprintln!("Timoshenko {what} {k}: {:.2} Hz {error:.1e}", all[k]);
                assert!((-1e-9..2e-3).contains(&error), "{what} {k}: {error:.1e}"); // measured 8.3e-4
            }
        }
        // Doubling the number of elements changes the low frequencies little.
        let fine = beam.modal_with(&ModalOptions { modes: 30, elements: 48, geometric: false }).unwrap();
        for k in 0..6 {
            let error = few.held_frequencies_hz()[k] / fine.held_frequencies_hz()[k] - 1.0;
            eprintln!("elements {k}: {error:.1e}");
            assert!(error.abs() < 2e-3, "{k}: {error:.1e}");
        }
    }
}

fn worst(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |worst: f64, x| if x <= worst { worst } else { x })
}

/// Identity: motions, frequencies and compliance do not depend on the choice of coordinates.
#[test]
fn an_orthogonalised_link_is_the_same_link() {
    let options = ModalOptions { modes: 10, geometric: true, ..ModalOptions::default() };
    for beam in [lower_arm(), turned()] {
        let link = beam.modal_with(&options).unwrap();
        let modes = link.orthogonalised(None).unwrap();
        let n = link.coordinates();
        let held =
            worst(link.held_frequencies_hz().iter().zip(modes.held_frequencies_hz()).map(|(a, b)| (a / b - 1.0).abs()));
        // Another solver, whose low frequencies lose digits to the high ones.
        let dense = worst(
            frequencies(&link.K, &link.M)
                .iter()
                .zip(modes.held_frequencies_hz())
                .map(|(a, b)| (a / b / TAU - 1.0).abs()),
        );
        let free = worst(
            link.free_frequencies_hz()[6..]
                .iter()
                .zip(&modes.free_frequencies_hz()[6..])
                .map(|(a, b)| (a / b - 1.0).abs()),
        );
        let compliance = relative(&modes.compliance(0).unwrap(), &link.compliance(0).unwrap());
        eprintln!("orthogonalised: held {held:.1e} dense {dense:.1e} free {free:.1e} compliance {compliance:.1e}");
        assert!(held < 1e-10, "{held:.1e}"); // measured 0
        assert!(dense < 1e-10, "{dense:.1e}"); // measured 6e-13
        assert!(free < 1e-10, "{free:.1e}"); // measured 2e-12
        assert!(compliance < 1e-10, "{compliance:.1e}"); // measured 3e-15

        // The integrals are still consistent, and the modes are orthonormal.
        let trace = worst((0..n * n).map(|at| (modes.N[at].trace() - f64::from(at / n == at % n)).abs()));
        assert!(trace < 1e-10, "{trace:.1e}"); // measured 1.3e-13
        let axial = |A: &nalgebra::Matrix3<f64>| {
            nalgebra::Vector3::new(A[(1, 2)] - A[(2, 1)], A[(2, 0)] - A[(0, 2)], A[(0, 1)] - A[(1, 0)])
        };
        let moment = worst((0..n).map(|k| (axial(&modes.P[k]) - modes.C_r.column(k)).amax() / modes.C_r.amax()));
        assert!(moment < 1e-12, "{moment:.1e}"); // measured 2.5e-15

        // Fewer modes: the same low frequencies, a stiffer tip.
        let few = link.orthogonalised(Some(5)).unwrap();
        assert_eq!((few.coordinates(), few.N.len(), few.interfaces[0].Phi.ncols()), (5, 25, 5));
        assert_eq!(few.held_frequencies_hz()[4], modes.held_frequencies_hz()[4]);
        assert!(link.orthogonalised(Some(n + 1)).is_err());
        assert!(!few.is_craig_bampton() && few.truncated(1).is_err());
    }
}

/// Identity: truncating modes equals not computing them.
#[test]
fn a_truncated_link_is_the_one_with_fewer_modes() {
    let options = |modes| ModalOptions { modes, geometric: true, ..ModalOptions::default() };
    let (many, few) = (turned().modal_with(&options(9)).unwrap(), turned().modal_with(&options(4)).unwrap());
    let cut = many.truncated(4).unwrap();
    assert_eq!((cut.coordinates(), &cut.labels, &cut.interfaces), (10, &few.labels, &few.interfaces));
    let size = |k: usize| few.M[(k, k)].sqrt();
    // The sign of a mode is arbitrary, so quadratic integrals are compared.
    let N = worst((0..10).map(|k| (cut.N[k * 11] - few.N[k * 11]).amax() / (size(k) * size(k))));
    let K = worst((0..10).map(|k| (cut.K[(k, k)] / few.K[(k, k)] - 1.0).abs()));
    eprintln!("truncated: N {N:.1e} K {K:.1e}");
    assert!(N < 1e-10 && K < 1e-12, "{N:.1e} {K:.1e}"); // measured 1.5e-13, 1.3e-15
    assert!(matches!(many.truncated(10), Err(FemError::OutOfRange { .. })));
}

/// Truth: static deflection of a cantilever under its own weight, `w l⁴/(8 EI)` at the tip.
#[test]
fn a_cantilever_sags_under_its_own_weight_as_the_textbook_says() {
    let link = slender().modal(6).unwrap();
    // Kη = -C_tᵀ a for an acceleration of the frame: unit gravity along -z.
    let load = link.C_t.row(2).transpose() * -1.0;
    let eta = link.K.clone().cholesky().unwrap().solve(&nalgebra::DVector::from_column_slice(load.as_slice()));
    let error = eta[2] / (-1.0 / 8.0) - 1.0;
    eprintln!("sag {error:.1e}");
    assert!(error.abs() < 1e-9, "{error:.1e}"); // measured 2.6e-13
    // The unit loads include gravity along the beam: a hanging beam stiffens.
    let hanging = slender().modal_with(&ModalOptions { geometric: true, ..ModalOptions::default() }).unwrap();
    let G = &hanging.geometric.as_ref().unwrap().acceleration[0];
    // The load -a along x compresses the beam: with a = -1 the beam hangs along gravity.
    assert!(G[(2, 2)] < 0.0);
    // Truth: a column buckles under its own weight at 7.8373 EI/l² [Timoshenko & Gere, art. 2.12].
    let L = hanging.K.clone().cholesky().unwrap().l();
    let A = L.solve_lower_triangular(G).unwrap();
    let A = L.solve_lower_triangular(&A.transpose()).unwrap();
    let critical = -1.0 / ((&A + A.transpose()) * 0.5).symmetric_eigenvalues().min();
    eprintln!("own weight {:.1e}", critical / 7.8373 - 1.0);
    assert!((critical / 7.8373 - 1.0).abs() < 1e-3, "{critical}"); // measured 1.9e-4
}

#[test]
fn impossible_choices_are_refused() {
    let with = |modes, elements| slender().modal_with(&ModalOptions { modes, elements, geometric: false });
    assert!(matches!(with(7, 2), Err(FemError::OutOfRange { .. })));
    assert!(matches!(with(0, 1), Err(FemError::OutOfRange { .. })));
    assert!(matches!(with(6, 2).map(|link| link.coordinates()), Ok(12)));
    let negative = BeamLink { mass: Some(-1.0), ..slender() };
    assert!(negative.modal(2).is_err());
}
