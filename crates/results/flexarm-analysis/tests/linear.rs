//! Linear structures compared with closed forms: oscillators, chains of masses, rigid motions,
//! resonance peaks.

use std::f64::consts::{PI, TAU};

use flexarm_analysis::*;
use nalgebra::{Complex, DMatrix, DVector, dmatrix};
use proptest::prelude::*;

fn real(A: &DMatrix<f64>) -> DMatrix<Complex<f64>> {
    A.map(|x| Complex::new(x, 0.0))
}

/// One force and one displacement at the same coordinate.
fn force_to_displacement(M: DMatrix<f64>, D: DMatrix<f64>, K: DMatrix<f64>, at: usize) -> LinearSystem {
    let n = M.nrows();
    let unit = DMatrix::from_fn(n, 1, |i, _| f64::from(u8::from(i == at)));
    let zero = DMatrix::zeros(n, 1);
    let (B_1, B_2, C) = (zero.clone(), zero, unit.transpose());
    LinearSystem { M, D, K, B_0: unit, B_1, B_2, C, F: DMatrix::zeros(1, 1) }
}

/// Truth: `λ = -ζω ± iω sqrt(1 - ζ²)`, and beyond critical damping `-ζω ± ω sqrt(ζ² - 1)`. Measured
/// 5e-16.
#[test]
fn an_oscillator_has_its_frequency_and_ratio_up_to_and_beyond_critical_damping() {
    let (m, k) = (3.0, 3.0 * 40.0f64.powi(2));
    for zeta in [0.0, 0.01, 0.3, 0.9, 1.5, 8.0] {
        let d = 2.0 * zeta * 40.0 * m;
        let modes = damped_modes(&dmatrix![m], &dmatrix![d], &dmatrix![k]).unwrap();
        assert!(modes.iter().all(|mode| mode.residual < 1e-13));
        if zeta < 1.0 {
            assert_eq!(modes.len(), 1);
            assert!((modes[0].frequency_hz() * TAU / 40.0 - 1.0).abs() < 1e-13);
            eprintln!("osc {:.1e} {:.1e}", modes[0].frequency_hz() * TAU / 40.0 - 1.0, modes[0].damping_ratio() - zeta);
            assert!((modes[0].damping_ratio() - zeta).abs() < 1e-13);
            assert!((modes[0].damped_frequency_hz() * TAU / 40.0 - (1.0 - zeta * zeta).sqrt()).abs() < 1e-13);
            assert!((modes[0].shape[0] - Complex::new(1.0 / m.sqrt(), 0.0)).norm() < 1e-13);
        } else {
            let root = (zeta * zeta - 1.0f64).sqrt();
            assert_eq!(modes.len(), 2);
            for (mode, rate) in modes.iter().zip([zeta - root, zeta + root]) {
                assert!((mode.eigenvalue.re / (-40.0 * rate) - 1.0).abs() < 1e-12, "{zeta}: {}", mode.eigenvalue);
                assert_eq!((mode.eigenvalue.im, mode.damping_ratio()), (0.0, 1.0));
            }
        }
    }
}

/// Truth: a chain of n equal masses between walls, `ω_j = 2 sqrt(k/m) sin(jπ / (2(n+1)))`, and
/// `ζ_j = β ω_j / 2` for `D = β K`. Measured 6e-15.
#[test]
fn a_chain_of_masses_has_the_frequencies_and_ratios_of_the_textbook() {
    let (n, m, k, beta) = (7, 0.2, 900.0, 1e-3);
    let K = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => 2.0 * k,
        1 => -k,
        _ => 0.0,
    });
    let modes = damped_modes(&(DMatrix::identity(n, n) * m), &(&K * beta), &K).unwrap();
    assert_eq!(modes.len(), n);
    for (j, mode) in modes.iter().enumerate() {
        let omega = 2.0 * (k / m).sqrt() * ((j + 1) as f64 * PI / (2.0 * (n + 1) as f64)).sin();
        assert!((mode.frequency_hz() * TAU / omega - 1.0).abs() < 1e-12);
        eprintln!(
            "chain {:.1e} {:.1e}",
            mode.frequency_hz() * TAU / omega - 1.0,
            mode.damping_ratio() - 0.5 * beta * omega
        );
        assert!((mode.damping_ratio() - 0.5 * beta * omega).abs() < 1e-12);
        assert!(mode.shape.iter().all(|x| x.im.abs() < 1e-12), "proportional damping leaves the shapes real");
    }
}

/// Truth: two masses with one damper, whose quartic `λ⁴ + ...` is evaluated at the eigenvalues
/// found; and the trace of the first-order matrix. The damping is far from proportional. Measured
/// 4e-15.
#[test]
fn two_masses_with_one_damper_solve_their_quartic() {
    let (m_1, m_2, k_1, k_2, d) = (2.0, 0.5, 800.0, 300.0, 9.0);
    let M = dmatrix![m_1, 0.0; 0.0, m_2];
    let D = dmatrix![0.0, 0.0; 0.0, d];
    let K = dmatrix![k_1 + k_2, -k_2; -k_2, k_2];
    let modes = damped_modes(&M, &D, &K).unwrap();
    assert_eq!(modes.len(), 2);
    for mode in &modes {
        let l = mode.eigenvalue;
        let quartic = (l * l * m_1 + (k_1 + k_2)) * (l * l * m_2 + l * d + k_2) - k_2 * k_2;
        eprintln!("quartic {:.1e} {:.1e}", quartic.norm() / ((k_1 + k_2) * k_2), mode.residual);
        assert!(quartic.norm() < 1e-11 * (k_1 + k_2) * k_2, "{quartic}");
        assert!(mode.residual < 1e-13);
        // Shape from the first row.
        let ratio = (l * l * m_1 + (k_1 + k_2)) / k_2;
        assert!((mode.shape[1] / mode.shape[0] - ratio).norm() < 1e-12 * ratio.norm());
    }
    let trace: f64 = modes.iter().map(|mode| 2.0 * mode.eigenvalue.re).sum();
    assert!((trace / (-d / m_2) - 1.0).abs() < 1e-12);
}

/// Truth: two masses on a spring, free in space: one rigid motion, `ω² = k (1/m_1 + 1/m_2)`. With a
/// single mass damped to the ground: `0` and `-d/m`. An inverted pendulum falls with `sqrt(g/l)`.
#[test]
fn rigid_motions_and_falling_are_modes_too() {
    let K = dmatrix![500.0, -500.0; -500.0, 500.0];
    let modes = damped_modes(&dmatrix![2.0, 0.0; 0.0, 3.0], &DMatrix::zeros(2, 2), &K).unwrap();
    assert_eq!(modes.len(), 2);
    assert_eq!((modes[0].frequency_hz(), modes[0].damping_ratio()), (0.0, 0.0));
    assert!((modes[0].shape[0] - modes[0].shape[1]).norm() < 1e-9 && modes[0].residual < 1e-13);
    let omega = (500.0 * (1.0 / 2.0 + 1.0 / 3.0f64)).sqrt();
    let error = modes[1].frequency_hz() * TAU / omega - 1.0;
    eprintln!("free masses: {error:.1e}");
    assert!(error.abs() < 1e-13);

    let modes = damped_modes(&dmatrix![2.0], &dmatrix![8.0], &dmatrix![0.0]).unwrap();
    let found: Vec<f64> = modes.iter().map(|mode| mode.eigenvalue.re).collect();
    assert!(found[0] == 0.0 && (found[1] + 4.0).abs() < 1e-12, "{found:?}");

    let falling = damped_modes(&dmatrix![1.0], &dmatrix![0.0], &dmatrix![-9.81]).unwrap();
    let rates: Vec<f64> = falling.iter().map(|mode| mode.eigenvalue.re).collect();
    assert!(rates.iter().any(|r| (r - 9.81f64.sqrt()).abs() < 1e-12), "{rates:?}");
    assert!(falling.iter().any(|mode| mode.damping_ratio() == -1.0));
}

/// Two equal oscillators: any pair of shapes is valid if both satisfy the equation and span the
/// space.
#[test]
fn equal_frequencies_have_two_shapes() {
    let R = nalgebra::Rotation2::new(0.3);
    let turn = DMatrix::from_column_slice(2, 2, R.matrix().as_slice());
    let M = &turn * dmatrix![2.0, 0.0; 0.0, 2.0] * turn.transpose();
    let (D, K) = (&M * 0.7, &M * 90.0);
    let modes = damped_modes(&M, &D, &K).unwrap();
    assert_eq!(modes.len(), 2);
    let span = DMatrix::from_columns(&[modes[0].shape.clone(), modes[1].shape.clone()]);
    assert!(span.determinant().norm() > 0.1, "{span}");
    assert!(modes.iter().all(|mode| mode.residual < 1e-13));
}

/// Low modes stay accurate next to very stiff ones: 1 Hz next to 100 kHz. Measured 3e-15.
#[test]
fn a_low_mode_beside_a_stiff_one_keeps_its_digits() {
    let (low, high) = (TAU, TAU * 1e5);
    let K = dmatrix![low * low, 0.0; 0.0, high * high];
    let turn = dmatrix![1.0, 0.4; 0.0, 1.0];
    let M = turn.transpose() * &turn;
    let D = turn.transpose() * dmatrix![2.0 * 0.02 * low, 0.0; 0.0, 2.0 * 0.02 * high] * &turn;
    let modes = damped_modes(&M, &D, &(turn.transpose() * K * &turn)).unwrap();
    for (mode, omega) in modes.iter().zip([low, high]) {
        eprintln!("low {:.1e} {:.1e}", mode.frequency_hz() * TAU / omega - 1.0, mode.damping_ratio() / 0.02 - 1.0);
        assert!((mode.frequency_hz() * TAU / omega - 1.0).abs() < 1e-12, "{}", mode.frequency_hz());
        assert!((mode.damping_ratio() / 0.02 - 1.0).abs() < 1e-12, "{}", mode.damping_ratio());
    }
}

/// Truth: at `ω sqrt(1 - 2ζ²)` the amplitude is `1 / (2 ζ k sqrt(1 - ζ²))`; static `1/k`; phase
/// -90° at ω. Measured 2e-16 in magnitude and 3e-9 in frequency.
#[test]
fn an_oscillator_resonates_as_the_closed_form_says() {
    let (m, omega) = (1.7, TAU * 12.5);
    let k = m * omega * omega;
    for zeta in [1e-4, 0.03, 0.4] {
        let system = force_to_displacement(dmatrix![m], dmatrix![2.0 * zeta * omega * m], dmatrix![k], 0);
        assert!((system.response(0.0).unwrap()[(0, 0)].re * k - 1.0).abs() < 1e-14);
        assert!((system.response(omega).unwrap()[(0, 0)].arg() + PI / 2.0).abs() < 1e-12);
        let grid = with_resonances(&frequency_grid(1.0, 200.0, 50, Spacing::Logarithmic), &[(12.5, zeta)]);
        let magnitude = |hz: f64| system.response(TAU * hz).unwrap()[(0, 0)].norm();
        let values: Vec<f64> = grid.iter().map(|f| magnitude(*f)).collect();
        let peaks = response_peaks(&grid, &values, magnitude);
        assert_eq!(peaks.len(), 1);
        let height = 1.0 / (2.0 * zeta * k * (1.0 - zeta * zeta).sqrt());
        eprintln!(
            "peak {:.1e} {:.1e}",
            peaks[0].magnitude / height - 1.0,
            peaks[0].frequency / (12.5 * (1.0 - 2.0 * zeta * zeta).sqrt()) - 1.0
        );
        assert!((peaks[0].magnitude / height - 1.0).abs() < 1e-12, "{}", peaks[0].magnitude / height - 1.0);
        assert!((peaks[0].frequency / (12.5 * (1.0 - 2.0 * zeta * zeta).sqrt()) - 1.0).abs() < 1e-7);
    }
}

/// Truth: the closed form `1/|k - ω²m + iωd|` between the points; with two modes the difference of
/// two such terms.
#[test]
fn a_resolved_response_is_the_curve_and_not_a_chord_of_it() {
    let mode = |f: f64, zeta: f64, hz: f64| {
        let r = hz / f;
        nalgebra::Complex::new(1.0 - r * r, 2.0 * zeta * r).inv()
    };
    for zeta in [1e-3, 0.03] {
        // The second mode with the opposite sign: without an antiresonance between them, but with
        // one above both.
        let exact = |hz: f64| mode(12.5, zeta, hz) - mode(40.0, zeta, hz) * 0.2;
        let coarse =
            with_resonances(&frequency_grid(1.0, 200.0, 60, Spacing::Logarithmic), &[(12.5, zeta), (40.0, zeta)]);
        let (hz, response) = resolved_response(&coarse, |hz| Some(dmatrix![exact(hz)]), 0.02);
        assert!(coarse.iter().all(|f| hz.contains(f)), "what was asked for is there");
        let worst = |hz: &[f64]| {
            let off = |pair: &[f64], k: i32| {
                let part = f64::from(k) / 8.0;
                let between = pair[0] * (pair[1] / pair[0]).powf(part);
                let [a, m, b] = [pair[0], between, pair[1]].map(|hz| exact(hz).norm().ln());
                (m - a - (b - a) * part).abs()
            };
            hz.windows(2).flat_map(|pair| (1..8).map(move |k| off(pair, k))).fold(0.0, f64::max)
        };
        // Measured 0.0200 and 0.0197 with 133 and 82 points; the coarse grid of 78 has 1.0 and
        // 0.025.
        eprintln!("{} {} points, {} {}", worst(&hz), hz.len(), worst(&coarse), coarse.len());
        assert!(worst(&hz) < 0.022 && worst(&coarse) > 0.024);
        assert!(hz.len() < 200 && response.len() == hz.len());
    }
}

/// Truth: the undamped tuned-mass absorber keeps the main mass at rest at `sqrt(k_2/m_2)`.
#[test]
fn an_absorber_stills_the_main_mass() {
    let (k_2, m_2) = (200.0, 0.5);
    let K = dmatrix![1000.0 + k_2, -k_2; -k_2, k_2];
    let system = force_to_displacement(dmatrix![4.0, 0.0; 0.0, m_2], DMatrix::zeros(2, 2), K, 0);
    let at = |omega: f64| system.response(omega).unwrap()[(0, 0)].norm() * 1000.0;
    assert!(at((k_2 / m_2).sqrt()) < 1e-12 && at(0.0) > 0.9);
    let undamped = dmatrix![1.0];
    let alone = force_to_displacement(undamped.clone(), DMatrix::zeros(1, 1), undamped, 0);
    assert_eq!(alone.response(1.0), Err(LinearError::Resonance { omega: 1.0 }));
}

/// Truth: a mass on a spring and damper with a moving base: transmissibility
/// `(k + iωd) / (k + iωd - ω²m)`, with an absolute coordinate (force by rate of the base) or one
/// relative to the base (inertia by its acceleration, and F).
#[test]
fn a_moving_foot_is_force_or_inertia_alike() {
    let (m, d, k) = (1.3, 4.0, 900.0);
    let one = |x: f64| dmatrix![x];
    let absolute = LinearSystem {
        M: one(m),
        D: one(d),
        K: one(k),
        B_0: one(k),
        B_1: one(d),
        B_2: one(0.0),
        C: one(1.0),
        F: one(0.0),
    };
    let relative = LinearSystem { B_0: one(0.0), B_1: one(0.0), B_2: one(-m), F: one(1.0), ..absolute.clone() };
    for omega in [0.0, 5.0, 26.3, 26.3113, 200.0] {
        let dynamic = Complex::new(k - omega * omega * m, omega * d);
        let truth = Complex::new(k, omega * d) / dynamic;
        for system in [&absolute, &relative] {
            let found = system.response(omega).unwrap()[(0, 0)];
            assert!((found - truth).norm() < 1e-12 * truth.norm().max(1.0), "{omega}: {found} {truth}");
        }
    }
    assert_eq!(Quantity::Acceleration.factor(3.0), Quantity::Velocity.factor(3.0) * Quantity::Velocity.factor(3.0));
}

#[test]
fn a_grid_ends_where_it_was_told_to() {
    let grid = frequency_grid(1.0, 200.0, 301, Spacing::Logarithmic);
    assert_eq!((grid[0], grid[300], grid.len()), (1.0, 200.0, 301));
    assert!((grid[150] / 200.0f64.sqrt() - 1.0).abs() < 1e-14);
    assert_eq!(frequency_grid(0.0, 10.0, 6, Spacing::Linear), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
}

#[test]
fn matrices_that_do_not_fit_are_named() {
    let unit = DMatrix::identity(2, 2);
    let error = damped_modes(&unit, &DMatrix::zeros(3, 3), &unit).unwrap_err();
    assert_eq!(error.to_string(), "the damping matrix has 3 x 3 entries, expected 2 x 2");
    let error = damped_modes(&dmatrix![0.0], &dmatrix![0.0], &dmatrix![1.0]).unwrap_err();
    assert_eq!(error.to_string(), "the mass matrix is not positive definite");
    let error = damped_modes(&dmatrix![1.0], &dmatrix![0.0], &dmatrix![f64::NAN]).unwrap_err();
    assert_eq!(error, LinearError::NotFinite { what: "stiffness matrix" });
    assert!(damped_modes(&DMatrix::zeros(0, 0), &DMatrix::zeros(0, 0), &DMatrix::zeros(0, 0)).unwrap().is_empty());
}

fn positive_definite(n: usize) -> impl Strategy<Value = DMatrix<f64>> {
    prop::collection::vec(-1.0..1.0_f64, n * n).prop_map(move |entries| {
        let A = DMatrix::from_vec(n, n, entries);
        &A * A.transpose() + DMatrix::identity(n, n) * 0.1
    })
}

proptest! {
    /// For any damping: every mode satisfies its equation, the shares of the compliance add up to
    /// `C K^-1 Cᵀ`, the sum of the eigenvalues is the trace of `-M^-1 D`, and energy shares add up
    /// to one.
    #[test]
    fn modes_of_any_structure_hold_together(M in positive_definite(5), D in positive_definite(5), K in positive_definite(5), size in 0.01..3.0_f64) {
        let (D, K) = (D * size, K * 100.0);
        let modes = damped_modes(&M, &D, &K).unwrap();
        let C = DMatrix::from_fn(2, 5, |i, j| (1.0 + i as f64) * (j as f64 - 1.7));
        let mut sum = DVector::zeros(2);
        let (mut trace, mut count) = (0.0, 0);
        for mode in &modes {
            prop_assert!(mode.residual < 1e-11, "{}", mode.residual); // measured 1e-14
            let energy = mode.shape.dotc(&(real(&M) * &mode.shape));
            prop_assert!((energy - 1.0).norm() < 1e-12);
            sum += compliance_parts(mode, &M, &D, &C).unwrap();
            let pair = if mode.eigenvalue.im > 0.0 { 2 } else { 1 };
            trace += f64::from(pair) * mode.eigenvalue.re;
            count += pair;
            let blocks = [(0, K.view((0, 0), (2, 2)).into_owned()), (2, K.view((2, 2), (3, 3)).into_owned())];
            let shares = strain_energy_shares(&mode.shape, &blocks);
            prop_assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        prop_assert_eq!(count, 10);
        let truth = (&C * K.clone().cholesky().unwrap().solve(&C.transpose())).diagonal();
        prop_assert!((sum - &truth).amax() < 1e-8 * truth.amax());
        let M_inverse_D = M.cholesky().unwrap().solve(&D);
        prop_assert!((trace + M_inverse_D.trace()).abs() < 1e-9 * M_inverse_D.trace());
    }
}
