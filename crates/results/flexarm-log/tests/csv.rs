//! CSV recordings, read back.

use crate::synthetic;
use std::collections::HashMap;
use std::path::Path;

use flexarm_log::{CreateOptions, CsvRecorder, LogError, Recorder, RunHeader, RunResult};

fn write(path: &Path, header: &RunHeader, samples: u64) {
    let mut recorder = CsvRecorder::create(path, CreateOptions::default());
    recorder.begin(header).unwrap();
    (0..samples).for_each(|step| recorder.record(&synthetic::sample(step)).unwrap());
    recorder.finish(&synthetic::result()).unwrap();
}

fn columns(path: &Path) -> HashMap<String, Vec<f64>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(names[0], "time");
    let mut columns: HashMap<_, Vec<f64>> = names.iter().map(|name| (name.clone(), Vec::new())).collect();
    assert_eq!(columns.len(), names.len(), "a name appears twice");
    for row in reader.records() {
        for (name, field) in names.iter().zip(&row.unwrap()) {
            columns.get_mut(name).unwrap().push(field.parse().unwrap());
        }
    }
    columns
}

/// Truth: the samples themselves, bit for bit.
#[test]
fn numbers_read_back_exactly_under_their_names() {
    let path = synthetic::scratch("round-trip.csv");
    write(&path, &synthetic::header(), 200);
    let columns = columns(&path);
    assert_eq!(columns.len(), 1 + 3 + 3 + 6 + 3 + 3 + 3 + 3 * 3 + 12 + 4 + 3);
    for step in 0..200_u64 {
        let (row, sample) = (step as usize, synthetic::sample(step));
        let expected = [
            ("time", sample.time_s),
            ("rigid_y_m", sample.rigid.X_WT.translation.y),
            ("flexible_z_m", sample.flexible.X_WT.translation.z),
            ("error_x_m", sample.error_world[0]),
            ("top_strain", sample.gauges[0]),
            ("eye_principal_3_pa", sample.gauges[3]),
            ("error_rz_rad", sample.error_world[5]),
            ("error_binormal_m", sample.error_path[2]),
            ("static_error_z_m", sample.static_m[2]),
            ("upper_arm_contribution_y_m", sample.contributions[0][1]),
            ("joint_2_position_rad", sample.flexible.q[1]),
            ("joint_3_effort", sample.flexible.effort[2]),
            ("rigid_joint_1_effort", sample.rigid.effort[0]),
            ("upper_arm_ry_rad", sample.elastic[0].deflection[4]),
            ("upper_arm_tz_nm", sample.elastic[0].load[5]),
            ("elastic_energy_j", sample.energy.elastic),
        ];
        for (name, value) in expected {
            assert_eq!(columns[name][row].to_bits(), value.to_bits(), "{name} at step {step}");
        }
    }
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_run_without_a_twin_has_no_rigid_and_no_error_columns() {
    let path = synthetic::scratch("alone.csv");
    write(&path, &RunHeader { has_rigid: false, ..synthetic::header() }, 3);
    let columns = columns(&path);
    assert!(columns.contains_key("flexible_x_m"));
    assert!(!columns.keys().any(|name| name.starts_with("rigid") || name.starts_with("error")));
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_sample_that_does_not_fit_its_header_is_refused_with_both_numbers() {
    let path = synthetic::scratch("shape.csv");
    let mut recorder = CsvRecorder::create(&path, CreateOptions::default());
    recorder.begin(&synthetic::header()).unwrap();
    let mut sample = synthetic::sample(7);
    sample.rigid.effort.pop();
    let error = recorder.record(&sample).unwrap_err();
    assert!(matches!(error, LogError::Shape { what: "effort", found: 2, expected: 3, .. }), "{error}");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn calls_in_the_wrong_order_are_errors() {
    let path = synthetic::scratch("order.csv");
    let mut recorder = CsvRecorder::create(&path, CreateOptions::default());
    assert!(matches!(recorder.record(&synthetic::sample(0)), Err(LogError::Order { call: "record", .. })));
    recorder.begin(&synthetic::header()).unwrap();
    assert!(matches!(recorder.begin(&synthetic::header()), Err(LogError::Order { call: "begin", .. })));
    recorder.finish(&RunResult::default()).unwrap();
    assert!(matches!(recorder.finish(&RunResult::default()), Err(LogError::Order { call: "finish", .. })));
    std::fs::remove_file(path).unwrap();
}
