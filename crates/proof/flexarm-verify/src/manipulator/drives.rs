//! Elastic links, elastic drives, and both; then every method again with elastic drives.
//!
//! Not here: models and steppers with links alone (`methods.rs`).

use flexarm::steppers::ConstraintForm;
use flexarm::{DriveModel, LinkModel, Modelling, StepperKind};
use nalgebra::Vector3;

use super::methods::{SHOWN_STEP_S, reference};
use super::runs::{MethodRun, Run, Runs, stepper_name};
use super::{ALL_MODES, DRIVES};
use crate::Error;
use crate::bench::{ALPHA, Bench, in_modes, in_parts, larger, modal, spook};

/// Step size of the spring-damper model (s).
pub(super) const STEP_S: f64 = 1e-3;
/// Finer step size for compliant constraints (s).
const FINE_STEP_S: f64 = 1e-4;

/// A run of one motion with one choice of elastic elements.
pub(super) struct Flexibility {
    pub(super) motion: &'static str,
    pub(super) what: &'static str,
    pub(super) run: Run,
}

/// Links, drives and both on every motion.
pub(super) struct Flexibilities {
    pub(super) made: Vec<Flexibility>,
    /// Sag of links and drives together minus the sum of the two separately, relative to it;
    /// maximum over all motions.
    pub(super) sum_error: f64,
}

impl Flexibilities {
    pub(super) fn new(bench: &Bench, runs: &mut Runs<'_, '_>, moves: &[&'static str]) -> Result<Self, Error> {
        let robot = bench.robot(DRIVES)?;
        let both = Modelling::default();
        let kinds = [
            ("links", Modelling { drives: DriveModel::Rigid, ..both }),
            ("drives", Modelling { links: LinkModel::Rigid, ..both }),
            ("both", both),
        ];
        let (mut made, mut sum_error) = (Vec::new(), 0.0f64);
        for &motion in moves {
            let path = bench.motion(&robot, &format!("trajectories/{motion}.toml"))?;
            let mut sags = Vec::new();
            for (what, modelling) in kinds {
                let run = runs.make(&robot, &path, modelling, ALPHA, STEP_S)?;
                sags.extend(run.deflection_m.first().copied());
                made.push(Flexibility { motion, what, run });
            }
            sum_error = larger(sum_error, sum_of_two(&sags));
        }
        Ok(Self { made, sum_error })
    }
}

/// Relative difference between the sag of both and the sum of the two: at rest, compliances in
/// series add. Zero if there are not three runs.
fn sum_of_two(sags: &[Vector3<f64>]) -> f64 {
    match sags {
        [links, drives, both] => (links + drives - both).norm() / both.norm(),
        _ => 0.0,
    }
}

/// Indices of runs in [`ElasticDrives::made`].
pub(super) const LINKS_ALONE: usize = 1;
pub(super) const DRIVES_ALONE: usize = 2;
pub(super) const TWO_PARTS: usize = 3;
/// Indices of the runs that are claimed to be close to the truth.
pub(super) const CLAIMED: [usize; 3] = [3, 4, 6];

/// Every method with elastic drives, on one motion.
pub(super) struct ElasticDrives {
    pub(super) motion: &'static str,
    /// Maximum deflection of the truth (m).
    pub(super) peak_m: f64,
    /// The truth itself, with zero error.
    pub(super) truth: MethodRun,
    pub(super) made: Vec<MethodRun>,
}

impl ElasticDrives {
    pub(super) fn new(bench: &Bench, runs: &mut Runs<'_, '_>, name: &'static str) -> Result<Self, Error> {
        let robot = bench.robot(DRIVES)?;
        let motion = bench.motion(&robot, &format!("trajectories/{name}.toml"))?;
        let truth = runs.make(&robot, &motion, modal(ALL_MODES), reference(), SHOWN_STEP_S)?;
        let peak_m = truth.peaks().all;
        let made = list().into_iter().map(|method| {
            let run = runs.make(&robot, &motion, method.modelling, method.kind, method.step_s)?;
            let error = run.apart(&truth).over(peak_m);
            Ok(MethodRun { links: method.links, stepper: method.stepper, run, error })
        });
        let made = made.collect::<Result<_, Error>>()?;
        let (links, stepper) = (in_modes(ALL_MODES).0, "error control (truth)".to_owned());
        let error = truth.apart(&truth).over(peak_m);
        Ok(Self { motion: name, peak_m, truth: MethodRun { links, stepper, run: truth, error }, made })
    }
}

struct Method {
    links: String,
    modelling: Modelling,
    stepper: String,
    kind: StepperKind,
    step_s: f64,
}

/// The elastic elements one by one, then the methods.
fn list() -> Vec<Method> {
    let rigid = Modelling { links: LinkModel::Rigid, ..Modelling::default() };
    let nothing = Modelling { drives: DriveModel::Rigid, ..rigid };
    let links_alone = Modelling { drives: DriveModel::Rigid, ..modal(ALL_MODES) };
    let mut list = vec![Method {
        links: "rigid, drives too".into(),
        modelling: nothing,
        stepper: "-".into(),
        kind: ALPHA,
        step_s: SHOWN_STEP_S,
    }];
    let mut add = |(links, modelling): (String, Modelling), stepper: &str, kind, step_s| {
        list.push(Method { links, modelling, stepper: stepper_name(stepper, step_s), kind, step_s });
    };
    for links in [("modal, drives rigid".into(), links_alone), ("rigid".into(), rigid), in_parts(2), in_parts(8)] {
        add(links, "spring-damper", ALPHA, STEP_S);
    }
    let (local, global) = (spook(ConstraintForm::Local), spook(ConstraintForm::Global));
    add(in_parts(2), "compliant constraints, local", local, STEP_S);
    add(in_parts(2), "compliant constraints, local", local, FINE_STEP_S);
    add(in_parts(2), "compliant constraints, global", global, FINE_STEP_S);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth by hand: 3 + 4 along one axis against 7 gives no error, against 8 one eighth.
    #[test]
    fn sags_of_springs_in_series_add() {
        let sag = |z: f64| Vector3::new(0.0, 0.0, -z);
        assert_eq!(sum_of_two(&[sag(3.0), sag(4.0), sag(7.0)]), 0.0);
        assert_eq!(sum_of_two(&[sag(3.0), sag(4.0), sag(8.0)]), 0.125);
    }

    /// The claims and the picture refer to runs by index.
    #[test]
    fn the_methods_with_drives_are_where_the_claims_look_for_them() {
        let list = list();
        let name = |k: usize| format!("{}, {}", list[k].links, list[k].stepper);
        assert_eq!(name(LINKS_ALONE), "modal, drives rigid, spring-damper, 1 ms");
        assert_eq!(name(DRIVES_ALONE), "rigid, spring-damper, 1 ms");
        assert_eq!(name(TWO_PARTS), "2 parts, spring-damper, 1 ms");
        let claimed = CLAIMED.map(name);
        assert_eq!(claimed[1], "8 parts, spring-damper, 1 ms");
        assert_eq!(claimed[2], "2 parts, compliant constraints, local, 0.1 ms");
        assert_eq!(list.len(), 8);
    }
}
