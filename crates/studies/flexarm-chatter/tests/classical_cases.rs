//! Six classical cases with 41 spindle speeds each, against the limits from another program
//! (`tests/golden/milling_lobes.json`, accurate to 0.2 %).

use std::f64::consts::TAU;

use flexarm_chatter::milling::{Coefficients, Cutter, Engagement, Kind, LimitOptions, Mode, Structure, limit_of_depth};
use nalgebra::Vector3;
use serde_json::Value;

struct Case {
    name: String,
    structure: Structure,
    cutter: Cutter,
    deepest: f64,
    rows: Vec<Row>,
}

/// Speed (1/min), and depth (m), type and frequency (Hz) if there is a limit.
type Row = (f64, Option<(f64, Kind, f64)>);

fn cases() -> Vec<Case> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../tests/golden/milling_lobes.json");
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    file["cases"].as_object().unwrap().iter().map(|(name, case)| read(name, case)).collect()
}

fn read(name: &str, case: &Value) -> Case {
    let number = |key: &str| case[key].as_f64().unwrap();
    let mode = |m: &Value| {
        let axis = if m["axis"] == "x" { Vector3::x() } else { Vector3::y() };
        Mode {
            angular_frequency: TAU * m["frequency_Hz"].as_f64().unwrap(),
            damping_ratio: m["damping_ratio"].as_f64().unwrap(),
            shape: axis / m["mass_kg"].as_f64().unwrap().sqrt(),
        }
    };
    let modes: Vec<Mode> = case["modes"].as_array().unwrap().iter().map(mode).collect();
    let coefficients = Coefficients { tangential: number("Kt_Pa"), radial: number("Kn_Pa"), axial: 0.0 };
    let engagement = Engagement { entry: number("entry_rad"), exit: number("exit_rad") };
    let row = |r: &Value| {
        let kind = if r[2] == "flip" { Kind::Flip } else { Kind::Hopf };
        (r[0].as_f64().unwrap(), r[1].as_f64().map(|depth| (depth, kind, r[3].as_f64().unwrap())))
    };
    Case {
        name: name.to_owned(),
        structure: Structure::from_modes(&modes).unwrap(),
        cutter: Cutter::straight(case["teeth"].as_u64().unwrap() as usize, coefficients, engagement),
        deepest: number("searched_to_m"),
        rows: case["rows"].as_array().unwrap().iter().map(row).collect(),
    }
}

/// Truth: limits from another program with another method, accurate to 0.2 %; required within 0.5
/// %.
#[test]
fn every_limit_of_the_classical_cases_is_met() {
    let mut worst: f64 = 0.0;
    for case in cases() {
        let (mut far, mut beside, mut largest) = (0.0_f64, 0.0_f64, 0);
        for (rpm, expected) in &case.rows {
            let found =
                limit_of_depth(&case.structure, &case.cutter, rpm * TAU / 60.0, &LimitOptions::to(case.deepest))
                    .unwrap();
            let Some((depth, kind, hz)) = *expected else {
                assert!(found.is_none(), "{} at {rpm} rpm: {found:?}, expected none", case.name);
                continue;
            };
            let found = found.unwrap_or_else(|| panic!("{} at {rpm} rpm: none, expected {depth}", case.name));
            far = far.max((found.depth / depth - 1.0).abs());
            beside = beside.max((found.multiplier_hz - hz).abs());
            largest = largest.max(found.unknowns);
            assert_eq!(found.kind, kind, "{} at {rpm} rpm", case.name);
            assert!(found.change <= 1e-3, "{} at {rpm} rpm: {:.1e}", case.name, found.change);
        }
        eprintln!("{}: {:.3} %, {beside:.3} Hz, {largest} unknowns", case.name, 100.0 * far);
        // measured: 0.06 Hz
        assert!(beside < 0.3, "{}: {beside}", case.name);
        worst = worst.max(far);
    }
    // measured: 0.11 %
    assert!(worst < 0.005, "{worst}");
}

/// Convergence: the error is well below the tolerance of 1e-3, compared with elements refined to a
/// tolerance of 1e-7.
#[test]
fn limits_asked_for_more_exactly_move_less_than_their_tolerance() {
    let mut worst: f64 = 0.0;
    for case in cases() {
        for (rpm, _) in case.rows.iter().step_by(8) {
            let spindle = rpm * TAU / 60.0;
            let options = LimitOptions::to(case.deepest);
            let usual = limit_of_depth(&case.structure, &case.cutter, spindle, &options).unwrap();
            let options = LimitOptions { tolerance: 1e-7, ..options };
            let exact = limit_of_depth(&case.structure, &case.cutter, spindle, &options).unwrap();
            let (Some(usual), Some(exact)) = (usual, exact) else { continue };
            worst = worst.max((usual.depth / exact.depth - 1.0).abs());
        }
    }
    eprintln!("largest difference {worst:.1e}");
    // measured: 8e-8; elements are of high order, one refinement too many costs little
    assert!(worst < 1e-5, "{worst:.1e}");
}
