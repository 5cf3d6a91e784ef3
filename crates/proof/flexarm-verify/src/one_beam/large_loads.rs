//! Loads large enough for geometric nonlinearity: the limit of linear elasticity.
//!
//! Truths: the elastica for the bar of beam theory, nonlinear finite elements of CalculiX for the
//! one from the mesh. Not here: small loads (`study.rs`).

use flexarm::{Modelling, Robot};
use nalgebra::{Matrix6, Vector6};

use super::STORED;
use super::bar::{LENGTH_M, bar};
use crate::Error;
use crate::bench::{Bench, Rig, Stored, in_parts, larger, modal, weightless};

/// Numbers of parts of the links.
const COUNTS: [usize; 4] = [2, 3, 5, 9];
/// Indices of the chains of two and of nine parts in lists of models.
const TWO: usize = 0;
const NINE: usize = 3;
/// Elastic rotation above which a run warns (rad).
pub(super) const WARNING_RAD: f64 = 0.05;
/// Reciprocal of the maximum height of the end, over the length, up to which nine parts are judged.
pub(super) const JUDGED_UP_TO_L_OVER: u32 = 4;

/// One force.
pub(super) struct LargeLoad {
    pub(super) force_n: f64,
    /// Elastica: height of the end and shortening, over the length.
    pub(super) height_over_l: f64,
    pub(super) shortening_over_l: f64,
    /// Rotation of the end with two parts (rad).
    pub(super) two_parts_rad: f64,
    /// Height of the end, relative differences from the elastica: linear theory, then every model.
    pub(super) linear_error: f64,
    pub(super) errors: Vec<f64>,
    /// Height of the end (m) and engineering strain by nonlinear finite elements.
    pub(super) fe_height_m: f64,
    pub(super) fe_strain: f64,
    /// Height of the end of the reduced link, relative differences from the nonlinear finite
    /// elements: linear elements, then every model.
    pub(super) fe_linear_error: f64,
    pub(super) fe_errors: Vec<f64>,
    /// Engineering strain with two parts.
    pub(super) two_parts_strain: f64,
}

/// Results of all forces.
pub(super) struct LargeLoads {
    /// Program, script and date of the stored results.
    pub(super) provenance: String,
    pub(super) models: Vec<String>,
    pub(super) loads: Vec<LargeLoad>,
}

/// The links under test: the one of beam theory and the one reduced from the mesh, both without
/// gravity, and their models.
struct Subjects {
    robot: Robot,
    meshed: Robot,
    models: Vec<(String, Modelling)>,
    /// Compliance of the end by linear finite elements (m/N, rad/(N m)).
    C: Matrix6<f64>,
}

impl LargeLoads {
    pub(super) fn new(bench: &Bench, robot: &Robot, meshed: &Robot) -> Result<Self, Error> {
        let stored = bench.stored(STORED)?;
        let mut models: Vec<(String, Modelling)> = COUNTS.map(in_parts).into();
        models.push(("modal".into(), modal(6)));
        let [robot, meshed] = [robot, meshed].map(|robot| weightless(robot.clone()));
        let subjects = Subjects { robot, meshed, models, C: stored.matrix6("C_BB")? };
        let count = stored.at("large_load")?.as_array().map_or(0, Vec::len);
        let loads = (0..count).map(|k| LargeLoad::new(&subjects, &stored, k)).collect::<Result<_, Error>>()?;
        let models = subjects.models.into_iter().map(|(name, _)| name).collect();
        Ok(Self { provenance: stored.provenance(), models, loads })
    }

    /// Absolute error of two parts under the last load below the warning limit.
    pub(super) fn at_the_warning_limit(&self) -> f64 {
        let below = self.loads.iter().rfind(|load| load.two_parts_rad <= WARNING_RAD);
        below.map_or(f64::NAN, |load| load.fe_errors[TWO].abs())
    }

    /// Maximum error of nine parts up to the height limit.
    pub(super) fn worst_of_nine(&self) -> f64 {
        let judged = self.loads.iter().filter(|load| load.height_over_l < 1.0 / f64::from(JUDGED_UP_TO_L_OVER));
        judged.map(|load| load.fe_errors[NINE].abs()).fold(0.0, larger)
    }
}

impl LargeLoad {
    /// * `k`: index of the load in the stored list.
    fn new(subjects: &Subjects, stored: &Stored, k: usize) -> Result<Self, Error> {
        let Subjects { robot, meshed, models, C } = subjects;
        let bar = bar();
        let force_n = stored.number(&format!("large_load/{k}/force_n"))?;
        let fe = stored.numbers(&format!("large_load/{k}/u_B"))?;
        let wrench = Vector6::new(0.0, 0.0, force_n, 0.0, 0.0, 0.0);
        // Far beyond the valid range of the model, there may be no equilibrium.
        let bent = |robot: &Robot, modelling: &Modelling| -> Result<Vector6<f64>, Error> {
            Ok(Rig::new(robot, modelling, None)?.statics(&wrench).unwrap_or(Vector6::repeat(f64::NAN)))
        };
        let all = |robot: &Robot| models.iter().map(|(_, m)| bent(robot, m)).collect::<Result<Vec<_>, Error>>();
        let (beams, solids) = (all(robot)?, all(meshed)?);
        let [height_over_l, shortening_over_l] = bar.elastica(force_n);
        let linear = force_n * bar.tip_compliance()[(2, 2)] / bar.l;
        Ok(Self {
            force_n,
            height_over_l,
            shortening_over_l,
            two_parts_rad: -beams[TWO][4],
            linear_error: linear / height_over_l - 1.0,
            errors: beams.iter().map(|u| u[2] / bar.l / height_over_l - 1.0).collect(),
            fe_height_m: fe[2],
            fe_strain: engineering_strain(fe[0], fe[2]),
            fe_linear_error: force_n * C[(2, 2)] / fe[2] - 1.0,
            fe_errors: solids.iter().map(|u| u[2] / fe[2] - 1.0).collect(),
            two_parts_strain: engineering_strain(solids[TWO][0], solids[TWO][2]),
        })
    }
}

/// Relative change of the distance between the ends if the end moves by `x` along the bar and by
/// `z` across it (m).
fn engineering_strain(x: f64, z: f64) -> f64 {
    (LENGTH_M + x).hypot(z) / LENGTH_M - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth by hand: the triangle 0.6, 0.8, 1.0 (its hypotenuse is the deformed bar), a pure
    /// stretch, and a rotation without strain.
    #[test]
    fn the_engineering_strain_is_that_of_the_line_between_the_ends() {
        assert!((engineering_strain(0.0, 0.6) - 0.25).abs() < 1e-15);
        assert!((engineering_strain(8e-4, 0.0) - 1e-3).abs() < 1e-15);
        assert!(engineering_strain(-0.8, 0.8).abs() < 1e-15);
    }

    fn load(two_parts_rad: f64, height_over_l: f64, error: f64) -> LargeLoad {
        LargeLoad {
            force_n: 0.0,
            height_over_l,
            shortening_over_l: 0.0,
            two_parts_rad,
            linear_error: 0.0,
            errors: Vec::new(),
            fe_height_m: 0.0,
            fe_strain: 0.0,
            fe_linear_error: 0.0,
            fe_errors: vec![-error, 0.0, 0.0, 0.1 * error],
            two_parts_strain: 0.0,
        }
    }

    /// A load without an equilibrium is beyond every limit.
    #[test]
    fn limits_are_judged_below_them_and_not_beyond() {
        let loads =
            [load(0.02, 0.1, 1e-4), load(0.05, 0.2, 2e-4), load(0.06, 0.25, 3e-4), load(f64::NAN, 0.5, f64::NAN)];
        let found = LargeLoads { provenance: String::new(), models: Vec::new(), loads: loads.into() };
        assert_eq!(found.at_the_warning_limit(), 2e-4);
        assert_eq!(found.worst_of_nine(), 0.1 * 2e-4);
    }
}
