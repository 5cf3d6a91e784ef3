//! Stiffness of gears from encoders on both sides.

use flexarm_identify::{GearOutput, gear_stiffness};

fn run(seed: f64, noise: f64, stiffness: f64) -> Vec<GearOutput> {
    let n = 2500;
    let t = |k: usize| 0.004 * k as f64;
    let torque: Vec<f64> = (0..n).map(|k| 900.0 * (0.9 * t(k) + seed).sin() + 400.0 * (2.3 * t(k)).cos()).collect();
    let rate: Vec<f64> = (0..n).map(|k| 0.4 * (1.3 * t(k) + 2.0 * seed).cos()).collect();
    let error = |k: usize| noise * (17.0 * t(k) * (1.0 + 0.1 * seed)).sin();
    let deflection = (0..n).map(|k| torque[k] / stiffness + 3e-3 * rate[k] + 1e-3 * seed + error(k)).collect();
    let torques = vec![torque];
    vec![GearOutput { deflection_rate: vec![0.0; n], deflection, instruments: torques.clone(), torques, rate }]
}

/// Truth: the stiffness that generated the deflection. The link's encoder has noise at about 5
/// Hz; its second derivative times 400 kg m² is in the torque.
#[test]
fn noise_of_the_link_encoder_that_is_in_deflection_and_torque_does_not_pass_for_a_spring() {
    let noisy = |seed: f64| {
        let mut run = run(seed, 0.0, 8e6);
        let run_of = &mut run[0];
        for k in 0..run_of.rate.len() {
            let (t, w) = (0.004 * k as f64, 31.0 + 0.3 * seed);
            let noise = 4e-4 * (w * t + 3.0 * (0.37 * t).sin()).sin();
            run_of.deflection[k] -= noise;
            run_of.torques[0][k] -= 400.0 * w * w * noise;
        }
        run
    };
    let runs = [0.0, 1.0, 2.0].map(noisy);
    let found = &gear_stiffness(&runs).unwrap()[0];
    let plain = runs.clone().map(|mut run| {
        run[0].instruments = run[0].torques.clone();
        run
    });
    let plain = &gear_stiffness(&plain).unwrap()[0];
    let [found, plain] = [found, plain].map(|gear| gear.stiffness / 8e6 - 1.0);
    assert!(found.abs() < 0.03 && plain.abs() > 0.2, "{found} {plain}"); // measured: 0.019, 0.32
}

#[test]
fn a_gear_is_found_with_its_delay_whatever_the_offsets_of_the_runs() {
    let runs: Vec<Vec<GearOutput>> = [0.0, 1.0, 2.0].map(|seed| run(seed, 0.0, 8e6)).to_vec();
    let found = &gear_stiffness(&runs).unwrap()[0];
    assert!((found.stiffness / 8e6 - 1.0).abs() < 1e-10 && (found.delay_s - 3e-3).abs() < 1e-12, "{found:?}");
    assert!(found.is_determined() && found.r2 > 1.0 - 1e-12 && found.unseen_r2.iter().all(|r2| *r2 > 1.0 - 1e-12));
    // A single run is cross-validated by its halves.
    assert!(gear_stiffness(&runs[..1]).unwrap()[0].is_determined());
}

#[test]
fn a_deflection_below_the_error_of_the_encoder_is_not_told() {
    let runs: Vec<Vec<GearOutput>> = [0.0, 1.0, 2.0].map(|seed| run(seed, 4e-4, 4e7)).to_vec();
    let found = &gear_stiffness(&runs).unwrap()[0];
    assert!(!found.is_determined(), "{found:?}");
}
