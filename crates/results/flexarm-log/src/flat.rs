//! The columns of a run in memory as the table of its CSV file: one number per column, with the
//! same names.
//!
//! Start at [`flat_columns`]. Not here: names and order of the columns ([`crate::table`]).

use flexarm_sample::{Columns, RunHeader};

use crate::table;

/// Returns names and numbers of the table's columns, in the column order of [`crate::CsvRecorder`].
pub fn flat_columns(columns: &Columns) -> Vec<(String, Vec<f64>)> {
    let has_rigid = columns.column("error_world").is_some();
    let header = RunHeader {
        joints: columns.joints.clone(),
        prismatic: columns.prismatic.clone(),
        elements: columns.elements.clone(),
        contributors: columns.contributors.clone(),
        gauges: columns.gauges.clone(),
        has_rigid,
        has_static: has_rigid,
        ..RunHeader::default()
    };
    table::columns(&header)
        .into_iter()
        .zip(places(columns, has_rigid))
        .map(|(name, of)| (name, of.numbers(columns)))
        .collect()
}

/// Signal, and index of the number within it, that make up a column.
struct ColumnSource {
    signal: &'static str,
    number: usize,
}

impl ColumnSource {
    fn numbers(&self, columns: &Columns) -> Vec<f64> {
        let Some(column) = columns.column(self.signal) else { return Vec::new() };
        column.values.iter().skip(self.number).step_by(column.width.max(1)).copied().collect()
    }
}

/// Returns the places in the order of [`table::columns`].
fn places(columns: &Columns, has_rigid: bool) -> Vec<ColumnSource> {
    let mut places = Vec::new();
    let mut take = |signal, numbers: std::ops::Range<usize>| {
        places.extend(numbers.map(|number| ColumnSource { signal, number }));
    };
    // TCP of both robots, and its error.
    take("time", 0..1);
    if has_rigid {
        take("rigid_tcp_position", 0..3);
    }
    take("tcp_position", 0..3);
    if has_rigid {
        take("error_world", 0..3);
        take("error_rotation", 0..3);
        take("error_path", 0..3);
        take("error_static", 0..3);
    }
    // Causes of the error, joints, elastic elements, gauges, energies.
    if columns.column("contribution").is_some() {
        take("contribution", 0..3 * columns.contributors.len());
    }
    for joint in 0..columns.joints.len() {
        take("position", joint..joint + 1);
        take("effort", joint..joint + 1);
        if has_rigid {
            take("rigid_effort", joint..joint + 1);
        }
    }
    for element in 0..columns.elements.len() {
        take("deflection", 6 * element..6 * element + 6);
        take("load", 6 * element..6 * element + 6);
    }
    take("gauge", 0..columns.gauges.len());
    take("energy", 0..3);
    places
}
