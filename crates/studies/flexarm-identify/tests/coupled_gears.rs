//! Stiffness of coupled gears from the encoders of all joints.

use flexarm_identify::{GearOutput, gear_stiffness};

const C: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [-0.2, 1.0, 0.0], [0.4, -0.3, 1.0]];
const STIFFNESS: [f64; 3] = [2e6, 9e5, 4e5];
const DELAY: [f64; 3] = [3e-3, -1e-3, 2e-3];

fn run(seed: f64, noise: f64) -> Vec<GearOutput> {
    let t = |k: usize| 0.004 * k as f64;
    let tau: Vec<Vec<f64>> = (0..3)
        .map(|j| {
            let f = 0.9 + 0.37 * j as f64;
            (0..2500).map(|k| 900.0 * (f * t(k) + seed).sin() + 400.0 * (2.3 * f * t(k) + j as f64).cos()).collect()
        })
        .collect();
    let motor = |k: usize, i: usize| (0..3).map(|j| C[j][k] * tau[j][i]).sum::<f64>();
    let output = |i: usize| {
        let rate: Vec<f64> = (0..2500).map(|k| 0.4 * ((1.3 + 0.2 * i as f64) * t(k) + 2.0 * seed).cos()).collect();
        let torques: Vec<Vec<f64>> = (0..3).map(|k| (0..2500).map(|s| C[i][k] * motor(k, s)).collect()).collect();
        let error = |s: usize| noise * (17.0 * t(s) * (1.0 + 0.1 * seed + 0.3 * i as f64)).sin();
        let spring = |s: usize| (0..3).map(|k| torques[k][s] / STIFFNESS[k]).sum::<f64>();
        let deflection = (0..2500).map(|s| spring(s) + DELAY[i] * rate[s] + 1e-3 * seed + error(s)).collect();
        GearOutput { deflection, rate, deflection_rate: vec![0.0; 2500], instruments: torques.clone(), torques }
    };
    (0..3).map(output).collect()
}

#[test]
fn springs_of_coupled_motors_are_found_from_all_encoders_and_from_the_last_one_alone() {
    let runs: Vec<_> = [0.0, 1.0, 2.0].map(|seed| run(seed, 0.0)).to_vec();
    let last: Vec<_> = runs.iter().map(|run| run[2..].to_vec()).collect();
    for runs in [&runs[..], &runs[..1], &last[..]] {
        let found = gear_stiffness(runs).unwrap();
        for (gear, truth) in found.iter().zip(STIFFNESS) {
            let error = (gear.stiffness / truth - 1.0).abs();
            // Measured: at most 1e-12.
            assert!(error < 1e-9 && gear.is_determined() && gear.r2 > 1.0 - 1e-12, "{gear:?}");
        }
    }
    // Without noise the delays are exact too; the first spring's largest contribution is in its
    // own encoder.
    let found = gear_stiffness(&runs).unwrap();
    assert!((found[0].delay_s - DELAY[0]).abs() < 1e-10 && (found[2].delay_s - DELAY[2]).abs() < 1e-10);
}

#[test]
fn springs_that_the_encoders_do_not_tell_apart_are_not_made_up() {
    let mut runs: Vec<_> = [0.0, 1.0].map(|seed| run(seed, 0.0)).to_vec();
    // Two springs with the same torque in one encoder.
    for run in &mut runs {
        run.truncate(1);
        run[0].torques = vec![run[0].torques[0].clone(); 2];
        run[0].instruments = run[0].torques.clone();
    }
    assert!(gear_stiffness(&runs).is_none());
}
