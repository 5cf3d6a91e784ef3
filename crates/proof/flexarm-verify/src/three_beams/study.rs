//! Loads at the tip, and the same arm from meshes: results of every method and of two other
//! programs.

use flexarm::{Modelling, Robot};
use flexarm_fem::element::Quadrature;
use flexarm_fem::reduction::Tie;
use flexarm_fem::{Material, UnitSystem};
use nalgebra::{Matrix6, Vector3, Vector6};

use super::G;
use super::beams::{BALL_KG, members, tip_compliance};
use crate::Error;
use crate::bench::{
    Bench, Rig, Stored, Worst, compliance_error, in_modes, in_parts, larger, place, shift_and_turn_errors, small_loads,
    weight_response, weightless,
};
use crate::compliance::{Method, by_every_method};
use crate::meshed::Meshed;

/// Step size of the runs until rest (s).
const SETTLING_STEP_S: f64 = 2e-3;
/// The mesh of the tube.
const TUBE_MESH: &str = "robots/test/three_beams/fe/beam_1.msh.gz";
/// Number of modes of the links used for the modal energy shares, all that the files have.
pub(super) const ALL_MODES: usize = 10;

/// Six loads at the tip, each method compared with the closed form.
pub(super) struct TipLoads {
    /// Compliance of the tip in closed form (m/N, rad/(N m)).
    pub(super) truth: Matrix6<f64>,
    /// Contributions of tube, box and rectangle.
    pub(super) of_beams: [Matrix6<f64>; 3],
    pub(super) methods: Vec<Method>,
}

impl TipLoads {
    pub(super) fn new(robot: &Robot) -> Result<Self, Error> {
        let truth = tip_compliance();
        let others = [in_parts(5), in_modes(6)];
        let methods = by_every_method(robot, None, &small_loads(&truth), SETTLING_STEP_S, &others)?;
        Ok(Self { truth, of_beams: members().map(|member| member.at_tip()), methods })
    }
}

/// Sag of the tip (m, rad) under the weight of beams and ball, and frequencies (Hz), by one program
/// on the mesh of the whole arm.
pub(super) struct WholeMesh {
    /// Program, script and date.
    pub(super) provenance: String,
    pub(super) C_tip: Matrix6<f64>,
    pub(super) sag: Vector6<f64>,
    pub(super) hz: Vec<f64>,
}

impl WholeMesh {
    fn read(stored: &Stored) -> Result<Self, Error> {
        Ok(Self {
            provenance: stored.provenance(),
            C_tip: stored.matrix6("C_tip")?,
            sag: stored.vector6("sag")?,
            hz: stored.numbers("frequencies_hz")?,
        })
    }

    /// Relative errors of a given sag: translation and rotation, each as a vector norm.
    fn sag_errors(&self, sag: &Vector6<f64>) -> [f64; 2] {
        shift_and_turn_errors(sag, &self.sag)
    }

    /// Relative differences of given frequencies from these.
    fn hz_errors(&self, hz: &[f64]) -> Vec<f64> {
        hz.iter().zip(&self.hz).map(|(f, truth)| f / truth - 1.0).collect()
    }
}

/// A link model on the meshed arm.
pub(super) struct Model {
    pub(super) name: String,
    pub(super) modal: bool,
    pub(super) elastic_coordinates: usize,
    /// Errors of the translation and of the rotation of the tip under gravity.
    pub(super) sag_errors: [f64; 2],
    /// Relative differences of the frequencies, one per frequency of the truth.
    pub(super) hz_errors: Vec<f64>,
}

/// The arm from meshes, compared with NGSolve and CalculiX on the mesh of the whole arm.
pub(super) struct Meshes {
    /// The truth.
    pub(super) ngsolve: WholeMesh,
    pub(super) calculix: WholeMesh,
    pub(super) methods: Vec<Method>,
    /// Condition number of the tube's stiffness matrix in its link file.
    pub(super) tube_condition: f64,
    /// Relative change of the tube's compliance with CalculiX's integration rule; `None` in a quick
    /// run.
    pub(super) tube_rule_error: Option<f64>,
    pub(super) calculix_sag_errors: [f64; 2],
    pub(super) calculix_hz_errors: Vec<f64>,
    pub(super) models: Vec<Model>,
    /// Share of the ball in the kinetic energy of each mode, modal links with all modes.
    pub(super) ball_shares: Vec<f64>,
    /// Share of each mode's strain energy in shapes with held ends, same links.
    pub(super) held_shares: Vec<f64>,
}

impl Meshes {
    pub(super) fn new(bench: &Bench, robot: &Robot) -> Result<Self, Error> {
        let calculix = WholeMesh::read(&bench.stored("three_beams_calculix.json")?)?;
        let ngsolve = WholeMesh::read(&bench.stored("three_beams_ngsolve.json")?)?;
        let others = [in_parts(5), in_modes(0), in_modes(ALL_MODES)];
        let methods = by_every_method(robot, None, &small_loads(&ngsolve.C_tip), SETTLING_STEP_S, &others)?;
        // This assembles two more meshes.
        let tube_rule_error = if bench.quick { None } else { Some(tube_rule_error(bench, robot)?) };
        let lumped = [2, 3, 5].map(|n| (in_parts(n), false));
        let modal = [0, 5, ALL_MODES].map(|n| (in_modes(n), true));
        let models = lumped.into_iter().chain(modal).map(|((name, modelling), modal)| {
            let u = weight_response(robot, &modelling, None, &Vector3::new(0.0, 0.0, -G))?;
            let rig = Rig::new(&weightless(robot.clone()), &modelling, None)?;
            Ok(Model {
                name,
                modal,
                elastic_coordinates: rig.arm.model.n_elastic(),
                sag_errors: ngsolve.sag_errors(&u),
                hz_errors: ngsolve.hz_errors(&rig.arm.modes.frequencies_hz()),
            })
        });
        let models = models.collect::<Result<_, Error>>()?;
        let all_modes: Modelling = in_modes(ALL_MODES).1;
        let rig = Rig::new(&weightless(robot.clone()), &all_modes, None)?;
        let condition = robot.flexible_links[super::beams::TUBE].flexible.reduced.details.as_ref();
        let condition = condition.and_then(|details| details.gate.as_ref()).map(|gate| gate.condition);
        Ok(Self {
            tube_condition: condition.unwrap_or(f64::NAN),
            tube_rule_error,
            calculix_sag_errors: ngsolve.sag_errors(&calculix.sag),
            calculix_hz_errors: ngsolve.hz_errors(&calculix.hz),
            models,
            ball_shares: ball_shares(&rig, ngsolve.hz.len()),
            held_shares: held_shares(&rig, ngsolve.hz.len()),
            ngsolve,
            calculix,
            methods,
        })
    }

    /// Returns the model of this name.
    pub(super) fn model(&self, name: &str) -> Option<&Model> {
        self.models.iter().find(|model| model.name == name)
    }

    /// Error of the translation under gravity of the named model; NaN if there is none.
    pub(super) fn shift_error(&self, name: &str) -> f64 {
        self.model(name).map_or(f64::NAN, |model| model.sag_errors[0])
    }

    /// Maximum error of the first `count` frequencies of the named model.
    pub(super) fn worst_hz_error(&self, name: &str, count: usize) -> f64 {
        self.model(name).map_or(f64::NAN, |model| model.hz_errors.iter().take(count).copied().worst())
    }

    /// Maximum sag error of modal links.
    pub(super) fn modal_sag_error(&self) -> f64 {
        let modal = self.models.iter().filter(|model| model.modal);
        modal.map(|model| model.sag_errors.into_iter().worst()).fold(0.0, larger)
    }
}

/// Relative difference of the tube's compliance with CalculiX's integration rule from the exact
/// one.
fn tube_rule_error(bench: &Bench, robot: &Robot) -> Result<f64, Error> {
    let by_rule = |quadrature: Quadrature| -> Result<Matrix6<f64>, Error> {
        let tube = Meshed::read_with(bench, TUBE_MESH, UnitSystem::SI, Material::ALUMINIUM, quadrature)?;
        let p_B = robot.flexible_links[super::beams::TUBE].flexible.reduced.X_LB.translation.vector;
        tube.condensed([Tie::Rigid; 2], Vector3::zeros(), p_B)?.compliance()
    };
    Ok(compliance_error(&by_rule(Quadrature::Calculix)?, &by_rule(Quadrature::Exact)?))
}

/// Share of the ball in the kinetic energy of each mode, without its rotation.
fn ball_shares(rig: &Rig, count: usize) -> Vec<f64> {
    const SMALL: f64 = 1e-6;
    let shift = |k: usize| {
        let e = rig.arm.modes.shapes.column(k) * SMALL;
        (place(&rig.arm, &rig.frame, &e).translation.vector - rig.X_WF.translation.vector) / SMALL
    };
    // Mode shapes have unit modal mass.
    (0..count).map(|k| BALL_KG * shift(k).norm_squared()).collect()
}

/// Share of the strain energy of each mode in the coordinates after the six end coordinates of each
/// modal link.
fn held_shares(rig: &Rig, count: usize) -> Vec<f64> {
    let K = rig.arm.stiffness();
    let share = |k: usize| {
        let e = rig.arm.modes.shapes.column(k).into_owned();
        let mut inner = e.clone();
        for element in &rig.arm.elements {
            inner.rows_mut(rig.arm.offset(element), 6).fill(0.0);
        }
        inner.dot(&(&K * &inner)) / e.dot(&(&K * &e))
    };
    (0..count).map(share).collect()
}
