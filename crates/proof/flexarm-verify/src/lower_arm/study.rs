//! Loads, weight, frequencies and ties of the casting.
//!
//! Six-vectors are those of interface B with A held, axes of the link, z from A towards B. Not
//! here: results of the mesh and of other programs (`truth.rs`).

use flexarm::{Modelling, Robot};
use flexarm_fem::reduction::Tie;
use nalgebra::{Matrix6, Vector3, Vector6};

use super::truth::{MODES, Program, Truth};
use super::{ALL_MODES, B, CHAINS, G};
use crate::Error;
use crate::bench::{
    Rig, Worst, compliance_error, in_modes, in_parts, larger, shift_and_turn_errors, small_loads, weight_response,
    weightless,
};
use crate::compliance::{Method, by_every_method};
use crate::meshed::{Meshed, inverse};

/// Step size of the runs until rest (s).
const SETTLING_STEP_S: f64 = 5e-4;
/// Fraction of the usual load that is applied along the casting.
pub(super) const AXIAL_PART: f64 = 0.1;
/// Index of F_z in lists of loads.
const F_Z: usize = 2;

/// Six loads at B: other programs and every method compared with the mesh.
pub(super) struct FlangeLoads {
    /// Compliance (m/N, rad/(N m), ...).
    pub(super) truth: Matrix6<f64>,
    pub(super) programs: Vec<Method>,
    pub(super) link_file: Method,
    pub(super) methods: Vec<Method>,
}

impl FlangeLoads {
    pub(super) fn new(robot: &Robot, truth: &Truth, programs: &[Program; 2]) -> Result<Self, Error> {
        let filed = inverse(&robot.flexible_links[0].flexible.reduced.K_BB);
        let mut loads = small_loads(&truth.C);
        loads[F_Z] *= AXIAL_PART;
        let chains = CHAINS.map(in_parts);
        let others: Vec<(String, Modelling)> = chains.into_iter().chain([0, ALL_MODES].map(in_modes)).collect();
        let program = |program: &Program| Method { name: program.name.into(), C: program.truth.C };
        Ok(Self {
            truth: truth.C,
            programs: programs.iter().map(program).collect(),
            link_file: Method {
                name: "link file".into(),
                C: filed.ok_or_else(|| Error::Case("K_BB of the link file is singular".into()))?,
            },
            methods: by_every_method(robot, B, &loads, SETTLING_STEP_S, &others)?,
        })
    }
}

/// A model of the link.
pub(super) struct Model {
    pub(super) name: String,
    /// Number of parts, if lumped.
    pub(super) parts: Option<usize>,
    modelling: Modelling,
}

/// Models of the link, lumped ones first.
fn models() -> Vec<Model> {
    let lumped = [2, CHAINS[0], CHAINS[1], CHAINS[2]].map(|n| (in_parts(n), Some(n)));
    let modal = [0, 5, ALL_MODES].map(|m| (in_modes(m), None));
    let all = lumped.into_iter().chain(modal);
    all.map(|((name, modelling), parts)| Model { name, parts, modelling }).collect()
}

/// Relative errors of the translation and of the rotation of B under gravity along x, y, z, each as
/// a vector norm.
pub(super) type SagErrors = [[f64; 2]; 3];

/// Own weight in three directions.
pub(super) struct Weight {
    /// Magnitudes of the translation (m) and of the rotation (rad) under gravity along x, y, z.
    pub(super) sizes: [[f64; 2]; 3],
    pub(super) programs: Vec<(&'static str, SagErrors)>,
    pub(super) models: Vec<(Model, SagErrors)>,
}

impl Weight {
    pub(super) fn new(robot: &Robot, truth: &Truth, programs: &[Program; 2]) -> Result<Self, Error> {
        let errors = |sag: &[Vector6<f64>; 3]| [0, 1, 2].map(|k| shift_and_turn_errors(&sag[k], &truth.sag[k]));
        let models = models().into_iter().map(|model| {
            let sag = [Vector3::x(), Vector3::y(), Vector3::z()]
                .map(|axis| weight_response(robot, &model.modelling, B, &(G * axis)));
            let [x, y, z] = sag;
            Ok((model, errors(&[x?, y?, z?])))
        });
        Ok(Self {
            sizes: truth.sag.map(|u| [0, 3].map(|from| u.fixed_rows::<3>(from).norm())),
            programs: programs.iter().map(|program| (program.name, errors(&program.truth.sag))).collect(),
            models: models.collect::<Result<_, Error>>()?,
        })
    }

    /// Maximum error of the other programs.
    pub(super) fn worst_program(&self) -> f64 {
        self.programs.iter().map(|(_, errors)| worst_sag(errors)).fold(0.0, larger)
    }

    /// Maximum error of modal links.
    pub(super) fn worst_modal(&self) -> f64 {
        let modal = self.models.iter().filter(|(model, _)| model.parts.is_none());
        modal.map(|(_, errors)| worst_sag(errors)).fold(0.0, larger)
    }

    /// Errors of the translation with `parts` parts under transverse gravity (the larger of x and
    /// y) and along z.
    pub(super) fn across_and_along(&self, parts: usize) -> [f64; 2] {
        let found = self.models.iter().find(|(model, _)| model.parts == Some(parts));
        found.map_or([f64::NAN; 2], |(_, [x, y, z])| [larger(x[0], y[0]), z[0]])
    }
}

fn worst_sag(errors: &SagErrors) -> f64 {
    errors.iter().flatten().copied().worst()
}

/// Frequencies with A held.
pub(super) struct Frequencies {
    pub(super) hz: Vec<f64>,
    pub(super) programs: Vec<(&'static str, Vec<f64>)>,
    /// Relative differences and number of elastic coordinates.
    pub(super) models: Vec<(Model, Vec<f64>, usize)>,
}

impl Frequencies {
    pub(super) fn new(robot: &Robot, truth: &Truth, programs: &[Program; 2]) -> Result<Self, Error> {
        let models = models().into_iter().map(|model| {
            let rig = Rig::new(&weightless(robot.clone()), &model.modelling, B)?;
            let errors = truth.hz_errors(&rig.plant.modes.frequencies_hz());
            Ok((model, errors, rig.plant.model.n_elastic()))
        });
        Ok(Self {
            hz: truth.hz.clone(),
            programs: programs.iter().map(|p| (p.name, truth.hz_errors(&p.truth.hz))).collect(),
            models: models.collect::<Result<_, Error>>()?,
        })
    }
}

/// Number of frequencies by which ties are compared.
pub(super) const TIED_MODES: usize = 3;

/// Seats with one pair of ties, relative to rigid ties, minus one.
pub(super) struct Tied {
    pub(super) ties: [Tie; 2],
    /// Diagonal of the compliance.
    pub(super) compliance: [f64; 6],
    pub(super) hz: Vec<f64>,
}

/// Rigid ties compared with distributing ones.
pub(super) struct Ties {
    pub(super) pairs: Vec<Tied>,
    /// Name of another program and its difference, with distributing ties at both seats.
    pub(super) programs: Vec<(&'static str, f64)>,
}

impl Ties {
    pub(super) fn new(
        mesh: &Meshed,
        [p_A, p_B]: [Vector3<f64>; 2],
        truth: &Truth,
        programs: &[Program; 2],
    ) -> Result<Self, Error> {
        let (mut pairs, mut judged) = (Vec::new(), Vec::new());
        for ties in [[Tie::Distributing, Tie::Rigid], [Tie::Rigid, Tie::Distributing], [Tie::Distributing; 2]] {
            let condensed = mesh.condensed(ties, p_A, p_B)?;
            let C = condensed.compliance()?;
            let hz = truth.hz_errors(&condensed.held_hz(TIED_MODES)?);
            pairs.push(Tied { ties, compliance: std::array::from_fn(|j| C[(j, j)] / truth.C[(j, j)] - 1.0), hz });
            if ties == [Tie::Distributing; 2] {
                judged = programs.iter().map(|p| (p.name, compliance_error(&p.C_distributing, &C))).collect();
            }
        }
        Ok(Self { pairs, programs: judged })
    }

    /// Minimum increase of the diagonal of the compliance by distributing ties at both seats.
    pub(super) fn softest(&self) -> f64 {
        let both = self.pairs.iter().filter(|tied| tied.ties == [Tie::Distributing; 2]);
        both.flat_map(|tied| tied.compliance).fold(f64::INFINITY, f64::min)
    }
}

/// Maximum of the first `count` errors, at most [`MODES`].
pub(super) fn worst_of(errors: &[f64], count: usize) -> f64 {
    errors.iter().take(count.min(MODES)).copied().worst()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weight() -> Weight {
        let errors: [SagErrors; 2] = [[[0.1, 0.2], [0.3, 0.0], [0.6, 0.0]], [[1e-9, 0.0], [0.0, 2e-9], [0.0, 0.0]]];
        let mut models = models();
        let (modal, two) = (models.remove(5), models.remove(0));
        Weight {
            sizes: [[1.0; 2]; 3],
            programs: vec![("a", errors[1])],
            models: vec![(two, errors[0]), (modal, errors[1])],
        }
    }

    /// The maximum error of modal links does not include that of two parts; a number of parts
    /// without a model gives NaN.
    #[test]
    fn errors_under_weight_are_those_of_their_models() {
        let weight = weight();
        assert_eq!(weight.worst_modal(), 2e-9);
        assert_eq!(weight.worst_program(), 2e-9);
        assert_eq!(weight.across_and_along(2), [0.3, 0.6]);
        assert!(weight.across_and_along(8).iter().all(|e| e.is_nan()));
    }

    #[test]
    fn models_are_named_by_what_they_are() {
        let names: Vec<String> = models().into_iter().map(|model| model.name).collect();
        assert_eq!(names[..4], ["2 parts", "3 parts", "4 parts", "8 parts"]);
        assert_eq!(names[4..], ["modal, 0 modes", "modal, 5 modes", "modal, 10 modes"]);
    }
}
