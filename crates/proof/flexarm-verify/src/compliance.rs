//! Compliance of a point by every method, compared with a truth; shared by the first three cases.
//!
//! Start at [`by_every_method`]: 6x6, linear first, world axes. Not here: the truths (each case).

use flexarm::{Modelling, Robot};
use nalgebra::{Matrix6, Vector6};

use crate::Error;
use crate::bench::{LUMPED, Rig, column_error, compliance_error, damped, parts, weightless};
use crate::page::{Bound, Case, Table, error};

/// Number of parts of a link that is stepped until it is at rest.
pub(crate) const STEPPED_PARTS: usize = 2;

/// Result of one method.
pub(crate) struct Method {
    /// Name on the page.
    pub(crate) name: String,
    /// Displacement and rotation of the point per wrench on it (m/N, rad/(N m), ...), world axes.
    pub(crate) C: Matrix6<f64>,
}

/// Computes the compliance at a frame of a robot without gravity by every method: lumped links of
/// two parts by stepping in time, the others by Newton's method.
///
/// * `loads`: magnitude of each of the six loads (N, N m). `step_s`: step size of the time stepping
///   (s).
///
/// # Errors
/// If a model cannot be built, has no equilibrium, or does not come to rest.
pub(crate) fn by_every_method(
    robot: &Robot,
    frame: Option<&str>,
    loads: &Vector6<f64>,
    step_s: f64,
    others: &[(String, Modelling)],
) -> Result<Vec<Method>, Error> {
    let robot = damped(weightless(robot.clone()));
    let stepped = Rig::new(&robot, &parts(STEPPED_PARTS), frame)?;
    let mut methods = Vec::new();
    for (name, kind) in LUMPED {
        let C = stepped.compliance(loads, |rig, wrench| rig.settled(wrench, kind, step_s))?;
        methods.push(Method { name: format!("{name}, {STEPPED_PARTS} parts"), C });
    }
    for (name, modelling) in others {
        let C = Rig::new(&robot, modelling, frame)?.compliance(loads, Rig::statics)?;
        methods.push(Method { name: name.clone(), C });
    }
    Ok(methods)
}

/// Adds a column per method to a table with a row per load: the error under that load.
pub(crate) fn add_errors(table: &mut Table, truth: &Matrix6<f64>, methods: &[Method]) {
    table.columns.extend(methods.iter().map(|method| method.name.clone()));
    for (j, row) in table.rows.iter_mut().enumerate() {
        row.extend(methods.iter().map(|method| error(column_error(&method.C, truth, j))));
    }
}

/// Adds a claim per method: its maximum error over all loads.
pub(crate) fn claim_each(case: &mut Case, what: &str, truth: (&str, &Matrix6<f64>), methods: &[Method], bound: f64) {
    for Method { name, C } in methods {
        case.claim(format!("{what}, {name}"), truth.0, compliance_error(C, truth.1), Bound::AtMost(bound));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::word;

    /// Truth by hand: with C_ii = 1 everywhere, an entry of column 2 that is wrong by 3e-3 appears
    /// only as the error of load 2.
    #[test]
    fn an_error_of_one_load_stands_in_the_row_of_that_load() {
        let truth = Matrix6::identity();
        let mut C = truth;
        C[(4, 2)] += 3e-3;
        let methods = [Method { name: "a".into(), C: truth }, Method { name: "b".into(), C }];
        let mut table = Table::new("", &["load"]);
        table.rows = (0..6).map(|j| vec![word(format!("{j}"))]).collect();
        add_errors(&mut table, &truth, &methods);
        assert_eq!(table.columns, ["load", "a", "b"]);
        let printed: Vec<String> = table.rows.iter().map(|row| row[2].print()).collect();
        assert_eq!(printed, ["< 1e-9", "< 1e-9", "0.30 %", "< 1e-9", "< 1e-9", "< 1e-9"]);
        let mut case = Case::new("a", "A", "");
        claim_each(&mut case, "loads", ("hand", &truth), &methods, 2e-3);
        let told: Vec<(&str, bool)> = case.claims().map(|claim| (claim.text.as_str(), claim.holds)).collect();
        assert_eq!(told, [("loads, a", true), ("loads, b", false)]);
    }
}
