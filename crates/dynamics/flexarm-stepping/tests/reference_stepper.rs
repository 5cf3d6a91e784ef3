//! Reference stepper: closed forms, restarts, its work on the reference arm.

use std::f64::consts::TAU;

use flexarm_settings::Words;
use flexarm_stepping::*;
use nalgebra::{DMatrix, DVector};

use ReferenceMethod::{Bdf, Esdirk34, Tsit45};

/// `ẍ + 2 ζ ω ẋ + ω² x = load(t)`, uncoupled; without matrices, which the reference stepper does
/// not use.
struct Oscillators<F> {
    omega: Vec<f64>,
    zeta: f64,
    load: F,
    evaluations: u64,
}

impl<F: Fn(f64) -> f64> SecondOrderSystem for Oscillators<F> {
    fn dimension(&self) -> usize {
        self.omega.len()
    }
    fn residual(&mut self, _: f64, _: &DVector<f64>, _: &DVector<f64>, _: &DVector<f64>, _: &mut DVector<f64>) {
        unreachable!("only accelerations are asked for")
    }
    fn acceleration(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        v: &DVector<f64>,
        a: &mut DVector<f64>,
    ) -> Result<(), StepError> {
        self.evaluations += 1;
        for (k, omega) in self.omega.iter().enumerate() {
            a[k] = (self.load)(t) - 2.0 * self.zeta * omega * v[k] - omega * omega * x[k];
        }
        Ok(())
    }
    fn mass(&mut self, _: &mut DMatrix<f64>) {
        unreachable!("only accelerations are asked for")
    }
    fn damping_and_stiffness(&mut self, _: f64, _: f64, _: &mut DMatrix<f64>) {
        unreachable!("only accelerations are asked for")
    }
    fn stiffness(&mut self, _: &mut DMatrix<f64>) {
        unreachable!("only accelerations are asked for")
    }
}

fn settings(method: ReferenceMethod, rtol: f64) -> ReferenceSettings {
    ReferenceSettings { method, ..ReferenceSettings::new(rtol) }
}

const METHODS: [ReferenceMethod; 3] = [Bdf, Esdirk34, Tsit45];

/// Runs over `t` in `[0, 1]`; returns the maximum error of x and of v/ω at the points, and the
/// integrator.
fn run<F: Fn(f64) -> f64>(
    system: &mut Oscillators<F>,
    settings: ReferenceSettings,
    h: f64,
    start: [f64; 2],
    restarts: &[f64],
    truth: impl Fn(f64) -> [f64; 2],
) -> ([f64; 2], Reference) {
    let [x, v] = start.map(|x| DVector::from_element(1, x));
    let mut g = Reference::new(system, 0.0, h, settings, x, v).expect("starts");
    restarts.iter().for_each(|t| g.restart_at(*t));
    let mut worst = [0.0f64; 2];
    for k in 1..=(1.0 / h).round() as usize {
        g.step(system).expect("steps");
        assert!((g.time() - k as f64 * h).abs() < 1e-12);
        let [x, v] = truth(g.time());
        worst[0] = worst[0].max((g.now.x[0] - x).abs());
        worst[1] = worst[1].max((g.now.v[0] - v).abs() / system.omega[0]);
    }
    (worst, g)
}

const OMEGA: f64 = TAU * 10.0;

/// Truth: `x = cos ω t`, ten periods. Measured, relative to the tolerance: BDF 12 to 170, ESDIRK 60
/// to 330, explicit 2 to 3.
#[test]
fn harmonic_oscillator_keeps_its_closed_form_to_the_tolerance() {
    for method in METHODS {
        let mut last = f64::INFINITY;
        for rtol in [1e-4, 1e-6, 1e-8, 1e-10] {
            if method == Esdirk34 && rtol < 1e-9 {
                continue; // third order: 20 000 steps
            }
            let mut system = Oscillators { omega: vec![OMEGA], zeta: 0.0, load: |_| 0.0, evaluations: 0 };
            let truth = |t: f64| [(OMEGA * t).cos(), -OMEGA * (OMEGA * t).sin()];
            let (error, g) = run(&mut system, settings(method, rtol), 1e-3, [1.0, 0.0], &[], truth);
            eprintln!(
                "{:<8} rtol {rtol:.0e}: error {:.1e} of x, {:.1e} of v; {} steps, {} evaluations, {} factorisations",
                method.word().unwrap_or_default(),
                error[0],
                error[1],
                g.solver_steps,
                g.evaluations,
                g.factorisations
            );
            let largest = error[0].max(error[1]);
            assert!(largest < 1e3 * rtol && largest < 0.1 * last, "{method:?} {rtol}: {largest}");
            last = largest;
            assert_eq!(g.evaluations, system.evaluations);
        }
    }
}

/// `ẍ + 2 ζ ω ẋ + ω² x = f sin p t` from rest: forced vibration plus the free vibration that
/// cancels it at the start.
fn driven(t: f64, zeta: f64, f: f64, p: f64) -> [f64; 2] {
    let (a, b) = (OMEGA * OMEGA - p * p, 2.0 * zeta * OMEGA * p);
    let (s, c) = (f * a / (a * a + b * b), -f * b / (a * a + b * b));
    let (w, decay) = (OMEGA * (1.0 - zeta * zeta).sqrt(), zeta * OMEGA);
    let (A, B) = (-c, (-s * p - decay * c) / w); // e^(-decay t) (A cos wt + B sin wt)
    let (sin, cos, fade) = ((w * t).sin(), (w * t).cos(), (-decay * t).exp());
    [
        s * (p * t).sin() + c * (p * t).cos() + fade * (A * cos + B * sin),
        p * (s * (p * t).cos() - c * (p * t).sin()) + fade * (w * (B * cos - A * sin) - decay * (A * cos + B * sin)),
    ]
}

/// Truth: the closed form above. Measured at 1e-8, relative to tolerance times amplitude: BDF 24,
/// ESDIRK 100, explicit 0.3.
#[test]
fn damped_driven_oscillator_keeps_its_closed_form() {
    let (zeta, p) = (0.05, 47.0);
    let f = OMEGA * OMEGA;
    let amplitude = (1..1000).map(|k| driven(1e-3 * f64::from(k), zeta, f, p)[0].abs()).fold(0.0, f64::max);
    for method in METHODS {
        let mut system = Oscillators { omega: vec![OMEGA], zeta, load: |t: f64| f * (p * t).sin(), evaluations: 0 };
        let (error, _) = run(&mut system, settings(method, 1e-8), 1e-3, [0.0; 2], &[], |t| driven(t, zeta, f, p));
        eprintln!(
            "{:<8} error {:.1e} of x, {:.1e} of v",
            method.word().unwrap_or_default(),
            error[0] / amplitude,
            error[1] / amplitude
        );
        assert!(error[0].max(error[1]) < 1e3 * 1e-8 * amplitude, "{method:?} {error:?}");
    }
}

/// Points inside the solver's steps are as accurate as the steps: ten thousand points, hundreds per
/// step, against one hundred.
///
/// Measured: the maximum errors differ by at most 5 %.
#[test]
fn error_between_the_steps_is_that_of_the_steps() {
    for method in METHODS {
        let truth = |t: f64| [(OMEGA * t).cos(), -OMEGA * (OMEGA * t).sin()];
        let [coarse, dense] = [1e-2, 1e-5].map(|h| {
            let mut system = Oscillators { omega: vec![OMEGA], zeta: 0.0, load: |_| 0.0, evaluations: 0 };
            let (error, g) = run(&mut system, settings(method, 1e-6), h, [1.0, 0.0], &[], truth);
            eprintln!("{:<8} h {h:.0e}: {error:?}, {} steps", method.word().unwrap_or_default(), g.solver_steps);
            error
        });
        for k in 0..2 {
            assert!(dense[k] < 2.0 * coarse[k] && coarse[k] < 2.0 * dense[k], "{method:?}: {coarse:?} {dense:?}");
        }
    }
}

/// Closed form from rest with a load that jumps at s: `x = (1 - cos ω(t - s)) f/ω²`.
fn after_jump(t: f64, s: f64) -> [f64; 2] {
    let u = OMEGA * (t - s).max(0.0);
    [1.0 - u.cos(), OMEGA * u.sin()]
}

/// Truth: the closed form above; s at a point or between points, and defined by the system as the
/// last time before the jump or as the first one after it.
///
/// Measured: BDF 8.2e-7 at a tolerance of 1e-8, ESDIRK 1.5e-4 at 1e-6, explicit 2.8e-8 at 1e-8,
/// with 4 to 10 % fewer evaluations than without the restart; the error is the same, because the
/// step control finds the jump by itself.
#[test]
fn restart_at_a_jump_of_the_load_keeps_the_accuracy() {
    let f = OMEGA * OMEGA;
    for method in METHODS {
        let rtol = if method == Esdirk34 { 1e-6 } else { 1e-8 };
        for s in [0.25, 0.250_37] {
            for at_s in [0.0, f] {
                let load = |t: f64| {
                    if t == s {
                        at_s
                    } else if t < s {
                        0.0
                    } else {
                        f
                    }
                };
                let both = [&[][..], &[s]].map(|restarts| {
                    let mut system = Oscillators { omega: vec![OMEGA], zeta: 0.0, load, evaluations: 0 };
                    let settings = settings(method, rtol);
                    let (error, g) = run(&mut system, settings, 1e-3, [0.0; 2], restarts, |t| after_jump(t, s));
                    (error[0].max(error[1]), g.evaluations)
                });
                eprintln!(
                    "{:<8} jump at {s}, load there {at_s:.0}: without {:?}, with {:?}",
                    method.word().unwrap_or_default(),
                    both[0],
                    both[1]
                );
                assert!(both[1].0 < 1e3 * rtol, "{method:?} {s}: {both:?}");
                assert!(both[1].1 <= both[0].1, "{method:?} {s}: {both:?}");
            }
        }
    }
}

/// A system changed from outside at a point: `restart` there discards the solution beyond it.
#[test]
fn restart_sees_a_system_changed_from_outside() {
    let s = 0.25;
    let load = std::cell::Cell::new(0.0);
    for method in METHODS {
        let rtol = if method == Esdirk34 { 1e-6 } else { 1e-8 };
        load.set(0.0);
        let mut system = Oscillators { omega: vec![OMEGA], zeta: 0.0, load: |_| load.get(), evaluations: 0 };
        let zero = DVector::zeros(1);
        let mut g = Reference::new(&mut system, 0.0, 1e-3, settings(method, rtol), zero.clone(), zero).expect("starts");
        for _ in 0..250 {
            g.step(&mut system).expect("steps");
        }
        load.set(OMEGA * OMEGA);
        g.restart(&mut system).expect("restarts");
        assert_eq!(g.now.acceleration[0], OMEGA * OMEGA);
        let mut worst = 0.0f64;
        for _ in 250..1000 {
            g.step(&mut system).expect("steps");
            worst = worst.max((g.now.x[0] - after_jump(g.time(), s)[0]).abs());
        }
        eprintln!("{:<8} {worst:.1e}", method.word().unwrap_or_default());
        assert!(worst < 1e3 * rtol, "{method:?}: {worst}");
        assert_eq!(g.evaluations, system.evaluations);
    }
}

/// A restart announced after the solver has passed it, and one announced twice.
#[test]
fn restart_may_be_announced_late_and_twice() {
    let (s, f) = (0.253, OMEGA * OMEGA);
    for method in METHODS {
        let load = |t: f64| if t < s { 0.0 } else { f };
        let mut system = Oscillators { omega: vec![OMEGA], zeta: 0.0, load, evaluations: 0 };
        let zero = DVector::zeros(1);
        let mut g = Reference::new(&mut system, 0.0, 1e-3, settings(method, 1e-6), zero.clone(), zero).expect("starts");
        for k in 0..1000 {
            if k == 252 {
                g.restart_at(s);
                g.restart_at(s + 1e-13);
            }
            g.step(&mut system).expect("steps");
            let error = (g.now.x[0] - after_jump(g.time(), s)[0]).abs();
            assert!(error < 1e3 * 1e-6, "{method:?} at {}: {error}", g.time());
        }
    }
}

/// A load of 20 ms after half a second of rest: no step is long enough to miss it.
///
/// Truth: the same run with the explicit method at 1e-9 and restarts at both ends of the load.
/// Measured, relative to the final value: 1e-2 at a tolerance of 1e-3, 5e-6 to 1e-4 at 1e-6.
/// Regression: a rejected step of maximum length once counted as a restart here.
#[test]
fn a_pulse_after_a_long_rest_is_seen() {
    let pulse = |t: f64| if (0.507..0.527).contains(&t) { (25.0 * TAU * (t - 0.507)).sin().powi(2) * 1e3 } else { 0.0 };
    let end = |settings: ReferenceSettings, restarts: &[f64]| {
        let mut system = Oscillators { omega: vec![OMEGA], zeta: 0.0, load: pulse, evaluations: 0 };
        run(&mut system, settings, 1e-3, [0.0; 2], restarts, |_| [0.0; 2]).1.now.x[0]
    };
    let truth = end(settings(Tsit45, 1e-9), &[0.507, 0.527]);
    assert!(truth.abs() > 0.05);
    for method in METHODS {
        for rtol in [1e-3, 1e-4, 1e-6] {
            let error = (end(settings(method, rtol), &[]) - truth).abs();
            eprintln!("{:<8} rtol {rtol:.0e}: {error:.1e} of {truth:.3}", method.word().unwrap_or_default());
            assert!(error < 300.0 * rtol * truth.abs(), "{method:?} {rtol}: {error}");
        }
    }
}

/// Purpose of each method: a slow oscillator together with one of 5 kHz of very small amplitude,
/// driven for a second.
///
/// Measured evaluations at 1e-6, BDF / ESDIRK / explicit: 110 700, 6 160, 134 773 with 1 % damping;
/// 1 447, 3 802, 74 029 with 90 %: only the A-stable method takes steps beyond the period of a
/// lightly damped fast mode, BDF beyond that of a damped one.
#[test]
fn a_fast_mode_is_stepped_over_by_the_method_made_for_it() {
    let count = |method: ReferenceMethod, zeta: f64| {
        let load = |t: f64| 4e3 * (20.0 * t).sin();
        let mut system = Oscillators { omega: vec![OMEGA, TAU * 5e3], zeta, load, evaluations: 0 };
        let zeros = DVector::zeros(2);
        let settings = settings(method, 1e-6);
        let mut g = Reference::new(&mut system, 0.0, 1e-3, settings, zeros.clone(), zeros).expect("starts");
        for _ in 0..1000 {
            g.step(&mut system).expect("steps");
        }
        let truth = driven(1.0, zeta, 4e3, 20.0)[0];
        assert!((g.now.x[0] - truth).abs() < 1e-4, "{method:?} {zeta}: {} {truth}", g.now.x[0]);
        g.evaluations
    };
    for zeta in [0.01, 0.9] {
        let [bdf, esdirk, explicit] = METHODS.map(|method| count(method, zeta));
        eprintln!("damping {zeta}: bdf {bdf}, esdirk34 {esdirk}, tsit45 {explicit} evaluations");
        assert!(esdirk < explicit / 10);
        assert!(if zeta < 0.1 { esdirk < bdf / 10 } else { bdf < explicit / 10 });
    }
}

/// A failing system, a diverging system and invalid tolerances give errors with their own message.
#[test]
fn failures_say_what_happened() {
    struct Failing(Option<StepError>);
    impl SecondOrderSystem for Failing {
        fn dimension(&self) -> usize {
            1
        }
        fn residual(&mut self, _: f64, _: &DVector<f64>, _: &DVector<f64>, _: &DVector<f64>, _: &mut DVector<f64>) {}
        fn acceleration(
            &mut self,
            t: f64,
            x: &DVector<f64>,
            _: &DVector<f64>,
            a: &mut DVector<f64>,
        ) -> Result<(), StepError> {
            a[0] = 1e4 * x[0]; // grows as e^(100 t)
            self.0.clone().filter(|_| t > 0.1).map_or(Ok(()), Err)
        }
        fn mass(&mut self, _: &mut DMatrix<f64>) {}
        fn damping_and_stiffness(&mut self, _: f64, _: f64, _: &mut DMatrix<f64>) {}
        fn stiffness(&mut self, _: &mut DMatrix<f64>) {}
    }
    let singular = StepError::Singular { matrix: "mass matrix", t: 0.1 };
    for method in METHODS {
        for fault in [Some(singular.clone()), None] {
            let mut system = Failing(fault.clone());
            let one = DVector::from_element(1, 1.0);
            let mut g =
                Reference::new(&mut system, 0.0, 1e-3, settings(method, 1e-6), one.clone(), one).expect("starts");
            let error = (0..1000).find_map(|_| g.step(&mut system).err()).expect("fails");
            let (t, x) = (g.time(), g.now.x[0]);
            match fault {
                // All points before the failure were delivered, and the failure persists.
                Some(_) => {
                    assert!(error == singular && (0.098..0.101).contains(&t), "{method:?}: {error} {t}");
                    assert_eq!(g.step(&mut system), Err(singular.clone()));
                    assert_eq!((g.time(), g.now.x[0]), (t, x));
                }
                None => {
                    assert!(matches!(error, StepError::Diverged { .. }), "{error}");
                    assert!((0.14..0.147).contains(&t) && x > 1e5, "{method:?}: {t} {x}");
                }
            }
        }
    }
    let mut system = Failing(None);
    let one = DVector::from_element(1, 1.0);
    for (rtol, atol) in [(0.0, 1e-9), (1e-15, 1e-9), (f64::NAN, 1e-9), (0.5, 1e-9), (1e-6, 0.0), (1e-6, f64::NAN)] {
        let settings = ReferenceSettings { rtol, atol, method: Bdf };
        let error = Reference::new(&mut system, 0.0, 1e-3, settings, one.clone(), one.clone()).err();
        assert!(matches!(error, Some(StepError::Setup(_))), "{rtol} {atol}");
    }
}

/// An arm without elastic links has nothing to integrate; the time still advances.
#[test]
fn no_coordinates_are_no_trouble() {
    let mut system = Oscillators { omega: vec![], zeta: 0.0, load: |_| 0.0, evaluations: 0 };
    let none = DVector::zeros(0);
    let mut g =
        Reference::new(&mut system, 0.0, 1e-3, ReferenceSettings::default(), none.clone(), none).expect("starts");
    (0..5).for_each(|_| g.step(&mut system).expect("steps"));
    assert_eq!(g.time(), 5e-3);
}
