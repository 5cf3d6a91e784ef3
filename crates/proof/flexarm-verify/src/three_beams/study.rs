//! Loads at the tip, and the same arm from meshes: results of every method and of two other
//! programs.

use flexarm::Robot;
use nalgebra::{Matrix6, Vector3, Vector6};

use super::G;
use super::beams::{members, tip_compliance};
use crate::Error;
use crate::bench::{
    Bench, Rig, Stored, Worst, in_modes, in_parts, larger, shift_and_turn_errors, small_loads, weight_response,
    weightless,
};
use crate::compliance::{Method, by_every_method};

/// Step size of the runs until rest (s).
const SETTLING_STEP_S: f64 = 2e-3;
/// Number of modes of the links, all that the files have.
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
    pub(super) calculix_sag_errors: [f64; 2],
    pub(super) calculix_hz_errors: Vec<f64>,
    pub(super) models: Vec<Model>,
}

impl Meshes {
    pub(super) fn new(bench: &Bench, robot: &Robot) -> Result<Self, Error> {
        let calculix = WholeMesh::read(&bench.stored("three_beams_calculix.json")?)?;
        let ngsolve = WholeMesh::read(&bench.stored("three_beams_ngsolve.json")?)?;
        let others = [in_parts(5), in_modes(0), in_modes(ALL_MODES)];
        let methods = by_every_method(robot, None, &small_loads(&ngsolve.C_tip), SETTLING_STEP_S, &others)?;
        let lumped = [2, 3, 5].map(|n| (in_parts(n), false));
        let modal = [0, 5, ALL_MODES].map(|n| (in_modes(n), true));
        let models = lumped.into_iter().chain(modal).map(|((name, modelling), modal)| {
            let u = weight_response(robot, &modelling, None, &Vector3::new(0.0, 0.0, -G))?;
            let rig = Rig::new(&weightless(robot.clone()), &modelling, None)?;
            Ok(Model {
                name,
                modal,
                elastic_coordinates: rig.plant.model.n_elastic(),
                sag_errors: ngsolve.sag_errors(&u),
                hz_errors: ngsolve.hz_errors(&rig.plant.modes.frequencies_hz()),
            })
        });
        let models = models.collect::<Result<_, Error>>()?;
        Ok(Self {
            calculix_sag_errors: ngsolve.sag_errors(&calculix.sag),
            calculix_hz_errors: ngsolve.hz_errors(&calculix.hz),
            models,
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
